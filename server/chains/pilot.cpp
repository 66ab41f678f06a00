// See pilot.h.
#include "server/chains/pilot.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <sys/resource.h>
#include <unistd.h>

#include "sampler/check.h"
#include "server/chains/runner.h"

namespace retake {
namespace {

constexpr std::uint64_t kSeed = 0;        // no chain's draws need to be told from these
constexpr double kBetweenLooks = 0.0005;  // [s], chosen: reading the clock then costs nothing

/// [s] of CPU time that this thread has taken.
double thread_seconds() {
  std::timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

Pilot::Pilot(Store& store, ScenarioLibrary& library, EventHub& events, Settings settings)
    : store_(store), library_(library), events_(events), settings_(std::move(settings)) {
  thread_ = std::jthread([this] { work(); });
}

Pilot::~Pilot() {
  drain();
}

void Pilot::add(std::string_view scenario) {
  // Somebody looks at what was created last.
  const std::lock_guard lock(mutex_);
  queue_.emplace_front(scenario);
  changed_.notify_one();
}

void Pilot::add_missing() {
  const std::vector<std::string> missing = store_.scenarios_without_pilot();
  const std::lock_guard lock(mutex_);
  for (auto id = missing.rbegin(); id != missing.rend(); ++id)
    if (std::find(queue_.begin(), queue_.end(), *id) == queue_.end()) queue_.push_back(*id);
  changed_.notify_one();
}

void Pilot::drain() {
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    if (interruption_) interruption_->ask();
    changed_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void Pilot::work() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), Runner::kNiceness);
  while (const auto id = next_scenario()) {
    try {
      look_at(*id);
    } catch (const Interrupted&) {
      return;  // it is the end
    } catch (const std::exception& error) {
      std::fprintf(stderr, "retake: scenario %s has no pilot: %s\n", id->c_str(), error.what());
    }
  }
}

/// Waits for one. None at the end.
std::optional<std::string> Pilot::next_scenario() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return draining_ || !queue_.empty(); });
  if (draining_) return std::nullopt;
  std::string id = std::move(queue_.front());
  queue_.pop_front();
  return id;
}

void Pilot::look_at(const std::string& id) {
  const auto scenario = library_.find(id);
  if (!scenario) return;  // it was deleted
  check_context() = {.scenario = id, .chain = "pilot", .iteration = 0};
  const auto found = draw(*scenario);
  check_context() = {};
  if (found && store_.set_pilot(id, *found)) events_.scenario_changed(id);
}

/// While this lives, drain() interrupts.
class Pilot::Interruptible {
 public:
  Interruptible(Pilot& pilot, Interruption& interruption) : pilot_(pilot) {
    const std::lock_guard lock(pilot_.mutex_);
    pilot_.interruption_ = &interruption;
    if (pilot_.draining_) interruption.ask();
  }
  ~Interruptible() {
    const std::lock_guard lock(pilot_.mutex_);
    pilot_.interruption_ = nullptr;
  }
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  Pilot& pilot_;
};

/// None if there was no time to finish. Throws: Interrupted.
std::optional<PilotTally> Pilot::draw(const Scenario& scenario) {
  const auto performer = scenario.make_performer();
  const Interruptible interruptible(*this, performer->interruption());
  Chain chain(scenario.target(Ratios::exact), {.seed = kSeed, .method = Method::rejection});
  const double begin = thread_seconds();
  double now = begin;
  std::uint64_t steps_between_clocks = 1;
  OddsTally tally;
  while (now - begin < settings_.seconds && tally.hits < settings_.most_hits) {
    if (draining_) return std::nullopt;
    for (std::uint64_t i = 0; i < steps_between_clocks && tally.hits < settings_.most_hits; ++i) {
      chain.step(*performer);
      tally = settings_.tally(chain.counts());
    }
    const double round = now;
    now = thread_seconds();
    if (now - round < kBetweenLooks / 2)
      steps_between_clocks *= 2;
    else if (now - round > kBetweenLooks && steps_between_clocks > 1)
      steps_between_clocks /= 2;
  }
  return PilotTally{.draws = tally.draws, .hits = tally.hits, .seconds = now - begin};
}

}  // namespace retake
