// A published vehicle as the model of a study.
#include <cmath>
#include <numbers>

#include "study/model_reader.hpp"
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
  own.model = xv15::model(own.xv15);
  own.parameters = xv15::parameters(*own.xv15);
  own.keys = keys_of(own.model);
  return own;
}

// The controls within their travel; level flight, if the speed is asked for; the start that a
// pilot would guess.
void complete_published(const UserModel&, UserCondition& condition) {
  constexpr double degree = std::numbers::pi / 180, knot = 0.514444;
  constexpr double three_quarter_tip_speed = 176;  // m/s
  auto& values = condition.values;
  const auto given = [&](const char* name) { return values.contains(name); };
  if (!given("stick")) values["stick"] = {0.0, 9.6};
  if (!given("collective")) values["collective"] = {-10 * degree, 70 * degree};
  if (!given("climb") && !(given("u") && given("w"))) values["climb"] = {0.0, 0.0};
  const auto middle = [&](const char* name) {
    return given(name) ? (values[name].lower + values[name].upper) / 2 : 0.0;
  };
  double V = given("V") ? middle("V") : given("speed_kt") ? knot * middle("speed_kt") : middle("u");
  if (!std::isfinite(V)) V = 0;
  const auto guess = [&](const char* name, double value) { condition.guess.insert({name, value}); };
  guess("u", V);
  guess("stick", 4.8);
  guess("collective",
        std::atan(V * std::sin(middle("mast_angle")) / three_quarter_tip_speed) + 8 * degree);
}

}  // namespace tiltrim::reading
