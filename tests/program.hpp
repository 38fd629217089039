/// The program as a user runs it: in a folder of its own, waited for, interrupted or killed.
#pragma once

#include <fmt/core.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace program {

namespace fs = std::filesystem;

inline std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of this process's own to work in, and one beside it for what programs say; both are
/// removed at the end.
struct Scratch {
  fs::path root, path, said;
  explicit Scratch(const std::string& name)
      : root(fs::temp_directory_path() / fmt::format("tiltrim-{}-{}", name, ::getpid())),
        path(root / "work"),
        said(root / "said") {
    fs::create_directories(path);
    fs::create_directories(said);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(root, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
    return path / name;
  }
  /// Names of all files in the folder to work in.
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(path)) names.insert(entry.path().filename());
    return names;
  }
};

/// Exactly one of exit_code and signal says how it ended; the other is -1.
struct Ran {
  int exit_code = -1, signal = -1;
  std::string out, err;
};

struct Running {
  pid_t pid;
  fs::path out, err;
};

struct Surroundings {
  std::string before{};                   ///< shell commands: limits, traps
  std::string program = TILTRIM_PROGRAM;  ///< or a launcher and the program
};

/// Starts it without waiting. The arguments may redirect as a shell takes it.
inline Running start(const Scratch& scratch, const std::string& arguments,
                     const Surroundings& around = {}) {
  static int number = 0;
  ++number;
  Running run{-1, scratch.said / fmt::format("out{}", number),
              scratch.said / fmt::format("err{}", number)};
  const std::string command =
      fmt::format("cd '{}' && {} exec {} >'{}' 2>'{}' </dev/null {}", scratch.path.string(),
                  around.before, around.program, run.out.string(), run.err.string(), arguments);
  run.pid = ::fork();
  if (run.pid == 0) {
    ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  return run;
}

/// Waits for its end; ends it when patience is over, which is then its signal.
inline Ran finish(const Running& run, std::chrono::seconds patience = std::chrono::seconds(120)) {
  using clock = std::chrono::steady_clock;
  const auto grace = std::chrono::seconds(10);
  const auto begun = clock::now();
  int status = 0, asked = 0;
  while (::waitpid(run.pid, &status, WNOHANG) == 0) {
    const auto waited = clock::now() - begun;
    if (asked == 0 && waited > patience) ::kill(run.pid, asked = SIGTERM);
    if (asked == SIGTERM && waited > patience + grace) ::kill(run.pid, asked = SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const bool ended = WIFEXITED(status) && asked == 0;
  const int signal = asked != 0 ? asked : WIFSIGNALED(status) ? WTERMSIG(status) : -1;
  return {ended ? WEXITSTATUS(status) : -1, signal, slurp(run.out), slurp(run.err)};
}

inline Ran run(const Scratch& scratch, const std::string& arguments,
               const Surroundings& around = {}) {
  return finish(start(scratch, arguments, around));
}

/// Polls until the condition holds; false if it does not within a minute.
template <class Condition>
bool holds_soon(const Condition& condition) {
  for (int i = 0; i < 60'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// 0 for a file that is not there.
inline std::uintmax_t size_of(const fs::path& file) {
  std::error_code missing;
  const std::uintmax_t size = fs::file_size(file, missing);
  return missing ? 0 : size;
}

using Row = std::vector<std::string>;

/// Rows of CSV; the first are the columns' names. Quoted fields may hold commas and quotes.
inline std::vector<Row> csv_of(const std::string& text) {
  std::vector<Row> rows;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    Row& row = rows.emplace_back(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (quoted && line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"')
        row.back() += line[++i];
      else if (line[i] == '"')
        quoted = !quoted;
      else if (line[i] == ',' && !quoted)
        row.emplace_back();
      else
        row.back() += line[i];
    }
  }
  return rows;
}

}  // namespace program
