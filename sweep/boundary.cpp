#include "sweep/boundary.hpp"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>

#include "sweep/grid_line.hpp"
#include "sweep/halves.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

using Eigen::MatrixXd;

namespace {

constexpr double trusted = 0.5;  // confidence of a link required to name the mode that crosses

// Names the mode of the map that crosses at an event, from the grid point before it.
void name_mode(const GridLine& line, const LineEvent& event, AxisCrossing& crossing) {
  if (event.kind == CrossingKind::jump || event.before < 0 || event.after < 0) return;
  std::size_t k = std::min(std::size_t(event.at()), line.size() - 2);
  if (event.at() - double(k) > 0.5) ++k;
  const std::size_t n = std::size_t(line.sweep.states()), p = line.point(k);
  Reference from;
  const auto e = settled_at(line, k);
  if (!e) return;
  from.A = e->A(line.sweep);
  for (std::size_t i = 0; i < n; ++i)
    from.modes.emplace_back(line.map.eigenvalue_re[p * n + i], line.map.eigenvalue_im[p * n + i]);
  const auto there = settle(line.sweep, line.at(event.at()), e->at);
  if (!there) return;
  const MatrixXd A = there->A(line.sweep);
  const Eigenvalues lambda = eigenvalues_of(A);
  if (lambda.size() != n) return;
  const Ordered ordered =
      in_order(from, from.modes, A, lambda,
               trims_between(line.sweep, line.at(double(k)), line.at(event.at()), e->at));
  std::size_t nearest = 0;
  const auto distance = [&](std::size_t i) {
    return std::abs(ordered.modes[i] - std::complex<double>(0, event.frequency));
  };
  for (std::size_t i = 1; i < n; ++i)
    if (distance(i) < distance(nearest)) nearest = i;
  if (ordered.confidence[nearest] < 255 * trusted) return;
  crossing.mode = int(nearest);
  crossing.mode_name = line.map.mode_names[std::size_t(line.condition)][nearest];
}

std::vector<double> coordinates(const GridLine& line, double t) {
  std::vector<double> all;
  const GridPlace place = line.at(t);
  for (std::size_t a = 0; a < place.size(); ++a)
    all.push_back(coordinate(line.sweep.axes[a], place[a]));
  return all;
}

AxisCrossing located(const GridLine& line, const LineEvent& event) {
  AxisCrossing crossing;
  crossing.condition = line.condition;
  crossing.axis = int(line.axis);
  crossing.at = coordinates(line, event.at());
  const std::vector<double>& v = line.sweep.axes[line.axis].columns.front().values;
  const std::size_t k = std::min(std::size_t(event.at()), v.size() - 2);
  crossing.error =
      std::max(event.right - event.at(), event.at() - event.left) * std::abs(v[k + 1] - v[k]);
  crossing.kind = event.kind;
  crossing.unstable_before = event.before;
  crossing.unstable_after = event.after;
  crossing.frequency = event.frequency;
  return crossing;
}

// The top of the parabola of abscissas through three samples.
double vertex(const Sample& left, const Sample& middle, const Sample& right) {
  const double l = left.t - middle.t, r = right.t - middle.t;
  const double at_l = left.abscissa() - middle.abscissa(),
               at_r = right.abscissa() - middle.abscissa();
  return middle.t + 0.5 * (r * r * at_l - l * l * at_r) / (r * at_l - l * at_r);
}

struct Abscissa {
  double at, value;
};

// The largest real part next to sample i, along a line of several axes by one sample more.
Abscissa by_parabola(const MatrixLine& line, const std::vector<const Sample*>& seen,
                     std::size_t i) {
  const Abscissa own{seen[i]->t, seen[i]->abscissa()};
  if (i == 0 || i + 1 == seen.size() || seen[i]->A.size() == 0) return own;
  const double top = vertex(*seen[i - 1], *seen[i], *seen[i + 1]);
  if (!(top > seen[i - 1]->t && top < seen[i + 1]->t)) return own;
  const auto there = line.sample(top, *seen[i]);
  return there && there->abscissa() > own.value ? Abscissa{top, there->abscissa()} : own;
}

// The same by Brent's method between the samples on both sides.
Abscissa by_brent(const MatrixLine& line, const std::vector<const Sample*>& seen, std::size_t i) {
  const Abscissa own{seen[i]->t, seen[i]->abscissa()};
  const double left = i == 0 ? own.at : seen[i - 1]->t;
  const double right = i + 1 == seen.size() ? own.at : seen[i + 1]->t;
  const auto negative = [&](double at) {
    const auto s = line.sample(at, *seen[i]);
    return s ? -s->abscissa() : std::numeric_limits<double>::max();
  };
  boost::uintmax_t steps = 50;
  constexpr int bits = 26;  // accuracy to which a smooth maximum can be located
  const auto [best, value] =
      boost::math::tools::brent_find_minima(negative, left, right, bits, steps);
  return -value > own.value ? Abscissa{best, -value} : own;
}

// From every sample higher than its neighbors that may be next to a maximum higher than all found.
Abscissa by_brent(const MatrixLine& line, const std::vector<const Sample*>& seen, std::size_t most,
                  double rounding) {
  Abscissa best = by_brent(line, seen, most);
  for (std::size_t i = 1; i + 1 < seen.size(); ++i) {
    const double own = seen[i]->abscissa();
    const double before = seen[i - 1]->abscissa(), after = seen[i + 1]->abscissa();
    const double reach = own + (own - std::min(before, after));
    if (i == most || own < before || own < after || !(reach > best.value + rounding)) continue;
    if (const Abscissa top = by_brent(line, seen, i); top.value > best.value) best = top;
  }
  return best;
}

// The largest real part found between two positions, and where. An interval between two grid points
// has its middle as sample.
void largest_abscissa(const GridLine& line, const std::vector<Sample>& seen, double from, double to,
                      AxisInterval& interval) {
  std::vector<const Sample*> inside;
  for (const Sample& s : seen)
    if (s.t >= from && s.t <= to) inside.push_back(&s);
  std::ranges::stable_sort(inside, {}, [](const Sample* s) { return s->t; });
  const MatrixLine matrices = matrices_of(line);
  std::optional<Sample> middle;
  if (inside.empty() && !seen.empty()) {
    const auto nearest =
        std::ranges::min_element(seen, {}, [&](const Sample& s) { return std::abs(s.t - from); });
    middle = matrices.sample(from + 0.5 * (to - from), *nearest);
    if (middle) inside.push_back(&*middle);
  }
  if (inside.empty()) return;
  const auto largest =
      std::ranges::max_element(inside, {}, [](const Sample* s) { return s->abscissa(); });
  const std::size_t most = std::size_t(largest - inside.begin());
  double size = 0.0;  // of the matrices and eigenvalues
  for (const Sample* s : inside) size = std::max({size, s->A.norm(), std::abs(s->abscissa())});
  const double rounding = 64 * std::numeric_limits<double>::epsilon() * size;
  const Abscissa found = line.sweep.axes.size() > 1 ? by_parabola(matrices, inside, most)
                         : interval.verdict == IntervalVerdict::undecided
                             ? Abscissa{(*largest)->t, (*largest)->abscissa()}
                             : by_brent(matrices, inside, most, rounding);
  const double near = std::sqrt(std::numeric_limits<double>::epsilon()) * size;
  if (interval.verdict == IntervalVerdict::stable && found.value > near)
    interval.verdict = IntervalVerdict::undecided;  // a crossing that no second difference showed
  interval.abscissa = std::abs(found.value) <= rounding ? 0.0 : found.value;  // at a crossing
  interval.abscissa_at = coordinate(line.sweep.axes[line.axis], found.at);
}

IntervalVerdict verdict_of(int unstable) {
  return unstable < 0    ? IntervalVerdict::no_trim
         : unstable == 0 ? IntervalVerdict::stable
                         : IntervalVerdict::unstable;
}

bool any_trim(const GridLine& line, double from, double to) {
  for (std::size_t k = std::size_t(std::ceil(from)); double(k) < to; ++k)
    if (double(k) > from && line.valid(k)) return true;
  return false;
}

// Intervals from event to event; a wide event that could not be resolved is an interval of its own,
// and so is what would be stable if eigenvalues did not ride on the axis.
std::vector<AxisInterval> intervals(const GridLine& line, const std::vector<LineEvent>& events,
                                    const std::vector<Sample>& seen,
                                    const std::vector<Riding>& riding) {
  std::vector<AxisInterval> all;
  const SweepAxis& axis = line.sweep.axes[line.axis];
  const auto add = [&](double from, double to, int unstable, bool decided) {
    AxisInterval i;
    i.condition = line.condition;
    i.axis = int(line.axis);
    i.at = coordinates(line, from);
    i.from = coordinate(axis, from);
    i.to = coordinate(axis, to);
    const bool known = unstable >= 0 || !any_trim(line, from, to);  // otherwise without a model
    i.verdict = decided && known ? verdict_of(unstable) : IntervalVerdict::undecided;
    i.unstable = std::max(unstable, 0);
    i.abscissa = i.abscissa_at = std::numeric_limits<double>::quiet_NaN();
    if (unstable >= 0) largest_abscissa(line, seen, from, to, i);
    all.push_back(i);
  };
  // Up to an event, from whose left end on nothing is certain.
  const auto add_beside = [&](double from, double to, int unstable, double certain) {
    for (const Riding& r : riding) {
      const double left = std::max(r.from, from), right = std::min(r.to, to);
      if (unstable != 0 || !(left < right)) continue;
      add(from, left, unstable, true);
      add(left, right, unstable, false);
      all.back().abscissa = 0.0;
      all.back().abscissa_at = all.back().from;
      from = right;
    }
    if (from < certain || all.empty())
      add(from, to, unstable, true);
    else
      all.back().to = coordinate(axis, to);
  };
  const double last = double(line.size() - 1);
  int unstable = events.empty() ? -1 : events.front().before;
  if (events.empty() && line.valid(0))
    if (const std::optional<Sample> first = grid_sample(line, 0))
      unstable = without(*first, riding.empty() ? 0 : on_axis(*first)).unstable();
  double from = 0.0;
  for (const LineEvent& e : events) {  // the state before, at and after it
    const bool jump = e.kind == CrossingKind::jump || e.kind == CrossingKind::end;
    constexpr double located = 1e-4;  // of a step
    const double widest = e.kind == CrossingKind::touch ? 2 * finest : located;
    const bool wide = !jump && std::abs(e.right - e.left) > widest;
    add_beside(from, jump || wide ? e.left : e.at(), e.before, e.left);
    if (wide) add(e.left, e.right, std::max(e.before, e.after), false);
    from = jump || wide ? e.right : e.at();
    unstable = e.after;
  }
  add_beside(from, last, unstable, last);
  std::erase_if(all, [](const AxisInterval& i) { return i.from == i.to; });
  return all;
}

// Events closer than `cluster` are merged: a crossing at a grid point is found from both sides, a
// curve that touches the axis crosses it at every rounding, and where a real eigenvalue crosses
// zero in the trim's own equations no trim can be found at the crossing.
std::vector<LineEvent> in_clusters(const std::vector<LineEvent>& events) {
  constexpr double cluster = 1e-6;  // of a grid step
  std::vector<LineEvent> all;
  for (const LineEvent& e : events) {
    if (all.empty() || e.left - all.back().right > cluster) {
      all.push_back(e);
      continue;
    }
    LineEvent& one = all.back();
    const bool through = one.before >= 0 && e.after >= 0;  // trims on both sides
    const bool jumps = one.kind == CrossingKind::jump || e.kind == CrossingKind::jump;
    const double frequency = std::max(one.frequency, e.frequency);
    one.root.reset();
    one.right = e.right;
    one.after = e.after;
    one.kind = !through                  ? CrossingKind::end
               : jumps                   ? CrossingKind::jump
               : one.before == one.after ? CrossingKind::touch
               : frequency > 0           ? CrossingKind::hopf
                                         : CrossingKind::zero;
    one.frequency = one.kind == CrossingKind::hopf ? frequency : 0.0;
  }
  return all;
}

// If there are more unknowns than equations, each point needs an optimization, and equilibria do
// not follow from their neighbors by Newton.
AxisInterval not_looked_at(const GridLine& line) {
  const std::vector<double>& v = line.sweep.axes[line.axis].columns.front().values;
  AxisInterval i;
  i.condition = line.condition;
  i.axis = int(line.axis);
  i.at = coordinates(line, 0.0);
  i.from = v.front();
  i.to = v.back();
  i.abscissa = i.abscissa_at = std::numeric_limits<double>::quiet_NaN();
  return i;
}

void finish(const GridLine& line, std::vector<LineEvent> events, std::vector<Sample> seen,
            const std::vector<Riding>& riding, LineVerdicts& found) {
  events = in_clusters(events);
  if (seen.empty())
    for (std::size_t k = 0; k < line.size(); ++k)
      if (line.valid(k)) {
        Sample s{double(k), operating_point(line, k), {}, {}};
        s.eigenvalues = Eigen::VectorXcd::Constant(1, line.map.spectral_abscissa[line.point(k)]);
        seen.push_back(s);
      }
  for (const LineEvent& e : events) {
    found.crossings.push_back(located(line, e));
    name_mode(line, e, found.crossings.back());
  }
  found.intervals = intervals(line, events, seen, riding);
}

}  // namespace

