/// @file
/// Sweeps: trim, linear model and modes at every point of a grid, and crossings between the points.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "sweep/map.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// A trim problem, and axes whose columns name variables that the trim does not solve for.
struct SweepRequest {
  std::string name;                 ///< of the condition
  Model model;                      ///< signals must be the same for all conditions
  TrimSpec spec;                    ///< of each point
  OperatingPoint guess;             ///< and all values that no axis sets
  std::vector<std::string> inputs;  ///< stored with the state: inputs or outputs of the model
  /// Trim without a starting point, at these parameters; empty: trim() from the guess.
  std::function<TrimResult(const OperatingPoint& at, const TrimOptions& options)> cold{};
};

/// Progress of a sweep.
struct SweepProgress {
  const char* what = "points";      ///< "points", then "lines" searched for crossings
  std::size_t done = 0, total = 0;  ///< number completed, number in all
  std::size_t stable = 0, unstable = 0, undecided = 0, no_trim = 0;  ///< points so far
};

/// Options of sweep().
struct SweepOptions {
  int threads = 0;        ///< 0: one per hardware thread
  bool crossings = true;  ///< search for crossings between grid points
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of full trims
  std::filesystem::path log{};  ///< file from which an interrupted sweep resumes; empty: no log
  double checkpoint = 1.0;      ///< s between writes to the log
  std::string identity{};       ///< identity of the work, for the log: study, program
  std::stop_token stop{};       ///< checked between points
  std::function<void(const SweepProgress&)> observe{};  ///< called by one thread at a time
};

/// The sweep was stopped; finished work is in the log, and here unless it was stopped before it
/// began.
struct SweepInterrupted : std::runtime_error {
  /// With a message; `elsewhere`: on another rank.
  explicit SweepInterrupted(const char* what, bool elsewhere = false)
      : std::runtime_error(what), failed_elsewhere(elsewhere) {}
  bool failed_elsewhere;  ///< another rank of the run failed, and has reported the error
  /// The map so far. Points that were not reached have status -1; those that were are the same as
  /// in the whole map. Crossings are missing where the search had not yet run.
  std::shared_ptr<const SweepMap> finished{};
};

/// The map of all conditions, which share axes, states and inputs. Each point is trimmed by Newton
/// from its neighbor with exact derivatives (a full trim if that fails), verified and linearized;
/// eigenvalues are computed in batches, verdicts with error bounds, and mode names are tracked
/// along the grid. Every line is tracked from both ends: where they find different equilibria the
/// one of lower cost is the point's, the other its second branch. Results are bitwise identical for
/// any number of threads, and after resuming. Throws std::invalid_argument for unknown names,
/// std::runtime_error "path: reason" for an unusable log, SweepInterrupted.
[[nodiscard]] SweepMap sweep(const std::vector<SweepRequest>& conditions,
                             const std::vector<SweepAxis>& axes, const SweepOptions& options = {});

}  // namespace tiltrim
