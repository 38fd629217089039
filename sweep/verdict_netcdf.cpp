// Maps of verdicts as NetCDF: a byte a point, deflated. Of a part, the runs.
#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "runtime/whole_file.hpp"
#include "sweep/map_netcdf.hpp"
#include "sweep/verdict_map.hpp"
#include "sweep/verdict_runs.hpp"

namespace tiltrim::filing {

namespace {

// The points as the last of these dimensions, in rows of the last but one.
std::vector<std::size_t> sizes_of(const SweepMap& grid) {
  std::vector<std::size_t> sizes{grid.conditions.size()};
  for (const SweepAxis& axis : grid.axes) sizes.push_back(axis.size());
  return sizes;
}

// Calls each(start, count) for hyperslabs of whole lines, in their order.
void each_slab(const std::vector<std::size_t>& sizes, const auto& each) {
  constexpr std::size_t most = std::size_t(1) << 20;  // points
  const std::size_t row = sizes.size() - 2;
  std::vector<std::size_t> start(sizes.size(), 0), count(sizes.size(), 1);
  count.back() = sizes.back();
  while (start[0] < sizes[0]) {
    count[row] = std::min(std::max<std::size_t>(most / sizes.back(), 1), sizes[row] - start[row]);
    each(start, count);
    start[row] += count[row];
    for (std::size_t d = row; d > 0 && start[d] == sizes[d]; --d) {
      start[d] = 0;
      ++start[d - 1];
    }
  }
}

Field verdict_field() {
  return {"verdict", {"point"}, "stability of the equilibrium", "", verdicts(), -1};
}

std::size_t lines_in(const SweepMap& grid) {
  std::size_t lines = grid.conditions.size();
  for (std::size_t a = 0; a + 1 < grid.axes.size(); ++a) lines *= grid.axes[a].size();
  return lines;
}

void put_verdicts(const Dataset& set, int variable, const VerdictMap& map) {
  std::size_t at = 0;
  std::vector<std::int8_t> codes;
  each_slab(sizes_of(map.grid), [&](const auto& start, const auto& count) {
    const std::size_t points = count.back();
    codes.clear();
    for (std::size_t l = 0; l < count[count.size() - 2]; ++l)
      each_run(map.runs, at, points,
               [&](std::int8_t code, std::size_t n) { codes.insert(codes.end(), n, code); });
    put_bytes(set, variable, start, count, codes.data());
  });
}

constexpr const char* lines_of_points = "points but for the last axis";  // no name in a file

void add_line_dimension(Dataset& set) {
  Shape lines = set.dimensions["point"];
  lines.ids.pop_back();
  lines.sizes.pop_back();
  set.dimensions[lines_of_points] = lines;
}

const Field& located_field() {
  static const Field field{"borders_located",
                           {lines_of_points},
                           "all borders along the last axis are among the crossings",
                           "",
                           {"no", "yes"}};
  return field;
}

}  // namespace

std::pair<Image, std::size_t> image_of(const VerdictMap& map, const std::filesystem::path& file) {
  const SweepMap& grid = map.grid;
  const Lists lists = lists_of(grid);
  Dataset set(file);
  Puts puts;
  add_head(set, puts, grid, "Stability verdicts over a grid");
  put_text(set, "detail", "verdict");
  put_text(set, "work", map.work);
  each_field(grid, lists, [&](const Field& field, const auto& array) {
    if (field.over.front() != "point") add(set, puts, field, array);
  });
  const bool whole = map.part.of == 1;
  const std::vector<std::uint64_t> part{map.part.number, map.part.of};
  if (whole) {
    if (map.located.size() != lines_in(grid))
      throw std::invalid_argument("write_netcdf: the map does not have the lines of its grid");
    const int variable = define_bytes(set, verdict_field());
    add_line_dimension(set);
    add(set, puts, located_field(), map.located);
    end_definitions(set, puts);
    put_verdicts(set, variable, map);
    return finished(set);
  }
  put_text(set, "part", fmt::format("{}/{}", map.part.number, map.part.of));
  add_dimension(set, "part_number", part.size());
  add_dimension(set, "part_run", map.runs.size());
  add_dimension(set, "part_line", map.located.size());
  // No values over the grid: it is there for its dimensions.
  (void)define_bytes(set, {"part_of", {"point"}, "a part of a map over these dimensions"});
  add(set, puts, {"part_numbers", {"part_number"}, "number of the part, number of parts"}, part);
  add(set, puts, {"part_runs", {"part_run"}, "verdicts, for tiltrim merge"}, map.runs);
  add(set, puts, {"part_located", {"part_line"}, located_field().long_name}, map.located);
  end_definitions(set, puts);
  return finished(set);
}

void get_verdicts(Dataset& set, VerdictMap& map) {
  map.work = get_text(set, "work");
  if (has(set, "part")) {
    std::vector<std::uint64_t> part;
    get(set, Field{"part_numbers", {"part_number"}, ""}, part);
    if (part.size() != 2) refuse(set.name, "part_numbers: has another length");
    map.part = {part[0], part[1]};
    get(set, Field{"part_runs", {"part_run"}, ""}, map.runs);
    get(set, Field{"part_located", {"part_line"}, ""}, map.located);
    return;
  }
  add_line_dimension(set);
  get(set, located_field(), map.located);
  const int variable = find_bytes(set, verdict_field());
  std::vector<std::int8_t> codes;
  each_slab(set.dimensions["point"].sizes, [&](const auto& start, const auto& count) {
    const std::size_t points = count.back(), lines = count[count.size() - 2];
    codes.resize(lines * points);
    get_bytes(set, variable, start, count, codes.data());
    for (const std::int8_t code : codes)
      if (code < -1 || code > std::int8_t(Verdict::undecided))
        refuse(set.name, "verdict: is not one of its meanings");
    for (std::size_t l = 0; l < lines; ++l)
      append_runs(std::span(codes).subspan(l * points, points), map.runs);
  });
}

void check_verdicts(const VerdictMap& map) {
  const auto wrong = [](const char* what) { throw std::runtime_error(what); };
  const SweepPart& part = map.part;
  if (map.grid.conditions.empty()) wrong("condition_name: is empty");
  if (part.number < 1 || part.number > part.of) wrong("part_numbers: is not a part");
  if (map.grid.axes.empty()) wrong("verdict: has no axis");
  double lines = double(map.grid.conditions.size());
  for (std::size_t a = 0; a + 1 < map.grid.axes.size(); ++a)
    lines *= double(map.grid.axes[a].size());
  if (part.of == 1 ? double(map.located.size()) != lines : double(map.located.size()) > lines)
    wrong("borders_located: has a different number of values than lines");
  for (const std::int8_t located : map.located)
    if (located != 0 && located != 1) wrong("borders_located: is neither yes nor no");
  std::size_t at = 0;
  for (std::size_t l = 0; l < map.located.size(); ++l)
    each_run(map.runs, at, map.grid.axes.back().size(), [](std::int8_t, std::size_t) {});
  if (at != map.runs.size()) wrong("part_runs: are more than the lines");
}

}  // namespace tiltrim::filing
