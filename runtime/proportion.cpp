#include "runtime/proportion.hpp"

#include <boost/math/distributions/binomial.hpp>

namespace tiltrim {

Proportion proportion(long met, long of) {
  if (of == 0) return {};
  // By default Boost computes in long double, and any program that links this aborts at start-up
  // under valgrind, which has no 80-bit numbers.
  using InDouble = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  using Binomial = boost::math::binomial_distribution<double, InDouble>;
  constexpr double outside = 0.025;  // probability on either side
  const auto n = double(of), k = double(met);
  return {k / n, Binomial::find_lower_bound_on_p(n, k, outside),
          Binomial::find_upper_bound_on_p(n, k, outside)};
}

}  // namespace tiltrim
