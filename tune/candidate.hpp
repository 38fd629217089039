/// One choice of gains at all operating points: trims, eigenvalues, and how they move with the
/// gains. Internal to tune/.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sweep/neighbour.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// Eigenvalues at one operating point.
struct PointModes {
  TrimStatus status = TrimStatus::not_found;
  std::string message;
  OperatingPoint at;
  Eigen::MatrixXd A;
  Eigen::VectorXcd eigenvalues;
  Eigen::MatrixXcd slopes;  ///< dλ/dgain, [eigenvalue, gain], the trim's shift included; if asked

  bool valid() const { return eigenvalues.size() > 0; }
};

/// The points made ready, each with the equilibrium it was last at.
class Candidates {
 public:
  Candidates(const TuneProblem& problem, const TrimOptions& trimming);

  const TuneProblem& problem() const { return problem_; }
  /// At gains in SI units.
  std::vector<PointModes> at(const Eigen::VectorXd& gains, bool slopes);
  /// The same from trims of their own, not from a neighbour's.
  std::vector<PointModes> anew(const Eigen::VectorXd& gains);

 private:
  struct Point {
    std::unique_ptr<Prepared> prepared;
    std::vector<Eigen::Index> gains;        // variables of the model
    std::optional<OperatingPoint> nearest;  // an equilibrium at other gains
  };
  PointModes modes(Point& point, const Eigen::VectorXd& gains, bool slopes, bool anew);

  const TuneProblem& problem_;
  std::vector<Point> points_;
};

}  // namespace tiltrim
