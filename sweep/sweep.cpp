#include "sweep/sweep.hpp"

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <limits>
#include <memory>
#include <string_view>

#include "linearize/batch.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "sweep/boundary.hpp"
#include "sweep/halves.hpp"
#include "sweep/starts.hpp"
#include "sweep/work.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

// Hundreds of megabytes that the system clears page by page: uses large pages if available.
void resize(std::vector<double>& numbers, std::size_t size) {
  numbers.reserve(size);
#ifdef __linux__
  constexpr std::size_t page = std::size_t{2} << 20;
  void* begin = numbers.data();
  std::size_t space = size * sizeof(double);
  if (std::align(page, page, begin, space)) (void)madvise(begin, space, MADV_HUGEPAGE);
#endif
  numbers.resize(size);
}

SweepMap empty_map(const PreparedConditions& conditions, const std::vector<SweepAxis>& axes) {
  SweepMap map;
  map.axes = axes;
  const Prepared& first = *conditions.front();
  map.states = first.model().states;
  for (const std::string& name : first.request.inputs) {
    const Index i = find(first.model().inputs, name);
    map.inputs.push_back(
        i >= 0
            ? first.model().inputs[std::size_t(i)]
            : first.model().outputs[std::size_t(index_of(first.model().outputs, name, "output"))]);
  }
  for (const auto& c : conditions) map.conditions.push_back(c->request.name);
  map.instruction_set = rounding();
  map.mode_names.resize(conditions.size());
  map.reasons = {""};
  const std::size_t points = map.points(), n = map.modes(), m = map.inputs.size();
  map.status.assign(points, -1);
  map.verdict.assign(points, -1);
  map.reason.resize(points);
  map.second_branch.resize(points);
  map.confidence.resize(points * n);
  const std::vector<std::pair<std::vector<double>*, std::size_t>> numbers{
      {&map.eigenvalue_re, n}, {&map.eigenvalue_im, n},     {&map.state, n},  {&map.input, m},
      {&map.residual, 1},      {&map.spectral_abscissa, 1}, {&map.damping, 1}};
  in_parallel(numbers.size(),
              [&](std::size_t i) { resize(*numbers[i].first, points * numbers[i].second); });
  return map;
}

void place(const LinePoints& line, std::size_t first, SweepMap& map) {
  const auto copy = [](const auto& from, auto& to, std::size_t at) {
    std::ranges::copy(from, to.begin() + std::ptrdiff_t(at));
  };
  const std::size_t n = map.modes(), m = map.inputs.size();
  copy(line.status, map.status, first);
  copy(line.verdict, map.verdict, first);
  copy(line.second_branch, map.second_branch, first);
  copy(line.residual, map.residual, first);
  copy(line.spectral_abscissa, map.spectral_abscissa, first);
  copy(line.damping, map.damping, first);
  copy(line.state, map.state, first * n);
  copy(line.input, map.input, first * m);
  copy(line.eigenvalue_re, map.eigenvalue_re, first * n);
  copy(line.eigenvalue_im, map.eigenvalue_im, first * n);
  copy(line.confidence, map.confidence, first * n);
}

// Appends second branches and reasons, whose indices depend on all previous lines.
void append(const LinePoints& line, std::size_t first, SweepMap& map) {
  SweepMap::SecondBranch& all = map.second;
  std::vector<std::size_t> order(line.second.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return line.second[i]; });
  const auto part = [](const auto& from, std::size_t i, std::size_t size, auto& to) {
    const auto at = from.begin() + std::ptrdiff_t(i * size);
    to.insert(to.end(), at, at + std::ptrdiff_t(size));
  };
  for (const std::size_t i : order) {
    all.points.push_back(first + line.second[i]);
    part(line.second_state, i, map.modes(), all.state);
    part(line.second_input, i, map.inputs.size(), all.input);
    part(line.second_re, i, map.modes(), all.eigenvalue_re);
    part(line.second_im, i, map.modes(), all.eigenvalue_im);
    part(line.second_verdict, i, 1, all.verdict);
  }
  constexpr std::size_t most = 30'000;  // limit for a short index
  std::vector<std::int16_t> number;
  for (const std::string& reason : line.reasons) {
    auto known = std::ranges::find(map.reasons, reason);
    if (known == map.reasons.end() && map.reasons.size() < most) {
      map.reasons.push_back(reason);
      known = map.reasons.end() - 1;
    }
    number.push_back(known == map.reasons.end() ? std::int16_t(most - 1)
                                                : std::int16_t(known - map.reasons.begin()));
  }
  for (std::size_t k = 0; k < line.reason.size(); ++k)
    map.reason[first + k] = number[std::size_t(line.reason[k])];
}

