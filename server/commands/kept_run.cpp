// See kept_run.h.
#include "server/commands/kept_run.h"

#include <filesystem>
#include <utility>

#include "db/open_store.h"
#include "server/chains/scenario_library.h"
#include "server/commands/command_line.h"
#include "worlds/words.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr const char* kFile = "run.db";
constexpr std::size_t kSamplesAtOnce = 500;

std::string path_in(const std::string& folder) {
  return (std::filesystem::path(folder) / kFile).string();
}

/// Deletes a store with what is kept beside it.
void remove_store(const std::string& path) {
  for (const char* beside : {"", "-wal", "-shm", ".lock"}) {
    std::error_code fault;
    std::filesystem::remove(path + beside, fault);
    if (fault) throw OutputError("cannot delete " + path + beside + ": " + fault.message());
  }
}

/// What the environment refuses is an output that cannot be written.
template <typename Use>
auto writing(Use&& use) {
  try {
    return use();
  } catch (const StoreError& fault) {
    throw OutputError(fault.what());
  }
}

/// "the scenario (/constraints/0/x)": where two documents differ.
std::string scenario_difference(const std::string& kept, const json& given) {
  std::vector<std::string> places;
  for (const json& change : json::diff(json::parse(kept), given))
    places.push_back(change.at("path"));
  return "the scenario (" + list_in_words(places) + ")";
}

}  // namespace

KeptRun::KeptRun(std::string path, std::unique_ptr<Store> store, ScenarioRecord scenario, ChainRecord chain)
    : path_(std::move(path)),
      store_(std::move(store)),
      scenario_(std::move(scenario)),
      chain_(std::move(chain)) {}

KeptRun KeptRun::begin(const std::string& folder, const Scenario& scenario, const ChainRecord& chain) {
  const std::string path = path_in(folder);
  // What another process holds, or what is no store, is left alone.
  if (std::filesystem::exists(path)) writing([&] { open_store(path); });
  remove_store(path);
  return writing([&] {
    auto store = open_store(path);
    ScenarioRecord record = new_scenario_record(scenario);
    store->add_scenario(record);
    store->add_chains({chain});
    return KeptRun(path, std::move(store), std::move(record), chain);
  });
}

std::unique_ptr<KeptRun> KeptRun::find(const std::string& folder) {
  const std::string path = path_in(folder);
  if (!std::filesystem::exists(path)) return nullptr;
  return writing([&]() -> std::unique_ptr<KeptRun> {
    auto store = open_store(path);
    const auto scenarios = store->scenarios(1, "").records;
    // It may have been cut before it had a chain.
    const auto chains = scenarios.empty() ? std::vector<ChainRecord>() : store->chains(scenarios.front().id);
    if (chains.empty()) return nullptr;
    return std::unique_ptr<KeptRun>(new KeptRun(path, std::move(store), scenarios.front(), chains.front()));
  });
}

void KeptRun::expect_same(const Scenario& scenario, const ChainRecord& other) const {
  std::vector<std::string> differences;
  if (scenario_.id != other.scenario)
    differences.push_back(scenario_difference(scenario_.document, scenario.document()));
  const auto compare = [&](const char* what, const auto& kept, const auto& given) {
    std::string text = what;
    if (kept != given)
      differences.push_back(text + " (" + json(kept).dump() + ", not " + json(given).dump() + ")");
  };
  compare("the seed", chain_.seed, other.seed);
  compare("the index", chain_.index, other.index);
  compare("the method", chain_.method, other.method);
  compare("the ratios", chain_.ratios, other.ratios);
  if (!differences.empty())
    throw ConfigurationError("--resume: the run in " + path_ + " differs in " + list_in_words(differences));
}

ChainRun::Stored KeptRun::stored() const {
  return {.checkpoint = store_->checkpoint(chain_.id), .trace_blocks = store_->trace(chain_.id)};
}

void KeptRun::each_sample(const std::function<void(const SampleRecord&)>& visit) const {
  std::string cursor;
  do {
    const auto page = store_->samples(scenario_.id, SampleOrder::oldest, kSamplesAtOnce, cursor);
    for (const SampleRecord& record : page.records)
      visit(record);
    cursor = page.next_cursor;
  } while (!cursor.empty());
}

std::vector<DrawRecord> KeptRun::draws(std::size_t most, std::uint64_t from_iteration) const {
  return store_->draws(chain_.id, most, from_iteration);
}

void KeptRun::keep(ChainProgress progress) {
  writing([&] { return store_->commit(std::move(progress)).get(); });
}

void KeptRun::forget() {
  store_.reset();
  remove_store(path_);
}

}  // namespace retake
