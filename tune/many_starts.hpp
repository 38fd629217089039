/// Local searches from many starts, until they agree. Internal to tune/.
#pragma once

#include <vector>

#include "tune/search.hpp"

namespace tiltrim {

/// The values at which completed local searches ended.
struct Ends {
  std::vector<Merit> merits;
  double weight = 0.0;  ///< of the penalty on violations, at the best

  /// How many are as good as `best`, to 0.1 %.
  long agreeing(const Merit& best) const;
};

/// From the given start, the middle, and the best of the global search or of random points; then
/// deeper from the best of these ends, and from further random points, until as many ends agree as
/// the options ask for, or EndSearch is thrown.
void from_many_starts(Search& search, Ends& ends);

/// How nearly the best candidate is stationary (TuneResult::stationarity), with this weight of the
/// penalty on violations (0: a first guess); NaN if it cannot be computed. Counts no candidates.
double stationarity_at_best(Search& search, double weight);

}  // namespace tiltrim
