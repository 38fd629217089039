/// The program as a user runs it: in its own folder, waited for, interrupted or killed.
#pragma once

#include <sys/types.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace program {

namespace fs = std::filesystem;

std::string slurp(const fs::path& file);

/// A working folder of this process, and another for the programs' output; both are removed at the
/// end.
struct Scratch {
  fs::path root, path, said;
  explicit Scratch(const std::string& name);
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  fs::path write(const std::string& name, const std::string& text) const;
  /// Names of all files in the working folder.
  std::set<std::string> files() const;
};

/// Exactly one of exit_code and signal tells how it ended; the other is -1.
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
Running start(const Scratch& scratch, const std::string& arguments,
              const Surroundings& around = {});

/// Waits for its end; kills it when the time limit is exceeded, which is then its signal.
Ran finish(const Running& run, std::chrono::seconds patience = std::chrono::seconds(120));

/// Waits until it has computed for so long, however busy the machine, or has ended; a minute at
/// most.
void let_compute(const Running& run, std::chrono::duration<double> time);
/// It has ended; finish() still tells how.
bool has_ended(const Running& run);

Ran run(const Scratch& scratch, const std::string& arguments, const Surroundings& around = {});

/// Polls until the condition holds; false if it does not within a minute.
template <class Condition>
bool holds_soon(const Condition& condition) {
  for (int i = 0; i < 60'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// 0 for a missing file.
std::uintmax_t size_of(const fs::path& file);
/// Bytes of records in a log, which come after its header; 0 until the header is whole.
std::uintmax_t records_in(const fs::path& log);

using Row = std::vector<std::string>;

/// Rows of CSV; the first are the columns' names. Quoted fields may hold commas and quotes.
std::vector<Row> csv_of(const std::string& text);

}  // namespace program
