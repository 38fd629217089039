#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "follow/envelope.hpp"
#include "follow/linear_at.hpp"
#include "follow/path.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

using Eigen::VectorXd;

namespace {

constexpr std::size_t most_equilibria = 50;

struct Found {
  const Model& model;
  const TrimSpec& spec;   // of a trim
  const TrimSpec& along;  // of a branch: without bounds that only limit the starts
  const Problem problem;
  AllEquilibria all{};

  void add(const TrimResult& r, const std::string& how) {
    if (!is_equilibrium(r.status)) return;
    const VectorXd z = unknowns_of(problem, r.point);
    for (const Equilibrium& e : all.equilibria)
      if (same_solution(unknowns_of(problem, e.trim.point), z)) return;
    all.equilibria.push_back({r, how});
    Equilibrium& e = all.equilibria.back();
    e.trim.others.clear();
    const LinearModel linear = linear_at(model, spec, r.point);
    if (linear) e.modes = modes(linear);
  }
};

// Newton only, from one point; the optimizer if a cost selects the trim.
TrimResult at(const Found& f, const OperatingPoint& guess, TrimOptions options) {
  options.method = f.problem.square() ? TrimMethod::newton : TrimMethod::ipopt;
  options.starts = 0;
  options.max_boxes = 0;
  options.closest = false;
  return trim(f.model, f.spec, guess, options);
}

// Where a branch returns to the original parameter value there is another trim.
void look_along(Found& f, std::size_t from, const std::string& parameter, double reach,
                const TrimOptions& options) {
  const OperatingPoint start = f.all.equilibria[from].trim.point;
  const Eigen::Index j = variable(f.model, parameter);
  const double own = value_of(start, j);
  FollowOptions along;
  along.stability = false;
  along.max_points = 1000;
  along.stop = options.stop;
  for (const double way : {-1.0, 1.0}) {
    if (options.stop.stop_requested()) return;
    const Branch branch = follow(f.model, f.along, start, parameter,
                                 own + way * reach * signal_of(f.model, j).nominal, along);
    ++f.all.branches;
    for (std::size_t k = 1; k + 1 < branch.points.size(); ++k) {
      const double a = branch.points[k].parameter - own, b = branch.points[k + 1].parameter - own;
      if (!(a * b <= 0)) continue;
      OperatingPoint guess = branch.points[std::abs(a) < std::abs(b) ? k : k + 1].point;
      set_value(guess, j, own);
      f.add(at(f, guess, options), fmt::format("the branch in {}", parameter));
    }
  }
}

AllEquilibria search(Found f, const OperatingPoint& guess,
                     const std::vector<std::string>& parameters, double reach,
                     const TrimOptions& options) {
  const TrimResult first = trim(f.model, f.spec, guess, options);
  f.all.starts = first.starts;
  f.add(first, "a start");
  for (const OperatingPoint& other : first.others) f.add(at(f, other, options), "a start");
  // Fewer starts may end elsewhere, by way of the closest point: what they find belongs to all.
  if (TrimOptions fewer = options; fewer.starts > TrimOptions{}.starts) {
    fewer.starts = TrimOptions{}.starts;
    f.add(trim(f.model, f.spec, guess, fewer), "a start");
  }
  if (f.all.equilibria.empty()) f.all.none = first;
  for (std::size_t k = 0; k < std::min(f.all.equilibria.size(), most_equilibria); ++k)
    for (const std::string& parameter : parameters) look_along(f, k, parameter, reach, options);
  std::ranges::stable_sort(f.all.equilibria, {},
                           [](const Equilibrium& e) { return e.trim.effort; });
  return std::move(f.all);
}

}  // namespace

AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                             const std::vector<std::string>& parameters, double reach,
                             const TrimOptions& options) {
  const RoundToNearest environment;
  return all_equilibria(model, spec, spec, guess, parameters, reach, options);
}

AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec, const TrimSpec& along,
                             const OperatingPoint& guess,
                             const std::vector<std::string>& parameters, double reach,
                             const TrimOptions& options) {
  const RoundToNearest environment;
  return search({model, spec, along, make_problem(model, spec, guess)}, guess, parameters, reach,
                options);
}

}  // namespace tiltrim
