#include "study/lookup_table_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <span>

namespace tiltrim::reading {

namespace {

constexpr Accepted entries{-1e100, 1e100};
constexpr std::size_t most_values = 100000;

// One list of numbers, or a list of such lists.
bool nested(const Entry& entry) {
  return entry.kind == Entry::Kind::array && !entry.entries.empty() &&
         entry.entries.front().kind == Entry::Kind::array;
}

// The entries of each argument.
std::vector<std::vector<double>> read_grid(const Section& section) {
  const Entry& at = section.require("at", "a list of rising numbers, or one for each argument");
  const std::vector<Entry> lists = nested(at) ? at.entries : std::vector<Entry>{at};
  if (lists.size() > 3 || (nested(at) && lists.size() < 2))
    section.refuse(at, fmt::format("{} lists; expected a list of rising numbers for one argument, "
                                   "or two or three such lists",
                                   lists.size()));
  std::vector<std::vector<double>> grid;
  double count = 1;
  for (Entry list : lists) {
    list.key = "at";
    grid.push_back(section.numbers(list, entries));
    const auto falls = std::ranges::adjacent_find(grid.back(), std::greater_equal<>());
    if (falls != grid.back().end())
      section.refuse(list, fmt::format("{} after {} does not rise; expected rising numbers",
                                       *std::next(falls), *falls));
    if (grid.back().size() < 2)
      section.refuse(list, "a single number; expected at least two for each argument");
    count *= double(grid.back().size());
  }
  if (count > double(most_values))
    section.refuse(at, fmt::format("{} combinations; expected at most {}", count, most_values));
  return grid;
}

// A number for each combination of these entries; lists within lists.
void read_values(const Section& section, Entry list, std::span<const std::vector<double>> grid,
                 std::vector<double>& values) {
  list.key = "values";
  const bool last = grid.size() == 1;
  if (list.kind != Entry::Kind::array || nested(list) == last ||
      list.entries.size() != grid[0].size())
    section.refuse(list, fmt::format("{}; expected a list of {} {}, one for each entry of {}",
                                     list.kind == Entry::Kind::array
                                         ? fmt::format("a list of {}", list.entries.size())
                                         : describe(list),
                                     grid[0].size(), last ? "numbers" : "lists",
                                     last ? "the last argument" : "an argument"));
  if (last)
    std::ranges::copy(section.numbers(list, entries), std::back_inserter(values));
  else
    for (const Entry& part : list.entries) read_values(section, part, grid.subspan(1), values);
}

}  // namespace

LookupTable read_lookup_table(const Section& section) {
  section.allow_only({"name", "at", "values", "interpolation"});
  LookupTable table{"", read_grid(section), {}};
  const Entry& values =
      section.require("values", "numbers, a list within the list for each further argument");
  read_values(section, values, table.at, table.values);
  table.smooth = section.choice("interpolation", {"linear", "cubic"}) == 1;
  return table;
}

}  // namespace tiltrim::reading
