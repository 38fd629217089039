#include "cli/terminal.hpp"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "runtime/whole_file.hpp"

namespace tiltrim::cli {

using std::chrono::steady_clock;

static double seconds(steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

static std::size_t width_of(int terminal, std::size_t otherwise) {
  constexpr std::size_t least = 40, most = 160;  // columns; longer lines are hard to read
  winsize size{};
  if (ioctl(terminal, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return otherwise;
  return std::clamp<std::size_t>(size.ws_col, least, most);
}

std::size_t terminal_width(std::size_t otherwise) { return width_of(STDOUT_FILENO, otherwise); }

// In the last column some terminals begin a new line.
std::size_t Progress::columns() { return width_of(STDERR_FILENO, 80) - 1; }

Progress::Progress(std::size_t total, std::string what)
    : total_(total),
      what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(steady_clock::now()),
      last_(start_) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r\033[K");
}

bool Progress::due() {
  constexpr double patience = 1.0, between = 0.1;  // s
  if (!terminal_) return false;
  const auto now = steady_clock::now();
  if (seconds(now - start_) < patience || seconds(now - last_) < between) return false;
  last_ = now;
  return true;
}

// The next line replaces this one only if it fits into one row; the time left is always there.
void Progress::show(const std::string& line, const std::string& left) {
  fmt::print(stderr, "\r\033[K{:.{}}{}", line, columns() - std::min(left.size(), columns()), left);
  std::fflush(stderr);
  shown_ = true;
}

void Progress::advance() {
  const std::scoped_lock lock(one_at_a_time_);
  ++done_;
  if (done_ == total_ || !due()) return;
  const double spent = seconds(steady_clock::now() - start_);
  const double left = spent / double(done_) * double(total_ - done_);
  show(fmt::format("{} of {} {}", done_, total_, what_), fmt::format(", {:.0f} s left", left));
}

void Progress::say(const std::string& where, double share) {
  const std::scoped_lock lock(one_at_a_time_);
  if (!due()) return;
  const double spent = seconds(steady_clock::now() - start_);
  const double all = (double(done_) + share) / double(total_);
  const std::string left =
      share > 0 ? fmt::format(", {:.0f} s left", spent / all * (1 - all)) : std::string();
  show(fmt::format("{} of {} {}; {}", done_, total_, what_, where), left);
}

void Progress::tell(const std::string& line, double share, const std::string& most) {
  const std::scoped_lock lock(one_at_a_time_);
  if (!(share > 0 && share < 1) || !due()) return;
  const double spent = seconds(steady_clock::now() - start_);
  show(line, fmt::format(", {}{:.0f} s left", most, spent / share * (1 - share)));
}

namespace {

sigset_t stopping_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

using filing::refuse;
using filing::target_of;

// The signal received; whether a file is being read.
std::atomic<int> arrived = 0;
std::atomic<bool> reading = false;

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

}  // namespace

Interrupt::Interrupt() {
  arrived = 0;
  const sigset_t set = stopping_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  watcher_ = std::jthread([this, set](const std::stop_token& ended) {
    watching_.count_down();
    for (int got = 0; sigwait(&set, &got) == 0 && !ended.stop_requested();) {
      const bool again = arrived.exchange(got) != 0;
      if (again || reading) std::_Exit(128 + got);
      source_.request_stop();
    }
  });
  watching_.wait();  // a fork while a thread starts would copy the locks it holds
}

Interrupt::~Interrupt() {
  watcher_.request_stop();
  pthread_kill(watcher_.native_handle(), SIGTERM);  // it wakes, and the program ends at once
  watcher_.join();
  const sigset_t set = stopping_signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

int Interrupt::signal() const { return arrived; }

Reading::Reading() {
  reading = true;
  if (const int signal = arrived; signal != 0) std::_Exit(128 + signal);
}

Reading::~Reading() { reading = false; }

void check_apart(const std::filesystem::path& file, const std::string& name,
                 const std::filesystem::path& other, const std::string& other_name) {
  if (file.empty() || other.empty()) return;
  std::error_code ignored;
  const auto whole = [&](const std::filesystem::path& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, ignored), ignored);
  };
  if (whole(file) == whole(other))
    throw std::invalid_argument(fmt::format("{}: {} and {} name the same file; expected two files",
                                            file.string(), name, other_name));
}

void check_writable(const std::filesystem::path& file) {
  if (const int error = filing::name_error(file); error != 0 && error != ENOTDIR)
    refuse(file, error);
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored))
    throw std::runtime_error(
        fmt::format("{}: is not a regular file; output is written to a temporary file and renamed; "
                    "use > {} instead",
                    file.string(), file.string()));
  const std::filesystem::path folder = folder_of(target_of(file));
  if (!std::filesystem::is_directory(folder, ignored))
    refuse(folder, std::generic_category().message(ENOENT) + "; make this folder before " +
                       file.filename().string() + " is written to it");
  if (::access(folder.c_str(), W_OK | X_OK) != 0) refuse(folder, errno);
}

void check_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  if (folder.empty()) return;
  fs::path there = folder;
  if (const int error = filing::name_error(folder); error == ENAMETOOLONG || error == ELOOP)
    refuse(folder, error);
  std::error_code ignored;
  while (!there.empty() && !fs::exists(there, ignored)) there = there.parent_path();
  if (!there.empty() && !fs::is_directory(there, ignored))
    throw std::runtime_error(fmt::format("{}: Not a directory", there.string()));
  check_writable(there / "figures.gp");
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(fmt::format("{}: {}", folder.string(), error.message()));
}

void write_whole(const std::filesystem::path& file, const std::string& text) {
  check_writable(file);
  const std::filesystem::path target = target_of(file);
  std::string beside = target.string() + ".XXXXXX";
  const int fd = ::mkstemp(beside.data());
  if (fd < 0) refuse(file, errno);
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(fd, 0666 & ~mask);
  filing::finish(fd, beside, target, file, {std::as_bytes(std::span(text))});
}

void print_whole(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0)
    throw std::runtime_error(fmt::format("standard output: {}", std::strerror(errno)));
}

}  // namespace tiltrim::cli
