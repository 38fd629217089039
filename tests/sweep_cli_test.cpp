// `tiltrim sweep` and `tiltrim diff` as a user runs them: killed, interrupted, disk full, misused.
#include <poll.h>
#include <pty.h>
#include <sched.h>
#include <sys/mount.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <string>

#include "tests/check.hpp"
#include "tests/forged_map.hpp"
#include "tests/program.hpp"

namespace sweep_cli_test {

namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using program::csv_of;
using program::finish;
namespace fs = std::filesystem;
using fs::path;
using program::holds_soon;
using program::Ran;
using program::records_in;
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

const std::set<std::string> interrupted_files{"map.nc.log", "s.toml"};

const std::string sweep_command = "sweep s.toml -o map.nc ";

double now() {  // s
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Uninterrupted {
  std::string bytes, text;
  double seconds = 0.0;
};

// Once for all cases.
const Uninterrupted& uninterrupted() {
  static const Uninterrupted whole = [] {
    const Scratch scratch("sweep-whole");
    scratch.write("s.toml", corridor_study());
    const double begun = now();
    const Ran ran = run(scratch, sweep_command);
    const double spent = now() - begun;
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.err.empty());
    CHECK(scratch.files() == std::set<std::string>{"map.nc", "s.toml"});
    return Uninterrupted{slurp(scratch.path / "map.nc"), ran.out, spent};
  }();
  return whole;
}

// Not compared by doctest, whose printout of two files would be useless.
bool is_whole(const path& file) { return slurp(file) == uninterrupted().bytes; }

struct Killed {
  int landed = 0;
  bool went_on = true;  // what one run logged, the next did not repeat
};

// Kills runs of one command at random moments until so many kills have met a running program.
Killed kill_often(const Scratch& scratch, const std::string& options, int kills, unsigned seed) {
  constexpr std::uintmax_t record = 1 << 16;  // more than the one that a kill may tear
  const path map = scratch.path / "map.nc", log = scratch.path / "map.nc.log";
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  double longest = uninterrupted().seconds;
  Killed killed;
  std::uintmax_t logged = 0;
  scratch.write("map.nc", "the old one");
  for (int i = 0; i < 20 * kills && killed.landed < kills; ++i) {
    const Running sweep = start(scratch, sweep_command + options);
    const double begun = now();
    std::this_thread::sleep_for(std::chrono::duration<double>(longest * share(random)));
    ::kill(sweep.pid, SIGKILL);
    const Ran ran = finish(sweep);
    const bool whole = is_whole(map);
    if (ran.signal == SIGKILL) {
      ++killed.landed;
      CHECK((whole || slurp(map) == "the old one"));
      if (!whole) killed.went_on = killed.went_on && size_of(log) + record >= logged;
      logged = whole ? 0 : size_of(log);
    } else {
      CHECK(ran.exit_code == 0);
      CHECK(whole);
      CHECK_FALSE(fs::exists(log));
      if (logged == 0) longest = std::min(longest, now() - begun);  // the machine was busy then
      logged = 0;
    }
    scratch.write("map.nc", "the old one");
  }
  return killed;
}

}  // namespace

