// StoreOptions: how a store is opened.
// doc/design.md, section 5. Plain values.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace retake {

struct StoreOptions {
  bool read_only = false;       ///< for tools that look at a store, also while a daemon serves it
  std::size_t batch_rows = 32;  ///< a group is committed when it holds this many samples, or
  double batch_seconds = 0.05;  ///< when its oldest sample is this old [s]
  std::size_t reader_connections = 4;
  /// Told why writing does not work, and an empty text when it works again; called on a thread of the
  /// store's.
  std::function<void(const std::string& error)> tell{};
  /// Told of each damaged row once, "sample c-4 is damaged: …", when it is met; from any thread.
  std::function<void(const std::string&)> on_damage{};
};

}  // namespace retake
