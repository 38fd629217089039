/// Algebra of one-loop transfer functions: inverses, products, zeros. Internal to linearize/.
#pragma once

#include <complex>
#include <vector>

#include "linearize/margins.hpp"

namespace tiltrim::transfer {

using Complex = std::complex<double>;

/// Throws std::invalid_argument for sizes that do not fit and for what is not finite.
void check(const LoopTransfer& loop);
/// c (iωI - A)⁻¹ b
Complex proper(const LoopTransfer& g, double frequency);
/// 1/(1 + L) from L, and 1 + L from S - 1. Throws std::invalid_argument if 1 + d = 0.
LoopTransfer inverse_of_one_plus(LoopTransfer g);
/// States scaled so that A, b and c have similar size: the same transfer function.
LoopTransfer balanced(const LoopTransfer& g);

/// p + q G(s) + r G(-s) + t G(s) G(-s), with G(-s) = bᵀ (-sI - Aᵀ)⁻¹ cᵀ + d. Its real zeros on the
/// axis are eigenvalues of a Hamiltonian matrix.                                         [44, 45]
struct Terms {
  double p, q, r, t;
};
LoopTransfer combined(const LoopTransfer& g, const Terms& k);

/// Appends the zeros of G: eigenvalues of A - b c/d if d is not zero. If rounding leaves that in
/// doubt, the zeros for both cases. False if an eigenvalue iteration reached its limit.
bool collect_zeros(LoopTransfer g, std::vector<Complex>& found);

}  // namespace tiltrim::transfer
