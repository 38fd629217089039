/// The transfer function of one input and one output, with error bounds. Internal to qualities/.
#pragma once

#include <Eigen/Core>
#include <string>

#include "qualities/qualities.hpp"

namespace tiltrim {

/// G(s) = c (sI - A)⁻¹ b + d from one input to one output, and error bounds of its entries (empty:
/// exact). A is n x n [1/s], b and c have n entries.
struct TransferFunction {
  Eigen::MatrixXd A;             ///< 1/s
  Eigen::VectorXd b;             ///< from the input
  Eigen::RowVectorXd c;          ///< to the output
  double d = 0.0;                ///< feedthrough
  Eigen::MatrixXd A_error{};     ///< of each entry of A
  Eigen::VectorXd b_error{};     ///< of each entry of b
  Eigen::RowVectorXd c_error{};  ///< of each entry of c
  double d_error = 0.0;          ///< of d
};

/// The transfer function from an input of a linear model to a state or an output. Throws
/// std::invalid_argument for an unknown name or without a linear model.
[[nodiscard]] TransferFunction transfer_function(const LinearModel& linear,
                                                 const std::string& input,
                                                 const std::string& output);

/// zeros_and_poles() of a transfer function. Throws std::invalid_argument if sizes do not match or
/// a value is not finite.
[[nodiscard]] ZerosAndPoles zeros_and_poles(const TransferFunction& transfer);

}  // namespace tiltrim
