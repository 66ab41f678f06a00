// See runner.h.
#include "server/chains/runner.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace retake {
namespace {

/// Whether one rule ends a chain nowhere before the other, and not always at the same place.
bool allows_more(const StopRule& rule, const StopRule& other) {
  bool less = false, more = false;
  visit_limits(
      [&](std::string_view, const auto& limit, const auto& before) {
        less = less || (limit && (!before || *limit < *before));
        more = more || limit != before;
      },
      rule, other);
  return more && !less;
}

}  // namespace

Runner::Runner(Store& store, ScenarioLibrary& library, EventHub& events, Settings settings)
    : store_(store), library_(library), events_(events), settings_(settings) {
  for (std::size_t i = 0; i < settings_.threads; ++i)
    threads_.emplace_back([this] { work(); });
}

Runner::~Runner() {
  drain();
}

/// One request at a time changes a chain: while this lives, others that want to wait.
class Runner::Turn {
 public:
  Turn(Runner& runner, std::string_view id) : runner_(runner), id_(id) {
    std::unique_lock lock(runner_.mutex_);
    runner_.changed_.wait(lock, [this] { return runner_.turns_.insert(id_).second; });
  }
  ~Turn() {
    const std::lock_guard lock(runner_.mutex_);
    runner_.turns_.erase(id_);
    runner_.changed_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  Runner& runner_;
  const std::string id_;
};

// --- Chains come and go -------------------------------------------------------------------------

void Runner::resume_stored() {
  std::map<std::string, bool> has_world;  // by scenario
  for (const ChainRecord& record : store_.chains_in_states({ChainState::paused, ChainState::failed})) {
    const auto [known, is_new] = has_world.try_emplace(record.scenario, true);
    if (is_new) known->second = has_world_if_sound(record.scenario);
    if (!known->second) try_set_state(record.id, ChainState::finished, kEndedByVersion, record.error);
  }
  for (const ChainRecord& record : store_.chains_in_states({ChainState::queued, ChainState::running})) {
    try {
      if (record.attempts >= kMostAttempts)
        throw std::runtime_error("the process died " + std::to_string(record.attempts) +
                                 " times while it was running; resume it to try once more");
      make_live(record);
    } catch (const OtherVersion& reason) {
      std::fprintf(stderr, "retake: chain %s is finished: %s\n", record.id.c_str(), reason.what());
      try_set_state(record.id, ChainState::finished, kEndedByVersion, record.error);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "retake: chain %s cannot go on: %s\n", record.id.c_str(), error.what());
      try_set_state(record.id, ChainState::failed, "", error.what());
    }
  }
}

/// As the next start will find it out again, it need not be known now.
void Runner::try_set_state(std::string_view id, ChainState state, std::string_view ended_by,
                           std::string_view error) {
  try {
    set_state(id, state, ended_by, error);
  } catch (const StoreUnavailable& reason) {
    std::fprintf(stderr, "retake: chain %s cannot be said to have %s: %s\n", std::string(id).c_str(),
                 std::string(to_string(state)).c_str(), reason.what());
  }
}

/// Of a damaged scenario nobody knows; its chains stay as they are.
bool Runner::has_world_if_sound(std::string_view scenario) const try {
  const auto record = store_.scenario(scenario);
  return !record || library_.has_world_of(*record);
} catch (const Damaged&) {
  return true;
}

void Runner::add(const std::vector<ChainRecord>& chains) {
  std::deque<Turn> turns;
  for (const ChainRecord& record : chains)
    turns.emplace_back(*this, record.id);
  store_.add_chains(chains);
  for (const ChainRecord& record : chains)
    make_live(record);
}

/// Queues a stored chain.
void Runner::make_live(const ChainRecord& record) {
  const auto live = std::make_shared<Live>(LiveChain(store_, library_, events_, record));
  // One that ran when the process ended says so with its first step: those that never get that far are not to
  // blame for what the process dies of.
  live->is_noted = record.state != ChainState::running;
  if (live->is_noted) set_state(record.id, ChainState::running, "", "");
  const std::lock_guard lock(mutex_);
  if (live_.try_emplace(record.id, live).second) {
    queue_.push_back(live);
    work_.notify_one();
  }
}

