// Robustness of gains to random parameters between the corners.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>

#include "linearize/modes.hpp"
#include "runtime/proportion.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"
#include "tune/requirement.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

struct Sample {
  VectorXd uncertain;
  Merit merit;
  std::size_t worst = 0;  // the place with the worst goal
  bool stable = true;
};

VectorXd numbers_of(const TuneProblem& problem, std::uint64_t seed, long number) {
  std::seed_seq mixed{std::uint32_t(seed), std::uint32_t(seed >> 32), std::uint32_t(number),
                      std::uint32_t(std::uint64_t(number) >> 32)};
  std::mt19937 random(mixed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  VectorXd numbers(std::ssize(problem.uncertain));
  for (Index k = 0; k < numbers.size(); ++k) {
    const Uncertain& u = problem.uncertain[std::size_t(k)];
    numbers[k] = u.lower + uniform(random) * (u.upper - u.lower);
  }
  return numbers;
}

Sample tried(const Candidates& candidates, const VectorXd& gains, const VectorXd& uncertain) {
  Sample sample{uncertain, {}, 0, true};
  std::vector<PlaceModes> places;
  double worst_goal = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < candidates.places().size(); ++p) {
    places.push_back(candidates.scattered(p, gains, uncertain));
    const PlaceModes& place = places.back();
    if (!place.valid()) continue;
    sample.stable = sample.stable && modes(place.A).verdict == Verdict::stable;
    for (std::size_t i = 0; i < candidates.asked().size() && candidates.is_goal(i); ++i) {
      const Requirement& r = candidates.asked()[i];
      const double goal = goal_score(candidates.problem(), r, worst(i, r, place).score);
      if (goal < worst_goal) worst_goal = goal, sample.worst = p;
    }
  }
  sample.merit = merit(candidates, places);
  return sample;
}

}  // namespace

static void set_interval(Robustness& r) {
  if (r.samples == 0) return;
  const Proportion p = proportion(r.met, r.samples);
  std::tie(r.fraction, r.lower, r.upper) = std::tuple(p.share, p.lower, p.upper);
}

static Robustness tried_on(const TuneProblem& problem, const VectorXd& gains, long samples,
                           const TuneOptions& options) {
  TuneProblem nominal = problem;
  nominal.corners = false;
  nominal.samples = 0;
  Candidates candidates(nominal, options.trimming);
  Candidates tuned(problem, options.trimming);  // with corners and samples
  const bool nowhere = !applies_nowhere(tuned, tuned.at(gains, false)).empty();  // never met
  Robustness result;
  double worst_score = std::numeric_limits<double>::infinity();
  constexpr long block = 256;
  const auto begun = std::chrono::steady_clock::now();
  while (result.samples < samples && !options.stop.stop_requested()) {
    std::vector<Sample> drawn(std::size_t(std::min(block, samples - result.samples)));
    in_parallel(drawn.size(), [&](std::size_t i) {
      drawn[i] =
          tried(candidates, gains, numbers_of(problem, options.seed, result.samples + long(i)));
    });
    for (const Sample& s : drawn) {
      ++result.samples;
      if (!s.merit.trimmed()) {
        ++result.no_trim;
        continue;
      }
      if (!s.stable) ++result.unstable;
      if (s.stable && s.merit.feasible && !nowhere) ++result.met;
      if (s.merit.goal >= worst_score) continue;
      worst_score = s.merit.goal;
      result.worst = candidates.places()[s.worst].request.name;
      for (std::size_t k = 0; k < problem.uncertain.size(); ++k) {
        const std::string& name = problem.uncertain[k].name;
        result.worst +=
            fmt::format(", {} = {:.6g}", name.substr(name.rfind('.') + 1), s.uncertain[Index(k)]);
      }
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun;
    if (options.observe)
      options.observe({result.samples, samples, spent.count(), goal_value(problem, worst_score),
                       result.met == result.samples,
                       fmt::format("limits in {} samples", result.samples - result.met)});
  }
  result.interrupted = result.samples < samples;
  if (result.no_trim < result.samples) result.worst_goal = goal_value(problem, worst_score);
  set_interval(result);
  return result;
}

Robustness robustness(const TuneProblem& problem, const VectorXd& gains, long samples,
                      const TuneOptions& options) {
  const RoundToNearest environment;
  if (gains.size() != Index(problem.variables()))
    throw std::invalid_argument(
        fmt::format("{} gains for a problem that has {}", gains.size(), problem.variables()));
  if (problem.uncertain.empty())
    throw std::invalid_argument("robustness without uncertain numbers; expected some");
  Robustness result;
  with_threads(options.threads, [&] { result = tried_on(problem, gains, samples, options); });
  return result;
}

}  // namespace tiltrim
