/// NLopt behind one door: what it says of its own success is not passed on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace tiltrim {

enum class Optimizer { crs2, isres, esch, direct, mlsl, slsqp, mma, bobyqa, cobyla, sbplx };

/// min f(x) with c(x) <= 0, e(x) = 0 and lower <= x <= upper. Slopes are asked for where a pointer
/// is given, rows of constraints by columns of x.
struct Optimization {
  Optimizer algorithm = Optimizer::slsqp;
  Eigen::VectorXd start, lower, upper;
  std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd* slope)> objective;
  using Constraints =
      std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& c, Eigen::MatrixXd* slopes)>;
  Eigen::Index inequalities = 0, equalities = 0;
  Constraints inequality{}, equality{};
  double constraint_tolerance = 1e-9;
  double step_tolerance = 1e-10;  ///< relative, of x
  double first_step = 0.0;        ///< 0: NLopt's own
  int evaluations = 1000;
  std::uint64_t seed = 1;
};

/// Thrown by one of the functions, it ends the search.
struct EndSearch {};

/// Runs the search and says nothing of how it ended: NLopt's word is not taken. What is best is for
/// the functions to remember. Other exceptions of the functions are passed on.
void optimize(const Optimization& problem);

}  // namespace tiltrim
