// The tube of equilibria over a box of parameters, by a parametric Krawczyk test.
#include <Eigen/Core>
#include <utility>

#include "dense/dense.hpp"
#include "model/among.hpp"
#include "model/lookup.hpp"
#include "prove/parts.hpp"

namespace tiltrim::proving {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A function of the box by its centre and slopes.
Jet linear(double centre, const VectorXd& slopes) {
  std::vector<double> row(Quadratic::length(std::size_t(slopes.size())));
  row[0] = centre;
  std::copy(slopes.begin(), slopes.end(), row.begin() + 1);
  return Jet::quadratic(std::move(row));
}

}  // namespace

Jets evaluate(const Setup& s, const Known& known, const Jets& unknowns, Along along) {
  const std::size_t m = along == Along::nothing ? 0 : along == Along::unknowns ? s.nz() : s.states;
  Jets x = known.x, u = known.u;
  for (std::size_t j = 0; j < s.states && along == Along::states; ++j) x[j] = x[j].unknown(j, m);
  for (std::size_t j = 0; j < s.nz(); ++j) {
    const std::size_t at = std::size_t(s.unknowns[j]);
    const std::size_t direction = along == Along::states ? s.direction(j) : j;
    (at < s.states ? x[at] : u[at - s.states]) = unknowns[j].unknown(direction, m);
  }
  if (current_branches) {
    current_branches->next = known.next;
    current_branches->values = along == Along::nothing;
  }
  const bool trim = s.problem.trim && along != Along::states;
  return (trim ? s.problem.trim : s.problem.model.jets)(x, u, known.p);
}

namespace {

// The equations, or their derivatives along the unknowns, of an evaluation.
struct Equations {
  Jets G;
  std::vector<Jets> slopes;  // row by row

  Equations(const Setup& s, const Jets& all) {
    for (const Index i : s.equations) {
      const Jet& row = all[std::size_t(i)];
      G.push_back(row.value_only());
      slopes.emplace_back();
      for (std::size_t j = 0; j < s.nz(); ++j) slopes.back().push_back(row.derivative(j));
    }
  }
  MatrixXd middle_slopes() const {
    return MatrixXd::NullaryExpr(std::ssize(G), std::ssize(G), [&](Index i, Index j) {
      return slopes[std::size_t(i)][std::size_t(j)].value().centre();
    });
  }
  // Of G, or of the slopes, along a number of the box.
  VectorXd along(std::size_t k) const {
    return VectorXd::NullaryExpr(std::ssize(G),
                                 [&](Index i) { return G[std::size_t(i)].value().slope(k); });
  }
  MatrixXd slopes_along(std::size_t k) const {
    return MatrixXd::NullaryExpr(std::ssize(G), std::ssize(G), [&](Index i, Index j) {
      return slopes[std::size_t(i)][std::size_t(j)].value().slope(k);
    });
  }
};

Jets line(const VectorXd& z, const MatrixXd& S) {
  Jets all;
  for (Index i = 0; i < z.size(); ++i) all.push_back(linear(z[i], S.row(i).transpose()));
  return all;
}

// Newton's method at the middle; the answer need not be exact.
bool newton(const Setup& s, const Known& known, VectorXd& z) {
  const MatrixXd flat = MatrixXd::Zero(z.size(), Index(s.k()));
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0; step < 30; ++step) {
    const Equations at(s, evaluate(s, known, line(z, flat), Along::unknowns));
    const VectorXd g = VectorXd::NullaryExpr(
        z.size(), [&](Index i) { return at.G[std::size_t(i)].value().centre(); });
    const VectorXd move = dense::solve(at.middle_slopes(), g);
    if (!move.allFinite()) return false;
    double size = 0;
    for (Index i = 0; i < move.size(); ++i)
      size = std::max(size, std::abs(move[i]) /
                                (std::abs(z[i]) +
                                 signal_of(s.problem.model, s.unknowns[std::size_t(i)]).nominal));
    z -= move;
    if (size < 1e-14 || (size < 1e-9 && size >= 0.5 * before)) return true;
    before = size;
  }
  return false;
}

