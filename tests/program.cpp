#include "tests/program.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iterator>
#include <sstream>

namespace program {

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Scratch::Scratch(const std::string& name)
    : root(fs::temp_directory_path() / fmt::format("tiltrim-{}-{}", name, ::getpid())),
      path(root / "work"),
      said(root / "said") {
  fs::create_directories(path);
  fs::create_directories(said);
}

Scratch::~Scratch() {
  std::error_code ignored;
  fs::remove_all(root, ignored);
}

fs::path Scratch::write(const std::string& name, const std::string& text) const {
  std::ofstream(path / name, std::ios::binary) << text;
  return path / name;
}

std::set<std::string> Scratch::files() const {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(path)) names.insert(entry.path().filename());
  return names;
}

Running start(const Scratch& scratch, const std::string& arguments, const Surroundings& around) {
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

Ran finish(const Running& run, std::chrono::seconds patience) {
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

bool has_ended(const Running& run) {
  siginfo_t info{};
  return ::waitid(P_PID, id_t(run.pid), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
         info.si_pid == run.pid;
}

void let_compute(const Running& run, std::chrono::duration<double> time) {
  clockid_t clock{};
  timespec used{};
  (void)holds_soon([&] {
    return has_ended(run) || ::clock_getcpuclockid(run.pid, &clock) != 0 ||
           ::clock_gettime(clock, &used) != 0 ||
           double(used.tv_sec) + 1e-9 * double(used.tv_nsec) >= time.count();
  });
}

Ran run(const Scratch& scratch, const std::string& arguments, const Surroundings& around) {
  return finish(start(scratch, arguments, around));
}

std::uintmax_t size_of(const fs::path& file) {
  std::error_code missing;
  const std::uintmax_t size = fs::file_size(file, missing);
  return missing ? 0 : size;
}

std::uintmax_t records_in(const fs::path& log) {
  const std::uintmax_t size = size_of(log);  // first: the program is writing
  std::array<std::uint64_t, 3> header{};  // magic, format, length of the identity; then a checksum
  std::ifstream(log, std::ios::binary).read(reinterpret_cast<char*>(header.data()), sizeof header);
  const std::uintmax_t before = sizeof header + header[2] + sizeof(std::uint64_t);
  return std::max(size, before) - before;
}

std::vector<Row> csv_of(const std::string& text) {
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
