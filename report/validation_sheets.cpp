#include "report/validation_sheets.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "report/json.hpp"

namespace tiltrim {

namespace {

using json::ordered_json;

SheetCell cell(const std::optional<double>& value) {
  return value ? SheetCell(*value) : SheetCell();
}

SheetCell verdict_cell(const Comparison& c) {
  const std::string words = c.verdict();
  return {words, words == "agrees" ? Tone::good : words == "no bound" ? Tone::doubtful : Tone::bad};
}

Sheet group_sheet(const std::string& group, const std::vector<Comparison>& all) {
  Sheet sheet;
  sheet.title = group;
  sheet.columns = {{"condition", "condition", ""},
                   {"quantity", "quantity", ""},
                   {"unit", "unit", ""},
                   {"published", "published", "", "{:.5g}"},
                   {"ours", "ours", "", "{:.5g}"},
                   {"difference", "difference", "", "{:.2g}"},
                   {"allowed", "allowed", "", "{:.2g}"},
                   {"verdict", "", ""},
                   {"source", "source", ""}};
  std::vector<std::string> causes;
  for (const Comparison& c : all) {
    if (c.group != group) continue;
    sheet.rows.push_back({SheetCell(c.condition), SheetCell(c.quantity), SheetCell(c.unit),
                          c.published, cell(c.ours), cell(c.difference()), cell(c.allowed),
                          verdict_cell(c), SheetCell(c.source)});
    const std::string cause = c.quantity + ": " + c.cause;
    if (c.verdict() != "agrees" && !c.cause.empty() &&
        std::ranges::find(causes, cause) == causes.end())
      causes.push_back(cause);
  }
  for (const std::string& cause : causes) sheet.notes.push_back("likely cause, " + cause);
  return sheet;
}

std::vector<std::string> groups_of(const Validation& v) {
  std::vector<std::string> groups;
  for (const Comparison& c : v.comparisons)
    if (groups.empty() || groups.back() != c.group) groups.push_back(c.group);
  return groups;
}

std::string counted(const Validation& v) {
  const auto count = [&](const char* verdict) {
    return std::ranges::count_if(v.comparisons,
                                 [&](const Comparison& c) { return c.verdict() == verdict; });
  };
  return fmt::format(
      "{} published numbers: {} agree, {} miss, {} without answer, {} without a "
      "stated bound",
      v.comparisons.size(), count("agrees"), count("misses"), count("no answer"),
      count("no bound"));
}

}  // namespace

std::vector<Sheet> validation_document(const Validation& v) {
  Sheet summary;
  summary.title = "root mean square difference of the four printed trims from GTRS";
  summary.columns = {{"quantity", "quantity", ""},
                     {"unit", "unit", ""},
                     {"ours", "ours", "", "{:.2f}"},
                     {"simpler", "Kleinhesselink 2007", "", "{:.2f}"}};
  for (const AgainstSimpler& s : v.summary)
    summary.rows.push_back({SheetCell(s.quantity), SheetCell(s.unit), s.ours, s.simpler});
  summary.notes = {counted(v)};
  std::vector<Sheet> sheets{summary};
  for (const std::string& group : groups_of(v)) sheets.push_back(group_sheet(group, v.comparisons));
  return sheets;
}

std::string validation_text(const Validation& v, const TextStyle& style) {
  std::string text;
  for (const Sheet& sheet : validation_document(v))
    text += (text.empty() ? "" : "\n") + as_text(sheet, style);
  return text;
}

Sheet validation_sheet(const Validation& v) {
  Sheet sheet;
  for (const char* key : {"group", "condition", "quantity", "unit", "published", "ours",
                          "difference", "allowed", "verdict", "source", "cause"})
    sheet.columns.push_back({key, key, ""});
  for (const Comparison& c : v.comparisons)
    sheet.rows.push_back({SheetCell(c.group), SheetCell(c.condition), SheetCell(c.quantity),
                          SheetCell(c.unit), c.published, cell(c.ours), cell(c.difference()),
                          cell(c.allowed), verdict_cell(c), SheetCell(c.source),
                          SheetCell(c.verdict() == "agrees" ? "" : c.cause)});
  return sheet;
}

std::string validation_json(const Validation& v) {
  const auto value = [](const std::optional<double>& x) {
    return x ? ordered_json(*x) : ordered_json(nullptr);
  };
  ordered_json all = ordered_json::array(), summary = ordered_json::array();
  for (const Comparison& c : v.comparisons)
    all.push_back({{"group", c.group},
                   {"condition", c.condition},
                   {"quantity", c.quantity},
                   {"unit", c.unit},
                   {"published", c.published},
                   {"ours", value(c.ours)},
                   {"difference", value(c.difference())},
                   {"allowed", value(c.allowed)},
                   {"verdict", c.verdict()},
                   {"source", c.source},
                   {"cause", c.verdict() == "agrees" ? "" : c.cause},
                   {"kleinhesselink", value(c.simpler)}});
  for (const AgainstSimpler& s : v.summary)
    summary.push_back({{"quantity", s.quantity},
                       {"unit", s.unit},
                       {"ours", s.ours},
                       {"kleinhesselink", s.simpler}});
  return ordered_json{{"vehicle", v.vehicle}, {"rms", summary}, {"comparisons", all}}.dump(2) +
         "\n";
}

}  // namespace tiltrim
