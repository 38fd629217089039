#include "report/motions.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "report/json.hpp"
#include "report/line_parts.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

constexpr std::size_t most_shown = 40;

std::string named(const MotionAnswer& m) {
  return fmt::format("{}, from the trim of {}", m.start.model.name, m.asked.start);
}

bool has_samples(const MotionAnswer& m) { return m.motion && !m.motion->t.empty(); }

std::string outcome(const MotionAnswer& m, int digits = 6) {
  if (!m.motion)
    return fmt::format("no trim to start from: {}: {}", to_string(m.start.trim.status),
                       m.start.trim.message);
  const Simulation& s = *m.motion;
  const double end = s.t.empty() ? 0.0 : s.t.back();
  return fmt::format("{} at {:.{}g} s{}", to_string(s.status), end, digits,
                     s.message.empty() ? "" : ": " + s.message);
}

std::string unit_of(const FlightColumn& c) { return c.unit == "degrees" ? "°" : c.unit; }

// The motion at about ten instants.
Sheet course(const MotionAnswer& m) {
  constexpr int rows = 10;
  Sheet sheet;
  for (const FlightColumn& c : m.table.columns)
    sheet.columns.push_back({c.name, c.name == "time" ? "t" : c.name, unit_of(c), "{:.6g}"});
  const std::vector<double>& t = m.motion->t;
  std::size_t last = t.size();
  for (int k = 0; k <= rows; ++k) {
    const double when = t.front() + (t.back() - t.front()) * k / rows;
    const auto row = std::size_t(
        std::min(std::ranges::lower_bound(t, when - 1e-9) - t.begin(), std::ssize(t) - 1));
    if (row == last) continue;
    last = row;
    std::vector<SheetCell> cells;
    for (const FlightColumn& c : m.table.columns) cells.emplace_back(c.values[row]);
    sheet.rows.push_back(std::move(cells));
  }
  return sheet;
}

Sheet events_sheet(const Simulation& s) {
  Sheet sheet{"", {{"t", "t", "s", "{:.6f}"}, {"what", "switch", ""}, {"to", "", ""}}, {}, {}};
  for (std::size_t k = 0; k < std::min(s.events.size(), most_shown); ++k)
    sheet.rows.push_back({s.events[k].t, SheetCell(s.events[k].name),
                          SheetCell(s.events[k].rising ? "above" : "below")});
  if (s.events.size() > most_shown)
    sheet.notes.push_back(
        fmt::format("and {} more: --format json lists them", s.events.size() - most_shown));
  return sheet;
}

bool moves(const FlightColumn& c) {
  constexpr double rounding = 1e-12;
  return std::ranges::any_of(c.values, [&](double v) {
    return std::abs(v - c.values.front()) > rounding * std::max(1.0, std::abs(v));
  });
}

}  // namespace

std::string outcome_of(const MotionAnswer& m) { return named(m) + ": " + outcome(m, 3) + "."; }

std::string motion_text(const MotionAnswer& m, const TextStyle& style) {
  std::string text = fmt::format("{}\n", named(m));
  const Tone tone = m.answered() ? Tone::good : Tone::bad;
  text += wrapped(toned(outcome(m), tone, style) + ".", 2, style.width);
  if (has_samples(m)) text += as_text(course(m), style);
  if (m.motion && !m.motion->events.empty()) text += '\n' + as_text(events_sheet(*m.motion), style);
  return text;
}

std::vector<Sheet> motion_document(const MotionAnswer& m) {
  std::vector<Sheet> sheets;
  if (has_samples(m)) sheets.push_back(course(m));
  if (m.motion && !m.motion->events.empty()) sheets.push_back(events_sheet(*m.motion));
  if (sheets.empty()) sheets.emplace_back();
  sheets.front().title = named(m);
  sheets.front().notes.push_back(outcome(m) + ".");
  return sheets;
}

std::string motion_json(const MotionAnswer& m) {
  ordered_json root{{"name", m.start.model.name}, {"start", m.asked.start}};
  root["status"] = m.motion ? to_string(m.motion->status) : "no_trim";
  root["message"] = m.motion ? m.motion->message : outcome(m);
  if (m.motion) {
    root["error"] = json::named(m.start.model.states, m.motion->error);
    root["stiff"] = m.motion->stiff;
  }
  if (m.motion) {
    root["steps"] = m.motion->steps;
    root["evaluations"] = m.motion->evaluations;
    root["events"] = ordered_json::array();
    for (const Simulation::SwitchEvent& e : m.motion->events)
      root["events"].push_back({{"t", e.t}, {"what", e.name}, {"rising", e.rising}});
    root["units"] = ordered_json::object();
    root["samples"] = ordered_json::object();
    for (const FlightColumn& c : m.table.columns) {
      root["units"][c.name] = c.unit;
      root["samples"][c.name] = c.values;
    }
  }
  return root.dump(2) + "\n";
}

FlightNotes notes_of(const MotionAnswer& m) {
  FlightNotes notes{"motion of " + named(m), "", "", "no_trim", "", {}};
  if (!m.motion) return notes;
  notes.status = to_string(m.motion->status);
  notes.message = m.motion->message;
  for (const Simulation::SwitchEvent& e : m.motion->events)
    notes.events.push_back({e.t, e.rising ? "rising" : "falling", e.name});
  return notes;
}

Figure motion_figure(const MotionAnswer& m) {
  constexpr std::size_t most = 8;
  Figure figure{"motion", fmt::format("Motion of {}", named(m)), "Over time: ", "", {}};
  std::string constant;
  const bool moving = std::ranges::any_of(
      m.table.columns, [](const FlightColumn& c) { return c.name != "time" && moves(c); });
  const FigureAxis time{"time [s]", figures::around(m.motion->t, 0.0), false, {}, ""};
  for (const FlightColumn& c : m.table.columns) {
    if (c.name == "time" || figure.panels.size() >= most) continue;
    if (!moves(c) && moving) {
      if (c.what == "state")
        constant += fmt::format("{}{} = {:.4g}{}", constant.empty() ? ". Constant: " : ", ", c.name,
                                c.values.front(), figures::unit_words(c.unit));
      continue;
    }
    if (!figure.panels.empty()) figure.panels.back().x.label.clear();
    Panel panel{
        time, {figures::with_unit(c.name, c.unit), figures::around(c.values, 0.08), false, {}, ""},
        {},   {},
        {},   8.5,
        ""};
    PlotCurve curve;
    curve.colour = colour::first;
    curve.width = 2;
    curve.x = m.motion->t;
    curve.y = c.values;
    panel.curves.push_back(curve);
    panel.height = std::max(panel.height, text_width(panel.y.label));
    figure.panels.push_back(panel);
    figure.alternative += (figure.panels.size() > 1 ? ", " : "") + c.name;
  }
  figure.caption += constant;
  return figure;
}

}  // namespace tiltrim
