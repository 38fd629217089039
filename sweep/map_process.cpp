#include <fcntl.h>
#include <fmt/core.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <type_traits>

#include "runtime/whole_file.hpp"
#include "sweep/map_fields.hpp"
#include "sweep/map_netcdf.hpp"

// HDF5 trusts the contents of a file: a forged file, checksums included, makes it crash, loop or
// overwrite memory. A child process therefore reads the file and sends the arrays through a pipe;
// the parent checks them before use.

namespace tiltrim::filing {

namespace {

// Memory limit of the child above that of this process, and limit of what it may send: the largest
// result of decompressing the file, but no more than the machine's memory.
std::size_t memory_for(std::size_t file_size) {
  constexpr std::size_t libraries = std::size_t(64) << 20, deflated = 1032;
  const auto physical = std::size_t(::sysconf(_SC_PHYS_PAGES)) * std::size_t(::getpagesize());
  return libraries + std::min(deflated * file_size, physical);
}

// CPU seconds: a hundred times what a map of this size takes.
unsigned time_for(std::size_t file_size) { return 1 + 10 * unsigned(file_size >> 20); }

// visit(part) for everything sent through the pipe.
template <class C, class Visit>
void each_part(C& contents, Visit& visit) {
  auto& verdicts = contents.map;
  auto& map = verdicts.grid;
  visit(contents.verdicts);
  visit(verdicts.work);
  visit(verdicts.part.number);
  visit(verdicts.part.of);
  visit(verdicts.runs);
  visit(verdicts.located);
  visit(map.program);
  visit(map.instruction_set);
  visit(map.polar);
  visit(map.study);
  visit(map.axes);
  each_field(map, contents.lists, [&](const Field&, auto& array) { visit(array); });
}

template <class Column, class Visit>
void each_of_column(Column& column, Visit& visit) {
  visit(column.name);
  visit(column.unit);
  visit(column.signal);
  visit(column.values);
  visit(column.si);
}

struct Sink {
  int fd;

  void bytes(const void* from, std::size_t size) const {
    if (write_all(fd, {static_cast<const std::byte*>(from), size}) != 0) ::_exit(1);
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(const T& number) const { bytes(&number, sizeof number); }
  void operator()(const std::string& text) const {
    const std::size_t size = text.size();
    bytes(&size, sizeof size);
    bytes(text.data(), size);
  }
  template <class T>
  void operator()(const std::vector<T>& list) const {
    const std::size_t size = list.size();
    bytes(&size, sizeof size);
    if constexpr (std::is_arithmetic_v<T>)
      bytes(list.data(), size * sizeof(T));
    else
      for (const T& one : list) (*this)(one);
  }
  void operator()(const SweepAxis& axis) const { (*this)(axis.columns); }
  void operator()(const SweepAxis::Column& column) const { each_of_column(column, *this); }
};

struct CutOff {};  // the child ended before sending everything

struct Source {
  int fd;
  std::size_t left;  // bytes still allowed

