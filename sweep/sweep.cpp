#include "sweep/sweep.hpp"

#include <fmt/ranges.h>
#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <memory>

#include "linearize/batch.hpp"
#include "linearize/modes.hpp"
#include "sweep/boundary.hpp"
#include "sweep/line.hpp"
#include "sweep/spectrum.hpp"
#include "sweep/work.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

// Numbers of lines along the last axis, and the lines next to one along the slower axes.
struct Lines {
  const std::vector<SweepAxis>& axes;

  std::size_t count() const {
    std::size_t all = 1;
    for (std::size_t a = 0; a + 1 < axes.size(); ++a) all *= axes[a].size();
    return all;
  }
  GridPlace place(std::size_t line) const {
    GridPlace place(axes.size(), 0.0);
    for (std::size_t a = axes.size() - 1; a-- > 0; line /= axes[a].size())
      place[a] = double(line % axes[a].size());
    return place;
  }
  // The line before (or after), along the fastest of the slower axes that has one.
  std::optional<std::size_t> next_to(std::size_t line, bool before) const {
    std::size_t stride = 1;
    for (std::size_t a = axes.size() - 1; a-- > 0; stride *= axes[a].size()) {
      const std::size_t at = line / stride % axes[a].size();
      if (before && at > 0) return line - stride;
      if (!before && at + 1 < axes[a].size()) return line + stride;
    }
    return {};
  }
};

struct Named {
  Reference reference;
  std::vector<std::string> names;
};

// The modes in the order and by the names of modes(), at the first equilibrium of a condition.
Named named_modes(const Prepared& sweep, const GridTrim& e) {
  Named named;
  named.reference.A = e.A(sweep);
  const ModesOptions naming{.mode_names = sweep.model().mode_names};
  for (const Mode& m : modes(named.reference.A, {}, names(sweep.model().states), naming).modes) {
    named.reference.modes.push_back(m.eigenvalue);
    named.names.push_back(m.name);
  }
  return named;
}

// The modes at the first point of a line, straight on from the two before it.
Eigenvalues foreseen(const Lines& lines, const std::vector<LineStart>& starts, std::size_t line,
                     std::size_t before) {
  const Eigenvalues& modes = starts[before].reference->modes;
  const GridPlace here = lines.place(line), there = lines.place(before);
  std::size_t axis = 0;
  while (here[axis] == there[axis]) ++axis;
  const std::size_t k = std::size_t(here[axis]), stride = line - before;
  if (k < 2) return modes;
  const LineStart& earlier = starts[before - stride];
  if (!earlier.first.valid() || !starts[before].first.valid() || !earlier.reference) return modes;
  const std::vector<double>& v = lines.axes[axis].columns.front().values;
  const double ratio = (v[k] - v[k - 1]) / (v[k - 1] - v[k - 2]);
  Eigenvalues predicted = modes;
  for (std::size_t i = 0; i < modes.size(); ++i)
    if (side(earlier.reference->modes[i]) == side(modes[i]))
      predicted[i] += ratio * (modes[i] - earlier.reference->modes[i]);
  return predicted;
}

// The first points of all lines, each from the line before it.
void start_first_points(const Prepared& sweep, const Lines& lines, std::vector<LineStart>& starts,
                        std::vector<std::string>& mode_names) {
  const std::size_t n = std::size_t(sweep.states());
  std::vector<std::optional<OperatingPoint>> last(starts.size());
  for (std::size_t l = 0; l < starts.size(); ++l) {
    LineStart& s = starts[l];
    s.confidence.assign(n, 0);
    const auto before = lines.next_to(l, true);
    if (before) {
      last[l] = last[*before];
      s.reference = starts[*before].reference;
    }
    std::optional<GridTrim> e;
    if (last[l]) e = settle(sweep, s.place, *last[l]);
    s.first = e ? *e : from_nothing(sweep, s.place);
    if (!s.first.valid()) continue;
    last[l] = s.first.at;
    const Eigen::MatrixXd A = s.first.A(sweep);
    const Eigenvalues lambda = eigenvalues_of(A);
    if (lambda.size() != n) continue;
    if (mode_names.empty()) {
      Named named = named_modes(sweep, s.first);
      if (named.reference.modes.size() != n) continue;
      mode_names = named.names;
      s.reference = named.reference;
      s.confidence.assign(n, 255);
    } else if (s.reference) {
      const Ordered ordered = in_order(
          *s.reference, before ? foreseen(lines, starts, l, *before) : s.reference->modes, A,
          lambda,
          before ? trims_between(sweep, lines.place(*before), s.place, s.first.at) : nullptr);
      s.reference = Reference{A, ordered.modes};
      s.confidence = ordered.confidence;
    }
  }
}

// The last points, each from the line after it.
void start_last_points(const Prepared& sweep, const Lines& lines, std::vector<LineStart>& starts) {
  for (std::size_t l = starts.size(); l-- > 0;) {
    GridPlace place = starts[l].place;
    place.back() = double(sweep.axes.back().size() - 1);
    const auto after = lines.next_to(l, false);
    std::optional<GridTrim> e;
    if (after && starts[*after].last) {
      e = settle(sweep, place, *starts[*after].last);
    } else if (GridTrim own = from_nothing(sweep, place); own.valid()) {
      e = own;
    }
    if (e) {
      starts[l].last = e->at;
    } else if (after &&
               starts[*after].last) {  // its numbers are this line's, its unknowns the other's
      OperatingPoint at = numbers_at(sweep, place);
      for (const Index j : sweep.problem.unknowns)
        set_value(at, j, value_of(*starts[*after].last, j));
      starts[l].last = at;
    }
  }
}

