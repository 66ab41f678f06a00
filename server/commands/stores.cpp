// Commands that look at a store - verify, export, backup, check - and those that tell what this build can do.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>

#include "db/open_store.h"
#include "server/api/views.h"
#include "server/chains/scenario_library.h"
#include "server/commands/command_line.h"
#include "worlds/formats/formats.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::size_t kPage = 500;

/// Calls `visit` for every sample of a scenario, oldest first, until it says false.
void each_sample(const Store& store, const std::string& scenario,
                 const std::function<bool(const SampleRecord&)>& visit) {
  std::string cursor;
  do {
    const Page<SampleRecord> page = store.samples(scenario, SampleOrder::oldest, kPage, cursor);
    for (const SampleRecord& record : page.records)
      if (!visit(record)) return;
    cursor = page.next_cursor;
  } while (!cursor.empty());
}

void each_scenario(const Store& store, const std::function<void(const ScenarioRecord&)>& visit) {
  std::string cursor;
  do {
    const Page<ScenarioRecord> page = store.scenarios(kPage, cursor);
    for (const ScenarioRecord& record : page.records)
      visit(record);
    cursor = page.next_cursor;
  } while (!cursor.empty());
}

/// Simulates samples again, with one performer a scenario.
class Verifier {
 public:
  explicit Verifier(const Store& store) : library_(store), store_(store) {}
  bool identical(const SampleRecord& record) {
    if (!scenario_ || record.scenario != scenario_id_) {
      scenario_ = library_.find(record.scenario);
      if (!scenario_) return false;
      scenario_id_ = record.scenario;
      performer_ = scenario_->make_performer();
    }
    const auto state = store_.sample_state(record.id);
    if (!state) return false;
    const State decoded = decode_state(*state);
    const Scenario::Performer::Take take = performer_->perform(decoded);
    return take.complete && digest(decoded, take.animation) == record.digest;
  }

 private:
  ScenarioLibrary library_;
  const Store& store_;
  std::string scenario_id_;
  std::shared_ptr<const Scenario> scenario_;
  std::unique_ptr<Scenario::Performer> performer_;
};

}  // namespace

Exit verify(const VerifyOptions& options) {
  const auto opened = open_store(options.store, {.read_only = true});
  const Store& store = *opened;
  Verifier verifier(store);
  std::uint64_t same = 0, different = 0, unverifiable = 0;
  const auto look = [&](const SampleRecord& record) {
    std::string trouble = "differs";
    bool identical = false;
    try {
      identical = verifier.identical(record);
    } catch (const OtherVersion& reason) {
      ++unverifiable;
      if (!options.samples.empty())
        std::printf("%s cannot be verified: %s\n", record.id.c_str(), reason.what());
      return true;
    } catch (const DamagedAnimation& fault) {
      trouble = fault.what();
    } catch (const Damaged& damage) {
      trouble = damage.what();
    }
    ++(identical ? same : different);
    if (!identical) std::printf("%s: %s\n", record.id.c_str(), trouble.c_str());
    return true;
  };
  if (options.samples.empty()) {
    each_scenario(store, [&](const ScenarioRecord& scenario) { each_sample(store, scenario.id, look); });
  } else {
    for (const std::string& id : options.samples) {
      const auto record = store.sample(id);
      if (!record) throw std::runtime_error("there is no sample " + id);
      look(*record);
    }
  }
  std::printf("%llu identical, %llu different", static_cast<unsigned long long>(same),
              static_cast<unsigned long long>(different));
  if (unverifiable > 0)
    std::printf(", %llu of other versions of their worlds, which cannot be verified",
                static_cast<unsigned long long>(unverifiable));
  std::printf("\n");
  return different == 0 ? Exit::done : Exit::failed;
}

