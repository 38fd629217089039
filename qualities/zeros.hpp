/// @file
/// Zeros, gain and poles of a transfer function, with error bounds.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "linearize/linearize.hpp"

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

/// Status of the zeros of a transfer function.
enum class ZerosStatus {
  found,             ///< every zero is enclosed in a disk of its own
  not_enclosed,      ///< some zeros are multiple or ill conditioned: their errors are infinite,
                     ///< and where the QZ iteration fails they are NaN
  degree_undecided,  ///< a Markov parameter may be zero: the number of finite zeros is not known
  no_response,       ///< the input has no effect on the output
};
std::string to_string(ZerosStatus status);  ///< as in JSON

/// A root with the radius of a disk that contains a true one.
struct EnclosedRoot {
  std::complex<double> value;  ///< 1/s
  double error = 0.0;          ///< infinite: not enclosed
};

/// G(s) = gain Π(s - zero)/Π(s - pole).
struct ZerosAndPoles {
  ZerosStatus status = ZerosStatus::no_response;  ///< of the zeros
  std::vector<EnclosedRoot> zeros;                ///< finite, by ascending real part
  std::vector<EnclosedRoot> poles;                ///< by ascending real part
  int relative_degree = 0;  ///< poles less finite zeros: the number of infinite zeros
  double gain = 0.0;        ///< the first Markov parameter that is not zero
  double gain_error = 0.0;  ///< its bound
  int cancelled = 0;        ///< states without a path from the input or to the output: left out
};

/// Finite zeros of the Rosenbrock pencil [A - sI, b; c, d] by QZ, each improved by Newton's method
/// and enclosed by Krawczyk's test for all matrices within the error bounds. States that the input
/// cannot reach or the output cannot see, by exact zeros, are left out. The number of finite zeros
/// is proved by the first Markov parameter d, cb, cAb, ... that cannot be zero. Throws
/// std::invalid_argument if sizes do not match or a value is not finite.
[[nodiscard]] ZerosAndPoles zeros_and_poles(const TransferFunction& transfer);

}  // namespace tiltrim
