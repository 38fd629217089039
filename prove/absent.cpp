// That no equilibrium exists within the limits: bisection of the bounded unknowns.

#include "dense/dense.hpp"
#include "model/lookup.hpp"
#include "prove/parts.hpp"

namespace tiltrim::proving {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::size_t most_parts = 1000;
// A part this small, in shares of the limits, that is not excluded is close to a trim.
constexpr double smallest_part = 0.002;

using Part = std::vector<Interval>;  // of the unknowns

// The necessary system over a box of its unknowns and a cell of parameters: all of them are
// numbers of one box, the unknowns after the parameters.
class Rows {
 public:
  Rows(const ProveProblem::NecessarySystem& system, const Cell& cell, Branches branches)
      : system_(system), cell_(cell), branches_(std::move(branches)) {
    for (const std::string& name : system.equations)
      equations_.push_back(std::size_t(index_of(system.model.states, name, "state")));
    for (const auto& [name, range] : system.unknowns)
      at_.push_back(std::size_t(variable(system.model, name)));
  }

  // The equations; empty if a switch is open.
  Jets over(const Part& part) {
    const std::size_t k = cell_.m.size(), n = at_.size() + k;
    Jets c;
    for (std::size_t j = 0; j < k; ++j) c.push_back(Jet::number(cell_.m[j], cell_.r[j], j, n));
    const BranchScope scope(branches_);
    branches_.next = 0;
    branches_.blocked = false;
    branches_.values = true;
    auto [x, u, p, fixed] = system_.at(c);
    const std::size_t nx = x.size();
    for (std::size_t j = 0; j < at_.size(); ++j)
      if (fixed.empty() || !fixed[j])
        (at_[j] < nx ? x[at_[j]] : u[at_[j] - nx]) =
            Jet::number(middle(part[j]), radius(part[j]), k + j, n).unknown(0, 0);
    const Jets all = system_.model.jets(x, u, p);
    fixed_ = fixed;
    Jets rows;
    if (branches_.blocked) return rows;
    for (const std::size_t i : equations_) rows.push_back(all[i]);
    return rows;
  }
  bool fixed(std::size_t j) const { return !fixed_.empty() && fixed_[j]; }
  // Slopes along the unknowns, scaled by the part's half-widths.
  MatrixXd slopes(const Jets& rows) const {
    return MatrixXd::NullaryExpr(std::ssize(rows), std::ssize(at_), [&](Index i, Index j) {
      return rows[std::size_t(i)].value().slope(cell_.m.size() + std::size_t(j));
    });
  }

 private:
  const ProveProblem::NecessarySystem& system_;
  const Cell& cell_;
  Branches branches_;
  std::vector<std::size_t> equations_, at_;
  std::vector<char> fixed_;
};

bool nonzero(const VectorXd& weights, const Jets& rows) {
  Jet sum;
  for (Index i = 0; i < weights.size(); ++i) sum += weights[i] * rows[std::size_t(i)];
  const Interval all = sum.range();
  return all.lower() > 0 || all.upper() < 0;
}

}  // namespace

bool prove_absent(const Setup& s, const Cell& cell, const Branches& branches, Record& record) {
  if (!s.problem.necessary) return false;
  const ProveProblem::NecessarySystem& system = *s.problem.necessary;
  Rows rows(system, cell, branches);
  Part whole;
  for (const auto& [name, range] : system.unknowns) whole.emplace_back(range.lower, range.upper);
  std::vector<Part> open{whole};
  std::size_t parts = 0;
  const Index n = std::ssize(system.equations);
  while (!open.empty()) {
    if (++parts > most_parts) return false;
    const Part part = std::move(open.back());
    open.pop_back();
    const Jets over = rows.over(part);
    VectorXd size = VectorXd::Zero(std::ssize(part));
    bool excluded = false;
    if (!over.empty()) {
      const MatrixXd J = rows.slopes(over);
      // The sum of the other equations' projections that leaves the least of the unknowns.
      MatrixXd weights(n + J.cols(), n);
      weights.topRows(n).setIdentity();
      const dense::SVD svd = dense::svd(J);
      for (Index i = 0; i < n; ++i)
        weights.col(i).tail(J.cols()) = dense::solve(svd, VectorXd::Unit(n, i));
      for (Index i = 0; i < weights.rows() && !excluded; ++i) {
        if (!weights.row(i).allFinite()) continue;
        excluded = nonzero(weights.row(i).transpose(), over);
        if (excluded) record.absent.push_back({-1, 0.0, weights.row(i).transpose()});
      }
    }
    if (excluded) continue;
    for (std::size_t j = 0; j < part.size(); ++j) {
      if (rows.fixed(j)) continue;
      const auto& range = system.unknowns[j].second;
      size[Index(j)] = radius(part[j]) / (range.upper - range.lower);
    }
    Index cut = 0;
    if (!(size.maxCoeff(&cut) > smallest_part)) return false;
    const double at = middle(part[std::size_t(cut)]);
    record.absent.push_back({int(cut), at, {}});
    Part low = part, high = part;
    low[std::size_t(cut)] = {part[std::size_t(cut)].lower(), at};
    high[std::size_t(cut)] = {at, part[std::size_t(cut)].upper()};
    open.push_back(std::move(high));  // the lower part is next
    open.push_back(std::move(low));
  }
  return true;
}

}  // namespace tiltrim::proving
