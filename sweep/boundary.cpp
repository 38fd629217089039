#include "sweep/boundary.hpp"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>

#include "linearize/modes.hpp"
#include "linearize/stability_map.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double finest = 1e-10;  // of a step of the grid: where crossings are told apart no more
constexpr double trusted = 0.5;   // of a link, to say which mode it is that crosses

// One line of the map along an axis.
struct GridLine {
  const Prepared& sweep;
  const SweepMap& map;
  int condition;
  std::size_t axis;
  GridPlace place;  // of its first point

  std::size_t size() const { return sweep.axes[axis].size(); }
  std::size_t point(std::size_t k) const {
    std::size_t number = std::size_t(condition);
    for (std::size_t a = 0; a < sweep.axes.size(); ++a)
      number = number * sweep.axes[a].size() + (a == axis ? k : std::size_t(place[a]));
    return number;
  }
  GridPlace at(double t) const {
    GridPlace there = place;
    there[axis] = t;
    return there;
  }
  bool valid(std::size_t k) const { return map.verdict[point(k)] >= 0; }
};

// The equilibrium that the map has at the line's point k.
OperatingPoint operating_point(const GridLine& line, std::size_t k) {
  OperatingPoint at = numbers_at(line.sweep, line.at(double(k)));
  const std::size_t n = std::size_t(line.sweep.states()), p = line.point(k);
  for (std::size_t i = 0; i < n; ++i) at.x[Index(i)] = line.map.state[p * n + i];
  const std::vector<Index>& inputs = line.sweep.inputs;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (inputs[i] < at.u.size()) at.u[inputs[i]] = line.map.input[p * inputs.size() + i];
  return at;
}

std::optional<Sample> as_sample(double t, const OperatingPoint& at, const MatrixXd& A) {
  if (!A.allFinite()) return {};
  Sample s{t, at, A, eigenvalues(A)};
  if (s.eigenvalues.size() != A.rows()) return {};
  return s;
}

// GridTrim again, since the map need not keep all that the trim is free to move.
std::optional<GridTrim> settled_at(const GridLine& line, std::size_t k) {
  if (!line.valid(k)) return {};
  return settle(line.sweep, line.at(double(k)), operating_point(line, k));
}

std::optional<Sample> grid_sample(const GridLine& line, std::size_t k) {
  const auto e = settled_at(line, k);
  if (!e) return {};
  return as_sample(double(k), e->at, e->A(line.sweep));
}

// Where an eigenvalue is zero the trim's own equations may be singular, and nothing settles. An
// equilibrium that stays where it is while the line's numbers move is there all the same.
std::optional<GridTrim> stays(const GridLine& line, double t, const OperatingPoint& near) {
  Problem problem = line.sweep.problem;
  problem.base = numbers_at(line.sweep, line.at(t));
  for (const Index j : problem.unknowns) set_value(problem.base, j, value_of(near, j));
  constexpr double round_off = 1e-12;  // scaled, 1/s: round-off of the rates
  try {
    const Values v = values(problem, unknowns_of(problem, problem.base));
    if (!(v.residual.lpNorm<Eigen::Infinity>() <= round_off)) return {};
    return equilibrium_at(line.sweep, problem.base);
  } catch (const std::exception&) {  // settle() has been refused, too
    return {};
  }
}

MatrixLine matrices_of(const GridLine& line) {
  return {[&line](double t, const Sample& near) -> std::optional<Sample> {
            auto e = settle(line.sweep, line.at(t), near.at);
            if (!e) e = stays(line, t, near.at);
            if (!e) return {};
            return as_sample(t, e->at, e->A(line.sweep));
          },
          [&line](const Sample& a, const Sample& b) { return apart(line.sweep, a.at, b.at); }};
}

// Where a switch of the model lies between two points of the grid: two places as near as can be,
// one on each side.
struct SwitchPlace {
  double before, after;
};

std::vector<SwitchPlace> switches_between(const GridLine& line, std::size_t k) {
  std::vector<SwitchPlace> places;
  for (const Model::Switch& s : line.sweep.model().switches) {
    const auto side = [&](double t) { return s.distance(numbers_at(line.sweep, line.at(t))) >= 0; };
    double a = double(k), b = double(k) + 1;
    const bool at_a = side(a);
    if (at_a == side(b)) continue;
    constexpr int halvings = 60;
    for (int i = 0; i < halvings; ++i) {
      const double middle = 0.5 * (a + b);
      if (middle <= a || middle >= b) break;
      (side(middle) == at_a ? a : b) = middle;
    }
    places.push_back({a, b});
  }
  std::ranges::sort(places, {}, &SwitchPlace::before);
  return places;
}

