#include "study/sweep_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "study/axes.hpp"

namespace tiltrim::reading {

namespace {

constexpr double most_of_an_axis = 1e6;  // points of one axis

// h [m] is no variable of the tiltrotor: it sets the three commands of the corridor (16).
Key axis_key(const Section& section, const AxisKeys& keys) {
  const std::string name = section.text("key");
  if (keys.corridor && name == "h") return height_key();
  try {
    return key_among(keys.keys, name);
  } catch (const std::invalid_argument& e) {
    section.refuse(*section.find("key"),
                   fmt::format("{}{}", e.what(),
                               keys.corridor ? "; or h, the height along corridor (16)" : ""));
  }
}

bool is_corridor(const SweepAxis::Column& column) { return column.signal.empty(); }

std::size_t read_count(const Section& section) {
  const Entry& entry = section.require("count", "a whole number of points, or values = [...]");
  const double count = section.number(entry, {2, most_of_an_axis});
  if (count != std::floor(count))
    section.refuse(entry, fmt::format("{} is not a whole number", describe(entry)));
  return std::size_t(count);
}

// The column's values in its own unit. `count` is given for keys that vary along with another.
std::vector<double> read_values(const Section& section, const Accepted& accepted,
                                std::optional<std::size_t> count) {
  if (const Entry* list = section.find("values")) {
    for (const char* other : {"from", "to", "count", "spacing"})
      if (const Entry* entry = section.find(other))
        section.refuse(*entry, "cannot be combined with values; expected one or the other");
    return section.numbers(*list, accepted);
  }
  const bool logarithmic = section.choice("spacing", {"linear", "log"}) == 1;
  (void)section.number("from", accepted);
  (void)section.number("to", accepted);
  const double from = section.find("from")->number, to = section.find("to")->number;
  if (logarithmic && !(from * to > 0))
    section.refuse(
        *section.find("spacing"),
        fmt::format("log from {} to {} passes through zero; expected both of one sign", from, to));
  return spaced(from, to, count ? *count : read_count(section), logarithmic);
}

SweepAxis::Column read_column(const Section& section, const AxisKeys& keys,
                              std::optional<std::size_t> count) {
  const Key key = axis_key(section, keys);
  const Accepted accepted{key.accepted.lower, key.accepted.upper, key.unit};
  return column_of(key, read_values(section, accepted, count));
}

void check_monotone(const Section& section, const SweepAxis::Column& column) {
  const Entry* list = section.find("values");
  const Entry& named = list ? *list : *section.find("to");
  const bool up = column.values.back() > column.values.front();
  for (std::size_t i = 1; i < column.values.size(); ++i) {
    const double before = column.values[i - 1], here = column.values[i];
    if (up ? here > before : here < before) continue;
    section.refuse(
        named, fmt::format("{} after {} {}; expected ascending or descending values, each once",
                           here, before, here == before ? "repeats it" : "reverses the direction"));
  }
}

void read_coupled(const Section& section, const std::filesystem::path& file, const AxisKeys& keys,
                  const std::string& prefix, SweepAxis& axis) {
  const Entry* list = section.find("with");
  if (!list) return;
  constexpr std::string_view expected = "expected [{key = \"V\", from = 5, to = 15}, ...]";
  if (list->kind != Entry::Kind::array || list->entries.empty())
    section.refuse(*list, fmt::format("{} is not a list of keys; {}", describe(*list), expected));
  for (const Entry& entry : list->entries) {
    if (entry.kind != Entry::Kind::table)
      refuse(file, entry.place,
             fmt::format("{}with: {} is not a table; {}", prefix, describe(entry), expected));
    const Section with(file, entry, "in with", prefix + "with.");
    with.allow_only({"key", "from", "to", "spacing", "values"},
                    {{"count", "the axis determines the count"}});
    axis.columns.push_back(read_column(with, keys, axis.size()));
    if (axis.columns.back().values.size() != axis.size())
      with.refuse(*with.find("values"),
                  fmt::format("{} values for an axis of {}; expected as many",
                              axis.columns.back().values.size(), axis.size()));
    if (is_corridor(axis.columns.back()))
      with.refuse(*with.find("key"), "h sets V, gamma and eta; expected it as the key of an axis");
  }
}

SweepAxis read_axis(const Section& section, const std::filesystem::path& file, const AxisKeys& keys,
                    const std::string& prefix) {
  section.allow_only({"key", "from", "to", "count", "spacing", "values", "with"});
  section.require("key", "a number of the study in quotes, as \"eta_deg\" or \"gains.K_Lp\"");
  SweepAxis axis;
  axis.columns.push_back(read_column(section, keys, {}));
  const std::string& name = axis.columns.front().name;
  axis.name = name.substr(name.rfind('.') + 1);
  check_monotone(section, axis.columns.front());
  if (is_corridor(axis.columns.front())) add_corridor(axis);
  read_coupled(section, file, keys, prefix, axis);
  return axis;
}

// Every variable is set by one axis, once.
void check_distinct(const Section& section, const std::vector<SweepAxis>& axes) {
  std::set<std::string> set;
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns)
      if (!set.insert(column.signal.empty() ? column.name : column.signal).second)
        section.refuse(*section.find("axis"),
                       fmt::format("{} is set twice; expected each key once (h sets V, gamma_deg "
                                   "and eta_deg)",
                                   column.name));
}

// [[sweep.axis]] or [[report.map.axis]]; `path` is the part before "axis".
SweepTable read_grid(const Section& section, const std::filesystem::path& file,
                     const AxisKeys& keys, const std::string& path) {
  const std::string tables = fmt::format("[[{}axis]]", path);
  SweepTable sweep;
  if (section.find("crossings"))
    sweep.crossings = section.choice("crossings", {"locate", "skip"}) == 0;
  if (section.find("detail")) sweep.verdicts = section.choice("detail", {"full", "verdict"}) == 1;
  const Entry& list = section.require("axis", tables + " tables");
  if (list.kind != Entry::Kind::array || list.entries.empty())
    section.refuse(list, fmt::format("{} is not a list of tables; expected {} tables",
                                     describe(list), tables));
  const std::string prefix = path + "axis.";
  double points = 1;
  for (const Entry& entry : list.entries) {
    if (entry.kind != Entry::Kind::table)
      refuse(file, entry.place,
             fmt::format("{}axis: {} is not a table; expected {} tables", path, describe(entry),
                         tables));
    sweep.axes.push_back(
        read_axis(Section(file, entry, "in " + tables, prefix), file, keys, prefix));
    add_schedule(keys.schedule, sweep.axes.back());
    points *= double(sweep.axes.back().size());
  }
  check_distinct(section, sweep.axes);
  const double most = sweep.verdicts ? most_verdicts : most_points;
  if (points > most)
    section.refuse(
        list, fmt::format("the grid has {:.10g} points; expected at most {:.0f}{}", points, most,
                          path == "sweep." && points <= most_verdicts
                              ? ", or detail = \"verdict\" in [sweep]"
                              : ""));
  return sweep;
}

// A boolean, if present.
std::optional<bool> read_shown(const Section& section, const char* key) {
  if (!section.find(key)) return {};
  return section.choice(key, {"show", "skip"}) == 0;
}

ReportTable::Map read_map(const Section& section, const std::filesystem::path& file,
                          const AxisKeys& keys, const std::vector<Condition>& conditions) {
  section.allow_only({"condition", "axis", "crossings"});
  ReportTable::Map map{"", read_grid(section, file, keys, "report.map.")};
  if (section.find("condition")) {
    std::vector<std::string> names;
    for (const Condition& c : conditions) names.push_back(c.name);
    map.condition = names[section.choice("condition", names)];
  }
  if (map.grid.axes.size() > 2)
    section.refuse(
        *section.find("axis"),
        fmt::format("{} axes cannot be plotted; expected one or two", map.grid.axes.size()));
  return map;
}

}  // namespace

SweepTable read_sweep(const Section& section, const std::filesystem::path& file,
                      const AxisKeys& keys) {
  section.allow_only({"axis", "crossings", "detail"});
  return read_grid(section, file, keys, "sweep.");
}

ReportTable read_report(const Section& section, const std::filesystem::path& file,
                        const AxisKeys& keys, const std::vector<Condition>& conditions) {
  section.allow_only({"map", "flight", "audit"});
  ReportTable report;
  for (const Section& map : section.tables("map"))
    report.maps.push_back(read_map(map, file, keys, conditions));
  report.flight = read_shown(section, "flight");
  report.audit = read_shown(section, "audit");
  return report;
}

}  // namespace tiltrim::reading
