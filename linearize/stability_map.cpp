// Characteristic polynomials of A0 + a A1 + b A2 with terms of rank one, and what they say of
// stability. Derivations and bounds: docs/stability_map.md.                       [35, 36, 37, 39]
#include "linearize/stability_map.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "linearize/balance.hpp"
#include "linearize/batch.hpp"
#include "linearize/dispatch.hpp"
#include "linearize/routh.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using Wide = long double;
constexpr int largest = int(largest_batch_matrix);
using WideMatrix = Eigen::Matrix<Wide, Eigen::Dynamic, Eigen::Dynamic, 0, largest, largest>;
using WideVector = Eigen::Matrix<Wide, Eigen::Dynamic, 1, 0, largest, 1>;
using Sizes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, largest, largest>;

constexpr double u = std::numeric_limits<double>::epsilon() / 2;
constexpr double wide_u = double(std::numeric_limits<Wide>::epsilon()) / 2;
// Covers the rounding of the bounds themselves, sums and products of positive numbers.
constexpr double inflated = 1.01;
constexpr double underflow = 1e-190;  // more than it loses of coefficients of matrices of norm one
constexpr double rank_tolerance = 1e-10;

// A number and a bound of its error.
struct Bounded {
  Wide value = 0;
  double error = 0;
};

// Coefficients of sⁿ⁻ᵏ, k = 0 .. n.
using Polynomial = std::array<Bounded, largest + 1>;

// --- Matrices of like rows and columns, of norm one, and their terms of rank one.

void check_square(const MatrixXd& A, Index n, const char* name) {
  if (A.rows() != n || A.cols() != n || n > largest)
    throw std::invalid_argument(
        fmt::format("stability map: {} is {} x {}, not {} x {} of at most {}", name, A.rows(),
                    A.cols(), n, n, largest));
  if (!A.allFinite())
    throw std::invalid_argument(
        fmt::format("stability map: {} has an entry that is not finite", name));
}

// The similarity and the unit of frequency in which |A0| + |a| |A1| + |b| |A2| is balanced.
struct Frame {
  Balanced balanced;
  double unit = 1.0;  // rad/s, a power of two

  explicit Frame(const MatrixXd& sizes) {
    const double top = sizes.maxCoeff();
    if (!std::isfinite(top))
      throw std::invalid_argument("stability map: gains times matrices leave the range of doubles");
    const double first = top > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(top), -1000, 1000)) : 1.0;
    balanced = balance(sizes / first);
    const double norm = balanced.B.rowwise().sum().maxCoeff();
    const double second = norm > 0 ? std::ldexp(1.0, std::ilogb(norm)) : 1.0;
    balanced.B /= second;
    unit = first * second;
  }
  // In one step, so that nothing is lost that is not far below rounding of the whole.
  Sizes of(const MatrixXd& A) const {
    Sizes B(A.rows(), A.cols());
    const int down = std::ilogb(unit);
    for (Index i = 0; i < B.rows(); ++i)
      for (Index j = 0; j < B.cols(); ++j)
        B(i, j) = std::scalbn(A(balanced.order[std::size_t(i)], balanced.order[std::size_t(j)]),
                              std::ilogb(balanced.scale[j]) - std::ilogb(balanced.scale[i]) - down);
    return B;
  }
};

// u vᵀ, and what of the matrix it leaves over.
struct RankOne {
  WideVector u, v;
  Sizes left_over;
};

RankOne rank_one(const Sizes& A, const char* name) {
  const Index n = A.rows();
  RankOne r{WideVector::Zero(n), WideVector::Zero(n), Sizes::Zero(n, n)};
  Index i = 0, j = 0;
  if (n == 0 || A.cwiseAbs().maxCoeff(&i, &j) == 0) return r;
  r.u = A.col(j).cast<Wide>() / Wide(A(i, j));
  r.v = A.row(i).transpose().cast<Wide>();
  const WideMatrix product = r.u * r.v.transpose();
  const Sizes size = product.cwiseAbs().cast<double>();
  r.left_over = (A.cast<Wide>() - product).cwiseAbs().cast<double>();
  if (!(r.left_over.norm() <= rank_tolerance * A.norm()))
    throw std::invalid_argument(fmt::format("stability map: {} is not of rank one", name));
  r.left_over = inflated * (r.left_over + 2 * wide_u * size);
  return r;
}

// Of a perturbation of Frobenius norm φ and a matrix of columns at most hⱼ long,
//   |δcₖ| <= √(n - k + 1) φ eₖ₋₁(h + φ)                                                    [36]
std::array<double, largest + 1> perturbation(const Sizes& sizes, double phi) {
  const Index n = sizes.cols();
  std::array<double, largest + 1> e{1.0}, error{};
  for (Index j = 0; j < n; ++j) {
    const double column = sizes.col(j).norm() + phi;
    for (Index k = j + 1; k > 0; --k) e[std::size_t(k)] += column * e[std::size_t(k - 1)];
  }
  for (Index k = 1; k <= n; ++k)
    error[std::size_t(k)] =
        inflated * std::sqrt(double(n - k + 1)) * phi * e[std::size_t(k - 1)] + underflow;
  return error;
}

