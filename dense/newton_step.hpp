/// Newton step for equations of any scale, and bitwise comparison of vectors. Internal to tiltrim.
#pragma once

#include <Eigen/Core>

namespace tiltrim::dense {

/// The minimum-norm solution of J step = -residual with every row of J scaled by its largest entry,
/// so that equations with small derivatives get equal weight; zero rows are ignored.
Eigen::VectorXd newton_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& residual);

/// Length of the series of Newton steps that begins with these two: to a root of order m each is
/// 1 - 1/m times the one before. Infinite if they do not shrink, as towards no root.
double length_of_steps(double first, double second);

/// True if both have the same size and the same bits; 0 and -0 differ.
bool same_bits(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace tiltrim::dense
