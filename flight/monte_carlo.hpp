/// Monte Carlo simulation of a flight with scattered parameters.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "flight/flight.hpp"
#include "flight/fly.hpp"
#include "runtime/proportion.hpp"

namespace tiltrim {

/// [montecarlo]: the flight of [simulate], repeated with scattered parameters.
struct MonteCarloTable {
  long flights = 1000;             ///< number of flights
  std::uint64_t seed = 1;          ///< of all random numbers
  std::vector<Uncertain> scatter;  ///< uniform, SI; "aircraft.mass", "gains.K_Lp" (the same at all
                                   ///< tilts), "theta", "height", "gust_size" (of every gust)
  int worst = 10;                  ///< number of worst flights to keep
  /// A flight is good if its final |V - Vd| and |gamma - gamma_d| and its largest |theta| are at
  /// most
  double V_within = 0.2;       ///< m/s
  double gamma_within = 0.01;  ///< rad
  double theta_within = 1.3;   ///< rad
};

/// Outcome of one flight.
struct Outcome {
  long number = 0;                            ///< from 0 on
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  bool good = false;                          ///< within the tolerances of [montecarlo]
  double t = 0.0, height = 0.0;               ///< at the end, s, m
  double V_off = 0.0, gamma_off = 0.0;        ///< deviation from the final command, m/s, rad
  double theta_most = 0.0;                    ///< largest |theta| over the samples, rad
  /// The largest ratio of a deviation to its tolerance; for a flight that ends early, larger than
  /// any of these, and the larger the earlier it ends.
  double miss = 0.0;
};

/// Result of monte_carlo().
struct MonteCarlo {
  long asked = 0, flown = 0;                 ///< numbers of flights
  long good = 0;                             ///< of the flights flown
  std::array<long, flight_statuses> ends{};  ///< count by FlightStatus
  Proportion share;                          ///< of good flights, with its confidence interval
  std::vector<std::string> names;            ///< of the scattered parameters, as in the study
  /// One of the worst flights.
  struct Kept {
    Outcome outcome;              ///< how it ended
    std::vector<double> numbers;  ///< in the study's units
  };
  std::vector<Kept> worst;   ///< by decreasing miss
  std::string message;       ///< why no flight was possible: no trim to start from; else empty
  bool interrupted = false;  ///< fewer flights than requested
};

/// Options of monte_carlo().
struct MonteCarloOptions {
  int threads = 0;              ///< 0: one per processor; the result does not depend on it
  std::filesystem::path log{};  ///< to resume an interrupted run; empty: none
  double checkpoint = 1.0;      ///< s between writes to it
  std::string identity{};       ///< of the work: study, program
  std::stop_token stop{};       ///< checked between flights
  std::function<void(const MonteCarlo& so_far)> observe{};  ///< called by one thread at a time
};

/// The flights of a Monte Carlo simulation.
struct ScatteredFlights {
  FlightPlan nominal;              ///< without scatter
  std::vector<GustTable> gusts{};  ///< each with a different seed in each flight
  MonteCarloTable table{};         ///< what is scattered, and how often
};

/// Flight i depends only on `flights` and i: its scattered parameters are uniform, its turbulence
/// has a seed of its own. All flights start from the nominal initial state. The log is kept: the
/// caller removes it once the result is saved. Throws std::runtime_error "path: why" for a log that
/// cannot be used.
[[nodiscard]] MonteCarlo monte_carlo(const ScatteredFlights& flights,
                                     const MonteCarloOptions& options = {});

/// Flight `number` for inspection. Throws std::invalid_argument if there is no such flight.
[[nodiscard]] FlightPlan flight_plan_of(const ScatteredFlights& flights, long number);

}  // namespace tiltrim