TEST_CASE("killed at random moments and taken up again: the same bytes") {
  for (const std::string interval : {"0", "0.05"}) {
    CAPTURE(interval);
    const Scratch scratch("sweep-killed");
    scratch.write("s.toml", corridor_study());
    const int kills = trials(10);
    const std::string options = "--checkpoint " + interval;
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

Surroundings on_ranks(int n, const std::string& command = mpi_program) {
  return {"", fmt::format("mpirun --oversubscribe --allow-run-as-root -n {} {}", n, command)};
}

bool without_mpi() {
  if (mpi_program.empty()) MESSAGE("no program for MPI was built");
  return mpi_program.empty();
}

// The process id of one rank of a launcher; 0 if there is none yet.
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

namespace {

// A sweep with the first records in its log; one thread, which takes long on every machine.
Running under_way(const Scratch& scratch) {
  const Running sweep = start(scratch, sweep_command + "--threads 1 --checkpoint 0");
  CHECK(holds_soon([&] { return records_in(scratch.path / "map.nc.log") > 0; }));
  return sweep;
}

// Kills one of n ranks once the log grows; false if the map was written before that.
bool kill_one_of(int n, const Scratch& scratch, const std::string& command) {
  const path map = scratch.path / "map.nc", log = scratch.path / "map.nc.log";
  const std::uintmax_t logged = records_in(log);
  const Running sweep = start(scratch, command, on_ranks(n));
  CHECK(holds_soon([&] { return fs::exists(map) || records_in(log) > logged; }));
  const pid_t rank = one_rank_of(sweep.pid);  // 0: the sweep has ended
  if (rank > 0) ::kill(rank, SIGKILL);
  const int exit_code = finish(sweep).exit_code;
  CHECK((fs::exists(map) ? is_whole(map) : rank > 0 && exit_code != 0));
  return !fs::exists(map);
}

}  // namespace

TEST_CASE("a rank is killed; the sweep goes on with another number of ranks") {
  if (without_mpi()) return;
  const Scratch scratch("sweep-rank-killed");
  scratch.write("s.toml", corridor_study());
  const std::string command = sweep_command + "--checkpoint 0";
  for (const int n : {3, 2}) {
    CAPTURE(n);
    bool killed = false;
    for (int tries = 0; tries < 20 && !killed; ++tries) {
      fs::remove(scratch.path / "map.nc");
      killed = kill_one_of(n, scratch, command);
    }
    CHECK(killed);
  }
  const Ran last = run(scratch, command, on_ranks(2));
  CHECK(last.exit_code == 0);
  CHECK(is_whole(scratch.path / "map.nc"));
  CHECK_FALSE(fs::exists(scratch.path / "map.nc.log"));
}

TEST_CASE("ranks: the log's disk is full: all end") {
  if (without_mpi()) return;
  const Scratch scratch("sweep-ranks-room");
  scratch.write("s.toml", corridor_study());
  const std::string limited = (scratch.said / "limited.sh").string();
  std::ofstream(limited) << fmt::format("ulimit -f 100\ntrap '' XFSZ\nexec {} \"$@\"\n",
                                        mpi_program);
  const Ran full =
      finish(start(scratch, sweep_command + "--checkpoint 0", on_ranks(2, "sh " + limited)), 60s);
  REQUIRE(says(full.err, "map.nc.log: File too large"));
  REQUIRE(scratch.files() == interrupted_files);
  CHECK(full.exit_code == 2);
}

TEST_CASE("ranks: the log is in use: all end") {
  if (without_mpi()) return;
  const Scratch scratch("sweep-ranks-two");
  scratch.write("s.toml", corridor_study());
  const Running first = under_way(scratch);
  ::kill(first.pid, SIGSTOP);
  const Ran second = finish(start(scratch, sweep_command, on_ranks(2)), 60s);
  ::kill(first.pid, SIGKILL);
  (void)finish(first);
  REQUIRE(says(second.err, "map.nc.log: another process is using it"));
  CHECK(second.exit_code == 2);
}

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
          "tiltrim: stopped; finished lines are in map.nc.log: the same command continues from "
          "there\n");
    CHECK(scratch.files() == interrupted_files);
    const Ran again = run(scratch, sweep_command);
    CHECK(again.exit_code == 0);
    CHECK(again.out == uninterrupted().text);
    CHECK(again.err == "tiltrim: resumed from map.nc.log: its lines were not computed again\n");
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
  CHECK(
      second.err ==
      "tiltrim: map.nc.log: another process is using it; wait for it, or choose another output\n");
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
  for (const char* words : {"map.nc.log: is the log of another run", "'to = 5' in the log",
                            "'to = 6' now", "delete it, or choose another output"}) {
    CAPTURE(ran.err);
    CHECK(says(ran.err, words));
  }
  CHECK(scratch.files() == interrupted_files);
}

