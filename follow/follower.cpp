#include "follow/follower.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "linearize/eigenvalues.hpp"
#include "linearize/linearize.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string to_string(EventKind kind) {
  switch (kind) {
    case EventKind::fold:
      return "fold";
    case EventKind::limit:
      return "limit";
    case EventKind::limit_left:
      return "limit_left";
    case EventKind::zero:
      return "zero";
    case EventKind::hopf:
      return "hopf";
    case EventKind::branch_point:
      return "branch_point";
    case EventKind::end:
      return "end";
  }
  return "unknown";
}

std::string to_string(BranchEnd end) {
  switch (end) {
    case BranchEnd::reached:
      return "reached";
    case BranchEnd::limit:
      return "limit";
    case BranchEnd::closed:
      return "closed";
    case BranchEnd::switched:
      return "switched";
    case BranchEnd::not_implied:
      return "not_implied";
    case BranchEnd::stuck:
      return "stuck";
    case BranchEnd::not_finite:
      return "not_finite";
    case BranchEnd::singular:
      return "singular";
    case BranchEnd::points:
      return "points";
    case BranchEnd::no_start:
      return "no_start";
    case BranchEnd::interrupted:
      return "interrupted";
  }
  return "unknown";
}

TraceOptions trace_options(const FollowOptions& o) {
  return {.first_step = std::min(0.05, o.max_step),
          .max_step = o.max_step,
          .max_points = o.max_points,
          .tolerance = o.tolerance,
          .step_tolerance = o.step_tolerance,
          .stop = o.stop};
}

constexpr double rounding_unit = std::numeric_limits<double>::epsilon();

static VectorXd computed_real_parts(const Follower& f, const CurvePoint& at) {
  constexpr double rounding = 1e-14;
  const Index n = std::ssize(f.problem.model.states);
  std::vector<Index> states;
  for (Index i = 0; i < n; ++i) states.push_back(i);
  const MatrixXd A = jacobian(f.problem.model, f.point(at), states).topRows(n);
  VectorXd re = VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN());
  if (!A.allFinite()) return re;
  const Eigen::VectorXcd lambda = eigenvalues(A);
  if (lambda.size() != n) return re;
  re = lambda.real();
  const double small = rounding * A.lpNorm<1>();
  for (double& r : re)
    if (std::abs(r) <= small) r = -std::numeric_limits<double>::denorm_min();
  std::ranges::sort(re, std::greater{});
  return re;
}

const VectorXd& real_parts(const Follower& f, const CurvePoint& at) {
  if (f.seen.size() != at.y.size() || f.seen != at.y) {
    f.seen_real_parts = computed_real_parts(f, at);
    f.seen = at.y;
  }
  return f.seen_real_parts;
}

// The second-order condition at this value of the parameter.
static bool is_least_at(const Follower& f, const VectorXd& y) {
  const Problem& p = f.problem;
  ActiveSet held = f.path.held;
  const Index after = p.n() + p.m() + std::ssize(held.unknowns);
  held.unknowns.push_back({f.path.parameter(), y[f.path.parameter()], 1.0});
  VectorXd lambda(y.size() - p.n() + 1);
  lambda << y.segment(p.n(), after - p.n()), 0.0, y.tail(y.size() - after);
  return is_least(p, held, f.path.z(y), lambda);
}

BranchPoint reported(const Follower& f, const CurvePoint& at) {
  BranchPoint b;
  const Values v = values(f.problem, f.path.z(at.y));
  b.point = f.point(at);
  b.parameter = at.y[f.path.parameter()] * f.nominal();
  b.rates = rates_of(f.problem, v);
  b.outputs = outputs(f.problem, b.point);
  b.residual = v.residual.size() > 0 ? v.residual.lpNorm<Eigen::Infinity>() : 0.0;
  b.step = at.step;
  if (f.stability) b.unstable = int((real_parts(f, at).array() > 0).count());
  if (f.path.deciding()) b.least = is_least_at(f, at.y);
  return b;
}

