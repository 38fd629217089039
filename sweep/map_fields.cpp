#include "sweep/map_fields.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace tiltrim::filing {

// ---- Conversion between a map and its lists ----------------------------------------------------

namespace {

std::vector<double> row(const std::vector<double>& all, std::size_t k, std::size_t width) {
  return {all.begin() + std::ptrdiff_t(k * width), all.begin() + std::ptrdiff_t((k + 1) * width)};
}

}  // namespace

Lists lists_of(const SweepMap& map) {
  Lists l;
  for (const SweepAxis& axis : map.axes) l.axis_name.push_back(axis.name);
  for (const Strings& names : map.mode_names)
    l.mode_name.insert(l.mode_name.end(), names.begin(), names.end());
  const auto signals = [](const Signals& from, Strings& names, Strings& units,
                          std::vector<double>& nominal) {
    for (const Signal& s : from) {
      names.push_back(s.name);
      units.push_back(s.unit);
      nominal.push_back(s.nominal);
    }
  };
  signals(map.states, l.state_name, l.state_unit, l.state_nominal);
  signals(map.inputs, l.input_name, l.input_unit, l.input_nominal);
  for (const AxisCrossing& x : map.crossings) {
    auto& c = l.crossing;
    c.condition.push_back(x.condition);
    c.axis.push_back(x.axis);
    c.at.insert(c.at.end(), x.at.begin(), x.at.end());
    c.error.push_back(x.error);
    c.kind.push_back(std::int8_t(x.kind));
    c.unstable_before.push_back(x.unstable_before);
    c.unstable_after.push_back(x.unstable_after);
    c.frequency.push_back(x.frequency);
    c.mode.push_back(x.mode);
    c.mode_name.push_back(x.mode_name);
  }
  for (const AxisInterval& x : map.intervals) {
    auto& i = l.interval;
    i.condition.push_back(x.condition);
    i.axis.push_back(x.axis);
    i.at.insert(i.at.end(), x.at.begin(), x.at.end());
    i.from.push_back(x.from);
    i.to.push_back(x.to);
    i.verdict.push_back(std::int8_t(x.verdict));
    i.unstable.push_back(x.unstable);
    i.abscissa.push_back(x.abscissa);
    i.abscissa_at.push_back(x.abscissa_at);
  }
  return l;
}

namespace {

[[noreturn]] void wrong(const std::string& name, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", name, what));
}

// Lengths of the dimensions. That of "point" is checked against an array over it, because the
// product of forged lengths could be anything.
std::map<std::string, std::size_t> lengths(const SweepMap& map, const Lists& l, bool verdicts) {
  double points = double(map.conditions.size());
  for (const SweepAxis& axis : map.axes) {
    if (axis.columns.empty()) wrong("axis", "has no values");
    for (const SweepAxis::Column& c : axis.columns)
      if (c.values.size() != axis.size() || c.si.size() != axis.size() || axis.size() == 0)
        wrong(c.name, "has a different number of values than its axis has points");
    points *= double(axis.size());
  }
  if (!verdicts && points != double(map.status.size()))
    wrong("status", "has a different number of values than points");
  return {{"condition", map.conditions.size()},
          {"point", map.status.size()},
          {"axis", map.axes.size()},
          {"state", l.state_name.size()},
          {"input", l.input_name.size()},
          {"mode", l.state_name.size()},
          {"distinct_reason", map.reasons.size()},
          {"second", map.second.points.size()},
          {"crossing", l.crossing.condition.size()},
          {"interval", l.interval.condition.size()}};
}

// Indices into a list of `size`; `least` is -1 if -1 stands for no entry.
template <class T>
void check_positions(const std::string& name, const std::vector<T>& all, std::size_t size,
                     int least = 0) {
  for (const T k : all)
    if (std::cmp_less(k, least) ||
        (std::cmp_greater_equal(k, 0) && std::cmp_greater_equal(k, size)))
      wrong(name, fmt::format("{} is not a position in a list of {}", k, size));
}

}  // namespace

void check_parts(const SweepMap& map, const Lists& l, bool verdicts) {
  const auto length = lengths(map, l, verdicts);
  each_field(map, l, [&](const Field& field, const auto& array) {
    std::size_t count = 1;
    for (const std::string& over : field.over) count *= length.at(over);
    if (array.size() != count)
      wrong(field.name, fmt::format("{} values, not {}", array.size(), count));
    if constexpr (std::is_same_v<std::decay_t<decltype(array)>, std::vector<std::int8_t>>)
      check_positions(field.name, array, field.flags.size(), field.nothing ? -1 : 0);
  });
  check_positions("reason", map.reason, map.reasons.size());
  check_positions("second_point", map.second.points, map.status.size());
  check_positions("crossing_condition", l.crossing.condition, map.conditions.size());
  check_positions("crossing_axis", l.crossing.axis, map.axes.size());
  check_positions("crossing_mode", l.crossing.mode, l.state_name.size(), -1);
  check_positions("interval_condition", l.interval.condition, map.conditions.size());
  check_positions("interval_axis", l.interval.axis, map.axes.size());
}

