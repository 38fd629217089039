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

/// From the given start, the middle, and the best of the global search or of random points,
/// quickly; then from the best of these, and from further random points, until three ends agree or
/// EndSearch is thrown.
void from_many_starts(Search& search, Ends& ends);

}  // namespace tiltrim
