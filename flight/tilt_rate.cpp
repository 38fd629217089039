#include "flight/tilt_rate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "flight/flight.hpp"
#include "flight/fly.hpp"
#include "flight/frozen_loops.hpp"
#include "flight/hand_over.hpp"
#include "model/degrees.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"

namespace tiltrim {

namespace {

using std::numbers::pi;

SteadyTilt tilting_at(const TiltRateOptions& options, double rate) {
  constexpr double begins = 1.0;  // s
  return {begins, rate, options.from, options.to};
}

struct Offset {
  std::string words;
  double V = 0.0, gamma = 0.0, theta = 0.0, q = 0.0;
};

std::vector<Offset> offsets(const TiltRateOptions& o, double scale) {
  std::vector<Offset> all{{"no disturbance"}};
  for (const double sign : {scale, -scale}) {
    all.push_back({fmt::format("V {:+g} m/s", sign * o.V), sign * o.V});
    all.push_back({fmt::format("γ {:+g} rad", sign * o.gamma), 0, sign * o.gamma});
    all.push_back({fmt::format("θ {:+g} rad", sign * o.theta), 0, 0, sign * o.theta});
    all.push_back({fmt::format("q {:+g} rad/s", sign * o.q), 0, 0, 0, sign * o.q});
  }
  return all;
}

bool at_trim(const FlightPoint& at, const FlightState& x, const FrozenLoop& trim) {
  constexpr double speed = 0.2, angle = 0.05;  // m/s, rad
  return std::abs(at.V - trim.command.V) < speed &&
         std::abs(at.gamma - trim.command.gamma) < angle &&
         std::abs(x.theta - trim.trim.theta) < angle;
}

// The trim's attitude at a tilt, interpolated between frozen loops.
double trim_theta(const std::vector<FrozenLoop>& loops, double eta) {
  const auto after = std::ranges::lower_bound(loops, eta, std::greater<>(), &FrozenLoop::eta);
  if (after == loops.begin()) return loops.front().trim.theta;
  if (after == loops.end()) return loops.back().trim.theta;
  const FrozenLoop &a = *std::prev(after), &b = *after;
  return std::lerp(a.trim.theta, b.trim.theta, (eta - a.eta) / (b.eta - a.eta));
}

// The first sample too far from the moving trims; the number of samples if there is none.
std::size_t strays(const Flight& flight, const FlightResult& flown,
                   const std::vector<FrozenLoop>& loops, const TiltRateOptions& options) {
  for (std::size_t k = 0; k < flown.t.size(); ++k) {
    const FlightPoint at = flight_point(flight, flown.modes[k], flown.t[k], flown.states[k]);
    const double theta = flown.states[k].theta - trim_theta(loops, at.eta);
    const double gamma = std::remainder(at.gamma - at.command.gamma, 2 * pi);
    const double most = std::max(std::abs(gamma), std::abs(theta));
    if (!(std::abs(at.V - at.command.V) <= options.speed && most <= options.angle)) return k;
  }
  return flown.t.size();
}

class Flights {
 public:
  Flights(const Flight& flight, const TiltRateOptions& options, TiltRateLimit& result)
      : flight_(flight), options_(options), result_(result), offsets_(offsets(options, 1.0)) {}

  // Offsets from which the loop frozen at the first tilt does not recover are no test of the tilt
  // rate: they are halved until it does. False if it never does.
  bool shrink_to_frozen() {
    constexpr int most = 10;
    for (int k = 0; k < most; ++k, result_.disturbance /= 2) {
      offsets_ = offsets(options_, result_.disturbance);
      std::vector<char> back(offsets_.size());
      in_parallel(back.size(), [&](std::size_t i) { back[i] = fly_with(0.0, offsets_[i]).holds; });
      if (std::ranges::all_of(back, [](char b) { return b != 0; })) return true;
      if (options_.stop.stop_requested()) return false;
    }
    return false;
  }

  // Flies all disturbances at a rate; true if every flight settles at the final trim.
  bool hold(double rate) {
    std::vector<TiltFlight> flown(offsets_.size());
    in_parallel(flown.size(), [&](std::size_t k) { flown[k] = fly_with(rate, offsets_[k]); });
    if (options_.stop.stop_requested()) return false;  // some flights were cut short
    bool all = true;
    for (const TiltFlight& f : flown) {
      result_.flights.push_back(f);
      if (options_.observe) options_.observe(f);
      if (f.holds) continue;
      if (all) result_.worst = f;
      all = false;
    }
    return all;
  }

 private:
  const Flight& flight_;
  const TiltRateOptions& options_;
  TiltRateLimit& result_;
  std::vector<Offset> offsets_;

