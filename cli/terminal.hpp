/// What the program owes the terminal and the file system: progress, Ctrl-C, whole files.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <stop_token>
#include <string>
#include <thread>

namespace tiltrim::cli {

/// "3 of 40 conditions, 12 s left" on standard error, if that is a terminal and the work takes over
/// a second.
class Progress {
 public:
  explicit Progress(std::size_t total, std::string what = "conditions");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance();
  /// Says how far the work at hand is, ten times a second at most; `share` of it is done, if known.
  void say(const std::string& where, double share = 0.0);
  /// The same in words of the caller's own alone.
  void tell(const std::string& line, double share);

 private:
  bool due();
  void show(const std::string& line);

  std::size_t total_, done_ = 0;
  std::string what_;
  bool terminal_, shown_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

/// Turns SIGINT and SIGTERM into a stop request for the time of its life; a second one ends the
/// program at once. Make it before any other thread.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  std::stop_token token() const { return source_.get_token(); }
  int signal() const;  ///< that came; 0 if none

 private:
  std::stop_source source_;
  std::jthread watcher_;
};

/// While it lives the first signal ends the program at once: what reads a pipe may wait for ever,
/// and nothing is written yet.
class Reading {
 public:
  Reading();
  ~Reading();
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;
};

/// Throws std::invalid_argument if both are one file, as --gains and the study. An empty path is
/// none.
void check_apart(const std::filesystem::path& file, const std::string& name,
                 const std::filesystem::path& other, const std::string& other_name);
/// Throws std::runtime_error "path: why" if a file could not be written there.
void check_writable(const std::filesystem::path& file);
/// The same for a file in a folder that may have to be made first. An empty path is none.
void check_folder(const std::filesystem::path& folder);
/// Makes it, and those it lies in; throws std::runtime_error "path: why".
void make_folder(const std::filesystem::path& folder);
/// Writes beside the file, syncs and renames, so that the file is the old one or the new one; of a
/// symbolic link the target.
/// Throws std::runtime_error "path: why".
void write_whole(const std::filesystem::path& file, const std::string& text);
/// To standard output; throws std::runtime_error if it does not take all (a full disk).
void print_whole(const std::string& text);

}  // namespace tiltrim::cli
