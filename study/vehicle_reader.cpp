// A published vehicle as the model of a study.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/degrees.hpp"
#include "model/lookup.hpp"
#include "study/model_reader.hpp"
#include "vehicles/xv15/data.hpp"
#include "vehicles/xv15/xv15.hpp"

namespace tiltrim::reading {

UserModel read_published(const Section& top, const std::filesystem::path& data) {
  const auto variant = xv15::Variant(top.choice("variant", xv15::variant_names()));
  UserModel own;
  try {
    own.xv15 = xv15::load(data / "xv15", variant);
  } catch (const std::runtime_error& e) {
    top.refuse("vehicle", e.what());
  }
  const bool controlled = top.choice("control", {"none", "energy"}) == 1;
  own.model = controlled ? xv15::closed_loop(own.xv15) : xv15::model(own.xv15);
  own.parameters =
      controlled ? xv15::closed_loop_parameters(*own.xv15) : xv15::parameters(*own.xv15);
  own.keys = keys_of(own.model);
  constexpr std::array positive{"mass", "air_density", "sound_speed", "rotor_speed", "gravity"};
  for (Key& key : own.keys)
    if (std::ranges::find(positive, key.name) != positive.end()) key.accepted = {1e-6, 1e6};
  if (controlled) {
    const std::vector<std::string> all = names(own.model.parameters);
    own.gains.assign(all.begin() + xv15::parameters(*own.xv15).size(), all.end());
    own.loops = {{"collective", "collective_added", "collective_command"},
                 {"stick", "stick_added", "stick_command"}};
  }
  if (const std::optional<Section> values = top.table("gains")) {
    if (!controlled) top.refuse("gains", "it belongs to control = \"energy\"");
    values->allow_only(own.gains);
    for (const std::string& name : own.gains)
      if (values->find(name))
        own.parameters[index_of(own.model.parameters, name, "gain")] =
            values->number(name, {-1e100, 1e100});
  }
  return own;
}

// Under control the speed is commanded; without it a climb angle is commanded with the speed.
static void check_speeds(const Section& section, bool controlled, const UserCondition& condition) {
  const auto given = [&](const char* name) { return condition.values.contains(name); };
  if (given("airspeed_kt")) return;
  for (const char* own : {"V", "speed_kt"})
    if (controlled && given(own))
      section.refuse(*section.find(own),
                     "the control law flies a commanded speed; expected airspeed_kt");
  if (controlled || !given("climb_angle")) return;
  const Entry* in_degrees = section.find("climb_angle_deg");
  section.refuse(in_degrees ? *in_degrees : *section.find("climb_angle"),
                 "it is commanded with airspeed_kt; expected that speed, or climb in m/s");
}

// The controls within their travel; level flight, if the speed is asked for; the start by closed
// forms.
void complete_published(const Section& section, const UserModel& own, UserCondition& condition) {
  constexpr double degree = std::numbers::pi / 180;
  constexpr double three_quarter_tip_speed = 176;  // m/s
  auto& values = condition.values;
  const auto given = [&](const char* name) { return values.contains(name); };
  // Under control both are outputs, and the integrals take them where they must be.
  const bool controlled = find(own.model.inputs, "stick") < 0;
  check_speeds(section, controlled, condition);
  if (!given("stick")) values["stick"] = {0.0, 9.6};
  if (!given("collective")) values["collective"] = {-10 * degree, 70 * degree};
  if (given("airspeed_kt") && !controlled) {
    values["forward_error"] = values["climb_error"] = {0.0, 0.0};
  } else if (!controlled && !given("climb") && !(given("u") && given("w"))) {
    values["climb"] = {0.0, 0.0};
  }
  const auto middle = [&](const char* name) {
    const double at = given(name) ? (values[name].lower + values[name].upper) / 2 : 0.0;
    return std::isfinite(at) ? at : 0.0;
  };
  const double V = given("V")   ? middle("V")
                   : given("u") ? middle("u")
                                : kt * (middle("speed_kt") + middle("airspeed_kt"));
  const double climb = middle("climb_angle");
  OperatingPoint at{Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero(), own.parameters};
  const auto set = [&](const Signals& signals, Eigen::VectorXd& to) {
    for (Eigen::Index k = 0; k < std::min(to.size(), std::ssize(signals)); ++k)
      if (const auto& name = signals[std::size_t(k)].name; given(name.c_str()))
        to[k] = middle(name.c_str());
  };
  at.u[2] = middle("flap");
  at.u[3] = middle("mast_angle");
  set(own.model.parameters, at.p);
  const xv15::Start start = xv15::start_of(*own.xv15, at, V, climb);
  const auto guess = [&](const char* name, double value) { condition.guess.insert({name, value}); };
  guess("theta", start.theta);
  guess("u", V * std::cos(start.theta - climb));
  guess("w", V * std::sin(start.theta - climb));
  if (controlled) {
    const double inflow = std::atan2(V * std::sin(at.u[3]), three_quarter_tip_speed);
    guess("energy_integral", start.collective - inflow);
    guess("distribution_integral", start.stick - 4.8 - 4 * start.theta);
  } else {
    guess("stick", start.stick);
    guess("collective", start.collective);
  }
}

}  // namespace tiltrim::reading
