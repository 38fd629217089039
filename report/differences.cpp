// Differences between two maps, as text, CSV and JSON.
#include <fmt/core.h>

#include <cmath>

#include "report/json.hpp"
#include "report/map_parts.hpp"

namespace tiltrim {

using json::ordered_json;

Sheet difference_sheet(const SweepMap& before, const MapDifference& d) {
  Sheet sheet;
  sheet.columns = {{"condition", "condition", ""}};
  for (const SweepAxis& axis : before.axes) {
    const SweepAxis::Column& own = axis.columns.front();
    sheet.columns.push_back({own.name, axis.name, unit_of(own), "{:.6g}"});
  }
  sheet.columns.insert(sheet.columns.end(),
                       {{"status_before", "status", "before"},
                        {"status_after", "", "after"},
                        {"verdict_before", "verdict", "before"},
                        {"verdict_after", "", "after"},
                        {"abscissa_before", "largest Re λ", "before", "{:.6g}"},
                        {"abscissa_after", "", "after", "{:.6g}"}});
  for (const PointDifference& p : d.changed) {
    const std::vector<std::size_t> at = before.position(p.point);
    std::vector<SheetCell> row{before.conditions[at[0]]};
    for (std::size_t a = 0; a < before.axes.size(); ++a)
      row.emplace_back(before.axes[a].columns.front().values[at[a + 1]]);
    row.emplace_back(to_string(p.status_before));
    row.emplace_back(to_string(p.status_after));
    row.emplace_back(verdict_name(p.verdict_before));
    row.emplace_back(verdict_name(p.verdict_after));
    for (const double v : {p.abscissa_before, p.abscissa_after})
      row.push_back(std::isnan(v) ? SheetCell() : SheetCell(v));
    sheet.rows.push_back(std::move(row));
  }
  return sheet;
}

namespace {

// "h = 12.5 m, K_Lp = 0.5"
std::string place_in_words(const SweepMap& map, const std::vector<double>& at) {
  std::string words;
  for (std::size_t a = 0; a < at.size(); ++a) {
    const std::string unit = unit_of(map.axes[a].columns.front());
    words += fmt::format("{}{} = {:.6g}{}{}", words.empty() ? "" : ", ", map.axes[a].name, at[a],
                         unit.empty() || unit == "°" ? "" : " ", unit);
  }
  return words;
}

constexpr std::size_t most_changed = 20;  // printed

std::string largest_change(const SweepMap& before, const MapDifference& d) {
  std::string words =
      fmt::format("largest change of the largest real part: {:.6g} 1/s", d.largest_abscissa_change);
  if (!(d.largest_abscissa_change > 0)) return words;
  const std::vector<std::size_t> at = before.position(d.largest_at);
  std::vector<double> where;
  for (std::size_t a = 0; a < before.axes.size(); ++a)
    where.push_back(before.axes[a].columns.front().values[at[a + 1]]);
  return words + fmt::format(", {} at {}", before.conditions[at[0]], place_in_words(before, where));
}

std::string in_words(const SweepMap& before, const MapDifference& d) {
  return fmt::format(
      "{} of {} points changed status or stability\n{}\n"
      "crossings: {} moved, {} appeared, {} vanished\n",
      d.changed.size(), d.compared, largest_change(before, d), d.moved.size(), d.appeared.size(),
      d.vanished.size());
}

// The first changes, and the number of the others.
Sheet first_changes(const SweepMap& before, const MapDifference& d) {
  Sheet sheet = difference_sheet(before, d);
  if (sheet.rows.size() > most_changed) sheet.rows.resize(most_changed);
  return sheet;
}

std::string and_more(const MapDifference& d) {
  return d.changed.size() <= most_changed ? ""
                                          : fmt::format("... and {} more: --format csv lists all",
                                                        d.changed.size() - most_changed);
}

}  // namespace

std::string difference_text(const SweepMap& before, const MapDifference& d,
                            const TextStyle& style) {
  const std::string text = in_words(before, d);
  if (d.changed.empty()) return text;
  const std::string more = and_more(d);
  return text + "\n" + as_text(first_changes(before, d), style) + (more.empty() ? "" : more + "\n");
}

std::vector<Sheet> difference_document(const SweepMap& before, const MapDifference& d) {
  std::vector<Sheet> sheets{paragraph_sheet(in_words(before, d))};
  if (d.changed.empty()) return sheets;
  sheets.push_back(first_changes(before, d));
  sheets.back().title = "Points that changed";
  if (const std::string more = and_more(d); !more.empty()) sheets.back().notes.push_back(more);
  return sheets;
}

std::string difference_json(const SweepMap& before, const MapDifference& d) {
  ordered_json all{{"compared", d.compared},
                   {"largest_abscissa_change", d.largest_abscissa_change}};
  all["changed"] = ordered_json::array();
  for (const PointDifference& p : d.changed) {
    const std::vector<std::size_t> at = before.position(p.point);
    ordered_json point{{"condition", before.conditions[at[0]]}};
    for (std::size_t a = 0; a < before.axes.size(); ++a)
      point[before.axes[a].columns.front().name] = before.axes[a].columns.front().values[at[a + 1]];
    point["status"] = {to_string(p.status_before), to_string(p.status_after)};
    point["verdict"] = {verdict_name(p.verdict_before), verdict_name(p.verdict_after)};
    point["spectral_abscissa"] = {p.abscissa_before, p.abscissa_after};
    all["changed"].push_back(point);
  }
  const auto list = [&](const std::vector<AxisCrossing>& crossings) {
    ordered_json array = ordered_json::array();
    for (const AxisCrossing& c : crossings) array.push_back(crossing_json(before, c));
    return array;
  };
  all["appeared"] = list(d.appeared);
  all["vanished"] = list(d.vanished);
  all["moved"] = ordered_json::array();
  for (const MapDifference::Moved& m : d.moved)
    all["moved"].push_back(
        {{"before", crossing_json(before, m.before)}, {"after", crossing_json(before, m.after)}});
  return all.dump(1) + "\n";
}

}  // namespace tiltrim
