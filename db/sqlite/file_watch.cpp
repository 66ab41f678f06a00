// See file_watch.h.
#include "db/sqlite/file_watch.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <sys/stat.h>
#include <utility>

namespace retake::database {
namespace {

constexpr const char* kDatabase = "";
constexpr const char* kLog = "-wal";
constexpr const char* kSharedMemory = "-shm";

std::string name_of(const std::string& suffix) {
  if (suffix == kLog) return "its write-ahead log";
  if (suffix == kSharedMemory) return "its shared memory";
  return "the file";
}

}  // namespace

FileWatch::FileWatch(std::string path) : path_(std::move(path)) {
  fault(0);
}

std::string FileWatch::fault(std::uint64_t log_bytes) {
  if (!truncated_.empty()) return truncated_;
  for (const auto& [suffix, least] : {std::pair(kDatabase, std::uint64_t{0}), std::pair(kLog, log_bytes),
                                      std::pair(kSharedMemory, std::uint64_t{0})})
    if (std::string found = fault_of(suffix, least); !found.empty()) return found;
  return {};
}

std::string FileWatch::fault_of(const char* suffix, std::uint64_t least_bytes) {
  const auto known = known_.find(suffix);
  struct stat now {};
  if (::stat((path_ + suffix).c_str(), &now) != 0) {
    if (known == known_.end()) return {};  // SQLite makes it when it is needed
    if (errno == ENOENT) return name_of(suffix) + " was removed";
    return name_of(suffix) + " cannot be found: " + std::strerror(errno);
  }
  const auto bytes = static_cast<std::uint64_t>(now.st_size);
  if (known == known_.end()) {
    known_.emplace(suffix, Known{.device = now.st_dev, .inode = now.st_ino, .bytes = bytes});
  } else if (now.st_dev != known->second.device || now.st_ino != known->second.inode) {
    return name_of(suffix) + " was replaced by another one";
  }
  // SQLite finds the log by the database's name: by another name it would find another one.
  if (now.st_nlink > 1) return name_of(suffix) + " has a second name (a hard link)";

  // The database never shrinks; the log only begins anew, so it is known by what it has to hold.
  Known& held = known_[suffix];
  const bool is_log = std::strcmp(suffix, kLog) == 0;
  if (bytes < (is_log ? least_bytes : held.bytes))
    return truncated_ = name_of(suffix) + " was truncated; end the daemon and put a backup in its place";
  held.bytes = bytes;
  return {};
}

}  // namespace retake::database
