// Daemon: the real `retake serve` as a child process, and a client that asks it. What the tests of the API,
// the determinism and the command line tests stand on. It must not know httplib.h.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/server/child_process.h"
#include "tests/server/raw_client.h"

namespace retake::test {

using nlohmann::json;

/// Scenario documents of the tests.
inline json prior_document(const std::string& title = "Anything") {
  return {{"world", "ball2d"}, {"title", title}, {"model", json::object()}, {"constraints", json::array()}};
}
inline json wish_document(double x, double width, const std::string& title = "Rest there") {
  json document = prior_document(title);
  document["constraints"] = {{{"kind", "rest_position"}, {"x", x}, {"sd", width}, {"tolerance", width}}};
  return document;
}

/// What chance does not find while a test looks.
inline json vain_document() {
  json document = wish_document(1, 1e-6, "In vain");
  document["constraints"][0]["tolerance"] = 1e-12;
  return document;
}

/// The elements of an array that may be part of a temporary.
inline std::vector<json> elements(const json& array) {
  return array.get<std::vector<json>>();
}

struct Answer : RawResponse {
  nlohmann::json json() const { return nlohmann::json::parse(body); }
};

using Fields = std::map<std::string, std::string>;

class Daemon {
 public:
  struct Options {
    std::vector<std::string> flags{"--no-examples", "--threads", "2"};
    std::vector<std::string> before_command{};
    Fields environment{};
    rlim_t most_file_bytes = RLIM_INFINITY;
    rlim_t most_address_space = RLIM_INFINITY;
    rlim_t most_descriptors = RLIM_INFINITY;
    std::string store = "retake.db";
  };

  /// Starts on the store in `folder` and waits until it listens.
  explicit Daemon(const std::filesystem::path& folder) : Daemon(folder, Options{}) {}
  Daemon(const std::filesystem::path& folder, const Options& options) {
    std::vector<std::string> arguments = options.before_command;
    for (const char* text : {"serve", "--listen", "127.0.0.1:0", "--store"})
      arguments.push_back(text);
    arguments.push_back((folder / options.store).string());
    arguments.insert(arguments.end(), options.flags.begin(), options.flags.end());
    process_ = std::make_unique<ChildProcess>(
        folder, ChildProcess::Start{.arguments = arguments,
                                    .environment = options.environment,
                                    .most_file_bytes = options.most_file_bytes,
                                    .most_address_space = options.most_address_space,
                                    .most_descriptors = options.most_descriptors});
    wait_until([this] { return process_->has_ended() || find_port(); });
    if (port_ == 0) throw std::runtime_error("the daemon did not start: " + process_->err());
  }

  int port() const { return port_; }
  ChildProcess& process() { return *process_; }
  /// As an operator ends it. Returns the exit code.
  int terminate() {
    process_->signal_with(SIGTERM);
    return process_->wait();
  }
  void kill() { process_->kill(); }

  /// Asks on a connection of its own. `body` without a value: none is sent.
  Answer ask(const std::string& method, const std::string& target,
             const std::optional<std::string>& body = {}, const Fields& fields = {}) const {
    Fields sent = {{"Host", "127.0.0.1:" + std::to_string(port_)}, {"Connection", "close"}};
    if (body) {
      sent["Content-Type"] = "application/json";
      sent["Content-Length"] = std::to_string(body->size());
    }
    for (const auto& [name, value] : fields)
      sent[name] = value;
    std::string text = method + " " + target + " HTTP/1.1\r\n";
    for (const auto& [name, value] : sent)
      text += name + ": " + value + "\r\n";
    RawClient client(port_);
    client.send(text + "\r\n" + body.value_or(""), 60);
    return Answer{client.read(60, method != "HEAD")};
  }
  Answer get(const std::string& target, const Fields& fields = {}) const {
    return ask("GET", target, {}, fields);
  }
  Answer post(const std::string& target, const json& body = json::object(), const Fields& fields = {}) const {
    return ask("POST", target, body.dump(), fields);
  }
  Answer remove(const std::string& target) const { return ask("DELETE", target); }

  // --- Steps that many tests begin with --------------------------------------------------------

  std::string add_scenario(const json& document) const {
    const Answer answer = post("/v1/scenarios", document);
    if (answer.status != 201 && answer.status != 200) throw std::runtime_error(answer.body);
    return answer.json().at("id");
  }
  std::vector<std::string> add_chains(const std::string& scenario, const json& request) const {
    const Answer answer = post("/v1/scenarios/" + scenario + "/chains", request);
    if (answer.status != 201) throw std::runtime_error(answer.body);
    std::vector<std::string> ids;
    for (const json& chain : elements(answer.json().at("chains")))
      ids.push_back(chain.at("id"));
    return ids;
  }
  json chain(const std::string& id) const { return get("/v1/chains/" + id).json(); }
  /// The chain once it has ended; as it is then if that takes too long.
  json wait_for_end(const std::string& id, double seconds = 240) const {
    json now;
    wait_until(
        [&] {
          now = chain(id);
          return now.at("state") == "finished" || now.at("state") == "failed";
        },
        seconds);
    return now;
  }
  /// A scenario that holds the samples of one finished chain.
  std::string add_stocked_scenario(const json& document, int samples, const json& seed = 1) const {
    const std::string scenario = add_scenario(document);
    const auto chains = add_chains(scenario, {{"seed", seed}, {"stop", {{"samples", samples}}}});
    EXPECT_EQ(wait_for_end(chains.at(0)).at("state"), "finished");
    return scenario;
  }
  /// Every sample of a scenario, page by page.
  std::vector<json> samples(const std::string& scenario, const std::string& order = "oldest",
                            int limit = 500) const {
    std::vector<json> all;
    std::string cursor;
    do {
      const Answer answer =
          get("/v1/scenarios/" + scenario + "/samples?order=" + order + "&limit=" + std::to_string(limit) +
              (cursor.empty() ? "" : "&cursor=" + cursor));
      if (answer.status != 200) throw std::runtime_error(answer.body);
      const json page = answer.json();
      for (const json& sample : page.at("samples"))
        all.push_back(sample);
      EXPECT_LE(page.at("samples").size(), static_cast<std::size_t>(limit));
      cursor = page.value("next_cursor", "");
    } while (!cursor.empty());
    return all;
  }

 private:
  bool find_port() {
    const std::string text = process_->out();
    const std::string before = "Retake is at http://127.0.0.1:";
    const std::size_t place = text.find(before);
    if (place == std::string::npos || text.find("/\n", place + before.size()) == std::string::npos)
      return false;
    port_ = std::stoi(text.substr(place + before.size()));
    return true;
  }

  std::unique_ptr<ChildProcess> process_;
  int port_ = 0;
};

/// A test with a daemon on an empty store.
class DaemonTest : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  Daemon daemon{folder.path()};
};

}  // namespace retake::test
