#include "tune/response.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>

#include "dense/dense.hpp"
#include "design/design.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "tune/shift.hpp"
#include "tune/step_response.hpp"

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

bool of_a_response(Measure what) {
  return what >= Measure::peak_gain && what <= Measure::settling_time;
}

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr double beyond_all = std::numeric_limits<double>::infinity();

// x' = A x + B u, y = C x + D u; or the derivatives of A, B, C, D by a gain.
struct Transfer {
  MatrixXd A, B, C, D;
};

// ---- weight ----

struct Filter {
  MatrixXd A, B, C;
  double D = 1.0;
};

// The ratio of polynomials in controllable canonical form.
Filter filter_of(const Requirement& r) {
  Filter w;
  if (r.denominator.empty() && r.numerator.empty()) return w;
  const std::vector<double> unit{1.0};
  const std::vector<double>& above = r.numerator.empty() ? unit : r.numerator;
  const std::vector<double>& below = r.denominator.empty() ? unit : r.denominator;
  const Index n = std::ssize(below) - 1, shift = n + 1 - std::ssize(above);
  const auto b = [&](Index power) {  // of the numerator, over the leading denominator
    const Index k = n - power - shift;
    return k < 0 ? 0.0 : above[std::size_t(k)] / below.front();
  };
  w.D = b(n);
  w.A = MatrixXd::Zero(n, n);
  w.B = MatrixXd::Zero(n, 1);
  w.C = MatrixXd::Zero(1, n);
  for (Index i = 0; i < n; ++i) {
    const double a = below[std::size_t(n - i)] / below.front();
    if (i + 1 < n) w.A(i, i + 1) = 1.0;
    w.A(n - 1, i) = -a;
    w.C(0, i) = b(i) - a * w.D;
  }
  if (n > 0) w.B(n - 1, 0) = 1.0;
  return w;
}

// Each output through the weight. Of derivatives, those of the series.
Transfer in_series(const Transfer& g, const Filter& w, bool derivative) {
  const Index n = g.A.rows(), m = g.B.cols(), p = g.C.rows(), k = w.A.rows(), all = n + p * k;
  Transfer s{MatrixXd::Zero(all, all), MatrixXd::Zero(all, m), MatrixXd::Zero(p, all), w.D * g.D};
  s.A.topLeftCorner(n, n) = g.A;
  s.B.topRows(n) = g.B;
  s.C.leftCols(n) = w.D * g.C;
  for (Index i = 0; i < p && k > 0; ++i) {
    const Index at = n + i * k;
    s.A.block(at, 0, k, n) = w.B * g.C.row(i);
    s.B.block(at, 0, k, m) = w.B * g.D.row(i);
    if (derivative) continue;
    s.A.block(at, at, k, k) = w.A;
    s.C.block(i, at, 1, k) = w.C;
  }
  return s;
}

// ---- from the model ----

// Where a transfer is read off the Jacobian of a model.
struct Path {
  const Model* model = nullptr;
  OperatingPoint at;
  std::vector<Index> along{};     // states, then the signals it starts from
  std::vector<Index> rows{};      // of [x; h] for each signal it leads to
  std::vector<double> factors{};  // of each
  double direct = 0.0;            // added to D
};

Index row_of(const Model& model, const std::string& name) {
  const Index state = find(model.states, name);
  return state >= 0 ? state
                    : std::ssize(model.states) + index_of(model.outputs, name, "output or state");
}

Transfer transfer_of(const Path& path, const MatrixXd& J, bool derivative) {
  const Index n = std::ssize(path.model->states), m = std::ssize(path.along) - n;
  const Index p = std::ssize(path.rows);
  Transfer g{J.topLeftCorner(n, n), J.topRightCorner(n, m), MatrixXd::Zero(p, n),
             MatrixXd::Constant(p, m, derivative ? 0.0 : path.direct)};
  for (Index i = 0; i < p; ++i) {
    const Index row = path.rows[std::size_t(i)];
    const double factor = path.factors[std::size_t(i)];
    if (row < n) {
      if (!derivative) g.C(i, row) = factor;
      continue;
    }
    g.C.row(i) = factor * J.row(row).head(n);
    g.D.row(i) += factor * J.row(row).tail(m);
  }
  return g;
}

Path along_states(const Model& model, const OperatingPoint& at) {
  Path path{&model, at};
  for (Index i = 0; i < std::ssize(model.states); ++i) path.along.push_back(i);
  return path;
}

