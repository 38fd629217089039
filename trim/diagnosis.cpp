#include "trim/diagnosis.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dense/dense.hpp"
#include "model/lookup.hpp"
#include "model/many.hpp"
#include "runtime/rounding.hpp"
#include "trim/problem.hpp"
#include "trim/proof.hpp"
#include "trim/remedy.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// The model with its rates as additional outputs "V'", so that rates can be bounded or minimized.
Model with_rates(const Model& model) {
  Model wider = model;
  wider.lanes = nullptr;
  wider.jets = nullptr;
  if (const auto* const f = model.f.target<FunctionOfMany>()) wider.f = f->one;
  const Index nx = std::ssize(model.states);
  for (Index i = 0; i < nx; ++i)
    wider.outputs.push_back(
        {row_name(model, i), row_unit(model, i), model.states[std::size_t(i)].nominal});
  wider.h = [model](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    VectorXd y(std::ssize(model.outputs) + std::ssize(model.states));
    if (model.h)
      y << model.h(x, u, p), model.f(x, u, p);
    else
      y = model.f(x, u, p);
    return y;
  };
  if (model.derivatives)
    wider.derivatives = [model, nx](const OperatingPoint& at, const std::vector<Index>& variables) {
      const MatrixXd J = model.derivatives(at, variables);
      MatrixXd wide(J.rows() + nx, J.cols());
      wide << J, J.topRows(nx);
      return wide;
    };
  if (model.enclosure)
    wider.enclosure = [model](const std::vector<Range>& box) {
      std::vector<Range> all = model.enclosure(box);
      const std::vector<Range> rates(all.begin(), all.begin() + std::ssize(model.states));
      all.insert(all.end(), rates.begin(), rates.end());
      return all;
    };
  return wider;
}

// The value of the variable or output at a point.
double at(const Model& model, const TrimResult& r, const std::string& signal) {
  for (const Signals* own : {&model.states, &model.inputs, &model.parameters})
    if (find(*own, signal) >= 0) return value_of(r.point, variable(model, signal));
  return r.outputs[index_of(model.outputs, signal, "output")];
}

TrimOptions quiet(TrimOptions options) {
  options.observe = {};
  options.method = TrimMethod::ipopt;
  options.closest = false;
  return options;
}

// Search range of a limit: half a turn for an angle, otherwise a multiple of the range.
double reach(const Range& bound, const Signal& signal, bool upper) {
  constexpr double times = 10.0;
  if (signal.unit == "rad")
    return std::max(0.0, std::numbers::pi - (upper ? bound.upper : -bound.lower));
  const double room = bound.upper - bound.lower;
  return times * (std::isfinite(room) && room > 0 ? room : signal.nominal);
}

Remedy of_limit(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                const Signal& signal, bool upper, const TrimOptions& options) {
  TrimSpec given = spec;
  Range& bound = given.bounds[signal.name];
  Remedy remedy{RemedyKind::limit, signal.name, upper, upper ? bound.upper : bound.lower};
  const double far = reach(bound, signal, upper);
  (upper ? bound.upper : bound.lower) += upper ? far : -far;
  given.effort = {{signal.name, signal.nominal, remedy.from}};
  remedy.searched = upper ? Range{remedy.from, bound.upper} : Range{bound.lower, remedy.from};
  remedy.trim = trim(model, given, guess, options);
  if (remedy.helps()) remedy.to = at(model, remedy.trim, signal.name);
  return remedy;
}

Remedy of_equation(const Model& wider, const TrimSpec& spec, const OperatingPoint& guess,
                   const std::string& state, const TrimOptions& options) {
  TrimSpec given = spec;
  Remedy remedy{RemedyKind::equation, state};
  given.moving = moving_states(wider, spec);
  std::erase(given.steady, state);
  if (const auto held = given.rates.find(state); held != given.rates.end()) {
    remedy.from = held->second;
    given.rates.erase(held);
  }
  const double nominal = signal_of(wider, variable(wider, state)).nominal;
  given.effort = {{state + "'", nominal, remedy.from}};
  std::erase(given.implied, state);
  given.moving.push_back(state);
  remedy.trim = trim(wider, given, guess, options);
  if (remedy.helps()) remedy.to = at(wider, remedy.trim, state + "'");
  return remedy;
}

