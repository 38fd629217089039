#include "tune/requirement.hpp"

#include <cmath>
#include <limits>

namespace tiltrim {

using Complex = std::complex<double>;

std::string to_string(Measure measure) {
  switch (measure) {
    case Measure::decay:
      return "decay";
    case Measure::damping:
      return "damping";
    case Measure::frequency:
      return "frequency";
  }
  return "unknown";
}

Measured measure(Measure what, Complex lambda) {
  const double size = std::abs(lambda);
  switch (what) {
    case Measure::decay:
      return {-lambda.real(), -1.0};
    case Measure::frequency:
      return {size, size > 0 ? lambda / size : Complex(1.0)};
    case Measure::damping:
      break;
  }
  if (size == 0) return {0.0, 0.0};
  // d(-Re λ/|λ|) = (-d(Re λ) + (Re λ/|λ|) d|λ|)/|λ|
  return {-lambda.real() / size, (-1.0 + lambda.real() / size * (lambda / size)) / size};
}

double better(Measure what) { return what == Measure::frequency ? -1.0 : 1.0; }

Worst worst(Measure what, const PointModes& modes) {
  Worst found{std::numeric_limits<double>::infinity(), -1};
  for (Eigen::Index i = 0; i < modes.eigenvalues.size(); ++i) {
    const double value = better(what) * measure(what, modes.eigenvalues[i]).value;
    if (value < found.value) found = {value, i};
  }
  found.value *= better(what);
  return found;
}

double Merit::value() const {
  constexpr double far = 1e6;
  if (!trimmed) return -2 * far;
  return feasible ? goal : -far - missed;
}

Merit merit(const TuneProblem& problem, const std::vector<PointModes>& points) {
  Merit m{true, true, std::numeric_limits<double>::infinity(), 0.0};
  for (const PointModes& point : points) {
    if (!point.valid()) return {};
    m.goal = std::min(m.goal, better(problem.goal) * worst(problem.goal, point).value);
    for (const Requirement& r : problem.limits) {
      const double size = r.limit != 0 ? std::abs(r.limit) : 1.0;
      const double miss = better(r.measure) * (r.limit - worst(r.measure, point).value) / size;
      m.missed = std::max(m.missed, miss);
    }
  }
  constexpr double rounding = 1e-9;
  m.feasible = m.missed <= rounding;
  return m;
}

}  // namespace tiltrim
