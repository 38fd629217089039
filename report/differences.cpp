#include "report/differences.hpp"

#include <fmt/core.h>

#include <array>
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
    for (const double v : {p.abscissa_before, p.abscissa_after}) row.push_back(number_cell(v));
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

std::string in_words(const CrossingDifferences& d) {
  return fmt::format("crossings: {} moved, {} appeared, {} vanished", d.moved.size(),
                     d.appeared.size(), d.vanished.size());
}

std::string and_more(const Sheet& changes) {
  return changes.rows.size() <= most_changed
             ? ""
             : fmt::format("... and {} more: --format csv lists all",
                           changes.rows.size() - most_changed);
}

std::string in_words(const SweepMap& before, const MapDifference& d) {
  return fmt::format("{} of {} points changed status or stability\n{}\n{}\n", d.changed.size(),
                     d.compared, largest_change(before, d), in_words(d.crossings));
}

// The first changes, and the number of the others.
std::string text_of(const std::string& summary, Sheet changes, const TextStyle& style) {
  if (changes.rows.empty()) return summary;
  const std::string more = and_more(changes);
  if (changes.rows.size() > most_changed) changes.rows.resize(most_changed);
  return summary + "\n" + as_text(changes, style) + (more.empty() ? "" : more + "\n");
}

std::vector<Sheet> document_of(const std::string& summary, Sheet changes) {
  std::vector<Sheet> sheets{paragraph_sheet(summary)};
  if (changes.rows.empty()) return sheets;
  changes.title = "Points that changed";
  if (const std::string more = and_more(changes); !more.empty()) changes.notes.push_back(more);
  if (changes.rows.size() > most_changed) changes.rows.resize(most_changed);
  sheets.push_back(std::move(changes));
  return sheets;
}

void add_crossings(ordered_json& all, const SweepMap& map, const CrossingDifferences& d) {
  const auto list = [&](const std::vector<AxisCrossing>& crossings) {
    ordered_json array = ordered_json::array();
    for (const AxisCrossing& c : crossings) array.push_back(crossing_json(map, c));
    return array;
  };
  all["appeared"] = list(d.appeared);
  all["vanished"] = list(d.vanished);
  all["moved"] = ordered_json::array();
  for (const CrossingDifferences::Moved& m : d.moved)
    all["moved"].push_back(
        {{"before", crossing_json(map, m.before)}, {"after", crossing_json(map, m.after)}});
}

}  // namespace

std::string difference_text(const SweepMap& before, const MapDifference& d,
                            const TextStyle& style) {
  return text_of(in_words(before, d), difference_sheet(before, d), style);
}

std::vector<Sheet> difference_document(const SweepMap& before, const MapDifference& d) {
  return document_of(in_words(before, d), difference_sheet(before, d));
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
  add_crossings(all, before, d.crossings);
  return all.dump(1) + "\n";
}

// ---- verdicts alone ----

namespace {

constexpr std::array<int, 4> verdicts{0, 1, 2, -1};  // in the order of VerdictCounts

std::string in_words(const VerdictMap& before, const VerdictDifference& d) {
  std::string words = fmt::format("{} of {} points changed stability\n", d.changed(), d.compared());
  for (std::size_t a = 0; a < verdicts.size(); ++a)
    for (std::size_t b = 0; b < verdicts.size(); ++b)
      if (a != b && d.counts[a][b] > 0)
        words += fmt::format("  {}, now {}: {}\n", verdict_name(verdicts[a]),
                             verdict_name(verdicts[b]), d.counts[a][b]);
  if (d.lines_not_located == before.located.size())
    return words + "crossings: not compared; no line has all of them located in both maps\n";
  words += in_words(d.crossings);
  if (d.lines_not_located > 0)
    words += fmt::format("; not compared on {} of {}, where they are not all located in both maps",
                         d.lines_not_located, number_of(before.located.size(), "line"));
  return words + "\n";
}

}  // namespace

Sheet difference_sheet(const VerdictMap& before, const VerdictDifference& d) {
  const SweepMap& grid = before.grid;
  const SweepAxis::Column& own = grid.axes.back().columns.front();
  Sheet sheet;
  sheet.columns = {{"condition", "condition", ""}};
  for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a) {
    const SweepAxis::Column& column = grid.axes[a].columns.front();
    sheet.columns.push_back({column.name, grid.axes[a].name, unit_of(column), "{:.6g}"});
  }
  sheet.columns.insert(sheet.columns.end(), {{own.name + "_from", grid.axes.back().name + " from",
                                              unit_of(own), "{:.6g}"},
                                             {own.name + "_to", "to", unit_of(own), "{:.6g}"},
                                             {"points", "points", ""},
                                             {"verdict_before", "verdict", "before"},
                                             {"verdict_after", "", "after"}});
  for (const VerdictStretch& stretch : d.stretches) {
    const std::vector<std::size_t> at = grid.position(stretch.line * grid.axes.back().size());
    std::vector<SheetCell> row{grid.conditions[at[0]]};
    for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a)
      row.emplace_back(grid.axes[a].columns.front().values[at[a + 1]]);
    row.emplace_back(own.values[stretch.from]);
    row.emplace_back(own.values[stretch.to]);
    row.emplace_back(double(stretch.to - stretch.from + 1));
    row.emplace_back(verdict_name(stretch.before));
    row.emplace_back(verdict_name(stretch.after));
    sheet.rows.push_back(std::move(row));
  }
  return sheet;
}

std::string difference_text(const VerdictMap& before, const VerdictDifference& d,
                            const TextStyle& style) {
  return text_of(in_words(before, d), difference_sheet(before, d), style);
}

std::vector<Sheet> difference_document(const VerdictMap& before, const VerdictDifference& d) {
  return document_of(in_words(before, d), difference_sheet(before, d));
}

std::string difference_json(const VerdictMap& before, const VerdictDifference& d) {
  const SweepMap& grid = before.grid;
  const SweepAxis::Column& own = grid.axes.back().columns.front();
  ordered_json all{{"compared", d.compared()}, {"detail", "verdict"}};
  all["changed"] = ordered_json::array();
  for (const VerdictStretch& stretch : d.stretches) {
    const std::vector<std::size_t> at = grid.position(stretch.line * grid.axes.back().size());
    ordered_json one{{"condition", grid.conditions[at[0]]}};
    for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a)
      one[grid.axes[a].columns.front().name] = grid.axes[a].columns.front().values[at[a + 1]];
    one[own.name] = {own.values[stretch.from], own.values[stretch.to]};
    one["points"] = stretch.to - stretch.from + 1;
    one["verdict"] = {verdict_name(stretch.before), verdict_name(stretch.after)};
    all["changed"].push_back(one);
  }
  all["lines"] = {{"number", before.located.size()}, {"not_located", d.lines_not_located}};
  add_crossings(all, grid, d.crossings);
  return all.dump(1) + "\n";
}

}  // namespace tiltrim