// At the least-squares point, Jᵀr + Aᵀμ = 0 over its active limits: μ are their multipliers.
std::vector<Diagnosis::Holding> holding(const Problem& p, const VectorXd& z) {
  constexpr double near = 1e-4, negligible = 1e-9;  // an interior point stops short of its bounds
  const Values v = values(p, z);
  const Jacobians s = jacobians(p, z);
  std::vector<Diagnosis::Holding> active;
  if (!v.finite || !s.finite) return active;
  MatrixXd A(0, p.n());
  const auto note = [&](const std::string& name, double value, double lower, double upper,
                        double size, const VectorXd& slope) {
    const bool high = value >= upper - near;
    if (!high && !(value <= lower + near)) return;
    active.push_back({{name, high, (high ? upper : lower) * size}, 0.0});
    A.conservativeResize(A.rows() + 1, p.n());
    A.row(A.rows() - 1) = (high ? 1.0 : -1.0) * slope;
  };
  for (Index k = 0; k < p.n(); ++k)
    note(signal_of(p.model, p.unknowns[std::size_t(k)]).name, z[k], p.lower[k], p.upper[k],
         p.nominal[k], VectorXd::Unit(p.n(), k));
  for (Index i = 0; i < std::ssize(p.limited); ++i) {
    const Index row = p.limited[std::size_t(i)];
    note(row_name(p.model, row), v.limited[i], p.limited_lower[i], p.limited_upper[i],
         p.row_nominal[row], s.limited.row(i));
  }
  if (active.empty()) return active;
  const VectorXd gradient = s.residual.transpose() * v.residual;
  const VectorXd mu = dense::least_squares(A.transpose(), -gradient);
  for (std::size_t i = 0; i < active.size(); ++i) active[i].pull = -mu[Index(i)];
  std::erase_if(active, [](const Diagnosis::Holding& h) { return !(h.pull < -negligible); });
  std::ranges::stable_sort(active, {}, &Diagnosis::Holding::pull);
  return active;
}

}  // namespace

// Newton at values of the variable with growing distance from the requested one, up to `farthest`:
// the first trim. `spec` without the variable must have as many unknowns as equations.
static std::optional<TrimResult> outwards(const Model& model, const TrimSpec& spec,
                                          OperatingPoint guess, Index decision,
                                          const Remedy& remedy, double farthest,
                                          const TrimOptions& options) {
  constexpr int values_tried = 120;
  TrimOptions once = quiet(options);
  once.method = TrimMethod::newton;
  once.max_boxes = 0;
  once.starts = std::min(options.starts, 8);
  const Range& r = remedy.searched;
  for (int k = 1; k < values_tried && !options.stop.stop_requested(); ++k)
    for (const double side : {-1.0, 1.0}) {
      const double value = remedy.from + side * farthest * k / values_tried;
      if (value < r.lower || value > r.upper) continue;
      set_value(guess, decision, value);
      TrimResult there = trim(model, spec, guess, once);
      if (is_equilibrium(there.status)) return there;
    }
  return {};
}

// The optimizer's nearest value may be a local minimum: it continues from a trim that is nearer.
static void look_nearer(const Model& model, const TrimSpec& spec, const TrimSpec& given,
                        const OperatingPoint& guess, Index decision, const TrimOptions& options,
                        Remedy& remedy) {
  const Range& r = remedy.searched;
  const double known = remedy.helps() ? std::abs(remedy.to - remedy.from)
                                      : std::max(r.upper - remedy.from, remedy.from - r.lower);
  const auto there = outwards(model, spec, guess, decision, remedy, known, options);
  if (!there) return;
  TrimOptions on = quiet(options);
  on.starts = 0;
  TrimResult nearer = trim(model, given, there->point, on);
  if (!is_equilibrium(nearer.status)) {
    nearer = *there;
    nearer.status = TrimStatus::not_optimal;  // a trim, not proved to be the nearest
  }
  const double to = value_of(nearer.point, decision);
  if (remedy.helps() && std::abs(to - remedy.from) >= known) return;
  nearer.starts = remedy.trim.starts + 1;
  remedy.trim = nearer;
  remedy.to = to;
}

