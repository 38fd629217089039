/// Linear motions beside nonlinear ones from the same offset. Internal to simulate/ and flight/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "simulate/simulate.hpp"

namespace tiltrim::comparing {

/// A nonlinear motion as deviations from its trim, [state, sample].
struct Nonlinear {
  std::vector<double> t;
  Eigen::MatrixXd x;
  bool whole = false;   ///< to the end of its time
  std::string message;  ///< why not
};

/// Fills in the response from its offset: both motions, how far apart, how far they go together.
/// `moved` may have no samples where there is no motion from an offset.
void compare(const std::function<Nonlinear(const Eigen::VectorXd& offset)>& moved,
             const Eigen::MatrixXd& A, const ResponseOptions& options, Response& response);

}  // namespace tiltrim::comparing
