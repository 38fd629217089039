#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "report/code_points.hpp"
#include "report/tuning_parts.hpp"
#include "report/tuning_words.hpp"
#include "tune/measures.hpp"

namespace tiltrim {

namespace tuning {
namespace {

std::string gains_text(const TuningReport& report, const TextStyle& style) {
  const std::string toml = tuning_toml(report);
  if (toml.empty()) return "";
  std::string text = report.result ? "\nThe gains, to paste into the study:\n\n"
                                   : "\nThe best found, to paste into the study:\n\n";
  std::istringstream lines(toml);
  for (std::string line; std::getline(lines, line);)
    text += line.empty() ? "\n" : wrapped(line, 4, style.width);
  return text;
}

SheetCell reserve_cell(const Achieved& a) {
  const double in_percent = 100 * a.reserve();
  if (!std::isfinite(in_percent)) return number_cell(in_percent);
  SheetCell cell(std::round(10 * in_percent) / 10);  // as printed: no -0.0
  if (a.reserve() < -rounding) cell.tone = Tone::bad;
  return cell;
}

Sheet requirements_sheet(const TuningReport& report) {
  Sheet sheet;
  sheet.title = "\nRequirements, where they are worst, and the reserve in percent of the limit:";
  sheet.columns = {{"", "requirement", ""},        {"", "worst", "", "{:.5g}"}, {"", "unit", ""},
                   {"", "reserve", "%", "{:.1f}"}, {"", "active", ""},          {"", "where", ""}};
  const std::vector<Requirement> asked = asked_of(report.problem);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const std::string words = asked_in_words(asked[i], i < goals_of(report.problem));
    const Achieved* a = worst(report.result, i, everywhere);
    if (!a) {
      sheet.rows.push_back({words, {}, "", {}, "", "applies nowhere"});
      continue;
    }
    sheet.rows.push_back({words, a->value, unit_in_text(unit(asked[i].measure)), reserve_cell(*a),
                          any_active(report.result, i, everywhere) ? "*" : "",
                          place_in_words(report.problem, a->place)});
  }
  return sheet;
}

template <class Counts>
std::vector<SheetCell> point_row(const TuningReport& report, const std::string& name,
                                 const Counts& counts) {
  std::vector<SheetCell> row{name};
  for (std::size_t i = 0; i < asked_of(report.problem).size(); ++i) {
    const Achieved* a = worst(report.result, i, counts);
    const bool active = any_active(report.result, i, counts);
    row.emplace_back(a ? fmt::format("{:.4g}{}", a->value, active ? '*' : ' ') : "- ",
                     a && a->reserve() < -rounding ? Tone::bad : Tone::plain);
  }
  return row;
}

// Right-aligns the text of a column, including its heading.
void align_right(Sheet& sheet, std::size_t column) {
  std::vector<std::string*> words{&sheet.columns[column].title, &sheet.columns[column].unit};
  for (auto& row : sheet.rows) words.push_back(&std::get<std::string>(row[column].value));
  std::size_t width = 0;
  for (const std::string* w : words) width = std::max(width, characters(*w));
  for (std::string* w : words) w->insert(0, width - characters(*w), ' ');
}

struct PlacesOfPoint {
  long nominal = 0, scattered = 0;
};
std::vector<PlacesOfPoint> places_by_point(const TuningReport& report) {
  std::vector<PlacesOfPoint> counts(report.problem.points.size());
  for (const Achieved& a : report.result.achieved)
    if (a.asked == 0)
      ++(a.place.scatter.empty() ? counts.at(a.place.point).nominal
                                 : counts.at(a.place.point).scattered);
  return counts;
}

// The table of points, and the number of rows omitted.
std::pair<Sheet, std::size_t> points_sheet(const TuningReport& report) {
  const TuneProblem& problem = report.problem;
  Sheet sheet;
  sheet.title = "\nAt each operating point (* limits the result):";
  sheet.columns = {{"", "point", ""}};
  const std::vector<Requirement> asked = asked_of(problem);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const std::string unit_name = unit_in_text(unit(asked[i].measure));
    const std::string goal = unit_name.empty() ? "goal" : "goal, " + unit_name;
    sheet.columns.push_back(
        {"", in_words(asked[i]) + ' ',
         (i == 0 && problem.goals.empty() ? goal : limit_in_words(asked[i])) + ' '});
  }
  constexpr std::size_t most = 40;
  std::size_t left_out = 0;
  const std::vector<PlacesOfPoint> counts = places_by_point(report);
  for (std::size_t p = 0; p < counts.size(); ++p) {
    const auto nominal = [&](const Achieved::Place& s) {
      return s.point == p && s.scatter.empty();
    };
    const auto scattered = [&](const Achieved::Place& s) {
      return s.point == p && !s.scatter.empty();
    };
    const auto add = [&](const std::string& name, const auto& which) {
      if (sheet.rows.size() < most)
        sheet.rows.push_back(point_row(report, name, which));
      else
        ++left_out;
    };
    if (counts[p].nominal > 0) add(problem.points[p].name, nominal);
    if (counts[p].scattered > 0)
      add(fmt::format("{}, worst of {}",
                      counts[p].nominal > 0 ? "  scattered" : problem.points[p].name,
                      grouped(counts[p].scattered)),
          scattered);
  }
  return {sheet, left_out};
}

std::string and_more(std::size_t left_out) {
  return left_out > 0 ? fmt::format("... and {} more (JSON lists all)", left_out) : "";
}

std::string points_text(const TuningReport& report, const TextStyle& style) {
  auto [sheet, left_out] = points_sheet(report);
  for (std::size_t k = 1; k < sheet.columns.size(); ++k) align_right(sheet, k);
  const std::string more = and_more(left_out);
  return as_text(sheet, style) + (more.empty() ? "" : "  " + more + '\n');
}

SheetCell met_cell(bool met) {
  return met ? SheetCell("met") : SheetCell("missed", Tone::doubtful);
}

Sheet effects_sheet(const TuningReport& report) {
  constexpr double ten_percent = 0.1;
  const std::vector<Requirement> asked = asked_of(report.problem);
  const bool limited = asked.size() > goals_of(report.problem);
  Sheet sheet;
  sheet.title =
      "\nEffect of each gain: the worst case with 10 % less and 10 % more of it, and the slope per "
      "10 % increase:";
  sheet.columns = {{"", "gain", ""}, {"", "value", "", "{:.5g}"}, {"", "unit", ""}};
  for (const char* step : {"10 % less", "10 % more"}) {
    sheet.columns.push_back({"", "goal", step, "{:.4g}"});
    if (limited) sheet.columns.push_back({"", "limits", ""});
  }
  for (const Requirement& r : asked) sheet.columns.push_back({"", in_words(r), "slope", "{:+.2g}"});
  for (const TuneResult::GainEffect& e : report.result.effects) {
    const Key key = key_of(report.problem, e.name.substr(0, e.name.find(" at ")));
    std::vector<SheetCell> row{without_prefix(e.name), number_cell(key.in_study(e.value)),
                               unit_in_text(key.unit), number_cell(e.goal_less)};
    if (limited) row.push_back(met_cell(e.limits_less));
    row.push_back(number_cell(e.goal_more));
    if (limited) row.push_back(met_cell(e.limits_more));
    for (std::size_t i = 0; i < asked.size(); ++i)
      row.push_back(number_cell(i < e.slopes.size() ? ten_percent * e.slopes[i] : nan));
    sheet.rows.push_back(std::move(row));
  }
  if (report.result.coalescing)
    sheet.notes.emplace_back(
        "Two of the critical eigenvalues coincide: slopes of single eigenvalues are unbounded "
        "there; the columns with 10 % less and more are evaluated exactly.");
  return sheet;
}

Sheet front_sheet(const TuningReport& report) {
  const Requirement& moved = report.front_limit;
  const std::string goal = goal_in_words(report.problem);
  const std::string moved_unit = unit_in_text(unit(moved.measure));
  Sheet sheet;
  sheet.title = fmt::format("\nThe best {} where {} is limited:", goal, in_words(moved));
  sheet.columns = {{"", in_words(moved) + ' ' + sign(moved.measure), moved_unit, "{:.5g}"},
                   {"", goal, unit_in_text(goal_unit(report.problem)), "{:.5g}"},
                   {"", "status", ""}};
  for (const TuningReport::FrontPoint& p : report.front)
    sheet.rows.push_back({p.limit,
                          number_cell(p.result.status == TuneStatus::no_trim ? nan : p.result.goal),
                          SheetCell(status_in_words(p.result.status), tone_of(p.result.status))});
  return sheet;
}

// The gains in the study's units, one row each, one column per tilt of a schedule.
Sheet gains_sheet(const TuningReport& report) {
  const TuneProblem& problem = report.problem;
  const Key over = key_of(problem, problem.schedule_over);
  Sheet sheet;
  sheet.title = report.result ? "The gains" : "The best found";
  sheet.columns = {{"gain", "gain", ""}};
  if (problem.schedule.empty()) sheet.columns.push_back({"value", "value", "", "{}"});
  for (const double at : problem.schedule)
    sheet.columns.push_back({"value",
                             fmt::format("{} = {:.6g}{}", problem.schedule_over, over.in_study(at),
                                         unit_in_text(over.unit)),
                             "", "{}"});
  sheet.columns.push_back({"unit", "unit", ""});
  for (std::size_t g = 0; g < problem.gains.size(); ++g) {
    const Key key = key_of(problem, problem.gains[g].name);
    std::vector<SheetCell> row{without_prefix(problem.gains[g].name)};
    for (const double value : values_of(problem, report.result, g))
      row.emplace_back(key.in_study(value));
    row.emplace_back(unit_in_text(key.unit));
    sheet.rows.push_back(std::move(row));
  }
  return sheet;
}

}  // namespace
}  // namespace tuning

