/// Characteristic polynomials of A + t u vᵀ with error bounds of their coefficients, and their
/// values on the imaginary axis. Derivations: docs/linearize.md. Internal to linearize/.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "linearize/balance.hpp"
#include "linearize/batch.hpp"

namespace tiltrim::characteristic {

using Wide = long double;
constexpr int largest = int(largest_batch_matrix);
using WideMatrix = Eigen::Matrix<Wide, Eigen::Dynamic, Eigen::Dynamic, 0, largest, largest>;
using WideVector = Eigen::Matrix<Wide, Eigen::Dynamic, 1, 0, largest, 1>;
using Sizes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, largest, largest>;

constexpr double narrow_u = std::numeric_limits<double>::epsilon() / 2;
constexpr double wide_u = double(std::numeric_limits<Wide>::epsilon()) / 2;
/// Covers the rounding of the bounds themselves, which are sums and products of positive numbers.
constexpr double inflated = 1.01;

/// Throws std::invalid_argument unless A is finite, n x n, and of at most `largest` rows.
void check_square(const Eigen::MatrixXd& A, Eigen::Index n, const char* name);

/// The similarity and the unit of frequency that balance matrices of these sizes and bring their
/// norm below two. Throws std::invalid_argument if a size is not finite.
struct Frame {
  Balanced balanced;
  double unit = 1.0;  ///< rad/s, a power of two

  explicit Frame(const Eigen::MatrixXd& sizes);
  /// A in these coordinates.
  Sizes of(const Eigen::MatrixXd& A) const;
};

/// u vᵀ, and the remainder of the matrix.
struct RankOne {
  WideVector u, v;
  Sizes left_over;
};

/// Throws std::invalid_argument if A is not of rank one (or zero) to 1e-10 of its size.
RankOne rank_one(const Sizes& A, const char* name);

/// A number and its error bound.
struct Bounded {
  Wide value = 0;
  double error = 0;
};

/// Coefficients of sⁿ⁻ᵏ, k = 0 .. n.
using Polynomial = std::array<Bounded, largest + 1>;

/// For a perturbation of Frobenius norm φ and a matrix with columns of length at most hⱼ,
///   |δcₖ| <= √(n - k + 1) φ eₖ₋₁(h + φ)                                                    [33]
std::array<double, largest + 1> perturbation(const Sizes& sizes, double phi);

/// det(sI - A - t u vᵀ) = p + t q.
struct Pencil {
  Polynomial p{}, q{};
};

/// p = det(sI - A) and q = -vᵀ adj(sI - A) u, for A within A_error; right is u, left is v.
Pencil pencil(const WideMatrix& A, const Sizes& A_error, const WideVector& right,
              const WideVector& left);

/// A real polynomial in x, lowest power first, with error bounds of its coefficients.
struct Series {
  std::vector<Wide> c;
  std::vector<double> error;

  Wide value(Wide x) const;
  Wide slope(Wide x) const;
  /// Error bound of the value, for x >= 0.
  double bound(double x) const;
};

/// A pencil of degree n at s = iω, with x = ω²: p = E0 + iω O0, q = E1 + iω O1.
struct OnAxis {
  Series E0, O0, E1, O1;

  OnAxis(const Pencil& pencil, std::size_t n);
};

}  // namespace tiltrim::characteristic
