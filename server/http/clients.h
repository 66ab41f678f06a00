// Clients: what one client may take before it takes from all others. Streams that are open at once, and
// tokens that are tried. Realises doc/http.md. It must not know sockets, heads or routes.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

namespace retake {

/// Who is behind an address: itself, of IPv6 the network of 64 bits that one host can have for itself.
std::string client_at(std::string_view address);

/// Places that are taken for a while. Thread safety: any thread.
class ClientPlaces {
 public:
  ClientPlaces(std::size_t most_of_client, std::size_t most) : most_of_client_(most_of_client), most_(most) {}

  enum class Refusal { none, client_has_many, all_are_taken };
  struct Taken {
    Refusal refusal = Refusal::none;
    std::shared_ptr<void> place;  ///< given back with its last copy, before this object goes
  };
  Taken take(const std::string& client);
  std::size_t count() const;

 private:
  void give_back(const std::string& client);

  const std::size_t most_of_client_, most_;
  mutable std::mutex mutex_;
  std::map<std::string, std::size_t> taken_;  ///< by client, none of 0
  std::size_t count_ = 0;
};

/// Slows who guesses the token: after a few wrong ones a client's tokens are looked at one by one. The same
/// wrong token again is no guess, so that an old cookie locks nobody out. Thread safety: any thread.
class TokenAttempts {
 public:
  using Clock = std::chrono::steady_clock;

  /// How long no token of this client is looked at; 0: it may try one.
  std::chrono::duration<double> wait(const std::string& client, Clock::time_point now);
  void note_wrong(const std::string& client, std::string_view token, Clock::time_point now);

 private:
  struct Record {
    double left;  ///< attempts
    Clock::time_point seen;
    std::deque<std::string> tried;  ///< the last ones
  };
  void refill(Record& record, Clock::time_point now) const;
  void make_room();

  std::mutex mutex_;
  std::map<std::string, Record> records_;
};

}  // namespace retake
