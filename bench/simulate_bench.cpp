// Cost of a flight: the whole transition of 90 s, and the same flight by SciPy's solve_ivp (RK45,
// the same tolerance) in the same run, if Python has SciPy.
#include <benchmark/benchmark.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "flight/fly.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;

namespace {

// "transition" of data/reference_flights.json, with the gains that bench/flight_scipy.py uses.
Flight reference_flight() {
  Flight flight{reference_vehicle()};
  std::ifstream in(data_directory() / "reference_flights.json");
  const nlohmann::json all = nlohmann::json::parse(in);
  const Signals gains = gain_signals();
  for (const nlohmann::json& one : all["flights"]) {
    if (one["name"] != "transition") continue;
    for (std::size_t j = 0; j < gains.size(); ++j)
      gain_value(flight.vehicle.gains, j) = one["gains"][gains[j].name.substr(6)];
  }
  return flight;
}

// SciPy's time in seconds; 0 if SciPy is missing.
double scipy_seconds() {
  const std::string script = (data_directory().parent_path() / "bench/flight_scipy.py").string();
  const std::string command = "/usr/bin/python3 '" + script + "' --time 2>/dev/null";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"),
                                                             &::pclose);
  std::array<char, 4096> line{};
  if (!pipe || !std::fgets(line.data(), int(line.size()), pipe.get())) return 0.0;
  const nlohmann::json answer = nlohmann::json::parse(line.data(), nullptr, false);
  return answer.is_discarded() ? 0.0 : answer.value("seconds", 0.0);
}

void simulate_transition(benchmark::State& state) {
  const Flight flight = reference_flight();
  FlyOptions options;
  options.integrate.tolerance = state.range(0) == 9 ? 1e-9 : 1e-6;
  options.integrate.sample = 0.5;
  double evaluations = 0;
  const auto begun = std::chrono::steady_clock::now();
  for (auto _ : state) {
    const FlightResult flown = fly(flight, at_rest(), options);
    evaluations = double(flown.evaluations);
    benchmark::DoNotOptimize(flown.t.data());
  }
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun;
  const double each = spent.count() / double(state.iterations());
  state.counters["flights_per_s"] = 1 / each;
  state.counters["evaluations"] = evaluations;
  if (state.range(0) != 9) return;
  static const double scipy = scipy_seconds();
  if (scipy > 0) state.counters["scipy_over_ours"] = scipy / each;
}

BENCHMARK(simulate_transition)->ArgName("digits")->Arg(9)->Arg(6);

}  // namespace
