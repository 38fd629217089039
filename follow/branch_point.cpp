// Locates a branch point to round-off, where Newton on the branch itself does not converge.
#include <cmath>
#include <limits>

#include "dense/dense.hpp"
#include "follow/curve.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double nowhere = std::numeric_limits<double>::infinity();

// Moore's system: branches cross where the Jacobian has a left null vector ψ. The system is regular
// at a simple branch point, while the equations of the branch are singular.      [69]
//   G(y) + b ψ = 0,   slopes(y)ᵀ ψ = 0,   ½ (ψᵀψ - 1) = 0;   b = 0 if branches cross
struct MooreSystem {
  const Curve& curve;
  Index n;  // number of unknowns of the curve

  // F and its Jacobian, except the derivative of slopes(y)ᵀ ψ with respect to y.
  bool evaluate(const VectorXd& Y, VectorXd& F, MatrixXd& J) const {
    const VectorXd y = Y.head(n), psi = Y.segment(n, n - 1);
    const double b = Y[2 * n - 1];
    VectorXd G;
    MatrixXd S;
    if (!curve.evaluate(y, G, S)) return false;
    F.resize(2 * n);
    F << G + b * psi, S.transpose() * psi, 0.5 * (psi.squaredNorm() - 1);
    J = MatrixXd::Zero(2 * n, 2 * n);
    J.topLeftCorner(n - 1, n) = S;
    J.block(0, n, n - 1, n - 1).diagonal().setConstant(b);
    J.block(0, 2 * n - 1, n - 1, 1) = psi;
    J.block(n - 1, n, n, n - 1) = S.transpose();
    J.block(2 * n - 1, n, 1, n - 1) = psi.transpose();
    return true;
  }

  // ∂(slopes(y)ᵀ ψ)/∂y by central differences.
  bool curvature(const VectorXd& Y, MatrixXd& J) const {
    constexpr double step = 1e-5;
    const VectorXd psi = Y.segment(n, n - 1);
    VectorXd G;
    MatrixXd ahead, behind;
    for (Index k = 0; k < n; ++k) {
      const VectorXd e = step * VectorXd::Unit(n, k);
      if (!curve.evaluate(Y.head(n) + e, G, ahead) || !curve.evaluate(Y.head(n) - e, G, behind))
        return false;
      J.block(n - 1, k, n, 1) = (ahead - behind).transpose() * psi / (2 * step);
    }
    return true;
  }
};

}  // namespace

double refine_branch_point(const Curve& curve, Index parameter, double slope_error,
                           CurvePoint& at) {
  constexpr int cap = 20;
  constexpr double nearby = 1e-3;  // scaled: farther away it is a different branch point
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const Index n = at.y.size();
  const MooreSystem system{curve, n};
  VectorXd G, F;
  MatrixXd S, J;
  if (n < 2 || !curve.evaluate(at.y, G, S)) return nowhere;
  VectorXd Y(2 * n);
  Y << at.y, dense::svd(S).U.col(n - 2), 0.0;
  double last = nowhere;
  for (int i = 0; i < cap; ++i) {
    if (!system.evaluate(Y, F, J) || !system.curvature(Y, J)) return nowhere;
    const dense::LU<MatrixXd> lu = dense::lu(J);
    const VectorXd dY = dense::solve(lu, -F);
    if (!dY.allFinite()) return nowhere;
    const double step = dY.head(n).lpNorm<Eigen::Infinity>();
    if (step <= epsilon || step > 0.25 * last) {  // converged: the rest is rounding
      if ((Y.head(n) - at.y).lpNorm<Eigen::Infinity>() > nearby) return nowhere;
      VectorXd rounding(2 * n);  // of F
      rounding << VectorXd::Constant(n - 1, 64 * epsilon * (1 + Y.head(n).norm()) * (1 + S.norm())),
          VectorXd::Constant(n, (slope_error + 64 * epsilon) * (1 + S.norm())), 4 * epsilon;
      const MatrixXd inverse = dense::solve(lu, MatrixXd::Identity(2 * n, 2 * n));
      const VectorXd error = inverse.cwiseAbs() * rounding;
      if (!error.allFinite() || std::abs(Y[2 * n - 1]) > error[2 * n - 1] + nearby * nearby)
        return nowhere;
      at.y = Y.head(n);
      return error[parameter] + step;
    }
    last = step;
    Y += dY;
  }
  return nowhere;
}

}  // namespace tiltrim
