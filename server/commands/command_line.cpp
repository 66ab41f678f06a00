// See command_line.h. Flag > environment > configuration file > default.
#include "server/commands/command_line.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>

#include <CLI/CLI.hpp>

#include "db/store.h"
#include "sampler/target.h"
#include "server/chains/chain_run.h"
#include "server/http/guard.h"
#include "worlds/document.h"
#include "worlds/parameters.h"

namespace retake {
namespace {

constexpr std::uint64_t kLargestSeed = (std::uint64_t{1} << 53) - 1;
constexpr std::uint64_t kLargestCount = (std::uint64_t{1} << 53) - 1;

/// Accepts what `read` knows; it is the reader's place to know the names.
template <typename Read>
CLI::Validator known(Read read, const std::string& names) {
  return CLI::Validator(
      [read, names](std::string& text) { return read(text) ? "" : "must be one of " + names; }, names);
}

/// Accepts a comma-separated list without faults.
CLI::Validator each_piece(std::string (*fault_of)(std::string_view piece)) {
  const auto first_fault = [fault_of](std::string& list) {
    std::string fault;
    for (const std::string_view piece : split(list, ','))
      if (fault.empty()) fault = fault_of(piece);
    return fault;
  };
  return CLI::Validator(first_fault, "");
}

/// The commands with their options, and the one that was chosen.
struct CommandLine {
  explicit CommandLine(bool reads_file = true);
  void add_serve();
  void add_sample();
  void add_store_commands();

  CLI::App app{"Retake: you decide the outcome; it finds the physics, a fresh one every play."};
  std::function<Exit()> chosen;
  ServeOptions serve_options;
  SampleOptions sample_options;
  VerifyOptions verify_options;
  ExportOptions export_options;
  BackupOptions backup_options;
  std::string check_store = "retake.db";
  std::string unread_file;
  bool worlds_json = false;
  bool version_json = false;
};

CommandLine::CommandLine(bool reads_file) {
  app.name("retake");
  app.require_subcommand(1);
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  if (reads_file)
    app.set_config("--config", "",
                   "Configuration file: `[serve]` and then `listen = \"127.0.0.1:8080\"`, one option a line");
  else
    app.add_option("--config", unread_file);
  app.footer(
      "Every option may also stand in the environment: --low-water as RETAKE_LOW_WATER.\n"
      "Exit codes: 0 done, 1 failed, 2 usage, 3 configuration, 4 store, 5 listen address, 6 gave up, 7 "
      "malformed "
      "document, 8 impossible document, 9 unwritable output.");
  add_serve();
  add_sample();
  add_store_commands();

  auto* worlds = app.add_subcommand("worlds", "List the worlds with their parameters and constraint terms");
  worlds->add_flag("--json", worlds_json, "As GET /v1/worlds");
  worlds->footer("Example: retake worlds --json");
  worlds->callback([this] { chosen = [this] { return list_worlds(worlds_json); }; });
  auto* version = app.add_subcommand("version", "Print the version");
  version->add_flag("--json", version_json, "For machines");
  version->footer("Example: retake version --json");
  version->callback([this] { chosen = [this] { return show_version(version_json); }; });
  for (CLI::App* command : app.get_subcommands({}))
    command->fallthrough(false);
}

void CommandLine::add_serve() {
  ServeOptions& options = serve_options;
  auto* command = app.add_subcommand("serve", "Serve the API and the gallery page until SIGTERM");
  command->add_option("--listen", options.listen, "Address and port; port 0 lets the system pick")
      ->capture_default_str();
  command->add_option("--store", options.store, "The store's file; made if missing")->capture_default_str();
  command->add_option("--threads", options.threads, "Threads that step chains; 0: one a core")
      ->check(CLI::Range(0, 1024));
  command->add_flag("--no-examples", options.no_examples, "Leave an empty store empty");
  command->add_option("--token", options.token, "Bearer token; any address but loopback needs one");
  command->add_option("--token-file", options.token_file, "File whose first line is the bearer token");
  command->add_option("--allow-host", options.allow_hosts, "Further Host names to answer to, comma-separated")
      ->check(each_piece(fault_of_host));
  command
      ->add_option("--allow-origin", options.allow_origins,
                   "Origins of other pages that may use the API, comma-separated: https://game.example")
      ->check(each_piece(fault_of_origin));
  command
      ->add_option("--max-samples", options.limits.most_samples_per_scenario,
                   "Samples a scenario may hold; its chains finish there")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  command
      ->add_option("--low-water", options.limits.low_water,
                   "A play that leaves its player fewer unseen samples starts a chain again; 0: never")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{0}, ServiceLimits::kMostLowWater));
  command->add_option("--refill", options.limits.refill, "Samples that such a chain finds")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, kLargestCount));
  command->footer("Example: retake serve --listen 127.0.0.1:8080 --store retake.db --threads 2");
  command->callback([this] { chosen = [this] { return serve(serve_options); }; });
}

