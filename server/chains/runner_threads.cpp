// The threads of the runner: they step chains in turn, and hand over what is found. See runner.h.
#include <algorithm>
#include <sys/resource.h>
#include <unistd.h>

#include "server/chains/runner.h"

namespace retake {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;

constexpr duration<double> kSlice{0.02};           // chosen: a person's click is answered at once
constexpr duration<double> kBetweenCommits{0.25};  // chosen: what a page shows of a chain is at most this old
constexpr std::size_t kSamplesPerCommit = 32;
constexpr std::size_t kMostGathered = 256;  // a chain waits for its commit when it has gathered this many

}  // namespace

void Runner::work() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
  Performers performers;  // of the scenarios stepped last; their scratch memory is reused
  constexpr std::size_t kMostPerformers = 8;
  while (const std::shared_ptr<Live> live = next_chain()) {
    const auto& scenario = live->chain.run().scenario();
    auto found = std::find_if(performers.begin(), performers.end(),
                              [&](const auto& entry) { return entry.first == scenario; });
    if (found == performers.end()) {
      if (performers.size() == kMostPerformers) performers.erase(performers.begin());
      performers.emplace_back(scenario, scenario->make_performer());
      found = std::prev(performers.end());
    }
    if (!slice(live, *found->second)) performers.erase(found);
  }
}

/// The next chain in turn whose commits keep up; waits for one. Null at the end.
std::shared_ptr<Runner::Live> Runner::next_chain() {
  std::unique_lock lock(mutex_);
  while (!draining_) {
    const bool is_store_failing = !store_.last_error().empty();
    for (auto place = queue_.begin(); place != queue_.end(); ++place) {
      const std::shared_ptr<Live> live = *place;
      if (live->wish != Wish::run) continue;  // whoever wishes takes it
      const LiveChain& chain = live->chain;
      if (chain.is_spoiled() && is_store_failing) continue;
      const bool waits = chain.run().gathered() >= kMostGathered || chain.run().awaits_judgement();
      if (waits && chain.is_committing()) continue;
      queue_.erase(place);
      live->in_slice = true;
      return live;
    }
    if (queue_.empty())
      work_.wait(lock);
    else
      work_.wait_for(lock, std::chrono::milliseconds(is_store_failing ? 50 : 1));  // the store is behind
  }
  return nullptr;
}

bool Runner::slice(const std::shared_ptr<Live>& live, Scenario::Performer& performer) {
  LiveChain& chain = live->chain;
  bool is_usable = true;
  try {
    if (!chain.restore()) {
      leave(live);
      return is_usable;
    }

    // Step, unless something else is wished; whoever wishes waits for the chain.
    if (chain.run().ended_by().empty() && !chain.run().awaits_judgement()) is_usable = step(*live, performer);
    if (!is_usable || wish_of(*live) != Wish::run) {
      give_back(live);
      return is_usable;
    }

    // Hand over what there is, when it is time.
    const bool is_deleted = !chain.settle(false);
    if (is_deleted) {
      leave(live);
      return is_usable;
    }
    const bool is_all_stored = !chain.is_unsettled() && chain.is_handed_over();
    if (chain.run().awaits_judgement() && wish_of(*live) == Wish::run && is_all_stored) chain.judge();
    if (end_if_wished(live)) return is_usable;
    const std::size_t gathered = chain.run().gathered();
    // Somebody may be waiting for the first ones.
    const bool is_first = gathered > 0 && gathered == chain.run().record().counters.samples;
    if (!chain.is_unsettled() &&
        (is_first || gathered >= kSamplesPerCommit || chain.run().awaits_judgement() ||
         Clock::now() - chain.handed_over() >= kBetweenCommits))
      chain.hand_over(std::nullopt, "");
  } catch (const StoreUnavailable&) {
    hold(live, std::nullopt);
    return is_usable;
  } catch (const std::exception& error) {
    // Whatever it is, memory that runs out included, it ends this chain and nothing else.
    fail(live, error.what());
    return false;
  }
  give_back(live);
  return is_usable;
}

bool Runner::step(Live& live, Scenario::Performer& performer) {
  if (!live.is_noted) set_state(live.chain.id(), ChainState::running, "", "");
  live.is_noted = true;

  // Whoever wishes something from here on can interrupt.
  const auto publish = [&](Interruption* interruption) {
    const std::lock_guard lock(mutex_);
    performer.interruption().withdraw();
    live.interruption = interruption;
    return live.wish == Wish::run && !draining_;
  };
  const ChainCounters before = live.chain.run().record().counters;
  const bool may_step = publish(&performer.interruption());
  try {
    if (may_step) live.chain.run().step_for(performer, kSlice, kMostGathered);
  } catch (const Interrupted&) {
    live.chain.spoil();
    publish(nullptr);
    return false;
  } catch (...) {
    publish(nullptr);
    throw;
  }
  publish(nullptr);
  count(before, live.chain.run().record().counters);
  return true;
}

void Runner::hold(const std::shared_ptr<Live>& live, std::optional<Wish> wish) {
  live->chain.spoil();
  if (wish) {
    const std::lock_guard lock(mutex_);
    live->wish = *wish;
  }
  give_back(live);
}

void Runner::give_back(const std::shared_ptr<Live>& live) {
  const std::lock_guard lock(mutex_);
  live->in_slice = false;
  queue_.push_back(live);
  work_.notify_one();
  if (live->wish != Wish::run || draining_) changed_.notify_all();
}

bool Runner::end_if_wished(const std::shared_ptr<Live>& live) {
  const Wish wish = wish_of(*live);
  if (wish == Wish::drop) {
    leave(live);
    return true;
  }
  LiveChain& chain = live->chain;
  std::string_view ended_by = chain.run().ended_by();
  if (wish == Wish::stop && ended_by.empty()) ended_by = "stop";
  if (ended_by.empty() && chain.run().gathered() > 0 &&
      store_.sample_count(chain.scenario()) >= settings_.most_samples_per_scenario)
    ended_by = "stock";
  if (ended_by.empty() && wish != Wish::pause) return false;
  chain.settle(true);
  chain.hand_over(ended_by.empty() ? ChainState::paused : ChainState::finished, ended_by);
  chain.settle(true);
  leave(live);
  return true;
}

Runner::Wish Runner::wish_of(const Live& live) const {
  const std::lock_guard lock(mutex_);
  return live.wish;
}

void Runner::count(const ChainCounters& before, const ChainCounters& after) {
  iterations_ += after.iteration - before.iteration;
  samples_ += after.samples - before.samples;
  simulations_ += after.simulations - before.simulations;
  failed_simulations_ += after.failed_simulations - before.failed_simulations;
}

}  // namespace retake
