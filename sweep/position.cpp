// Links between modes by position only.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "sweep/spectrum.hpp"
#include "sweep/track.hpp"

namespace tiltrim {

bool link_by_position(Spectrum predicted, Spectrum next, std::span<int> to,
                      std::span<double> confidence) {
  const std::size_t n = predicted.size();
  if (next.size() != n || to.size() != n || confidence.size() != n)
    throw std::invalid_argument("link_by_position: the spans are not of one size");
  // Each is closer than a third of its distance to the next nearest, and no column occurs twice:
  // then each is also the nearest to its column's mode, by a factor of 1.5.
  for (std::size_t i = 0; i < n; ++i) {
    double least = infinity, other = infinity;
    std::size_t nearest = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const double d2 = distance2(predicted[i], next[j]);
      nearest = d2 < least ? j : nearest;
      other = std::min(other, std::max(d2, least));
      least = std::min(least, d2);
    }
    if (!(square(nearer) * least < other) || side(predicted[i]) != side(next[nearest]))
      return false;
    for (std::size_t k = 0; k < i; ++k)
      if (to[k] == int(nearest)) return false;
    to[i] = int(nearest);
    confidence[i] = 1 - nearer * std::sqrt(least / other);
  }
  return true;
}

bool link_by_position(Spectrum last, Spectrum predicted, Spectrum next, std::span<int> to,
                      std::span<double> confidence) {
  if (last.size() != next.size())
    throw std::invalid_argument("link_by_position: the spans are not of one size");
  if (!link_by_position(predicted, next, to, confidence)) return false;
  for (std::size_t i = 0; i < last.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (turned(last[i] - last[k], next[std::size_t(to[i])] - next[std::size_t(to[k])]))
        return false;
  return true;
}

void IsolatedModes::assign(Spectrum at) {
  modes.assign(at.begin(), at.end());
  gap.assign(at.size(), infinity);
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const double d2 = distance2(at[i], at[k]);
      gap[i] = std::min(gap[i], d2);
      gap[k] = std::min(gap[k], d2);
    }
  for (double& g : gap) g = std::sqrt(g);
}

// With cᵢ the modes here, gᵢ their gaps and |zᵢ - cᵢ| <= gᵢ/8 for all i, before and after a step:
//   |zᵢ - zⱼ| >= |cᵢ - cⱼ| - (gᵢ + gⱼ)/8 >= 3/4 max(gᵢ, gⱼ)
// The change of zᵢ - zⱼ is at most (gᵢ + gⱼ)/4, two thirds of its length: an angle of 42°. From a
// prediction at distance d from zᵢ every other mode is at least 3/4 gᵢ - d away.
std::size_t IsolatedModes::stay(const double* const* re, const double* const* im,
                                std::span<const double> step_ratio) {
  constexpr double radius = 1.0 / 8;
  const std::size_t length = std::min(longest, step_ratio.size());
  std::array<double, longest> left;  // 1: left its disk; also for NaN
  std::fill_n(left.begin(), length, 0.0);
  for (std::size_t i = 0; i < modes.size(); ++i)  // a pair has just split or joined
    if (side({0.0, im[i][-1]}) != side({0.0, im[i][-2]})) return 0;
  off.resize(modes.size() * longest);
  std::fill_n(worst.begin(), length, 0.0);
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const double x0 = modes[i].real(), y0 = modes[i].imag();
    const double within = 1 / square(radius * gap[i]), scale = 1 / square(gap[i]);
    for (std::size_t m = 0; m < length; ++m) {
      const double *const x = re[i] + m, *const y = im[i] + m;
      const double dx = x[0] - x[-1] - step_ratio[m] * (x[-1] - x[-2]);
      const double dy = y[0] - y[-1] - step_ratio[m] * (y[-1] - y[-2]);
      const double d2 = scale * (dx * dx + dy * dy);
      off[i * longest + m] = d2;
      worst[m] = std::max(worst[m], d2);
      const double away = within * (square(x[0] - x0) + square(y[0] - y0));
      left[m] = away <= 1 ? left[m] : 1.0;
    }
  }
  constexpr double too_far = 0.75 / (1 + nearer);
  std::size_t stays = 0;
  while (stays < length && left[stays] == 0 && worst[stays] < square(too_far)) ++stays;
  return stays;
}

double IsolatedModes::confidence(std::size_t i, std::size_t m) const {
  const double d = std::sqrt(off[i * longest + m]);
  return 1 - nearer * d / (0.75 - d);
}

