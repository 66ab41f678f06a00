// The writer's loop: take a group of jobs, commit it, see to what is due.
// Realises doc/design.md, section 5.
#include "db/sqlite/writer.h"

#include <algorithm>

#include "db/errors.h"

namespace retake::database {
namespace {

using std::chrono::milliseconds;

// Plays reach the disk so long after their commit at the latest; half of what the Store promises.
constexpr milliseconds kFlushAfter{500};
// A failed duty is tried again after this; chosen.
constexpr milliseconds kRetryAfter{1000};
// The file is looked at so often without a write; half of what the Store promises.
constexpr milliseconds kBetweenLooks{500};
// Between two slices of upkeep while there is other work; chosen.
constexpr milliseconds kUpkeepPause{50};
// A group takes no more than this, so that the first of a long queue does not wait for the last; chosen.
constexpr std::size_t kMostRows = 512;
constexpr std::size_t kMostPlays = 256;
// The write-ahead log is checkpointed each time it has grown by so many pages (2 MB). A checkpoint holds up
// the plays under way while it flushes what has gathered: measured, 20 ms at 16 MB and 5 ms at 2 MB, and a
// play dirties some eight pages.
constexpr std::size_t kCheckpointPages = 500;

}  // namespace

Writer::Writer(std::unique_ptr<Connection> connection, const std::string& reason, Options options)
    : connection_(std::move(connection)), options_(std::move(options)) {
  if (!connection_) note_error(explain("commit to", std::runtime_error(reason)));
  thread_ = std::jthread([this] { write_until_stopped(); });
}

Writer::~Writer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Writer::enqueue(std::unique_ptr<Job> job) {
  {
    const std::lock_guard lock(mutex_);
    job->queued_at = Clock::now();
    if (job->urgency == Urgency::play) {
      plays_.push_back(std::move(job));
    } else {
      queued_rows_ += job->rows;
      queued_immediate_ += job->urgency == Urgency::immediate ? 1 : 0;
      writes_.push_back(std::move(job));
    }
  }
  changed_.notify_one();
}

void Writer::wake_upkeep() {
  {
    const std::lock_guard lock(mutex_);
    upkeep_pending_ = true;
  }
  changed_.notify_one();
}

std::string Writer::last_error() const {
  const std::lock_guard lock(mutex_);
  return last_error_;
}

std::uint64_t Writer::queued_jobs() const {
  const std::lock_guard lock(mutex_);
  return writes_.size() + plays_.size() + in_progress_;
}

std::uint64_t Writer::failed_jobs() const {
  const std::lock_guard lock(mutex_);
  return failed_jobs_;
}

void Writer::write_until_stopped() {
  while (auto group = next_group()) {
    const bool busy = !group->empty();
    if (look_at_ <= Clock::now()) look_after_file(busy);
    if (busy) commit(*std::move(group));
    if (!connection_ || !is_sound_) {
      postpone_duties();
      continue;
    }
    if (flush_at_ && *flush_at_ <= Clock::now()) flush_plays();
    checkpoint_if_long();
    keep_up(busy);
  }
  if (!connection_) return;
  is_sound_ = options_.inspect(*connection_).empty();
  if (is_sound_ && flush_at_) flush_plays();
  // The log's name may be another file's by now.
  if (!is_sound_) connection_->leave_log();
}

// Requires: mutex_ is held, as for the next two.
bool Writer::batch_due(Clock::time_point time) const {
  if (writes_.empty()) return false;
  return stopping_ || queued_immediate_ > 0 || queued_rows_ >= options_.batch_rows ||
         time - writes_.front()->queued_at >= options_.batch_time;
}

Writer::Clock::time_point Writer::next_duty() const {
  auto duty = look_at_;
  if (flush_at_) duty = std::min(duty, *flush_at_);
  if (upkeep_pending_) duty = std::min(duty, upkeep_at_);
  return duty;
}

// Waits for work. An empty group: there is no job but a duty; none: stopped, and everything is done.
std::optional<Writer::Group> Writer::next_group() {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto time = Clock::now();
    if (batch_due(time) || !plays_.empty()) break;
    if (stopping_) return std::nullopt;
    auto until = next_duty();
    if (until <= time) return Group{};
    if (!writes_.empty())
      until = std::min(until,
                       writes_.front()->queued_at + std::chrono::ceil<Clock::duration>(options_.batch_time));
    changed_.wait_until(lock, until);
  }

  Group group;
  if (batch_due(Clock::now())) {
    for (std::size_t rows = 0; !writes_.empty() && rows < kMostRows; writes_.pop_front()) {
      auto& job = writes_.front();
      rows += std::max<std::size_t>(job->rows, 1);
      queued_rows_ -= job->rows;
      queued_immediate_ -= job->urgency == Urgency::immediate ? 1 : 0;
      group.push_back(std::move(job));
    }
  }
  for (std::size_t count = 0; !plays_.empty() && count < kMostPlays; ++count, plays_.pop_front()) {
    group.push_back(std::move(plays_.front()));
  }
  in_progress_ = group.size();
  return group;
}

