/// Parts of JSON shared by several reports. Internal to report/.
#pragma once

#include <nlohmann/json.hpp>

#include "linearize/modes.hpp"
#include "model/model.hpp"

namespace tiltrim::json {

// Numbers keep every digit; infinities and NaN, which JSON lacks, become null.
using nlohmann::ordered_json;

/// [[row], [row], ...]
ordered_json rows(const Eigen::MatrixXd& matrix);
/// {"name": value, ...}, the first `most` signals.
ordered_json named(const Signals& signals, const Eigen::VectorXd& values,
                   std::size_t most = SIZE_MAX);
/// theta0, a1s, delta_e: inputs of the airframe (together with eta), first outputs of the closed
/// loop.
ordered_json actuators(const Model& model, const OperatingPoint& point,
                       const Eigen::VectorXd& outputs);
/// {"state", "input", "output"}.
ordered_json point(const Model& model, const OperatingPoint& at, const Eigen::VectorXd& outputs);
ordered_json mode(const Mode& mode, const Signals& states);

}  // namespace tiltrim::json
