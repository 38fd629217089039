// Newton's method on several systems of equations, one per lane. No product is fused with a sum:
// every instruction set gives the same bits.
#include "sweep/lanes_step.hpp"

#include "runtime/lanes.hpp"

namespace tiltrim::TILTRIM_LANES {

namespace {

using Real = Pack<1>;
using Mask = PackMask<1>;

constexpr std::size_t L = StepTask::lanes;
constexpr double fast = 1e-2;       // ratio of two steps with one Jacobian
constexpr double far = 1.0;         // nominal sizes: a step that only the scalar path takes
constexpr double foreseen = 1e-14;  // nominal sizes: a next step that need not be taken

[[gnu::always_inline]] inline Real at(const double* numbers) {
  Real r;
  r.load(numbers);
  return r;
}
[[gnu::always_inline]] inline Mask marked(const double* marks) { return Real(0.0) < at(marks); }
[[gnu::always_inline]] inline void mark(const Mask& where, double* marks) {
  choose(where, Real(1.0), Real(0.0)).store(marks);
}

[[gnu::always_inline]] inline Real larger_of(const Real& largest, const Real& value) {
  return choose(abs(value) <= largest, largest, abs(value));  // NaN stays
}

// [J | -r], N equations; N = 0: as many as the task has. Then the step in the last column.
template <std::size_t N>
struct Equations {
  static constexpr std::size_t most = N > 0 ? N : StepTask::largest;
  std::size_t n;
  Real a[most][most + 1];
  Real residual = 0.0, size = 0.0;
  Mask regular;

  [[gnu::always_inline]] Equations(const StepTask& t, std::size_t first) : n(N > 0 ? N : t.n) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < n; ++k) a[i][k].load(t.J + (i * n + k) * L + first);
      const std::ptrdiff_t row = t.equations[i];
      const Real value = at(t.values + std::size_t(row) * L + first);
      a[i][n] = (Real(t.held[i]) - value) / Real(t.row_nominal[row]);
      residual = larger_of(residual, a[i][n]);
    }
  }

  // Gaussian elimination with partial pivoting                                [11, alg. 3.4.1]
  [[gnu::always_inline]] void solve() {
    constexpr double singular = 1e-11;
    Real least = 1.0, most_pivot = 1.0, inverse[most];
    for (std::size_t c = 0; c < n; ++c) {
      for (std::size_t i = c + 1; i < n; ++i) {
        const Mask larger = abs(a[c][c]) < abs(a[i][c]);
        for (std::size_t k = c; k <= n; ++k) {
          const Real upper = choose(larger, a[i][k], a[c][k]);
          a[i][k] = choose(larger, a[c][k], a[i][k]);
          a[c][k] = upper;
        }
      }
      const Real pivot = abs(a[c][c]);
      least = c == 0 ? pivot : choose(pivot < least, pivot, least);
      most_pivot = choose(most_pivot < pivot, pivot, most_pivot);
      inverse[c] = 1.0 / a[c][c];
      for (std::size_t i = c + 1; i < n; ++i) {
        const Real factor = a[i][c] * inverse[c];
        for (std::size_t k = c + 1; k <= n; ++k) a[i][k] = a[i][k] - factor * a[c][k];
      }
    }
    for (std::size_t c = n; c-- > 0;) {
      Real sum = a[c][n];
      for (std::size_t k = c + 1; k < n; ++k) sum = sum - a[c][k] * a[k][n];
      a[c][n] = sum * inverse[c];
      size = larger_of(size, a[c][n]);
    }
    regular = Real(singular) * most_pivot < least;
  }

  [[gnu::always_inline]] void step(const StepTask& t, std::size_t first, const Mask& which) const {
    for (std::size_t i = 0; i < n; ++i) {
      double* const to = t.z + std::size_t(t.unknowns[i]) * L + first;
      const Real z = at(to);
      choose(which, z + a[i][n] * Real(t.nominal[i]), z).store(to);
    }
  }
};