  void bytes(void* to, std::size_t size) {
    if (size > left) throw std::bad_alloc();
    left -= size;
    for (std::size_t done = 0; done < size;) {
      const ssize_t n = ::read(fd, static_cast<char*>(to) + done, size - done);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw CutOff();
      done += std::size_t(n);
    }
  }
  // Reads the length of a list with at least `each` bytes per element.
  std::size_t size_of_list(std::size_t each) {
    std::size_t size = 0;
    bytes(&size, sizeof size);
    if (size > left / each) throw std::bad_alloc();
    return size;
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(T& number) { bytes(&number, sizeof number); }
  void operator()(bool& is) {
    char byte = 0;
    bytes(&byte, sizeof byte);
    is = byte != 0;
  }
  void operator()(std::string& text) {
    text.resize(size_of_list(1));
    bytes(text.data(), text.size());
  }
  template <class T>
  void operator()(std::vector<T>& list) {
    if constexpr (std::is_arithmetic_v<T>) {
      list.resize(size_of_list(sizeof(T)));
      bytes(list.data(), list.size() * sizeof(T));
    } else {
      for (std::size_t k = size_of_list(sizeof(std::size_t)); k > 0; --k)
        (*this)(list.emplace_back());
    }
  }
  void operator()(SweepAxis& axis) { (*this)(axis.columns); }
  void operator()(SweepAxis::Column& column) { each_of_column(column, *this); }
};

// ---- The child ----------------------------------------------------------------------------------

void limit(__rlimit_resource_t resource, rlim_t most) {
  rlimit now{};
  if (::getrlimit(resource, &now) != 0) return;
  now.rlim_cur = now.rlim_max = std::min(now.rlim_cur, most);
  ::setrlimit(resource, &now);
}

// Size of the process's address space, to which its limit applies; 0 if unknown.
std::size_t address_space() {
  std::size_t pages = 0;
  std::FILE* const file = std::fopen("/proc/self/statm", "re");
  if (!file) return 0;
  if (std::fscanf(file, "%zu", &pages) != 1) pages = 0;
  std::fclose(file);
  return pages * std::size_t(::getpagesize());
}

void limit_child(std::size_t file_size) {
  const unsigned seconds = time_for(file_size);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  limit(RLIMIT_CPU, seconds);
  if (const std::size_t now = address_space(); now > 0)
    limit(RLIMIT_AS, now + memory_for(file_size));
  // The caller's crash handlers must not run in the child.
  for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) std::signal(crash, SIG_DFL);
  // Ends a wait for a lock that another thread of the parent held at the fork.
  std::signal(SIGALRM, SIG_DFL);
  ::alarm(10 * seconds);
  // The C library prints a message if memory was overwritten; the parent reports the error itself.
  if (const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0)
    ::dup2(nowhere, STDERR_FILENO);
}

[[noreturn]] void read_in_child(std::span<std::byte> content, const std::filesystem::path& file,
                                Sink sink) {
  limit_child(content.size());
  std::string why;
  Contents contents;
  try {
    contents = contents_in(content, file);
  } catch (const std::bad_alloc&) {
    why = fmt::format("{}: {}", file.string(), std::strerror(ENOMEM));
  } catch (const std::exception& e) {
    why = e.what();
  }
  sink(why);
  if (why.empty()) each_part(contents, sink);
  ::_exit(0);
}

// ---- The parent ---------------------------------------------------------------------------------

// How the child ended if it did not send everything.
std::string end_of(pid_t child) {
  int status = 0;
  pid_t ended = 0;
  do ended = ::waitpid(child, &status, 0);
  while (ended < 0 && errno == EINTR);
  if (ended != child || !WIFSIGNALED(status)) return "fails";
  const int number = WTERMSIG(status);
  if (number == SIGXCPU || number == SIGKILL || number == SIGALRM) return "does not finish";
  return fmt::format("crashes ({})", ::strsignal(number));
}

}  // namespace

std::optional<Contents> contents_from(int pipe, std::size_t most,
                                      const std::filesystem::path& file) {
  std::string why;
  Contents contents;
  try {
    Source source{pipe, most};
    source(why);
    if (!why.empty()) throw std::runtime_error(why);
    each_part(contents, source);
  } catch (const CutOff&) {
    return {};
  } catch (const std::bad_alloc&) {
    refuse(file, ENOMEM);
  }
  try {
    check_parts(contents.map.grid, contents.lists, contents.verdicts);
    if (contents.verdicts) check_verdicts(contents.map);
  } catch (const std::runtime_error& e) {
    refuse(file, e.what());
  }
  put_back(contents.lists, contents.map.grid);
  return contents;
}

Contents checked_contents_in(std::span<std::byte> content, const std::filesystem::path& file) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) refuse(file, errno);
  const pid_t child = ::fork();
  if (child == 0) read_in_child(content, file, {pipe[1]});
  const int error = errno;
  ::close(pipe[1]);
  std::optional<Contents> contents;
  std::exception_ptr failure;
  try {
    if (child > 0) contents = contents_from(pipe[0], memory_for(content.size()), file);
  } catch (...) {
    failure = std::current_exception();
  }
  ::close(pipe[0]);  // ends a child that is writing
  if (child < 0) refuse(file, error);
  const std::string end = end_of(child);
  if (failure) std::rethrow_exception(failure);
  if (!contents)
    refuse(file, fmt::format("is damaged: the NetCDF library {} when reading it", end));
  return *std::move(contents);
}

}  // namespace tiltrim::filing
