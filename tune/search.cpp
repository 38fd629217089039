#include "tune/search.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "optimize/optimize.hpp"
#include "tune/epigraph.hpp"
#include "tune/measures.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr std::array<std::pair<GlobalSearch, const char*>, 6> global_searches{
    {{GlobalSearch::crs2, "crs2"},
     {GlobalSearch::isres, "isres"},
     {GlobalSearch::esch, "esch"},
     {GlobalSearch::direct, "direct"},
     {GlobalSearch::mlsl, "mlsl"},
     {GlobalSearch::multistart, "multistart"}}};
constexpr std::array<std::pair<LocalSearch, const char*>, 6> local_searches{
    {{LocalSearch::bfgs, "bfgs"},
     {LocalSearch::slsqp, "slsqp"},
     {LocalSearch::mma, "mma"},
     {LocalSearch::bobyqa, "bobyqa"},
     {LocalSearch::sbplx, "sbplx"},
     {LocalSearch::cobyla, "cobyla"}}};

std::string name_in(const auto& table, auto algorithm) {
  for (const auto& [known, name] : table)
    if (known == algorithm) return name;
  return "unknown";
}

auto named_in(const auto& table, const std::string& wanted) {
  std::vector<std::string> names;
  for (const auto& [known, name] : table) {
    if (name == wanted) return known;
    names.emplace_back(name);
  }
  throw std::invalid_argument(
      fmt::format("no algorithm '{}'; there are: {}", wanted, fmt::join(names, ", ")));
}

}  // namespace

std::string to_string(GlobalSearch algorithm) { return name_in(global_searches, algorithm); }
std::string to_string(LocalSearch algorithm) { return name_in(local_searches, algorithm); }
GlobalSearch global_search(const std::string& name) { return named_in(global_searches, name); }
LocalSearch local_search(const std::string& name) { return named_in(local_searches, name); }

Search::Search(const TuneProblem& p, const TuneOptions& o)
    : problem(p), options(o), candidates(p, o.trimming) {}

const FreeGain& Search::gain_of(Index variable) const {
  const std::size_t each = problem.variables() / problem.gains.size();
  return problem.gains[std::size_t(variable) / each];
}

VectorXd Search::numbers_at(const VectorXd& y) const {
  VectorXd g(y.size());
  for (Index j = 0; j < y.size(); ++j) {
    const FreeGain& gain = gain_of(j);
    const double share = std::clamp(y[j], 0.0, 1.0);
    g[j] = gain.logarithmic ? gain.lower * std::pow(gain.upper / gain.lower, share)
                            : gain.lower + share * (gain.upper - gain.lower);
    g[j] = std::clamp(g[j], gain.lower, gain.upper);
  }
  return g;
}

VectorXd Search::place_of(const VectorXd& numbers) const {
  VectorXd y(numbers.size());
  for (Index j = 0; j < y.size(); ++j) {
    const FreeGain& gain = gain_of(j);
    const double number = std::clamp(numbers[j], gain.lower, gain.upper);
    y[j] = gain.logarithmic ? std::log(number / gain.lower) / std::log(gain.upper / gain.lower)
                            : (number - gain.lower) / (gain.upper - gain.lower);
  }
  return y;
}

VectorXd Search::scales_at(const VectorXd& y) const {
  const VectorXd g = numbers_at(y);
  VectorXd scale(y.size());
  for (Index j = 0; j < y.size(); ++j) {
    const FreeGain& gain = gain_of(j);
    scale[j] =
        gain.logarithmic ? g[j] * std::log(gain.upper / gain.lower) : gain.upper - gain.lower;
  }
  return scale;
}

