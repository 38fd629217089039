/// The contents of a map file: each variable's name, dimensions and description, defined once for
/// writing and reading. Internal to sweep/.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sweep/map.hpp"

namespace tiltrim::filing {

using Strings = std::vector<std::string>;

/// One variable. "point" in `over` stands for condition and all axes.
struct Field {
  std::string name;
  std::vector<std::string> over;
  std::string long_name;
  std::string units{};                   ///< UDUNITS; empty for names and counts
  Strings flags{};                       ///< meanings of 0, 1, ...
  std::optional<std::int8_t> nothing{};  ///< _FillValue
  std::optional<double> scale{};         ///< scale_factor
};

/// The map's lists of structs as arrays.
struct Lists {
  Strings axis_name, mode_name, state_name, state_unit, input_name, input_unit;
  std::vector<double> state_nominal, input_nominal;
  struct {
    std::vector<int> condition, axis, unstable_before, unstable_after, mode;
    std::vector<double> at, error, frequency;
    std::vector<std::int8_t> kind;
    Strings mode_name;
  } crossing;
  struct {
    std::vector<int> condition, axis, unstable;
    std::vector<double> at, from, to, abscissa, abscissa_at;
    std::vector<std::int8_t> verdict;
  } interval;
};

Lists lists_of(const SweepMap& map);
/// Throws std::runtime_error "what is wrong" unless every array has the length of its dimensions
/// and every index and enumerator is valid; of a map of verdicts alone, arrays over points are
/// empty.
void check_parts(const SweepMap& map, const Lists& lists, bool verdicts = false);
/// The inverse; the map must have its axes and conditions, and everything is checked.
void put_back(const Lists& lists, SweepMap& map);

/// Names of the file's own variables and dimensions.
std::set<std::string> reserved_names();

struct ColumnNames {
  std::string own;
  std::string si;  ///< empty if the values are SI
};
/// [axis][column]; the first column's name is also the dimension's.
std::vector<std::vector<ColumnNames>> column_names(const std::vector<SweepAxis>& axes);

/// Units in UDUNITS notation: "m/s" -> "m s-1", "rad/s²" -> "rad s-2", "degrees" -> "degree".
std::string udunits(const std::string& unit);

/// Names of the first `count` enumerators.
template <class Enum>
Strings meanings(int count) {
  Strings words;
  for (int k = 0; k < count; ++k) words.push_back(to_string(Enum(k)));
  return words;
}

inline const Strings& statuses() {
  static const auto words = meanings<TrimStatus>(int(TrimStatus::time_limit) + 1);
  return words;
}

inline const Strings& verdicts() {
  static const auto words = meanings<Verdict>(int(Verdict::undecided) + 1);
  return words;
}

/// visit(field, array) for every array over points.
template <class Map, class Visit>
void each_over_points(Map& map, const Visit& visit) {
  const Strings at{"point"}, modes{"point", "mode"};
  visit(Field{"status", at, "how the trim ended", "", statuses(), -1}, map.status);
  visit(Field{"verdict", at, "stability of the equilibrium", "", verdicts(), -1}, map.verdict);
  visit(Field{"reason", at, "position in reason_text"}, map.reason);
  visit(Field{"residual", at, "largest rate left over, each over its nominal size", "s-1"},
        map.residual);
  visit(Field{"spectral_abscissa", at, "largest real part of an eigenvalue", "s-1"},
        map.spectral_abscissa);
  visit(Field{"damping", at, "least damping ratio of a mode", "1"}, map.damping);
  visit(Field{"second_branch", at, "a second equilibrium was met", "", {"no", "yes"}},
        map.second_branch);
  visit(Field{"state_value", {"point", "state"}, "state at the equilibrium, units in state_unit"},
        map.state);
  visit(Field{"input_value", {"point", "input"}, "input at the equilibrium, units in input_unit"},
        map.input);
  visit(Field{"eigenvalue_re", modes, "real part of the eigenvalue", "s-1"}, map.eigenvalue_re);
  visit(Field{"eigenvalue_im", modes, "imaginary part of the eigenvalue", "s-1"},
        map.eigenvalue_im);
  visit(Field{.name = "confidence",
              .over = modes,
              .long_name = "confidence of the link to the same mode at the point before",
              .units = "1",
              .scale = 1.0 / 255},
        map.confidence);
}

template <class Map, class Visit>
void each_of_second(Map& map, const Visit& visit) {
  const Strings modes{"second", "mode"};
  auto& second = map.second;
  visit(Field{"second_point", {"second"}, "number of the point, the last axis fastest"},
        second.points);
  visit(Field{"second_state", {"second", "state"}, "state at the second equilibrium"},
        second.state);
  visit(Field{"second_input", {"second", "input"}, "input at the second equilibrium"},
        second.input);
  visit(Field{"second_eigenvalue_re", modes, "real part of the eigenvalue", "s-1"},
        second.eigenvalue_re);
  visit(Field{"second_eigenvalue_im", modes, "imaginary part of the eigenvalue", "s-1"},
        second.eigenvalue_im);
  visit(
      Field{
          "second_verdict", {"second"}, "stability of the second equilibrium", "", verdicts(), -1},
      second.verdict);
}

template <class L, class Visit>
void each_of_crossings(L& lists, const Visit& visit) {
  const Strings one{"crossing"};
  const auto kinds = meanings<CrossingKind>(int(CrossingKind::end) + 1);
  auto& c = lists.crossing;
  visit(Field{"crossing_condition", one, "position of the condition"}, c.condition);
  visit(Field{"crossing_axis", one, "position of the axis along which it was located"}, c.axis);
  visit(Field{"crossing_at", {"crossing", "axis"}, "coordinates, in the units of the axes"}, c.at);
  visit(Field{"crossing_error", one, "of the located coordinate, in its unit"}, c.error);
  visit(Field{"crossing_kind", one, "what crosses the imaginary axis", "", kinds}, c.kind);
  visit(Field{"crossing_unstable_before", one, "unstable eigenvalues before", "1"},
        c.unstable_before);
  visit(Field{"crossing_unstable_after", one, "unstable eigenvalues after", "1"}, c.unstable_after);
  visit(Field{"crossing_frequency", one, "imaginary part on the axis", "rad s-1"}, c.frequency);
  visit(Field{"crossing_mode", one, "position of the mode that crosses, -1 if not known"}, c.mode);
  visit(Field{"crossing_mode_name", one, "name of the mode that crosses"}, c.mode_name);
}

template <class L, class Visit>
void each_of_intervals(L& lists, const Visit& visit) {
  const Strings one{"interval"};
  const auto kinds = meanings<IntervalVerdict>(int(IntervalVerdict::undecided) + 1);
  auto& i = lists.interval;
  visit(Field{"interval_condition", one, "position of the condition"}, i.condition);
  visit(Field{"interval_axis", one, "position of the axis along which it lies"}, i.axis);
  visit(Field{"interval_at", {"interval", "axis"}, "coordinates of the line"}, i.at);
  visit(Field{"interval_from", one, "where it begins, in the unit of its axis"}, i.from);
  visit(Field{"interval_to", one, "where it ends, in the unit of its axis"}, i.to);
  visit(Field{"interval_verdict", one, "what holds in all of it", "", kinds}, i.verdict);
  visit(Field{"interval_unstable", one, "unstable eigenvalues", "1"}, i.unstable);
  visit(Field{"interval_abscissa", one, "largest real part met in it", "s-1"}, i.abscissa);
  visit(Field{"interval_abscissa_at", one, "where, in the unit of its axis"}, i.abscissa_at);
}

/// visit(field, array) for everything except the axes, in file order.
template <class Map, class L, class Visit>
void each_field(Map& map, L& lists, const Visit& visit) {
  visit(Field{"condition_name", {"condition"}, "flight condition"}, map.conditions);
  visit(Field{"axis_name", {"axis"}, "axis of the grid"}, lists.axis_name);
  visit(Field{"state_name", {"state"}, "name of the state"}, lists.state_name);
  visit(Field{"state_unit", {"state"}, "unit of the state"}, lists.state_unit);
  visit(Field{"state_nominal", {"state"}, "a change of the state that matters"},
        lists.state_nominal);
  visit(Field{"input_name", {"input"}, "name of the input"}, lists.input_name);
  visit(Field{"input_unit", {"input"}, "unit of the input"}, lists.input_unit);
  visit(Field{"input_nominal", {"input"}, "a change of the input that matters"},
        lists.input_nominal);
  visit(Field{"mode_name", {"condition", "mode"}, "name of the mode"}, lists.mode_name);
  visit(Field{"reason_text", {"distinct_reason"}, "why there is no equilibrium"}, map.reasons);
  each_over_points(map, visit);
  each_of_second(map, visit);
  each_of_crossings(lists, visit);
  each_of_intervals(lists, visit);
}

}  // namespace tiltrim::filing