// C(d) near the inverse of G_z(d), to first order: any matrices serve.
std::vector<Jets> preconditioner(const MatrixXd& C, const Equations& on_line, std::size_t k) {
  std::vector<MatrixXd> slopes;
  for (std::size_t j = 0; j < k; ++j) slopes.push_back(-C * on_line.slopes_along(j) * C);
  std::vector<Jets> all;
  for (Index i = 0; i < C.rows(); ++i) {
    all.emplace_back();
    for (Index j = 0; j < C.cols(); ++j) {
      VectorXd along(static_cast<Index>(k));
      for (std::size_t l = 0; l < k; ++l) along[Index(l)] = slopes[l](i, j);
      all.back().push_back(linear(C(i, j), along));
    }
  }
  return all;
}

Jet product(const Jets& row, const Jets& column) {
  Jet sum = row[0] * column[0];
  for (std::size_t j = 1; j < row.size(); ++j) sum += row[j] * column[j];
  return sum;
}

// |I - C(d) G_z(d)|, and what each number of the box adds to it.
MatrixXd contraction(const std::vector<Jets>& C, const Equations& at,
                     std::vector<MatrixXd>& shares) {
  MatrixXd K(std::ssize(C), std::ssize(C));
  for (MatrixXd& share : shares) share = K;
  for (Index j = 0; j < K.cols(); ++j) {
    Jets column;
    for (const Jets& row : at.slopes) column.push_back(row[std::size_t(j)]);
    for (Index i = 0; i < K.rows(); ++i) {
      const Jet left = product(C[std::size_t(i)], column) - (i == j ? 1.0 : 0.0);
      K(i, j) = magnitude(left.range());
      for (std::size_t k = 0; k < shares.size(); ++k) shares[k](i, j) = share_of(left.value(), k);
    }
  }
  return K;
}

Jets steps(const std::vector<Jets>& C, const Jets& G) {
  Jets all;
  for (const Jets& row : C) all.push_back(product(row, G));
  return all;
}

VectorXd magnitudes(const Jets& all) {
  return VectorXd::NullaryExpr(std::ssize(all),
                               [&](Index i) { return magnitude(all[std::size_t(i)].range()); });
}

// Z with rho + kappa Z a little below 0.9 Z.
VectorXd radii(const MatrixXd& kappa, const VectorXd& rho) {
  const MatrixXd left = 0.85 * MatrixXd::Identity(rho.size(), rho.size()) - kappa;
  return dense::solve(left, VectorXd(1.05 * rho));
}

// A tube that is not proved: what adds to it, in shares of its radii.
Failure fold(const Setup& s, const MatrixXd& C, const Jets& g, const std::vector<MatrixXd>& kappa,
             const VectorXd& rho) {
  Failure failure{"fold", -1, {}, {}};
  failure.share = VectorXd::Zero(std::ssize(kappa));
  for (std::size_t k = 0; k < kappa.size(); ++k) {
    const VectorXd turned = kappa[k] * rho;
    for (Index i = 0; i < rho.size(); ++i)
      failure.share[Index(k)] +=
          (0.1 * share_of(g[std::size_t(i)].value(), k) + turned[i]) / rho[i];
  }
  failure.weight = MatrixXd::Zero(Index(s.states), 1);
  for (Index j = 0; j < C.cols(); ++j)
    failure.weight(s.equations[std::size_t(j)], 0) =
        (C.col(j).cwiseAbs().array() / rho.array()).sum();
  return failure;
}

// C and S; false where they are not finite.
bool linearize_middle(const Setup& s, const Known& numbers, Record& r) {
  const Index n = r.z.size();
  const MatrixXd flat = MatrixXd::Zero(n, Index(s.k()));
  const Equations at(s, evaluate(s, numbers, line(r.z, flat), Along::unknowns));
  r.C = dense::solve(at.middle_slopes(), MatrixXd::Identity(n, n));
  r.S = flat;
  for (std::size_t k = 0; k < s.k(); ++k) r.S.col(Index(k)) = -r.C * at.along(k);
  return r.S.allFinite() && r.C.allFinite();
}

