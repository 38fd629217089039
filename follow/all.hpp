/// @file
/// All the equilibria of a trim problem that can be found.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "follow/follow.hpp"
#include "linearize/modes.hpp"

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
/// The same, where branches are not bounded as starts are: `along` in place of `spec` on them.
[[nodiscard]] AllEquilibria all_equilibria(const Model& model, const TrimSpec& spec,
                                           const TrimSpec& along, const OperatingPoint& guess,
                                           const std::vector<std::string>& parameters, double reach,
                                           const TrimOptions& options);

}  // namespace tiltrim
