// Eigenvalues of many 6 x 6 matrices: the SIMD kernel with balancing, scaling and checks, compared
// on the same matrices, in alternation, with Eigen::EigenSolver and (if LAPACK is installed) dgeev,
// eigenvalues only and, for Eigen, without balancing. The ratios are medians over the alternations,
// in CPU time of this thread.
#include <benchmark/benchmark.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <ctime>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "linearize/batch.hpp"
#include "linearize/linearize.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

#ifdef TILTRIM_BENCH_LAPACK
extern "C" void dgeev_(const char* left, const char* right, const int* n, double* A, const int* lda,
                       double* re, double* im, double* VL, const int* ldvl, double* VR,
                       const int* ldvr, double* work, const int* lwork, int* info);
#endif

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr Index n = 6, count = 5000;
constexpr std::size_t sample = 500;  // matrices, for the slower methods
constexpr double degree = std::numbers::pi / 180;

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

std::vector<MatrixXd> gaussian() {
  std::mt19937_64 random(1);
  std::normal_distribution normal;
  std::vector<MatrixXd> all;
  for (Index k = 0; k < count; ++k)
    all.push_back(MatrixXd::NullaryExpr(n, n, [&] { return normal(random); }));
  return all;
}

// The closed loop trimmed at three conditions, every entry perturbed by up to 40 %.
std::vector<MatrixXd> closed_loops() {
  std::vector<MatrixXd> trimmed;
  for (const Command& command : {Command{2.0, 90 * degree, 90 * degree},
                                 {6.0, 45 * degree, 45 * degree},
                                 {15.0, 0.0, 0.0}}) {
    const TrimProblem p = closed_loop_problem(reference_vehicle(), command);
    const TrimResult result = trim(p.model, p.spec, p.guess, {.starts = 0});
    if (!result) throw std::runtime_error(result.message);
    trimmed.push_back(linearize(p.model, result.point).A);
  }
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> share(0.6, 1.4);
  std::vector<MatrixXd> all;
  for (Index k = 0; k < count; ++k)
    all.push_back(
        trimmed[std::size_t(k) % 3].unaryExpr([&](double a) { return a * share(random); }));
  return all;
}

double seconds_of_eigen(const std::vector<MatrixXd>& matrices) {
  Eigen::EigenSolver<MatrixXd> solver(n);
  const double begin = cpu_seconds();
  for (std::size_t k = 0; k < sample; ++k) {
    solver.compute(matrices[k], false);
    benchmark::DoNotOptimize(solver.eigenvalues().data());
  }
  return (cpu_seconds() - begin) / double(sample);
}

#ifdef TILTRIM_BENCH_LAPACK
double seconds_of_dgeev(const std::vector<MatrixXd>& matrices) {
  constexpr int size = int(n), room = 64 * int(n), one = 1;
  std::array<double, n> re{}, im{};
  std::array<double, room> work{};
  MatrixXd A(n, n);
  int info = 0;
  const double begin = cpu_seconds();
  for (std::size_t k = 0; k < sample; ++k) {
    A = matrices[k];
    dgeev_("N", "N", &size, A.data(), &size, re.data(), im.data(), nullptr, &one, nullptr, &one,
           work.data(), &room, &info);
    benchmark::DoNotOptimize(re.data());
  }
  return (cpu_seconds() - begin) / double(sample);
}
#endif

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

void batch_eigenvalues(benchmark::State& state, const std::vector<MatrixXd>& matrices) {
  MatrixBatch batch(n, count);
  for (Index k = 0; k < count; ++k) batch.set(k, matrices[std::size_t(k)]);
  BatchEigenvalues answer;
  eigenvalues(batch, answer);
  std::vector<double> own, eigen, dgeev;
  for (auto _ : state) {
    const double begin = cpu_seconds();
    eigenvalues(batch, answer);
    const double whole = cpu_seconds() - begin;
    state.SetIterationTime(whole);
    own.push_back(whole / double(count));
    eigen.push_back(seconds_of_eigen(matrices) / own.back());
#ifdef TILTRIM_BENCH_LAPACK
    dgeev.push_back(seconds_of_dgeev(matrices) / own.back());
#endif
  }
  state.SetLabel(instruction_set());
  state.counters["ns_per_matrix"] = 1e9 * median(own);
  state.counters["matrices/s"] = 1 / median(own);
  state.counters["of_EigenSolver"] = median(eigen);
  if (!dgeev.empty()) state.counters["of_dgeev"] = median(dgeev);
  state.counters["fallbacks"] =
      double(std::ranges::count(answer.status, LaneStatus::fallback)) / double(count);
}

void batch_closed_loops(benchmark::State& state) { batch_eigenvalues(state, closed_loops()); }
void batch_gaussian(benchmark::State& state) { batch_eigenvalues(state, gaussian()); }

BENCHMARK(batch_closed_loops)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(batch_gaussian)->UseManualTime()->Unit(benchmark::kMicrosecond);

}  // namespace
