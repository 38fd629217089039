#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "dense/dense.hpp"
#include "design/lapack.hpp"
#include "linearize/modes.hpp"
#include "model/lookup.hpp"
#include "qualities/transfer_function.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

std::string to_string(ZerosStatus status) {
  switch (status) {
    case ZerosStatus::found:
      return "found";
    case ZerosStatus::not_enclosed:
      return "not_enclosed";
    case ZerosStatus::degree_undecided:
      return "degree_undecided";
    case ZerosStatus::no_response:
      return "no_response";
  }
  return "unknown";
}

namespace {

constexpr double unenclosed = std::numeric_limits<double>::infinity();

// Relative rounding error of a sum of n products, with room for the bound's own rounding.
double rounding_of(Index n) { return 2 * double(n + 4) * std::numeric_limits<double>::epsilon(); }

TransferFunction with_errors(const TransferFunction& given) {
  const Index n = given.A.rows();
  if (given.A.cols() != n || given.b.size() != n || given.c.size() != n)
    throw std::invalid_argument(
        fmt::format("zeros: A is {} x {}, b has {} and c {} entries; expected n x n, n and n", n,
                    given.A.cols(), given.b.size(), given.c.size()));
  TransferFunction g = given;
  if (g.A_error.size() == 0) g.A_error = MatrixXd::Zero(n, n);
  if (g.b_error.size() == 0) g.b_error = VectorXd::Zero(n);
  if (g.c_error.size() == 0) g.c_error = RowVectorXd::Zero(n);
  if (g.A_error.rows() != n || g.A_error.cols() != n || g.b_error.size() != n ||
      g.c_error.size() != n)
    throw std::invalid_argument("zeros: an error bound has another size than what it bounds");
  const bool finite = g.A.allFinite() && g.b.allFinite() && g.c.allFinite() && std::isfinite(g.d) &&
                      g.A_error.allFinite() && g.b_error.allFinite() && g.c_error.allFinite() &&
                      std::isfinite(g.d_error);
  if (!finite) throw std::invalid_argument("zeros: a value or an error bound is not finite");
  return g;
}

// Marks the states that `from` reaches along nonzero entries: links(i, j) leads from j to i.
std::vector<bool> reached(const MatrixXd& links, const VectorXd& from) {
  std::vector<bool> in(std::size_t(from.size()));
  std::vector<Index> open;
  const auto enter = [&](Index i) {
    if (in[std::size_t(i)]) return;
    in[std::size_t(i)] = true;
    open.push_back(i);
  };
  for (Index i = 0; i < from.size(); ++i)
    if (from[i] != 0) enter(i);
  while (!open.empty()) {
    const Index j = open.back();
    open.pop_back();
    for (Index i = 0; i < links.rows(); ++i)
      if (links(i, j) != 0) enter(i);
  }
  return in;
}

// Without the states that are not on a path from the input to the output.
TransferFunction on_the_path(const TransferFunction& g) {
  const MatrixXd links = g.A.cwiseAbs() + g.A_error;
  const auto driven = reached(links, g.b.cwiseAbs() + g.b_error);
  const auto seen = reached(links.transpose(), (g.c.cwiseAbs() + g.c_error).transpose());
  std::vector<Index> kept;
  for (Index i = 0; i < g.b.size(); ++i)
    if (driven[std::size_t(i)] && seen[std::size_t(i)]) kept.push_back(i);
  return {g.A(kept, kept),       g.b(kept),       g.c(kept),       g.d,
          g.A_error(kept, kept), g.b_error(kept), g.c_error(kept), g.d_error};
}

// The first Markov parameter d, cb, cAb, ... that is not zero, whatever the errors.
void first_markov_parameter(const TransferFunction& g, ZerosAndPoles& answer) {
  const Index n = g.b.size();
  const double ulp = rounding_of(n);
  double value = g.d, error = g.d_error;
  VectorXd p = g.b, p_error = g.b_error;
  const MatrixXd A = g.A.cwiseAbs() + g.A_error;
  for (int degree = 0; degree <= int(n); ++degree) {
    if (degree > 0) {
      value = g.c.dot(p);
      error = (g.c.cwiseAbs() + g.c_error).dot(p_error) + g.c_error.dot(p.cwiseAbs()) +
              ulp * g.c.cwiseAbs().dot(p.cwiseAbs());
      const VectorXd rounding = ulp * (g.A.cwiseAbs() * p.cwiseAbs());
      p_error = (A * p_error + g.A_error * p.cwiseAbs() + rounding).eval();
      p = (g.A * p).eval();
    }
    if (value == 0 && error == 0) continue;  // by exact zeros
    answer.relative_degree = degree;
    answer.gain = value;
    answer.gain_error = error;
    answer.status = std::abs(value) > error ? ZerosStatus::found : ZerosStatus::degree_undecided;
    return;
  }
  answer.status = ZerosStatus::no_response;
}

// S(z) = [A - zI, b; c, d]
template <class Scalar>
Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> pencil(const TransferFunction& g, Scalar z) {
  const Index n = g.b.size();
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> S(n + 1, n + 1);
  S << g.A.cast<Scalar>(), g.b.cast<Scalar>(), g.c.cast<Scalar>(), Scalar(g.d);
  S.diagonal().head(n).array() -= z;
  return S;
}

// A zero z and its vector v with S(z) v = 0, v[pinned] = 1.
struct ZeroVector {
  Complex z;
  VectorXcd v;
  Index pinned = 0;
};

// The derivative of (S(z) v, v[pinned] - 1) by (v, z).
MatrixXcd bordered(const TransferFunction& g, const ZeroVector& at) {
  const Index n = g.b.size();
  MatrixXcd J = MatrixXcd::Zero(n + 2, n + 2);
  J.topLeftCorner(n + 1, n + 1) = pencil(g, at.z);
  J.col(n + 1).head(n) = -at.v.head(n);
  J(n + 1, at.pinned) = 1;
  return J;
}

VectorXcd residual_of(const TransferFunction& g, const ZeroVector& at) {
  VectorXcd r(g.b.size() + 2);
  r << pencil(g, at.z) * at.v, at.v[at.pinned] - 1.0;
  return r;
}

ZeroVector improved(const TransferFunction& g, Complex start) {
  const Index n = g.b.size();
  ZeroVector at{start, dense::least_singular_vector(pencil(g, start)), 0};
  at.v.cwiseAbs().maxCoeff(&at.pinned);
  at.v /= at.v[at.pinned];
  constexpr int steps = 4;  // from a QZ eigenvalue, of which half the digits suffice
  for (int k = 0; k < steps; ++k) {
    const VectorXcd step = dense::solve(bordered(g, at), residual_of(g, at));
    if (!step.allFinite()) break;
    at.v -= step.head(n + 1);
    at.z -= step[n + 1];
    if (start.imag() == 0) at.z = at.z.real();
  }
  return at;
}

// Krawczyk's test: the radius of a disk around z that contains a zero for every matrix within the
// errors; infinite if none was found.  δ -> δ - R F(δ) maps the box |δ| <= r into itself if
// |R| |F(0)| + |I - R J| r + |R| |ΔS| (|v| + r) + |R| |E r_v| r_z <= r                  [98]
double enclosed(const TransferFunction& g, const ZeroVector& at) {
  const Index n = g.b.size(), m = n + 2;
  const double ulp = rounding_of(m);
  const MatrixXcd J = bordered(g, at), R = dense::inverse(J);
  if (!R.allFinite() || !at.v.allFinite()) return unenclosed;
  const MatrixXd size = R.cwiseAbs();
  MatrixXd dS = MatrixXd::Zero(n + 1, n + 1);
  dS << g.A_error, g.b_error, g.c_error, g.d_error;
  const VectorXd v = at.v.cwiseAbs();
  VectorXd start = residual_of(g, at).cwiseAbs();
  start.head(n + 1) += dS * v + ulp * (pencil(g, at.z).cwiseAbs() * v);
  start[n + 1] += ulp;
  const VectorXd t = size * start;
  const MatrixXd contraction =
      (MatrixXcd::Identity(m, m) - R * J).cwiseAbs() + ulp * (size * J.cwiseAbs());
  const auto image = [&](const VectorXd& r) {
    VectorXd rest = VectorXd::Zero(m);
    rest.head(n + 1) = dS * r.head(n + 1);
    rest.head(n) += r[n + 1] * r.head(n);
    return VectorXd((1 + ulp) * (t + contraction * r + size * rest));
  };
  VectorXd r = (2 * t).cwiseMax(std::numeric_limits<double>::min());
  constexpr int attempts = 12;
  for (int k = 0; k < attempts; ++k) {
    const VectorXd next = image(r);
    if (!next.allFinite()) return unenclosed;
    if ((next.array() <= r.array()).all()) return next[n + 1];
    r = 1.2 * next;
  }
  return unenclosed;
}

// The `count` eigenvalues of the pencil that are farthest from infinity.
std::vector<Complex> nearest_zeros(const TransferFunction& g, Index count) {
  const Index n = g.b.size();
  MatrixXd E = MatrixXd::Zero(n + 1, n + 1);
  E.topLeftCorner(n, n).setIdentity();
  const lapack::Pencil all = lapack::generalized_eigenvalues(pencil(g, 0.0), E);
  std::vector<Complex> roots;
  std::vector<Index> order(std::size_t(all.beta.size()));
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = Index(k);
  const auto size = [&](Index k) {
    return all.beta[k] == 0 ? unenclosed : std::abs(all.alpha[k]) / std::abs(all.beta[k]);
  };
  std::ranges::stable_sort(order, {}, size);
  for (const Index k : order)
    if (std::ssize(roots) < count && all.beta[k] != 0) roots.push_back(all.alpha[k] / all.beta[k]);
  return roots;
}

void order_roots(std::vector<EnclosedRoot>& roots) {
  std::ranges::stable_sort(
      roots, {}, [](const EnclosedRoot& r) { return std::pair(r.value.real(), r.value.imag()); });
}

// A disk that touches another one may share its zero.
void separate(std::vector<EnclosedRoot>& roots) {
  std::vector<bool> shared(roots.size());
  for (std::size_t i = 0; i < roots.size(); ++i)
    for (std::size_t j = 0; j < roots.size(); ++j)
      if (i != j && !(std::abs(roots[i].value - roots[j].value) > roots[i].error + roots[j].error))
        shared[i] = true;
  for (std::size_t i = 0; i < roots.size(); ++i)
    if (shared[i]) roots[i].error = unenclosed;
}

}  // namespace

