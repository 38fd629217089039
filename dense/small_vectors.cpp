// Eigenvalues and eigenvectors of small matrices without a Schur form, in plain loops.
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

template <class Matrix>
SmallHessenberg hessenberg(Matrix H) {
  SmallHessenberg found;
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
  found.H = H;
  return found;
}

}  // namespace

// Gauss elimination below the subdiagonal, each step a similarity.          [11, sec. 7.4]
SmallHessenberg small_hessenberg(const SmallMatrix& A) {
  return with_known_size([](const auto& known) { return hessenberg(known); }, A);
}

namespace {

using Three = std::array<double, 3>;

// First column of H² - (a + b) H + a b I over its size, a and b the eigenvalues of the last two
// rows, from the lowest row m at which two subdiagonals in succession are small.
Three first_column(const SmallMatrix& H, int low, int high, int& m) {
  const double x = H(high, high), y = H(high - 1, high - 1),
               w = H(high, high - 1) * H(high - 1, high);
  for (m = high - 2;; --m) {
    const double z = H(m, m), a = x - z, b = y - z;
    Three v{(a * b - w) / H(m + 1, m) + H(m, m + 1), H(m + 1, m + 1) - z - a - b, H(m + 2, m + 1)};
    const double size = std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
    for (double& entry : v) entry /= size;
    if (m == low) return v;
    const double left = std::abs(H(m, m - 1)) * (std::abs(v[1]) + std::abs(v[2]));
    const double around = std::abs(H(m - 1, m - 1)) + std::abs(z) + std::abs(H(m + 1, m + 1));
    if (left <= epsilon * std::abs(v[0]) * around) return v;
  }
}

// One step of Francis on rows low .. high: the bulge is chased down by reflections I - u vᵀ.
void francis_step(SmallMatrix& H, int low, int high) {
  int m;
  Three v = first_column(H, low, high, m);
  for (int k = m; k < high; ++k) {
    const bool last = k == high - 1;
    if (k > m) v = {H(k, k - 1), H(k + 1, k - 1), last ? 0.0 : H(k + 2, k - 1)};
    const double norm = std::copysign(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]), v[0]);
    if (norm == 0) continue;
    if (k > m) {
      H(k, k - 1) = -norm;
      H(k + 1, k - 1) = 0;
      if (!last) H(k + 2, k - 1) = 0;
    } else if (m > low) {
      H(k, k - 1) = -H(k, k - 1);
    }
    const double first = v[0] + norm;
    const Three u{first / norm, v[1] / norm, v[2] / norm};
    const double q = v[1] / first, r = v[2] / first;
    for (int j = k; j <= high; ++j) {
      double* const h = &H(k, j);
      const double sum = h[0] + q * h[1] + (last ? 0.0 : r * h[2]);
      h[0] -= sum * u[0];
      h[1] -= sum * u[1];
      if (!last) h[2] -= sum * u[2];
    }
    for (int i = low; i <= std::min(high, k + 3); ++i) {
      const double sum = u[0] * H(i, k) + u[1] * H(i, k + 1) + (last ? 0.0 : u[2] * H(i, k + 2));
      H(i, k) -= sum;
      H(i, k + 1) -= sum * q;
      if (!last) H(i, k + 2) -= sum * r;
    }
  }
}

// Those of rows k and k + 1; of two real ones the second by their product, without cancellation.
void set_two(const SmallMatrix& H, int k, SmallComplexVector& values) {
  const double x = H(k + 1, k + 1), p = 0.5 * (H(k, k) - x), w = H(k + 1, k) * H(k, k + 1);
  const double square = p * p + w, root = std::sqrt(std::abs(square));
  if (square < 0) {
    values[k] = {x + p, root};
    values[k + 1] = {x + p, -root};
    return;
  }
  const double far = p + std::copysign(root, p);
  values[k] = x + far;
  values[k + 1] = far != 0 ? x - w / far : x;
}

}  // namespace

// Implicit double shifts, without the exceptional ones that few matrices need.    [11, alg. 7.5.2]
SmallComplexVector small_eigenvalues(SmallMatrix H) {
  constexpr int most = 10;  // steps per eigenvalue
  const int n = int(H.rows());
  const double size = H.cwiseAbs().maxCoeff();
  for (int j = 0; j < n; ++j)
    for (int i = j + 2; i < n; ++i) H(i, j) = 0;
  SmallComplexVector values(n);
  int high = n - 1;
  for (int step = 0; high >= 0;) {
    int low = high;
    for (; low > 0; --low) {
      const double around = std::abs(H(low - 1, low - 1)) + std::abs(H(low, low));
      if (std::abs(H(low, low - 1)) <= epsilon * (around > 0 ? around : size)) break;
    }
    if (low >= high - 1) {
      if (low == high)
        values[high] = H(high, high);
      else
        set_two(H, low, values);
      high = low - 1;
      step = 0;
      continue;
    }
    if (++step > most) return {};
    francis_step(H, low, high);
  }
  return values;
}

namespace {

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
std::array<Scalar, small_size> vector_of(const Matrix& H, const std::array<int, small_size>& pivot,
                                         Scalar lambda, double least) {
  const int n = int(H.rows());
  const Shifted<Scalar, Matrix> shifted(H, lambda, least);
  std::array<Scalar, small_size> x;
  x.fill(1.0);
  shifted.solve_upper(x.data(), n);
  normalize(x.data(), n);
  shifted.solve_lower(x.data(), n);
  shifted.solve_upper(x.data(), n);
  for (int m = n - 2; m > 0; --m) {
    for (int i = m + 1; i < n; ++i) x[i] += H(i, m - 1) * x[m];
    std::swap(x[m], x[pivot[m]]);
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
std::optional<SmallMatrix> vectors(const Matrix& A, const Matrix& H,
                                   const std::array<int, small_size>& pivot,
                                   std::span<const std::complex<double>> upper) {
  // ε^¼ and ε^¾: what two iterations leave of another eigenvector, (near/far)², is rounding.
  constexpr double far = 0x1p-13, near = epsilon / far;
  const int n = int(A.rows());
  const double size = A.norm(), least = epsilon * size;
  const auto pairs = std::ranges::count_if(upper, [](const auto& z) { return z.imag() > 0; });
  if (std::ssize(upper) + pairs != n || !apart(upper, far * size)) return {};
  std::optional<SmallMatrix> P(std::in_place, n, n);
  double* column = P->data();
  for (const std::complex<double>& lambda : upper) {
    if (lambda.imag() == 0) {
      const auto x = vector_of(H, pivot, lambda.real(), least);
      if (!satisfies(A, lambda.real(), x.data(), near * size)) return {};
      column = std::copy_n(x.data(), n, column);
      continue;
    }
    const auto x = vector_of(H, pivot, plain(lambda), least);
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

std::optional<SmallMatrix> small_vectors(const SmallMatrix& A, const SmallHessenberg& h,
                                         std::span<const std::complex<double>> upper) {
  return with_known_size(
      [&](const auto& known, const auto& H) { return vectors(known, H, h.pivot, upper); }, A, h.H);
}

}  // namespace tiltrim::dense
