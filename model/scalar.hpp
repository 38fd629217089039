/// The scalars the physics is evaluated on: numbers, numbers with derivatives, ranges.
/// Internal to model/.
#pragma once

#include <Eigen/Core>
#include <boost/numeric/interval.hpp>
#include <cmath>
#include <type_traits>
#include <unsupported/Eigen/AutoDiff>

#include "model/polar.hpp"

namespace tiltrim::physics {

/// A number with its derivatives along `dual_width` directions (forward mode).
inline constexpr int dual_width = 6;
template <class T>
using DualOf = Eigen::AutoDiffScalar<Eigen::Matrix<T, dual_width, 1>>;
using Dual = DualOf<double>;

/// A range of numbers. Not outward rounded: who concludes from it leaves a margin (trim/proof.cpp).
using Interval = boost::numeric::interval<
    double, boost::numeric::interval_lib::policies<
                boost::numeric::interval_lib::save_state_nothing<
                    boost::numeric::interval_lib::rounded_transc_exact<double>>,
                boost::numeric::interval_lib::checking_base<double>>>;

/// Sine and cosine of one angle.
template <class S>
struct Turn {
  S sin, cos;
};

inline Turn<double> turn(double angle) { return {std::sin(angle), std::cos(angle)}; }

inline Turn<Dual> turn(const Dual& angle) {
  const double s = std::sin(angle.value());
  const double c = std::cos(angle.value());
  return {Dual(s, c * angle.derivatives()), Dual(c, -s * angle.derivatives())};
}

inline Turn<Interval> turn(const Interval& angle) { return {sin(angle), cos(angle)}; }

template <class S>
struct CoefficientsOf {
  S CL, CD, CM;
};

inline CoefficientsOf<double> coefficients(const Polar& polar, double alpha) {
  const auto [CL, CD, CM] = polar.at(alpha);
  return {CL, CD, CM};
}

inline CoefficientsOf<Dual> coefficients(const Polar& polar, const Dual& alpha) {
  const auto [value, slope] = polar.slope_at(alpha.value());
  const auto& d = alpha.derivatives();
  return {Dual(value.CL, slope.CL * d), Dual(value.CD, slope.CD * d), Dual(value.CM, slope.CM * d)};
}

inline CoefficientsOf<Interval> coefficients(const Polar& polar, const Interval& alpha) {
  const auto [CL, CD, CM] = polar.range(alpha.lower(), alpha.upper());
  return {{CL.lower, CL.upper}, {CD.lower, CD.upper}, {CM.lower, CM.upper}};
}

}  // namespace tiltrim::physics
