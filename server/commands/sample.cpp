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
#include "server/commands/kept_run.h"
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

void write_file(const std::filesystem::path& path, const std::function<bool(const TextSink&)>& write) {
  std::ofstream file(path, std::ios::binary);
  write([&](std::string_view piece) { return static_cast<bool>(file << piece); });
  file << '\n';
  file.close();
  if (!file) throw OutputError("cannot write " + path.string());
}

/// What stands on standard error of how far a run is: in one line that changes on a terminal, else a line now
/// and then.
class ProgressLine {
 public:
  ProgressLine(bool is_wished, std::string wanted)
      : on_terminal_(isatty(STDERR_FILENO) != 0),
        shown_(is_wished || on_terminal_),
        wanted_(std::move(wanted)) {}

  void show(const ChainCounters& counters, bool is_last) {
    const auto now = std::chrono::steady_clock::now();
    if (!shown_ || (!on_terminal_ && !is_last && now - last_ < kBetweenLines)) return;
    last_ = now;
    std::fprintf(stderr, "%s%llu of %s (%llu found), %llu iterations, %.0f a second%s",
                 on_terminal_ ? kToStart : "", static_cast<unsigned long long>(counters.counted),
                 wanted_.c_str(), static_cast<unsigned long long>(counters.samples),
                 static_cast<unsigned long long>(counters.iteration), counters.iterations_per_second,
                 on_terminal_ && !is_last ? "" : "\n");
    std::fflush(stderr);
  }
  /// Makes room for a line of something else.
  void clear() const {
    if (on_terminal_) std::fputs(kToStart, stderr);
  }

 private:
  static constexpr std::chrono::seconds kBetweenLines{1};
  static constexpr const char* kToStart = "\r\033[K";
  bool on_terminal_, shown_;
  std::string wanted_;
  std::chrono::steady_clock::time_point last_{};
};

/// Tells samples on standard output: lines that whoever reads along has at once.
class Lines {
 public:
  explicit Lines(const ProgressLine& progress) : progress_(progress) {}
  void print(const std::string& line) {
    progress_.clear();
    std::cout << line << std::endl;
    if (!std::cout) throw OutputError("cannot write to standard output");
  }

 private:
  const ProgressLine& progress_;
};

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
    for (const NewSample& sample : progress.samples)
      add(sample.record);
  }
  void add(const SampleRecord& record) {
    const auto [place, is_first] = open_.try_emplace(record.replica, record);
    if (is_first) return;
    write_(place->second);
    place->second = record;
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

/// Where the samples of a run go: a keyframe document each into a folder, and a line each to standard output.
class Showing {
 public:
  Showing(const SampleOptions& options, const Scenario& scenario, const ProgressLine& progress)
      : options_(options), scenario_(scenario), lines_(progress) {}

  /// What was found before the run was cut, whose documents are there.
  void add_before(const SampleRecord& record) {
    tell(record);
    if (options_.json) weighed_.add(record);
  }
  void write_files(const ChainProgress& progress) const {
    if (options_.out.empty()) return;
    for (const NewSample& each : progress.samples) {
      const Animation animation = decode_animation(each.animation);
      const KeyframeHead head = keyframe_head(
          animation, each.record.id, std::string(scenario_.world().name()), scenario_.world().version());
      write_file(path_of(each.record),
                 [&](const TextSink& sink) { return format_.write(animation, head, options_.rate, sink); });
    }
  }
  void tell(const ChainProgress& progress) {
    for (const NewSample& each : progress.samples)
      tell(each.record);
    if (options_.json) weighed_.add(progress);
  }
  /// The last lines; the chain is finished.
  void finish(const ChainRecord& record) {
    if (!options_.json) return;
    weighed_.finish();
    json chain = chain_json(record, &scenario_);
    chain.erase("created_at");
    lines_.print(json({{"chain", std::move(chain)},
                       {"ended_by", record.ended_by},
                       {"odds", odds_json(record.counters.odds)}})
                     .dump());
  }

 private:
  std::string path_of(const SampleRecord& record) const {
    return (std::filesystem::path(options_.out) / (record.id + std::string(format_.extension))).string();
  }
  /// For people: at once, as what it weighs in the end is not said.
  void tell(const SampleRecord& record) {
    if (options_.json) return;
    lines_.print(record.id + "  " + record.digest + (options_.out.empty() ? "" : "  " + path_of(record)) +
                 (record.weight == 0 ? "  learning" : ""));
  }
  void print_weighed(const SampleRecord& record) {
    json view = sample_json(record);
    for (const char* stored_only : {"created_at", "plays"})
      view.erase(stored_only);
    if (!options_.out.empty()) view["file"] = path_of(record);
    lines_.print(view.dump());
  }

  const SampleOptions& options_;
  const Scenario& scenario_;
  const Format& format_ = formats().front();
  Lines lines_;
  WeighedSamples weighed_{[this](const SampleRecord& record) { print_weighed(record); }};
};

void make_folder(const std::string& folder) {
  std::error_code fault;
  std::filesystem::create_directories(folder, fault);
  if (fault) throw OutputError("cannot make the folder " + folder + ": " + fault.message());
}

}  // namespace

Exit sample(const SampleOptions& given) {
  SampleOptions options = given;
  const auto scenario = Scenario::read(parse_document(read_text(options.scenario)));
  if (!options.out.empty()) make_folder(options.out);

  // Where it begins: anew, or where it was cut.
  std::unique_ptr<KeptRun> kept = options.resume ? KeptRun::find(options.out) : nullptr;
  if (kept && !options.seed) options.seed = kept->chain().seed;
  ChainRecord record = chain_record(options, *scenario);
  ChainRun::Stored stored;
  if (kept) {
    kept->expect_same(*scenario, record);
    record.counters = kept->chain().counters;
    stored = kept->stored();
  } else if (!options.out.empty()) {
    kept = std::make_unique<KeptRun>(KeptRun::begin(options.out, *scenario, record));
  }
  ChainRun run(scenario, std::move(record), stored);

  const std::string wanted = wanted_text(run.record().stop);
  ProgressLine progress_line(options.progress, wanted);
  Showing showing(options, *scenario, progress_line);
  if (options.resume && kept)
    kept->each_sample([&](const SampleRecord& before) { showing.add_before(before); });

  GatheredDraws gathered;  // only if the chain is judged by them and nothing keeps it
  const DrawsOf draws = [&](std::size_t most, std::uint64_t from_iteration) {
    return kept ? kept->draws(most, from_iteration) : gathered.draws(most, from_iteration);
  };
  const auto performer = scenario->make_performer();
  const auto judge = [&] {
    if (run.awaits_judgement()) run.judge(effective_samples(*scenario, run.record(), draws));
  };
  judge();
  while (run.ended_by().empty()) {
    run.step_for(*performer, kBetweenReports, 256);
    ChainProgress progress = run.take_progress();
    showing.write_files(progress);
    showing.tell(progress);
    if (options.ess && !kept) gathered.add(progress);
    if (kept) kept->keep(std::move(progress));
    judge();
    progress_line.show(run.record().counters, !run.ended_by().empty());
  }

  ChainRecord ended = run.record();
  ended.state = ChainState::finished;
  ended.ended_by = run.ended_by();
  showing.finish(ended);
  if (ended.ended_by == "counted" || ended.ended_by == "ess") {
    if (kept) kept->forget();
    return Exit::done;
  }
  std::fprintf(stderr, "retake: gave up with %llu of %s\n",
               static_cast<unsigned long long>(ended.counters.counted), wanted.c_str());
  return Exit::gave_up;
}

}  // namespace retake
