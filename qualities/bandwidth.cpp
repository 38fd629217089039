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

// rad/s, our choice: pilots control attitude faster, and slower zeros do not delay them.
constexpr double slowest_control = 0.1;

// By more than its error: an undamped root must not depend on rounding.
bool right_of_axis(const EnclosedRoot& r) { return r.value.real() > r.error; }

// arg(iω - r), continuous in ω, 90 degrees at infinity.
double angle(const EnclosedRoot& r, double w) {
  const double turned = std::atan2(w - r.value.imag(), std::abs(r.value.real()));
  return right_of_axis(r) ? pi - turned : turned;
}

// For a zero. A fast one right of the axis acts as a delay: from 0 at rest (a pair together) to -90
// degrees at infinity, that of z - iω if it is real.
double zero_angle(const EnclosedRoot& z, double w) {
  const bool delays = right_of_axis(z) && std::abs(z.value) >= slowest_control;
  return delays ? angle(z, w) - pi : angle(z, w);
}

// Phase and ln|G| of ±gain Π(iω - zero)/Π(iω - pole), and bounds of their errors.
struct Response {
  const ZerosAndPoles& g;

  double phase(double w) const {
    double total = 0.0;
    for (const EnclosedRoot& r : g.zeros) total += zero_angle(r, w);
    for (const EnclosedRoot& r : g.poles) total -= angle(r, w);
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

// Where the curve falls through zero between two frequencies, given its values there.
std::optional<double> fall(const Curve& f, double from, double to, double at_from, double at_to) {
  if (!(at_from > 0 && at_to <= 0)) return {};
  boost::uintmax_t steps = 200;
  const auto [left, right] = boost::math::tools::toms748_solve(
      f, from, to, at_from, at_to, boost::math::tools::eps_tolerance<double>(52), steps);
  return left + 0.5 * (right - left);
}

// All falls between grid points, by ascending frequency.
std::vector<double> falls(const Curve& f, const std::vector<double>& grid) {
  std::vector<double> found;
  double at_from = f(grid.front());
  for (std::size_t k = 0; k + 1 < grid.size(); ++k) {
    const double at_to = f(grid[k + 1]);
    if (const auto w = fall(f, grid[k], grid[k + 1], at_from, at_to)) found.push_back(*w);
    at_from = at_to;
  }
  return found;
}

// The last one below a frequency.
std::optional<double> last_fall(const Curve& f, const std::vector<double>& grid, double below) {
  auto k = std::size_t(std::ranges::lower_bound(grid, below) - grid.begin());
  double to = std::min(below, grid.back()), at_to = f(to);
  while (k-- > 0) {
    const double at_from = f(grid[k]);
    if (const auto w = fall(f, grid[k], to, at_from, at_to)) return w;
    to = grid[k];
    at_to = at_from;
  }
  return {};
}

// The distance from `at` to the nearest one, by the steps on both sides, nearest first.
double to_nearest_fall(const Curve& f, const std::vector<double>& grid, double at) {
  const std::ptrdiff_t steps = std::ssize(grid) - 1;
  std::ptrdiff_t up = std::min(std::ranges::upper_bound(grid, at) - grid.begin(), steps);
  std::ptrdiff_t down = up - 1;
  double distance = never;
  for (;;) {
    const double below = down >= 0 ? std::max(0.0, at - grid[std::size_t(down) + 1]) : never;
    const double above = up < steps ? grid[std::size_t(up)] - at : never;
    if (std::min(below, above) >= distance) return distance;
    const auto k = std::size_t(below <= above ? down-- : up++);
    if (const auto w = fall(f, grid[k], grid[k + 1], f(grid[k]), f(grid[k + 1])))
      distance = std::min(distance, std::abs(*w - at));
  }
}

// The fall at `at`, with the distance to those of the curve raised and lowered by its error.
Bounded bracketed(const Curve& f, const Curve& error, const std::vector<double>& grid, double at) {
  const auto nearest = [&](double sign) {
    return to_nearest_fall([&](double w) { return f(w) + sign * error(w); }, grid, at);
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
  if (const auto last = last_fall(above, grid, w))
    b.gain_bandwidth = bracketed(above, error, grid, *last);
  else
    b.gain_bandwidth.value = 0.0;  // the gain margin is below 6 dB at every frequency
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
  const std::vector<double> crossovers = falls(at_180, grid);
  if (!crossovers.empty()) b.crossover = bracketed(at_180, error, grid, crossovers.front());
  if (crossovers.size() > 1)
    b.message = "the phase falls through -180 degrees more than once: the first is taken";
  if (const auto last = last_fall(at_135, grid, b.crossover.value))
    b.phase_bandwidth = bracketed(at_135, error, grid, *last);
  else if (std::isfinite(b.crossover.value))
    b.phase_bandwidth.value = 0.0;
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
