// `retake serve`: puts the daemon's parts together and takes them apart again.
#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <malloc.h>
#include <pthread.h>
#include <string_view>
#include <sys/resource.h>
#include <thread>

#include "db/open_store.h"
#include "server/api/api.h"
#include "server/commands/command_line.h"
#include "server/http/guard.h"

namespace retake {
namespace {

constexpr std::uint64_t kExampleEss = 100;  // a chain; chosen: fills some pages of the gallery
constexpr double kExampleSeconds = 60;      // [s] of running, a chain; rare wishes get that far

struct Address {
  std::string host;
  int port;
};

/// "127.0.0.1:8080" or "[::1]:8080".
Address read_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0)
    throw ConfigurationError("--listen wants ADDRESS:PORT, got " + text);
  std::string host = text.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string port = text.substr(colon + 1);
  const bool digits = !port.empty() && port.size() <= 5 &&
                      std::all_of(port.begin(), port.end(),
                                  [](char character) { return character >= '0' && character <= '9'; });
  if (!digits || std::stoi(port) > 65535)
    throw ConfigurationError("--listen wants a port from 0 to 65535, got " + port);
  return {std::move(host), std::stoi(port)};
}

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

std::string read_token(const ServeOptions& options) {
  if (options.token_file.empty()) return options.token;
  std::ifstream file(options.token_file);
  std::string token;
  if (!std::getline(file, token) || token.empty())
    throw ConfigurationError("--token-file " + options.token_file + " holds no token");
  return token;
}

HttpSettings http_settings(const ServeOptions& options) {
  const Address address = read_address(options.listen);
  HttpSettings settings;
  settings.address = address.host;
  settings.port = address.port;
  settings.token = read_token(options);
  for (const std::string_view host : split(options.allow_hosts, ','))
    settings.allowed_hosts.emplace_back(host);
  for (const std::string_view origin : split(options.allow_origins, ','))
    settings.allowed_origins.emplace_back(origin);
  if (settings.token.empty() && !is_loopback(address.host))
    throw ConfigurationError("--listen " + options.listen +
                             " can be reached from other machines: give a --token");
  try {
    const HttpGuard guard(settings);
  } catch (const std::runtime_error& fault) {
    throw ConfigurationError(fault.what());
  }
  return settings;
}

/// Fills an empty store. Lists show the newest first, so the example that a person should meet first is added
/// last; the chains are started in the order in which the examples are met.
void add_examples(Api& api) try {
  if (!api.store.scenarios(1, "").records.empty()) return;
  std::vector<std::shared_ptr<const Scenario>> examples;
  for (const World* world : worlds())
    for (const nlohmann::json& document : world->examples())
      examples.push_back(Scenario::read(document));
  std::vector<std::string> ids(examples.size());
  for (std::size_t i = examples.size(); i-- > 0;)
    ids[i] = api.store.add_scenario(new_scenario_record(*examples[i])).scenario.id;

  for (std::size_t i = 0; i < examples.size(); ++i) {
    ChainWish wish = default_wish(*examples[i]);
    wish.count = 2;
    wish.stop = {.seconds = kExampleSeconds, .ess = kExampleEss};
    api.starter.start(ids[i], wish, api.limits.most_live_chains);
  }
} catch (const StoreUnavailable& fault) {
  std::fprintf(stderr, "retake: no examples: %s\n", fault.what());
}

/// The signals that end the daemon, blocked in every thread that is made from here on.
sigset_t block_end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is a failed write, not the end
  return signals;
}

/// Takes as many descriptors as the system lets it. Throws: ConfigurationError if those are too few: each
/// connection needs one, served or waiting, and what is left is the store's.
void take_descriptors() {
  constexpr rlim_t kFewest = 400;  // chosen: 48 connections and 256 that wait, the store's and some more
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0) getrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_cur < kFewest)
    throw ConfigurationError("the daemon needs " + std::to_string(kFewest) +
                             " file descriptors and may open " + std::to_string(limit.rlim_cur) +
                             ": raise its limit (ulimit -n)");
}

}  // namespace

Exit serve(const ServeOptions& options) {
  // An arena for every connection thread would keep what a burst of requests left there.
  mallopt(M_ARENA_MAX, static_cast<int>(std::max(4u, std::thread::hardware_concurrency())));
  const HttpSettings settings = http_settings(options);
  take_descriptors();
  const sigset_t signals = block_end_signals();
  const bool fits_cookie =
      std::all_of(settings.token.begin(), settings.token.end(), [](unsigned char character) {
        return std::isalnum(character) ||
               std::string_view("-._~+/=").find(static_cast<char>(character)) != std::string_view::npos;
      });
  if (!fits_cookie) throw ConfigurationError("--token may hold letters, digits and -._~+/= only");

  // The address first: a second daemon by mistake should not touch the store.
  HttpServer server(settings);
  int port = 0;
  try {
    port = server.bind();
  } catch (const std::runtime_error& fault) {
    std::fprintf(stderr, "retake: %s\n", fault.what());
    return Exit::listen_address;
  }

  StoreOptions store_options;
  store_options.tell = [](const std::string& error) {
    std::fprintf(stderr, "retake: %s\n", error.empty() ? "the store can be written again" : error.c_str());
  };
  store_options.on_damage = [](const std::string& damage) {
    std::fprintf(stderr, "retake: %s\n", damage.c_str());
  };
  const auto opened = open_store(options.store, store_options);
  Store& store = *opened;
  ScenarioLibrary library(store);
  EventHub events;
  const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
  Runner runner(store, library, events,
                {.threads = options.threads == 0 ? cores : options.threads,
                 .most_samples_per_scenario = options.limits.most_samples_per_scenario});
  ChainStarter starter(store, runner);
  Pilot pilot(store, library, events);
  DocumentDesk documents;
  Api api{.store = store,
          .scenarios = library,
          .events = events,
          .runner = runner,
          .starter = starter,
          .pilot = pilot,
          .documents = documents,
          .limits = options.limits,
          .server = server};
  add_all_routes(server, api);
  runner.resume_stored();
  if (!options.no_examples) add_examples(api);
  pilot.add_missing();

  const bool is_ipv6 = settings.address.find(':') != std::string::npos;
  std::printf("Retake is at http://%s:%d/\n",
              (is_ipv6 ? "[" + settings.address + "]" : settings.address).c_str(), port);
  std::fflush(stdout);

  // A first signal ends the daemon in good order. The thread waits for one until the process ends.
  std::thread([&server, &events, signals] {
    int signal = 0;
    sigwait(&signals, &signal);
    std::fprintf(stderr, "retake: %s, finishing\n", signal == SIGTERM ? "SIGTERM" : "SIGINT");
    events.close();
    server.stop();
  }).detach();
  server.run();
  pilot.drain();
  runner.drain();
  return Exit::done;
}

}  // namespace retake
