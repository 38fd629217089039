// Gaussian elimination with partial pivoting [11, alg. 3.4.1], one system of equations per lane. No
// product is fused with a sum: every instruction set gives the same bits.
#include "sweep/lanes_step.hpp"

#include "runtime/lanes.hpp"

namespace tiltrim::TILTRIM_LANES {

namespace {

using Real = Pack<1>;
using Mask = PackMask<1>;

// [J | -r], N equations; N = 0: as many as the task has.
template <std::size_t N>
struct Equations {
  static constexpr std::size_t most = N > 0 ? N : StepTask::largest;
  Real a[most][most + 1];
};

[[gnu::always_inline]] inline Real larger_of(const Real& largest, const Real& value) {
  return choose(abs(value) <= largest, largest, abs(value));  // NaN stays
}

template <std::size_t N>
[[gnu::always_inline]] inline void solve(const StepTask& task, std::size_t first) {
  constexpr double singular = 1e-11;
  const std::size_t n = N > 0 ? N : task.n;
  Equations<N> e;
  Real residual = 0.0, size = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k)
      e.a[i][k].load(task.J + (i * n + k) * StepTask::lanes + first);
    Real value;
    value.load(task.values + std::size_t(task.rows[i]) * StepTask::lanes + first);
    e.a[i][n] = (Real(task.held[i]) - value) / Real(task.nominal[task.rows[i]]);
    residual = larger_of(residual, e.a[i][n]);
  }
  Real least = 1.0, most = 1.0;
  for (std::size_t c = 0; c < n; ++c) {
    for (std::size_t i = c + 1; i < n; ++i) {
      const Mask larger = abs(e.a[c][c]) < abs(e.a[i][c]);
      for (std::size_t k = c; k <= n; ++k) {
        const Real upper = choose(larger, e.a[i][k], e.a[c][k]);
        e.a[i][k] = choose(larger, e.a[c][k], e.a[i][k]);
        e.a[c][k] = upper;
      }
    }
    const Real pivot = abs(e.a[c][c]);
    least = c == 0 ? pivot : choose(pivot < least, pivot, least);
    most = choose(most < pivot, pivot, most);
    const Real inverse = 1.0 / e.a[c][c];
    for (std::size_t i = c + 1; i < n; ++i) {
      const Real factor = e.a[i][c] * inverse;
      for (std::size_t k = c + 1; k <= n; ++k) e.a[i][k] = e.a[i][k] - factor * e.a[c][k];
    }
  }
  for (std::size_t c = n; c-- > 0;) {
    Real sum = e.a[c][n];
    for (std::size_t k = c + 1; k < n; ++k) sum = sum - e.a[c][k] * e.a[k][n];
    e.a[c][n] = sum / e.a[c][c];
    e.a[c][n].store(task.dz + c * StepTask::lanes + first);
    size = larger_of(size, e.a[c][n]);
  }
  residual.store(task.residual + first);
  size.store(task.size + first);
  choose(Real(singular) * most < least, Real(1.0), Real(0.0)).store(task.regular + first);
}

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES

namespace tiltrim {

using namespace TILTRIM_LANES;

template <>
void newton_step<InstructionSet::TILTRIM_SET>(const StepTask& task) {
  for (std::size_t first = 0; first < StepTask::lanes; first += lane_count)
    task.n == 3 ? solve<3>(task, first) : solve<0>(task, first);
}

}  // namespace tiltrim
