/// Eigenvalues as points of the complex plane. Internal to sweep/.
#pragma once

#include <complex>
#include <limits>
#include <span>

namespace tiltrim {

using Complex = std::complex<double>;
using Spectrum = std::span<const Complex>;

inline constexpr double infinity = std::numeric_limits<double>::infinity();

constexpr double square(double x) { return x * x; }

/// |a - b|² without std::abs's protection against overflow, which would dominate the cost.
inline double distance2(Complex a, Complex b) {
  return square(a.real() - b.real()) + square(a.imag() - b.imag());
}

/// Side of the real axis.
inline int side(Complex z) { return (z.imag() > 0) - (z.imag() < 0); }

/// True if the difference of two modes has rotated by more than 60° between a and b.
inline bool turned(Complex a, Complex b) {
  const double dot = a.real() * b.real() + a.imag() * b.imag();
  return !(dot > 0 && square(dot) > 0.25 * std::norm(a) * std::norm(b));
}

/// An eigenvalue is linked if it is this many times nearer than any other.
inline constexpr double nearer = 3.0;

}  // namespace tiltrim
