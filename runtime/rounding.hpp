/// The floating-point environment in which tiltrim computes. Internal to tiltrim.
#pragma once

#include <cfenv>
#if defined(__SSE2__) && __has_include(<fpu_control.h>)
#include <fpu_control.h>
#include <xmmintrin.h>
#define TILTRIM_CONTROL_WORDS
#endif

namespace tiltrim {

/// During its lifetime this thread rounds to nearest, keeps subnormal numbers and traps no
/// exceptions, whatever the host program has set (another rounding mode, or FTZ and DAZ set by a
/// library compiled with -ffast-math). The destructor restores the host's settings; flags of past
/// exceptions are none. A new thread inherits the settings of its parent; a pool thread may have
/// any.
class RoundToNearest {
 public:
  RoundToNearest() : set_(!is_default()) {
    if (!set_) return;
    std::fegetenv(&host_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~RoundToNearest() {
    if (set_) std::fesetenv(&host_);
  }
  RoundToNearest(const RoundToNearest&) = delete;
  RoundToNearest& operator=(const RoundToNearest&) = delete;

 private:
  // Reads the control words alone: the whole environment takes thirty times as long.
  static bool is_default() {
#if defined(TILTRIM_CONTROL_WORDS)
    fpu_control_t x87;
    _FPU_GETCW(x87);
    return x87 == _FPU_DEFAULT && (_mm_getcsr() & ~unsigned{_MM_EXCEPT_MASK}) == _MM_MASK_MASK;
#else
    return false;
#endif
  }

  bool set_;
  std::fenv_t host_{};
};

}  // namespace tiltrim
