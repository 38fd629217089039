/// Eigenvalues as points of the plane. Internal to sweep/.
#pragma once

#include <complex>
#include <limits>
#include <span>

namespace tiltrim {

using Complex = std::complex<double>;
using Spectrum = std::span<const Complex>;

inline constexpr double infinity = std::numeric_limits<double>::infinity();

constexpr double square(double x) { return x * x; }

/// |a - b|² without the care for overflow of std::abs, which costs more than the rest.
inline double distance2(Complex a, Complex b) {
  return square(a.real() - b.real()) + square(a.imag() - b.imag());
}

/// Of the real axis.
inline int side(Complex z) { return (z.imag() > 0) - (z.imag() < 0); }

/// The difference of two modes turned by more than 60° between a and b.
inline bool turned(Complex a, Complex b) {
  const double dot = a.real() * b.real() + a.imag() * b.imag();
  return !(dot > 0 && square(dot) > 0.25 * std::norm(a) * std::norm(b));
}

/// So many times nearer than to any other is an eigenvalue in its place.
inline constexpr double nearer = 3.0;

}  // namespace tiltrim
