#include "design/lapack.hpp"

#include <algorithm>
#include <complex>
#include <cstddef>
#include <vector>

// Each character argument of a Fortran routine has its length at the end.
extern "C" {
void dgees_(const char* vectors, const char* sort, int (*select)(const double*, const double*),
            const int* n, double* A, const int* lda, int* leading, double* re, double* im,
            double* Z, const int* ldz, double* work, const int* size, int* flags, int* info,
            std::size_t, std::size_t);
void dtrexc_(const char* vectors, const int* n, double* T, const int* ldt, double* Z,
             const int* ldz, int* from, int* to, double* work, int* info, std::size_t);
void dtrsyl_(const char* op_T, const char* op_S, const int* sign, const int* m, const int* n,
             const double* T, const int* ldt, const double* S, const int* lds, double* F,
             const int* ldf, double* scale, int* info, std::size_t, std::size_t);
void dgeev_(const char* left, const char* right, const int* n, double* A, const int* lda,
            double* re, double* im, double* VL, const int* ldvl, double* VR, const int* ldvr,
            double* work, const int* size, int* info, std::size_t, std::size_t);
void dggevx_(const char* balance, const char* left, const char* right, const char* sense,
             const int* n, double* A, const int* lda, double* B, const int* ldb, double* re,
             double* im, double* beta, double* VL, const int* ldvl, double* VR, const int* ldvr,
             int* low, int* high, double* left_scale, double* right_scale, double* A_norm,
             double* B_norm, double* values_rcond, double* vectors_rcond, double* work,
             const int* size, int* indices, int* flags, int* info, std::size_t, std::size_t,
             std::size_t, std::size_t);
void dgebal_(const char* job, const int* n, double* A, const int* lda, int* low, int* high,
             double* scale, int* info, std::size_t);
void zgesvd_(const char* U, const char* V, const int* m, const int* n, std::complex<double>* A,
             const int* lda, double* sigma, std::complex<double>* u, const int* ldu,
             std::complex<double>* v, const int* ldv, std::complex<double>* work, const int* size,
             double* real_work, int* info, std::size_t, std::size_t);
}

namespace tiltrim::lapack {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

static constexpr char vectors = 'V';  // Schur vectors are accumulated
static int is_stable(const double* re, const double*) { return *re < 0; }

Schur schur(const MatrixXd& A, bool stable_first) {
  Schur s{true, MatrixXd(A.rows(), A.rows()), A, VectorXcd(A.rows()), 0};
  if (A.rows() == 0) return s;
  const int n = int(A.rows()), size = 40 * n;
  VectorXd re(n), im(n), work(size);
  std::vector<int> flags(std::size_t(n), 0);
  int leading = 0, info = 0;
  dgees_(&vectors, stable_first ? "S" : "N", &is_stable, &n, s.T.data(), &n, &leading, re.data(),
         im.data(), s.Z.data(), &n, work.data(), &size, flags.data(), &info, 1, 1);
  if (info != 0 && info != n + 2) return {};  // n + 2: reordering moved one across the axis
  s.values.real() = re;
  s.values.imag() = im;
  s.leading = leading;
  return s;
}

bool move(Schur& s, Index from, Index to) {
  const int n = int(s.T.rows());
  int source = int(from) + 1, target = int(to) + 1, info = 0;
  VectorXd work(n);
  dtrexc_(&vectors, &n, s.T.data(), &n, s.Z.data(), &n, &source, &target, work.data(), &info, 1);
  return info == 0;
}

MatrixXd sylvester(const MatrixXd& T, const MatrixXd& S, bool S_transposed, const MatrixXd& F) {
  MatrixXd Y = F;
  const int m = int(T.rows()), n = int(S.rows()), plus = 1;
  if (m == 0 || n == 0) return Y;
  double scale = 1;
  int info = 0;
  dtrsyl_("N", S_transposed ? "T" : "N", &plus, &m, &n, T.data(), &m, S.data(), &n, Y.data(), &m,
          &scale, &info, 1, 1);
  return Y / scale;
}

VectorXcd eigenvalues(const MatrixXd& A) {
  const int n = int(A.rows()), one = 1, size = 40 * n;
  if (n == 0) return {};
  MatrixXd T = A;
  VectorXd re(n), im(n), work(size);
  int info = 0;
  dgeev_("N", "N", &n, T.data(), &n, re.data(), im.data(), nullptr, &one, nullptr, &one,
         work.data(), &size, &info, 1, 1);
  if (info != 0) return {};
  VectorXcd values(n);
  values.real() = re;
  values.imag() = im;
  std::ranges::sort(values, [](Complex a, Complex b) {
    return a.real() != b.real() ? a.real() < b.real() : a.imag() < b.imag();
  });
  return values;
}

VectorXd scales(const MatrixXd& A) {
  const int n = int(A.rows());
  MatrixXd balanced = A;
  VectorXd d = VectorXd::Ones(n);
  int low = 0, high = 0, info = 0;
  if (n > 0) dgebal_("S", &n, balanced.data(), &n, &low, &high, d.data(), &info, 1);
  return d;
}

Pencil generalized_eigenvalues(const MatrixXd& A, const MatrixXd& B) {
  if (A.rows() == 0) return {};
  const int n = int(A.rows()), size = 40 * n, one = 1;
  MatrixXd a = A, b = B;
  VectorXd re(n), im(n), beta(n), left(n), right(n), rcond(n), work(size);
  std::vector<int> indices(std::size_t(n + 6), 0), flags(std::size_t(n), 0);
  double a_norm = 0.0, b_norm = 0.0;
  int low = 0, high = 0, info = 0;
  dggevx_("B", "N", "N", "N", &n, a.data(), &n, b.data(), &n, re.data(), im.data(), beta.data(),
          nullptr, &one, nullptr, &one, &low, &high, left.data(), right.data(), &a_norm, &b_norm,
          rcond.data(), rcond.data(), work.data(), &size, indices.data(), flags.data(), &info, 1, 1,
          1, 1);
  if (info != 0) return {};
  Pencil all{VectorXcd(n), beta};
  all.alpha.real() = re;
  all.alpha.imag() = im;
  return all;
}

double spectral_norm(const MatrixXcd& G) {
  const int m = int(G.rows()), n = int(G.cols()), one = 1, least = std::min(m, n);
  if (least <= 1) return G.norm();
  const int size = 4 * (m + n);
  MatrixXcd copy = G;
  VectorXd sigma(least), real_work(5 * least);
  VectorXcd work(size);
  int info = 0;
  zgesvd_("N", "N", &m, &n, copy.data(), &m, sigma.data(), nullptr, &one, nullptr, &one,
          work.data(), &size, real_work.data(), &info, 1, 1);
  return info == 0 ? sigma[0] : G.norm();
}

}  // namespace tiltrim::lapack
