// Every hostile client of doc/http.md's table, against a server in a process of its own whose memory is
// watched, while a healthy client is served.
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <string>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/http/representation.h"
#include "server/http/server.h"
#include "server/http/settings.h"
#include "tests/server/http/test_routes.h"
#include "tests/server/raw_client.h"

namespace retake {
namespace {

using test::get;
using test::post;
using test::RawClient;
using test::RawResponse;
using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMeasuresMemory = false;
#else
constexpr bool kMeasuresMemory = true;
#endif
constexpr long kMostKilobytes = 64 * 1024;
constexpr double kMegabyte = 1 << 20;
constexpr double kServedWithin = 10;  // [s] on a busy machine; the eviction of slow clients takes 5 s

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// [kB] a figure of /proc/<pid>/status such as "VmRSS:".
long memory(pid_t process, const std::string& figure) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string word; status >> word;)
    if (word == figure) {
      long kilobytes = 0;
      status >> kilobytes;
      return kilobytes;
    }
  return 0;
}

/// A server in a child process, forked before this process has threads.
class ServerProcess {
 public:
  explicit ServerProcess(HttpSettings settings = {}) {
    settings.port = 0;
    int ports[2];
    if (pipe(ports) != 0) throw std::runtime_error("no pipe");
    process_ = fork();
    if (process_ == 0) serve(settings, ports[1]);
    close(ports[1]);
    if (::read(ports[0], &port_, sizeof(port_)) != sizeof(port_))
      throw std::runtime_error("the server did not start");
    close(ports[0]);
    for (int i = 0; i < 10; ++i)
      RawClient(port_).ask(get("/healthz"));
    idle_ = memory(process_, "VmRSS:");
  }
  ~ServerProcess() {
    const long grown = memory(process_, "VmHWM:") - idle_;
    kill(process_, SIGTERM);
    int status = 0;
    waitpid(process_, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0)
        << "the server did not survive, status " << status;
    if (kMeasuresMemory) {
      EXPECT_GT(idle_, 0);
      EXPECT_LT(grown, kMostKilobytes);
      testing::Test::RecordProperty("grown_kilobytes", std::to_string(grown));
      std::printf("             memory grew by %.1f MB\n", static_cast<double>(grown) / 1024);
    }
  }
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  int port() const { return port_; }
  /// Seconds that a healthy client waits for an answer on a new connection.
  double answer_seconds() const {
    const auto start = Clock::now();
    EXPECT_EQ(RawClient(port_).ask(get("/healthz"), 20).status, 200) << "a healthy client was not served";
    return seconds_since(start);
  }

 private:
  [[noreturn]] static void serve(const HttpSettings& settings, int port_pipe) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    sigset_t terminate;
    sigemptyset(&terminate);
    sigaddset(&terminate, SIGTERM);
    sigprocmask(SIG_BLOCK, &terminate, nullptr);
    {
      HttpServer server(settings);
      test::add_test_routes(server);
      const int port = server.bind();
      if (write(port_pipe, &port, sizeof(port)) != sizeof(port)) _exit(2);
      std::thread stopper([&] {
        int signal = 0;
        sigwait(&terminate, &signal);
        server.stop();
      });
      server.run();
      stopper.join();
    }
    _exit(0);
  }

  pid_t process_ = 0;
  int port_ = 0;
  long idle_ = 0;
};

/// Sends `piece` again and again until the server cuts or half a gigabyte is gone. Returns the megabytes
/// sent.
double flood(RawClient& client, const std::string& piece) {
  double sent = 0;
  while (sent < 512 * kMegabyte && client.send(piece, 3))
    sent += static_cast<double>(piece.size());
  return sent / kMegabyte;
}

/// Sends one byte a second on all connections until all are cut. Returns the seconds until the last was.
double drip(std::vector<std::unique_ptr<RawClient>>& clients, double most_seconds,
            const ServerProcess& server, double most_answer_seconds) {
  const auto start = Clock::now();
  std::vector<bool> is_cut(clients.size(), false);
  while (seconds_since(start) < most_seconds) {
    bool all_cut = true;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (!is_cut[i]) is_cut[i] = clients[i]->is_closed_within(0.001) || !clients[i]->send("a", 0.1);
      all_cut = all_cut && is_cut[i];
    }
    if (all_cut) return seconds_since(start);
    EXPECT_LT(server.answer_seconds(), most_answer_seconds);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  return seconds_since(start);
}

