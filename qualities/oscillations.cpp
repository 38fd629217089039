#include "qualities/oscillations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tiltrim {

Bounded frequency_of(const Mode& mode) { return {mode.frequency(), mode.error}; }

Bounded damping_of(const Mode& mode) {
  const double size = mode.frequency(), ratio = mode.damping();
  if (!(size > mode.error)) return {0.0, 1.0};
  // The disk is seen from the origin within ± asin(error/|λ|).
  const double turn = std::asin(mode.error / size), at = std::acos(std::clamp(ratio, -1.0, 1.0));
  const double above = std::cos(std::max(at - turn, 0.0)) - ratio;
  const double below = ratio - std::cos(std::min(at + turn, std::numbers::pi));
  return {ratio, std::max(above, below) + 4 * std::numeric_limits<double>::epsilon()};
}

double beyond_damping(std::complex<double> root, double ratio) {
  return -root.real() * std::sqrt(1 - ratio * ratio) - std::abs(root.imag()) * ratio;
}

double slower_than(std::complex<double> root, double time) {
  return std::numbers::ln2 / time - root.real();
}

double below_frequency(std::complex<double> root, double frequency) {
  return frequency - std::abs(root);
}

namespace {

std::string roots_in_words(const Modes& modes, const std::vector<std::size_t>& real) {
  std::string words;
  for (const std::size_t k : real)
    words += fmt::format("{}{:.5g}", words.empty() ? "" : ", ", modes.modes[k].eigenvalue.real());
  return words;
}

// ω² = λ₁ λ₂, 2 ζ ω = -(λ₁ + λ₂):  ζ = (r + 1/r)/2 with r² = λ₁/λ₂
void as_one(const Mode& a, const Mode& b, Oscillation& found) {
  const double fast = std::max(a.frequency(), b.frequency());
  const double slow = std::min(a.frequency(), b.frequency());
  const double error = std::max(a.error, b.error);
  const auto frequency = [](double p, double q) { return std::sqrt(p * q); };
  const auto damping = [](double p, double q) {
    const double r = std::sqrt(std::max(p / q, 1.0));
    return 0.5 * (r + 1 / r);
  };
  const double w = frequency(fast, slow), z = damping(fast, slow);
  found.frequency = {w, std::max(frequency(fast + error, slow + error) - w,
                                 w - frequency(fast - error, slow - error))};
  found.damping = {z, std::max(damping(fast + error, slow - error) - z,
                               z - damping(fast - error, slow + error))};
}

}  // namespace

Oscillation oscillation_with(const Modes& modes, const std::vector<Qualities::ModeShares>& shares,
                             double Qualities::ModeShares::*share, const char* name,
                             const std::vector<std::size_t>& taken) {
  constexpr double most = 0.5;
  Oscillation found;
  std::vector<std::size_t> real;
  double largest = most;
  for (std::size_t k = 0; k < modes.modes.size(); ++k) {
    const Mode& mode = modes.modes[k];
    const double own = shares[k].*share;
    if (!(own > most) || std::ranges::find(taken, k) != taken.end()) continue;
    if (mode.eigenvalue.imag() == 0) real.push_back(k);
    if (mode.eigenvalue.imag() <= 0 || own <= largest) continue;
    largest = own;
    found.kind = OscillationKind::pair;
    const auto conjugate =
        std::ranges::find(modes.modes, std::conj(mode.eigenvalue), &Mode::eigenvalue);
    found.modes = {std::size_t(conjugate - modes.modes.begin()), k};
    found.frequency = frequency_of(mode);
    found.damping = damping_of(mode);
  }
  if (found.kind == OscillationKind::pair) return found;
  const bool stable = std::ranges::all_of(real, [&](std::size_t k) {
    return modes.modes[k].eigenvalue.real() < -modes.modes[k].error;
  });
  if (real.empty())
    found.message = fmt::format("no {}: no mode has most of its participation there", name);
  else
    found.message = fmt::format("no {}: {} real root{}, {} 1/s", name, real.size(),
                                real.size() == 1 ? "" : "s", roots_in_words(modes, real));
  if (real.size() != 2 || !stable) return found;
  found.kind = OscillationKind::two_real;
  found.modes = real;
  as_one(modes.modes[real[0]], modes.modes[real[1]], found);
  return found;
}

}  // namespace tiltrim