// det(sI - A - t u vᵀ) = p + t q: p = det(sI - A), q = -vᵀ adj(sI - A) u, by Faddeev's method with
// running bounds: adj(sI - A) = Σ Bₖ sⁿ⁻¹⁻ᵏ, B₀ = I, Bₖ = A Bₖ₋₁ + cₖ I, cₖ = -tr(A Bₖ₋₁)/k.
//                                                                             [37, vol. 1, ch. 4]
struct Pencil {
  Polynomial p{}, q{};
};

Pencil pencil(const WideMatrix& A, const Sizes& A_error, const WideVector& right,
              const WideVector& left) {
  const Index n = A.rows();
  const double rounding = inflated * double(n + 2) * wide_u;
  const Sizes size = A.cwiseAbs().cast<double>(), own = A_error + rounding * size;
  const Sizes whole = size + A_error, right_size = right.cwiseAbs().cast<double>(),
              left_size = left.transpose().cwiseAbs().cast<double>();
  Pencil result;
  result.p[0].value = 1;
  WideMatrix B = WideMatrix::Identity(n, n), next(n, n);
  Sizes error = Sizes::Zero(n, n), B_size(n, n), next_error(n, n);
  for (Index k = 1; k <= n; ++k) {
    B_size = B.cwiseAbs().cast<double>();
    const Sizes off = (error + 2 * rounding * B_size).lazyProduct(right_size);
    result.q[std::size_t(k)] = {-left.dot(B.lazyProduct(right).eval()),
                                inflated * left_size.lazyProduct(off).value()};
    next.noalias() = A.lazyProduct(B);
    next_error.noalias() = whole.lazyProduct(error) + own.lazyProduct(B_size);
    Bounded& c = result.p[std::size_t(k)];
    const Wide trace = next.trace();
    const double sizes = double(next.diagonal().cwiseAbs().sum());
    c.value = -trace / Wide(k);
    c.error = inflated * (next_error.trace() + rounding * sizes) / double(k) +
              wide_u * double(std::abs(c.value));
    B.swap(next);
    B.diagonal().array() += c.value;
    error.swap(next_error);
    error.diagonal().array() += c.error + wide_u * B.diagonal().cwiseAbs().cast<double>().array();
  }
  return result;
}

// --- The map.

// Polynomials at a = 0 and a = reach, between and beyond which both coefficients are linear in a.
struct Plane {
  Index n;
  Pencil near, far;
  double reach;
  std::array<double, largest + 1> left_over;  // errors of coefficients, anywhere on the map
};

double reach(std::span<const double> gains) {
  double most = 0;
  for (const double gain : gains) {
    if (!std::isfinite(gain)) throw std::invalid_argument("stability map: a gain is not finite");
    most = std::max(most, std::abs(gain));
  }
  return most;
}

Plane plane(const AffineFamily& family, double a_most, double b_most) {
  const MatrixXd sizes =
      family.A0.cwiseAbs() + a_most * family.A1.cwiseAbs() + b_most * family.A2.cwiseAbs();
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
  result.near = pencil(A0, Sizes::Zero(result.n, result.n), two.u, two.v);
  result.far = pencil(far, rounding, two.u, two.v);
  return result;
}

// (1 - t) near + t far, rounded to a double; the error includes that rounding and another.
Bounded between(const Bounded& near, const Bounded& far, Wide t) {
  const Wide first = (1 - t) * near.value, second = t * far.value, value = first + second;
  const double rounding = 4 * wide_u * double(std::abs(first) + std::abs(second));
  return {value,
          inflated * (double(std::abs(1 - t)) * near.error + double(std::abs(t)) * far.error +
                      rounding + 2 * u * double(std::abs(value)))};
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

Verdict by_eigenvalues(const AffineFamily& family, double a, double b) {
  const MatrixXd A = family.A0 + a * family.A1 + b * family.A2;
  const MatrixXd size = family.A0.cwiseAbs() + std::abs(a) * family.A1.cwiseAbs() +
                        std::abs(b) * family.A2.cwiseAbs();
  return modes(A, 4 * u * size).verdict;
}

void check_family(const AffineFamily& family) {
  const Index n = family.A0.rows();
  check_square(family.A0, n, "A0");
  check_square(family.A1, n, "A1");
  check_square(family.A2, n, "A2");
}

}  // namespace

void stability_map(const AffineFamily& family, std::span<const double> a, std::span<const double> b,
                   std::span<Verdict> answer) {
  check_family(family);
  if (answer.size() != a.size() * b.size())
    throw std::invalid_argument(fmt::format("stability map: {} x {} points, room for {} verdicts",
                                            a.size(), b.size(), answer.size()));
  const double a_most = reach(a), b_most = reach(b);
  if (family.A0.rows() == 0) {
    std::ranges::fill(answer, Verdict::stable);
    return;
  }
  const Plane all = plane(family, a_most, b_most);
  const auto kernel = chosen(&lanes_scalar::routh_of_line, &lanes_baseline::routh_of_line,
                             &lanes_avx2::routh_of_line, &lanes_avx512::routh_of_line);
  std::vector<RouthVerdict> said(b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Line row = line(all, a[i]);
    kernel({row.p.data(), row.q.data(), row.p_error.data(), row.q_error.data(), std::size_t(all.n),
            b.data(), b.size(), said.data()});
    Verdict* const verdict = answer.data() + i * b.size();
    for (std::size_t j = 0; j < b.size(); ++j) verdict[j] = static_cast<Verdict>(said[j]);
    for (std::size_t j = 0; j < b.size(); ++j)
      if (verdict[j] == Verdict::undecided) verdict[j] = by_eigenvalues(family, a[i], b[j]);
  }
}

