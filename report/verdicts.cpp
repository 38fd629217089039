#include "report/verdicts.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "report/json.hpp"
#include "report/map_parts.hpp"
#include "report/map_sheets.hpp"
#include "sweep/verdict_map.hpp"
#include "sweep/verdict_runs.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

std::string in_words(const VerdictCounts& c) {
  return fmt::format("{} stable, {} unstable, {} undecided, {} without trim", c[0], c[1], c[2],
                     c[3]);
}

// "along k_de: 1000 lines, 990 with all borders, 1800 borders"
std::string borders_in_words(const VerdictMap& map) {
  const std::size_t located = std::size_t(std::ranges::count(map.located, std::int8_t(1)));
  return fmt::format("along {}: {}, {} with all borders located, {} borders",
                     map.grid.axes.back().name, number_of(map.located.size(), "line"), located,
                     map.grid.crossings.size());
}

// Everything that is printed of a condition; a part has no conditions of its own.
std::vector<std::string> facts(const VerdictMap& map, std::size_t condition) {
  std::vector<std::string> all;
  for (const SweepAxis& axis : map.grid.axes) all.push_back(axis_in_words(axis));
  if (map.part.of > 1) all.push_back(fmt::format("part {} of {}", map.part.number, map.part.of));
  all.push_back(in_words(counts_of(map)[condition]));
  return all;
}

}  // namespace

std::string verdicts_text(const VerdictMap& map, const TextStyle& style) {
  std::string text;
  for (std::size_t c = 0; c < map.grid.conditions.size(); ++c) {
    text += (c > 0 ? "\n" : "") + map.grid.conditions[c] + "\n";
    for (const std::string& fact : facts(map, c)) text += wrapped(fact, 2, style.width);
  }
  if (!map.grid.crossings.empty() || std::ranges::count(map.located, std::int8_t(1)) > 0)
    text += wrapped(borders_in_words(map), 2, style.width);
  return text;
}

std::vector<Sheet> verdicts_document(const VerdictMap& map) {
  std::vector<Sheet> sheets;
  for (std::size_t c = 0; c < map.grid.conditions.size(); ++c)
    sheets.push_back({map.grid.conditions[c], {}, {}, facts(map, c)});
  sheets.back().notes.push_back(borders_in_words(map));
  return sheets;
}

Sheet verdicts_sheet(const VerdictMap& map) {
  const SweepMap& grid = map.grid;
  Sheet sheet;
  sheet.columns = {{"condition", "", ""}};
  for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a)
    for (const SweepAxis::Column& column : grid.axes[a].columns)
      sheet.columns.push_back({column.name, "", ""});
  const SweepAxis::Column& own = grid.axes.back().columns.front();
  sheet.columns.insert(sheet.columns.end(), {{own.name + "_from", "", ""},
                                             {own.name + "_to", "", ""},
                                             {"points", "", ""},
                                             {"verdict", "", ""}});
  const std::size_t points = grid.axes.back().size();
  std::size_t at = 0;
  for (std::size_t line = 0; line < map.located.size(); ++line) {
    const std::vector<std::size_t> place = grid.position(line * points);
    std::vector<SheetCell> row{grid.conditions[place[0]]};
    for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a)
      for (const SweepAxis::Column& column : grid.axes[a].columns)
        row.emplace_back(column.values[place[a + 1]]);
    std::size_t k = 0;
    each_run(map.runs, at, points, [&](std::int8_t code, std::size_t length) {
      sheet.rows.push_back(row);
      std::vector<SheetCell>& cells = sheet.rows.back();
      cells.emplace_back(own.values[k]);
      cells.emplace_back(own.values[k + length - 1]);
      cells.emplace_back(double(length));
      cells.emplace_back(verdict_name(code));
      k += length;
    });
  }
  return sheet;
}

std::string verdicts_json(const VerdictMap& map) {
  ordered_json all{{"program", map.grid.program},
                   {"detail", "verdict"},
                   {"conditions", map.grid.conditions},
                   {"axes", axes_json(map.grid)}};
  for (const VerdictCounts& c : counts_of(map))
    all["verdicts"].push_back(
        {{"stable", c[0]}, {"unstable", c[1]}, {"undecided", c[2]}, {"no_trim", c[3]}});
  all["lines"] = {{"number", map.located.size()},
                  {"borders_located", std::ranges::count(map.located, std::int8_t(1))}};
  all["crossings"] = ordered_json::array();
  for (const AxisCrossing& c : map.grid.crossings)
    all["crossings"].push_back(crossing_json(map.grid, c));
  return all.dump(1) + "\n";
}

}  // namespace tiltrim
