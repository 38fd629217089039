/// [model] of a study: user-defined equations instead of the tiltrotor's.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "study/keys.hpp"
#include "vehicles/xv15/xv15.hpp"

namespace tiltrim {

/// The model of a study that has [model] or a published vehicle.
struct UserModel {
  Model model;                 ///< built from the formulas
  Eigen::VectorXd parameters;  ///< their values
  /// Its states, inputs and parameters by name, and with the suffix "_deg" if the unit is rad.
  std::vector<Key> keys;

  /// A loop to break for margins: `input` is added to the law's command `output`.
  struct Loop {
    std::string name;    ///< in the results
    std::string input;   ///< of the model; zero unless a condition sets it
    std::string output;  ///< of the model: the command before `input` is added
  };
  std::vector<Loop> loops;  ///< empty: no loops

  /// Of vehicle = "xv15"; null for [model].
  std::shared_ptr<const xv15::Data> xv15{};
  /// The published vehicle's parameters that [gains] sets: its control law's.
  std::vector<std::string> gains{};
};

/// [simulate] of a study with [model]: the motion from a condition's trim.
struct UserMotion {
  std::string start;                     ///< the condition's name
  double duration = 10.0;                ///< s
  double sample = 0.1;                   ///< s
  double tolerance = 1e-9;               ///< of each step, over nominal sizes
  std::map<std::string, double> offset;  ///< of states, added to the trim; the model's units

  /// A temporary change of an input or parameter.
  struct Change {
    std::string signal;           ///< which
    bool doublet = false;         ///< `size` for `duration`, then -`size` for as long; else a step
    double at = 0.0, size = 0.0;  ///< s; the model's unit
    double duration = 0.0;        ///< s; for a step, 0: to the end
  };
  std::vector<Change> changes;  ///< added up
};

}  // namespace tiltrim