Path path_of(const Requirement& r, const Place& place, const GridTrim& e) {
  const Model& model = place.responses ? *place.responses : place.request.model;
  OperatingPoint at = e.at;
  if (place.responses) at.u = VectorXd::Zero(std::ssize(model.inputs));
  Path path = along_states(model, at);
  if (r.measure == Measure::quadratic_cost) {
    for (const auto& [name, weight] : r.weights) {
      path.rows.push_back(row_of(model, name));
      path.factors.push_back(std::sqrt(weight));
    }
    return path;
  }
  for (const std::string& name : r.from) path.along.push_back(variable(model, name));
  for (const std::string& name : r.to) {
    path.rows.push_back(row_of(model, name));
    path.factors.push_back(1.0);
  }
  return path;
}

// From what is added to an actuator's command to the sum: 1/(1 + L).
Path path_at(const Place& place, const GridTrim& e, const std::string& actuator) {
  const Model& model = *place.loops;
  OperatingPoint at = e.at;
  at.u = VectorXd::Zero(std::ssize(model.inputs));
  Path path = along_states(model, at);
  path.along.push_back(std::ssize(model.states) +
                       index_of(model.inputs, actuator + "_added", "input"));
  path.rows = {std::ssize(model.states) + index_of(model.outputs, actuator, "output")};
  path.factors = {1.0};
  path.direct = 1.0;
  return path;
}

// The transfer of a path, and its derivatives with respect to the place's gains.
struct Described {
  Transfer transfer;
  std::vector<Transfer> slopes;
  bool in_use;  // without its weight it is not the path's direct part alone
};

Described described(const Requirement& r, const Place& place, const GridTrim& e, const Path& path,
                    bool slopes) {
  const Filter weight = filter_of(r);
  const Transfer plain = transfer_of(path, jacobian(*path.model, path.at, path.along), false);
  const bool through_states = !plain.B.isZero(0.0) && !plain.C.isZero(0.0);
  const bool in_use = through_states || (plain.D.array() != path.direct).any();
  Described all{in_series(plain, weight, false), {}, in_use};
  if (!slopes) return all;
  const MatrixXd own = shifts(*place.prepared, e, place.gains);
  const Index nx = path.at.x.size(), np = path.at.p.size();
  MatrixXd by = MatrixXd::Zero(nx + path.at.u.size() + np, own.cols());
  by.topRows(nx) = own.topRows(nx);
  by.bottomRows(np) = own.bottomRows(np);
  if (path.at.u.size() == e.at.u.size())
    by.middleRows(nx, path.at.u.size()) = own.middleRows(nx, path.at.u.size());
  for (const MatrixXd& dJ :
       jacobian_slopes(*path.model, path.at, by, steps_along(e.at, place.gains), path.along))
    all.slopes.push_back(in_series(transfer_of(path, dJ, true), weight, true));
  return all;
}

// ---- norms ----

bool finite(const Transfer& g) {
  return g.A.allFinite() && g.B.allFinite() && g.C.allFinite() && g.D.allFinite();
}

// Largest singular value of G = C (iω - A)⁻¹ B + D with vectors u and v:
// dσ = Re(u* (C R dA R B + dC R B + C R dB + dD) v), R = (iω - A)⁻¹.
ResponseScore peak_score(const Described& d) {
  const auto& [A, B, C, D] = d.transfer;
  if (!finite(d.transfer)) return {-beyond_all, {}};
  const Peak peak = hinf_norm(A, B, C, D);
  if (peak.status == PeakStatus::unstable) return {-beyond_all, {}};
  ResponseScore result{-(peak ? peak.gain : peak.upper), {}};
  if (d.slopes.empty()) return result;
  const Index n = A.rows(), m = B.cols(), p = C.rows();
  MatrixXcd RB = MatrixXcd::Zero(n, m), CR = MatrixXcd::Zero(p, n);
  if (std::isfinite(peak.frequency)) {
    MatrixXcd M = -A.cast<Complex>();
    M.diagonal().array() += Complex(0, peak.frequency);
    RB = dense::solve(M, MatrixXcd(B.cast<Complex>()));
    CR = dense::solve(MatrixXcd(M.transpose()), MatrixXcd(C.transpose().cast<Complex>()))
             .transpose();
  }
  const MatrixXcd G = C.cast<Complex>() * RB + D.cast<Complex>();
  MatrixXd real(2 * p, 2 * m);
  real << G.real(), -G.imag(), G.imag(), G.real();
  const dense::SVD svd = dense::svd(real);
  VectorXcd u(p), v(m);
  u.real() = svd.U.col(0).head(p);
  u.imag() = svd.U.col(0).tail(p);
  v.real() = svd.V.col(0).head(m);
  v.imag() = svd.V.col(0).tail(m);
  const Eigen::RowVectorXcd uCR = u.adjoint() * CR;
  const VectorXcd RBv = RB * v;
  result.slopes.resize(std::ssize(d.slopes));
  for (Index j = 0; j < result.slopes.size(); ++j) {
    const Transfer& s = d.slopes[std::size_t(j)];
    const Complex change = (uCR * (s.A * RBv + s.B * v) + u.adjoint() * (s.C * RBv + s.D * v))(0);
    result.slopes[j] = -change.real();
  }
  return result;
}

