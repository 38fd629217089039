#include "sweep/verdict_map.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "linearize/batch.hpp"
#include "runtime/checksum.hpp"
#include "runtime/rounding.hpp"
#include "sweep/boundary.hpp"
#include "sweep/line.hpp"
#include "sweep/line_chain.hpp"
#include "sweep/sweep.hpp"
#include "sweep/verdict_runs.hpp"
#include "sweep/work.hpp"

namespace tiltrim {

namespace {

// The lines of a map in units of some lines of one condition, which the log and the parts keep
// whole.
struct Units {
  std::size_t conditions, lines, of_unit;

  std::size_t per_condition() const { return (lines + of_unit - 1) / of_unit; }
  std::size_t count() const { return conditions * per_condition(); }
  std::size_t condition(std::size_t unit) const { return unit / per_condition(); }
  std::size_t first_line(std::size_t unit) const { return unit % per_condition() * of_unit; }
  std::size_t size(std::size_t unit) const { return std::min(of_unit, lines - first_line(unit)); }
  /// The units before part k of n, counted from 0.
  std::size_t before(std::uint64_t k, std::uint64_t n) const {
    return std::size_t(count() / n * k + std::min<std::uint64_t>(k, count() % n));
  }
};

Units units_of(const std::vector<SweepAxis>& axes, std::size_t conditions) {
  constexpr std::size_t points = std::size_t(1) << 16;  // some milliseconds of work
  constexpr std::size_t together = Model::model_lanes;
  std::size_t of_unit = std::max<std::size_t>(points / axes.back().size(), 1);
  if (of_unit > together) of_unit -= of_unit % together;
  return {conditions, Lines{axes}.count(), of_unit};
}

void check_part(const SweepPart& part, std::size_t units) {
  if (part.of < 1 || part.number < 1 || part.number > part.of)
    throw std::invalid_argument(
        fmt::format("part {}/{} does not exist; expected 1/n to n/n", part.number, part.of));
  if (part.of > units)
    throw std::invalid_argument(
        fmt::format("{} parts of a map that divides into {}; expected no more", part.of, units));
}

VerdictLines judge(const Prepared& condition, int number, std::span<const LineStart> starts,
                   bool borders) {
  static thread_local std::vector<JudgedLine> together;
  const std::size_t most = lines_together(condition);
  VerdictLines lines;
  for (std::size_t from = 0; from < starts.size(); from += most) {
    const auto some = starts.subspan(from, std::min(most, starts.size() - from));
    judge_lines(condition, some, together);
    for (std::size_t i = 0; i < some.size(); ++i) {
      const JudgedLine& judged = together[i];
      append_runs(judged.verdicts, lines.runs);
      std::optional<std::vector<AxisCrossing>> found;
      if (borders && judged.affine)
        found = affine_borders(condition, number, some[i].place, *judged.affine, judged.shares);
      lines.located.push_back(found.has_value());
      if (found) lines.borders.insert(lines.borders.end(), found->begin(), found->end());
    }
  }
  return lines;
}

void count_runs(const VerdictLines& lines, std::size_t points, SweepProgress& progress) {
  const std::array<std::size_t*, 4> counts{&progress.no_trim, &progress.stable, &progress.unstable,
                                           &progress.undecided};
  std::size_t at = 0;
  while (at < lines.runs.size())
    each_run(lines.runs, at, points, [&](std::int8_t code, std::size_t length) {
      *counts[std::size_t(code + 1)] += length;
      progress.done += length;
    });
}

void append(const VerdictLines& lines, VerdictMap& map) {
  map.runs.insert(map.runs.end(), lines.runs.begin(), lines.runs.end());
  map.located.insert(map.located.end(), lines.located.begin(), lines.located.end());
  auto& crossings = map.grid.crossings;
  crossings.insert(crossings.end(), lines.borders.begin(), lines.borders.end());
}

// Units from .. to - 1, of one condition. The starts of a few at a time are computed before them.
void judge_units(const Prepared& condition, const Units& units, std::size_t from, std::size_t to,
                 Work& work, VerdictMap& map) {
  constexpr std::size_t most_lines = 4096;  // whose starts are kept
  const std::size_t at_once = std::max<std::size_t>(most_lines / units.of_unit, 1);
  const std::size_t number = units.condition(from), points = map.grid.axes.back().size();
  LineChain chain(condition, units.first_line(from));
  std::vector<LineStart> starts;
  for (std::size_t begin = from; begin < to; begin += at_once) {
    const std::size_t end = std::min(begin + at_once, to), first = units.first_line(begin);
    starts.clear();
    for (std::size_t unit = begin; unit < end; ++unit)
      for (std::size_t l = 0; l < units.size(unit); ++l) starts.push_back(chain.next());
    run<VerdictLines>(
        work, begin, end - begin, 1,
        [&](const std::vector<std::size_t>& one, const std::vector<VerdictLines*>& lines) {
          const std::size_t unit = begin + one.front();
          *lines.front() =
              judge(condition, int(number),
                    std::span(starts).subspan(units.first_line(unit) - first, units.size(unit)),
                    work.options.crossings);
        },
        [&](const Bytes& bytes) {
          const LineSizes sizes{units.conditions, map.grid.axes.size(), points, 0, 0};
          return in_log(work, verdict_lines_from, bytes, sizes);
        },
        [](std::size_t, const VerdictLines&) {},
        [&](std::size_t, const VerdictLines& lines) {
          count_runs(lines, points, work.progress);
          append(lines, map);
        });
  }
}

std::size_t lines_before(const Units& units, std::size_t unit) {
  return units.condition(unit) * units.lines + units.first_line(unit);
}

std::string hash_of(const std::string& text) {
  return fmt::format("{:016x}", checksum(std::as_bytes(std::span(text))));
}

}  // namespace

VerdictMap sweep_verdicts(const std::vector<SweepRequest>& requests,
                          const std::vector<SweepAxis>& axes, const SweepOptions& options,
                          const SweepPart& part) {
  const RoundToNearest environment;
  const PreparedConditions conditions = prepare(requests, axes, options);
  const Units units = units_of(axes, conditions.size());
  check_part(part, units.count());
  VerdictMap map;
  map.grid.axes = axes;
  map.grid.instruction_set = rounding();
  for (const auto& c : conditions) map.grid.conditions.push_back(c->request.name);
  map.part = part;
  const std::string identity = identity_of(options, conditions, axes) +
                               (options.crossings ? "\nverdicts, crossings located" : "\nverdicts");
  map.work = hash_of(identity);
  Work work{options, nullptr};
  const auto log = open_log(work, fmt::format("{}\npart {}/{}", identity, part.number, part.of));
  const std::size_t from = units.before(part.number - 1, part.of),
                    to = units.before(part.number, part.of);
  work.progress.total = (lines_before(units, to) - lines_before(units, from)) * axes.back().size();
  with_threads(options.threads, [&] {
    for (std::size_t unit = from; unit < to;) {
      const std::size_t c = units.condition(unit);
      const std::size_t end = std::min(to, (c + 1) * units.per_condition());
      judge_units(*conditions[c], units, unit, end, work, map);
      unit = end;
    }
  });
  return map;
}

std::vector<VerdictCounts> counts_of(const VerdictMap& map) {
  const std::vector<SweepAxis>& axes = map.grid.axes;
  const Units units = units_of(axes, map.grid.conditions.size());
  std::size_t line = lines_before(units, units.before(map.part.number - 1, map.part.of));
  std::vector<VerdictCounts> counts(units.conditions, VerdictCounts{});
  for (std::size_t at = 0; at < map.runs.size(); ++line) {
    if (line >= units.conditions * units.lines)
      throw std::runtime_error("a part has lines beyond the end of its map");
    each_run(map.runs, at, axes.back().size(), [&](std::int8_t code, std::size_t length) {
      counts[line / units.lines][code < 0 ? 3 : std::size_t(code)] += length;
    });
  }
  return counts;
}

namespace {

void check_same_work(const VerdictMap& a, const VerdictMap& b, const std::string& name_a,
                     const std::string& name_b) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(
        fmt::format("{} is not a part of the same map as {}: {}", name_b, name_a, what));
  };
  if (a.grid.program != b.grid.program)
    refuse(fmt::format("{} wrote it, not {}", b.grid.program, a.grid.program));
  if (a.grid.instruction_set != b.grid.instruction_set)
    refuse(fmt::format("a processor with {} computed it, not one with {}", b.grid.instruction_set,
                       a.grid.instruction_set));
  if (a.grid.study != b.grid.study) refuse("its study has another text");
  if (a.grid.conditions != b.grid.conditions) refuse("it has other conditions");
  if (a.part.of != b.part.of)
    refuse(fmt::format("it is part {} of {}, not of {}", b.part.number, b.part.of, a.part.of));
  if (a.work != b.work) refuse("another file that the study names, or an option, has changed");
}

}  // namespace

