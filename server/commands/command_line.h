// The command line: which command, with which options, from flags, environment, configuration file and
// defaults. doc/api.md, "The program". Each command stands in a file of its own and must not know how its
// options were found.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/api/limits.h"
#include "server/api/views.h"

namespace retake {

/// Exit codes of the program.
enum class Exit : int {
  done = 0,
  failed = 1,
  usage = 2,
  configuration = 3,
  store = 4,
  listen_address = 5,
  gave_up = 6,     ///< a limit came before what was asked for
  malformed = 7,   ///< the document cannot be read
  impossible = 8,  ///< the document says something that is not possible
  unwritable = 9,  ///< what was found cannot be written
};

/// What is configured cannot work: one line for the operator.
class ConfigurationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What was found cannot be written where it shall go.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ServeOptions {
  std::string listen = "127.0.0.1:8080";
  std::string store = "retake.db";
  std::size_t threads = 0;  ///< 0: one a core
  bool no_examples = false;
  std::string token;
  std::string token_file;
  std::string allow_hosts;    ///< comma-separated
  std::string allow_origins;  ///< comma-separated
  ServiceLimits limits;
};
Exit serve(const ServeOptions& options);

struct SampleOptions {
  std::string scenario;                ///< file, "-" for standard input
  std::optional<std::uint64_t> count;  ///< that count; 10 unless something else ends the chain by success
  std::optional<std::uint64_t> ess;    ///< effective samples
  std::optional<std::uint64_t> seed;
  std::uint32_t index = 0;
  std::string method{kAutoMethod};
  std::string ratios = "exact";
  std::optional<std::uint64_t> iterations;
  std::optional<double> seconds;
  std::string out;
  double rate = 0;
  bool json = false;
  bool resume = false;    ///< go on from where the run in `out` was cut
  bool progress = false;  ///< say how far it is, also where no terminal shows it
};
Exit sample(const SampleOptions& options);

Exit list_worlds(bool json);
Exit show_version(bool json);

struct VerifyOptions {
  std::string store = "retake.db";
  std::vector<std::string> samples;  ///< empty: all
};
Exit verify(const VerifyOptions& options);

struct ExportOptions {
  std::string store = "retake.db";
  std::string scenario;
  std::string out;
  std::uint64_t limit = 0;  ///< 0: all
  double rate = 0;
};
Exit export_samples(const ExportOptions& options);

struct BackupOptions {
  std::string store = "retake.db";
  std::string target;
};
Exit backup(const BackupOptions& options);

Exit check(const std::string& store);

/// Parses and runs; returns the exit code.
int run_command_line(int count, char** arguments);

/// "0.1.0" and how it was built.
std::string version_text();

}  // namespace retake
