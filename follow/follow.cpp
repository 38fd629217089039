#include "follow/follow.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "follow/path.hpp"
#include "linearize/linearize.hpp"
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

namespace {

constexpr double same_place = 1e-6;  // along the branch: crossings nearer than this are one

TraceOptions trace_options(const FollowOptions& o) {
  return {.first_step = std::min(0.05, o.max_step),
          .max_step = o.max_step,
          .max_points = o.max_points,
          .tolerance = o.tolerance,
          .step_tolerance = o.step_tolerance,
          .stop = o.stop};
}

std::string words(const LimitName& limit) {
  return limit.signal + (limit.upper ? " upper" : " lower");
}

// What is being followed, and what has been found so far.
struct Follower {
  Problem problem;
  Path path{problem};
  double to;  // scaled
  const FollowOptions& options;
  bool stability = false;
  std::vector<Index> states{};
  Branch branch{};
  std::optional<LimitName> pending{};  // a limit to hold, or one to let go, before going on
  CurvePoint last{};
  mutable VectorXd seen{}, seen_real_parts{};  // where the eigenvalues were last asked for

  Follower(Problem p, double target, const FollowOptions& o)
      : problem(std::move(p)), to(target), options(o) {
    for (Index i = 0; i < std::ssize(problem.model.states); ++i) states.push_back(i);
  }
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  double nominal() const { return problem.nominal[path.parameter()]; }
  OperatingPoint point(const CurvePoint& at) const { return point_of(problem, path.z(at.y)); }

  // Real parts of the eigenvalues, largest first; one that is zero to rounding counts as stable.
  const VectorXd& real_parts(const CurvePoint& at) const {
    if (seen.size() != at.y.size() || seen != at.y) {
      seen_real_parts = computed_real_parts(at);
      seen = at.y;
    }
    return seen_real_parts;
  }

  VectorXd computed_real_parts(const CurvePoint& at) const {
    constexpr double rounding = 1e-14;
    const MatrixXd A = jacobian(problem.model, point(at), states).topRows(std::ssize(states));
    VectorXd re = VectorXd::Constant(A.rows(), std::numeric_limits<double>::quiet_NaN());
    if (!A.allFinite()) return re;
    const Eigen::VectorXcd lambda = eigenvalues(A);
    if (lambda.size() != A.rows()) return re;
    re = lambda.real();
    const double small = rounding * A.lpNorm<1>();
    for (double& r : re)
      if (std::abs(r) <= small) r = -std::numeric_limits<double>::denorm_min();
    std::ranges::sort(re, std::greater{});
    return re;
  }

  BranchPoint reported(const CurvePoint& at) const {
    BranchPoint b;
    const VectorXd z = path.z(at.y);
    const Values v = values(problem, z);
    b.point = point(at);
    b.parameter = at.y[path.parameter()] * nominal();
    b.rates = v.rates;
    b.outputs = outputs(problem, b.point);
    b.residual = v.residual.size() > 0 ? v.residual.lpNorm<Eigen::Infinity>() : 0.0;
    b.step = at.step;
    if (stability) b.unstable = int((real_parts(at).array() > 0).count());
    if (path.deciding()) b.least = is_least(at.y);
    return b;
  }

  // At this value of the parameter, to second order.
  bool is_least(const VectorXd& y) const {
    ActiveSet held = path.held;
    const Index after = problem.n() + problem.m() + std::ssize(held.unknowns);
    held.unknowns.push_back({path.parameter(), y[path.parameter()], 1.0});
    VectorXd lambda(y.size() - problem.n() + 1);
    lambda << y.segment(problem.n(), after - problem.n()), 0.0, y.tail(y.size() - after);
    return tiltrim::is_least(problem, held, path.z(y), lambda);
  }

  // A rate that should follow from the equations and does not vanish, in words.
  std::string not_implied(const BranchPoint& b) const {
    for (const Index row : problem.implied)
      if (!(std::abs(b.rates[row]) <= options.tolerance * problem.row_nominal[row]))
        return fmt::format("the equations hold, but {} = {:.3g} {} does not vanish",
                           row_name(problem.model, row), b.rates[row],
                           row_unit(problem.model, row));
    return {};
  }

  BranchEvent& add(EventKind kind, const CurvePoint& at, std::string which) {
    branch.events.push_back({kind, reported(at), branch.points.size(), std::move(which), {}, {}});
    BranchEvent& event = branch.events.back();
    if (!stability) return event;
    const LinearModel linear = linearize(problem.model, event.at.point);
    if (linear) event.modes = modes(linear);
    return event;
  }

