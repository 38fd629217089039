/// The polar's coefficients for every scalar of the physics.
/// Internal to vehicles/tiltrotor/.
#pragma once

#include "model/scalar.hpp"
#include "vehicles/tiltrotor/polar.hpp"

namespace tiltrim::physics {

template <class S>
struct CoefficientsOf {
  S CL, CD, CM;
};

inline CoefficientsOf<double> coefficients(const Polar& polar, double alpha) {
  const auto [CL, CD, CM] = polar.at(alpha);
  return {CL, CD, CM};
}

inline CoefficientsOf<Dual> coefficients(const Polar& polar, const Dual& alpha) {
  const auto [value, slope] = polar.slope_at(alpha.value);
  return {{value.CL, slope.CL * alpha.slopes},
          {value.CD, slope.CD * alpha.slopes},
          {value.CM, slope.CM * alpha.slopes}};
}

inline CoefficientsOf<Interval> coefficients(const Polar& polar, const Interval& alpha) {
  const auto [CL, CD, CM] = polar.ranges(alpha);
  return {CL.value, CD.value, CM.value};
}

inline CoefficientsOf<Jet> coefficients(const Polar& polar, const Jet& alpha) {
  const auto over = polar.ranges(alpha.range());
  const auto centre = polar.ranges(alpha.value().centre());
  // The third derivative jumps at a knot: it bounds the slopes of the second.
  const auto of = [&](std::size_t k) {
    const Polar::Ranges& c = centre[k];
    const Jet::Derivatives here{c.value, c.slope, c.curvature, Interval(), Interval()};
    const Jet::Derivatives around{Interval(), Interval(), Interval(), over[k].third, Interval()};
    return along(alpha, composed(alpha, here, around, 0),
                 composed(alpha, c.slope, c.curvature, over[k].third));
  };
  return {of(0), of(1), of(2)};
}

}  // namespace tiltrim::physics
