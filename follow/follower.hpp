/// State and results of a branch while it is followed. Internal to follow/.
#pragma once

#include "follow/follow.hpp"
#include "follow/path.hpp"

namespace tiltrim {

struct Follower {
  Problem problem;
  Path path{problem};
  double to;  ///< target of the parameter, scaled
  const FollowOptions& options;
  bool stability = false;
  std::vector<std::string> moving{};  ///< states that need not be at rest
  Branch branch{};
  std::optional<LimitName> pending{};  ///< the limit to hold or release before continuing
  CurvePoint last{};
  mutable Eigen::VectorXd seen{}, seen_real_parts{};  ///< point and eigenvalues last computed

  Follower(Problem p, double target, const FollowOptions& o)
      : problem(std::move(p)), to(target), options(o) {}
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  double nominal() const { return problem.nominal[path.parameter()]; }
  OperatingPoint point(const CurvePoint& at) const { return point_of(problem, path.z(at.y)); }
};

/// Real parts of the eigenvalues, in descending order; one that is zero to rounding counts as
/// stable. NaN if there are no eigenvalues.
const Eigen::VectorXd& real_parts(const Follower& f, const CurvePoint& at);

BranchPoint reported(const Follower& f, const CurvePoint& at);
TraceOptions trace_options(const FollowOptions& options);

/// An implied rate that does not vanish, as text; otherwise empty.
std::string not_implied(const Follower& f, const BranchPoint& at);

BranchEvent& add(Follower& f, EventKind kind, const CurvePoint& at, std::string which);
/// Adds a fold or branch point. If all equations of the model are singular an eigenvalue is zero.
BranchEvent& add_singular(Follower& f, EventKind kind, const CurvePoint& at);
/// Adds an eigenvalue on the axis, a component of real_parts() that changes sign: zero or hopf.
void add_crossing(Follower& f, const LocatedEvent& crossing);

void end(Follower& f, BranchEnd how, const CurvePoint& at, std::string message);
/// Adds the end at which the continuation stopped, as text, at the last point.
void end(Follower& f, CurveEnd how);

}  // namespace tiltrim
