/// Derivatives of eigenvalues by parameters, with the shift of the trim. Internal to tune/.
#pragma once

#include <vector>

#include "sweep/neighbour.hpp"

namespace tiltrim {

/// Eigenvalues at an equilibrium, and dλ/dp, [eigenvalue, parameter], including the shift of the
/// trim. Empty if they cannot be computed.
struct EigenvalueSlopes {
  Eigen::VectorXcd eigenvalues;
  Eigen::MatrixXcd slopes;
};
EigenvalueSlopes spectrum_of(const Prepared& sweep, const GridTrim& e,
                             const std::vector<Eigen::Index>& parameters);

/// Derivatives of all model variables with respect to each of the parameters, in columns.
Eigen::MatrixXd shifts(const Prepared& sweep, const GridTrim& e,
                       const std::vector<Eigen::Index>& parameters);

/// Derivatives of jacobian(model, at, along) along each column of `by`, changes of all variables
/// of the model, by central differences with these steps.
std::vector<Eigen::MatrixXd> jacobian_slopes(const Model& model, const OperatingPoint& at,
                                             const Eigen::MatrixXd& by,
                                             const Eigen::VectorXd& steps,
                                             const std::vector<Eigen::Index>& along);
/// Steps along changes of these parameters.
Eigen::VectorXd steps_along(const OperatingPoint& at, const std::vector<Eigen::Index>& parameters);

}  // namespace tiltrim
