#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "qualities/qualities.hpp"

namespace tiltrim {

std::string to_string(ResponseType type) {
  return type == ResponseType::rate ? "rate" : "attitude";
}

namespace {

using std::numbers::pi;
constexpr double never = std::numeric_limits<double>::infinity();
constexpr double half_gain = 0.3;  // 6 dB = 20 log10(10^0.3)

// arg(iω - r), continuous in ω, 90 degrees at infinity.
double angle(std::complex<double> r, double w) {
  const double up = w - r.imag();
  return r.real() > 0 ? pi - std::atan2(up, r.real()) : std::atan2(up, -r.real());
}

// Phase and ln|G| of gain Π(iω - zero)/Π(iω - pole), gain > 0, and bounds of their errors.
struct Response {
  const ZerosAndPoles& g;

  double phase(double w) const {
    double total = 0.0;
    for (const EnclosedRoot& r : g.zeros) total += angle(r.value, w);
    for (const EnclosedRoot& r : g.poles) total -= angle(r.value, w);
    return total;
  }
  double log_gain(double w) const {
    double total = 0.0;
    for (const EnclosedRoot& r : g.zeros) total += std::log(std::abs(r.value - w * unit()));
    for (const EnclosedRoot& r : g.poles) total -= std::log(std::abs(r.value - w * unit()));
    return total;
  }
  static std::complex<double> unit() { return {0.0, 1.0}; }
  // Moving a root by its error turns its factor by at most asin(error/distance).
  double phase_error(double w) const {
    double total = rounding();
    each([&](const EnclosedRoot& r) { total += std::asin(std::min(1.0, share(r, w))); });
    return total;
  }
  double log_gain_error(double w) const {
    double total = rounding();
    each([&](const EnclosedRoot& r) {
      total += share(r, w) < 1 ? -std::log1p(-share(r, w)) : never;
    });
    return total;
  }
  static double share(const EnclosedRoot& r, double w) {
    return r.error == 0 ? 0.0 : r.error / std::abs(r.value - w * unit());
  }
  double rounding() const {
    return 8 * double(g.zeros.size() + g.poles.size() + 1) * std::numeric_limits<double>::epsilon();
  }
  template <class Visit>
  void each(const Visit& visit) const {
    for (const EnclosedRoot& r : g.zeros) visit(r);
    for (const EnclosedRoot& r : g.poles) visit(r);
  }
};

// Frequencies that separate all features of the response: a logarithmic grid, and every root.
std::vector<double> grid_of(const Response& response) {
  std::vector<double> grid;
  response.each([&](const EnclosedRoot& r) {
    const double size = std::abs(r.value);
    if (size > 0) grid.push_back(size);
    if (r.value.imag() > 0) grid.push_back(r.value.imag());
  });
  const double least = grid.empty() ? 1.0 : *std::ranges::min_element(grid);
  const double most = grid.empty() ? 1.0 : *std::ranges::max_element(grid);
  constexpr double beyond = 1e4;  // where the phase is its limit to 1e-4 of a root's share
  constexpr int steps = 2000;
  const double from = std::log(least / beyond), to = std::log(most * beyond);
  for (int k = 0; k <= steps; ++k) grid.push_back(std::exp(from + (to - from) * k / steps));
  std::ranges::sort(grid);
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  return grid;
}

using Curve = std::function<double(double)>;

// Where the curve falls through zero between grid points, by ascending frequency.
std::vector<double> falls(const Curve& f, const std::vector<double>& grid, double below) {
  std::vector<double> found;
  for (std::size_t k = 0; k + 1 < grid.size() && grid[k] < below; ++k) {
    const double a = grid[k], b = std::min(grid[k + 1], below);
    if (!(f(a) > 0 && f(b) <= 0)) continue;
    boost::uintmax_t steps = 200;
    const auto [left, right] = boost::math::tools::toms748_solve(
        f, a, b, boost::math::tools::eps_tolerance<double>(52), steps);
    found.push_back(left + 0.5 * (right - left));
  }
  return found;
}

// The fall at `at`, with the distance to those of the curve raised and lowered by its error.
Bounded bracketed(const Curve& f, const Curve& error, const std::vector<double>& grid, double at) {
  const auto nearest = [&](double sign) {
    const Curve moved = [&](double w) { return f(w) + sign * error(w); };
    double distance = never;
    for (const double w : falls(moved, grid, never))
      distance = std::min(distance, std::abs(w - at));
    return distance;
  };
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  return {at, std::max(nearest(1.0), nearest(-1.0)) + rounding * at};
}

void add_phase_delay(const Response& response, Bandwidth& b) {
  const double w = b.crossover.value, twice = 2 * w;
  b.phase_delay.value = -(response.phase(twice) + pi) / twice;
  const double slope = std::abs(response.phase(twice * (1 + 1e-6)) - response.phase(twice)) / 1e-6;
  b.phase_delay.error = response.phase_error(twice) / twice +
                        b.crossover.error / w * (2 * slope / twice + std::abs(b.phase_delay.value));
}

void add_gain_bandwidth(const Response& response, const std::vector<double>& grid, Bandwidth& b) {
  const double w = b.crossover.value;
  const double level = response.log_gain(w) + half_gain * std::numbers::ln10;
  const double moved = std::abs(response.log_gain(w * (1 + 1e-6)) - response.log_gain(w)) / 1e-6;
  const double level_error = response.log_gain_error(w) + 2 * moved * b.crossover.error / w;
  const Curve above = [&](double at) { return response.log_gain(at) - level; };
  const Curve error = [&](double at) { return response.log_gain_error(at) + level_error; };
  const std::vector<double> all = falls(above, grid, w);
  if (all.empty())
    b.gain_bandwidth.value = 0.0;  // the gain margin is below 6 dB at every frequency
  else
    b.gain_bandwidth = bracketed(above, error, grid, all.back());
}

}  // namespace

Bandwidth bandwidth(const ZerosAndPoles& transfer, ResponseType type) {
  Bandwidth b;
  if (transfer.status != ZerosStatus::found) {
    b.message = "the zeros are not known: " + to_string(transfer.status);
    return b;
  }
  const Response response{transfer};
  const std::vector<double> grid = grid_of(response);
  const Curve error = [&](double w) { return response.phase_error(w); };
  const auto through = [&](double degrees) {
    return Curve(
        [&response, degrees](double w) { return response.phase(w) + degrees * (pi / 180); });
  };
  b.known = true;
  const Curve at_180 = through(180), at_135 = through(135);
  const std::vector<double> crossovers = falls(at_180, grid, never);
  if (!crossovers.empty()) b.crossover = bracketed(at_180, error, grid, crossovers.front());
  if (crossovers.size() > 1)
    b.message = "the phase falls through -180 degrees more than once: the first is taken";
  const std::vector<double> margins = falls(at_135, grid, b.crossover.value);
  if (!margins.empty()) b.phase_bandwidth = bracketed(at_135, error, grid, margins.back());
  if (margins.empty() && std::isfinite(b.crossover.value)) b.phase_bandwidth.value = 0.0;
  if (std::isfinite(b.crossover.value)) {
    add_phase_delay(response, b);
    add_gain_bandwidth(response, grid, b);
  }
  const bool lesser =
      type == ResponseType::rate && b.gain_bandwidth.value < b.phase_bandwidth.value;
  b.bandwidth = lesser ? b.gain_bandwidth : b.phase_bandwidth;
  return b;
}

}  // namespace tiltrim
