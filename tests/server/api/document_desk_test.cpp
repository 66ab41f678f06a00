// How many animations are in memory at once to be sent.
#include "server/api/document_desk.h"

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/server/child_process.h"

namespace retake {
namespace {

TEST(DocumentDesk, HoldsSoManyBytesAtOnceOrASingleLargeOne) {
  DocumentDesk desk({.most_bytes = 100, .longest_wait = 0.01});
  auto first = desk.take(60);
  EXPECT_TRUE(first);
  EXPECT_FALSE(desk.take(50));
  EXPECT_TRUE(desk.take(40));
  auto copy = first;
  first.reset();
  EXPECT_FALSE(desk.take(50)) << "it is held still";
  copy.reset();
  const auto large = desk.take(1000);
  EXPECT_TRUE(large) << "alone, whatever its size";
  EXPECT_FALSE(desk.take(1));
}

TEST(DocumentDesk, WhoWaitsIsServedOnceThereIsRoom) {
  DocumentDesk desk({.most_bytes = 100, .longest_wait = 60});
  auto held = desk.take(100);
  std::atomic<int> served = 0;
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i)
    clients.emplace_back([&] { served += desk.take(100) != nullptr; });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(served, 0);
  held.reset();
  for (std::thread& client : clients)
    client.join();
  EXPECT_EQ(served, 4);
}

TEST(DocumentDesk, NoMoreWaitThanMay) {
  DocumentDesk desk({.most_bytes = 100, .most_waiting = 0, .longest_wait = 60});
  const auto held = desk.take(100);
  EXPECT_FALSE(desk.take(1)) << "refused at once";
}

TEST(DocumentDesk, ASlowReaderIsCutOnlyWhileOthersWait) {
  DocumentDesk desk({.most_bytes = 100, .longest_wait = 60, .patience = 0, .slowest_bytes_per_second = 1e5});
  auto held = desk.take(100);
  const StreamSink sink = [](std::string_view) { return true; };
  const StreamSink slow = desk.hurried(sink), quick = desk.hurried(sink);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(slow("a")) << "nobody waits";
  std::thread other([&] { EXPECT_TRUE(desk.take(100)); });
  EXPECT_TRUE(test::wait_until([&] { return !slow("a"); })) << "it keeps others waiting";
  EXPECT_TRUE(quick(std::string(1 << 26, 'a')));
  held.reset();
  other.join();
}

}  // namespace
}  // namespace retake
