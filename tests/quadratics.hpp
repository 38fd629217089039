/// What a Quadratic of two numbers of a box stands for.
#pragma once

#include "model/jet.hpp"

/// Without its rest, at d and e in [-1, 1].
inline long double value_at(const tiltrim::Quadratic& q, long double d, long double e) {
  return q.centre() + q.slope(0) * d + q.slope(1) * e + q.bend(0, 0) * d * d +
         q.bend(1, 0) * d * e + q.bend(1, 1) * e * e;
}

/// Whether it contains this exact value there, and so does its range; up to rounding of both.
inline bool contains(const tiltrim::Quadratic& q, long double d, long double e, long double exact) {
  const long double rounding = 1e-17L * (1 + std::abs(exact));
  return std::abs(exact - value_at(q, d, e)) <= q.rest() + rounding &&
         q.range().lower() <= exact + rounding && exact - rounding <= q.range().upper();
}