const Search::Seen& Search::evaluate(const VectorXd& y) {
  if (last.y.size() == y.size() && last.y == y) return last;
  interrupted = options.stop.stop_requested();
  out_of_evaluations = !unlimited && evaluations >= options.evaluations;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun_;
  out_of_time = !unlimited && options.seconds > 0 && spent.count() > options.seconds;
  if (interrupted || out_of_evaluations || out_of_time) throw EndSearch{};
  ++evaluations;
  last = {y, {}, {}};
  if (y.allFinite())
    last.places = candidates.at(numbers_at(y), false);
  else  // the solver's status is not used
    last.places.resize(candidates.places().size());
  last.merit = merit(candidates, last.places);
  if (last.merit.trimmed()) {
    const bool first = best.y.size() == 0 || !best.merit.trimmed();
    lowest_goal = first ? last.merit.goal : std::min(lowest_goal, last.merit.goal);
    highest_goal = first ? last.merit.goal : std::max(highest_goal, last.merit.goal);
  }
  const bool better = best.y.size() == 0 || best.merit < last.merit;
  if (better) best = last;
  if (own.y.size() == 0 || own.merit < last.merit) own = last;
  if (better && options.observe) decides_ = deciding(*this);
  keep();
  if (options.observe && !unlimited)
    options.observe({evaluations, options.evaluations, spent.count(),
                     goal_value(problem, best.merit.goal), best.merit.feasible, decides_, starts,
                     stationary});
  return last;
}

const Search::Seen& Search::with_slopes(const std::vector<std::size_t>& at) {
  candidates.add_slopes(last.places, at);
  return last;
}

// The limit with the largest violation, otherwise the goal.
std::string deciding(const Search& search) {
  const Search::Seen& best = search.best;
  if (!best.merit.trimmed())
    return fmt::format("no trim at {} of {} places", best.merit.without_trim, best.places.size());
  std::size_t place = 0, asked = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < best.places.size(); ++p)
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      const Requirement& r = search.asked()[i];
      const double own = worst(i, r, best.places[p]).score;
      const bool goal = search.candidates.is_goal(i);
      if (best.merit.feasible != goal) continue;
      const double miss = goal ? best.merit.goal - goal_score(search.problem, r, own)
                               : (score_of(r.measure, r.limit) - own) / size_of(r);
      if (miss > most) std::tie(most, place, asked) = std::tuple(miss, p, i);
    }
  const Place& where = search.candidates.places()[place];
  return fmt::format("{} at {}{}{}", name_of(search.asked()[asked]), where.request.name,
                     where.where.scatter.empty() ? "" : ", ", where.where.scatter);
}

// Keeps the best candidate of each neighbourhood, up to twelve.
void Search::keep() {
  constexpr double wide = 0.25;  // relative to each gain's range
  constexpr std::size_t most = 12;
  if (kept.size() == most && !(kept.back().merit < last.merit)) return;
  const auto near = [&](const Seen& other) {
    return (other.y - last.y).lpNorm<Eigen::Infinity>() < wide;
  };
  if (std::ranges::any_of(kept, [&](const Seen& k) { return near(k) && !(k.merit < last.merit); }))
    return;
  std::erase_if(kept, near);
  kept.push_back(last);
  std::ranges::stable_sort(kept, [](const Seen& a, const Seen& b) { return b.merit < a.merit; });
  if (kept.size() > most) kept.pop_back();
}

namespace {

Optimizer named(GlobalSearch algorithm) {
  switch (algorithm) {
    case GlobalSearch::isres:
      return Optimizer::isres;
    case GlobalSearch::esch:
      return Optimizer::esch;
    case GlobalSearch::direct:
      return Optimizer::direct;
    case GlobalSearch::mlsl:
      return Optimizer::mlsl;
    default:
      return Optimizer::crs2;
  }
}

Optimizer named(LocalSearch algorithm) {
  switch (algorithm) {
    case LocalSearch::mma:
      return Optimizer::mma;
    case LocalSearch::cobyla:
      return Optimizer::cobyla;
    default:
      return Optimizer::slsqp;
  }
}

}  // namespace

VectorXd random_point(std::mt19937_64& random, Index n) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  VectorXd y(n);
  for (double& v : y) v = uniform(random);
  return y;
}

