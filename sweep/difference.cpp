#include "sweep/difference.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "sweep/verdict_runs.hpp"

namespace tiltrim {

namespace {

[[noreturn]] void incomparable(const std::string& what, const std::string& before,
                               const std::string& after) {
  throw std::invalid_argument(
      fmt::format("the maps cannot be compared: {} {} before, {} after", what, before, after));
}

void check_same(const std::string& what, const std::vector<std::string>& before,
                const std::vector<std::string>& after) {
  if (before != after)
    incomparable(what, fmt::format("[{}]", fmt::join(before, ", ")),
                 fmt::format("[{}]", fmt::join(after, ", ")));
}

void check_same(const SweepAxis::Column& before, const SweepAxis::Column& after) {
  const std::size_t count = before.values.size();
  if (after.values.size() != count)
    incomparable("points of " + before.name, std::to_string(count),
                 std::to_string(after.values.size()));
  for (std::size_t i = 0; i < count; ++i)
    if (before.values[i] != after.values[i])
      incomparable(fmt::format("value {} of {}", i + 1, before.name),
                   fmt::format("{}", before.values[i]), fmt::format("{}", after.values[i]));
}

void check_comparable(const SweepMap& before, const SweepMap& after) {
  check_same("conditions", before.conditions, after.conditions);
  check_same("states", names(before.states), names(after.states));
  const auto columns_of = [](const SweepMap& map) {
    std::vector<std::string> columns;
    for (const SweepAxis& axis : map.axes) {
      columns.push_back(axis.columns.front().name);
      for (std::size_t c = 1; c < axis.columns.size(); ++c)
        columns.push_back("with " + axis.columns[c].name);
    }
    return columns;
  };
  check_same("axes", columns_of(before), columns_of(after));
  for (std::size_t a = 0; a < before.axes.size(); ++a)
    for (std::size_t c = 0; c < before.axes[a].columns.size(); ++c)
      check_same(before.axes[a].columns[c], after.axes[a].columns[c]);
}

void compare_points(const SweepMap& before, const SweepMap& after, MapDifference& answer) {
  answer.compared = before.points();
  for (std::size_t p = 0; p < answer.compared; ++p) {
    const double a = before.spectral_abscissa[p], b = after.spectral_abscissa[p];
    if (before.status[p] != after.status[p] || before.verdict[p] != after.verdict[p])
      answer.changed.push_back({p, TrimStatus(before.status[p]), TrimStatus(after.status[p]),
                                before.verdict[p], after.verdict[p], a, b});
    if (before.verdict[p] < 0 || after.verdict[p] < 0) continue;
    const double change = std::abs(b - a);
    if (!(change > answer.largest_abscissa_change)) continue;
    answer.largest_abscissa_change = change;
    answer.largest_at = p;
  }
}

/// Two crossings can only match if they have the same kind and the same line: condition, axis and
/// coordinates along the other axes.
using Line = std::tuple<int, int, CrossingKind, std::vector<double>>;

Line line_of(const AxisCrossing& crossing) {
  std::vector<double> others = crossing.at;
  others[std::size_t(crossing.axis)] = 0.0;
  return {crossing.condition, crossing.axis, crossing.kind, others};
}

double place(const AxisCrossing& crossing) { return crossing.at[std::size_t(crossing.axis)]; }

using Numbers = std::vector<std::size_t>;

// The matching crossing of `to` for each crossing of `from`, if any: nearest pairs first.
std::map<std::size_t, std::size_t> nearest_pairs(const std::vector<AxisCrossing>& before,
                                                 const Numbers& from,
                                                 const std::vector<AxisCrossing>& after,
                                                 const Numbers& to) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> all;
  for (const std::size_t i : from)
    for (const std::size_t j : to)
      all.emplace_back(std::abs(place(before[i]) - place(after[j])), i, j);
  std::ranges::sort(all);
  std::map<std::size_t, std::size_t> pairs;
  std::vector<std::size_t> used;
  for (const auto& [distance, i, j] : all)
    if (!pairs.contains(i) && std::ranges::find(used, j) == used.end()) {
      pairs[i] = j;
      used.push_back(j);
    }
  return pairs;
}

void compare_crossings(const std::vector<AxisCrossing>& before,
                       const std::vector<AxisCrossing>& after, CrossingDifferences& answer) {
  std::map<Line, std::pair<Numbers, Numbers>> lines;
  for (std::size_t i = 0; i < before.size(); ++i) lines[line_of(before[i])].first.push_back(i);
  for (std::size_t j = 0; j < after.size(); ++j) lines[line_of(after[j])].second.push_back(j);
  std::map<std::size_t, std::size_t> pairs;
  for (const auto& [line, both] : lines)
    pairs.merge(nearest_pairs(before, both.first, after, both.second));

  std::vector<bool> paired(after.size(), false);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto found = pairs.find(i);
    if (found == pairs.end()) {
      answer.vanished.push_back(before[i]);
      continue;
    }
    const AxisCrossing &a = before[i], &b = after[found->second];
    paired[found->second] = true;
    if (place(a) != place(b) || a.unstable_before != b.unstable_before ||
        a.unstable_after != b.unstable_after)
      answer.moved.push_back({a, b});
  }
  for (std::size_t j = 0; j < after.size(); ++j)
    if (!paired[j]) answer.appeared.push_back(after[j]);
}

