#include "sweep/grid_line.hpp"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <new>
#include <stdexcept>

#include "linearize/batch.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/modes.hpp"
#include "model/lookup.hpp"
#include "sweep/halves.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

std::optional<Sample> as_sample(double t, const OperatingPoint& at, const MatrixXd& A) {
  if (!A.allFinite()) return {};
  Sample s{t, at, A, eigenvalues(A)};
  if (s.eigenvalues.size() != A.rows()) return {};
  return s;
}

// At a zero eigenvalue the trim's own equations may be singular, and Newton does not converge. An
// equilibrium that stays constant while the line's parameters change exists there nevertheless.
std::optional<GridTrim> stays(const GridLine& line, double t, const OperatingPoint& near) {
  Problem problem = line.sweep.problem;
  problem.base = numbers_at(line.sweep, line.at(t));
  for (const Index j : problem.unknowns) set_value(problem.base, j, value_of(near, j));
  constexpr double round_off = 1e-12;  // scaled, 1/s: round-off of the rates
  try {
    const Values v = values(problem, unknowns_of(problem, problem.base));
    if (!(v.residual.lpNorm<Eigen::Infinity>() <= round_off)) return {};
    return equilibrium_at(line.sweep, problem.base);
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {  // settle() has failed, too
    return {};
  }
}

}  // namespace

// By a difference, all unknowns off by a step at round-off; infinite where that cannot be told.
static double blur(const Prepared& sweep, OperatingPoint at, const MatrixXd& A) {
  constexpr double off = 1e-6;  // nominal sizes
  for (Index k = 0; k < sweep.problem.n(); ++k) {
    const Index j = sweep.problem.unknowns[std::size_t(k)];
    set_value(at, j, value_of(at, j) + off * sweep.problem.nominal[k]);
  }
  try {
    const double moved = (equilibrium_at(sweep, at).A(sweep) - A).norm();
    return std::isfinite(moved) ? step_at_rest / off * moved : infinity;
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    return infinity;
  }
}

OperatingPoint operating_point(const GridLine& line, std::size_t k) {
  OperatingPoint at = numbers_at(line.sweep, line.at(double(k)));
  const std::size_t n = std::size_t(line.sweep.states()), p = line.point(k);
  for (std::size_t i = 0; i < n; ++i) at.x[Index(i)] = line.map.state[p * n + i];
  const std::vector<Index>& inputs = line.sweep.inputs;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (inputs[i] < at.u.size()) at.u[inputs[i]] = line.map.input[p * inputs.size() + i];
  return at;
}

// Computes GridTrim again, since the map need not store all free variables of the trim.
std::optional<GridTrim> settled_at(const GridLine& line, std::size_t k) {
  if (!line.valid(k)) return {};
  return settle(line.sweep, line.at(double(k)), operating_point(line, k));
}

std::optional<Sample> grid_sample(const GridLine& line, std::size_t k) {
  const auto e = settled_at(line, k);
  if (!e) return {};
  return as_sample(double(k), e->at, e->A(line.sweep));
}

MatrixLine matrices_of(const GridLine& line) {
  return {[&line](double t, const Sample& near) -> std::optional<Sample> {
            auto e = settle(line.sweep, line.at(t), near.at);
            if (!e) e = stays(line, t, near.at);
            if (!e) return {};
            return as_sample(t, e->at, e->A(line.sweep));
          },
          [&line](const Sample& a, const Sample& b) { return apart(line.sweep, a.at, b.at); },
          [&line](const Sample& s) { return blur(line.sweep, s.at, s.A); }};
}

namespace {

// Location of a switch of the model between two grid points: two positions as close as possible,
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

// After a switch: if Newton from the neighbour fails, a full trim without a starting point.
std::optional<Sample> beyond_switch(const GridLine& line, const MatrixLine& matrices, double t,
                                    const std::optional<Sample>& near) {
  if (near)
    if (auto sample = matrices.sample(t, *near)) return sample;
  const GridTrim e = from_nothing(line.sweep, line.at(t));
  if (!e.valid()) return {};
  return as_sample(t, e.at, e.A(line.sweep));
}

}  // namespace

