// FileLock on flock(2), which also tells apart two holders within one process.
// Realises doc/design.md, section 5.
#include "db/sqlite/file_lock.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <stdexcept>
#include <sys/file.h>
#include <unistd.h>

namespace retake::database {

FileLock::FileLock(const std::string& path)
    : descriptor_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (descriptor_ < 0) throw std::runtime_error(std::strerror(errno));
  while (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    if (error == EINTR) continue;
    ::close(descriptor_);
    if (error == EWOULDBLOCK) throw LockedElsewhere();
    throw std::runtime_error(std::strerror(error));
  }
}

FileLock::~FileLock() {
  ::close(descriptor_);
}

}  // namespace retake::database
