// Compiled without the thread sanitizer, as TBB itself is (CMakeLists.txt).
#include "runtime/threads.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <thread>

#include "runtime/rounding.hpp"

namespace tiltrim {

void with_threads(int threads, const std::function<void()>& work) {
  const int machine = int(std::max(1U, std::thread::hardware_concurrency()));
  tbb::task_arena arena(threads > 0 ? threads : machine);
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism,
                                 std::size_t(std::max(threads, machine)));
  arena.execute(work);
}

void spread(std::size_t count, const std::function<void(std::size_t)>& work) {
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const RoundToNearest environment;  // pool threads may have other settings
    work(i);
  });
}

}  // namespace tiltrim
