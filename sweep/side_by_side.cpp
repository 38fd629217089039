#include "sweep/side_by_side.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "dense/dense.hpp"
#include "runtime/instruction_set.hpp"
#include "sweep/lanes_step.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr std::size_t L = Model::model_lanes;
static_assert(L == StepTask::lanes && dense::small_size == StepTask::largest);

constexpr std::size_t most_known = StepTask::known;  // points that the extrapolation uses

// A number of each point, in one cache line.
struct alignas(64) Lane {
  double of[L];
  double& operator[](std::size_t l) { return of[l]; }
  const double& operator[](std::size_t l) const { return of[l]; }
};
static_assert(sizeof(Lane) == L * sizeof(double));
using Numbers = std::vector<Lane>;

double* first_of(Numbers& numbers) { return numbers.empty() ? nullptr : numbers.front().of; }

// The lines, and the numbers of their current points.
struct Group {
  const std::vector<LineTracker*>& lines;
  const Prepared& s;
  const Problem& p;
  std::size_t nx, rows, n;                  // states, rows of [f; h], unknowns
  Numbers z;                                // all variables
  Numbers y, slopes;                        // [f; h], and its derivatives
  Numbers J, last, before_last;             // scaled: in use, at the last two points
  std::array<Numbers, most_known> history;  // unknowns at the last points
  std::array<Lane, most_known> weights{};
  Lane share{}, walks{}, moving{}, found{}, residual{}, size{}, before{};
  std::array<std::size_t, L> known{}, primed{};  // points before with trims, with Jacobians
  std::array<char, L> trusted{};
  std::vector<StepTask::Range> ranges;
  std::vector<Index> entries;
  std::vector<double> scales;
  MatrixBatch block;  // of the last points: number k of those of lane l is k * L + l
  LaneSteps step;

  explicit Group(const std::vector<LineTracker*>& all)
      : lines(all),
        s(all.front()->sweep),
        p(s.problem),
        nx(std::size_t(s.states())),
        rows(nx + s.model().outputs.size()),
        n(s.unknowns.size()),
        z(nx + s.model().inputs.size() + s.model().parameters.size()),
        y(rows),
        slopes(s.along.size() * rows),
        J(n * n),
        last(J),
        before_last(J),
        block(Index(nx), Index(block_points * L)),
        step(chosen([]<InstructionSet set>() { return lane_steps<set>(); })) {
    for (std::size_t l = 0; l < L; ++l) put(l, lines[std::min(l, lines.size() - 1)]->base);
    for (Numbers& numbers : history) numbers.resize(n);
    for (Index i = 0; i < block.n; ++i)  // stable until there is a matrix
      std::fill_n(&block(i, i, 0), block.count, -1.0);
    for (const Index row : p.equations)
      for (std::size_t k = 0; k < n; ++k) {
        entries.push_back(s.unknowns[k] * Index(rows) + row);
        scales.push_back(p.nominal[Index(k)] / p.row_nominal[row]);
      }
    set_ranges();
  }

  // With 16 all entries would share a few sets of a cache.
  static constexpr std::size_t block_points = 15;

  void put(std::size_t l, const OperatingPoint& at) {
    std::size_t j = 0;
    for (const auto* part : {&at.x, &at.u, &at.p})
      for (const double value : *part) z[j++][l] = value;
  }
  Lane& unknown(std::size_t i) { return z[std::size_t(p.unknowns[i])]; }

  // Limits, and implied rates that are zero.
  void set_ranges() {
    const auto keep = [&](const Lane& of, double nominal, double lower, double upper) {
      ranges.push_back({of.of, lower * nominal, upper * nominal});
    };
    for (std::size_t i = 0; i < n; ++i)
      keep(unknown(i), p.nominal[Index(i)], p.lower[Index(i)] - bound_slack,
           p.upper[Index(i)] + bound_slack);
    for (std::size_t i = 0; i < p.limited.size(); ++i)
      keep(y[std::size_t(p.limited[i])], p.row_nominal[p.limited[i]],
           p.limited_lower[Index(i)] - bound_slack, p.limited_upper[Index(i)] + bound_slack);
    for (const Index row : p.implied)
      keep(y[std::size_t(row)], p.row_nominal[row], -s.trimming.tolerance, s.trimming.tolerance);
  }

  StepTask task() {
    StepTask t{.n = n,
               .z = first_of(z),
               .values = first_of(y),
               .slopes = first_of(slopes),
               .n_values = y.size(),
               .n_slopes = slopes.size(),
               .unknowns = p.unknowns.data(),
               .nominal = p.nominal.data(),
               .equations = p.equations.data(),
               .held = p.held.data(),
               .row_nominal = p.row_nominal.data(),
               .entries = entries.data(),
               .scales = scales.data(),
               .ranges = ranges.data(),
               .n_ranges = ranges.size(),
               .tolerance = s.trimming.tolerance,
               .step_tolerance = s.trimming.step_tolerance,
               .at_rest = step_at_rest,
               .history = {},
               .weights = {},
               .last = first_of(last),
               .before_last = first_of(before_last),
               .share = share.of,
               .J = first_of(J),
               .residual = residual.of,
               .size = size.of,
               .before = before.of,
               .walks = walks.of,
               .moving = moving.of,
               .found = found.of};
    for (std::size_t a = 0; a < most_known; ++a) {
      t.history[a] = first_of(history[a]);
      t.weights[a] = weights[a].of;
    }
    return t;
  }
};

