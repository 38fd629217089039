// `tiltrim tune` as a user runs it: files written, refusals, interrupts and time limits.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace tune_cli_test {

namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using program::csv_of;
using program::finish;
using program::Ran;
using program::run;
using program::Running;
using program::Scratch;
using program::slurp;
using program::start;
using Names = std::set<std::string>;

bool says(const std::string& text, const std::string& words) {
  INFO(text);
  INFO(words);
  const bool found = text.find(words) != std::string::npos;
  CHECK(found);
  return found;
}

const std::string level =
    "[[condition]]\nname = \"level\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";
const std::string climb =
    "[[condition]]\nname = \"climb\"\nV = 2.0\ngamma_deg = 90.0\neta_deg = 90.0\n";
const std::string untrimmed =
    "[[condition]]\nname = \"slow\"\nV = 3.0\ngamma_deg = 0.0\neta_deg = 0.0\n";

std::string gain(const std::string& name) {
  return fmt::format("[[tune.gain]]\nkey = \"gains.{}\"\nfrom = 0.02\nto = 10.0\n", name);
}
std::string limit(const std::string& asked) { return "[[tune.limit]]\nmeasure = " + asked + "\n"; }

const std::string two_gains = gain("K_Lp") + gain("k_V");
const std::string damped = limit("\"damping\"\nat_least = 0.4");
const std::string mass = "[[tune.uncertain]]\nkey = \"aircraft.mass\"\npercent = 10\n";

std::string table(const std::string& keys) { return "[tune]\nevaluations = 100\n" + keys; }

const std::string study =
    level + climb + table("second = \"crs2\"\nrobustness = 100\n") + damped + two_gains + mass;

}  // namespace

TEST_CASE("text: verdict, gains, what became of each, and the searches") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  const Ran ran = run(scratch, "tune s.toml --gains gains.toml");
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  for (const char* words :
       {"tuned: worst decay ", "over 2 points with scatter (6 places); all limits",
        "The gains, to paste into the study:", "\nRequirements,", "At each operating point",
        "\nEffect of each gain:", "Second search by ", " random samples meet all limits",
        "100 candidates (the limit); global "})
    says(ran.out, words);
  std::istringstream lines(slurp(scratch.path / "gains.toml"));
  for (std::string line; std::getline(lines, line);) says(ran.out, "\n    " + line + "\n");
}

TEST_CASE("JSON has the documented keys; CSV the same places") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  const json j = json::parse(run(scratch, "tune s.toml -f json").out);
  Names keys;
  for (const auto& [key, value] : j.items()) keys.insert(key);
  CHECK(keys == Names{"status",      "message",     "goal",        "gains",
                      "evaluations", "interrupted", "out_of_time", "out_of_evaluations",
                      "limits",      "toml",        "achieved",    "effects",
                      "coalescing",  "second",      "end",         "stationarity",
                      "starts",      "agreeing",    "robustness",  "front_limit",
                      "front",       "global",      "local",       "seed"});
  CHECK(j["status"] == "tuned");
  CHECK(j["evaluations"] == 100);
  CHECK(j["out_of_evaluations"] == true);
  CHECK(j["front_limit"].is_null());
  CHECK(j["front"].empty());
  CHECK(j["robustness"]["samples"] == 100);
  CHECK(j["effects"].size() == 2);
  REQUIRE(j["achieved"].size() == 2 * 6);
  const auto rows = csv_of(run(scratch, "tune s.toml -f csv").out);
  REQUIRE(rows.size() == 1 + 2 * 6);
  CHECK(rows[0] == program::Row{"point", "scatter", "measure", "of", "unit", "limit", "value",
                                "reserve", "eigenvalue_re", "eigenvalue_im", "active"});
  for (std::size_t i = 0; i < j["achieved"].size(); ++i) {
    const json& a = j["achieved"][i];
    CHECK(rows[i + 1].at(0) == a["point"]);
    CHECK(rows[i + 1].at(1) == a["scatter"]);
    CHECK(rows[i + 1].at(2) == a["measure"]);
    CHECK(std::stod(rows[i + 1].at(6)) == a["value"].get<double>());
  }
}

