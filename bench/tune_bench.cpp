// Cost of a tuning candidate: all its operating points trimmed again from the previous trims,
// linearized, with eigenvalues; with gradients; and, for comparison, trimmed from scratch.
#include <benchmark/benchmark.h>

#include <random>

#include "runtime/threads.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tune/candidate.hpp"

using namespace tiltrim;

namespace {

enum Way { values, slopes, from_nothing_at_all };

void candidate(benchmark::State& state, const char* file) {
  const Study study = load_study(data_directory().parent_path() / "studies" / file);
  const TuneProblem problem = tune_problem(study);
  const TuneOptions options = tune_options(study);
  Candidates candidates(problem, options.trimming);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> share(-0.1, 0.1);
  with_threads(1, [&] {
    (void)candidates.at(options.start, false);
    for (auto _ : state) {
      Eigen::VectorXd gains = options.start;
      for (double& g : gains) g *= std::exp(share(random));
      const auto places = state.range(0) == from_nothing_at_all
                              ? candidates.anew(gains)
                              : candidates.at(gains, state.range(0) == slopes);
      benchmark::DoNotOptimize(places.data());
    }
  });
  state.counters["places"] = double(candidates.places().size());
  state.counters["per_place"] = benchmark::Counter(
      double(candidates.places().size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void tune_three_conditions(benchmark::State& state) { candidate(state, "tune_paper.toml"); }
void tune_corridor(benchmark::State& state) { candidate(state, "tune_corridor.toml"); }

BENCHMARK(tune_three_conditions)->ArgName("way")->DenseRange(values, from_nothing_at_all);
BENCHMARK(tune_corridor)->ArgName("way")->DenseRange(values, slopes);

}  // namespace
