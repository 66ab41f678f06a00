// One measured figure, as scripts/bench reads it.
#pragma once

#include <cstdio>
#include <ctime>
#include <string>

namespace retake {

/// Prints one JSON object on a line of its own.
inline void print_figure(const std::string& name, double value, const char* unit) {
  std::printf("{\"name\":\"%s\",\"value\":%.6g,\"unit\":\"%s\"}\n", name.c_str(), value, unit);
  std::fflush(stdout);
}

/// CPU time of this thread [s]: what others run on the machine costs little of it.
inline double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace retake
