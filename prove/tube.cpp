// The tube of equilibria over a box of parameters, by a parametric Krawczyk test.
#include <fmt/core.h>

#include <Eigen/Core>
#include <utility>

#include "dense/dense.hpp"
#include "model/among.hpp"
#include "prove/parts.hpp"

namespace tiltrim::proving {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Setup::Setup(const ProveProblem& p) : problem(p), states(p.model.states.size()) {
  if (!p.model.jets)
    throw CallerMistake(fmt::format("{}: the model has no ranges with derivatives", p.model.name));
  if (p.unknowns.size() != p.equations.size() || p.unknowns.empty())
    throw CallerMistake(
        fmt::format("{} unknowns for {} equations", p.unknowns.size(), p.equations.size()));
  if (p.parameters.empty()) throw CallerMistake("a proof needs at least one parameter");
  const Index inputs = std::ssize(p.model.inputs);
  moving = states;
  for (const std::string& name : p.unknowns) {
    unknowns.push_back(variable(p.model, name));
    if (unknowns.back() >= Index(states) + inputs)
      throw CallerMistake(fmt::format("the unknown '{}' is a parameter", name));
    if (unknowns.back() >= Index(states)) ++moving;
  }
  for (const std::string& name : p.equations)
    equations.push_back(index_of(p.model.states, name, "state"));
  for (const auto& [name, range] : p.limits) {
    const auto own = std::ranges::find(p.unknowns, name);
    if (own != p.unknowns.end())
      limits.push_back({own - p.unknowns.begin(), -1, range});
    else
      limits.push_back({-1, Index(states) + index_of(p.model.outputs, name, "output"), range});
  }
  for (const ProveParameter& parameter : p.parameters) {
    if (!(parameter.from < parameter.to))
      throw CallerMistake(fmt::format("{}: expected from < to", parameter.key));
    if (!p.numbers) placed.push_back(variable(p.model, parameter.key));
  }
  directions = moving + k();
}

std::size_t Setup::direction(std::size_t unknown) const {
  const std::size_t own = std::size_t(unknowns[unknown]);
  if (own < states) return own;
  std::size_t at = states;
  for (std::size_t j = 0; j < unknown; ++j) at += std::size_t(unknowns[j]) >= states;
  return at;
}

Cell::Cell(std::vector<Range> b) : box(std::move(b)) {
  for (const Range& range : box) {
    m.push_back(0.5 * (range.lower + range.upper));
    r.push_back(Interval::up(
        std::max(Interval::up(range.upper - m.back()), Interval::up(m.back() - range.lower))));
  }
}

Jets evaluate(const Setup& s, const Record& r, const Cell& cell, bool at_middle, bool curved) {
  const std::size_t n = s.directions;
  const OperatingPoint& guess = s.problem.guess;
  Jets x, u, c;
  std::vector<double> extents(n, 0.0);
  for (std::size_t j = 0; j < s.states; ++j)
    x.push_back(Jet::variable(guess.x[Index(j)], guess.x[Index(j)], j, n, 1, curved));
  for (const double value : guess.u) u.emplace_back(value);
  for (std::size_t j = 0; j < s.nz(); ++j) {
    const Index i = Index(j);
    Interval range(r.z[i]);
    for (Index k = 0; k < r.S.cols() && !at_middle; ++k)
      range += Interval(-1, 1) * Interval(r.S(i, k));
    if (!at_middle) range += Interval(-r.Z[i], r.Z[i]);
    Jet own = Jet::variable(range, r.z[i], s.direction(j), n, 1, curved);
    for (Index k = 0; k < r.S.cols(); ++k) own.slope[s.moving + std::size_t(k)] = r.S(i, k);
    if (curved) own.tilt = own.slope;
    if (!at_middle) extents[s.direction(j)] = r.Z[i];
    const std::size_t at = std::size_t(s.unknowns[j]);
    (at < s.states ? x[at] : u[at - s.states]) = own;
  }
  for (std::size_t k = 0; k < s.k(); ++k) {
    const double m = cell.m[k], w = cell.r[k];
    const Interval range = at_middle ? Interval(m) : m + Interval(-w, w);
    c.push_back(Jet::variable(range, m, s.moving + k, n, w, curved));
    extents[s.moving + k] = 1;
  }
  if (current_branches) current_branches->extents = at_middle ? std::vector<double>() : extents;
  Jets p;
  if (s.problem.numbers) {
    p = s.problem.numbers(c);
  } else {
    for (const double value : guess.p) p.emplace_back(value);
    for (std::size_t k = 0; k < s.k(); ++k) {
      const std::size_t at = std::size_t(s.placed[k]), first = s.states + u.size();
      (at < first ? u[at - s.states] : p[at - first]) = c[k];
    }
  }
  return s.problem.model.jets(x, u, p);
}

namespace {

MatrixXd middle_slopes(const Setup& s, const Jets& at, bool parameters) {
  MatrixXd J(s.nz(), parameters ? s.k() : s.nz());
  for (Index i = 0; i < J.rows(); ++i)
    for (Index j = 0; j < J.cols(); ++j)
      J(i, j) = middle(at[std::size_t(s.equations[std::size_t(i)])].slope_at(
          parameters ? s.moving + std::size_t(j) : s.direction(std::size_t(j))));
  return J;
}

// Newton's method at the middle; the answer need not be exact.
bool newton(const Setup& s, const Cell& cell, Record& r, Branches& sides) {
  VectorXd& z = r.z;
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0; step < 30; ++step) {
    sides.next = 0;
    const Jets at = evaluate(s, r, cell, true, false);
    VectorXd g(s.nz());
    for (Index i = 0; i < g.size(); ++i)
      g[i] = middle(at[std::size_t(s.equations[std::size_t(i)])].value);
    const VectorXd move = dense::solve(middle_slopes(s, at, false), g);
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

}  // namespace

// max |C (a vector of ranges)| row by row.
static VectorXd weighted(const MatrixXd& C, const std::vector<Interval>& v) {
  VectorXd all(C.rows());
  for (Index i = 0; i < C.rows(); ++i) {
    Interval sum;
    for (Index j = 0; j < C.cols(); ++j) sum += Interval(C(i, j)) * v[std::size_t(j)];
    all[i] = magnitude(sum);
  }
  return all;
}

// Bound of |C G(z + S d, d)|, and each parameter's share of it.
static VectorXd residual(const Setup& s, const Tube& tube, MatrixXd& share, const Jets& bends) {
  const MatrixXd& C = tube.record.C;
  const auto rows = [&](const auto& of) {
    std::vector<Interval> v;
    for (const Index i : s.equations) v.push_back(of(std::size_t(i)));
    return weighted(C, v);
  };
  VectorXd sum = rows([&](std::size_t i) { return tube.centre[i].value; });
  share = MatrixXd::Zero(Index(s.nz()), Index(s.k()));
  for (std::size_t k = 0; k < s.k(); ++k) {
    share.col(Index(k)) +=
        rows([&](std::size_t i) { return tube.centre[i].slope_at(s.moving + k); });
    for (std::size_t l = 0; l <= k; ++l) {
      const VectorXd H =
          rows([&](std::size_t i) { return bends[i].bend_at(s.moving + k, s.moving + l); });
      share.col(Index(k)) += 0.5 * H;
      if (l != k) share.col(Index(l)) += 0.5 * H;
    }
  }
  return (sum + share.rowwise().sum()) * (1 + 1e-12);
}

// |I - C G_z| over the tube.
static MatrixXd contraction(const Setup& s, const Tube& tube) {
  const MatrixXd& C = tube.record.C;
  MatrixXd K(C.rows(), C.cols());
  for (std::size_t j = 0; j < s.nz(); ++j) {
    for (Index i = 0; i < C.rows(); ++i) {
      Interval sum = i == Index(j) ? -1.0 : 0.0;
      for (Index l = 0; l < C.cols(); ++l)
        sum += Interval(C(i, l)) *
               tube.over[std::size_t(s.equations[std::size_t(l)])].slope_at(s.direction(j));
      K(i, Index(j)) = magnitude(sum);
    }
  }
  return K;
}

static bool try_tube(const Setup& s, const Cell& cell, Tube& tube, Branches& sides) {
  const std::vector<char> centre = std::exchange(sides.all, {});
  sides.next = 0;
  sides.free = false;
  tube.over = evaluate(s, tube.record, cell, false, true);
  const bool same = !sides.blocked && sides.all == centre;
  sides.all = centre;
  return same;
}

Tube find_tube(const Setup& s, const Cell& cell, const VectorXd& start, Branches sides) {
  Tube tube;
  Record& r = tube.record;
  const Watched watched(sides);
  sides.free = true;
  r.z = start;
  if (!newton(s, cell, r, sides)) {
    tube.failed = Failure{"fold", 0};
    return tube;
  }
  for (const bool sloped : {false, true}) {  // the slopes, then second derivatives along them
    sides.all.clear();
    sides.next = 0;
    sides.blocked = false;
    tube.centre = evaluate(s, r, cell, true, sloped);
    if (sloped) break;
    const MatrixXd slopes = middle_slopes(s, tube.centre, false);
    r.C = dense::solve(slopes, MatrixXd::Identity(slopes.rows(), slopes.rows()));
    r.S = -r.C * middle_slopes(s, tube.centre, true);
  }
  MatrixXd share;
  r.Z = 2.0 * residual(s, tube, share, tube.centre);
  for (Index i = 0; i < r.Z.size(); ++i)
    r.Z[i] +=
        1e-13 * (std::abs(r.z[i]) + signal_of(s.problem.model, s.unknowns[std::size_t(i)]).nominal);
  // Over a wide box all ranges are useless: the curvature at the middle tells what to cut.
  Index cut = 0;
  if (share.allFinite())
    (share.array().colwise() / r.Z.array()).colwise().maxCoeff().maxCoeff(&cut);
  const auto refuse = [&](const char* cause) {
    tube.failed = Failure{cause, std::size_t(cut)};
    return tube;
  };
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (!r.Z.allFinite() || !r.S.allFinite()) return refuse("fold");
    if (!try_tube(s, cell, tube, sides)) return refuse("switch");
    const VectorXd rho = residual(s, tube, share, tube.over);
    const VectorXd K = (rho + contraction(s, tube) * r.Z) * (1 + 1e-12);
    if ((K.array() <= 0.9 * r.Z.array()).all()) return tube;
    if (!K.allFinite() || ((K - rho).array() > 0.9 * r.Z.array()).any()) return refuse("fold");
    r.Z = 1.5 * K.cwiseMax(0.5 * r.Z);
  }
  return refuse("fold");
}

int within_limits(const Setup& s, const Tube& tube, Failure& failure) {
  const Record& r = tube.record;
  int answer = 1;
  for (const Setup::Limit& limit : s.limits) {
    Interval at;
    VectorXd share = VectorXd::Zero(Index(s.k()));
    double slack = 0;
    if (limit.unknown >= 0) {
      at = r.z[limit.unknown] + Interval(-r.Z[limit.unknown], r.Z[limit.unknown]);
      share = r.S.row(limit.unknown).cwiseAbs();
      slack = signal_of(s.problem.model, s.unknowns[std::size_t(limit.unknown)]).nominal;
    } else {
      const Jet &centre = tube.centre[std::size_t(limit.row)],
                &over = tube.over[std::size_t(limit.row)];
      at = centre.value;
      for (std::size_t a = 0; a < s.nz(); ++a)
        at += over.slope_at(s.direction(a)) * Interval(-r.Z[Index(a)], r.Z[Index(a)]);
      for (std::size_t k = 0; k < s.k(); ++k) {
        share[Index(k)] += magnitude(centre.slope_at(s.moving + k));
        for (std::size_t l = 0; l < s.k(); ++l)
          share[Index(k)] += 0.5 * magnitude(over.bend_at(s.moving + k, s.moving + l));
      }
      slack = s.problem.model.outputs[std::size_t(limit.row) - s.states].nominal;
    }
    share *= 1 + 1e-12;
    for (const double w : share) at += Interval(-w, w);
    slack *= 1e-9;
    if (at.lower() >= limit.range.lower + slack && at.upper() <= limit.range.upper - slack)
      continue;
    if (at.upper() < limit.range.lower - slack || at.lower() > limit.range.upper + slack) return -1;
    answer = 0;
    Index cut = 0;
    if (share.allFinite()) share.maxCoeff(&cut);
    failure = {"limit", std::size_t(cut)};
  }
  return answer;
}

}  // namespace tiltrim::proving
