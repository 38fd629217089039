// Levels over the grid of a sweep, and their borders between its points.
#include <algorithm>
#include <array>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>

#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"
#include "study/problems.hpp"
#include "study/qualities_study.hpp"
#include "sweep/prepared.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

using Place = std::vector<double>;  // a position along each axis, in grid steps

// Criteria that [tune] may use.
constexpr std::array<const char*, 8> tuned_criteria{
    "aperiodic stability",    "phugoid damping",    "short-period damping", "control anticipation",
    "short-period frequency", "aperiodic response", "oscillation",          "attitude bandwidth"};
constexpr double not_judged_figure = 10.0;

struct LevelPoint {
  OperatingPoint at;
  Qualities qualities;
};

struct LevelGrid {
  const Study& study;
  const SweepTable& grid;
  const SweepMap& map;
  std::vector<SweepRequest> requests;
  std::vector<Condition> conditions;
};

void move_along(const SweepAxis& axis, double t, const Model& model, OperatingPoint& point) {
  const std::vector<double> values = values_at(axis, t);
  for (std::size_t c = 0; c < values.size(); ++c)
    if (!axis.columns[c].signal.empty())
      set_value(point, variable(model, axis.columns[c].signal), values[c]);
}

// Trims and judges at a place; nothing without an equilibrium or a linear model.
std::optional<LevelPoint> judged_at(const LevelGrid& g, std::size_t condition, const Place& place,
                                    const OperatingPoint& near) {
  const SweepRequest& r = g.requests[condition];
  OperatingPoint guess = near;
  for (std::size_t a = 0; a < place.size(); ++a)
    move_along(g.grid.axes[a], place[a], r.model, guess);
  TrimOptions options;
  options.time_limit = g.study.time_limit;
  options.closest = false;
  options.starts = 0;  // this equilibrium, not another one
  options.others = false;
  const TrimResult found = trim(r.model, r.spec, guess, options);
  if (!is_equilibrium(found.status)) return {};
  LinearizeOptions how;
  how.moving = moving_states(g.conditions[condition]);
  how.time_limit = g.study.time_limit;
  if (g.conditions[condition].command()) how.inputs = {"V", "gamma", "eta"};
  const LinearModel linear = linearize(r.model, found.point, how);
  if (!linear) return {};
  return LevelPoint{found.point,
                    qualities(linear, qualities_options(g.study, g.conditions[condition], linear,
                                                        found.outputs))};
}

const Criterion* named(const Qualities& q, const std::string& name) {
  const auto at = std::ranges::find(q.criteria, name, &Criterion::name);
  return at == q.criteria.end() || at->margins.empty() ? nullptr : &*at;
}

// The margin differs from zero by more than its error.
bool sign_known(const Criterion& c, std::size_t k) {
  return std::abs(c.margins[k]) > c.margin_error;
}

struct FigureEnds {};  // the figure does not exist at a place, or its side is not known

// The border at which margin `k` of a criterion changes sign between two places of a line.
QualityBorder located(const LevelGrid& g, std::size_t condition, std::size_t axis, Place place,
                      const LevelPoint& near, const std::string& name, std::size_t k) {
  const Place start = place;
  double figure = 0.0, error = 0.0;
  const auto margin = [&](double t) {
    place[axis] = t;
    const auto there = judged_at(g, condition, place, near.at);
    const Criterion* c = there ? named(there->qualities, name) : nullptr;
    if (!c || c->margins.size() <= k) throw FigureEnds{};
    figure = c->value;
    error = c->margin_error;
    return c->margins[k];
  };
  boost::uintmax_t steps = 60;
  const double from = start[axis], to = from + 1;
  const double a = margin(from), b = margin(to);
  if (!(a * b < 0)) throw FigureEnds{};  // another equilibrium than the map's
  const auto [left, right] = boost::math::tools::toms748_solve(
      margin, from, to, a, b, boost::math::tools::eps_tolerance<double>(46), steps);
  const double at = left + 0.5 * (right - left), slope = std::abs(b - a);
  (void)margin(at);
  const SweepAxis& along = g.grid.axes[axis];
  const double step = std::abs(coordinate(along, to) - coordinate(along, from));
  QualityBorder border{int(condition), int(axis), {}, 0.0, name, int(k) + 1, figure, {}};
  place[axis] = at;
  for (std::size_t j = 0; j < place.size(); ++j)
    border.at.push_back(coordinate(g.grid.axes[j], place[j]));
  border.error = step * std::min(1.0, 0.5 * (right - left) + error / slope);
  return border;
}

struct Borders {
  std::vector<QualityBorder> all;
  bool complete = true;
};

