// From a spec with the model's names to a problem.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/among.hpp"
#include "model/lookup.hpp"
#include "model/name_table.hpp"
#include "trim/check_answers.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// What a name in a spec may refer to: a variable (negative row) or an output.
struct Place {
  Index variable = -1;  // of the model
  Index row = -1;       // of [f; h]
};

Place place_of(const Model& model, const ModelNames& known, const std::string& name) {
  if (const Index j = known.variables.find(name); j >= 0) return {j, -1};
  if (const Index i = known.outputs.find(name); i >= 0) return {-1, std::ssize(model.states) + i};
  std::vector<std::string> all;
  for (const Signals* signals : {&model.states, &model.inputs, &model.parameters, &model.outputs})
    for (const Signal& s : *signals) all.push_back(s.name);
  const std::string near = nearest_name(name, all);
  throw std::invalid_argument(fmt::format("no signal '{}'{}; the model has: {}", name,
                                          near.empty() ? "" : fmt::format(" (nearest: '{}')", near),
                                          fmt::join(all, ", ")));
}

void check_range(const std::string& name, const Range& r) {
  if (std::isnan(r.lower) || std::isnan(r.upper))
    throw std::invalid_argument(fmt::format("bounds of '{}': not a number", name));
  if (r.lower > r.upper)
    throw std::invalid_argument(
        fmt::format("bounds of '{}' are reversed: [{}, {}]", name, r.lower, r.upper));
  if (r.lower == r.upper && std::isinf(r.lower))
    throw std::invalid_argument(fmt::format("bounds of '{}': both are {}", name, r.lower));
}

// The bounds on one variable or output.
struct Bound {
  Place at;
  Range range;

  bool fixes() const { return range.lower == range.upper; }
  bool limits() const { return at.row >= 0 && !fixes(); }  // an output
  bool holds() const { return at.row >= 0 && fixes(); }
};

std::vector<Bound> bounds_of(const Model& model, const ModelNames& known, const TrimSpec& spec) {
  std::vector<Bound> bounds;
  bounds.reserve(spec.bounds.size());
  for (const auto& [name, range] : spec.bounds) {
    check_range(name, range);
    bounds.push_back({place_of(model, known, name), range});
  }
  return bounds;
}

// There is room in `held` for all equations that a spec can have.
void add_equation(Problem& p, Index row, double value) {
  p.held[p.m()] = value;
  p.equations.push_back(row);
}

std::vector<Index> free_variables(const Model& model, const ModelNames& known,
                                  const TrimSpec& spec) {
  std::vector<Index> variables;
  variables.reserve(spec.free.size());
  for (const std::string& name : spec.free) {
    Index j = known.variables.find(name);
    if (j < 0) j = variable(model, name);  // throws
    if (std::ranges::find(variables, j) != variables.end())
      throw std::invalid_argument(fmt::format("'{}' is listed twice as a free variable", name));
    variables.push_back(j);
  }
  return variables;
}

// Of the free variables, those that no bounds fix.
void add_unknowns(Problem& p, const std::vector<Bound>& bounds) {
  for (const Bound& bound : bounds)
    if (bound.fixes()) std::erase(p.unknowns, bound.at.variable);
  const Index n = p.n();
  p.nominal.resize(n);
  p.lower = VectorXd::Constant(n, -std::numeric_limits<double>::infinity());
  p.upper = -p.lower;
  for (Index k = 0; k < n; ++k)
    p.nominal[k] = signal_of(p.model, p.unknowns[std::size_t(k)]).nominal;
}

// If no steady states are listed, all states that no other list names.
std::vector<std::string> steady_states(const Model& model, const TrimSpec& spec) {
  if (!spec.steady.empty()) return spec.steady;
  std::vector<std::string> steady;
  for (const Signal& s : model.states)
    if (!spec.rates.contains(s.name) && !among(spec.implied, s.name) && !among(spec.moving, s.name))
      steady.push_back(s.name);
  return steady;
}

// The held rate of a state, or nothing.
const double* held_rate(const TrimSpec& spec, const std::vector<std::string>& steady,
                        const std::string& name) {
  static constexpr double zero = 0.0;
  if (const auto at = spec.rates.find(name); at != spec.rates.end()) return &at->second;
  return among(steady, name) ? &zero : nullptr;
}

