#include "report/quality_sheets.hpp"

#include <fmt/core.h>

#include <cmath>

#include "report/json.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

Tone tone_of(Level level) {
  switch (level) {
    case Level::one:
      return Tone::good;
    case Level::undecided:
    case Level::not_judged:
      return Tone::doubtful;
    default:
      return Tone::bad;
  }
}

const std::vector<SheetColumn>& quality_columns() {
  static const std::vector<SheetColumn> all{{"criterion", "criterion", ""},
                                            {"value", "value", "", "{:.5g}"},
                                            {"unit", "unit", ""},
                                            {"level", "level", ""},
                                            {"distance", "distance", "", "{:.3g}"},
                                            {"border", "border", ""},
                                            {"requirement", "requirement", ""}};
  return all;
}

// "1|2": between level 1 and 2; "3|": between level 3 and none.
std::string border_name(const Criterion& c) {
  if (c.margins.empty()) return "";
  const std::size_t k = c.nearest();
  return k + 1 < c.margins.size() ? fmt::format("{}|{}", k + 1, k + 2) : fmt::format("{}|", k + 1);
}

std::vector<SheetCell> row_of(const Criterion& c) {
  return {SheetCell(c.name),         number_cell(c.value),
          SheetCell(c.unit),         SheetCell(to_string(c.level), tone_of(c.level)),
          number_cell(c.distance()), SheetCell(border_name(c)),
          SheetCell(c.requirement)};
}

std::string located_in_words(const Bounded& l, const char* unit) {
  return std::isfinite(l.value) ? fmt::format("{:.4g} {}", l.value, unit) : "not reached";
}

void add_notes(const JudgedQualities& j, Sheet& sheet) {
  const Qualities& q = j.qualities;
  sheet.notes.push_back(fmt::format("level {}; class {}, category {}, {}", to_string(q.level),
                                    to_string(j.options.aircraft), to_string(j.options.category),
                                    to_string(j.options.regime)));
  for (const Criterion& c : q.criteria)
    if (!c.remark.empty()) sheet.notes.push_back(c.name + ": " + c.remark);
  if (!std::isnan(q.n_per_alpha.value))
    sheet.notes.push_back(fmt::format("n/alpha {:.5g} g/rad", q.n_per_alpha.value));
  if (q.bandwidth.known)
    sheet.notes.push_back(fmt::format(
        "pitch attitude: bandwidth {} (phase {}, gain {}), phase delay {:.4g} s",
        located_in_words(q.bandwidth.bandwidth, "rad/s"),
        located_in_words(q.bandwidth.phase_bandwidth, "rad/s"),
        located_in_words(q.bandwidth.gain_bandwidth, "rad/s"), q.bandwidth.phase_delay.value));
  for (const std::string& remark : q.remarks) sheet.notes.push_back(remark);
}

Sheet sheet_of(const ConditionReport& r) {
  Sheet sheet{r.answer.condition.name, {}, {}, {}};
  if (!r.qualities) {
    const std::string& why = r.linear ? r.linear->message : r.answer.trim.message;
    sheet.notes = {"no linear model" + (why.empty() ? "" : ": " + why)};
    return sheet;
  }
  if (r.qualities->qualities.status != QualitiesStatus::judged) {
    sheet.notes = {"no longitudinal mode: no mode has most of its participation in the roles"};
    return sheet;
  }
  sheet.columns = quality_columns();
  for (const Criterion& c : r.qualities->qualities.criteria) sheet.rows.push_back(row_of(c));
  add_notes(*r.qualities, sheet);
  return sheet;
}

ordered_json number_json(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json();
}

ordered_json level_json(Level level) {
  return int(level) >= 1 && int(level) <= 3 ? ordered_json(int(level))
                                            : ordered_json(to_string(level));
}

ordered_json criterion_json(const Criterion& c) {
  ordered_json j{{"name", c.name},
                 {"requirement", c.requirement},
                 {"value", number_json(c.value)},
                 {"error", number_json(c.error)},
                 {"unit", c.unit},
                 {"level", level_json(c.level)},
                 {"distance", number_json(c.distance())},
                 {"border", border_name(c)},
                 {"margins", ordered_json::array()},
                 {"margin_error", number_json(c.margin_error)},
                 {"margin_unit", c.margin_unit},
                 {"remark", c.remark}};
  for (const double m : c.margins) j["margins"].push_back(number_json(m));
  return j;
}

ordered_json oscillation_json(const Oscillation& o) {
  return {{"kind", to_string(o.kind)},
          {"frequency", number_json(o.frequency.value)},
          {"frequency_error", number_json(o.frequency.error)},
          {"damping", number_json(o.damping.value)},
          {"damping_error", number_json(o.damping.error)},
          {"message", o.message}};
}

ordered_json roots_json(const std::vector<EnclosedRoot>& roots) {
  ordered_json all = ordered_json::array();
  for (const EnclosedRoot& r : roots)
    all.push_back({{"re", number_json(r.value.real())},
                   {"im", number_json(r.value.imag())},
                   {"error", number_json(r.error)}});
  return all;
}

ordered_json located_json(const Bounded& l) {
  return {{"value", number_json(l.value)}, {"error", number_json(l.error)}};
}

ordered_json attitude_json(const Qualities& q) {
  if (!q.attitude) return nullptr;
  const Bandwidth& b = q.bandwidth;
  return {{"status", to_string(q.attitude->status)},
          {"gain", number_json(q.attitude->gain)},
          {"gain_error", number_json(q.attitude->gain_error)},
          {"relative_degree", q.attitude->relative_degree},
          {"cancelled", q.attitude->cancelled},
          {"zeros", roots_json(q.attitude->zeros)},
          {"poles", roots_json(q.attitude->poles)},
          {"bandwidth", located_json(b.bandwidth)},
          {"phase_bandwidth", located_json(b.phase_bandwidth)},
          {"gain_bandwidth", located_json(b.gain_bandwidth)},
          {"crossover", located_json(b.crossover)},
          {"phase_delay", located_json(b.phase_delay)}};
}

}  // namespace

