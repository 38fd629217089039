#include "report/loops.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "model/degrees.hpp"
#include "report/json.hpp"
#include "report/mode_sheets.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

double decibels(double factor) { return 20 * std::log10(factor); }

SheetCell in_one_word(Verdict verdict) { return {to_string(verdict), tone_of(verdict)}; }

bool commanded(const ActuatorLoop& l) { return !l.loop.c.isZero(0); }

// Status of a loop in one word.
SheetCell word(const ActuatorLoop& l) {
  if (!l.in_use) return {commanded(l) ? "has no effect" : "not in use"};
  if (l.margins.stable() && !l.margins.complete) return {"incomplete", Tone::doubtful};
  return in_one_word(l.margins.closed_loop);
}

// Status of a condition without loops.
SheetCell word(const LoopsAnswer& c) {
  if (!c.trimmed.has_equilibrium()) return {to_string(c.trimmed.trim.status), Tone::bad};
  if (!c.linear) return {to_string(c.linear.status), Tone::bad};
  return in_one_word(c.modes.verdict);
}

std::vector<SheetCell> row(const LoopsAnswer& c, const ActuatorLoop& l) {
  std::vector<SheetCell> cells{c.trimmed.condition.name, l.actuator};
  const Margins& m = l.margins;
  if (l.in_use && m.stable())
    for (const double value : {decibels(m.gain_up), m.gain_up_at, decibels(m.gain_down),
                               m.gain_down_at, m.phase * degrees, m.phase_at, m.delay, m.delay_at,
                               m.disk, m.disk_at, m.sensitivity_peak, m.sensitivity_peak_at})
      cells.emplace_back(value);
  return cells;
}

// Why a condition has no margins; empty if it has them.
std::string reason(const LoopsAnswer& c) {
  if (!c.trimmed.has_equilibrium()) return "no trim, so no margins: " + c.trimmed.trim.message;
  if (!c.linear) return "no linear model, so no margins: " + c.linear.message;
  if (!c.modes.converged) return "no margins: the eigenvalue iteration did not converge";
  const Mode& last = c.modes.modes.back();
  const std::string which = fmt::format("{} 1/s ({})", eigenvalue_text(last), last.name);
  switch (c.modes.verdict) {
    case Verdict::stable:
      return {};
    case Verdict::unstable:
      return "the closed loop is unstable, so no margins: right of the axis lies " + which;
    case Verdict::undecided:
      return fmt::format(
          "the stability of the closed loop is undecided, so no margins: the axis lies within the "
          "error bound {:.1e} of {}",
          last.error, which);
  }
  return {};
}

std::vector<std::string> notes(const LoopsAnswer& c) {
  std::vector<std::string> found;
  const std::string why = reason(c);
  if (!why.empty()) found.push_back(why);
  if (c.trimmed.has_equilibrium() && !c.trimmed.trim.message.empty())
    found.push_back(c.trimmed.trim.message);
  for (const std::string& remark : c.linear.remarks) found.push_back(remark);
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use || c.modes.verdict != Verdict::stable) continue;
    if (!l.margins.stable())
      found.push_back(l.actuator +
                      ": within rounding its loop, opened and closed, cannot be distinguished from "
                      "an unstable one");
    else if (!l.margins.complete)
      found.push_back(fmt::format("{}: a margin may have been missed (left over: {:.1e})",
                                  l.actuator, l.margins.residual));
  }
  return found;
}

Sheet without(const Sheet& sheet, const std::vector<std::string>& keys) {
  Sheet rest{sheet.title, {}, std::vector<std::vector<SheetCell>>(sheet.rows.size()), sheet.notes};
  for (std::size_t k = 0; k < sheet.columns.size(); ++k) {
    if (std::ranges::find(keys, sheet.columns[k].key) != keys.end()) continue;
    rest.columns.push_back(sheet.columns[k]);
    for (std::size_t i = 0; i < sheet.rows.size(); ++i) rest.rows[i].push_back(sheet.rows[i].at(k));
  }
  return rest;
}

template <class Values>
ordered_json list(const Values& values) {
  return std::vector<double>(values.begin(), values.end());
}

ordered_json margins_of(const Margins& m) {
  ordered_json crossings = ordered_json::array(), crossovers = ordered_json::array();
  for (const Margins::Crossing& at : m.phase_crossings)
    crossings.push_back({{"frequency", at.frequency}, {"gain", at.change}});
  for (const Margins::Crossing& at : m.gain_crossovers)
    crossovers.push_back({{"frequency", at.frequency}, {"lag", at.change}});
  return {{"gain_up", m.gain_up},
          {"gain_up_at", m.gain_up_at},
          {"gain_down", m.gain_down},
          {"gain_down_at", m.gain_down_at},
          {"phase", m.phase},
          {"phase_at", m.phase_at},
          {"delay", m.delay},
          {"delay_at", m.delay_at},
          {"disk", m.disk},
          {"disk_at", m.disk_at},
          {"disk_gain_up", m.disk_gain_up()},
          {"disk_gain_down", m.disk_gain_down()},
          {"disk_phase", m.disk_phase()},
          {"sensitivity_peak", m.sensitivity_peak},
          {"sensitivity_peak_at", m.sensitivity_peak_at},
          {"phase_crossings", crossings},
          {"gain_crossovers", crossovers},
          {"residual", m.residual},
          {"complete", m.complete}};
}

