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

  Follower(Problem p, double target, const FollowOptions& o)
      : problem(std::move(p)), to(target), options(o) {
    for (Index i = 0; i < std::ssize(problem.model.states); ++i) states.push_back(i);
  }
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  double nominal() const { return problem.nominal[path.parameter()]; }
  OperatingPoint point(const CurvePoint& at) const { return point_of(problem, path.z(at.y)); }

  // Real parts of the eigenvalues, largest first; one that is zero to rounding counts as stable.
  VectorXd real_parts(const CurvePoint& at) const {
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
    b.point = point(at);
    b.parameter = at.y[path.parameter()] * nominal();
    b.rates = evaluate(problem.model, b.point).rates;
    b.outputs = outputs(problem, b.point);
    const Values v = values(problem, path.z(at.y));
    b.residual = v.residual.size() > 0 ? v.residual.lpNorm<Eigen::Infinity>() : 0.0;
    b.step = at.step;
    if (stability) b.unstable = int((real_parts(at).array() > 0).count());
    return b;
  }

  BranchEvent& add(EventKind kind, const CurvePoint& at, std::string which) {
    branch.events.push_back({kind, reported(at), branch.points.size(), std::move(which), {}, {}});
    BranchEvent& event = branch.events.back();
    if (!stability) return event;
    LinearizeOptions linear_options;
    const LinearModel linear = linearize(problem.model, event.at.point, linear_options);
    if (linear) event.modes = modes(linear);
    return event;
  }

  void end(BranchEnd how, const CurvePoint& at, std::string message) {
    branch.end = how;
    branch.message = message;
    add(EventKind::end, at, std::move(message));
  }
};

// The mode on the axis: the one with the least |Re|, or the least |λ| if it is a real one.
template <class Size>
const Mode* least(const std::optional<Modes>& modes, const Size& size) {
  if (!modes || modes->modes.empty()) return nullptr;
  return &*std::ranges::min_element(modes->modes, {}, size);
}

void add_fold(Follower& f, const CurvePoint& at) {
  BranchEvent& event = f.add(EventKind::fold, at, "");
  if (const Mode* m = least(event.modes, [](const Mode& k) { return std::abs(k.eigenvalue); }))
    event.eigenvalue = m->eigenvalue, event.which = m->name;
}

void add_crossing(Follower& f, const CurvePoint& at) {
  BranchEvent& event = f.add(EventKind::zero, at, "");
  const Mode* m = least(event.modes, [](const Mode& k) { return std::abs(k.eigenvalue.real()); });
  if (!m) return;
  event.eigenvalue = {m->eigenvalue.real(), std::abs(m->eigenvalue.imag())};
  event.which = m->name;
  if (m->eigenvalue.imag() != 0) event.kind = EventKind::hopf;
}

// What is watched: positions in watches().
enum Watched : std::size_t { turning, target, limits, switches, branching, stability };

std::vector<Watch> watches(const Follower& f) {
  const Index parameter = f.path.parameter();
  std::vector<Watch> all(6);
  all[turning] = [parameter](const CurvePoint& at) {
    return VectorXd::Constant(1, at.tangent[parameter]);
  };
  all[target] = [parameter, to = f.to](const CurvePoint& at) {
    return VectorXd::Constant(1, at.y[parameter] - to);
  };
  all[limits] = [&f](const CurvePoint& at) { return limit_distances(f.path, at.y); };
  all[switches] = [&f](const CurvePoint& at) {
    VectorXd distance(std::ssize(f.problem.model.switches));
    for (Index i = 0; i < distance.size(); ++i)
      distance[i] = f.problem.model.switches[std::size_t(i)].distance(f.point(at));
    return distance;
  };
  all[branching] = [](const CurvePoint& at) { return VectorXd::Constant(1, at.turn); };
  all[stability] = [&f](const CurvePoint& at) {
    return f.stability ? f.real_parts(at) : VectorXd();
  };
  return all;
}

