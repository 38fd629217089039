// The closed loop (14) in wind axes on SIMD lanes.
#include "model/lane_scalars.hpp"
#include "model/scalar.hpp"
#include "vehicles/tiltrotor/closed_loop.hpp"
#include "vehicles/tiltrotor/closed_loop_kernel.hpp"

namespace tiltrim::TILTRIM_LANES {

using physics::CoefficientsOf;
using physics::PolarTable;

// Cyclic's share of pitch control (12), as for double.
[[gnu::always_inline]] inline Number authority_at(const Number& eta, const AircraftOf<Number>& a) {
  const Number switched = choose(a.cyclic_off <= eta, Number(1.0), Number(0.0));
  const Number t = (eta - a.cyclic_off) / a.cyclic_blend + 0.5;
  const Number blended = choose(t <= Number(0.0), Number(0.0),
                                choose(Number(1.0) <= t, Number(1.0), t * t * (3.0 - 2.0 * t)));
  return choose(Number(0.0) < a.cyclic_blend, blended, switched);
}

// The pieces of the polar at each lane's angle, most often one for all, and the place on it, as
// Polar::place() finds them.
struct Pieces {
  Number c[12], t;
};

inline std::size_t piece_at(const PolarTable& polar, double turned) {
  if (polar.per_radian > 0) {
    if (!(turned > 0)) return 0;
    const std::size_t i = std::size_t(std::ptrdiff_t(turned * polar.per_radian));
    return i < polar.count ? i : polar.count - 1;
  }
  const double alpha = turned + polar.first;
  std::size_t low = 0, high = polar.count;  // the last piece that begins at alpha or before
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (alpha < polar.rows[middle * PolarTable::width + PolarTable::start] ? high : low) = middle;
  }
  return low;
}

inline Pieces pieces_at(const PolarTable& polar, const Number& alpha) {
  constexpr double turn = 2 * 3.14159265358979323846;
  double turned[lane_count];
  const double* row[lane_count];
  (alpha - polar.first).store(turned);
  bool same = true;
  for (std::size_t l = 0; l < lane_count; ++l) {
    double& at = turned[l];
    if (!(at >= 0 && at < turn)) {
      at = at - turn * __builtin_floor(at / turn);
      at = at < 0 ? 0.0 : turn < at ? turn : at;
    }
    row[l] = polar.rows + piece_at(polar, at) * PolarTable::width;
    same = same && row[l] == row[0];
  }
  Pieces p;
  p.t.load(turned);
  if (same) {
    for (std::size_t i = 0; i < 12; ++i) p.c[i] = row[0][i];
    p.t = p.t - Number(row[0][PolarTable::offset]);
    return p;
  }
  double c[lane_count];
  for (std::size_t i = 0; i < 12; ++i) {
    for (std::size_t l = 0; l < lane_count; ++l) c[l] = row[l][i];
    p.c[i].load(c);
  }
  for (std::size_t l = 0; l < lane_count; ++l) c[l] = row[l][PolarTable::offset];
  Number offset;
  offset.load(c);
  p.t = p.t - offset;
  return p;
}

[[gnu::always_inline]] inline Number cubic(const Number* c, const Number& t) {
  return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}
[[gnu::always_inline]] inline Number cubic_slope(const Number* c, const Number& t) {
  return c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
}

inline CoefficientsOf<Number> coefficients(const PolarTable& polar, const Number& alpha) {
  const Pieces p = pieces_at(polar, alpha);
  return {cubic(p.c, p.t), cubic(p.c + 4, p.t), cubic(p.c + 8, p.t)};
}

inline CoefficientsOf<LaneDual> coefficients(const PolarTable& polar, const LaneDual& alpha) {
  const Pieces p = pieces_at(polar, alpha.value);
  const auto of = [&](const Number* c) {
    const Number slope = cubic_slope(c, p.t);
    return LaneDual(cubic(c, p.t), alpha.along, [&](int k) { return slope * alpha.slopes[k]; });
  };
  return {of(p.c), of(p.c + 4), of(p.c + 8)};
}