namespace {

// True unless no two adjacent points have eigenvalues near the axis.
bool may_ride(const GridLine& line) {
  const std::size_t n = line.map.modes();
  const double near = std::sqrt(std::numeric_limits<double>::epsilon());
  const auto close = [&](std::size_t k) {
    const auto re = std::span(line.map.eigenvalue_re).subspan(line.point(k) * n, n);
    const auto im = std::span(line.map.eigenvalue_im).subspan(line.point(k) * n, n);
    double least = std::numeric_limits<double>::infinity(), largest = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      least = std::min(least, std::abs(re[i]));
      largest = std::max(largest, std::hypot(re[i], im[i]));
    }
    return least <= near * largest;
  };
  for (std::size_t k = 0; k + 1 < line.size(); ++k)
    if (close(k) && close(k + 1)) return true;
  return false;
}

// Looks between two samples of a line on which eigenvalues may ride, at positions within one step.
void look_beside_axis(const MatrixLine& matrices, double from, const std::optional<Sample>& a,
                      double to, const std::optional<Sample>& b, std::vector<LineEvent>& events,
                      std::vector<Sample>& seen, std::vector<Riding>& riding) {
  Index n = std::min(a ? on_axis(*a) : 0, b ? on_axis(*b) : 0);
  if (n > 0) {
    const std::optional<Sample> middle = matrices.sample(0.5 * (from + to), *a);
    n = std::min(n, middle ? on_axis(*middle) : 0);
  }
  const auto beside = [](const std::optional<Sample>& s) {
    return s ? std::optional(without(*s, on_axis(*s))) : s;
  };
  const MatrixLine left{[&](double t, const Sample& near) -> std::optional<Sample> {
                          const auto s = matrices.sample(t, near);
                          return s ? std::optional(without(*s, n)) : s;
                        },
                        matrices.apart, matrices.blur};
  // Where another eigenvalue meets those on the axis, half of the digits are lost.
  constexpr double least = 1e-6;
  events_between(left, from, beside(a), to, beside(b), least, events, seen, n);
  if (n == 0) return;
  if (!riding.empty() && riding.back().to == from)
    riding.back().to = to;
  else
    riding.push_back({from, to});
}

// With an end on the axis, rounding may leave both of its steps clear: its eigenvalues, the same
// for both, then differ in number from those at one of the other ends.
bool step_is_clear(const Halves& h, std::span<const double> bends, std::size_t k,
                   std::optional<Eigenvectors>& nearby) {
  const std::size_t a = 2 * k, m = a + 1, b = a + 2;
  if (!h.found(a) || !h.found(m) || !h.found(b) || h.unstable(a) != h.unstable(b)) return false;
  if (!continuous(h.apart(a, m), h.apart(m, b), h.apart(a, b))) return false;
  if (!(bends[a] >= 0 || bends[b] >= 0)) return false;  // nothing next to it tells of an inflection
  const std::size_t most = bends[b] >= 0 && !(bends[a] >= bends[b]) ? b : a;
  const dense::SmallMatrix bend = bends[most] > bends[m] ? h.bend(most) : dense::SmallMatrix();
  return is_clear(nearby, h.A(a), h.A(m), spectrum(h.eigenvalues(m)), h.A(b), bend);
}

// The sample at t, if it is one of the halves.
std::optional<Sample> known(const Halves& halves, double t) {
  const double i = 2 * t;
  if (i != std::floor(i) || !halves.found(std::size_t(i))) return {};
  return halves.sample(std::size_t(i));
}

}  // namespace

void search_events(const GridLine& line, const Halves& halves, std::vector<LineEvent>& events,
                   std::vector<Sample>& seen, std::vector<Riding>& riding) {
  MatrixLine matrices = matrices_of(line);
  matrices.sample = [&, computed = matrices.sample](double t, const Sample& near) {
    const std::optional<Sample> sample = known(halves, t);
    return sample ? sample : computed(t, near);
  };
  const auto grid = [&](std::size_t k) {
    const std::optional<Sample> sample = known(halves, double(k));
    return sample ? sample : grid_sample(line, k);
  };
  const bool ordinary = !may_ride(line);
  const auto look = [&](double from, const std::optional<Sample>& a, double to,
                        const std::optional<Sample>& b) {
    if (!(to - from > finest) && a && b && a->unstable() == b->unstable()) return;
    ordinary ? events_between(matrices, from, a, to, b, finest, events, seen)
             : look_beside_axis(matrices, from, a, to, b, events, seen, riding);
  };
  const auto unstable = [&](const std::optional<Sample>& s) {
    return !s ? -1 : ordinary ? s->unstable() : without(*s, on_axis(*s)).unstable();
  };
  const std::vector<double> bends = halves.bends();
  std::optional<Eigenvectors> nearby;
  std::optional<Sample> a = grid(0);
  if (a) seen.push_back(*a);
  std::size_t at = 0;  // the point of a
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const std::vector<SwitchPlace> switches = switches_between(line, k);
    if (ordinary && switches.empty() && step_is_clear(halves, bends, k, nearby)) {
      for (const std::size_t i : {2 * k + 1, 2 * k + 2}) seen.push_back(halves.sample(i));
      continue;
    }
    if (at != k) a = grid(k);
    const std::optional<Sample> end = grid(k + 1);
    double from = double(k);
    for (const SwitchPlace& s : switches) {
      const std::optional<Sample> left = beyond_switch(line, matrices, s.before, a);
      const std::optional<Sample> right = beyond_switch(line, matrices, s.after, end);
      look(from, a, s.before, left);
      const int before = unstable(left), after = unstable(right);
      if (before != after)
        events.push_back({s.before, s.after, left && right ? CrossingKind::jump : CrossingKind::end,
                          before, after, 0.0});
      for (const auto& sample : {left, right})
        if (sample) seen.push_back(*sample);
      a = right;
      from = s.after;
    }
    look(from, a, double(k) + 1, end);
    if (end) seen.push_back(*end);
    a = end;
    at = k + 1;
  }
}

