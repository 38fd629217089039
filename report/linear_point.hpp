/// A condition's linear model for export. Internal to report/.
#pragma once

#include "model/lookup.hpp"
#include "report/conditions.hpp"

namespace tiltrim {

/// The trim at which a linear model is valid: its states, its own inputs, its outputs.
struct LinearPoint {
  Eigen::VectorXd x0, u0, y0;
};

inline LinearPoint point_of(const ConditionReport& c) {
  const LinearModel& l = *c.linear;
  LinearPoint at{l.point.x, Eigen::VectorXd(Eigen::Index(l.inputs.size())), c.answer.trim.outputs};
  for (Eigen::Index j = 0; j < at.u0.size(); ++j)
    at.u0[j] = value_of(l.point, variable(c.answer.model, l.inputs[std::size_t(j)].name));
  return at;
}

/// The conditions that have a linear model.
inline std::vector<const ConditionReport*> linear_ones(
    const std::vector<ConditionReport>& conditions) {
  std::vector<const ConditionReport*> found;
  for (const ConditionReport& c : conditions)
    if (c.linear && *c.linear) found.push_back(&c);
  return found;
}

}  // namespace tiltrim
