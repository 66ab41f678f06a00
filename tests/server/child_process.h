// ChildProcess: a program run by a test, with its environment, its limits and what it prints.
// TemporaryFolder: a place for its files that goes away with the test.
#pragma once

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

namespace retake::test {

/// True as soon as the condition is; false if it is not within `seconds`, which is generous: cores may be
/// busy.
inline bool wait_until(const std::function<bool()>& condition, double seconds = 60) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "retake-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("cannot make a temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

class ChildProcess {
 public:
  struct Start {
    std::vector<std::string> arguments;
    std::map<std::string, std::string> environment{};  ///< beside what is inherited, RETAKE_* left out
    std::string input{};                               ///< what it reads from its standard input
    rlim_t most_file_bytes = RLIM_INFINITY;            ///< a disk that is full at this size of a file
    rlim_t most_address_space = RLIM_INFINITY;         ///< [bytes] memory that runs out
    rlim_t most_descriptors = RLIM_INFINITY;           ///< for good, if it is not infinite
    std::string program = RETAKE_PROGRAM;
  };

  /// Runs the program in `folder`, where its output is kept as well.
  ChildProcess(const std::filesystem::path& folder, const Start& start) {
    static int count = 0;
    const std::string name = "process-" + std::to_string(++count);
    out_ = folder / (name + ".out");
    err_ = folder / (name + ".err");
    const std::filesystem::path in = folder / (name + ".in");
    write_text(in, start.input);

    // Everything that allocates comes before the fork.
    std::vector<std::string> texts{start.program};
    texts.insert(texts.end(), start.arguments.begin(), start.arguments.end());
    std::vector<char*> arguments = pointers(texts);
    std::vector<std::string> variables = environment(start.environment);
    std::vector<char*> environment = pointers(variables);
    const std::string folder_text = folder.string(), in_text = in.string();
    const std::string out_text = out_.string(), err_text = err_.string();
    const rlimit space{start.most_address_space, start.most_address_space};
    // The disk may be given room again from outside.
    rlimit file_limit{};
    getrlimit(RLIMIT_FSIZE, &file_limit);
    file_limit.rlim_cur = start.most_file_bytes;
    const rlimit descriptor_limit{start.most_descriptors, start.most_descriptors};

    pid_ = fork();
    if (pid_ < 0) throw std::runtime_error("cannot fork");
    if (pid_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // it never outlives a test that crashed
    const bool is_ready = chdir(folder_text.c_str()) == 0 && redirect(in_text, O_RDONLY, 0) &&
                          redirect(out_text, O_WRONLY | O_CREAT | O_TRUNC, 1) &&
                          redirect(err_text, O_WRONLY | O_CREAT | O_TRUNC, 2);
    if (start.most_file_bytes != RLIM_INFINITY) {
      signal(SIGXFSZ, SIG_IGN);
      setrlimit(RLIMIT_FSIZE, &file_limit);
    }
    if (start.most_address_space != RLIM_INFINITY) setrlimit(RLIMIT_AS, &space);
    if (start.most_descriptors != RLIM_INFINITY) setrlimit(RLIMIT_NOFILE, &descriptor_limit);
    if (is_ready) execve(arguments[0], arguments.data(), environment.data());
    _exit(126);
  }
  ~ChildProcess() { kill(); }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  void signal_with(int number) const {
    if (!has_ended_) ::kill(pid_, number);
  }
  bool has_ended() {
    int status = 0;
    if (!has_ended_ && waitpid(pid_, &status, WNOHANG) == pid_) {
      has_ended_ = true;
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    return has_ended_;
  }
  /// Its exit code, 128 and the signal's number if one ended it, -1 if it still runs after `seconds`.
  int wait(double seconds = 90) {
    return wait_until([this] { return has_ended(); }, seconds) ? exit_code_ : -1;
  }
  void kill() {
    signal_with(SIGKILL);
    wait();
  }
  std::string out() const { return read_text(out_); }
  std::string err() const { return read_text(err_); }

 private:
  static std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts)
      pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
  }
  static std::vector<std::string> environment(const std::map<std::string, std::string>& more) {
    std::vector<std::string> variables;
    for (char** each = environ; *each; ++each)
      if (!std::string(*each).starts_with("RETAKE_")) variables.emplace_back(*each);
    for (const auto& [name, value] : more)
      variables.push_back(name + "=" + value);
    return variables;
  }
  static bool redirect(const std::string& path, int flags, int descriptor) {
    const int opened = open(path.c_str(), flags, 0600);
    return opened >= 0 && dup2(opened, descriptor) == descriptor;
  }

  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
  bool has_ended_ = false;
  int exit_code_ = -1;
};

struct Ended {
  int exit_code;
  std::string out;
  std::string err;
};

/// Runs a program to its end.
inline Ended run_program(const std::filesystem::path& folder, const ChildProcess::Start& start,
                         double seconds = 90) {
  ChildProcess process(folder, start);
  const int exit_code = process.wait(seconds);
  return {exit_code, process.out(), process.err()};
}

}  // namespace retake::test