// q = tr(C P Cᵀ) with A P + P Aᵀ + B Bᵀ = 0 and Aᵀ O + O A + Cᵀ C = 0:
// dq = 2 tr(O dA P) + 2 tr(Bᵀ O dB) + 2 tr(C P dCᵀ).
ResponseScore square_score(const Described& d) {
  const auto& [A, B, C, D] = d.transfer;
  if (!finite(d.transfer) || !D.isZero(0)) return {-beyond_all, {}};
  const EquationSolution P = lyapunov(A, B * B.transpose());
  const EquationSolution O = lyapunov(A.transpose(), C.transpose() * C);
  if (!P || !O) return {-beyond_all, {}};
  ResponseScore result{-std::max(0.0, (C * P.X * C.transpose()).trace()), {}};
  result.slopes.resize(std::ssize(d.slopes));
  for (Index j = 0; j < result.slopes.size(); ++j) {
    const Transfer& s = d.slopes[std::size_t(j)];
    result.slopes[j] = -2 * ((O.X * s.A * P.X).trace() + (B.transpose() * O.X * s.B).trace() +
                             (C * P.X * s.C.transpose()).trace());
  }
  return result;
}

ResponseScore h2_score(const Described& d) {
  ResponseScore result = square_score(d);
  if (std::isinf(result.score)) return result;
  const double norm = std::sqrt(-result.score);
  if (norm > 0) result.slopes /= 2 * norm;
  result.score = -norm;
  return result;
}

// From the state of the disturbance instead of an input.
ResponseScore cost_score(const TuneProblem& problem, const Place& place, Described d) {
  VectorXd x0 = VectorXd::Zero(d.transfer.A.rows());
  for (const auto& [state, value] : problem.disturbance)
    x0[index_of(place.request.model.states, state, "state")] = value;
  const auto enters = [&](Transfer& g, const VectorXd& x) {
    g.B = x;
    g.D = MatrixXd::Zero(g.C.rows(), 1);
  };
  enters(d.transfer, x0);
  for (Transfer& s : d.slopes) enters(s, VectorXd::Zero(x0.size()));
  return square_score(d);
}

// y(t) - y(∞) = C exp(A t) A⁻¹ B for a unit step.
double step_score(const Requirement& r, const Transfer& g) {
  constexpr double none = 1e-10;
  if (!finite(g)) return -beyond_all;
  const VectorXd x = dense::solve(g.A, VectorXd(g.B.col(0)));
  const RowVectorXd c = g.C.row(0);
  const double end = g.D(0, 0) - c.dot(x);
  const double size = std::abs(g.D(0, 0)) + c.cwiseAbs().dot(x.cwiseAbs());
  if (!(std::abs(end) > none * size)) return unknown;
  const bool settles = r.measure == Measure::settling_time;
  const Decaying d = decaying(g.A, c, x, end > 0 ? 1.0 : -1.0,
                              settles ? r.band * std::abs(end) : 0.0, std::abs(end));
  if (!d.determined) return -beyond_all;
  return -(settles ? d.last_beyond : d.largest / std::abs(end));
}

ResponseScore worst_sensitivity(const Requirement& r, const Place& place, const GridTrim& e,
                                bool slopes) {
  ResponseScore least{unknown, {}};
  for (const Signal& input : place.loops->inputs) {
    const std::string actuator = input.name.substr(0, input.name.rfind("_added"));
    if (!r.of.empty() && r.of != actuator) continue;
    const Described d = described(r, place, e, path_at(place, e, actuator), slopes);
    if (!d.in_use) continue;
    const ResponseScore own = peak_score(d);
    if (!(own.score >= least.score)) least = own;
  }
  return least;
}

