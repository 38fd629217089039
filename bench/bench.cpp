// What one condition costs: evaluation, derivatives, trim, linearization and modes of the closed
// loop in level flight. Published numbers state machine, compiler and options.
#include <benchmark/benchmark.h>

#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "model/study.hpp"
#include "trim/conditions.hpp"

using namespace tiltrim;

static constexpr Command level{.V = 15.0, .gamma = 0.0, .eta = 0.0};

static void evaluate_loop(benchmark::State& state) {
  const TrimProblem problem = closed_loop_problem(reference_vehicle(), level);
  for (auto _ : state) benchmark::DoNotOptimize(evaluate(problem.model, problem.guess));
}
BENCHMARK(evaluate_loop);

static void differentiate_loop(benchmark::State& state) {
  const TrimProblem problem = closed_loop_problem(reference_vehicle(), level);
  const std::vector<Eigen::Index> states{0, 1, 2, 3, 4, 5};
  for (auto _ : state) benchmark::DoNotOptimize(jacobian(problem.model, problem.guess, states));
}
BENCHMARK(differentiate_loop);

static void trim_loop(benchmark::State& state) {
  const TrimProblem problem = closed_loop_problem(reference_vehicle(), level);
  const TrimOptions options{.method = static_cast<TrimMethod>(state.range(0))};
  for (auto _ : state)
    benchmark::DoNotOptimize(trim(problem.model, problem.spec, problem.guess, options));
}
BENCHMARK(trim_loop)
    ->ArgName("newton")
    ->Arg(int(TrimMethod::ipopt))
    ->Arg(int(TrimMethod::newton))
    ->Unit(benchmark::kMicrosecond);

static void linearize_loop(benchmark::State& state) {
  const TrimProblem problem = closed_loop_problem(reference_vehicle(), level);
  const TrimResult level_flight = trim(problem.model, problem.spec, problem.guess);
  for (auto _ : state)
    benchmark::DoNotOptimize(modes(linearize(problem.model, level_flight.point)));
}
BENCHMARK(linearize_loop)->Unit(benchmark::kMicrosecond);
