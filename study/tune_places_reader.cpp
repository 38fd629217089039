#include "study/tune_places_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "model/lookup.hpp"
#include "study/requirement_reader.hpp"

namespace tiltrim::reading {

namespace {

using std::filesystem::path;

constexpr Accepted any_height{-largest, largest, "m"};
constexpr std::size_t most_heights = 1000;

bool has_gains(const Condition& condition) { return condition.command() || condition.user(); }

std::string without_gains(const Condition& condition) {
  return fmt::format("{} is of formulation {}, which has no gains", in_quotes(condition.name),
                     formulation_of(condition));
}

// A condition named in the list `conditions`.
const Condition& named_condition(const Section& section, const Entry& list, const Entry& entry,
                                 const std::vector<Condition>& conditions) {
  Entry named = entry;
  named.key = list.key;
  if (entry.kind != Entry::Kind::text)
    section.refuse(named, fmt::format("{} is not text; expected the name of a [[condition]]",
                                      described(entry)));
  const auto at = std::ranges::find(conditions, entry.text, &Condition::name);
  if (at == conditions.end()) {
    std::vector<std::string> names;
    for (const Condition& condition : conditions) names.push_back(condition.name);
    const std::string nearest = nearest_name(entry.text, names);
    section.refuse(
        named,
        fmt::format("{} is not a condition of the study; {}there are: {}", in_quotes(entry.text),
                    nearest.empty() ? "" : fmt::format("did you mean '{}'? ", nearest),
                    fmt::join(names, ", ")));
  }
  if (!has_gains(*at))
    section.refuse(named,
                   fmt::format("{}; expected only conditions of closed_loop", without_gains(*at)));
  return *at;
}

std::set<std::string> listed_conditions(const Section& section, const Entry& list,
                                        const std::vector<Condition>& conditions) {
  if (list.kind != Entry::Kind::array)
    section.refuse(list, fmt::format("{} is not a list of names; expected [\"a\", \"b\", ...]",
                                     described(list)));
  std::set<std::string> names;
  for (const Entry& entry : list.entries) {
    const Condition& condition = named_condition(section, list, entry, conditions);
    if (names.insert(condition.name).second) continue;
    Entry named = entry;
    named.key = list.key;
    section.refuse(named,
                   fmt::format("{} occurs twice; expected each once", in_quotes(entry.text)));
  }
  return names;
}

std::vector<std::string> every_condition(const Section& section,
                                         const std::vector<Condition>& conditions) {
  std::vector<std::string> names;
  for (const Condition& condition : conditions) {
    if (!has_gains(condition))
      section.refuse("conditions",
                     fmt::format("is missing, so all conditions are tuned for, and {}; expected "
                                 "the names of conditions of closed_loop",
                                 without_gains(condition)));
    names.push_back(condition.name);
  }
  return names;
}

}  // namespace

std::vector<std::string> read_places(const Section& section,
                                     const std::vector<Condition>& conditions) {
  const Entry* list = section.find("conditions");
  const bool along_corridor = section.find("corridor");
  if (!list)
    return along_corridor ? std::vector<std::string>{} : every_condition(section, conditions);
  const std::set<std::string> chosen = listed_conditions(section, *list, conditions);
  if (chosen.empty() && !along_corridor)
    section.refuse(*list,
                   "leaves no operating point; expected names of conditions, or also corridor");
  std::vector<std::string> names;
  for (const Condition& condition : conditions)
    if (chosen.contains(condition.name)) names.push_back(condition.name);
  return names;
}

namespace {

void check_one_direction(const Section& section, const Entry& entry,
                         const std::vector<double>& values) {
  const bool up = values.back() > values.front();
  for (std::size_t i = 1; i < values.size(); ++i)
    if (!(up ? values[i] > values[i - 1] : values[i] < values[i - 1]))
      section.refuse(entry, fmt::format("{} after {} reverses the direction; expected ascending or "
                                        "descending heights, each once",
                                        values[i], values[i - 1]));
}

// Both ends exact.
std::vector<double> spaced_heights(const Section& section) {
  section.allow_only({"from", "to", "count"});
  const double from = section.number("from", any_height), to = section.number("to", any_height);
  std::vector<double> heights(read_count(section, double(most_heights)));
  const double steps = double(heights.size() - 1);
  for (std::size_t i = 0; i < heights.size(); ++i)
    heights[i] = from + double(i) / steps * (to - from);
  heights.back() = to;
  return heights;
}

}  // namespace

std::vector<double> read_heights(const Section& section, const path& file) {
  const Entry* entry = section.find("corridor");
  if (!entry) return {};
  std::vector<double> heights;
  if (entry->kind == Entry::Kind::table) {
    heights = spaced_heights(Section(file, *entry, "in corridor", "tune.corridor."));
  } else if (entry->kind == Entry::Kind::array && !entry->entries.empty()) {
    heights = section.numbers(*entry, any_height);
  } else {
    section.refuse(*entry, fmt::format("{} is not a list of heights; expected {{from = 0, to = "
                                       "120, count = 13}} or [a, b, ...], each {}",
                                       described(*entry), describe(any_height)));
  }
  if (heights.size() > most_heights)
    section.refuse(
        *entry, fmt::format("has {} heights; expected at most {}", heights.size(), most_heights));
  check_one_direction(section, *entry, heights);
  return heights;
}

std::vector<double> read_schedule_tilts(const Section& section) {
  const Entry* list = section.find("schedule_eta_deg");
  if (!list) return {};
  const Key eta = study_key("eta_deg");
  std::vector<double> schedule = section.rising(*list, accepted_by(eta), "tilts");
  for (double& value : schedule) value = eta.in_si(value);
  return schedule;
}

}  // namespace tiltrim::reading