namespace {

// A file system of this size in a private name space; false if not permitted.
bool mount_small(const path& folder, std::uintmax_t bytes) {
  static const bool own = ::unshare(CLONE_NEWNS) == 0 &&
                          ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
  fs::create_directories(folder);
  return own &&
         ::mount("none", folder.c_str(), "tmpfs", 0, fmt::format("size={}", bytes).c_str()) == 0;
}

// The disk becomes full at some moment: reported, nothing lost; then there is room.
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

TEST_CASE("killed while the map is written: nothing is left of it after the next run") {
  const Scratch scratch("sweep-torn");
  scratch.write("s.toml", corridor_study());
  scratch.write("map.nc.part", uninterrupted().bytes.substr(0, uninterrupted().bytes.size() / 2));
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
      {level + "[sweep]\naxis = 3\n", {"s.toml:7:8: sweep.axis: 3 is not a list of tables"}},
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
       {"s.toml:11:11: sweep.axis.spacing: log from -1 to 1 passes through zero"}},
      {level + axis("gains.K_Lp", 0, 1, 3) + "spacing = \"log\"\n",
       {"s.toml:11:11: sweep.axis.spacing: log from 0 to 1 passes through zero"}},
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
      {level + gain + "values = 3\n",
       {"s.toml:8:10: sweep.axis.values: 3 is not a list of numbers"}},
      {level + gain + "values = [1, \"a\"]\n", {"s.toml:8:14: sweep.axis.values: the text 'a'"}},
      {level + gain + "values = [1, nan]\n", {"s.toml:8:14: sweep.axis.values: nan is not finite"}},
      {level + gain + "values = [inf, 1]\n", {"s.toml:8:11: sweep.axis.values: inf is not finite"}},
      {level + gain + "values = [1, 3, 2]\n", {"s.toml:8:10: sweep.axis.values: 2 after 3"}},
      {level + gain + "values = [3, 1, 2]\n", {"s.toml:8:10: sweep.axis.values: 2 after 1"}},
      {level + gain + "values = [1, 2, 2]\n", {"s.toml:8:10: sweep.axis.values: 2 after 2"}},
      {level + gain + "values = [1, 2]\ncount = 2\n",
       {"s.toml:9:9: sweep.axis.count: cannot be combined"}},
      {level + gain + "values = [1, 2]\nfrom = 1\n",
       {"s.toml:9:8: sweep.axis.from: cannot be combined"}},
      {level + gain + "values = [1, 2]\nspacing = \"log\"\n", {"s.toml:9:11: sweep.axis.spacing:"}},
      {with("3"), {"s.toml:11:8: sweep.axis.with: 3 is not a list of keys; expected [{key ="}},
      {with("[]"), {"s.toml:11:8: sweep.axis.with: "}},
      {with("[3]"), {"s.toml:11:9: sweep.axis.with: 3 is not a table"}},
      {with("[{key = \"gains.k_V\", frm = 1, to = 2}]"),
       {"s.toml:11:29: unknown key 'frm' in with; did you mean 'from'?"}},
      {with("[{key = \"gains.k_V\", from = 1, to = 2, count = 3}]"),
       {"s.toml:11:47: unknown key 'count' in with; the axis determines the count"}},
      {with("[{key = \"gains.k_V\", values = [1, 2]}]"),
       {"s.toml:11:38: sweep.axis.with.values: 2 values for an axis of 3"}},
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

TEST_CASE("what a condition cannot be swept over: exit 2, with its place") {
  const Scratch scratch("sweep-bad-condition");
  const std::vector<Bad> cases{
      {airframe + three, {"s.toml:1:1: condition 'b': the airframe", "no variable gains.K_Lp"}},
      {printed + three,
       {"s.toml:1:1: condition 'c': formulation table has no linear model to sweep"}},
      {level + axis("V", 0, 20, 3), {"s.toml:1:1: condition 'a': at V = 0 there is no path"}},
      {airframe + axis("theta_deg", 0, 10, 3),
       {"s.toml: ", "theta_deg is a free variable of this trim;"}},
  };
  for (const Bad& bad : cases) check_study_refused(scratch, bad.study, bad.said);
}

TEST_CASE("conditions of two formulations: refused before any work") {
  const Scratch scratch("sweep-formulations");
  check_study_refused(scratch, level + airframe + axis("aircraft.mass", 4, 5, 3),
                      {"s.toml: the states of condition 'b' differ from those of 'a'"});
}

TEST_CASE("a hover can be swept over a gain") {
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
  check_refused(scratch, "sweep", {"STUDY.toml is missing", "tiltrim sweep --help"});
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
  check_refused(scratch, "diff none.nc",
                {"AFTER.nc is missing; expected 'tiltrim diff BEFORE.nc AFTER.nc'", "--help"});
}

TEST_CASE("--checkpoint nan is refused") {
  const Scratch scratch("sweep-nan");
  scratch.write("s.toml", level + axis("V", 12, 15, 3));
  check_refused(scratch, "sweep s.toml --checkpoint nan", {"--checkpoint"});
}

namespace {

// Some without trim; a name that CSV has to quote; a key that moves with an axis.
const std::string mixed = condition("flat, level", 15, 0, 0) + condition("climb", 15, 8, 0) +
                          axis("eta_deg", 90, 0, 4) +
                          "with = [{ key = \"V\", from = 3.0, to = 60.0 }]\n" +
                          "[[sweep.axis]]\nkey = \"gains.K_Lp\"\nvalues = [0.05, 0.85, 5.0]\n";

const std::string points_alone = "[sweep]\ncrossings = \"skip\"\n";

// Cells of a row by the names of their columns.
using Cells = std::map<std::string, std::string>;

std::vector<Cells> cells_of(const std::string& csv) {
  const std::vector<Row> rows = csv_of(csv);
  std::vector<Cells> all;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    REQUIRE(rows[r].size() == rows[0].size());
    Cells& cells = all.emplace_back();
    for (std::size_t k = 0; k < rows[r].size(); ++k) cells[rows[0][k]] = rows[r][k];
    CHECK(cells.size() == rows[r].size());  // no name twice
  }
  return all;
}

// Every digit; an empty cell is a number that is not there.
void check_same(const std::string& cell, const json& number) {
  if (cell.empty())
    CHECK(number.is_null());
  else
    CHECK(std::stod(cell) == number.get<double>());
}

void check_point(const Cells& row, const json& point) {
  CHECK(row.at("condition") == point["condition"]);
  for (const char* key : {"eta_deg", "V", "gains.K_Lp"}) check_same(row.at(key), point[key]);
  CHECK(row.at("status") == point["status"]);
  CHECK(row.at("reason") == point["message"]);
  if (point["verdict"].is_null()) {
    for (const char* key : {"verdict", "residual", "spectral_abscissa", "theta", "theta0",
                            "eigenvalue_re_0", "eigenvalue_im_5"})
      CHECK(row.at(key).empty());
    CHECK_FALSE(row.at("reason").empty());
    CHECK_FALSE(point.contains("modes"));
    return;
  }
  CHECK(row.at("verdict") == point["verdict"]);
  for (const char* key : {"residual", "spectral_abscissa", "damping"})
    check_same(row.at(key), point[key]);
  CHECK((row.at("second_branch") == "1") == point["second_branch"].get<bool>());
  for (const char* list : {"state", "input"})
    for (const auto& [name, value] : point[list].items()) check_same(row.at(name), value);
  CHECK(point["state"].size() == 6);
  CHECK(point["input"].size() == 3);
  REQUIRE(point["modes"].size() == 6);
  for (std::size_t i = 0; i < 6; ++i) {
    check_same(row.at(fmt::format("eigenvalue_re_{}", i)), point["modes"][i]["re"]);
    check_same(row.at(fmt::format("eigenvalue_im_{}", i)), point["modes"][i]["im"]);
  }
}

}  // namespace

