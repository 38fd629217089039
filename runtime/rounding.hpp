/// The floating-point environment in which tiltrim computes. Internal to tiltrim.
#pragma once

#include <cfenv>

namespace tiltrim {

/// As long as it lives this thread rounds to nearest, keeps subnormal numbers and traps nothing,
/// whatever the host program has set (another rounding, FTZ and DAZ by a library compiled with
/// -ffast-math); then the host's settings are back. A thread inherits those of its parent; one of
/// a pool may have any.
class RoundToNearest {
 public:
  RoundToNearest() {
    std::fegetenv(&host_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~RoundToNearest() { std::fesetenv(&host_); }
  RoundToNearest(const RoundToNearest&) = delete;
  RoundToNearest& operator=(const RoundToNearest&) = delete;

 private:
  std::fenv_t host_{};
};

}  // namespace tiltrim
