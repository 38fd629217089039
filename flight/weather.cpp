#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "flight/flight.hpp"
#include "runtime/random.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

namespace {

using std::numbers::pi;

struct Gust {
  double speed = 0.0, rate = 0.0;
};
using GustAt = std::function<Gust(double t)>;

GustAt one_minus_cosine(const GustTable& table) {
  return [table](double t) -> Gust {
    const double turn = 2 * pi / table.duration, phase = turn * (t - table.at);
    if (phase <= 0 || phase >= 2 * pi) return {};
    return {table.size / 2 * (1 - std::cos(phase)), table.size / 2 * turn * std::sin(phase)};
  };
}

// Waves a cos(ω t + φ) with a²/2 the integral of the spectrum over each band, bands of equal ratio.
GustAt dryden(const GustTable& table) {
  constexpr int waves = 60;
  constexpr double slowest = 0.01, fastest = 30.0;  // wave numbers times length
  struct Wave {
    double amplitude, frequency, phase;
  };
  std::vector<Wave> all;
  std::mt19937_64 random(table.seed);
  double power = 0.0;
  const double ratio = std::pow(fastest / slowest, 1.0 / waves);
  for (int k = 0; k < waves; ++k) {
    const double from = slowest / table.length * std::pow(ratio, k), to = from * ratio;
    const double within = from * std::pow(ratio, uniform(random));
    const double share = dryden_spectrum(within, table.size, table.length, table.up) * (to - from);
    all.push_back({std::sqrt(2 * share), within * table.speed, 2 * pi * uniform(random)});
    power += share;
  }
  for (Wave& wave : all) wave.amplitude *= table.size / std::sqrt(power);  // exactly sigma
  return [all](double t) {
    Gust gust;
    for (const auto& [amplitude, frequency, phase] : all) {
      gust.speed += amplitude * std::cos(frequency * t + phase);
      gust.rate -= amplitude * frequency * std::sin(frequency * t + phase);
    }
    return gust;
  };
}

GustAt gust_at(const GustTable& table) {
  switch (table.kind) {
    case GustTable::Kind::steady:
      return [size = table.size](double) { return Gust{size, 0.0}; };
    case GustTable::Kind::one_minus_cosine:
      return one_minus_cosine(table);
    case GustTable::Kind::dryden:
      break;
  }
  if (table.size == 0) return [](double) { return Gust{}; };
  return dryden(table);
}

void check(const GustTable& table) {
  const auto require = [](bool holds, const char* why) {
    if (!holds) throw std::invalid_argument(std::string("gust: ") + why);
  };
  require(std::isfinite(table.size) && std::isfinite(table.at), "its size or time is not finite");
  const auto above_zero = [](double value) { return value > 0 && std::isfinite(value); };
  require(above_zero(table.duration), "its duration must be finite and greater than zero");
  require(above_zero(table.length) && above_zero(table.speed),
          "length and speed must be finite and greater than zero");
}

void check(const DisturbanceTable& table) {
  const auto require = [](bool holds, const char* why) {
    if (!holds) throw std::invalid_argument(std::string("disturbance: ") + why);
  };
  require(std::isfinite(table.size) && std::isfinite(table.at), "its size or time is not finite");
  require(table.duration >= 0 && std::isfinite(table.duration),
          "its duration must be finite and not negative");
  require(table.duration > 0 || table.kind == DisturbanceTable::Kind::step,
          "the duration of a doublet must be greater than zero");
}

double Disturbance::*member(const std::string& name) {
  constexpr std::array<std::pair<const char*, double Disturbance::*>, 5> members{
      {{"V", &Disturbance::V},
       {"gamma", &Disturbance::gamma},
       {"theta0", &Disturbance::theta0},
       {"a1s", &Disturbance::a1s},
       {"delta_e", &Disturbance::delta_e}}};
  for (const auto& [known, at] : members)
    if (name == known) return at;
  throw std::invalid_argument("disturbance: no '" + name +
                              "'; there are: V, gamma, theta0, a1s, delta_e");
}

void sort(std::vector<double>& times) {
  std::ranges::sort(times);
  times.erase(std::unique(times.begin(), times.end()), times.end());
}

}  // namespace

// Longitudinal σ² 2L/π 1/(1 + (LΩ)²), lateral σ² L/π (1 + 3 (LΩ)²)/(1 + (LΩ)²)².
double dryden_spectrum(double wave_number, double sigma, double length, bool across) {
  const double x = length * wave_number, below = 1 + x * x;
  return sigma * sigma * length / pi * (across ? (1 + 3 * x * x) / (below * below) : 2 / below);
}

Weather weather(const std::vector<GustTable>& gusts) {
  const RoundToNearest environment;
  if (gusts.empty()) return {};
  Weather all;
  std::vector<std::pair<bool, GustAt>> each;
  for (const GustTable& table : gusts) {
    check(table);
    each.emplace_back(table.up, gust_at(table));
    if (table.kind == GustTable::Kind::one_minus_cosine)
      all.kink_times.insert(all.kink_times.end(), {table.at, table.at + table.duration});
  }
  sort(all.kink_times);
  all.wind = [each](double t) {
    Wind wind;
    for (const auto& [up, at] : each) {
      const Gust gust = at(t);
      (up ? wind.up : wind.forward) += gust.speed;
      (up ? wind.up_rate : wind.forward_rate) += gust.rate;
    }
    return wind;
  };
  return all;
}

Disturbances disturbances(const std::vector<DisturbanceTable>& tables) {
  if (tables.empty()) return {};
  Disturbances all;
  struct Piece {
    double from, to, size;
    double Disturbance::*on;
  };
  std::vector<Piece> pieces;
  for (const DisturbanceTable& table : tables) {
    check(table);
    const auto on = member(table.on);
    const double ends =
        table.duration > 0 ? table.at + table.duration : std::numeric_limits<double>::infinity();
    pieces.push_back({table.at, ends, table.size, on});
    if (table.kind == DisturbanceTable::Kind::doublet)
      pieces.push_back({ends, ends + table.duration, -table.size, on});
  }
  for (const Piece& piece : pieces)
    for (const double t : {piece.from, piece.to})
      if (std::isfinite(t)) all.kink_times.push_back(t);
  sort(all.kink_times);
  all.at = [pieces](double t) {
    Disturbance sum;
    for (const auto& [from, to, size, on] : pieces)
      if (t >= from && t < to) sum.*on += size;
    return sum;
  };
  return all;
}

}  // namespace tiltrim
