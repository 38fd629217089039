/// Sweeps and tuning, for user-defined problems and for studies.
#pragma once

#include "model/time_limit.hpp"
#include "python/src/calls.hpp"
#include "python/src/models.hpp"
#include "sweep/sweep.hpp"
#include "tune/tune.hpp"

namespace tiltrim::python {

/// The variables of a map's file: `fields`, {name: (dimensions, long_name, units, flags, fill,
/// scale, flat values)}; `axes`, the columns of each; study, program and instruction_set.
py::dict dict_of(const SweepMap& map);
/// threads, crossings, starts; `trimming` as trim's options.
SweepOptions sweep_options_of(const py::dict& fields, bool callables,
                              double time_limit = unlimited);
/// A map, or what there was of it when the sweep was stopped.
struct Swept {
  SweepMap map;
  bool interrupted = false;
};
Swept sweep_so_far(const std::vector<SweepRequest>& requests, const std::vector<SweepAxis>& axes,
                   const SweepOptions& options);
/// Passes on the progress, if anybody listens.
void observe(SweepOptions& options, Progress& progress);
void observe(TuneOptions& options, const TuneProblem& problem, Progress& progress);
/// The same for one state of the search.
void tell(Progress& progress, const TuneProblem& problem, const std::string& what,
          const TuneProgress& at);

/// The problem at these points: gains, uncertain, corners, samples, schedule, goal, limits.
TuneProblem tune_problem_of(const std::vector<SweepRequest>& points, const py::dict& asked);
py::dict dict_of(const TuneProblem& problem, const TuneResult& result);
/// evaluations, seconds, seed, threads, global_search, local_search, starts; omitted fields keep
/// their defaults.
TuneOptions tune_options_of(const py::dict& fields, TuneOptions defaults, bool callables);
/// Adds those of regulator_starts and placed_starts, if the fields contain them.
void add_starts(TuneOptions& options, const TuneProblem& problem, const py::dict& fields);

}  // namespace tiltrim::python
