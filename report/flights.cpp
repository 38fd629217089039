#include "report/flights.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "model/degrees.hpp"
#include "report/json.hpp"
#include "report/paper_facts.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

constexpr std::size_t most_events = 60;  // listed

Tone tone(FlightStatus status) {
  return status == FlightStatus::flown || status == FlightStatus::landed ? Tone::good : Tone::bad;
}

std::string in_words(FlightStatus status) {
  switch (status) {
    case FlightStatus::flown:
      return "completed";
    case FlightStatus::landed:
      return "landed";
    case FlightStatus::ground_contact:
      return "hits the ground";
    case FlightStatus::lost:
      return "lost";
    case FlightStatus::not_finite:
      return "not finite";
    case FlightStatus::stuck:
      return "stuck";
    case FlightStatus::interrupted:
      return "interrupted";
  }
  return "?";
}

std::string in_words(const FlightEvent& event) {
  switch (event.kind) {
    case FlightEventKind::limit_reached:
      return event.what + " limit reached";
    case FlightEventKind::limit_left:
      return event.what + " limit left";
    case FlightEventKind::hand_over:
      return "handover " + event.what;
    case FlightEventKind::lift_off:
      return "lift-off" + (event.what == "at once" ? " at once" : std::string());
    case FlightEventKind::ground_contact:
      return "ground contact";
    case FlightEventKind::schedule_kink:
      return "schedule passes " + event.what;
    case FlightEventKind::lost:
      return event.what;
  }
  return "?";
}

// ---- The flight ---------------------------------------------------------------------------------

std::string verdict(const FlightReport& r, const TextStyle& style) {
  if (!r.flown)
    return toned("no flight", Tone::bad, style) + ": no trim to start from: " + r.plan.message +
           "\n";
  const FlightResult& f = *r.flown;
  std::string line = fmt::format("{}, starting {}: {} at {:.6g} s", r.name, r.plan.start_words,
                                 toned(in_words(f.status), tone(f.status), style), f.t.back());
  if (!f.message.empty()) line += ": " + f.message;
  return line + "\n";
}

// Removes the sign of values printed as zero.
double tidy(double value) {
  constexpr double finest = 5e-5;  // half a unit of the fourth digit
  return std::abs(value) < finest ? 0.0 : value;
}

// The flight at about ten instants.
Sheet course(const FlightReport& r) {
  Sheet sheet{"",
              {{"time", "t", "s", "{:.1f}"},
               {"V", "V", "m/s", "{:.2f}"},
               {"gamma_deg", "γ", "°", "{:.2f}"},
               {"theta_deg", "θ", "°", "{:.2f}"},
               {"eta_deg", "η", "°", "{:.1f}"},
               {"height", "h", "m", "{:.1f}"},
               {"distance", "x", "m", "{:.1f}"},
               {"theta0", "θ₀", "", "{:.3f}"},
               {"a1s_deg", "a1s", "°", "{:.2f}"},
               {"delta_e_deg", "δe", "°", "{:.2f}"},
               {"He", "He", "", "{:.4f}"},
               {"Le", "Le", "", "{:.4f}"}},
              {},
              {}};
  const std::vector<double>& t = r.table["time"];
  constexpr int rows = 10;
  for (int k = 0; k <= rows; ++k) {
    const double when = t.front() + (t.back() - t.front()) * k / rows;
    const auto row = std::size_t(
        std::min(std::ranges::lower_bound(t, when - 1e-9) - t.begin(), std::ssize(t) - 1));
    std::vector<SheetCell> cells;
    for (const SheetColumn& c : sheet.columns) cells.push_back(tidy(r.table[c.key][row]));
    sheet.rows.push_back(std::move(cells));
  }
  return sheet;
}

std::string limits_touched(const FlightResult& f) {
  std::set<std::string> touched;
  for (const FlightEvent& e : f.events)
    if (e.kind == FlightEventKind::limit_reached || e.kind == FlightEventKind::limit_left)
      touched.insert(e.what);
  std::string all;
  for (const std::string& name : touched) all += (all.empty() ? "" : ", ") + name;
  return touched.empty() ? "no limit reached" : "limits reached: " + all;
}

Sheet events_sheet(const FlightResult& f) {
  Sheet sheet{
      "", {{"t", "t", "s", "{:.6f}"}, {"h", "h", "m", "{:.2f}"}, {"what", "event", ""}}, {}, {}};
  for (std::size_t k = 0; k < std::min(f.events.size(), most_events); ++k) {
    const FlightEvent& e = f.events[k];
    sheet.rows.push_back({e.t, tidy(e.before.height), in_words(e)});
  }
  if (f.events.size() > most_events)
    sheet.notes.push_back(
        fmt::format("and {} more: --format json lists them", f.events.size() - most_events));
  return sheet;
}

