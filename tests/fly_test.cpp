// Flights: against an independent implementation (data/reference_flights.json, written by
// bench/flight_scipy.py), against each other in two sets of axes, and against laws.
#include "flight/fly.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "flight/flight.hpp"
#include "study/keys.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using nlohmann::json;

namespace fly_test {

namespace {

json references() {
  std::ifstream in(std::string(TILTRIM_SOURCE_DIR) + "/data/reference_flights.json");
  return json::parse(in);
}

json reference(const std::string& name) {
  const json all = references();
  for (const json& flight : all["flights"])
    if (flight["name"] == name) return flight;
  FAIL("no reference flight of this name");
  return {};
}

Flight flight_of(const json& reference) {
  Flight flight{reference_vehicle()};
  const Signals gains = gain_signals();
  for (std::size_t j = 0; j < gains.size(); ++j)
    gain_value(flight.vehicle.gains, j) =
        reference["gains"][gains[j].name.substr(gains[j].name.find('.') + 1)];
  if (reference["hand_over"] == "bumpless") flight.hand_over = HandOver::bumpless;
  if (!reference["gust"].is_null()) {
    GustTable gust;
    gust.up = true;
    gust.size = 1.5;
    gust.at = 1.0;
    gust.duration = 2.0;
    const Weather air = weather({gust});
    flight.wind = air.wind;
    flight.kink_times = air.kink_times;
  }
  return flight;
}

FlightState state_of(const json& values) {
  FlightState x;
  double* const into[] = {&x.along, &x.across,   &x.theta,  &x.q,           &x.x1,
                          &x.x2,    &x.distance, &x.height, &x.thrust_work, &x.drag_work};
  for (std::size_t k = 0; k < std::size(into); ++k) *into[k] = values[k];
  return x;
}

std::vector<double> values_of(const FlightState& x) {
  return {x.along, x.across,   x.theta,  x.q,           x.x1,
          x.x2,    x.distance, x.height, x.thrust_work, x.drag_work};
}

FlyOptions sharp(double duration) {
  FlyOptions options;
  options.duration = duration;
  options.integrate.tolerance = 1e-12;
  options.integrate.sample = 1.0;
  return options;
}

// ½V² + gh minus all works, per unit mass.
double energy(const FlightResult& flown, std::size_t k, double gravity) {
  const FlightState& x = flown.states[k];
  return (x.along * x.along + x.across * x.across) / 2 + gravity * x.height - x.thrust_work +
         x.drag_work - x.wind_work;
}

}  // namespace

TEST_CASE("flights agree with an independent implementation") {
  const json all = references();
  for (const json& expected : all["flights"]) {
    const std::string name = expected["name"];
    CAPTURE(name);
    const Flight flight = flight_of(expected);
    const FlightState first = state_of(expected["states"][0]);
    const bool rests = first.along == 0 && first.across == 0;
    const std::vector<double> times = expected["times"];
    const FlightResult flown = fly(flight, {first, rests}, sharp(times.back()));
    const bool lost = name == "climb_to_loss";
    std::size_t at = 0;
    double worst = 0.0;
    for (std::size_t k = 0; k < times.size(); ++k) {
      while (at < flown.t.size() && std::abs(flown.t[at] - times[k]) > 1e-9) ++at;
      if (at == flown.t.size()) {
        CHECK(lost);  // only a lost flight ends early
        break;
      }
      const std::vector<double> ours = values_of(flown.states[at]);
      for (std::size_t i = 0; i < ours.size(); ++i) {
        const double theirs = expected["states"][k][i];
        const double scaled = std::abs(ours[i] - theirs) / std::max(1.0, std::abs(theirs));
        worst = std::max(worst, scaled);
      }
    }
    CHECK_NEAR(worst, 0.0, lost ? 1e-6 : 1e-8);
  }
}

TEST_CASE("wind and body axes fly the same flight") {
  const Flight body = flight_of(reference("climb"));
  Flight wind = body;
  wind.axes = Axes::wind;
  const FlightState first = state_of(reference("climb")["states"][0]);
  FlightState turned = first;
  turned.along = std::hypot(first.along, first.across);
  turned.across = first.theta - std::atan2(first.across, first.along);
  const FlightResult a = fly(body, {first, false}, sharp(28.0));  // across the handover
  const FlightResult b = fly(wind, {turned, false}, sharp(28.0));
  REQUIRE(a);
  REQUIRE(b);
  REQUIRE(a.events.size() == b.events.size());
  REQUIRE(a.t.size() == b.t.size());
  for (std::size_t k = 0; k < a.events.size(); ++k) CHECK_NEAR(a.events[k].t, b.events[k].t, 1e-8);
  for (std::size_t k = 0; k < a.t.size(); ++k) {
    const FlightPoint p = flight_point(body, a.modes[k], a.t[k], a.states[k]);
    CHECK_NEAR(p.V, b.states[k].along, 1e-8);
    CHECK_NEAR(p.gamma, b.states[k].across, 1e-8);
    CHECK_NEAR(a.states[k].theta, b.states[k].theta, 1e-8);
    CHECK_NEAR(a.states[k].x2, b.states[k].x2, 1e-7);  // hundreds of seconds
    CHECK_NEAR(a.states[k].height, b.states[k].height, 1e-7);
  }
}

TEST_CASE("energy is neither made nor lost") {
  for (const char* name : {"transition", "gust", "climb_to_loss"}) {
    CAPTURE(name);
    const json expected = reference(name);
    Flight flight = flight_of(expected);
    const FlightState first = state_of(expected["states"][0]);
    const FlightResult flown =
        fly(flight, {first, first.along == 0}, sharp(expected["times"].back()));
    const double g = flight.vehicle.aircraft.gravity;
    double size = 0.0;
    for (const FlightState& x : flown.states) size = std::max(size, std::abs(x.thrust_work));
    for (std::size_t k = 0; k < flown.t.size(); ++k)
      CHECK_NEAR(energy(flown, k, g), energy(flown, 0, g), 1e-8 * size);
  }
}

TEST_CASE("a trim stays where it is for a thousand seconds") {
  Flight flight{reference_vehicle()};
  for (const Command command :
       {Command{2.0, std::numbers::pi / 2, std::numbers::pi / 2},
        Command{6.0, std::numbers::pi / 4, std::numbers::pi / 4}, Command{15.0, 0.0, 0.0}}) {
    CAPTURE(command.V);
    flight.schedule = held(command);
    const TrimmedStart trim = trimmed_start(flight, command, 1e4);
    REQUIRE(trim);
    FlyOptions options = sharp(1000.0);
    options.integrate.sample = 10.0;
    const FlightResult flown = fly(flight, trim.start, options);
    REQUIRE(flown);
    for (const FlightState& x : flown.states) {
      CHECK_NEAR(x.along, trim.start.state.along, 1e-9);
      CHECK_NEAR(x.across, trim.start.state.across, 1e-9);
      CHECK_NEAR(x.theta, trim.start.state.theta, 1e-9);
      CHECK_NEAR(x.q, 0.0, 1e-9);
      CHECK_NEAR(x.x1, trim.start.state.x1, 1e-9);
      CHECK_NEAR(x.x2, trim.start.state.x2, 1e-9);
    }
  }
}

TEST_CASE("the error of a flight's end, for less than the flight once more") {
  for (const char* name : {"transition", "transition_bumpless", "reconversion"}) {
    CAPTURE(name);
    const Study study = load_study(fmt::format("{}/studies/{}.toml", TILTRIM_SOURCE_DIR, name));
    FlightPlan plan = flight_plan(study);
    long calls = 0;
    const auto command = plan.flight.schedule.command;
    plan.flight.schedule.command = [&](double t, double h) {
      ++calls;
      return command(t, h);
    };
    const FlightResult plain = fly(plan.flight, plan.start, plan.options);
    CHECK_FALSE(plain.rough_end);
    CHECK(std::isnan(flight_table(plan.flight, plain).columns[1].error));
    const long once = std::exchange(calls, 0);
    plan.options.global_error = true;
    const FlightResult flown = fly(plan.flight, plan.start, plan.options);
    CHECK(calls < 2 * once);
    REQUIRE(flown.rough_end);
    CHECK(values_of(flown.states.back()) == values_of(plain.states.back()));
    FlyOptions finest = plan.options;
    finest.integrate.tolerance = 1e-13;
    const FlightTable exact = flight_table(plan.flight, fly(plan.flight, plan.start, finest));
    const FlightTable table = flight_table(plan.flight, flown);
    double covered = 0.0;
    for (std::size_t c = 1; c < table.columns.size(); ++c) {
      const FlightColumn& column = table.columns[c];
      if (column.name != "V" && column.name != "theta_deg" && column.name != "distance" &&
          column.name != "height")
        continue;
      const double off = std::abs(column.values.back() - exact.columns[c].values.back());
      const double rounding = 1e-13 * std::max(1.0, std::abs(column.values.back()));
      CHECK(off <= 3 * column.error + rounding);
      CHECK(column.error <= 3 * off + rounding);
      covered = std::max(covered, column.error);
    }
    CHECK(covered > 1e-10);  // the estimate is not trivially zero
  }
}

}  // namespace fly_test
