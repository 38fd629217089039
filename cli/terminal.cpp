#include "cli/terminal.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace tiltrim::cli {

Progress::Progress(std::size_t total)
    : total_(total),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r\033[K");
}

void Progress::advance() {
  ++done_;
  const double spent =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  constexpr double patience = 1.0;  // s
  if (!terminal_ || spent < patience || done_ == total_) return;
  const double left = spent / double(done_) * double(total_ - done_);
  fmt::print(stderr, "\r\033[K{} of {} conditions, {:.0f} s left", done_, total_, left);
  std::fflush(stderr);
  shown_ = true;
}

namespace {

sigset_t stopping_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

[[noreturn]] void refuse(const std::filesystem::path& file, int error) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), std::strerror(error)));
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

// 0, or the errno of the step that failed.
int write_and_sync(int fd, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    done += std::size_t(n);
  }
  return ::fsync(fd) == 0 || errno == EINVAL || errno == EROFS ? 0 : errno;
}

}  // namespace

Interrupt::Interrupt() {
  const sigset_t set = stopping_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  watcher_ = std::jthread([this, set](const std::stop_token& ended) {
    const timespec tick{0, 50'000'000};
    while (!ended.stop_requested()) {
      const int got = sigtimedwait(&set, nullptr, &tick);
      if (got <= 0) continue;
      if (signal_ != 0) std::_Exit(128 + got);
      signal_ = got;
      source_.request_stop();
    }
  });
}

Interrupt::~Interrupt() {
  watcher_.request_stop();
  watcher_.join();
  const sigset_t set = stopping_signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

void check_writable(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file)) refuse(file, EISDIR);
  const std::filesystem::path folder = folder_of(file);
  if (!std::filesystem::is_directory(folder)) refuse(folder, ENOENT);
  if (::access(folder.c_str(), W_OK | X_OK) != 0) refuse(folder, errno);
}

void write_whole(const std::filesystem::path& file, const std::string& text) {
  check_writable(file);
  std::string beside = file.string() + ".XXXXXX";
  const int fd = ::mkstemp(beside.data());
  if (fd < 0) refuse(file, errno);
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(fd, 0666 & ~mask);
  int error = write_and_sync(fd, text);
  if (::close(fd) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(beside.c_str(), file.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(beside.c_str());
    refuse(file, error);
  }
  const int folder = ::open(folder_of(file).c_str(), O_RDONLY | O_DIRECTORY);
  if (folder < 0) return;  // written and renamed; only the folder's own sync is not to be had
  ::fsync(folder);
  ::close(folder);
}

void print_whole(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0)
    throw std::runtime_error(fmt::format("standard output: {}", std::strerror(errno)));
}

}  // namespace tiltrim::cli