TEST_CASE("CSV: a state that is an axis has one column") {
  const Scratch scratch("sweep-axis-column");
  scratch.write("s.toml", R"([[condition]]
name = "level"
formulation = "airframe"
V = 15.0
gamma_deg = 0.0
eta_deg = 0.0
[[sweep.axis]]
key = "V"
values = [12.0, 15.0]
)");
  const std::vector<Cells> points = cells_of(run(scratch, "sweep s.toml -f csv").out);
  REQUIRE(points.size() == 2);
  CHECK(points[0].at("V") == "12");
  CHECK(points[1].contains("theta"));
}

TEST_CASE("CSV has a row for each point and every column; JSON says the same to every digit") {
  const Scratch scratch("sweep-formats");
  scratch.write("s.toml", points_alone + mixed);
  const Ran csv = run(scratch, "sweep s.toml -f csv"), text = run(scratch, "sweep s.toml");
  CHECK(csv.exit_code == 1);  // points without trim
  CHECK(csv.err.empty());
  const std::vector<Row> rows = csv_of(csv.out);
  std::string header;
  for (const std::string& name : rows.at(0)) header += name + " ";
  std::string expected =
      "condition eta_deg V gains.K_Lp status verdict reason residual spectral_abscissa damping "
      "second_branch V_err gamma_err theta q energy_integral distribution_integral theta0 a1s "
      "delta_e ";
  for (int i = 0; i < 6; ++i) expected += fmt::format("eigenvalue_re_{0} eigenvalue_im_{0} ", i);
  CHECK(header == expected);

  const std::vector<Cells> points = cells_of(csv.out);
  const json all = json::parse(run(scratch, "sweep s.toml -f json").out);
  REQUIRE(points.size() == 2 * 4 * 3);
  REQUIRE(all["points"].size() == points.size());
  std::map<std::string, int> counts;
  for (std::size_t p = 0; p < points.size(); ++p) {
    CAPTURE(p);
    check_point(points[p], all["points"][p]);
    CHECK(points[p].at("condition") == (p < 12 ? "flat, level" : "climb"));
    CHECK(std::stod(points[p].at("eta_deg")) == 90 - 30.0 * double(p / 3 % 4));
    CHECK_NEAR(std::stod(points[p].at("V")), 3 + 19.0 * double(p / 3 % 4), 1e-13);
    ++counts[points[p].at("condition") + points[p].at("verdict")];
  }
  for (const std::string c : {"flat, level", "climb"})
    CHECK(says(text.out, fmt::format("{} stable, {} unstable, 0 undecided, {} without trim",
                                     counts[c + "stable"], counts[c + "unstable"], counts[c])));
  CHECK(counts["flat, level"] > 0);
  CHECK(counts["flat, levelunstable"] > 0);

  // To a file the same; --only leaves the other out and changes nothing else.
  CHECK(run(scratch, "sweep s.toml -o map.csv -f csv").out.empty());
  CHECK(slurp(scratch.path / "map.csv") == csv.out);
  const Ran only = run(scratch, "sweep s.toml --only climb -f csv");
  CHECK(only.exit_code == 0);
  CHECK(csv.out ==
        csv.out.substr(0, csv.out.find("climb,")) + only.out.substr(only.out.find('\n') + 1));
  CHECK(scratch.files() == std::set<std::string>{"map.csv", "s.toml"});
}

