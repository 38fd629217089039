// [tune] of a study: values read, and refusals with position and message.
#include <fstream>
#include <iterator>
#include <numbers>
#include <set>

#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/study_text.hpp"
#include "tune/measures.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;

namespace tune_study_test {

static constexpr double degree = std::numbers::pi / 180;

static const std::string level =
    "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n";  // lines 1-5
static const std::string climb =
    "[[condition]]\nname = 'climb'\nV = 2\ngamma_deg = 90\neta_deg = 90\n";
static const std::string fixed_wing =
    "[[condition]]\nname = 'glide'\nformulation = 'airframe'\nV = 15\neta_deg = 0\n";
static const std::string gain = "[[tune.gain]]\nkey = 'gains.K_Lp'\nfrom = 0.02\nto = 10\n";
static const std::string mass = "[[tune.uncertain]]\nkey = 'aircraft.mass'\npercent = 15\n";

// Lines 1-5 the condition, 6 [tune], then its keys, the gain (four lines) and other tables.
static std::string study(const std::string& keys, const std::string& tables = "") {
  return level + "[tune]\n" + keys + gain + tables;
}

static TuneTable tuned(const std::string& text) {
  const Study read = parse_study(text, TILTRIM_SOURCE_DIR "/studies/t.toml");
  REQUIRE(read.tune);
  return *read.tune;
}

// ---- accepted ----

TEST_CASE("without [tune] there is none; with a gain alone everything has its default") {
  CHECK_FALSE(parse_study(level, "t.toml").tune);
  const TuneTable tune = tuned(study(""));
  CHECK(tune.conditions == std::vector<std::string>{"level"});
  CHECK(tune.heights.empty());
  REQUIRE(tune.gains.size() == 1);
  CHECK(tune.gains[0].name == "gains.K_Lp");
  CHECK(tune.gains[0].lower == 0.02);
  CHECK(tune.gains[0].upper == 10);
  CHECK(tune.gains[0].logarithmic);
  CHECK(tune.schedule.empty());
  CHECK(tune.uncertain.empty());
  CHECK(tune.corners);
  CHECK(tune.samples == 0);
  CHECK(tune.disturbance.empty());
  CHECK(tune.goal.measure == Measure::decay);
  CHECK(std::isnan(tune.goal.limit));
  CHECK(tune.goal.of.empty());
  CHECK(tune.limits.empty());
  CHECK(tune.global == "multistart");
  CHECK(tune.local == "bfgs");
  CHECK(tune.second == "crs2");
  CHECK(tune.seed == 1);
  CHECK(tune.evaluations == 100000);
  CHECK(tune.seconds == 0);
  CHECK(tune.robustness == 10'000);
  CHECK_FALSE(tune.front);
}

TEST_CASE("every key of [tune] is read into its own place") {
  const TuneTable tune = tuned(
      study("conditions = ['level']\ncorridor = [0, 60]\nschedule_eta_deg = [0, 45, 90]\n"
            "goal = 'damping'\ncorners = 'none'\nsamples = 7\nglobal = 'isres'\nlocal = 'cobyla'\n"
            "second = 'none'\nseed = 9007199254740992\nevaluations = 1000000000\nseconds = 0.5\n"
            "robustness = 0\n",
            mass));
  CHECK(tune.conditions == std::vector<std::string>{"level"});
  CHECK(tune.heights == std::vector<double>{0, 60});
  CHECK(tune.schedule == std::vector<double>{0, 45 * degree, 90 * degree});
  CHECK(tune.goal.measure == Measure::damping);
  CHECK_FALSE(tune.corners);
  CHECK(tune.samples == 7);
  CHECK(tune.global == "isres");
  CHECK(tune.local == "cobyla");
  CHECK(tune.second == "none");
  CHECK(tune.seed == 9007199254740992U);
  CHECK(tune.evaluations == 1'000'000'000);
  CHECK(tune.seconds == 0.5);
  CHECK(tune.robustness == 0);
}

TEST_CASE("every algorithm is accepted by its name") {
  for (const char* name : {"crs2", "isres", "esch", "direct", "mlsl", "multistart"}) {
    CHECK(tuned(study(fmt::format("global = '{}'\n", name))).global == name);
    CHECK(tuned(study(fmt::format("second = '{}'\n", name))).second == name);
  }
  for (const char* name : {"slsqp", "mma", "bobyqa", "cobyla", "sbplx"})
    CHECK(tuned(study(fmt::format("local = '{}'\n", name))).local == name);
}

TEST_CASE("operating points: conditions in the study's order, the corridor beside or in place") {
  using Names = std::vector<std::string>;
  const auto both = [](const std::string& keys) {
    return tuned(level + climb + "[tune]\n" + keys + gain);
  };
  CHECK(both("").conditions == Names{"level", "climb"});
  CHECK(both("conditions = ['climb', 'level']\n").conditions == Names{"level", "climb"});
  CHECK(both("conditions = ['climb']\n").conditions == Names{"climb"});
  CHECK(both("corridor = [5]\n").conditions.empty());
  CHECK(both("corridor = [5]\nconditions = []\n").conditions.empty());
  CHECK(both("corridor = [5]\nconditions = ['level']\n").conditions == Names{"level"});
  CHECK(tuned(fixed_wing + level + "[tune]\nconditions = ['level']\n" + gain).conditions ==
        Names{"level"});
  CHECK(tuned(fixed_wing + "[tune]\ncorridor = [5]\n" + gain).conditions.empty());
}

TEST_CASE("heights: spaced from one end to the other, or listed") {
  const auto heights = [](const std::string& corridor) {
    return tuned(study("corridor = " + corridor + "\n")).heights;
  };
  CHECK(heights("{from = 0, to = 120, count = 13}").size() == 13);
  CHECK(heights("{from = 0, to = 120, count = 13}")[4] == 40);
  CHECK(heights("{from = -2, to = 0.1, count = 1000}").back() == 0.1);
  CHECK(heights("{from = 60, to = 0, count = 2}") == std::vector<double>{60, 0});
  CHECK(heights("[0, 10, 60]") == std::vector<double>{0, 10, 60});
  CHECK(heights("[60, 10, -5]") == std::vector<double>{60, 10, -5});
}

TEST_CASE("a free number is in SI: degrees become radians, nothing else changes") {
  const TuneTable tune = tuned(
      study("",
            "[[tune.gain]]\nkey = 'aircraft.cyclic_off_deg'\nfrom = 30\nto = 90\nspacing = 'log'\n"
            "[[tune.gain]]\nkey = 'gains.k_V'\nfrom = -3\nto = 4\nspacing = 'linear'\n"));
  REQUIRE(tune.gains.size() == 3);
  CHECK(tune.gains[1].name == "aircraft.cyclic_off");
  CHECK(tune.gains[1].lower == 30 * degree);
  CHECK(tune.gains[1].upper == 90 * degree);
  CHECK(tune.gains[1].logarithmic);
  CHECK(tune.gains[2].name == "gains.k_V");
  CHECK(tune.gains[2].lower == -3);
  CHECK(tune.gains[2].upper == 4);
  CHECK_FALSE(tune.gains[2].logarithmic);
}

TEST_CASE("every number of the aircraft and the gains may be free, or uncertain") {
  for (const Signals& signals : {aircraft_signals(), gain_signals()})
    for (const Key& key : number_keys(signals)) {
      CAPTURE(key.name);
      const std::string rest = "key = '" + key.name + "'\nfrom = 0.5\nto = 1\n";
      const TuneTable free = tuned(level + "[[tune.gain]]\n" + rest);
      CHECK(free.gains.at(0).name == key.signal);
      CHECK(free.gains[0].upper == key.in_si(1));
      if (key.name == "gains.K_Lp") continue;
      const TuneTable uncertain = tuned(study("", "[[tune.uncertain]]\n" + rest));
      CHECK(uncertain.uncertain.at(0).name == key.signal);
      CHECK(uncertain.uncertain[0].lower == key.in_si(0.5));
    }
}

TEST_CASE("an uncertain number: a share of the study's own value, or two ends") {
  const auto uncertain = [](const std::string& text, const std::string& aircraft = "") {
    return tuned(aircraft + study("", "[[tune.uncertain]]\n" + text)).uncertain.at(0);
  };
  const Uncertain own = uncertain("key = 'aircraft.mass'\npercent = 25\n");
  CHECK(own.name == "aircraft.mass");
  CHECK(own.lower == 3);
  CHECK(own.upper == 5);
  CHECK(uncertain("key = 'aircraft.mass'\npercent = 25\n", "[aircraft]\nmass = 8\n").upper == 10);
  const Uncertain negative = uncertain("key = 'aircraft.CM_q'\npercent = 50\n");
  CHECK(negative.lower == -10.5);
  CHECK(negative.upper == -3.5);
  const Uncertain angle = uncertain("key = 'aircraft.cyclic_off_deg'\npercent = 10\n");
  CHECK(angle.name == "aircraft.cyclic_off");
  CHECK_NEAR(angle.lower, 54 * degree, 1e-15);
  CHECK_NEAR(angle.upper, 66 * degree, 1e-15);
  CHECK(uncertain("key = 'aircraft.cyclic_off_deg'\nfrom = -10\nto = 40\n").lower == -10 * degree);
  CHECK(uncertain("key = 'gains.k_V'\npercent = 1000\n").lower == -90);
}

TEST_CASE("a disturbance: metres per second, and degrees to radians") {
  const auto start = [](const std::string& text) {
    return tuned(study("", "[tune.disturbance]\n" + text)).disturbance;
  };
  using Start = std::map<std::string, double>;
  CHECK(start("V = 1\ngamma_deg = 5\ntheta_deg = -2\nq_deg = 30\n") ==
        Start{{"V", 1}, {"gamma", 5 * degree}, {"theta", -2 * degree}, {"q", 30 * degree}});
  CHECK(start("q_deg = 1\n") == Start{{"q", degree}});
  CHECK(start("").empty());
}

// Keys that a limit on each measure needs, and all measures of the tiltrotor's loop.
static std::vector<Requirement> asked() {
  std::vector<Requirement> all;
  for (const Measure measure : measures())
    if (measure != Measure::figure && measure <= Measure::sensitivity) all.push_back({measure});
  all.push_back({Measure::peak_sensitivity});
  for (const char* figure : {"flight", "tracking"})
    all.push_back({.measure = Measure::figure, .figure = figure});
  return all;
}
static std::string of(Measure measure) {
  return measure == Measure::half_time ? "of = 'phugoid'\n" : "";
}
static const std::string all_that_is_needed = mass + "[tune.disturbance]\nV = 1\n";

TEST_CASE("every measure may be the goal, a limit and a front, in its own unit") {
  for (const Requirement& r : asked()) {
    const Measure measure = r.measure;
    const std::string name = name_of(r);
    CAPTURE(name);
    const std::string side = more_is_better(measure) ? "at_least" : "at_most";
    const std::string what = "measure = '" + name + "'\n" + of(measure);
    const TuneTable tune =
        tuned(study("goal = {measure = '" + name + "'" +
                        (measure == Measure::half_time ? ", of = 'phugoid'" : "") + "}\n",
                    all_that_is_needed + "[[tune.limit]]\n" + what + side +
                        " = 0.75\n[tune.front]\n" + what + "from = 0.25\nto = 0.5\ncount = 3\n"));
    const std::string mode = measure == Measure::half_time ? "phugoid" : "";
    CHECK(tune.goal.measure == measure);
    CHECK(tune.goal.figure == r.figure);
    CHECK(tune.goal.of == mode);
    CHECK(std::isnan(tune.goal.limit));
    REQUIRE(tune.limits.size() == 1);
    CHECK(tune.limits[0].measure == measure);
    CHECK(tune.limits[0].limit == 0.75);
    CHECK(tune.limits[0].of == mode);
    REQUIRE(tune.front);
    CHECK(tune.front->limit.measure == measure);
    CHECK(tune.front->limit.of == mode);
    CHECK(std::isnan(tune.front->limit.limit));
    CHECK(tune.front->from == 0.25);
    CHECK(tune.front->to == 0.5);
    CHECK(tune.front->count == 3);
  }
  CHECK(tuned(study("", "[[tune.limit]]\nmeasure = 'phase_margin_deg'\nat_least = 45\n"))
            .limits.at(0)
            .limit == 45);  // in degrees, as the measure is
}

static const std::set<std::string> of_an_actuator{
    "gain_margin_db", "phase_margin_deg", "delay_margin", "disk_margin", "use",
    "response_use",   "peak_sensitivity"};

TEST_CASE("margins and uses may be of one actuator, half_time is of a mode, the rest of nothing") {
  for (const Requirement& r : asked()) {
    const Measure measure = r.measure;
    const std::string name = name_of(r);
    CAPTURE(name);
    const auto with = [&](const std::string& actuator) {
      return study("goal = {measure = '" + name + "', of = '" + actuator + "'}\n",
                   all_that_is_needed);
    };
    if (measure == Measure::half_time) {
      CHECK(tuned(with("a mode of any name")).goal.of == "a mode of any name");
    } else if (of_an_actuator.contains(name)) {
      for (const char* actuator : {"theta0", "a1s", "delta_e"})
        CHECK(tuned(with(actuator)).goal.of == actuator);
      check_refused(with("delta_r"), fmt::format("7:{}", 28 + name.size()),
                    {"tune.goal.of: 'delta_r'", "theta0, a1s, delta_e", "'delta_e'?"});
    } else {
      check_refused(with("delta_e"), fmt::format("7:{}", 28 + name.size()),
                    {"tune.goal.of", name + " does not apply to", "expected no key of"});
    }
  }
}

TEST_CASE("a region of poles, several goals with targets, efforts of regulators") {
  const TuneTable tune = tuned(
      study("regulator_starts = [0.1, 10]\nplaced_starts = [2]\n",
            "[[tune.goal]]\nmeasure = 'pole_region'\ndecay = 0.1\nfrequency = 20\nat_least = 1\n"
            "[[tune.goal]]\nmeasure = 'peak_sensitivity'\nof = 'a1s'\nat_most = 2\n"
            "weight = {numerator = [1, 2], denominator = [1, 3]}\n"));
  CHECK(tune.regulator_starts == std::vector<double>{0.1, 10});
  CHECK(tune.placed_starts == std::vector<double>{2});
  REQUIRE(tune.goals.size() == 2);
  CHECK(tune.goals[0].measure == Measure::pole_region);
  CHECK(tune.goals[0].decay == 0.1);
  CHECK(std::isnan(tune.goals[0].damping));
  CHECK(tune.goals[0].frequency == 20);
  CHECK(tune.goals[0].limit == 1);
  CHECK(tune.goals[1].of == "a1s");
  CHECK(tune.goals[1].limit == 2);
  CHECK(tune.goals[1].numerator == std::vector<double>{1, 2});
  CHECK(tune.goals[1].denominator == std::vector<double>{1, 3});
  const auto refused = [](const std::string& goal, const std::string& words) {
    const std::string said = study_refusal(study("goal = " + goal + "\n"));
    CAPTURE(said);
    CHECK(said.find(words) != said.npos);
  };
  refused("'peak_gain'", "the name of a signal");
  refused("{measure = 'overshoot', input = 'V', output = 'airspeed'}", "no signal 'V'");
  refused("{measure = 'overshoot', input = 'V_added', output = 'V_err'}", "no signal 'V_err'");
  refused("{measure = 'pole_region', decay = 0}", "positive decay, damping or frequency");
  refused("{measure = 'damping', decay = 1}", "decay does not apply to damping");
  refused("[{measure = 'decay'}]", "at_least");
}

TEST_CASE("a name alone is a goal") {
  for (const Requirement& r : asked())
    if (r.measure != Measure::half_time)
      CHECK(name_of(tuned(study("goal = '" + name_of(r) + "'\n", all_that_is_needed)).goal) ==
            name_of(r));
}

TEST_CASE("twelve uncertain numbers have corners, thirteen do not, unless none are asked") {
  std::string many;
  std::size_t count = 0;
  for (const Key& key : number_keys(aircraft_signals())) {
    if (count == 12) break;
    many += "[[tune.uncertain]]\nkey = '" + key.name + "'\npercent = 1\n";
    ++count;
  }
  const std::string another = "[[tune.uncertain]]\nkey = 'gains.k_V'\npercent = 1\n";
  CHECK(tuned(study("", many)).uncertain.size() == 12);
  CHECK(tuned(study("corners = 'none'\n", many + another)).uncertain.size() == 13);
  check_refused(
      study("", many + another), "11:1",
      {"tune.uncertain", "13 numbers", "at most 12", "4096 corners", "corners = \"none\""});
}

// ---- refused ----

TEST_CASE("a key misspelt is refused, with the nearest and all valid keys") {
  check_refused(study("goals = 'decay'\n"), "7:1",
                {"'goals' in [tune]", "did you mean 'goal'?", "schedule_eta_deg"});
  check_refused(study("schedule_eta = [0, 1]\n"), "7:1", {"did you mean 'schedule_eta_deg'?"});
  check_refused(study("[tune.limits]\n"), "7:7", {"'limits'", "did you mean 'limit'?"});
  check_refused(study("corridor = {from = 0, to = 1, counts = 2}\n"), "7:31",
                {"'counts' in corridor", "'count'?"});
  check_refused(study("goal = {measures = 'decay'}\n"), "7:9", {"in goal", "'measure'?"});
  check_refused(study("goal = {measure = 'decay', at_least = 2}\n"), "7:28",
                {"'at_least' in goal", "a single goal has no limit"});
  check_refused(study("", "spacin = 'log'\n"), "11:1", {"in [[tune.gain]]", "'spacing'?"});
  check_refused(study("", mass + "precent = 1\n"), "14:1", {"in [[tune.uncertain]]", "'percent'?"});
  check_refused(study("", "[tune.disturbance]\ngamma = 1\n"), "12:1",
                {"in [tune.disturbance]", "did you mean 'gamma_deg'?"});
  check_refused(study("", "[[tune.limit]]\nat_lest = 1\n"), "12:1",
                {"in [[tune.limit]]", "'at_least'?"});
  check_refused(study("", "[tune.front]\nat_least = 1\n"), "12:1",
                {"in [tune.front]", "the limit goes from"});
  check_refused("[tunes]\n" + level, "1:2", {"'tunes' at the top level", "'tune'?"});
}

TEST_CASE("conditions that cannot be tuned are refused") {
  const auto with = [](const std::string& list) { return study("conditions = " + list + "\n"); };
  check_refused(with("'level'"), "7:14", {"tune.conditions: the text 'level'", "not a list"});
  check_refused(with("{level = 1}"), "7:14", {"tune.conditions: a table"});
  check_refused(with("3"), "7:14", {"tune.conditions: 3"});
  check_refused(with("[3]"), "7:15", {"tune.conditions: 3 is not text"});
  check_refused(with("[['level']]"), "7:15", {"tune.conditions: an array is not text"});
  check_refused(with("[]"), "7:14", {"tune.conditions", "no operating point", "corridor"});
  check_refused(with("['level', 'level']"), "7:24", {"'level' occurs twice"});
  check_refused(with("['']"), "7:15", {"tune.conditions: '' is not a condition"});
  check_refused(level + climb + "[tune]\nconditions = ['level', 'clim']\n" + gain, "12:24",
                {"tune.conditions: 'clim'", "did you mean 'climb'?", "there are: level, climb"});
  check_refused(level + fixed_wing + "[tune]\nconditions = ['glide']\n" + gain, "12:15",
                {"tune.conditions: 'glide' is of formulation airframe", "closed_loop"});
  check_refused(level + fixed_wing + "[tune]\n" + gain, "11:1",
                {"tune.conditions: is missing", "'glide' is of formulation airframe"});
  const std::string table =
      "[[condition]]\nname = 'given'\nformulation = 'table'\ngamma_deg = 0\nalpha_deg = 0\n"
      "eta_deg = 0\nCL = 0\nCD = 0\nCM = 0\nk = 0\n";
  check_refused(level + table + "[tune]\n" + gain, "16:1", {"'given' is of formulation table"});
}

TEST_CASE("heights and tilts that cannot be are refused") {
  const auto corridor = [](const std::string& value) {
    return study("corridor = " + value + "\n");
  };
  check_refused(corridor("5"), "7:12", {"tune.corridor: 5 is not a list of heights", "count"});
  check_refused(corridor("'all'"), "7:12", {"tune.corridor: the text 'all'"});
  check_refused(corridor("[]"), "7:12", {"tune.corridor: an empty array"});
  check_refused(corridor("[1, 'x']"), "7:16", {"tune.corridor: the text 'x' is not a number"});
  check_refused(corridor("[1, [2]]"), "7:16", {"tune.corridor: an array is not a number"});
  check_refused(corridor("[1, nan]"), "7:16", {"tune.corridor: nan is not finite"});
  check_refused(corridor("[1, 1e7]"), "7:16", {"tune.corridor: 10000000 is out of range", "m"});
  check_refused(corridor("[1, 3, 2]"), "7:12", {"2 after 3", "reverses the direction"});
  check_refused(corridor("[1, 1]"), "7:12", {"1 after 1"});
  check_refused(corridor("{}"), "7:12", {"tune.corridor.from", "missing"});
  check_refused(corridor("{from = 0}"), "7:12", {"tune.corridor.to", "missing"});
  check_refused(corridor("{from = 0, to = 1}"), "7:12", {"tune.corridor.count", "missing"});
  check_refused(corridor("{from = 0, to = inf, count = 2}"), "7:28", {"tune.corridor.to: inf"});
  check_refused(corridor("{from = 0, to = 1, count = 1}"), "7:39", {"count: 1 is out of range"});
  check_refused(corridor("{from = 0, to = 1, count = 1001}"), "7:39", {"out of range", "1000"});
  check_refused(corridor("{from = 0, to = 1, count = 2.5}"), "7:39", {"2.5 is not a whole number"});
  check_refused(corridor("{from = 1, to = 1, count = 2}"), "7:12", {"1 after 1"});
  std::string many = "[0";
  for (int i = 1; i <= 1000; ++i) many += fmt::format(", {}", i);
  check_refused(corridor(many + "]"), "7:12", {"1001 heights", "at most 1000"});

  const auto schedule = [](const std::string& value) {
    return study("schedule_eta_deg = " + value + "\n");
  };
  check_refused(schedule("45"), "7:20",
                {"tune.schedule_eta_deg: 45 is not a list", "at least two"});
  check_refused(schedule("[45]"), "7:20", {"at least two"});
  check_refused(schedule("[]"), "7:20", {"an empty array", "at least two"});
  check_refused(schedule("{}"), "7:20", {"a table is not a list"});
  check_refused(schedule("[0, 0]"), "7:20", {"0 after 0 is not in ascending order;"});
  check_refused(schedule("[90, 0]"), "7:20", {"0 after 90 is not in ascending order;"});
  check_refused(schedule("[0, 101]"), "7:24", {"101 is out of range", "-10 to 100 degrees"});
  check_refused(schedule("[0, nan]"), "7:24", {"tune.schedule_eta_deg: nan"});
  check_refused(schedule("[0, true]"), "7:24", {"tune.schedule_eta_deg: a boolean"});
}

TEST_CASE("numbers and names of the search that cannot be are refused") {
  struct Bad {
    const char *key, *most, *too_much;
  };
  for (const auto& [key, most, too_much] : {Bad{"samples", "1000", "1001"},
                                            {"seed", "9007199254740992", "1e16"},
                                            {"evaluations", "1000000000", "1000000001"},
                                            {"robustness", "10000000", "10000001"},
                                            {"seconds", "1000000", "1000001"}}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const auto with = [&, name = std::string(key)](const std::string& value) {
      return study(name + " = " + value + "\n");
    };
    const std::string at = fmt::format("7:{}", std::string(key).size() + 4);
    const std::string named = fmt::format("tune.{}: ", key);
    CHECK(study_refusal(with("0")).empty());
    CHECK(study_refusal(with(most)).empty());
    check_refused(with(too_much), at, {named, "out of range"});
    check_refused(with("-1"), at, {named, "-1 is out of range"});
    check_refused(with("nan"), at, {named, "nan is not finite"});
    check_refused(with("inf"), at, {named, "inf is not finite"});
    check_refused(with("'1'"), at, {named, "the text '1'"});
    check_refused(with("[1]"), at, {named, "an array"});
    check_refused(with("true"), at, {named, "a boolean"});
    if (std::string(key) == "seconds")
      CHECK(study_refusal(with("0.5")).empty());
    else
      check_refused(with("0.5"), at, {named, "0.5 is not a whole number"});
  }
  check_refused(study("global = 'crs'\n"), "7:10",
                {"tune.global: 'crs' is not known", "multistart", "did you mean 'crs2'?"});
  check_refused(study("global = 'none'\n"), "7:10", {"tune.global: 'none'"});
  check_refused(study("local = 'crs2'\n"), "7:9", {"tune.local: 'crs2'", "slsqp, mma"});
  check_refused(study("second = 'nne'\n"), "7:10", {"tune.second: 'nne'", "'none'?"});
  check_refused(study("second = false\n"), "7:10", {"tune.second: a boolean is not text"});
  check_refused(study("corners = 'some'\n"), "7:11", {"tune.corners: 'some'", "all, none"});
  check_refused(study("corners = 3\n"), "7:11", {"tune.corners: 3 is not text"});
}

TEST_CASE("free numbers that cannot be are refused") {
  const auto with = [](const std::string& text) { return level + "[[tune.gain]]\n" + text; };
  check_refused(level + "[tune]\n", "6:1", {"tune.gain", "missing", "[[tune.gain]]"});
  check_refused(level + "[tune.gain]\nkey = 'gains.K_Lp'\n", "6:1", {"double brackets"});
  check_refused(level + "[tune]\ngain = []\n", "7:8", {"tune.gain: an empty array"});
  check_refused(level + "[tune]\ngain = 'gains.K_Lp'\n", "7:8", {"tune.gain: the text"});
  check_refused(level + "[tune]\ngain = [1]\n", "7:9", {"tune.gain: 1 is not a table"});
  check_refused(with("from = 1\nto = 2\n"), "6:1", {"tune.gain.key", "missing"});
  check_refused(with("key = 3\n"), "7:7", {"tune.gain.key: 3 is not text"});
  check_refused(with("key = ['gains.K_Lp']\n"), "7:7", {"tune.gain.key: an array"});
  check_refused(with("key = 'gains.K_LP'\n"), "7:7",
                {"'gains.K_LP'", "did you mean 'gains.K_Lp'?", "expected an aircraft.* or gains."});
  check_refused(with("key = 'aircraft.cyclic_off'\n"), "7:7", {"'aircraft.cyclic_off_deg'?"});
  for (const char* own : {"V", "gamma_deg", "eta_deg", "theta0"})
    check_refused(with(fmt::format("key = '{}'\nfrom = 1\nto = 2\n", own)), "7:7",
                  {"tune.gain.key", fmt::format("{} belongs to the conditions", own)});
  const std::string k_V = "key = 'gains.k_V'\n";
  check_refused(with(k_V), "6:1", {"tune.gain.from", "missing"});
  check_refused(with(k_V + "from = 1\n"), "6:1", {"tune.gain.to", "missing"});
  check_refused(with(k_V + "from = 2\nto = 1\n"), "9:6", {"tune.gain.to: 1 is not above", "2"});
  check_refused(with(k_V + "from = 2\nto = 2\n"), "9:6", {"tune.gain.to: 2 is not above"});
  check_refused(with(k_V + "from = nan\nto = 2\n"), "8:8", {"tune.gain.from: nan"});
  check_refused(with(k_V + "from = 1\nto = inf\n"), "9:6", {"tune.gain.to: inf"});
  check_refused(with(k_V + "from = 1\nto = 1e7\n"), "9:6", {"tune.gain.to", "out of range"});
  check_refused(with(k_V + "from = [1, 2]\nto = 3\n"), "8:8", {"tune.gain.from: an array"});
  check_refused(with(k_V + "from = 0\nto = 1\n"), "8:8",
                {"tune.gain.from: 0", "logarithm", "spacing = \"linear\""});
  check_refused(with(k_V + "from = -2\nto = -1\nspacing = 'log'\n"), "8:8", {"logarithm"});
  check_refused(with(k_V + "from = 1\nto = 2\nspacing = 'lin'\n"), "10:11", {"log, linear"});
  check_refused(with("key = 'aircraft.mass'\nfrom = 0\nto = 1\nspacing = 'linear'\n"), "8:8",
                {"tune.gain.from: 0 is out of range", "kg"});
  check_refused(study("", gain), "12:7", {"tune.gain.key: gains.K_Lp is given twice"});
}

TEST_CASE("uncertain numbers that cannot be are refused") {
  const auto with = [](const std::string& text) {
    return study("", "[[tune.uncertain]]\n" + text);
  };
  const std::string mass_is = "key = 'aircraft.mass'\n";
  check_refused(study("uncertain = []\n"), "7:13", {"tune.uncertain: an empty array"});
  check_refused(study("uncertain = ['aircraft.mass']\n"), "7:14", {"tune.uncertain: the text"});
  check_refused(study("", "[tune.uncertain]\n" + mass_is), "11:1", {"double brackets"});
  check_refused(with("percent = 5\n"), "11:1", {"tune.uncertain.key", "missing"});
  check_refused(with("key = 'aircraft.mas'\n"), "12:7", {"did you mean 'aircraft.mass'?"});
  check_refused(with("key = 'V'\npercent = 5\n"), "12:7", {"V belongs to the conditions"});
  check_refused(with("key = 'gains.K_Lp'\npercent = 5\n"), "12:7",
                {"tune.uncertain.key: gains.K_Lp is free", "[[tune.gain]]"});
  check_refused(study("", mass + mass), "15:7", {"aircraft.mass is given twice"});
  check_refused(with(mass_is), "11:1", {"tune.uncertain.percent", "percent, or from and to"});
  check_refused(with(mass_is + "from = 1\n"), "11:1", {"tune.uncertain.to", "missing"});
  check_refused(with(mass_is + "to = 1\n"), "11:1", {"tune.uncertain.from", "missing"});
  check_refused(with(mass_is + "from = 2\nto = 1\n"), "14:6", {"1 is not above"});
  check_refused(with(mass_is + "from = 0\nto = 1\n"), "13:8", {"0 is out of range", "kg"});
  check_refused(with(mass_is + "percent = 5\nfrom = 1\n"), "14:8",
                {"tune.uncertain.from: cannot be combined with percent"});
  check_refused(with(mass_is + "percent = 0\n"), "13:11", {"tune.uncertain.percent: 0"});
  check_refused(with(mass_is + "percent = 1e-300\n"), "13:11", {"changes nothing"});
  check_refused(with(mass_is + "percent = -5\n"), "13:11", {"-5 is out of range", "percent"});
  check_refused(with(mass_is + "percent = 1001\n"), "13:11", {"1001 is out of range"});
  check_refused(with(mass_is + "percent = nan\n"), "13:11", {"nan is not finite"});
  check_refused(with(mass_is + "percent = [5]\n"), "13:11", {"an array"});
  check_refused(with(mass_is + "percent = 100\n"), "13:11",
                {"100 of aircraft.mass = 4 reaches 0", "out of range", "kg"});
  check_refused(with("key = 'aircraft.cyclic_off_deg'\npercent = 250\n"), "13:11",
                {"aircraft.cyclic_off_deg", "out of range", "degrees"});
  check_refused(with("key = 'aircraft.cyclic_blend_deg'\npercent = 5\n"), "13:11",
                {"aircraft.cyclic_blend_deg is 0", "expected from and to"});
}

// As [gains] refuses the values themselves.
TEST_CASE("numbers between whose ends the control law divides by zero are refused") {
  const auto free = [](const std::string& key, const std::string& ends, const std::string& before) {
    return before + level + "[[tune.gain]]\nkey = '" + key + "'\n" + ends + "spacing = 'linear'\n";
  };
  check_refused(free("gains.K_Lp", "from = -2\nto = 1\n", ""), "7:7",
                {"tune.gain.key", "1 + K_Lp"});
  check_refused(free("gains.K_Lp", "from = -1\nto = 1\n", ""), "7:7", {"1 + K_Lp"});
  CHECK(study_refusal(free("gains.K_Lp", "from = -0.9\nto = 1\n", "")).empty());
  CHECK(study_refusal(free("gains.K_Lp", "from = -3\nto = -1.1\n", "")).empty());
  check_refused(free("gains.K_Ep", "from = -1\nto = 1\n", ""), "7:7", {"1 + thrust_excess K_Ep"});
  CHECK(study_refusal(free("gains.K_Ep", "from = -0.7\nto = 1\n", "")).empty());
  check_refused(free("aircraft.thrust_excess", "from = 1\nto = 3\n", "[gains]\nK_Ep = -0.5\n"),
                "9:7", {"1 + thrust_excess K_Ep"});
  check_refused(free("gains.K_Ep", "from = -0.7\nto = 1\n", "") +
                    "[[tune.uncertain]]\nkey = 'aircraft.thrust_excess'\npercent = 20\n",
                "7:7", {"1 + thrust_excess K_Ep"});
  check_refused(free("gains.K_Ep", "from = -3\nto = -0.6\n", "") +
                    "[[tune.uncertain]]\nkey = 'aircraft.thrust_excess'\nfrom = 1\nto = 3\n",
                "7:7", {"1 + thrust_excess K_Ep"});
  check_refused(level + "[[tune.gain]]\nkey = 'gains.k_V'\nfrom = 1\nto = 2\n" +
                    "[[tune.uncertain]]\nkey = 'gains.K_Lp'\nfrom = -2\nto = 1\n",
                "11:7", {"tune.uncertain.key", "1 + K_Lp"});
}

TEST_CASE("disturbances that cannot be are refused") {
  const auto with = [](const std::string& text) {
    return study("", "[tune.disturbance]\n" + text);
  };
  check_refused(study("disturbance = 1\n"), "7:15", {"tune.disturbance: 1 is not a table"});
  check_refused(study("", "[[tune.disturbance]]\nV = 1\n"), "11:1",
                {"tune.disturbance: an array is not a table", "[tune.disturbance]"});
  check_refused(with("V = nan\n"), "12:5", {"tune.disturbance.V: nan"});
  check_refused(with("V = 1e7\n"), "12:5", {"out of range", "m/s"});
  check_refused(with("gamma_deg = 181\n"), "12:13", {"181 is out of range", "degrees"});
  check_refused(with("theta_deg = -181\n"), "12:13", {"-181 is out of range"});
  check_refused(with("q_deg = inf\n"), "12:9", {"tune.disturbance.q_deg: inf", "degrees/s"});
  check_refused(with("q_deg = '1'\n"), "12:9", {"the text '1' is not a number"});
}

TEST_CASE("goals that cannot be are refused") {
  const auto with = [](const std::string& goal) { return study("goal = " + goal + "\n"); };
  check_refused(with("'decai'"), "7:8", {"'decai' is not known", "did you mean 'decay'?", "use"});
  check_refused(with("3"), "7:8", {"tune.goal: 3 is not a measure"});
  check_refused(with("['decay']"), "7:8", {"tune.goal: an array is not a measure"});
  check_refused(with("[]"), "7:8", {"tune.goal: an empty array"});
  check_refused(with("{}"), "7:8", {"tune.goal.measure", "missing"});
  check_refused(with("''"), "7:8", {"0 bytes"});
  check_refused(with("{measure = 3}"), "7:19", {"tune.goal.measure: 3 is not text"});
  check_refused(with("{measure = {measure = 'decay'}}"), "7:19", {"a table is not text"});
  check_refused(with("'half_time'"), "7:8", {"tune.goal.of: is missing", "phugoid"});
  check_refused(with("{measure = 'half_time', of = ''}"), "7:37", {"tune.goal.of: 0 bytes"});
  check_refused(with("{measure = 'half_time', of = 2}"), "7:37", {"tune.goal.of: 2 is not text"});
  check_refused(with("'response_use'"), "7:8", {"response_use", "[tune.disturbance]"});
  check_refused(with("'sensitivity'"), "7:8", {"sensitivity", "[[tune.uncertain]]"});
  check_refused(study("goal = 'response_use'\n", "[tune.disturbance]\nV = 0\nq_deg = 0\n"), "7:8",
                {"nonzero"});
}

TEST_CASE("limits that cannot be are refused") {
  const auto with = [](const std::string& text) { return study("", "[[tune.limit]]\n" + text); };
  check_refused(study("limit = 3\n"), "7:9", {"tune.limit: 3 is not a list of tables"});
  check_refused(study("limit = [[]]\n"), "7:10", {"tune.limit: an empty array is not a table"});
  check_refused(study("", "[tune.limit]\nmeasure = 'decay'\n"), "11:1", {"double brackets"});
  check_refused(with("at_least = 1\n"), "11:1", {"tune.limit.measure", "missing"});
  check_refused(with("measure = 'dumping'\n"), "12:11", {"'dumping'", "'damping'?"});
  check_refused(with("measure = 'response_use'\nat_most = 1\n"), "12:11", {"[tune.disturbance]"});
  check_refused(with("measure = 'sensitivity'\nat_most = 1\n"), "12:11", {"[[tune.uncertain]]"});
  check_refused(with("measure = 'half_time'\nat_most = 1\n"), "11:1",
                {"tune.limit.of: is missing", "the name of a mode"});
  check_refused(with("measure = 'damping'\nat_least = 0.4\nof = 'phugoid'\n"), "14:6",
                {"tune.limit.of", "expected no key of"});
  check_refused(with("measure = 'damping'\nat_least = 2\n"), "13:12", {"2 is out of range"});
  check_refused(with("measure = 'damping'\nat_least = nan\n"), "13:12", {"nan is not finite"});
  check_refused(with("measure = 'damping'\nat_least = [0.4]\n"), "13:12", {"an array"});
  check_refused(with("measure = 'phase_margin_deg'\nat_least = 181\n"), "13:12",
                {"181 is out of range", "0 to 180 degrees"});
  check_refused(with("measure = 'decay'\nat_least = inf\n"), "13:12", {"inf", "1/s"});
  CHECK(study_refusal(with("measure = 'decay'\nat_least = -1\n")).empty());
}

TEST_CASE("a limit on the wrong side is refused with the right one named") {
  for (const Requirement& r : asked()) {
    const Measure measure = r.measure;
    const bool more = more_is_better(measure);
    const std::string right = more ? "at_least" : "at_most", wrong = more ? "at_most" : "at_least";
    const std::string head = "[[tune.limit]]\nmeasure = '" + name_of(r) + "'\n" + of(measure);
    const int line = measure == Measure::half_time ? 19 : 18;
    const auto with = [&](const std::string& rest) {
      return study("", all_that_is_needed + head + rest);
    };
    check_refused(with(wrong + " = 0.5\n"), fmt::format("{}:{}", line, wrong.size() + 4),
                  {"tune.limit." + wrong, name_of(r), "expected " + right});
    check_refused(with(right + " = 0.5\n" + wrong + " = 0.6\n"),
                  fmt::format("{}:{}", line + 1, wrong.size() + 4), {"expected " + right});
    check_refused(with(""), "16:1", {"tune.limit." + right, "missing"});
    if (measure != Measure::decay)
      check_refused(with(right + " = -1.5\n"), fmt::format("{}:{}", line, right.size() + 4),
                    {"-1.5 is out of range"});
  }
}

TEST_CASE("fronts that cannot be are refused") {
  const auto with = [](const std::string& text) {
    return study("", "[tune.front]\nmeasure = 'damping'\n" + text);
  };
  check_refused(study("front = 3\n"), "7:9", {"tune.front: 3 is not a table"});
  check_refused(study("", "[[tune.front]]\n"), "11:1", {"tune.front: an array is not a table"});
  check_refused(study("", "[tune.front]\n"), "11:1", {"tune.front.measure", "missing"});
  check_refused(study("", "[tune.front]\nmeasure = 'half_time'\n"), "11:1",
                {"tune.front.of: is missing"});
  check_refused(study("", "[tune.front]\nmeasure = 'sensitivity'\n"), "12:11",
                {"[[tune.uncertain]]"});
  check_refused(with("of = 'a1s'\n"), "13:6", {"tune.front.of", "expected no key of"});
  check_refused(with(""), "11:1", {"tune.front.from", "missing"});
  check_refused(with("from = 0.2\n"), "11:1", {"tune.front.to", "missing"});
  check_refused(with("from = 0.2\nto = 0.8\n"), "11:1", {"tune.front.count", "missing"});
  check_refused(with("from = 0.2\nto = 0.2\ncount = 3\n"), "14:6", {"0.2 is `from` again"});
  check_refused(with("from = 0.2\nto = 1.2\ncount = 3\n"), "14:6", {"1.2 is out of range"});
  check_refused(with("from = nan\nto = 0.2\ncount = 3\n"), "13:8", {"nan"});
  check_refused(with("from = 0.2\nto = 0.8\ncount = 1\n"), "15:9", {"1 is out of range"});
  check_refused(with("from = 0.2\nto = 0.8\ncount = 101\n"), "15:9", {"101 is out of range"});
  check_refused(with("from = 0.2\nto = 0.8\ncount = 7.5\n"), "15:9", {"not a whole number"});
  CHECK(tuned(with("from = 0.8\nto = 0.2\ncount = 2\n")).front->from == 0.8);
}

TEST_CASE("what is no table is refused") {
  check_refused("tune = 3\n" + level, "1:8", {"tune: 3 is not a table", "[tune]"});
  check_refused("tune = 'decay'\n" + level, "1:8", {"tune: the text 'decay'"});
  check_refused("[[tune]]\n" + level, "1:1", {"tune: an array is not a table"});
}

// A study with all keys.
static const std::string everything =
    level + climb +
    "[tune]\nconditions = ['climb', 'level']\ncorridor = {from = 0, to = 120, count = 13}\n"
    "schedule_eta_deg = [0, 45, 90]\ngoal = {measure = 'disk_margin', of = 'delta_e'}\n"
    "corners = 'all'\nsamples = 20\nglobal = 'crs2'\nlocal = 'mma'\nsecond = 'esch'\nseed = 7\n"
    "evaluations = 100\nseconds = 60\nrobustness = 1000\n[tune.disturbance]\nV = 1.0\n"
    "gamma_deg = 5.0\ntheta_deg = 0.0\nq_deg = 0.0\n" +
    gain + mass +
    "[[tune.limit]]\nmeasure = 'half_time'\nof = 'phugoid'\nat_most = 10\n"
    "[tune.front]\nmeasure = 'damping'\nfrom = 0.2\nto = 0.8\ncount = 7\n";

TEST_CASE("a [tune] with bytes changed, lost or doubled loads or is refused") {
  REQUIRE(study_refusal(everything).empty());
  check_damaged(everything, trials(5000));
}

// The value of each key is replaced by each of these in turn.
TEST_CASE("a [tune] with a value of another kind at any key loads or is refused" * thorough) {
  check_exchanged(everything, "[tune]",
                  {"1", "-0.0", "1e308", "5e-324", "nan", "'x'", "''", "true", "2024-01-01", "[]",
                   "[[]]", "[{}]", "{}", "{a = 1}", "['x', 1]"});
}

TEST_CASE("the manual names every key of [tune], every measure and its unit") {
  std::ifstream in(TILTRIM_SOURCE_DIR "/docs/study.md", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t start = text.find("## [tune]");
  REQUIRE(start != text.npos);
  const std::string manual = text.substr(start, text.find("\n## ", start) - start);
  for (const char* key : {"conditions",
                          "corridor",
                          "schedule_eta_deg",
                          "goal",
                          "corners",
                          "samples",
                          "global",
                          "local",
                          "second",
                          "seed",
                          "evaluations",
                          "seconds",
                          "robustness",
                          "key",
                          "from",
                          "spacing",
                          "percent",
                          "measure",
                          "at_least",
                          "at_most",
                          "of",
                          "count",
                          "gamma_deg",
                          "theta_deg",
                          "q_deg",
                          "input",
                          "output",
                          "weight",
                          "weights",
                          "band",
                          "regulator_starts",
                          "placed_starts"}) {
    CAPTURE(key);
    CHECK(manual.find(fmt::format("`{}`", key)) != manual.npos);
  }
  std::vector<Requirement> all = asked();
  for (const Measure measure : measures())
    if (measure > Measure::sensitivity) all.push_back({measure});
  for (const Requirement& r : all) {
    const Measure measure = r.measure;
    const std::string side = more_is_better(measure) ? "at_least" : "at_most";
    CAPTURE(name_of(r));
    const std::string row = fmt::format("| `{}` | {} | `{}` |", name_of(r), unit(measure), side);
    const std::string without_unit = fmt::format("| `{}` | | `{}` |", name_of(r), side);
    CHECK(manual.find(unit(measure).empty() ? without_unit : row) != manual.npos);
  }
}

}  // namespace tune_study_test
