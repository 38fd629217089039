#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>
#include <functional>
#include <stdexcept>

#include "flight/fly.hpp"
#include "model/degrees.hpp"

namespace tiltrim {

namespace {

struct Instant {
  double t;
  const FlightState& x;
  const FlightMode& mode;
  const FlightPoint& at;
  const Aircraft& aircraft;
};

struct Field {
  const char *name, *unit, *what;
  std::function<double(const Instant&)> value;
};

const std::vector<Field>& fields() {
  static const std::vector<Field> all{
      {"time", "s", "time", [](const Instant& i) { return i.t; }},
      {"V", "m/s", "airspeed", [](const Instant& i) { return i.at.V; }},
      {"gamma_deg", "degrees", "flight-path angle through the air",
       [](const Instant& i) { return i.at.gamma * degrees; }},
      {"theta_deg", "degrees", "pitch attitude",
       [](const Instant& i) { return i.x.theta * degrees; }},
      {"alpha_deg", "degrees", "angle of attack",
       [](const Instant& i) { return i.at.alpha * degrees; }},
      {"q", "rad/s", "pitch rate", [](const Instant& i) { return i.x.q; }},
      {"energy_integral", "s", "integral of He", [](const Instant& i) { return i.x.x1; }},
      {"distribution_integral", "s", "integral of Le", [](const Instant& i) { return i.x.x2; }},
      {"distance", "m", "over the ground", [](const Instant& i) { return i.x.distance; }},
      {"height", "m", "over the ground", [](const Instant& i) { return i.x.height; }},
      {"ground_speed", "m/s", "along the ground",
       [](const Instant& i) { return i.at.ground_speed; }},
      {"climb_rate", "m/s", "over the ground", [](const Instant& i) { return i.at.climb_rate; }},
      {"eta_deg", "degrees", "nacelle tilt", [](const Instant& i) { return i.at.eta * degrees; }},
      {"V_commanded", "m/s", "airspeed commanded", [](const Instant& i) { return i.at.command.V; }},
      {"gamma_commanded_deg", "degrees", "path angle commanded",
       [](const Instant& i) { return i.at.command.gamma * degrees; }},
      {"theta0", "1", "collective", [](const Instant& i) { return i.at.used.theta0; }},
      {"a1s_deg", "degrees", "longitudinal cyclic",
       [](const Instant& i) { return i.at.used.a1s * degrees; }},
      {"delta_e_deg", "degrees", "elevator",
       [](const Instant& i) { return i.at.used.delta_e * degrees; }},
      {"theta0_asked", "1", "collective ahead of its limits",
       [](const Instant& i) { return i.at.asked.theta0; }},
      {"a1s_asked_deg", "degrees", "cyclic ahead of its limits",
       [](const Instant& i) { return i.at.asked.a1s * degrees; }},
      {"delta_e_asked_deg", "degrees", "elevator ahead of its limits",
       [](const Instant& i) { return i.at.asked.delta_e * degrees; }},
      {"He", "1", "energy rate error (7)", [](const Instant& i) { return i.at.He; }},
      {"Le", "1", "distribution rate error (7)", [](const Instant& i) { return i.at.Le; }},
      {"thrust", "N", "thrust", [](const Instant& i) { return i.at.thrust; }},
      {"lift", "N", "lift", [](const Instant& i) { return i.at.lift; }},
      {"drag", "N", "drag", [](const Instant& i) { return i.at.drag; }},
      {"thrust_power", "W", "that thrust gives to the motion, T V cos φ",
       [](const Instant& i) { return i.aircraft.mass * i.at.rates.thrust_work; }},
      {"drag_power", "W", "that drag takes from it, D V",
       [](const Instant& i) { return i.aircraft.mass * i.at.rates.drag_work; }},
      {"induced_power", "W", "that goes into the wake, T vi",
       [](const Instant& i) { return i.at.thrust * i.at.induced_velocity; }},
      {"on_ground", "1", "1: held on the ground",
       [](const Instant& i) { return double(i.mode.on_ground); }},
      {"elevator_side", "1", "1: the elevator has the pitch",
       [](const Instant& i) { return double(i.mode.airplane); }}};
  return all;
}

}  // namespace

const std::vector<double>& FlightTable::operator[](const std::string& name) const {
  std::vector<std::string> names;
  for (const FlightColumn& c : columns) {
    if (c.name == name) return c.values;
    names.push_back(c.name);
  }
  throw std::invalid_argument(
      fmt::format("no column '{}'; there are: {}", name, fmt::join(names, ", ")));
}

FlightTable flight_table(const Flight& flight, const FlightResult& flown) {
  FlightTable table;
  for (const Field& f : fields()) table.columns.push_back({f.name, f.unit, f.what, {}});
  const auto each = [&](double t, const FlightState& x, const FlightMode& mode, const auto& take) {
    const FlightPoint at = flight_point(flight, mode, t, x);
    const Instant now{t, x, mode, at, flight.vehicle.aircraft};
    for (std::size_t c = 0; c < fields().size(); ++c)
      take(table.columns[c], fields()[c].value(now));
  };
  for (std::size_t k = 0; k < flown.t.size(); ++k)
    each(flown.t[k], flown.states[k], flown.modes[k],
         [](FlightColumn& column, double value) { column.values.push_back(value); });
  // The error is proportional to the tolerance: the rough run's error is the difference plus the
  // error sought.
  if (const auto& rough = flown.rough_end)
    each(rough->t, rough->state, rough->mode, [](FlightColumn& column, double value) {
      column.error = std::abs(value - column.values.back()) / (rough_tolerance - 1);
    });
  return table;
}

}  // namespace tiltrim
