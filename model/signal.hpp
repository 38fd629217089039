/// @file
/// Named signals: names, units and sizes travel with every vector.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace tiltrim {

/// One component of a state, input, output or parameter vector. SI units, radians.
struct Signal {
  std::string name;      ///< found by it everywhere
  std::string unit;      ///< in words, "m/s"; empty: none
  double nominal = 1.0;  ///< a change that matters: the scale of steps, norms and rank tests; > 0
};

using Signals = std::vector<Signal>;  ///< of one vector, in its order

/// A closed range [lower, upper]; unbounded by default.
struct Range {
  double lower = -std::numeric_limits<double>::infinity();  ///< belongs to it
  double upper = std::numeric_limits<double>::infinity();   ///< belongs to it
};

/// A parameter that may be anywhere between two values, in SI units.
struct Uncertain {
  std::string name;                 ///< the models' signal, "aircraft.mass"
  double lower = 0.0, upper = 0.0;  ///< both may be
};

/// One term of the objective that decides where there are more unknowns than equations:
/// ((signal - reference) / scale)². The signal is a variable or an output of the model.
struct CostTerm {
  std::string signal;      ///< its name
  double scale = 1.0;      ///< in its unit; not zero
  double reference = 0.0;  ///< in its unit
};

/// Position of `name` in `signals`, or -1.
Eigen::Index find(const Signals& signals, std::string_view name);

/// Position of `name`; throws std::invalid_argument with the real names if there is none.
/// `kind` says in the message what was looked for ("state", "input", ...).
Eigen::Index index_of(const Signals& signals, std::string_view name, std::string_view kind);

/// The candidate nearest to `name` in edit distance; empty if none comes near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// Names and nominal sizes, in order.
std::vector<std::string> names(const Signals& signals);
Eigen::VectorXd nominals(const Signals& signals);  ///< one for each, in its unit

}  // namespace tiltrim