// ---- verdicts alone ----

using Run = std::pair<std::int8_t, std::size_t>;  // verdict, points

std::vector<Run> next_line(const VerdictMap& map, std::size_t& at) {
  std::vector<Run> runs;
  each_run(map.runs, at, map.grid.axes.back().size(),
           [&](std::int8_t code, std::size_t length) { runs.emplace_back(code, length); });
  return runs;
}

void compare_line(std::size_t line, const std::vector<Run>& before, const std::vector<Run>& after,
                  VerdictDifference& answer) {
  const auto place_of = [](std::int8_t code) { return code < 0 ? 3 : std::size_t(code); };
  std::size_t i = 0, j = 0, point = 0, end_i = before[0].second, end_j = after[0].second;
  while (i < before.size()) {
    const std::size_t end = std::min(end_i, end_j);
    const std::int8_t a = before[i].first, b = after[j].first;
    answer.counts[place_of(a)][place_of(b)] += end - point;
    if (a != b) answer.stretches.push_back({line, point, end - 1, a, b});
    point = end;
    if (end_i == point && ++i < before.size()) end_i += before[i].second;
    if (end_j == point && ++j < after.size()) end_j += after[j].second;
  }
}

// The number of a crossing's line in the map: its coordinates along all axes but the last.
std::size_t line_number(const SweepMap& grid, const AxisCrossing& crossing) {
  auto line = std::size_t(crossing.condition);
  for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a) {
    const std::vector<double>& values = grid.axes[a].columns.front().values;
    const auto found = std::ranges::find(values, crossing.at[a]);
    if (found == values.end())
      throw std::runtime_error("a crossing of the map is not on a line of its grid");
    line = line * values.size() + std::size_t(found - values.begin());
  }
  return line;
}

std::vector<AxisCrossing> on_lines(const VerdictMap& map, const std::vector<bool>& lines) {
  std::vector<AxisCrossing> found;
  for (const AxisCrossing& crossing : map.grid.crossings)
    if (lines[line_number(map.grid, crossing)]) found.push_back(crossing);
  return found;
}

}  // namespace

MapDifference difference(const SweepMap& before, const SweepMap& after) {
  check_comparable(before, after);
  MapDifference answer;
  compare_points(before, after, answer);
  compare_crossings(before.crossings, after.crossings, answer.crossings);
  return answer;
}

std::uint64_t VerdictDifference::compared() const {
  std::uint64_t points = 0;
  for (const VerdictCounts& row : counts)
    for (const std::uint64_t n : row) points += n;
  return points;
}

std::uint64_t VerdictDifference::changed() const {
  std::uint64_t points = compared();
  for (std::size_t v = 0; v < counts.size(); ++v) points -= counts[v][v];
  return points;
}

VerdictDifference difference(const VerdictMap& before, const VerdictMap& after) {
  check_comparable(before.grid, after.grid);
  if (before.part.of > 1 || after.part.of > 1)
    throw std::invalid_argument(
        "the maps cannot be compared: a part of a map; expected whole maps");
  VerdictDifference answer;
  std::vector<bool> located;
  for (std::size_t line = 0, at_a = 0, at_b = 0; line < before.located.size(); ++line) {
    compare_line(line, next_line(before, at_a), next_line(after, at_b), answer);
    located.push_back(before.located[line] == 1 && after.located[line] == 1);
    if (!located.back()) ++answer.lines_not_located;
  }
  compare_crossings(on_lines(before, located), on_lines(after, located), answer.crossings);
  return answer;
}

}  // namespace tiltrim
