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
  const auto [CL, CD, CM] = polar.range(alpha.lower(), alpha.upper());
  return {{CL.lower, CL.upper}, {CD.lower, CD.upper}, {CM.lower, CM.upper}};
}

}  // namespace tiltrim::physics
