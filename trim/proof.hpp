/// Showing that a trim problem has no solution. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

struct Proof {
  bool shown = false;  ///< no point within the bounds satisfies the equations
  int boxes = 0;       ///< examined
};

/// Branch and bound: the bounded unknowns' box is halved until in every part some equation's range
/// excludes its held value, or some limited output lies outside its bounds. Needs the model's
/// enclosure and finite bounds on every unknown; gives up (not shown) where a part that cannot be
/// excluded has become small, or at options.max_boxes.
Proof show_no_solution(const Problem& problem, const TrimOptions& options);

}  // namespace tiltrim
