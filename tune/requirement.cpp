#include "tune/requirement.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "linearize/margins.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "tune/measures.hpp"
#include "tune/response.hpp"
#include "tune/shift.hpp"
#include "tune/step_response.hpp"

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double most = 1e6;  // of a score: larger margins, and infinite ones, are cut

// Score of a margin for an unstable loop: minus the largest real part.
double lacking(const VectorXcd& eigenvalues) { return -eigenvalues.real().maxCoeff(); }

double margin(Measure what, const Margins& m) {
  constexpr double degrees = 180 / std::numbers::pi;
  switch (what) {
    case Measure::gain_margin_db:
      return 20 * std::log10(std::min(m.gain_up, 1 / m.gain_down));
    case Measure::phase_margin_deg:
      return m.phase * degrees;
    case Measure::delay_margin:
      return m.delay;
    default:
      return m.disk;
  }
}

// The smallest margin of the loops broken at one actuator each.
double margin_score(const Requirement& r, const Place& place, const GridTrim& e,
                    const VectorXcd& eigenvalues) {
  const Model& model = *place.loops;
  const Index n = std::ssize(model.states), inputs = std::ssize(model.inputs);
  OperatingPoint at = e.at;
  at.u = VectorXd::Zero(inputs);
  std::vector<Index> along;
  for (Index i = 0; i < n + inputs; ++i) along.push_back(i);
  const MatrixXd J = jacobian(model, at, along);
  double least = not_a_number;
  for (Index j = 0; j < inputs; ++j) {
    const std::string& added = model.inputs[std::size_t(j)].name;
    const std::string actuator = added.substr(0, added.rfind("_added"));
    if (!r.of.empty() && r.of != actuator) continue;
    const Index k = n + index_of(model.outputs, actuator, "output");
    const VectorXd b = J.col(n + j).head(n);
    const Eigen::RowVectorXd c = J.row(k).head(n);
    const double d = J(k, n + j);
    if ((b.isZero(0.0) || c.isZero(0.0)) && d == 0) continue;  // no effect on this loop
    const Margins m = margins(opened(J.topLeftCorner(n, n), b, c, d));
    const double score = m.stable() ? margin(r.measure, m) : std::min(0.0, lacking(eigenvalues));
    if (!(score >= least)) least = std::min(score, most);
  }
  return least;
}

// The decay rate of the slowest of the modes with that name.
double half_time_score(const Requirement& r, const Place& place, const MatrixXd& A) {
  double least = not_a_number;
  const Model& model = place.request.model;
  for (const Mode& m : modes(A, {}, names(model.states), model.mode_names).modes)
    if (m.name == r.of && !(-m.eigenvalue.real() >= least)) least = -m.eigenvalue.real();
  return least;
}

// The actuators that have a range, and their position in it: 0 in the middle, 1 at an end.
struct Actuator {
  Index output;
  double middle, half;
};

std::vector<Actuator> actuators(const Requirement& r, const Place& place) {
  std::vector<Actuator> all;
  const Model& model = place.request.model;
  for (const std::string& name : place.request.inputs) {
    const auto bound = place.request.spec.bounds.find(name);
    const Index output = find(model.outputs, name);
    if (output < 0 || bound == place.request.spec.bounds.end()) continue;
    if (!r.of.empty() && r.of != name) continue;
    const Range& range = bound->second;
    const double half = 0.5 * (range.upper - range.lower);
    if (std::isfinite(half) && half > 0)
      all.push_back({output, 0.5 * (range.upper + range.lower), half});
  }
  return all;
}

double use_score(const Requirement& r, const Place& place, const GridTrim& e) {
  double least = not_a_number;
  for (const Actuator& a : actuators(r, place)) {
    const double score = -std::abs(e.outputs[a.output] - a.middle) / a.half;
    if (!(score >= least)) least = score;
  }
  return least;
}

// The largest |middle + y(t)| for y(t) = c exp(A t) x0; infinite: not determined.
double largest_response(const MatrixXd& A, const Eigen::RowVectorXd& c, const VectorXd& x0,
                        double middle, double size) {
  double largest = 0;
  for (const double sign : {1.0, -1.0}) {
    const Decaying y = decaying(A, c, x0, sign, 0.0, size);
    if (!y.determined) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, sign * middle + y.largest);
  }
  return largest;
}