std::vector<std::unique_ptr<RawClient>> many_clients(int count, int port, const std::string& beginning) {
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < count; ++i) {
    clients.push_back(std::make_unique<RawClient>(port));
    clients.back()->send(beginning);
  }
  return clients;
}

TEST(HttpAttack, EndlessStreamsAreCut) {
  const ServerProcess server;
  struct Case {
    const char* what;
    std::string beginning;
    std::string piece;
    int status;
  };
  const std::string post_head =
      "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n";
  const Case cases[] = {
      {"no line end", "", std::string(65536, 'a'), 414},
      {"one header without end", "GET / HTTP/1.1\r\nX: ", std::string(65536, 'a'), 431},
      {"header lines without end", "GET / HTTP/1.1\r\n", "X-Field: value\r\nY-Field: value\r\n", 431},
      {"empty lines without end", "", "\r\n\r\n\r\n\r\n", 400},
      {"chunks", post_head + "Transfer-Encoding: chunked\r\n\r\n",
       "10000\r\n" + std::string(65536, 'a') + "\r\n", 413},
      {"chunks of a byte with extensions", post_head + "Transfer-Encoding: chunked\r\n\r\n", "1;a=b\r\na\r\n",
       400},
      {"a chunk's size without end", post_head + "Transfer-Encoding: chunked\r\n\r\n",
       std::string(65536, '0'), 400},
      {"trailers without end", post_head + "Transfer-Encoding: chunked\r\n\r\n0\r\n", "X: y\r\n", 400},
      {"more than the length", post_head + "Content-Length: 2\r\n\r\n{}", std::string(65536, 'a'), 201},
      {"a huge length", post_head + "Content-Length: 18446744073709551615\r\n\r\n", std::string(65536, 'a'),
       400},
      {"no length", post_head + "\r\n", std::string(65536, 'a'), 411},
      {"no length that could be a request", post_head + "\r\n", std::string(65536, 'A'), 201},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    RawClient client(server.port());
    client.send(c.beginning);
    const double megabytes = flood(client, c.piece);
    EXPECT_LT(megabytes, 100);
    EXPECT_LT(server.answer_seconds(), kServedWithin);
    RawClient polite(server.port());
    polite.send(c.beginning + c.piece);
    for (int i = 0; i < (c.piece.size() < 1000 ? 2000 : 20); ++i)
      polite.send(c.piece, 0.1);
    EXPECT_EQ(polite.read().status, c.status);
  }
}

TEST(HttpAttack, CostlyRequestsGetSmallAnswers) {
  const ServerProcess server;
  std::string ranges = "Range: bytes=0-1000000";
  for (int i = 0; i < 600; ++i)
    ranges += ",0-1000000";
  const std::string bomb = gzip(std::string(16 << 20, '\0'));
  struct Case {
    const char* what;
    std::string request;
    int status;
  };
  const Case cases[] = {
      {"600 ranges", get("/large", ranges + "\r\n"), 416},
      {"a range of 8 KB", get("/large", "Range: bytes=" + std::string(8000, '1') + "\r\n"), 416},
      {"a path of 8 KB", get("/" + std::string(8000, 'a')), 414},
      {"a path of slashes", get("/" + std::string(500, '/')), 404},
      {"a query of ampersands", get("/echo?" + std::string(2000, '&')), 200},
      {"a packed body", post("/echo", bomb, "Content-Encoding: gzip\r\n"), 415},
      {"a handler that throws", get("/fails/logic"), 500},
      {"a thousand header fields",
       get("/echo",
           [] {
             std::string fields;
             for (int i = 0; i < 1000; ++i)
               fields += "a:\r\n";
             return fields;
           }()),
       431},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    for (int i = 0; i < 3; ++i) {
      const RawResponse response = RawClient(server.port()).ask(c.request);
      EXPECT_EQ(response.status, c.status);
      EXPECT_LT(response.body.size(), 1000u);
      EXPECT_EQ((response.head + response.body).find("secret"), std::string::npos);
    }
    EXPECT_LT(server.answer_seconds(), kServedWithin);
  }
}

TEST(HttpAttack, SlowHeadsAreEvictedAfterFiveSecondsInAll) {
  const ServerProcess server;
  auto clients = many_clients(16, server.port(), "GET /");
  const double seconds = drip(clients, 40, server, kServedWithin);
  EXPECT_GT(seconds, 4);
  EXPECT_LT(seconds, 40);
}

