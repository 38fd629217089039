#include "study/study.hpp"

#include <unistd.h>

#include <clocale>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <numbers>
#include <set>

#include "linearize/modes.hpp"
#include "model/time_limit.hpp"
#include "study/analyses.hpp"
#include "study/angle_remarks.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"
#include "tests/study_text.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

using namespace tiltrim;
namespace fs = std::filesystem;

namespace study_test {

static const fs::path source = TILTRIM_SOURCE_DIR;
static constexpr double degree = std::numbers::pi / 180;

static const std::string one_condition =
    "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n";

static Study parsed(const std::string& text) {
  return parse_study(text, source / "studies/t.toml");
}

static std::string polar_text(const std::string& rows) {
  return "# a test polar\nalpha_deg,CL,CD,CM\n" + rows;
}

static const std::string flat_rows = "-180,0,1,0\n-90,0,1,0\n0,0,1,0\n90,0,1,0\n180,0,1,0\n";

TEST_CASE("what a study does not say keeps its default") {
  const Study study = parsed(one_condition);
  const Vehicle reference = reference_vehicle();
  CHECK(airframe_parameters(study.vehicle) == airframe_parameters(reference));
  const Command command{15, 0, 0};
  CHECK(closed_loop_parameters(study.vehicle, command) ==
        closed_loop_parameters(reference, command));
  CHECK(study.vehicle.limits.a1s.lower == -0.35);
  CHECK(study.vehicle.limits.theta.upper == 1.3);
  CHECK(study.vehicle.equations == Equations::consistent);
  CHECK(study.polar_name == "naca8h12_re150k.csv");
  REQUIRE(study.vehicle.polar);
  CHECK(study.vehicle.polar->at(0.3).CL == reference.polar->at(0.3).CL);
  REQUIRE(study.conditions.size() == 1);
  CHECK(formulation_of(study.conditions[0]) == "closed_loop");
}

// Every number gets a unique value, so that none can be confused with another.
TEST_CASE("every number of the aircraft and the gains is read into its own place") {
  std::string text = "[aircraft]\n";
  const Signals aircraft = aircraft_signals();
  const Signals gains = gain_signals();
  const auto value = [](std::size_t i) { return 1.5 + static_cast<double>(i); };
  const auto in_degrees = [](const std::string& name) { return name.find("cyclic") != name.npos; };
  for (std::size_t i = 0; i < aircraft.size(); ++i) {
    const std::string key = aircraft[i].name.substr(std::string("aircraft.").size());
    text += fmt::format("{}{} = {}\n", key, in_degrees(key) ? "_deg" : "", value(i));
  }
  text += "[gains]\n";
  for (std::size_t i = 0; i < gains.size(); ++i)
    text += fmt::format("{} = -{}\n", gains[i].name.substr(6), value(i));

  Vehicle vehicle = parsed(text + one_condition).vehicle;
  for (std::size_t i = 0; i < aircraft.size(); ++i) {
    CAPTURE(aircraft[i].name);
    CHECK(aircraft_value(vehicle.aircraft, i) ==
          (in_degrees(aircraft[i].name) ? value(i) * degree : value(i)));
  }
  for (std::size_t i = 0; i < gains.size(); ++i) {
    CAPTURE(gains[i].name);
    CHECK(gain_value(vehicle.gains, i) == -value(i));
  }
}

TEST_CASE("a time limit of the trims, in any kind of study") {
  const std::string one = "[[condition]]\nname = 'a'\n";
  const std::string own = "[model]\nname = 'm'\n[[model.state]]\nname = 'x'\nrate = '-x'\n";
  for (const std::string& rest : {one + "V = 15.0\ngamma_deg = 0\neta_deg = 0\n", own + one}) {
    CHECK(parse_study("time_limit = 2.5\n" + rest, "s.toml").time_limit == 2.5);
    CHECK(parse_study(rest, "s.toml").time_limit == unlimited);
    for (const char* const wrong : {"0", "-1", "inf", "'2 s'"})
      CHECK_THROWS_WITH_AS(
          (void)parse_study(fmt::format("time_limit = {}\n", wrong) + rest, "s.toml"),
          doctest::Contains("s.toml:1:14: time_limit: "), StudyError);
  }
}

TEST_CASE("limits are read, angles in degrees") {
  const Limits limits = parsed(
                            "limits.theta0 = [-1, 0.5]\nlimits.a1s_deg = [-20, 21]\n"
                            "limits.delta_e_deg = [-30, 31]\nlimits.theta_deg = [-60, 61]\n" +
                            one_condition)
                            .vehicle.limits;
  CHECK(limits.theta0.lower == -1);
  CHECK(limits.theta0.upper == 0.5);
  CHECK(limits.a1s.lower == -20 * degree);
  CHECK(limits.a1s.upper == 21 * degree);
  CHECK(limits.delta_e.lower == -30 * degree);
  CHECK(limits.delta_e.upper == 31 * degree);
  CHECK(limits.theta.lower == -60 * degree);
  CHECK(limits.theta.upper == 61 * degree);
}

TEST_CASE("the reference angle of 60 degrees is the default's pi/3 to the last bit") {
  CHECK(parsed("aircraft.cyclic_off_deg = 60\n" + one_condition).vehicle.aircraft.cyclic_off ==
        Aircraft{}.cyclic_off);
}

TEST_CASE("a closed-loop condition") {
  const Study study = parsed(
      "equations = 'printed'\n[[condition]]\nname = 'a'\nformulation = 'closed_loop'\n"
      "V = 2.5\ngamma_deg = -90\neta_deg = 45\n");
  CHECK(study.vehicle.equations == Equations::printed);
  const Condition& a = study.conditions.at(0);
  CHECK(a.name == "a");
  CHECK(a.command()->V == 2.5);
  CHECK(a.command()->gamma == -90 * degree);
  CHECK(a.command()->eta == 45 * degree);
}

TEST_CASE("an airframe condition: fixed, bounded, free, held rates, objective") {
  const Study study = parsed(R"(
[[condition]]
name = "b"
formulation = "airframe"
V = 12
gamma_deg = [-5, 5]
alpha_deg = 3
theta_deg = "free"
q = 0.25
eta_deg = [0.0, 90.0]
theta0 = [0.1, 0.9]
a1s_deg = 0
delta_e_deg = [-10, 10]
V_dot = 0.1
gamma_dot = 0.2
theta_dot = 0.3
q_dot = 0.4
objective = [{signal = "theta0"}, {signal = "a1s", scale = 0.35, reference = 0.1},
             {signal = "theta_deg", scale = 10, reference = 5}, {signal = "eta_deg"}]
)");
  REQUIRE(formulation_of(study.conditions.at(0)) == "airframe");
  const AirframeCondition& b = *study.conditions.at(0).airframe();
  const auto is = [&](const char* signal, double lower, double upper) {
    CAPTURE(signal);
    REQUIRE(b.values.contains(signal));
    CHECK(b.values.at(signal).lower == lower);
    CHECK(b.values.at(signal).upper == upper);
  };
  is("V", 12, 12);
  is("gamma", -5 * degree, 5 * degree);
  is("alpha", 3 * degree, 3 * degree);
  is("theta", Range{}.lower, Range{}.upper);
  is("q", 0.25, 0.25);
  is("eta", 0, 90 * degree);
  is("theta0", 0.1, 0.9);
  is("a1s", 0, 0);
  is("delta_e", -10 * degree, 10 * degree);
  CHECK(b.values.size() == 9);
  CHECK(b.rates ==
        std::map<std::string, double>{{"V", 0.1}, {"gamma", 0.2}, {"theta", 0.3}, {"q", 0.4}});
  REQUIRE(b.effort.size() == 4);
  CHECK(b.effort[0].signal == "theta0");
  CHECK(b.effort[0].scale == 1);
  CHECK(b.effort[0].reference == 0);
  CHECK(b.effort[1].signal == "a1s");
  CHECK(b.effort[1].scale == 0.35);
  CHECK(b.effort[1].reference == 0.1);
  CHECK(b.effort[2].signal == "theta");
  CHECK(b.effort[2].scale == 10 * degree);
  CHECK(b.effort[2].reference == 5 * degree);
  CHECK(b.effort[3].scale == degree);
}

TEST_CASE("free: without bounds, but an airspeed is not negative and a tilt one of the nacelle's") {
  const Study study = parsed(
      "[[condition]]\nname = 'a'\nformulation = 'airframe'\nV = 'free'\neta_deg = 'free'\n"
      "gamma_deg = 'free'\ntheta0 = 'free'\n");
  const auto& values = study.conditions[0].airframe()->values;
  CHECK(values.at("V").lower == 0);
  CHECK(values.at("V").upper == Range{}.upper);
  CHECK(values.at("eta").lower == -10 * degree);
  CHECK(values.at("eta").upper == 100 * degree);
  CHECK(values.at("gamma").lower == Range{}.lower);
  CHECK(values.at("theta0").upper == Range{}.upper);
}

TEST_CASE("a table condition") {
  const Study study = parsed(
      "[[condition]]\nname = 'c'\nformulation = 'table'\ngamma_deg = -90\nalpha_deg = -45\n"
      "eta_deg = 45\nCL = 1.3229\nCD = 1.6217\nCM = -0.1707\nk = 0.0424933\n");
  REQUIRE(formulation_of(study.conditions.at(0)) == "table");
  const TableCondition& c = *study.conditions.at(0).table();
  CHECK(c.gamma == -90 * degree);
  CHECK(c.alpha == -45 * degree);
  CHECK(c.eta == 45 * degree);
  CHECK(c.CL == 1.3229);
  CHECK(c.CD == 1.6217);
  CHECK(c.CM == -0.1707);
  CHECK(c.k == 0.0424933);
}

TEST_CASE("the shipped studies load") {
  for (const char* name : {"paper", "airframe", "printed", "stall"}) {
    CAPTURE(name);
    const Study study = load_study(source / "studies" / fmt::format("{}.toml", name));
    CHECK(study.conditions.size() >= 3);
    CHECK(study.vehicle.polar);
  }
  const Study paper = load_study(source / "studies/paper.toml");
  CHECK(closed_loop_parameters(paper.vehicle, {}) ==
        closed_loop_parameters(reference_vehicle(), {}));
  CHECK(paper.conditions[1].name == "transition");
  CHECK(paper.conditions[1].command()->V == 6);
  CHECK(paper.conditions[1].command()->gamma == 45 * degree);
  CHECK_FALSE(paper.follow);
  CHECK_FALSE(paper.envelope);
  const Study stall = load_study(source / "studies/stall.toml");
  REQUIRE(stall.follow);
  CHECK(stall.follow->parameter.name == "V");
  CHECK(stall.follow->to == 5);
}

TEST_CASE("what is to be followed: any number, in its own unit") {
  const auto followed = [](const std::string& parameter, const std::string& to) {
    return parsed("[follow]\nparameter = '" + parameter + "'\nto = " + to + "\n" + one_condition)
        .follow.value();
  };
  CHECK(followed("V", "5").to == 5);
  CHECK(followed("gamma_deg", "-30").to == -30 * degree);
  CHECK(followed("gamma_deg", "-30").parameter.signal == "gamma");
  CHECK(followed("aircraft.mass", "4.5").to == 4.5);
  CHECK(followed("aircraft.cyclic_off_deg", "45").to == 45 * degree);
  CHECK(followed("gains.K_Lp", "1").parameter.signal == "gains.K_Lp");
  for (const Key& key : study_keys()) {
    CAPTURE(key.name);
    CHECK(followed(key.name, "0.5").parameter.name == key.name);
    CHECK_NEAR(key.in_study(key.in_si(0.5)), 0.5, 1e-16);
  }
}

TEST_CASE("an envelope: what is not said keeps its default") {
  const auto read = [](const std::string& text) {
    return parsed("[envelope]\n" + text + one_condition).envelope.value();
  };
  const EnvelopeTable corridor = read("over = 'eta_deg'\n");
  CHECK(corridor.over.name == "eta_deg");
  CHECK(corridor.range.lower == 0);
  CHECK(corridor.range.upper == 90 * degree);
  CHECK(corridor.along_range.lower == 1);
  CHECK(corridor.along_range.upper == 30);
  CHECK(corridor.count == 100);
  CHECK(read("").over.name == "eta_deg");
  const EnvelopeTable path =
      read("over = 'gamma_deg'\nV = [4, 12]\ngamma_deg = [-20, 10]\ncount = 60\n");
  CHECK(path.over.name == "gamma_deg");
  CHECK(path.along_range.lower == 4);
  CHECK(path.along_range.upper == 12);
  CHECK(path.range.lower == -20 * degree);
  CHECK(path.range.upper == 10 * degree);
  CHECK(path.count == 60);
  CHECK(read("over = 'gamma_deg'\n").range.upper == 30 * degree);
}

TEST_CASE("the manual's examples load, and it names every key") {
  const std::string manual = contents(source / "docs/study.md");
  const std::string fence = "```toml\n";
  int examples = 0;
  for (std::size_t at = manual.find(fence); at != manual.npos; at = manual.find(fence, at)) {
    at += fence.size();
    const std::string example = manual.substr(at, manual.find("```", at) - at);
    CAPTURE(example);
    CHECK(study_refusal(example) == "");
    ++examples;
  }
  CHECK(examples >= 4);
  std::vector<std::string> keys = names(aircraft_signals());
  for (const std::string& gain : names(gain_signals())) keys.push_back(gain);
  for (const std::string& key : keys) {
    CAPTURE(key);
    CHECK(manual.find("| `" + key.substr(key.find('.') + 1)) != manual.npos);
  }
}

TEST_CASE("line ends, a byte-order mark and the locale change nothing") {
  const std::string text = contents(source / "studies/paper.toml");
  const Eigen::VectorXd expected =
      closed_loop_parameters(parsed(text).vehicle, *parsed(text).conditions[1].command());
  std::string crlf;
  for (char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const auto same = [&](const std::string& t) {
    const Study study = parsed(t);
    return closed_loop_parameters(study.vehicle, *study.conditions[1].command()) == expected;
  };
  CHECK(same(crlf));
  CHECK(same("\xEF\xBB\xBF" + text));
  CHECK(same(text.substr(0, text.size() - 1)));
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* comma : {"de_DE.UTF-8", "fr_FR.UTF-8"})  // where the machine has them
    if (std::setlocale(LC_ALL, comma)) CHECK(same(text));
  std::setlocale(LC_ALL, before.c_str());
}

TEST_CASE("gains scheduled over the tilt: linear between, constant beyond, moved by every axis") {
  const std::string schedule =
      "[gains]\nschedule_eta_deg = [30, 60, 90]\nK_Lp = [1, 2, 4]\nk_de = 5\n";
  const Study study = parsed(schedule + one_condition +
                             "[[condition]]\nname = 'half'\nV = 6\ngamma_deg = 45\neta_deg = 45\n"
                             "[[sweep.axis]]\nkey = 'h'\nfrom = 0\nto = 120\ncount = 5\n");
  CHECK(vehicle_at(study, study.conditions[0]).gains.K_Lp == 1.0);  // below the first tilt
  CHECK(vehicle_at(study, study.conditions[1]).gains.K_Lp == doctest::Approx(1.5).epsilon(1e-15));
  CHECK(vehicle_at(study, study.conditions[1]).gains.k_de == 5.0);
  CHECK(vehicle_at(study, study.conditions[1]).gains.K_Li == Gains{}.K_Li);
  CHECK(gains_at(study.schedule, 2.0).K_Lp == 4.0);
  const SweepAxis& axis = study.sweep->axes[0];
  const auto tilt = std::ranges::find(axis.columns, "eta", &SweepAxis::Column::signal);
  const auto K_Lp = std::ranges::find(axis.columns, "gains.K_Lp", &SweepAxis::Column::signal);
  REQUIRE(K_Lp != axis.columns.end());
  for (std::size_t k = 0; k < 5; ++k)
    CHECK(K_Lp->si[k] == gains_at(study.schedule, tilt->si[k]).K_Lp);

  check_refused("[gains]\nschedule_eta_deg = [30]\n" + one_condition, "2:20", {"two tilts"});
  check_refused("[gains]\nschedule_eta_deg = 30\n" + one_condition, "2:20", {"two tilts"});
  check_refused("[gains]\nschedule_eta_deg = [30, 30]\n" + one_condition, "2:20", {"ascending"});
  check_refused("[gains]\nschedule_eta_deg = [30, nan]\n" + one_condition, "2:25", {"finite"});
  check_refused("[gains]\nschedule_eta_deg = [30, 60]\nK_Lp = [1, 2, 3]\n" + one_condition, "3:8",
                {"3 values for 2 tilts"});
  check_refused("[gains]\nK_Lp = [1, 2]\n" + one_condition, "2:8", {"K_Lp"});
  check_refused("[gains]\nschedule_eta_deg = [30, 60]\nK_Lp = [1, -1]\n" + one_condition, "2:20",
                {"1 + K_Lp"});
  check_refused(schedule + one_condition +
                    "[[sweep.axis]]\nkey = 'eta_deg'\nfrom = 0\nto = 90\ncount = 5\n"
                    "[[sweep.axis]]\nkey = 'gains.K_Lp'\nfrom = 1\nto = 2\ncount = 5\n",
                "10:1", {"gains.K_Lp is set twice"});
}

TEST_CASE("a key misspelt is refused, with the nearest and all valid keys") {
  check_refused("[gains]\nk_v = 2\n" + one_condition, "2:1",
                {"unknown key 'k_v' in [gains]", "did you mean 'k_V'?", "K_Ep", "k_de"});
  check_refused("[aircraft]\nmasss = 2\n" + one_condition, "2:1", {"'masss'", "'mass'"});
  check_refused("[limits]\na1s = [0, 1]\n" + one_condition, "2:1", {"did you mean 'a1s_deg'?"});
  check_refused("[gain]\n" + one_condition, "1:2", {"'gain' at the top level", "'gains'"});
  check_refused("[landing]\n" + one_condition, "1:2",
                {"'landing'", "valid keys: model, vehicle, equations"});
  check_refused(one_condition + "eta = 3\n", "6:1", {"'eta'", "did you mean 'eta_deg'?"});
  check_refused(one_condition + "alpha_deg = 3\n", "6:1",
                {"'alpha_deg'", "it is a key of formulation airframe and table"});
  check_refused(
      "[[condition]]\nname = 'a'\nformulation = 'airframe'\nV = 1\neta_deg = 0\n"
      "objective = [{signal = 'V', weight = 2}]\n",
      "6:29", {"'weight'", "in objective", "signal, scale, reference"});
}

TEST_CASE("an angle's key with no unit or another one: the hint is the key in degrees") {
  const auto hint = [](const std::string& table, const std::string& key) {
    const std::string message = study_refusal(table + key + " = 1\n");
    return message.find("did you mean 'theta_deg'? it is in degrees;") != message.npos;
  };
  const std::string airframe = one_condition + "formulation = 'airframe'\n";
  for (const std::string key : {"theta", "theta_rad", "theta_radians", "theta_degrees"}) {
    CAPTURE(key);
    CHECK(hint(airframe, key));
  }
  check_refused(airframe + "theta_dge = 1\n", "7:1", {"did you mean 'theta_deg'?"});
  check_refused(airframe + "q_deg = 1\n", "7:1", {"did you mean 'q'? valid"});
  check_refused("[gains]\nk_V_rad = 1\n", "2:1", {"did you mean 'k_V'? valid"});
}

TEST_CASE("an angle in degrees that is a fraction of pi is remarked upon") {
  const auto remarks = [](const std::string& value) {
    const std::string text = one_condition.substr(0, one_condition.find("gamma")) +
                             "gamma_deg = " + value + "\neta_deg = 0\n";
    return angle_remarks(parse_study(text, "t.toml"));
  };
  CHECK(remarks("1.5708") ==
        std::vector<std::string>{"t.toml:4:13: gamma_deg = 1.5708 is 1.57 degrees; 1.5708 rad "
                                 "would be 90 degrees"});
  const std::map<std::string, std::string> radians{
      {"3.1416", " 180 "}, {"-1.571", " -90 "},  {"1.0472", " 60 "},
      {"0.7854", " 45 "},  {"-0.5236", " -30 "}, {"3.141592653589793", " 180 "}};
  for (const auto& [typed, degrees] : radians) {
    const std::string value = typed;
    CAPTURE(value);
    REQUIRE(remarks(value).size() == 1);
    CHECK(remarks(value)[0].find("would be" + degrees + "degrees") != std::string::npos);
  }
  for (const std::string usual : {"0", "1.57", "1.5", "0.5", "3.1", "3.14", "1.05", "90", "-30"})
    CHECK(remarks(usual).empty());
  const std::string elsewhere = "[limits]\na1s_deg = [-0.5236, 20]\n" + one_condition +
                                "[follow]\nparameter = 'gamma_deg'\nto = 0.7854\n"
                                "[[sweep.axis]]\nkey = 'eta_deg'\nvalues = [0, 1.5708]\n"
                                "[[sweep.axis]]\nkey = 'gains.K_Lp'\nfrom = 0.7854\nto = 1.5708\n"
                                "count = 2\n";
  std::string places;
  for (const std::string& remark : angle_remarks(parse_study(elsewhere, "t.toml")))
    places += remark.substr(0, remark.find(' ')) + " ";
  CHECK(places == "t.toml:2:12: t.toml:10:6: t.toml:13:14: ");
}

TEST_CASE("the shipped studies have their angles in the units of their keys" * thorough) {
  for (const auto& entry : fs::directory_iterator(source / "studies"))
    if (entry.path().extension() == ".toml") CHECK(angle_remarks(load_study(entry.path())).empty());
}

TEST_CASE("a wrong number is refused at its place") {
  const auto mass = [](const std::string& value) { return "[aircraft]\nmass = " + value + "\n"; };
  check_refused(mass("'4 kg'") + one_condition, "2:8",
                {"aircraft.mass: the text '4 kg' is not a number", "expected a number", "kg"});
  check_refused(mass("true") + one_condition, "2:8", {"aircraft.mass: a boolean"});
  check_refused(mass("2024-01-01") + one_condition, "2:8", {"aircraft.mass: a date"});
  check_refused(mass("[1]") + one_condition, "2:8", {"aircraft.mass: an array"});
  check_refused(mass("{a = 1}") + one_condition, "2:8", {"aircraft.mass: a table"});
  check_refused(mass("nan") + one_condition, "2:8", {"aircraft.mass: nan is not finite"});
  check_refused(mass("inf") + one_condition, "2:8", {"aircraft.mass: inf is not finite"});
  check_refused(mass("-inf") + one_condition, "2:8", {"aircraft.mass: -inf is not finite"});
  check_refused(mass("-4") + one_condition, "2:8", {"aircraft.mass: -4 is out of range"});
  check_refused(mass("0") + one_condition, "2:8", {"aircraft.mass: 0 is out of range"});
  check_refused(mass("1e300") + one_condition, "2:8", {"out of range"});
  check_refused(mass("1e400") + one_condition, "2:13", {"1e400", "in the line 'mass = 1e400'"});
  check_refused(mass("9223372036854775808") + one_condition, "2:27", {"in the line 'mass"});
  check_refused("[gains]\nK_Ep = 1e7\n" + one_condition, "2:8", {"gains.K_Ep"});
  check_refused("[gains]\nK_Lp = -1\n" + one_condition, "2:8", {"gains.K_Lp", "1 + K_Lp"});
  check_refused("[gains]\nK_Ep = -1\n[aircraft]\nthrust_excess = 1\n" + one_condition, "2:8",
                {"gains.K_Ep", "thrust_excess"});
  check_refused("[aircraft]\ncyclic_blend_deg = -1\n" + one_condition, "2:20", {"degrees"});
}

TEST_CASE("every number that must be positive refuses zero, every one infinity") {
  const std::set<std::string> may_be_zero{
      "rotor_x", "rotor_z", "pitch_scale", "wake_immersion", "CL_q",
      "CL_de",   "CM_q",    "CM_de",       "cyclic_off",     "cyclic_blend"};
  for (const std::string& full : names(aircraft_signals())) {
    const std::string name = full.substr(full.find('.') + 1);
    CAPTURE(name);
    const std::string key = name + (name.starts_with("cyclic") ? "_deg" : "");
    const auto with = [&](const char* value) {
      return study_refusal(fmt::format("[aircraft]\n{} = {}\n{}", key, value, one_condition));
    };
    CHECK(with("0").empty() == may_be_zero.contains(name));
    CHECK(with("inf").find("aircraft." + key) != std::string::npos);
  }
}

TEST_CASE("wrong limits are refused") {
  const auto with = [](const std::string& pair) {
    return "[limits]\na1s_deg = " + pair + "\n" + one_condition;
  };
  check_refused(with("[20, -20]"), "2:11", {"limits.a1s_deg", "20 is not below", "-20"});
  check_refused(with("[20, 20]"), "2:11", {"limits.a1s_deg"});
  check_refused(with("[20]"), "2:11", {"limits.a1s_deg", "[lower, upper]"});
  check_refused(with("[1, 2, 3]"), "2:11", {"limits.a1s_deg"});
  check_refused(with("20"), "2:11", {"limits.a1s_deg: 20 is not a pair"});
  check_refused(with("[-20, 'x']"), "2:17", {"limits.a1s_deg: the text 'x'"});
  check_refused(with("[-20, nan]"), "2:17", {"limits.a1s_deg: nan"});
  check_refused(with("[-200, 20]"), "2:12", {"limits.a1s_deg: -200", "degrees"});
}

TEST_CASE("wrong conditions are refused") {
  const std::string head = "[[condition]]\nname = 'a'\n";
  check_refused("", "1:1", {"condition: none is given"});
  check_refused("# nothing\n", "1:1", {"[[condition]]"});
  check_refused("[gains]\nk_V = 1\n", "1:1", {"condition"});
  check_refused("condition = []\n", "1:13", {"condition", "empty"});
  check_refused("condition = 3\n", "1:13", {"condition: 3"});
  check_refused("condition = [1]\n", "1:14", {"condition: 1 is not a table"});
  check_refused("[condition]\nname = 'a'\n", "1:1", {"double brackets"});
  check_refused(one_condition + one_condition, "7:8", {"condition.name: 'level'", "distinct"});
  check_refused("[[condition]]\nV = 1\n", "1:1", {"condition.name", "missing"});
  check_refused("[[condition]]\nname = ''\n", "2:8", {"condition.name"});
  check_refused("[[condition]]\nname = 'a\tb'\n", "2:8", {"condition.name", "control"});
  check_refused("[[condition]]\nname = 3\n", "2:8", {"condition.name: 3 is not text"});
  check_refused(head + "gamma_deg = 0\neta_deg = 0\n", "1:1", {"condition.V", "missing"});
  check_refused(head + "V = 1\neta_deg = 0\n", "1:1", {"condition.gamma_deg", "missing"});
  check_refused(head + "V = -1\ngamma_deg = 0\neta_deg = 0\n", "3:5", {"condition.V: -1"});
  check_refused(head + "V = 'free'\ngamma_deg = 0\neta_deg = 0\n", "3:5", {"condition.V"});
  check_refused(head + "V = 1\ngamma_deg = 181\neta_deg = 0\n", "4:13", {"gamma_deg: 181"});
  check_refused(head + "V = 1\ngamma_deg = 0\neta_deg = 101\n", "5:11", {"eta_deg: 101", "100"});
  check_refused(head + "formulation = 'closed'\n", "3:15", {"'closed'", "airframe", "table"});
  check_refused("equations = 'print'\n" + one_condition, "1:13", {"equations", "'printed'?"});
  check_refused("equations = 'printed'\n" + head + "V = 0\ngamma_deg = 0\neta_deg = 0\n", "4:5",
                {"condition.V", "printed"});
  check_refused("aircraft = 3\n" + one_condition, "1:12", {"aircraft: 3 is not a table"});
}

TEST_CASE("wrong airframe and table conditions are refused") {
  const std::string head =
      "[[condition]]\nname = 'a'\nformulation = 'airframe'\nV = 9\neta_deg = 0\n";
  CHECK(study_refusal(head).empty());
  check_refused("[[condition]]\nname = 'a'\nformulation = 'airframe'\nV = 9\n", "1:1",
                {"condition.eta_deg", "missing"});
  check_refused(head + "theta0 = 'fre'\n", "6:10",
                {"condition.theta0: the text 'fre'", "\"free\""});
  check_refused(head + "theta0 = [1, 0]\n", "6:10", {"condition.theta0: lower 1 is not below"});
  check_refused(head + "theta0 = [0, inf]\n", "6:14", {"condition.theta0: inf"});
  check_refused(head + "theta0 = true\n", "6:10", {"condition.theta0: a boolean"});
  check_refused(head + "V_dot = 'free'\n", "6:9", {"condition.V_dot"});
  check_refused(head + "alpha_deg = 2\ntheta_deg = 2\n", "7:13", {"theta = alpha + gamma"});
  check_refused(head + "alpha_deg = 2\ntheta_deg = 2\ngamma_deg = 0\n", "7:13", {"all fixed"});
  CHECK(study_refusal(head + "alpha_deg = 2\ntheta_deg = 2\ngamma_deg = 'free'\n").empty());
  check_refused(
      "[[condition]]\nname = 'a'\nformulation = 'airframe'\nV = 0\neta_deg = 90\nV_dot = 1\n",
      "6:9", {"condition.V_dot", "airspeed"});
  check_refused(head + "objective = 'theta0'\n", "6:13", {"condition.objective"});
  check_refused(head + "objective = [1]\n", "6:14", {"condition.objective: 1"});
  check_refused(head + "objective = [{scale = 1}]\n", "6:14", {"objective.signal", "missing"});
  check_refused(head + "objective = [{signal = 'thta0'}]\n", "6:24", {"'thta0'", "'theta0'?"});
  check_refused(head + "objective = [{signal = 'V', scale = 0}]\n", "6:37", {"objective.scale: 0"});
  check_refused("[[condition]]\nname = 'a'\nformulation = 'table'\n", "1:1",
                {"condition.gamma_deg", "missing"});
}

TEST_CASE("wrong branches and envelopes are refused") {
  const auto follow = [](const std::string& text) { return "[follow]\n" + text + one_condition; };
  check_refused(follow(""), "1:1", {"follow.parameter", "missing"});
  check_refused(follow("to = 5\n"), "1:1", {"follow.parameter", "missing"});
  check_refused(follow("parameter = 'V'\n"), "1:1", {"follow.to", "missing"});
  check_refused(follow("parameter = 'Vv'\nto = 5\n"), "2:13",
                {"follow.parameter", "'Vv'", "did you mean 'V'?", "gains.K_Lp"});
  check_refused(follow("parameter = 'gamma'\nto = 5\n"), "2:13", {"did you mean 'gamma_deg'?"});
  check_refused(follow("parameter = 'aircraft.masss'\nto = 5\n"), "2:13", {"'aircraft.mass'?"});
  check_refused(follow("parameter = 'mass'\nto = 5\n"), "2:13", {"'aircraft.mass'?"});
  check_refused(follow("parameter = 'cyclic_off'\nto = 5\n"), "2:13",
                {"'aircraft.cyclic_off_deg'?"});
  check_refused(follow("parameter = 3\nto = 5\n"), "2:13", {"follow.parameter: 3 is not text"});
  check_refused(follow("parameter = 'V'\nto = 'slow'\n"), "3:6", {"follow.to", "'slow'"});
  check_refused(follow("parameter = 'V'\nto = -1\n"), "3:6", {"follow.to: -1", "m/s"});
  check_refused(follow("parameter = 'V'\nto = nan\n"), "3:6", {"follow.to: nan"});
  check_refused(follow("parameter = 'eta_deg'\nto = 101\n"), "3:6", {"follow.to: 101", "100"});
  check_refused(follow("parameter = 'V'\nto = 5\nfrom = 3\n"), "4:1", {"'from'", "[follow]"});
  check_refused("follow = 3\n" + one_condition, "1:10", {"follow: 3 is not a table"});

  const auto envelope = [](const std::string& text) {
    return "[envelope]\n" + text + one_condition;
  };
  check_refused(envelope("over = 'V'\n"), "2:8", {"envelope.over", "eta_deg, gamma_deg"});
  check_refused(envelope("over = 'eta_deg'\ngamma_deg = [-5, 5]\n"), "3:13",
                {"envelope.gamma_deg", "each condition;", "over = \"gamma_deg\""});
  check_refused(envelope("gamma_deg = [-5, 5]\n"), "2:13", {"envelope.gamma_deg"});
  check_refused(envelope("over = 'gamma_deg'\neta_deg = [0, 5]\n"), "3:11", {"envelope.eta_deg"});
  check_refused(envelope("V = 5\n"), "2:5", {"envelope.V: 5 is not a pair"});
  check_refused(envelope("V = [5, 4]\n"), "2:5", {"envelope.V: lower 5"});
  check_refused(envelope("V = [0, 4]\n"), "2:6", {"envelope.V: 0", "0.5"});
  check_refused(envelope("eta_deg = [0, 200]\n"), "2:15", {"envelope.eta_deg: 200", "100"});
  check_refused(envelope("count = 4\n"), "2:9", {"envelope.count: 4"});
  check_refused(envelope("count = 'x'\n"), "2:9", {"envelope.count", "'x'"});
  check_refused(envelope("counts = 4\n"), "2:1", {"'counts'", "did you mean 'count'?"});
}

TEST_CASE("what is not TOML, or not text, is refused") {
  check_refused("[aircraft]\nmass = 1\nmass = 2\n" + one_condition, "3:8",
                {"mass", "redefine", "given in line 2"});
  check_refused("[gains]\nk_V = 1\n[gains]\n" + one_condition, "3:1", {"gains"});
  check_refused("[aircraft\n", "1:10", {"not TOML"});
  check_refused("V = 1\n\n" + std::string(1, '\0'), "3:1", {"NUL"});
  check_refused(std::string("\xFF\xFEx\0", 4), "1:1", {"UTF-16"});
  check_refused(std::string("\xFE\xFF\0x", 4), "1:1", {"UTF-16"});
  check_refused("x = '\xC0\x80'\n", "1:5", {"utf-8", "in the line 'x = '"});
  check_refused("[é]\n", "1:2", {"not TOML", "ASCII"});
  check_refused("x = \"a\" é", "1:9", {"not TOML", "ASCII"});
  check_refused("x = \"\\\"é\" \n", "1:1", {"'x'"});
  check_refused("x = '\\' # é\n", "1:1", {"'x'"});
  check_refused("x = \"\"\"\na\"\"\"", "1:5", {"one line"});
  check_refused("x = \'\'\'", "1:5", {"one line"});
  check_refused("\xEF\xBB\xBF\xC3\xA9 = 1", "1:4", {"ASCII"});
  check_refused("[.a]\n", "1:2", {"not TOML"});
  check_refused("\"\\u001b[31m\" = 1\n", "1:1", {"unknown key '?[31m'"});
  check_refused(std::string("\x7F"
                            "ELF\x02\x01\x01"),
                "1:1", {"not TOML"});
  // The limit of a file: a program may list more values than a user types.
  CHECK(study_refusal("#" + std::string(10'000'000, 'x') + "\n" + one_condition).empty());
}

TEST_CASE("nesting of any depth is refused, not followed") {
  const auto repeated = [](std::string_view part, std::size_t times) {
    std::string all;
    for (std::size_t i = 0; i < times; ++i) all += part;
    return all;
  };
  constexpr std::size_t deep = 100'000;
  CHECK_FALSE(study_refusal("x = " + repeated("[", deep)).empty());
  CHECK_FALSE(study_refusal("x = " + repeated("{a=", deep)).empty());
  CHECK_FALSE(study_refusal("x = " + repeated("[", 100) + repeated("]", 100)).empty());
  check_refused("x" + repeated(".x", deep) + " = 1\n", "1:34", {"dots"});
  check_refused("[x" + repeated(".x", deep) + "]\n", "1:35", {"dots"});
  check_refused("1" + repeated(".1", deep) + " = 1\n", "1:34", {"dots"});
  check_refused("a" + repeated(".'#'", deep) + " = 1\n", "1:66", {"dots"});
  const std::string longest = "{" + repeated("a.", 16) + "a = [\n";
  CHECK_FALSE(study_refusal("x = [" + repeated(longest, 126)).empty());
  CHECK_FALSE(
      study_refusal("x = [" + repeated(longest, 126) + "1" + repeated("]}", 126) + "]").empty());
  CHECK(study_refusal(" # " + repeated(".", deep) + "\n" + one_condition).empty());
  check_refused("x = [" + repeated("0.5, ", 1000) + "]\n" + one_condition, "1:1", {"'x'"});
}

TEST_CASE("files that cannot be read are refused with their name") {
  const Folder folder;
  const auto message = [](const fs::path& file) {
    return refusal<StudyError>([&] { (void)load_study(file); });
  };
  CHECK(
      message(folder.path).starts_with(folder.path.string() + ": cannot be read: is a directory"));
  CHECK(message(folder.path / "none.toml").find("none.toml: cannot be read") != std::string::npos);
  CHECK(message("").find("cannot be read") != std::string::npos);
  const fs::path big = folder.write("big.toml", std::string(10'000'000, '\xA7'));
  CHECK(message(big).starts_with(big.string() + ":1:1: the file has more than 1000000 bytes"));
  const fs::path empty = folder.write("empty.toml", "");
  CHECK(message(empty).starts_with(empty.string() + ":1:1: condition"));
  if (geteuid() != 0) {  // root may read everything
    const fs::path closed = folder.write("closed.toml", one_condition);
    fs::permissions(closed, fs::perms::none);
    CHECK(message(closed).find("closed.toml: cannot be read") != std::string::npos);
  }
}

TEST_CASE("a polar lies beside the study, or among the shipped data") {
  const Folder folder;
  const auto with = [&](const std::string& polar) {
    return folder.write("s.toml", "[aircraft]\npolar = '" + polar + "'\n" + one_condition);
  };
  folder.write("mine.csv", polar_text(flat_rows));
  folder.write("table2_anchored.csv", polar_text(flat_rows));
  CHECK_NEAR(load_study(with("mine.csv")).vehicle.polar->at(0.4).CD, 1.0, 1e-14);
  CHECK_NEAR(load_study(with("table2_anchored.csv")).vehicle.polar->at(0.4).CD, 1.0, 1e-14);
  CHECK(load_study(with("naca8h12_re150k.csv")).vehicle.polar->at(0.4).CD < 0.9);
  CHECK_NEAR(load_study(with((folder.path / "mine.csv").string())).vehicle.polar->at(0.4).CD, 1.0,
             1e-14);
}

TEST_CASE("a bad polar is refused at the study's key, in the polar's own words") {
  const Folder folder;
  const fs::path study = folder.write("s.toml", "[aircraft]\npolar = 'p.csv'\n" + one_condition);
  const auto message = [&](const std::string& rows) {
    folder.write("p.csv", polar_text(rows));
    return refusal<StudyError>([&] { (void)load_study(study); });
  };
  const auto check = [&](const std::string& text, const std::string& word) {
    CAPTURE(text);
    CHECK(text.starts_with(study.string() + ":2:9: aircraft.polar: "));
    CHECK(text.find(word) != std::string::npos);
  };
  check(refusal<StudyError>([&] { (void)load_study(study); }), "'p.csv' is neither in");
  CHECK(message(flat_rows).empty());
  check(message("-180,0,1,0\n-90,0,1,0\n0,0,1,0\n90,0,1,0\n180,0,2,0\n"), "not periodic");
  check(message("-180,0,1,0\n0,0,1,0\n-90,0,1,0\n90,0,1,0\n180,0,1,0\n"), "p.csv:5: alpha");
  check(message("-180,0,1,0\n180,0,1,0\n"), "at least 4 rows, got 2");
  check(message("-180,0,1,0\ngarbage\n"), "p.csv:4: ");
  check(message("-180,0,nan,0\n"), "p.csv:3: ");
  check(message(""), "got 0");
  folder.write("p.csv", "");
  check(refusal<StudyError>([&] { (void)load_study(study); }), "p.csv");
  fs::remove(folder.path / "p.csv");
  fs::create_directory(folder.path / "p.csv");
  check(refusal<StudyError>([&] { (void)load_study(study); }), "p.csv");
}

TEST_CASE("a polar's name may be anything and is still only a name") {
  const auto with = [](const std::string& name) {
    return "[aircraft]\npolar = \"" + name + "\"\n" + one_condition;
  };
  check_refused(with(""), "2:9", {"aircraft.polar"});
  check_refused(with("a\\u0000b"), "2:9", {"aircraft.polar", "control"});
  check_refused(with(std::string(100'000, 'x')), "2:9", {"aircraft.polar"});
  check_refused(with("."), "2:9", {"aircraft.polar"});
  check_refused("[aircraft]\npolar = 3\n" + one_condition, "2:9", {"aircraft.polar: 3"});
}

TEST_CASE("the environment says where the data are") {
  const Folder folder;
  const char* set = std::getenv("TILTRIM_DATA");
  const std::string before = set ? set : "";
  setenv("TILTRIM_DATA", folder.path.c_str(), 1);
  CHECK(data_directory() == folder.path);
  check_refused(one_condition, "1:1", {"aircraft.polar (by default)", folder.path.string()});
  CHECK_THROWS_AS(reference_vehicle(), std::runtime_error);
  folder.write("naca8h12_re150k.csv", polar_text(flat_rows));
  CHECK_NEAR(reference_vehicle().polar->at(0.1).CD, 1.0, 1e-14);
  set ? setenv("TILTRIM_DATA", before.c_str(), 1) : unsetenv("TILTRIM_DATA");
}

TEST_CASE("a study cut short at any byte loads or is refused" * thorough) {
  for (const char* name : {"paper", "airframe", "printed"}) {
    const std::string text = contents(source / "studies" / fmt::format("{}.toml", name));
    REQUIRE(text.size() > 1000);
    for (std::size_t n = 0; n <= text.size(); ++n) {
      CAPTURE(n);
      if (!loads_or_is_refused(text.substr(0, n))) FAIL("neither loaded nor refused");
    }
  }
}

TEST_CASE("a study with bytes changed, lost or doubled loads or is refused" * thorough) {
  for (const char* name : {"paper", "airframe", "printed"})
    check_damaged(contents(source / "studies" / fmt::format("{}.toml", name)), 2000);
}

static const std::string axis = one_condition + "[[sweep.axis]]\n";

TEST_CASE("sweeps: the axes' values, and what moves with them") {
  const Study study = parse_study(
      axis +
          "key = 'eta_deg'\nfrom = 0\nto = 90\ncount = 4\n"
          "with = [{key = 'V', values = [15, 10, 5, 2]}]\n"
          "[[sweep.axis]]\nkey = 'gains.K_Lp'\nfrom = 0.1\nto = 10\ncount = 3\nspacing = 'log'\n",
      "study.toml");
  REQUIRE(study.sweep);
  REQUIRE(study.sweep->axes.size() == 2);
  const SweepAxis &tilt = study.sweep->axes[0], &gain = study.sweep->axes[1];
  CHECK(tilt.name == "eta_deg");
  CHECK(tilt.columns[0].values == std::vector<double>{0, 30, 60, 90});
  CHECK_NEAR(tilt.columns[0].si[2], std::numbers::pi / 3, 1e-15);
  CHECK(tilt.columns[1].signal == "V");
  CHECK(tilt.columns[1].si == std::vector<double>{15, 10, 5, 2});
  CHECK(gain.name == "K_Lp");
  CHECK(gain.columns[0].values.front() == 0.1);
  CHECK_NEAR(gain.columns[0].values[1], 1.0, 1e-15);
  CHECK(gain.columns[0].values.back() == 10.0);
}

TEST_CASE("sweeps: h sets the three of the corridor") {
  const Study study = parse_study(axis + "key = 'h'\nvalues = [0, 60, 120]\n", "study.toml");
  const SweepAxis& h = study.sweep->axes.at(0);
  REQUIRE(h.columns.size() == 4);
  CHECK(h.columns[0].signal.empty());
  CHECK(h.columns[1].values == std::vector<double>{2, corridor(60).V, 15});
  CHECK_NEAR(h.columns[2].values[1], 45, 1e-12);  // (16) is odd about its middle
  CHECK_NEAR(h.columns[3].si[0], std::numbers::pi / 2, 1e-15);
}

TEST_CASE("sweeps that cannot be are refused at their line") {
  check_refused(axis + "key = 'gains.K_Lpp'\nvalues = [1]\n", "7:7",
                {"did you mean 'gains.K_Lp'?"});
  check_refused(axis + "key = 'eta'\nvalues = [1]\n", "7:7", {"did you mean 'eta_deg'?"});
  check_refused(axis + "key = 'V'\nvalues = []\n", "8:10", {"an empty array"});
  check_refused(axis + "key = 'V'\nfrom = 15\nto = 15\ncount = 3\n", "9:6",
                {"15 after 15 repeats it"});
  check_refused(axis + "key = 'V'\nvalues = [1, 3, 2]\n", "8:10",
                {"2 after 3", "reverses the direction"});
  check_refused(axis + "key = 'V'\nvalues = [1, 1]\n", "8:10", {"1 after 1"});
  check_refused(axis + "key = 'V'\nvalues = [1, nan]\n", "8:14", {"not finite"});
  check_refused(axis + "key = 'V'\nfrom = 1\nto = 2\ncount = 1e12\n", "10:9", {"out of range"});
  check_refused(axis + "key = 'V'\nfrom = 1\nto = 2\ncount = 2.5\n", "10:9", {"whole number"});
  check_refused(axis + "key = 'V'\nfrom = 0\nto = 2\ncount = 3\nspacing = 'log'\n", "11:11",
                {"passes through zero;"});
  check_refused(axis + "key = 'V'\nvalues = [1]\ncount = 3\n", "9:9",
                {"cannot be combined with values;"});
  check_refused(axis + "key = 'h'\nvalues = [1]\n[[sweep.axis]]\nkey = 'V'\nvalues = [1]\n", "6:1",
                {"V is set twice"});
}

static Key key_of(const Study& study, const std::string& name) {
  const std::vector<Key> keys = keys_of(study);
  return *std::ranges::find(keys, name, &Key::name);
}

static std::string sweep_refusal(const std::string& text) {
  const Study study = parsed(text);
  try {
    (void)sweep_requests(study, study.conditions, study.sweep->axes);
  } catch (const StudyError& e) {
    return e.what();
  }
  return "";
}

TEST_CASE("what a condition's trims do not depend on is no axis, branch or envelope") {
  const std::string over = "[[sweep.axis]]\nvalues = [0, 1]\nkey = ";
  CHECK(sweep_refusal(one_condition + over + "'q'").find("q is zero in every trim of the closed") !=
        std::string::npos);
  const std::string xv15 =
      "vehicle = 'xv15'\n[[condition]]\nname = 'a'\nflap_deg = 40\nmast_angle_deg = 0\n";
  for (const char* key : {"airspeed_kt", "climb_angle_deg"}) {
    CAPTURE(key);
    const std::string idle = xv15 + "speed_kt = 80\n", flown = xv15 + "airspeed_kt = 80\n";
    const std::string own = over + "'" + key + "'\n";
    CHECK(sweep_refusal(idle + own).find(std::string(key) + " moves nothing") != std::string::npos);
    CHECK(sweep_refusal(flown + own).empty());
    const Study study = parsed(idle);
    const Vehicle vehicle = study.vehicle;
    const Key moved = key_of(study, key);
    CHECK_THROWS_WITH_AS((void)follow(vehicle, study.conditions[0], moved, 0.1),
                         doctest::Contains("moves nothing"), std::invalid_argument);
    const EnvelopeTable plane{moved, key_of(study, "mast_angle"), {0, 1}, {0, 1}, 3};
    CHECK_THROWS_WITH_AS((void)envelope(vehicle, study.conditions[0], plane, {}),
                         doctest::Contains("moves nothing"), std::invalid_argument);
  }
  check_refused(xv15 + "speed_kt = 80\nclimb_angle_deg = 3\n", "7:19",
                {"it is commanded with airspeed_kt", "climb in m/s"});
  check_refused("control = 'energy'\n" + xv15 + "speed_kt = 80\n", "7:12",
                {"flies a commanded speed; expected airspeed_kt"});
}

TEST_CASE("a held rate: linear models about that motion, as in sweeps; theta_dot is q") {
  const std::string airframe =
      "[[condition]]\nname = 'a'\nformulation = 'airframe'\nV = 15\neta_deg = 0\na1s_deg = 0\n";
  const std::string pitching = airframe + "q = 0.1\n", speeding = airframe + "V_dot = 1\n";
  for (const std::string& state : {std::string("V"), std::string("theta")}) {
    CAPTURE(state);
    const std::string& text = state == "V" ? speeding : pitching;
    const Study study = parsed(text + "[[sweep.axis]]\nkey = 'V'\nvalues = [15, 16]\n");
    const Condition& condition = study.conditions[0];
    CHECK(moving_states(condition) == std::vector<std::string>{state});
    const Answer trimmed = answer(study.vehicle, condition);
    const LinearModel linear =
        linearize(trimmed.model, trimmed.trim.point, {.moving = moving_states(condition)});
    REQUIRE(linear);
    const Modes found = modes(linear);
    const Verdict expected = state == "theta" ? Verdict::stable : Verdict::unstable;
    CHECK(found.verdict == expected);
    const SweepMap map =
        sweep(sweep_requests(study, study.conditions, study.sweep->axes), study.sweep->axes);
    CHECK(map.verdict[0] == int(expected));
  }
  for (const char* still : {"", "q = 'free'\n", "q = 0\n"})
    CHECK(moving_states(parsed(airframe + still).conditions[0]).empty());
  const auto trims = [&](const std::string& more) {
    const Study study = parsed(airframe + more);
    return answer(study.vehicle, study.conditions[0]).trim.status == TrimStatus::converged;
  };
  CHECK(trims("q = 0.1\ntheta_dot = 0.1\n"));
  CHECK(trims("q = 'free'\ntheta_dot = 0.1\n"));
  CHECK_THROWS_WITH_AS((void)trims("theta_dot = 0.1\n"),
                       doctest::Contains("theta_dot = 0.1 rad/s is q, which is fixed at 0"),
                       std::invalid_argument);
}

TEST_CASE("reports: lines and maps, and what else is shown") {
  const std::string map =
      "[[report.map]]\n[[report.map.axis]]\nkey = 'h'\nfrom = 0\nto = 60\ncount = 3\n";
  const Study study =
      parse_study("[report]\nflight = 'skip'\naudit = 'show'\n" + map +
                      "[[report.map]]\ncondition = 'level'\ncrossings = 'skip'\n"
                      "[[report.map.axis]]\nkey = 'gains.K_Lp'\nvalues = [1, 2]\n"
                      "[[report.map.axis]]\nkey = 'gains.K_Li'\nvalues = [1, 2, 3]\n" +
                      one_condition,
                  "s.toml");
  REQUIRE(study.report);
  CHECK(study.report->flight == false);
  CHECK(study.report->audit == true);
  REQUIRE(study.report->maps.size() == 2);
  CHECK(study.report->maps[0].condition.empty());
  CHECK(study.report->maps[0].grid.crossings);
  CHECK(study.report->maps[0].grid.axes.at(0).columns.size() == 4);  // V, gamma, eta with h
  CHECK(study.report->maps[1].condition == "level");
  CHECK(!study.report->maps[1].grid.crossings);
  CHECK(study.report->maps[1].grid.axes.at(1).size() == 3);
  CHECK(!parse_study(one_condition, "s.toml").report);
  const Study bare = parse_study(one_condition + "[report]\n", "s.toml");
  CHECK(bare.report->maps.empty());
  CHECK(!bare.report->flight);
}

TEST_CASE("reports that cannot be are refused at their line") {
  const std::string report = one_condition + "[report]\n", map = one_condition + "[[report.map]]\n";
  const std::string K = "[[report.map.axis]]\nkey = 'gains.K_Lp'\nvalues = [1]\n";
  check_refused(report + "flight = 'shw'\n", "7:10", {"report.flight", "did you mean 'show'?"});
  check_refused(report + "audit = true\n", "7:9", {"report.audit", "a boolean"});
  check_refused(report + "maps = 3\n", "7:1", {"unknown key 'maps'", "did you mean 'map'?"});
  check_refused(report + "map = 3\n", "7:7", {"report.map"});
  check_refused(map, "6:1", {"report.map.axis: is missing"});
  check_refused(map + "condition = 'lvel'\n" + K, "7:13",
                {"report.map.condition", "mean 'level'?"});
  check_refused(map + "axis = 3\n", "7:8",
                {"report.map.axis: 3 is not a list", "[[report.map.axis]]"});
  check_refused(map + "[[report.map.axis]]\nkey = 'gains.K_Lpp'\nvalues = [1]\n", "8:7",
                {"report.map.axis.key", "did you mean 'gains.K_Lp'?"});
  check_refused(map + K + "with = [{key = 'V', from = 1, two = 2}]\n", "10:31", {"two"});
  check_refused(map + K + "[[report.map.axis]]\nkey = 'V'\nvalues = [1]\n" +
                    "[[report.map.axis]]\nkey = 'eta_deg'\nvalues = [1]\n",
                "7:1", {"3 axes cannot be plotted; expected one or two"});
}

}  // namespace study_test