// Moves all lanes to point k. The unknowns are foreseen by a polynomial through up to four adjacent
// points, as for a line alone, the Jacobian by the last two points: what it misses is of second
// order.
void go_to(Group& g, std::size_t k) {
  const LineTracker& first = *g.lines.front();
  const SweepAxis& axis = g.s.axes[first.axis];
  for (std::size_t c = 0; c < axis.columns.size(); ++c)
    if (const Index j = g.s.moved[first.axis][c]; j >= 0)
      std::fill_n(g.z[std::size_t(j)].of, L, axis.columns[c].si[k]);
  const std::vector<double>& v = first.coordinates();
  std::array<std::array<double, most_known>, most_known + 1> weight{};
  for (std::size_t count = 1; count <= std::min(most_known, k); ++count) {
    if (std::ranges::find(g.known, count) == g.known.end()) continue;
    for (std::size_t a = 0; a < count; ++a) {
      weight[count][a] = 1.0;
      for (std::size_t b = 0; b < count; ++b)
        if (b != a) weight[count][a] *= (v[k] - v[k - 1 - b]) / (v[k - 1 - a] - v[k - 1 - b]);
    }
  }
  const double ratio = k >= 2 ? (v[k] - v[k - 1]) / (v[k - 1] - v[k - 2]) : 0.0;
  for (std::size_t l = 0; l < L; ++l) {
    for (std::size_t a = 0; a < most_known; ++a) g.weights[a][l] = weight[g.known[l]][a];
    g.share[l] = g.primed[l] >= 2 ? ratio : 0.0;
    g.walks[l] = g.known[l] > 0 ? 1.0 : 0.0;
  }
}

// Newton with the extrapolated Jacobian, then with that of each point itself.
void solve(Group& g) {
  constexpr int most_approaching = 6, most_verifying = 4;
  static const std::vector<Index> no_variables;
  const StepTask task = g.task();
  const auto& lanes = g.s.model().lanes;
  g.step.predict(task);
  for (int i = 0; i < most_approaching; ++i) {
    lanes(task.z, no_variables, task.values, nullptr);
    if (!g.step.approach(task, i == 0)) break;
  }
  g.moving = g.walks;
  g.found = {};
  for (int i = 0; i < most_verifying; ++i) {
    lanes(task.z, g.s.along, task.values, task.slopes);
    if (!g.step.verify(task, i + 1 == most_verifying)) break;
  }
}

// What a point found in a lane has; the scalar path overwrites it.
void expect(LineTracker& w) {
  std::ranges::fill(w.valid, char(1));
  std::ranges::fill(w.exact, char(1));
  std::ranges::fill(w.points.status, std::int8_t(TrimStatus::converged));
  std::ranges::fill(w.points.reason, std::int16_t(0));
}

// Stores the point of lane l; expect() has stored what all of them share.
void keep(const Group& g, std::size_t l, std::size_t k) {
  LineTracker& w = *g.lines[l];
  for (std::size_t i = 0; i < g.n; ++i)
    w.unknowns[k * g.n + i] = g.z[std::size_t(g.p.unknowns[i])][l];
  if (w.judged) return;
  LinePoints& points = w.points;
  points.residual[k] = g.residual[l];
  for (std::size_t i = 0; i < g.nx; ++i) points.state[k * g.nx + i] = g.z[i][l];
  const std::size_t m = g.s.inputs.size(), nu = g.s.model().inputs.size();
  for (std::size_t i = 0; i < m; ++i) {
    const std::size_t at = std::size_t(g.s.inputs[i]);
    points.input[k * m + i] = at < nu ? g.z[g.nx + at][l] : g.y[g.nx + at - nu][l];
  }
}

void keep_matrices(Group& g, std::size_t k) {
  constexpr std::size_t count = Group::block_points * L;
  const std::size_t nx = g.nx, rows = g.rows;
  const Lane* const from = g.slopes.data();
  double* to = &g.block(0, 0, Index(k % Group::block_points * L));
  for (std::size_t i = 0; i < nx; ++i)
    for (std::size_t j = 0; j < nx; ++j, to += count)
      std::memcpy(to, from[j * rows + i].of, sizeof(Lane));
}