TEST(HttpAttack, MoreSlowHeadsThanThreadsDelayOthersBySecondsOnly) {
  const ServerProcess server;
  auto clients = many_clients(100, server.port(), "GET /");
  EXPECT_LT(drip(clients, 60, server, kServedWithin), 60);
  EXPECT_LT(server.answer_seconds(), kServedWithin);
}

TEST(HttpAttack, SlowBodiesAreEvictedAfterTenSecondsInAll) {
  const ServerProcess server;
  auto clients = many_clients(8, server.port(), post("/echo", std::string(500, 'a')).substr(0, 200));
  for (auto& client : many_clients(8, server.port(), test::chunked("/echo", "fff\r\n")))
    clients.push_back(std::move(client));
  const double seconds = drip(clients, 60, server, kServedWithin);
  EXPECT_GT(seconds, 8);
  EXPECT_LT(seconds, 60);
}

/// Of forty clients that send large bodies at once, half or more are turned away, and some are not.
template <typename Clients>
void expect_half_refused(Clients& clients) {
  int refused = 0;
  EXPECT_TRUE(test::eventually([&] {
    for (auto& client : clients)
      refused += client->read_head(0.001).status == 503;
    return refused >= 20;
  }));
  EXPECT_LT(refused, 40);
}

TEST(HttpAttack, ManyLargeBodiesAtOnceAreRefusedBeforeTheyAreHeld) {
  const ServerProcess server;
  const std::string request = post("/echo", std::string(1 << 20, 'a'));
  auto clients = many_clients(40, server.port(), request.substr(0, request.size() - 10));
  EXPECT_LT(server.answer_seconds(), kServedWithin);
  expect_half_refused(clients);
}

TEST(HttpAttack, ChunkedBodiesAreCountedAsTheyArrive) {
  const ServerProcess server;
  const std::string almost = "fff00\r\n" + std::string(0xfff00, 'a') + "\r\n";
  {
    // Forty that say nothing of their size take no place before there is something of them.
    auto silent = many_clients(40, server.port(), test::chunked("/echo", "fffff\r\n"));
    EXPECT_EQ(RawClient(server.port()).ask(test::chunked("/echo", almost + "0\r\n\r\n")).status, 201);
  }
  auto clients = many_clients(40, server.port(), test::chunked("/echo", almost));
  EXPECT_LT(server.answer_seconds(), kServedWithin);
  expect_half_refused(clients);
}

TEST(HttpAttack, GuessesOfTheTokenHoldNoThreadsAndEndWithOneASecond) {
  HttpSettings settings;
  settings.token = "right";
  const ServerProcess server(settings);
  std::atomic<int> looked_at{0}, put_off{0};
  std::vector<std::thread> guessers;
  const auto start = Clock::now();
  for (int g = 0; g < 8; ++g)
    guessers.emplace_back([&, g] {
      for (int i = 0; i < 500; ++i) {
        const std::string token = std::to_string(g) + "-" + std::to_string(i);
        const int status =
            RawClient(server.port()).ask(get("/echo", "Authorization: Bearer " + token + "\r\n"), 20).status;
        looked_at += status == 401;
        put_off += status == 429;
      }
    });
  EXPECT_LT(server.answer_seconds(), kServedWithin);
  for (std::thread& guesser : guessers)
    guesser.join();
  EXPECT_EQ(looked_at + put_off, 4000);
  EXPECT_LT(looked_at, 40 + seconds_since(start)) << "twenty, eight at once, and one a second";
}

TEST(HttpAttack, BodiesThatAreRefusedTakeNobodysPlace) {
  // As many as may be are on their way, and more and more are refused: who has none is served all the same.
  const ServerProcess server;
  const std::string request = post("/echo", std::string(1 << 20, 'a'));
  const std::string head = request.substr(0, request.find("\r\n\r\n") + 4);
  const auto held = many_clients(16, server.port(), head);
  std::atomic<bool> is_enough = false;
  std::vector<std::thread> refused;
  for (int i = 0; i < 4; ++i)
    refused.emplace_back([&] {
      while (!is_enough)
        RawClient(server.port()).ask(head, 5);
    });
  for (int i = 0; i < 300; ++i)
    EXPECT_LT(server.answer_seconds(), kServedWithin) << i;
  is_enough = true;
  for (std::thread& thread : refused)
    thread.join();
}

