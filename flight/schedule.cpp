#include <math.h>  // pchip.hpp of Boost 1.74 calls isnan without std::

#include <algorithm>
#include <boost/math/interpolators/pchip.hpp>
#include <boost/math/special_functions/fpclassify.hpp>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "flight/flight.hpp"
#include "runtime/rounding.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim {

namespace {

using std::numbers::pi;

double smoothstep(double t) {
  const double s = std::clamp(t, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

// A monotone cubic, constant beyond its ends; with two points a line.
class Curve {
 public:
  Curve(std::vector<double> at, std::vector<double> values)
      : at_(at), first_(values.front()), last_(values.back()) {
    constexpr std::size_t least = 4;  // points needed for a cubic
    if (at.size() >= least)
      cubic_ = std::make_shared<const Cubic>(std::move(at), std::move(values));
    else
      values_ = std::move(values);
  }

  double operator()(double x) const {
    if (x <= at_.front()) return first_;
    if (x >= at_.back()) return last_;
    if (cubic_) return (*cubic_)(x);
    const std::size_t k = std::size_t(std::ranges::upper_bound(at_, x) - at_.begin());
    return std::lerp(values_[k - 1], values_[k], (x - at_[k - 1]) / (at_[k] - at_[k - 1]));
  }

 private:
  using Cubic = boost::math::interpolators::pchip<std::vector<double>>;
  std::vector<double> at_, values_;
  double first_, last_;
  std::shared_ptr<const Cubic> cubic_;
};

struct Curves {
  Curve V, gamma, eta;
  Command operator()(double x) const { return {V(x), gamma(x), eta(x)}; }
};

Curves curves(const Commands& commands) {
  if (commands.at.size() < 2 || commands.at.size() != commands.values.size())
    throw std::invalid_argument("a schedule needs at least two points, and a command at each");
  const auto not_rising = [](double a, double b) { return !(a < b); };
  if (std::ranges::adjacent_find(commands.at, not_rising) != commands.at.end())
    throw std::invalid_argument("the points of a schedule must be in ascending order");
  const auto curve = [&](double Command::*of) {
    std::vector<double> values;
    for (const Command& c : commands.values) values.push_back(c.*of);
    return Curve(commands.at, std::move(values));
  };
  return {curve(&Command::V), curve(&Command::gamma), curve(&Command::eta)};
}

}  // namespace

Schedule held(const Command& command) {
  return {[command](double, double) { return command; }, {}, {}};
}

Schedule over_height(const Commands& commands) {
  const RoundToNearest environment;
  return {[all = curves(commands)](double, double h) { return all(h); }, commands.at, {}};
}

Schedule over_time(const Commands& commands) {
  const RoundToNearest environment;
  return {[all = curves(commands)](double t, double) { return all(t); }, {}, commands.at};
}

// (16) is π/2 (1 - y) with the smoothstep y = 3u² - 2u³ of u = h/120 m, and its inverse is
// u = 1/2 - sin(asin(1 - 2y)/3).
double corridor_height(double eta) {
  const double y = std::clamp(1 - eta / (pi / 2), 0.0, 1.0);
  return corridor_top * (0.5 - std::sin(std::asin(1 - 2 * y) / 3));
}

Schedule corridor_at_tilt_rate(const SteadyTilt& tilt) {
  if (!(tilt.rate > 0)) throw std::invalid_argument("the tilt rate must be greater than zero");
  if (!(tilt.from > tilt.to)) throw std::invalid_argument("the tilt must decrease");
  const auto at = [tilt](double t, double) {
    const double eta = std::clamp(tilt.from - tilt.rate * (t - tilt.begins), tilt.to, tilt.from);
    Command command = corridor(corridor_height(eta));
    command.eta = eta;  // exactly
    return command;
  };
  Schedule schedule{at, {}, {tilt.begins, tilt.ends()}};
  // When the speed of (16) begins to rise.
  const double rises = tilt.begins + (tilt.from - corridor(corridor_rises).eta) / tilt.rate;
  if (rises > tilt.begins && rises < tilt.ends())
    schedule.kink_times.insert(schedule.kink_times.begin() + 1, rises);
  return schedule;
}

Schedule reconversion(const Reconversion& times) {
  const double ends = times.begins + times.lasts;
  const double turns = ends + times.hovers;
  const auto at = [times, turns](double t, double) {
    const double done = std::clamp((t - times.begins) / times.lasts, 0.0, 1.0);
    Command command = corridor(corridor_top * (1 - done));
    command.gamma = times.descent * smoothstep((t - turns) / times.turns);
    return command;
  };
  // There the slope of the speed has a kink.
  const double slowed = times.begins + (1 - corridor_rises / corridor_top) * times.lasts;
  return {at, {}, {times.begins, slowed, ends, turns, turns + times.turns}};
}

}  // namespace tiltrim
