/// Aerodynamic coefficients over the full circle: a periodic C2 cubic spline through a table.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "model/signal.hpp"

namespace tiltrim {

/// Lift, drag and pitching-moment coefficients.
struct Coefficients {
  double CL, CD, CM;
};

/// CL, CD, CM over the angle of attack with period 2π, twice continuously differentiable.
///
/// The spline is the periodic cubic one (three conditions join the ends: value, slope and
/// curvature), as SciPy's CubicSpline(bc_type="periodic"). Knots may be unevenly spaced.
class Polar {
 public:
  /// `alpha` rising, from -π to π, first and last coefficients equal; at least 4 rows.
  /// Throws std::invalid_argument that names the row otherwise.
  Polar(const std::vector<double>& alpha, const std::vector<Coefficients>& rows);

  Coefficients at(double alpha) const;

  /// Values and slopes [1/rad] in one look-up.
  struct Slope {
    Coefficients value, slope;
  };
  Slope slope_at(double alpha) const;

  /// Ranges of CL, CD, CM over alpha in [lower, upper]: exact extremes of the cubics.
  std::array<Range, 3> range(double lower, double upper) const;

 private:
  struct Piece {
    // c[k][i]: coefficient of t^i of the k-th curve, t = alpha - start
    std::array<std::array<double, 4>, 3> c;
    double start, width;
    std::array<Range, 3> range;
  };
  struct Place {
    const Piece* piece;
    double t;
  };
  Place place(double alpha) const;

  std::vector<Piece> pieces_;
  double first_ = 0.0;
  double per_radian_ = 0.0;  // pieces per radian if evenly spaced, else 0
};

/// Reads `alpha_deg,CL,CD,CM` rows below a header line of that form; lines starting with # are
/// comments. Throws std::runtime_error "file:line: what is wrong".
Polar load_polar(const std::filesystem::path& file);

}  // namespace tiltrim
