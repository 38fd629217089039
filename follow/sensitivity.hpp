/// @file
/// Sensitivities of a trim and its modes to every parameter, including the shift of the trim.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// Status of sensitivities().
enum class SensitivityStatus {
  found,        ///< sensitivities of the trim and of its modes
  not_trim,     ///< the point is not a verified trim (or not of least cost, if a cost selects it)
  not_implied,  ///< for some parameter an implied rate would not remain zero
  singular,   ///< at a fold, where a limit becomes active, or along every parameter at a kink or an
              ///< end of the model: the trim is not differentiable
  no_linear,  ///< only trim sensitivities: not an equilibrium, or no linear model
};
std::string to_string(SensitivityStatus status);  ///< as in JSON

/// Derivatives with respect to one parameter; NaN where there is none, as at a kink of the model.
struct ParameterSensitivity {
  /// Derivatives of one mode with respect to a parameter; NaN where not differentiable.
  struct ModeSensitivity {
    std::complex<double> eigenvalue;  ///< dλ/dp
    double damping = 0.0;             ///< d(-Re λ/|λ|)/dp
    double frequency = 0.0;           ///< d|λ|/dp
    double error = 0.0;               ///< estimated error of dλ/dp
  };

  Signal parameter;                    ///< its name and unit
  double value = 0.0;                  ///< its value at the trim
  Eigen::VectorXd x, u, outputs;       ///< dx*/dp, du*/dp, dy*/dp
  std::vector<ModeSensitivity> modes;  ///< in the order of Sensitivities::modes
};

/// The result of sensitivities().
struct Sensitivities {
  SensitivityStatus status = SensitivityStatus::not_trim;  ///< whether they exist
  std::string message;       ///< why there are no sensitivities, or for which modes
  OperatingPoint point;      ///< the trim
  double rcond = 0.0;        ///< of the trim's equations in scaled unknowns
  Modes modes;               ///< at the trim
  std::vector<bool> simple;  ///< the mode is isolated and has derivatives
  std::vector<ParameterSensitivity> parameters;  ///< in the order requested

  /// True for sensitivities of the trim and its modes.
  explicit operator bool() const { return status == SensitivityStatus::found; }
  /// Positions of the parameters by their effect on mode `mode` for a change of one percent of the
  /// parameter's value, largest change of damping ratio first (of decay rate for a real mode).
  std::vector<std::size_t> ranked(std::size_t mode) const;
};

/// dz*/dp = -(∂G/∂z)⁻¹ ∂G/∂p at a verified trim of `spec` (implicit function theorem, exact
/// derivatives if the model has them), and dλ/dp = wᴴ (dA/dp) v with dA/dp including the shift of
/// the trim. `parameters`: states, inputs or parameters that are not free in the trim; empty: all
/// remaining parameters of the model. Throws std::invalid_argument on invalid
/// arguments.                                                            [4, thm. A.2; 26, sec. 2]
[[nodiscard]] Sensitivities sensitivities(const Model& model, const TrimSpec& spec,
                                          const OperatingPoint& trimmed,
                                          const std::vector<std::string>& parameters = {});

}  // namespace tiltrim