// The numbers by an independent method: a branch followed along V, and the conditions on both
// sides.
TEST_CASE("one axis: the text has its intervals; the crossing is where the branch has it") {
  const Scratch scratch("sweep-one");
  const std::string flat = condition("level", 20, 0, 0);
  scratch.write("s.toml",
                flat + axis("V", 20, 9.5, 22) + "[follow]\nparameter = \"V\"\nto = 5.0\n");
  const auto interval = [](const json& i) {
    return std::regex(fmt::format(R"(\n +{:.9g} +{:.9g} +{} +{} +{:.6g} )", i["from"].get<double>(),
                                  i["to"].get<double>(), i["verdict"].get<std::string>(),
                                  i["unstable"].get<int>(), i["abscissa"].get<double>()));
  };
  const Ran stable = run(scratch, "sweep s.toml");
  CHECK(stable.exit_code == 0);
  CHECK(says(stable.out, "22 stable, 0 unstable, 0 undecided, 0 without trim"));
  CHECK(says(stable.out, "stable throughout [20, 9.5] m/s"));

  scratch.write("s.toml",
                flat + axis("V", 20, 9.151, 22) + "[follow]\nparameter = \"V\"\nto = 5.0\n");
  const Ran text = run(scratch, "sweep s.toml");
  const json all = json::parse(run(scratch, "sweep s.toml -f json").out);
  const json hopf =
      json::parse(run(scratch, "follow s.toml -f json").out)["branches"][0]["events"][0];
  REQUIRE(hopf["kind"] == "hopf");
  REQUIRE(all["crossings"].size() == 1);
  const json& crossing = all["crossings"][0];
  CHECK(crossing["kind"] == "hopf");
  CHECK(crossing["unstable_before"] == 0);
  CHECK(crossing["unstable_after"] == 2);
  const double V = crossing["at"]["V"].get<double>();
  CHECK_NEAR(V, hopf["V"].get<double>(), 1e-8);
  CHECK_NEAR(crossing["frequency"].get<double>(), hopf["eigenvalue"]["im"].get<double>(), 1e-6);
  REQUIRE(all["intervals"].size() == 2);
  CHECK(all["intervals"][0]["to"] == V);
  CHECK(all["intervals"][1]["from"] == V);
  CHECK(all["intervals"][1]["to"] == 9.151);
  CHECK(all["intervals"][1]["verdict"] == "unstable");
  for (const json& i : all["intervals"]) {
    CAPTURE(text.out);
    CHECK(std::regex_search(text.out, interval(i)));
  }
  CHECK(says(text.out, "21 stable, 1 unstable, 0 undecided, 0 without trim"));
  CHECK(says(text.out, "unstable in 1 interval of [20, 9.151] m/s"));
  for (const double side : {1e-7, -1e-7}) {
    scratch.write("side.toml", condition("a", V + side, 0, 0));
    CHECK(
        json::parse(run(scratch, "linearize side.toml -f json").out)["conditions"][0]["verdict"] ==
        (side > 0 ? "stable" : "unstable"));
  }
}

