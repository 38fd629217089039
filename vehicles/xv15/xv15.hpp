/// @file
/// The XV-15: nonlinear longitudinal motion from published data (data/xv15/README.md).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace tiltrim::xv15 {

/// Where the sources contradict each other.
enum class Variant {
  report_1988,   ///< the tables of CR-166536 Rev. A
  printed_1983,  ///< what the printed runs of CR-166537 imply
};

struct Data;

/// Reads the folder data/xv15. Throws std::runtime_error, naming the file.
[[nodiscard]] std::shared_ptr<const Data> load(const std::filesystem::path& folder,
                                               Variant variant);

/// States u, w [m/s], theta [rad], q [rad/s] in body axes; inputs collective (pitch at 0.75 R),
/// flap and mast_angle [rad; 0 helicopter, 90 degrees airplane] and stick [in, 0 to 9.6, forward].
/// Outside the tables f throws std::domain_error, which names the table; the rotors' outputs are
/// NaN where inflow and flapping have no balance.
[[nodiscard]] Model model(const std::shared_ptr<const Data>& data);
/// Default values of its parameters. `inflow_gradient`: 1 lets the induced velocity grow aft with
/// the wake's skew (Pitt and Peters), 0 is uniform inflow. `airspeed_kt` and `climb_angle` are
/// commands: the outputs forward_error and climb_error are the deviations from them.
[[nodiscard]] Eigen::VectorXd parameters(const Data& data);

/// The total-energy control law around model(): collective and stick follow from the errors of
/// airspeed and climb, their integrals, pitch and pitch rate, with gains that are linear between
/// helicopter and airplane mode. Inputs are flap, mast_angle, and collective_added and stick_added,
/// added to the law's commands, the outputs collective_command and stick_command.
[[nodiscard]] Model closed_loop(const std::shared_ptr<const Data>& data);
/// Default values of its parameters: those of parameters(), then the gains.
[[nodiscard]] Eigen::VectorXd closed_loop_parameters(const Data& data);

/// Where a trim begins.
struct Start {
  double theta;       ///< rad
  double collective;  ///< rad
  double stick;       ///< in
};
/// From the airframe's tables and the rotor's closed form, without blade elements. `at`: inputs and
/// parameters; its collective and stick are not used.
[[nodiscard]] Start start_of(const Data& data, const OperatingPoint& at, double airspeed,
                             double climb_angle);

}  // namespace tiltrim::xv15