// Throws for the first name, in alphabetical order, that is not a state.
void refuse_unknown_rates(const Model& model, const TrimSpec& spec) {
  std::vector<std::string> held = spec.steady;
  for (const auto& [name, rate] : spec.rates) held.push_back(name);
  std::ranges::sort(held);
  for (const std::string& name : held) (void)index_of(model.states, name, "state");
}

void add_rates(Problem& p, const std::vector<Bound>& bounds, const TrimSpec& spec) {
  for (const std::string& name : spec.moving) {
    (void)index_of(p.model.states, name, "state");
    if (among(spec.steady, name) || spec.rates.contains(name) || among(spec.implied, name))
      throw std::invalid_argument(fmt::format("the rate of '{}' is both free and held", name));
  }
  const std::vector<std::string> others =
      spec.steady.empty() ? steady_states(p.model, spec) : std::vector<std::string>{};
  const std::vector<std::string>& steady = spec.steady.empty() ? others : spec.steady;
  for (auto name = steady.begin(); name != steady.end(); ++name)
    if (spec.rates.contains(*name) || std::find(steady.begin(), name, *name) != name)
      throw std::invalid_argument(fmt::format("the rate of '{}' is held twice", *name));
  const std::size_t held = spec.rates.size() + steady.size();
  const auto equations = held + std::size_t(std::ranges::count_if(bounds, &Bound::holds));
  p.held.resize(Index(equations));
  p.equations.reserve(equations);
  for (Index i = 0; i < std::ssize(p.model.states); ++i) {
    const std::string& name = p.model.states[std::size_t(i)].name;
    const double* const rate = held_rate(spec, steady, name);
    if (!rate) continue;
    if (!std::isfinite(*rate))
      throw std::invalid_argument(fmt::format("the held rate of '{}' is not finite", name));
    add_equation(p, i, *rate);
  }
  if (p.equations.size() < held) refuse_unknown_rates(p.model, spec);
  p.implied.reserve(spec.implied.size());
  for (const std::string& name : spec.implied)
    p.implied.push_back(index_of(p.model.states, name, "state"));
}

void add_bounds(Problem& p, const std::vector<Bound>& bounds) {
  const auto limits = std::ranges::count_if(bounds, &Bound::limits);
  p.limited.reserve(std::size_t(limits));
  p.limited_lower.resize(limits);
  p.limited_upper.resize(limits);
  for (const Bound& bound : bounds) {
    const auto& [at, range] = bound;
    const auto k = std::ranges::find(p.unknowns, at.variable) - p.unknowns.begin();
    if (bound.limits()) {
      const Index i = std::ssize(p.limited);
      p.limited_lower[i] = range.lower / p.row_nominal[at.row];
      p.limited_upper[i] = range.upper / p.row_nominal[at.row];
      p.limited.push_back(at.row);
    } else if (at.row >= 0) {
      add_equation(p, at.row, range.lower);
    } else if (k < p.n()) {
      p.lower[k] = range.lower / p.nominal[k];
      p.upper[k] = range.upper / p.nominal[k];
    } else {
      p.fixed_bounds.push_back({at.variable, range});
    }
  }
}

// If no effort is given, that of every unknown that is an input, over its nominal size.
void add_input_effort(Problem& p) {
  const Index nx = std::ssize(p.model.states), nu = std::ssize(p.model.inputs);
  for (Index k = 0; k < p.n(); ++k)
    if (const Index j = p.unknowns[std::size_t(k)]; j >= nx && j < nx + nu)
      p.terms.push_back({k, -1, p.nominal[k], 0.0});
}

void add_effort(Problem& p, const ModelNames& known, const TrimSpec& spec) {
  if (spec.effort.empty()) return add_input_effort(p);
  p.terms.reserve(spec.effort.size());
  for (const CostTerm& e : spec.effort) {
    if (!(e.scale > 0 && std::isfinite(e.scale) && std::isfinite(e.reference)))
      throw std::invalid_argument(fmt::format(
          "control effort of '{}': its scale must be positive and its reference finite", e.signal));
    const Place at = place_of(p.model, known, e.signal);
    const auto k = std::ranges::find(p.unknowns, at.variable) - p.unknowns.begin();
    if (at.row >= 0)
      p.terms.push_back({-1, at.row, e.scale, e.reference});
    else if (k < p.n())
      p.terms.push_back({k, -1, e.scale, e.reference});
    else
      p.fixed_terms.push_back({at.variable, e.scale, e.reference});
  }
}

