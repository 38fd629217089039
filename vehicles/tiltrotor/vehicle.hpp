/// @file
/// The tiltrotor's parameters, and the models built from them.
#pragma once

#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "vehicles/tiltrotor/polar.hpp"

namespace tiltrim {

/// The airframe's parameters; defaults are the reference aircraft (sources: docs/model.md).
/// Templated on its scalar for internal use; use Aircraft.
template <class S>
struct AircraftOf {
  S mass = 4.0;                         ///< kg
  S inertia_yy = 6.076;                 ///< kg m²
  S chord = 0.36;                       ///< m
  S wing_area = 0.85;                   ///< m²
  S air_density = 0.9667;               ///< kg/m³
  S gravity = 9.81;                     ///< m/s²
  S rotor_x = 0.01;                     ///< m, nacelle pivot ahead of the center of gravity
  S rotor_z = 0.08;                     ///< m, nacelle pivot to hub
  S thrust_excess = 1.4;                ///< Ep, full thrust over weight
  S rotor_speed_rpm = 5400.0;           ///< rev/min
  S rotor_radius = 0.25;                ///< m
  S blade_count = 6.0;                  ///< b in (3)
  S blade_chord = 0.05;                 ///< m
  S blade_lift_slope = 5.7;             ///< 1/rad
  S pitch_scale = 0.12;                 ///< rad of blade pitch per unit of theta0
  S wake_immersion = 0.05;              ///< fraction of the induced velocity that acts on the wing
  S CL_q = 2.3;                         ///< per q chord/(2 W)
  S CL_de = 0.23;                       ///< 1/rad
  S CM_q = -7.0;                        ///< per q chord/(2 W)
  S CM_de = -0.64;                      ///< 1/rad
  S cyclic_off = std::numbers::pi / 3;  ///< rad, tilt of the handover from cyclic to elevator
  S cyclic_blend = 0.0;                 ///< rad, width of the handover; 0: a switch
};
using Aircraft = AircraftOf<double>;  ///< the airframe's parameters

/// Gains of the total-energy control law (8)-(13); defaults are the reference gains.
template <class S>
struct GainsOf {
  S k_V = 10.0;    ///< 1/s, speed error to commanded acceleration
  S K_Ep = 8.0;    ///< energy rate error to theta0
  S K_Ei = 1.25;   ///< energy rate error integral to theta0, 1/s
  S K_Lp = 0.75;   ///< distribution rate error to a1s and delta_e
  S K_Li = 0.085;  ///< distribution rate error integral, 1/s
  S k_pa = 6.3;    ///< pitch to a1s
  S k_da = 0.03;   ///< pitch rate to a1s, s
  S k_pe = 0.03;   ///< pitch to delta_e
  S k_de = 3.9;    ///< pitch rate to delta_e, s
};
using Gains = GainsOf<double>;  ///< of the control law

/// A commanded flight condition of the closed loop.
template <class S>
struct CommandOf {
  S V = 15.0;     ///< m/s, airspeed
  S gamma = 0.0;  ///< rad, flight-path angle
  S eta = 0.0;    ///< rad, nacelle tilt: π/2 helicopter, 0 airplane
};
using Command = CommandOf<double>;  ///< a flight condition

/// Actuator and attitude limits.
struct Limits {
  Range theta0{0.0, 1.0};      ///< collective, fraction of full thrust
  Range a1s{-0.35, 0.35};      ///< rad, cyclic
  Range delta_e{-0.53, 0.53};  ///< rad, elevator
  Range theta{-1.3, 1.3};      ///< rad, attitude
};

/// The consistent equations (docs/theory.md), or those printed in the paper, only for studying the
/// paper. The printed forms hold only in wind axes.
enum class Equations { consistent, printed };

/// Wind axes (V, gamma, theta, q) divide by V; body axes (u, w, theta, q) are valid at any speed.
enum class Axes { wind, body };

/// All data of a tiltrotor's models.
struct Vehicle {
  Aircraft aircraft;                            ///< airframe
  Gains gains;                                  ///< control law
  Limits limits;                                ///< of actuators and attitude
  Equations equations = Equations::consistent;  ///< or as printed
  std::shared_ptr<const Polar> polar;           ///< must be set
};

/// The airframe (2) or (1): states V, gamma, theta, q (wind) or u, w, theta, q (body); inputs
/// theta0, a1s, delta_e, eta; parameters "aircraft.*"; outputs airspeed, flight_path, alpha,
/// thrust. The parameters' values are in the guess of airframe_problem() (formulations.hpp).
Model airframe(const Vehicle& vehicle, Axes axes = Axes::wind);

/// The closed loop (14): states V_err, gamma_err, theta, q, energy_integral,
/// distribution_integral (wind), or u, w in place of the first two (body); no inputs; parameters
/// V, gamma, eta (the command), "aircraft.*" and "gains.*"; outputs theta0, a1s, delta_e, airspeed,
/// flight_path, alpha. At rest, in body axes, the path angle is taken to be the commanded one.
/// The parameters' values are in the guess of closed_loop_problem() (formulations.hpp).
Model closed_loop(const Vehicle& vehicle, Axes axes = Axes::wind);

/// The same with three inputs, theta0_added, a1s_added and delta_e_added, added to the actuator
/// commands after the control law. The outputs are the law's commands before the addition, where
/// a loop is broken for its margins (linearize/margins.hpp).
Model closed_loop_with_inputs(const Vehicle& vehicle, Axes axes = Axes::wind);

/// The same with two more inputs, V_added and gamma_added, added to the commands, whose steps they
/// are. V_err and gamma_err remain errors from the commands without the additions.
Model closed_loop_with_commands(const Vehicle& vehicle, Axes axes = Axes::wind);

}  // namespace tiltrim