TEST_CASE("one axis, a gain: the crossing lies between stable and unstable") {
  const Scratch scratch("sweep-gain");
  const auto at_gain = [&](double K_Lp) {
    scratch.write("side.toml",
                  fmt::format("[gains]\nK_Lp = {:.17g}\n", K_Lp) + condition("hover", 3, 0, 90));
    return json::parse(run(scratch, "linearize side.toml -f json").out)["conditions"][0];
  };
  scratch.write("s.toml", condition("hover", 3, 0, 90) + axis("gains.K_Lp", 0.05, 5, 12));
  const Ran ran = run(scratch, "sweep s.toml -f json");
  REQUIRE(ran.exit_code == 0);
  const json all = json::parse(ran.out);
  REQUIRE(all["crossings"].size() == 1);
  const double K_Lp = all["crossings"][0]["at"]["gains.K_Lp"].get<double>();
  CHECK(at_gain(K_Lp - 1e-7)["verdict"] == "unstable");
  CHECK(at_gain(K_Lp + 1e-7)["verdict"] == "stable");
  CHECK(says(run(scratch, "sweep s.toml").out, fmt::format("{:.9g}", K_Lp)));
}

TEST_CASE("diff: a map and itself; two maps whose one gain is another, against their CSV") {
  const Scratch scratch("sweep-diff");
  scratch.write("a.toml", mixed);
  scratch.write("b.toml", "[gains]\nk_V = 14.0\n" + mixed);
  for (const std::string name : {"a", "b"})
    CHECK(run(scratch, fmt::format("sweep {0}.toml -o {0}.nc", name)).exit_code == 1);
  const Ran same = run(scratch, "diff a.nc a.nc");
  CHECK(same.exit_code == 0);
  CHECK(same.out.starts_with("0 of 24 points changed status or stability\n"));
  CHECK(says(same.out, "crossings: 0 moved, 0 appeared, 0 vanished\n"));
  CHECK(csv_of(run(scratch, "diff a.nc a.nc -f csv").out).size() == 1);

  for (const std::string name : {"a", "b"})
    scratch.write(name + ".toml", points_alone + slurp(scratch.path / (name + ".toml")));
  const std::vector<Cells> before = cells_of(run(scratch, "sweep a.toml -f csv").out);
  const std::vector<Cells> after = cells_of(run(scratch, "sweep b.toml -f csv").out);
  const Ran text = run(scratch, "diff a.nc b.nc"), csv = run(scratch, "diff a.nc b.nc -f csv");
  const std::vector<Cells> changed = cells_of(csv.out);
  const json all = json::parse(run(scratch, "diff a.nc b.nc -f json").out);
  CHECK(text.exit_code == 1);
  CHECK(text.err.empty());
  std::size_t k = 0;
  double largest = 0;
  for (std::size_t p = 0; p < before.size(); ++p) {
    const Cells &a = before[p], &b = after[p];
    if (!a.at("verdict").empty() && !b.at("verdict").empty())
      largest = std::max(largest, std::abs(std::stod(b.at("spectral_abscissa")) -
                                           std::stod(a.at("spectral_abscissa"))));
    if (a.at("status") == b.at("status") && a.at("verdict") == b.at("verdict")) continue;
    REQUIRE(k < changed.size());
    for (const char* key : {"condition", "eta_deg", "gains.K_Lp"})
      CHECK(changed[k].at(key) == a.at(key));
    for (const std::string key : {"status", "verdict"}) {
      CHECK(changed[k].at(key + "_before") == a.at(key));
      CHECK(changed[k].at(key + "_after") == b.at(key));
    }
    CHECK(changed[k].at("abscissa_before") == a.at("spectral_abscissa"));
    CHECK(changed[k].at("abscissa_after") == b.at("spectral_abscissa"));
    check_same(a.at("gains.K_Lp"), all["changed"][k]["gains.K_Lp"]);
    check_same(b.at("spectral_abscissa"), all["changed"][k]["spectral_abscissa"][1]);
    ++k;
  }
  CHECK(k > 0);
  CHECK(k == changed.size());
  CHECK(k == all["changed"].size());
  CHECK(all["largest_abscissa_change"] == largest);
  CHECK(text.out.starts_with(fmt::format("{} of 24 points changed status or stability\n", k)));
  CHECK(says(text.out, fmt::format("largest real part: {:.6g} 1/s", largest)));
}

