#include "sweep/side_by_side.hpp"

#include <algorithm>
#include <array>
#include <cmath>

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
using Lane = std::array<double, L>;

constexpr std::size_t most_known = 4;  // points that the extrapolation uses
constexpr double fast = 1e-2;          // ratio of two steps with one Jacobian
constexpr double far = 1.0;            // nominal sizes: a step that only the scalar path takes
constexpr double foreseen = 1e-14;     // nominal sizes: a next step that need not be taken

// The lines, and the numbers of their current points: of lane l at [... * L + l].
struct Group {
  const std::vector<LineTracker*>& lines;
  const Prepared& s;
  const Problem& p;
  std::size_t nx, rows, n;                   // states, rows of [f; h], unknowns
  std::vector<double> z;                     // all variables
  std::vector<double> y, slopes;             // [f; h], and its derivatives along `along`
  std::vector<double> J, last, before_last;  // scaled: in use, and at the last two points
  std::vector<double> dz;
  std::vector<double> elsewhere;                 // matrices of lanes without a line
  std::array<std::size_t, L> known{}, primed{};  // points before with trims, with Jacobians
  Lane regular{}, residual{}, size{}, before{};
  std::array<char, L> trusted{}, walks{}, found{};
  void (*step)(const StepTask&);

  explicit Group(const std::vector<LineTracker*>& all)
      : lines(all),
        s(all.front()->sweep),
        p(s.problem),
        nx(std::size_t(s.states())),
        rows(nx + s.model().outputs.size()),
        n(s.unknowns.size()),
        z((nx + s.model().inputs.size() + s.model().parameters.size()) * L),
        y(rows * L),
        slopes(s.along.size() * rows * L),
        J(n * n * L),
        last(J),
        before_last(J),
        dz(n * L),
        elsewhere(lines.size() < L ? all.front()->A.entries.size() : 0),
        step(chosen([]<InstructionSet set>() { return &newton_step<set>; })) {
    for (std::size_t l = 0; l < L; ++l) put(l, lines[std::min(l, lines.size() - 1)]->base);
  }

  void put(std::size_t l, const OperatingPoint& at) {
    std::size_t j = 0;
    for (const auto* part : {&at.x, &at.u, &at.p})
      for (const double value : *part) z[j++ * L + l] = value;
  }
  double* unknown(std::size_t i) { return &z[std::size_t(p.unknowns[i]) * L]; }
};

// Moves all lanes to point k, and extrapolates the unknowns by a polynomial through up to four
// adjacent points, as for a line alone.
void go_to(Group& g, std::size_t k) {
  const LineTracker& first = *g.lines.front();
  const SweepAxis& axis = g.s.axes[first.axis];
  for (std::size_t c = 0; c < axis.columns.size(); ++c)
    if (const Index j = g.s.moved[first.axis][c]; j >= 0)
      std::fill_n(&g.z[std::size_t(j) * L], L, axis.columns[c].si[k]);
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
  for (std::size_t l = 0; l < g.lines.size(); ++l)
    for (std::size_t i = 0; i < g.n; ++i) {
      double value = 0.0;
      for (std::size_t a = 0; a < g.known[l]; ++a)
        value += weight[g.known[l]][a] * g.lines[l]->unknowns[(k - 1 - a) * g.n + i];
      if (g.known[l] > 0) g.unknown(i)[l] = value;
    }
}

// The Jacobian extrapolated from the last two points: what it misses is of second order.
void foresee(Group& g, std::size_t k) {
  const std::vector<double>& v = g.lines.front()->coordinates();
  const double ratio = k >= 2 ? (v[k] - v[k - 1]) / (v[k - 1] - v[k - 2]) : 0.0;
  Lane share{};
  for (std::size_t l = 0; l < L; ++l) share[l] = g.primed[l] >= 2 ? ratio : 0.0;
  for (std::size_t e = 0; e < g.J.size(); e += L)
    for (std::size_t l = 0; l < L; ++l)
      g.J[e + l] = g.last[e + l] + share[l] * (g.last[e + l] - g.before_last[e + l]);
}

bool any(const std::array<char, L>& flags) {
  return std::ranges::any_of(flags, [](char flag) { return flag != 0; });
}

// The Newton step from the rates and outputs in y, with its size and the residuals'.
void find_step(Group& g) {
  g.step({g.n, g.p.equations.data(), g.y.data(), g.p.held.data(), g.p.row_nominal.data(),
          g.J.data(), g.dz.data(), g.residual.data(), g.size.data(), g.regular.data()});
}

