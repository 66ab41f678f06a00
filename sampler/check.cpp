// See check.h.
#include "sampler/check.h"

#include <cstdio>
#include <cstdlib>

namespace retake {

CheckContext& check_context() {
  thread_local CheckContext context;
  return context;
}

void check_failed(std::string_view condition, std::string_view file, int line, const std::string& values) {
  const CheckContext& context = check_context();
  std::fprintf(stderr,
               "retake: CHECK(%.*s) failed at %.*s:%d:%s [scenario %.*s, chain %.*s, iteration %llu]\n",
               static_cast<int>(condition.size()), condition.data(), static_cast<int>(file.size()),
               file.data(), line, values.c_str(), static_cast<int>(context.scenario.size()),
               context.scenario.data(), static_cast<int>(context.chain.size()), context.chain.data(),
               static_cast<unsigned long long>(context.iteration));
  std::abort();
}

}  // namespace retake
