/// @file
/// Sweeps: trim, linearize and modes at every point of a grid, and what lies between the points.
#pragma once

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "sweep/map.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// What is swept: a trim problem, and axes whose columns name variables that the trim does not
/// move.
struct SweepRequest {
  std::string name;                 ///< of the condition
  Model model;                      ///< of the same signals for all conditions
  TrimSpec spec;                    ///< of each point
  OperatingPoint guess;             ///< and its numbers but for the axes'
  std::vector<std::string> inputs;  ///< to be kept beside the state: inputs or outputs of the model
  /// The point's trim from nothing, at these numbers; empty: trim() from the guess's unknowns.
  std::function<TrimResult(const OperatingPoint& at, const TrimOptions& options)> cold{};
};

/// How far a sweep is.
struct SweepProgress {
  const char* what = "points";      ///< "points", then "lines" between which crossings lie
  std::size_t done = 0, total = 0;  ///< of them
  std::size_t stable = 0, unstable = 0, undecided = 0, no_trim = 0;  ///< points so far
};

/// How sweep() goes about it.
struct SweepOptions {
  int threads = 0;        ///< 0: as many as the machine has
  bool crossings = true;  ///< look between the grid's points
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< from nothing
  std::filesystem::path log{};  ///< where it can be taken up again; empty: nowhere
  double checkpoint = 1.0;      ///< s between writes to the log
  std::string identity{};       ///< of the work, for the log: study, program
  std::stop_token stop{};       ///< asked between points
  std::function<void(const SweepProgress&)> observe{};  ///< from one thread at a time
};

/// The sweep was stopped; what is done is in the log.
struct SweepInterrupted : std::runtime_error {
  /// With what() and where.
  explicit SweepInterrupted(const char* what, bool elsewhere = false)
      : std::runtime_error(what), failed_elsewhere(elsewhere) {}
  bool failed_elsewhere;  ///< another rank of the run failed, and has said so
};

/// Whether this process is the one that writes: always, but for the other ranks of an MPI run.
[[nodiscard]] bool first_of_ranks();

/// The map of all conditions, which share axes, states and inputs. Each point is trimmed by Newton
/// from its neighbour with exact derivatives, from nothing where that fails, verified, linearized;
/// eigenvalues come in batches (linearize/batch.hpp), verdicts with bounds, names along the grid
///. Every line is walked from both ends: where they meet different equilibria
/// the one of less effort is the point's and the other its second branch. The same bits for any
/// number of threads, taken up again or not. Throws std::invalid_argument for names the model does
/// not have, std::runtime_error "path: why" for a log that cannot be used, SweepInterrupted.
[[nodiscard]] SweepMap sweep(const std::vector<SweepRequest>& conditions,
                             const std::vector<SweepAxis>& axes, const SweepOptions& options = {});

}  // namespace tiltrim