bool IsolatedModes::certain(std::size_t m) const { return worst[m] <= square(4e-4); }

namespace {

// Two eigenvalues that are a pair, or both real: the one that continues as the first of the other
// two, their middle and half their distance.
struct Two {
  std::size_t first = 0, second = 0;
  bool real = false;
  double middle = 0, half = infinity;
};

// The two nearest to a point of the real axis, if they can be a pair or the ends of one.
std::optional<Two> two_at(Spectrum lambda, double middle) {
  std::size_t a = 0, b = 1;
  const auto nearer_than = [&](std::size_t i, std::size_t k) {
    return distance2(lambda[i], middle) < distance2(lambda[k], middle);
  };
  for (std::size_t i = 1; i < lambda.size(); ++i) {
    if (i > 1 && nearer_than(i, b)) b = i;
    if (nearer_than(b, a)) std::swap(a, b);
  }
  const bool real = lambda[a].imag() == 0 && lambda[b].imag() == 0;
  if (!real && lambda[a] != std::conj(lambda[b])) return {};
  if (real ? lambda[b].real() > lambda[a].real() : lambda[b].imag() > 0) std::swap(a, b);
  const Complex sum = lambda[a] + lambda[b];
  return Two{a, b, real, 0.5 * sum.real(), 0.5 * std::sqrt(distance2(lambda[a], lambda[b]))};
}

struct Step {
  Spectrum last, predicted, next;
  std::span<int> to;
  std::span<double> confidence;

  // Links all but the two by position, and the two as one.
  bool meet(const Two& a, const Two& b) const {
    const double foreseen = 0.5 * (predicted[a.first] + predicted[a.second]).real();
    double others = infinity;  // distance from the pair's middle, before, predicted and after
    for (std::size_t i = 0; i < last.size(); ++i) {
      if (i != b.first && i != b.second) others = std::min(others, std::abs(next[i] - b.middle));
      if (i == a.first || i == a.second) continue;
      others = std::min({others, std::abs(last[i] - a.middle), std::abs(predicted[i] - foreseen)});
      const auto [j, ratio] = nearest_to(predicted[i]);
      if (!(nearer * ratio < 1) || j == b.first || j == b.second) return false;
      if (side(last[i]) != side(next[j]) || turned(last[i] - a.middle, next[j] - b.middle))
        return false;
      for (std::size_t k = 0; k < i; ++k)
        if (k != a.first && k != a.second &&
            (to[k] == int(j) || turned(last[i] - last[k], next[j] - next[std::size_t(to[k])])))
          return false;
      to[i] = int(j);
      confidence[i] = 1 - nearer * ratio;
    }
    const double apart = std::abs(b.middle - foreseen) + std::max(a.half, b.half);
    to[a.first] = int(b.first);
    to[a.second] = int(b.second);
    confidence[a.first] = confidence[a.second] = 1 - nearer * apart / others;
    return confidence[a.first] >= 0.5;
  }

  // The nearest eigenvalue, and the ratio of its distance to that of the second nearest.
  std::pair<std::size_t, double> nearest_to(Complex place) const {
    double least = infinity, other = infinity;
    std::size_t nearest = 0;
    for (std::size_t j = 0; j < next.size(); ++j) {
      const double d2 = distance2(place, next[j]);
      if (d2 < least) nearest = j;
      other = std::min(other, std::max(d2, least));
      least = std::min(least, d2);
    }
    return {nearest, std::sqrt(least / other)};
  }
};

}  // namespace

bool link_meeting(Spectrum last, Spectrum predicted, Spectrum next, std::span<int> to,
                  std::span<double> confidence) {
  const std::size_t n = last.size();
  if (predicted.size() != n || next.size() != n || to.size() != n || confidence.size() != n)
    throw std::invalid_argument("link_meeting: the spans are not of one size");
  if (n < 2) return false;
  const auto upper = [](Complex z) { return z.imag() > 0; };
  const bool from_pair = std::ranges::count_if(last, upper) >= std::ranges::count_if(next, upper);
  for (const Complex& z : from_pair ? last : next) {
    if (!upper(z)) continue;
    const auto a = two_at(last, z.real()), b = two_at(next, z.real());
    if (a && b && !(a->real && b->real) && Step{last, predicted, next, to, confidence}.meet(*a, *b))
      return true;
  }
  return false;
}

}  // namespace tiltrim
