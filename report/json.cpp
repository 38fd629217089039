#include "report/json.hpp"

#include <algorithm>

namespace tiltrim::json {

using Eigen::Index;

ordered_json rows(const Eigen::MatrixXd& matrix) {
  ordered_json list = ordered_json::array();
  for (const auto& row : matrix.rowwise())
    list.push_back(std::vector<double>(row.begin(), row.end()));
  return list;
}

ordered_json named(const Signals& signals, const Eigen::VectorXd& values, std::size_t most) {
  ordered_json object = ordered_json::object();
  for (std::size_t i = 0; i < std::min(most, signals.size()) && Index(i) < values.size(); ++i)
    object[signals[i].name] = values[Index(i)];
  return object;
}

ordered_json actuators(const Model& model, const OperatingPoint& at,
                       const Eigen::VectorXd& outputs) {
  constexpr std::size_t count = 3;  // theta0, a1s, delta_e
  const bool closed_loop = model.inputs.empty() && find(model.outputs, "theta0") == 0;
  return closed_loop ? named(model.outputs, outputs, count) : named(model.inputs, at.u);
}

ordered_json point(const Model& model, const OperatingPoint& at, const Eigen::VectorXd& outputs) {
  return {{"state", named(model.states, at.x)},
          {"input", actuators(model, at, outputs)},
          {"output", named(model.outputs, outputs)}};
}

ordered_json mode(const Mode& m, const Signals& states) {
  return {{"re", m.eigenvalue.real()},
          {"im", m.eigenvalue.imag()},
          {"frequency", m.frequency()},
          {"damping", m.damping()},
          {"time_to_half", m.time_to_half()},
          {"error", m.error},
          {"condition", m.condition},
          {"backward_error", m.backward_error},
          {"determined", m.determined},
          {"name", m.name},
          {"participation", named(states, m.participation)}};
}

}  // namespace tiltrim::json