double response_use_score(const TuneProblem& problem, const Requirement& r, const Place& place,
                          const GridTrim& e, const VectorXcd& eigenvalues) {
  const Prepared& sweep = *place.prepared;
  const Index n = sweep.states();
  if (!(eigenvalues.real().maxCoeff() < 0)) return -unbounded;
  VectorXd x0 = VectorXd::Zero(n);
  for (const auto& [state, value] : problem.disturbance)
    x0[index_of(sweep.model().states, state, "state")] = value;
  const MatrixXd A = e.A(sweep);
  double least = not_a_number;
  for (const Actuator& a : actuators(r, place)) {
    const double largest = largest_response(A, e.slopes.row(n + a.output).head(n), x0,
                                            e.outputs[a.output] - a.middle, a.half);
    const double score = -std::min(largest / a.half, unbounded);
    if (!(score >= least)) least = score;
  }
  return least;
}

double sensitivity_score(const TuneProblem& problem, const Place& place, const GridTrim& e) {
  const EigenvalueSlopes spectrum = spectrum_of(*place.prepared, e, place.uncertain);
  if (spectrum.eigenvalues.size() == 0) return not_a_number;
  if (!spectrum.slopes.allFinite()) return -unbounded;
  double largest = 0;
  for (std::size_t k = 0; k < place.uncertain.size(); ++k) {
    const double half = 0.5 * (problem.uncertain[k].upper - problem.uncertain[k].lower);
    largest = std::max(largest, half * spectrum.slopes.col(Index(k)).cwiseAbs().maxCoeff());
  }
  return -std::min(largest, unbounded);
}

}  // namespace

bool may_be_unbounded(Measure what) {
  return of_a_response(what) || what == Measure::response_use || what == Measure::sensitivity;
}

double score_of(Measure what, double value) {
  if (what == Measure::half_time) return std::numbers::ln2 / value;
  return more_is_better(what) ? value : -value;
}

double value_of(Measure what, double score) {
  if (std::isnan(score)) return score;
  if (what == Measure::half_time)
    return score > 0 ? std::numbers::ln2 / score : std::numeric_limits<double>::infinity();
  if (may_be_unbounded(what) && score <= -unbounded) return std::numeric_limits<double>::infinity();
  const bool margin = what >= Measure::gain_margin_db && what <= Measure::disk_margin;
  if (margin) return score >= most ? std::numeric_limits<double>::infinity() : std::max(score, 0.0);
  return more_is_better(what) ? score : -score;
}

double value_slope(Measure what, double score) {
  if (what == Measure::half_time) return -std::numbers::ln2 / (score * score);
  return more_is_better(what) ? 1.0 : -1.0;
}

double size_of(const Requirement& r) {
  const double limit = std::abs(score_of(r.measure, r.limit));
  return limit > 0 && std::isfinite(limit) ? limit : 1.0;
}

double missed_by(const Requirement& r, double own) {
  return (score_of(r.measure, r.limit) - own) / size_of(r);
}

double goal_score(const TuneProblem& problem, const Requirement& goal, double own) {
  if (problem.goals.empty()) return own;
  return (own - score_of(goal.measure, goal.limit)) / size_of(goal);
}

double goal_value(const TuneProblem& problem, double own) {
  return problem.goals.empty() ? value_of(problem.goal.measure, own) : own;
}

double goal_slope(const TuneProblem& problem, const Requirement& goal) {
  return problem.goals.empty() ? 1.0 : 1.0 / size_of(goal);
}

bool spectral(Measure what) {
  return what == Measure::decay || what == Measure::damping || what == Measure::frequency ||
         what == Measure::pole_region;
}

namespace {

Scored decay(Complex lambda) { return {-lambda.real(), -1.0}; }

Scored damping(Complex lambda) {
  const double size = std::abs(lambda);
  if (size == 0) return {0.0, 0.0};
  // d(-Re λ/|λ|) = (-d(Re λ) + (Re λ/|λ|) d|λ|)/|λ|
  return {-lambda.real() / size, (-1.0 + lambda.real() / size * (lambda / size)) / size};
}

// The least of -Re λ/decay, (-Re λ/|λ|)/damping and frequency/|λ|, of those required: at least 1
// inside the region.
Scored region(const Requirement& r, Complex lambda) {
  Scored least{most, 0.0};
  const auto take = [&](const Scored& s, double size) {
    if (s.score / size < least.score) least = {s.score / size, s.slope / size};
  };
  const double size = std::abs(lambda);
  if (r.decay > 0) take(decay(lambda), r.decay);
  if (r.damping > 0) take(damping(lambda), r.damping);
  if (r.frequency > 0 && size > 0)
    take({1 / size, -lambda / (size * size * size)}, 1 / r.frequency);
  return least;
}

}  // namespace