void Writer::commit(Group group) {
  const bool only_plays =
      std::all_of(group.begin(), group.end(), [](const auto& job) { return job->urgency == Urgency::play; });
  std::string last_failure;
  try {
    require_sound();
    write_durably(!only_plays);
    Transaction transaction(*connection_, Transaction::Kind::write);
    for (auto& job : group)
      run_alone(*job, last_failure);
    // A commit that changes nothing would not reach the disk, and so not flush the plays before it.
    if (!only_plays && flush_at_) run(*connection_, "UPDATE flush SET count = count IS NOT 1");
    transaction.commit();
    if (!only_plays) {
      flush_at_.reset();
    } else if (!flush_at_) {
      flush_at_ = Clock::now() + kFlushAfter;
    }
  } catch (const std::exception& error) {
    last_failure = explain("commit to", error);
    for (auto& job : group)
      job->error = failure(last_failure, error);
    options_.rolled_back();
  }

  // Say so only when everything that callers may ask for agrees.
  std::string before;
  {
    const std::lock_guard lock(mutex_);
    in_progress_ = 0;
    failed_jobs_ += static_cast<std::uint64_t>(std::count_if(
        group.begin(), group.end(), [](const auto& job) { return job->error && !job->refused; }));
    before = std::exchange(last_error_, last_failure);
  }
  tell_if_turned(before, last_failure);
  for (auto& job : group) {
    if (job->error) {
      job->fail(std::move(job->error));
    } else {
      job->succeed();
    }
  }
}

// Runs a job such that its failure undoes nothing but itself.
void Writer::run_alone(Job& job, std::string& last_failure) {
  database::run(*connection_, "SAVEPOINT job");
  try {
    job.run(*connection_);
  } catch (...) {
    // Some failures have undone the whole transaction.
    if (!connection_->in_transaction()) throw;
    database::run(*connection_, "ROLLBACK TO job");
    options_.rolled_back();
    try {
      throw;
    } catch (const DatabaseError& error) {
      last_failure = explain(job.operation, error);
      job.error = failure(last_failure, error);
    } catch (...) {
      job.error = std::current_exception();
      job.refused = true;
    }
  }
  database::run(*connection_, "RELEASE job");
}

/// Throws: DatabaseError.
void Writer::require_sound() {
  if (!connection_) connection_ = options_.open();
  const std::string fault = options_.inspect(*connection_);
  is_sound_ = fault.empty();
  if (!is_sound_) throw DatabaseError(DatabaseError::Kind::unavailable, fault);
}

/// So that what goes wrong, and right again, is known without a write. A write that comes anyway will tell.
void Writer::look_after_file(bool busy) {
  look_at_ = Clock::now() + kBetweenLooks;
  try {
    require_sound();
    if (busy || last_error().empty()) return;
    write_durably(true);
    Transaction transaction(*connection_, Transaction::Kind::write);
    database::run(*connection_, "UPDATE flush SET count = count IS NOT 1");
    transaction.commit();
    flush_at_.reset();
    note_error("");
  } catch (const std::exception& error) {
    note_error(explain("commit to", error));
  }
}

void Writer::postpone_duties() {
  const auto later = Clock::now() + kRetryAfter;
  if (flush_at_) flush_at_ = later;
  upkeep_at_ = later;
}

void Writer::flush_plays() {
  try {
    write_durably(true);
    Transaction transaction(*connection_, Transaction::Kind::write);
    database::run(*connection_, "UPDATE flush SET count = count IS NOT 1");
    transaction.commit();
    flush_at_.reset();
  } catch (const std::exception& error) {
    note_error(explain("flush plays to", error));
    flush_at_ = Clock::now() + kRetryAfter;
  }
}

void Writer::checkpoint_if_long() {
  const auto pages = connection_->log_pages();
  if (pages < checkpointed_pages_) checkpointed_pages_ = 0;  // the log has begun anew
  if (pages - checkpointed_pages_ < kCheckpointPages) return;
  checkpointed_pages_ = pages;
  try {
    connection_->checkpoint();
  } catch (const std::exception& error) {
    note_error(explain("checkpoint", error));
  }
}

void Writer::keep_up(bool busy) {
  {
    const std::lock_guard lock(mutex_);
    if (!upkeep_pending_ || Clock::now() < upkeep_at_) return;
    upkeep_pending_ = false;
  }
  bool more = true;
  try {
    write_durably(false);
    Transaction transaction(*connection_, Transaction::Kind::write);
    more = options_.upkeep(*connection_);
    transaction.commit();
    upkeep_at_ = busy ? Clock::now() + kUpkeepPause : Clock::now();
  } catch (const std::exception& error) {
    note_error(explain("purge", error));
    upkeep_at_ = Clock::now() + kRetryAfter;
  }
  if (more) wake_upkeep();
}

void Writer::write_durably(bool durably) {
  if (durably == durably_) return;
  connection_->execute(durably ? "PRAGMA synchronous = FULL" : "PRAGMA synchronous = NORMAL");
  durably_ = durably;
}

std::string Writer::explain(const char* operation, const std::exception& reason) const {
  return std::string("store: cannot ") + operation + " " + options_.path + ": " + reason.what();
}

std::exception_ptr Writer::failure(const std::string& text, const std::exception& reason) {
  const auto* error = dynamic_cast<const DatabaseError*>(&reason);
  if (error && error->kind() != DatabaseError::Kind::unavailable)
    return std::make_exception_ptr(StoreError(text));
  return std::make_exception_ptr(StoreUnavailable(text));
}

void Writer::note_error(const std::string& error) {
  std::string before;
  {
    const std::lock_guard lock(mutex_);
    before = std::exchange(last_error_, error);
  }
  tell_if_turned(before, error);
}

void Writer::tell_if_turned(const std::string& before, const std::string& after) const {
  if (options_.tell && before.empty() != after.empty()) options_.tell(after);
}

}  // namespace retake::database