TransferFunction transfer_function(const LinearModel& linear, const std::string& input,
                                   const std::string& output) {
  if (!linear) throw std::invalid_argument("zeros: there is no linear model");
  const Index j = index_of(linear.inputs, input, "input");
  TransferFunction g{linear.A, linear.B.col(j), {}, 0.0, linear.A_error, linear.B_error.col(j)};
  const Index state = find(linear.states, output);
  if (state >= 0) {
    g.c = RowVectorXd::Unit(linear.A.rows(), state);
    g.c_error = RowVectorXd::Zero(linear.A.rows());
    return g;
  }
  const Index i = index_of(linear.outputs, output, "state or output");
  g.c = linear.C.row(i);
  g.c_error = linear.C_error.row(i);
  g.d = linear.D(i, j);
  g.d_error = linear.D_error(i, j);
  return g;
}

ZerosAndPoles zeros_and_poles(const LinearModel& linear, const std::string& input,
                              const std::string& output) {
  return zeros_and_poles(transfer_function(linear, input, output));
}

ZerosAndPoles zeros_and_poles(const TransferFunction& transfer) {
  const RoundToNearest environment;
  const TransferFunction whole = with_errors(transfer), g = on_the_path(whole);
  ZerosAndPoles answer;
  answer.cancelled = int(whole.b.size() - g.b.size());
  for (const Mode& mode : modes(g.A, g.A_error).modes)
    answer.poles.push_back({mode.eigenvalue, mode.error});
  first_markov_parameter(g, answer);
  if (answer.status != ZerosStatus::found) return answer;
  const Index count = g.b.size() - answer.relative_degree;
  std::vector<Complex> starts = nearest_zeros(g, count);
  starts.resize(std::size_t(count), std::numeric_limits<double>::quiet_NaN());
  for (const Complex start : starts) {
    const bool known = std::isfinite(start.real());
    const ZeroVector at = known ? improved(g, start) : ZeroVector{start, {}, 0};
    const double error = known ? enclosed(g, at) : unenclosed;
    answer.zeros.push_back({std::isfinite(error) ? at.z : start, error});
  }
  separate(answer.zeros);
  order_roots(answer.zeros);
  const bool all = std::ranges::all_of(
      answer.zeros, [](const EnclosedRoot& r) { return std::isfinite(r.error); });
  answer.status = all ? ZerosStatus::found : ZerosStatus::not_enclosed;
  return answer;
}

}  // namespace tiltrim