VerdictMap merged(std::vector<VerdictMap> parts, const std::vector<std::string>& names) {
  if (parts.empty()) throw std::invalid_argument("no part to merge");
  std::vector<std::size_t> order(parts.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  for (std::size_t k = 1; k < parts.size(); ++k)
    check_same_work(parts[0], parts[k], names[0], names[k]);
  std::ranges::sort(order, {}, [&](std::size_t k) { return parts[k].part.number; });
  for (std::size_t k = 1; k < order.size(); ++k)
    if (parts[order[k]].part.number == parts[order[k - 1]].part.number)
      throw std::invalid_argument(fmt::format("{} and {} are both part {} of {}",
                                              names[order[k - 1]], names[order[k]],
                                              parts[order[k]].part.number, parts[0].part.of));
  std::string missing;
  std::size_t have = 0;
  constexpr std::size_t longest = 60;  // of the list
  for (std::uint64_t number = 1; number <= parts[0].part.of && missing.size() < longest; ++number)
    if (have < order.size() && parts[order[have]].part.number == number)
      ++have;
    else
      missing += fmt::format("{}{}/{}", missing.empty() ? "" : ", ", number, parts[0].part.of);
  if (!missing.empty())
    throw std::invalid_argument(fmt::format("part {} is missing; there are {} of {}", missing,
                                            parts.size(), parts[0].part.of));
  VerdictMap map = std::move(parts[order[0]]);
  for (std::size_t k = 1; k < order.size(); ++k) {
    const VerdictMap& next = parts[order[k]];
    append({next.runs, next.located, next.grid.crossings}, map);
  }
  map.part = {};
  return map;
}

}  // namespace tiltrim
