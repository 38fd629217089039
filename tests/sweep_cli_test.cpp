// `tiltrim sweep` and `tiltrim diff` as a user runs them: killed, interrupted, out of room,
// misasked.
#include <poll.h>
#include <pty.h>
#include <sched.h>
#include <sys/mount.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <string>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using program::csv_of;
using program::finish;
namespace fs = std::filesystem;
using fs::path;
using program::holds_soon;
using program::Ran;
using program::Row;
using program::run;
using program::Running;
using program::Scratch;
using program::size_of;
using program::slurp;
using program::start;
using program::Surroundings;

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

std::string condition(const std::string& name, double V, double gamma_deg, double eta_deg) {
  return fmt::format("[[condition]]\nname = \"{}\"\nV = {}\ngamma_deg = {}\neta_deg = {}\n", name,
                     V, gamma_deg, eta_deg);
}

std::string axis(const std::string& key, double from, double to, int count) {
  return fmt::format("[[sweep.axis]]\nkey = \"{}\"\nfrom = {}\nto = {}\ncount = {}\n", key, from,
                     to, count);
}

// The corridor at many gains: crossings along both, and a sweep of about a second.
std::string corridor_study() {
  return condition("corridor", 15, 0, 0) + axis("h", 0, 60, sanitized ? 13 : 91) +
         axis("gains.K_Lp", 0.05, 5.0, sanitized ? 12 : 70) + "spacing = \"log\"\n";
}

const std::string sweep_command = "sweep s.toml -o map.nc ";

struct Uninterrupted {
  std::string bytes, text;
  double seconds = 0.0;
};

// Once for all cases.
const Uninterrupted& uninterrupted() {
  static const Uninterrupted whole = [] {
    const Scratch scratch("sweep-whole");
    scratch.write("s.toml", corridor_study());
    const auto begun = std::chrono::steady_clock::now();
    const Ran ran = run(scratch, sweep_command);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun;
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.err.empty());
    CHECK(scratch.files() == std::set<std::string>{"map.nc", "s.toml"});
    return Uninterrupted{slurp(scratch.path / "map.nc"), ran.out, spent.count()};
  }();
  return whole;
}

// What doctest would print of two files is of no use.
bool is_whole(const path& file) { return slurp(file) == uninterrupted().bytes; }

struct Killed {
  int landed = 0, finished = 0;
  bool went_on = true;  // what one run has logged, the next has not done anew
};

// Kills runs of one command at random moments until so many kills have met a running program.
Killed kill_often(const Scratch& scratch, const std::string& options, int kills, unsigned seed) {
  constexpr std::uintmax_t record = 1 << 16;  // more than the one that a kill may tear
  const path map = scratch.path / "map.nc", log = scratch.path / "map.nc.log";
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> moment(0.0, uninterrupted().seconds);
  Killed killed;
  std::uintmax_t logged = 0;
  scratch.write("map.nc", "the old one");
  for (int i = 0; i < 20 * kills && killed.landed < kills; ++i) {
    const Running sweep = start(scratch, sweep_command + options);
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    ::kill(sweep.pid, SIGKILL);
    const Ran ran = finish(sweep);
    if (ran.signal == SIGKILL) {
      ++killed.landed;
      CHECK((is_whole(map) || slurp(map) == "the old one"));
      killed.went_on = killed.went_on && size_of(log) + record >= logged;
      logged = size_of(log);
      continue;
    }
    ++killed.finished;
    CHECK(ran.exit_code == 0);
    CHECK(is_whole(map));
    CHECK_FALSE(fs::exists(log));
    scratch.write("map.nc", "the old one");
    logged = 0;
  }
  return killed;
}

}  // namespace

TEST_CASE("killed at random moments and taken up again: the same bytes") {
  for (const char* interval : {"0", "0.05"}) {
    CAPTURE(interval);
    const Scratch scratch("sweep-killed");
    scratch.write("s.toml", corridor_study());
    const int kills = trials(10);
    const std::string options = std::string("--checkpoint ") + interval;
    const Killed killed = kill_often(scratch, options, kills, 11);
    CHECK(killed.landed == kills);
    CHECK(killed.went_on);
    const Ran last = run(scratch, sweep_command + options);
    CHECK(last.exit_code == 0);
    CHECK(last.out == uninterrupted().text);
    CHECK(is_whole(scratch.path / "map.nc"));
    CHECK_FALSE(fs::exists(scratch.path / "map.nc.log"));
  }
}

