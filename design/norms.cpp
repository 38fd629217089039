#include <fmt/core.h>

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "dense/dense.hpp"
#include "design/checks.hpp"
#include "design/design.hpp"
#include "design/lapack.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();
constexpr double rounding = std::numeric_limits<double>::epsilon();

struct System {
  MatrixXd A, B, C, D;
};

// States in units that balance A, B and C together: the same G.
System in_balanced_units(const System& g) {
  const Index n = g.A.rows(), m = g.B.cols(), p = g.C.rows();
  MatrixXd M = MatrixXd::Zero(n + 2, n + 2);
  M.topLeftCorner(n, n) = g.A;
  if (m > 0) M.col(n).head(n) = g.B.rowwise().norm();
  if (p > 0) M.row(n + 1).head(n) = g.C.colwise().norm();
  M(n, n + 1) = 1;  // from output to input, so that nothing is isolated
  const Eigen::VectorXd d = lapack::scales(M).head(n), over = d.cwiseInverse();
  return {over.asDiagonal() * g.A * d.asDiagonal(), over.asDiagonal() * g.B, g.C * d.asDiagonal(),
          g.D};
}

bool left_of_axis(const System& g, const VectorXcd& poles) {
  const Index n = g.A.rows();
  return poles.size() == n &&
         (n == 0 || poles.real().maxCoeff() < -double(n) * rounding * g.A.norm());
}

// The largest gain found so far.
struct Climb {
  const System& g;
  double gain, frequency = unbounded;

  double at(double omega) const {
    if (g.A.rows() == 0 || std::isinf(omega)) return lapack::spectral_norm(g.D.cast<Complex>());
    MatrixXcd M = -g.A.cast<Complex>();
    M.diagonal().array() += Complex(0, omega);
    const MatrixXcd X = dense::solve(M, g.B.cast<Complex>());
    const double value = lapack::spectral_norm(g.C.cast<Complex>() * X + g.D.cast<Complex>());
    return std::isfinite(value) ? value : 0.0;
  }
  bool visit(double omega) {
    const double value = at(omega);
    if (!(value > gain)) return false;
    gain = value;
    frequency = omega;
    return true;
  }
  // Up to the top of the hill within `width` of the frequency.
  void ascend(double width) {
    if (std::isinf(frequency)) return;
    std::uintmax_t evaluations = 30;
    const auto [omega, value] = boost::math::tools::brent_find_minima(
        [&](double w) { return -at(w); }, std::max(0.0, frequency - width), frequency + width,
        std::numeric_limits<double>::digits / 2, evaluations);
    if (-value > gain) {
      gain = -value;
      frequency = omega;
    }
  }
};

// A first peak: the resonance of each pair, static gain, and for ω -> ∞ that of D. If all are zero,
// more frequencies than a rational function of this order has zeros.
void first_peak(Climb& climb, const VectorXcd& poles) {
  climb.visit(0.0);
  double width = poles.size() > 0 ? poles.cwiseAbs().minCoeff() : 0.0;
  for (const Complex& pole : poles) {
    if (pole.imag() < 0) continue;
    const double resonance =
        std::sqrt(std::max(0.0, std::norm(pole.imag()) - std::norm(pole.real())));
    if (climb.visit(std::max(resonance, pole.imag() / 2))) width = 2 * std::abs(pole.real());
    if (pole.imag() == 0 && climb.visit(-pole.real())) width = -pole.real() / 2;
  }
  const Index n = poles.size();
  for (Index k = 0; climb.gain == 0 && k <= n; ++k)
    if (climb.visit(poles.cwiseAbs().maxCoeff() * double(k + 1) / double(n + 1))) width = 0;
  if (width > 0) climb.ascend(width);
}

// Its eigenvalues iω are the frequencies at which a singular value of G(iω) is γ.      [44, 45]
MatrixXd hamiltonian(const System& g, double gamma) {
  const Index n = g.A.rows(), m = g.B.cols(), p = g.C.rows();
  const MatrixXd R = gamma * gamma * MatrixXd::Identity(m, m) - g.D.transpose() * g.D;
  const MatrixXd S = gamma * gamma * MatrixXd::Identity(p, p) - g.D * g.D.transpose();
  const MatrixXd RB = dense::solve(R, MatrixXd(g.B.transpose()));
  const MatrixXd A = g.A + RB.transpose() * g.D.transpose() * g.C;
  MatrixXd H(2 * n, 2 * n);
  H << A, gamma * g.B * RB, -gamma * g.C.transpose() * dense::solve(S, g.C), -A.transpose();
  return H;
}

