// ChainStarter: how chains begin - from which lesson, and whether the same chain is there already.
// doc/design.md, section 3, "Lessons". It must not know HTTP.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "db/store.h"
#include "server/chains/runner.h"

namespace retake {

/// What chains are asked for.
struct ChainWish {
  std::uint32_t count = 1;
  std::optional<std::uint64_t> seed{};  ///< none: any
  std::string method;
  std::string ratios;
  std::optional<std::uint64_t> lesson{};  ///< 0: they learn by themselves; none: as Store::next_lesson says
  StopRule stop{};
};

/// Thread safety: every method may be called from any thread.
class ChainStarter {
 public:
  ChainStarter(Store& store, Runner& runner) : store_(store), runner_(runner) {}

  struct Started {
    std::vector<ChainRecord> chains;  ///< by index
    std::size_t created = 0;          ///< the others were there
  };
  /// The same seed, index, method, ratios and lesson are the same chain, and the same evidence: it is not run
  /// a second time, but goes on if the wish's stop rule lies farther than where it ended. Without a lesson in
  /// the wish any will do. All of them are started, or none.
  /// Throws: UnknownLesson; TooManyChains if more than `most_live` would run; StoreError.
  class UnknownLesson;
  class TooManyChains;
  Started start(std::string_view scenario, const ChainWish& wish, std::uint64_t most_live);

 private:
  void check_lesson(std::string_view scenario, const ChainWish& wish) const;

  Store& store_;
  Runner& runner_;
  std::mutex mutex_;  ///< one at a time, so that none is begun twice
};

class ChainStarter::UnknownLesson : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class ChainStarter::TooManyChains : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace retake
