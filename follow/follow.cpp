#include "follow/follow.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "follow/follower.hpp"
#include "follow/linear_at.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "trim/problem.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double same_place = 1e-6;  // along the branch: crossings closer than this are the same

std::string words(const LimitName& limit) {
  return limit.signal + (limit.upper ? " upper" : " lower");
}

// Test functions: positions in test_functions().
enum BranchEvent : std::size_t { turning, target, limits, branching, stability };

std::vector<TestFunction> test_functions(const Follower& f, const std::vector<LimitName>& names) {
  const Index parameter = f.path.parameter();
  std::vector<TestFunction> all(5);
  all[turning] = [parameter](const CurvePoint& at) {
    return VectorXd::Constant(1, at.tangent[parameter]);
  };
  all[target] = [parameter, to = f.to](const CurvePoint& at) {
    return VectorXd::Constant(1, at.y[parameter] - to);
  };
  all[limits] = [&](const CurvePoint& at) { return limit_distances(f.path, names, at.y); };
  all[branching] = [](const CurvePoint& at) { return VectorXd::Constant(1, at.turn); };
  all[stability] = [&f](const CurvePoint& at) {
    return f.stability ? real_parts(f, at) : VectorXd();
  };
  return all;
}

// At a fold or branch point an eigenvalue crosses zero, at a Hopf point two eigenvalues cross
// together: each is one event.
void merge(std::vector<LocatedEvent>& found) {
  const auto known = [&](const LocatedEvent& c) {
    const auto same = [&](const LocatedEvent& other) {
      if (std::abs(other.at.s - c.at.s) > same_place + other.within + c.within) return false;
      return other.which == turning || other.which == branching ||
             (other.which == stability && other.index < c.index);
    };
    return c.which == stability && std::ranges::any_of(found, same);
  };
  std::vector<LocatedEvent> distinct;
  for (const LocatedEvent& c : found)
    if (!known(c)) distinct.push_back(c);
  found = std::move(distinct);
}

void reach(Follower& f, CurvePoint there) {
  there.y[f.path.parameter()] = f.to;  // located to round-off: now refined
  end(f, BranchEnd::reached, there,
      fmt::format("{} reaches the requested value",
                  signal_of(f.problem.model, f.problem.unknowns.back()).name));
}

// The target next to the last point: no step crosses it where the model is not defined beyond.
bool reached_at_edge(Follower& f, const TraceOptions& options) {
  constexpr double near = 1e-6;  // nominal sizes
  const Index p = f.path.parameter();
  const double left = f.to - f.last.y[p];
  CurvePoint there;
  if (std::abs(left) > near || !(left * f.last.tangent[p] > 0) ||
      !point_at(f.path.curve(), f.last, p, f.to, options, there))
    return false;
  reach(f, there);
  return true;
}

// Returns whether the branch continues.
bool meet(Follower& f, const LocatedEvent& crossing, const std::vector<LimitName>& names) {
  switch (crossing.which) {
    case turning:
      add_singular(f, EventKind::fold, crossing.at);
      if (!f.path.optimal || f.path.deciding()) return true;
      end(f, BranchEnd::limit, crossing.at,
          "at its limits no free unknown is left and the branch turns back: no trim exists beyond");
      return false;
    case target:
      reach(f, crossing.at);
      return false;
    case limits: {
      if (crossing.rising) return true;
      const LimitName& limit = names[std::size_t(crossing.index)];
      add(f, limit.held ? EventKind::limit_left : EventKind::limit, crossing.at, words(limit));
      f.last = crossing.at;
      f.pending = limit;
      return false;
    }
    case branching: {
      CurvePoint there = crossing.at;
      const double off =
          refine_branch_point(f.path.curve(), f.path.parameter(), slope_error(f.path), there);
      // Not moved onto the branch point: the distance at which Newton stopped, if known.
      const double near =
          crossing.within > 0 ? crossing.within : std::numeric_limits<double>::infinity();
      add_singular(f, EventKind::branch_point, there).error =
          f.nominal() * (std::isfinite(off) ? off : near);
      return true;
    }
    default:
      add_crossing(f, crossing);
      return true;
  }
}

