/// The roots of the linearized loop right of a line, and those of less damping. Internal to
/// check_proof/.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "check_proof/cubic.hpp"
#include "check_proof/equations.hpp"

namespace tiltrim::checking {

using Matrix3 = std::array<std::array<Form, 3>, 3>;

/// det(s I - A) = det(s² I - s M1 - M0): with x1 - V_err/g and x2 - V_err/g as states, only the
/// rates of V_err, gamma_err and q are more than a state or the two errors
///   (x1 - V_err/g)' = k_V/g V_err + gamma_err,  (x2 - V_err/g)' = k_V/g V_err - gamma_err,  θ' = q
struct Pencil {
  Matrix3 M1, M0;
  std::size_t n = 0;  ///< numbers of the box
};
Pencil pencil(const Numbers& a, const Loop<Dual>& loop);

/// An interval of frequencies and the half-plane in which v det is positive.
struct Half {
  double from, to, re, im;
};

/// s = from + w along for w ≥ 0, |s| ≥ w.
struct Ray {
  Complex from, along;
};
/// s = i w - sigma
Ray line_at(const Ball& sigma);
/// s = w exp(i (pi/2 + phi)), sin(phi) = damping: on and left of it and its conjugate a root has at
/// least that damping ratio.
Ray ray_of(const Ball& damping);

/// Empty if no s of the ray is a root of any member; else where that fails. The intervals of w
/// begin at 0 and are connected.
std::optional<std::string> excluded(const Pencil& p, const Ray& ray,
                                    const std::vector<Half>& intervals);

/// Roots right of -sigma of a member of the pencil; empty if undecided by rounding.
std::optional<int> roots_right(const Pencil& p, const Ball& sigma);

/// Whether a member of the pencil has a root right of the ray of this damping ratio and its
/// conjugate; empty if undecided by rounding.
std::optional<bool> less_damped(const Pencil& p, const Ball& damping);

/// det(s² I - s M1 - M0) at a member, coefficients of s⁰ to s⁶.
std::array<Ball, 7> characteristic(const Pencil& p);

}  // namespace tiltrim::checking