void take_step(Group& g, const std::array<char, L>& which) {
  for (std::size_t i = 0; i < g.n; ++i) {
    const double nominal = g.p.nominal[Index(i)];
    double* const z = g.unknown(i);
    for (std::size_t l = 0; l < L; ++l) z[l] = which[l] ? z[l] + g.dz[i * L + l] * nominal : z[l];
  }
}

// The equations' Jacobian in nominal sizes at the current points.
void scale(Group& g, const std::vector<double>& slopes, std::vector<double>& J) {
  for (std::size_t i = 0; i < g.n; ++i)
    for (std::size_t k = 0; k < g.n; ++k) {
      const std::size_t row = std::size_t(g.p.equations[i]), column = std::size_t(g.s.unknowns[k]);
      const double nominal = g.p.nominal[Index(k)], size = g.p.row_nominal[Index(row)];
      for (std::size_t l = 0; l < L; ++l)
        J[(i * g.n + k) * L + l] = slopes[(column * g.rows + row) * L + l] * nominal / size;
    }
}

// Steps with the extrapolated Jacobian, until the next is foreseen to be at round-off.
void approach(Group& g) {
  constexpr int most_steps = 6;
  static const std::vector<Index> no_variables;
  g.before.fill(std::numeric_limits<double>::infinity());
  std::array<char, L> moving = g.walks;
  for (int i = 0; i < most_steps && any(moving); ++i) {
    g.s.model().lanes(g.z.data(), no_variables, g.y.data(), nullptr);
    find_step(g);
    for (std::size_t l = 0; l < L; ++l)  // otherwise the exact Jacobian decides
      moving[l] = moving[l] && g.size[l] < far && (i == 0 || g.size[l] <= fast * g.before[l]);
    take_step(g, moving);
    for (std::size_t l = 0; l < L; ++l) {
      if (!moving[l]) continue;
      const double ratio = i > 0 ? g.size[l] / g.before[l] : fast * fast;
      g.before[l] = g.size[l];
      moving[l] = g.size[l] * ratio > foreseen;
    }
  }
}

// Newton with exact Jacobians: `found` where the step is at round-off and the residual within the
// tolerances, both by the Jacobian of the point itself.
void verify(Group& g) {
  constexpr int most_steps = 4;
  std::array<char, L> moving = g.walks;
  g.found.fill(0);
  for (int i = 0; i < most_steps; ++i) {
    g.s.model().lanes(g.z.data(), g.s.along, g.y.data(), g.slopes.data());
    scale(g, g.slopes, g.J);
    find_step(g);
    for (std::size_t l = 0; l < L; ++l) {
      if (!moving[l]) continue;
      const bool small =
          g.residual[l] <= g.s.trimming.tolerance && g.size[l] <= g.s.trimming.step_tolerance;
      g.found[l] = small && g.regular[l] != 0 &&
                   (g.size[l] <= step_at_rest || g.size[l] >= 0.5 * g.before[l]);
      moving[l] = !g.found[l] && g.size[l] < far;
      g.before[l] = g.size[l];
    }
    if (!any(moving)) return;
    if (i + 1 < most_steps) take_step(g, moving);
  }
}

// Zero in the lanes in which all values and derivatives are finite, otherwise NaN.
Lane not_finite(const Group& g) {
  Lane sum{};
  for (const std::vector<double>* numbers : {&g.y, &g.slopes})
    for (std::size_t e = 0; e < numbers->size(); e += L)
      for (std::size_t l = 0; l < L; ++l) sum[l] += 0.0 * (*numbers)[e + l];
  return sum;
}

// Zero in the lanes in which limits are satisfied and implied rates zero, otherwise 1.
Lane outside(const Group& g) {
  Lane out{};
  const auto keep = [&](const std::vector<double>& of, Index row, double nominal, double lower,
                        double upper) {
    const double* const values = &of[std::size_t(row) * L];
    for (std::size_t l = 0; l < L; ++l) {
      const double value = values[l] / nominal;
      out[l] = value >= lower && value <= upper ? out[l] : 1.0;
    }
  };
  for (std::size_t i = 0; i < g.n; ++i)
    keep(g.z, g.p.unknowns[i], g.p.nominal[Index(i)], g.p.lower[Index(i)] - bound_slack,
         g.p.upper[Index(i)] + bound_slack);
  for (std::size_t i = 0; i < g.p.limited.size(); ++i)
    keep(g.y, g.p.limited[i], g.p.row_nominal[g.p.limited[i]],
         g.p.limited_lower[Index(i)] - bound_slack, g.p.limited_upper[Index(i)] + bound_slack);
  for (const Index row : g.p.implied) {
    const double rest = g.s.trimming.tolerance * g.p.row_nominal[row];
    keep(g.y, row, 1.0, -rest, rest);
  }
  return out;
}