std::string not_implied(const Follower& f, const BranchPoint& b) {
  const Problem& p = f.problem;
  for (const Index row : p.implied)
    if (!(std::abs(b.rates[row]) <= f.options.tolerance * p.row_nominal[row]))
      return fmt::format("the equations hold, but {} = {:.3g} {} does not vanish",
                         row_name(p.model, row), b.rates[row], row_unit(p.model, row));
  return {};
}

BranchEvent& add(Follower& f, EventKind kind, const CurvePoint& at, std::string which) {
  std::vector<BranchEvent>& events = f.branch.events;
  const Index p = f.path.parameter();
  const double error = (at.step + 4 * rounding_unit * (1 + std::abs(at.y[p]))) * f.nominal();
  events.push_back(
      {kind, reported(f, at), error, f.branch.points.size(), std::move(which), {}, {}});
  if (!f.stability) return events.back();
  const LinearModel linear =
      linearize(f.problem.model, events.back().at.point, {.moving = f.moving});
  if (linear) events.back().modes = modes(linear);
  return events.back();
}

template <class Size>
static const Mode* least(const std::optional<Modes>& modes, const Size& size) {
  if (!modes || modes->modes.empty()) return nullptr;
  return &*std::ranges::min_element(modes->modes, {}, size);
}

BranchEvent& add_singular(Follower& f, EventKind kind, const CurvePoint& at) {
  constexpr double zero = 1e-5;  // 1/s
  BranchEvent& event = add(f, kind, at, "");
  const Mode* m = least(event.modes, [](const Mode& k) { return std::abs(k.eigenvalue); });
  if (!m || std::abs(m->eigenvalue) > zero) return event;
  event.eigenvalue = m->eigenvalue;
  event.which = m->name;
  return event;
}

// How far in the parameter a sign change of one of the sorted real parts, each within `error`, may
// be: to points on either side at which it clearly has either sign. Infinite if there are none.
static double sign_change_within(const Follower& f, const LocatedEvent& crossing, double error) {
  constexpr double farthest = 0.1;  // scaled
  const Curve curve = f.path.curve();
  const Index p = f.path.parameter();
  const CurvePoint& at = crossing.at;
  const auto beside = [&](double s, CurvePoint& point) {
    return first_point(curve, at.y + s * at.tangent, at.tangent, trace_options(f.options), point) ==
                   CurveEnd::stopped
               ? real_parts(f, point)[crossing.index] * (crossing.rising == (s > 0) ? 1 : -1)
               : 0.0;
  };
  const double left = error + std::abs(real_parts(f, at)[crossing.index]);
  const double rounding = 64 * rounding_unit * (1 + at.y.norm());
  const double first = 2 * left / std::abs(crossing.slope) + crossing.within + rounding;
  for (double s = first; s <= farthest; s *= 4) {
    CurvePoint before, after;
    if (!(beside(-s, before) > error && beside(s, after) > error)) continue;
    const double slope = std::max(
        {std::abs(before.tangent[p]), std::abs(at.tangent[p]), std::abs(after.tangent[p])});
    return f.nominal() * slope * s;
  }
  return std::numeric_limits<double>::infinity();
}

void add_crossing(Follower& f, const LocatedEvent& crossing) {
  BranchEvent& event = add(f, EventKind::zero, crossing.at, "");
  const Mode* m = least(event.modes, [](const Mode& k) { return std::abs(k.eigenvalue.real()); });
  if (!m) return;
  event.error += sign_change_within(f, crossing, m->error);
  event.eigenvalue = std::complex(m->eigenvalue.real(), std::abs(m->eigenvalue.imag()));
  event.which = m->name;
  if (m->eigenvalue.imag() != 0) event.kind = EventKind::hopf;
}

void end(Follower& f, BranchEnd how, const CurvePoint& at, std::string message) {
  f.branch.end = how;
  f.branch.message = message;
  add(f, EventKind::end, at, std::move(message));
}