void Runner::leave(const std::shared_ptr<Live>& live) {
  const std::lock_guard lock(mutex_);
  live_.erase(live->chain.id());
  changed_.notify_all();
}

void Runner::fail(const std::shared_ptr<Live>& live, const std::string& error) {
  std::fprintf(stderr, "retake: chain %s failed: %s\n", live->chain.id().c_str(), error.c_str());
  try {
    set_state(live->chain.id(), ChainState::failed, "", error);
  } catch (const StoreError&) {
    // The store may be what failed. The failure is shown from memory; a restart takes the chain up again.
    const std::lock_guard lock(mutex_);
    unsaved_failures_[live->chain.id()] = error;
    events_.chain_changed(live->chain.id());
  }
  leave(live);
}

void Runner::set_state(std::string_view id, ChainState state, std::string_view ended_by,
                       std::string_view error) {
  store_.set_chain_state(id, state, ended_by, error);
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = unsaved_failures_.find(id); found != unsaved_failures_.end())
      unsaved_failures_.erase(found);
  }
  events_.chain_changed(id);
  try {
    if (const auto record = store_.chain(id)) events_.scenario_changed(record->scenario);
  } catch (const Damaged&) {
    // Whoever asks for it is told.
  }
}

// --- What clients ask ---------------------------------------------------------------------------

std::optional<ChainRecord> Runner::chain(std::string_view id) const {
  auto record = store_.chain(id);
  if (record) show_unsaved_failure(*record);
  return record;
}

std::vector<ChainRecord> Runner::chains(std::string_view scenario) const {
  std::vector<ChainRecord> records = store_.chains(scenario);
  for (ChainRecord& record : records)
    show_unsaved_failure(record);
  return records;
}

Page<ChainRecord> Runner::chains(std::string_view scenario, std::size_t limit,
                                 std::string_view cursor) const {
  Page<ChainRecord> page = store_.chains(scenario, limit, cursor);
  for (ChainRecord& record : page.records)
    show_unsaved_failure(record);
  return page;
}

void Runner::show_unsaved_failure(ChainRecord& record) const {
  const std::lock_guard lock(mutex_);
  const auto found = unsaved_failures_.find(record.id);
  if (found == unsaved_failures_.end()) return;
  record.state = ChainState::failed;
  record.error = found->second;
}

/// Has a live chain do something, and waits for that. This thread does it, as soon as no other has the chain:
/// those that step chains are of low priority, and busy.
std::optional<ChainRecord> Runner::wish(std::string_view id, Wish wish) {
  std::unique_lock lock(mutex_);
  if (const auto found = live_.find(id); found != live_.end()) {
    const std::shared_ptr<Live> live = found->second;
    live->wish = wish;
    bool is_taken = false;
    wait_for(lock, {live}, [&] { return draining_ || !is_live(live) || (is_taken = take(live)); });
    lock.unlock();
    if (is_taken) fulfil(live);
  }
  if (lock.owns_lock()) lock.unlock();
  return chain(id);
}

/// Throws: StoreUnavailable; it is as if nothing had been wished then.
void Runner::fulfil(const std::shared_ptr<Live>& live) {
  try {
    if (!live->chain.restore()) return leave(live);
    end_if_wished(live);
  } catch (const StoreUnavailable&) {
    hold(live, Wish::run);
    throw;
  } catch (const std::exception& error) {
    fail(live, error.what());
  }
}

bool Runner::is_live(const std::shared_ptr<Live>& live) const {
  const auto now = live_.find(live->chain.id());
  return now != live_.end() && now->second == live;
}

bool Runner::take(const std::shared_ptr<Live>& live) {
  const auto place = std::find(queue_.begin(), queue_.end(), live);
  if (place == queue_.end()) return false;
  queue_.erase(place);
  live->in_slice = true;
  return true;
}

void Runner::wait_for(std::unique_lock<std::mutex>& lock, const Lives& lives,
                      const std::function<bool()>& has_ended) {
  if (changed_.wait_for(lock, settings_.patience, has_ended)) return;
  for (const std::shared_ptr<Live>& live : lives)
    if (live->interruption) live->interruption->ask();
  changed_.wait(lock, has_ended);
}