ordered_json transfer(const LoopTransfer& g) {
  ordered_json A = ordered_json::array();
  for (const auto& of_state : g.A.rowwise()) A.push_back(list(of_state));
  return {
      {"A", A}, {"b", list(g.b)}, {"c", list(g.c)}, {"d", g.d + 0.0}};  // no minus sign before zero
}

ordered_json loop(const ActuatorLoop& l) {
  ordered_json j{{"actuator", l.actuator},
                 {"in_use", l.in_use},
                 {"margins", nullptr},
                 {"loop", nullptr},
                 {"bode", nullptr}};
  if (!l.in_use) return j;
  if (l.margins.stable()) j["margins"] = margins_of(l.margins);
  j["loop"] = transfer(l.loop);
  j["bode"] = {
      {"frequency", l.bode.frequency}, {"magnitude", l.bode.magnitude}, {"phase", l.bode.phase}};
  return j;
}

}  // namespace

Sheet margins_sheet(const std::vector<LoopsAnswer>& conditions) {
  const char* const frequency = "{:.3g}";
  Sheet sheet;
  sheet.columns = {{"name", "condition", ""},
                   {"actuator", "loop", ""},
                   {"gain_up_dB", "gain up", "dB", "{:.2f}"},
                   {"gain_up_at", "at", "rad/s", frequency},
                   {"gain_down_dB", "down", "dB", "{:.2f}"},
                   {"gain_down_at", "at", "rad/s", frequency},
                   {"phase_deg", "phase", "°", "{:.2f}"},
                   {"phase_at", "at", "rad/s", frequency},
                   {"delay", "delay", "s", "{:.4g}"},
                   {"delay_at", "at", "rad/s", frequency},
                   {"disk", "disk", "", "{:.3f}"},
                   {"disk_at", "at", "rad/s", frequency},
                   {"sensitivity_peak", "max |S|", "", "{:.3f}"},
                   {"sensitivity_peak_at", "at", "rad/s", frequency},
                   {"answer", "closed loop", ""}};
  const auto add = [&](std::vector<SheetCell> cells, const SheetCell& answer) {
    cells.resize(sheet.columns.size() - 1);
    cells.push_back(answer);
    sheet.rows.push_back(std::move(cells));
  };
  bool idle = false, idle_own = false;  // a loop of the tiltrotor, of a study's own model
  for (const LoopsAnswer& c : conditions) {
    if (c.loops.empty()) add({c.trimmed.condition.name}, word(c));
    for (const ActuatorLoop& l : c.loops) add(row(c, l), word(l));
    for (const std::string& note : notes(c))
      sheet.notes.push_back(c.trimmed.condition.name + ": " + note + ".");
    const auto* user = c.trimmed.condition.user();
    const bool own = user && !user->model->xv15;
    (own ? idle_own : idle) |= !std::ranges::all_of(c.loops, commanded);
  }
  if (idle)
    sheet.notes.push_back("Not in use: the law does not command this actuator at this tilt.");
  if (idle_own)
    sheet.notes.push_back(
        "Not in use: the output of this loop does not depend on the states, so its gain is zero.");
  return sheet;
}

Sheet bode_sheet(const std::vector<LoopsAnswer>& conditions) {
  Sheet sheet;
  sheet.columns = {{"name", "", ""},
                   {"actuator", "", ""},
                   {"frequency", "", ""},
                   {"magnitude_dB", "", ""},
                   {"phase_deg", "", ""}};
  for (const LoopsAnswer& c : conditions)
    for (const ActuatorLoop& l : c.loops)
      for (std::size_t k = 0; k < l.bode.frequency.size(); ++k)
        sheet.rows.push_back({c.trimmed.condition.name, l.actuator, l.bode.frequency[k],
                              decibels(l.bode.magnitude[k]), l.bode.phase[k] * degrees});
  return sheet;
}

static Sheet for_people(const std::vector<LoopsAnswer>& conditions) {
  return without(margins_sheet(conditions), {"delay_at", "sensitivity_peak_at"});
}

std::string margins_text(const std::vector<LoopsAnswer>& conditions, const TextStyle& style) {
  return as_text(for_people(conditions), style);
}

std::vector<Sheet> margins_document(const std::vector<LoopsAnswer>& conditions) {
  Sheet sheet = for_people(conditions);
  sheet.title = "Margins of the loop broken at each actuator";
  return {sheet};
}

std::string margins_json(const std::vector<LoopsAnswer>& conditions) {
  ordered_json all{{"conditions", ordered_json::array()}};
  for (const LoopsAnswer& c : conditions) {
    ordered_json j{{"name", c.trimmed.condition.name},
                   {"status", to_string(c.trimmed.trim.status)},
                   {"message", c.linear ? c.trimmed.trim.message : reason(c)},
                   {"verdict", nullptr},
                   {"loops", ordered_json::array()}};
    if (c.linear) j["verdict"] = to_string(c.modes.verdict);
    for (const ActuatorLoop& l : c.loops) j["loops"].push_back(loop(l));
    all["conditions"].push_back(j);
  }
  return all.dump(1) + '\n';
}

}  // namespace tiltrim