// From a switch on, the trim starts anew: from nothing where its neighbours' does not settle.
std::optional<Sample> beyond_switch(const GridLine& line, const MatrixLine& matrices, double t,
                                    const std::optional<Sample>& near) {
  if (near)
    if (auto sample = matrices.sample(t, *near)) return sample;
  const GridTrim e = from_nothing(line.sweep, line.at(t));
  if (!e.valid()) return {};
  return as_sample(t, e.at, e.A(line.sweep));
}

// All that happens on the line, found by halving the steps of the grid.
void search(const GridLine& line, std::vector<LineEvent>& events, std::vector<Sample>& seen) {
  const MatrixLine matrices = matrices_of(line);
  std::optional<Sample> a = grid_sample(line, 0);
  if (a) seen.push_back(*a);
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const std::optional<Sample> end = grid_sample(line, k + 1);
    double from = double(k);
    for (const SwitchPlace& s : switches_between(line, k)) {
      const std::optional<Sample> left = beyond_switch(line, matrices, s.before, a);
      const std::optional<Sample> right = beyond_switch(line, matrices, s.after, end);
      events_between(matrices, from, a, s.before, left, finest, events, seen);
      const int before = left ? left->unstable() : -1, after = right ? right->unstable() : -1;
      if (before != after)
        events.push_back({s.before, s.after, left && right ? CrossingKind::jump : CrossingKind::end,
                          before, after, 0.0});
      for (const auto& sample : {left, right})
        if (sample) seen.push_back(*sample);
      a = right;
      from = s.after;
    }
    events_between(matrices, from, a, double(k) + 1, end, finest, events, seen);
    if (end) seen.push_back(*end);
    a = end;
  }
}

// Where φ has the value, on a line along which it is monotone.
double position_of(const GridLine& line, const Model::Affine& structure, double phi) {
  const auto miss = [&](double t) {
    return structure.phi(numbers_at(line.sweep, line.at(t)).p).value() - phi;
  };
  const double last = double(line.size() - 1);
  if (miss(0.0) * miss(last) >= 0) return std::abs(miss(0.0)) < std::abs(miss(last)) ? 0.0 : last;
  boost::uintmax_t most = 100;
  const auto [low, high] = boost::math::tools::toms748_solve(
      miss, 0.0, last, boost::math::tools::eps_tolerance<double>(52), most);
  return 0.5 * (low + high);
}

// The matrices first + x slope for x from 0 to length.
struct AffineStretch {
  const AffineLine& line;
  double length;

  MatrixXd at(double x) const { return line.first + x * line.slope; }
  int unstable(double x) const { return Sample{x, {}, {}, eigenvalues(at(x))}.unstable(); }
};

// All crossings at once, the roots of one polynomial; false if rounding leaves doubt, or the slope
// is not of rank one.
bool roots(const AffineStretch& stretch, std::vector<LineEvent>& events) {
  const double length = stretch.length;
  LineCrossings found;
  try {
    found = line_crossings(stretch.line.first, stretch.line.slope, std::min(0.0, length),
                           std::max(0.0, length));
  } catch (const std::invalid_argument&) {
    return false;
  }
  if (!found.complete) return false;
  if (length < 0) std::ranges::reverse(found.crossings);
  std::vector<double> ends{0.0};
  for (const LineCrossing& c : found.crossings) ends.push_back(c.t);
  ends.push_back(length);
  const auto between = [&](std::size_t i) {
    return stretch.unstable(0.5 * (ends[i] + ends[i + 1]));
  };
  int before = between(0);
  for (std::size_t i = 0; i < found.crossings.size(); ++i) {
    const LineCrossing& c = found.crossings[i];
    const int after = between(i + 1);
    const CrossingKind kind = before == after   ? CrossingKind::touch
                              : c.frequency > 0 ? CrossingKind::hopf
                                                : CrossingKind::zero;
    const double error = std::copysign(c.error, length);
    events.push_back({c.t - error, c.t + error, kind, before, after, c.frequency});
    before = after;
  }
  return true;
}

