#include "report/map_sheets.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "report/map_parts.hpp"

namespace tiltrim {

std::string verdict_name(int verdict) {
  return verdict < 0 ? "" : to_string(static_cast<Verdict>(verdict));
}

std::string unit_of(const SweepAxis::Column& column) {
  return column.unit == "degrees" ? "°" : column.unit;
}

std::string status_name(int status) {
  return status < 0 ? "not_reached" : to_string(static_cast<TrimStatus>(status));
}

namespace {

Tone tone_of(IntervalVerdict verdict) {
  switch (verdict) {
    case IntervalVerdict::stable:
      return Tone::good;
    case IntervalVerdict::unstable:
      return Tone::bad;
    default:
      return Tone::doubtful;
  }
}

std::size_t count(const SweepMap& map, std::size_t condition, int verdict) {
  const std::size_t n = map.points_per_condition();
  const auto first = map.verdict.begin() + std::ptrdiff_t(condition * n);
  return std::size_t(std::count(first, first + std::ptrdiff_t(n), std::int8_t(verdict)));
}

}  // namespace

std::string axis_in_words(const SweepAxis& axis) {
  const SweepAxis::Column& own = axis.columns.front();
  std::string words = fmt::format("{} from {:.6g} to {:.6g}{}{}", own.name, own.values.front(),
                                  own.values.back(), own.unit.empty() ? "" : " ", own.unit);
  for (std::size_t c = 1; c < axis.columns.size(); ++c)
    words += (c == 1 ? " (with " : ", ") + axis.columns[c].name;
  return words + (axis.columns.size() > 1 ? ")" : "") + ", " + number_of(axis.size(), "point");
}

std::string counts_in_words(const SweepMap& map, std::size_t c) {
  std::string words =
      fmt::format("{} stable, {} unstable, {} undecided, {} without trim",
                  count(map, c, int(Verdict::stable)), count(map, c, int(Verdict::unstable)),
                  count(map, c, int(Verdict::undecided)), count(map, c, -1));
  const std::size_t n = map.points_per_condition();
  const std::size_t second = std::size_t(
      std::ranges::count_if(map.second.points, [&](std::uint64_t p) { return p / n == c; }));
  if (second > 0) words += fmt::format("; a second equilibrium at {}", second);
  return words;
}

Threw threw(const SweepMap& map, std::size_t first, std::size_t last) {
  Threw all;
  for (std::size_t p = first; p < last; ++p) {
    if (map.status[p] != std::int8_t(TrimStatus::model_threw)) continue;
    const std::string& words = map.reasons[std::size_t(map.reason[p])];
    if (++all.points == 1) all.first = words;
    all.alike = all.alike && words == all.first;
  }
  return all;
}

std::vector<std::string> reasons_of(const SweepMap& map, std::size_t c) {
  std::vector<std::pair<std::size_t, std::size_t>> counts(map.reasons.size());
  for (std::size_t r = 0; r < counts.size(); ++r) counts[r] = {0, r};
  const std::size_t n = map.points_per_condition();
  for (std::size_t p = c * n; p < (c + 1) * n; ++p)
    if (map.reason[p] > 0 && map.status[p] != std::int8_t(TrimStatus::model_threw))
      ++counts[std::size_t(map.reason[p])].first;
  std::ranges::stable_sort(counts, std::greater{}, [](const auto& r) { return r.first; });
  constexpr std::size_t most = 3;
  std::vector<std::string> reasons;
  if (const Threw all = threw(map, c * n, (c + 1) * n); all.points > 0)
    reasons.push_back(fmt::format("{} x {}{}", all.points, all.first,
                                  all.alike ? "" : " (the first one; others differ)"));
  std::size_t left = 0;
  for (const auto& [times, r] : counts) {
    if (times > 0 && reasons.size() < most)
      reasons.push_back(fmt::format("{} x {}", times, map.reasons[r]));
    else
      left += times;
  }
  if (left > 0)
    reasons.push_back(
        fmt::format("{} point{} for other reasons: see reason_text", left, left == 1 ? "" : "s"));
  return reasons;
}

namespace {

constexpr double rounding = 1e-15;

// The located crossing at an end of the interval, or null.
const AxisCrossing* crossing_at(const SweepMap& map, const AxisInterval& i, double end) {
  const auto found = std::ranges::find_if(map.crossings, [&](const AxisCrossing& c) {
    return c.condition == i.condition && c.axis == i.axis &&
           std::abs(c.at[std::size_t(i.axis)] - end) <= c.error + rounding * std::abs(end);
  });
  return found == map.crossings.end() ? nullptr : &*found;
}

// Largest real part; zero, not its rounding error, where an eigenvalue crosses the axis.
double abscissa_of(const SweepMap& map, const AxisInterval& i) {
  for (const double end : {i.from, i.to}) {
    const bool at_end = i.abscissa_at == end && i.verdict != IntervalVerdict::undecided;
    const AxisCrossing* c = at_end ? crossing_at(map, i, end) : nullptr;
    if (c && c->kind != CrossingKind::jump && c->kind != CrossingKind::end) return 0.0;
  }
  return i.abscissa;
}

// Where it is; zero, not the rounding error of the search, at zero.
double abscissa_at(const SweepMap& map, const AxisInterval& i) {
  const std::vector<double>& own = map.axes[std::size_t(i.axis)].columns.front().values;
  const double precision = 1e-6 * std::abs(own.back() - own.front());  // of the search
  return std::abs(i.abscissa_at) < precision ? 0.0 : i.abscissa_at;
}

}  // namespace

Sheet intervals_sheet(const SweepMap& map, std::size_t condition, std::size_t axis) {
  const SweepAxis::Column& own = map.axes[axis].columns.front();
  Sheet sheet;
  sheet.title = fmt::format("Intervals along {} (ends located between grid points)", own.name);
  sheet.columns = {{"from", "from", unit_of(own), "{:.9g}"},
                   {"to", "to", unit_of(own), "{:.9g}"},
                   {"verdict", "verdict", ""},
                   {"unstable", "unstable", "", "{:.0f}"},
                   {"abscissa", "largest Re λ", "1/s", "{:.6g}"},
                   {"abscissa_at", "at", unit_of(own), "{:.7g}"},
                   {"ends", "ends with", ""}};
  for (const AxisInterval& i : map.intervals) {
    if (i.condition != int(condition) || i.axis != int(axis)) continue;
    const AxisCrossing* crossing = crossing_at(map, i, i.to);
    std::string ends;
    if (crossing) {
      ends = to_string(crossing->kind);
      if (crossing->kind == CrossingKind::hopf)
        ends = "±" + number_text(crossing->frequency, "{:.5f}") + "i";
      if (!crossing->mode_name.empty()) ends += ", " + crossing->mode_name;
      if (crossing->error > 0) ends += fmt::format(" (±{:.0e})", crossing->error);
    }
    const bool trimmed = i.verdict != IntervalVerdict::no_trim;
    sheet.rows.push_back({i.from, i.to, SheetCell(to_string(i.verdict), tone_of(i.verdict)),
                          trimmed ? SheetCell(double(i.unstable)) : SheetCell(),
                          std::isfinite(i.abscissa) ? SheetCell(abscissa_of(map, i)) : SheetCell(),
                          std::isfinite(i.abscissa) ? SheetCell(abscissa_at(map, i)) : SheetCell(),
                          ends});
  }
  return sheet;
}

std::string line_in_words(const SweepMap& map, std::size_t condition, std::size_t axis) {
  double stable = 0, unstable = 0, rest = 0;
  std::size_t intervals = 0;
  const AxisInterval* least = nullptr;
  for (const AxisInterval& i : map.intervals) {
    if (i.condition != int(condition) || i.axis != int(axis)) continue;
    const double length = std::abs(i.to - i.from);
    if (std::isfinite(i.abscissa) && (!least || i.abscissa > least->abscissa)) least = &i;
    if (i.verdict == IntervalVerdict::unstable) unstable += length, ++intervals;
    if (i.verdict == IntervalVerdict::stable) stable += length;
    if (i.verdict != IntervalVerdict::stable && i.verdict != IntervalVerdict::unstable)
      rest += length;
  }
  const SweepAxis::Column& own = map.axes[axis].columns.front();
  const std::string unit = unit_of(own), spaced = unit.empty() || unit == "°" ? unit : " " + unit;
  const auto measured = [&](double value) { return fmt::format("{:.3g}{}", value, spaced); };
  const std::string range =
      fmt::format("[{:.6g}, {:.6g}]{}", own.values.front(), own.values.back(), spaced);
  const std::string worst =
      least ? fmt::format("; largest Re λ {:.3g} 1/s at {} = {}", abscissa_of(map, *least),
                          own.name, measured(abscissa_at(map, *least)))
            : "";
  if (unstable == 0 && rest == 0) return fmt::format("stable throughout {}{}", range, worst);
  if (unstable == 0 && stable == 0) return fmt::format("no trim or undecided throughout {}", range);
  if (unstable == 0)
    return "stable on " + range + " except for " + measured(rest) +
           ", which has no trim or is undecided";
  std::string words = fmt::format("unstable in {} of {}, {} in total",
                                  number_of(intervals, "interval"), range, measured(unstable));
  if (rest > 0) words += "; no trim or undecided on " + measured(rest);
  return words + worst;
}

namespace {

// For grids of several axes: the number of lines along each axis that are stable throughout.
std::string lines_in_words(const SweepMap& map, std::size_t condition, std::size_t axis) {
  std::size_t lines = 0, crossings = 0, doubtful = 0, stable = 0;
  const std::vector<double>& own = map.axes[axis].columns.front().values;
  for (const AxisInterval& i : map.intervals) {
    if (i.condition != int(condition) || i.axis != int(axis)) continue;
    if (i.from == own.front()) ++lines;
    if (i.verdict == IntervalVerdict::undecided) ++doubtful;
    if (i.verdict == IntervalVerdict::stable && i.from == own.front() && i.to == own.back())
      ++stable;
  }
  for (const AxisCrossing& c : map.crossings)
    if (c.condition == int(condition) && c.axis == int(axis)) ++crossings;
  return fmt::format("along {}: {}, {} stable throughout, {} located{}", map.axes[axis].name,
                     number_of(lines, "line"), stable, number_of(crossings, "crossing"),
                     doubtful > 0 ? ", " + number_of(doubtful, "interval") + " undecided" : "");
}

}  // namespace

std::string map_text(const SweepMap& map, const TextStyle& style) {
  std::string text;
  for (std::size_t c = 0; c < map.conditions.size(); ++c) {
    text += (c > 0 ? "\n" : "") + map.conditions[c] + "\n";
    for (const SweepAxis& axis : map.axes) text += wrapped(axis_in_words(axis), 2, style.width);
    text += wrapped(counts_in_words(map, c), 2, style.width);
    for (const std::string& reason : reasons_of(map, c)) text += wrapped(reason, 2, style.width);
    if (map.intervals.empty()) continue;
    if (map.axes.size() > 1) {
      for (std::size_t a = 0; a < map.axes.size(); ++a)
        text += wrapped(lines_in_words(map, c, a), 2, style.width);
      continue;
    }
    text += wrapped(line_in_words(map, c, 0), 2, style.width) + "\n";
    text += as_text(intervals_sheet(map, c, 0), style);
  }
  return text;
}

std::vector<Sheet> map_document(const SweepMap& map) {
  std::vector<Sheet> sheets;
  for (std::size_t c = 0; c < map.conditions.size(); ++c) {
    Sheet counts{map.conditions[c], {}, {}, {}};
    for (const SweepAxis& axis : map.axes) counts.notes.push_back(axis_in_words(axis));
    counts.notes.push_back(counts_in_words(map, c));
    for (const std::string& reason : reasons_of(map, c)) counts.notes.push_back(reason);
    const bool along = !map.intervals.empty();
    if (along && map.axes.size() == 1) counts.notes.push_back(line_in_words(map, c, 0));
    if (along && map.axes.size() > 1)
      for (std::size_t a = 0; a < map.axes.size(); ++a)
        counts.notes.push_back(lines_in_words(map, c, a));
    sheets.push_back(std::move(counts));
    if (!along || map.axes.size() != 1) continue;
    sheets.push_back(intervals_sheet(map, c, 0));
    sheets.back().title = map.conditions[c] + ": " + sheets.back().title;
  }
  return sheets;
}

// Positions of the signals that are not an axis, which has a column already.
static std::vector<std::size_t> besides_axes(const Signals& signals, const SweepMap& map) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const auto is_axis = [&](const SweepAxis& axis) {
      return std::ranges::count(axis.columns, signals[i].name, &SweepAxis::Column::name) > 0;
    };
    if (std::ranges::none_of(map.axes, is_axis)) kept.push_back(i);
  }
  return kept;
}