TEST(HttpAttack, SilentConnectionsDoNotKeepOthersWaiting) {
  HttpSettings settings;
  const ServerProcess server(settings);
  auto silent = many_clients(200, server.port(), "");
  EXPECT_LT(server.answer_seconds(), kServedWithin);
  auto idle = many_clients(60, server.port(), get("/healthz"));
  for (auto& client : idle)
    client->read(3);
  EXPECT_LT(server.answer_seconds(), kServedWithin);
}

TEST(HttpAttack, MoreConnectionsThanMayWaitAreTurnedAway) {
  HttpSettings settings;
  settings.threads = 4;
  const ServerProcess server(settings);
  auto clients = many_clients(400, server.port(), "GET /");
  int turned_away = 0;
  for (auto& client : clients)
    turned_away += client->is_closed_within(0.002);
  EXPECT_GT(turned_away, 50);
}

TEST(HttpAttack, ReadersThatStallAreCut) {
  HttpSettings settings;
  settings.write_stall_seconds = 1;
  const ServerProcess server(settings);
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(std::make_unique<RawClient>(server.port(), 4096));
    clients.back()->send(get("/large?bytes=6000000"));
  }
  EXPECT_LT(server.answer_seconds(), kServedWithin);
  EXPECT_TRUE(test::eventually([&] {
    const std::string counters = RawClient(server.port()).ask(get("/counters")).body;
    return counters == "{\"open_connections\":1}";
  })) << "readers that stalled still hold their threads";
  for (auto& client : clients)
    EXPECT_LT(client->read(1).body.size(), 6'000'000u);
}

TEST(HttpAttack, StreamsThatNobodyReadsLeaveRoomForOthers) {
  HttpSettings settings;
  settings.write_stall_seconds = 1;
  const ServerProcess server(settings);
  {
    auto streams = many_clients(20, server.port(), get("/events"));
    EXPECT_LT(server.answer_seconds(), kServedWithin);
    int open = 0, refused = 0;
    for (auto& client : streams) {
      const int status = client->read_head().status;
      open += status == 200;
      refused += status == 429;
    }
    EXPECT_EQ(open, 8);
    EXPECT_EQ(refused, 12);
    for (auto& client : streams)
      client->reset();
  }
  EXPECT_TRUE(test::eventually([&] {
    RawClient next(server.port());
    next.send(get("/events"));
    return next.read_head().status == 200;
  })) << "streams of clients that left still count";
}

TEST(HttpAttack, ClientsThatLeaveAtAnyMomentCostNothing) {
  const ServerProcess server;
  const std::string request = post("/echo", "{\"a\":1}") + get("/large") + get("/slow");
  for (std::size_t length = 0; length <= request.size(); length += 3) {
    RawClient polite(server.port()), rude(server.port());
    polite.send(request.substr(0, length));
    rude.send(request.substr(0, length));
    rude.reset();
  }
  EXPECT_LT(server.answer_seconds(), kServedWithin);
}

TEST(HttpAttack, EndlessPipeliningIsAnsweredAtTheReadersPace) {
  HttpSettings settings;
  settings.write_stall_seconds = 1;
  const ServerProcess server(settings);
  RawClient client(server.port());
  std::string requests;
  for (int i = 0; i < 1000; ++i)
    requests += get("/tagged");
  EXPECT_LT(flood(client, requests), 100) << "requests were taken although nobody read the answers";
  EXPECT_LT(server.answer_seconds(), kServedWithin);
}

TEST(HttpAttack, RandomBytesAreRefused) {
  const ServerProcess server;
  std::uint64_t state = 88172645463325252;  // xorshift64, fixed seed
  for (int i = 0; i < 300; ++i) {
    std::string bytes = i % 2 == 0 ? "GET /echo HTTP/1.1\r\n" : "";
    for (int k = 0; k < 400; ++k) {
      state ^= state << 13;
      state ^= state >> 7;
      state ^= state << 17;
      bytes += k % 40 == 39 ? '\n' : static_cast<char>(state & 0xff);
    }
    RawClient client(server.port());
    client.send(bytes + "\r\n\r\n");
    const int status = client.read().status;
    EXPECT_GE(status, 400) << i;
    EXPECT_LT(status, 506) << i;
  }
  EXPECT_LT(server.answer_seconds(), kServedWithin);
}

}  // namespace
}  // namespace retake
