#include "follow/linear_at.hpp"

#include <fmt/core.h>

#include "trim/problem.hpp"

namespace tiltrim {

using Eigen::Index;

std::vector<std::string> unsteady_states(const Model& model, const TrimSpec& spec) {
  std::vector<std::string> states = moving_states(model, spec);
  for (const auto& [state, rate] : spec.rates)
    if (rate != 0) states.push_back(state);
  return states;
}

LinearModel linear_at(const Model& model, const TrimSpec& spec, const OperatingPoint& trimmed) {
  LinearModel linear = linearize(model, trimmed, {.moving = unsteady_states(model, spec)});
  if (!linear) return linear;
  for (const auto& [state, rate] : spec.rates) {
    const Index j = find(model.states, state);
    for (Index i = 0; rate != 0 && i < linear.A.rows(); ++i) {
      if (linear.A(i, j) == 0) continue;
      linear.status = LinearizeStatus::not_equilibrium;
      linear.message = fmt::format("not an equilibrium: {}' = {:.3g}, and {}' depends on {}", state,
                                   rate, model.states[std::size_t(i)].name, state);
    }
  }
  return linear;
}

}  // namespace tiltrim
