/// How eigenvalues move with parameters when the trim moves with them too. Internal to tune/.
#pragma once

#include <vector>

#include "sweep/neighbour.hpp"

namespace tiltrim {

/// Eigenvalues at an equilibrium, and dλ/dp, [eigenvalue, parameter], the trim's shift included.
/// Empty if there are none to be had.
struct Spectrum {
  Eigen::VectorXcd eigenvalues;
  Eigen::MatrixXcd slopes;
};
Spectrum spectrum_of(const Prepared& sweep, const GridTrim& e,
                     const std::vector<Eigen::Index>& parameters);

/// How all variables of the model move with each of the parameters, in columns.
Eigen::MatrixXd shifts(const Prepared& sweep, const GridTrim& e,
                       const std::vector<Eigen::Index>& parameters);

}  // namespace tiltrim
