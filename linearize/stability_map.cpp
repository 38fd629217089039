// Verdicts over two gains: polynomials affine in each gain, and Routh's test with error bounds.
// Derivations and bounds: docs/linearize.md.                                  [32, 33, 34]
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "linearize/batch.hpp"
#include "linearize/characteristic.hpp"
#include "linearize/lanes_routh.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using namespace characteristic;

namespace {

// Polynomials at a = 0 and a = reach; both coefficients are linear in a.
struct Plane {
  Index n;
  Pencil near, far;
  double reach;
  std::array<double, largest + 1> left_over;  // error bounds of coefficients, for the whole map
};

double reach(std::span<const double> gains) {
  double most = 0;
  for (const double gain : gains) {
    if (!std::isfinite(gain)) throw std::invalid_argument("stability map: a gain is not finite");
    most = std::max(most, std::abs(gain));
  }
  return most;
}

MatrixXd largest_entries(const AffineFamily& family, double a_most, double b_most) {
  return family.A0.cwiseAbs() + a_most * family.A1.cwiseAbs() + b_most * family.A2.cwiseAbs();
}

Plane plane(const AffineFamily& family, double a_most, double b_most, double entry_error) {
  const MatrixXd sizes = largest_entries(family, a_most, b_most);
  const Frame frame(sizes);
  const RankOne one = rank_one(frame.of(family.A1), "A1"),
                two = rank_one(frame.of(family.A2), "A2");
  const double over = (a_most * one.left_over + b_most * two.left_over).norm();
  Plane result{sizes.rows(),
               {},
               {},
               a_most > 0 ? a_most : 1.0,
               perturbation(frame.balanced.B, inflated * over)};
  const WideMatrix A0 = frame.of(family.A0).cast<Wide>();
  const WideMatrix step = Wide(result.reach) * (one.u * one.v.transpose());
  const WideMatrix far = A0 + step;
  const Sizes rounding = 4 * wide_u * (step.cwiseAbs() + far.cwiseAbs()).cast<double>();
  const Sizes given = inflated * entry_error * frame.of(sizes);
  result.near = pencil(A0, given, two.u, two.v);
  result.far = pencil(far, given + rounding, two.u, two.v);
  return result;
}

// (1 - t) near + t far, rounded to a double; the error includes that rounding and another.
Bounded between(const Bounded& near, const Bounded& far, Wide t) {
  const Wide first = (1 - t) * near.value, second = t * far.value, value = first + second;
  const double rounding = 4 * wide_u * double(std::abs(first) + std::abs(second));
  return {value,
          inflated * (double(std::abs(1 - t)) * near.error + double(std::abs(t)) * far.error +
                      rounding + 2 * narrow_u * double(std::abs(value)))};
}

struct Line {
  std::array<double, largest + 1> p{}, q{}, p_error{}, q_error{};
};

Line line(const Plane& plane, double a) {
  Line result;
  const Wide t = Wide(a) / Wide(plane.reach);
  for (std::size_t k = 1; k <= std::size_t(plane.n); ++k) {
    const Bounded p = between(plane.near.p[k], plane.far.p[k], t);
    const Bounded q = between(plane.near.q[k], plane.far.q[k], t);
    result.p[k] = double(p.value);
    result.q[k] = double(q.value);
    result.p_error[k] = inflated * (p.error + plane.left_over[k]);
    result.q_error[k] = inflated * q.error;
  }
  return result;
}

Verdict by_eigenvalues(const AffineFamily& family, double a, double b, const MatrixXd& error) {
  const MatrixXd A = family.A0 + a * family.A1 + b * family.A2;
  return modes(A, 4 * narrow_u * largest_entries(family, std::abs(a), std::abs(b)) + error).verdict;
}

void check_family(const AffineFamily& family) {
  const Index n = family.A0.rows();
  check_square(family.A0, n, "A0");
  check_square(family.A1, n, "A1");
  check_square(family.A2, n, "A2");
}

}  // namespace

void stability_map(const AffineFamily& family, std::span<const double> a, std::span<const double> b,
                   std::span<Verdict> answer, const StabilityMapOptions& options) {
  const RoundToNearest environment;
  check_family(family);
  if (answer.size() != a.size() * b.size())
    throw std::invalid_argument(fmt::format("stability map: {} x {} points, room for {} verdicts",
                                            a.size(), b.size(), answer.size()));
  if (!(options.entry_error >= 0))
    throw std::invalid_argument(
        "stability map: the error of the entries is negative or not a number");
  const double a_most = reach(a), b_most = reach(b);
  if (family.A0.rows() == 0) {
    std::ranges::fill(answer, Verdict::stable);
    return;
  }
  const Plane all = plane(family, a_most, b_most, options.entry_error);
  const MatrixXd error = options.entry_error * largest_entries(family, a_most, b_most);
  const auto kernel = chosen([]<InstructionSet set>() { return &routh_of_line<set>; });
  std::vector<RouthVerdict> said(b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Line row = line(all, a[i]);
    kernel({row.p.data(), row.q.data(), row.p_error.data(), row.q_error.data(), std::size_t(all.n),
            b.data(), b.size(), said.data()});
    Verdict* const verdict = answer.data() + i * b.size();
    for (std::size_t j = 0; j < b.size(); ++j) verdict[j] = static_cast<Verdict>(said[j]);
    const bool decided = !std::memchr(said.data(), int(RouthVerdict::undecided), said.size());
    if (decided || !options.by_modes) continue;
    for (std::size_t j = 0; j < b.size(); ++j)
      if (verdict[j] == Verdict::undecided) verdict[j] = by_eigenvalues(family, a[i], b[j], error);
  }
}

std::vector<Verdict> stability_map(const AffineFamily& family, const std::vector<double>& a,
                                   const std::vector<double>& b,
                                   const StabilityMapOptions& options) {
  std::vector<Verdict> answer(a.size() * b.size());
  stability_map(family, a, b, answer, options);
  return answer;
}

}  // namespace tiltrim