std::string balance_text(const FlightReport& r) {
  const FlightResult& f = *r.flown;
  const double g = r.plan.flight.vehicle.aircraft.gravity;
  const bool body = r.plan.flight.axes == Axes::body;
  const auto energy = [&](const FlightState& x) {
    const double square = body ? x.along * x.along + x.across * x.across : x.along * x.along;
    return square / 2 + g * x.height - x.thrust_work + x.drag_work - x.wind_work;
  };
  double off = 0.0, size = 1.0;
  for (const FlightState& x : f.states) {
    off = std::max(off, std::abs(energy(x) - energy(f.states.front())));
    size = std::max(size, std::abs(x.thrust_work));
  }
  return fmt::format(
      "energy balance: work of thrust, drag and wind less the change of ½V² + gh is {:.1e} of the "
      "work; {} steps at a tolerance of {:.0e}",
      off / size, f.steps, r.plan.options.integrate.tolerance);
}

// The estimated error of the final position; empty if there is no estimate.
std::string error_text(const FlightReport& r) {
  if (!r.plan.options.global_error || !r.flown->ended()) return {};
  if (!r.flown->rough_end)
    return "error of the final state: unknown; with ten times the tolerance the flight ends "
           "differently";
  const auto of = [&](const char* name) {
    const auto column = std::ranges::find(r.table.columns, name, &FlightColumn::name);
    return column == r.table.columns.end() ? 0.0 : column->error;
  };
  return fmt::format(
      "estimated error of the final state: V {:.0e} m/s, γ {:.0e}°, θ {:.0e}°, distance {:.0e} m, "
      "height {} m",
      of("V"), of("gamma_deg"), of("theta_deg"), of("distance"),
      of("height") == 0 ? "0" : fmt::format("{:.0e}", of("height")));
}

std::string hand_over_text(const HandOverCheck& c, const TextStyle& style) {
  if (c.verdict == HandOverVerdict::never) return "handover: not on the schedule\n";
  if (c.verdict == HandOverVerdict::blended)
    return "handover: blended (cyclic_blend_deg), without a jump\n";
  const std::string where = fmt::format(
      "handover to the {} at η = {:.4g}°, {} (V = {:.3g} m/s, γ = {:.3g}°)",
      c.behind.airplane ? "elevator" : "cyclic", c.command.eta * degrees,
      c.t > 0 ? fmt::format("t = {:.4g} s", c.t) : fmt::format("h = {:.4g} m", c.height),
      c.command.V, std::round(c.command.gamma * degrees * 1e9) / 1e9 + 0.0);
  const auto says = [&](const std::string& words, Tone tone) {
    return where + ": " + toned(words, tone, style);
  };
  std::string text;
  switch (c.verdict) {
    case HandOverVerdict::settles:
      text = says("the flight continues from the trim before it", Tone::good);
      break;
    case HandOverVerdict::lost:
      text = says(
          c.ends == FlightStatus::flown
              ? fmt::format("loss predicted: starting from the trim before it, the flight has not "
                            "returned to the command after {:.0f} s",
                            c.ends_at)
              : fmt::format("loss predicted: starting from the trim before it, the flight {} "
                            "after {:.1f} s",
                            c.ends == FlightStatus::ground_contact ? in_words(c.ends)
                                                                   : "is " + in_words(c.ends),
                            c.ends_at),
          Tone::bad);
      break;
    case HandOverVerdict::not_reached:
      text = says(
          fmt::format("not decided by the trims: the loop before the handover needs {:.3g} s to "
                      "settle, but the schedule reaches the handover after {:.3g} s",
                      -1 / c.front.abscissa, c.seconds_there),
          Tone::doubtful);
      break;
    case HandOverVerdict::no_trim:
    case HandOverVerdict::blended:
    case HandOverVerdict::never:
      return wrapped(says("no trim", Tone::bad) + ": " + c.message, 0, style.width);
  }
  return wrapped(text, 0, style.width) + wrapped(c.message, 2, style.width);
}

ordered_json command_json(const Command& c) {
  return {{"V", c.V}, {"gamma_deg", c.gamma * degrees}, {"eta_deg", c.eta * degrees}};
}

ordered_json actuators_json(const Actuators& a) {
  return {{"theta0", a.theta0}, {"a1s_deg", a.a1s * degrees}, {"delta_e_deg", a.delta_e * degrees}};
}

ordered_json side_json(const HandOverSide& s) {
  ordered_json side{{"status", to_string(s.status)}, {"message", s.message}};
  if (!is_equilibrium(s.status)) return side;
  side["theta_deg"] = s.state.theta * degrees;
  side["energy_integral"] = s.state.x1;
  side["distribution_integral"] = s.state.x2;
  side["input"] = actuators_json(s.inputs);
  side["spectral_abscissa"] = s.abscissa;
  return side;
}

ordered_json hand_over_json(const HandOverCheck& c) {
  ordered_json check{{"verdict", to_string(c.verdict)}, {"message", c.message}};
  if (c.verdict == HandOverVerdict::never || c.verdict == HandOverVerdict::blended) return check;
  check["t"] = c.t;
  check["height"] = c.height;
  check["command"] = command_json(c.command);
  check["front"] = side_json(c.front);
  check["behind"] = side_json(c.behind);
  check["asked"] = actuators_json(c.asked);
  check["integral_jump"] = c.integral_jump;
  check["ends"] = to_string(c.ends);
  check["ends_at"] = c.ends_at;
  check["seconds_there"] = c.seconds_there;
  return check;
}