  TiltFlight fly_with(double rate, const Offset& offset) const {
    const bool fixed_tilt = rate == 0;
    const FrozenLoop& first = result_.loops.front();
    const FrozenLoop& last = fixed_tilt ? first : result_.loops.back();
    Flight tilting = flight_;
    tilting.schedule =
        fixed_tilt ? held(first.command) : corridor_at_tilt_rate(tilting_at(options_, rate));
    tilting.wind = {};
    tilting.disturbance = {};
    tilting.kink_times.clear();
    tilting.axes = Axes::body;
    constexpr double high = 1e6;  // m: no ground
    FlightStart start{first.trim, false};
    FlightState& x = start.state;
    const double V = first.command.V + offset.V, gamma = first.command.gamma + offset.gamma;
    x.theta += offset.theta;
    x.q += offset.q;
    x.along = V * std::cos(x.theta - gamma);
    x.across = V * std::sin(x.theta - gamma);
    x.height = high;
    x.eta = first.eta;
    FlyOptions flying;
    flying.duration = options_.settles + (fixed_tilt ? 0.0 : tilting_at(options_, rate).ends());
    flying.integrate.tolerance = 1e-7;
    flying.integrate.sample = 0.1;
    flying.integrate.stop = options_.stop;
    const FlightResult flown = fly(tilting, start, flying);
    TiltFlight answer{rate, offset.words, false, flown.status, flown.message, 0.0};
    const std::size_t strayed = strays(tilting, flown, result_.loops, options_);
    const FlightPoint end =
        flight_point(tilting, flown.modes.back(), flown.t.back(), flown.states.back());
    const bool near = strayed == flown.t.size();
    answer.holds = flown && near && at_trim(end, flown.states.back(), last);
    const std::size_t left = near ? flown.t.size() - 1 : strayed;
    answer.left = tilting.schedule.command(flown.t[left], 0.0).eta;
    if (flown && !answer.holds)
      answer.message = near ? fmt::format("ends at V = {:.3g} m/s, γ = {:.3g}°, θ = {:.3g}°", end.V,
                                          end.gamma * degrees, flown.states.back().theta * degrees)
                            : "strays too far from the trim";
    return answer;
  }
};

std::string cause(const Flight& flight, const TiltRateOptions& options,
                  const TiltRateLimit& limit) {
  const TiltFlight& w = limit.worst;
  const bool whole = w.status == FlightStatus::flown && !w.message.empty();
  std::string words = fmt::format(
      "at {:.4g}°/s the flight with {} departs from the moving trim at a tilt of {:.4g}° ({}{}{})",
      w.rate * degrees, w.disturbed, w.left * degrees, whole ? "" : to_string(w.status),
      whole || w.message.empty() ? "" : ": ", w.message);
  Flight at_rate = flight;
  at_rate.schedule = corridor_at_tilt_rate(tilting_at(options, w.rate));
  HandOverOptions checking;
  checking.duration = tilting_at(options, w.rate).ends();
  constexpr double near = 0.01;  // rad
  if (w.left > flight.vehicle.aircraft.cyclic_off + near) return words;
  for (const HandOverCheck& check : check_hand_over(at_rate, checking))
    if (check.verdict == HandOverVerdict::lost || check.verdict == HandOverVerdict::not_reached)
      words += fmt::format("; at the handover ({:.4g}°, h = {:.4g} m of (16)) {}",
                           check.command.eta * degrees, corridor_height(check.command.eta),
                           check.message);
  return words;
}

void bisect(const Flight& flight, const TiltRateOptions& options, TiltRateLimit& limit) {
  Flights flights(flight, options, limit);
  const auto ends = [&](TiltRateStatus status) {
    limit.status = status;
    if (status != TiltRateStatus::always) limit.message = cause(flight, options, limit);
  };
  const auto stopped = [&] {
    if (options.stop.stop_requested()) limit.status = TiltRateStatus::interrupted;
    return options.stop.stop_requested();
  };
  const bool brought_back = flights.shrink_to_frozen();
  if (stopped()) return;
  if (!brought_back) {
    limit.status = TiltRateStatus::never;
    limit.message = "the loop frozen at the initial tilt recovers from none of the disturbances";
    return;
  }
  const auto fly_at = [&](double rate) {
    const bool holds = flights.hold(rate);
    if (!options.stop.stop_requested()) (holds ? limit.holds : limit.fails) = rate;
  };
  fly_at(options.slowest);
  while (limit.fails == 0) {
    if (stopped()) return;
    if (limit.holds >= options.fastest) return ends(TiltRateStatus::always);
    fly_at(std::min(2 * limit.holds, options.fastest));
  }
  if (limit.holds == 0) return ends(TiltRateStatus::never);
  while (limit.fails > limit.holds * (1 + options.relative)) {
    if (stopped()) return;
    fly_at(std::sqrt(limit.holds * limit.fails));
  }
  ends(TiltRateStatus::found);
}

TiltRateLimit limit_of(const Flight& flight, const TiltRateOptions& options) {
  TiltRateLimit limit;
  limit.frozen_stable = true;
  for (const std::vector<double>& tilts : stretches_of(flight, options)) {
    const std::vector<FrozenLoop> loops = frozen_loops(flight, tilts, options, limit.message);
    if (loops.empty()) {
      const bool stopped = limit.message.empty();
      limit.status = stopped ? TiltRateStatus::interrupted : TiltRateStatus::no_trim;
      return limit;
    }
    limit.stretches.push_back(slow_tilt(flight, tilts, options));
    limit.frozen_stable = limit.frozen_stable && limit.stretches.back().stable;
    limit.loops.insert(limit.loops.end(), loops.begin(), loops.end());
  }
  bisect(flight, options, limit);
  for (const double rate : {limit.holds, limit.fails})
    if (rate > 0) limit.growth.push_back(growth(limit.loops, rate));
  return limit;
}

}  // namespace

std::string to_string(TiltRateStatus status) {
  constexpr std::array names{"found", "always", "never", "no_trim", "interrupted"};
  return names[std::size_t(status)];
}

TiltRateLimit tilt_rate_limit(const Flight& flight, const TiltRateOptions& options) {
  const RoundToNearest environment;
  if (!(options.from > options.to && options.to >= 0 && options.from <= pi / 2))
    throw std::invalid_argument("tilts must decrease, between 90 and 0 degrees");
  TiltRateOptions asked = options;
  const Aircraft& aircraft = flight.vehicle.aircraft;
  if (!(aircraft.cyclic_blend > 0) && options.from == aircraft.cyclic_off)
    asked.from -= hair;  // on the elevator's side of the handover
  TiltRateLimit limit;
  with_threads(options.threads, [&] { limit = limit_of(flight, asked); });
  return limit;
}

}  // namespace tiltrim
