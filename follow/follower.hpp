/// What is being followed, and what has been found so far. Internal to follow/.
#pragma once

#include "follow/follow.hpp"
#include "follow/path.hpp"

namespace tiltrim {

struct Follower {
  Problem problem;
  Path path{problem};
  double to;  ///< of the parameter, scaled
  const FollowOptions& options;
  bool stability = false;
  std::vector<std::string> moving{};  ///< states that are not to be at rest
  Branch branch{};
  std::optional<LimitName> pending{};  ///< a limit to hold, or one to let go, before going on
  CurvePoint last{};
  mutable Eigen::VectorXd seen{}, seen_real_parts{};  ///< where eigenvalues were last asked for

  Follower(Problem p, double target, const FollowOptions& o)
      : problem(std::move(p)), to(target), options(o) {}
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  double nominal() const { return problem.nominal[path.parameter()]; }
  OperatingPoint point(const CurvePoint& at) const { return point_of(problem, path.z(at.y)); }
};

/// Real parts of the eigenvalues, largest first; one that is zero to rounding counts as stable. NaN
/// where there are none.
const Eigen::VectorXd& real_parts(const Follower& f, const CurvePoint& at);

BranchPoint reported(const Follower& f, const CurvePoint& at);
/// How well slopes along the branch are known, relative to their size.
double slope_error(const Follower& f);

/// A rate that should follow from the equations and does not vanish, in words; else empty.
std::string not_implied(const Follower& f, const BranchPoint& at);

BranchEvent& add(Follower& f, EventKind kind, const CurvePoint& at, std::string which);
/// A fold or branch point: where all of the model's equations are singular an eigenvalue is zero.
BranchEvent& add_singular(Follower& f, EventKind kind, const CurvePoint& at);
/// An eigenvalue on the axis, whose real part changes by `slope` along the way: zero or hopf.
void add_crossing(Follower& f, const CurvePoint& at, double slope);

void end(Follower& f, BranchEnd how, const CurvePoint& at, std::string message);
/// The end that the trace came to by itself, in words, at the last point.
void end(Follower& f, CurveEnd how);

}  // namespace tiltrim
