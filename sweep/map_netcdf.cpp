#include "sweep/map_netcdf.hpp"

#include <fmt/core.h>

#include "runtime/whole_file.hpp"
#include "sweep/map_dataset.hpp"
#include "sweep/map_fields.hpp"

namespace tiltrim::filing {

namespace {

constexpr int map_format = 1;

void define_dimensions(Dataset& set, const SweepMap& map,
                       const std::vector<std::vector<ColumnNames>>& names) {
  add_dimension(set, "condition", map.conditions.size());
  set.dimensions["point"] = set.dimensions["condition"];
  for (std::size_t a = 0; a < map.axes.size(); ++a) {
    add_dimension(set, names[a].front().own, map.axes[a].size());
    append(set.dimensions["point"], set.dimensions[names[a].front().own]);
  }
  add_dimension(set, "axis", map.axes.size());
  add_dimension(set, "state", map.states.size());
  add_dimension(set, "input", map.inputs.size());
  add_dimension(set, "mode", map.modes());
  add_dimension(set, "distinct_reason", map.reasons.size());
  add_dimension(set, "second", map.second.points.size());
  add_dimension(set, "crossing", map.crossings.size());
  add_dimension(set, "interval", map.intervals.size());
}

void define_globals(const Dataset& set, const SweepMap& map, const char* title) {
  put_text(set, "Conventions", "CF-1.8");
  put_text(set, "title", title);
  put_text(set, "program", map.program);
  put_text(set, "instruction_set", map.instruction_set);
  if (!map.polar.empty()) put_text(set, "polar", map.polar);
  put_number(set, "format_version", map_format);
}

}  // namespace

void add_head(Dataset& set, Puts& puts, const SweepMap& map, const char* title) {
  const auto names = column_names(map.axes);
  create(set);
  define_dimensions(set, map, names);
  define_globals(set, map, title);
  set.at_points = "condition_name";
  for (const auto& columns : names)
    for (std::size_t c = 1; c < columns.size(); ++c) set.at_points += " " + columns[c].own;
  add_study(set, puts, map.study);
  for (std::size_t a = 0; a < names.size(); ++a) add_axis(set, puts, map.axes[a], names[a]);
}

std::pair<Image, std::size_t> image_of(const SweepMap& map, const std::filesystem::path& file) {
  const Lists lists = lists_of(map);
  Dataset set(file);
  Puts puts;
  add_head(set, puts, map, "Equilibria and their eigenvalues over a grid");
  each_field(map, lists,
             [&](const Field& field, const auto& array) { add(set, puts, field, array); });
  end_definitions(set, puts);
  return finished(set);
}

namespace {

void get_globals(const Dataset& set, SweepMap& map) {
  const int found = get_number(set, "format_version");
  if (found != map_format)
    refuse(set.name, fmt::format("has another format, {} instead of {}", found, map_format));
  map.program = get_text(set, "program");
  map.instruction_set = get_text(set, "instruction_set");
  if (has(set, "polar")) map.polar = get_text(set, "polar");  // older files have none
  map.study = get_study(set);
}

}  // namespace

Contents contents_in(std::span<std::byte> content, const std::filesystem::path& file) {
  Dataset set(file);
  open(set, content);
  Contents c;
  SweepMap& map = c.map.grid;
  get_globals(set, map);
  c.verdicts = has(set, "detail");
  const bool part = c.verdicts && has(set, "part");
  const char* const over = part ? "part_of" : c.verdicts ? "verdict" : "status";
  for (const std::string& axis : find_dimensions(set, over))
    map.axes.push_back(get_axis(set, axis));
  each_field(map, c.lists, [&](const Field& field, auto& array) {
    if (!c.verdicts || field.over.front() != "point") get(set, field, array);
  });
  if (c.verdicts) get_verdicts(set, c.map);
  return c;
}

}  // namespace tiltrim::filing