// The flight at about ten instants, and its events.
std::vector<Sheet> flight_sheets(const FlightReport& report) {
  if (!report.flown) return {};
  std::vector<Sheet> sheets{course(report)};
  if (!report.flown->events.empty()) sheets.push_back(events_sheet(*report.flown));
  return sheets;
}

}  // namespace

std::string flight_text(const FlightReport& report, const TextStyle& style) {
  std::string text = wrapped(verdict(report, style), 0, style.width);
  for (const HandOverCheck& c : report.hand_over) text += "\n" + hand_over_text(c, style);
  if (!report.flown) return text;
  for (const Sheet& sheet : flight_sheets(report)) text += "\n" + as_text(sheet, style);
  text += "\n" + wrapped(limits_touched(*report.flown), 0, style.width) +
          wrapped(balance_text(report), 0, style.width);
  if (const std::string error = error_text(report); !error.empty())
    text += wrapped(error, 0, style.width);
  return text + facts_text(report.facts, style);
}

static std::string capital(std::string sentence) {
  if (!sentence.empty() && sentence[0] >= 'a' && sentence[0] <= 'z') sentence[0] += 'A' - 'a';
  return sentence;
}

// The lines of a paragraph joined as sentences.
static std::string joined(const std::string& lines) {
  std::istringstream in(lines);
  std::string words;
  for (std::string line; std::getline(in, line);) {
    line.erase(0, line.find_first_not_of(' '));
    if (!line.empty()) words += words.empty() ? line : ". " + capital(line);
  }
  return words + ".";
}

std::vector<std::string> flight_words(const FlightReport& report) {
  constexpr TextStyle unbroken{false, std::size_t(1) << 30};
  std::vector<std::string> words{joined(verdict(report, unbroken))};
  for (const HandOverCheck& c : report.hand_over)
    words.push_back(capital(joined(hand_over_text(c, unbroken))));
  if (!report.flown) return words;
  words.push_back(capital(joined(limits_touched(*report.flown))));
  words.push_back(capital(joined(balance_text(report))));
  if (const std::string error = error_text(report); !error.empty())
    words.push_back(capital(joined(error)));
  return words;
}

std::vector<Sheet> flight_document(const FlightReport& report) {
  std::vector<Sheet> sheets;
  for (const std::string& words : flight_words(report)) sheets.push_back({"", {}, {}, {words}});
  const char* title = "The flight";
  for (Sheet& sheet : flight_sheets(report)) {
    sheet.title = std::exchange(title, "Its events");
    sheets.push_back(std::move(sheet));
  }
  if (!report.facts.empty()) sheets.push_back(facts_sheet(report.facts));
  return sheets;
}

Sheet flight_sheet(const FlightReport& report) { return table_sheet(report.table); }

Sheet table_sheet(const FlightTable& table) {
  Sheet sheet;
  for (const FlightColumn& c : table.columns)
    sheet.columns.push_back({c.name, c.name, c.unit, "{}"});
  for (std::size_t k = 0; k < table.rows(); ++k) {
    std::vector<SheetCell> row;
    for (const FlightColumn& c : table.columns) row.emplace_back(c.values[k]);
    sheet.rows.push_back(std::move(row));
  }
  return sheet;
}

std::string flight_json(const FlightReport& report) {
  ordered_json root{{"name", report.name}, {"start", report.plan.start_words}};
  root["status"] = report.flown ? to_string(report.flown->status) : "no_trim";
  root["message"] = report.flown ? report.flown->message : report.plan.message;
  root["hand_over"] = ordered_json::array();
  for (const HandOverCheck& c : report.hand_over) root["hand_over"].push_back(hand_over_json(c));
  if (report.flown) {
    root["steps"] = report.flown->steps;
    root["evaluations"] = report.flown->evaluations;
    root["error"] = nullptr;  // of the last sample
    if (report.flown->rough_end) {
      root["error"] = ordered_json::object();
      for (const FlightColumn& c : report.table.columns) root["error"][c.name] = c.error;
    }
    root["events"] = ordered_json::array();
    for (const FlightEvent& e : report.flown->events)
      root["events"].push_back({{"t", e.t},
                                {"kind", to_string(e.kind)},
                                {"what", e.what},
                                {"height", e.before.height},
                                {"distribution_integral_before", e.before.x2},
                                {"distribution_integral_after", e.after.x2}});
    root["units"] = ordered_json::object();
    root["samples"] = ordered_json::object();
    for (const FlightColumn& c : report.table.columns) {
      root["units"][c.name] = c.unit;
      root["samples"][c.name] = c.values;
    }
  }
  if (!report.facts.empty()) {
    root["paper"] = ordered_json::array();
    for (const PaperFact& f : report.facts)
      root["paper"].push_back({{"figure", f.figure},
                               {"paper", f.paper},
                               {"flight", f.flight},
                               {"agrees", f.agrees},
                               {"why", f.why}});
  }
  return root.dump(2) + "\n";
}

}  // namespace tiltrim