namespace {

using Loop = physics::WindLoop<physics::LoopInputs::nothing, const PolarTable*>;

constexpr std::size_t states = Loop::sizes.states, parameters = Loop::sizes.parameters,
                      rows = states + Loop::sizes.outputs;

// Lanes first .. first + lane_count - 1 of the points.
struct Part {
  const WindLoopTask& task;
  std::size_t first;
  Number x[states], p[parameters];

  Part(const WindLoopTask& t, std::size_t at) : task(t), first(at) {
    for (std::size_t j = 0; j < states; ++j) x[j].load(t.z + j * Model::model_lanes + at);
#pragma GCC unroll 64
    for (std::size_t j = 0; j < parameters; ++j)
      p[j].load(t.z + (states + j) * Model::model_lanes + at);
  }

  [[gnu::noinline]] TILTRIM_FLATTEN void values(const Loop& loop) const {
    Number results[rows];
    loop(x, static_cast<const Number*>(nullptr), p, results, results + states);
    for (std::size_t i = 0; i < rows; ++i)
      results[i].store(task.values + i * Model::model_lanes + first);
  }

  // With the derivatives with respect to the states, each along a direction of its own.
  [[gnu::noinline]] TILTRIM_FLATTEN void slopes_of_states(const Loop& loop) const {
    LaneDual moving[states];
#pragma GCC unroll 8
    for (std::size_t j = 0; j < states; ++j)
      moving[j] = LaneDual(x[j], 1U << j, [](int) { return Number(1.0); });
    slopes_from(loop, moving, 0, states);
  }

  // With the derivatives with respect to variables from .. from + dual_width - 1.
  [[gnu::noinline]] TILTRIM_FLATTEN void slopes(const Loop& loop, std::size_t from) const {
    const std::size_t left = task.count - from, count = left < dual_width ? left : dual_width;
    LaneDual moving[states];
    for (std::size_t j = 0; j < states; ++j)
      moving[j] = LaneDual(x[j], LaneDual::all, [](int) { return Number(0.0); });
    for (std::size_t k = 0; k < count; ++k) moving[task.variables[from + k]].slopes[k] = 1.0;
    slopes_from(loop, moving, from, count);
  }

  [[gnu::always_inline]] void slopes_from(const Loop& loop, const LaneDual* moving,
                                          std::size_t from, std::size_t count) const {
    LaneDual results[rows];
    loop(moving, static_cast<const LaneDual*>(nullptr), p, results, results + states);
#pragma GCC unroll 16
    for (std::size_t i = 0; i < rows; ++i)
      results[i].value.store(task.values + i * Model::model_lanes + first);
#pragma GCC unroll 8
    for (std::size_t k = 0; k < count; ++k) {
      double* const column = task.slopes + (from + k) * rows * Model::model_lanes + first;
#pragma GCC unroll 16
      for (std::size_t i = 0; i < rows; ++i)
        results[i].slopes[k].store(column + i * Model::model_lanes);
    }
  }
};

static_assert(states == dual_width);

bool along_states(const WindLoopTask& task) {
  bool same = task.count == states;
  for (std::size_t j = 0; j < task.count; ++j) same = same && task.variables[j] == Eigen::Index(j);
  return same;
}

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES

namespace tiltrim {

using namespace TILTRIM_LANES;

template <>
void wind_loop<InstructionSet::TILTRIM_SET>(const WindLoopTask& task) {
  const Loop loop{task.polar, task.printed ? Equations::printed : Equations::consistent};
  for (std::size_t first = 0; first < Model::model_lanes; first += lane_count) {
    const Part part(task, first);
    if (!task.slopes)
      part.values(loop);
    else if (along_states(task))
      part.slopes_of_states(loop);
    else
      for (std::size_t from = 0; from < task.count; from += dual_width) part.slopes(loop, from);
  }
}

}  // namespace tiltrim
