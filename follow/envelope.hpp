/// Envelope: where in the plane of two parameters there is a trim within the limits.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "trim/trim.hpp"

namespace tiltrim {

/// One axis of the plane: a variable of the model that the trim does not move.
struct EnvelopeAxis {
  std::string signal;
  Range range;      ///< SI
  int count = 100;  ///< grid points; at least 2
};

/// A verified trim on the border.
struct BorderPoint {
  double x = 0.0, y = 0.0;
  OperatingPoint point;
  Eigen::VectorXd outputs;
  double residual = 0.0;
  bool outer = true;  ///< no other trim within the limits lies just across
};

/// A stretch of the border on which one thing stops the trim.
struct BorderPiece {
  std::string name;  ///< "delta_e lower", or "fold"
  std::vector<BorderPoint> points;
  std::string from, to;  ///< what each end meets: another piece's name, "edge", "loop", or why
};

/// An interval of x at one y: trims exist from one end to the other.
struct EnvelopeEnd {
  double x = 0.0;
  std::string name;  ///< what ends it: a piece's name, or "edge" of the plane looked at
};
struct EnvelopeInterval {
  EnvelopeEnd from, to;
};
struct EnvelopeRow {
  double y = 0.0;
  std::vector<EnvelopeInterval> intervals;
};

enum class EnvelopeStatus { complete, empty, interrupted };

struct Envelope {
  EnvelopeStatus status = EnvelopeStatus::complete;
  EnvelopeAxis x, y;
  Eigen::MatrixXi count;  ///< distinct trims found at each grid point, (x.count) rows
  std::vector<BorderPiece> pieces;
  std::vector<EnvelopeRow> rows;  ///< at the values of y asked for; none if interrupted
  long evaluations = 0;
};

struct EnvelopeOptions {
  std::vector<double> rows{};  ///< values of y at which the intervals of x are wanted
  int coarse = 7;              ///< seeds along each axis
  int starts = 24;             ///< Newton starts at each seed
  double max_step = 0.2;       ///< along the border, every unknown over its nominal size
  std::stop_token stop{};
  std::function<void(double share)> observe{};  ///< of the grid that is done
};

/// Every sheet of trims that the seeds reach is spread over the grid by Newton from neighbours;
/// where one stops, the limit or fold that stops it is located and followed. What no seed reaches
/// is not found, and not said to be absent. `spec` must have as many unknowns as equations. Throws
/// std::invalid_argument on the caller's mistakes.                              [25, ch. 15; 27]
[[nodiscard]] Envelope envelope(const Model& model, const TrimSpec& spec,
                                const OperatingPoint& guess, const EnvelopeAxis& x,
                                const EnvelopeAxis& y, const EnvelopeOptions& options = {});

}  // namespace tiltrim
