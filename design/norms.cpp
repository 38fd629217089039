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
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();
constexpr double rounding = std::numeric_limits<double>::epsilon();

// Relative rounding error of a sum of n products, with room for the bound's own rounding.
double rounding_of(Index n) { return double(n + 2) * rounding; }

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
  const VectorXd d = lapack::scales(M).head(n), over = d.cwiseInverse();
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

// No input reaches an output.
bool no_path(const System& g) {
  const auto linked = [](const MatrixXd& M) { return MatrixXd((M.array() != 0).cast<double>()); };
  MatrixXd reached = linked(g.B);
  for (Index k = 0; k < g.A.rows(); ++k) reached = linked(reached + linked(g.A) * reached);
  return g.D.isZero(0) && (linked(g.C) * reached).isZero(0);
}

// A first peak: the resonance of each pair, between the time scales, static gain, and for ω -> ∞
// that of D. If all are zero, more frequencies than a rational function of this order has zeros.
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
  VectorXd scales = poles.cwiseAbs();
  std::ranges::sort(scales);
  for (Index k = 1; k < n; ++k)
    if (climb.visit(std::sqrt(scales[k - 1] * scales[k]))) width = scales[k] - scales[k - 1];
  for (Index k = 0; climb.gain == 0 && k <= n; ++k)
    if (climb.visit(poles.cwiseAbs().maxCoeff() * double(k + 1) / double(n + 1))) width = 0;
  if (width > 0) climb.ascend(width);
}

// H in units that balance it, and bounds on the rounding of its entries.
struct Hamiltonian {
  MatrixXd H, error;
};

// Its eigenvalues iω are the frequencies at which a singular value of G(iω) is γ:         [44, 45]
// iω x = A x + B v, iω z = -Aᵀ z - Cᵀ w, γ v - Dᵀ w = Bᵀ z, γ w - D v = C x.
Hamiltonian hamiltonian(const System& g, double gamma) {
  const Index n = g.A.rows(), m = g.B.cols(), p = g.C.rows();
  MatrixXd H(2 * n, 2 * n), in(2 * n, m + p), out(m + p, 2 * n), S(m + p, m + p);
  H << g.A, MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), -g.A.transpose();
  in << g.B, MatrixXd::Zero(n, p), MatrixXd::Zero(n, m), -g.C.transpose();
  out << MatrixXd::Zero(m, n), g.B.transpose(), g.C, MatrixXd::Zero(p, n);
  S << gamma * MatrixXd::Identity(m, m), -g.D.transpose(), -g.D, gamma * MatrixXd::Identity(p, p);
  const MatrixXd K = dense::solve(S, out);
  const double ulp = rounding_of(m + p), least = gamma - lapack::spectral_norm(g.D.cast<Complex>());
  const MatrixXd left =
      (S * K - out).cwiseAbs() + ulp * (S.cwiseAbs() * K.cwiseAbs() + out.cwiseAbs());
  const MatrixXd error = in.rowwise().norm() * left.colwise().norm() / least +
                         ulp * (H.cwiseAbs() + in.cwiseAbs() * K.cwiseAbs());
  H += in * K;
  const VectorXd d = lapack::scales(H), over = d.cwiseInverse();
  return {over.asDiagonal() * H * d.asDiagonal(), over.asDiagonal() * error * d.asDiagonal()};
}

struct Interval {
  double low, high;
};

// Intervals that hold the frequency of every eigenvalue on the axis, apart and in order. All
// eigenvalues are in Gershgorin's disks of V⁻¹ H V = Λ + V⁻¹ (H V - V Λ), with the computed V, Λ.
//                                                                            [11, sec. 7.2]
std::vector<Interval> crossings(const Hamiltonian& of, const dense::Eigensystem& found) {
  const auto& [H, error] = of;
  const MatrixXcd &V = found.V, W = dense::inverse(V);
  const MatrixXd v = V.cwiseAbs(), w = W.cwiseAbs();
  const double ulp = rounding_of(H.rows());
  const auto identity = MatrixXcd::Identity(H.rows(), H.rows());
  const double off = ((identity - W * V).cwiseAbs() + ulp * (w * v)).rowwise().sum().maxCoeff();
  const MatrixXd left = (H * V - V * found.values.asDiagonal()).cwiseAbs() +
                        (error + ulp * H.cwiseAbs()) * v +
                        ulp * (v * found.values.cwiseAbs().asDiagonal());
  const VectorXd radii = (w * left).rowwise().sum();
  const double more = off < 0.5 ? off / (1 - off) * radii.maxCoeff() : unbounded;  // V⁻¹ is not W
  const double largest = (H.cwiseAbs() + error).rowwise().sum().maxCoeff();
  std::vector<Interval> all, apart;
  for (Index k = 0; k < radii.size(); ++k) {
    const double radius = radii[k] + more, center = found.values[k].imag();
    if (std::abs(found.values[k].real()) > radius || center + radius < 0) continue;
    const bool known = std::isfinite(radius);
    all.push_back({known ? std::max(0.0, center - radius) : 0.0,
                   known ? std::min(largest, center + radius) : largest});
  }
  std::ranges::sort(all, {}, &Interval::low);
  for (const Interval& one : all)
    if (apart.empty() || one.low > apart.back().high)
      apart.push_back(one);
    else
      apart.back().high = std::max(apart.back().high, one.high);
  return apart;
}

