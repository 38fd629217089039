#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "report/loops.hpp"
#include "report/map_sheets.hpp"
#include "report/mode_sheets.hpp"
#include "report/paper.hpp"
#include "report/study_report.hpp"

namespace tiltrim {

namespace {

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t most = 6;
  if (names.size() <= most) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more",
                     fmt::join(names.begin(), names.begin() + std::ptrdiff_t(most), ", "),
                     names.size() - most);
}

bool has_verdict(const ConditionReport& c) {
  return c.modes && c.modes->converged && c.modes->verdict != Verdict::undecided;
}

// The table formulation has coefficients only, hence no eigenvalues.
bool wants_verdict(const ConditionReport& c) { return !c.answer.condition.table(); }

std::string ended(const std::string& sentence) {
  return sentence.empty() || sentence.back() == '.' ? sentence : sentence + ".";
}

std::string why_not(const ConditionReport& c) {
  const TrimResult& t = c.answer.trim;
  return ended(to_string(t.status) + (t.message.empty() ? "" : ": " + t.message));
}

void add_condition(const ConditionReport& c, std::vector<Unanswered>& all) {
  const std::string& name = c.answer.condition.name;
  if (!c.answer.has_equilibrium()) {
    all.push_back({"Trim of " + name, why_not(c)});
    if (c.why)
      for (const std::string& words : c.why->words) all.back().more.push_back(ended(words));
    return;
  }
  if (!c.answer.trim) all.push_back({"Trim of " + name + ", with a remark", why_not(c)});
  if (!wants_verdict(c)) return;
  if (c.linear && !*c.linear)
    all.push_back({"Linear model of " + name, ended(c.linear->message)});
  else if (!has_verdict(c))
    all.push_back(
        {"Stability of " + name,
         "undecided: the imaginary axis lies within the error bounds of the eigenvalues."});
}

void add_map(const SweepMap& map, std::vector<Unanswered>& all) {
  const std::size_t n = map.points_per_condition();
  for (std::size_t c = 0; c < map.conditions.size(); ++c) {
    const auto first = map.verdict.begin() + std::ptrdiff_t(c * n);
    const auto open = std::count_if(first, first + std::ptrdiff_t(n), [](std::int8_t v) {
      return v < 0 || v == std::int8_t(Verdict::undecided);
    });
    if (open == 0) continue;
    std::string axes;
    for (const SweepAxis& a : map.axes) axes += (axes.empty() ? "" : " and ") + a.name;
    std::vector<std::string> reasons = reasons_of(map, c);
    if (reasons.empty()) reasons.push_back("the imaginary axis lies within the error bounds");
    const bool whole = std::size_t(open) == n;
    const std::string times = fmt::format("{} x ", open);  // if it is the reason of all
    if (whole && reasons.size() == 1 && reasons.front().starts_with(times))
      reasons.front().erase(0, times.size());
    all.push_back({fmt::format("{} points over {} ({})",
                               whole ? fmt::format("All {}", n) : fmt::format("{} of {}", open, n),
                               axes, map.conditions[c]),
                   ended(fmt::format("{}", fmt::join(reasons, "; ")))});
  }
}

}  // namespace

bool flown_well(const FlightReport& f) {
  return f.flown &&
         (f.flown->status == FlightStatus::flown || f.flown->status == FlightStatus::landed);
}

std::vector<Unanswered> unanswered(const StudyReport& report) {
  std::vector<Unanswered> all;
  for (const ConditionReport& c : report.conditions) add_condition(c, all);
  for (const LoopsAnswer& c : report.loops)
    if (c.trimmed.has_equilibrium() && !c.answered())
      all.push_back({"Margins of " + c.trimmed.condition.name,
                     !c.linear ? "no linear model: " + ended(c.linear.message)
                     : c.modes.verdict == Verdict::stable
                         ? "some margins may have been missed: see the table's notes."
                         : "a loop that is not stable has no margins."});
  for (const StudyReport::Map& m : report.maps) add_map(m.map, all);
  for (const Unanswered& u : report.not_swept) all.push_back({u.what, ended(u.why), u.more});
  if (report.flight && !report.flight->flown)
    all.push_back({"The flight", "no trim to start from: " + ended(report.flight->plan.message)});
  if (report.motion && !report.motion->answered())
    all.push_back({"The motion", outcome_of(*report.motion)});
  if (report.paper && report.paper->identified.status != IdentifyStatus::reproduced)
    all.push_back({"The constants of Table 3", ended(report.paper->identified.message)});
  if (!report.not_examined.empty())
    all.push_back({"The rest of this report",
                   "interrupted: not examined are " + listed(report.not_examined) + "."});
  return all;
}

