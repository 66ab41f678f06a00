// The C library's calls that reach the disk, replaced: SQLite calls these in their place.
#include "tests/db/disk.h"

#include <cerrno>
#include <sys/syscall.h>
#include <unistd.h>

namespace retake::test {

Disk& disk() {
  static Disk instance;
  return instance;
}

namespace {

int flush(long call, int descriptor) {
  ++disk().flushes;
  if (const int error = disk().flush_error; error != 0) {
    errno = error;
    return -1;
  }
  return static_cast<int>(::syscall(call, descriptor));
}

}  // namespace
}  // namespace retake::test

extern "C" {

int fsync(int descriptor) {
  return retake::test::flush(SYS_fsync, descriptor);
}
int fdatasync(int descriptor) {
  return retake::test::flush(SYS_fdatasync, descriptor);
}

ssize_t pwrite64(int descriptor, const void* bytes, size_t count, off64_t offset) {
  if (const int error = retake::test::disk().write_error; error != 0) {
    errno = error;
    return -1;
  }
  return ::syscall(SYS_pwrite64, descriptor, bytes, count, offset);
}
ssize_t pwrite(int descriptor, const void* bytes, size_t count, off_t offset) {
  return pwrite64(descriptor, bytes, count, offset);
}

}  // extern "C"
