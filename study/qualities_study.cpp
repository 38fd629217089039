#include "study/qualities_study.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/degrees.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

constexpr double low_speed = 35 * kt;  // MIL-F-83300 calls up to 35 kt hover and low speed

// The names that the built-in vehicles give their signals; body axes have u and w.
Roles built_in(const LinearModel& linear) {
  const bool body = find(linear.states, "w") >= 0;
  Roles roles;
  roles.pitch = "theta";
  roles.pitch_rate = "q";
  roles.alpha = body ? "" : "alpha";
  roles.downward_speed = body ? "w" : "";
  roles.speed = body ? "u" : "airspeed";
  for (const char* name : {"stick", body ? "a1s" : "delta_e"})
    if (roles.stick.empty() && find(linear.inputs, name) >= 0) roles.stick = name;
  return roles;
}

void replace(const Roles& given, Roles& roles) {
  for (const auto role :
       {&Roles::pitch, &Roles::pitch_rate, &Roles::alpha, &Roles::downward_speed, &Roles::speed,
        &Roles::height, &Roles::normal_acceleration, &Roles::stick})
    if (!(given.*role).empty()) roles.*role = given.*role;
}

// The value of a state or an output at the trim; NaN for another name.
double value_at(const LinearModel& linear, const Eigen::VectorXd& outputs,
                const std::string& name) {
  const Index state = find(linear.states, name), output = find(linear.outputs, name);
  if (state >= 0) return linear.point.x[state];
  if (output >= 0 && output < outputs.size()) return outputs[output];
  return std::numeric_limits<double>::quiet_NaN();
}

double airspeed(const LinearModel& linear, const Eigen::VectorXd& outputs, const Roles& roles) {
  double speed = value_at(linear, outputs, roles.speed);
  const Index down = find(linear.states, roles.downward_speed);
  if (down >= 0 && find(linear.states, roles.speed) >= 0)
    speed = std::hypot(speed, linear.point.x[down]);
  return std::abs(speed) > 0 ? std::abs(speed) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

QualitiesOptions qualities_options(const Study& study, const Condition& condition,
                                   const LinearModel& linear, const Eigen::VectorXd& outputs) {
  const bool own = study.user_model && !study.user_model->xv15;
  if (own && !study.qualities)
    throw std::invalid_argument(
        "no [qualities] table; expected one that names the roles of the model's signals");
  const QualitiesTable table = study.qualities.value_or(QualitiesTable{});
  QualitiesOptions options = table.options;
  if (!own) {
    options.roles = built_in(linear);
    replace(table.options.roles, options.roles);
  }
  // The linear model of a closed loop has other inputs than the airframe's.
  if (find(linear.inputs, options.roles.stick) < 0) options.roles.stick.clear();
  if (std::isnan(options.airspeed)) options.airspeed = airspeed(linear, outputs, options.roles);
  const double below = table.hover_below.value_or(own ? 0.0 : low_speed);
  const bool named = std::ranges::find(table.hover, condition.name) != table.hover.end();
  const bool slow = !(options.airspeed >= below) && (below > 0 || table.hover_below);
  options.regime = table.phase.value_or(
      named || (table.hover.empty() && slow) ? FlightRegime::hover : FlightRegime::forward);
  return options;
}

}  // namespace tiltrim