namespace {

// Position at which φ has the given value, on a line along which it is monotone.
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

// All crossings at once, as the roots of one polynomial; false if rounding leaves doubt, or if the
// slope is not of rank one.
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

// The same by bisection: pieces of a straight line have no curvature, however long they are.
void halve(const AffineStretch& stretch, std::vector<LineEvent>& events) {
  std::vector<Sample> seen;
  const MatrixLine matrices{
      [&](double x, const Sample&) { return as_sample(x, {}, stretch.at(x)); },
      [](const Sample&, const Sample&) { return 0.0; }, [](const Sample&) { return 0.0; }};
  const double length = stretch.length;
  events_between(matrices, 0.0, as_sample(0.0, {}, stretch.at(0.0)), length,
                 as_sample(length, {}, stretch.at(length)), finest * std::abs(length), events,
                 seen);
}

// φ - φ(first point) at all points; empty where the structure does not hold.
std::vector<double> shares_of(const GridLine& line, const AffineLine& affine) {
  std::vector<double> shares;
  OperatingPoint at = numbers_at(line.sweep, line.place);
  for (std::size_t k = 0; k < line.size(); ++k) {
    move_to(line.sweep, line.axis, double(k), at);
    const auto share = affine.share(at.p);
    if (!share) return {};
    shares.push_back(*share);
  }
  return shares;
}

// True if φ ascends or descends throughout. Where it has a pole between two points, its value in
// their middle lies beyond theirs.
bool monotone(const GridLine& line, const AffineLine& affine, std::span<const double> shares) {
  const bool up = shares.back() > shares.front();
  const auto rises = [&](double from, double to) { return up ? to > from : to < from; };
  for (std::size_t k = 0; k + 1 < shares.size(); ++k) {
    const auto middle = affine.share(numbers_at(line.sweep, line.at(double(k) + 0.5)).p);
    if (!middle || !rises(shares[k], *middle) || !rises(*middle, shares[k + 1])) return false;
  }
  return true;
}

}  // namespace

bool affine_events(const GridLine& line, const AffineLine& affine, std::span<const double> shares,
                   bool bisect, std::vector<LineEvent>& events) {
  if (shares.empty() || !monotone(line, affine, shares)) return false;
  const AffineStretch stretch{affine, shares.back()};
  if (!roots(stretch, events)) {
    events.clear();
    if (!bisect) return false;
    halve(stretch, events);
  }
  try {
    for (LineEvent& e : events) {
      e.left = position_of(line, *affine.structure, affine.phi + e.left);
      e.right = position_of(line, *affine.structure, affine.phi + e.right);
      if (e.root) e.root = position_of(line, *affine.structure, affine.phi + *e.root);
    }
  } catch (const std::bad_optional_access&) {  // φ does not exist between two points
    events.clear();
    return false;
  }
  return true;
}

bool solve_events(const GridLine& line, std::vector<LineEvent>& events) {
  if (!line.sweep.affine[line.axis] || may_ride(line)) return false;
  for (std::size_t k = 0; k < line.size(); ++k)
    if (!line.valid(k)) return false;
  const auto first = settled_at(line, 0);
  if (!first) return false;
  const auto affine = affine_line(line.sweep, line.place, line.axis, *first);
  return affine && affine_events(line, *affine, shares_of(line, *affine), true, events);
}

}  // namespace tiltrim
