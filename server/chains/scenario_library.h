// ScenarioLibrary: the compiled Scenario of every stored scenario that is in use.
// It must not know chains or HTTP.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "db/store.h"
#include "worlds/scenario.h"

namespace retake {

/// The id of a scenario: 20 characters of the SHA-256 of its document, so that equal documents have equal
/// ids.
std::string scenario_id(const nlohmann::json& document);

/// The record of a scenario that is new. `created_at` is now.
ScenarioRecord new_scenario_record(const Scenario& scenario);

/// A stored scenario whose world is gone or has another version here: what was found plays on, but cannot be
/// simulated again, and nothing more can be found.
class OtherVersion : public std::runtime_error {
 public:
  explicit OtherVersion(const ScenarioRecord& record);
};

/// A stored scenario whose document its world refuses now.
class RefusedDocument : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Whether one of the worlds on offer is that of a stored scenario, in the version for which it was made.
bool has_world_of(const ScenarioRecord& record, const std::vector<const World*>& offered = worlds());

/// Compiles a stored document. Throws: OtherVersion unless has_world_of(record); RefusedDocument.
std::shared_ptr<const Scenario> compile_stored(const ScenarioRecord& record,
                                               const std::vector<const World*>& offered = worlds());

/// Thread safety: every method may be called from any thread.
class ScenarioLibrary {
 public:
  explicit ScenarioLibrary(const Store& store, std::vector<const World*> offered = worlds())
      : store_(store), offered_(std::move(offered)) {}
  bool has_world_of(const ScenarioRecord& record) const { return retake::has_world_of(record, offered_); }
  /// Null if there is no such scenario. Throws: as compile_stored; Damaged.
  std::shared_ptr<const Scenario> find(std::string_view id);
  /// Null also for one that this build cannot run: its world has another version here or refuses it, or it
  /// is damaged.
  std::shared_ptr<const Scenario> find_runnable(std::string_view id);
  void forget(std::string_view id);

 private:
  const Store& store_;
  const std::vector<const World*> offered_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const Scenario>, std::less<>> compiled_;
};

}  // namespace retake
