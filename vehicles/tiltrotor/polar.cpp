#include "vehicles/tiltrotor/polar.hpp"

#include <fmt/core.h>
#include <fmt/std.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "dense/dense.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using std::numbers::pi;

// Extremes of a cubic over [a, b]: at the ends and at the roots of its derivative.
Range Polar::Cubic::extremes(double a, double b) const {
  Range r{std::min(at(a), at(b)), std::max(at(a), at(b))};
  const auto include = [&](double t) {
    if (!(t > a && t < b)) return;
    r.lower = std::min(r.lower, at(t));
    r.upper = std::max(r.upper, at(t));
  };
  // 3 c3 t² + 2 c2 t + c1 = 0, by the form without cancellation
  const double discriminant = c2 * c2 - 3 * c3 * c1;
  if (discriminant >= 0) {
    const double s = -(c2 + std::copysign(std::sqrt(discriminant), c2));
    include(s / (3 * c3));
    include(c1 / s);
  }
  return r;
}

// Second derivatives at the knots of the periodic cubic spline:
//   h₋ M₋ + 2 (h₋ + h₊) M + h₊ M₊ = 6 ((y₊ - y)/h₊ - (y - y₋)/h₋), indices modulo n  [6, eq. 3.3.7]
static Eigen::MatrixXd knot_curvatures(const std::vector<double>& h, const Eigen::MatrixXd& y) {
  const auto n = static_cast<Eigen::Index>(h.size());
  Eigen::VectorXd at(n), to_next(n);
  Eigen::MatrixXd rhs(n, y.cols());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index before = (i + n - 1) % n;
    const Eigen::Index after = (i + 1) % n;
    const double hb = h[std::size_t(before)];
    const double ha = h[std::size_t(i)];
    at[i] = 2 * (hb + ha);
    to_next[i] = ha;
    rhs.row(i) = 6 * ((y.row(after) - y.row(i)) / ha - (y.row(i) - y.row(before)) / hb);
  }
  return dense::solve_cyclic(at, to_next, rhs);
}

// The curvatures of the exact spline. The matrix of the equations exceeds its off-diagonal by
// h₋ + h₊ in every row, so the error is at most the largest residual over the least h₋ + h₊.
static std::vector<Interval> enclosed_curvatures(const std::vector<Interval>& h,
                                                 const Eigen::VectorXd& y,
                                                 const Eigen::VectorXd& M) {
  const std::size_t n = h.size();
  double residual = 0, least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = (i + n - 1) % n, after = (i + 1) % n;
    const Interval &hb = h[before], &ha = h[i];
    const auto at = [](const Eigen::VectorXd& v, std::size_t k) {
      return Interval(v[Eigen::Index(k)]);
    };
    const Interval left = hb * at(M, before) + 2.0 * (hb + ha) * at(M, i) + ha * at(M, after);
    const Interval right = 6.0 * ((at(y, after) - at(y, i)) / ha - (at(y, i) - at(y, before)) / hb);
    residual = std::max(residual, magnitude(left - right));
    least = std::min(least, (hb + ha).lower());
  }
  const double error = Interval::up(residual / least);
  std::vector<Interval> enclosed;
  for (const double m : M) enclosed.push_back(Interval::around(m - error, m + error));
  return enclosed;
}

static void check_table(const std::vector<double>& alpha, const std::vector<Coefficients>& rows) {
  const auto refuse = [](std::size_t row, std::string_view why) {
    throw std::invalid_argument(fmt::format("polar row {}: {}", row + 1, why));
  };
  if (alpha.size() != rows.size() || rows.size() < 4)
    throw std::invalid_argument(
        fmt::format("a polar needs at least 4 rows, got {}", std::min(alpha.size(), rows.size())));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!std::isfinite(alpha[i] + rows[i].CL + rows[i].CD + rows[i].CM))
      refuse(i, "a value is not finite");
    if (i > 0 && !(alpha[i] > alpha[i - 1])) refuse(i, "alpha does not increase");
  }
  constexpr double slack = 1e-9;  // π printed with ten digits is accepted as the end
  if (std::abs(alpha.front() + pi) > slack || std::abs(alpha.back() - pi) > slack)
    throw std::invalid_argument("a polar must run from -180 to 180 degrees");
  const Coefficients& a = rows.front();
  const Coefficients& b = rows.back();
  if (a.CL != b.CL || a.CD != b.CD || a.CM != b.CM)
    refuse(rows.size() - 1,
           "the polar is not periodic: the coefficients at 180 degrees differ from "
           "those at -180 degrees");
}