// Before an evaluation whose switches and undefined functions count.
void clear(Branches& sides) {
  sides.blocked = false;
  sides.trouble.clear();
}

// The cause of a failure, with the formula's function if one is to blame.
std::string cause_of(const std::string& cause, const Branches& sides) {
  const bool blamed = sides.trouble.starts_with("undefined") ||
                      (sides.trouble.starts_with("switch") && cause == "switch");
  return blamed ? sides.trouble : cause;
}

// Widens the tube about its line until it contains its image by 0.9, with the contraction on it in
// `kappa`; otherwise the cause.
const char* widen(const Setup& s, const Known& numbers, const std::vector<Jets>& C,
                  const VectorXd& rho, Branches& sides, Record& r, MatrixXd& kappa,
                  std::vector<MatrixXd>& shares) {
  constexpr int most_attempts = 4;
  for (int attempt = 0; attempt < most_attempts; ++attempt) {
    r.Z = radii(kappa, rho);
    if (!r.Z.allFinite() || !(r.Z.minCoeff() > 0)) return "fold";
    Jets wide = line(r.z, r.S);
    for (Index i = 0; i < r.z.size(); ++i)
      wide[std::size_t(i)] = wide[std::size_t(i)].widened(r.Z[i]);
    clear(sides);
    const Equations at(s, evaluate(s, numbers, wide, Along::unknowns));
    if (sides.blocked) return "switch";
    kappa = contraction(C, at, shares);
    const VectorXd K = (rho + kappa * r.Z) * (1 + 1e-12);
    if ((K.array() <= 0.9 * r.Z.array()).all()) return nullptr;
    if (!K.allFinite()) return "fold";
  }
  return "fold";
}

}  // namespace

Tube find_tube(const Setup& s, const Cell& cell, const VectorXd& start, Branches sides) {
  Tube tube;
  Record& r = tube.record;
  const BranchScope scope(sides);
  sides.next = 0;
  clear(sides);
  const Known numbers = known(s, cell);
  r.z = start;
  const auto refuse = [&](const char* cause, Failure failure = {}) {
    failure.cause = cause_of(cause, sides);
    tube.failed = std::move(failure);
    return tube;
  };
  if (!newton(s, numbers, r.z)) return refuse("fold");
  const Index n = r.z.size();
  if (!linearize_middle(s, numbers, r)) return refuse("fold");
  tube.trimmed = true;
  tube.line = evaluate(s, numbers, line(r.z, r.S), Along::nothing);
  clear(sides);
  const Equations on_line(s, evaluate(s, numbers, line(r.z, r.S), Along::unknowns));
  if (sides.blocked) return refuse("switch");
  const std::vector<Jets> C = preconditioner(r.C, on_line, s.k());
  const Jets bends = steps(C, on_line.G);
  for (Index i = 0; i < n; ++i)  // the curve bends to one side: its middle
    if (const double off = middle(bends[std::size_t(i)].range()); std::isfinite(off)) r.z[i] -= off;
  tube.line = evaluate(s, numbers, line(r.z, r.S), Along::nothing);
  const Equations shifted(s, tube.line);
  const Jets g = steps(C, shifted.G);
  VectorXd rho = magnitudes(g);
  for (Index i = 0; i < n; ++i)
    rho[i] +=
        1e-13 * (std::abs(r.z[i]) + signal_of(s.problem.model, s.unknowns[std::size_t(i)]).nominal);
  std::vector<MatrixXd> shares(s.k());
  MatrixXd kappa = contraction(C, on_line, shares);
  const Failure failure = fold(s, r.C, bends, shares, rho);
  if (!rho.allFinite() || !kappa.allFinite()) return refuse("fold", failure);
  if (const char* const cause = widen(s, numbers, C, rho, sides, r, kappa, shares))
    return refuse(cause, failure);
  // x(d) in z + S d - C(d) G(d) + (I - C(d) G_z) [-Z, Z]
  const VectorXd left = kappa * r.Z * (1 + 1e-12);
  tube.unknowns = line(r.z, r.S);
  for (Index i = 0; i < n; ++i)
    tube.unknowns[std::size_t(i)] =
        (tube.unknowns[std::size_t(i)] - g[std::size_t(i)]).widened(left[i]);
  clear(sides);
  tube.over = evaluate(s, numbers, tube.unknowns, Along::states);
  if (sides.blocked) return refuse("switch", failure);
  if (!std::ranges::all_of(tube.over, &Jet::known)) return refuse("undefined", failure);
  return tube;
}

