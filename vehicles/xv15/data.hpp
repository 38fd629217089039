/// The published numbers of the XV-15 (data/xv15/), in SI units; angles in tables are in degrees.
/// Internal to vehicles/xv15/.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "vehicles/xv15/table.hpp"
#include "vehicles/xv15/xv15.hpp"

namespace tiltrim::xv15 {

/// A point of the airframe: station (grows aft) and waterline (grows up), m.
struct Point {
  double station, waterline;
};

struct Data {
  Variant variant = Variant::report_1988;
  std::size_t number = 0;            ///< of this set of data in the process, from 1
  std::map<std::string, double> si;  ///< parameters.json: recommended values
  // Weights and positions
  double mass, inertia, inertia_slope, pylon_share;
  Point cg, pylon_cg, pivot, fuselage, wing, tail, fin;
  double mast_length;
  // Areas and factors
  double wing_area, wing_chord, tail_area, fin_area, fin_drag, spinner_axial, spinner_cross;
  double K_XRW, X_RW0, X_RW1, X_RW2;
  double immersed_area, immersed_until, wake_factor;
  double pressure_factor, extra_drag, tau_e, D_Ke;
  // Rotor
  double radius, chord, solidity, flap_inertia, delta3, induced_factor, download;
  int blades;
  std::vector<Element> elements, few_elements;  ///< few: for start values
  std::array<Pair, 4> airfoils;                 ///< cl and cd over Mach and alpha
  // Controls
  double stick_neutral, elevator_per_stick;  ///< in; rad/in
  // Tables
  Table fuselage_lift, fuselage_drag, fuselage_moment;
  Table wing_cl, wing_cd, wing_cm, downwash;
  Table interference, tail_cl, tail_cl_mach, tail_cd, tail_pressure, tail_wake, elevator_mach;
  Table cyclic;
};

/// "report_1988", "printed_1983"
const std::vector<std::string>& variant_names();

Data read_data(const std::filesystem::path& folder, Variant variant);

}  // namespace tiltrim::xv15