TEST_CASE("diff: maps that cannot be compared, and what is no map: exit 2") {
  const Scratch scratch("sweep-no-diff");
  scratch.write("a.toml", points_alone + mixed);
  scratch.write("b.toml", condition("climb", 15, 8, 0) + axis("V", 10, 20, 3));
  REQUIRE(run(scratch, "sweep a.toml -o a.nc").exit_code == 1);
  REQUIRE(run(scratch, "sweep b.toml -o b.nc").exit_code == 0);
  REQUIRE(run(scratch, "sweep a.toml --only climb -o c.nc").exit_code == 0);
  const std::string bytes = slurp(scratch.path / "a.nc");
  scratch.write("cut.nc", bytes.substr(0, bytes.size() / 2));
  scratch.write("empty.nc", "");
  fs::create_directory(scratch.path / "folder");
  check_refused(scratch, "diff a.nc c.nc", {"cannot be compared: conditions [flat, level, climb]"});
  check_refused(scratch, "diff c.nc b.nc", {"cannot be compared: axes"});
  for (const std::string file : {"cut.nc", "empty.nc", "a.toml", "folder", "none.nc"})
    check_refused(scratch, "diff a.nc " + file, {"tiltrim: " + file + ": "});
}

TEST_CASE("diff, report: a forged map, its checksums holding, is read or refused by name") {
  const Scratch scratch("sweep-forged");
  scratch.write("s.toml", "[report]\nflight = \"skip\"\naudit = \"skip\"\n" +
                              condition("level", 15, 0, 0) + axis("gains.K_Lp", 0.05, 5.0, 3));
  REQUIRE(run(scratch, "sweep s.toml -o map.nc").exit_code == 0);
  const std::string whole = slurp(scratch.path / "map.nc");
  const auto pieces = hdf5_pieces(whole);
  std::mt19937_64 random(18);
  const auto draw = [&] { return std::uint16_t(random()); };
  int crashes = 0;
  for (int trial = 0; trial < trials(40); ++trial) {
    const Hdf5Change change{draw(), draw(), std::uint8_t(draw()), std::uint8_t(draw()), draw()};
    scratch.write("forged.nc", forged(whole, pieces, {change}));
    for (const char* command : {"diff map.nc forged.nc", "report s.toml --sweep forged.nc"}) {
      if (trial % 10 > 0 && command[0] == 'r') continue;  // takes longer, reads the same
      const Ran ran = run(scratch, command);
      CAPTURE(ran.err);
      REQUIRE((ran.exit_code >= 0 && ran.exit_code <= 2));
      const bool named = ran.exit_code == 2 ? says(ran.err, "forged.nc: ") : ran.err.empty();
      REQUIRE(named);
      crashes += says(ran.err, "the NetCDF library crashes (");
    }
  }
  CHECK((sanitized || crashes > 0));
}

TEST_CASE("memory that runs out: the program says for what, and leaves no map") {
  if (sanitized) return;  // its shadow memory takes all the address space
  const Scratch scratch("sweep-memory");
  scratch.write("s.toml", condition("level", 15, 0, 0) + axis("gains.K_Lp", 0.05, 5.0, 4000) +
                              axis("gains.k_de", 0.05, 5.0, 4000));
  const Ran ran = run(scratch, "sweep s.toml -o map.nc --threads 1", {"ulimit -v 900000;"});
  CHECK(ran.exit_code == 2);
  CHECK(
      ran.err ==
      "tiltrim: s.toml: not enough memory for a map of 1 condition, K_Lp 4000 x k_de 4000 points; "
      "expected fewer points\n");
  CHECK(!fs::exists(scratch.path / "map.nc"));
}