// Of the gain at the center and on the interval, rounding included.
struct Bounds {
  double center = unbounded, everywhere = unbounded;
};

// G(i(c + w δ)) = D + Σ C Tᵏ R B δᵏ with R = (ic - A)⁻¹, T = -iw R, for |δ| <= 1 by the norms of
// the coefficients of G*G, which are small also where G turns and its gain does not change.
Bounds gains(const System& g, const Interval& on) {
  constexpr int order = 8;
  const Index n = g.A.rows();
  const double c = on.low + (on.high - on.low) / 2, w = (on.high - on.low) / 2 + rounding * c;
  MatrixXcd M = -g.A.cast<Complex>();
  M.diagonal().array() += Complex(0, c);
  const MatrixXcd R = dense::inverse(M), CR = g.C * R;
  // R = M⁻¹ (I - F), F includes the rounding of I - M R
  const double ulp = rounding_of(n);
  const MatrixXd r = R.cwiseAbs(), B = g.B.cwiseAbs(), C = g.C.cwiseAbs();
  const MatrixXd F = (MatrixXcd::Identity(n, n) - M * R).cwiseAbs() + ulp * (M.cwiseAbs() * r);
  const double f = F.norm(), size = CR.norm() * B.norm();
  if (!(f < 0.1)) return {};
  const double error = (CR.cwiseAbs() * F * B + 2 * ulp * (C * r * B + g.D.cwiseAbs())).norm() +
                       size * f * f / (1 - f);

  MatrixXcd X = R * g.B;
  std::vector<MatrixXcd> G{g.C * X + g.D};
  const double center = lapack::spectral_norm(G[0]);
  Bounds bounds{center * (1 + 10 * ulp) + error};
  const double q = w * R.norm() * (1 + 2 * f);
  if (q > 0.5) return bounds;
  double sum = G[0].norm(), square = 0;
  for (int k = 1; k <= order; ++k) {
    X = Complex(0, -w) * (R * X);
    G.push_back(g.C * X);
    sum += G.back().norm();
  }
  const MatrixXcd first = G[0].adjoint() * G[1], even = G[0].adjoint() * G[0];
  for (const double end : {-1.0, 1.0})  // between them the norm is convex
    square = std::max(square, lapack::spectral_norm(even + end * (first + first.adjoint())));
  for (int k = 2; k <= 2 * order; ++k) {
    MatrixXcd term = MatrixXcd::Zero(g.B.cols(), g.B.cols());
    for (int j = std::max(0, k - order); j <= std::min(k, order); ++j)
      term += G[std::size_t(j)].adjoint() * G[std::size_t(k - j)];
    square += term.norm();
  }
  const double rest = 2 * q * C.norm() * X.norm();  // Σ over k > order
  const double rounded = (2 * f * size + ulp * C.norm() * r.norm() * B.norm()) * q * (2 - q) /
                         ((1 - q) * (1 - q));  // Σ (k + 1) qᵏ
  bounds.everywhere =
      std::sqrt(square + 4 * rounding_of(order + g.C.rows()) * sum * sum) + rest + error + rounded;
  return bounds;
}

// Shows that the gain is below γ on all intervals, halving them as needed.
bool all_below(Climb& climb, double gamma, std::vector<Interval> open) {
  constexpr int most = 10000;
  for (int k = 0; k < most && !open.empty(); ++k) {
    const Interval on = open.back();
    open.pop_back();
    const Bounds bounds = gains(climb.g, on);
    if (bounds.everywhere < gamma) continue;
    const double center = on.low + (on.high - on.low) / 2;
    climb.visit(center);
    const bool halves = on.low < center && center < on.high;
    if (!halves || !(bounds.center < gamma) || climb.gain >= gamma) return false;
    open.push_back({center, on.high});
    open.push_back({on.low, center});
  }
  return open.empty();
}

// The gain is below γ at ω -> ∞, and passes γ within `crossings` only: it is below γ everywhere if
// it is there and at one frequency between each two.
bool shown_below(Climb& climb, double gamma, std::vector<Interval> crossings) {
  double before = 0;
  for (std::size_t k = 0, all = crossings.size(); k < all; ++k) {
    const double between = before + (crossings[k].low - before) / 2;
    before = crossings[k].high;
    crossings.push_back({between, between});
  }
  if (std::isfinite(climb.frequency)) crossings.push_back({climb.frequency, climb.frequency});
  return all_below(climb, gamma, crossings);
}