// The same by halving: pieces of a straight line have no bend, however long they are.
void halve(const AffineStretch& stretch, std::vector<LineEvent>& events) {
  std::vector<Sample> seen;
  const MatrixLine matrices{
      [&](double x, const Sample&) { return as_sample(x, {}, stretch.at(x)); },
      [](const Sample&, const Sample&) { return 0.0; }};
  const double length = stretch.length;
  events_between(matrices, 0.0, as_sample(0.0, {}, stretch.at(0.0)), length,
                 as_sample(length, {}, stretch.at(length)), finest * std::abs(length), events,
                 seen);
}

// φ at every point of the line, rising or falling throughout.
bool monotone(const GridLine& line, const Model::Affine& structure) {
  std::optional<double> before;
  int way = 0;
  OperatingPoint at = numbers_at(line.sweep, line.place);
  for (std::size_t k = 0; k < line.size(); ++k) {
    move_to(line.sweep, line.axis, double(k), at);
    const auto phi = structure.phi(at.p);
    if (!phi) return false;
    const int step = before ? (*phi > *before) - (*phi < *before) : 0;
    if (before && (step == 0 || step == -way)) return false;
    if (before) way = step;
    before = phi;
  }
  return true;
}

// Along an axis in whose φ the matrices are affine. False if the line has no such structure.
bool solve(const GridLine& line, std::vector<LineEvent>& events) {
  const Model::Affine* structure = line.sweep.affine[line.axis];
  if (!structure || !monotone(line, *structure)) return false;
  for (std::size_t k = 0; k < line.size(); ++k)
    if (!line.valid(k)) return false;
  const auto first = settled_at(line, 0);
  if (!first) return false;
  const auto affine = affine_line(line.sweep, line.place, line.axis, *first);
  if (!affine) return false;
  const double last = *structure->phi(numbers_at(line.sweep, line.at(double(line.size() - 1))).p);
  const AffineStretch stretch{*affine, last - affine->phi};
  if (!roots(stretch, events)) {
    events.clear();
    halve(stretch, events);
  }
  try {
    for (LineEvent& e : events) {
      e.left = position_of(line, *structure, affine->phi + e.left);
      e.right = position_of(line, *structure, affine->phi + e.right);
    }
  } catch (const std::bad_optional_access&) {  // between two points there is no φ
    events.clear();
    return false;
  }
  return true;
}

// Which mode of the map it is that crosses at an event, by the grid's point before it.
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

AxisCrossing crossing_at(const GridLine& line, const LineEvent& event) {
  AxisCrossing crossing;
  crossing.condition = line.condition;
  crossing.axis = int(line.axis);
  crossing.at = coordinates(line, event.at());
  const std::vector<double>& v = line.sweep.axes[line.axis].columns.front().values;
  const std::size_t k = std::min(std::size_t(event.at()), v.size() - 2);
  crossing.error = 0.5 * (event.right - event.left) * std::abs(v[k + 1] - v[k]);
  crossing.kind = event.kind;
  crossing.unstable_before = event.before;
  crossing.unstable_after = event.after;
  crossing.frequency = event.frequency;
  name_mode(line, event, crossing);
  return crossing;
}