Remedy nearest(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
               const DecisionVariable& decision, const TrimOptions& options) {
  const RoundToNearest environment;
  TrimSpec given = spec, fixed = spec;
  const Index j = variable(model, decision.signal);
  Remedy remedy{RemedyKind::decision_variable, decision.signal};
  remedy.from = value_of(guess, j);
  remedy.searched = decision.range;
  if (std::ranges::find(given.free, decision.signal) == given.free.end())
    given.free.push_back(decision.signal);
  given.bounds[decision.signal] = decision.range;
  given.effort = {{decision.signal, signal_of(model, j).nominal, remedy.from}};
  fixed.bounds.erase(decision.signal);
  std::erase(fixed.free, decision.signal);
  const bool square = make_problem(model, fixed, guess).square();
  TrimOptions search = quiet(options);
  const double farthest =
      std::max(decision.range.upper - remedy.from, remedy.from - decision.range.lower);
  // Where Newton finds nothing in the range, a proof is worth its time before the optimizer.
  if (square && !outwards(model, fixed, guess, j, remedy, farthest, options)) {
    if (proved_infeasible(model, given, guess, search)) {
      remedy.trim = closest_point(model, given, guess, search);
      return remedy;
    }
    search.max_boxes = 0;
  }
  remedy.trim = trim(model, given, guess, search);
  if (remedy.helps()) remedy.to = value_of(remedy.trim.point, j);
  if (square) look_nearer(model, fixed, given, guess, j, options, remedy);
  return remedy;
}

Diagnosis diagnose(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                   const OperatingPoint& closest, const std::vector<DecisionVariable>& variables,
                   const TrimOptions& options) {
  const RoundToNearest environment;
  const Problem problem = make_problem(model, spec, guess);
  check(model, closest);
  Diagnosis d{closest, holding(problem, unknowns_of(problem, closest)), {}};

  TrimOptions briefly = quiet(options);  // a long proof that no limit helps is not worth its time
  briefly.max_boxes = std::min(options.max_boxes, boxes_before_short_search);
  const auto limit = [&](const Signal& signal, double lower, double upper) {
    for (const bool up : {false, true})
      if (std::isfinite(up ? upper : lower))
        d.remedies.push_back(of_limit(model, spec, guess, signal, up, briefly));
  };
  const auto stopped = [&] { return options.stop.stop_requested(); };
  for (Index k = 0; k < problem.n() && !stopped(); ++k)
    limit(signal_of(model, problem.unknowns[std::size_t(k)]), problem.lower[k], problem.upper[k]);
  for (Index i = 0; i < std::ssize(problem.limited) && !stopped(); ++i) {
    const Index row = problem.limited[std::size_t(i)] - std::ssize(model.states);
    limit(model.outputs[std::size_t(row)], problem.limited_lower[i], problem.limited_upper[i]);
  }
  const Model wider = with_rates(model);
  for (const Index row : problem.equations)
    if (row < std::ssize(model.states) && !stopped())
      d.remedies.push_back(
          of_equation(wider, spec, guess, model.states[std::size_t(row)].name, briefly));
  for (const DecisionVariable& decision : variables)
    if (!stopped()) d.remedies.push_back(nearest(model, spec, guess, decision, options));
  // An interrupted search proves nothing about a remedy.
  const auto ended = [](TrimStatus status) {
    return [status](const Remedy& r) { return r.trim.status == status; };
  };
  d.out_of_time = std::erase_if(d.remedies, ended(TrimStatus::time_limit)) > 0;
  std::erase_if(d.remedies, ended(TrimStatus::interrupted));
  d.interrupted = stopped();
  return d;
}

std::string in_words(const Remedy& r, double factor, const std::string& unit) {
  const std::string space = unit.empty() || unit == "°" ? unit : " " + unit;
  const auto number = [&](double value) { return fmt::format("{:.6g}{}", value * factor, space); };
  const std::string known = r.trim.status == TrimStatus::infeasible
                                ? "proved"
                                : "no equilibrium found from " + counted(r.trim.starts, "start");
  const std::string nearest = r.trim.status == TrimStatus::converged ? "" : "at most ";
  const char* const way = r.upper ? "up to" : "down to";
  const double farthest = r.upper ? r.searched.upper : r.searched.lower;
  switch (r.kind) {
    case RemedyKind::limit:
      if (!r.helps()) return fmt::format("{} {} {} ({})", r.signal, way, number(farthest), known);
      return fmt::format("{} {} {}{} instead of {}", r.signal, way, nearest, number(r.to),
                         number(r.from));
    case RemedyKind::equation:
      if (!r.helps()) return fmt::format("any {}' ({})", r.signal, known);
      return fmt::format("{}' = {} instead of {}", r.signal, number(r.to), number(r.from));
    case RemedyKind::decision_variable:
      if (!r.helps())
        return fmt::format("any {} between {} and {} ({})", r.signal, number(r.searched.lower),
                           number(r.searched.upper), known);
      return fmt::format("{} = {}{} instead of {}", r.signal, nearest, number(r.to),
                         number(r.from));
  }
  return {};
}

}  // namespace tiltrim
