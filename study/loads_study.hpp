/// @file
/// Component loads of a published vehicle at a given state, without a trim.
#pragma once

#include <string>

#include "study/study.hpp"
#include "vehicles/xv15/loads.hpp"
#include "vehicles/xv15/xv15.hpp"

namespace tiltrim {

/// The loads at one condition.
struct LoadsAnswer {
  std::string name;       ///< of the condition
  OperatingPoint at;      ///< its state and inputs
  xv15::Loads loads;      ///< valid if `message` is empty
  std::string message{};  ///< why there are none: the table that is silent there
};

/// Loads at the condition's u, w, q, stick or elevator, flap and mast angle. Throws
/// std::invalid_argument, naming what is missing, and if the study's vehicle has no components.
[[nodiscard]] LoadsAnswer component_loads(const Condition& condition);

}  // namespace tiltrim
