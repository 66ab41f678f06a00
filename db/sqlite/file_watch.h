// FileWatch: whether the files of an open store are still those that their names say.
// Realises doc/design.md, section 5: what is written to a file that nobody will find again is lost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <sys/types.h>

namespace retake::database {

/// Thread safety: one thread at a time.
class FileWatch {
 public:
  /// Remembers what has these names now. Requires: the database is open.
  explicit FileWatch(std::string path);

  /// What is wrong, empty if nothing: the database, its log or its shared memory was removed or replaced, has
  /// a second name, or is shorter than it was. The last is for good; all else may be put right.
  /// `log_bytes`: how long the log has to be at least.
  std::string fault(std::uint64_t log_bytes);

 private:
  struct Known {
    dev_t device = 0;
    ino_t inode = 0;
    std::uint64_t bytes = 0;  ///< never fewer again
  };
  std::string fault_of(const char* suffix, std::uint64_t least_bytes);

  const std::string path_;
  std::map<std::string, Known> known_;  ///< by suffix
  std::string truncated_;
};

}  // namespace retake::database
