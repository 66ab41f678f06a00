// See event_hub.h.
#include "server/chains/event_hub.h"

#include <utility>

namespace retake {

void EventHub::mark(Versions& versions, std::string_view id) {
  ++version_;
  if (const auto found = versions.find(id); found != versions.end())
    found->second = version_;
  else
    versions.emplace(id, version_);
}

void EventHub::chain_changed(std::string_view id) {
  const std::lock_guard lock(mutex_);
  mark(chains_, id);
  changed_.notify_all();
}

void EventHub::scenario_changed(std::string_view id) {
  const std::lock_guard lock(mutex_);
  if (const auto found = deleted_.find(id); found != deleted_.end()) deleted_.erase(found);
  mark(scenarios_, id);
  changed_.notify_all();
}

void EventHub::scenario_deleted(std::string_view id, const std::vector<std::string>& chains) {
  const std::lock_guard lock(mutex_);
  for (const std::string& chain : chains)
    chains_.erase(chain);
  if (const auto found = scenarios_.find(id); found != scenarios_.end()) scenarios_.erase(found);
  mark(deleted_, id);
  changed_.notify_all();
}

std::uint64_t EventHub::version() {
  const std::lock_guard lock(mutex_);
  return version_;
}

std::uint64_t EventHub::wait_for_scenario(std::string_view id, std::uint64_t version,
                                          std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const auto is_after = [&](const Versions& versions) {
    const auto found = versions.find(id);
    return found != versions.end() && found->second > version;
  };
  changed_.wait_until(lock, deadline, [&] { return closed_ || is_after(scenarios_) || is_after(deleted_); });
  return version_;
}

void EventHub::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

EventHub::Changes EventHub::changes_since(std::uint64_t version, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, wait, [&] { return closed_ || version_ > version; });
  Changes changes{.version = version_, .chains = {}, .scenarios = {}, .deleted_scenarios = {}};
  const auto collect = [version](const Versions& versions, std::vector<std::string>& into) {
    for (const auto& [id, changed] : versions)
      if (changed > version) into.push_back(id);
  };
  collect(chains_, changes.chains);
  collect(scenarios_, changes.scenarios);
  if (version > 0) collect(deleted_, changes.deleted_scenarios);
  return changes;
}

}  // namespace retake
