/// @file
/// Aerodynamic coefficients over the full circle: a periodic C2 cubic spline through a table.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "model/interval.hpp"
#include "model/model.hpp"

namespace tiltrim {

namespace physics {
struct PolarRows;  // reads the pieces for the kernels in SIMD lanes
}

/// Lift, drag and pitching-moment coefficients.
struct Coefficients {
  double CL, CD, CM;  ///< CL up, CM nose up
};

/// CL, CD, CM over the angle of attack with period 2π, twice continuously differentiable.
///
/// A periodic cubic spline (value, slope and curvature match at the ends), as SciPy's
/// CubicSpline(bc_type="periodic"). Knots may be unevenly spaced.
class Polar {
 public:
  /// `alpha` ascending, from -π to π, first and last coefficients equal; at least 4 rows.
  /// Otherwise throws std::invalid_argument, naming the row.
  Polar(const std::vector<double>& alpha, const std::vector<Coefficients>& rows);

  Coefficients at(double alpha) const;  ///< any alpha, rad; NaN if it is not finite

  /// Values and derivatives [1/rad] in one look-up.
  struct Slope {
    Coefficients value, slope;  ///< slope in 1/rad
  };
  Slope slope_at(double alpha) const;  ///< derivative of at()

  /// Ranges of CL, CD, CM over alpha in [lower, upper]: the exact extremes of the cubics.
  std::array<Range, 3> range(double lower, double upper) const;

  /// Of the exact spline through the table, over alpha: rounded outward.
  struct Ranges {
    Interval value, slope, curvature;  ///< per rad, per rad²
  };
  std::array<Ranges, 3> ranges(const Interval& alpha) const;  ///< of CL, CD, CM

  /// A parabola near the exact spline, or near its slope: g + g1 (α - c) + ½ g2 (α - c)² ± error.
  struct Fit {
    Interval g, g1, g2;  ///< about c
    double error;        ///< a bound over the range; infinite beyond the table
  };
  /// Of CL, CD, CM over alpha, about c; of their slopes if `slope`.
  std::array<Fit, 3> fits(const Interval& alpha, double c, bool slope) const;

  /// The table.
  const std::vector<double>& knots() const { return knots_; }      ///< alpha, rad
  const std::vector<Coefficients>& rows() const { return rows_; }  ///< at the knots

 private:
  friend struct physics::PolarRows;

  // Coefficients of the exact spline on one piece, over t = alpha - start.
  struct Enclosed {
    std::array<std::array<Interval, 4>, 3> c;
    double start, width;
    std::array<Ranges, 3> whole;  // over the whole piece
    std::array<Ranges, 3> over(const Interval& t) const;
    double distance(std::size_t k, bool slope, const std::array<double, 3>& parabola, double m,
                    double from, double to) const;
  };
  // c0 + c1 t + c2 t² + c3 t³
  struct Cubic {
    double c0, c1, c2, c3;
    double at(double t) const { return c0 + t * (c1 + t * (c2 + t * c3)); }
    double slope_at(double t) const { return c1 + t * (2 * c2 + t * 3 * c3); }
    Range extremes(double a, double b) const;  // over [a, b]
  };
  struct Piece {
    std::array<Cubic, 3> c;  // CL, CD, CM over t = alpha - start
    double start, width;
    std::array<Range, 3> range;
  };
  struct Place {
    const Piece* piece;
    double t;
  };
  Place place(double alpha) const;
  static double wrapped(double turned);         // into [0, 2π]
  std::size_t piece_below(double alpha) const;  // by search if knots are uneven

  std::vector<Piece> pieces_;
  std::vector<Enclosed> enclosed_;
  std::vector<double> knots_;
  std::vector<Coefficients> rows_;
  double first_ = 0.0;
  double per_radian_ = 0.0;  // pieces per radian if evenly spaced, otherwise 0
};

inline Polar::Place Polar::place(double alpha) const {
  double turned = alpha - first_;
  if (!(turned >= 0 && turned < 2 * std::numbers::pi)) turned = wrapped(turned);
  std::size_t i = 0;
  if (!(per_radian_ > 0))
    i = piece_below(turned + first_);
  else if (turned > 0)
    i = std::min(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(turned * per_radian_)),
                 pieces_.size() - 1);
  return {&pieces_[i], turned - (pieces_[i].start - first_)};
}

inline Coefficients Polar::at(double alpha) const {
  const auto [piece, t] = place(alpha);
  return {piece->c[0].at(t), piece->c[1].at(t), piece->c[2].at(t)};
}

inline Polar::Slope Polar::slope_at(double alpha) const {
  const auto [piece, t] = place(alpha);
  const auto& [CL, CD, CM] = piece->c;
  return {{CL.at(t), CD.at(t), CM.at(t)}, {CL.slope_at(t), CD.slope_at(t), CM.slope_at(t)}};
}

/// Reads `alpha_deg,CL,CD,CM` rows after a header line of that form; lines starting with # are
/// comments. Throws std::runtime_error "file:line: reason".
Polar load_polar(const std::filesystem::path& file);

}  // namespace tiltrim
