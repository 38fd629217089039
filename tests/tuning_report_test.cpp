// Reports of a tuning result: text, JSON, CSV and TOML, from constructed results.
#include "report/tuning_report.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <sstream>

#include "model/lookup.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using nlohmann::json;

namespace tuning_report_test {

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double degree = std::numbers::pi / 180;

SweepRequest point(const std::string& name) {
  SweepRequest request;
  request.name = name;
  return request;
}

TuneProblem three_points() {
  TuneProblem p;
  p.points = {point("climb"), point("übergang η"), point("level")};
  p.gains = {{"gains.K_Lp", 0.02, 10}, {"gains.k_da", 0.02, 10}, {"aircraft.cyclic_off", 0, 1}};
  p.limits = {{Measure::damping, 0.4},
              {Measure::frequency, 20.0},
              {Measure::phase_margin_deg, 45.0, "theta0"},
              {Measure::half_time, 4.0, "phugoid"}};
  return p;
}

// One value for each requirement, the goal first.
void add(TuningReport& report, const Achieved::Place& place, const std::vector<double>& values) {
  REQUIRE(values.size() == 1 + report.problem.limits.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Requirement& r = i == 0 ? report.problem.goal : report.problem.limits[i - 1];
    const bool decides = r.measure == Measure::decay || r.measure == Measure::damping;
    const std::complex<double> eigenvalue =
        decides ? std::complex(-0.5, 1.0 / 3) : std::complex(NaN, NaN);
    const double decisive = i == 0 ? report.result.goal : r.limit;
    report.result.achieved.push_back(
        {place, i, r, values[i], eigenvalue, std::abs(values[i] - decisive) < 1e-4});
  }
}

TuningReport tuned() {
  TuningReport report{.problem = three_points()};
  TuneResult& r = report.result;
  r.status = TuneStatus::tuned;
  r.gains = Eigen::Vector3d(0.1 + 0.2, 4.0, 25 * degree);
  r.goal = 0.3372;
  r.coalescing = true;
  r.evaluations = 4000;
  r.out_of_evaluations = true;
  const std::string heavy = "mass +15 %, inertia_yy -15 %, air_density +10 %, CM_de -15 %";
  add(report, {0, ""}, {0.412, 0.55, 12.25, 61.5, NaN});
  add(report, {0, heavy}, {0.3372, 0.48, 12.5, 58.0, NaN});
  add(report, {0, "mass -15 %"}, {0.39, 0.53, 13.0, infinity, NaN});
  add(report, {1, ""}, {0.377, 0.45, 18.75, 50.0, NaN});
  add(report, {1, heavy}, {0.36, 0.4, 20.0, 47.25, NaN});
  add(report, {2, ""}, {0.51, 0.4, 8.0, 55.0, 2.5});
  add(report, {2, heavy}, {0.48, 0.42, 8.5, 52.0, 3.0});
  r.effects = {{"gains.K_Lp", r.gains[0], {-0.21, 0.35, 0.5, 1.5, NaN}, 0.325, 0.331, true, false},
               {"aircraft.cyclic_off", r.gains[2], {0.02, 0, 0, 0, 0}, 0.337, 0.337, true, true},
               {"gains.k_da", r.gains[1], {}, NaN, 0.3355, false, true}};
  report.second_algorithm = "crs2";
  report.second = r;
  report.second->goal = 0.335;
  report.second->gains[1] = 5.0;
  report.robustness = Robustness{.samples = 10'000,
                                 .met = 9812,
                                 .no_trim = 12,
                                 .unstable = 3,
                                 .fraction = 0.9812,
                                 .lower = 0.9783,
                                 .upper = 0.9838,
                                 .worst_goal = -0.0125,
                                 .worst = "level, mass +14.2 %"};
  report.front_limit = {Measure::damping};
  for (const double limit : {0.3, 0.4, 0.9}) report.front.push_back({limit, r});
  report.front[0].result.goal = 0.362;
  report.front[2].result = {};
  report.front[2].result.status = TuneStatus::no_trim;
  return report;
}

TuningReport scheduled() {
  TuningReport report{.problem = three_points()};
  report.problem.gains.resize(2);
  report.problem.schedule = {0.0, 30 * degree, std::numbers::pi / 2};
  report.problem.schedule_over = "eta";
  report.result.status = TuneStatus::tuned;
  report.result.goal = 0.25;
  report.result.gains.resize(6);
  report.result.gains << 0.5, 0.1, 1.0 / 3, 4.0, 1e-5, 2e4;
  return report;
}

const std::string one_condition =
    "[[condition]]\nname = \"level\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";

// As pasted in front of a study's conditions.
Study pasted(const TuningReport& report) {
  return parse_study(tuning_toml(report) + one_condition, "tuning_report_test.toml");
}

double gain_of(const Study& study, const std::string& name) {
  const Signals signals = gain_signals();
  Gains gains = study.vehicle.gains;
  return gain_value(gains, std::size_t(index_of(signals, name, "gain")));
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::size_t characters(const std::string& text) {
  return std::size_t(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the text as a whole") {
  const std::string text = tuning_text(tuned(), {});
  CHECK(text ==
        R"(tuned: worst decay 0.3372 1/s over 3 points with scatter (7 places); all limits
met

The gains, to paste into the study:

    [gains]
    K_Lp = 0.30000000000000004
    k_da = 4.0

    [aircraft]
    cyclic_off_deg = 25.0

Requirements, where they are worst, and the reserve in percent of the limit:
  requirement               worst unit  reserve active where
                                              %
  decay, the goal          0.3372 1/s         - *      climb, mass +15 %,
                                                       inertia_yy -15 %,
                                                       air_density +10 %, CM_de
                                                       -15 %
  damping ≥ 0.4               0.4           0.0 *      übergang η, mass +15 %,
                                                       inertia_yy -15 %,
                                                       air_density +10 %, CM_de
                                                       -15 %
  frequency ≤ 20 rad/s         20 rad/s     0.0 *      übergang η, mass +15 %,
                                                       inertia_yy -15 %,
                                                       air_density +10 %, CM_de
                                                       -15 %
  phase margin of theta0 ≥  47.25 °         5.0        übergang η, mass +15 %,
  45°                                                  inertia_yy -15 %,
                                                       air_density +10 %, CM_de
                                                       -15 %
  half time of phugoid ≤ 4      3 s        33.3        level, mass +15 %,
  s                                                    inertia_yy -15 %,
                                                       air_density +10 %, CM_de
                                                       -15 %

At each operating point (* limits the result):
  point                   decay   damping    frequency   phase margin of theta0
                      goal, 1/s     ≥ 0.4   ≤ 20 rad/s                    ≥ 45°
  climb                   0.412      0.55        12.25                     61.5
  scattered, worst       0.3372*     0.48           13                       58
  of 2
  übergang η              0.377      0.45        18.75                       50
  scattered, worst         0.36       0.4*          20*                   47.25
  of 1
  level                    0.51       0.4*           8                       55
  scattered, worst         0.48      0.42          8.5                       52
  of 1

  point                        decay   half time of phugoid
                           goal, 1/s                  ≤ 4 s
  climb                        0.412                      -
    scattered, worst of 2     0.3372*                     -
  übergang η                   0.377                      -
    scattered, worst of 1       0.36                      -
  level                         0.51                    2.5
    scattered, worst of 1       0.48                      3

Effect of each gain: the worst case with 10 % less and 10 % more of it, and the
slope per 10 % increase:
  gain                 value  unit       goal  limits       goal  limits   decay
                                    10 % less          10 % more           slope
  K_Lp                   0.3            0.325  met         0.331  missed  -0.021
  aircraft.cyclic_off     25  °         0.337  met         0.337  met     +0.002
  k_da                     4  s             -  missed     0.3355  met          -

  gain                 damping  frequency  phase margin of theta0
                         slope      slope                   slope
  K_Lp                  +0.035      +0.05                   +0.15
  aircraft.cyclic_off       +0         +0                      +0
  k_da                       -          -                       -

  gain                 half time of phugoid
                                      slope
  K_Lp                                    -
  aircraft.cyclic_off                    +0
  k_da                                    -
  Two of the critical eigenvalues coincide: slopes of single eigenvalues are
  unbounded there; the columns with 10 % less and more are evaluated exactly.

The search ended before three starts agreed; a larger budget may find better
gains.

Second search by crs2: tuned, worst decay 0.335 1/s, 0.0022 1/s worse; the gain
that differs most is k_da, by 20 % (4,000 candidates).

9,812 of 10,000 random samples meet all limits: 98.12 %, 95 % interval 97.83 to
98.38 %; 12 without trim, 3 unstable; worst decay -0.0125 1/s at level, mass
+14.2 %.

Worst corner of the scatter: decay 0.3372 1/s at climb, mass +15 %, inertia_yy
-15 %, air_density +10 %, CM_de -15 %.

The best decay where damping is limited:
  damping ≥   decay  status
                1/s
        0.3   0.362  tuned
        0.4  0.3372  tuned
        0.9       -  no trim

4,000 candidates (the limit); global multistart, local bfgs, seed 1.
)");
  for (const std::string& line : lines_of(text)) CHECK_MESSAGE(characters(line) <= 100, line);
}

TEST_CASE("colour for the verdict, what is missed and what is doubtful") {
  TuningReport report = tuned();
  report.result.achieved[1].value = 0.3;  // damping, of 0.4 asked
  const std::string text = tuning_text(report, {.colour = true});
  CHECK(text.starts_with("\033[32mtuned\033[0m: "));
  CHECK(has(text, "\033[31m  -25.0\033[0m"));
  CHECK(has(text, "\033[31m    0.3 \033[0m"));
  CHECK(has(text, "\033[33mmissed\033[0m"));
  CHECK(has(text, "\033[31mno trim\033[0m"));
}

TEST_CASE("every status has its own first line") {
  TuningReport report = tuned();
  const auto first = [&](TuneStatus status, const std::string& message) {
    report.result.status = status;
    report.result.message = message;
    return lines_of(tuning_text(report, {.width = 200})).front();
  };
  CHECK(first(TuneStatus::limits_unmet, "damping of 0.4 is not met at 'climb'") ==
        "limits not met: damping of 0.4 is not met at 'climb'");
  CHECK(first(TuneStatus::unstable, "at 'climb' 0.1 1/s") == "unstable: at 'climb' 0.1 1/s");
  CHECK(first(TuneStatus::no_trim, "") == "no trim");
  report.result.interrupted = true;
  CHECK(first(TuneStatus::no_trim, "no equilibrium at 'climb'") ==
        "no trim: no equilibrium at 'climb' (interrupted)");
  report.result.interrupted = false;
  report.result.out_of_time = true;
  report.problem.limits.clear();
  report.result.achieved.clear();
  report.second.reset();
  CHECK(first(TuneStatus::tuned, "") ==
        "tuned: worst decay 0.3372 1/s over 3 points; no limits required (out of time: the best "
        "so far)");
}

TEST_CASE("no trim at any candidate: nothing but that is said") {
  TuningReport report;
  report.problem = three_points();
  report.result.message = "no equilibrium at 'climb': theta0 would have to be 1.25";
  report.result.goal = NaN;
  report.result.evaluations = 12;
  CHECK(tuning_text(report, {}) ==
        "no trim: no equilibrium at 'climb': theta0 would have to be 1.25\n"
        "\n"
        "12 candidates; global multistart, local bfgs, seed 1.\n");
  CHECK(tuning_toml(report).empty());
  CHECK(tuning_sheet(report).rows.empty());
  const json j = json::parse(tuning_json(report));
  CHECK(j["status"] == "no_trim");
  CHECK(j["gains"].is_null());
  CHECK(j["goal"]["value"].is_null());
  CHECK(j["goal"]["point"].is_null());
  CHECK(j["achieved"].empty());
  CHECK(j["second"].is_null());
  CHECK(j["robustness"].is_null());
  CHECK(j["front_limit"].is_null());
  CHECK(j["limits"].size() == 4);
}

TEST_CASE("JSON gives back every number, null for what is not finite") {
  const TuningReport report = tuned();
  const TuneResult& r = report.result;
  const json j = json::parse(tuning_json(report));
  CHECK(j["status"] == "tuned");
  CHECK(j["goal"]["measure"] == "decay");
  CHECK(j["goal"]["value"].get<double>() == r.goal);
  CHECK(j["goal"]["point"] == "climb");
  CHECK(j["goal"]["limit"].is_null());
  CHECK(j["gains"]["gains.K_Lp"].get<double>() == 0.1 + 0.2);
  CHECK(j["gains"]["aircraft.cyclic_off"].get<double>() == 25 * degree);
  CHECK(j["toml"] == tuning_toml(report));
  CHECK(j["limits"][2]["of"] == "theta0");
  CHECK(j["limits"][2]["unit"] == "degrees");
  CHECK(j["limits"][2]["point"] == "übergang η");
  CHECK_NEAR(j["limits"][2]["reserve"].get<double>(), 2.25 / 45, 1e-15);

  REQUIRE(j["achieved"].size() == r.achieved.size());
  for (std::size_t i = 0; i < r.achieved.size(); ++i) {
    const json& a = j["achieved"][i];
    CHECK(a["scatter"] == r.achieved[i].place.scatter);
    CHECK(a["active"] == r.achieved[i].active);
    if (std::isfinite(r.achieved[i].value))
      CHECK(a["value"].get<double>() == r.achieved[i].value);
    else
      CHECK(a["value"].is_null());
    if (std::isnan(r.achieved[i].eigenvalue.real()))
      CHECK(a["eigenvalue"].is_null());
    else
      CHECK(a["eigenvalue"]["im"].get<double>() == 1.0 / 3);
  }
  CHECK(j["effects"][0]["slopes"][0].get<double>() == -0.21);
  CHECK(j["effects"][0]["slopes"][4].is_null());
  CHECK(j["effects"][0]["limits_more"] == false);
  CHECK(j["coalescing"] == true);
  CHECK(j["second"]["global"] == "crs2");
  CHECK(j["second"]["goal"].get<double>() == 0.335);
  CHECK(j["second"]["gains"]["gains.k_da"].get<double>() == 5.0);
  CHECK(j["robustness"]["met"] == 9812);
  CHECK(j["robustness"]["lower"].get<double>() == 0.9783);
  CHECK(j["front_limit"]["measure"] == "damping");
  CHECK(j["front"][0]["goal"].get<double>() == 0.362);
  CHECK(j["front"][2]["status"] == "no_trim");
  CHECK(j["front"][2]["goal"].is_null());
  CHECK(j["evaluations"] == 4000);
  CHECK(j["out_of_evaluations"] == true);
  CHECK(j["global"] == "multistart");
  CHECK(j["local"] == "bfgs");
  CHECK(j["seed"] == 1);
}

TEST_CASE("names stand as they are in JSON and CSV") {
  TuningReport report = tuned();
  report.problem.points[0].name = "a \"b\",\\c";
  CHECK(json::parse(tuning_json(report))["achieved"][0]["point"] == "a \"b\",\\c");
  const std::vector<std::string> csv = lines_of(as_csv(tuning_sheet(report)));
  REQUIRE(csv.size() == 1 + report.result.achieved.size());
  CHECK(csv[0] ==
        "point,scatter,measure,of,unit,limit,value,reserve,eigenvalue_re,eigenvalue_im,active");
  CHECK(csv[1] ==
        "\"a \"\"b\"\",\\c\",,decay,,1/s,,0.41199999999999998,,-0.5,0.33333333333333331,0");
  CHECK(csv[5] == "\"a \"\"b\"\",\\c\",,half_time,phugoid,s,4,,,,,0");
  CHECK(csv[14] == "\"a \"\"b\"\",\\c\",mass -15 %,phase_margin_deg,theta0,degrees,45,inf,inf,,,0");
  CHECK(csv[23].starts_with("übergang η,\"mass +15 %, inertia_yy -15 %"));
}

TEST_CASE("TOML is read by a study as the same bits" * thorough) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(-6.0, 5.0);
  TuningReport report = tuned();
  for (int trial = 0; trial < 1000; ++trial) {
    const double K_Lp = std::pow(10.0, exponent(random)), k_da = -std::pow(10.0, exponent(random));
    const double off = std::pow(10.0, exponent(random) / 12);  // rad, to 150°
    report.result.gains = Eigen::Vector3d(K_Lp, k_da, off);
    const Study study = pasted(report);
    CHECK(gain_of(study, "gains.K_Lp") == K_Lp);
    CHECK(gain_of(study, "gains.k_da") == k_da);
    // Not every angle in radians is that of some number in degrees.
    CHECK_NEAR(study.vehicle.aircraft.cyclic_off, off,
               std::numeric_limits<double>::epsilon() * off);
  }
  report.result.gains = Eigen::Vector3d(1000.0, 1e-5, 25 * degree);
  CHECK(tuning_toml(report) ==
        "[gains]\nK_Lp = 1000.0\nk_da = 1e-05\n\n[aircraft]\ncyclic_off_deg = 25.0\n");
  CHECK(gain_of(pasted(report), "gains.k_da") == 1e-5);
  report.result.gains[1] = NaN;
  CHECK(tuning_toml(report).empty());
}

TEST_CASE("what no study has is a comment, whatever its name") {
  TuningReport report = tuned();
  report.problem.gains[1].name = "lead\ntime";
  CHECK(tuning_toml(report) ==
        "[gains]\nK_Lp = 0.30000000000000004\n\n[aircraft]\ncyclic_off_deg = 25.0\n"
        "# lead?time = 4.0, which studies do not have\n");
  CHECK(pasted(report).conditions.size() == 1);
}

TEST_CASE("a schedule is the study's own") {
  const TuningReport report = scheduled();
  CHECK(tuning_toml(report) ==
        "[gains]\n"
        "schedule_eta_deg = [0.0, 30.0, 90.0]\n"
        "K_Lp = [0.5, 0.1, 0.3333333333333333]\n"
        "k_da = [4.0, 1e-05, 20000.0]\n");
  const Study study = pasted(report);
  REQUIRE(study.schedule.gains.size() == 3);
  CHECK(study.schedule.eta == report.problem.schedule);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(study.schedule.gains[k].K_Lp == report.result.gains[Eigen::Index(k)]);
    CHECK(study.schedule.gains[k].k_da == report.result.gains[Eigen::Index(3 + k)]);
    CHECK(study.schedule.gains[k].k_V == Gains{}.k_V);
  }

  const json gains = json::parse(tuning_json(report))["gains"];
  CHECK(gains["eta"].get<std::vector<double>>() == report.problem.schedule);
  CHECK(gains["gains.K_Lp"][2].get<double>() == 1.0 / 3);
  CHECK(gains["gains.k_da"][0].get<double>() == 4.0);
}

TEST_CASE("the second answer names the place of the gain that differs most") {
  TuningReport report = scheduled();
  report.second_algorithm = "isres";
  report.second = report.result;
  CHECK(has(tuning_text(report, {}), "the same; the same gains (0"));
  report.second->gains[4] = 0.0;
  CHECK(has(tuning_text(report, {.width = 200}), "is k_da at eta = 30 deg, by 100 % "));
  report.second->status = TuneStatus::no_trim;
  report.second->message = "no equilibrium at 'level'";
  CHECK(
      has(tuning_text(report, {}), "Second search by isres: no trim, no equilibrium at 'level'."));
}

TEST_CASE("random samples: none, one of very many, interrupted") {
  TuningReport report = tuned();
  report.robustness = Robustness{};
  CHECK(has(tuning_text(report, {}), "No random samples were tried."));
  report.robustness = Robustness{.samples = 1'000'000,
                                 .met = 999'999,
                                 .fraction = 0.999999,
                                 .lower = 0.99999,
                                 .upper = 1,
                                 .worst = "level"};
  CHECK(has(tuning_text(report, {}), "999,999 of 1,000,000 random samples meet all limits: "));
  CHECK(
      has(tuning_text(report, {.width = 400}), " 99.9999 %, 95 % interval 99.9990 to 100.0000 %"));
  report.robustness->interrupted = true;
  CHECK(has(tuning_text(report, {.width = 400}), "(interrupted: fewer samples than requested)."));
}

TEST_CASE("stability that is asked because nothing else asks for it has its row and column") {
  TuningReport report;
  report.problem = three_points();
  report.problem.goal = {Measure::disk_margin};
  report.problem.limits.clear();
  report.result.status = TuneStatus::tuned;
  report.result.goal = 0.5;
  for (std::size_t p = 0; p < 3; ++p) {
    report.result.achieved.push_back(
        {{p, ""}, 0, {Measure::disk_margin}, 0.5, {std::nan(""), 0}, p == 0});
    report.result.achieved.push_back({{p, ""}, 1, {Measure::decay, 0.0}, 0.25, {-0.25, 0}, false});
  }
  const std::string text = tuning_text(report, {});
  CHECK(has(text, "over 3 points"));
  CHECK(has(text, "decay ≥ 0"));
  const json limits = json::parse(tuning_json(report))["limits"];
  REQUIRE(limits.size() == 1);
  CHECK(limits[0]["measure"] == "decay");
  CHECK(limits[0]["value"] == 0.25);
}

TEST_CASE("of many points forty rows are shown and the rest counted") {
  TuningReport report;
  report.problem = three_points();
  report.problem.limits.clear();
  report.problem.points.clear();
  report.result.status = TuneStatus::tuned;
  for (std::size_t p = 0; p < 45; ++p) {
    report.problem.points.push_back(point(fmt::format("point {}", p)));
    add(report, {p, ""}, {1.0 + double(p)});
    add(report, {p, "mass +15 %"}, {0.5 + double(p)});
  }
  const std::string text = tuning_text(report, {});
  CHECK(has(text, "  point 19                        20\n    scattered, worst of 1       19.5\n"));
  CHECK(!has(text, "point 20"));
  CHECK(has(text, "  ... and 50 more (JSON lists all)\n"));
}

}  // namespace tuning_report_test
