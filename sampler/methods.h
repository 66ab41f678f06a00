// Methods: which Walk each method is. The one file that knows all of them.
// doc/design.md, section 3. Internal to the sampler: callers see Chain.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sampler/walk.h"

namespace retake {

/// The walk that the settings name. Requires: target, settings and counts outlive it.
std::unique_ptr<Walk> make_walk(const Target& target, const ChainSettings& settings, ChainCounts& counts);
/// What ChainCounts::kernels counts.
std::vector<std::string> kernel_names(const Target& target, Method method);

}  // namespace retake
