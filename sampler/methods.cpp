// See methods.h.
#include "sampler/methods.h"

#include "sampler/conditional.h"
#include "sampler/guided.h"
#include "sampler/placed.h"
#include "sampler/simple_walks.h"
#include "sampler/tempering.h"

namespace retake {

std::unique_ptr<Walk> make_walk(const Target& target, const ChainSettings& settings, ChainCounts& counts) {
  switch (settings.method) {
    case Method::metropolis:
      return std::make_unique<Metropolis>(target, settings, counts);
    case Method::rejection:
      return std::make_unique<Rejection>(target, settings, counts);
    case Method::conditional:
      if (target.guide) return std::make_unique<Guided>(target, settings, counts);
      if (target.placed) return std::make_unique<Placed>(target, settings, counts);
      return std::make_unique<Conditional>(target, settings, counts);
    case Method::tempering:
      return std::make_unique<Tempering>(target, settings, counts);
  }
  return nullptr;
}

std::vector<std::string> kernel_names(const Target& target, Method method) {
  switch (method) {
    case Method::metropolis:
      return Metropolis::kernel_names(target);
    case Method::rejection:
      return {"prior"};
    case Method::conditional:
      if (target.guide) return Guided::kernel_names(*target.guide);
      return target.placed ? Placed::kernel_names() : Conditional::kernel_names();
    case Method::tempering:
      return Tempering::kernel_names();
  }
  return {};
}

}  // namespace retake
