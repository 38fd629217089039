/// Work spread over threads. Internal to tiltrim.
#pragma once

#include <cstddef>
#include <functional>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace tiltrim {

/// work() with up to `threads` threads for the loops in it; 0: as many as the machine has.
void with_threads(int threads, const std::function<void()>& work);

/// work(i) for i = 0 .. count - 1, in any order and side by side.
void spread(std::size_t count, const std::function<void(std::size_t)>& work);

/// The same. Debian's TBB is not built for the thread sanitizer, which therefore does not see that
/// the loop's beginning comes before what its threads do, and its end after: it is told. What they
/// do beside each other it sees as it is.
template <class Work>
void in_parallel(std::size_t count, const Work& work) {
#if defined(__SANITIZE_THREAD__)
  static char begun, done;  // not of this call's: to read a capture would be to be too early
  const std::function<void(std::size_t)> told = [&](std::size_t i) {
    __tsan_acquire(&begun);
    work(i);
    __tsan_release(&done);
  };
  __tsan_release(&begun);
  spread(count, told);
  __tsan_acquire(&done);
#else
  spread(count, work);
#endif
}

}  // namespace tiltrim
