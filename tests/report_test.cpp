// Sheets: alignment, quoting and rounding.
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/map_sheets.hpp"
#include "report/proofs.hpp"
#include "report/sheet.hpp"
#include "report/study_report.hpp"
#include "tests/check.hpp"

using namespace tiltrim;

namespace report_test {

static const Sheet sheet{
    "title",
    {{"name", "name", ""}, {"angle_deg", "θ", "°", "{:.2f}"}, {"n", "n", "", "{:.0e}"}},
    {{SheetCell("a, \"b\""), SheetCell(0.1), SheetCell()},
     {SheetCell("γ"), SheetCell(-12.345), SheetCell(1e-13)}},
    {}};

TEST_CASE("text is aligned by characters, numbers to the right, words to the left") {
  CHECK(as_text(sheet) ==
        "title\n"
        "  name         θ      n\n"
        "               °\n"
        "  a, \"b\"    0.10      -\n"
        "  γ       -12.35  1e-13\n");
}

TEST_CASE("CSV quotes what needs it and keeps every digit") {
  CHECK(as_csv(sheet) ==
        "name,angle_deg,n\n"
        "\"a, \"\"b\"\"\",0.10000000000000001,\n"
        "γ,-12.345000000000001,1e-13\n");
  CHECK(std::stod("0.10000000000000001") == 0.1);
}

TEST_CASE("colour only where asked for; lines wrap by characters") {
  CHECK(toned("stable", Tone::good, {}) == "stable");
  CHECK(toned("stable", Tone::good, {.colour = true}) == "\033[32mstable\033[0m");
  CHECK(wrapped("one two three", 2, 9) == "  one two\n  three\n");
  CHECK(wrapped("", 2, 9) == "  \n");
  CHECK(wrapped("unbreakable", 2, 5) == "  unbreakable\n");
}

TEST_CASE("a number too long for fixed notation is printed with its exponent") {
  CHECK(number_text(1e300, "{:.4f}") == "1e+300");
  CHECK(number_text(-1.23456789e10, "{:.4f}") == "-1.234568e+10");
  CHECK(number_text(9999999999.5, "{:.4f}") == "9999999999.5000");
  CHECK(number_text(1e300, "{:.3g}") == "1e+300");
  CHECK(number_text(-INFINITY, "{:.4f}") == "-inf");
  Sheet large = sheet;
  large.rows = {{SheetCell("z"), SheetCell(1e300), SheetCell(0.0)}};
  CHECK(as_text(large).find(" 1e+300 ") != std::string::npos);
}

TEST_CASE("a minus sign never stands before a zero") {
  Sheet zero = sheet;
  zero.rows = {{SheetCell("z"), SheetCell(-0.0), SheetCell(0.0)}};
  CHECK(as_text(zero).find("-0") == std::string::npos);
  zero.rows = {{SheetCell("z"), SheetCell(-1e-20), SheetCell(0.0)}};  // of its digits none is shown
  CHECK(as_text(zero).find("-0") == std::string::npos);
}

static StudyReport report_of_two() {
  StudyReport report{};
  for (const char* const name : {"level", "fast"}) {
    ConditionReport c{};
    c.answer.condition.name = name;
    c.answer.trim.status = TrimStatus::converged;
    c.modes = Modes{};
    c.modes->verdict = Verdict::stable;
    report.conditions.push_back(c);
  }
  return report;
}

TEST_CASE("an interrupted report says what was examined and what was not") {
  StudyReport report = report_of_two();
  CHECK(verdict_in_words(report) == "All 2 conditions are in verified equilibrium and stable.");
  CHECK(unanswered(report).empty());
  report.not_examined = {"condition 'slow'", "the map over h", "the flight"};
  CHECK(verdict_in_words(report) ==
        "Interrupted, so incomplete: not examined are condition 'slow', the map over h, the "
        "flight. All 2 conditions examined are in verified equilibrium and stable.");
  REQUIRE(unanswered(report).size() == 1);
  CHECK(unanswered(report)[0].why ==
        "interrupted: not examined are condition 'slow', the map over h, the flight.");
  report.conditions.pop_back();
  CHECK(verdict_in_words(report).ends_with(
      "The one condition examined is in verified equilibrium and stable."));
  report.conditions.clear();
  CHECK(verdict_in_words(report).ends_with("No condition was examined."));
}

TEST_CASE("a theorem of several parameters: stretches of the first, what is not stable and where") {
  const Study study = parse_study(
      "[[condition]]\nname = \"level\"\nV = 15\ngamma_deg = 0\neta_deg = 0\n"
      "[[prove.parameter]]\nkey = \"h\"\nfrom = 0\nto = 120\n"
      "[[prove.parameter]]\nkey = \"aircraft.mass\"\nfrom = 3.5\nto = 4.5\n",
      "report_test.toml");
  const auto region = [](ProofVerdict verdict, const char* cause, Range h, Range mass) {
    ProofNode r;
    r.verdict = verdict;
    r.cause = cause;
    r.box = {h, mass};
    r.volume = (h.upper - h.lower) * (mass.upper - mass.lower) / 120;
    return r;
  };
  Theorem t;
  t.name = "level";
  t.parameters = {{"h", 0, 120}, {"mass", 3.5, 4.5}};
  t.boxes = 15;
  t.stable = 0.9375;
  t.undecided = 0.0625;
  t.regions = {region(ProofVerdict::stable, "", {0, 30}, {3.5, 4.5}),
               region(ProofVerdict::stable, "", {30, 45}, {3.5, 4}),
               region(ProofVerdict::undecided, "switch", {30, 37.5}, {4, 4.5}),
               region(ProofVerdict::undecided, "limit", {37.5, 45}, {4, 4.5}),
               region(ProofVerdict::stable, "", {45, 120}, {3.5, 4.5})};
  CHECK(theorems_text(study, {t}) ==
        "level\n"
        "  h from 0 to 120 m\n"
        "  aircraft.mass from 3.5 to 4.5 kg\n"
        "  partly proved: 15 boxes\n"
        "  stable: every eigenvalue has a real part below 0 1/s\n"
        "  shares of the volume: 0.9375 stable, none unstable, none without trim, 0.0625\n"
        "  undecided\n"
        "  h from 0 to 30 m: proved_stable\n"
        "  h from 30 to 37.5 m: proved_stable, undecided (switch)\n"
        "  h from 37.5 to 45 m: proved_stable, undecided (limit)\n"
        "  h from 45 to 120 m: proved_stable\n"
        "  undecided (limit): 1 region, 0.0312 of the volume, within h from 37.5 to 45 m, "
        "aircraft.mass from 4 to 4.5 kg\n"
        "  undecided (switch): 1 region, 0.0312 of the volume, within h from 30 to 37.5 m, "
        "aircraft.mass from 4 to 4.5 kg\n"
        "  5 regions in all: --format json\n");
}

TEST_CASE("points at which the model threw: how many, and the first exception") {
  SweepMap map;
  map.conditions = {"a"};
  map.axes = {{"p", {{"p", "", "p", {1, 2, 3, 4}, {1, 2, 3, 4}}}}};
  const auto threw = std::int8_t(TrimStatus::model_threw);
  map.status = {std::int8_t(TrimStatus::converged), threw, threw, threw};
  map.verdict = {std::int8_t(Verdict::stable), -1, -1, -1};
  map.reasons = {"", "the model threw: no row 7", "the model threw: no row 8"};
  map.reason = {0, 1, 1, 1};
  for (std::vector<double>* numbers : {&map.residual, &map.spectral_abscissa, &map.damping})
    numbers->assign(4, 0.0);
  map.second_branch.resize(4);
  CHECK(reasons_of(map, 0) == std::vector<std::string>{"3 x the model threw: no row 7"});
  map.reason = {0, 1, 2, 2};
  CHECK(reasons_of(map, 0) ==
        std::vector<std::string>{"3 x the model threw: no row 7 (the first one; others differ)"});
  const auto json = nlohmann::json::parse(map_json(map));
  CHECK(json["model_threw"]["points"] == 3);
  CHECK(json["model_threw"]["first"] == "the model threw: no row 7");
  CHECK(json["points"][3]["message"] == "the model threw: no row 8");
  map.status.assign(4, std::int8_t(TrimStatus::converged));
  CHECK(nlohmann::json::parse(map_json(map))["model_threw"].is_null());
}

}  // namespace report_test
