/// Proof that a trim problem has no solution. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

struct Proof {
  bool proved = false;  ///< no point within the bounds satisfies the equations
  int boxes = 0;        ///< examined
};

/// The model has an enclosure, and the unknowns are states and inputs with finite bounds.
bool can_be_proved(const Problem& problem);

/// Boxes tried before a search that takes as long: with and without the search for a closest point.
inline constexpr int boxes_before_search = 5000, boxes_before_short_search = 1000;

/// Branch and bound: the box of the bounded unknowns is bisected until in every part the range of
/// some equation excludes its held value, or some limited output lies outside its bounds. Needs the
/// model's enclosure and finite bounds on every unknown; gives up (no proof) at a small box that
/// cannot be excluded, or at options.max_boxes. What it assumes: docs/prove.md.
Proof prove_no_solution(const Problem& problem, const TrimOptions& options);

}  // namespace tiltrim
