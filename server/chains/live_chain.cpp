// See live_chain.h.
#include "server/chains/live_chain.h"

#include <stdexcept>
#include <utility>

#include "server/chains/health.h"

namespace retake {

LiveChain::LiveChain(Store& store, ScenarioLibrary& library, EventHub& events, const ChainRecord& record)
    : store_(store),
      library_(library),
      events_(events),
      id_(record.id),
      scenario_(record.scenario),
      run_(make_run(record)) {}

std::unique_ptr<ChainRun> LiveChain::make_run(const ChainRecord& record) const {
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

bool LiveChain::restore() {
  if (!is_spoiled_) return true;
  if (commit_.valid()) commit_.wait();
  commit_ = {};  // if it failed, this is why it goes back
  const auto record = store_.chain(id_);
  if (!record) return false;
  run_ = make_run(*record);
  is_spoiled_ = false;
  handed_over_at_.reset();  // what it is, is committed again: then it is known to have done no harm
  return true;
}

void LiveChain::hand_over(std::optional<ChainState> state, std::string_view ended_by) {
  ChainProgress progress = run_->take_progress(state == ChainState::finished);
  progress.state = state;
  progress.ended_by = ended_by;
  commit_ = store_.commit(std::move(progress));
  handed_over_time_ = std::chrono::steady_clock::now();
  handed_over_at_ = run_->record().counters.iteration;
}

bool LiveChain::is_committing() const {
  return commit_.valid() && commit_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

bool LiveChain::settle(bool waits) {
  if (!commit_.valid() || (!waits && is_committing())) return true;
  const bool has_samples = commit_.get() > 0;
  if (!has_samples && !store_.chain(id_)) return false;  // its scenario was deleted while it was being added
  events_.chain_changed(id_);
  events_.scenario_changed(scenario_);
  return true;
}

void LiveChain::judge() {
  const ChainRecord& record = run_->record();
  run_->judge(
      effective_samples(*run_->scenario(), record, [&](std::size_t most, std::uint64_t from_iteration) {
        return store_.draws(record.id, most, from_iteration);
      }));
}

}  // namespace retake
