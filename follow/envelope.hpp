/// @file
/// Where in the plane of two parameters there is a trim within the limits, and all the equilibria
/// of one problem that can be found.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "follow/follow.hpp"
#include "linearize/modes.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// One axis of the plane: a variable of the model that the trim does not move.
struct EnvelopeAxis {
  std::string signal;  ///< its name
  Range range;         ///< SI
  int count = 100;     ///< grid points; at least 2
};

/// A verified trim on the border.
struct BorderPoint {
  double x = 0.0, y = 0.0;  ///< in the plane, SI
  OperatingPoint point;     ///< the trim
  Eigen::VectorXd outputs;  ///< there
  double residual = 0.0;    ///< as in TrimResult
  bool outer = true;        ///< no other trim within the limits lies just across
};

/// A stretch of the border on which one thing stops the trim.
struct BorderPiece {
  std::string name;                 ///< "delta_e lower", or "fold"
  std::vector<BorderPoint> points;  ///< along it
  std::string from, to;  ///< what each end meets: another piece's name, "edge", "loop", or why
};

/// One end of an interval of x.
struct EnvelopeEnd {
  double x = 0.0;    ///< SI
  std::string name;  ///< what ends it: a piece's name, or "edge" of the plane looked at
};
/// An interval of x at one y: trims exist from one end to the other.
struct EnvelopeInterval {
  EnvelopeEnd from, to;  ///< rising
};
/// All intervals at one y.
struct EnvelopeRow {
  double y = 0.0;                           ///< SI
  std::vector<EnvelopeInterval> intervals;  ///< rising
};

/// How an envelope ended.
enum class EnvelopeStatus {
  complete,     ///< every sheet that was met is gone over
  empty,        ///< no trim was found in the plane
  interrupted,  ///< the caller asked to stop
};

/// What envelope() answers.
struct Envelope {
  EnvelopeStatus status = EnvelopeStatus::complete;  ///< how it ended
  EnvelopeAxis x, y;                                 ///< as asked
  Eigen::MatrixXi count;            ///< distinct trims found at each grid point, (x.count) rows
  std::vector<BorderPiece> pieces;  ///< of the border
  std::vector<EnvelopeRow> rows;    ///< at the values of y asked for; none if interrupted
  long evaluations = 0;             ///< of the model's f and derivatives
};

/// How envelope() goes about it.
struct EnvelopeOptions {
  std::vector<double> rows{};  ///< values of y at which the intervals of x are wanted
  int coarse = 7;              ///< seeds along each axis
  int starts = 24;             ///< Newton starts at each seed
  double max_step = 0.2;       ///< along the border, every unknown over its nominal size
  std::stop_token stop{};      ///< asked between trims
  std::function<void(double share)> observe{};  ///< of the grid that is done
};

/// Every sheet of trims that the seeds reach is spread over the grid by Newton from neighbours;
/// where one stops, the limit or fold that stops it is located and followed. What no seed reaches
/// is not found, and not said to be absent. `spec` must have as many unknowns as equations. Throws
/// std::invalid_argument on the caller's mistakes.                              [25, ch. 15; 27]
[[nodiscard]] Envelope envelope(const Model& model, const TrimSpec& spec,
                                const OperatingPoint& guess, const EnvelopeAxis& x,
                                const EnvelopeAxis& y, const EnvelopeOptions& options = {});

/// One of them.
struct Equilibrium {
  TrimResult trim;               ///< verified
  std::string found;             ///< "a start", or "the branch in V from number 1"
  std::optional<Modes> modes{};  ///< where it has a linear model
};

/// What was found, by rising effort. That these are all is never said.
struct AllEquilibria {
  std::vector<Equilibrium> equilibria;  ///< numbered from 1 in words
  TrimResult none;                      ///< where there is none: what trim() says
  int starts = 0;                       ///< of Newton, over the limits (a Halton set)
  int branches = 0;  ///< followed from what was found, in search of where they come back
};

/// Newton from many starts, then the branches in `parameters` from every equilibrium found, both
/// ways as far as `reach` nominal sizes: where a branch comes back to the condition there is
/// another. Repeated until nothing new is found. Throws as trim() and follow().
[[nodiscard]] AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec,
                                           const OperatingPoint& guess,
                                           const std::vector<std::string>& parameters, double reach,
                                           const TrimOptions& options);
/// The same, where branches are not bounded as starts are: `along` in place of `spec` on them.
[[nodiscard]] AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec,
                                           const TrimSpec& along, const OperatingPoint& guess,
                                           const std::vector<std::string>& parameters, double reach,
                                           const TrimOptions& options);

}  // namespace tiltrim
