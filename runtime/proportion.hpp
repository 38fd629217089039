/// @file
/// How often something holds, and how sure that is.
#pragma once

namespace tiltrim {

/// A share of independent trials with Clopper and Pearson's interval of 95 %, which holds at least
/// as often as it says [50].
struct Proportion {
  double share = 0.0, lower = 0.0, upper = 1.0;  ///< lower <= share <= upper
};
/// Of `of` trials `met`; of none nothing is known.
Proportion proportion(long met, long of);

}  // namespace tiltrim
