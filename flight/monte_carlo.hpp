/// @file
/// A flight again and again with scattered numbers.
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

/// [montecarlo]: the flight of [simulate] again and again.
struct MonteCarloTable {
  long flights = 1000;             ///< how many
  std::uint64_t seed = 1;          ///< of all that is random
  std::vector<Uncertain> scatter;  ///< uniform, SI; "aircraft.mass", "gains.K_Lp" (the same at all
                                   ///< tilts), "theta", "height", "gust_size" (of every gust)
  int worst = 10;                  ///< flights kept and named
  /// A flight is good if at its end |V - Vd| and |gamma - gamma_d| are at most these,
  double V_within = 0.2;       ///< m/s
  double gamma_within = 0.01;  ///< rad
  double theta_within = 1.3;   ///< rad: |theta| on all the way
};

/// How one of the flights went.
struct Outcome {
  long number = 0;                            ///< from 0 on
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  bool good = false;                          ///< within all that [montecarlo] allows
  double t = 0.0, height = 0.0;               ///< at the end, s, m
  double V_off = 0.0, gamma_off = 0.0;        ///< of the command there, m/s, rad
  double theta_most = 0.0;                    ///< largest |theta| of the samples, rad
  /// What it misses by: the largest of its figures over what is allowed; for a flight that ends
  /// early above all of these, the earlier the more.
  double miss = 0.0;
};

/// What monte_carlo() answers.
struct MonteCarlo {
  long asked = 0, flown = 0;                 ///< flights
  long good = 0;                             ///< of those flown
  std::array<long, flight_statuses> ends{};  ///< [FlightStatus]
  Proportion share;                          ///< of good ones
  std::vector<std::string> names;            ///< of the scattered numbers, in the study's words
  /// One of the worst.
  struct Kept {
    Outcome outcome;              ///< how it went
    std::vector<double> numbers;  ///< in the study's units
  };
  std::vector<Kept> worst;   ///< by falling miss
  std::string message;       ///< why none was flown: no trim to start from; else empty
  bool interrupted = false;  ///< fewer were flown than asked
};

/// How monte_carlo() goes about it.
struct MonteCarloOptions {
  int threads = 0;              ///< 0: as many as the machine has; the answer is the same for any
  std::filesystem::path log{};  ///< from which a killed run goes on; empty: nowhere
  double checkpoint = 1.0;      ///< s between writes to it
  std::string identity{};       ///< of the work: study, program
  std::stop_token stop{};       ///< asked between flights
  std::function<void(const MonteCarlo& so_far)> observe{};  ///< from one thread at a time
};

/// What is flown again and again.
struct ScatteredFlights {
  FlightPlan nominal;              ///< without scatter
  std::vector<GustTable> gusts{};  ///< its own, each with another seed in each flight
  MonteCarloTable table{};         ///< what is scattered, how often
};

/// Flight i depends on these and i alone: its scattered numbers are uniform, its turbulence has a
/// seed of its own. All begin as the nominal one does. The log stays: who has the answer safe
/// removes it. Throws std::runtime_error "path: why" for a log that cannot be used.
[[nodiscard]] MonteCarlo monte_carlo(const ScatteredFlights& flights,
                                     const MonteCarloOptions& options = {});

/// Flight `number` of it, to be looked at. Throws std::invalid_argument if there is none.
[[nodiscard]] FlightPlan flight_plan_of(const ScatteredFlights& flights, long number);

}  // namespace tiltrim