Sheet map_sheet(const SweepMap& map) {
  const std::vector<std::size_t> states = besides_axes(map.states, map);
  const std::vector<std::size_t> inputs = besides_axes(map.inputs, map);
  Sheet sheet;
  sheet.columns = {{"condition", "", ""}};
  for (const SweepAxis& axis : map.axes)
    for (const SweepAxis::Column& column : axis.columns)
      sheet.columns.push_back({column_key(column.name), "", ""});
  for (const char* key :
       {"status", "verdict", "reason", "residual", "spectral_abscissa", "damping", "second_branch"})
    sheet.columns.push_back({key, "", ""});
  for (const std::size_t i : states)
    sheet.columns.push_back({column_key(map.states[i].name), "", ""});
  for (const std::size_t i : inputs)
    sheet.columns.push_back({column_key(map.inputs[i].name), "", ""});
  for (std::size_t i = 0; i < map.modes(); ++i) {
    sheet.columns.push_back({fmt::format("eigenvalue_re_{}", i), "", ""});
    sheet.columns.push_back({fmt::format("eigenvalue_im_{}", i), "", ""});
  }
  for (std::size_t p = 0; p < map.points(); ++p) {
    const std::vector<std::size_t> at = map.position(p);
    std::vector<SheetCell> row{map.conditions[at[0]]};
    for (std::size_t a = 0; a < map.axes.size(); ++a)
      for (const SweepAxis::Column& column : map.axes[a].columns)
        row.emplace_back(column.values[at[a + 1]]);
    row.emplace_back(status_name(map.status[p]));
    row.emplace_back(verdict_name(map.verdict[p]));
    row.emplace_back(map.reasons[std::size_t(map.reason[p])]);
    for (const double v : {map.residual[p], map.spectral_abscissa[p], map.damping[p]})
      row.push_back(number_cell(v));
    row.emplace_back(double(map.second_branch[p]));
    const std::size_t n = map.modes(), m = map.inputs.size();
    for (const std::size_t i : states) row.push_back(number_cell(map.state[p * n + i]));
    for (const std::size_t i : inputs) row.push_back(number_cell(map.input[p * m + i]));
    for (std::size_t i = 0; i < n; ++i) {
      row.push_back(number_cell(map.eigenvalue_re[p * n + i]));
      row.push_back(number_cell(map.eigenvalue_im[p * n + i]));
    }
    sheet.rows.push_back(std::move(row));
  }
  return sheet;
}

}  // namespace tiltrim
