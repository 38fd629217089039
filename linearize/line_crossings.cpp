// Crossings of a line of matrices with the stability boundary by D-decomposition: roots of a
// polynomial in ω². Derivations and bounds: docs/linearize.md.                  [33, 34, 36]
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "linearize/batch.hpp"
#include "linearize/characteristic.hpp"
#include "linearize/modes.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::MatrixXd;
using namespace characteristic;

namespace {

// a b - c d.
Series difference_of_products(const Series& a, const Series& b, const Series& c, const Series& d) {
  const std::size_t size = std::max(a.c.size() + b.c.size(), c.c.size() + d.c.size()) - 1;
  Series s{std::vector<Wide>(size), std::vector<double>(size)};
  const auto add = [&](const Series& f, const Series& g, int sign) {
    for (std::size_t i = 0; i < f.c.size(); ++i)
      for (std::size_t j = 0; j < g.c.size(); ++j) {
        const Wide product = f.c[i] * g.c[j];
        s.c[i + j] += Wide(sign) * product;
        const double F = double(std::abs(f.c[i])), G = double(std::abs(g.c[j]));
        s.error[i + j] += inflated * (F * g.error[j] + f.error[i] * (G + g.error[j]) +
                                      2 * double(size) * wide_u * double(std::abs(product)));
      }
  };
  add(a, b, 1);
  add(c, d, -1);
  return s;
}

Series derivative(const Series& s) {
  Series d;
  for (std::size_t k = 1; k < s.c.size(); ++k) {
    d.c.push_back(Wide(k) * s.c[k]);
    d.error.push_back(double(k) * s.error[k]);
  }
  return d;
}

// The root in a monotonic interval with a sign change: Newton, with bisection if it leaves.
Wide root_between(const Series& s, Wide low, Wide high) {
  const bool rising = s.value(high) > 0;
  constexpr int cap = 200;  // bisection needs at most the mantissa and exponent bits of a Wide
  Wide x = (low + high) / 2;
  for (int i = 0; i < cap; ++i) {
    const Wide value = s.value(x), slope = s.slope(x);
    if (value == 0) return x;
    ((value > 0) == rising ? high : low) = x;
    const Wide newton = x - value / slope;
    const Wide next = newton > low && newton < high ? newton : (low + high) / 2;
    if (std::abs(next - x) <= 2 * wide_u * x || next == low || next == high) return next;
    x = next;
  }
  return x;
}

// Roots in (0, most), and places where rounding may hide one or two: between the roots of its
// derivative a polynomial has one root if its signs there differ, otherwise no root.
struct Roots {
  std::vector<Wide> certain, doubtful;
};

Roots roots(const Series& s, Wide most) {
  Roots found;
  std::vector<Wide> stops{0};
  if (s.c.size() > 2) {
    const Roots turns = roots(derivative(s), most);
    stops.insert(stops.end(), turns.certain.begin(), turns.certain.end());
    stops.insert(stops.end(), turns.doubtful.begin(), turns.doubtful.end());
    std::ranges::sort(stops);
  }
  stops.push_back(most);
  for (const Wide x : stops)
    if (!(double(std::abs(s.value(x))) > s.bound(double(x)))) found.doubtful.push_back(x);
  for (std::size_t k = 0; k + 1 < stops.size(); ++k)
    if ((s.value(stops[k]) > 0) != (s.value(stops[k + 1]) > 0))
      found.certain.push_back(root_between(s, stops[k], stops[k + 1]));
  return found;
}

// Position on the line at which iω is an eigenvalue; |τ| <= 1 is on the line.
struct Place {
  Wide tau = 0;
  double error = 0;
  enum { on, off, unknown } where = unknown;
};

double length(Wide even, Wide odd, Wide x) {
  return double(std::sqrt(even * even + x * odd * odd));
}

//   τ = -Re(p0 conj p1)/|p1|²,  |dτ/dω| <= |p'(iω)|/|p1(iω)|
Place place(const OnAxis& axis, Wide x, double x_error) {
  const Wide E0 = axis.E0.value(x), O0 = axis.O0.value(x), E1 = axis.E1.value(x),
             O1 = axis.O1.value(x);
  const double xd = double(x), omega = std::sqrt(xd);
  const double p0 = length(E0, O0, x), p1 = length(E1, O1, x);
  const double p0_error = axis.E0.bound(xd) + omega * axis.O0.bound(xd);
  const double p1_error = axis.E1.bound(xd) + omega * axis.O1.bound(xd);
  constexpr double margin = 1e-6;  // for places known only to rounding
  Place result;
  if (p0 - p0_error > (1 + margin) * (p1 + p1_error)) {
    result.where = Place::off;
    return result;
  }
  if (!(p1 > 2 * p1_error)) return result;
  result.where = Place::on;
  result.tau = -(E0 * E1 + x * O0 * O1) / (E1 * E1 + x * O1 * O1);
  const double tau = double(std::abs(result.tau));
  result.error = inflated * (p0_error + tau * p1_error) / (p1 - p1_error) + 8 * wide_u * tau;
  if (x_error > 0) {
    // d/dx of p0 + τ p1 = E + iω O is E' + iω O' + i O/(2ω)
    const Wide E = axis.E0.slope(x) + result.tau * axis.E1.slope(x);
    const Wide O =
        axis.O0.slope(x) + result.tau * axis.O1.slope(x) + (O0 + result.tau * O1) / (2 * x);
    result.error += 2 * length(E, O, x) / (p1 - p1_error) * x_error;
  }
  return result;
}

// Error bound of a root x of g: g has opposite signs on both sides, including its own error.
std::optional<double> root_error(const Series& g, Wide x) {
  const double error =
      2 * g.bound(double(x)) / double(std::abs(g.slope(x))) + 4 * wide_u * double(x);
  if (!(error < 0.5 * double(x))) return std::nullopt;
  const Wide before = g.value(x - Wide(error)), after = g.value(x + Wide(error));
  const double least = 1.1 * g.bound(double(x) + error);
  if ((before > 0) == (after > 0) || !(double(std::min(std::abs(before), std::abs(after))) > least))
    return std::nullopt;
  return error;
}

// A0 + t A1 = A(middle + half τ), |τ| <= 1, balanced.
struct Stretch {
  OnAxis axis;
  double middle, half, unit;
};

// The deviation of A1 from rank one matters at the ends of the segment, not in its middle.
Stretch stretch(const MatrixXd& A0, const MatrixXd& A1, double from, double to) {
  const double middle = from + 0.5 * (to - from), half = 0.5 * (to - from);
  const double most = std::max(std::abs(from), std::abs(to));
  const Frame frame(A0.cwiseAbs() + most * A1.cwiseAbs());
  const RankOne one = rank_one(frame.of(A1), "A1");
  const WideMatrix first = frame.of(A0).cast<Wide>();
  const WideMatrix step = Wide(middle) * frame.of(A1).cast<Wide>();
  const Sizes rounding = 4 * wide_u * (step.cwiseAbs() + first.cwiseAbs()).cast<double>();
  Pencil p = pencil(first + step, rounding, Wide(half) * one.u, one.v);
  const double over = inflated * half * one.left_over.norm();
  const auto left_over = perturbation(frame.balanced.B, over);
  for (std::size_t k = 1; k <= std::size_t(A0.rows()); ++k) p.p[k].error += left_over[k];
  return {OnAxis(p, std::size_t(A0.rows())), middle, half, frame.unit};
}

Series on_axis(const OnAxis& axis) {
  return difference_of_products(axis.O0, axis.E1, axis.E0, axis.O1);
}

// The crossing at ω² = x if it lies on the line, within its error.
std::optional<LineCrossing> crossing(const Stretch& line, const Place& at, Wide x) {
  if (at.where != Place::on || !(double(std::abs(at.tau)) <= 1 + at.error)) return std::nullopt;
  const double t = line.middle + line.half * double(std::clamp(at.tau, Wide(-1), Wide(1)));
  return LineCrossing{t, line.unit * double(std::sqrt(x)),
                      line.half * at.error + 2 * narrow_u * (std::abs(t) + line.half)};
}

// The same crossing, computed on a segment around it hardly longer than its error.
LineCrossing refined(const LineCrossing& rough, const MatrixXd& A0, const MatrixXd& A1) {
  const double around = 4 * rough.error;
  const Stretch line = stretch(A0, A1, rough.t - around, rough.t + around);
  const Series g = on_axis(line.axis);
  Wide x = std::pow(Wide(rough.frequency) / Wide(line.unit), Wide(2));
  constexpr int steps = 4;  // Newton steps, from at least half the digits
  for (int i = 0; i < steps && x > 0; ++i) x -= g.value(x) / g.slope(x);
  const std::optional<double> x_error = rough.frequency > 0 ? root_error(g, x) : 0.0;
  if (!x_error) return rough;
  const std::optional<LineCrossing> fine = crossing(line, place(line.axis, x, *x_error), x);
  return fine && fine->error < rough.error ? *fine : rough;
}

bool vanishes(const Series& s) {
  for (std::size_t k = 0; k < s.c.size(); ++k)
    if (double(std::abs(s.c[k])) > s.error[k]) return false;
  return true;
}

// The eigenvalues do not depend on t: no crossings, unless one is on the axis.
bool clear_of_axis(const MatrixXd& A) {
  return std::ranges::all_of(modes(A).modes, [](const Mode& mode) {
    return std::abs(mode.eigenvalue.real()) > mode.error;
  });
}

}  // namespace

