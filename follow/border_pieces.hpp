/// The border of an envelope, followed piece by piece through the points where sheets of trims end.
/// Internal to follow/.
#pragma once

#include "follow/grid.hpp"

namespace tiltrim {

/// A point where a sheet ends.
struct Seed {
  Stop stop;
  Eigen::VectorXd y;
  bool on_fold = false;  ///< where a limit meets a fold: the limits of two sheets begin here
};

struct Followed {
  BorderPiece piece;  ///< without points: reported() makes them of the way's
  Stop stop;
  std::vector<Eigen::VectorXd> way;
  Eigen::VectorXd low{}, high{};  ///< of the way
  double mean_step = 0.0, longest_step = 0.0;
};

/// The end of a piece that has as many points as one may have.
inline constexpr const char* cut_off = "too many points";

/// Follows the border through every seed that none of the pieces passes, and from the corners met
/// on the way.
void follow_border(const Grid& grid, std::deque<Seed>& seeds, std::vector<Followed>& pieces);

/// A point of a piece's way, with its outputs and residual.
BorderPiece::Point reported(const Grid& grid, const Eigen::VectorXd& y);

/// The curve's point in the plane direction · y = level, by Newton from y; none if a step is longer
/// than `longest`.
std::optional<Eigen::VectorXd> in_plane(const Curve& curve, Eigen::VectorXd y,
                                        const Eigen::VectorXd& direction, double level,
                                        double longest);

}  // namespace tiltrim
