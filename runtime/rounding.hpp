/// The floating-point environment in which tiltrim computes. Internal to tiltrim.
#pragma once

#include <cfenv>

namespace tiltrim {

/// During its lifetime this thread rounds to nearest, keeps subnormal numbers and traps no
/// exceptions, whatever the host program has set (another rounding mode, or FTZ and DAZ set by a
/// library compiled with -ffast-math). The destructor restores the host's settings. A new thread
/// inherits those of its parent; a pool thread may have any.
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