void put_back(const Lists& l, SweepMap& map) {
  for (std::size_t k = 0; k < l.axis_name.size(); ++k) map.axes[k].name = l.axis_name[k];
  for (std::size_t k = 0; k < l.state_name.size(); ++k)
    map.states.push_back({l.state_name[k], l.state_unit[k], l.state_nominal[k]});
  for (std::size_t k = 0; k < l.input_name.size(); ++k)
    map.inputs.push_back({l.input_name[k], l.input_unit[k], l.input_nominal[k]});
  for (std::size_t k = 0; k < map.conditions.size(); ++k) {
    const auto from = l.mode_name.begin() + std::ptrdiff_t(k * map.modes());
    map.mode_names.emplace_back(from, from + std::ptrdiff_t(map.modes()));
  }
  const std::size_t axes = map.axes.size();
  for (std::size_t k = 0; k < l.crossing.condition.size(); ++k) {
    const auto& c = l.crossing;
    map.crossings.push_back({c.condition[k], c.axis[k], row(c.at, k, axes), c.error[k],
                             CrossingKind(c.kind[k]), c.unstable_before[k], c.unstable_after[k],
                             c.frequency[k], c.mode[k], c.mode_name[k]});
  }
  for (std::size_t k = 0; k < l.interval.condition.size(); ++k) {
    const auto& i = l.interval;
    map.intervals.push_back({i.condition[k], i.axis[k], row(i.at, k, axes), i.from[k], i.to[k],
                             IntervalVerdict(i.verdict[k]), i.unstable[k], i.abscissa[k],
                             i.abscissa_at[k]});
  }
}

// ---- Names and units -------------------------------------------------------------------------

namespace {

// Converts text to a NetCDF name: letters, digits and _ are kept, others become _.
std::string netcdf_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    const bool kept = (u >= '0' && u <= '9') || (u >= 'A' && u <= 'Z') || (u >= 'a' && u <= 'z');
    name += kept ? c : '_';
  }
  if (name.size() > 100) name.resize(100);
  return name.empty() || (name[0] >= '0' && name[0] <= '9') ? "_" + name : name;
}

std::string last_part(const std::string& name) { return name.substr(name.rfind('.') + 1); }

// `text` as a name, with _2, _3, ... appended if it is taken.
std::string give(std::set<std::string>& taken, const std::string& text) {
  const std::string first = netcdf_name(text);
  std::string name = first;
  for (int k = 2; !taken.insert(name).second; ++k) name = fmt::format("{}_{}", first, k);
  return name;
}

}  // namespace

std::string udunits(const std::string& unit) {
  if (unit.empty()) return "1";
  std::string answer;
  bool below = false;  // in the denominator
  for (std::size_t i = 0; i < unit.size();) {
    const std::size_t end = std::min(unit.find_first_of(" /*", i), unit.size());
    std::string word = unit.substr(i, end - i);
    for (const auto& [super, digit] : {std::pair("²", "2"), {"³", "3"}, {"^", ""}})
      if (const auto at = word.find(super); at != std::string::npos)
        word.replace(at, std::strlen(super), digit);
    const bool powered = !word.empty() && word.back() >= '0' && word.back() <= '9';
    if (below && powered) word.insert(word.find_first_of("0123456789"), "-");
    if (below && !powered) word += "-1";
    if (word == "degrees") word = "degree";
    if (word != "1" && !word.empty()) answer += (answer.empty() ? "" : " ") + word;
    if (end < unit.size()) below = unit[end] == '/';
    i = end + 1;
  }
  return answer;
}

std::set<std::string> reserved_names() {
  SweepMap map;
  Lists lists;
  std::set<std::string> names{"study",       "study_length", "borders_located", "part_of",
                              "part_run",    "part_runs",    "part_line",       "part_located",
                              "part_number", "part_numbers"};
  each_field(map, lists, [&](const Field& field, const auto&) {
    names.insert(field.over.begin(), field.over.end());
    names.insert({field.name, field.name + "_length"});
  });
  return names;
}

std::vector<std::vector<ColumnNames>> column_names(const std::vector<SweepAxis>& axes) {
  auto taken = reserved_names();
  std::vector<std::vector<ColumnNames>> names;
  for (const SweepAxis& axis : axes) names.push_back({{give(taken, axis.name), ""}});
  for (std::size_t a = 0; a < axes.size(); ++a)
    for (std::size_t c = 1; c < axes[a].columns.size(); ++c)
      names[a].push_back({give(taken, last_part(axes[a].columns[c].name)), ""});
  for (std::size_t a = 0; a < axes.size(); ++a)
    for (std::size_t c = 0; c < axes[a].columns.size(); ++c)
      if (axes[a].columns[c].si != axes[a].columns[c].values)
        names[a][c].si = give(taken, names[a][c].own + "_si");
  return names;
}

}  // namespace tiltrim::filing