std::string name_of(const StudyReport& report, const StudyReport::Map& map, std::size_t condition) {
  std::vector<std::string> words;
  if (report.study.conditions.size() > 1) words.push_back(map.map.conditions[condition]);
  if (!map.file.empty()) words.push_back(map.file);
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string verdict_in_words(const StudyReport& report) {
  std::vector<std::string> without, undecided, unstable, stable;
  for (const ConditionReport& c : report.conditions) {
    const std::string& name = c.answer.condition.name;
    if (!c.answer.has_equilibrium())
      without.push_back(fmt::format("{}: {}", name, to_string(c.answer.trim.status)));
    else if (!wants_verdict(c))
      continue;
    else if (!has_verdict(c))
      undecided.push_back(name);
    else
      (c.modes->verdict == Verdict::stable ? stable : unstable).push_back(name);
  }
  const bool cut = !report.not_examined.empty();
  const std::string all =
      number_of(report.conditions.size(), "condition") + (cut ? " examined" : "");
  std::vector<std::string> parts;
  if (!without.empty())
    parts.push_back(fmt::format("no verified equilibrium for {} of {} ({})", without.size(), all,
                                listed(without)));
  if (!undecided.empty())
    parts.push_back(
        fmt::format("stability undecided for {} ({})", undecided.size(), listed(undecided)));
  if (!unstable.empty())
    parts.push_back(fmt::format("{} of {} unstable ({})", unstable.size(), all, listed(unstable)));
  if (!stable.empty())
    parts.push_back(stable.size() == report.conditions.size()
                        ? fmt::format("{} in verified equilibrium and stable",
                                      stable.size() == 1 && !cut ? "the condition is"
                                      : stable.size() == 1 ? "the one " + all.substr(2) + " is"
                                                           : fmt::format("all {} are", all))
                        : fmt::format("{} in verified equilibrium and stable", stable.size()));
  if (report.conditions.empty())
    parts.emplace_back("no condition was examined");
  else if (parts.empty())
    parts.push_back(fmt::format("{} in verified equilibrium", all));
  std::string words = fmt::format("{}", fmt::join(parts, "; "));
  for (const StudyReport::Map& m : report.maps)
    if (m.map.axes.size() == 1 && !m.map.intervals.empty())
      for (std::size_t c = 0; c < m.map.conditions.size(); ++c) {
        const std::string name = name_of(report, m, c);
        words += fmt::format(". Along {}{}: {}", m.map.axes[0].name,
                             name.empty() ? "" : " (" + name + ")", line_in_words(m.map, c, 0));
      }
  if (report.flight && report.flight->flown && !flown_well(*report.flight)) {
    const FlightResult& f = *report.flight->flown;
    words += fmt::format(". The flight ends at {:.3g} s: {}", f.t.back(),
                         f.message.empty() ? to_string(f.status) : f.message);
  } else if (report.flight && report.flight->flown) {
    words += fmt::format(". The flight is completed at {:.3g} s", report.flight->flown->t.back());
  }
  if (report.motion) words += ". The motion of " + ended(outcome_of(*report.motion));
  if (words.ends_with('.')) words.pop_back();
  words.front() = char(std::toupper(static_cast<unsigned char>(words.front())));
  if (cut)
    words = fmt::format("Interrupted, so incomplete: not examined are {}. {}",
                        listed(report.not_examined), words);
  return words + ".";
}

// ---- Tables -------------------------------------------------------------------------------------

namespace {

std::string limits_in_words(const TrimResult& trim) {
  std::vector<std::string> limits;
  for (const ActiveLimit& l : trim.limits_active)
    limits.push_back(l.signal + (l.upper ? " upper" : " lower"));
  return limits.empty() ? "none" : fmt::format("{}", fmt::join(limits, ", "));
}

// A condition in short: limits, verdict, the least damped mode.
std::vector<SheetCell> in_short(const ConditionReport& c) {
  std::vector<SheetCell> cells(5);
  if (c.answer.has_equilibrium()) cells[4] = SheetCell(limits_in_words(c.answer.trim));
  if (!c.modes || c.modes->modes.empty()) return cells;
  const auto at_least = [](const Mode& m) { return std::isnan(m.damping()) ? -1 : m.damping(); };
  const Mode& least = *std::ranges::min_element(c.modes->modes, {}, at_least);
  cells[0] = SheetCell(to_string(c.modes->verdict), tone_of(c.modes->verdict));
  cells[1] = c.modes->spectral_abscissa;
  cells[2] = damping_cell(least);
  cells[3] = least.name;
  return cells;
}

Sheet verdicts_sheet(const std::vector<ConditionReport>& conditions) {
  Sheet sheet{"Verdicts and least damped modes",
              {{"name", "condition", ""},
               {"status", "status", ""},
               {"verdict", "verdict", ""},
               {"spectral_abscissa", "max Re λ", "1/s", "{:.4f}"},
               {"least_damping", "least ζ", "", "{:.3f}"},
               {"least_damped", "of the mode", ""},
               {"limits", "at limits", ""}},
              {},
              {}};
  const Sheet trims = trim_sheet(conditions);
  const auto status = std::ranges::find(trims.columns, "status", &SheetColumn::key);
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const std::vector<SheetCell>& trim = trims.rows[i];
    sheet.rows.push_back({trim.front(), trim[std::size_t(status - trims.columns.begin())]});
    const std::vector<SheetCell> cells = in_short(conditions[i]);
    sheet.rows[i].insert(sheet.rows[i].end(), cells.begin(), cells.end());
  }
  return sheet;
}

// The trims as `trim` prints them, in tables that fit on a printed page: each repeats the names.
std::vector<Sheet> trims_sheets(const std::vector<ConditionReport>& conditions) {
  Sheet rest = trim_sheet(conditions);
  const auto status = std::ranges::find(rest.columns, "status", &SheetColumn::key);
  const std::ptrdiff_t at = status - rest.columns.begin();
  rest.columns.erase(status);
  for (auto& row : rest.rows) row.erase(row.begin() + at);
  constexpr std::size_t most = 11;  // columns
  std::vector<Sheet> sheets;
  for (std::size_t from = 1; from < rest.columns.size(); from += most - 1) {
    const auto part = [&](const auto& list) {
      const auto to = std::min(list.size(), from + most - 1);
      auto taken =
          std::vector(list.begin() + std::ptrdiff_t(from), list.begin() + std::ptrdiff_t(to));
      taken.insert(taken.begin(), list.front());
      return taken;
    };
    Sheet& sheet = sheets.emplace_back(
        Sheet{sheets.empty() ? "Trims" : "Trims, continued", part(rest.columns), {}, {}});
    for (const auto& row : rest.rows) sheet.rows.push_back(part(row));
  }
  return sheets;
}

}  // namespace

