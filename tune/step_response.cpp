#include "tune/step_response.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dense/dense.hpp"
#include "design/design.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

namespace {

// exp(A) for ‖A‖ <= 0.1: the next term of the series is below rounding.
MatrixXd small_exponential(const MatrixXd& A) {
  constexpr int terms = 10;
  MatrixXd term = MatrixXd::Identity(A.rows(), A.cols()), sum = term;
  for (int k = 1; k <= terms; ++k) {
    term = (term * A / k).eval();
    sum += term;
  }
  return sum;
}

// The cubic with these values and derivatives with respect to s in [0, 1] at its ends.
struct Cubic {
  double y0, d0, y1, d1;

  double at(double s) const {
    const double c2 = 3 * (y1 - y0) - 2 * d0 - d1, c3 = 2 * (y0 - y1) + d0 + d1;
    return y0 + s * (d0 + s * (c2 + s * c3));
  }
  // 0, the extrema between, 1.
  std::vector<double> turns() const {
    const double c2 = 3 * (y1 - y0) - 2 * d0 - d1, c3 = 2 * (y0 - y1) + d0 + d1;
    std::vector<double> all{0.0, 1.0};
    const double under = c2 * c2 - 3 * c3 * d0;
    if (under >= 0) {
      const double q = -(c2 + std::copysign(std::sqrt(under), c2));
      for (const double s : {q / (3 * c3), d0 / q})
        if (s > 0 && s < 1) all.push_back(s);
    }
    std::ranges::sort(all);
    return all;
  }
  // The last s with |y| > band; negative: none.
  double last_beyond(double band) const {
    const std::vector<double> ends = turns();
    if (std::abs(y1) > band) return 1.0;
    for (std::size_t k = ends.size() - 1; k-- > 0;) {
      if (!(std::abs(at(ends[k])) > band)) continue;
      double out = ends[k], in = ends[k + 1];
      for (int i = 0; i < 50; ++i)
        (std::abs(at((out + in) / 2)) > band ? out : in) = (out + in) / 2;
      return out;
    }
    return -1.0;
  }
};

// |c exp(A t) x| <= √(c M⁻¹ cᵀ) √(xᵀ M x) for all t >= 0, where Aᵀ M + M A + I = 0.
struct Bound {
  MatrixXd M;
  double of_output = 0.0;

  double operator()(const VectorXd& x) const {
    return of_output * std::sqrt(std::max(0.0, x.dot(M * x)));
  }
};

}  // namespace

Decaying decaying(const MatrixXd& A, const RowVectorXd& c, const VectorXd& x0, double sign,
                  double band, double size) {
  constexpr int most_steps = 20000, most_levels = 60;
  constexpr double fine = 0.05, close = 1e-8;
  const Index n = A.rows();
  const EquationSolution lyapunov_function =
      lyapunov(A.transpose(), MatrixXd::Identity(n, n) * A.norm());
  if (!lyapunov_function) return {};
  const dense::Eigensystem sizes = dense::eigenvalues(lyapunov_function.X);
  if (!sizes.converged || !(sizes.values.real().minCoeff() > 0)) return {};  // A is not stable
  Bound bound{lyapunov_function.X};
  bound.of_output = std::sqrt(std::max(0.0, c.dot(dense::solve(bound.M, VectorXd(c.transpose())))));
  const double h = fine / A.norm();
  const RowVectorXd rate = c * A;
  std::vector<MatrixXd> powers{small_exponential(A * h)};  // exp(A h 2ᵏ)
  Decaying found;
  VectorXd x = x0;
  double t = 0;
  for (int step = 0, level = 1; step < most_steps; ++step) {
    const double enough = band > 0 ? band : std::max(found.largest, close * size);
    found.determined = bound(x) <= enough;
    if (found.determined) return found;
    while (std::ssize(powers) <= level) powers.emplace_back(powers.back() * powers.back());
    const double length = h * std::ldexp(1.0, level);
    const VectorXd middle = powers[std::size_t(level - 1)] * x,
                   next = powers[std::size_t(level)] * x;
    const Cubic y{c.dot(x), length * rate.dot(x), c.dot(next), length * rate.dot(next)};
    if (level > 1 && std::abs(y.at(0.5) - c.dot(middle)) > close * size) {
      --level;
      continue;
    }
    for (const double s : y.turns()) found.largest = std::max(found.largest, sign * y.at(s));
    const double last = y.last_beyond(band);
    if (last >= 0) found.last_beyond = t + last * length;
    x = next;
    t += length;
    level = std::min(level + 1, most_levels);
  }
  return found;
}

}  // namespace tiltrim
