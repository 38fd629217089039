#include "linearize/batch.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <complex>
#include <limits>
#include <stdexcept>

#include "linearize/eigenvalues.hpp"
#include "linearize/lanes_eigenvalues.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;

std::string to_string(LaneStatus status) {
  switch (status) {
    case LaneStatus::converged:
      return "converged";
    case LaneStatus::fallback:
      return "fallback";
    case LaneStatus::not_converged:
      return "not converged";
    case LaneStatus::not_finite:
      return "not finite";
  }
  return "unknown";
}

std::string instruction_set() { return name_of(chosen()); }

std::string rounding() {
#ifdef __x86_64__
  if (!__builtin_cpu_supports("fma")) return "no fma";
#endif
  return "fma";
}

void MatrixBatch::set(Index k, const Eigen::MatrixXd& A) {
  if (A.rows() != n || A.cols() != n || k < 0 || k >= count)
    throw std::invalid_argument(
        fmt::format("batch of {} matrices of size {}: number {} cannot be {} x {}", count, n, k,
                    A.rows(), A.cols()));
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) (*this)(i, j, k) = A(i, j);
}

Eigen::MatrixXd MatrixBatch::matrix(Index k) const {
  if (k < 0 || k >= count)
    throw std::invalid_argument(fmt::format("batch of {} matrices: no number {}", count, k));
  Eigen::MatrixXd A(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) A(i, j) = (*this)(i, j, k);
  return A;
}

namespace {

void check(const MatrixBatch& A) {
  if (A.n < 0 || A.n > largest_batch_matrix || A.count < 0)
    throw std::invalid_argument(
        fmt::format("batch of {} matrices of size {}: supported sizes are 0 to {}", A.count, A.n,
                    largest_batch_matrix));
  if (A.entries.size() != std::size_t(A.n * A.n * A.count))
    throw std::invalid_argument(
        fmt::format("batch of {} matrices of size {}: {} entries", A.count, A.n, A.entries.size()));
}

// Solves one lane with the scalar code: pairs are adjacent, positive imaginary part first.
void fall_back(const MatrixBatch& A, Index k, const BatchOptions& options,
               BatchEigenvalues& answer) {
  const auto put = [&](Index i, double re, double im) {
    answer.re[std::size_t(i * A.count + k)] = re;
    answer.im[std::size_t(i * A.count + k)] = im;
  };
  const Eigen::VectorXcd lambda = eigenvalues(A.matrix(k), options.fallback_iterations);
  if (lambda.size() == 0) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    for (Index i = 0; i < A.n; ++i) put(i, nan, nan);
    answer.status[std::size_t(k)] = LaneStatus::not_converged;
    return;
  }
  Index i = 0;
  for (const std::complex<double>& z : lambda) {
    if (z.imag() < 0) continue;
    put(i++, z.real(), z.imag());
    if (z.imag() > 0) put(i++, z.real(), -z.imag());
  }
}

}  // namespace

void eigenvalues(const MatrixBatch& A, BatchEigenvalues& answer, const BatchOptions& options) {
  const RoundToNearest environment;
  check(A);
  const auto n = std::size_t(A.n), count = std::size_t(A.count);
  answer.re.resize(n * count);
  answer.im.resize(n * count);
  answer.status.assign(count, LaneStatus::converged);
  if (n == 0 || count == 0) return;
  static_assert(sizeof(LaneStatus) == 1);
  const auto kernel = chosen(
      []<InstructionSet set>() -> void (*)(const EigenvalueTask&) { return &eigenvalues<set>; });
  kernel({A.entries.data(), n, count, 0, count, options.max_iterations, answer.re.data(),
          answer.im.data(), reinterpret_cast<unsigned char*>(answer.status.data())});
  for (Index k = 0; k < A.count; ++k)
    if (answer.status[std::size_t(k)] == LaneStatus::fallback) fall_back(A, k, options, answer);
}

}  // namespace tiltrim