// Frequencies of all eigenvalues near the axis, and between neighbors. Too many do no harm: the
// gain is evaluated at each.
bool climb_between(Climb& climb, const VectorXcd& values) {
  constexpr double near = 1e-3, zero = 1e-7;
  const double size = values.cwiseAbs().maxCoeff();
  std::vector<double> crossings{0.0};
  for (const Complex& v : values)
    if (v.imag() >= 0 && std::abs(v.real()) <= near * std::abs(v) + zero * size)
      crossings.push_back(v.imag());
  std::ranges::sort(crossings);
  const double before = climb.gain;
  double width = 0;
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    climb.visit(crossings[k]);
    if (k == 0) continue;
    const double half = (crossings[k] - crossings[k - 1]) / 2;
    if (half > 0 && climb.visit(crossings[k - 1] + half)) width = half;
  }
  if (width > 0) climb.ascend(width);
  return climb.gain > before;
}

void check_system(const char* verb, const System& g) {
  const Index n = g.A.rows(), m = g.B.cols(), p = g.C.rows();
  checks::shapes(verb, {{"A", g.A, n, n}, {"B", g.B, n, m}, {"C", g.C, p, n}, {"D", g.D, p, m}});
}

}  // namespace

std::string to_string(PeakStatus status) {
  switch (status) {
    case PeakStatus::found:
      return "found";
    case PeakStatus::unstable:
      return "unstable";
    case PeakStatus::iteration_limit:
      break;
  }
  return "iteration_limit";
}

Peak hinf_norm(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C, const MatrixXd& D,
               double tolerance, int max_levels) {
  const RoundToNearest environment;
  check_system("hinf_norm", {A, B, C, D});
  if (!(tolerance >= 1e-12 && tolerance <= 1) || max_levels < 1)
    throw std::invalid_argument("hinf_norm: expected 1e-12 <= tolerance <= 1, max_levels >= 1");
  const System g = in_balanced_units({A, B, C, D});
  const VectorXcd poles = lapack::eigenvalues(g.A);
  if (!left_of_axis(g, poles)) return {};

  Climb climb{g, lapack::spectral_norm(D.cast<Complex>())};
  if (D.size() == 0) return {PeakStatus::found, 0.0, 0.0, 0.0};
  if (A.rows() == 0) return {PeakStatus::found, climb.gain, climb.gain, 0.0};
  first_peak(climb, poles);
  if (climb.gain == 0) return {PeakStatus::found, 0.0, 0.0, 0.0};

  Peak peak{PeakStatus::iteration_limit, 0.0, unbounded, 0.0};
  for (int level = 0; level < max_levels; ++level) {
    const double gamma = (1 + tolerance) * climb.gain;
    const VectorXcd values = lapack::eigenvalues(hamiltonian(g, gamma));
    if (values.size() == 0) break;
    if (climb_between(climb, values) && climb.gain >= gamma) continue;
    peak.status = PeakStatus::found;
    peak.upper = gamma;
    break;
  }
  peak.gain = climb.gain;
  peak.frequency = climb.frequency;
  return peak;
}

H2Norm h2_norm(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C, const MatrixXd& D) {
  const RoundToNearest environment;
  check_system("h2_norm", {A, B, C, D});
  const System g = in_balanced_units({A, B, C, D});
  if (!left_of_axis(g, lapack::eigenvalues(g.A)) || !D.isZero(0)) return {};
  // tr C P Cᵀ = tr Bᵀ O B with A P + P Aᵀ + B Bᵀ = 0 and Aᵀ O + O A + Cᵀ C = 0.
  const EquationSolution P = lyapunov(g.A, g.B * g.B.transpose());
  const EquationSolution O = lyapunov(g.A.transpose(), g.C.transpose() * g.C);
  if (P.X.size() != g.A.size() || O.X.size() != g.A.size()) return {std::nan(""), unbounded};
  const auto root = [](double square) { return std::sqrt(std::max(0.0, square)); };
  const double norm = root((g.C * P.X * g.C.transpose()).trace());
  const double other = root((g.B.transpose() * O.X * g.B).trace());
  const double larger = std::max(norm, other);
  const double difference = larger > 0 ? std::abs(norm - other) / larger : 0.0;
  return {norm, std::max({difference, P.residual, O.residual})};
}

}  // namespace tiltrim
