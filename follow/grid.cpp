#include "follow/grid.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "dense/dense.hpp"
#include "model/lookup.hpp"
#include "runtime/threads.hpp"
#include "trim/newton.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double same_trim = 1e-5;  // scaled distance below which two trims are the same

Grid::Grid(const Model& model, const TrimSpec& spec, const TrimSpec& over,
           const OperatingPoint& guess, const EnvelopeAxis& along, const EnvelopeAxis& up,
           const EnvelopeOptions& o, Sheets& found)
    : x(along),
      y(up),
      options(o),
      fixed(make_problem(model, spec, guess)),
      moving(make_problem(model, over, guess)),
      plane{moving, {}, {}},
      sheets(found) {
  sheets.trims.resize(std::size_t(along.count) * std::size_t(up.count));
  sheets.beyond.resize(sheets.trims.size());
  fixed.needs_outputs = moving.needs_outputs = bool(model.h);  // a trim's outputs are finite
  const Vector2d size = moving.nominal.tail<2>();
  plane.lower = Vector2d(x.range.lower, y.range.lower).cwiseQuotient(size);
  plane.upper = Vector2d(x.range.upper, y.range.upper).cwiseQuotient(size);
}

Grid::Grid(const Grid& other)
    : x(other.x),
      y(other.y),
      options(other.options),
      fixed(other.fixed),
      moving(other.moving),
      plane{moving, other.plane.lower, other.plane.upper},
      sheets(other.sheets) {}

Vector2d Grid::place(int i, int j) const {
  const auto at = [](double lower, double upper, int k, int count) {
    return k == count - 1 ? upper : lower + (upper - lower) * k / (count - 1);
  };
  return {at(plane.lower[0], plane.upper[0], i, x.count),
          at(plane.lower[1], plane.upper[1], j, y.count)};
}

void Grid::put(const Vector2d& p) const {
  set_value(fixed.base, moving.unknowns[std::size_t(n())], p[0] * moving.nominal[n()]);
  set_value(fixed.base, moving.unknowns[std::size_t(n() + 1)], p[1] * moving.nominal[n() + 1]);
}

bool Grid::within(const VectorXd& z, const Values& v) const {
  return excess(z, fixed.lower, fixed.upper) <= bound_slack &&
         excess(v.limited, fixed.limited_lower, fixed.limited_upper) <= bound_slack;
}

void for_all(const Grid& g, std::size_t count,
             const std::function<void(const Grid&, std::size_t)>& work) {
  constexpr std::size_t per_thread = 8;  // blocks: some take longer than others
  if (g.options.threads == 1) {
    for (std::size_t k = 0; k < count; ++k) work(g, k);
    return;
  }
  const std::size_t blocks = std::min(count, per_thread * threads());
  std::vector<long> evaluations(blocks);
  in_parallel(blocks, [&](std::size_t b) {
    const Grid own(g);
    for (std::size_t k = b * count / blocks; k < (b + 1) * count / blocks; ++k) work(own, k);
    evaluations[b] =
        own.fixed.evaluations - g.fixed.evaluations + own.moving.evaluations - g.moving.evaluations;
  });
  for (const long more : evaluations) g.fixed.evaluations += more;
}

Settled settle(const Grid& g, VectorXd& z, int cap) {
  constexpr double tolerance = 1e-10, step_tolerance = 1e-9, far = 10.0;
  constexpr double sure = 0.1;  // of that: a step by the last Jacobian is not exactly Newton's
  const VectorXd apart = g.fixed.upper - g.fixed.lower;
  const VectorXd longest = apart.array().isFinite().select(apart.cwiseMax(far), far);
  std::optional<dense::LU<MatrixXd>> last;
  for (int i = 0; i < cap; ++i) {
    const Values v = values(g.fixed, z);
    if (!v.finite) return Settled::lost;
    const bool small = v.residual.lpNorm<Eigen::Infinity>() <= tolerance;
    if (small && last &&
        dense::solve(*last, v.residual).lpNorm<Eigen::Infinity>() <= sure * step_tolerance)
      return g.within(z, v) ? Settled::trim : Settled::outside;
    const Jacobians s = jacobians(g.fixed, z);
    if (!s.finite) return Settled::lost;
    last = dense::lu(s.residual);
    const VectorXd dz = -dense::solve(*last, v.residual);
    const double step = dz.lpNorm<Eigen::Infinity>();
    if (!(dz.cwiseAbs().array() < longest.array()).all()) return Settled::lost;
    if (small && step <= step_tolerance) return g.within(z, v) ? Settled::trim : Settled::outside;
    z += dz;
  }
  return Settled::lost;
}

static bool known(const std::vector<VectorXd>& trims, const VectorXd& z) {
  return std::ranges::any_of(trims, [&](const VectorXd& t) {
    return (t.head(z.size()) - z).lpNorm<Eigen::Infinity>() <=
           same_trim * std::max(1.0, z.lpNorm<Eigen::Infinity>());
  });
}

bool add(Grid& g, int i, int j, const VectorXd& z, bool within, std::deque<Front>& front) {
  std::vector<VectorXd>& trims = (within ? g.sheets.trims : g.sheets.beyond)[g.node(i, j)];
  if (known(trims, z)) return false;
  if (trims.size() >= most_sheets) {
    g.sheets.more = true;
    return false;
  }
  VectorXd y(g.n() + 2);
  y << z, g.place(i, j);
  trims.push_back(y);
  front.push_back({i, j, within, y});
  return true;
}

