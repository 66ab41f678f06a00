// What a daemon keeps in memory, whatever is asked of it: documents that make much of their bytes.
#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/server/daemon.h"

namespace retake {
namespace {

using nlohmann::json;
using test::Answer;
using test::Daemon;
using test::TemporaryFolder;
using test::wait_until;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryIsItsOwn = false;  // a sanitizer's counts among it
#else
constexpr bool kMemoryIsItsOwn = true;
#endif
constexpr double kMostAboveIdle = 64;      // [MB]
constexpr double kMostKept = 10;           // [MB]
constexpr double kMostOfAnimations = 120;  // [MB] a single one of the largest box has 90
constexpr std::size_t kBodyBytes = 1'040'000;

/// [MB] of a process.
double resident(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string word; status >> word;)
    if (word == "VmRSS:") {
      double kilobytes = 0;
      status >> kilobytes;
      return kilobytes / 1024;
    }
  return 0;
}

/// Looks at a process's memory for as long as it lives.
class MemoryWatch {
 public:
  explicit MemoryWatch(pid_t process)
      : process_(process), before_(resident(process)), thread_([this] { look(); }) {}
  ~MemoryWatch() { stop(); }
  double most_above() const { return most_ - before_; }
  double above_now() const { return resident(process_) - before_; }
  void stop() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  void look() {
    while (!is_over_) {
      most_ = std::max<double>(most_, resident(process_));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  const pid_t process_;
  const double before_;
  std::atomic<double> most_ = 0;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

std::string filled(std::string begin, const std::function<std::string(int)>& piece, const std::string& end) {
  for (int i = 0; begin.size() < kBodyBytes; ++i)
    begin += (i > 0 ? "," : "") + piece(i);
  return begin + end;
}

/// Bodies of about a mebibyte of which much could be made, by what they are made of.
std::vector<std::pair<std::string, std::string>> costly_bodies() {
  const auto field = [](int i) { return "\"f" + std::to_string(i) + "\":0"; };
  const auto text = [](const std::string& same) { return [same](int) { return same; }; };
  const std::string begin = R"({"world":"ball2d","constraints":[)";
  std::string few_fields = R"({"world":"ball2d","constraints":[],)";
  for (int i = 0; i < 9'000; ++i)
    few_fields += field(i) + ",";
  return {
      {"unknown fields", filled(R"({"world":"ball2d","constraints":[],)", field, "}")},
      {"as many unknown fields as are read", few_fields + R"("title":")" + std::string(900'000, 'x') + "\"}"},
      {"unknown fields of the model", filled(R"({"world":"ball2d","constraints":[],"model":{)", field, "}}")},
      {"numbers", filled(begin, text("0"), "]}")},
      {"empty lists", filled(begin, text("[]"), "]}")},
      {"empty objects", filled(begin, text("{}"), "]}")},
      {"short texts", filled(begin, text("\"aaaaaaaaaaaaaaaa\""), "]}")},
      {"terms", filled(begin, text(R"({"kind":"rest_position","x":1})"), "]}")},
      {"long texts", filled(begin, text("\"" + std::string(4000, 'x') + "\""), "]}")},
      {"a long text",
       R"({"world":"ball2d","constraints":[],"title":")" + std::string(1'000'000, 'x') + "\"}"},
      {"a long key", R"({"world":"ball2d","constraints":[],")" + std::string(1'000'000, 'x') + "\":0}"},
      {"many levels", std::string(kBodyBytes, '[')}};
}

/// Sends a body sixteen times at once. Returns how often each status came, 0 for no answer.
std::map<int, int> burst(const Daemon& daemon, const std::string& path, const std::string& body) {
  std::map<int, int> statuses;
  std::mutex mutex;
  std::vector<std::thread> clients;
  for (int client = 0; client < 16; ++client)
    clients.emplace_back([&] {
      const Answer answer = daemon.ask("POST", path, body);
      const std::lock_guard lock(mutex);
      ++statuses[answer.status];
      EXPECT_LT(answer.body.size(), 40'000u) << "an answer grows with its request";
      EXPECT_TRUE(json::accept(answer.body)) << answer.body;
    });
  for (std::thread& client : clients)
    client.join();
  return statuses;
}

TEST(DaemonMemory, Bursts_of_large_documents_are_refused_in_bounded_memory_that_comes_back) {
  const TemporaryFolder folder;
  Daemon daemon(folder.path());
  const std::string scenario = daemon.add_scenario(test::prior_document());
  daemon.get("/v1/worlds");
  MemoryWatch watch(daemon.process().pid());
  for (const auto& [what, body] : costly_bodies())
    for (const std::string& path : {std::string("/v1/scenarios"), "/v1/scenarios/" + scenario + "/chains",
                                    "/v1/scenarios/" + scenario + "/plays"}) {
      for (const auto& [status, count] : burst(daemon, path, body))
        EXPECT_TRUE(status == 422 || status == 503) << what << " to " << path << ": " << status;
      EXPECT_EQ(daemon.get("/healthz").status, 200);
    }
  if (!kMemoryIsItsOwn) return;
  EXPECT_LT(watch.most_above(), kMostAboveIdle);
  EXPECT_TRUE(wait_until([&] { return watch.above_now() < kMostKept; }, 20))
      << watch.above_now() << " MB stay";
  std::printf("             %.1f MB above idle at most, %.1f afterwards\n", watch.most_above(),
              watch.above_now());
}

TEST(DaemonMemory, Large_animations_are_sent_in_turn_and_their_memory_comes_back) {
  const TemporaryFolder folder;
  std::string path;
  {
    const Daemon daemon(folder.path());
    const std::string scenario =
        daemon.add_stocked_scenario({{"world", "spelling"},
                                     {"model", {{"columns", 40}, {"rows", 12}, {"balls", 480}}},
                                     {"constraints", json::array()}},
                                    1);
    path = "/v1/samples/" + daemon.samples(scenario).at(0)["id"].get<std::string>() + "/keyframes";
  }
  Daemon daemon(folder.path());
  const std::string whole = daemon.get(path).body;
  EXPECT_TRUE(json::accept(whole));
  EXPECT_GT(whole.size(), 20u << 20);
  {
    // The store's connections fill their caches once.
    std::vector<std::jthread> first;
    for (int client = 0; client < 12; ++client)
      first.emplace_back([&] { daemon.get(path); });
  }
  MemoryWatch watch(daemon.process().pid());
  std::atomic<int> sent = 0;
  std::vector<std::thread> clients;
  for (int client = 0; client < 24; ++client)
    clients.emplace_back([&] {
      const Answer answer = daemon.get(path);
      EXPECT_TRUE(answer.status == 200 || answer.status == 503) << answer.status;
      if (answer.status != 200) return;
      ++sent;
      EXPECT_TRUE(answer.body == whole) << "what is sent is whole";
    });
  EXPECT_EQ(daemon.get("/healthz").status, 200);
  for (std::thread& client : clients)
    client.join();
  EXPECT_GE(sent, 1);
  const Answer too_large = daemon.get(path + "?rate=240");
  EXPECT_EQ(too_large.status, 422);
  EXPECT_EQ(too_large.json()["type"], "/problems/document-too-large");
  const std::string detail = too_large.json()["detail"];
  const int rate = std::stoi(detail.substr(detail.rfind(' ')));
  EXPECT_GT(rate, 60);
  EXPECT_EQ(daemon.ask("HEAD", path + "?rate=" + std::to_string(rate)).status, 200) << detail;
  EXPECT_EQ(daemon.ask("HEAD", path + "?rate=" + std::to_string(rate + 1)).status, 422) << detail;
  if (!kMemoryIsItsOwn) return;
  EXPECT_LT(watch.most_above(), kMostOfAnimations);
  EXPECT_TRUE(wait_until([&] { return watch.above_now() < kMostKept; }, 20))
      << watch.above_now() << " MB stay";
  std::printf("             %.1f MB above idle at most, %.1f afterwards\n", watch.most_above(),
              watch.above_now());
}

TEST(DaemonMemory, With_little_memory_such_bursts_are_refused_and_nobody_dies) {
  if (!kMemoryIsItsOwn) return;
  const TemporaryFolder folder;
  Daemon daemon(folder.path(), {.most_address_space = 800u << 20});
  const std::string scenario = daemon.add_scenario(test::prior_document());
  for (const auto& [what, body] : costly_bodies()) {
    for (const auto& [status, count] : burst(daemon, "/v1/scenarios", body))
      EXPECT_TRUE(status == 413 || status == 422 || status == 503) << what << ": " << status;
    EXPECT_EQ(daemon.get("/v1/scenarios/" + scenario).status, 200) << what;
  }
  EXPECT_EQ(daemon.terminate(), 0);
}

TEST(DaemonMemory, Of_many_faults_the_first_hundred_are_listed_and_the_rest_counted) {
  const TemporaryFolder folder;
  const Daemon daemon(folder.path());
  json document = test::prior_document();
  for (int i = 0; i < 1234; ++i)
    document["field" + std::to_string(i)] = i;
  const Answer answer = daemon.post("/v1/scenarios", document);
  EXPECT_EQ(answer.status, 422);
  EXPECT_EQ(answer.json()["errors"].size(), 100);
  EXPECT_NE(answer.json()["detail"].get<std::string>().find("and 1,134 more"), std::string::npos)
      << answer.body;
  for (int i = 100; i < 1234; ++i)
    document.erase("field" + std::to_string(i));
  EXPECT_EQ(daemon.post("/v1/scenarios", document).json()["detail"],
            "The request says something that is not possible.");
}

}  // namespace
}  // namespace retake