// Minus infinity where there is no finite value.
ResponseScore score_if_stable(const TuneProblem& problem, const Requirement& r, const Place& place,
                              const GridTrim& e, bool slopes) {
  if (r.measure == Measure::peak_sensitivity) return worst_sensitivity(r, place, e, slopes);
  const bool steps = r.measure == Measure::overshoot || r.measure == Measure::settling_time;
  const Described d = described(r, place, e, path_of(r, place, e), slopes && !steps);
  switch (r.measure) {
    case Measure::peak_gain:
      return peak_score(d);
    case Measure::h2_norm:
      return h2_score(d);
    case Measure::quadratic_cost:
      return cost_score(problem, place, d);
    default:
      return {step_score(r, d.transfer), {}};
  }
}

}  // namespace

ResponseScore response_score(const TuneProblem& problem, const Requirement& r, const Place& place,
                             const GridTrim& e, const VectorXcd& eigenvalues, bool slopes) {
  const double right = eigenvalues.real().maxCoeff();
  constexpr double far = 1e6;
  if (!(right < 0)) return {-unbounded * (1 + std::min(right, far)), {}};
  ResponseScore own = score_if_stable(problem, r, place, e, slopes);
  if (own.score <= -unbounded) own = {-unbounded, {}};
  return own;
}

namespace {

void check_weight(const Requirement& r) {
  const auto words = [](const std::vector<double>& c) {
    return fmt::format("[{}]", fmt::join(c, ", "));
  };
  for (const auto* c : {&r.numerator, &r.denominator})
    if (!std::ranges::all_of(*c, [](double v) { return std::isfinite(v); }) ||
        (!c->empty() && c->front() == 0))
      throw std::invalid_argument(fmt::format(
          "the weight of {} has the coefficients {}; expected numbers, the first not zero",
          to_string(r.measure), words(*c)));
  if (r.numerator.size() > std::max<std::size_t>(r.denominator.size(), 1))
    throw std::invalid_argument(
        fmt::format("the weight of {} is {} over {}; expected a numerator of no higher degree",
                    to_string(r.measure), words(r.numerator), words(r.denominator)));
  const Filter w = filter_of(r);
  if (w.A.rows() == 0) return;
  const dense::Eigensystem poles = dense::eigenvalues(w.A);
  if (!poles.converged || poles.values.real().maxCoeff() >= 0)
    throw std::invalid_argument(
        fmt::format("the weight of {} has the denominator {}, with a root that is not left of the "
                    "axis; expected a stable weight",
                    to_string(r.measure), words(r.denominator)));
}

}  // namespace

void check_response(const TuneProblem& problem, const Requirement& r, const Model& model) {
  const std::string name = to_string(r.measure);
  check_weight(r);
  if (r.measure == Measure::peak_sensitivity) return;
  if (r.measure == Measure::quadratic_cost) {
    if (problem.disturbance.empty())
      throw std::invalid_argument("quadratic_cost without a disturbance; expected one");
    if (r.weights.empty())
      throw std::invalid_argument("quadratic_cost without weights; expected outputs or states");
    for (const auto& [signal, weight] : r.weights) {
      (void)row_of(model, signal);
      if (!(weight >= 0) || !std::isfinite(weight))
        throw std::invalid_argument(
            fmt::format("quadratic_cost weighs {} by {}; expected at least 0", signal, weight));
    }
    return;
  }
  if (r.from.empty() || r.to.empty())
    throw std::invalid_argument(name + " without the signals it leads from and to");
  for (const std::string& signal : r.from)
    if (const Index from = variable(model, signal); from < std::ssize(model.states))
      throw std::invalid_argument(
          fmt::format("{} from the state {}; expected an input or a parameter", name, signal));
  for (const std::string& signal : r.to) (void)row_of(model, signal);
  const bool steps = r.measure == Measure::overshoot || r.measure == Measure::settling_time;
  if (steps && (r.from.size() != 1 || r.to.size() != 1))
    throw std::invalid_argument(fmt::format("{} from {} signals to {}; expected one of each", name,
                                            r.from.size(), r.to.size()));
  if (r.measure == Measure::settling_time && !(r.band > 0 && r.band < 1))
    throw std::invalid_argument(
        fmt::format("settling_time into a band of {}; expected one between 0 and 1", r.band));
}

}  // namespace tiltrim
