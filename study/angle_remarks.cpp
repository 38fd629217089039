#include "study/angle_remarks.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "study/toml_reader.hpp"

namespace tiltrim {

using reading::Entry;

namespace {

constexpr double degree = std::numbers::pi / 180;

enum class Unit { other, degrees, rad };

// What a number in degrees would be in radians, if it is one of the angles that people type so.
std::string as_radians(const std::string& key, double value) {
  constexpr double four_digits = 2e-4;  // 3.142, 1.571, 1.047, 0.7854 and 0.5236, but not 1.57
  for (const double angle : {30, 45, 60, 90, 180})
    if (std::abs(std::abs(value) / (angle * degree) - 1) < four_digits)
      return fmt::format("{0} = {1} is {1:.3g} degrees; {1} rad would be {2} degrees", key, value,
                         std::copysign(angle, value));
  return {};
}

std::string as_degrees(const std::string& key, double value) {
  if (!(std::abs(value) > 2 * std::numbers::pi)) return {};
  return fmt::format("{0} = {1} is in rad, {2:.4g} degrees; {1} degrees would be {3:.4g} rad", key,
                     value, value / degree, value * degree);
}

struct AngleCheck {
  std::string file;
  std::vector<std::string> in_rad;  // names of the [model]
  std::vector<std::string> remarks{};

  Unit unit_of(const std::string& key) const {
    if (key.ends_with("_deg")) return Unit::degrees;
    return std::ranges::find(in_rad, key) != in_rad.end() ? Unit::rad : Unit::other;
  }

  // `key` is that of the number or of its array; `named` the unit of the table's variable.
  void visit(const Entry& entry, const std::string& key, Unit unit) {
    if (entry.kind == Entry::Kind::number && unit != Unit::other) {
      const std::string remark =
          unit == Unit::degrees ? as_radians(key, entry.number) : as_degrees(key, entry.number);
      if (!remark.empty())
        remarks.push_back(
            fmt::format("{}:{}:{}: {}", file, entry.place.line, entry.place.column, remark));
    }
    if (entry.kind == Entry::Kind::array)
      for (const Entry& item : entry.entries) visit(item, key, unit);
    if (entry.kind == Entry::Kind::table) visit_table(entry);
  }

  // An axis or a parameter names its variable or unit in one key and has its values in others.
  void visit_table(const Entry& table) {
    Unit named = Unit::other;
    for (const Entry& e : table.entries) {
      if (e.key == "key" || e.key == "parameter" || e.key == "signal") named = unit_of(e.text);
      if (e.key == "unit" && e.text == "rad") named = Unit::rad;
    }
    constexpr std::string_view of_named[] = {"from", "to", "values", "value", "reference"};
    for (const Entry& e : table.entries) {
      if (e.key == "rates") continue;  // per second
      const bool value = std::ranges::find(of_named, e.key) != std::end(of_named);
      visit(e, e.key, value ? named : unit_of(e.key));
    }
  }
};

}  // namespace

std::vector<std::string> angle_remarks(const Study& study) {
  AngleCheck check{study.file.string(), {}};
  if (study.user_model)
    for (const Key& key : study.user_model->keys)
      if (key.unit == "rad") check.in_rad.push_back(key.name);
  check.visit_table(reading::parse_toml(study.text, study.file));
  return check.remarks;
}

}  // namespace tiltrim