void search_globally(Search& search) {
  const Index n = search.variables();
  constexpr int each = 150;  // candidates per variable
  if (search.options.global == GlobalSearch::multistart) return;
  std::mt19937_64 random(search.options.seed);
  Optimization o;
  o.algorithm = named(search.options.global);
  o.start = random_point(random, n);
  o.lower = VectorXd::Zero(n);
  o.upper = VectorXd::Ones(n);
  o.objective = [&](const VectorXd& y, VectorXd*) {
    const Merit merit = search.evaluate(y).merit;
    return -(search.options.global == GlobalSearch::direct ? merit.penalised() : merit.value());
  };
  o.evaluations = each * int(n);
  o.seed = search.options.seed;
  o.step_tolerance = 1e-6;
  optimize(o);
}

void search_locally(Search& search, VectorXd y, LocalSearch local, double radius, int evaluations) {
  Optimization o;
  o.evaluations = evaluations;
  if (local == LocalSearch::bobyqa || local == LocalSearch::sbplx) {
    o.algorithm = local == LocalSearch::bobyqa ? Optimizer::bobyqa : Optimizer::sbplx;
    o.start = y;
    o.lower = (y.array() - radius).max(0.0);
    o.upper = (y.array() + radius).min(1.0);
    o.first_step = std::min(0.05, 0.2 * radius);
    o.objective = [&](const VectorXd& at, VectorXd*) {
      return -search.evaluate(at).merit.penalised();
    };
    return optimize(o);
  }
  if (!search.problem.limits.empty() && !search.evaluate(y).merit.feasible) {
    const Search::Seen before = search.own;
    search.own = search.last;
    meet_limits(search, y, named(local), radius, evaluations);
    y = search.own.y;
    if (search.own.merit < before.merit) search.own = before;
  }
  const Merit at_start = search.evaluate(y).merit;
  search_epigraph(search, {}, y, std::isfinite(at_start.goal) ? at_start.goal : 0.0, named(local),
                  radius, evaluations);
}

// Eigenvalues that are decisive, or nearly, and close to each other.
std::vector<Meeting> meetings_at(const Search& search, double within) {
  std::vector<Meeting> found;
  const Search::Seen& best = search.own;
  const Requirement& goal = search.problem.goal;
  if (!search.problem.goals.empty() || !spectral(goal.measure)) return found;
  for (std::size_t p = 0; p < best.places.size(); ++p) {
    const Eigen::VectorXcd& lambda = best.places[p].eigenvalues;
    const auto decides = [&](Index i) {
      return score(goal, lambda[i]).score <= best.merit.goal + within;
    };
    for (Index i = 0; i < lambda.size(); ++i)
      for (Index k = 0; k < i; ++k) {
        if (!decides(i) || !decides(k) || std::abs(lambda[i] - lambda[k]) > 2 * within) continue;
        const bool pair = lambda[i] == std::conj(lambda[k]) && lambda[i].imag() != 0;
        const bool real = pair || (lambda[i].imag() == 0 && lambda[k].imag() == 0);
        const bool upper = lambda[i].imag() > 0 && lambda[k].imag() > 0;
        if (real || upper)
          found.push_back(
              {p, 0.5 * (lambda[i] + lambda[k]), std::abs(lambda[i] - lambda[k]), real});
      }
  }
  std::ranges::stable_sort(found, {}, &Meeting::apart);
  return found;
}

// Keeping two eigenvalues together off the axis takes two degrees of freedom: the closest are kept
// together while variables are left.
static std::vector<Meeting> held_together(std::vector<Meeting> meetings, Index variables) {
  Index left = (variables - 1) / 2;
  std::erase_if(meetings, [&](const Meeting& m) { return !m.real && left-- <= 0; });
  return meetings;
}

bool search_coalesced(Search& search, double within, double radius, int evaluations) {
  if (!search.own.merit.trimmed()) return false;
  const double before = search.own.merit.value();
  const std::vector<Meeting> meetings =
      held_together(meetings_at(search, within), search.variables());
  if (meetings.empty()) return false;
  search_epigraph(search, meetings, search.own.y, search.own.merit.goal, Optimizer::slsqp, radius,
                  evaluations);
  return search.own.merit.value() > before;
}

}  // namespace tiltrim