using namespace tuning;

std::string tuning_text(const TuningReport& report, const TextStyle& style) {
  std::string text = verdict_text(report, style) + gains_text(report, style);
  if (!report.result.achieved.empty())
    text += as_text(requirements_sheet(report), style) + points_text(report, style);
  if (!report.result.effects.empty()) text += as_text(effects_sheet(report), style);
  for (const std::string& words : paragraphs(report)) text += '\n' + wrapped(words, 0, style.width);
  if (!report.front.empty()) text += as_text(front_sheet(report), style);
  return text + '\n' + wrapped(effort_in_words(report), 0, style.width);
}

std::vector<Sheet> tuning_document(const TuningReport& report) {
  std::vector<Sheet> sheets{paragraph_sheet(verdict_text(report, unwrapped))};
  if (!tuning_toml(report).empty()) sheets.push_back(gains_sheet(report));
  if (!report.result.achieved.empty()) {
    sheets.push_back(requirements_sheet(report));
    const auto [points, left_out] = points_sheet(report);
    sheets.push_back(points);
    if (left_out > 0) sheets.back().notes.push_back(and_more(left_out));
  }
  if (!report.result.effects.empty()) sheets.push_back(effects_sheet(report));
  for (const std::string& words : paragraphs(report)) sheets.push_back({"", {}, {}, {words}});
  if (!report.front.empty()) sheets.push_back(front_sheet(report));
  sheets.push_back({"", {}, {}, {effort_in_words(report)}});
  for (Sheet& sheet : sheets)  // in documents titles are captions
    if (sheet.title.ends_with(':')) sheet.title.pop_back();
  return sheets;
}

}  // namespace tiltrim
