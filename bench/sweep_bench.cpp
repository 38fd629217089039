// Cost of a map point before it is written.
#include <benchmark/benchmark.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>

#include "linearize/batch.hpp"
#include "model/formulas.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"
#include "sweep/verdict_map.hpp"

using namespace tiltrim;

namespace {

Study study_of(const std::string& condition, const std::string& axes) {
  return parse_study("[[condition]]\nname = \"c\"\n" + condition + axes, "bench.toml");
}

std::string axis(const std::string& key, double from, double to, int count,
                 const std::string& spacing) {
  return "[[sweep.axis]]\nkey = \"" + key + "\"\nfrom = " + std::to_string(from) +
         "\nto = " + std::to_string(to) + "\ncount = " + std::to_string(count) + "\nspacing = \"" +
         spacing + "\"\n";
}

const std::string airplane = "V = 8.0\ngamma_deg = 30.0\neta_deg = 30.0\n";
const std::string level = "V = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";

Study two_gains() {
  return study_of(airplane, axis("gains.K_Lp", 0.02, 10, 1000, "log") +
                                axis("gains.k_de", 0.05, 20, 1000, "log"));
}

// Height varies fastest: no two neighbours have the same equilibrium.
Study gain_over_corridor() {
  return study_of(level,
                  axis("gains.K_Lp", 0.05, 5, 101, "log") + axis("h", 0, 120, 961, "linear"));
}

// Keeps a map's memory (200 MB) in the process between runs: the time the system needs for fresh
// pages, a second on some virtual machines, is not part of the cost of a point.
void keep_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

std::size_t run(const Study& study, int threads, bool lanes = true, bool crossings = false) {
  SweepOptions options;
  options.threads = threads;
  options.crossings = crossings;
  auto requests = sweep_requests(study, study.conditions, study.sweep->axes);
  for (SweepRequest& r : requests)
    if (!lanes) r.model.lanes = nullptr;
  const SweepMap map = sweep(requests, study.sweep->axes, options);
  benchmark::DoNotOptimize(map.spectral_abscissa.data());
  return map.points();
}

void count_points(benchmark::State& state, std::size_t points) {
  state.counters["points"] = double(points);
  state.counters["points_per_s"] =
      benchmark::Counter(double(points), benchmark::Counter::kIsIterationInvariantRate);
}

void sweep_two_gains_fixed_trim(benchmark::State& state) {
  const Study study = two_gains();
  std::size_t points = 0;
  for (auto _ : state) points = run(study, 1);
  count_points(state, points);
}

// Verdicts alone with borders, file written, as the program does: points over CPU time, and how
// many times less a point takes than in the detailed map of the same grid, in alternation.
void verdicts_two_gains_written(benchmark::State& state) {
  const auto cpu = [] { return double(std::clock()) / CLOCKS_PER_SEC; };
  keep_memory();
  const Study small = two_gains();
  const Study large = study_of(airplane, axis("gains.K_Lp", 0.02, 10, 4000, "log") +
                                             axis("gains.k_de", 0.05, 20, 4000, "log"));
  const auto requests = sweep_requests(large, large.conditions, large.sweep->axes);
  const auto file = std::filesystem::temp_directory_path() / "tiltrim_verdicts_bench.nc";
  double detailed = 0, alone = 0, points = 0;
  for (auto _ : state) {
    const double begin = cpu();
    const double of_detailed = double(run(small, 1));
    const double middle = cpu();
    const VerdictMap map = sweep_verdicts(requests, large.sweep->axes, {.threads = 1});
    write_netcdf(map, file);
    const double end = cpu();
    points = double(map.grid.points());
    detailed += (middle - begin) / of_detailed;
    alone += (end - middle) / points;
  }
  std::filesystem::remove(file);
  state.counters["points_per_s"] = double(state.iterations()) / alone;
  state.counters["detailed_over_verdict"] = detailed / alone;
}

void sweep_trimmed_at_every_point(benchmark::State& state) {
  const Study study = gain_over_corridor();
  std::size_t points = 0;
  for (auto _ : state) points = run(study, 1);
  count_points(state, points);
}

void verdicts_trimmed_at_every_point(benchmark::State& state) {
  const Study study = gain_over_corridor();
  const auto requests = sweep_requests(study, study.conditions, study.sweep->axes);
  std::size_t points = 0;
  for (auto _ : state) {
    const VerdictMap map =
        sweep_verdicts(requests, study.sweep->axes, {.threads = 1, .crossings = false});
    benchmark::DoNotOptimize(map.runs.data());
    points = map.grid.points();
  }
  count_points(state, points);
}

// CPU time of the lines alone over that of eight side by side, the least of each in alternation.
void sweep_lines_alone_over_side_by_side(benchmark::State& state) {
  keep_memory();
  const Study study = gain_over_corridor();
  const auto seconds = [&](bool lanes) {
    const std::clock_t begun = std::clock();
    (void)run(study, 1, lanes);
    return double(std::clock() - begun) / CLOCKS_PER_SEC;
  };
  (void)seconds(false);
  double alone = std::numeric_limits<double>::infinity(), together = alone;
  for (auto _ : state) {
    alone = std::min(alone, seconds(false));
    together = std::min(together, seconds(true));
  }
  state.counters["ratio"] = alone / together;
  state.SetLabel(instruction_set());
}

// CPU time of the search between the points, over that of trimming and judging the points; of lines
// alone and of eight side by side.
void crossings_over_points(benchmark::State& state) {
  keep_memory();
  const Study study =
      study_of(level, axis("gains.K_Lp", 0.05, 5, 41, "log") + axis("h", 0, 120, 241, "linear"));
  const bool lanes = state.range(0) != 0;
  const auto seconds = [&](bool crossings) {
    const std::clock_t begun = std::clock();
    (void)run(study, 1, lanes, crossings);
    return double(std::clock() - begun) / CLOCKS_PER_SEC;
  };
  double points = std::numeric_limits<double>::infinity(), both = points;
  for (auto _ : state) {
    points = std::min(points, seconds(false));
    both = std::min(both, seconds(true));
  }
  constexpr double steps = 41 * 240;
  state.counters["ratio"] = (both - points) / points;
  state.counters["per_step"] = (both - points) / steps;
}

// Too slow to fly: every point is shown to have no equilibrium.
void sweep_below_stall(benchmark::State& state) {
  const Study study =
      study_of(level, axis("V", 5, 6.5, 40, "linear") + axis("gamma_deg", -3, 3, 40, "linear"));
  std::size_t points = 0;
  for (auto _ : state) points = run(study, 1);
  count_points(state, points);
}

// A plane of formulas, too slow to fly: CPU time without the formulas' ranges, where each point is
// searched, over that with them, where each is proved to have no trim.
void formulas_searched_over_proved(benchmark::State& state) {
  keep_memory();
  Model plane =
      model_of({.name = "plane",
                .states = {{"V", "m/s", 10.0}, {"gamma", "rad", 0.1}},
                .inputs = {{"T", "m/s²", 1.0}, {"CL", "", 0.1}},
                .outputs = {},
                .parameters = {{"k", "1/m", 0.01}},
                .rates = {"T - 0.02*V^2 - 9.81*sin(gamma)", "(k*V^2*CL - 9.81*cos(gamma))/V"}});
  const TrimSpec steady{
      .free = {"T", "CL"}, .steady = {"V", "gamma"}, .bounds = {{"T", {0, 12}}, {"CL", {-1, 1.4}}}};
  const OperatingPoint guess{Eigen::Vector2d(10, 0), Eigen::Vector2d(1, 1),
                             Eigen::VectorXd::Constant(1, 0.03)};
  std::vector<double> values;
  for (int i = 0; i < 20; ++i) values.push_back(0.02 + 0.001 * i);
  const auto seconds = [&](const Model& model) {
    const std::clock_t begun = std::clock();
    const SweepMap map = sweep({{"slow", model, steady, guess, {}}},
                               {{"k", {{"k", "", "k", values, values}}}}, {.threads = 1});
    if (map.status.size() != values.size()) throw std::runtime_error("20 points were asked for");
    return double(std::clock() - begun) / CLOCKS_PER_SEC;
  };
  Model without = plane;
  without.enclosure = {};
  double searched = std::numeric_limits<double>::infinity(), proved = searched;
  for (auto _ : state) {
    searched = std::min(searched, seconds(without));
    proved = std::min(proved, seconds(plane));
  }
  state.counters["ratio"] = searched / proved;
}

// Wall time of one thread over that of two, in alternation.
void two_cores_over_one(benchmark::State& state, const Study& study) {
  using clock = std::chrono::steady_clock;
  keep_memory();
  (void)run(study, 2);
  double one = 0, two = 0;
  for (auto _ : state) {
    const auto begun = clock::now();
    (void)run(study, 1);
    const auto between = clock::now();
    (void)run(study, 2);
    one += std::chrono::duration<double>(between - begun).count();
    two += std::chrono::duration<double>(clock::now() - between).count();
  }
  state.counters["speedup"] = one / two;
}

void sweep_two_cores_over_one(benchmark::State& state) { two_cores_over_one(state, two_gains()); }

void sweep_trimmed_two_cores_over_one(benchmark::State& state) {
  two_cores_over_one(state, gain_over_corridor());
}

BENCHMARK(sweep_two_gains_fixed_trim)->Unit(benchmark::kMillisecond)->MinTime(2.0);
BENCHMARK(verdicts_two_gains_written)->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_trimmed_at_every_point)->Unit(benchmark::kMillisecond)->MinTime(2.0);
BENCHMARK(verdicts_trimmed_at_every_point)->Unit(benchmark::kMillisecond)->MinTime(2.0);
BENCHMARK(sweep_lines_alone_over_side_by_side)->Unit(benchmark::kMillisecond)->MinTime(2.0);
BENCHMARK(crossings_over_points)->ArgName("lanes")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_below_stall)->Unit(benchmark::kMillisecond);
BENCHMARK(formulas_searched_over_proved)->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_two_cores_over_one)->Unit(benchmark::kMillisecond)->MinTime(2.0);
BENCHMARK(sweep_trimmed_two_cores_over_one)->Unit(benchmark::kMillisecond)->MinTime(2.0);

}  // namespace