void count_verdicts(const LinePoints& line, SweepProgress& p) {
  p.done += line.verdict.size();
  p.stable += std::size_t(std::ranges::count(line.verdict, std::int8_t(Verdict::stable)));
  p.unstable += std::size_t(std::ranges::count(line.verdict, std::int8_t(Verdict::unstable)));
  p.undecided += std::size_t(std::ranges::count(line.verdict, std::int8_t(Verdict::undecided)));
  p.no_trim += std::size_t(std::ranges::count(line.verdict, std::int8_t(-1)));
}

// The first points of the lines along one axis, over all conditions.
struct AxisLine {
  int condition;
  std::size_t axis;
  GridPlace place;
};

std::vector<AxisLine> lines_along_axes(std::size_t conditions, const std::vector<SweepAxis>& axes) {
  std::vector<AxisLine> all;
  for (std::size_t c = 0; c < conditions; ++c)
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      std::size_t count = 1;
      for (std::size_t a = 0; a < axes.size(); ++a)
        if (a != axis) count *= axes[a].size();
      for (std::size_t number = 0; number < count; ++number) {
        GridPlace place(axes.size(), 0.0);
        std::size_t rest = number;
        for (std::size_t a = axes.size(); a-- > 0;) {
          if (a == axis) continue;
          place[a] = double(rest % axes[a].size());
          rest /= axes[a].size();
        }
        all.push_back({int(c), axis, place});
      }
    }
  return all;
}

// Points of lines that were placed, perhaps, but not appended.
void clear_from(std::size_t first, SweepMap& map) {
  const auto clear = [&](auto& values, std::size_t each, auto value) {
    std::fill(values.begin() + std::ptrdiff_t(first * each), values.end(), value);
  };
  const std::size_t n = map.modes(), m = map.inputs.size();
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::vector<std::int8_t>* codes : {&map.status, &map.verdict})
    clear(*codes, 1, std::int8_t(-1));
  clear(map.second_branch, 1, std::int8_t(0));
  clear(map.confidence, n, std::uint8_t(0));
  for (std::vector<double>* numbers : {&map.residual, &map.spectral_abscissa, &map.damping})
    clear(*numbers, 1, nan);
  for (std::vector<double>* numbers : {&map.eigenvalue_re, &map.eigenvalue_im, &map.state})
    clear(*numbers, n, nan);
  clear(map.input, m, nan);
}

std::size_t lines_together(const PreparedConditions& conditions) {
  std::size_t most = 1;
  for (const auto& c : conditions) most = std::max(most, lines_together(*c));
  return most;
}

// The units of the log from `first` on: every line along every axis, searched between its points.
void look_between_points(const PreparedConditions& conditions, const std::vector<SweepAxis>& axes,
                         Work& work, std::size_t first, const LineSizes& sizes, SweepMap& map) {
  const std::vector<AxisLine> between = lines_along_axes(conditions.size(), axes);
  work.progress.what = "lines";
  work.progress.done = 0;
  work.progress.total = between.size();
  std::vector<std::vector<std::unique_ptr<const Halved>>> halved(conditions.size());
  for (std::size_t c = 0; c < conditions.size(); ++c)
    for (std::size_t axis = 0; axis < axes.size(); ++axis)
      halved[c].push_back(std::make_unique<const Halved>(*conditions[c], axis));
  // Few lines are shared out to all threads rather than walked together.
  const std::size_t together =
      std::clamp(between.size() / threads(), std::size_t{1}, lines_together(conditions));
  run<LineVerdicts>(
      work, first, between.size(), together,
      [&](const std::vector<std::size_t>& units, const std::vector<LineVerdicts*>& all) {
        for (std::size_t from = 0, to = 0; from < units.size(); from = to) {
          const AxisLine& l = between[units[from]];
          std::vector<const GridPlace*> places;
          for (; to < units.size() && between[units[to]].condition == l.condition &&
                 between[units[to]].axis == l.axis;
               ++to)
            places.push_back(&between[units[to]].place);
          const auto c = std::size_t(l.condition);
          look_between(*conditions[c], *halved[c][l.axis], map, l.condition, l.axis, places,
                       {all.begin() + std::ptrdiff_t(from), all.begin() + std::ptrdiff_t(to)});
        }
      },
      [&](const Bytes& bytes) { return in_log(work, verdicts_from, bytes, sizes); },
      [](std::size_t, const LineVerdicts&) {},
      [&](std::size_t, const LineVerdicts& line) {
        map.crossings.insert(map.crossings.end(), line.crossings.begin(), line.crossings.end());
        map.intervals.insert(map.intervals.end(), line.intervals.begin(), line.intervals.end());
        ++work.progress.done;
      });
}

