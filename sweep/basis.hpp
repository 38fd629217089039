/// Eigenvalues with eigenvectors, and the assignment of one matrix's modes to those of the next.
/// Of at most dense::small_size modes, without allocation. Internal to sweep/.
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>

#include "dense/dense.hpp"
#include "sweep/spectrum.hpp"

namespace tiltrim {

/// At most one entry per mode.
template <class T>
using PerMode = boost::container::static_vector<T, dense::small_size>;
inline Spectrum spectrum(const PerMode<Complex>& lambda) { return {lambda.data(), lambda.size()}; }

/// Which eigenvalues are real, and which are conjugate pairs.
struct Kinds {
  PerMode<std::array<int, 2>> pairs;  ///< the member with positive imaginary part first
  PerMode<int> reals;
  PerMode<int> partner;  ///< of each; a real eigenvalue is its own partner
};

/// Eigenvalues in the caller's order and their eigenvectors, A V = V Λ, W = V⁻¹, in real columns
/// of P and rows of R = P⁻¹: v = p + iq and w = (r - is)/2 of a pair's first member.
struct Basis {
  PerMode<Complex> lambda;
  Kinds kind;
  struct Place {
    int re, im;   ///< columns of p and q; one and the same for a real eigenvalue
    double side;  ///< of the real axis
  };
  PerMode<Place> place;     ///< of each mode in P and R
  dense::SmallMatrix P, R;  ///< not finite if A is defective
};

/// For a matrix in balanced coordinates; `lambda` empty: the eigenvalues in the solver's order.
/// If the iteration limit is reached, the eigenvectors and any computed eigenvalues are empty.
Basis basis(const dense::SmallMatrix& balanced, Spectrum lambda);

/// V⁻¹ A V of another matrix in the same coordinates.
dense::SmallComplexMatrix in_eigenvectors(const Basis& of, const dense::SmallMatrix& A);

/// Real parts of tr(Pᵢ Qⱼ) for every mode i of a and every mode j of b, with Pᵢ and Qⱼ their
/// spectral projectors. All ones (no information) if an eigenvector is missing.
dense::SmallMatrix correlation(const Basis& a, const Basis& b);

/// The cost of linking each mode of a to each of b; M is their correlation.
dense::SmallMatrix costs(const dense::SmallMatrix& M, const Basis& a, Spectrum predicted,
                         const Basis& b);

/// Minimum total cost: pairs to pairs and reals to reals; as many pairs split as b has fewer.
PerMode<int> assign_kinds(const dense::SmallMatrix& cost, const Basis& a, const Basis& b);

}  // namespace tiltrim
