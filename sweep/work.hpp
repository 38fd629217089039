/// A sweep's work in units that threads and ranks share, logged as they are finished.
/// Internal to sweep/.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <map>
#include <utility>
#include <vector>

#include "runtime/log.hpp"
#include "runtime/ranks.hpp"
#include "runtime/threads.hpp"
#include "sweep/record.hpp"
#include "sweep/sweep.hpp"

namespace tiltrim {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point then);

/// The work at hand, finished units by number.
struct Work {
  const SweepOptions& options;
  Log* log;  // rank 0's, if any
  std::map<std::uint64_t, Bytes> recovered{};
  SweepProgress progress{};
  std::vector<std::pair<std::uint64_t, Bytes>> unwritten{};
  Clock::time_point written = Clock::now();
  std::exception_ptr failure{};  // of this rank, until the others know

  bool known(std::uint64_t unit) const { return recovered.contains(unit); }
};

/// Takes over what an earlier run has left in rank 0's log.
void recover(Work& work);
/// Writes what is finished and not in the log yet. A disk that is full is said to all ranks by
/// agree().
void write(Work& work);
/// All ranks go on, or all end; a stop that comes after the last unit is none. Throws what rank 0
/// failed with, or SweepInterrupted.
void agree(Work& work, bool last = false);
/// What the other ranks have computed of the units from `from` on.
void exchange(std::size_t from, std::vector<Bytes>& bytes);

/// Each rank's units from `from` on, by its threads; `bytes` are left empty where another rank has
/// it.
template <class Result>
void compute_block(const Work& work, std::uint64_t first, std::size_t from, const auto& compute,
                   const auto& store, std::vector<Result>& results, std::vector<Bytes>& bytes) {
  const bool bytes_needed = work.log || ranks() > 1;
  in_parallel(results.size(), [&](std::size_t k) {
    const std::size_t unit = from + k;
    const bool mine = unit % std::size_t(ranks()) == std::size_t(rank());
    if (!mine || work.known(first + unit) || work.options.stop.stop_requested()) return;
    compute(unit, results[k]);
    if (bytes_needed) bytes[k] = as_bytes(results[k]);
    store(unit, results[k]);
  });
}

/// Computes units first .. first + count - 1 in blocks that grow until one takes long enough to be
/// shared out: compute(i, result) and store(i, result), spread over ranks and threads; append(i,
/// result) in the units' order. A result's memory is used again by the next block's.
template <class Result>
void run(Work& work, std::uint64_t first, std::size_t count, const auto& compute,
         const auto& as_result, const auto& store, const auto& append) {
  constexpr double long_enough = 0.02;         // s
  constexpr std::size_t most_of_a_rank = 256;  // units: what ranks exchange at once
  std::size_t block = 1;
  std::vector<Result> results;
  for (std::size_t from = 0; from < count;) {
    const std::size_t size = std::min(count - from, block);
    const Clock::time_point begun = Clock::now();
    results.resize(size);
    std::vector<Bytes> bytes(size);
    compute_block(work, first, from, compute, store, results, bytes);
    agree(work);
    exchange(from, bytes);
    in_parallel(size, [&](std::size_t k) {
      if (const auto known = work.recovered.find(first + from + k); known != work.recovered.end())
        results[k] = as_result(known->second);
      else if (ranks() > 1)
        results[k] = as_result(bytes[k]);
      else
        return;
      store(from + k, results[k]);
    });
    for (std::size_t k = 0; k < size; ++k) {
      append(from + k, results[k]);
      if (work.log && !work.known(first + from + k))
        work.unwritten.emplace_back(first + from + k, std::move(bytes[k]));
    }
    if (seconds_since(work.written) >= work.options.checkpoint) write(work);
    if (work.options.observe) work.options.observe(work.progress);
    if (ranks() > 1 ? block < most_of_a_rank : seconds_since(begun) < long_enough) block *= 2;
    from += size;
  }
  agree(work, true);
}

}  // namespace tiltrim