// Frequencies of all eigenvalues near the axis, and between neighbors. Too many do no harm: the
// gain is evaluated at each.
void climb_between(Climb& climb, const VectorXcd& values) {
  constexpr double near = 1e-3, zero = 1e-7;
  const double size = values.cwiseAbs().maxCoeff();
  std::vector<double> crossings{0.0};
  for (const Complex& v : values)
    if (v.imag() >= 0 && std::abs(v.real()) <= near * std::abs(v) + zero * size)
      crossings.push_back(v.imag());
  std::ranges::sort(crossings);
  double width = 0;
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    climb.visit(crossings[k]);
    if (k == 0) continue;
    const double half = (crossings[k] - crossings[k - 1]) / 2;
    if (half > 0 && climb.visit(crossings[k - 1] + half)) width = half;
  }
  if (width > 0) climb.ascend(width);
}

// tr C P Cᵀ, and how far it may be off.
struct Variance {
  double value = std::nan(""), error = unbounded;
};

// Row sums of |A X + X Aᵀ + Q|, rounding included: a diagonal matrix that is larger.
VectorXd residual(const MatrixXd& A, const MatrixXd& X, const MatrixXd& Q) {
  const MatrixXd AX = A * X, size = A.cwiseAbs() * X.cwiseAbs();
  const MatrixXd rounded = rounding_of(A.rows()) * (size + size.transpose() + Q.cwiseAbs());
  return ((AX + AX.transpose() + Q).cwiseAbs() + rounded).rowwise().sum();
}

// Less what rounding in the factorization may hide.
bool positive_definite(const MatrixXd& X) {
  const double n = double(X.rows());
  const MatrixXd hidden = (n * rounding_of(X.rows()) * X.diagonal()).asDiagonal();
  return dense::cholesky(X - hidden).has_value();
}

// A P + P Aᵀ + B Bᵀ = R with -Q <= R <= Q: P is off by at most X, A X + X Aᵀ + Q = 0. The computed
// X may lack the share of Q that it leaves. It is positive definite only if A is stable.    [34]
Variance variance(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C) {
  const MatrixXd noise = B * B.transpose(), b = B.cwiseAbs(), c = C.cwiseAbs();
  const double ulp = rounding_of(A.rows() + B.cols() + C.rows());
  if (!noise.allFinite()) return {};
  const MatrixXd P = lyapunov(A, noise).X;
  if (P.size() != A.size()) return {};
  const double value = (C * P * C.transpose()).trace();
  VectorXd q = residual(A, P, noise) + ulp * (b * b.transpose()).rowwise().sum();
  if (q.isZero(0)) return {0.0, 0.0};
  q.array() += rounding * q.maxCoeff();
  if (!q.allFinite()) return {value};
  const MatrixXd Q = q.asDiagonal(), X = lyapunov(A, Q).X;
  if (X.size() != A.size() || !X.allFinite() || !positive_definite(X)) return {value};
  const double share = residual(A, X, Q).cwiseQuotient(q).maxCoeff();
  if (!(share < 0.1)) return {value};
  return {value, (C * X * C.transpose()).trace() / (1 - share) +
                     2 * ulp * (c * (P + X).cwiseAbs() * c.transpose()).trace()};
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
  if (no_path(g)) return {PeakStatus::found, 0.0, 0.0, 0.0};
  first_peak(climb, poles);
  if (climb.gain == 0) return {PeakStatus::iteration_limit, 0.0, unbounded, 0.0};

  Peak peak{PeakStatus::iteration_limit, 0.0, unbounded, 0.0};
  double wanted = tolerance;
  for (int level = 0; level < max_levels && wanted <= 1; ++level) {
    const double gamma = (1 + wanted) * climb.gain;
    const Hamiltonian h = hamiltonian(g, gamma);
    if (!h.H.allFinite()) break;
    const dense::Eigensystem found = dense::eigensystem(h.H);
    if (!found.converged) break;
    climb_between(climb, found.values);
    if (climb.gain < gamma && shown_below(climb, gamma, crossings(h, found))) {
      peak.upper = gamma;
      break;
    }
    if (climb.gain < gamma) wanted *= 10;  // rounding hides the answer: a coarser one
  }
  if (peak.upper <= (1 + tolerance) * climb.gain) peak.status = PeakStatus::found;
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
  const Variance P = variance(g.A, g.B, g.C);
  const Variance O = variance(g.A.transpose(), g.C.transpose(), g.B.transpose());
  const auto& [value, error] = O.error < P.error ? O : P;
  if (error == 0) return {std::sqrt(value), 0.0};
  if (!(value > error)) return {std::sqrt(value < 0 ? 0 : value), unbounded};
  return {std::sqrt(value), error / value / (1 + std::sqrt(1 - error / value)) + 2 * rounding};
}

}  // namespace tiltrim