TEST_CASE("linearize with the gains of --gains finds the decay and damping that were promised") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  const json tuned = json::parse(run(scratch, "tune s.toml -f json --gains gains.toml").out);
  const std::string gains = slurp(scratch.path / "gains.toml");
  CHECK(tuned["toml"] == gains);
  scratch.write("pasted.toml", gains + level + climb);
  const Ran trim = run(scratch, "trim pasted.toml");
  CHECK(trim.exit_code == 0);
  CHECK(trim.err.empty());
  const json all = json::parse(run(scratch, "linearize pasted.toml -f json").out)["conditions"];
  int compared = 0;
  for (const json& a : tuned["achieved"]) {
    if (a["scatter"] != "") continue;
    const auto condition =
        std::ranges::find_if(all, [&](const json& c) { return c["name"] == a["point"]; });
    REQUIRE(condition != all.end());
    double decay = 1e9, damping = 1;
    for (const json& m : (*condition)["modes"]) {
      const double re = m["re"], size = std::hypot(re, m["im"].get<double>());
      decay = std::min(decay, -re);
      damping = std::min(damping, -re / size);
    }
    CHECK_NEAR(a["value"].get<double>(), a["measure"] == "decay" ? decay : damping, 1e-9);
    ++compared;
  }
  CHECK(compared == 4);
}

TEST_CASE("the same bytes for any number of threads, and again") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  const std::string once = run(scratch, "tune s.toml -f json --threads 1").out;
  CHECK_FALSE(once.empty());
  CHECK(run(scratch, "tune s.toml -f json --threads 2").out == once);
  CHECK(run(scratch, "tune s.toml -f json --threads 1").out == once);
}

TEST_CASE("exit 1: limits unmet, no trim, not one candidate; what there is is still written") {
  const Scratch scratch("tune");
  const auto answer = [&](const std::string& text, const std::string& options) {
    scratch.write("s.toml", text);
    const Ran ran = run(scratch, "tune s.toml -o out.txt " + options);
    CHECK(ran.exit_code == 1);
    CHECK(ran.out.empty());
    CHECK(ran.err.empty());
    return slurp(scratch.path / "out.txt");
  };
  const std::string alone = table("second = \"none\"\n");
  const std::string unmet =
      answer(level + climb + alone + limit("\"damping\"\nat_least = 0.9999") + two_gains, "");
  says(unmet, "limits not met: damping at '");
  says(unmet, "The best found, to paste into the study:");
  says(answer(untrimmed + alone + damped + two_gains, "--evaluations 2"),
       "no trim: no equilibrium at 'slow'");
  says(answer(level + alone + damped + two_gains, "--evaluations 0"),
       "no trim: the search ended before a candidate was evaluated");
}

namespace {

// In one line, without writing anything.
void refused(const Scratch& scratch, const std::string& arguments, const std::string& words) {
  CAPTURE(arguments);
  const Names before = scratch.files();
  const Ran ran = run(scratch, "tune " + arguments);
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(std::ranges::count(ran.err, '\n') == 1);
  says(ran.err, words);
  CHECK(scratch.files() == before);
}

}  // namespace

TEST_CASE("exit 2: a study without [tune], with unknown keys") {
  const Scratch scratch("tune");
  scratch.write("none.toml", level);
  refused(scratch, "none.toml", "none.toml: no [tune] table; expected one, with a [[tune.gain]]");
  scratch.write("key.toml", level + "[tune]\nsecnd = \"crs2\"\n" + two_gains);
  refused(scratch, "key.toml",
          "key.toml:7:1: unknown key 'secnd' in [tune]; did you mean 'second'");
  scratch.write("gain.toml", level + "[tune]\n" + gain("K_Lq"));
  refused(scratch, "gain.toml", "'gains.K_Lq' is not a number of a study; did you mean");
  refused(scratch, "absent.toml", "absent.toml: cannot be read");
}

