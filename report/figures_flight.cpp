// Figures of a flight over time and over distance.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "report/figure_parts.hpp"

namespace tiltrim::figures {

namespace {

Track flight_track(const FlightReport& flight) {
  Track track{"flight", "the flight", {}, {}};
  for (const FlightColumn& c : flight.table.columns)
    track.columns.push_back({c.name == "time" ? "parameter" : c.name,
                             c.unit == "degrees" && c.name.ends_with("_deg")
                                 ? c.name.substr(0, c.name.size() - 4)
                                 : c.name,
                             c.unit, c.values});
  return track;
}

struct FlightCurve {
  const char *key, *title;
};

Panel flight_panel(const Track& track, const std::string& x_key, const std::string& x_label,
                   const std::string& label, const std::vector<FlightCurve>& curves,
                   double height) {
  const std::vector<double>& x = column(track, x_key)->values;
  Panel panel{{x_label, around(x, 0.0), false, {}, x_key},
              {label, {}, false, {}, ""},
              {},
              {},
              {},
              height,
              ""};
  std::vector<double> all;
  std::size_t k = 0;
  for (const FlightCurve& c : curves) {
    const Track::Column* y = column(track, c.key);
    if (!y) continue;
    PlotCurve curve = nth_curve(k++, c.title);
    curve.x = x;
    curve.y = y->values;
    curve.x_key = x_key;
    curve.y_key = c.key;
    panel.curves.push_back(curve);
    all.insert(all.end(), y->values.begin(), y->values.end());
  }
  panel.y.range = around(all);
  return panel;
}

// Marks the handovers.
void add_hand_overs(const FlightReport& flight, Panel& panel) {
  for (const FlightEvent& e : flight.flown->events) {
    if (e.kind != FlightEventKind::hand_over) continue;
    PlotCurve line = level_line({0, 1}, 0);
    line.x = {e.t, e.t};
    line.y = {panel.y.range.lower, panel.y.range.upper};
    panel.curves.push_back(line);
  }
}

void add_limits(const Range& limits, double factor, const std::string& of, Panel& panel) {
  for (const double limit : {limits.lower * factor, limits.upper * factor})
    if (std::isfinite(limit)) {
      constexpr double room = 1.15;  // for the line and its label
      panel.y.range = {std::min(panel.y.range.lower, limit < 0 ? room * limit : limit),
                       std::max(panel.y.range.upper, room * limit)};
      panel.curves.push_back(level_line(panel.x.range, limit));
      panel.labels.push_back(
          {{{panel.x.range.upper, limit}, {panel.x.range.lower, limit}}, "limit of " + of});
    }
}

}  // namespace

void add_flight(const FlightReport& flight, const Vehicle& vehicle, ReportFigures& all) {
  if (!flight.flown || flight.table.rows() < 2) return;
  const Track track = flight_track(flight);
  const std::string time = "time [s]";
  const auto over_time = [&](const char* label, const std::vector<FlightCurve>& curves) {
    return flight_panel(track, "parameter", time, label, curves, 10.0);
  };
  const std::string ended =
      fmt::format("{} s, {} m high at most", track.columns.front().values.back(),
                  std::ranges::max(column(track, "height")->values));
  const auto add = [&](const char* name, const std::string& caption, std::vector<Panel> panels) {
    for (Panel& p : panels)
      if (p.x.key == "parameter") add_hand_overs(flight, p);
    all.figures.push_back({name, caption + ": " + flight.name,
                           caption + " of the flight " + flight.name + ", " + ended + ".",
                           track.name, std::move(panels)});
  };
  Panel collective = over_time("collective", {{"theta0", "θ₀"}});
  collective.x.label.clear();
  add_limits(vehicle.limits.theta0, 1.0, "θ₀", collective);
  Panel pitch = over_time("[°]", {{"a1s_deg", "cyclic a1s"}, {"delta_e_deg", "elevator δe"}});
  add_limits(vehicle.limits.a1s, degrees, "a1s", pitch);
  add_limits(vehicle.limits.delta_e, degrees, "δe", pitch);
  add("flight_angles", "Pitch, flight path, tilt",
      {over_time("[°]", {{"theta_deg", "pitch θ"},
                         {"gamma_deg", "path γ"},
                         {"gamma_commanded_deg", "path commanded"},
                         {"eta_deg", "tilt η"}})});
  add("flight_speeds", "Speeds",
      {over_time("[m/s]", {{"V", "airspeed"},
                           {"V_commanded", "commanded"},
                           {"climb_rate", "vertical"},
                           {"ground_speed", "horizontal"}})});
  add("flight_controls", "Controls with their limits", {collective, pitch});
  add("flight_energy", "Energy rate and distribution rate errors",
      {over_time("error", {{"He", "He"}, {"Le", "Le"}})});
  add("flight_path", "Height over distance",
      {flight_panel(track, "distance", "distance [m]", "height [m]", {{"height", ""}}, 10.0)});
  all.tracks.push_back(track);
}

}  // namespace tiltrim::figures