// Stores the point of lane l.
void keep(const Group& g, std::size_t l, std::size_t k) {
  LineTracker& w = *g.lines[l];
  LinePoints& points = w.points;
  points.status[k] = std::int8_t(TrimStatus::converged);
  points.reason[k] = 0;
  points.residual[k] = g.residual[l];
  w.valid[k] = w.exact[k] = 1;
  for (std::size_t i = 0; i < g.n; ++i)
    w.unknowns[k * g.n + i] = g.z[std::size_t(g.p.unknowns[i]) * L + l];
  for (std::size_t i = 0; i < g.nx; ++i) points.state[k * g.nx + i] = g.z[i * L + l];
  const std::size_t m = g.s.inputs.size(), nu = g.s.model().inputs.size();
  for (std::size_t i = 0; i < m; ++i) {
    const std::size_t at = std::size_t(g.s.inputs[i]);
    points.input[k * m + i] = at < nu ? g.z[(g.nx + at) * L + l] : g.y[(g.nx + at - nu) * L + l];
  }
}

// Stores the matrices of all lanes; the scalar path overwrites those of lanes that fail.
void keep_all_matrices(Group& g, std::size_t k) {
  const std::size_t count = g.lines.front()->count;
  std::array<double*, L> to;
  for (std::size_t l = 0; l < L; ++l)
    to[l] = (l < g.lines.size() ? g.lines[l]->A.entries : g.elsewhere).data() + k;
  for (std::size_t i = 0; i < g.nx; ++i)
    for (std::size_t j = 0; j < g.nx; ++j)
      for (std::size_t l = 0; l < L; ++l)
        to[l][(i * g.nx + j) * count] = g.slopes[(j * g.rows + i) * L + l];
}

// True if the lanes give what f, h and the derivatives give at the equilibrium, to rounding.
bool agrees(Group& g, std::size_t l, const GridTrim& e) {
  constexpr double same = 1e-9;
  g.put(l, e.at);
  g.s.model().lanes(g.z.data(), g.s.along, g.y.data(), g.slopes.data());
  const Eigen::VectorXd rates = g.s.model().f(e.at.x, e.at.u, e.at.p);
  for (std::size_t i = 0; i < g.rows; ++i) {
    const double expected = i < g.nx ? rates[Index(i)] : e.outputs[Index(i - g.nx)];
    const double size = g.p.row_nominal[Index(i)] + std::abs(expected);
    if (!(std::abs(g.y[i * L + l] - expected) <= same * size)) return false;
    const double steepest = e.slopes.row(Index(i)).lpNorm<Eigen::Infinity>();
    for (std::size_t c = 0; c < g.s.along.size(); ++c) {
      const double miss = g.slopes[(c * g.rows + i) * L + l] - e.slopes(Index(i), Index(c));
      if (!(std::abs(miss) <= same * steepest)) return false;
    }
  }
  return true;
}

// After point k of lane l by the scalar path: its Jacobian, for the points that follow.
void resume(Group& g, std::size_t l, std::size_t k, const GridTrim& e) {
  g.known[l] = g.primed[l] = 0;
  if (!e.valid() || !e.exact) return;
  if (!g.trusted[l] && !agrees(g, l, e)) return;
  g.trusted[l] = 1;
  for (std::size_t i = 0; i < g.n; ++i)
    for (std::size_t c = 0; c < g.n; ++c) {
      const Index row = g.p.equations[i];
      g.last[(i * g.n + c) * L + l] =
          e.slopes(row, g.s.unknowns[c]) * g.p.nominal[Index(c)] / g.p.row_nominal[row];
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
  for (std::size_t k = 0; k < lines.front()->count; ++k) {
    for (std::size_t l = 0; l < lines.size(); ++l) g.walks[l] = g.known[l] > 0;
    Lane invalid{}, limited{};
    if (any(g.walks)) {
      go_to(g, k);
      foresee(g, k);
      approach(g);
      verify(g);
      invalid = not_finite(g);
      limited = outside(g);
      keep_all_matrices(g, k);
      std::swap(g.last, g.before_last);
      std::swap(g.last, g.J);
    }
    for (std::size_t l = 0; l < lines.size(); ++l) {
      if (g.walks[l] && g.found[l] && invalid[l] == 0 && limited[l] == 0) {
        keep(g, l, k);
        g.known[l] = std::min(g.known[l] + 1, most_known);
        g.primed[l] = std::min<std::size_t>(g.primed[l] + 1, 2);
      } else {
        resume(g, l, k, alone(l, k));
      }
    }
  }
}

}  // namespace tiltrim