void predict_part(const StepTask& t, std::size_t first) {
  const Mask walks = marked(t.walks + first);
  const Real share = at(t.share + first);
  for (std::size_t i = 0; i < t.n; ++i) {
    Real value = 0.0;
    for (std::size_t a = 0; a < StepTask::known; ++a)
      value = value + at(t.weights[a] + first) * at(t.history[a] + i * L + first);
    double* const to = t.z + std::size_t(t.unknowns[i]) * L + first;
    choose(walks, value, at(to)).store(to);
  }
  for (std::size_t e = 0; e < t.n * t.n; ++e) {
    const Real last = at(t.last + e * L + first);
    (last + share * (last - at(t.before_last + e * L + first))).store(t.J + e * L + first);
  }
  mark(walks, t.moving + first);
  Real(__builtin_inf()).store(t.before + first);
}

template <std::size_t N>
bool approach_part(const StepTask& t, std::size_t first, bool first_step) {
  Equations<N> e(t, first);
  e.solve();
  const Real before = at(t.before + first);
  Mask moving = marked(t.moving + first) && e.size < Real(far);
  if (!first_step) moving = moving && e.size <= fast * before;
  e.step(t, first, moving);
  const Real ratio = first_step ? Real(fast * fast) : e.size / before;
  choose(moving, e.size, before).store(t.before + first);
  moving = moving && Real(foreseen) < e.size * ratio;
  mark(moving, t.moving + first);
  return any_of(moving);
}

// Zero where all numbers are finite, otherwise NaN. Four sums, so that none waits for another.
[[gnu::always_inline]] inline Real not_finite(const double* numbers, std::size_t count) {
  constexpr std::size_t sums = 4;
  Real sum[sums] = {0.0, 0.0, 0.0, 0.0};
  std::size_t i = 0;
  for (; i + sums <= count; i += sums)
    for (std::size_t s = 0; s < sums; ++s) sum[s] = sum[s] + Real(0.0) * at(numbers + (i + s) * L);
  for (; i < count; ++i) sum[0] = sum[0] + Real(0.0) * at(numbers + i * L);
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// Every number finite and every range kept.
[[gnu::always_inline]] inline Mask good(const StepTask& t, std::size_t first) {
  Mask within = not_finite(t.values + first, t.n_values) == Real(0.0) &&
                not_finite(t.slopes + first, t.n_slopes) == Real(0.0);
  for (std::size_t i = 0; i < t.n_ranges; ++i) {
    const Real value = at(t.ranges[i].of + first);
    within = within && Real(t.ranges[i].lower) <= value && value <= Real(t.ranges[i].upper);
  }
  return within;
}

template <std::size_t N>
bool verify_part(const StepTask& t, std::size_t first, bool last) {
  const std::size_t n = N > 0 ? N : t.n;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      (at(t.slopes + std::size_t(t.entries[i * n + k]) * L + first) * Real(t.scales[i * n + k]))
          .store(t.J + (i * n + k) * L + first);
  Equations<N> e(t, first);
  e.solve();
  e.residual.store(t.residual + first);
  const Real before = at(t.before + first);
  const Mask moved = marked(t.moving + first);
  const Mask at_rest = e.size <= Real(t.at_rest) || 0.5 * before <= e.size;
  const Mask small = e.residual <= Real(t.tolerance) && e.size <= Real(t.step_tolerance);
  const Mask rests = moved && small && e.regular && at_rest;
  mark((rests && good(t, first)) || (!moved && marked(t.found + first)), t.found + first);
  const Mask moving = moved && !rests && e.size < Real(far);
  choose(moved, e.size, before).store(t.before + first);
  mark(moving, t.moving + first);
  if (!last) e.step(t, first, moving);
  return any_of(moving);
}

void predict(const StepTask& task) {
  for (std::size_t first = 0; first < L; first += lane_count) predict_part(task, first);
}

bool approach(const StepTask& task, bool first_step) {
  bool moving = false;
  for (std::size_t first = 0; first < L; first += lane_count)
    moving |= task.n == 3 ? approach_part<3>(task, first, first_step)
                          : approach_part<0>(task, first, first_step);
  return moving;
}

bool verify(const StepTask& task, bool last) {
  bool moving = false;
  for (std::size_t first = 0; first < L; first += lane_count)
    moving |= task.n == 3 ? verify_part<3>(task, first, last) : verify_part<0>(task, first, last);
  return moving;
}

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES

namespace tiltrim {

using namespace TILTRIM_LANES;

template <>
LaneSteps lane_steps<InstructionSet::TILTRIM_SET>() {
  return {&predict, &approach, &verify};
}

}  // namespace tiltrim