// Derivatives of the distances to the limits along the tangent at a point.
VectorXd limits_ahead(const Follower& f, const std::vector<LimitName>& names,
                      const CurvePoint& at) {
  constexpr double ahead = 1e-6;
  return limit_distances(f.path, names, at.y + ahead * at.tangent) -
         limit_distances(f.path, names, at.y);
}

// A limit that the start lies on and that the branch would violate.
std::optional<LocatedEvent> limit_at_start(const Follower& f, const std::vector<LimitName>& names,
                                           const CurvePoint& start) {
  constexpr double on = 1e-10, rounding = 1e-14;
  const VectorXd distance = limit_distances(f.path, names, start.y);
  const VectorXd change = limits_ahead(f, names, start);
  for (Index i = 0; i < distance.size(); ++i)
    if (distance[i] <= on && change[i] < -rounding) return LocatedEvent{limits, i, false, start};
  return {};
}

// One section of the branch, until its end or a change of the held limits.
void stretch(Follower& f, const CurvePoint& start) {
  const Curve curve = f.path.curve();
  const std::vector<LimitName> names = limit_names(f.path);
  f.last = start;
  f.pending.reset();
  if (const auto at_once = limit_at_start(f, names, start)) {
    meet(f, *at_once, names);
    return;
  }
  bool ended = false;
  TraceOptions options = trace_options(f.options);
  options.max_points = f.options.max_points - int(f.branch.points.size()) + 1;
  const auto visit = [&](const CurvePoint& next, std::vector<LocatedEvent>& found) {
    merge(found);
    for (const LocatedEvent& crossing : found)
      if (!meet(f, crossing, names)) {
        ended = true;
        return false;
      }
    f.last = next;
    f.branch.points.push_back(reported(f, next));
    if (std::string why = not_implied(f, f.branch.points.back()); !why.empty()) {
      f.branch.points.pop_back();
      end(f, BranchEnd::not_implied, next, std::move(why));
      ended = true;
      return false;
    }
    if (f.options.observe)
      f.options.observe(f.branch.points.back().parameter, f.branch.points.size());
    return true;
  };
  const CurveEnd came_to = trace(curve, start, test_functions(f, names), options, visit);
  const bool stopped = came_to == CurveEnd::not_finite || came_to == CurveEnd::stuck;
  if (!ended && !(stopped && reached_at_edge(f, options))) end(f, came_to);
}

// The path with the new set of held limits from `last`, in the feasible direction of `limit`: the
// multiplier grows if it is held, the distance if it is not. Empty if there is no such path.
std::optional<CurvePoint> along(Follower& f, const LimitName& limit) {
  const VectorXd start = f.path.start(f.path.z(f.last.y));
  VectorXd towards = VectorXd::Zero(start.size());
  towards.head(f.problem.n()) = f.last.tangent.head(f.problem.n());
  CurvePoint point;
  if (first_point(f.path.curve(), start, towards, trace_options(f.options), point) !=
      CurveEnd::stopped)
    return {};
  point.s = f.last.s;
  const std::vector<LimitName> names = limit_names(f.path);
  const auto at = std::ranges::find_if(names, [&](const LimitName& n) {
    return n.signal == limit.signal && n.upper == limit.upper;
  });
  if (limits_ahead(f, names, point)[at - names.begin()] < 0) point.tangent = -point.tangent;
  return point;
}

// Holds the limit just met, or releases one: the path that continues the branch, or empty.
std::optional<CurvePoint> changed(Follower& f) {
  const LimitName limit = *f.pending;
  const bool of_parameter = limit.of_unknown && limit.as.position == f.path.parameter();
  if (!f.path.optimal || of_parameter || (!limit.held && f.path.free() == 0)) return {};
  std::vector<Held>& held = limit.of_unknown ? f.path.held.unknowns : f.path.held.limited;
  if (limit.held)
    std::erase_if(held, [&](const Held& h) {
      return h.position == limit.as.position && h.side == limit.as.side;
    });
  else
    held.push_back(limit.as);
  return along(f, limit);
}

