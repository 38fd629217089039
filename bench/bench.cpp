// Cost of one condition: evaluation, derivatives, trim, linearization and modes of the closed loop,
// each also as a fraction of one cold Ipopt trim in the same run. Absolute times depend on the
// machine; the ratios carry over.
#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <Eigen/LU>
#include <array>
#include <map>
#include <numbers>
#include <stdexcept>

#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "study/analyses.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "trim/problem.hpp"
#include "trim/repeated.hpp"
#include "vehicles/tiltrotor/closed_loop.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/xv15/xv15.hpp"

using namespace tiltrim;

namespace {

constexpr double degree = std::numbers::pi / 180;
// Helicopter, half way, airplane: cyclic and elevator active, every angle nonzero except in the
// last.
constexpr std::array<Command, 3> commands{
    {{2.0, 90 * degree, 90 * degree}, {6.0, 45 * degree, 45 * degree}, {15.0, 0.0, 0.0}}};

struct Case {
  TrimProblem problem;
  OperatingPoint trimmed;
};

Case prepared(const benchmark::State& state) {
  TrimProblem problem =
      closed_loop_problem(reference_vehicle(), commands.at(std::size_t(state.range(0))));
  const TrimResult result = trim(problem.model, problem.spec, problem.guess);
  if (!result) throw std::runtime_error(result.message);
  return {std::move(problem), result.point};
}

// Perturbs the state by a few ulps, so that no evaluation can be reused.
void disturb(Eigen::VectorXd& x) {
  x[0] += 1e-13;
  x[1] += 1e-14;
}

void evaluation_concrete(benchmark::State& state) {
  Case c = prepared(state);
  const physics::WindLoop<> loop{reference_vehicle().polar, Equations::consistent};
  Eigen::VectorXd rates(6);
  for (auto _ : state) {
    disturb(c.trimmed.x);
    loop(c.trimmed.x.data(), c.trimmed.u.data(), c.trimmed.p.data(), rates.data(),
         static_cast<double*>(nullptr));
    benchmark::DoNotOptimize(rates.data());
  }
}

void evaluation_through_model(benchmark::State& state) {
  Case c = prepared(state);
  for (auto _ : state) {
    disturb(c.trimmed.x);
    benchmark::DoNotOptimize(c.problem.model.f(c.trimmed.x, c.trimmed.u, c.trimmed.p));
  }
}

void jacobian_exact(benchmark::State& state) {
  Case c = prepared(state);
  const std::vector<Eigen::Index> states{0, 1, 2, 3, 4, 5};
  for (auto _ : state) {
    disturb(c.trimmed.x);
    benchmark::DoNotOptimize(c.problem.model.derivatives(c.trimmed, states));
  }
}

void jacobian_differences_with_errors(benchmark::State& state) {
  Case c = prepared(state);
  const std::vector<Eigen::Index> states{0, 1, 2, 3, 4, 5};
  for (auto _ : state) benchmark::DoNotOptimize(difference(c.problem.model, c.trimmed, states));
}

void modes_with_bounds(benchmark::State& state) {
  Case c = prepared(state);
  const LinearModel linear = linearize(c.problem.model, c.trimmed);
  for (auto _ : state) benchmark::DoNotOptimize(modes(linear));
}

// A single solve from the first guess, polished and verified: no further starts.
void trim_ipopt_cold(benchmark::State& state) {
  const Case c = prepared(state);
  const TrimOptions options{.starts = 0};
  for (auto _ : state)
    benchmark::DoNotOptimize(trim(c.problem.model, c.problem.spec, c.problem.guess, options));
}

void trim_newton_cold(benchmark::State& state) {
  const Case c = prepared(state);
  const TrimOptions options{.method = TrimMethod::newton, .starts = 0};
  for (auto _ : state)
    benchmark::DoNotOptimize(trim(c.problem.model, c.problem.spec, c.problem.guess, options));
}

// The same from its own answer: what the verification costs.
void trim_newton_warm(benchmark::State& state) {
  const Case c = prepared(state);
  const TrimOptions options{.method = TrimMethod::newton, .starts = 0};
  for (auto _ : state)
    benchmark::DoNotOptimize(trim(c.problem.model, c.problem.spec, c.trimmed, options));
}

// Both again from one RepeatedTrim, as in a loop over conditions.
void trim_repeated_cold(benchmark::State& state) {
  const Case c = prepared(state);
  const TrimOptions options{.method = TrimMethod::newton, .starts = 0};
  RepeatedTrim again(c.problem.model, c.problem.spec);
  for (auto _ : state) benchmark::DoNotOptimize(again(c.problem.guess, options));
}

void trim_repeated_warm(benchmark::State& state) {
  const Case c = prepared(state);
  const TrimOptions options{.method = TrimMethod::newton, .starts = 0};
  RepeatedTrim again(c.problem.model, c.problem.spec);
  for (auto _ : state) benchmark::DoNotOptimize(again(c.trimmed, options));
}

// As in the program: Ipopt, then 32 starts for other equilibria.
void trim_all_starts(benchmark::State& state) {
  const Case c = prepared(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(trim(c.problem.model, c.problem.spec, c.problem.guess));
}

// The wake as printed in the paper pushes the wing down too hard for a trim of the first two: the
// program's proof, closest point and what would have to change.
void no_trim_explained(benchmark::State& state) {
  Vehicle printed = reference_vehicle();
  printed.aircraft.pitch_scale = printed.aircraft.wake_immersion = 1.0;
  Condition condition;
  condition.name = "no trim";
  condition.asked = commands.at(std::size_t(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(answer(printed, condition, {}));
    benchmark::DoNotOptimize(explain(printed, condition, {}));
  }
}

// One Newton step from a neighbouring trim: residuals, exact Jacobian, three equations solved.
void newton_step(benchmark::State& state) {
  Case c = prepared(state);
  const Problem problem = make_problem(c.problem.model, c.problem.spec, c.trimmed);
  const Eigen::VectorXd neighbour = unknowns_of(problem, c.trimmed).array() + 1e-3;
  Eigen::VectorXd z = neighbour;
  for (auto _ : state) {
    z[0] += 1e-13;
    const Values v = values(problem, z);
    const Jacobians s = jacobians(problem, z);
    const Eigen::VectorXd next = z - s.residual.partialPivLu().solve(v.residual);
    benchmark::DoNotOptimize(next.data());
  }
}

// Complete problems of level flight on the wing; `points` is the number of trims in each.
Condition level_flight(double V) {
  Condition level;
  level.name = "level";
  level.asked = Command{V, 0.0, 0.0};
  return level;
}

// From 20 m/s through the stall to elevator saturation, with folds, limits and crossings.
void follow_level_branch(benchmark::State& state) {
  const TrimProblem p = closed_loop_problem(reference_vehicle(), {20.0, 0.0, 0.0});
  TrimSpec spec = p.spec;
  spec.bounds.erase("energy_integral");
  spec.bounds.erase("distribution_integral");
  const TrimResult start = trim(p.model, spec, p.guess, {.starts = 0});
  std::size_t points = 0;
  for (auto _ : state) {
    const Branch branch = follow(p.model, spec, start.point, "V", 5.0);
    if (branch.end != BranchEnd::limit) throw std::runtime_error(branch.message);
    points = branch.points.size() + branch.events.size();
  }
  state.counters["points"] = double(points);
}

// The conversion corridor: V over tilt, 100 x 100, boundary and rows.
void envelope_100_by_100(benchmark::State& state) {
  const Vehicle vehicle = reference_vehicle();
  const Condition level = level_flight(15.0);
  for (auto _ : state)
    if (envelope(vehicle, level, EnvelopeTable{}, {.threads = 1}).parts.size() != 2)
      throw std::runtime_error("an envelope over tilt has two parts");
  state.counters["points"] = 100.0 * 100.0;
}

void sensitivities_to_all_parameters(benchmark::State& state) {
  const Case c = prepared(state);
  for (auto _ : state)
    benchmark::DoNotOptimize(sensitivities(c.problem.model, c.problem.spec, c.trimmed));
}

// The XV-15 in level flight at 40, 60, 80 and 100 kt, blade elements at every evaluation.
TrimProblem xv15_problem(const benchmark::State& state) {
  const Study study = load_study(data_directory().parent_path() / "studies/xv15.toml");
  return problem_of(study.vehicle, study.conditions.at(std::size_t(state.range(0))));
}

void xv15_trim(benchmark::State& state, TrimMethod method) {
  const TrimProblem p = xv15_problem(state);
  for (auto _ : state) {
    const TrimResult r = trim(p.model, p.spec, p.guess, {.method = method, .starts = 0});
    if (!r) throw std::runtime_error(r.message);
  }
}
void xv15_trim_newton_cold(benchmark::State& state) { xv15_trim(state, TrimMethod::newton); }
void xv15_trim_ipopt_cold(benchmark::State& state) { xv15_trim(state, TrimMethod::ipopt); }

// The start of a trim by closed forms.
void xv15_start(benchmark::State& state) {
  const TrimProblem p = xv15_problem(state);
  const auto data = xv15::load(data_directory() / "xv15", xv15::Variant::report_1988);
  constexpr double knot = 0.514444;
  const double V = (40 + 20 * double(state.range(0))) * knot;
  for (auto _ : state) benchmark::DoNotOptimize(xv15::start_of(*data, p.guess, V, 0.0));
}

// Its conversion corridor, airspeed over mast angle, from few seeds: most of the time of a whole
// envelope goes to starts that look for further equilibria.
void xv15_envelope_12_by_12(benchmark::State& state) {
  constexpr int count = 12;
  const Study study = load_study(data_directory().parent_path() / "studies/xv15_corridor.toml");
  const EnvelopeTable table = envelope_table(study, {}, count);
  const EnvelopeOptions few{.coarse = 3, .starts = 4, .threads = 1};
  for (auto _ : state)
    if (envelope(study.vehicle, study.conditions.at(0), table, few).parts.size() != 1)
      throw std::runtime_error("an envelope of a user's model has one part");
  state.counters["points"] = count * count;
}

BENCHMARK(xv15_start)->DenseRange(0, 3)->ArgName("condition");
BENCHMARK(xv15_trim_newton_cold)->DenseRange(0, 3)->ArgName("condition");
BENCHMARK(xv15_trim_ipopt_cold)->DenseRange(0, 3)->ArgName("condition");
BENCHMARK(xv15_envelope_12_by_12)->Unit(benchmark::kMillisecond);
BENCHMARK(newton_step)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(follow_level_branch)->Unit(benchmark::kMillisecond);
BENCHMARK(envelope_100_by_100)->Unit(benchmark::kMillisecond);
BENCHMARK(sensitivities_to_all_parameters)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(evaluation_concrete)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(evaluation_through_model)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(jacobian_exact)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(jacobian_differences_with_errors)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(modes_with_bounds)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(trim_newton_cold)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(trim_newton_warm)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(trim_repeated_cold)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(trim_repeated_warm)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(trim_ipopt_cold)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(trim_all_starts)->DenseRange(0, 2)->ArgName("condition");
BENCHMARK(no_trim_explained)->DenseRange(0, 1)->ArgName("condition");

// The table on the console, and the medians it is based on.
class Ratios final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
      if (run.run_type == Run::RT_Aggregate ? run.aggregate_name == "median" : run.repetitions <= 1)
        note(run);
  }

  void note(const Run& run) {
    const double seconds =
        run.GetAdjustedCPUTime() / benchmark::GetTimeUnitMultiplier(run.time_unit);
    const auto points = run.counters.find("points");
    if (points == run.counters.end())
      seconds_[run.run_name.function_name][run.run_name.args] = seconds;
    else
      whole_[run.run_name.function_name] = {seconds, points->second};
  }

  void print() const {
    print_over("xv15_trim_ipopt_cold", "one cold Ipopt trim of the XV-15");
    const auto ipopt = seconds_.find("trim_ipopt_cold");
    if (ipopt == seconds_.end()) return;
    print_over("trim_ipopt_cold", "one cold Ipopt trim");
    fmt::print("\nCPU time of Ipopt, cold, at each point over that of the whole:\n");
    for (const auto& [name, whole] : whole_) {
      const auto own = name.starts_with("xv15_") ? seconds_.find("xv15_trim_ipopt_cold") : ipopt;
      if (own == seconds_.end()) continue;
      const double level = own->second.rbegin()->second;  // the airplane, or the fastest
      fmt::print("  {:34} {:10.4g}   ({:.0f} points, {:.4g} µs each)\n", name,
                 whole.points * level / whole.seconds, whole.points,
                 1e6 * whole.seconds / whole.points);
    }
  }

 private:
  // The XV-15's benchmarks over its own trim, the others over the closed loop's.
  void print_over(const std::string& base, const char* what) const {
    const auto ipopt = seconds_.find(base);
    if (ipopt == seconds_.end()) return;
    fmt::print("\nCPU time of {} over that of:\n", what);
    for (const auto& [name, by_condition] : seconds_) {
      if (name.starts_with("xv15_") != base.starts_with("xv15_")) continue;
      std::string ratios;  // empty for benchmarks without a condition
      for (const auto& [condition, time] : by_condition)
        if (const auto at = ipopt->second.find(condition); at != ipopt->second.end())
          ratios += fmt::format(" {:10.4g}", at->second / time);
      if (!ratios.empty()) fmt::print("  {:34}{}\n", name, ratios);
    }
  }

  struct Whole {
    double seconds, points;
  };
  std::map<std::string, Whole> whole_;

  std::map<std::string, std::map<std::string, double>> seconds_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  Ratios reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.print();
}