TEST_CASE("exit 2: bad options, places that cannot be written") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  for (const char* bad :
       {"--evaluations -1", "--evaluations 2.5", "--seconds -1", "--seconds inf", "--seed -1",
        "--seed 9007199254740993", "--seed 18446744073709551616", "--threads -1"})
    refused(scratch, fmt::format("s.toml {}", bad), "number from ");
  refused(scratch, "s.toml --only level", "--only");
  refused(scratch, "s.toml --gains absent/g.toml", "absent: No such file or directory");
  refused(scratch, "s.toml --gains .", "Is a directory");
  refused(scratch, "s.toml -o absent/o.txt", "absent: No such file or directory");
}

TEST_CASE("exit 2: NaN seconds") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  refused(scratch, "s.toml --seconds nan", "--seconds");
}

// Without the check, the output replaces the gains.
TEST_CASE("exit 2: --gains and -o are one file") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  refused(scratch, "s.toml --gains same.txt -o same.txt", "same.txt");
}

// Without the check, the gains replace the study.
TEST_CASE("exit 2: --gains is the study itself") {
  const Scratch scratch("tune");
  scratch.write("s.toml", study);
  (void)run(scratch, "tune s.toml --gains s.toml");
  CHECK(slurp(scratch.path / "s.toml") == study);
}

namespace {

// Nine gains at 123 places: some 10 s of search, whose first candidate meets the limit.
std::string lasting(const std::string& keys) {
  const std::string near_level = "corridor = {from = 110, to = 120, count = 41}\n";
  std::string gains;
  for (const char* name : {"k_V", "K_Ep", "K_Ei", "K_Lp", "K_Li", "k_pa", "k_da", "k_pe", "k_de"})
    gains += gain(name);
  return level + climb + table(near_level + keys) + damped + gains + mass;
}

Running lasting_search(const Scratch& scratch, const std::string& options) {
  scratch.write("s.toml", lasting("second = \"crs2\"\nrobustness = 100\n"));
  return start(scratch, "tune s.toml --evaluations 100000000 " + options);
}

// Stopped by SIGINT amid its first search.
Ran stopped(const Scratch& scratch, const std::string& options) {
  const Running tune = lasting_search(scratch, options);
  let_compute(tune, 500ms);
  ::kill(tune.pid, SIGINT);
  const Ran ran = finish(tune, 60s);
  CHECK(ran.exit_code == 128 + SIGINT);
  CHECK(ran.err.empty());
  return ran;
}

}  // namespace

TEST_CASE("Ctrl-C: exit 130, the best so far, verified, and said to be so") {
  const Scratch scratch("tune");
  const Ran text = stopped(scratch, "--gains gains.toml");
  says(text.out, "tuned: worst decay ");
  says(text.out, "(interrupted:");
  scratch.write("pasted.toml", slurp(scratch.path / "gains.toml") + level + climb);
  CHECK(run(scratch, "linearize pasted.toml").exit_code == 0);
  const json j = json::parse(stopped(scratch, "-f json").out);
  CHECK(j["interrupted"] == true);
  CHECK(j["status"] == "tuned");
  CHECK(j["achieved"].size() == 41 * 3 * 2);  // heights, masses, asked
  CHECK(j["second"].is_null());
  CHECK(j["robustness"].is_null());
}

// The first search has used its second, the next is running; on a busy machine both may have ended.
TEST_CASE("Ctrl-C in the second search is said too") {
  const Scratch scratch("tune");
  Ran ran;
  for (int i = 0; i < 20 && ran.exit_code <= 0; ++i) {
    const Running tune = lasting_search(scratch, "--seconds 1");
    std::this_thread::sleep_for(1600ms);
    ::kill(tune.pid, SIGINT);
    ran = finish(tune, 60s);
  }
  CHECK(ran.exit_code == 128 + SIGINT);
  says(ran.out, "interrupted");
}

