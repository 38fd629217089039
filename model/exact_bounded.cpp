// Bounds of the rounding of exact derivatives, by interval arithmetic.
#include <cmath>
#include <vector>

#include "model/branches.hpp"
#include "model/differentiate.hpp"
#include "model/jet.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// How far the derivatives may be from the exact ones at this point, from their evaluation on
// ranges; NaN where these tell nothing: at a kink, or where terms are undefined.
MatrixXd apart_from_ranges(const Model& model, const OperatingPoint& point,
                           const std::vector<Index>& variables, const MatrixXd& J) {
  MatrixXd apart = MatrixXd::Constant(J.rows(), J.cols(), NAN);
  std::vector<Jet> x, u, p;
  const auto fixed = [](const VectorXd& values, std::vector<Jet>& jets) {
    for (const double v : values) jets.push_back(Jet::number(v, 0.0, 0, 1));
  };
  fixed(point.x, x);
  fixed(point.u, u);
  fixed(point.p, p);
  const Index nx = point.x.size(), nu = point.u.size();
  for (std::size_t k = 0; k < variables.size(); ++k) {
    const Index j = variables[k];
    Jet& jet = j < nx        ? x[std::size_t(j)]
               : j < nx + nu ? u[std::size_t(j - nx)]
                             : p[std::size_t(j - nx - nu)];
    jet = jet.unknown(k, variables.size());
  }
  Branches sides{.replay = true};
  const BranchScope scope(sides);
  std::vector<Jet> rows;
  try {
    rows = model.jets(x, u, p);
  } catch (...) {  // outside of the model's domain
  }
  if (sides.blocked || std::ssize(rows) != J.rows()) return apart;
  for (Index i = 0; i < J.rows(); ++i)
    for (Index k = 0; k < J.cols(); ++k) {
      const Interval slope = rows[std::size_t(i)].slope(std::size_t(k)).range();
      if (rows[std::size_t(i)].known()) apart(i, k) = magnitude(slope - Interval(J(i, k)));
    }
  return apart;
}

}  // namespace

Estimate exact_bounded(const Model& model, const OperatingPoint& point,
                       const std::vector<Index>& variables) {
  Estimate e = exact(model, point, variables);
  constexpr std::size_t most_directions = 64;  // of a Jet
  if (!model.jets || variables.size() > most_directions) return e;
  const MatrixXd apart = apart_from_ranges(model, point, variables, e.value);
  e.error = apart.array().isFinite().select(e.error.cwiseMax(apart), e.error);
  return e;
}

}  // namespace tiltrim