Exit export_samples(const ExportOptions& options) {
  const auto opened =
      open_store(options.store, {.read_only = true, .on_damage = [](const std::string& damage) {
                                   std::fprintf(stderr, "retake: %s\n", damage.c_str());
                                 }});
  const Store& store = *opened;
  const auto scenario = store.scenario(options.scenario);
  if (!scenario) throw std::runtime_error("there is no scenario " + options.scenario);
  std::filesystem::create_directories(options.out);
  const Format& format = formats().front();
  std::uint64_t written = 0;
  each_sample(store, scenario->id, [&](const SampleRecord& record) {
    std::optional<std::string> bytes;
    try {
      bytes = store.sample_animation(record.id);
    } catch (const Damaged&) {
      // It is told as it is met.
    }
    if (!bytes) return true;  // deleted meanwhile, or damaged
    const Animation animation = decode_animation(*bytes);
    const KeyframeHead head = keyframe_head(animation, record.id, scenario->world, scenario->world_version);
    const std::filesystem::path path =
        std::filesystem::path(options.out) / (record.id + std::string(format.extension));
    std::ofstream file(path, std::ios::binary);
    format.write(animation, head, options.rate,
                 [&](std::string_view piece) { return static_cast<bool>(file << piece); });
    file << '\n';
    file.close();
    if (!file) throw std::runtime_error("cannot write " + path.string());
    return ++written != options.limit;
  });
  std::printf("%llu keyframe documents in %s\n", static_cast<unsigned long long>(written),
              options.out.c_str());
  return Exit::done;
}

Exit backup(const BackupOptions& options) {
  const auto opened = open_store(options.store, {.read_only = true});
  const Store& store = *opened;
  store.backup(options.target);
  std::printf("%s is a copy of %s\n", options.target.c_str(), options.store.c_str());
  return Exit::done;
}

Exit check(const std::string& path) {
  const auto opened = open_store(path, {.read_only = true});
  const Store& store = *opened;
  std::uint64_t faults = 0, samples = 0;
  for (const std::string& line : store.check()) {
    ++faults;
    std::printf("%s\n", line.c_str());
  }
  each_scenario(store, [&](const ScenarioRecord& scenario) {
    each_sample(store, scenario.id, [&](const SampleRecord& record) {
      ++samples;
      try {
        decode_animation(store.sample_animation(record.id).value_or(""));
        decode_state(store.sample_state(record.id).value_or(""));
      } catch (const Damaged&) {
        // It is among those above.
      } catch (const DamagedAnimation& fault) {
        ++faults;
        std::printf("sample %s: %s\n", record.id.c_str(), fault.what());
      }
      return true;
    });
  });
  std::printf("%llu samples looked at, %llu faults\n", static_cast<unsigned long long>(samples),
              static_cast<unsigned long long>(faults));
  return faults == 0 ? Exit::done : Exit::failed;
}

Exit list_worlds(bool as_json) {
  json views = json::array();
  for (const World* world : worlds())
    views.push_back(world_json(*world));
  if (as_json) {
    std::cout << json({{"worlds", views}}).dump(2) << '\n';
    return Exit::done;
  }
  for (const json& world : views) {
    std::cout << world.value("name", "") << " (version " << world["version"]
              << "): " << world.value("summary", "") << "\n  model\n";
    for (const auto& [name, field] : world["model"]["properties"].items())
      std::cout << "    " << name << " = " << field.value("default", json()).dump()
                << (field.contains("x-unit") ? " " + field.value("x-unit", "") : "") << "  "
                << field.value("description", "") << '\n';
    std::cout << "  constraints\n";
    for (const json& term : world["constraints"]) {
      std::cout << "    " << term.value("kind", "") << ": " << term.value("summary", "") << '\n';
      for (const auto& [name, field] : term["schema"]["properties"].items())
        if (name != "kind")
          std::cout << "      " << name
                    << (field.contains("default") ? " = " + field["default"].dump() : " (required)") << "  "
                    << field.value("description", "") << '\n';
    }
  }
  return Exit::done;
}

std::string version_text() {
  return RETAKE_VERSION;
}

Exit show_version(bool as_json) {
  json names = json::object();
  for (const World* world : worlds())
    names[std::string(world->name())] = world->version();
  if (as_json)
    std::cout << json({{"version", version_text()}, {"compiler", __VERSION__}, {"worlds", names}}).dump()
              << '\n';
  else
    std::cout << "retake " << version_text() << " (g++ " << __VERSION__ << ")\n";
  return Exit::done;
}

}  // namespace retake
