// That no equilibrium exists within the limits: bisection of the bounded unknowns.

#include "dense/dense.hpp"
#include "prove/parts.hpp"

namespace tiltrim::proving {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::size_t most_parts = 2000;

// The necessary system over a box of its unknowns and a cell of parameters.
class Rows {
 public:
  Rows(const NecessarySystem& system, const Cell& cell, Branches branches)
      : system_(system), cell_(cell), branches_(std::move(branches)) {
    for (const std::string& name : system.equations)
      equations_.push_back(std::size_t(index_of(system.model.states, name, "state")));
    for (const auto& [name, range] : system.unknowns)
      at_.push_back(std::size_t(variable(system.model, name)));
    branches_.unknowns = at_.size();
  }

  // The equations; empty if a switch is open.
  Jets over(const std::vector<Interval>& y, bool middle) {
    const std::size_t k = cell_.m.size(), n = at_.size() + k;
    Jets c;
    for (std::size_t j = 0; j < k; ++j) {
      const double m = cell_.m[j], r = cell_.r[j];
      c.push_back(Jet::variable(middle ? Interval(m) : m + Interval(-r, r), m, at_.size() + j, n, r,
                                false));
    }
    std::vector<double> extents(n, 1.0);
    for (std::size_t j = 0; j < at_.size(); ++j) extents[j] = radius(y[j]);
    branches_.extents = middle ? std::vector<double>() : extents;
    const Watched watched(branches_);
    branches_.next = 0;
    branches_.free = middle;
    branches_.blocked = false;
    branches_.all.clear();
    auto [x, u, p, fixed] = system_.at(c);
    const std::size_t nx = x.size();
    for (std::size_t j = 0; j < at_.size(); ++j)
      if (fixed.empty() || !fixed[j])
        (at_[j] < nx ? x[at_[j]] : u[at_[j] - nx]) =
            Jet::variable(y[j], tiltrim::middle(y[j]), j, n, 1, false);
    const Jets all = system_.model.jets(x, u, p);
    fixed_ = fixed;
    Jets rows;
    if (branches_.blocked) return rows;
    for (const std::size_t i : equations_) rows.push_back(all[i]);
    return rows;
  }
  const std::vector<char>& outcomes() const { return branches_.all; }
  bool fixed(std::size_t j) const { return !fixed_.empty() && fixed_[j]; }
  std::size_t unknowns() const { return at_.size(); }
  std::size_t parameters() const { return cell_.m.size(); }

 private:
  const NecessarySystem& system_;
  const Cell& cell_;
  Branches branches_;
  std::vector<std::size_t> equations_, at_;
  std::vector<char> fixed_;
};

struct Part {
  std::vector<Interval> y;
};

// Mean-value form of a weighted sum of the rows, and its plain range.
bool nonzero(const Rows& rows, const VectorXd& weights, const Jets& centre, const Jets& over,
             const Part& part) {
  Interval form, plain;
  for (Index i = 0; i < weights.size(); ++i) {
    form += Interval(weights[i]) * centre[std::size_t(i)].value;
    plain += Interval(weights[i]) * over[std::size_t(i)].value;
  }
  for (std::size_t j = 0; j < rows.unknowns() + rows.parameters(); ++j) {
    Interval slope;
    for (Index i = 0; i < weights.size(); ++i)
      slope += Interval(weights[i]) * over[std::size_t(i)].slope_at(j);
    const double r = j < rows.unknowns() ? radius(part.y[j]) : 1.0;
    form += slope * Interval(-r, r);
  }
  return form.lower() > 0 || form.upper() < 0 || plain.lower() > 0 || plain.upper() < 0;
}

MatrixXd slopes_of(const Rows& rows, const Jets& at) {
  MatrixXd J(Index(at.size()), Index(rows.unknowns()));
  for (Index i = 0; i < J.rows(); ++i)
    for (Index j = 0; j < J.cols(); ++j)
      J(i, j) = middle(at[std::size_t(i)].slope_at(std::size_t(j)));
  return J;
}

}  // namespace

bool prove_absent(const Setup& s, const Cell& cell, const Branches& branches, Record& record) {
  if (!s.problem.necessary) return false;
  const NecessarySystem& system = *s.problem.necessary;
  Branches own = branches;
  Rows rows(system, cell, std::move(own));
  Part whole;
  for (const auto& [name, range] : system.unknowns) whole.y.emplace_back(range.lower, range.upper);
  std::vector<Part> open{whole};
  std::size_t parts = 0;
  while (!open.empty()) {
    if (++parts > most_parts) return false;
    const Part part = std::move(open.back());
    open.pop_back();
    std::vector<Interval> middles;
    for (const Interval& y : part.y) middles.emplace_back(middle(y));
    const Jets over = rows.over(part.y, false);
    const std::vector<char> outcomes = rows.outcomes();
    const Jets centre = rows.over(middles, true);
    const bool comparable = !over.empty() && !centre.empty() && outcomes == rows.outcomes();
    MatrixXd weights =
        MatrixXd::Identity(Index(system.equations.size()), Index(system.equations.size()));
    VectorXd size = VectorXd::Zero(Index(part.y.size()));
    bool excluded = false;
    if (comparable) {
      const MatrixXd J = slopes_of(rows, centre);
      const dense::SVD svd = dense::svd(J);
      MatrixXd C(J.cols(), J.rows());  // the pseudo-inverse
      for (Index i = 0; i < C.cols(); ++i)
        C.col(i) = dense::solve(svd, VectorXd::Unit(C.cols(), i));
      if (C.allFinite()) {
        MatrixXd all(weights.rows() + C.rows(), weights.cols());
        all << weights, C;
        weights = all;
      }
      for (Index i = 0; i < weights.rows() && !excluded; ++i) {
        excluded = nonzero(rows, weights.row(i).transpose(), centre, over, part);
        if (excluded) record.absent.push_back({-1, 0.0, weights.row(i).transpose()});
      }
    }
    if (excluded) continue;
    // Cut the unknown whose width moves the equations most.
    for (std::size_t j = 0; j < part.y.size(); ++j) {
      if (rows.fixed(j)) continue;
      const auto& range = system.unknowns[j].second;
      size[Index(j)] = radius(part.y[j]) / (range.upper - range.lower);
    }
    Index cut = 0;
    if (!(size.maxCoeff(&cut) > 1e-7)) return false;
    const double at = middle(part.y[std::size_t(cut)]);
    record.absent.push_back({int(cut), at, {}});
    Part low = part, high = part;
    low.y[std::size_t(cut)] = {part.y[std::size_t(cut)].lower(), at};
    high.y[std::size_t(cut)] = {at, part.y[std::size_t(cut)].upper()};
    open.push_back(std::move(high));  // the lower part is next
    open.push_back(std::move(low));
  }
  return true;
}

}  // namespace tiltrim::proving
