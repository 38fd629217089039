#include "sweep/line_affine.hpp"

#include <algorithm>
#include <stdexcept>

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

void fill_matrices(const AffineLine& line, const std::vector<double>& shares, MatrixBatch& A) {
  const std::size_t count = shares.size();
  for (Index i = 0; i < A.n; ++i)
    for (Index j = 0; j < A.n; ++j) {
      const double first = line.first(i, j), slope = line.slope(i, j);
      double* const entries = &A(i, j, 0);
      if (slope == 0)
        std::fill_n(entries, count, first);
      else
        for (std::size_t k = 0; k < count; ++k) entries[k] = first + shares[k] * slope;
    }
}

std::vector<double> phi_along(const Prepared& sweep, OperatingPoint at) {
  const std::size_t axis = sweep.axes.size() - 1;
  const Model::Affine* structure = sweep.affine[axis];
  std::vector<double> phi(structure ? sweep.axes[axis].size() : 0);
  for (std::size_t k = 0; k < phi.size(); ++k) {
    move_to(sweep, axis, double(k), at);
    const auto there = structure->phi(at.p);
    if (!there) return {};
    phi[k] = *there;
  }
  return phi;
}

std::vector<double> shares_along(const Prepared& sweep, const LineStart& start,
                                 const AffineLine& line) {
  std::vector<double> shares = start.phi ? *start.phi : phi_along(sweep, start.first.at);
  for (double& share : shares) share -= line.phi;
  return shares;
}

// What the polynomial cannot decide with a margin that covers the rounding of each point's matrix
// is decided by that matrix.
bool judge_by_polynomial(const AffineLine& line, const std::vector<double>& shares,
                         std::vector<Verdict>& answer) {
  constexpr double margin = 0x1p-40;
  const Index n = line.first.rows();
  const double at_first = 0.0;
  const std::size_t count = shares.size();
  answer.resize(count);
  try {
    stability_map({line.first, MatrixXd::Zero(n, n), line.slope}, {&at_first, 1}, shares, answer,
                  {.entry_error = margin, .by_modes = false});
  } catch (const std::invalid_argument&) {
    return false;
  }
  std::vector<std::size_t> open;
  std::vector<double> shares_of_open;
  for (std::size_t k = 0; k < count; ++k)
    if (answer[k] == Verdict::undecided) {
      open.push_back(k);
      shares_of_open.push_back(shares[k]);
    }
  if (open.empty()) return true;
  MatrixBatch A(n, std::ssize(open));
  fill_matrices(line, shares_of_open, A);
  std::vector<Verdict> decided;
  verdicts(A, decided);
  for (std::size_t m = 0; m < open.size(); ++m) answer[open[m]] = decided[m];
  return true;
}

}  // namespace tiltrim