void CommandLine::add_sample() {
  SampleOptions& options = sample_options;
  auto* command = app.add_subcommand("sample", "Sample a scenario without a server");
  command->add_option("scenario", options.scenario, "Scenario document, - for standard input")->required();
  command
      ->add_option("--count", options.count,
                   "Samples to find that count, so none of learning; 10 if --ess is absent too")
      ->check(CLI::Range(std::uint64_t{1}, kLargestSeed));
  command
      ->add_option("--ess", options.ess,
                   "Find samples until so many are effective, for every variable and measure")
      ->check(CLI::Range(std::uint64_t{1}, kMostEffectiveSamples));
  command->add_option("--seed", options.seed, "Seed; picked and reported if absent")
      ->check(CLI::Range(std::uint64_t{0}, kLargestSeed));
  command->add_option("--index", options.index, "Which chain of the seed")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{std::numeric_limits<std::uint32_t>::max()}));
  const std::string methods = list_of_names(method_names()) + ", " + std::string(kAutoMethod);
  const std::string ratios = list_of_names(ratios_names());
  command->add_option("--method", options.method, methods + ", which is the world's default")
      ->capture_default_str()
      ->check(
          known([](const std::string& name) { return name == kAutoMethod || method_from(name); }, methods));
  command->add_option("--ratios", options.ratios, "exact, or paper for the published behaviour")
      ->capture_default_str()
      ->check(known(ratios_from, ratios));
  command->add_option("--iterations", options.iterations, "Give up after so many iterations")
      ->check(CLI::Range(std::uint64_t{1}, kLargestCount));
  command->add_option("--seconds", options.seconds, "Give up after so many seconds")
      ->check(CLI::PositiveNumber);
  auto* out = command->add_option("--out", options.out, "Folder for the keyframe documents");
  command
      ->add_flag("--resume", options.resume,
                 "Go on where the run in the folder was cut, as if it had not been")
      ->needs(out);
  command->add_option("--rate", options.rate, "Frames a second of the keyframes; 0: the world's own")
      ->check(CLI::Range(0, 240));
  command->add_flag("--json", options.json, "One JSON line a sample, and one at the end");
  command->add_flag("--progress", options.progress,
                    "Say on standard error how far it is, also if that is no terminal");
  command->footer("Example: retake sample scenario.json --count 10 --seed 1 --out animations");
  command->callback([this] { chosen = [this] { return sample(sample_options); }; });
}

void CommandLine::add_store_commands() {
  auto* verify_command = app.add_subcommand("verify", "Simulate stored samples again and compare digests");
  verify_command->add_option("samples", verify_options.samples, "Ids of samples; all if absent")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verify_command->add_option("--store", verify_options.store, "The store's file")->capture_default_str();
  verify_command->footer("Example: retake verify --store retake.db");
  verify_command->callback([this] { chosen = [this] { return verify(verify_options); }; });

  auto* export_command = app.add_subcommand("export", "Write a scenario's samples as keyframe documents");
  export_command->add_option("scenario", export_options.scenario, "Id of the scenario")->required();
  export_command->add_option("--out", export_options.out, "Folder to write to")->required();
  export_command->add_option("--limit", export_options.limit, "At most so many, oldest first; 0: all")
      ->check(CLI::Range(std::uint64_t{0}, kLargestCount));
  export_command->add_option("--rate", export_options.rate, "Frames a second; 0: the world's own")
      ->check(CLI::Range(0, 240));
  export_command->add_option("--store", export_options.store, "The store's file")->capture_default_str();
  export_command->footer("Example: retake export SCENARIO --store retake.db --out animations");
  export_command->callback([this] { chosen = [this] { return export_samples(export_options); }; });

  auto* backup_command = app.add_subcommand("backup", "Copy a store to a new file, also while it is served");
  backup_command->add_option("target", backup_options.target, "The new file")->required();
  backup_command->add_option("--store", backup_options.store, "The store's file")->capture_default_str();
  backup_command->footer("Example: retake backup copy.db --store retake.db");
  backup_command->callback([this] { chosen = [this] { return backup(backup_options); }; });

  auto* check_command = app.add_subcommand("check", "Look for damage in a store");
  check_command->add_option("--store", check_store, "The store's file")->capture_default_str();
  check_command->footer("Example: retake check --store retake.db");
  check_command->callback([this] { chosen = [this] { return check(check_store); }; });
}

