// Unusual files: a limit on their size, names that are too long, symbolic links, pipes.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "tests/check.hpp"
#include "tests/program.hpp"

using namespace program;

namespace files_cli_test {

namespace {

using Names = std::set<std::string>;

const std::string level = "[[condition]]\nname = \"a\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";
const std::string grid = level + "[[sweep.axis]]\nkey = \"V\"\nfrom = 14.5\nto = 15\ncount = 2\n";

}  // namespace

TEST_CASE("a polar that the study reads is not overwritten") {
  const Scratch scratch("files-polar");
  const std::string polar = slurp(TILTRIM_SOURCE_DIR "/data/naca8h12_re150k.csv");
  scratch.write("p.csv", polar);
  for (const std::string command : {"trim", "sweep", "simulate"}) {
    scratch.write("s.toml",
                  "[aircraft]\npolar = \"p.csv\"\n" + (command == "sweep" ? grid : level));
    const Ran ran = run(scratch, command + " s.toml -o ./p.csv");
    CHECK(ran.exit_code == 2);
    CHECK(contains(ran.err, "-o and the study's polar name the same file"));
    CHECK(slurp(scratch.path / "p.csv") == polar);
  }
  for (const std::string option :
       {"linearize --models", "margins --bode", "simulate --samples",
        "simulate --monte-carlo --log", "tune --gains", "prove --certificate", "prove --log"}) {
    const std::size_t space = option.find(' ');
    const Ran ran =
        run(scratch, option.substr(0, space) + " s.toml" + option.substr(space) + " p.csv");
    CHECK(ran.exit_code == 2);
    CHECK(contains(ran.err, option.substr(option.rfind(' ') + 1) +
                                " and the study's polar name the same file"));
    CHECK(slurp(scratch.path / "p.csv") == polar);
  }
}

TEST_CASE("a limit on the size of files: the message, and nothing is left behind") {
  const Scratch scratch("files-limit");
  scratch.write("s.toml", grid);
  const auto refused = [&](const std::string& command, const std::string& output) {
    const Ran ran = run(scratch, command + output, {"ulimit -f 1;"});
    CHECK(ran.exit_code == 2);
    CHECK(ran.err == fmt::format("tiltrim: {}: File too large\n", output));
    CHECK(scratch.files() == Names{"s.toml"});
  };
  refused("trim s.toml -f json -o ", "out.json");
  refused("simulate s.toml --samples ", "f.nc");
  // The log of a map is kept, so that the sweep can be resumed. Blocks of 512 or 1024 bytes: the
  // log is below 30 KB, the map above 60.
  const Ran ran = run(scratch, "sweep s.toml -o map.nc --checkpoint 1000", {"ulimit -f 60;"});
  CHECK(ran.exit_code == 2);
  CHECK(ran.err == "tiltrim: map.nc: File too large\n");
  CHECK(scratch.files() == Names{"map.nc.log", "s.toml"});
}

TEST_CASE("names that are too long are refused with the name and why, in every format") {
  const Scratch scratch("files-long");
  scratch.write("s.toml", grid);
  const std::string stem(300, 'n');
  const auto refused = [&](const std::string& command, const std::string& name) {
    CAPTURE(command);
    const Ran ran = run(scratch, command + name);
    CHECK(ran.exit_code == 2);
    CHECK(ran.out.empty());
    CHECK(ran.err == fmt::format("tiltrim: {}: File name too long\n", name));
  };
  for (const char* format : {"text", "json", "csv", "markdown", "latex"})
    refused(fmt::format("trim s.toml -f {} -o ", format), stem);
  refused("sweep s.toml -o ", stem + ".nc");
  refused("sweep s.toml -o ", stem + ".csv");
  for (const char* ending : {".mat", ".json", ".csv", ".py"})
    refused("linearize s.toml --models ", stem + ending);
  refused("simulate s.toml --samples ", stem + ".nc");
  refused("simulate s.toml --plots ", stem);
  refused("report s.toml -o ", stem + ".html");
  refused("report s.toml --tables ", stem);
  refused("margins s.toml --bode ", stem);
  CHECK(scratch.files() == Names{"s.toml"});
}

TEST_CASE("through a symbolic link its target is written, also one that is not there yet") {
  const Scratch scratch("files-link");
  scratch.write("s.toml", grid);
  fs::create_directory(scratch.path / "real");
  for (const std::string name : {"out.json", "map.nc"}) {
    CAPTURE(name);
    const std::string command =
        name == "map.nc" ? "sweep s.toml -o map.nc" : "trim s.toml -f json -o out.json";
    fs::create_symlink(fs::path("real") / name, scratch.path / name);
    REQUIRE(run(scratch, command).exit_code == 0);
    const std::string first = slurp(scratch.path / "real" / name);
    CHECK_FALSE(first.empty());
    REQUIRE(run(scratch, command).exit_code == 0);
    CHECK(fs::is_symlink(scratch.path / name));
    CHECK(slurp(scratch.path / "real" / name) == first);
  }
  CHECK(scratch.files() == Names{"map.nc", "out.json", "real", "s.toml"});
  CHECK(std::distance(fs::directory_iterator(scratch.path / "real"), {}) == 2);
  fs::create_symlink("circle", scratch.path / "circle");
  const Ran ran = run(scratch, "trim s.toml -o circle");
  CHECK(ran.exit_code == 2);
  CHECK(ran.err == "tiltrim: circle: Too many levels of symbolic links\n");
}

TEST_CASE("a link and its target are one output: the second sweep is refused") {
  const Scratch scratch("files-lock");
  scratch.write("s.toml", level +
                              "[[sweep.axis]]\nkey = \"V\"\nfrom = 5\nto = 15\ncount = 200\n"
                              "[[sweep.axis]]\nkey = \"gamma_deg\"\nfrom = -3\nto = 3\n"
                              "count = 200\n");
  fs::create_symlink("real.nc", scratch.path / "link.nc");
  const Running first = start(scratch, "sweep s.toml --checkpoint 0 -o real.nc");
  CHECK(holds_soon([&] { return size_of(scratch.path / "real.nc.log") > 0; }));
  ::kill(first.pid, SIGSTOP);
  const Ran second = run(scratch, "sweep s.toml -o link.nc");
  CHECK(second.exit_code == 2);
  CHECK(contains(second.err, "tiltrim: real.nc.log: another process is using it"));
  ::kill(first.pid, SIGKILL);
  (void)finish(first);
  CHECK(scratch.files() == Names{"link.nc", "real.nc.log", "s.toml"});
}

TEST_CASE("a pipe that nobody ends: the first signal does") {
  const Scratch scratch("files-pipe");
  const fs::path pipe = scratch.path / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  for (const std::string command : {"trim pipe", "modes pipe"})
    for (const int signal : {SIGINT, SIGTERM}) {
      CAPTURE(command);
      const Running waiting = start(scratch, command);
      int writer = -1;  // opens once the program has opened the other end
      CHECK(
          holds_soon([&] { return (writer = ::open(pipe.c_str(), O_WRONLY | O_NONBLOCK)) >= 0; }));
      ::kill(waiting.pid, signal);
      const Ran ran = finish(waiting, std::chrono::seconds(20));
      CHECK(ran.exit_code == 128 + signal);
      CHECK(ran.err.empty());
      ::close(writer);
    }
}

TEST_CASE("a file in the user's folder with the name of a library is not loaded") {
  const Scratch scratch("files-library");
  for (const char* name : {"libm.so.6", "libz.so.1"}) scratch.write(name, "no library");
  CHECK(run(scratch, "--version").exit_code == 0);
}

}  // namespace files_cli_test
