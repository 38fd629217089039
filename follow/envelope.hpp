/// @file
/// Region in the plane of two parameters in which trims within the limits exist, and the search for
/// all equilibria of one problem.
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

/// One axis of the plane: a variable of the model that is not free in the trim.
struct EnvelopeAxis {
  std::string signal;  ///< its name
  Range range;         ///< SI
  int count = 100;     ///< grid points; at least 2
};

/// A section of the boundary with one cause.
struct BorderPiece {
  /// A verified trim on the boundary.
  struct Point {
    double x = 0.0, y = 0.0;  ///< in the plane, SI
    OperatingPoint point;     ///< the trim
    Eigen::VectorXd outputs;  ///< at the trim
    double residual = 0.0;    ///< as in TrimResult
    bool outer = true;        ///< no other trim within the limits exists on the outer side
  };

  std::string name;           ///< "delta_e lower", or "fold"
  std::vector<Point> points;  ///< in order
  std::string from, to;  ///< what each end meets: another piece's name, "edge", "loop", or a reason
};

/// An interval of x at one y: trims exist throughout.
struct EnvelopeInterval {
  /// One end of an interval of x.
  struct End {
    double x = 0.0;    ///< SI
    std::string name;  ///< what ends it: a piece's name, "edge" of the plane, or "lost": not found
  };
  End from, to;  ///< ascending
};
/// All intervals at one y.
struct EnvelopeRow {
  double y = 0.0;                           ///< SI
  std::vector<EnvelopeInterval> intervals;  ///< ascending
};

inline constexpr std::size_t most_border_pieces = 400;  ///< that envelope() follows
inline constexpr std::size_t most_sheets = 20;          ///< trims at a point of the grid

/// How an envelope ended.
enum class EnvelopeStatus {
  complete,     ///< every sheet found has been covered, within the limits and not far beyond
  empty,        ///< no trim found in the plane
  interrupted,  ///< stopped by the caller
  incomplete,   ///< the boundary has more than most_border_pieces, or a piece with more points than
                ///< are followed, or a point of the grid more than most_sheets trims: some of it is
                ///< missing
};
std::string to_string(EnvelopeStatus status);  ///< as in JSON

/// The result of envelope().
struct Envelope {
  EnvelopeStatus status = EnvelopeStatus::complete;  ///< how the search ended
  EnvelopeAxis x, y;                                 ///< as requested
  Eigen::MatrixXi count;            ///< distinct trims found at each grid point, (x.count) rows
  std::vector<BorderPiece> pieces;  ///< of the boundary
  std::vector<EnvelopeRow> rows;    ///< at the requested values of y; empty if interrupted
  long evaluations = 0;             ///< of the model's f and derivatives
};

/// Options of envelope().
struct EnvelopeOptions {
  std::vector<double> rows{};  ///< values of y at which intervals of x are computed
  int coarse = 7;              ///< seeds along each axis
  int starts = 24;             ///< Newton starts at each seed
  /// Along the boundary, on every unknown over its nominal size; in a plane much larger than that,
  /// a 400th of its shorter side.
  double max_step = 0.2;
  int threads = 0;         ///< 0: one per hardware thread; the result does not depend on it
  std::stop_token stop{};  ///< checked between trims
  std::function<void(double share)> observe{};  ///< share of the grid completed
};

/// Every sheet of trims that the seeds reach is extended over the grid by Newton from neighbouring
/// points; where a sheet ends, the limit or fold is located and followed. Sheets that no seed
/// reaches are not found; their absence is not proved. `spec` must have as many unknowns as
/// equations. Throws std::invalid_argument on invalid arguments.                [25, ch. 15; 27]
[[nodiscard]] Envelope envelope(const Model& model, const TrimSpec& spec,
                                const OperatingPoint& guess, const EnvelopeAxis& x,
                                const EnvelopeAxis& y, const EnvelopeOptions& options = {});

/// One equilibrium found.
struct Equilibrium {
  TrimResult trim;               ///< verified
  std::string found;             ///< "a start", or "the branch in V"
  std::optional<Modes> modes{};  ///< if it has a linear model
};

/// The equilibria found, by ascending cost. Completeness is not guaranteed.
struct AllEquilibria {
  std::vector<Equilibrium> equilibria;  ///< messages number them from 1
  TrimResult none;                      ///< if no equilibrium was found: the result of trim()
  int starts = 0;                       ///< Newton starts over the limits (a Halton set)
  int branches = 0;  ///< followed from the equilibria found, to see where they return
};

/// Newton from many starts, then the branches in `parameters` from every equilibrium found, in both
/// directions up to `reach` nominal sizes: a branch that returns to the original parameter value
/// gives another equilibrium. Repeated until nothing new is found, from 50 at most. Throws as
/// trim() and follow().
[[nodiscard]] AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec,
                                           const OperatingPoint& guess,
                                           const std::vector<std::string>& parameters, double reach,
                                           const TrimOptions& options);
/// The same with separate bounds for branches: `along` replaces `spec` on them.
[[nodiscard]] AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec,
                                           const TrimSpec& along, const OperatingPoint& guess,
                                           const std::vector<std::string>& parameters, double reach,
                                           const TrimOptions& options);

}  // namespace tiltrim