void count(const Problem& p, const TrimSpec& spec) {
  if (p.m() == 0 && p.implied.empty() && spec.effort.empty())
    throw std::invalid_argument(
        "the trim has no conditions: every state may move and no output is held at a value");
  if (p.n() >= p.m()) return;
  std::vector<std::string> unknowns, held;
  for (const Index j : p.unknowns) unknowns.push_back(signal_of(p.model, j).name);
  for (const Index row : p.equations) held.push_back(row_name(p.model, row));
  const std::string free = p.n() == 0
                               ? "nothing is free to"
                               : fmt::format("{} ({}) cannot", counted(int(p.n()), "free variable"),
                                             fmt::join(unknowns, ", "));
  throw std::invalid_argument(fmt::format("{} hold {} ({}): free {} more", free,
                                          counted(int(p.m()), "condition"), fmt::join(held, ", "),
                                          p.m() - p.n()));
}

}  // namespace

std::vector<std::string> moving_states(const Model& model, const TrimSpec& spec) {
  const std::vector<std::string> steady = steady_states(model, spec);
  std::vector<std::string> moving;
  for (const Signal& s : model.states)
    if (!among(steady, s.name) && !among(spec.implied, s.name) && !spec.rates.contains(s.name))
      moving.push_back(s.name);
  return moving;
}

void check_within_limits(const TrimSpec& spec, const std::string& signal,
                         std::span<const double> values) {
  const auto at = spec.bounds.find(signal);
  if (at == spec.bounds.end() || among(spec.free, signal)) return;
  const Range& limits = at->second;
  for (const double value : values)
    if (!(value >= limits.lower && value <= limits.upper))
      throw std::invalid_argument(
          fmt::format("{} is to be {:.6g}, outside its limits in the trim, [{:.6g}, {:.6g}]",
                      signal, value, limits.lower, limits.upper));
}

// From names that are checked.
static Problem problem_of(const Model& model, const ModelNames& known, const TrimSpec& spec) {
  Problem p(model);
  p.in_place = in_place(model);
  p.row_nominal.resize(std::ssize(model.states) + std::ssize(model.outputs));
  Index at = 0;
  for (const Signals* signals : {&model.states, &model.outputs})
    for (const Signal& s : *signals) p.row_nominal[at++] = s.nominal;
  p.unknowns = free_variables(model, known, spec);
  const std::vector<Bound> bounds = bounds_of(model, known, spec);
  add_unknowns(p, bounds);
  add_rates(p, bounds, spec);
  add_bounds(p, bounds);
  add_effort(p, known, spec);
  count(p, spec);
  const Index nx = std::ssize(model.states);
  const auto is_output = [nx](Index row) { return row >= nx; };
  p.needs_outputs = !p.limited.empty() || std::ranges::any_of(p.equations, is_output) ||
                    std::ranges::any_of(p.terms, [](const auto& t) { return t.row >= 0; });
  return p;
}

static void set_checked_guess(Problem& p, const OperatingPoint& guess) {
  p.base = guess;
  for (const auto& [variable, range] : p.fixed_bounds)
    if (range.lower == range.upper) set_value(p.base, variable, range.lower);
  p.fixed_effort = 0.0;
  for (const auto& [variable, scale, reference] : p.fixed_terms)
    p.fixed_effort += std::pow((value_of(p.base, variable) - reference) / scale, 2);
  p.evaluations = 0;
  p.thrown.clear();
  p.nearest = {};
  p.memory.z_of_here.resize(0);
  p.memory.z_of_slopes.resize(0);
  check_answers(p);
}

Problem unguessed_problem(const Model& model, const TrimSpec& spec) {
  return problem_of(model, checked_names(model), spec);
}

void set_guess(Problem& p, const OperatingPoint& guess) {
  check(p.model, guess);
  set_checked_guess(p, guess);
}

Problem make_problem(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                     bool timed) {
  const ModelNames known = checked_names(model);
  check(model, guess);
  Problem p = problem_of(model, known, spec);
  p.notes_nearest = timed;
  set_checked_guess(p, guess);
  return p;
}

}  // namespace tiltrim