TEST_CASE("memory that runs out while the output is made: the program says for what") {
  if (sanitized) return;
  const Scratch scratch("sweep-memory");
  scratch.write("s.toml", condition("level", 15, 0, 0) + axis("gains.K_Lp", 0.05, 5.0, 300) +
                              axis("gains.k_de", 0.05, 5.0, 300));
  for (const int limit : {450'000, 550'000, 700'000}) {  // kB: before, in and after the points
    const Ran ran =
        run(scratch, "sweep s.toml -f json --threads 1", {fmt::format("ulimit -v {};", limit)});
    CHECK(ran.exit_code == 2);
    CHECK(ran.out.empty());
    CHECK(ran.err == "tiltrim: not enough memory for: sweep s.toml -f json --threads 1\n");
  }
}

TEST_CASE("standard output that is full or closed, standard error that is closed") {
  const Scratch scratch("sweep-streams");
  scratch.write("s.toml", condition("a", 15, 0, 0) + axis("V", 12, 15, 3));
  const std::string whole = run(scratch, "sweep s.toml").out;
  const Ran full = run(scratch, "sweep s.toml >/dev/full");
  CHECK(full.exit_code == 2);
  CHECK(full.err == "tiltrim: standard output: No space left on device\n");
  const Ran help = run(scratch, "--help >/dev/full");
  CHECK(help.exit_code == 2);
  CHECK(help.err == "tiltrim: standard output: No space left on device\n");
  const Ran closed = run(scratch, "sweep s.toml >&-");
  CHECK(closed.exit_code == 2);
  CHECK(closed.err == "tiltrim: standard output: Bad file descriptor\n");
  REQUIRE(run(scratch, "sweep s.toml -o map.nc").exit_code == 0);
  const std::string map = slurp(scratch.path / "map.nc");
  for (const char* closing : {">&-", "2>&-", "<&- >&- 2>&-"}) {
    CAPTURE(closing);
    fs::remove(scratch.path / "map.nc");
    (void)run(scratch, fmt::format("sweep s.toml -o map.nc --checkpoint 0 {}", closing));
    const bool right = slurp(scratch.path / "map.nc") == map;
    CHECK(right);
    CHECK(scratch.files() == std::set<std::string>{"map.nc", "s.toml"});
  }
  CHECK(run(scratch, "sweep s.toml").out == whole);
}

namespace {

// Output of a run on a terminal until the pattern appears, when Ctrl-C is typed.
Ran on_terminal(const Scratch& scratch, const std::string& arguments, const std::regex& pattern) {
  Ran ran;
  int terminal = -1;
  const pid_t pid = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  if (pid == 0) {
    const std::string command =
        fmt::format("cd '{}' && exec {} {}", scratch.path.string(), TILTRIM_PROGRAM, arguments);
    ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  bool typed = false;
  constexpr int most = 100'000;  // pieces
  for (int i = 0; i < most; ++i) {
    pollfd ready{terminal, POLLIN, 0};
    char piece[4096];
    const ssize_t n = ::poll(&ready, 1, 60'000) == 1 ? ::read(terminal, piece, sizeof piece) : 0;
    if (n <= 0) break;  // EIO: the other side is closed
    ran.out.append(piece, std::size_t(n));
    if (typed || !std::regex_search(ran.out, pattern)) continue;
    typed = ::write(terminal, "\x03", 1) == 1;
  }
  ::kill(pid, SIGKILL);  // nothing to one that has ended
  int status = 0;
  ::waitpid(pid, &status, 0);
  ::close(terminal);
  ran.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

}  // namespace

TEST_CASE(
    "a terminal is told how far it is and how long it takes; Ctrl-C; a pipe is told nothing") {
  const Scratch scratch("sweep-terminal");
  scratch.write("s.toml", condition("a", 15, 0, 0) + axis("h", 0, 60, 1200) +
                              axis("gains.K_Lp", 0.05, 5.0, 700));  // several seconds
  const std::regex progress(
      R"(\r\x1b\[K([0-9]+) of (840000 points|1900 lines): ([0-9]+) stable, ([0-9]+) unstable, )"
      R"([0-9]+ s left)");
  const Ran ran = on_terminal(scratch, sweep_command + "--threads 1", progress);
  CAPTURE(ran.out);
  CHECK(ran.exit_code == 128 + SIGINT);
  std::smatch told;
  REQUIRE(std::regex_search(ran.out, told, progress));
  int counted = 0;
  for (std::size_t i = 3; i < 5; ++i) counted += std::stoi(told[i]);
  CHECK(counted == (told[2] == "1900 lines" ? 840'000 : std::stoi(told[1])));
  CHECK(says(ran.out, "stopped; finished lines are in map.nc.log"));
  CHECK(scratch.files() == interrupted_files);
}

TEST_CASE("stopped between the lines: the points are in the log, too") {
  const Scratch scratch("sweep-stages");
  scratch.write("s.toml", condition("a", 15, 0, 0) + axis("h", 0, 60, 1000) +
                              axis("gains.K_Lp", 0.05, 5.0, 600));  // between them for seconds
  const Ran ran = on_terminal(scratch, sweep_command + "--threads 1 --checkpoint 1000",
                              std::regex(R"([0-9]+ of 1600 lines: )"));
  REQUIRE(ran.exit_code == 128 + SIGINT);
  constexpr std::uintmax_t of_a_point = 100;  // bytes: six eigenvalues at least
  CHECK(size_of(scratch.path / "map.nc.log") > 1000 * 600 * of_a_point);
}

}  // namespace sweep_cli_test