std::vector<Verdict> stability_map(const AffineFamily& family, const std::vector<double>& a,
                                   const std::vector<double>& b) {
  std::vector<Verdict> answer(a.size() * b.size());
  stability_map(family, a, b, answer);
  return answer;
}

// --- Crossings along a line.

namespace {

// A real polynomial in x, lowest power first, with bounds of its coefficients' errors.
struct Series {
  std::vector<Wide> c;
  std::vector<double> error;

  Wide value(Wide x) const {
    Wide sum = 0;
    for (std::size_t k = c.size(); k-- > 0;) sum = sum * x + c[k];
    return sum;
  }
  Wide slope(Wide x) const {
    Wide sum = 0;
    for (std::size_t k = c.size(); k-- > 1;) sum = sum * x + Wide(k) * c[k];
    return sum;
  }
  // Of the value, for x >= 0.
  double bound(double x) const {
    double sum = 0;
    for (std::size_t k = c.size(); k-- > 0;)
      sum = sum * x + error[k] + 2 * double(c.size()) * wide_u * double(std::abs(c[k]));
    return inflated * sum;
  }
};

// The even or odd part of a polynomial of degree n at s = iω: Σ ±c x^m of s^(2m) or s^(2m+1), x =
// ω².
Series part(const Polynomial& p, std::size_t n, std::size_t odd) {
  Series s;
  for (std::size_t m = 0; 2 * m + odd <= n; ++m) {
    const Bounded& c = p[n - 2 * m - odd];
    s.c.push_back(m % 2 == 0 ? c.value : -c.value);
    s.error.push_back(c.error);
  }
  if (s.c.empty()) return {{0}, {0}};
  return s;
}

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

// The root of a monotonic stretch from a sign to the other: Newton, halved where it leaves.
Wide root_between(const Series& s, Wide low, Wide high) {
  const bool rising = s.value(high) > 0;
  constexpr int cap = 200;  // halvings alone need as many as a Wide and its exponents have bits
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

// Roots in (0, most), and places where one or two may be that rounding hides: between the roots of
// its derivative a polynomial has one root if its signs there differ, else none.
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

// p0 and p1 at s = iω, by x = ω²: E + iω O.
struct OnAxis {
  Series E0, O0, E1, O1;

  OnAxis(const Pencil& pencil, std::size_t n)
      : E0(part(pencil.p, n, 0)),
        O0(part(pencil.p, n, 1)),
        E1(part(pencil.q, n, 0)),
        O1(part(pencil.q, n, 1)) {}
};

// Where on the line iω is an eigenvalue, if it is; |τ| <= 1 is on it.
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
  constexpr double margin = 1e-6;  // for places known to rounding only
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

// A root x of g within error: g has opposite signs on both sides, for certain.
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

// What A1 is off rank one by counts at the ends of the stretch, not in its middle.
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

// The crossing at ω² = x if it lies on the line, within what is known of it.
std::optional<LineCrossing> crossing(const Stretch& line, const Place& at, Wide x) {
  if (at.where != Place::on || !(double(std::abs(at.tau)) <= 1 + at.error)) return std::nullopt;
  const double t = line.middle + line.half * double(std::clamp(at.tau, Wide(-1), Wide(1)));
  return LineCrossing{t, line.unit * double(std::sqrt(x)),
                      line.half * at.error + 2 * u * (std::abs(t) + line.half)};
}

// The same crossing from a stretch about it that is hardly longer than its error.
LineCrossing refined(const LineCrossing& rough, const MatrixXd& A0, const MatrixXd& A1) {
  const double around = 4 * rough.error;
  const Stretch line = stretch(A0, A1, rough.t - around, rough.t + around);
  const Series g = on_axis(line.axis);
  Wide x = std::pow(Wide(rough.frequency) / Wide(line.unit), Wide(2));
  constexpr int steps = 4;  // Newton's, from half the digits at least
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

// The eigenvalues do not move with t: crossings there are none, unless one is on the axis.
bool clear_of_axis(const MatrixXd& A) {
  return std::ranges::all_of(modes(A).modes, [](const Mode& mode) {
    return std::abs(mode.eigenvalue.real()) > mode.error;
  });
}

}  // namespace

//   Im(p0 conj p1)/ω = O0 E1 - E0 O1 = g(ω²);  at ω = 0  τ = -p0(0)/p1(0)                  [39]
LineCrossings line_crossings(const MatrixXd& A0, const MatrixXd& A1, double from, double to) {
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
  constexpr double most = 4.1;  // the frame's matrices have norms below 2, and so eigenvalues
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
