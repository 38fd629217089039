/// @file
/// All the equilibria of a condition that can be found.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "follow/follow.hpp"
#include "trim/answer.hpp"

namespace tiltrim {

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

/// Of a study's condition: branches in V, gamma and eta, where the condition holds them. Throws
/// std::invalid_argument for formulation table.
[[nodiscard]] AllEquilibria all_equilibria(const Vehicle& vehicle, const Condition& condition,
                                           const TrimOptions& options);

}  // namespace tiltrim
