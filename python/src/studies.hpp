/// Studies and their conditions as Python holds them.
#pragma once

#include <memory>

#include "python/src/models.hpp"
#include "study/study.hpp"

namespace tiltrim::python {

struct HeldStudy {
  std::shared_ptr<const Study> study;
};

struct HeldCondition {
  std::shared_ptr<const Study> study;
  Condition condition;

  Vehicle vehicle() const { return vehicle_at(*study, condition); }
};

}  // namespace tiltrim::python