TEST_CASE("the same bytes for any number of threads") {
  const Scratch scratch("sweep-threads");
  scratch.write("s.toml", corridor_study());
  for (const int threads : {1, 2, 3, 8}) {
    CAPTURE(threads);
    const Ran ran = run(scratch, sweep_command + fmt::format("--threads {}", threads));
    CHECK(ran.exit_code == 0);
    CHECK(ran.out == uninterrupted().text);
    CHECK(is_whole(scratch.path / "map.nc"));
  }
}

namespace {

#ifndef TILTRIM_MPI_PROGRAM
#define TILTRIM_MPI_PROGRAM ""
#endif

const std::string mpi_program = TILTRIM_MPI_PROGRAM;

Surroundings on_ranks(int n) {
  return {"", fmt::format("mpirun --oversubscribe --allow-run-as-root -n {} {}", n, mpi_program)};
}

bool without_mpi() {
  if (mpi_program.empty()) MESSAGE("no program for MPI was built");
  return mpi_program.empty();
}

// Of a launcher one of the ranks; 0 if there is none yet.
pid_t one_rank_of(pid_t launcher) {
  std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", launcher));
  pid_t child = 0;
  children >> child;
  return child;
}

}  // namespace

TEST_CASE("the same bytes for any number of ranks") {
  if (without_mpi()) return;
  const Scratch scratch("sweep-ranks");
  scratch.write("s.toml", corridor_study());
  for (const int n : {1, 2, 3}) {
    CAPTURE(n);
    const Ran ran = run(scratch, sweep_command, on_ranks(n));
    CHECK(ran.exit_code == 0);
    CHECK(ran.out == uninterrupted().text);
    CHECK(is_whole(scratch.path / "map.nc"));
    CHECK_FALSE(fs::exists(scratch.path / "map.nc.log"));
  }
}

TEST_CASE("a rank is killed; the sweep goes on with another number of ranks") {
  if (without_mpi()) return;
  const Scratch scratch("sweep-rank-killed");
  scratch.write("s.toml", corridor_study());
  const std::string command = sweep_command + "--checkpoint 0";
  const path log = scratch.path / "map.nc.log";
  std::uintmax_t logged = 30'000;  // the header and more
  for (const int n : {3, 2}) {
    CAPTURE(n);
    const Running sweep = start(scratch, command, on_ranks(n));
    CHECK(holds_soon([&] { return size_of(log) > logged; }));
    logged = size_of(log);
    const pid_t rank = one_rank_of(sweep.pid);
    REQUIRE(rank > 0);
    ::kill(rank, SIGKILL);
    CHECK(finish(sweep).exit_code != 0);
    CHECK_FALSE(fs::exists(scratch.path / "map.nc"));
  }
  const Ran last = run(scratch, command, on_ranks(2));
  CHECK(last.exit_code == 0);
  CHECK(is_whole(scratch.path / "map.nc"));
  CHECK_FALSE(fs::exists(log));
}

TEST_CASE("what one rank meets ends all: a study without sweep, a folder without room") {
  if (without_mpi()) return;
  const Scratch scratch("sweep-ranks-refuse");
  scratch.write("s.toml", corridor_study());
  scratch.write("none.toml", condition("a", 15, 0, 0));
  const Ran none = run(scratch, "sweep none.toml", on_ranks(2));
  CHECK(none.exit_code == 2);
  CHECK(says(none.err, "no [[sweep.axis]]"));
  Surroundings small = on_ranks(2);
  small.before = "ulimit -f 200; trap '' XFSZ;";
  const Ran full = run(scratch, sweep_command + "--checkpoint 0", small);
  CHECK(full.exit_code == 2);
  CHECK(says(full.err, "map.nc.log: File too large"));
}

