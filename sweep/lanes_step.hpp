/// Newton steps of several points at once, in SIMD lanes. Internal to sweep/.
#pragma once

#include <cstddef>

namespace tiltrim {

/// Solves J dz = -r for the `Model::model_lanes` points of Model::lanes: entry (i, k) of point l is
/// J[(i n + k) Model::model_lanes + l]. `regular` is 1 where no pivot is too small, otherwise 0.
struct StepTask {
  static constexpr std::size_t largest = 16, lanes = 8;
  std::size_t n;  ///< at most `largest`
  const double *J, *r;
  double *dz, *regular;
};

namespace lanes_scalar {
void newton_step(const StepTask& task);
}
namespace lanes_baseline {
void newton_step(const StepTask& task);
}
#ifdef TILTRIM_X86
namespace lanes_avx2 {
void newton_step(const StepTask& task);
}
namespace lanes_avx512 {
void newton_step(const StepTask& task);
}
#else  // never selected there
namespace lanes_avx2 = lanes_baseline;
namespace lanes_avx512 = lanes_baseline;
#endif

}  // namespace tiltrim