// The largest real part between two places, and where; refined about the largest seen.
void largest_abscissa(const GridLine& line, const std::vector<Sample>& seen, double from, double to,
                      AxisInterval& interval) {
  std::vector<const Sample*> inside;
  for (const Sample& s : seen)
    if (s.t >= from && s.t <= to) inside.push_back(&s);
  std::ranges::stable_sort(inside, {}, [](const Sample* s) { return s->t; });
  std::optional<Sample> middle;  // of an interval between two points of the grid
  if (inside.empty() && !seen.empty()) {
    const auto nearest =
        std::ranges::min_element(seen, {}, [&](const Sample& s) { return std::abs(s.t - from); });
    middle = matrices_of(line).sample(from + 0.5 * (to - from), *nearest);
    if (middle) inside.push_back(&*middle);
  }
  if (inside.empty()) return;
  const auto most =
      std::ranges::max_element(inside, {}, [](const Sample* s) { return s->abscissa(); });
  double t = (*most)->t, abscissa = (*most)->abscissa();
  if (line.sweep.axes.size() == 1 && interval.verdict != IntervalVerdict::undecided) {
    const MatrixLine matrices = matrices_of(line);
    const double left = most == inside.begin() ? t : (*(most - 1))->t;
    const double right = most + 1 == inside.end() ? t : (*(most + 1))->t;
    const auto negative = [&](double at) {
      const auto s = matrices.sample(at, **most);
      return s ? -s->abscissa() : std::numeric_limits<double>::max();
    };
    boost::uintmax_t steps = 50;
    constexpr int bits = 26;  // a smooth maximum is no better known
    const auto [best, value] =
        boost::math::tools::brent_find_minima(negative, left, right, bits, steps);
    if (-value > abscissa) {
      abscissa = -value;
      t = best;
    }
  }
  const double rounding = 64 * std::numeric_limits<double>::epsilon() * (*most)->A.norm();
  interval.abscissa = std::abs(abscissa) <= rounding ? 0.0 : abscissa;  // at a crossing itself
  interval.abscissa_at = coordinate(line.sweep.axes[line.axis], t);
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

// From event to event; one that could not be told from a crossing is an interval of its own if
// wide.
std::vector<AxisInterval> intervals(const GridLine& line, const std::vector<LineEvent>& events,
                                    const std::vector<Sample>& seen) {
  std::vector<AxisInterval> all;
  const SweepAxis& axis = line.sweep.axes[line.axis];
  const auto add = [&](double from, double to, int unstable, bool decided) {
    AxisInterval i;
    i.condition = line.condition;
    i.axis = int(line.axis);
    i.at = coordinates(line, from);
    i.from = coordinate(axis, from);
    i.to = coordinate(axis, to);
    const bool known = unstable >= 0 || !any_trim(line, from, to);  // else trims without a model
    i.verdict = decided && known ? verdict_of(unstable) : IntervalVerdict::undecided;
    i.unstable = std::max(unstable, 0);
    i.abscissa = i.abscissa_at = std::numeric_limits<double>::quiet_NaN();
    if (unstable >= 0) largest_abscissa(line, seen, from, to, i);
    all.push_back(i);
  };
  const double last = double(line.size() - 1);
  int unstable = events.empty() ? -1 : events.front().before;
  if (events.empty() && line.valid(0))
    unstable = grid_sample(line, 0) ? grid_sample(line, 0)->unstable() : -1;
  double from = 0.0;
  for (const LineEvent& e : events) {  // what holds before it, at it, after it
    const bool jump = e.kind == CrossingKind::jump || e.kind == CrossingKind::end;
    const bool wide = e.kind == CrossingKind::touch && std::abs(e.right - e.left) > 2 * finest;
    add(from, jump || wide ? e.left : e.at(), e.before, true);
    if (wide) add(e.left, e.right, std::max(e.before, e.after), false);
    from = jump || wide ? e.right : e.at();
    unstable = e.after;
  }
  add(from, last, unstable, true);
  std::erase_if(all, [](const AxisInterval& i) { return i.from == i.to; });
  return all;
}

// Events nearer to each other than `cluster` are one: a crossing at a point of the grid is seen
// from both sides, a curve that touches the axis crosses it at every rounding, and where a real
// eigenvalue crosses zero in the trim's own equations there is no trim to be had at the place
// itself.
std::vector<LineEvent> in_clusters(const std::vector<LineEvent>& events) {
  constexpr double cluster = 1e-6;  // of a step of the grid
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

// Where more unknowns than equations leave an optimum to be found at each point, neighbours do not
// settle from one another.
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

}  // namespace

LineVerdicts look_between(const Prepared& sweep, const SweepMap& map, int condition,
                          std::size_t axis, const GridPlace& place) {
  const GridLine line{sweep, map, condition, axis, place};
  std::vector<LineEvent> events;
  std::vector<Sample> seen;
  if (line.size() < 2) return {};
  if (!sweep.problem.square()) return {{}, {not_looked_at(line)}};
  if (!solve(line, events)) {
    events.clear();
    search(line, events, seen);
  }
  events = in_clusters(events);
  if (seen.empty())
    for (std::size_t k = 0; k < line.size(); ++k)
      if (line.valid(k)) {
        Sample s{double(k), operating_point(line, k), {}, {}};
        s.eigenvalues = Eigen::VectorXcd::Constant(1, map.spectral_abscissa[line.point(k)]);
        seen.push_back(s);
      }
  LineVerdicts found;
  for (const LineEvent& e : events) found.crossings.push_back(crossing_at(line, e));
  found.intervals = intervals(line, events, seen);
  return found;
}

}  // namespace tiltrim