namespace {

// A sweep that is stopped as soon as its log says that it is under way.
Running under_way(const Scratch& scratch) {
  const Running sweep = start(scratch, sweep_command + "--checkpoint 0");
  CHECK(holds_soon([&] { return size_of(scratch.path / "map.nc.log") > 30'000; }));
  return sweep;
}

const std::set<std::string> interrupted_files{"map.nc.log", "s.toml"};

}  // namespace

TEST_CASE("SIGINT and SIGTERM: 128 + n, how to go on, and going on gives the same bytes") {
  const Scratch scratch("sweep-interrupted");
  scratch.write("s.toml", corridor_study());
  for (const int signal : {SIGINT, SIGTERM}) {
    CAPTURE(signal);
    const Running sweep = under_way(scratch);
    ::kill(sweep.pid, signal);
    const Ran ran = finish(sweep);
    CHECK(ran.exit_code == 128 + signal);
    CHECK(ran.out.empty());
    CHECK(ran.err ==
          "tiltrim: stopped; what is done is in map.nc.log: the same command goes on there\n");
    CHECK(scratch.files() == interrupted_files);
    const Ran again = run(scratch, sweep_command);
    CHECK(again.exit_code == 0);
    CHECK(again.out == uninterrupted().text);
    CHECK(again.err.empty());
    CHECK(is_whole(scratch.path / "map.nc"));
    CHECK_FALSE(fs::exists(scratch.path / "map.nc.log"));
    fs::remove(scratch.path / "map.nc");
  }
}

TEST_CASE("two at one output: the second is refused, the first is not disturbed") {
  const Scratch scratch("sweep-two");
  scratch.write("s.toml", corridor_study());
  const Running first = under_way(scratch);
  ::kill(first.pid, SIGSTOP);
  const Ran second = run(scratch, sweep_command);
  CHECK(second.exit_code == 2);
  CHECK(second.err ==
        "tiltrim: map.nc.log: another process is at work on it; wait for it, or choose another "
        "output\n");
  CHECK(scratch.files() == interrupted_files);
  ::kill(first.pid, SIGCONT);
  CHECK(finish(first).exit_code == 0);
  CHECK(is_whole(scratch.path / "map.nc"));
}

TEST_CASE("the log of another study is refused, with the line that is another, and kept") {
  const Scratch scratch("sweep-other");
  scratch.write("s.toml", corridor_study());
  const Running sweep = under_way(scratch);
  ::kill(sweep.pid, SIGKILL);
  (void)finish(sweep);
  scratch.write("s.toml", std::regex_replace(corridor_study(), std::regex("to = 5"), "to = 6"));
  const Ran ran = run(scratch, sweep_command);
  CHECK(ran.exit_code == 2);
  for (const char* words : {"map.nc.log: is the log of another sweep", "'to = 5' there",
                            "'to = 6' here", "delete it, or choose another output"}) {
    CAPTURE(ran.err);
    CHECK(says(ran.err, words));
  }
  CHECK(scratch.files() == interrupted_files);
}

namespace {

// A file system of so many bytes in a name space of this process's own; false where that is not
// to be had.
bool mount_small(const path& folder, std::uintmax_t bytes) {
  static const bool own = ::unshare(CLONE_NEWNS) == 0 &&
                          ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
  fs::create_directories(folder);
  return own &&
         ::mount("none", folder.c_str(), "tmpfs", 0, fmt::format("size={}", bytes).c_str()) == 0;
}

// The disk is full at some moment: said, nothing lost; then there is room.
void runs_out_of_room(const Scratch& scratch, const std::string& folder, const std::string& options,
                      const std::string& said, bool keeps_log, const std::string& limit,
                      const auto& make_room) {
  const path map = scratch.path / folder / "map.nc";
  const std::string command = fmt::format("sweep s.toml -o {}map.nc {}", folder, options);
  scratch.write("s.toml", corridor_study());
  scratch.write(folder + "map.nc", "the old one");
  const Ran ran = run(scratch, command, {limit});
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(ran.err == fmt::format("tiltrim: {}{}\n", folder, said));
  CHECK(slurp(map) == "the old one");
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(map.parent_path()))
    names.insert(entry.path().filename());
  names.erase("s.toml");
  names.erase("ballast");
  CHECK(names == (keeps_log ? std::set<std::string>{"map.nc", "map.nc.log"}
                            : std::set<std::string>{"map.nc"}));
  make_room();
  const Ran again = run(scratch, command);
  CHECK(again.exit_code == 0);
  CHECK(is_whole(map));
  CHECK_FALSE(fs::exists(map.string() + ".log"));
}

// Shell commands under which no file may grow beyond so many bytes, or half of them.
std::string no_longer_than(std::uintmax_t bytes) {
  return fmt::format("ulimit -f {}; trap '' XFSZ;", bytes / 1024);  // blocks of 512 bytes, or 1024
}

}  // namespace

TEST_CASE("no room: said with the path, the old file stays, and it goes on when there is room") {
  const std::uintmax_t size = uninterrupted().bytes.size();
  const Scratch scratch("sweep-room");
  const auto nothing = [] {};
  SUBCASE("a limit on files: the map") {
    runs_out_of_room(scratch, "", "--checkpoint 1000", "map.nc: File too large", true,
                     no_longer_than(size / 2), nothing);
  }
  SUBCASE("a limit on files: the log") {
    runs_out_of_room(scratch, "", "--checkpoint 0", "map.nc.log: File too large", true,
                     no_longer_than(size / 2), nothing);
  }
  SUBCASE("a limit on files: the first of the log") {
    runs_out_of_room(scratch, "", "", "map.nc.log: File too large", false, no_longer_than(8192),
                     nothing);
  }
  for (const bool log : {false, true}) {
    SUBCASE(log ? "a full disk: the log" : "a full disk: the map") {
      const path small = scratch.path / "small";
      if (!mount_small(small, 4 * size)) {
        MESSAGE("no file system can be mounted here");
        return;
      }
      scratch.write("small/ballast", std::string(4 * size - size / 2, 'x'));
      runs_out_of_room(
          scratch, "small/", log ? "--checkpoint 0" : "--checkpoint 1000",
          log ? "map.nc.log: No space left on device" : "map.nc: No space left on device", true, "",
          [&] { fs::remove(small / "ballast"); });
      ::umount2(small.c_str(), MNT_DETACH);
    }
  }
}

// The file that is written beside the map has a new name each time.
TEST_CASE("killed while the map is written: nothing is left of it after the next run" *
          doctest::should_fail()) {
  const Scratch scratch("sweep-torn");
  scratch.write("s.toml", corridor_study());
  const Ran torn =
      run(scratch, sweep_command + "--checkpoint 1000",
          {fmt::format("ulimit -c 0; ulimit -f {};", uninterrupted().bytes.size() / 2048)});
  REQUIRE(torn.signal == SIGXFSZ);
  REQUIRE(run(scratch, sweep_command).exit_code == 0);
  REQUIRE(is_whole(scratch.path / "map.nc"));
  CHECK(scratch.files() == std::set<std::string>{"map.nc", "s.toml"});
}

namespace {

const std::string level = condition("a", 15, 0, 0);
const std::string gain = "[[sweep.axis]]\nkey = \"gains.K_Lp\"\n";
const std::string ends = "from = 0.1\nto = 1.0\n";
const std::string three = gain + ends + "count = 3\n";
const std::string airframe =
    "[[condition]]\nname = \"b\"\nformulation = \"airframe\"\nV = 15\neta_deg = 0\na1s_deg = 0\n";
const std::string printed =
    "[[condition]]\nname = \"c\"\nformulation = \"table\"\ngamma_deg = 0\nalpha_deg = 5\n"
    "eta_deg = 0\nCL = 0.5\nCD = 0.05\nCM = 0\nk = 0\n";

// Exit code 2, one line with all the words, and nothing written.
void check_refused(const Scratch& scratch, const std::string& arguments,
                   const std::vector<std::string>& words) {
  CAPTURE(arguments);
  const std::set<std::string> before = scratch.files();
  const Ran ran = run(scratch, arguments);
  CAPTURE(ran.err);
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(ran.err.starts_with("tiltrim: "));
  CHECK(std::ranges::count(ran.err, '\n') == 1);
  for (const std::string& one : words) {
    CAPTURE(one);
    CHECK(says(ran.err, one));
  }
  const bool nothing_new = scratch.files() == before;
  CHECK(nothing_new);
}

void check_study_refused(const Scratch& scratch, const std::string& study,
                         const std::vector<std::string>& words) {
  CAPTURE(study);
  scratch.write("s.toml", study);
  check_refused(scratch, "sweep s.toml -o map.nc", words);
}

struct Bad {
  std::string study;
  std::vector<std::string> said;
};

}  // namespace

TEST_CASE("a bad [[sweep.axis]]: exit 2 before any work, with the place and the key") {
  const Scratch scratch("sweep-bad-axis");
  const std::string range = "expected a number from ";
  const std::vector<Bad> cases{
      {level, {"s.toml: no [[sweep.axis]] table; expected"}},
      {level + "[sweep]\n", {"s.toml:6:1: sweep.axis: is missing"}},
      {level + "[sweep]\naxis = 3\n", {"s.toml:7:8: sweep.axis: 3 is no list of tables"}},
      {level + "[sweep]\naxis = []\n", {"s.toml:7:8: sweep.axis: "}},
      {level + "[sweep]\naxis = [1]\n", {"s.toml:7:9: sweep.axis: 1 is not a table"}},
      {"sweep = 3\n" + level, {"s.toml:1:9: sweep: 3 is not a table"}},
      {level + "[sweep]\ncrossing = \"skip\"\n" + three,
       {"s.toml:7:1: unknown key 'crossing' in [sweep]; did you mean 'crossings'?"}},
      {level + "[sweep]\ncrossings = true\n" + three, {"s.toml:7:13: sweep.crossings: a boolean"}},
      {level + "[sweep]\ncrossings = \"skp\"\n" + three,
       {"s.toml:7:13: sweep.crossings: 'skp'", "did you mean 'skip'?"}},
      {level + axis("gains.K_L", 1, 2, 3), {"s.toml:7:7: sweep.axis.key", "mean 'gains.K_Lp'?"}},
      {level + axis("gamma", 1, 2, 3), {"s.toml:7:7: sweep.axis.key", "mean 'gamma_deg'?"}},
      {level + axis("polar", 1, 2, 3), {"s.toml:7:7: sweep.axis.key: 'polar'"}},
      {level + "[[sweep.axis]]\n" + ends + "count = 3\n", {"s.toml:6:1: sweep.axis.key: is missi"}},
      {level + "[[sweep.axis]]\nkey = 3\n" + ends, {"s.toml:7:7: sweep.axis.key: 3 is not text"}},
      {level + three + "cout = 3\n",
       {"s.toml:11:1: unknown key 'cout' in [[sweep.axis]]; did you mean 'count'?"}},
      {level + gain + ends, {"s.toml:6:1: sweep.axis.count: is missing"}},
      {level + gain + ends + "count = 0\n", {"s.toml:10:9: sweep.axis.count: 0 is out", range}},
      {level + gain + ends + "count = 1\n", {"s.toml:10:9: sweep.axis.count: 1 is out", range}},
      {level + gain + ends + "count = -3\n", {"s.toml:10:9: sweep.axis.count: -3 is", range}},
      {level + gain + ends + "count = 2.5\n", {"s.toml:10:9: sweep.axis.count: 2.5 is not a who"}},
      {level + gain + ends + "count = 1e12\n", {"s.toml:10:9: sweep.axis.count: 1000000000000 is"}},
      {level + gain + ends + "count = \"3\"\n", {"s.toml:10:9: sweep.axis.count: the text '3'"}},
      {level + axis("gains.K_Lp", 1, 2, 10000) + axis("gains.k_V", 1, 2, 10000) +
           axis("gains.k_da", 1, 2, 10000),
       {"sweep.axis: the grid has 1e+12 points; expected at most 20000000"}},
      {level + gain + "to = 1.0\ncount = 3\n", {"s.toml:6:1: sweep.axis.from: is missing", range}},
      {level + gain + "from = 1.0\ncount = 3\n", {"s.toml:6:1: sweep.axis.to: is missing", range}},
      {level + gain + "from = nan\nto = 1\ncount = 3\n", {"s.toml:8:8: sweep.axis.from: nan is"}},
      {level + gain + "from = 0\nto = inf\ncount = 3\n", {"s.toml:9:6: sweep.axis.to: inf is not"}},
      {level + axis("V", -5, 5, 3), {"s.toml:8:8: sweep.axis.from: -5 is out", "from 0 to", "m/s"}},
      {level + axis("aircraft.mass", 0, 5, 3), {"s.toml:8:8: sweep.axis.from: 0 is out", "kg"}},
      {level + axis("gains.K_Lp", 1, 1, 3), {"s.toml:9:6: sweep.axis.to: 1 after 1"}},
      {level + axis("gains.K_Lp", -1, 1, 3) + "spacing = \"log\"\n",
       {"s.toml:11:11: sweep.axis.spacing: log from -1 to 1 passes zero"}},
      {level + axis("gains.K_Lp", 0, 1, 3) + "spacing = \"log\"\n",
       {"s.toml:11:11: sweep.axis.spacing: log from 0 to 1 passes zero"}},
      {level + axis("gains.K_Lp", 1, 2, 3) + "spacing = \"logg\"\n",
       {"s.toml:11:11: sweep.axis.spacing: 'logg' is not known", "did you mean 'log'?"}},
  };
  for (const Bad& bad : cases) check_study_refused(scratch, bad.study, bad.said);
}

TEST_CASE("bad values, and keys that move with an axis: exit 2, with the place and the key") {
  const Scratch scratch("sweep-bad-values");
  const auto with = [](const std::string& list) { return level + three + "with = " + list + "\n"; };
  const std::string once = "gains.k_V is set twice; expected each key once";
  const std::vector<Bad> cases{
      {level + gain + "values = []\n", {"s.toml:8:10: sweep.axis.values: an empty array"}},
      {level + gain + "values = 3\n", {"s.toml:8:10: sweep.axis.values: 3 is no list of numbers"}},
      {level + gain + "values = [1, \"a\"]\n", {"s.toml:8:14: sweep.axis.values: the text 'a'"}},
      {level + gain + "values = [1, nan]\n", {"s.toml:8:14: sweep.axis.values: nan is not finite"}},
      {level + gain + "values = [inf, 1]\n", {"s.toml:8:11: sweep.axis.values: inf is not finite"}},
      {level + gain + "values = [1, 3, 2]\n", {"s.toml:8:10: sweep.axis.values: 2 after 3"}},
      {level + gain + "values = [3, 1, 2]\n", {"s.toml:8:10: sweep.axis.values: 2 after 1"}},
      {level + gain + "values = [1, 2, 2]\n", {"s.toml:8:10: sweep.axis.values: 2 after 2"}},
      {level + gain + "values = [1, 2]\ncount = 2\n", {"s.toml:9:9: sweep.axis.count: stands bes"}},
      {level + gain + "values = [1, 2]\nfrom = 1\n", {"s.toml:9:8: sweep.axis.from: stands besid"}},
      {level + gain + "values = [1, 2]\nspacing = \"log\"\n", {"s.toml:9:11: sweep.axis.spacing:"}},
      {with("3"), {"s.toml:11:8: sweep.axis.with: 3 is no list of keys; expected [{key ="}},
      {with("[]"), {"s.toml:11:8: sweep.axis.with: "}},
      {with("[3]"), {"s.toml:11:9: sweep.axis.with: 3 is not a table"}},
      {with("[{key = \"gains.k_V\", frm = 1, to = 2}]"),
       {"s.toml:11:29: unknown key 'frm' in with; did you mean 'from'?"}},
      {with("[{key = \"gains.k_V\", from = 1, to = 2, count = 3}]"),
       {"s.toml:11:47: unknown key 'count' in with; the axis has the count"}},
      {with("[{key = \"gains.k_V\", values = [1, 2]}]"),
       {"s.toml:11:38: sweep.axis.with.values: 2 values beside an axis of 3"}},
      {with("[{key = \"gains.k_v\", from = 1, to = 2}]"),
       {"s.toml:11:16: sweep.axis.with.key: 'gains.k_v'", "did you mean 'gains.k_V'?"}},
      {with("[{key = \"h\", from = 1, to = 2}]"), {"s.toml:11:16: sweep.axis.with.key: h sets V"}},
      {with("[{key = \"gains.k_V\", from = 1, to = 2}, {key = \"gains.k_V\", values = [1, 2, 3]}]"),
       {"s.toml:", "sweep.axis: " + once}},
      {with("[{key = \"gains.K_Lp\", from = 1, to = 2}]"),
       {"s.toml:", "sweep.axis: gains.K_Lp is set twice"}},
      {level + axis("gains.k_V", 1, 2, 3) + axis("gains.k_V", 2, 3, 3), {"sweep.axis: " + once}},
      {level + axis("h", 0, 60, 3) + axis("V", 2, 3, 3),
       {"sweep.axis: V is set twice", "(h sets V, gamma_deg and eta_deg)"}},
  };
  for (const Bad& bad : cases) check_study_refused(scratch, bad.study, bad.said);
}

TEST_CASE("what a condition cannot be swept over: exit 2, with its name") {
  const Scratch scratch("sweep-bad-condition");
  const std::vector<Bad> cases{
      {airframe + three, {"s.toml: condition 'b': the airframe", "no variable gains.K_Lp"}},
      {printed + three, {"s.toml: condition 'c': formulation table has no linear model to sweep"}},
      {level + axis("V", 0, 20, 3), {"s.toml: condition 'a': V = 0 has no path"}},
      {airframe + axis("theta_deg", 0, 10, 3), {"s.toml: ", "theta_deg is free in this trim"}},
  };
  for (const Bad& bad : cases) check_study_refused(scratch, bad.study, bad.said);
}

// It says so only after the log is there.
TEST_CASE("conditions of two formulations: refused before any work" * doctest::should_fail()) {
  const Scratch scratch("sweep-formulations");
  check_study_refused(scratch, level + airframe + axis("aircraft.mass", 4, 5, 3),
                      {"s.toml: condition 'b' has other states than 'a'"});
}

// The check of V does not ask whether V moves.
TEST_CASE("a hover can be swept over a gain" * doctest::should_fail()) {
  const Scratch scratch("sweep-hover");
  scratch.write("s.toml", condition("hover", 0, 90, 90) + three);
  REQUIRE(run(scratch, "trim s.toml").exit_code == 0);
  CHECK(run(scratch, "sweep s.toml").exit_code != 2);
}

TEST_CASE("bad arguments and bad places: exit 2, the path or the option named") {
  const Scratch scratch("sweep-bad-arguments");
  scratch.write("s.toml", level + three);
  scratch.write("file", "");
  fs::create_directory(scratch.path / "folder");
  const std::string sweep = "sweep s.toml ";
  check_refused(scratch, "sweep", {"study is required", "tiltrim sweep --help"});
  check_refused(scratch, "sweep nowhere.toml", {"nowhere.toml: "});
  check_refused(scratch, "sweep folder", {"folder: ", "directory"});
  check_refused(scratch, sweep + "-o folder", {"folder: Is a directory"});
  check_refused(scratch, sweep + "-o none/map.nc", {"none: No such file or directory"});
  check_refused(scratch, sweep + "-o file/map.nc", {"file"});
  check_refused(scratch, sweep + "-o /proc/map.nc", {"/proc"});
  check_refused(scratch, sweep + "--threads -1", {"--threads", "-1"});
  check_refused(scratch, sweep + "--threads 1025", {"--threads", "1025"});
  check_refused(scratch, sweep + "--threads 1.5", {"--threads"});
  check_refused(scratch, sweep + "--checkpoint -1", {"--checkpoint", "-1"});
  check_refused(scratch, sweep + "--theads 2", {"--theads"});
  check_refused(scratch, sweep + "--format xml", {"--format", "text"});
  check_refused(scratch, sweep + "--only b", {"s.toml: no condition 'b'", "there are: a"});
  check_refused(scratch, sweep + "--only aa", {"nearest: 'a'"});
  check_refused(scratch, "swep s.toml", {"did you mean 'sweep'?"});
  check_refused(scratch, "diff s.toml s.toml", {"s.toml: "});
  check_refused(scratch, "diff none.nc s.toml", {"none.nc: No such file"});
  check_refused(scratch, "diff none.nc", {"after is required", "tiltrim diff --help"});
}

// CLI::Range lets it pass, and no comparison with it is true: nothing is ever logged.
TEST_CASE("--checkpoint nan is refused" * doctest::should_fail()) {
  const Scratch scratch("sweep-nan");
  scratch.write("s.toml", level + three);
  check_refused(scratch, "sweep s.toml --checkpoint nan", {"--checkpoint"});
}
