// Stability without eigenvalues: verdicts, maps over two gains, crossings along a line; each also
// as a multiple of the time of Eigen's EigenSolver for the same matrices in the same run.
#include <benchmark/benchmark.h>

#include <Eigen/Eigenvalues>
#include <chrono>
#include <stdexcept>

#include "linearize/batch.hpp"
#include "linearize/linearize.hpp"
#include "model/lookup.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

// The closed loop of the helicopter in climb, over pitch and pitch-rate gain.
AffineFamily cyclic_family() {
  const auto loop = [](double k_pa, double k_da) {
    Vehicle vehicle = reference_vehicle();
    vehicle.gains.k_da = k_da;
    TrimProblem problem =
        closed_loop_problem(vehicle, {2.0, 1.5707963267948966, 1.5707963267948966});
    const TrimResult result = trim(problem.model, problem.spec, problem.guess, {.starts = 0});
    if (!result) throw std::runtime_error(result.message);
    // a1s is constant: K_Li x2/(1 + K_Lp) + k_pa θ
    OperatingPoint at = result.point;
    const double step = k_pa - vehicle.gains.k_pa;
    at.x[5] -= step * at.x[2] * (1 + vehicle.gains.K_Lp) / vehicle.gains.K_Li;
    set_value(at, variable(problem.model, "gains.k_pa"), k_pa);
    const LinearModel linear = linearize(problem.model, at);
    if (!linear) throw std::runtime_error(linear.message);
    return linear.A;
  };
  const MatrixXd A0 = loop(0, 0);
  const auto slope = [&](double k_pa, double k_da) {
    const MatrixXd steep = loop(k_pa, k_da) - A0;
    const double noise = 1e-12 * A0.norm();
    return MatrixXd((steep.array().abs() > noise).select(steep, 0.0) / (k_pa + k_da));
  };
  return {A0, slope(8, 0), slope(0, 8)};
}

std::vector<double> grid(double from, double to, int count) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back(from + (to - from) * k / (count - 1));
  return values;
}

constexpr int side = 300;

MatrixXd at(const AffineFamily& family, double a, double b) {
  return family.A0 + a * family.A1 + b * family.A2;
}

// Seconds per EigenSolver, eigenvalues only: the minimum over several rounds.
double eigen_seconds(const std::vector<MatrixXd>& matrices) {
  using Clock = std::chrono::steady_clock;
  Eigen::EigenSolver<MatrixXd> solver(matrices.front().rows());
  double least = 1e300;
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    const auto start = Clock::now();
    for (const MatrixXd& A : matrices)
      benchmark::DoNotOptimize(solver.compute(A, false).eigenvalues().data());
    least = std::min(least, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return least / double(matrices.size());
}

// Counters: seconds per item, and items per EigenSolver time.
void count(benchmark::State& state, double each_iteration, double eigen) {
  using benchmark::Counter;
  state.counters["each"] =
      Counter(each_iteration, Counter::kIsIterationInvariantRate | Counter::kInvert);
  state.counters["in_one_Eigen"] =
      Counter(each_iteration * eigen, Counter::kIsIterationInvariantRate);
  state.SetLabel(instruction_set());
}

std::vector<MatrixXd> closed_loops(Index n) {
  const AffineFamily family = cyclic_family();
  std::vector<MatrixXd> all;
  for (const double a : grid(0, 15, 40))
    for (const double b : grid(0, 2, 25)) all.push_back(at(family, a, b).topLeftCorner(n, n));
  return all;
}

void verdicts_of_matrices(benchmark::State& state) {
  const std::vector<MatrixXd> matrices = closed_loops(state.range(0));
  MatrixBatch batch(state.range(0), std::ssize(matrices));
  for (Index k = 0; k < batch.count; ++k) batch.set(k, matrices[std::size_t(k)]);
  std::vector<Verdict> answer;
  for (auto _ : state) {
    verdicts(batch, answer);
    benchmark::DoNotOptimize(answer.data());
  }
  count(state, double(batch.count), eigen_seconds(matrices));
}

void stability_map_of_gains(benchmark::State& state) {
  const AffineFamily family = cyclic_family();
  const auto a = grid(0, 15, side), b = grid(0, 2, side);
  std::vector<Verdict> answer(a.size() * b.size());
  for (auto _ : state) {
    stability_map(family, a, b, answer);
    benchmark::DoNotOptimize(answer.data());
  }
  count(state, double(answer.size()), eigen_seconds(closed_loops(6)));
}

void crossings_of_line(benchmark::State& state) {
  const AffineFamily family = cyclic_family();
  std::size_t found = 0;
  for (auto _ : state) found = line_crossings(family.A0, family.A1, 0, 15).crossings.size();
  count(state, 1, eigen_seconds(closed_loops(6)));
  state.counters["crossings"] = double(found);
}

BENCHMARK(verdicts_of_matrices)->Arg(4)->Arg(6)->ArgName("states");
BENCHMARK(stability_map_of_gains)->Unit(benchmark::kMicrosecond);
BENCHMARK(crossings_of_line)->Unit(benchmark::kMicrosecond);

}  // namespace
