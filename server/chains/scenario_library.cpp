// See scenario_library.h.
#include "server/chains/scenario_library.h"

#include <algorithm>
#include <stdexcept>

#include "server/chains/identifiers.h"

namespace retake {

std::string scenario_id(const nlohmann::json& document) {
  return digest_identifier(document.dump(), 20);
}

ScenarioRecord new_scenario_record(const Scenario& scenario) {
  ScenarioRecord record;
  record.id = scenario_id(scenario.document());
  record.world = scenario.world().name();
  record.world_version = scenario.world().version();
  record.title = scenario.title();
  record.document = scenario.document().dump();
  record.created_at = now_milliseconds();
  return record;
}

OtherVersion::OtherVersion(const ScenarioRecord& record)
    : std::runtime_error("it was made for " + record.world + " version " +
                         std::to_string(record.world_version) + ", which this program does not have") {}

bool has_world_of(const ScenarioRecord& record, const std::vector<const World*>& offered) {
  return std::any_of(offered.begin(), offered.end(), [&](const World* world) {
    return world->name() == record.world && world->version() == record.world_version;
  });
}

std::shared_ptr<const Scenario> compile_stored(const ScenarioRecord& record,
                                               const std::vector<const World*>& offered) {
  if (!has_world_of(record, offered)) throw OtherVersion(record);
  nlohmann::json document = nlohmann::json::parse(record.document);
  document.erase("world_version");
  try {
    return Scenario::read(document, offered);
  } catch (const InvalidRequest& fault) {
    throw RefusedDocument("scenario " + record.id + " cannot be read: " + fault.what());
  }
}

std::shared_ptr<const Scenario> ScenarioLibrary::find(std::string_view id) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = compiled_.find(id); found != compiled_.end()) return found->second;
  }
  const auto record = store_.scenario(id);
  if (!record) return nullptr;
  auto scenario = compile_stored(*record, offered_);
  const std::lock_guard lock(mutex_);
  return compiled_.try_emplace(std::string(id), std::move(scenario)).first->second;
}

std::shared_ptr<const Scenario> ScenarioLibrary::find_runnable(std::string_view id) {
  try {
    return find(id);
  } catch (const OtherVersion&) {
    return nullptr;
  } catch (const RefusedDocument&) {
    return nullptr;
  } catch (const Damaged&) {
    return nullptr;
  }
}

void ScenarioLibrary::forget(std::string_view id) {
  const std::lock_guard lock(mutex_);
  if (const auto found = compiled_.find(id); found != compiled_.end()) compiled_.erase(found);
}

}  // namespace retake
