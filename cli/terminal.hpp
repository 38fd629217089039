/// Terminal and file system: progress display, Ctrl-C, complete writes.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <latch>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace tiltrim::cli {

/// Columns of the terminal that standard output is; `otherwise` if it does not tell.
std::size_t terminal_width(std::size_t otherwise);

/// "3 of 40 conditions, 12 s left" on standard error, if it is a terminal and the work takes more
/// than a second. One line of the terminal. Any thread may call.
class Progress {
 public:
  explicit Progress(std::size_t total, std::string what = "conditions");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance();
  /// Displays the current work, at most ten times a second; `share` is the fraction done, if known.
  void say(const std::string& where, double share = 0.0);
  /// The same with a line composed by the caller; before the time left, `most` if it is a bound.
  void tell(const std::string& line, double share, const std::string& most = "");
  /// Columns of such a line, what is longer is cut; of them tell() itself needs `own`.
  static std::size_t columns();
  static constexpr std::size_t own = 14;

 private:
  bool due();
  void show(const std::string& line, const std::string& left);

  std::mutex one_at_a_time_;
  std::size_t total_, done_ = 0;
  std::string what_;
  bool terminal_, shown_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

/// Turns SIGINT and SIGTERM into a stop request during its lifetime; a second signal ends the
/// program at once. Construct it before any other thread starts.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  std::stop_token token() const { return source_.get_token(); }
  int signal() const;  ///< the signal received; 0 if none

 private:
  std::stop_source source_;
  std::latch watching_{1};
  std::jthread watcher_;
};

/// During its lifetime the first signal ends the program at once: reading a pipe may block forever,
/// and nothing has been written yet.
class Reading {
 public:
  Reading();
  ~Reading();
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;
};

/// Throws std::invalid_argument if both are the same file, such as --gains and the study. An empty
/// path is ignored.
void check_apart(const std::filesystem::path& file, const std::string& name,
                 const std::filesystem::path& other, const std::string& other_name);
/// Throws std::runtime_error "path: why" if a file could not be written there.
void check_writable(const std::filesystem::path& file);
/// The same for a file in a folder that may not exist yet. An empty path is ignored.
void check_folder(const std::filesystem::path& folder);
/// Creates the folder and its parents; throws std::runtime_error "path: why".
void make_folder(const std::filesystem::path& folder);
/// Writes a temporary file in the same folder, syncs and renames it, so the file is either the old
/// or the new one; a symbolic link's target is replaced. Throws std::runtime_error "path: why".
void write_whole(const std::filesystem::path& file, const std::string& text);
/// Writes to standard output; throws std::runtime_error if not everything could be written (full
/// disk).
void print_whole(const std::string& text);

}  // namespace tiltrim::cli
