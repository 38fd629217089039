#include "study/loads_study.hpp"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "vehicles/xv15/loads.hpp"

namespace tiltrim {

namespace {

// A value that the condition fixes.
std::optional<double> fixed(const UserCondition& condition, const char* name) {
  const auto given = condition.values.find(name);
  if (given == condition.values.end() || given->second.lower != given->second.upper) return {};
  return given->second.lower;
}

double required(const UserCondition& condition, const char* name, const char* keys) {
  const std::optional<double> value = fixed(condition, name);
  if (!value) throw std::invalid_argument(fmt::format("no {}; expected a number", keys));
  return *value;
}

// The stick moves the elevator by a fixed gearing.
double stick_of(const UserCondition& condition) {
  if (const auto stick = fixed(condition, "stick")) return *stick;
  const double elevator = required(condition, "elevator", "stick or elevator_deg");
  return xv15::stick_for(*condition.model->xv15, elevator);
}

// Of level flight, forwards or backwards, upright; straight up or down the fuselage is level.
double pitch_of(const UserCondition& condition, double u, double w) {
  return fixed(condition, "theta").value_or(u == 0 ? 0.0 : std::atan(w / u));
}

}  // namespace

LoadsAnswer component_loads(const Condition& condition) {
  const UserCondition* asked = condition.user();
  if (!asked || !asked->model->xv15)
    throw std::invalid_argument(
        "component loads belong to a published vehicle; expected a study with vehicle = \"xv15\"");
  const UserModel& own = *asked->model;
  LoadsAnswer answer{condition.name, {}, {}};
  OperatingPoint& at = answer.at;
  const double u = required(*asked, "u", "u"), w = required(*asked, "w", "w");
  at.x = Eigen::Vector4d(u, w, pitch_of(*asked, u, w), fixed(*asked, "q").value_or(0.0));
  at.u = Eigen::Vector4d(0.0, stick_of(*asked), required(*asked, "flap", "flap_deg"),
                         required(*asked, "mast_angle", "mast_angle_deg"));
  at.p = own.parameters;
  for (const Signal& s : own.model.parameters)
    if (const auto value = fixed(*asked, s.name.c_str()))
      at.p[find(own.model.parameters, s.name)] = *value;
  try {
    answer.loads = xv15::loads(*own.xv15, at,
                               {fixed(*asked, "collective"), fixed(*asked, "induced_velocity")});
    at.u[0] = answer.loads.collective;
  } catch (const std::domain_error& e) {
    answer.message = e.what();
  }
  return answer;
}

}  // namespace tiltrim
