/// @file
/// [model] of a study: equations of the user's own, in place of the tiltrotor's.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "study/keys.hpp"

namespace tiltrim {

/// The model of a study that has [model].
struct UserModel {
  Model model;                 ///< of its formulas
  Eigen::VectorXd parameters;  ///< their values
  /// Its states, inputs and parameters by name, and again with "_deg" where the unit is rad.
  std::vector<Key> keys;

  /// Where margins break a loop: `input` is added to what the law commands, `output`.
  struct Loop {
    std::string name;    ///< as margins call it
    std::string input;   ///< of the model; zero in a condition that does not say otherwise
    std::string output;  ///< of the model: the command ahead of that addition
  };
  std::vector<Loop> loops;  ///< empty: none to break
};

/// [simulate] of a study with [model]: the motion from a condition's trim.
struct UserMotion {
  std::string start;                     ///< the condition's name
  double duration = 10.0;                ///< s
  double sample = 0.1;                   ///< s
  double tolerance = 1e-9;               ///< of each step, over nominal sizes
  std::map<std::string, double> offset;  ///< of states, added to the trim; the model's units

  /// A change of an input or parameter for a time.
  struct Change {
    std::string signal;    ///< which
    bool doublet = false;  ///< `size` for `duration`, then its opposite for as long; else a step
    double at = 0.0, size = 0.0;  ///< s; the model's unit
    double duration = 0.0;        ///< s; of a step 0: to the end
  };
  std::vector<Change> changes;  ///< all together
};

}  // namespace tiltrim
