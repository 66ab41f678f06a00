// What one client may take before it takes from all others.
#include "server/http/clients.h"

#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace retake {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Clients, AnAddressOfIPv6StandsForItsNetwork) {
  EXPECT_EQ(client_at("192.0.2.1"), client_at("192.0.2.1"));
  EXPECT_NE(client_at("192.0.2.1"), client_at("192.0.2.2"));
  EXPECT_EQ(client_at("2001:db8:1:2::1"), client_at("2001:db8:1:2:ffff:0:1:9"));
  EXPECT_NE(client_at("2001:db8:1:2::1"), client_at("2001:db8:1:3::1"));
  EXPECT_EQ(client_at("fe80::1%eth0"), client_at("fe80::1%eth0"));
  EXPECT_NE(client_at("::ffff:192.0.2.1"), client_at("::ffff:192.0.2.2"));
}

TEST(Clients, PlacesAreTakenAndGivenBack) {
  ClientPlaces places(2, 3);
  std::vector<ClientPlaces::Taken> taken = {places.take("a"), places.take("a")};
  EXPECT_EQ(places.take("a").refusal, ClientPlaces::Refusal::client_has_many);
  taken.push_back(places.take("b"));
  EXPECT_EQ(places.take("b").refusal, ClientPlaces::Refusal::all_are_taken);
  EXPECT_EQ(places.take("a").refusal, ClientPlaces::Refusal::client_has_many);
  EXPECT_EQ(places.count(), 3u);
  taken.erase(taken.begin());
  EXPECT_EQ(places.take("b").refusal, ClientPlaces::Refusal::none);
  EXPECT_EQ(places.count(), 2u);
}

TEST(Clients, GuessesAreLookedAtOneASecondAfterTwenty) {
  TokenAttempts attempts;
  auto now = TokenAttempts::Clock::now();
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(attempts.wait("a", now).count(), 0) << i;
    attempts.note_wrong("a", std::to_string(i), now);
  }
  EXPECT_DOUBLE_EQ(attempts.wait("a", now).count(), 1);
  EXPECT_EQ(attempts.wait("b", now).count(), 0);
  now += milliseconds(600);
  EXPECT_NEAR(attempts.wait("a", now).count(), 0.4, 1e-9);
  now += milliseconds(400);
  EXPECT_NEAR(attempts.wait("a", now).count(), 0, 1e-9);
  now += seconds(1000);
  for (int i = 0; i < 20; ++i)
    attempts.note_wrong("a", "again " + std::to_string(i), now);
  EXPECT_DOUBLE_EQ(attempts.wait("a", now).count(), 1) << "no more than twenty are saved up";
}

TEST(Clients, TheSameWrongTokenAgainIsNoGuess) {
  TokenAttempts attempts;
  const auto now = TokenAttempts::Clock::now();
  for (int i = 0; i < 1000; ++i)
    for (const char* old : {"cookie", "header", "script"})
      attempts.note_wrong("a", old, now);
  EXPECT_EQ(attempts.wait("a", now).count(), 0);
  const std::string common(1000, 'x');
  for (int i = 0; i < 20; ++i)
    attempts.note_wrong("b", common + std::to_string(i), now);
  EXPECT_GT(attempts.wait("b", now).count(), 0) << "only a whole token tells whether it is the same";
}

TEST(Clients, AThousandAddressesAreRememberedTheLatestOnes) {
  TokenAttempts attempts;
  auto now = TokenAttempts::Clock::now();
  const auto guess = [&](const std::string& client) {
    for (int i = 0; i < 20; ++i)
      attempts.note_wrong(client, std::to_string(i), now);
  };
  guess("first");
  for (int client = 0; client < 1023; ++client)
    attempts.note_wrong(std::to_string(client), "x", now);
  EXPECT_GT(attempts.wait("first", now).count(), 0);
  now += milliseconds(1);
  for (int client = 0; client < 1023; ++client)
    attempts.note_wrong(std::to_string(client), "y", now);
  attempts.note_wrong("one more", "x", now);
  EXPECT_EQ(attempts.wait("first", now).count(), 0);
  guess("last");
  EXPECT_GT(attempts.wait("last", now).count(), 0);
}

}  // namespace
}  // namespace retake