Polar::Polar(const std::vector<double>& alpha, const std::vector<Coefficients>& rows)
    : knots_(alpha), rows_(rows) {
  const RoundToNearest environment;
  check_table(alpha, rows);
  const std::size_t n = rows.size() - 1;
  std::vector<double> h(n);
  Eigen::MatrixXd y(n, 3);
  for (std::size_t i = 0; i < n; ++i) {
    h[i] = alpha[i + 1] - alpha[i];
    y.row(Eigen::Index(i)) << rows[i].CL, rows[i].CD, rows[i].CM;
  }
  const Eigen::MatrixXd M = knot_curvatures(h, y);
  for (std::size_t i = 0; i < n; ++i) {
    Piece piece{{}, alpha[i], h[i], {}};
    const auto here = Eigen::Index(i);
    const auto next = Eigen::Index((i + 1) % n);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto c = Eigen::Index(k);
      const double slope =
          (y(next, c) - y(here, c)) / h[i] - h[i] / 6 * (2 * M(here, c) + M(next, c));
      piece.c[k] = {y(here, c), slope, M(here, c) / 2, (M(next, c) - M(here, c)) / (6 * h[i])};
      piece.range[k] = piece.c[k].extremes(0, h[i]);
    }
    pieces_.push_back(piece);
  }
  std::vector<Interval> exact_h;
  for (std::size_t i = 0; i < n; ++i) {
    exact_h.push_back(Interval(alpha[i + 1]) - Interval(alpha[i]));
    enclosed_.push_back({{}, alpha[i], exact_h[i].upper(), {}});
  }
  for (Eigen::Index c = 0; c < 3; ++c) {
    const std::vector<Interval> curve = enclosed_curvatures(exact_h, y.col(c), M.col(c));
    for (std::size_t i = 0; i < n; ++i) {
      const Interval &m = curve[i], &next = curve[(i + 1) % n], &width = exact_h[i];
      const Interval here = y(Eigen::Index(i), c), there = y(Eigen::Index((i + 1) % n), c);
      enclosed_[i].c[std::size_t(c)] = {here,
                                        (there - here) / width - width / 6.0 * (2.0 * m + next),
                                        m / 2.0, (next - m) / (6.0 * width)};
    }
  }
  for (Enclosed& piece : enclosed_) piece.whole = piece.over({0.0, piece.width});
  first_ = alpha.front();
  const auto [least, most] = std::ranges::minmax(h);
  if (most - least < 1e-9 * most) per_radian_ = static_cast<double>(n) / (2 * pi);
}

double Polar::wrapped(double turned) {
  const double rest = turned - 2 * pi * std::floor(turned / (2 * pi));
  return std::clamp(rest, 0.0, 2 * pi);  // round-off may leave the circle
}

std::size_t Polar::piece_below(double alpha) const {
  const auto above = std::ranges::upper_bound(pieces_, alpha, {}, &Piece::start);
  return above == pieces_.begin() ? 0 : static_cast<std::size_t>(above - pieces_.begin()) - 1;
}

std::array<Range, 3> Polar::range(double lower, double upper) const {
  std::array<Range, 3> all;
  const auto widen = [](Range& r, const Range& by) {
    r = {std::min(r.lower, by.lower), std::max(r.upper, by.upper)};
  };
  all.fill({std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()});
  if (!(upper - lower < 2 * pi)) {
    for (const Piece& piece : pieces_)
      for (std::size_t k = 0; k < 3; ++k) widen(all[k], piece.range[k]);
    return all;
  }
  Place from = place(lower);
  double left = upper - lower;
  for (std::size_t step = 0; step <= pieces_.size(); ++step) {
    const double to = std::min(from.t + left, from.piece->width);
    const bool whole = from.t <= 0 && to >= from.piece->width;
    for (std::size_t k = 0; k < 3; ++k)
      widen(all[k], whole ? from.piece->range[k] : from.piece->c[k].extremes(from.t, to));
    left -= to - from.t;
    if (!(left > 0)) break;
    from = {from.piece == &pieces_.back() ? &pieces_.front() : from.piece + 1, 0.0};
  }
  return all;
}