void compute(const PreparedConditions& conditions, const std::vector<SweepAxis>& axes, Work& work,
             SweepMap& map) {
  const Lines lines{axes};
  const std::size_t per_condition = lines.count(), length = axes.back().size();
  std::vector<std::vector<LineStart>> starts(conditions.size(),
                                             std::vector<LineStart>(per_condition));
  for (std::vector<LineStart>& of_condition : starts)
    for (std::size_t l = 0; l < per_condition; ++l) of_condition[l].place = lines.place(l);
  in_parallel(2 * conditions.size(), [&](std::size_t i) {
    const std::size_t c = i / 2;
    if (i % 2 == 0)
      start_first_points(*conditions[c], lines, starts[c], map.mode_names[c]);
    else
      start_last_points(*conditions[c], lines, starts[c]);
  });
  for (std::vector<std::string>& of_condition : map.mode_names) of_condition.resize(map.modes());

  const std::size_t count = conditions.size() * per_condition;
  work.progress = {"points", 0, count * length};
  const LineSizes sizes{conditions.size(), axes.size(), length, map.modes(), map.inputs.size()};
  run<LinePoints>(
      work, 0, count, lines_together(conditions),
      [&](const std::vector<std::size_t>& units, const std::vector<LinePoints*>& all) {
        for (std::size_t from = 0, to = 0; from < units.size(); from = to) {
          const std::size_t c = units[from] / per_condition;  // those of one condition
          std::vector<const LineStart*> first;
          for (; to < units.size() && units[to] / per_condition == c; ++to)
            first.push_back(&starts[c][units[to] % per_condition]);
          walk_lines(*conditions[c], first,
                     {all.begin() + std::ptrdiff_t(from), all.begin() + std::ptrdiff_t(to)});
        }
      },
      [&](const Bytes& bytes) { return in_log(work, points_from, bytes, sizes); },
      [&](std::size_t i, const LinePoints& line) { place(line, i * length, map); },
      [&](std::size_t i, const LinePoints& line) {
        append(line, i * length, map);
        count_verdicts(line, work.progress);
      });
  for (std::size_t c = 0; c < conditions.size(); ++c) name_late(*conditions[c], c, map);
  if (!work.options.crossings) return;

  look_between_points(conditions, axes, work, count, sizes, map);
}

SweepMap swept(const PreparedConditions& conditions, const std::vector<SweepAxis>& axes,
               Work& work) {
  SweepMap map = empty_map(conditions, axes);
  try {
    compute(conditions, axes, work, map);
  } catch (SweepInterrupted& e) {
    if (work.progress.what == std::string_view("points")) clear_from(work.progress.done, map);
    e.finished = std::make_shared<const SweepMap>(std::move(map));
    throw;
  }
  return map;
}

}  // namespace

SweepMap sweep(const std::vector<SweepRequest>& requests, const std::vector<SweepAxis>& axes,
               const SweepOptions& options) {
  const RoundToNearest environment;
  const PreparedConditions conditions = prepare(requests, axes, options);
  Work work{options, nullptr};
  const std::unique_ptr<Log> log = open_log(work, identity_of(options, conditions, axes));
  SweepMap map;
  with_threads(options.threads, [&] { map = swept(conditions, axes, work); });
  return map;
}

}  // namespace tiltrim
