/// A sweep's work in units that threads and ranks share, logged when they are finished.
/// Internal to sweep/.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "runtime/log.hpp"
#include "runtime/ranks.hpp"
#include "runtime/threads.hpp"
#include "sweep/prepared.hpp"
#include "sweep/record.hpp"
#include "sweep/sweep.hpp"

namespace tiltrim {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point then);

/// The current work, with finished units by number.
struct Work {
  const SweepOptions& options;
  Log* log;  // rank 0's, if any
  std::map<std::uint64_t, Bytes> recovered{};
  SweepProgress progress{};
  std::vector<std::pair<std::uint64_t, Bytes>> unwritten{};
  Clock::time_point written = Clock::now();
  std::exception_ptr failure{};  // of this rank, until it is reported to the others

  bool known(std::uint64_t unit) const { return recovered.contains(unit); }
};

using PreparedConditions = std::vector<std::unique_ptr<Prepared>>;
/// Throws std::invalid_argument for no condition, no axis, or conditions of different states.
PreparedConditions prepare(const std::vector<SweepRequest>& requests,
                           const std::vector<SweepAxis>& axes, const SweepOptions& options);
/// Identity of the work that the log's units belong to.
std::string identity_of(const SweepOptions& options, const PreparedConditions& conditions,
                        const std::vector<SweepAxis>& axes);
/// The log of the options on rank 0, and the units that are in it; empty without one. An unusable
/// log throws on all ranks.
std::unique_ptr<Log> open_log(Work& work, const std::string& identity);

/// Reads the units that an earlier run left in rank 0's log.
void recover(Work& work);
/// Writes finished units to the log. A full disk is reported on all ranks by agree().
void write(Work& work);
/// All ranks continue, or all end; a stop after the last unit is ignored. Throws rank 0's error, or
/// SweepInterrupted.
void agree(Work& work, bool last = false);
/// Receives the units from `from` on that other ranks have computed.
void exchange(std::size_t from, std::vector<Bytes>& bytes);

/// Reads a unit from the log; errors name the log.
auto in_log(const Work& work, const auto& unit_from, const Bytes& bytes, const LineSizes& sizes) {
  try {
    return unit_from(bytes, sizes);
  } catch (const std::runtime_error& e) {
    throw LogError(work.options.log.string() + ": " + e.what());
  }
}

/// This rank's units from `from` on, computed by its threads, up to `together` at a time; `bytes`
/// stay empty for those of another rank.
template <class Result>
void compute_block(const Work& work, std::uint64_t first, std::size_t from, std::size_t together,
                   const auto& compute, const auto& store, std::vector<Result>& results,
                   std::vector<Bytes>& bytes) {
  const bool bytes_needed = work.log || ranks() > 1;
  std::vector<std::size_t> mine;
  for (std::size_t k = 0; k < results.size(); ++k)
    if ((from + k) % std::size_t(ranks()) == std::size_t(rank()) && !work.known(first + from + k))
      mine.push_back(k);
  in_parallel((mine.size() + together - 1) / together, [&](std::size_t group) {
    if (work.options.stop.stop_requested()) return;
    std::vector<std::size_t> units;
    std::vector<Result*> answers;
    const std::size_t end = std::min(mine.size(), (group + 1) * together);
    for (std::size_t i = group * together; i < end; ++i) {
      units.push_back(from + mine[i]);
      answers.push_back(&results[mine[i]]);
    }
    compute(units, answers);
    for (std::size_t i = 0; i < units.size(); ++i) {
      if (bytes_needed) bytes[units[i] - from] = as_bytes(*answers[i]);
      store(units[i], *answers[i]);
    }
  });
}

/// Computes units first .. first + count - 1 in blocks that grow until one takes long enough to be
/// distributed: compute(units, results), of up to `together` units, and store(i, result) run on
/// ranks and threads; append(i, result) runs in the order of the units. The memory of a result is
/// reused by the next block.
template <class Result>
void run(Work& work, std::uint64_t first, std::size_t count, std::size_t together,
         const auto& compute, const auto& as_result, const auto& store, const auto& append) {
  constexpr double long_enough = 0.02;         // s
  constexpr std::size_t most_of_a_rank = 256;  // units: exchanged between ranks at once
  std::size_t block = together * threads() * std::size_t(ranks());  // some for every thread
  std::vector<Result> results;
  for (std::size_t from = 0; from < count;) {
    const std::size_t size = std::min(count - from, block);
    const Clock::time_point begun = Clock::now();
    results.resize(size);
    std::vector<Bytes> bytes(size);
    compute_block(work, first, from, together, compute, store, results, bytes);
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
