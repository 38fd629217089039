/// A proportion with its confidence interval.
#pragma once

namespace tiltrim {

/// A share of independent trials with the Clopper-Pearson interval at 95 % confidence, whose
/// coverage is never below 95 % [50].
struct Proportion {
  double share = 0.0, lower = 0.0, upper = 1.0;  ///< lower <= share <= upper
};
/// The proportion of `met` in `of` trials; with no trials the interval is [0, 1].
Proportion proportion(long met, long of);

}  // namespace tiltrim