// Taylor's form about the middle of t.
std::array<Polar::Ranges, 3> Polar::Enclosed::over(const Interval& t) const {
  std::array<Ranges, 3> all;
  const Interval m = middle(t), d(-radius(t), radius(t));
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& [c0, c1, c2, c3] = c[k];
    const Interval value = c0 + m * (c1 + m * (c2 + m * c3));
    const Interval slope = c1 + m * (2.0 * c2 + m * (3.0 * c3));
    const Interval half = c2 + 3.0 * c3 * m;
    all[k] = {value + d * slope + square(d) * half + square(d) * d * c3,
              slope + d * (2.0 * half) + square(d) * (3.0 * c3), 2.0 * half + 6.0 * c3 * d};
  }
  return all;
}

std::array<Polar::Ranges, 3> Polar::ranges(const Interval& alpha) const {
  std::array<Ranges, 3> all;
  if (!alpha.finite()) {
    all.fill({Interval::unknown(), Interval::unknown(), Interval::unknown()});
    return all;
  }
  // Beyond the table, which wraps around, any piece may hold.
  const bool inside = alpha.lower() >= knots_.front() && alpha.upper() <= knots_.back();
  const double from = inside ? alpha.lower() : knots_.front();
  const double to = inside ? alpha.upper() : knots_.back();
  bool any = false;
  for (std::size_t i = from < to || inside ? piece_below(from) : 0; i < enclosed_.size(); ++i) {
    const Enclosed& piece = enclosed_[i];
    if (piece.start > to) break;
    const Interval low = Interval(from) - Interval(piece.start);
    const Interval high = Interval(to) - Interval(piece.start);
    const Interval t(std::max(0.0, low.lower()), std::min(piece.width, high.upper()));
    const bool whole = t.lower() == 0 && t.upper() == piece.width;
    const std::array<Ranges, 3> here = whole ? piece.whole : piece.over(t);
    for (std::size_t k = 0; k < 3; ++k)
      all[k] = any ? Ranges{hull(all[k].value, here[k].value), hull(all[k].slope, here[k].slope),
                            hull(all[k].curvature, here[k].curvature)}
                   : here[k];
    any = true;
  }
  return all;
}

// A bound of |cubic - parabola| on [from, to] within the piece, by Taylor's form about the middle;
// the parabola is about m.
double Polar::Enclosed::distance(std::size_t k, bool slope, const std::array<double, 3>& parabola,
                                 double m, double from, double to) const {
  const double at = 0.5 * (from + to);
  const Interval t = Interval(at) - start, off = Interval(at) - m;
  const double h = radius(Interval(from, to));
  const auto& [c0, c1, c2, c3] = c[k];
  const auto& [q0, q1, q2] = parabola;
  const Interval value =
      slope ? c1 + t * (2.0 * c2 + t * (3.0 * c3)) : c0 + t * (c1 + t * (c2 + t * c3));
  const Interval first = slope ? 2.0 * c2 + t * (6.0 * c3) : c1 + t * (2.0 * c2 + t * (3.0 * c3));
  const Interval half = slope ? 3.0 * c3 : c2 + t * (3.0 * c3);
  const double third = slope ? 0.0 : magnitude(c3);
  const double sum = magnitude(value - (q0 + off * (q1 + off * Interval(q2)))) +
                     h * (magnitude(first - (q1 + off * Interval(2 * q2))) +
                          h * (magnitude(half - Interval(q2)) + h * third));
  return std::isfinite(sum) ? sum * (1 + 1e-12) : std::numeric_limits<double>::infinity();
}