std::vector<NamedSheet> report_sheets(const StudyReport& report) {
  std::vector<NamedSheet> all{{"conditions", verdicts_sheet(report.conditions)}};
  for (const Sheet& trims : trims_sheets(report.conditions))
    all.push_back({fmt::format("trims_{}", all.size()), trims});
  for (std::size_t i = 0; i < report.conditions.size(); ++i) {
    const ConditionReport& c = report.conditions[i];
    if (!c.modes || c.modes->modes.empty()) continue;
    all.push_back({file_name_of("modes_", i, c.answer.condition.name), modes_sheet(c)});
    all.back().sheet.title = "Eigenvalues: " + c.answer.condition.name;
  }
  if (!report.loops.empty()) {
    all.push_back({"margins", margins_sheet(report.loops)});
    all.back().sheet.title = "Margins of the loops broken at each actuator";
  }
  std::size_t number = 0;
  for (const StudyReport::Map& m : report.maps)
    for (std::size_t c = 0; c < m.map.conditions.size(); ++c, ++number) {
      if (m.map.axes.size() != 1 || m.map.intervals.empty()) continue;
      all.push_back(
          {file_name_of("intervals_", number, m.map.conditions[c]), intervals_sheet(m.map, c, 0)});
    }
  if (report.flight && report.flight->flown) {
    std::size_t k = 0;
    for (const Sheet& sheet : flight_document(*report.flight))
      if (!sheet.columns.empty()) all.push_back({fmt::format("flight_{}", ++k), sheet});
  }
  if (report.motion) {
    std::size_t k = 0;
    for (const Sheet& sheet : motion_document(*report.motion))
      if (!sheet.columns.empty()) all.push_back({fmt::format("motion_{}", ++k), sheet});
  }
  if (report.paper) {
    std::size_t k = 0;
    for (const Sheet& sheet : paper_sheets(*report.paper))
      all.push_back({fmt::format("paper_{}", ++k), sheet});
  }
  return all;
}

}  // namespace tiltrim
