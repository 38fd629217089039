/// The vehicle's parameters by position: one table of names, units, nominal sizes and members.
/// Internal to vehicles/tiltrotor/.
#pragma once

#include <array>
#include <utility>

#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim::physics {

/// Accepted magnitudes: beyond any aircraft, yet far from overflow.
inline constexpr double least = 1e-6, most = 1e6;
inline constexpr AcceptedNumber any{-most, most}, positive{least, most}, not_negative{0, most};

template <class Struct, class S>
struct Field {
  const char* name;
  const char* unit;
  double nominal;
  S Struct::*member;
  AcceptedNumber accepted = any;
};

template <class S>
constexpr auto aircraft_fields() {
  using A = AircraftOf<S>;
  return std::to_array<Field<A, S>>({
      {"mass", "kg", 1.0, &A::mass, positive},
      {"inertia_yy", "kg m²", 1.0, &A::inertia_yy, positive},
      {"chord", "m", 0.1, &A::chord, positive},
      {"wing_area", "m²", 0.1, &A::wing_area, positive},
      {"air_density", "kg/m³", 0.1, &A::air_density, positive},
      {"gravity", "m/s²", 1.0, &A::gravity, positive},
      {"rotor_x", "m", 0.01, &A::rotor_x},
      {"rotor_z", "m", 0.01, &A::rotor_z},
      {"thrust_excess", "", 0.1, &A::thrust_excess, positive},
      {"rotor_speed_rpm", "rev/min", 1000.0, &A::rotor_speed_rpm, positive},
      {"rotor_radius", "m", 0.1, &A::rotor_radius, positive},
      {"blade_count", "", 1.0, &A::blade_count, positive},
      {"blade_chord", "m", 0.01, &A::blade_chord, positive},
      {"blade_lift_slope", "1/rad", 1.0, &A::blade_lift_slope, positive},
      {"pitch_scale", "rad", 0.1, &A::pitch_scale, not_negative},
      {"wake_immersion", "", 0.1, &A::wake_immersion, not_negative},
      {"CL_q", "", 1.0, &A::CL_q},
      {"CL_de", "1/rad", 0.1, &A::CL_de},
      {"CM_q", "", 1.0, &A::CM_q},
      {"CM_de", "1/rad", 0.1, &A::CM_de},
      {"cyclic_off", "rad", 0.1, &A::cyclic_off, {-180, 180, true}},
      {"cyclic_blend", "rad", 0.1, &A::cyclic_blend, {0, 180, true}},
  });
}

template <class S>
constexpr auto gain_fields() {
  using G = GainsOf<S>;
  return std::to_array<Field<G, S>>({
      {"k_V", "1/s", 1.0, &G::k_V},
      {"K_Ep", "", 1.0, &G::K_Ep},
      {"K_Ei", "1/s", 0.1, &G::K_Ei},
      {"K_Lp", "", 0.1, &G::K_Lp},
      {"K_Li", "1/s", 0.1, &G::K_Li},
      {"k_pa", "", 1.0, &G::k_pa},
      {"k_da", "s", 0.1, &G::k_da},
      {"k_pe", "", 1.0, &G::k_pe},
      {"k_de", "s", 1.0, &G::k_de},
  });
}

template <class S>
constexpr auto command_fields() {
  using C = CommandOf<S>;
  return std::to_array<Field<C, S>>({
      {"V", "m/s", 1.0, &C::V},
      {"gamma", "rad", 0.1, &C::gamma},
      {"eta", "rad", 0.1, &C::eta},
  });
}

template <class Struct, auto fields, class S, std::size_t... i>
Struct unpack(const S* p, std::index_sequence<i...>) {
  static constexpr auto table = fields();
  Struct filled;
  ((filled.*(table[i].member) = p[i]), ...);
  return filled;
}

/// Fills a struct from consecutive parameters. `fields` is a compile-time table: no look-up.
template <class Struct, auto fields, class S>
Struct unpack(const S* p) {
  return unpack<Struct, fields>(p, std::make_index_sequence<fields().size()>());
}

}  // namespace tiltrim::physics