// What the log's lines are lines of.
std::string identity_of(const SweepOptions& options,
                        const std::vector<std::unique_ptr<Prepared>>& conditions,
                        const std::vector<SweepAxis>& axes) {
  std::string identity = options.identity + "\n" + rounding();
  for (const auto& c : conditions)
    identity += fmt::format("\ncondition {}: {}", c->request.name,
                            fmt::join(names(c->model().states), " "));
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns) {
      identity += fmt::format("\naxis {}, {}:", axis.name, column.name);
      for (const double value : column.si) identity += fmt::format(" {:a}", value);
    }
  return identity;
}

void check_alike(const std::vector<std::unique_ptr<Prepared>>& conditions) {
  const Prepared& first = *conditions.front();
  for (const auto& c : conditions)
    if (names(c->model().states) != names(first.model().states))
      throw std::invalid_argument(fmt::format(
          "condition '{}' has other states than '{}'; expected conditions of one formulation",
          c->request.name, first.request.name));
}

// Hundreds of megabytes, which the system clears page by page: in large ones where it has them.
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

SweepMap empty_map(const std::vector<std::unique_ptr<Prepared>>& conditions,
                   const std::vector<SweepAxis>& axes) {
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

// Second branches and reasons, whose places depend on all lines before.
void append(const LinePoints& line, std::size_t first, SweepMap& map) {
  SecondBranch& all = map.second;
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
  constexpr std::size_t most = 30'000;  // what a short counts
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

// Names of a condition whose lines all begin without an equilibrium: those at its first.
void name_late(const Prepared& sweep, std::size_t condition, SweepMap& map) {
  std::vector<std::string>& all = map.mode_names[condition];
  const std::size_t n = map.modes(), count = map.points_per_condition();
  if (std::ranges::any_of(all, [](const std::string& name) { return !name.empty(); })) return;
  for (std::size_t p = condition * count; p < (condition + 1) * count; ++p) {
    if (map.verdict[p] < 0) continue;
    GridPlace place;
    const std::vector<std::size_t> position = map.position(p);
    for (std::size_t a = 1; a < position.size(); ++a) place.push_back(double(position[a]));
    const GridTrim e = from_nothing(sweep, place);
    if (!e.valid() || !e.A(sweep).allFinite()) return;
    const Named named = named_modes(sweep, e);
    for (std::size_t i = 0; i < n && i < named.names.size(); ++i) {
      const std::complex<double> own(map.eigenvalue_re[p * n + i], map.eigenvalue_im[p * n + i]);
      const auto nearest = std::ranges::min_element(
          named.reference.modes, {}, [&](const auto& z) { return std::abs(z - own); });
      all[i] = named.names[std::size_t(nearest - named.reference.modes.begin())];
    }
    return;
  }
}

SweepMap swept(const std::vector<std::unique_ptr<Prepared>>& conditions,
               const std::vector<SweepAxis>& axes, Work& work) {
  SweepMap map = empty_map(conditions, axes);
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
  run<LinePoints>(
      work, 0, count,
      [&](std::size_t i, LinePoints& line) {
        walk_line(*conditions[i / per_condition], starts[i / per_condition][i % per_condition],
                  line);
      },
      points_from, [&](std::size_t i, const LinePoints& line) { place(line, i * length, map); },
      [&](std::size_t i, const LinePoints& line) {
        append(line, i * length, map);
        count_verdicts(line, work.progress);
      });
  for (std::size_t c = 0; c < conditions.size(); ++c) name_late(*conditions[c], c, map);
  if (!work.options.crossings) return map;

  const std::vector<AxisLine> between = lines_along_axes(conditions.size(), axes);
  work.progress.what = "lines";
  work.progress.done = 0;
  work.progress.total = between.size();
  run<LineVerdicts>(
      work, count, between.size(),
      [&](std::size_t i, LineVerdicts& line) {
        const AxisLine& l = between[i];
        line =
            look_between(*conditions[std::size_t(l.condition)], map, l.condition, l.axis, l.place);
      },
      verdicts_from, [](std::size_t, const LineVerdicts&) {},
      [&](std::size_t, const LineVerdicts& line) {
        map.crossings.insert(map.crossings.end(), line.crossings.begin(), line.crossings.end());
        map.intervals.insert(map.intervals.end(), line.intervals.begin(), line.intervals.end());
        ++work.progress.done;
      });
  return map;
}

}  // namespace

bool first_of_ranks() { return rank() == 0; }

SweepMap sweep(const std::vector<SweepRequest>& requests, const std::vector<SweepAxis>& axes,
               const SweepOptions& options) {
  if (requests.empty()) throw std::invalid_argument("no condition to sweep");
  if (axes.empty()) throw std::invalid_argument("no axis to sweep along");
  std::vector<std::unique_ptr<Prepared>> conditions;
  for (const SweepRequest& r : requests)
    conditions.push_back(std::make_unique<Prepared>(r, axes, options.trimming));
  check_alike(conditions);
  std::unique_ptr<Log> log;
  Work work{options, nullptr};
  if (!options.log.empty() && rank() == 0) {
    try {
      log = std::make_unique<Log>(options.log, identity_of(options, conditions, axes));
    } catch (const LogError&) {
      work.failure = std::current_exception();
    }
    work.log = log.get();
  }
  agree(work);
  recover(work);
  SweepMap map;
  with_threads(options.threads, [&] { map = swept(conditions, axes, work); });
  return map;
}

}  // namespace tiltrim
