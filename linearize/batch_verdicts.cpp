#include <fmt/core.h>

#include <stdexcept>

#include "linearize/batch.hpp"
#include "linearize/lanes_routh.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

static_assert(int(RouthVerdict::stable) == int(Verdict::stable) &&
              int(RouthVerdict::unstable) == int(Verdict::unstable) &&
              int(RouthVerdict::undecided) == int(Verdict::undecided));

void check_batch(const MatrixBatch& A, double entry_error) {
  if (A.n < 0 || A.n > largest_batch_matrix)
    throw std::invalid_argument(fmt::format(
        "verdicts: supported are matrices of 0 to {} states, not {}", largest_batch_matrix, A.n));
  if (A.count < 0 || std::ssize(A.entries) != A.n * A.n * A.count)
    throw std::invalid_argument(
        fmt::format("verdicts: {} matrices of {} states have {} entries, not {}", A.count, A.n,
                    A.n * A.n * A.count, A.entries.size()));
  if (!(entry_error >= 0))
    throw std::invalid_argument("verdicts: the error of the entries is negative or not a number");
}

std::vector<RouthVerdict> by_routh(const MatrixBatch& A, double entry_error, bool balanced) {
  const auto kernel = chosen([]<InstructionSet set>() { return &routh_of_matrices<set>; });
  std::vector<RouthVerdict> said(static_cast<std::size_t>(A.count));
  kernel({A.entries.data(), std::size_t(A.n), std::size_t(A.count), 0, said.size(), entry_error,
          balanced, said.data()});
  return said;
}

Verdict by_eigenvalues(const MatrixXd& A, double entry_error) {
  const MatrixXd error = entry_error * A.cwiseAbs();
  if (!A.allFinite() || !error.allFinite()) return Verdict::undecided;
  return modes(A, error).verdict;
}

}  // namespace

// Three stages, each for matrices that the previous one left undecided: unbalanced, balanced,
// eigenvalues.
void verdicts(const MatrixBatch& A, std::vector<Verdict>& answer, double entry_error) {
  const RoundToNearest environment;
  check_batch(A, entry_error);
  answer.assign(std::size_t(A.count), Verdict::stable);
  if (A.n == 0) return;
  const std::vector<RouthVerdict> first = by_routh(A, entry_error, false);
  std::vector<Index> left;
  for (Index k = 0; k < A.count; ++k) {
    answer[std::size_t(k)] = static_cast<Verdict>(first[std::size_t(k)]);
    if (answer[std::size_t(k)] == Verdict::undecided) left.push_back(k);
  }
  MatrixBatch harder(A.n, std::ssize(left));
  for (Index m = 0; m < harder.count; ++m)
    for (Index i = 0; i < A.n; ++i)
      for (Index j = 0; j < A.n; ++j) harder(i, j, m) = A(i, j, left[std::size_t(m)]);
  const std::vector<RouthVerdict> second = by_routh(harder, entry_error, true);
  for (Index m = 0; m < harder.count; ++m) {
    Verdict& verdict = answer[std::size_t(left[std::size_t(m)])];
    verdict = static_cast<Verdict>(second[std::size_t(m)]);
    if (verdict == Verdict::undecided) verdict = by_eigenvalues(harder.matrix(m), entry_error);
  }
}

}  // namespace tiltrim
