/// Linear compared with nonlinear motions from the same offset. Internal to simulate/, flight/ and
/// study/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "simulate/simulate.hpp"

namespace tiltrim {

/// An offset by state name as a vector. Throws std::invalid_argument for other names and if zero.
Eigen::VectorXd offset_of(const Signals& states, const std::map<std::string, double>& offset);

}  // namespace tiltrim

namespace tiltrim::comparing {

/// A nonlinear motion as deviations from its trim, [state, sample].
struct Nonlinear {
  std::vector<double> t;
  Eigen::MatrixXd x;
  bool whole = false;   ///< reached its end time
  std::string message;  ///< why it did not
};

/// Completes the response from its offset: both motions, their difference, and the offset up to
/// which they agree. `moved` may return no samples if there is no motion from an offset.
void compare(const std::function<Nonlinear(const Eigen::VectorXd& offset)>& moved,
             const Eigen::MatrixXd& A, const ResponseOptions& options, Response& response);

}  // namespace tiltrim::comparing