// Sheets are followed beyond limits by the size of the larger limit, at least by three nominal
// sizes.
static bool near_limits(const VectorXd& at, const VectorXd& lower, const VectorXd& upper) {
  constexpr double least = 3.0;
  for (Index i = 0; i < at.size(); ++i) {
    double margin = least;
    for (const double limit : {lower[i], upper[i]})
      if (std::isfinite(limit)) margin = std::max(margin, std::abs(limit));
    if (!(at[i] >= lower[i] - margin && at[i] <= upper[i] + margin)) return false;
  }
  return true;
}

static bool near_limits(const Grid& g, const VectorXd& z) {
  return near_limits(z, g.fixed.lower, g.fixed.upper) &&
         near_limits(values(g.fixed, z).limited, g.fixed.limited_lower, g.fixed.limited_upper);
}

std::vector<VectorXd> around(const Grid& g, const Vector2d& p) {
  const Vector2d cell =
      (g.plane.upper - g.plane.lower).cwiseQuotient(Vector2d(g.x.count - 1, g.y.count - 1));
  const Vector2d at = (p - g.plane.lower).cwiseQuotient(cell);
  const int i0 = std::clamp(int(at[0]), 0, g.x.count - 2);
  const int j0 = std::clamp(int(at[1]), 0, g.y.count - 2);
  std::vector<VectorXd> starts;
  for (const auto* sheets : {&g.sheets.trims, &g.sheets.beyond})
    for (int i = std::max(0, i0 - 1); i <= std::min(g.x.count - 1, i0 + 2); ++i)
      for (int j = std::max(0, j0 - 1); j <= std::min(g.y.count - 1, j0 + 2); ++j)
        for (const VectorXd& t : (*sheets)[g.node(i, j)]) starts.push_back(t.head(g.n()));
  return starts;
}

namespace {

// A trim at a grid point, within the limits or beyond, or where a sheet ended on the way to it.
struct Reached {
  int i, j;
  VectorXd z;
  Settled how;
  bool on_sheet;  // to be followed on from here
};

// Newton from z at a grid point.
Reached reach(const Grid& own, int i, int j, VectorXd z, int cap) {
  const Settled how = settle(own, z, cap);
  return {i, j, z, how, how == Settled::trim || (how == Settled::outside && near_limits(own, z))};
}

// The rates that a trim over the whole plane implies must vanish at each of its points.
void check_implied(const Grid& g, const Reached& r) {
  constexpr double small = 1e-6;  // 1/s
  if (r.how != Settled::trim || g.fixed.implied.empty()) return;
  const Vector2d p = g.place(r.i, r.j).cwiseProduct(g.moving.nominal.tail<2>());
  g.put(g.place(r.i, r.j));
  const VectorXd y = values(g.fixed, r.z).y;
  for (const Index row : g.fixed.implied)
    if (!(std::abs(y[row]) <= small * g.fixed.row_nominal[row]))
      throw std::invalid_argument(fmt::format(
          "the trim at {} = {:.6g}, {} = {:.6g} has {} = {:.3g}, which should vanish with its "
          "equations; an envelope needs it to vanish over the whole plane",
          g.x.signal, p[0], g.y.signal, p[1], row_name(g.fixed.model, row), y[row]));
}

void add(Grid& g, const Reached& r, std::deque<Front>& front) {
  check_implied(g, r);
  if (r.on_sheet) add(g, r.i, r.j, r.z, r.how == Settled::trim, front);
}

}  // namespace

void seed(Grid& g, std::deque<Front>& front) {
  constexpr int cap = 4;
  const int most = std::max(1, g.options.coarse);
  const auto at = [&](int k, int count) {
    return most == 1 ? count / 2 : k * (count - 1) / (most - 1);
  };
  std::vector<std::vector<Reached>> found(std::size_t(most) * std::size_t(most));
  for_all(g, found.size(), [&](const Grid& own, std::size_t place) {
    const int i = at(int(place) / most, g.x.count), j = at(int(place) % most, g.y.count);
    own.put(g.place(i, j));
    for (int k = 0; k <= g.options.starts && !g.options.stop.stop_requested(); ++k) {
      TrimOptions options;
      options.max_iterations = 12;  // of trims found, few took more; hopeless starts take all
      const VectorXd z0 = k == 0 ? unknowns_of(own.fixed, own.fixed.base) : start(own.fixed, k);
      found[place].push_back(reach(own, i, j, newton(own.fixed, z0, options).z, cap));
    }
  });
  for (const std::vector<Reached>& all : found)
    for (const Reached& r : all) add(g, r, front);
}

std::vector<Edge> spread(Grid& g, std::deque<Front>& front) {
  constexpr int cap = 12;
  std::vector<Edge> edges;
  std::size_t done = 0;
  const double all = double(g.sheets.trims.size());
  while (!front.empty()) {
    const std::deque<Front> wave = std::move(front);
    front.clear();
    std::vector<std::vector<Reached>> reached(wave.size());
    for_all(g, wave.size(), [&](const Grid& own, std::size_t k) {
      const Front& f = wave[k];
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const int i = f.i + di, j = f.j + dj;
        if (i < 0 || j < 0 || i >= g.x.count || j >= g.y.count) continue;
        if (g.options.stop.stop_requested()) return;
        own.put(g.place(i, j));
        reached[k].push_back(reach(own, i, j, f.y.head(g.n()), cap));
      }
    });
    if (g.options.stop.stop_requested()) return edges;
    for (std::size_t k = 0; k < wave.size(); ++k) {
      const Front& f = wave[k];
      for (const Reached& r : reached[k]) {
        add(g, r, front);
        if (f.within && r.how != Settled::trim) edges.push_back({f.y, f.i, f.j, r.i, r.j});
      }
      if (g.options.observe && ++done % 256 == 0)
        g.options.observe(std::min(1.0, double(done) / all));
    }
  }
  return edges;
}

}  // namespace tiltrim
