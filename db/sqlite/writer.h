// Writer: the one thread with the one connection that writes, and the queue of jobs before it.
// Realises doc/design.md, section 5: jobs are committed in groups. Knows nothing of the tables.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "db/sqlite/connection.h"

namespace retake::database {

/// When a job is committed, and what its commit survives.
enum class Urgency {
  batched,    ///< with a group of its like; a power cut
  immediate,  ///< with the next group; a power cut
  play,       ///< with the next group; a killed process, and a power cut a moment later
};

/// Thread safety: every method may be called from any thread. Jobs run one after another on the writer's
/// thread: batched and immediate ones in the order of submission, plays among themselves likewise.
class Writer {
 public:
  struct Options {
    std::string path;  ///< as errors name it
    std::size_t batch_rows = 32;
    std::chrono::duration<double> batch_time{0.05};
    std::function<void()> rolled_back;        ///< called on the writer's thread when a job was undone
    std::function<bool(Connection&)> upkeep;  ///< run while idle until it gives false
    /// Opens the connection, if there is none yet; tried until it succeeds.
    std::function<std::unique_ptr<Connection>()> open;
    /// What is wrong with the file, empty if nothing. Nothing is written before it is put right.
    std::function<std::string(const Connection&)> inspect;
    std::function<void(const std::string&)> tell;  ///< see StoreOptions
  };

  /// Without a connection `reason` says why there is none.
  Writer(std::unique_ptr<Connection> connection, const std::string& reason, Options options);
  /// Commits what is queued.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Queues a job. The future holds what `work` gave once that is committed, or why it is not: a StoreError
  /// where the database failed, else what `work` threw. A job that throws is undone alone.
  template <typename Work>
  auto submit(Urgency urgency, std::size_t rows, const char* operation, Work work) {
    auto job = std::make_unique<TypedJob<Work>>(std::move(work));
    job->urgency = urgency;
    job->rows = rows;
    job->operation = operation;
    auto future = job->promise.get_future();
    enqueue(std::move(job));
    return future;
  }
  /// Runs upkeep again.
  void wake_upkeep();

  std::string last_error() const;
  std::uint64_t queued_jobs() const;
  std::uint64_t failed_jobs() const;

 private:
  using Clock = std::chrono::steady_clock;

  struct Job {
    virtual ~Job() = default;
    virtual void run(Connection& connection) = 0;
    virtual void succeed() = 0;
    virtual void fail(std::exception_ptr error) = 0;

    Urgency urgency = Urgency::batched;
    std::size_t rows = 0;
    const char* operation = "";
    Clock::time_point queued_at;
    std::exception_ptr error;
    bool refused = false;  // the error is of the work's own
  };
  template <typename Work>
  struct TypedJob : Job {
    using Result = std::invoke_result_t<Work, Connection&>;
    explicit TypedJob(Work its_work) : work(std::move(its_work)) {}
    void run(Connection& connection) override { result.emplace(work(connection)); }
    void succeed() override { promise.set_value(*std::move(result)); }
    void fail(std::exception_ptr reason) override { promise.set_exception(std::move(reason)); }

    Work work;
    std::optional<Result> result;
    std::promise<Result> promise;
  };
  using Group = std::vector<std::unique_ptr<Job>>;

  void enqueue(std::unique_ptr<Job> job);
  void write_until_stopped();
  bool batch_due(Clock::time_point time) const;
  Clock::time_point next_duty() const;
  std::optional<Group> next_group();
  void commit(Group group);
  void run_alone(Job& job, std::string& last_failure);
  void require_sound();
  void look_after_file(bool busy);
  void postpone_duties();
  void flush_plays();
  void checkpoint_if_long();
  void keep_up(bool busy);
  void write_durably(bool durably);
  std::string explain(const char* operation, const std::exception& reason) const;
  static std::exception_ptr failure(const std::string& text, const std::exception& reason);
  void note_error(const std::string& error);
  void tell_if_turned(const std::string& before, const std::string& after) const;

  std::unique_ptr<Connection> connection_;  ///< null until it can be opened
  const Options options_;

  // Shared with the callers.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::unique_ptr<Job>> writes_;  // batched and immediate
  std::deque<std::unique_ptr<Job>> plays_;
  std::size_t queued_rows_ = 0;
  std::size_t queued_immediate_ = 0;
  std::size_t in_progress_ = 0;
  std::uint64_t failed_jobs_ = 0;
  std::string last_error_;
  bool upkeep_pending_ = true;
  bool stopping_ = false;

  // The writer's thread's own.
  std::optional<Clock::time_point> flush_at_;  // plays wait to reach the disk
  Clock::time_point upkeep_at_{};
  Clock::time_point look_at_{};
  bool is_sound_ = true;
  std::size_t checkpointed_pages_ = 0;
  bool durably_ = true;

  std::jthread thread_;
};

}  // namespace retake::database