int within_limits(const Setup& s, const Tube& tube, Failure& failure) {
  int answer = 1;
  for (const Setup::Limit& limit : s.limits) {
    const bool own = limit.unknown >= 0;
    const Jet& quantity =
        own ? tube.unknowns[std::size_t(limit.unknown)] : tube.over[std::size_t(limit.row)];
    const Signal& signal = own ? signal_of(s.problem.model, s.unknowns[std::size_t(limit.unknown)])
                               : s.problem.model.outputs[std::size_t(limit.row) - s.states];
    const Interval at = quantity.range();
    const double slack = 1e-9 * signal.nominal;
    if (at.lower() >= limit.range.lower + slack && at.upper() <= limit.range.upper - slack)
      continue;
    if (at.upper() < limit.range.lower - slack || at.lower() > limit.range.upper + slack) return -1;
    answer = 0;
    failure = {"limit", widest_share(quantity.value()), {}, {}};
  }
  return answer;
}

int worst(const Setup& s, const Cell& cell, const Record& r, const Branches& branches,
          const Failure& failure) {
  if (s.k() == 1) return 0;
  if (failure.cut >= 0 || failure.share.size() == 0) return failure.cut;
  VectorXd share = failure.share;
  Branches sides = branches;
  const BranchScope scope(sides);
  for (std::size_t k = 0; k < s.k() && failure.weight.size() > 0; ++k) {
    Cell alone = cell;
    for (std::size_t j = 0; j < s.k(); ++j)
      if (j != k) alone.r[j] = 0;
    MatrixXd S = MatrixXd::Zero(r.S.rows(), r.S.cols());
    S.col(Index(k)) = r.S.col(Index(k));
    sides.next = 0;
    const Known numbers = known(s, alone);
    const bool slopes = failure.weight.cols() > 1;
    const Jets all = evaluate(s, numbers, line(r.z, S), slopes ? Along::states : Along::nothing);
    for (Index i = 0; i < failure.weight.rows(); ++i)
      for (Index j = 0; j < failure.weight.cols(); ++j) {
        const Jet& row = all[std::size_t(i)];
        const double rest = slopes ? row.slope(std::size_t(j)).rest() : row.value().rest();
        share[Index(k)] += failure.weight(i, j) * rest;
      }
  }
  Index most = -1;
  if (share.allFinite()) share.maxCoeff(&most);
  return int(most);
}

bool middle_within_limits(const Setup& s, const Tube& tube) {
  return std::ranges::all_of(s.limits, [&](const Setup::Limit& limit) {
    const double at = limit.unknown >= 0 ? tube.record.z[limit.unknown]
                                         : tube.line[std::size_t(limit.row)].value().centre();
    return at >= limit.range.lower && at <= limit.range.upper;
  });
}

double share_of(const Quadratic& of, std::size_t k) {
  double share = std::abs(of.slope(k));
  for (std::size_t l = 0; l < of.numbers(); ++l)
    share += std::abs(l <= k ? of.bend(k, l) : of.bend(l, k));
  return share;
}

int widest_share(const Quadratic& of) {
  int most = -1;
  double largest = 0;
  for (std::size_t k = 0; k < of.numbers(); ++k) {
    if (const double share = share_of(of, k); share > largest) {
      largest = share;
      most = int(k);
    }
  }
  return most;
}

}  // namespace tiltrim::proving