void look_between(const Prepared& sweep, const Halved& halved, const SweepMap& map, int condition,
                  std::size_t axis, const std::vector<const GridPlace*>& places,
                  const std::vector<LineVerdicts*>& found) {
  std::vector<GridLine> lines;
  std::vector<const GridLine*> searched;
  std::vector<LineVerdicts*> answers;
  for (const GridPlace* place : places) lines.push_back({sweep, map, condition, axis, *place});
  for (std::size_t l = 0; l < lines.size(); ++l) {
    *found[l] = {};
    std::vector<LineEvent> events;
    if (lines[l].size() < 2) continue;
    if (!sweep.problem.square()) {
      found[l]->intervals = {not_looked_at(lines[l])};
    } else if (solve_events(lines[l], events)) {
      finish(lines[l], std::move(events), {}, {}, *found[l]);
    } else {
      searched.push_back(&lines[l]);
      answers.push_back(found[l]);
    }
  }
  if (searched.empty()) return;
  const std::vector<Halves> halves = walk_halves(halved, searched, rooms_of_thread());
  for (std::size_t l = 0; l < searched.size(); ++l) {
    std::vector<LineEvent> events;
    std::vector<Sample> seen;
    std::vector<Riding> riding;
    search_events(*searched[l], halves[l], events, seen, riding);
    finish(*searched[l], std::move(events), std::move(seen), riding, *answers[l]);
  }
}

std::optional<std::vector<AxisCrossing>> affine_borders(const Prepared& sweep, int condition,
                                                        const GridPlace& place,
                                                        const AffineLine& affine,
                                                        std::span<const double> shares) {
  const SweepMap no_points;
  const GridLine line{sweep, no_points, condition, sweep.axes.size() - 1, place};
  std::vector<LineEvent> events;
  if (line.size() > 1 && !affine_events(line, affine, shares, false, events)) return {};
  std::vector<AxisCrossing> borders;
  for (const LineEvent& e : in_clusters(events)) borders.push_back(located(line, e));
  return borders;
}

}  // namespace tiltrim
