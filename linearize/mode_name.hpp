/// A mode's name from the participation of its states.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A name for a mode from the participation of its states: the first of `known` whose states have
/// most of it, otherwise the dominant states joined by +.
std::string mode_name(std::complex<double> eigenvalue, const Eigen::VectorXd& participation,
                      const std::vector<std::string>& state_names,
                      const std::shared_ptr<const std::vector<ModeName>>& known = {});

/// Those of `known` whose states are all among these: no other one can be a mode's name.
std::shared_ptr<const std::vector<ModeName>> possible_names(
    const std::shared_ptr<const std::vector<ModeName>>& known,
    const std::vector<std::string>& state_names);

}  // namespace tiltrim