ordered_json qualities_object(const JudgedQualities& judged) {
  const Qualities& q = judged.qualities;
  ordered_json j{{"status", to_string(q.status)},
                 {"level", level_json(q.level)},
                 {"class", to_string(judged.options.aircraft)},
                 {"category", to_string(judged.options.category)},
                 {"phase", to_string(judged.options.regime)},
                 {"airspeed", number_json(judged.options.airspeed)},
                 {"criteria", ordered_json::array()}};
  for (const Criterion& c : q.criteria) j["criteria"].push_back(criterion_json(c));
  j["short_period"] = oscillation_json(q.short_period);
  j["phugoid"] = oscillation_json(q.phugoid);
  j["n_per_alpha"] = number_json(q.n_per_alpha.value);
  j["n_per_alpha_error"] = number_json(q.n_per_alpha.error);
  j["attitude"] = attitude_json(q);
  j["shares"] = ordered_json::array();
  for (std::size_t k = 0; k < q.shares.size(); ++k)
    j["shares"].push_back({{"re", q.modes.modes[k].eigenvalue.real()},
                           {"im", q.modes.modes[k].eigenvalue.imag()},
                           {"error", number_json(q.modes.modes[k].error)},
                           {"fast", q.shares[k].fast},
                           {"slow", q.shares[k].slow}});
  j["remarks"] = q.remarks;
  return j;
}

std::vector<Sheet> qualities_document(const std::vector<ConditionReport>& conditions) {
  std::vector<Sheet> sheets;
  for (const ConditionReport& r : conditions) sheets.push_back(sheet_of(r));
  return sheets;
}

std::string qualities_text(const std::vector<ConditionReport>& conditions, const TextStyle& style) {
  std::string text;
  for (const Sheet& sheet : qualities_document(conditions))
    text += (text.empty() ? "" : "\n") + as_text(sheet, style);
  return text;
}

Sheet qualities_sheet(const std::vector<ConditionReport>& conditions) {
  Sheet sheet{"", quality_columns(), {}, {}};
  sheet.columns.insert(sheet.columns.begin(), {"condition", "condition", ""});
  sheet.columns.push_back({"error", "error", ""});
  sheet.columns.push_back({"margin_error", "error of the distance", ""});
  for (const ConditionReport& r : conditions) {
    if (!r.qualities) continue;
    for (const Criterion& c : r.qualities->qualities.criteria) {
      std::vector<SheetCell> row = row_of(c);
      row.insert(row.begin(), SheetCell(r.answer.condition.name));
      row.push_back(number_cell(c.error));
      row.push_back(number_cell(c.margin_error));
      sheet.rows.push_back(row);
    }
  }
  return sheet;
}

std::string qualities_json(const std::vector<ConditionReport>& conditions) {
  ordered_json all{{"conditions", ordered_json::array()}};
  for (const ConditionReport& r : conditions) {
    const bool linear = r.linear.has_value();
    all["conditions"].push_back(
        {{"name", r.answer.condition.name},
         {"status", to_string(r.answer.trim.status)},
         {"message", linear ? r.linear->message : r.answer.trim.message},
         {"qualities", r.qualities ? qualities_object(*r.qualities) : ordered_json()}});
  }
  return all.dump(1) + '\n';
}

Sheet borders_sheet(const SweepMap& map, const QualityLayer& layer) {
  Sheet sheet{
      "Borders of levels", {{"condition", "condition", ""}, {"along", "along", ""}}, {}, {}};
  for (const SweepAxis& axis : map.axes)
    sheet.columns.push_back({axis.name, axis.name, axis.columns.front().unit, "{:.10g}"});
  sheet.columns.push_back({"error", "error", "", "{:.1e}"});
  sheet.columns.push_back({"criterion", "criterion", ""});
  sheet.columns.push_back({"border", "border", ""});
  sheet.columns.push_back({"value", "value", "", "{:.6g}"});
  for (const QualityBorder& b : layer.borders) {
    std::vector<SheetCell> row{SheetCell(map.conditions[std::size_t(b.condition)]),
                               SheetCell(map.axes[std::size_t(b.axis)].name)};
    for (const double at : b.at) row.push_back(at);
    row.insert(row.end(), {b.error, SheetCell(b.criterion),
                           SheetCell(fmt::format("{}|{}", b.level, b.level + 1)), b.value});
    sheet.rows.push_back(row);
  }
  if (!layer.complete)
    sheet.notes.push_back(
        "borders may be missing: between two points a figure ends or is within its error of a "
        "border, or the search was stopped");
  return sheet;
}

std::string with_qualities(const std::string& map_json, const SweepMap& map,
                           const QualityLayer& layer) {
  ordered_json j = ordered_json::parse(map_json);
  ordered_json levels = ordered_json::array(), borders = ordered_json::array();
  for (const Level level : layer.level) levels.push_back(level_json(level));
  for (const QualityBorder& b : layer.borders)
    borders.push_back({{"condition", map.conditions[std::size_t(b.condition)]},
                       {"axis", map.axes[std::size_t(b.axis)].name},
                       {"at", b.at},
                       {"error", number_json(b.error)},
                       {"criterion", b.criterion},
                       {"border", fmt::format("{}|{}", b.level, b.level + 1)},
                       {"value", b.value},
                       {"unit", b.unit}});
  j["qualities"] = {{"level", levels}, {"borders", borders}, {"complete", layer.complete}};
  return j.dump(1) + '\n';
}

}  // namespace tiltrim