// The switch of the model next to the last point, if any. Near a jump, finite differences and the
// tangent from them are unreliable: every unknown is tried.
static std::string switch_next_to(const Follower& f) {
  constexpr double near = 1e-4;  // with finite differences, Newton stops at this distance
  for (const Model::Switch& s : f.problem.model.switches) {
    const double here = s.distance(f.point(f.last));
    for (Index k = 0; k < f.problem.n(); ++k)
      for (const double step : {-near, near}) {
        CurvePoint beside = f.last;
        beside.y[k] += step;
        if (here * s.distance(f.point(beside)) <= 0) return s.name;
      }
  }
  return {};
}

// Values at the nearest point ahead at which they are not finite, along the tangent or along one
// unknown that moves; empty if there are none. Where differences reach over the edge, the branch
// ends before it.
static std::optional<VectorXd> not_finite_ahead(const Follower& f) {
  const Index n = f.problem.n();
  for (const double ahead : {1e-8, 1e-7, 1e-6, 1e-5, 1e-4}) {
    std::vector<VectorXd> steps{ahead * f.last.tangent};
    for (Index k = 0; k < n; ++k)
      if (const double t = f.last.tangent[k]; t != 0)
        steps.push_back(std::copysign(ahead, t) * VectorXd::Unit(f.last.y.size(), k));
    for (const VectorXd& step : steps) {
      const VectorXd y = f.last.y + step;
      if (!values(f.problem, f.path.z(y)).finite) return y;
    }
  }
  return {};
}

// What is not finite just beyond the last point, if it is known.
static std::string no_numbers(const Follower& f) {
  if (!f.problem.thrown.empty()) return "; the model threw: " + f.problem.thrown;
  const auto beyond = not_finite_ahead(f);
  if (!beyond) return "";
  CurvePoint there = f.last;
  there.y = *beyond;
  const Values v = values(f.problem, f.path.z(there.y));
  const std::string what =
      not_finite_in_words(f.problem, rates_of(f.problem, v), outputs(f.problem, f.point(there)));
  return what.empty() ? "" : ": " + what;
}

void end(Follower& f, CurveEnd how) {
  const Signal& parameter = signal_of(f.problem.model, f.problem.unknowns.back());
  const std::string here =
      fmt::format("at {} = {:.6g}{}{}", parameter.name, f.last.y[f.path.parameter()] * f.nominal(),
                  parameter.unit.empty() ? "" : " ", parameter.unit);
  if (how == CurveEnd::stuck || how == CurveEnd::not_finite || how == CurveEnd::singular)
    if (const std::string name = switch_next_to(f); !name.empty())
      return end(f, BranchEnd::switched, f.last,
                 fmt::format("the model switches {}: {}", here, name));
  if (how == CurveEnd::stuck && not_finite_ahead(f)) how = CurveEnd::not_finite;
  switch (how) {
    case CurveEnd::closed:
      return end(f, BranchEnd::closed, f.last, "the branch is a loop: back at its start");
    case CurveEnd::points:
      return end(f, BranchEnd::points, f.last,
                 fmt::format("stopped after {} points, {}", f.options.max_points, here));
    case CurveEnd::not_finite:
      return end(f, BranchEnd::not_finite, f.last,
                 fmt::format("the model is not finite beyond the point {}{}", here, no_numbers(f)));
    case CurveEnd::singular:
      return end(f, BranchEnd::singular, f.last,
                 fmt::format("the equations leave more than one direction {}: a continuum of "
                             "trims, or equations that depend on each other",
                             here));
    case CurveEnd::interrupted:
      return end(f, BranchEnd::interrupted, f.last, "stopped by the caller " + here);
    default:
      return end(f, BranchEnd::stuck, f.last,
                 fmt::format("no next point found {}, however short the step: the equations jump "
                             "or have a kink there",
                             here));
  }
}

}  // namespace tiltrim
