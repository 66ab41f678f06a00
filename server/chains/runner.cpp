// See runner.h.
#include "server/chains/runner.h"

#include <algorithm>
#include <cstdio>
#include <sys/resource.h>
#include <unistd.h>
#include <utility>

#include "server/chains/health.h"

namespace retake {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;

constexpr duration<double> kSlice{0.02};           // chosen: a person's click is answered at once
constexpr duration<double> kBetweenCommits{0.25};  // chosen: what a page shows of a chain is at most this old
constexpr std::size_t kSamplesPerCommit = 32;
constexpr std::size_t kMostGathered = 256;  // a chain waits for its commit when it has gathered this many

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

/// The run of a stored chain, from its last checkpoint.
std::unique_ptr<ChainRun> Runner::make_run(const ChainRecord& record) const {
  const auto scenario = library_.find(record.scenario);
  if (!scenario) throw std::runtime_error("its scenario is gone");
  ChainRun::Stored stored{.checkpoint = store_.checkpoint(record.id),
                          .trace_blocks = store_.trace(record.id)};
  if (record.lesson > 0) {
    const auto lesson = store_.lesson(record.scenario, record.lesson);
    if (!lesson || lesson->version != kLessonVersion)
      throw std::runtime_error("lesson " + std::to_string(record.lesson) + " cannot be read here");
    stored.lesson = lesson->bytes;
  }
  return std::make_unique<ChainRun>(scenario, record, stored);
}

/// Queues a stored chain.
void Runner::make_live(const ChainRecord& record) {
  const auto live = std::make_shared<Live>();
  live->id = record.id;
  live->scenario = record.scenario;
  live->run = make_run(record);
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
  live_.erase(live->id);
  changed_.notify_all();
}

void Runner::fail(const std::shared_ptr<Live>& live, const std::string& error) {
  std::fprintf(stderr, "retake: chain %s failed: %s\n", live->id.c_str(), error.c_str());
  try {
    set_state(live->id, ChainState::failed, "", error);
  } catch (const StoreError&) {
    // The store may be what failed. The failure is shown from memory; a restart takes the chain up again.
    const std::lock_guard lock(mutex_);
    unsaved_failures_[live->id] = error;
    events_.chain_changed(live->id);
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
    if (live->is_stale) go_back(*live);
    end_if_wished(live);
  } catch (const StoreUnavailable&) {
    hold(live, Wish::run);
    throw;
  } catch (const std::exception& error) {
    fail(live, error.what());
  }
}

bool Runner::is_live(const std::shared_ptr<Live>& live) const {
  const auto now = live_.find(live->id);
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
    if (live->scenario == scenario) {
      live->wish = Wish::drop;
      dropped.push_back(live);
    }
  wait_for(lock, dropped, [&] {
    for (const std::shared_ptr<Live>& live : dropped)
      if (take(live)) live_.erase(live->id);
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
  const auto try_for = [](Live& live, const auto& work) {
    try {
      work(live);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "retake: chain %s loses its last moments, which it will find again: %s\n",
                   live.id.c_str(), error.what());
    }
  };
  for (const auto& [id, live] : live_)
    try_for(*live, [this](Live& each) {
      if (each.is_stale) go_back(each);
      settle_commit(each, true);
      if (!is_all_handed_over(each)) hand_over(each, std::nullopt, "");
    });
  for (const auto& [id, live] : live_)
    try_for(*live, [this](Live& each) { settle_commit(each, true); });
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

// --- The threads --------------------------------------------------------------------------------

void Runner::work() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
  Performers performers;  // of the scenarios stepped last; their scratch memory is reused
  constexpr std::size_t kMostPerformers = 8;
  while (const std::shared_ptr<Live> live = next_chain()) {
    const auto& scenario = live->run->scenario();
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
      if ((*place)->wish != Wish::run) continue;  // whoever wishes takes it
      if ((*place)->is_stale && is_store_failing) continue;
      const ChainRun& run = *(*place)->run;
      const bool waits = run.gathered() >= kMostGathered || run.awaits_judgement();
      const bool held_up = waits && (*place)->commit.valid() &&
                           (*place)->commit.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
      if (held_up) continue;
      std::shared_ptr<Live> live = *place;
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
  bool is_usable = true;
  try {
    if (live->is_stale) go_back(*live);

    // Step, unless something else is wished; whoever wishes waits for the chain.
    if (live->run->ended_by().empty() && !live->run->awaits_judgement()) is_usable = step(*live, performer);
    if (!is_usable || wish_of(*live) != Wish::run) {
      give_back(live);
      return is_usable;
    }

    // Hand over what there is, when it is time.
    const bool is_deleted = !settle_commit(*live, false);
    if (is_deleted) {
      leave(live);
      return is_usable;
    }
    const bool is_all_stored = !live->commit.valid() && is_all_handed_over(*live);
    if (live->run->awaits_judgement() && wish_of(*live) == Wish::run && is_all_stored) judge(*live);
    if (end_if_wished(live)) return is_usable;
    const std::size_t gathered = live->run->gathered();
    const bool behind = live->commit.valid();
    // Somebody may be waiting for the first ones.
    const bool is_first = gathered > 0 && gathered == live->run->record().counters.samples;
    if (!behind && (is_first || gathered >= kSamplesPerCommit || live->run->awaits_judgement() ||
                    Clock::now() - live->committed_at >= kBetweenCommits))
      hand_over(*live, std::nullopt, "");
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
  if (!live.is_noted) set_state(live.id, ChainState::running, "", "");
  live.is_noted = true;

  // Whoever wishes something from here on can interrupt.
  const auto publish = [&](Interruption* interruption) {
    const std::lock_guard lock(mutex_);
    performer.interruption().withdraw();
    live.interruption = interruption;
    return live.wish == Wish::run && !draining_;
  };
  const ChainCounters before = live.run->record().counters;
  const bool may_step = publish(&performer.interruption());
  try {
    if (may_step) live.run->step_for(performer, kSlice, kMostGathered);
  } catch (const Interrupted&) {
    live.is_stale = true;
    publish(nullptr);
    return false;
  } catch (...) {
    publish(nullptr);
    throw;
  }
  publish(nullptr);
  count(before, live.run->record().counters);
  return true;
}

/// To its last commit, as after a restart.
void Runner::go_back(Live& live) {
  if (live.commit.valid()) live.commit.wait();
  live.commit = {};  // if it failed, this is why it goes back
  const auto record = store_.chain(live.id);
  if (!record) return;  // it was deleted; whoever did so has dropped it
  live.run = make_run(*record);
  live.is_stale = false;
  live.handed_over_at.reset();  // what it is, is committed again: then it is known to have done no harm
}

void Runner::hold(const std::shared_ptr<Live>& live, std::optional<Wish> wish) {
  live->is_stale = true;
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
  const ChainRun& run = *live->run;
  std::string_view ended_by = run.ended_by();
  if (wish == Wish::stop && ended_by.empty()) ended_by = "stop";
  if (ended_by.empty() && run.gathered() > 0 &&
      store_.sample_count(live->scenario) >= settings_.most_samples_per_scenario)
    ended_by = "stock";
  if (ended_by.empty() && wish != Wish::pause) return false;
  settle_commit(*live, true);
  hand_over(*live, ended_by.empty() ? ChainState::paused : ChainState::finished, ended_by);
  settle_commit(*live, true);
  leave(live);
  return true;
}

bool Runner::is_all_handed_over(const Live& live) {
  return live.handed_over_at == live.run->record().counters.iteration;
}

Runner::Wish Runner::wish_of(const Live& live) const {
  const std::lock_guard lock(mutex_);
  return live.wish;
}

bool Runner::settle_commit(Live& live, bool wait) {
  if (!live.commit.valid()) return true;
  if (!wait && live.commit.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return true;
  const bool has_samples = live.commit.get() > 0;
  if (!has_samples && !store_.chain(live.id))
    return false;  // its scenario was deleted while it was being added
  events_.chain_changed(live.id);
  events_.scenario_changed(live.scenario);
  return true;
}

void Runner::hand_over(Live& live, std::optional<ChainState> state, std::string_view ended_by) {
  ChainProgress progress = live.run->take_progress(state == ChainState::finished);
  progress.state = state;
  progress.ended_by = ended_by;
  live.commit = store_.commit(std::move(progress));
  live.committed_at = Clock::now();
  live.handed_over_at = live.run->record().counters.iteration;
}

void Runner::judge(Live& live) {
  const ChainRecord& record = live.run->record();
  live.run->judge(
      effective_samples(*live.run->scenario(), record, [&](std::size_t most, std::uint64_t from_iteration) {
        return store_.draws(record.id, most, from_iteration);
      }));
}

void Runner::count(const ChainCounters& before, const ChainCounters& after) {
  iterations_ += after.iteration - before.iteration;
  samples_ += after.samples - before.samples;
  simulations_ += after.simulations - before.simulations;
  failed_simulations_ += after.failed_simulations - before.failed_simulations;
}

}  // namespace retake
