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
  const double c = alpha.value().centre();
  const auto values = polar.fits(alpha.range(), c, false);
  const auto slopes = polar.fits(alpha.range(), c, true);
  const auto form = [&](const Polar::Fit& fit) {
    return composed(alpha, fit.g, fit.g1, fit.g2).widened(fit.error);
  };
  return {along(alpha, form(values[0]), form(slopes[0])),
          along(alpha, form(values[1]), form(slopes[1])),
          along(alpha, form(values[2]), form(slopes[2]))};
}

}  // namespace tiltrim::physics
