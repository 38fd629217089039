#include "trim/proof.hpp"

#include <algorithm>
#include <cmath>

#include "model/interval.hpp"
#include "model/lookup.hpp"
#include "model/time_limit.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// A row is excluded only by at least this much of its nominal size: ten times the tolerance of a
// trim, and far more than what an enclosure may leave to ordinary rounding (docs/trim.md).
constexpr double margin = 1e-9;
// A box this small (in nominal sizes) that cannot be excluded contains a solution or nearly one.
constexpr double smallest = 1e-3;

struct Part {
  std::vector<Range> box;  // of the model's variables
};

bool disjoint(const Range& range, double lower, double upper, double nominal) {
  return range.lower > upper + margin * nominal || range.upper < lower - margin * nominal;
}

bool excluded(const Problem& p, const Part& part) {
  const std::vector<Range> y = p.model.enclosure(part.box);
  for (Index i = 0; i < p.m(); ++i) {
    const Index row = p.equations[std::size_t(i)];
    if (disjoint(y[std::size_t(row)], p.held[i], p.held[i], p.row_nominal[row])) return true;
  }
  for (Index i = 0; i < std::ssize(p.limited); ++i) {
    const Index row = p.limited[std::size_t(i)];
    const double size = p.row_nominal[row];
    if (disjoint(y[std::size_t(row)], p.limited_lower[i] * size, p.limited_upper[i] * size, size))
      return true;
  }
  return false;
}

Part whole(const Problem& p) {
  Part part;
  const Index all =
      std::ssize(p.model.states) + std::ssize(p.model.inputs) + std::ssize(p.model.parameters);
  for (Index j = 0; j < all; ++j) part.box.push_back({value_of(p.base, j), value_of(p.base, j)});
  for (Index k = 0; k < p.n(); ++k)
    part.box[std::size_t(p.unknowns[std::size_t(k)])] = {Interval::down(p.lower[k] * p.nominal[k]),
                                                         Interval::up(p.upper[k] * p.nominal[k])};
  return part;
}

// The unknown whose interval moves the equations most, by the slopes in the middle of the box: the
// largest sum of its smears [104]. Without slopes the widest; negative if all are small.
Index bisected(const Problem& p, const Part& part) {
  VectorXd widths(p.n()), middle(p.n());
  for (Index k = 0; k < p.n(); ++k) {
    const Range& r = part.box[std::size_t(p.unknowns[std::size_t(k)])];
    widths[k] = (r.upper - r.lower) / p.nominal[k];
    middle[k] = 0.5 * (r.lower + r.upper) / p.nominal[k];
  }
  Index cut = -1;
  if (!(p.n() > 0 && widths.maxCoeff(&cut) >= smallest)) return -1;
  const Jacobians s = jacobians(p, middle);
  if (!s.finite) return cut;
  const VectorXd smears = s.residual.cwiseAbs().colwise().sum().transpose().cwiseProduct(widths);
  (widths.array() >= smallest).select(smears, -1.0).maxCoeff(&cut);
  return cut;
}

}  // namespace

bool can_be_proved(const Problem& p) {
  const Index moving = std::ssize(p.model.states) + std::ssize(p.model.inputs);
  const bool enclosed = std::ranges::all_of(p.unknowns, [&](Index j) { return j < moving; });
  return p.model.enclosure && enclosed && p.lower.allFinite() && p.upper.allFinite();
}

Proof prove_no_solution(const Problem& p, const TrimOptions& options) {
  Proof proof;
  if (options.max_boxes <= 0 || !can_be_proved(p)) return proof;
  std::vector<Part> open{whole(p)};
  while (!open.empty()) {
    if (++proof.boxes > options.max_boxes || options.stop.stop_requested()) return proof;
    const Part part = std::move(open.back());
    open.pop_back();
    try {
      if (excluded(p, part)) continue;
    } catch (const OutOfTime&) {
      return proof;
    }
    const Index k = bisected(p, part);
    if (k < 0) return proof;
    const auto cut = std::size_t(p.unknowns[std::size_t(k)]);
    Part low = part, high = part;
    low.box[cut].upper = high.box[cut].lower = 0.5 * (part.box[cut].lower + part.box[cut].upper);
    open.push_back(std::move(low));
    open.push_back(std::move(high));
  }
  proof.proved = true;
  return proof;
}

}  // namespace tiltrim
