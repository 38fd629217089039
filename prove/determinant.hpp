/// det(I - F), zero nowhere while no member of a family has a root. Internal to prove/.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <limits>
#include <vector>

#include "dense/dense.hpp"

namespace tiltrim::proving {

using Complex = std::complex<double>;
using Small = dense::SmallMatrix;  // at most 16 rows, without allocation

inline constexpr double unit = std::numeric_limits<double>::epsilon() / 2;

/// B(d) = B_0 + Σ d_k A_k + Σ d_k d_l A_kl + R with R within `radius`, and W B T, W T for a basis
/// T.
struct Family {
  Small B;
  std::vector<Small> A, bends;  // bends: A_kl, row by row of the lower triangle
  Small radius;
  Small T, W;
  Small E0, P;                   // middles of W B_0 T and W T
  std::vector<Small> E, curved;  // of W A_k T, W A_kl T
  Small spread;                  // radius of all of W B T, without R's
  Small bend_moduli;             // Σ |W A_kl T|
  Small R;                       // |W| radius |T|
  double P_radius = 0;
  Complex along{0, 1};  // s = w along; i: the axis
};

/// I - F = (s W T - W B(d) T) H(w), s = w along, on an interval of w.
struct Value {
  std::vector<Complex> linear;                  // of each parameter, and of the frequency
  std::vector<std::vector<Complex>> quadratic;  // lower triangle
  double rest = 0;
  double total = 0;
  std::vector<double> share;  // of each parameter
  Small weight;               // of R
  double floor(Complex v) const;
};
Value value_at(const Family& family, double from, double to);

struct Direction {
  double floor;
  Complex v;
};
/// A direction v in which v det(I - F) is far right of the imaginary axis, and how far at least.
Direction best(const Value& value);

}  // namespace tiltrim::proving