std::array<Polar::Fit, 3> Polar::fits(const Interval& alpha, double c, bool slope) const {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::array<Fit, 3> all;
  all.fill({{}, {}, {}, infinite});
  if (!(alpha.lower() >= knots_.front() && alpha.upper() <= knots_.back())) return all;
  const std::size_t first = piece_below(alpha.lower()), last = piece_below(alpha.upper());
  constexpr std::size_t many = 24;  // over so many pieces no parabola is near
  if (last - first > many) {
    const auto over = ranges(alpha);
    for (std::size_t k = 0; k < 3; ++k) {
      const Interval& of = slope ? over[k].slope : over[k].value;
      all[k] = {middle(of), {}, {}, radius(of)};
    }
    return all;
  }
  // Through the Chebyshev nodes of the range.
  const double m = middle(alpha), node = 0.5 * std::sqrt(3.0) * std::max(radius(alpha), 1e-6);
  std::array<std::array<double, 3>, 3> q;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = [&](double x) {
      const auto [v, s] = slope_at(x);
      const Coefficients& own = slope ? s : v;
      return std::array{own.CL, own.CD, own.CM}[k];
    };
    const double low = value(m - node), here = value(m), high = value(m + node);
    q[k] = {here, (high - low) / (2 * node), 0.5 * ((high - here) - (here - low)) / (node * node)};
    const Interval off = Interval(c) - m;
    all[k] = {q[k][0] + off * (q[k][1] + off * Interval(q[k][2])),
              q[k][1] + off * Interval(2 * q[k][2]), 2.0 * Interval(q[k][2]), 0.0};
  }
  const std::size_t parts = last - first > 1 ? 1 : 4;
  for (std::size_t i = first; i <= last; ++i) {
    const double from = std::max(alpha.lower(), enclosed_[i].start);
    const double to = i == last ? alpha.upper() : enclosed_[i + 1].start;
    for (std::size_t j = 0; j < parts; ++j) {
      const double a = std::lerp(from, to, double(j) / double(parts));
      const double b = std::lerp(from, to, double(j + 1) / double(parts));
      for (std::size_t k = 0; k < 3; ++k)
        all[k].error = std::max(all[k].error, enclosed_[i].distance(k, slope, q[k], m, a, b));
    }
  }
  return all;
}

Polar load_polar(const std::filesystem::path& file) {
  constexpr std::uintmax_t largest = 4 << 20;  // bytes; a polar has hundreds of rows, not millions
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) throw std::runtime_error(fmt::format("{}: {}", file.string(), error.message()));
  if (size > largest)
    throw std::runtime_error(fmt::format("{}: {} bytes is too large for a polar (limit {})",
                                         file.string(), size, largest));
  std::ifstream in(file);
  if (!in) throw std::runtime_error(fmt::format("{}: cannot be read", file.string()));

  std::vector<double> alpha;
  std::vector<Coefficients> rows;
  bool header = false;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto refuse = [&](std::string_view why) {
      throw std::runtime_error(fmt::format("{}:{}: {}", file.string(), number, why));
    };
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    if (!header) {
      if (line != "alpha_deg,CL,CD,CM") refuse("expected the header 'alpha_deg,CL,CD,CM'");
      header = true;
      continue;
    }
    std::array<double, 4> v{};
    const char* at = line.data();
    const char* const end = at + line.size();
    for (std::size_t k = 0; k < 4; ++k) {
      const auto [next, failed] = std::from_chars(at, end, v[k]);
      const bool ended = next == end || *next == ',';
      if (failed != std::errc{} || !ended || (k < 3) != (next != end) || !std::isfinite(v[k]))
        refuse(fmt::format("column {} is not a number, or the row does not have four", k + 1));
      at = next + 1;
    }
    alpha.push_back(v[0] * (pi / 180));
    rows.push_back({v[1], v[2], v[3]});
    if (alpha.size() > 1 && !(alpha.back() > alpha[alpha.size() - 2]))
      refuse("alpha does not increase");
  }
  try {
    return {alpha, rows};
  } catch (const std::invalid_argument& e) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), e.what()));
  }
}

}  // namespace tiltrim
