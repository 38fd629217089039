// Compiled without the thread sanitizer, as TBB itself is (CMakeLists.txt).
#include "runtime/threads.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <thread>

#include "runtime/rounding.hpp"
#ifdef TILTRIM_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace tiltrim {
namespace {

// The thread sanitizer does not see how TBB's threads wait for each other: it is told.
#ifdef TILTRIM_THREAD_SANITIZER
void leave(char& gate) { __tsan_release(&gate); }
void enter(char& gate) { __tsan_acquire(&gate); }
#else
void leave(char&) {}
void enter(char&) {}
#endif

}  // namespace

void with_threads(int threads, const std::function<void()>& work) {
  const int machine = int(std::max(1U, std::thread::hardware_concurrency()));
  tbb::task_arena arena(threads > 0 ? threads : machine);
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism,
                                 std::size_t(std::max(threads, machine)));
  arena.execute(work);
}

std::size_t threads() { return std::size_t(tbb::this_task_arena::max_concurrency()); }

void spread(std::size_t count, const std::function<void(std::size_t)>& work) {
  char start = 0, end = 0;
  leave(start);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    enter(start);
    const RoundToNearest environment;  // pool threads may have other settings
    work(i);
    leave(end);
  });
  enter(end);
}

}  // namespace tiltrim
