// `retake sample`: the daemon's job without a daemon - the same chain, the same samples, the same digests.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <unistd.h>

#include "server/api/views.h"
#include "server/chains/chain_run.h"
#include "server/chains/gathered_draws.h"
#include "server/chains/health.h"
#include "server/chains/identifiers.h"
#include "server/chains/scenario_library.h"
#include "server/commands/command_line.h"
#include "worlds/formats/formats.h"
#include "worlds/formats/recorded.h"

namespace retake {
namespace {

using nlohmann::json;

constexpr std::chrono::duration<double> kBetweenReports{0.2};
constexpr std::uint64_t kDefaultCount = 10;

std::string read_text(const std::string& path) {
  if (path == "-") return std::string(std::istreambuf_iterator<char>(std::cin), {});
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

ChainRecord chain_record(const SampleOptions& options, const Scenario& scenario) {
  ChainRecord record;
  record.seed = options.seed.value_or(random_seed());
  record.index = options.index;
  record.id = "seed" + std::to_string(record.seed);
  record.scenario = scenario_id(scenario.document());
  const bool is_auto = options.method == kAutoMethod;
  record.method = is_auto ? to_string(scenario.world().default_method()) : options.method;
  record.ratios = options.ratios;
  if (!method_from(record.method))
    throw ConfigurationError("--method must be " + std::string(kAutoMethod) + " or one of " +
                             list_of_names(method_names()));
  if (!ratios_from(record.ratios))
    throw ConfigurationError("--ratios must be one of " + list_of_names(ratios_names()));
  record.stop = {.counted = options.count,
                 .iterations = options.iterations,
                 .seconds = options.seconds,
                 .ess = options.ess};
  if (!options.count && !options.ess) record.stop.counted = kDefaultCount;
  return record;
}

/// "10 samples", "samples until 50 are effective" or both.
std::string wanted_text(const StopRule& stop) {
  std::string text = stop.counted ? std::to_string(*stop.counted) + " samples" : "samples";
  if (stop.ess)
    text += (stop.counted ? ", or until " : " until ") + std::to_string(*stop.ess) + " are effective";
  return text;
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text << '\n';
  file.close();
  if (!file) throw OutputError("cannot write " + path.string());
}

/// Prints a line that whoever reads along has at once.
void print_line(const std::string& line) {
  std::cout << line << std::endl;
  if (!std::cout) throw OutputError("cannot write to standard output");
}

/// The samples of a chain in order, each once its weight is known: the one on which a walker still stands may
/// come to count more.
class WeighedSamples {
 public:
  using Write = std::function<void(const SampleRecord& record)>;
  explicit WeighedSamples(Write write) : write_(std::move(write)) {}

  void add(const ChainProgress& progress) {
    for (const WeightUpdate& update : progress.weights)
      if (const auto found = open_.find(update.replica);
          found != open_.end() && found->second.iteration == update.iteration)
        found->second.weight = update.weight;
    for (const NewSample& sample : progress.samples) {
      const auto [place, is_first] = open_.try_emplace(sample.record.replica, sample.record);
      if (is_first) continue;
      write_(place->second);
      place->second = sample.record;
    }
  }
  void finish() {
    for (const auto& [replica, record] : open_)
      write_(record);
    open_.clear();
  }

 private:
  Write write_;
  std::map<std::uint32_t, SampleRecord> open_;  ///< of each walker the last one
};

}  // namespace

Exit sample(const SampleOptions& options) {
  const auto scenario = Scenario::read(parse_document(read_text(options.scenario)));
  const auto performer = scenario->make_performer();
  ChainRun run(scenario, chain_record(options, *scenario), {});
  const Format& format = formats().front();
  if (!options.out.empty()) {
    std::error_code fault;
    std::filesystem::create_directories(options.out, fault);
    if (fault) throw OutputError("cannot make the folder " + options.out + ": " + fault.message());
  }
  const bool terminal = isatty(STDERR_FILENO) != 0 && !options.json;

  const std::string wanted = wanted_text(run.record().stop);
  GatheredDraws gathered;                    // only if the chain is judged by them
  std::map<std::string, std::string> files;  // by sample, until its line is written
  WeighedSamples lines([&](const SampleRecord& record) {
    json view = sample_json(record);
    for (const char* stored_only : {"created_at", "plays"})
      view.erase(stored_only);
    if (const auto file = files.extract(record.id)) view["file"] = file.mapped();
    print_line(view.dump());
  });
  while (run.ended_by().empty()) {
    run.step_for(*performer, kBetweenReports, 256);
    const ChainProgress progress = run.take_progress();
    if (options.ess) gathered.add(progress);
    if (run.awaits_judgement())
      run.judge(
          effective_samples(*scenario, run.record(), [&](std::size_t most, std::uint64_t from_iteration) {
            return gathered.draws(most, from_iteration);
          }));
    for (const NewSample& each : progress.samples) {
      std::string file;
      if (!options.out.empty()) {
        const std::filesystem::path path =
            std::filesystem::path(options.out) / (each.record.id + std::string(format.extension));
        const Animation animation = decode_animation(each.animation);
        const KeyframeHead head = keyframe_head(
            animation, each.record.id, std::string(scenario->world().name()), scenario->world().version());
        write_file(path, format.write(animation, head, options.rate));
        file = path.string();
        if (options.json) files[each.record.id] = file;
      }
      if (!options.json && (!terminal || !options.out.empty()))
        print_line(each.record.id + "  " + each.record.digest + (file.empty() ? "" : "  " + file) +
                   (each.record.weight == 0 ? "  learning" : ""));
    }
    if (options.json) lines.add(progress);
    const ChainCounters& counters = run.record().counters;
    if (terminal)
      std::fprintf(stderr, "\r%llu of %s, %llu iterations, %.0f a second ",
                   static_cast<unsigned long long>(counters.counted), wanted.c_str(),
                   static_cast<unsigned long long>(counters.iteration), counters.iterations_per_second);
  }
  if (terminal) std::fputc('\n', stderr);
  if (options.json) {
    lines.finish();
    ChainRecord record = run.record();
    record.state = ChainState::finished;
    record.ended_by = run.ended_by();
    json chain = chain_json(record, scenario.get());
    chain.erase("created_at");
    print_line(json({{"chain", std::move(chain)},
                     {"ended_by", run.ended_by()},
                     {"odds", odds_json(record.counters.odds)}})
                   .dump());
  }
  if (run.ended_by() == "counted" || run.ended_by() == "ess") return Exit::done;
  std::fprintf(stderr, "retake: gave up with %llu of %s\n",
               static_cast<unsigned long long>(run.record().counters.counted), wanted.c_str());
  return Exit::gave_up;
}

}  // namespace retake
