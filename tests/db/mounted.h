// Child processes of tests, and small file systems that only they see.
#pragma once

#include <cstdio>
#include <exception>
#include <fstream>
#include <functional>
#include <sched.h>
#include <string>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace retake::test {

inline int exit_code_of_child(const std::function<int()>& run) {
  const auto child = ::fork();
  if (child == 0) {
    try {
      ::_exit(run());
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      ::_exit(99);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

inline constexpr int kCannotMount = 77;

/// As exit_code_of_child, with a file system in memory mounted on `folder`. kCannotMount: that is not allowed
/// here.
inline int exit_code_in_mount(const std::string& folder, const std::string& options,
                              const std::function<int()>& run) {
  return exit_code_of_child([&] {
    const auto user = std::to_string(::geteuid());
    const auto group = std::to_string(::getegid());
    if (::unshare(CLONE_NEWNS | (user == "0" ? 0 : CLONE_NEWUSER)) != 0) return kCannotMount;
    if (user != "0") {
      std::ofstream("/proc/self/setgroups") << "deny";
      std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
      std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
    }
    ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (::mount("none", folder.c_str(), "tmpfs", 0, options.c_str()) != 0) return kCannotMount;
    return run();
  });
}

/// Of the exit code of a child that ran in such a mount.
inline void expect_done_in_mount(int code) {
  ASSERT_NE(code, kCannotMount)
      << "this test mounts a small file system: run it as root or allow user namespaces";
  EXPECT_EQ(code, 0);
}

}  // namespace retake::test
