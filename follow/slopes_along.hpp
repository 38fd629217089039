/// Slopes of a model along a direction of all its variables, and whether they exist. Internal to
/// follow/.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "model/differentiate.hpp"
#include "model/model.hpp"

namespace tiltrim {

inline constexpr double last_digit = std::numeric_limits<double>::epsilon();

/// Of a function at t = 0, by samples at -2t, -t, 0, t and 2t.
template <class T>
struct Slopes {
  T near, far;       ///< central differences over t and 2t
  T bend, far_bend;  ///< by how much the one-sided ones differ; far_bend = 2 bend if it is smooth
};

/// By how much `near` may be off. `noise`: of a slope. Near a kink or jump far_bend is not 2 bend,
/// as in model/differentiate.cpp; at a pole, or next to a kink, `near` and `far` differ.
double doubt(const Slopes<std::complex<double>>& slopes, double noise);

/// Samples of a function along a direction of all variables, over ever shorter steps.
struct SlopesAlong {
  using Function = std::function<Estimate(const OperatingPoint& at)>;
  static constexpr int lengths = 4;  ///< of steps
  static constexpr double shorter = 1.0 / 8;

  const OperatingPoint& at;
  const Eigen::VectorXd& direction;
  double step;  ///< the longest
  Function function;
  Estimate here;

  struct Level {
    Slopes<Eigen::MatrixXd> slopes;
    Eigen::MatrixXd noise;     ///< of a slope
    Eigen::MatrixXd rounding;  ///< of `near` and `far` together
  };
  std::vector<Level> levels{};

  Estimate sample(double t) const;  ///< NaN where the model throws
  const Level& level(int i);
};

/// Doubt, and the size that it is compared with.
struct Judged {
  double doubt, size;
};
/// The level at which a slope is that of a smooth function, and what doubt is left.
struct Smooth {
  int level;
  double doubt;
};
/// None at a kink or a pole, where shorter steps do not help. `judge`: Judged of a level.
template <class Judge>
std::optional<Smooth> settled(const Judge& judge) {
  constexpr double share = 1e-3, helped = 0.25;
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < SlopesAlong::lengths; ++i) {
    const Judged now = judge(i);
    if (now.doubt <= share * now.size) return Smooth{i, now.doubt};
    if (!std::isfinite(now.doubt) || now.doubt > helped * last) return {};
    last = now.doubt;
  }
  return Smooth{SlopesAlong::lengths - 1, last};
}

/// Values or nominal sizes of all variables, whichever are larger.
Eigen::VectorXd sizes_at(const Model& model, const OperatingPoint& at);

/// A along a direction, and its slope at a level. The slope's error: the change when the step is
/// doubled, and what rounding leaves of the Jacobians and of the step.
SlopesAlong jacobians_along(const Model& model, const OperatingPoint& at,
                            const Eigen::VectorXd& direction);
Estimate jacobian_slope(const Model& model, const SlopesAlong::Level& level, int shortened);

/// [f; h] along a direction. `terms`: sizes of what cancels in them.
SlopesAlong rates_along(const Model& model, const OperatingPoint& at,
                        const Eigen::VectorXd& direction, const Eigen::VectorXd& terms);
/// Whether a row of [f; h] has a derivative along the direction; that of an equation of the trim is
/// zero. `size`: of the terms of the derivative.
bool row_settles(SlopesAlong& along, Eigen::Index row, double size, bool equation);

}  // namespace tiltrim
