// CHECK: stops the program when we are wrong, in every build, and says where the chain stood.
// doc/contributing.md, "Errors". Not for faults of callers or of the environment.
#pragma once

#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

namespace retake {

/// What the current thread is working on; printed when a CHECK fails, so that the failure can be replayed.
struct CheckContext {
  std::string_view scenario;
  std::string_view chain;
  std::uint64_t iteration = 0;
};
CheckContext& check_context();

[[noreturn]] void check_failed(std::string_view condition, std::string_view file, int line,
                               const std::string& values);

template <typename... Values>
std::string check_values(const Values&... values) {
  std::ostringstream text;
  ((text << ' ' << values), ...);
  return text.str();
}

}  // namespace retake

/// CHECK(condition, values...): aborts with the condition, its place and the values unless it holds.
#define CHECK(condition, ...)                                                                      \
  do {                                                                                             \
    if (!(condition)) [[unlikely]]                                                                 \
      ::retake::check_failed(#condition, __FILE__, __LINE__, ::retake::check_values(__VA_ARGS__)); \
  } while (false)
