// [simulate] and [montecarlo] of a study: values read, and refusals with position and message.
#include <fstream>
#include <iterator>
#include <numbers>

#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/study_text.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;

namespace simulate_study_test {

static constexpr double degree = std::numbers::pi / 180;
static constexpr double infinity = std::numeric_limits<double>::infinity();

static const std::string level =
    "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n";  // lines 1-5
static const std::string hover =
    "[[condition]]\nname = 'hover'\nV = 0\ngamma_deg = 90\neta_deg = 90\n";
static const std::string fixed_wing =
    "[[condition]]\nname = 'glide'\nformulation = 'airframe'\nV = 15\neta_deg = 0\n";
static const std::string gust = "[[simulate.gust]]\nkind = 'steady'\nsize = 2\n";
static const std::string mass = "key = 'aircraft.mass'\n";

// Lines 1-5 the condition, 6 [simulate], then its keys and tables.
static std::string study(const std::string& keys) { return level + "[simulate]\n" + keys; }
// Lines 1-5 the condition, 6 [montecarlo], then its keys and tables.
static std::string again(const std::string& keys) { return level + "[montecarlo]\n" + keys; }

static Study parsed(const std::string& text) {
  return parse_study(text, TILTRIM_SOURCE_DIR "/studies/s.toml");
}

static SimulateTable flown(const std::string& text) {
  const Study read = parsed(text);
  REQUIRE(read.simulate);
  return *read.simulate;
}

static MonteCarloTable repeated(const std::string& text) {
  const Study read = parsed(text);
  REQUIRE(read.montecarlo);
  return *read.montecarlo;
}

// A number is refused below and above its range, if missing, and if not a number.
static void check_range(const auto& with, const std::string& place, const std::string& key,
                        const std::vector<std::string>& inside,
                        const std::vector<std::string>& outside) {
  for (const std::string& value : inside) CHECK(study_refusal(with(value)) == "");
  for (const std::string& value : outside) check_refused(with(value), place, {key + ": "});
  check_refused(with("nan"), place, {key + ": nan is not finite", "expected a number from"});
  check_refused(with("inf"), place, {key + ": inf is not finite"});
  check_refused(with("-inf"), place, {key + ": -inf is not finite"});
  check_refused(with("'1'"), place, {key + ": the text '1' is not a number"});
  check_refused(with("[1]"), place, {key + ": an array is not a number"});
  check_refused(with("{}"), place, {key + ": a table is not a number"});
  check_refused(with("true"), place, {key + ": a boolean is not a number"});
  check_refused(with("2024-01-01"), place, {key + ": a date"});
}

// ---- accepted ----

using ScheduleKind = ScheduleTable::Kind;

static void check_defaults(const SimulateTable& simulate) {
  CHECK(simulate.schedule.kind == ScheduleKind::corridor);
  CHECK_FALSE(simulate.schedule.over_time);
  CHECK(simulate.schedule.at.empty());
  CHECK(simulate.schedule.V.empty());
  CHECK(simulate.schedule.gamma.empty());
  CHECK(simulate.schedule.eta.empty());
  CHECK(simulate.duration == 90);
  CHECK(simulate.start.empty());
  CHECK(simulate.height == 0);
  CHECK(simulate.states.empty());
  CHECK(simulate.axes == Axes::body);
  CHECK(simulate.hand_over == HandOver::as_printed);
  CHECK(simulate.anti_windup == 1);
  CHECK(simulate.rates.theta0 == infinity);
  CHECK(simulate.rates.a1s == infinity);
  CHECK(simulate.rates.delta_e == infinity);
  CHECK(simulate.rates.eta == infinity);
  CHECK(simulate.lag == 0.05);
  CHECK(simulate.disturbances.empty());
  CHECK(simulate.gusts.empty());
  CHECK(simulate.tolerance == 1e-9);
  CHECK(simulate.sample == 0.1);
}

TEST_CASE("without the tables there are none; an empty one has its defaults") {
  CHECK_FALSE(parsed(level).simulate);
  CHECK_FALSE(parsed(level).montecarlo);
  check_defaults(flown(study("")));
  CHECK_FALSE(parsed(study("")).montecarlo);
  const Study alone = parsed(again(""));
  REQUIRE(alone.simulate);
  check_defaults(*alone.simulate);
  REQUIRE(alone.montecarlo);
  CHECK(alone.montecarlo->flights == 1000);
  CHECK(alone.montecarlo->seed == 1);
  CHECK(alone.montecarlo->worst == 10);
  CHECK(alone.montecarlo->scatter.empty());
  CHECK(alone.montecarlo->V_within == 0.2);
  CHECK(alone.montecarlo->gamma_within == 0.01);
  CHECK(alone.montecarlo->theta_within == 1.3);
}

TEST_CASE("every key of [simulate] is read into its own place") {
  const SimulateTable simulate =
      flown(study("schedule = 'hold'\nduration = 20\nstart = 'level'\nheight = 130\n"
                  "axes = 'wind'\nhand_over = 'bumpless'\nanti_windup = 0.5\nlag = 0.1\n"
                  "tolerance = 1e-6\nsample = 0.25\n[simulate.states]\nV = 14\ngamma_deg = 2\n"
                  "theta_deg = 5\nq = 0.1\nenergy_integral = 0.2\ndistribution_integral = -0.3\n"
                  "[simulate.rates]\ntheta0 = 2\na1s_deg = 60\ndelta_e_deg = 90\neta_deg = 3\n"));
  CHECK(simulate.schedule.kind == ScheduleKind::hold);
  CHECK(simulate.duration == 20);
  CHECK(simulate.start == "level");
  CHECK(simulate.height == 130);
  CHECK(simulate.axes == Axes::wind);
  CHECK(simulate.hand_over == HandOver::bumpless);
  CHECK(simulate.anti_windup == 0.5);
  CHECK(simulate.lag == 0.1);
  CHECK(simulate.tolerance == 1e-6);
  CHECK(simulate.sample == 0.25);
  CHECK(simulate.states == std::map<std::string, double>{{"V", 14},
                                                         {"gamma", 2 * degree},
                                                         {"theta", 5 * degree},
                                                         {"q", 0.1},
                                                         {"energy_integral", 0.2},
                                                         {"distribution_integral", -0.3}});
  CHECK(simulate.rates.theta0 == 2);
  CHECK(simulate.rates.a1s == 60 * degree);
  CHECK(simulate.rates.delta_e == 90 * degree);
  CHECK(simulate.rates.eta == 3 * degree);
}

TEST_CASE("the words that are defaults may be said") {
  const SimulateTable simulate =
      flown(study("schedule = 'corridor'\nstart = 'ground'\nheight = 0\naxes = 'body'\n"
                  "hand_over = 'as_printed'\n"));
  CHECK(simulate.schedule.kind == ScheduleKind::corridor);
  CHECK(simulate.start == "ground");
  CHECK(simulate.axes == Axes::body);
  CHECK(simulate.hand_over == HandOver::as_printed);
}

TEST_CASE("integrals that wind up, and samples no further apart than the flight is long") {
  CHECK(flown(study("anti_windup = 0\n")).anti_windup == infinity);
  CHECK(flown(study("duration = 0.05\n")).sample == 0.05);
  CHECK(flown(study("duration = 0.05\nsample = 0.05\n")).sample == 0.05);
  CHECK(flown(study("duration = 100_000\n")).sample == 0.1);
}

TEST_CASE("starts and heights: a reconversion begins on top of the corridor") {
  CHECK(flown(study("start = 'trim'\n")).start == "trim");
  CHECK(flown(study("start = 'trim'\n")).height == 0);
  CHECK(flown(level + fixed_wing + "[simulate]\nstart = 'level'\n").start == "level");
  const SimulateTable back = flown(study("schedule = 'reconversion'\n"));
  CHECK(back.schedule.kind == ScheduleKind::reconversion);
  CHECK(back.start.empty());
  CHECK(back.height == 120);
  CHECK(flown(study("schedule = 'reconversion'\nheight = 80\n")).height == 80);
  CHECK(flown(study("schedule = 'reconversion'\nstart = 'level'\n")).height == 120);
  CHECK(flown(study("schedule = 'hold'\n")).height == 0);
  CHECK(flown(study("schedule = 'hold'\n")).start.empty());
  CHECK(flown(study("[simulate.states]\ntheta_deg = 5\n")).states ==
        std::map<std::string, double>{{"theta", 5 * degree}});
}

static const std::string times =
    "[simulate.schedule]\nover = 'time'\nat = [0, 30]\nV = [2, 15]\ngamma_deg = [90, 0]\n"
    "eta_deg = [90, -10]\n";

TEST_CASE("a schedule of the study's own: over time all of it, over height what differs") {
  const ScheduleTable timed = flown(study(times)).schedule;
  CHECK(timed.kind == ScheduleKind::table);
  CHECK(timed.over_time);
  CHECK(timed.at == std::vector<double>{0, 30});
  CHECK(timed.V == std::vector<double>{2, 15});
  CHECK(timed.gamma == std::vector<double>{90 * degree, 0});
  CHECK(timed.eta == std::vector<double>{90 * degree, -10 * degree});
  CHECK(flown(study(times)).height == 0);
  const auto high = [](const std::string& lists) {
    return flown(study("[simulate.schedule]\nover = 'height'\nat = [-5, 20, 150]\n" + lists))
        .schedule;
  };
  const ScheduleTable fast = high("V = [2, 3.5, 18]\n");
  CHECK(fast.kind == ScheduleKind::table);
  CHECK_FALSE(fast.over_time);
  CHECK(fast.at == std::vector<double>{-5, 20, 150});
  CHECK(fast.V == std::vector<double>{2, 3.5, 18});
  CHECK(fast.gamma.empty());
  CHECK(fast.eta.empty());
  CHECK(high("gamma_deg = [1, 2, 3]\n").gamma[1] == 2 * degree);
  CHECK(high("eta_deg = [1, 2, 3]\n").eta[2] == 3 * degree);
  CHECK(flown(study("schedule = {over = 'height', at = [0, 0.0001], V = [1, 2]}\n")).schedule.V ==
        std::vector<double>{1, 2});
}

TEST_CASE("disturbances of each kind, on each thing, in SI") {
  struct On {
    const char *key, *signal;
    double unit;
  };
  for (const auto& [key, signal, unit] : {On{"V", "V", 1},
                                          {"gamma_deg", "gamma", degree},
                                          {"theta0", "theta0", 1},
                                          {"a1s_deg", "a1s", degree},
                                          {"delta_e_deg", "delta_e", degree}}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const std::string head = fmt::format("[[simulate.disturbance]]\non = '{}'\nsize = -3\n", key);
    const SimulateTable simulate = flown(
        study(head + "kind = 'step'\n" + head + "kind = 'doublet'\nat = 5\nduration = 0.5\n"));
    REQUIRE(simulate.disturbances.size() == 2);
    const DisturbanceTable &step = simulate.disturbances[0], &doublet = simulate.disturbances[1];
    CHECK(step.kind == DisturbanceTable::Kind::step);
    CHECK(step.on == signal);
    CHECK(step.size == -3 * unit);
    CHECK(step.at == 0);
    CHECK(step.duration == 0);
    CHECK(doublet.kind == DisturbanceTable::Kind::doublet);
    CHECK(doublet.on == signal);
    CHECK(doublet.size == -3 * unit);
    CHECK(doublet.at == 5);
    CHECK(doublet.duration == 0.5);
  }
}

TEST_CASE("gusts of each kind with their own keys") {
  const SimulateTable simulate = flown(
      study(gust +
            "[[simulate.gust]]\nkind = 'one_minus_cosine'\ndirection = 'up'\nsize = -1.5\n"
            "at = 10\nduration = 2\n"
            "[[simulate.gust]]\nkind = 'dryden'\ndirection = 'forward'\nsize = 0.7\nlength = 80\n"
            "speed = 12\nseed = 9007199254740992\n"
            "[[simulate.gust]]\nkind = 'one_minus_cosine'\nsize = 1\n"
            "[[simulate.gust]]\nkind = 'dryden'\nsize = 1\n"));
  REQUIRE(simulate.gusts.size() == 5);
  const GustTable &steady = simulate.gusts[0], &cosine = simulate.gusts[1],
                  &dryden = simulate.gusts[2];
  CHECK(steady.kind == GustTable::Kind::steady);
  CHECK_FALSE(steady.up);
  CHECK(steady.size == 2);
  CHECK(cosine.kind == GustTable::Kind::one_minus_cosine);
  CHECK(cosine.up);
  CHECK(cosine.size == -1.5);
  CHECK(cosine.at == 10);
  CHECK(cosine.duration == 2);
  CHECK(dryden.kind == GustTable::Kind::dryden);
  CHECK_FALSE(dryden.up);
  CHECK(dryden.size == 0.7);
  CHECK(dryden.length == 80);
  CHECK(dryden.speed == 12);
  CHECK(dryden.seed == 9007199254740992U);
  CHECK(simulate.gusts[3].at == 0);
  CHECK(simulate.gusts[3].duration == 1);
  CHECK(simulate.gusts[4].length == 50);
  CHECK(simulate.gusts[4].speed == 15);
  CHECK(simulate.gusts[4].seed == 1);
}

TEST_CASE("every key of [montecarlo] is read into its own place") {
  const MonteCarloTable montecarlo =
      repeated(again("flights = 10_000_000\nseed = 7\nworst = 0\nV_within = 0.5\n"
                     "gamma_within_deg = 2\ntheta_within_deg = 45\n[[montecarlo.scatter]]\n" +
                     mass + "percent = 25\n"));
  CHECK(montecarlo.flights == 10'000'000);
  CHECK(montecarlo.seed == 7);
  CHECK(montecarlo.worst == 0);
  CHECK(montecarlo.V_within == 0.5);
  CHECK(montecarlo.gamma_within == 2 * degree);
  CHECK(montecarlo.theta_within == 45 * degree);
  REQUIRE(montecarlo.scatter.size() == 1);
  CHECK(montecarlo.scatter[0].name == "aircraft.mass");
  CHECK(montecarlo.scatter[0].lower == 3);
  CHECK(montecarlo.scatter[0].upper == 5);
}

TEST_CASE("every number of the aircraft and the gains may be scattered, and three of the flight") {
  const auto scatter = [](const std::string& text) {
    return repeated(study("start = 'trim'\n" + gust + "[[montecarlo.scatter]]\n" + text))
        .scatter.at(0);
  };
  for (const Signals& signals : {aircraft_signals(), gain_signals()})
    for (const Key& key : number_keys(signals)) {
      CAPTURE(key.name);
      const Uncertain number = scatter("key = '" + key.name + "'\nfrom = 0.5\nto = 1\n");
      CHECK(number.name == key.signal);
      CHECK(number.lower == key.in_si(0.5));
      CHECK(number.upper == key.in_si(1));
    }
  const Uncertain theta = scatter("key = 'theta_deg'\nfrom = -5\nto = 10\n");
  CHECK(theta.name == "theta");
  CHECK(theta.lower == -5 * degree);
  CHECK(theta.upper == 10 * degree);
  const Uncertain height = scatter("key = 'height'\nfrom = 0\nto = 130\n");
  CHECK(height.name == "height");
  CHECK(height.lower == 0);
  CHECK(height.upper == 130);
  const Uncertain size = scatter("key = 'gust_size'\nfrom = -3\nto = 3\n");
  CHECK(size.name == "gust_size");
  CHECK(size.lower == -3);
  CHECK(size.upper == 3);
  CHECK(scatter("key = 'aircraft.CM_q'\npercent = 50\n").lower == -10.5);
}

TEST_CASE("[montecarlo] may stand ahead of what it repeats") {
  const std::string size = "key = 'gust_size'\nfrom = 1\nto = 2\n";
  const Study read = parsed("[[montecarlo.scatter]]\n" + size + gust + level);
  CHECK(read.simulate->gusts.size() == 1);
  CHECK(read.montecarlo->scatter.at(0).name == "gust_size");
}

TEST_CASE("a gain that is the same at all tilts may be scattered") {
  const std::string scheduled = "[gains]\nschedule_eta_deg = [0, 90]\nK_Lp = [1, 2]\nk_V = 8\n";
  const auto with = [&](const std::string& key) {
    return scheduled + again("[[montecarlo.scatter]]\nkey = '" + key + "'\npercent = 50\n");
  };
  CHECK(repeated(with("gains.k_V")).scatter.at(0).upper == 12);
  check_refused(with("gains.K_Lp"), "12:7",
                {"montecarlo.scatter.key: gains.K_Lp depends on the tilt (schedule_eta_deg)",
                 "from 1 to 2", "expected a number that is constant"});
}

// ---- refused ----

TEST_CASE("a key misspelt is refused, with the nearest and all valid keys") {
  check_refused(study("durtion = 3\n"), "7:1",
                {"unknown key 'durtion' in [simulate]", "did you mean 'duration'?", "hand_over"});
  check_refused(study("anti_wind_up = 3\n"), "7:1", {"'anti_windup'?"});
  check_refused(study("[simulate.rate]\n"), "7:11", {"'rate'", "did you mean 'rates'?"});
  check_refused(study("[[simulate.gusts]]\n"), "7:12", {"'gusts'", "did you mean 'gust'?"});
  check_refused(study("[simulate.states]\ntheta = 5\n"), "8:1",
                {"'theta' in [simulate.states]", "did you mean 'theta_deg'?", "energy_integral"});
  check_refused(study("[simulate.states]\nq_deg = 5\n"), "8:1", {"'q_deg' in [simulate.states]"});
  check_refused(study("[simulate.rates]\na1s = 5\n"), "8:1",
                {"'a1s' in [simulate.rates]", "did you mean 'a1s_deg'?"});
  check_refused(study("[simulate.schedule]\nover = 'time'\neta = [1]\n"), "9:1",
                {"'eta' in [simulate.schedule]", "did you mean 'eta_deg'?"});
  check_refused(study("[[simulate.disturbance]]\nsizes = 1\n"), "8:1",
                {"'sizes' in [[simulate.disturbance]]", "did you mean 'size'?"});
  check_refused(study("[[simulate.gust]]\nknd = 'steady'\n"), "8:1",
                {"'knd' in [[simulate.gust]]", "did you mean 'kind'?"});
  check_refused(again("flight = 3\n"), "7:1",
                {"unknown key 'flight' in [montecarlo]", "did you mean 'flights'?"});
  check_refused(again("gamma_within = 1\n"), "7:1", {"did you mean 'gamma_within_deg'?"});
  check_refused(again("[[montecarlo.scatter]]\n" + mass + "precent = 1\n"), "9:1",
                {"'precent' in [[montecarlo.scatter]]", "did you mean 'percent'?"});
  check_refused("[simulat]\n" + level, "1:2", {"'simulat' at the top level", "'simulate'?"});
  check_refused("[monte_carlo]\n" + level, "1:2", {"did you mean 'montecarlo'?"});
}

TEST_CASE("what is no table is refused") {
  check_refused("simulate = 3\n" + level, "1:12", {"simulate: 3 is not a table", "[simulate]"});
  check_refused("[[simulate]]\n" + level, "1:1", {"simulate: an array is not a table"});
  check_refused("montecarlo = 'x'\n" + level, "1:14", {"montecarlo: the text 'x'"});
  check_refused("[[montecarlo]]\n" + level, "1:1", {"montecarlo: an array is not a table"});
  for (const char* name : {"states", "rates"}) {
    const std::string key = name, at = fmt::format("7:{}", key.size() + 4);
    check_refused(study(key + " = 3\n"), at,
                  {"simulate." + key + ": 3 is not a table", "a table [simulate." + key + "]"});
    check_refused(study(key + " = []\n"), at, {"simulate." + key + ": an empty array"});
  }
  for (const std::string name : {"simulate.disturbance", "simulate.gust", "montecarlo.scatter"}) {
    const std::size_t dot = name.find('.');
    const auto with = [&](const std::string& value) {
      return level + "[" + name.substr(0, dot) + "]\n" + name.substr(dot + 1) + value;
    };
    const std::size_t column = name.size() - dot + 3;
    const std::string at = fmt::format("7:{}", column), in = fmt::format("7:{}", column + 1);
    check_refused(with(" = 3\n"), at, {name + ": 3 is not a list of tables", "[[" + name + "]]"});
    check_refused(with(" = []\n"), at, {name + ": an empty array is not a list"});
    check_refused(with(" = {}\n"), at, {name + ": is one table", "[[" + name + "]]"});
    check_refused(with(" = ['x']\n"), in, {name + ": the text 'x' is not a table"});
    check_refused(with(" = [[]]\n"), in, {name + ": an empty array is not a table"});
  }
}

TEST_CASE("the printed equations cannot be simulated;") {
  for (const char* name : {"simulate", "montecarlo"})
    check_refused(fmt::format("equations = 'printed'\n{}[{}]\n", level, name), "7:1",
                  {fmt::format("{}: the printed equations cannot be simulated", name),
                   "expected equations = \"consistent\""});
  CHECK(study_refusal("equations = 'consistent'\n" + study("")).empty());
}

TEST_CASE("numbers of [simulate] that cannot be are refused") {
  struct Bad {
    const char* key;
    std::vector<std::string> inside, outside;
  };
  for (const auto& [key, inside, outside] :
       {Bad{"duration", {"0.1", "100_000"}, {"0", "-1", "0.00009", "100_001", "1e300"}},
        {"height", {"0", "-0.0"}, {"-1", "1_000_001", "1", "120"}},
        {"anti_windup", {"0", "0.0001", "1_000_000"}, {"-1", "1e-5", "1e-300", "1_000_001"}},
        {"lag", {"0.0001", "1_000"}, {"0", "-1", "0.00009", "1_001"}},
        {"tolerance", {"1e-13", "1e-3"}, {"0", "-1", "9e-14", "0.0011"}},
        {"sample", {"0.0001", "90"}, {"0", "-1", "0.00009", "90.1"}}}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const auto with = [&, name = std::string(key)](const std::string& value) {
      return study(name + " = " + value + "\n");
    };
    check_range(with, fmt::format("7:{}", std::string(key).size() + 4),
                fmt::format("simulate.{}", key), inside, outside);
  }
  check_refused(study("duration = 0\n"), "7:12", {"0 is out of range", "0.0001 to 100000 s"});
  check_refused(study("anti_windup = 1e-5\n"), "7:15", {"too short", "expected 0, or at least"});
  check_refused(study("duration = 10\nsample = 11\n"), "8:10", {"0.0001 to 10 s"});
  check_refused(study("duration = 1000\nsample = 0.0001\n"), "8:10",
                {"simulate.sample: 0.0001 s of 1000 s are 1e+07 samples", "at most 2000000"});
}

TEST_CASE("words of [simulate] that are not known are refused") {
  check_refused(study("schedule = 'coridor'\n"), "7:12",
                {"simulate.schedule: 'coridor' is not known", "corridor, hold, reconversion",
                 "did you mean 'corridor'?"});
  check_refused(study("schedule = 3\n"), "7:12",
                {"simulate.schedule: 3 is not a schedule", "[simulate.schedule]"});
  check_refused(study("schedule = []\n"), "7:12", {"simulate.schedule: an empty array"});
  check_refused(study("schedule = ''\n"), "7:12", {"simulate.schedule: 0 bytes"});
  check_refused(study("[[simulate.schedule]]\n"), "7:1", {"an array is not a schedule"});
  check_refused(study("axes = 'wnd'\n"), "7:8", {"simulate.axes: 'wnd'", "did you mean 'wind'?"});
  check_refused(study("axes = 1\n"), "7:8", {"simulate.axes: 1 is not text"});
  check_refused(study("hand_over = 'bumples'\n"), "7:13",
                {"simulate.hand_over: 'bumples'", "as_printed, bumpless", "'bumpless'?"});
  check_refused(study("hand_over = true\n"), "7:13", {"a boolean is not text"});
}

TEST_CASE("starts that cannot be are refused") {
  const auto both = [](const std::string& keys) {
    return level + fixed_wing + "[simulate]\n" + keys;  // [simulate] is line 11
  };
  check_refused(study("start = 'levl'\n"), "7:9",
                {"simulate.start: 'levl' is not known", "ground, trim, level", "'level'?"});
  check_refused(study("start = 'grund'\n"), "7:9", {"did you mean 'ground'?"});
  check_refused(study("start = 3\n"), "7:9", {"simulate.start: 3 is not text"});
  check_refused(study("start = ['level']\n"), "7:9", {"an array is not text"});
  check_refused(
      both("start = 'glide'\n"), "12:9",
      {"simulate.start: the condition 'glide' has no control law", "formulation closed_loop"});
  check_refused(
      "[[condition]]\nname = 'trim'\nV = 5\ngamma_deg = 0\neta_deg = 0\n[simulate]\n"
      "start = 'trim'\n",
      "7:9", {"simulate.start: 'trim' is also the name of a condition"});
  check_refused(fixed_wing + "[simulate]\nschedule = 'hold'\n", "7:12",
                {"simulate.schedule: the condition 'glide' has no control law", "closed_loop"});
  CHECK(study_refusal(fixed_wing + level + "[simulate]\nschedule = 'hold'\nstart = 'level'\n")
            .empty());
  CHECK(study_refusal(fixed_wing + "[simulate]\n").empty());
  check_refused(study("schedule = 'reconversion'\nstart = 'ground'\n"), "8:9",
                {"simulate.start: a reconversion starts in the air", "\"trim\""});
  check_refused(study("height = 20\n"), "7:10",
                {"simulate.height: 20 m is not the ground", "start = \"trim\""});
  check_refused(study("start = 'ground'\nheight = 20\n"), "8:10", {"20 m is not the ground"});
  CHECK(study_refusal(study("start = 'trim'\nheight = 20\n")).empty());
}

TEST_CASE("wind axes are refused where V vanishes") {
  check_refused(study("axes = 'wind'\n"), "7:8",
                {"simulate.axes: wind axes divide by V, which is 0 on the ground", "\"body\""});
  check_refused(study("axes = 'wind'\nstart = 'ground'\n"), "7:8", {"on the ground"});
  check_refused(study("axes = 'wind'\n[simulate.schedule]\nover = 'height'\nat = [0, 1]\n"
                      "V = [1, 2]\n"),
                "7:8", {"on the ground"});
  CHECK(flown(study("axes = 'wind'\nstart = 'trim'\n")).axes == Axes::wind);
  CHECK(flown(study("axes = 'wind'\nschedule = 'hold'\n")).axes == Axes::wind);
  CHECK(flown(study("axes = 'wind'\n" + times)).axes == Axes::wind);
  check_refused(study("axes = 'wind'\nstart = 'trim'\n[simulate.states]\nV = 0.4\n"), "7:8",
                {"V, which decreases to 0.4 m/s;", "at least 0.5 m/s"});
  check_refused(study("axes = 'wind'\nschedule = {over = 'time', at = [0, 1], V = [5, 0], "
                      "gamma_deg = [0, 0], eta_deg = [0, 0]}\n"),
                "7:8", {"decreases to 0 m/s;"});
  const std::string hovering = hover + "[simulate]\naxes = 'wind'\nstart = 'hover'\n";
  check_refused(hovering, "7:8", {"decreases to 0 m/s;"});
  CHECK(study_refusal(hovering + "[simulate.states]\nV = 0.5\n").empty());
  const std::string held = hover + "[simulate]\naxes = 'wind'\nschedule = 'hold'\n";
  check_refused(held, "7:8", {"decreases to 0 m/s;"});
  check_refused(held + "[simulate.states]\nV = 5\n", "7:8", {"decreases to 0 m/s;"});
}

TEST_CASE("states that cannot be are refused") {
  struct Bad {
    const char *key, *most, *too_much;
  };
  for (const auto& [key, most, too_much] : {Bad{"V", "1_000_000", "1_000_001"},
                                            {"gamma_deg", "180", "181"},
                                            {"theta_deg", "-180", "-181"},
                                            {"q", "1_000", "1_001"},
                                            {"energy_integral", "1e6", "-2e6"},
                                            {"distribution_integral", "-1e6", "2e6"}}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const auto with = [&, name = std::string(key)](const std::string& value) {
      return study("start = 'trim'\n[simulate.states]\n" + name + " = " + value + "\n");
    };
    check_range(with, fmt::format("9:{}", std::string(key).size() + 4),
                fmt::format("simulate.states.{}", key), {"0", most}, {too_much});
  }
  check_refused(study("start = 'trim'\n[simulate.states]\nV = -1\n"), "9:5", {"0 to 1000000 m/s"});
  for (const char* start : {"", "start = 'ground'\n"})
    for (const char* key : {"V", "gamma_deg"})
      check_refused(study(fmt::format("states = {{{} = 1}}\n{}", key, start)),
                    fmt::format("7:{}", 14 + std::string(key).size()),
                    {fmt::format("simulate.states.{}: on the ground the aircraft is at rest", key),
                     "start = \"trim\""});
}

TEST_CASE("rates of actuators that cannot be are refused") {
  for (const std::string key : {"theta0", "a1s_deg", "delta_e_deg", "eta_deg"}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const auto with = [&](const std::string& value) {
      return study("[simulate.rates]\n" + key + " = " + value + "\n");
    };
    check_range(with, fmt::format("8:{}", key.size() + 4), "simulate.rates." + key, {"1e-6", "1e6"},
                {"0", "-1", "1e-7", "2e6"});
  }
  check_refused(study("[simulate.rates]\ntheta0 = 0\n"), "8:10", {"0 is out of range", "1/s"});
  check_refused(study("[simulate.rates]\neta_deg = 0\n"), "8:11", {"degrees/s"});
}

TEST_CASE("schedules that cannot be are refused") {
  const auto with = [](const std::string& keys) { return study("[simulate.schedule]\n" + keys); };
  check_refused(with("at = [0, 1]\n"), "7:1",
                {"simulate.schedule.over: is missing", "\"height\" or \"time\""});
  check_refused(with("over = 'tim'\nat = [0, 1]\n"), "8:8", {"'tim'", "did you mean 'time'?"});
  check_refused(with("over = 3\n"), "8:8", {"simulate.schedule.over: 3 is not text"});
  check_refused(with("over = 'time'\n"), "7:1", {"simulate.schedule.at: is missing", "times in s"});
  check_refused(with("over = 'height'\n"), "7:1", {"at: is missing", "heights in m"});
  const auto at = [&](const std::string& list) { return with("over = 'height'\nat = " + list); };
  check_refused(at("5\n"), "9:6",
                {"simulate.schedule.at: 5 is not a list of heights", "at least two"});
  check_refused(at("[]\n"), "9:6", {"an empty array is not a list of heights"});
  check_refused(at("[5]\n"), "9:6", {"at least two, in ascending order,"});
  check_refused(at("{}\n"), "9:6", {"a table is not a list of heights"});
  check_refused(at("[5, 5]\n"), "9:6",
                {"5 after 5 is not in ascending order;", "ascending heights, each once"});
  check_refused(at("[0, 5, 4]\n"), "9:6", {"4 after 5 is not in ascending order;"});
  check_refused(at("[0, 1e-5]\n"), "9:6", {"1e-05 after 0 is too close", "at least 0.0001 apart"});
  check_refused(at("[0, nan]\n"), "9:10", {"simulate.schedule.at: nan is not finite"});
  check_refused(at("[-inf, 0]\n"), "9:7", {"simulate.schedule.at: -inf is not finite"});
  check_refused(at("[0, 'x']\n"), "9:10", {"the text 'x' is not a number"});
  check_refused(at("[0, 2e6]\n"), "9:10", {"2000000 is out of range", "m"});
  std::string many = "[0";
  for (int i = 1; i <= 1000; ++i) many += fmt::format(", {}", i);
  check_refused(at(many + "]\n"), "9:6", {"has 1001 heights", "at most 1000"});
  check_refused(with("over = 'time'\nat = [-1, 1]\n"), "9:7", {"-1 is out of range", "100000 s"});
  check_refused(at("[0, 5]\n"), "7:1",
                {"simulate.schedule.V: is missing, and so are gamma_deg and eta_deg",
                 "schedule = \"corridor\""});
  const auto V = [&](const std::string& list) { return at("[0, 5]\nV = " + list + "\n"); };
  check_refused(V("[1]"), "10:5", {"simulate.schedule.V: 1 values for 2 heights", "one for each"});
  check_refused(V("[1, 2, 3]"), "10:5", {"3 values for 2 heights"});
  check_refused(V("[]"), "10:5", {"simulate.schedule.V: an empty array is not a list of numbers"});
  check_refused(V("5"), "10:5", {"5 is not a list of numbers;"});
  check_refused(V("[1, -1]"), "10:9", {"-1 is out of range", "m/s"});
  check_refused(V("[1, nan]"), "10:9", {"nan is not finite"});
  check_refused(V("[1, true]"), "10:9", {"a boolean is not a number"});
  check_refused(at("[0, 5]\ngamma_deg = [0, 181]\n"), "10:17", {"181 is out of range", "degrees"});
  check_refused(at("[0, 5]\neta_deg = [-11, 0]\n"), "10:12", {"-11 is out of range", "-10 to 100"});
}

TEST_CASE("over time nothing is left out") {
  for (const char* key : {"V", "gamma_deg", "eta_deg"}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    std::string left_out = times;
    const std::size_t start = left_out.find("\n" + std::string(key) + " =");
    left_out.erase(start, left_out.find('\n', start + 1) - start);
    check_refused(study(left_out), "7:1",
                  {fmt::format("simulate.schedule.{}: is missing", key), "each of `at`"});
  }
  check_refused(study("[simulate.schedule]\nover = 'time'\nat = [0, 1]\nV = [1, 2, 3]\n"), "10:5",
                {"3 values for 2 times"});
}

TEST_CASE("disturbances that cannot be are refused") {
  const std::string head = "[[simulate.disturbance]]\n", step = head + "kind = 'step'\n",
                    on = step + "on = 'V'\n";
  check_refused(study(head), "7:1", {"simulate.disturbance.kind: is missing", "\"doublet\""});
  check_refused(study(head + "kind = 'ste'\n"), "8:8", {"'ste'", "did you mean 'step'?"});
  check_refused(study(head + "kind = 3\n"), "8:8", {"simulate.disturbance.kind: 3 is not text"});
  check_refused(study(step), "7:1", {"simulate.disturbance.on: is missing"});
  check_refused(study(step + "on = 'gamma'\n"), "9:6", {"'gamma'", "did you mean 'gamma_deg'?"});
  check_refused(study(step + "on = 'eta_deg'\n"), "9:6", {"V, gamma_deg, theta0, a1s_deg"});
  check_refused(study(on), "7:1", {"simulate.disturbance.size: is missing", "m/s"});
  const auto number = [](const std::string& before, const std::string& key) {
    return [=](const std::string& value) { return study(before + key + " = " + value + "\n"); };
  };
  const std::string size = "simulate.disturbance.size";
  check_range(number(on, "size"), "10:8", size, {"0", "-1000"}, {"1001"});
  for (const auto& [key, most, too_much] : {std::array{"gamma_deg", "180", "181"},
                                            {"theta0", "-10", "11"},
                                            {"a1s_deg", "90", "-91"},
                                            {"delta_e_deg", "90", "91"}})
    check_range(number(step + "on = '" + key + "'\n", "size"), "10:8", size, {most}, {too_much});
  check_range(number(on + "size = 1\n", "at"), "11:6", "simulate.disturbance.at", {"0", "89.9"},
              {"-1", "2e5"});
  for (const char* at : {"at = 90\n", "at = 1e5\n"})
    check_refused(study(on + "size = 1\n" + at), "11:6",
                  {"simulate.disturbance.at: ", "is not before the end of the motion, 90 s"});
  check_range(number(on + "size = 1\n", "duration"), "11:12", "simulate.disturbance.duration",
              {"0", "1e-4", "1e5"}, {"-1", "1e-5", "2e5"});
  const std::string doublet = head + "kind = 'doublet'\non = 'V'\nsize = 1\n";
  check_refused(study(doublet), "7:1", {"simulate.disturbance.duration: a doublet needs one"});
  check_refused(study(doublet + "duration = 0\n"), "7:1", {"a number above 0 s"});
}

TEST_CASE("gusts that cannot be are refused") {
  const std::string head = "[[simulate.gust]]\n";
  check_refused(study(head + "size = 1\n"), "7:1",
                {"simulate.gust.kind: is missing", "\"one_minus_cosine\""});
  check_refused(study(head + "kind = 'dreiden'\n"), "8:8",
                {"'dreiden'", "steady, one_minus_cosine, dryden", "did you mean 'dryden'?"});
  check_refused(study(head + "kind = {}\n"), "8:8", {"simulate.gust.kind: a table is not text"});
  const auto of = [&](const std::string& kind) { return head + "kind = '" + kind + "'\n"; };
  check_refused(study(of("steady")), "7:1", {"simulate.gust.size: is missing", "m/s"});
  check_refused(study(of("steady") + "direction = 'down'\n"), "9:13",
                {"simulate.gust.direction: 'down'", "forward, up"});
  const auto number = [](const std::string& before, const std::string& key) {
    return [=](const std::string& value) { return study(before + key + " = " + value + "\n"); };
  };
  for (const char* kind : {"steady", "one_minus_cosine"})
    check_range(number(of(kind), "size"), "9:8", "simulate.gust.size", {"-1000", "0"}, {"1001"});
  check_range(number(of("dryden"), "size"), "9:8", "simulate.gust.size", {"0", "1000"}, {"-1"});
  const std::string cosine = of("one_minus_cosine") + "size = 1\n",
                    dryden = of("dryden") + "size = 1\n";
  check_range(number(cosine, "at"), "10:6", "simulate.gust.at", {"0", "89.9"}, {"-1", "2e5"});
  check_refused(study(cosine + "at = 90\n"), "10:6", {"simulate.gust.at: 90 s is not before"});
  check_range(number(cosine, "duration"), "10:12", "simulate.gust.duration", {"1e-4", "1e5"},
              {"0", "-1", "2e5"});
  check_range(number(dryden, "length"), "10:10", "simulate.gust.length", {"1", "1e6"},
              {"0", "-1", "2e6"});
  check_range(number(dryden, "speed"), "10:9", "simulate.gust.speed", {"0.5", "1000"},
              {"0", "-1", "1001"});
  check_range(number(dryden, "seed"), "10:8", "simulate.gust.seed", {"0", "9007199254740992"},
              {"-1", "1e16", "0.5"});
}

TEST_CASE("a gust's key of another kind is refused, and whose it is said") {
  struct Other {
    const char *kind, *key, *owner;
  };
  for (const auto& [kind, key, owner] : {Other{"steady", "at", "one_minus_cosine"},
                                         {"steady", "duration", "one_minus_cosine"},
                                         {"steady", "length", "dryden"},
                                         {"steady", "speed", "dryden"},
                                         {"steady", "seed", "dryden"},
                                         {"one_minus_cosine", "length", "dryden"},
                                         {"one_minus_cosine", "speed", "dryden"},
                                         {"one_minus_cosine", "seed", "dryden"},
                                         {"dryden", "at", "one_minus_cosine"},
                                         {"dryden", "duration", "one_minus_cosine"}})
    check_refused(
        study(fmt::format("[[simulate.gust]]\nkind = '{}'\nsize = 1\n{} = 1\n", kind, key)), "10:1",
        {fmt::format("unknown key '{}' in [[simulate.gust]]", key),
         fmt::format("it is a key of kind {};", owner)});
}

TEST_CASE("numbers of [montecarlo] that cannot be are refused") {
  struct Bad {
    const char* key;
    std::vector<std::string> inside, outside;
  };
  for (const auto& [key, inside, outside] :
       {Bad{"flights", {"1", "10_000_000"}, {"0", "-1", "1.5", "10_000_001"}},
        {"seed", {"0", "9007199254740992"}, {"-1", "0.5", "1e16"}},
        {"worst", {"0", "1000"}, {"-1", "0.5", "1001"}},
        {"V_within", {"0", "1e6"}, {"-1", "2e6"}},
        {"gamma_within_deg", {"0", "180"}, {"-1", "181"}},
        {"theta_within_deg", {"0", "180"}, {"-1", "181"}}}) {
    const auto& captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const auto with = [&, name = std::string(key)](const std::string& value) {
      return again(name + " = " + value + "\n");
    };
    check_range(with, fmt::format("7:{}", std::string(key).size() + 4),
                fmt::format("montecarlo.{}", key), inside, outside);
  }
  check_refused(again("worst = 0.5\n"), "7:9", {"0.5 is not a whole number"});
}

TEST_CASE("scatter that cannot be is refused") {
  const auto with = [](const std::string& text) {
    return again("[[montecarlo.scatter]]\n" + text);
  };
  check_refused(with("percent = 5\n"), "7:1", {"montecarlo.scatter.key: is missing"});
  check_refused(with("key = 3\n"), "8:7", {"montecarlo.scatter.key: 3 is not text"});
  check_refused(with("key = 'aircraft.mas'\n"), "8:7",
                {"'aircraft.mas' is not known", "gains.K_Lp", "did you mean 'aircraft.mass'?"});
  check_refused(with("key = 'aircraft.cyclic_off'\n"), "8:7", {"'aircraft.cyclic_off_deg'?"});
  check_refused(with("key = 'theta'\n"), "8:7", {"did you mean 'theta_deg'?"});
  check_refused(with("key = 'gustsize'\n"), "8:7", {"did you mean 'gust_size'?"});
  for (const char* own : {"V", "gamma_deg", "eta_deg", "theta0", "h"})
    check_refused(with(fmt::format("key = '{}'\nfrom = 1\nto = 2\n", own)), "8:7",
                  {fmt::format("montecarlo.scatter.key: '{}' is not known", own)});
  check_refused(with(mass), "7:1", {"montecarlo.scatter.percent", "percent, or from and to"});
  check_refused(with(mass + "from = 1\n"), "7:1", {"montecarlo.scatter.to: is missing"});
  check_refused(with(mass + "from = 2\nto = 2\n"), "10:6", {"2 is not above `from`"});
  check_refused(with(mass + "from = 0\nto = 2\n"), "9:8", {"0 is out of range", "kg"});
  check_refused(with(mass + "percent = 5\nto = 2\n"), "10:6", {"cannot be combined with percent;"});
  check_refused(with(mass + "percent = 100\n"), "9:11", {"reaches 0", "out of range"});
  check_refused(with(mass + "percent = nan\n"), "9:11", {"nan is not finite"});
  check_refused(with(mass + "percent = 0\n"), "9:11", {"changes nothing"});
  check_refused(with(mass + "percent = 5\n[[montecarlo.scatter]]\n" + mass + "percent = 5\n"),
                "11:7", {"aircraft.mass is given twice"});
  check_refused(with("key = 'theta_deg'\npercent = 5\n"), "9:11",
                {"montecarlo.scatter.percent", "theta_deg is not", "expected from and to"});
  check_refused(with("key = 'theta_deg'\nfrom = -181\nto = 5\n"), "9:8", {"degrees"});
  check_refused(with("key = 'theta_deg'\nfrom = -1\n"), "7:1", {"montecarlo.scatter.to"});
  check_refused(with("key = 'height'\nfrom = 1\nto = 5\n"), "8:7",
                {"montecarlo.scatter.key: the flight starts on the ground", "start = \"trim\""});
  check_refused(with("key = 'gust_size'\nfrom = 1\nto = 5\n"), "8:7",
                {"montecarlo.scatter.key: there is no gust", "[[simulate.gust]]"});
  check_refused(with("key = 'height'\nfrom = -1\nto = 5\n[simulate]\nstart = 'trim'\n"), "9:8",
                {"montecarlo.scatter.from: -1 is out of range", "0 to 1000000 m"});
  check_refused(with("key = 'gust_size'\nfrom = -1\nto = 5\n[[simulate.gust]]\nkind = 'dryden'\n"
                     "size = 1\n"),
                "9:8", {"-1 is out of range", "0 to 1000 m/s"});
}

// As [gains] refuses the values themselves.
TEST_CASE("scatter between whose ends the control law divides by zero is refused") {
  const auto with = [](const std::string& key, const std::string& ends) {
    return again("[[montecarlo.scatter]]\nkey = '" + key + "'\n" + ends);
  };
  check_refused(with("gains.K_Lp", "from = -2\nto = 1\n"), "8:7",
                {"montecarlo.scatter.key", "1 + K_Lp"});
  CHECK(study_refusal(with("gains.K_Lp", "from = -0.9\nto = 1\n")).empty());
  check_refused(with("gains.K_Ep", "from = -1\nto = 1\n"), "8:7", {"1 + thrust_excess K_Ep"});
  check_refused("[gains]\nK_Ep = -0.5\n" + with("aircraft.thrust_excess", "from = 1\nto = 3\n"),
                "10:7", {"1 + thrust_excess K_Ep"});
  check_refused("[gains]\nschedule_eta_deg = [0, 90]\nK_Ep = [8, -0.5]\n" +
                    with("aircraft.thrust_excess", "from = 1\nto = 3\n"),
                "11:7", {"1 + thrust_excess K_Ep"});
}

// A study with all keys.
static const std::string everything =
    level + hover +
    "[simulate]\nduration = 60\nstart = 'level'\nheight = 10\naxes = 'body'\n"
    "hand_over = 'bumpless'\nanti_windup = 2\nlag = 0.1\ntolerance = 1e-8\nsample = 0.5\n"
    "[simulate.schedule]\nover = 'height'\nat = [0, 20, 120]\nV = [2, 2, 15]\n"
    "gamma_deg = [90, 80, 0]\neta_deg = [90, 80, 0]\n"
    "[simulate.states]\nV = 3\ngamma_deg = 80\ntheta_deg = 5\nq = 0.1\nenergy_integral = 0\n"
    "distribution_integral = 0\n"
    "[simulate.rates]\ntheta0 = 1\na1s_deg = 60\ndelta_e_deg = 60\neta_deg = 5\n"
    "[[simulate.disturbance]]\nkind = 'doublet'\non = 'delta_e_deg'\nat = 5\nsize = 3\n"
    "duration = 1\n" +
    gust +
    "[[simulate.gust]]\nkind = 'one_minus_cosine'\ndirection = 'up'\nsize = 1\nat = 2\n"
    "duration = 3\n"
    "[[simulate.gust]]\nkind = 'dryden'\nsize = 0.5\nlength = 50\nspeed = 15\nseed = 3\n"
    "[montecarlo]\nflights = 100\nseed = 2\nworst = 5\nV_within = 0.3\ngamma_within_deg = 1\n"
    "theta_within_deg = 60\n[[montecarlo.scatter]]\nkey = 'aircraft.mass'\npercent = 15\n"
    "[[montecarlo.scatter]]\nkey = 'gust_size'\nfrom = 0\nto = 2\n"
    "[[montecarlo.scatter]]\nkey = 'height'\nfrom = 5\nto = 20\n"
    "[[montecarlo.scatter]]\nkey = 'theta_deg'\nfrom = -5\nto = 5\n";

TEST_CASE("a [simulate] with bytes changed, lost or doubled loads or is refused") {
  REQUIRE(study_refusal(everything) == "");
  check_damaged(everything, trials(5000));
}

// The value of each key is replaced by each of these in turn, or the key is removed.
TEST_CASE("a [simulate] with a value of another kind at any key loads or is refused" * thorough) {
  check_exchanged(everything, "[simulate]",
                  {"1", "-0.0", "1e308", "5e-324", "nan", "'x'", "''", "true", "2024-01-01", "[]",
                   "[[]]", "[{}]", "{}", "{a = 1}", "['x', 1]"});
}

// The part of the manual about a table.
static std::string manual_of(const std::string& table) {
  std::ifstream in(TILTRIM_SOURCE_DIR "/docs/study.md", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t start = text.find("## [" + table + "]");
  REQUIRE(start != text.npos);
  return text.substr(start, text.find("\n## ", start) - start);
}

TEST_CASE("the manual names every key of [simulate] and [montecarlo], and every word") {
  const auto names = [](const std::string& table, const std::vector<std::string>& keys) {
    const std::string manual = manual_of(table);
    for (const std::string& key : keys) {
      const auto& captured = key;  // clang 14 captures no structured binding
      CAPTURE(captured);
      CHECK(manual.find("`" + key + "`") != manual.npos);
    }
  };
  names("simulate", {"schedule",
                     "duration",
                     "start",
                     "height",
                     "axes",
                     "hand_over",
                     "anti_windup",
                     "lag",
                     "tolerance",
                     "sample",
                     "over",
                     "at",
                     "V",
                     "gamma_deg",
                     "theta_deg",
                     "q",
                     "energy_integral",
                     "distribution_integral",
                     "theta0",
                     "a1s_deg",
                     "delta_e_deg",
                     "eta_deg",
                     "kind",
                     "on",
                     "size",
                     "direction",
                     "length",
                     "speed",
                     "seed",
                     "\"corridor\"",
                     "\"hold\"",
                     "\"reconversion\"",
                     "\"ground\"",
                     "\"trim\"",
                     "\"body\"",
                     "\"wind\"",
                     "\"as_printed\"",
                     "\"bumpless\"",
                     "\"step\"",
                     "\"doublet\"",
                     "\"steady\"",
                     "\"one_minus_cosine\"",
                     "\"dryden\"",
                     "\"forward\"",
                     "\"up\""});
  names("montecarlo",
        {"flights", "seed", "worst", "V_within", "gamma_within_deg", "theta_within_deg", "key",
         "percent", "from", "theta_deg", "height", "gust_size"});
}

}  // namespace simulate_study_test
