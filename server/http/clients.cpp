// See clients.h.
#include "server/http/clients.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <netinet/in.h>

namespace retake {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kMostAttempts = 20;      ///< chosen: of a person who mistypes, at once
constexpr double kAttemptsPerSecond = 1;  ///< chosen: after those
constexpr std::size_t kMostRecords = 1024;
constexpr std::size_t kMostTried = 4;            ///< tokens that are remembered as no guess
constexpr std::size_t kLongestRemembered = 256;  ///< [bytes] of such a token
constexpr std::size_t kNetworkBytes = 8;         ///< of an IPv6 address

}  // namespace

std::string client_at(std::string_view address) {
  const std::string text(address.substr(0, address.find('%')));  // without the interface
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  if (inet_pton(AF_INET6, text.c_str(), bytes.data()) != 1) return text;
  if (IN6_IS_ADDR_V4MAPPED(reinterpret_cast<const in6_addr*>(bytes.data()))) return text;
  return {reinterpret_cast<const char*>(bytes.data()), kNetworkBytes};
}

// --- ClientPlaces -----------------------------------------------------------------------------

ClientPlaces::Taken ClientPlaces::take(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = taken_.find(client);
  if (found != taken_.end() && found->second >= most_of_client_) return {Refusal::client_has_many, nullptr};
  if (count_ >= most_) return {Refusal::all_are_taken, nullptr};
  Taken taken{Refusal::none, std::shared_ptr<void>(nullptr, [this, client](void*) { give_back(client); })};
  ++taken_[client];
  ++count_;
  return taken;
}

void ClientPlaces::give_back(const std::string& client) {
  const std::lock_guard lock(mutex_);
  const auto found = taken_.find(client);
  if (--found->second == 0) taken_.erase(found);
  --count_;
}

std::size_t ClientPlaces::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

// --- TokenAttempts ----------------------------------------------------------------------------

std::chrono::duration<double> TokenAttempts::wait(const std::string& client, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto found = records_.find(client);
  if (found == records_.end()) return Seconds(0);
  refill(found->second, now);
  return Seconds(std::max(0.0, (1 - found->second.left) / kAttemptsPerSecond));
}

void TokenAttempts::note_wrong(const std::string& client, std::string_view token, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  auto found = records_.find(client);
  if (found == records_.end()) {
    if (records_.size() == kMostRecords) make_room();
    found = records_.emplace(client, Record{kMostAttempts, now, {}}).first;
  }
  Record& record = found->second;
  refill(record, now);
  if (std::ranges::find(record.tried, token) != record.tried.end()) return;
  record.left = std::max(0.0, record.left - 1);
  if (token.size() > kLongestRemembered) return;
  record.tried.emplace_back(token);
  if (record.tried.size() > kMostTried) record.tried.pop_front();
}

void TokenAttempts::refill(Record& record, Clock::time_point now) const {
  record.left =
      std::min(kMostAttempts, record.left + Seconds(now - record.seen).count() * kAttemptsPerSecond);
  record.seen = now;
}

/// Forgets who has been away for longest.
void TokenAttempts::make_room() {
  records_.erase(std::ranges::min_element(records_, {}, [](const auto& entry) { return entry.second.seen; }));
}

}  // namespace retake
