// StoreOptions: how a store is opened.
// doc/design.md, section 5. Plain values.
#pragma once

#include <cstddef>

namespace retake {

struct StoreOptions {
  bool read_only = false;       ///< for tools that look at a store, also while a daemon serves it
  std::size_t batch_rows = 32;  ///< a group is committed when it holds this many samples, or
  double batch_seconds = 0.05;  ///< when its oldest sample is this old [s]
  std::size_t reader_connections = 4;
};

}  // namespace retake