//   Im(p0 conj p1)/ω = O0 E1 - E0 O1 = g(ω²);  at ω = 0  τ = -p0(0)/p1(0)                  [36]
LineCrossings line_crossings(const MatrixXd& A0, const MatrixXd& A1, double from, double to) {
  const RoundToNearest environment;
  check_square(A0, A0.rows(), "A0");
  check_square(A1, A0.rows(), "A1");
  if (!(from < to) || !std::isfinite(to - from))
    throw std::invalid_argument(fmt::format("line crossings: no interval from {} to {}", from, to));
  LineCrossings answer;
  if (A0.rows() == 0) return answer;
  const Stretch line = stretch(A0, A1, from, to);
  const OnAxis& axis = line.axis;
  if (vanishes(axis.E1) && vanishes(axis.O1)) {
    answer.complete = clear_of_axis(A0 + line.middle * A1);
    return answer;
  }
  const Series g = on_axis(axis);
  const auto keep = [&](const LineCrossing& found) {
    constexpr double good_enough = 1e-12;
    const bool good = found.error <= good_enough * (to - from);
    answer.crossings.push_back(good ? found : refined(found, A0, A1));
    double& t = answer.crossings.back().t;
    t = std::clamp(t, from, to);
  };
  const Place at_rest = place(axis, 0, 0);
  if (const auto found = crossing(line, at_rest, 0)) keep(*found);
  answer.complete = at_rest.where != Place::unknown && !vanishes(g);
  constexpr double most = 4.1;  // the scaled matrices, and so their eigenvalues, are below 2
  const Roots turns = roots(g, most);
  for (const Wide x : turns.certain) {
    const std::optional<double> error = root_error(g, x);
    const Place at = place(axis, x, error.value_or(0.5 * double(x)));
    answer.complete = answer.complete && at.where != Place::unknown;
    const std::optional<LineCrossing> found = crossing(line, at, x);
    if (!found) continue;
    answer.complete = answer.complete && error.has_value();
    keep(*found);
  }
  for (const Wide x : turns.doubtful)
    answer.complete = answer.complete && place(axis, x, 0).where == Place::off;
  std::ranges::sort(answer.crossings, {}, &LineCrossing::t);
  return answer;
}

}  // namespace tiltrim
