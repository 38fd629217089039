#include "study/section.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/lookup.hpp"

namespace tiltrim::reading {

std::string describe(const Accepted& a) {
  return fmt::format("a number from {} to {}{}{}", a.lower, a.upper, a.unit.empty() ? "" : " ",
                     a.unit);
}

std::string described(const Entry& entry) {
  const bool empty = entry.kind == Entry::Kind::array && entry.entries.empty();
  return empty ? "an empty array" : describe(entry);
}

Section::Section(const std::filesystem::path& file, const Entry& table, std::string title,
                 std::string prefix)
    : file_(file), table_(table), title_(std::move(title)), prefix_(std::move(prefix)) {}

void Section::refuse(const Entry& entry, std::string_view message) const {
  reading::refuse(file_, entry.place, fmt::format("{}{}: {}", prefix_, entry.key, message));
}

void Section::refuse(std::string_view key, std::string_view message) const {
  reading::refuse(file_, table_.place, fmt::format("{}{}: {}", prefix_, key, message));
}

// The valid key that differs only in the unit suffix of an angle, the commonest error; or empty.
static std::string with_its_suffix(const std::string& key, const std::vector<std::string>& keys) {
  std::string bare = key;
  for (const std::string_view suffix : {"_deg", "_degrees", "_degree", "_rad", "_radians"})
    if (key.ends_with(suffix)) bare = key.substr(0, key.size() - suffix.size());
  std::vector<std::string> same{bare, bare + "_deg"};
  if (key.find("_deg") != key.npos) std::ranges::reverse(same);
  const auto known = std::ranges::find_first_of(same, keys);
  return known == same.end() ? "" : *known;
}

static std::string hint_for(const std::string& key, const std::vector<std::string>& keys) {
  const std::string same = with_its_suffix(key, keys);
  const std::string nearest = same.empty() ? nearest_name(key, keys) : same;
  if (nearest.empty()) return {};
  const bool degrees = nearest.ends_with("_deg") && !key.ends_with("_deg");
  return fmt::format("did you mean '{}'? {}", nearest, degrees ? "it is in degrees; " : "");
}

void Section::allow_only(const std::vector<std::string>& keys,
                         const std::map<std::string, std::string>& elsewhere) const {
  if (listener) listener({.path = prefix_, .words = keys});
  for (const Entry& entry : table_.entries) {
    if (std::ranges::find(keys, entry.key) != keys.end()) continue;
    const auto known = elsewhere.find(entry.key);
    const std::string hint =
        known == elsewhere.end() ? hint_for(entry.key, keys) : known->second + "; ";
    reading::refuse(file_, entry.key_place,
                    fmt::format("unknown key {} {}; {}valid keys: {}", in_quotes(entry.key), title_,
                                hint, fmt::join(keys, ", ")));
  }
}

const Entry* Section::find(std::string_view key) const {
  const auto at = std::ranges::find(table_.entries, key, &Entry::key);
  return at == table_.entries.end() ? nullptr : &*at;
}

const Entry& Section::require(std::string_view key, std::string_view expected) const {
  const Entry* entry = find(key);
  if (!entry) refuse(key, fmt::format("is missing; expected {}", expected));
  return *entry;
}

static void hear_number(const std::string& path, const Accepted& a, bool whole) {
  if (!listener) return;
  listener({.path = path,
            .number = true,
            .whole = whole,
            .lower = a.lower,
            .upper = a.upper,
            .unit = std::string(a.unit)});
}

// `named` has the key: the entry itself, or its array.
double Section::accept(const Entry& entry, const Entry& named, const Accepted& accepted,
                       std::string_view expected) const {
  hear_number(prefix_ + named.key, accepted, false);
  const auto wrong = [&](std::string_view why) {
    reading::refuse(file_, entry.place,
                    fmt::format("{}{}: {} {}; expected {}", prefix_, named.key,
                                reading::describe(entry), why, expected));
  };
  if (entry.kind != Entry::Kind::number) wrong("is not a number");
  if (!std::isfinite(entry.number)) wrong("is not finite");
  if (!(entry.number >= accepted.lower && entry.number <= accepted.upper)) wrong("is out of range");
  return in_si(entry.number, accepted.unit);
}

double Section::number(const Entry& entry, const Accepted& accepted) const {
  return accept(entry, entry, accepted, describe(accepted));
}

double Section::number(std::string_view key, const Accepted& accepted) const {
  return number(require(key, describe(accepted)), accepted);
}

double Section::whole(const Entry& entry, const Accepted& accepted) const {
  hear_number(prefix_ + entry.key, accepted, true);
  const double value = number(entry, accepted);
  if (value != std::floor(value))
    refuse(entry, fmt::format("{} is not a whole number", reading::describe(entry)));
  return value;
}

std::vector<double> Section::numbers(const Entry& list, const Accepted& accepted) const {
  if (list.kind != Entry::Kind::array || list.entries.empty())
    refuse(list, fmt::format("{} is not a list of numbers; expected [a, b, ...], each {}",
                             described(list), describe(accepted)));
  std::vector<double> values;
  for (const Entry& entry : list.entries) {
    Entry named = entry;  // carries the key of the array
    named.key = list.key;
    (void)number(named, accepted);
    values.push_back(entry.number);
  }
  return values;
}

std::vector<double> Section::rising(const Entry& list, const Accepted& accepted,
                                    std::string_view things) const {
  if (listener) listener({.path = prefix_ + list.key, .least = 2});
  if (list.kind != Entry::Kind::array || list.entries.size() < 2)
    refuse(list, fmt::format("{} is not a list of {}; expected [a, b, ...], at least two, in "
                             "ascending order, each {}",
                             described(list), things, describe(accepted)));
  const std::vector<double> values = numbers(list, accepted);
  for (std::size_t i = 1; i < values.size(); ++i)
    if (!(values[i] > values[i - 1]))
      refuse(list,
             fmt::format("{} after {} is not in ascending order; expected ascending {}, each once",
                         values[i], values[i - 1], things));
  return values;
}

Range Section::range(const Entry& entry, const Accepted& accepted) const {
  const std::string expected = fmt::format("[lower, upper], each {}", describe(accepted));
  if (listener) listener({.path = prefix_ + entry.key, .least = 2, .most = 2});
  if (entry.kind != Entry::Kind::array || entry.entries.size() != 2)
    refuse(entry, fmt::format("{} is not a pair of numbers; expected {}", reading::describe(entry),
                              expected));
  const Range range{accept(entry.entries[0], entry, accepted, expected),
                    accept(entry.entries[1], entry, accepted, expected)};
  if (!(range.lower < range.upper))
    refuse(entry, fmt::format("lower {} is not below upper {}; expected [lower, upper]",
                              entry.entries[0].number, entry.entries[1].number));
  return range;
}

std::string Section::text(std::string_view key) const { return words(key, 200, false); }

std::string Section::passage(std::string_view key) const { return words(key, 5000, true); }

std::string Section::words(std::string_view key, std::size_t longest, bool lines) const {
  const Entry& entry = require(key, "text in quotes");
  if (entry.kind != Entry::Kind::text)
    refuse(entry, fmt::format("{} is not text; expected text in quotes", reading::describe(entry)));
  if (entry.text.empty() || entry.text.size() > longest)
    refuse(entry, fmt::format("{} bytes long; expected 1 to {}", entry.text.size(), longest));
  const auto control = [lines](unsigned char c) {
    return (c < 0x20 && !(lines && (c == '\n' || c == '\t'))) || c == 0x7F;
  };
  if (std::ranges::any_of(entry.text, control))
    refuse(entry, "has a control character; expected printable text");
  return entry.text;
}

std::size_t Section::choice(std::string_view key, const std::vector<std::string>& names) const {
  if (listener) listener({.path = prefix_ + std::string(key), .words = names});
  if (!find(key)) return 0;
  const std::string chosen = text(key);
  const auto at = std::ranges::find(names, chosen);
  if (at != names.end()) return static_cast<std::size_t>(at - names.begin());
  const std::string nearest = nearest_name(chosen, names);
  refuse(*find(key),
         fmt::format("{} is not known; expected one of {}{}", in_quotes(chosen),
                     fmt::join(names, ", "),
                     nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

std::optional<Section> Section::table(std::string_view key) const {
  const Entry* entry = find(key);
  if (!entry) return {};
  const std::string name = prefix_ + std::string(key);
  if (entry->kind != Entry::Kind::table)
    refuse(*entry,
           fmt::format("{} is not a table; expected a table [{}]", described(*entry), name));
  return Section(file_, *entry, fmt::format("in [{}]", name), name + ".");
}

std::vector<Section> Section::tables(std::string_view key) const {
  const Entry* list = find(key);
  if (!list) return {};
  const std::string name = prefix_ + std::string(key);
  if (list->kind == Entry::Kind::table)
    refuse(*list, fmt::format("is one table; expected double brackets, [[{}]]", name));
  if (list->kind != Entry::Kind::array || list->entries.empty())
    refuse(*list, fmt::format("{} is not a list of tables; expected [[{}]] tables",
                              described(*list), name));
  std::vector<Section> found;
  for (const Entry& entry : list->entries) {
    if (entry.kind != Entry::Kind::table)
      reading::refuse(
          file_, entry.place,
          fmt::format("{0}: {1} is not a table; expected [[{0}]] tables", name, described(entry)));
    found.emplace_back(file_, entry, fmt::format("in [[{}]]", name), name + ".");
  }
  return found;
}

}  // namespace tiltrim::reading