  void end(BranchEnd how, const CurvePoint& at, std::string message) {
    branch.end = how;
    branch.message = message;
    add(EventKind::end, at, std::move(message));
  }
};

template <class Size>
const Mode* least(const std::optional<Modes>& modes, const Size& size) {
  if (!modes || modes->modes.empty()) return nullptr;
  return &*std::ranges::min_element(modes->modes, {}, size);
}

// Where all of the model's equations fold or branch, an eigenvalue is zero.
void add_singular(Follower& f, EventKind kind, const CurvePoint& at) {
  constexpr double zero = 1e-5;  // 1/s; a branch point is located to some 1e-6
  BranchEvent& event = f.add(kind, at, "");
  const Mode* m = least(event.modes, [](const Mode& k) { return std::abs(k.eigenvalue); });
  if (!m || std::abs(m->eigenvalue) > zero) return;
  event.eigenvalue = m->eigenvalue;
  event.which = m->name;
}

void add_crossing(Follower& f, const CurvePoint& at) {
  BranchEvent& event = f.add(EventKind::zero, at, "");
  const Mode* m = least(event.modes, [](const Mode& k) { return std::abs(k.eigenvalue.real()); });
  if (!m) return;
  event.eigenvalue = std::complex(m->eigenvalue.real(), std::abs(m->eigenvalue.imag()));
  event.which = m->name;
  if (m->eigenvalue.imag() != 0) event.kind = EventKind::hopf;
}

// What is watched: positions in watches().
enum Watched : std::size_t { turning, target, limits, branching, stability };

std::vector<Watch> watches(const Follower& f) {
  const Index parameter = f.path.parameter();
  std::vector<Watch> all(5);
  all[turning] = [parameter](const CurvePoint& at) {
    return VectorXd::Constant(1, at.tangent[parameter]);
  };
  all[target] = [parameter, to = f.to](const CurvePoint& at) {
    return VectorXd::Constant(1, at.y[parameter] - to);
  };
  all[limits] = [&f](const CurvePoint& at) { return limit_distances(f.path, at.y); };
  all[branching] = [](const CurvePoint& at) { return VectorXd::Constant(1, at.turn); };
  all[stability] = [&f](const CurvePoint& at) {
    return f.stability ? f.real_parts(at) : VectorXd();
  };
  return all;
}

// At a fold or branch point an eigenvalue crosses zero, at a Hopf point two cross together: one
// event each.
void merge(std::vector<Crossing>& found) {
  const auto known = [&](const Crossing& c) {
    const auto same = [&](const Crossing& other) {
      if (std::abs(other.at.s - c.at.s) > same_place) return false;
      return other.watch == turning || other.watch == branching ||
             (other.watch == stability && other.index < c.index);
    };
    return c.watch == stability && std::ranges::any_of(found, same);
  };
  std::vector<Crossing> distinct;
  for (const Crossing& c : found)
    if (!known(c)) distinct.push_back(c);
  found = std::move(distinct);
}

// Returns whether the branch goes on.
bool meet(Follower& f, const Crossing& crossing, const std::vector<LimitName>& names) {
  switch (crossing.watch) {
    case turning:
      add_singular(f, EventKind::fold, crossing.at);
      if (!f.path.optimal || f.path.deciding()) return true;
      f.end(BranchEnd::limit, crossing.at,
            "at its limits no free unknown is left, and the branch turns back: beyond there is no "
            "trim");
      return false;
    case target:
      f.end(BranchEnd::reached, crossing.at,
            fmt::format("{} = {:.6g} is reached",
                        signal_of(f.problem.model, f.problem.unknowns.back()).name,
                        f.to * f.nominal()));
      return false;
    case limits: {
      if (crossing.rising) return true;
      const LimitName& limit = names[std::size_t(crossing.index)];
      f.add(limit.held ? EventKind::limit_left : EventKind::limit, crossing.at, words(limit));
      f.last = crossing.at;
      f.pending = limit;
      return false;
    }
    case branching:
      add_singular(f, EventKind::branch_point, crossing.at);
      return true;
    default:
      add_crossing(f, crossing.at);
      return true;
  }
}

// The switch of the model that lies next to the last point, if one does. Next to a jump slopes by
// differences, and so the tangent, cannot be relied on: every unknown is tried.
std::string switch_next_to(const Follower& f) {
  constexpr double near = 1e-4;  // where slopes are differences, Newton stops short of it
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

void end_of(Follower& f, CurveEnd end) {
  const std::string at = signal_of(f.problem.model, f.problem.unknowns.back()).name;
  const double value = f.last.y[f.path.parameter()] * f.nominal();
  const std::string here = fmt::format("at {} = {:.6g}", at, value);
  if (end == CurveEnd::stuck || end == CurveEnd::not_finite || end == CurveEnd::singular)
    if (const std::string name = switch_next_to(f); !name.empty())
      return f.end(BranchEnd::switched, f.last,
                   fmt::format("the model switches {}: {}", here, name));
  switch (end) {
    case CurveEnd::closed:
      return f.end(BranchEnd::closed, f.last, "the branch is a loop: back at its start");
    case CurveEnd::points:
      return f.end(BranchEnd::points, f.last,
                   fmt::format("stopped after {} points, {}", f.options.max_points, here));
    case CurveEnd::not_finite: {
      CurvePoint beyond = f.last;
      beyond.y += 1e-6 * f.last.tangent;
      std::string what = f.problem.thrown.empty() ? "" : "; the model threw: " + f.problem.thrown;
      return f.end(
          BranchEnd::not_finite, f.last,
          fmt::format("the model gives no finite numbers beyond the point {}{}", here, what));
    }
    case CurveEnd::singular:
      return f.end(BranchEnd::singular, f.last,
                   fmt::format("the equations leave more than one direction {}: a continuum of "
                               "trims, or equations that depend on each other",
                               here));
    case CurveEnd::interrupted:
      return f.end(BranchEnd::interrupted, f.last, "stopped by the caller " + here);
    default:
      return f.end(BranchEnd::stuck, f.last,
                   fmt::format("no next point is found {}, however short the step: the equations "
                               "jump or have a corner there",
                               here));
  }
}

// How the limits' distances change along the tangent at a point.
VectorXd limits_ahead(const Follower& f, const CurvePoint& at) {
  constexpr double ahead = 1e-6;
  return limit_distances(f.path, at.y + ahead * at.tangent) - limit_distances(f.path, at.y);
}

// A limit that the start lies on and that the branch would leave through.
std::optional<Crossing> limit_at_start(const Follower& f, const CurvePoint& start) {
  constexpr double on = 1e-10, rounding = 1e-14;
  const VectorXd distance = limit_distances(f.path, start.y), change = limits_ahead(f, start);
  for (Index i = 0; i < distance.size(); ++i)
    if (distance[i] <= on && change[i] < -rounding) return Crossing{limits, i, false, start};
  return {};
}

// One stretch of the branch, until its end or a change of the limits that are held.
void stretch(Follower& f, const CurvePoint& start) {
  const Curve curve = f.path.curve();
  const std::vector<LimitName> names = limit_names(f.path);
  f.last = start;
  f.pending.reset();
  if (const auto at_once = limit_at_start(f, start)) {
    meet(f, *at_once, names);
    return;
  }
  bool ended = false;
  TraceOptions options = trace_options(f.options);
  options.max_points = f.options.max_points - int(f.branch.points.size()) + 1;
  const auto visit = [&](const CurvePoint& next, std::vector<Crossing>& found) {
    merge(found);
    for (const Crossing& crossing : found)
      if (!meet(f, crossing, names)) {
        ended = true;
        return false;
      }
    f.last = next;
    f.branch.points.push_back(f.reported(next));
    if (std::string why = f.not_implied(f.branch.points.back()); !why.empty()) {
      f.branch.points.pop_back();
      f.end(BranchEnd::not_implied, next, std::move(why));
      ended = true;
      return false;
    }
    if (f.options.observe)
      f.options.observe(f.branch.points.back().parameter, f.branch.points.size());
    return true;
  };
  const CurveEnd end = trace(curve, start, watches(f), options, visit);
  if (!ended) end_of(f, end);
}

// The held limits' new path from `last`, along which `limit` is kept to: its multiplier rises if it
// is held, its distance if it is not. Nothing if there is none.
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
  if (limits_ahead(f, point)[at - names.begin()] < 0) point.tangent = -point.tangent;
  return point;
}

// Holds the limit just met, or lets one go: the path that continues the branch, or nothing.
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

// y at the start; nothing if that is no trim within the limits.
std::optional<VectorXd> start_of(Follower& f, const Problem& at_start) {
  const VectorXd z = unknowns_of(f.problem, f.problem.base);
  constexpr double far = 1e-6, outside = 1e-9;  // scaled; a start that is no trim
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

}  // namespace

Branch follow(const Model& model, const TrimSpec& spec, const OperatingPoint& start,
              const std::string& parameter, double to, const FollowOptions& options) {
  const TrimSpec with = with_parameter(model, spec, parameter);
  TrimSpec without = with;
  without.free.pop_back();
  without.bounds.erase(parameter);
  if (!std::isfinite(to)) throw std::invalid_argument("where to follow the branch is not finite");
  const Problem at_start = make_problem(model, without, start);  // counts unknowns and equations
  const Index j = variable(model, parameter);
  if (value_of(start, j) == to)
    throw std::invalid_argument(fmt::format("{} is at {} already", parameter, to));
  Follower f(make_problem(model, with, start), to / signal_of(model, j).nominal, options);
  f.path.optimal = !at_start.square();
  const auto y = start_of(f, at_start);
  if (!y) {
    f.last.y = unknowns_of(f.problem, start);
    f.end(BranchEnd::no_start, f.last, "the start is no verified trim");
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
    end_of(f, found);
    f.branch.evaluations = f.problem.evaluations;
    return f.branch;
  }
  f.stability = options.stability && bool(linearize(model, f.point(at)));
  f.branch.points.push_back(f.reported(at));
  constexpr int most_changes = 100;  // of the limits held
  for (int change = 0;; ++change) {
    stretch(f, at);
    if (!f.pending) break;
    const LimitName limit = *f.pending;
    const auto next = change < most_changes ? changed(f) : std::nullopt;
    if (!next) {
      f.end(BranchEnd::limit, f.last,
            fmt::format("{} reaches its {} limit, and no free unknown is left to go on along it",
                        limit.signal, limit.upper ? "upper" : "lower"));
      break;
    }
    at = *next;
  }
  f.branch.evaluations = f.problem.evaluations;
  return f.branch;
}

}  // namespace tiltrim
