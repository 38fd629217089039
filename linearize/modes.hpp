/// @file
/// Modes of a linear model: eigenvalues with error bounds, names and a stability verdict.
#pragma once

#include <complex>
#include <memory>
#include <string>
#include <vector>

#include "linearize/linearize.hpp"

namespace tiltrim {

/// One eigenvalue λ of A with its properties. A complex pair is two modes.
struct Mode {
  std::complex<double> eigenvalue;  ///< 1/s
  double condition = 0.0;       ///< 1/|wᴴv| in the balanced coordinates; infinite if defective
  double error = 0.0;           ///< bound: a true eigenvalue lies within it (see modes())
  double backward_error = 0.0;  ///< ‖Av - λv‖₁/(n ‖A‖₁ ε ‖v‖₁) for A as given
  Eigen::VectorXcd right;       ///< A v = λ v, of unit length, its largest component positive
  Eigen::VectorXcd left;        ///< wᴴ A = λ wᴴ, wᴴ v = 1; zero if defective
  Eigen::VectorXd participation;  ///< of each state, |vₖ wₖ|, normalized to sum one; otherwise zero
  std::string name;               ///< a name of the model if participation supports it
  bool determined = true;         ///< false: condition > 1e8, the value is unreliable

  double frequency() const { return std::abs(eigenvalue); }  ///< rad/s
  /// -Re λ/|λ|: 1 on the negative real axis; 0 for λ = 0; NaN if 0 lies within the error of λ ≠ 0.
  double damping() const;
  /// ln 2/|Re λ|, s; to double if unstable; infinite on the axis; NaN if the axis lies within the
  /// error of a λ beside it.
  double time_to_half() const;
};

/// Stability of a matrix.
enum class Verdict {
  stable,     ///< every eigenvalue is left of the axis by more than its error bound
  unstable,   ///< some eigenvalue is right of the axis by more than its error bound
  undecided,  ///< the axis lies within the error bounds
};
std::string to_string(Verdict verdict);  ///< as in JSON

/// All modes of a matrix.
struct Modes {
  std::vector<Mode> modes;               ///< by ascending real part, then ascending imaginary part
  Verdict verdict = Verdict::undecided;  ///< based on the modes' error bounds
  double spectral_abscissa = 0.0;        ///< largest real part; -inf if there are no modes
  bool converged = true;  ///< false: the QR iteration reached its limit; no modes, undecided
};

/// Eigenvalues of `A` (balanced, then shifted QR), with error bounds that include rounding and
/// `A_error` (for each entry; empty: zero). If exact zeros make A block triangular, each block is
/// bounded separately: positions that no rate depends on give exact zeros. The disks |z - λᵢ| <=
/// errorᵢ together contain all eigenvalues of every matrix within A_error of A. Modes are named
/// with `mode_names` (as Model::mode_names), otherwise after their dominant states. Throws
/// std::invalid_argument if A is not square or not finite, or A_error does not match. An empty A
/// has no modes and is stable.
[[nodiscard]] Modes modes(const Eigen::MatrixXd& A, const Eigen::MatrixXd& A_error = {},
                          const std::vector<std::string>& state_names = {},
                          const std::shared_ptr<const std::vector<ModeName>>& mode_names = {});

/// Modes of a linear model, named after its states. Throws std::invalid_argument without a model.
[[nodiscard]] Modes modes(const LinearModel& linear);

}  // namespace tiltrim
