// The disk as the tests see it: how often files were flushed, and a disk that is full or broken on demand.
// disk.cpp takes the place of the C library's calls in this program.
#pragma once

#include <atomic>

namespace retake::test {

struct Disk {
  std::atomic<int> flushes{0};      ///< calls of fsync and fdatasync
  std::atomic<int> write_error{0};  ///< errno that writes fail with, 0: they succeed
  std::atomic<int> flush_error{0};  ///< errno that flushes fail with, 0: they succeed
};
Disk& disk();

}  // namespace retake::test
