/// Interface to NLopt. NLopt's return codes are not used.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace tiltrim {

enum class Optimizer { crs2, isres, esch, direct, mlsl, slsqp, mma, bobyqa, cobyla, sbplx };

/// min f(x) with c(x) <= 0, e(x) = 0 and lower <= x <= upper. Derivatives are requested by a
/// non-null pointer; rows are constraints, columns are components of x.
struct Optimization {
  Optimizer algorithm = Optimizer::slsqp;
  Eigen::VectorXd start, lower, upper;
  std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd* slope)> objective;
  using Constraints =
      std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& c, Eigen::MatrixXd* slopes)>;
  Eigen::Index inequalities = 0, equalities = 0;
  Constraints inequality{}, equality{};
  double constraint_tolerance = 1e-9;
  double step_tolerance = 1e-10;  ///< relative, on x
  double first_step = 0.0;        ///< 0: NLopt's default
  int evaluations = 1000;
  std::uint64_t seed = 1;
};

/// Runs the search. No status is returned because NLopt's is not trusted: the functions must record
/// the best point. Exceptions of the functions are passed on.
void optimize(const Optimization& problem);

}  // namespace tiltrim