// The matrices of points first .. last - 1 are judged, or go to their lines.
void deliver(Group& g, std::size_t first, std::size_t last) {
  static thread_local std::vector<Verdict> answers;
  const bool judged = std::ranges::any_of(g.lines, &LineTracker::judged);
  const bool all_judged = std::ranges::all_of(g.lines, &LineTracker::judged);
  if (judged) verdicts(g.block, answers);
  for (std::size_t l = 0; l < g.lines.size(); ++l) {
    LineTracker& w = *g.lines[l];
    for (std::size_t k = first; k < last && w.judged; ++k)
      w.points.verdict[k] =
          w.valid[k] ? std::int8_t(answers[(k - first) * L + l]) : std::int8_t(-1);
  }
  for (Index e = 0; e < Index(g.nx * g.nx) && !all_judged; ++e)
    for (std::size_t l = 0; l < g.lines.size(); ++l) {
      LineTracker& w = *g.lines[l];
      if (w.judged) continue;
      const double* const from = &g.block(0, e, Index(l));
      double* const to = &w.A(0, e, Index(first));
      for (std::size_t k = 0; k < last - first; ++k) to[k] = from[k * L];
    }
}

// True if the lanes give what f, h and the derivatives give at the equilibrium, to rounding.
bool agrees(Group& g, std::size_t l, const GridTrim& e) {
  constexpr double same = 1e-9;
  g.s.model().lanes(first_of(g.z), g.s.along, first_of(g.y), first_of(g.slopes));
  const Eigen::VectorXd rates = g.s.model().f(e.at.x, e.at.u, e.at.p);
  for (std::size_t i = 0; i < g.rows; ++i) {
    const double expected = i < g.nx ? rates[Index(i)] : e.outputs[Index(i - g.nx)];
    const double size = g.p.row_nominal[Index(i)] + std::abs(expected);
    if (!(std::abs(g.y[i][l] - expected) <= same * size)) return false;
    const double steepest = e.slopes.row(Index(i)).lpNorm<Eigen::Infinity>();
    for (std::size_t c = 0; c < g.s.along.size(); ++c) {
      const double miss = g.slopes[c * g.rows + i][l] - e.slopes(Index(i), Index(c));
      if (!(std::abs(miss) <= same * steepest)) return false;
    }
  }
  return true;
}

// After point k of lane l by the scalar path: its numbers, for the points that follow.
void resume(Group& g, std::size_t l, std::size_t k, const GridTrim& e) {
  g.known[l] = g.primed[l] = 0;
  g.put(l, e.valid() ? e.at : g.lines[l]->base);
  for (Index i = 0; i < Index(g.nx); ++i)
    for (Index j = 0; j < Index(g.nx); ++j)
      g.block(i, j, Index(k % Group::block_points * L + l)) =
          e.valid() ? e.slopes(i, j) : not_a_number;
  if (!e.valid() || !e.exact) return;
  if (!g.trusted[l] && !agrees(g, l, e)) return;
  g.trusted[l] = 1;
  for (std::size_t i = 0; i < g.n; ++i)
    for (std::size_t c = 0; c < g.n; ++c) {
      const Index row = g.p.equations[i];
      g.last[i * g.n + c][l] = e.slopes(row, g.s.unknowns[c]) * g.scales[i * g.n + c];
    }
  g.primed[l] = 1;
  while (g.known[l] < std::min(most_known, k + 1) && g.lines[l]->valid[k - g.known[l]])
    ++g.known[l];
}

}  // namespace

bool has_lanes(const Prepared& s) {
  const auto moving = Index(s.model().states.size() + s.model().inputs.size());
  return s.model().lanes && s.problem.square() && s.problem.n() > 0 &&
         s.problem.n() <= dense::small_size &&
         std::ranges::all_of(s.along, [&](Index j) { return j < moving; });
}

void walk_side_by_side(const std::vector<LineTracker*>& lines,
                       const std::function<GridTrim(std::size_t l, std::size_t k)>& alone) {
  Group g(lines);
  for (LineTracker* w : lines) expect(*w);
  const std::size_t count = lines.front()->count;
  for (std::size_t k = 0; k < count; ++k) {
    go_to(g, k);
    if (std::ranges::find(g.walks.of, 1.0) != std::end(g.walks.of)) {
      solve(g);
      keep_matrices(g, k);
      std::swap(g.last, g.before_last);
      std::swap(g.last, g.J);
    }
    for (std::size_t l = 0; l < lines.size(); ++l) {
      if (g.walks[l] != 0 && g.found[l] != 0) {
        keep(g, l, k);
        g.known[l] = std::min(g.known[l] + 1, most_known);
        g.primed[l] = std::min<std::size_t>(g.primed[l] + 1, 2);
      } else {
        resume(g, l, k, alone(l, k));
      }
    }
    std::rotate(g.history.begin(), g.history.end() - 1, g.history.end());
    for (std::size_t i = 0; i < g.n; ++i) g.history.front()[i] = g.unknown(i);
    const std::size_t in_block = k % Group::block_points + 1;
    if (in_block == Group::block_points || k + 1 == count) deliver(g, k + 1 - in_block, k + 1);
  }
}

}  // namespace tiltrim
