// Names of chain states, the ids of samples.
// Realises doc/design.md, section 5.
#include "db/records.h"

#include <array>
#include <stdexcept>
#include <utility>

namespace retake {
namespace {

constexpr std::array<std::pair<ChainState, std::string_view>, 5> kChainStates{{
    {ChainState::queued, "queued"},
    {ChainState::running, "running"},
    {ChainState::paused, "paused"},
    {ChainState::finished, "finished"},
    {ChainState::failed, "failed"},
}};

}  // namespace

std::string_view to_string(ChainState state) {
  for (const auto& [candidate, name] : kChainStates) {
    if (candidate == state) return name;
  }
  throw std::logic_error("not a chain state: " + std::to_string(static_cast<int>(state)));
}

ChainState chain_state(std::string_view name) {
  for (const auto& [state, candidate] : kChainStates) {
    if (candidate == name) return state;
  }
  throw std::logic_error("not a chain state: " + std::string(name));
}

std::string sample_id(std::string_view chain, std::uint64_t iteration, std::uint32_t replica) {
  std::string id(chain);
  id += '-';
  id += std::to_string(iteration);
  if (replica != 0) {
    id += '-';
    id += std::to_string(replica);
  }
  return id;
}

}  // namespace retake