/// Options of the chosen command that the environment sets, as arguments. They stand before the given ones,
/// so that a flag wins, and count as given, so that the configuration file does not.
std::vector<std::string> environment_arguments(const CLI::App& command) {
  std::vector<std::string> arguments;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_lnames().empty()) continue;
    const std::string& name = option->get_lnames().front();
    std::string variable = "RETAKE_";
    for (const char letter : name)
      variable += letter == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    const char* value = std::getenv(variable.c_str());
    if (!value || name == "help") continue;
    arguments.push_back("--" + name + "=" + value);
  }
  return arguments;
}

void parse(CommandLine& line, std::vector<std::string> arguments, bool with_environment) {
  if (with_environment) {
    // The command is the first argument that names one.
    for (auto place = arguments.begin(); place != arguments.end(); ++place) {
      const auto named =
          line.app.get_subcommands([&](CLI::App* command) { return command->get_name() == *place; });
      if (named.empty()) continue;
      const std::vector<std::string> more = environment_arguments(*named.front());
      arguments.insert(place + 1, more.begin(), more.end());
      break;
    }
  }
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants it
  line.app.parse(std::move(arguments));
}

/// Whether the flags alone, or with the configuration file, are right.
bool right_without_environment(const std::vector<std::string>& arguments, bool reads_file) {
  try {
    CommandLine line(reads_file);
    parse(line, arguments, false);
    return true;
  } catch (const CLI::Error&) {
    return false;
  }
}

int report(const char* what, Exit code) {
  std::fprintf(stderr, "retake: %s\n", what);
  return static_cast<int>(code);
}

}  // namespace

int run_command_line(int count, char** arguments) {
  const std::vector<std::string> given(arguments + 1, arguments + count);
  CommandLine line;
  try {
    parse(line, given, true);
  } catch (const CLI::Success& help) {
    line.app.exit(help);
    return static_cast<int>(Exit::done);
  } catch (const CLI::FileError& fault) {
    return report(fault.what(), Exit::configuration);
  } catch (const CLI::ConfigError& fault) {
    return report(fault.what(), Exit::configuration);
  } catch (const CLI::Error& fault) {
    // The fault lies in what was left out when the rest is right.
    if (right_without_environment(given, true))
      return report((std::string("the environment: ") + fault.what()).c_str(), Exit::configuration);
    if (right_without_environment(given, false))
      return report((std::string("the configuration file: ") + fault.what()).c_str(), Exit::configuration);
    line.app.exit(fault, std::cerr, std::cerr);
    return static_cast<int>(Exit::usage);
  }

  try {
    return static_cast<int>(line.chosen());
  } catch (const ConfigurationError& fault) {
    return report(fault.what(), Exit::configuration);
  } catch (const StoreError& fault) {
    return report(fault.what(), Exit::store);
  } catch (const InvalidRequest& fault) {
    for (const Fault& each : fault.faults())
      std::fprintf(stderr, "retake: %s: %s\n", each.pointer.empty() ? "document" : each.pointer.c_str(),
                   each.detail.c_str());
    if (fault.further_faults() > 0) std::fprintf(stderr, "retake: and %zu more\n", fault.further_faults());
    return static_cast<int>(fault.malformed() ? Exit::malformed : Exit::impossible);
  } catch (const OutputError& fault) {
    return report(fault.what(), Exit::unwritable);
  } catch (const std::exception& fault) {
    return report(fault.what(), Exit::failed);
  }
}

}  // namespace retake