Scored score(const Requirement& r, Complex lambda) {
  if (r.measure == Measure::decay) return decay(lambda);
  if (r.measure == Measure::damping) return damping(lambda);
  if (r.measure == Measure::pole_region) return region(r, lambda);
  const double size = std::abs(lambda);
  return {-size, size > 0 ? -lambda / size : Complex(-1.0)};
}

double score(const TuneProblem& problem, const Requirement& r, const Place& place,
             const GridTrim& e, const VectorXcd& eigenvalues) {
  switch (r.measure) {
    case Measure::half_time:
      return half_time_score(r, place, e.A(*place.prepared));
    case Measure::use:
      return use_score(r, place, e);
    case Measure::response_use:
      return response_use_score(problem, r, place, e, eigenvalues);
    case Measure::figure:
      return place.where.point == 0 ? -problem.figures.at(r.figure)(e.at.p) : not_a_number;
    case Measure::sensitivity:
      return sensitivity_score(problem, place, e);
    default:
      return margin_score(r, place, e, eigenvalues);
  }
}

Worst worst(std::size_t asked, const Requirement& requirement, const PlaceModes& modes) {
  if (!spectral(requirement.measure)) return {modes.scores[Index(asked)], -1};
  Worst found{std::numeric_limits<double>::infinity(), -1};
  for (Index i = 0; i < modes.eigenvalues.size(); ++i) {
    const double own = score(requirement, modes.eigenvalues[i]).score;
    if (own < found.score) found = {own, i};
  }
  return found;
}

Eigen::RowVectorXd score_slope(std::size_t asked, const Requirement& r, const PlaceModes& modes) {
  const Worst w = worst(asked, r, modes);
  if (w.eigenvalue < 0) return modes.score_slopes.row(Index(asked));
  const Scored s = score(r, modes.eigenvalues[w.eigenvalue]);
  return (std::conj(s.slope) * modes.slopes.row(w.eigenvalue)).real();
}

namespace {

// In the same order, and between ±4e8: as it is up to 1e6, and by its logarithm beyond.
double within_reach(double score) {
  constexpr double linear = 1e6;
  if (!(std::abs(score) > linear)) return score;
  const double size = std::min(std::abs(score), std::numeric_limits<double>::max());
  return std::copysign(linear * (1 + std::log10(size / linear)), score);
}

}  // namespace

double Merit::value() const {
  constexpr double far = 1e9;
  if (!trimmed()) return -2 * far - double(without_trim);
  return feasible ? within_reach(goal) : -far - within_reach(missed);
}

double Merit::penalised() const {
  constexpr double heavy = 10.0, far = 1e3;
  if (!trimmed()) return -far - double(without_trim);
  return std::max(goal - heavy * std::max(std::abs(goal), 1.0) * std::min(missed, far), -far);
}

Merit merit(const Candidates& candidates, const std::vector<PlaceModes>& places) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::vector<Requirement>& asked = candidates.asked();
  Merit m{0, false, infinity, 0.0};
  for (const PlaceModes& place : places) {
    if (!place.valid()) {
      ++m.without_trim;
      continue;
    }
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const double own = worst(i, asked[i], place).score;
      if (std::isnan(own)) continue;  // not applicable there
      if (candidates.is_goal(i))
        m.goal = std::min(m.goal, goal_score(candidates.problem(), asked[i], own));
      else
        m.missed = std::max(m.missed, missed_by(asked[i], own));
    }
  }
  constexpr double rounding = 1e-9;
  m.feasible = m.trimmed() && m.missed <= rounding && m.goal < infinity;
  return m;
}

std::string applies_nowhere(const Candidates& candidates, const std::vector<PlaceModes>& places) {
  for (std::size_t i = 0; i < candidates.asked().size(); ++i) {
    const Requirement& r = candidates.asked()[i];
    const auto applies = [&](const PlaceModes& place) {
      return place.valid() && !std::isnan(worst(i, r, place).score);
    };
    const bool in_trim = std::ranges::any_of(places, &PlaceModes::valid);
    if (!in_trim || std::ranges::any_of(places, applies)) continue;
    const bool steps = r.measure == Measure::overshoot || r.measure == Measure::settling_time;
    return fmt::format("{}{} applies at no operating point ({})", name_of(r),
                       r.of.empty() ? "" : " of " + r.of,
                       r.measure == Measure::half_time ? "no mode has that name"
                       : steps                         ? "the step's final value is zero"
                               : "no such actuator is active, or it has no limits");
  }
  return {};
}

}  // namespace tiltrim