// y at the start; empty if the start is not a trim within the limits.
std::optional<VectorXd> start_of(Follower& f, const Problem& at_start) {
  const VectorXd z = unknowns_of(f.problem, f.problem.base);
  constexpr double far = 1e-6, outside = 1e-9;  // scaled; beyond this the start is not a trim
  const Values v = values(f.problem, z);
  if (!v.finite || v.residual.lpNorm<Eigen::Infinity>() > far) return {};
  if (excess(z, f.problem.lower, f.problem.upper) > outside ||
      excess(v.limited, f.problem.limited_lower, f.problem.limited_upper) > outside)
    return {};
  if (!f.path.optimal) return z;
  const Optimum optimum = polish_optimum(at_start, unknowns_of(at_start, f.problem.base), {});
  if (!optimum.verified) return {};
  f.path.held = optimum.active;
  VectorXd start(z.size());
  start << optimum.z, z[f.path.parameter()];
  return f.path.start(start);
}

// Why there is no start: the model's exception, or the remaining residual.
std::string no_start(Follower& f) {
  const Values v = values(f.problem, unknowns_of(f.problem, f.problem.base));
  const std::string said = "the start is not a verified trim";
  if (!f.problem.thrown.empty()) return said + ": the model threw: " + f.problem.thrown;
  if (!v.finite) return said + ": the model is not finite there";
  constexpr double far = 1e-6;
  const double left = v.residual.lpNorm<Eigen::Infinity>();
  if (left <= far) return said + ": outside its limits, or not of least effort";
  return fmt::format("{}: the residual is {:.3g} nominal sizes per second", said, left);
}

void check(const FollowOptions& options) {
  check_positive("longest step", options.max_step);
  check_positive("tolerance", options.tolerance);
  check_positive("step tolerance", options.step_tolerance);
  if (options.max_points < 1)
    throw std::invalid_argument(
        fmt::format("max_points is {}; expected at least 1", options.max_points));
}

}  // namespace

Branch follow(const Model& model, const TrimSpec& spec, const OperatingPoint& start,
              const std::string& parameter, double to, const FollowOptions& options) {
  const RoundToNearest environment;
  check(options);
  const TrimSpec with = with_parameter(model, spec, parameter);
  TrimSpec without = with;
  without.free.pop_back();
  without.bounds.erase(parameter);
  if (!std::isfinite(to)) throw std::invalid_argument("the range of the branch is not finite");
  const Problem at_start = make_problem(model, without, start);  // counts unknowns and equations
  const Index j = variable(model, parameter);
  if (value_of(start, j) == to)
    throw std::invalid_argument(fmt::format("{} is at {} already", parameter, to));
  Follower f(make_problem(model, with, start), to / signal_of(model, j).nominal, options);
  f.problem.needs_outputs = bool(model.h);  // a trim's outputs are finite
  f.path.optimal = !at_start.square();
  const auto y = start_of(f, at_start);
  if (!y) {
    f.last.y = unknowns_of(f.problem, start);
    end(f, BranchEnd::no_start, f.last, no_start(f));
    f.branch.evaluations = f.problem.evaluations;
    return f.branch;
  }

  VectorXd towards = VectorXd::Zero(y->size());
  towards[f.path.parameter()] = to > value_of(start, j) ? 1.0 : -1.0;
  CurvePoint at;
  const CurveEnd found = first_point(f.path.curve(), *y, towards, trace_options(options), at);
  if (found != CurveEnd::stopped) {
    f.last.y = *y;
    f.last.tangent = towards;
    end(f, found);
    f.branch.evaluations = f.problem.evaluations;
    return f.branch;
  }
  f.moving = unsteady_states(model, spec);
  const LinearModel linear = linear_at(model, spec, f.point(at));
  f.stability = options.stability && linear;
  f.branch.no_stability = linear.message;
  f.branch.points.push_back(reported(f, at));
  constexpr int most_changes = 100;  // of the held limits
  for (int change = 0;; ++change) {
    stretch(f, at);
    if (!f.pending) break;
    const LimitName limit = *f.pending;
    const auto next = change < most_changes ? changed(f) : std::nullopt;
    if (!next) {
      end(f, BranchEnd::limit, f.last,
          fmt::format("{} reaches its {} limit; no free unknown remains to continue along it",
                      limit.signal, limit.upper ? "upper" : "lower"));
      break;
    }
    const Index p = f.path.parameter();
    if (f.last.tangent[p] * next->tangent[p] < 0) add(f, EventKind::fold, *next, "");
    at = *next;
  }
  f.branch.evaluations = f.problem.evaluations;
  return f.branch;
}

}  // namespace tiltrim
