// Eigenvectors of small matrices at known eigenvalues, in plain loops.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "dense/dense.hpp"
#include "dense/known_size.hpp"

namespace tiltrim::dense {

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// A complex number that is not set to zero unasked, and whose product knows no infinities: both
// would take longer than the arithmetic.
struct Plain {
  double re, im;
  Plain() = default;
  Plain(double real, double imag = 0.0) : re(real), im(imag) {}
  Plain& operator+=(Plain b) { return *this = {re + b.re, im + b.im}; }
  Plain& operator-=(Plain b) { return *this = {re - b.re, im - b.im}; }
};
Plain operator*(Plain a, Plain b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
Plain operator*(double a, Plain b) { return {a * b.re, a * b.im}; }

Plain plain(std::complex<double> z) { return {z.real(), z.imag()}; }
double magnitude(double x) { return std::abs(x); }
double magnitude(Plain z) { return std::abs(z.re) + std::abs(z.im); }

double inverse(double a) { return 1 / a; }
Plain inverse(Plain a) { return (1 / (a.re * a.re + a.im * a.im)) * Plain(a.re, -a.im); }

// A = S H S⁻¹, H upper Hessenberg; S is in the exchanges of rows and below H's subdiagonal.
template <class Matrix>
struct Hessenberg {
  Matrix H;
  std::array<int, small_size> pivot{};
};

// Gauss elimination below the subdiagonal, each step a similarity.          [11, sec. 7.4]
template <class Matrix>
Hessenberg<Matrix> hessenberg(const Matrix& A) {
  Hessenberg<Matrix> found{A, {}};
  Matrix& H = found.H;
  const int n = int(H.rows());
  for (int m = 1; m < n - 1; ++m) {
    double* const factor = &H(0, m - 1);
    int pivot = m;
    for (int i = m + 1; i < n; ++i)
      if (std::abs(factor[i]) > std::abs(factor[pivot])) pivot = i;
    found.pivot[std::size_t(m)] = pivot;
    if (pivot != m) {
      for (int j = m - 1; j < n; ++j) std::swap(H(pivot, j), H(m, j));
      for (int i = 0; i < n; ++i) std::swap(H(i, pivot), H(i, m));
    }
    if (factor[m] == 0) continue;
    for (int i = m + 1; i < n; ++i) factor[i] /= factor[m];
    for (int j = m; j < n; ++j)
      for (int i = m + 1; i < n; ++i) H(i, j) -= factor[i] * H(m, j);
    for (int k = m + 1; k < n; ++k)
      for (int i = 0; i < n; ++i) H(i, m) += factor[k] * H(i, k);
  }
  return found;
}

// H - λI = L U with exchanges of adjacent rows; U by rows.
template <class Scalar, class Matrix>
struct Shifted {
  std::array<std::array<Scalar, small_size>, small_size> U;
  std::array<Scalar, small_size> factor, pivot_inverse;
  std::array<bool, small_size> exchanged;

  Shifted(const Matrix& H, Scalar lambda, double least) {
    const int n = int(H.rows());
    for (int j = 0; j < n; ++j) U[0][j] = H(0, j);
    U[0][0] -= lambda;
    for (int k = 0; k < n; ++k) {
      if (k + 1 < n) {
        auto &above = U[k], &below = U[k + 1];
        for (int j = k; j < n; ++j) below[j] = H(k + 1, j);
        below[k + 1] -= lambda;
        exchanged[k] = magnitude(below[k]) > magnitude(above[k]);
        if (exchanged[k])
          for (int j = k; j < n; ++j) std::swap(above[j], below[j]);
      }
      if (!(magnitude(U[k][k]) > least)) U[k][k] = least;
      pivot_inverse[k] = inverse(U[k][k]);
      if (k + 1 == n) return;
      factor[k] = U[k + 1][k] * pivot_inverse[k];
      for (int j = k + 1; j < n; ++j) U[k + 1][j] -= factor[k] * U[k][j];
    }
  }

  void solve_lower(Scalar* x, int n) const {
    for (int k = 0; k + 1 < n; ++k) {
      if (exchanged[k]) std::swap(x[k], x[k + 1]);
      x[k + 1] -= factor[k] * x[k];
    }
  }
  void solve_upper(Scalar* x, int n) const {
    for (int k = n - 1; k >= 0; --k) {
      for (int j = k + 1; j < n; ++j) x[k] -= U[k][j] * x[j];
      x[k] = x[k] * pivot_inverse[k];
    }
  }
};

// Scales x so that its largest entry is one.
template <class Scalar>
void normalize(Scalar* x, int n) {
  const Scalar* const most =
      std::max_element(x, x + n, [](Scalar a, Scalar b) { return magnitude(a) < magnitude(b); });
  const Scalar scale = inverse(*most);
  for (int i = 0; i < n; ++i) x[i] = x[i] * scale;
}

// Inverse iteration, twice, and the way back from H to A.                  [11, sec. 7.6.1]
template <class Scalar, class Matrix>
std::array<Scalar, small_size> vector_of(const Hessenberg<Matrix>& h, Scalar lambda, double least) {
  const int n = int(h.H.rows());
  const Shifted<Scalar, Matrix> shifted(h.H, lambda, least);
  std::array<Scalar, small_size> x;
  x.fill(1.0);
  shifted.solve_upper(x.data(), n);
  normalize(x.data(), n);
  shifted.solve_lower(x.data(), n);
  shifted.solve_upper(x.data(), n);
  for (int m = n - 2; m > 0; --m) {
    for (int i = m + 1; i < n; ++i) x[i] += h.H(i, m - 1) * x[m];
    std::swap(x[m], x[h.pivot[m]]);
  }
  normalize(x.data(), n);
  return x;
}

// True if A x = λ x to within `size`.
template <class Scalar, class Matrix>
bool satisfies(const Matrix& A, Scalar lambda, const Scalar* x, double size) {
  const int n = int(A.rows());
  std::array<Scalar, small_size> miss;
  for (int i = 0; i < n; ++i) miss[i] = -1.0 * lambda * x[i];
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) miss[i] += A(i, j) * x[j];
  return std::all_of(miss.begin(), miss.begin() + n,
                     [&](Scalar z) { return magnitude(z) <= size; });
}

// True if no two eigenvalues, those below the real axis included, are closer than `gap`.
bool apart(std::span<const std::complex<double>> upper, double gap) {
  for (std::size_t i = 0; i < upper.size(); ++i) {
    if (upper[i].imag() != 0 && !(2 * upper[i].imag() > gap)) return false;
    for (std::size_t k = 0; k < i; ++k)
      if (!(magnitude(plain(upper[i] - upper[k])) > gap)) return false;
  }
  return true;
}

template <class Matrix>
std::optional<SmallMatrix> vectors(const Matrix& A, std::span<const std::complex<double>> upper) {
  // ε^¼ and ε^¾: what two iterations leave of another eigenvector, (near/far)², is rounding.
  constexpr double far = 0x1p-13, near = epsilon / far;
  const int n = int(A.rows());
  const double size = A.norm(), least = epsilon * size;
  const auto pairs = std::ranges::count_if(upper, [](const auto& z) { return z.imag() > 0; });
  if (std::ssize(upper) + pairs != n || !apart(upper, far * size)) return {};
  const Hessenberg<Matrix> h = hessenberg(A);
  std::optional<SmallMatrix> P(std::in_place, n, n);
  double* column = P->data();
  for (const std::complex<double>& lambda : upper) {
    if (lambda.imag() == 0) {
      const auto x = vector_of(h, lambda.real(), least);
      if (!satisfies(A, lambda.real(), x.data(), near * size)) return {};
      column = std::copy_n(x.data(), n, column);
      continue;
    }
    const auto x = vector_of(h, plain(lambda), least);
    if (!satisfies(A, plain(lambda), x.data(), near * size)) return {};
    for (int i = 0; i < n; ++i) {
      column[i] = x[i].re;
      column[n + i] = x[i].im;
    }
    column += 2 * n;
  }
  return P;
}

}  // namespace

std::optional<SmallMatrix> small_vectors(const SmallMatrix& A,
                                         std::span<const std::complex<double>> upper) {
  return with_known_size([&](const auto& known) { return vectors(known, upper); }, A);
}

}  // namespace tiltrim::dense