// At a fold an eigenvalue crosses zero, at a Hopf point two cross together: one event each.
void merge(std::vector<Crossing>& found) {
  const auto known = [&](const Crossing& c) {
    const auto same = [&](const Crossing& other) {
      if (std::abs(other.at.s - c.at.s) > same_place) return false;
      return other.watch == turning || (other.watch == stability && other.index < c.index);
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
      add_fold(f, crossing.at);
      return true;
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
    case switches:
      return true;
    case branching:
      f.add(EventKind::branch_point, crossing.at, "another branch crosses");
      return true;
    default:
      add_crossing(f, crossing.at);
      return true;
  }
}

// The switch of the model that lies just ahead, if one does.
std::string switch_ahead(const Follower& f) {
  constexpr double ahead = 1e-6;
  CurvePoint beyond = f.last;
  beyond.y += ahead * f.last.tangent;
  for (const Model::Switch& s : f.problem.model.switches)
    if (s.distance(f.point(f.last)) * s.distance(f.point(beyond)) <= 0) return s.name;
  return {};
}

void end_of(Follower& f, CurveEnd end) {
  const std::string at = signal_of(f.problem.model, f.problem.unknowns.back()).name;
  const double value = f.last.y[f.path.parameter()] * f.nominal();
  const std::string here = fmt::format("at {} = {:.6g}", at, value);
  if (end == CurveEnd::stuck || end == CurveEnd::not_finite || end == CurveEnd::singular)
    if (const std::string name = switch_ahead(f); !name.empty())
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

// One stretch of the branch, until its end or a change of the limits that are held.
void stretch(Follower& f, const CurvePoint& start) {
  const Curve curve = f.path.curve();
  const std::vector<LimitName> names = limit_names(f.path);
  f.last = start;
  f.pending.reset();
  bool ended = false;
  TraceOptions options = trace_options(f.options);
  options.max_points = std::max(2, f.options.max_points - int(f.branch.points.size()));
  const auto visit = [&](const CurvePoint& next, std::vector<Crossing>& found) {
    merge(found);
    for (const Crossing& crossing : found)
      if (!meet(f, crossing, names)) {
        ended = true;
        return false;
      }
    f.last = next;
    f.branch.points.push_back(f.reported(next));
    if (f.options.observe)
      f.options.observe(f.branch.points.back().parameter, f.branch.points.size());
    return true;
  };
  const CurveEnd end = trace(curve, start, watches(f), options, visit);
  if (!ended) end_of(f, end);
}

// Holds the limit just met, or lets one go: the system that continues the branch, or nothing.
std::optional<CurvePoint> changed(Follower& f) {
  const LimitName limit = *f.pending;
  const Problem& p = f.problem;
  const bool of_parameter = limit.of_unknown && limit.as.position == f.path.parameter();
  if (!f.path.optimal || of_parameter || (!limit.held && f.path.free() == 0)) return {};
  // Multipliers lie behind z: of the equations, of held unknowns, of held rows.
  std::vector<Held>& held = limit.of_unknown ? f.path.held.unknowns : f.path.held.limited;
  std::vector<double> y(f.last.y.begin(), f.last.y.end());
  const auto place = [&](std::size_t k) {
    const std::size_t before = limit.of_unknown ? 0 : f.path.held.unknowns.size();
    return y.begin() + std::ptrdiff_t(std::size_t(p.n() + p.m()) + before + k);
  };
  Index multiplier = -1;
  if (limit.held) {
    const auto at = std::ranges::find_if(held, [&](const Held& h) {
      return h.position == limit.as.position && h.side == limit.as.side;
    });
    y.erase(place(std::size_t(at - held.begin())));
    held.erase(at);
  } else {
    const auto at = place(held.size());
    multiplier = at - y.begin();
    y.insert(at, 0.0);
    held.push_back(limit.as);
  }
  const VectorXd start = Eigen::Map<const VectorXd>(y.data(), std::ssize(y));
  // A limit that is held pushes back, one let go moves away; else on as before.
  VectorXd towards = VectorXd::Zero(start.size());
  if (multiplier >= 0)
    towards[multiplier] = limit.as.side;
  else
    towards[f.path.parameter()] = f.last.tangent[f.path.parameter()];
  CurvePoint point;
  if (first_point(f.path.curve(), start, towards, trace_options(f.options), point) !=
      CurveEnd::stopped)
    return {};
  point.s = f.last.s;
  return point;
}

// z of the start, or (z, λ) where an effort decides; nothing if that is no trim.
std::optional<VectorXd> start_of(Follower& f, const Problem& at_start) {
  const VectorXd z = unknowns_of(f.problem, f.problem.base);
  constexpr double far = 1e-6;  // scaled; a start that is no trim
  const Values v = values(f.problem, z);
  if (!v.finite || v.residual.lpNorm<Eigen::Infinity>() > far) return {};
  if (!f.path.optimal) return z;
  const Optimum optimum = polish_optimum(at_start, unknowns_of(at_start, f.problem.base), {});
  if (!optimum.verified) return {};
  f.path.held = optimum.active;
  VectorXd y(z.size() + optimum.lambda.size());
  y << optimum.z, z[f.path.parameter()], optimum.lambda;
  return y;
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
  const auto no_start = [&](BranchEnd end, std::string why) {
    f.branch.end = end;
    f.branch.message = std::move(why);
    return f.branch;
  };
  const auto y = start_of(f, at_start);
  if (!y) return no_start(BranchEnd::no_start, "the start is no verified trim");

  VectorXd towards = VectorXd::Zero(y->size());
  towards[f.path.parameter()] = to > value_of(start, j) ? 1.0 : -1.0;
  CurvePoint at;
  const CurveEnd found = first_point(f.path.curve(), *y, towards, trace_options(options), at);
  if (found != CurveEnd::stopped) {
    f.last.y = *y;
    f.last.tangent = towards;
    f.stability = false;
    end_of(f, found);
    return f.branch;
  }
  LinearizeOptions linear;
  f.stability = options.stability && bool(linearize(model, f.point(at), linear));
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
