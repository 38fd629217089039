/// @file
/// Flying qualities of a study's conditions, and the borders of their levels along a sweep.
#pragma once

#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "study/analyses.hpp"
#include "sweep/map.hpp"
#include "sweep/sweep.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// Flying qualities, and how they were judged.
struct JudgedQualities {
  QualitiesOptions options;  ///< completed for the condition
  Qualities qualities;       ///< of its linear model
};

/// How the study judges a linear model of a condition: its [qualities], completed for the built-in
/// vehicles. `outputs` at the trim give the airspeed. Throws std::invalid_argument for a study with
/// [model] but without [qualities].
[[nodiscard]] QualitiesOptions qualities_options(const Study& study, const Condition& condition,
                                                 const LinearModel& linear,
                                                 const Eigen::VectorXd& outputs);

/// Names of the figures that [tune] may use in a study with [qualities]: "level_1_phugoid_damping".
[[nodiscard]] std::vector<std::string> quality_figure_names();
/// By these names: how far the criterion is from level 1 at a trim of the request, in the unit of
/// its margins; negative inside, 10 where it is not judged.
[[nodiscard]] decltype(TuneProblem::figures) quality_figures(const Study& study,
                                                             const SweepRequest& request,
                                                             const Condition& condition);

/// Where a requirement changes its level along an axis of a sweep.
struct QualityBorder {
  int condition = 0, axis = 0;  ///< positions in the map
  std::vector<double> at;       ///< one coordinate per axis, in the study's units
  double error = 0.0;           ///< of the located coordinate: bracket, and bound of the figure
  std::string criterion;        ///< "short-period damping"
  int level = 1;                ///< the border between this level and the next worse one
  double value = 0.0;           ///< of the figure there, in `unit`
  std::string unit;             ///< of the figure
};

/// The level at each point of a sweep, and the borders between its points.
struct QualityLayer {
  std::vector<Level> level;            ///< one per point; not judged without an equilibrium
  std::vector<QualityBorder> borders;  ///< along each axis, by condition, axis and coordinate
  bool complete = true;  ///< false: a figure ends or has no known side somewhere, or stopped
};

/// Flying qualities at every point of a map of the study's sweep, and along each of its lines the
/// roots of each criterion's margins between neighbours, trimmed again. Of the options it takes
/// threads, stop and observe.
[[nodiscard]] QualityLayer quality_layer(const Study& study,
                                         const std::vector<Condition>& conditions,
                                         const SweepTable& grid, const SweepMap& map,
                                         const SweepOptions& options = {});

}  // namespace tiltrim