Borders borders_between(const LevelGrid& g, std::size_t condition, std::size_t axis,
                        const Place& place, const LevelPoint& a, const LevelPoint& b) {
  Borders found;
  for (const Criterion& c : a.qualities.criteria) {
    const Criterion* other = named(b.qualities, c.name);
    if (c.margins.empty() != !other) found.complete = false;
    if (!other || other->margins.size() != c.margins.size()) continue;
    for (std::size_t k = 0; k < c.margins.size(); ++k) {
      if ((c.margins[k] > 0) == (other->margins[k] > 0)) continue;
      if (k > 0 && c.margins[k] == c.margins[k - 1]) continue;  // two levels with one border
      try {
        if (!sign_known(c, k) || !sign_known(*other, k)) throw FigureEnds{};
        found.all.push_back(located(g, condition, axis, place, a, c.name, k));
        found.all.back().unit = c.unit;
      } catch (const FigureEnds&) {
        found.complete = false;
      }
    }
  }
  return found;
}

// The trimmed state of the map as a start.
OperatingPoint start_at(const LevelGrid& g, std::size_t condition, std::size_t point) {
  const SweepRequest& r = g.requests[condition];
  OperatingPoint guess = r.guess;
  const std::size_t n = g.map.states.size(), m = g.map.inputs.size();
  for (std::size_t i = 0; i < n; ++i) guess.x[Index(i)] = g.map.state[point * n + i];
  for (std::size_t i = 0; i < m; ++i)
    if (const Index j = find(r.model.inputs, g.map.inputs[i].name); j >= 0)
      guess.u[j] = g.map.input[point * m + i];
  return guess;
}

}  // namespace

std::vector<std::string> quality_figure_names() {
  std::vector<std::string> names;
  for (std::string name : tuned_criteria) {
    for (char& c : name)
      if (c == ' ' || c == '-') c = '_';
    names.push_back("level_1_" + name);
  }
  return names;
}

decltype(TuneProblem::figures) quality_figures(const Study& study, const SweepRequest& request,
                                               const Condition& condition) {
  const auto shared = std::make_shared<const Study>(study);
  const auto judged = [shared, request, condition](const Eigen::VectorXd& p) {
    const SweepTable none{};
    const SweepMap empty{};
    const LevelGrid g{*shared, none, empty, {request}, {condition}};
    OperatingPoint start = request.guess;
    start.p = p;
    const auto there = judged_at(g, 0, {}, start);
    std::vector<double> figures;
    for (const auto& name : tuned_criteria) {
      const Criterion* c = there ? named(there->qualities, name) : nullptr;
      figures.push_back(c ? -c->margins.front() : not_judged_figure);
    }
    return figures;
  };
  return figures_together(quality_figure_names(), judged);
}

namespace {

// Calls work(p) for all points, in parallel; false if it was stopped.
bool each_point(const SweepMap& map, const SweepOptions& options, const char* what,
                const std::function<void(std::size_t)>& work) {
  constexpr std::size_t together = 256;
  const std::size_t total = map.points();
  for (std::size_t from = 0; from < total; from += together) {
    if (options.stop.stop_requested()) return false;
    const std::size_t count = std::min(together, total - from);
    in_parallel(count, [&](std::size_t i) { work(from + i); });
    if (options.observe) options.observe({.what = what, .done = from + count, .total = total});
  }
  return true;
}

QualityLayer layer_of(const LevelGrid& g, const SweepOptions& options) {
  const SweepMap& map = g.map;
  QualityLayer layer;
  layer.level.assign(map.points(), Level::not_judged);
  std::vector<std::optional<LevelPoint>> points(map.points());
  const auto place_of = [](const std::vector<std::size_t>& position) {
    return Place(position.begin() + 1, position.end());
  };
  layer.complete = each_point(map, options, "levels", [&](std::size_t p) {
    if (map.verdict[p] < 0) return;
    const std::vector<std::size_t> position = map.position(p);
    points[p] = judged_at(g, position[0], place_of(position), start_at(g, position[0], p));
    if (points[p]) layer.level[p] = points[p]->qualities.level;
  });
  std::size_t stride = map.points_per_condition();
  bool stopped = !layer.complete;
  for (std::size_t axis = 0; axis < g.grid.axes.size() && !stopped; ++axis) {
    const std::size_t size = g.grid.axes[axis].size();
    stride /= size;
    std::vector<Borders> after(map.points());
    stopped = !each_point(map, options, "borders of levels", [&](std::size_t p) {
      const std::vector<std::size_t> position = map.position(p);
      if (position[axis + 1] + 1 == size || !points[p] || !points[p + stride]) return;
      after[p] = borders_between(g, position[0], axis, place_of(position), *points[p],
                                 *points[p + stride]);
    });
    for (Borders& found : after) {
      layer.complete = layer.complete && found.complete && !stopped;
      std::ranges::move(found.all, std::back_inserter(layer.borders));
    }
  }
  return layer;
}

}  // namespace

QualityLayer quality_layer(const Study& study, const std::vector<Condition>& conditions,
                           const SweepTable& grid, const SweepMap& map,
                           const SweepOptions& options) {
  const RoundToNearest environment;
  const LevelGrid g{study, grid, map, sweep_requests(study, conditions, grid.axes), conditions};
  QualityLayer layer;
  with_threads(options.threads, [&] { layer = layer_of(g, options); });
  return layer;
}

}  // namespace tiltrim
