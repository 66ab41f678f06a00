// ScenarioLibrary: the compiled Scenario of every stored scenario that is in use.
// It must not know chains or HTTP.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>

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

/// Whether this build has the world of a stored scenario in the version for which it was made.
bool has_world_of(const ScenarioRecord& record);

/// Compiles a stored document. Throws: OtherVersion unless has_world_of(record); std::runtime_error if the
/// world refuses the document.
std::shared_ptr<const Scenario> compile_stored(const ScenarioRecord& record);

/// Thread safety: every method may be called from any thread.
class ScenarioLibrary {
 public:
  explicit ScenarioLibrary(const Store& store) : store_(store) {}
  /// Null if there is no such scenario. Throws: as compile_stored.
  std::shared_ptr<const Scenario> find(std::string_view id);
  /// False: there is no such scenario, or its world has another version here.
  bool runs(std::string_view id);
  void forget(std::string_view id);

 private:
  const Store& store_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const Scenario>, std::less<>> compiled_;
};

}  // namespace retake
