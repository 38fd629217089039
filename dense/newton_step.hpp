/// Newton's step on equations of any scale, and vectors compared bit by bit. Internal to tiltrim.
#pragma once

#include <Eigen/Core>

namespace tiltrim::dense {

/// The least-norm solution of J step = -residual with every row of J divided by its largest entry,
/// so that an equation with small slopes counts as much as the others; rows of zeros count nothing.
Eigen::VectorXd newton_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& residual);

/// Whether both have the same size and the same bits; 0 and -0 differ.
bool same_bits(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace tiltrim::dense
