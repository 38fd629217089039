/// @file
/// Sensitivities: how a trim and its modes move with every parameter, the trim's shift included.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// Whether there are sensitivities.
enum class SensitivityStatus {
  found,        ///< of the trim and of its modes
  not_trim,     ///< the point is no verified trim (of least effort, where an effort decides)
  not_implied,  ///< along a parameter a rate that should follow from the equations would not vanish
  singular,     ///< at a fold, or where a limit takes hold: the trim has no derivative
  no_linear,    ///< trim sensitivities only: the point is no equilibrium, or has no linear model
};
std::string to_string(SensitivityStatus status);  ///< as JSON spells it

/// How one mode moves per unit of a parameter; NaN where it has no derivative.
struct ModeSensitivity {
  std::complex<double> eigenvalue;  ///< dλ/dp
  double damping = 0.0;             ///< d(-Re λ/|λ|)/dp
  double frequency = 0.0;           ///< d|λ|/dp
  double error = 0.0;               ///< estimated, of dλ/dp
};

/// Derivatives along one parameter, everything per unit of it.
struct ParameterSensitivity {
  Signal parameter;                    ///< which
  double value = 0.0;                  ///< at the trim
  Eigen::VectorXd x, u, outputs;       ///< dx*/dp, du*/dp, dy*/dp
  std::vector<ModeSensitivity> modes;  ///< in the order of Sensitivities::modes
};

/// What sensitivities() answers.
struct Sensitivities {
  SensitivityStatus status = SensitivityStatus::not_trim;  ///< whether there are some
  std::string message;       ///< why there are none, or of which modes
  OperatingPoint point;      ///< the trim
  double rcond = 0.0;        ///< of the equations that the trim solves, in scaled unknowns
  Modes modes;               ///< at it
  std::vector<bool> simple;  ///< the mode is isolated: it has derivatives
  std::vector<ParameterSensitivity> parameters;  ///< in the order asked

  /// Of the trim and its modes.
  explicit operator bool() const { return status == SensitivityStatus::found; }
};

/// dz*/dp = -(∂G/∂z)⁻¹ ∂G/∂p at a verified trim of `spec` (implicit function theorem, the model's
/// exact derivatives where it has them), and dλ/dp = wᴴ (dA/dp) v with dA/dp taken along the
/// trim's own shift. `parameters`: states, inputs or parameters that the trim does not move; empty:
/// all of the model's parameters that are left. Throws std::invalid_argument on the caller's
/// mistakes.                                                             [4, thm. A.2; 26, sec. 2]
[[nodiscard]] Sensitivities sensitivities(const Model& model, const TrimSpec& spec,
                                          const OperatingPoint& trimmed,
                                          const std::vector<std::string>& parameters = {});

/// What would move mode `mode` most for a change of one percent of each parameter's value: the
/// parameters' positions, largest change of damping ratio first (of decay rate, for a real mode).
std::vector<std::size_t> ranked(const Sensitivities& sensitivities, std::size_t mode);

}  // namespace tiltrim