std::optional<ChainRecord> Runner::pause(std::string_view id) {
  const Turn turn(*this, id);
  return wish(id, Wish::pause);
}

std::optional<ChainRecord> Runner::stop(std::string_view id) {
  const Turn turn(*this, id);
  auto record = wish(id, Wish::stop);
  if (record && (record->state == ChainState::paused || record->state == ChainState::failed)) {
    set_state(id, ChainState::finished, "stop", record->error);
    record = chain(id);
  }
  return record;
}

std::optional<ChainRecord> Runner::resume(std::string_view id) {
  const Turn turn(*this, id);
  auto record = chain(id);
  if (!record) return record;
  // Whose world went on without it: the library says so.
  if (record->ended_by == kEndedByVersion) library_.find(record->scenario);
  if (record->state == ChainState::paused || record->state == ChainState::failed) {
    {
      // The store may know that it failed before its thread has let go of it.
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return draining_ || !live_.contains(id); });
    }
    record->error.clear();
    make_live(*record);
    record = chain(id);
  }
  return record;
}

bool Runner::may_go_on(const ChainRecord& record, const StopRule& stop) {
  const ChainCounters& counters = record.counters;
  const bool is_before =
      limit_reached(stop, counters, counters).empty() &&
      !(stop.ess && counters.effective_samples.value_or(0) >= static_cast<double>(*stop.ess));
  if (record.state == ChainState::finished)
    return record.ended_by != kEndedByVersion && record.ended_by != "stock" && is_before;
  if (record.state == ChainState::queued || record.state == ChainState::running)
    return allows_more(stop, record.stop);
  return is_before;
}

std::optional<ChainRecord> Runner::go_on(std::string_view id, const StopRule& stop) {
  const Turn turn(*this, id);
  auto record = chain(id);
  if (!record || !may_go_on(*record, stop)) return record;
  wish(id, Wish::pause);
  store_.set_chain_stop(id, stop);
  record = chain(id);
  if (!record) return record;
  record->error.clear();
  make_live(*record);
  return chain(id);
}

void Runner::drop_scenario(std::string_view scenario) {
  // Those that are added meanwhile end with their first commit after the scenario is gone.
  std::unique_lock lock(mutex_);
  Lives dropped;
  for (const auto& [id, live] : live_)
    if (live->chain.scenario() == scenario) {
      live->wish = Wish::drop;
      dropped.push_back(live);
    }
  wait_for(lock, dropped, [&] {
    for (const std::shared_ptr<Live>& live : dropped)
      if (take(live)) live_.erase(live->chain.id());
    return draining_ ||
           std::none_of(dropped.begin(), dropped.end(), [this](const auto& live) { return is_live(live); });
  });
  changed_.notify_all();
}

void Runner::drain() {
  {
    std::unique_lock lock(mutex_);
    draining_ = true;
    work_.notify_all();
    changed_.notify_all();
    Lives all;
    for (const auto& [id, live] : live_)
      all.push_back(live);
    wait_for(lock, all, [&] {
      return std::none_of(all.begin(), all.end(),
                          [this](const auto& live) { return live->in_slice && is_live(live); });
    });
  }
  threads_.clear();  // joins

  // Submit all, then wait: they are committed together.
  const auto try_for = [](LiveChain& chain, const auto& work) {
    try {
      work(chain);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "retake: chain %s loses its last moments, which it will find again: %s\n",
                   chain.id().c_str(), error.what());
    }
  };
  for (const auto& [id, live] : live_)
    try_for(live->chain, [](LiveChain& chain) {
      if (!chain.restore()) return;
      chain.settle(true);
      if (!chain.is_handed_over()) chain.hand_over(std::nullopt, "");
    });
  for (const auto& [id, live] : live_)
    try_for(live->chain, [](LiveChain& chain) { chain.settle(true); });
  live_.clear();
  queue_.clear();
}

Runner::Counters Runner::counters() const {
  const std::lock_guard lock(mutex_);
  return {.iterations = iterations_,
          .samples = samples_,
          .simulations = simulations_,
          .failed_simulations = failed_simulations_,
          .live_chains = live_.size()};
}

}  // namespace retake
