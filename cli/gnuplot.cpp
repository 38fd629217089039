#include "cli/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <stdexcept>

namespace tiltrim::cli {

namespace fs = std::filesystem;

// The first lines of gnuplot's error output.
static std::string said(const fs::path& errors) {
  std::ifstream in(errors);
  std::string words, line;
  constexpr std::size_t enough = 400;
  while (words.size() < enough && std::getline(in, line))
    if (!line.empty()) words += (words.empty() ? "" : " ") + line;
  return words.substr(0, enough);
}

void run_gnuplot(const fs::path& folder, const fs::path& script, const std::string& kept) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  const fs::path errors = fs::absolute(folder) / script.stem().concat(".log");
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0666);
  std::string name = script.filename().string();
  char program[] = "gnuplot";
  char* const arguments[] = {program, name.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, program, &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0)
    throw std::runtime_error("gnuplot is not installed (Debian: gnuplot-nox)" + kept);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error("gnuplot failed: " + said(errors) + kept);
  fs::remove(errors);
}

}  // namespace tiltrim::cli