TEST_CASE("on a terminal of 80 columns each line of progress fits, with all that it tells") {
  const Scratch scratch("tune");
  // Thirteen heights without scatter would take longer than these 3 s.
  std::string text = slurp(TILTRIM_SOURCE_DIR "/studies/tune_corridor.toml");
  const std::size_t scatter = text.find("[[tune.uncertain]]");
  text.erase(scatter, text.find("[[tune.gain]]") - scatter);
  scratch.write("s.toml", text);
  const Ran ran =
      run(scratch, "",
          {.program = "script -qec 'stty cols 80; " TILTRIM_PROGRAM
                      " tune s.toml --evaluations 100000 --seconds 3 -o s.json' /dev/null"});
  int lines = 0;
  for (std::size_t at = ran.out.find("\r\033[K"); at != std::string::npos;) {
    at += 4;
    const std::size_t next = ran.out.find("\r\033[K", at);
    const std::string line = ran.out.substr(at, next - at);
    at = next;
    if (next == std::string::npos) break;
    if (line.empty()) continue;  // the end of a search clears the line
    const auto first = [](char c) { return (c & 0xC0) != 0x80; };  // byte of a character
    CHECK(std::ranges::count_if(line, first) < 80);
    CAPTURE(line);
    const bool found =
        line.find("decay ") != std::string::npos && line.find(" 1/s (decay") != std::string::npos;
    CHECK((found || line.find("no answer yet (missing ") != std::string::npos));
    CHECK(line.find(" start") != std::string::npos);
    CHECK(line.find(", < ") != std::string::npos);
    CHECK(line.ends_with(" s left"));
    ++lines;
  }
  CHECK(lines > 3);
}

TEST_CASE("--seconds ends each search in time") {
  const Scratch scratch("tune");
  scratch.write("s.toml", lasting("second = \"none\"\nrobustness = 0\n"));
  const Ran ran = run(scratch, "tune s.toml --evaluations 100000000 --seconds 1");
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  says(ran.out, "(out of time:");
}

TEST_CASE("exit 1: a limit that applies nowhere, with robustness") {
  const Scratch scratch("tune");
  scratch.write("s.toml", level + table("second = \"none\"\nrobustness = 10\n") +
                              limit("\"half_time\"\nof = \"phugoid\"\nat_most = 100") + two_gains +
                              mass);
  const Ran ran = run(scratch, "tune s.toml --evaluations 10");
  CHECK(ran.exit_code == 1);
  says(ran.out, "limits not met: half_time of phugoid applies at no operating point");
}

TEST_CASE(
    "every measure, a schedule, a front and robustness at once; trim and sweep read it back") {
  const Scratch scratch("tune");
  std::string limits;
  for (const char* asked :
       {"\"decay\"\nat_least = 0.01", "\"damping\"\nat_least = 0.1", "\"frequency\"\nat_most = 50",
        "\"half_time\"\nof = \"speed and path\"\nat_most = 100", "\"gain_margin_db\"\nat_least = 1",
        "\"phase_margin_deg\"\nof = \"theta0\"\nat_least = 5", "\"delay_margin\"\nat_least = 0.001",
        "\"disk_margin\"\nat_least = 0.05", "\"use\"\nat_most = 1",
        "\"response_use\"\nof = \"theta0\"\nat_most = 20", "\"sensitivity\"\nat_most = 100"})
    limits += limit(asked);
  scratch.write("s.toml", level + climb +
                              "[tune]\nschedule_eta_deg = [0, 90]\nevaluations = 3\n"
                              "second = \"none\"\nrobustness = 3\n"
                              "[tune.disturbance]\nV = 1\ngamma_deg = 5\n"
                              "[tune.front]\nmeasure = \"damping\"\nfrom = 0.1\nto = 0.3\n"
                              "count = 2\n" +
                              limits + two_gains + mass);
  const Ran ran = run(scratch, "tune s.toml -f json --gains gains.toml");
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  const json j = json::parse(ran.out);
  CHECK(j["limits"].size() == 11);
  CHECK(j["front"].size() == 2);
  CHECK(j["robustness"]["samples"] == 3);
  CHECK(j["gains"]["gains.K_Lp"].size() == 2);
  const std::string gains = slurp(scratch.path / "gains.toml");
  says(gains, "schedule_eta_deg = [0.0, 90.0]");
  scratch.write("pasted.toml", gains + level + climb);
  CHECK(run(scratch, "trim pasted.toml").exit_code == 0);
  scratch.write("swept.toml",
                gains + level + "[[sweep.axis]]\nkey = \"h\"\nfrom = 0\nto = 120\ncount = 2\n");
  CHECK(run(scratch, "sweep swept.toml").exit_code == 0);
}

}  // namespace tune_cli_test
