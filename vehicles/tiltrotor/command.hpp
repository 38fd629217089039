/// The corridor and scheduled gains on any scalar. Internal to vehicles/tiltrotor/ and flight/.
#pragma once

#include <algorithm>
#include <numbers>

#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/parameters.hpp"

namespace tiltrim::physics {

/// Corridor (16) at height h [m].
template <class S>
CommandOf<S> corridor_at(const S& h) {
  using std::clamp;
  constexpr double climb_speed = 2.0, cruise_speed = 15.0;  // m/s
  const S at = clamp(h, S(0.0), S(corridor_top));
  const S angle = std::numbers::pi * (at * at * at / 1728000.0 - at * at / 9600.0 + 0.5);  // (16)
  const S t = clamp(S((h - corridor_rises) / (corridor_top - corridor_rises)), S(0.0), S(1.0));
  const S V = climb_speed + (cruise_speed - climb_speed) * (3.0 * t * t - 2.0 * t * t * t);
  return {V, angle, angle};
}

/// Gains linear between their values, constant beyond.
template <class S>
GainsOf<S> scheduled(const GainSchedule& schedule, const S& eta) {
  const std::vector<double>& at = schedule.eta;
  std::size_t k = 1;
  while (k + 1 < at.size() && eta >= at[k]) ++k;
  using std::clamp;
  const S here = clamp(eta, S(at.front()), S(at.back()));
  const S share = (here - at[k - 1]) / (at[k] - at[k - 1]);
  GainsOf<S> gains;
  constexpr auto fields = gain_fields<double>();
  constexpr auto own = gain_fields<S>();
  for (std::size_t j = 0; j < fields.size(); ++j) {
    const double lower = schedule.gains[k - 1].*(fields[j].member);
    const double upper = schedule.gains[k].*(fields[j].member);
    gains.*(own[j].member) = (1.0 - share) * lower + share * upper;
  }
  return gains;
}

}  // namespace tiltrim::physics
