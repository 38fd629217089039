/// @file
/// Modes of a linear model: eigenvalues with bounds, names and a verdict.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include "linearize/linearize.hpp"

namespace tiltrim {

/// One eigenvalue λ of A and what is known of it. A complex pair is two modes.
struct Mode {
  std::complex<double> eigenvalue;  ///< 1/s
  double condition = 0.0;         ///< 1/|wᴴv| in the balanced coordinates; infinite if defective
  double error = 0.0;             ///< a bound: a true eigenvalue lies within it (see modes())
  double backward_error = 0.0;    ///< ‖Av - λv‖₁/(n ‖A‖₁ ε ‖v‖₁) on A as given
  Eigen::VectorXcd right;         ///< A v = λ v, of length one, its largest component positive
  Eigen::VectorXcd left;          ///< wᴴ A = λ wᴴ, wᴴ v = 1; zero if defective
  Eigen::VectorXd participation;  ///< share of each state, |vₖ wₖ|, summing to one; else zero
  std::string name;               ///< one of the model's where participation supports it
  bool determined = true;         ///< false: condition > 1e8, the value is not determined

  double frequency() const { return std::abs(eigenvalue); }  ///< rad/s
  double damping() const;       ///< -Re λ/|λ|, 1 at rest on the negative axis; 0 for λ = 0
  double time_to_half() const;  ///< s, ln 2/|Re λ|; infinite on the axis. To double if unstable
};

/// Where the eigenvalues are.
enum class Verdict {
  stable,     ///< every eigenvalue is left of the axis by more than its bound
  unstable,   ///< some eigenvalue is right of the axis by more than its bound
  undecided,  ///< the axis lies within the bounds
};
std::string to_string(Verdict verdict);  ///< as JSON spells it

/// All modes of a matrix.
struct Modes {
  std::vector<Mode> modes;               ///< by rising real part, then rising imaginary part
  Verdict verdict = Verdict::undecided;  ///< with the modes' error bounds
  double spectral_abscissa = 0.0;        ///< largest real part; -inf for no modes
  bool converged = true;  ///< false: the QR iteration met its cap; no modes, undecided
};

/// How modes() goes about it.
struct ModesOptions {
  int max_iterations = 40;  ///< QR steps for each eigenvalue
  ModeNames mode_names{};   ///< null: modes are called by the states that carry them
};

/// Eigenvalues of `A` (balanced, then shifted QR), with error bounds that include rounding and
/// `A_error` (entry by entry; empty: none). Where exact zeros make A block triangular each block is
/// bounded alone: positions that nothing depends on are zero to the last bit. The discs |z - λᵢ| <=
/// errorᵢ together contain all eigenvalues of every matrix within A_error of A. Throws
/// std::invalid_argument if A is not square, not finite, or A_error does not fit. Empty A gives no
/// modes and is stable.
[[nodiscard]] Modes modes(const Eigen::MatrixXd& A, const Eigen::MatrixXd& A_error = {},
                          const std::vector<std::string>& state_names = {},
                          const ModesOptions& options = {});

/// Eigenvalues of a finite square matrix alone (balanced, then shifted QR), by rising real part,
/// then rising imaginary part; empty if the iteration met its cap. For scanning many matrices:
/// what is reported should come from modes().
[[nodiscard]] Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A,
                                           const ModesOptions& options = {});

/// Modes of a linear model, named by its states. Throws std::invalid_argument if there is none.
[[nodiscard]] Modes modes(const LinearModel& linear);

/// A name for a mode from its states' shares: the first of `known` whose states hold most of the
/// share, else the dominant states joined by +.
std::string mode_name(std::complex<double> eigenvalue, const Eigen::VectorXd& participation,
                      const std::vector<std::string>& state_names, const ModeNames& known = {});

}  // namespace tiltrim
