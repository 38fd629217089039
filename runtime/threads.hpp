/// Parallel loops. Internal to tiltrim.
#pragma once

#include <cstddef>
#include <functional>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace tiltrim {

/// Calls work() with up to `threads` threads for the loops in it; 0: one per hardware thread.
void with_threads(int threads, const std::function<void()>& work);

/// The most threads that a loop here can have.
std::size_t threads();

/// Calls work(i) for i = 0 .. count - 1, in any order and in parallel.
void spread(std::size_t count, const std::function<void(std::size_t)>& work);

/// The same. Debian's TBB is not built for the thread sanitizer, so the start and end of the loop
/// are annotated as ordered before and after the work of its threads. Races between the threads are
/// found without annotation.
template <class Work>
void in_parallel(std::size_t count, const Work& work) {
#if defined(__SANITIZE_THREAD__)
  static char begun, done;  // static: reading a captured reference would precede the acquire
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
