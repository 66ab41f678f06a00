// FileLock: the right to write a store, held by one process at a time.
// Realises doc/design.md, section 5: one writer. The operating system releases it however the process ends.
#pragma once

#include <string>

namespace retake::database {

class FileLock {
 public:
  /// Takes the lock on the file, which is created if it does not exist and is left behind.
  /// Throws: LockedElsewhere if it is taken, std::runtime_error with the reason if the file cannot be opened.
  explicit FileLock(const std::string& path);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int descriptor_;
};

struct LockedElsewhere {};

}  // namespace retake::database
