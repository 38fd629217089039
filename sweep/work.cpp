#include "sweep/work.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "linearize/batch.hpp"

namespace tiltrim {

double seconds_since(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

namespace {

void check_alike(const PreparedConditions& conditions) {
  const Prepared& first = *conditions.front();
  for (const auto& c : conditions)
    if (names(c->model().states) != names(first.model().states))
      throw std::invalid_argument(
          fmt::format("the states of condition '{}' differ from those of '{}'; expected conditions "
                      "of one formulation",
                      c->request.name, first.request.name));
}

void check_axis(const SweepAxis& axis) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("axis {}: {}", axis.name, why));
  };
  if (axis.columns.empty() || axis.size() == 0) refuse("no values; expected at least one");
  for (const SweepAxis::Column& column : axis.columns) {
    if (column.values.size() != axis.size() || column.si.size() != axis.size())
      refuse(fmt::format("{} values of {}, {} in SI; expected {} of each", column.values.size(),
                         column.name, column.si.size(), axis.size()));
    for (const double value : column.si)
      if (!std::isfinite(value))
        refuse(fmt::format("{} = {}; expected finite values", column.name, value));
  }
  const std::vector<double>& values = axis.columns.front().si;
  const bool up = values.back() > values.front();
  for (std::size_t k = 1; k < values.size(); ++k)
    if (!(up ? values[k] > values[k - 1] : values[k] < values[k - 1]))
      refuse(fmt::format("{} after {}; expected ascending or descending values, each once",
                         values[k], values[k - 1]));
}

// Numbers and bytes of finished units, to send to ranks that do not have them.
Bytes packed(const std::vector<std::pair<std::uint64_t, Bytes>>& units) {
  Bytes all;
  const auto add = [&all](const void* from, std::size_t size) {
    const auto* bytes = static_cast<const std::byte*>(from);
    all.insert(all.end(), bytes, bytes + size);
  };
  for (const auto& [number, bytes] : units) {
    const std::uint64_t size = bytes.size();
    add(&number, sizeof number);
    add(&size, sizeof size);
    add(bytes.data(), bytes.size());
  }
  return all;
}

void unpack(const Bytes& all, const auto& take) {
  for (std::size_t at = 0; at < all.size();) {
    std::uint64_t number = 0, size = 0;
    std::memcpy(&number, all.data() + at, sizeof number);
    std::memcpy(&size, all.data() + at + sizeof number, sizeof size);
    at += sizeof number + sizeof size;
    take(number, Bytes(all.begin() + std::ptrdiff_t(at), all.begin() + std::ptrdiff_t(at + size)));
    at += size;
  }
}

}  // namespace

std::string identity_of(const SweepOptions& options, const PreparedConditions& conditions,
                        const std::vector<SweepAxis>& axes) {
  std::string identity = options.identity + "\n" + rounding();
  for (const auto& c : conditions)
    identity += fmt::format("\ncondition {}: {}", c->request.name,
                            fmt::join(names(c->model().states), " "));
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns) {
      identity += fmt::format("\naxis {}, {}:", axis.name, column.name);
      for (const double value : column.si) identity += fmt::format(" {:a}", value);
    }
  return identity;
}

PreparedConditions prepare(const std::vector<SweepRequest>& requests,
                           const std::vector<SweepAxis>& axes, const SweepOptions& options) {
  if (requests.empty()) throw std::invalid_argument("no condition to sweep over");
  if (axes.empty()) throw std::invalid_argument("no axis to sweep along");
  for (const SweepAxis& axis : axes) check_axis(axis);
  PreparedConditions conditions;
  for (const SweepRequest& r : requests)
    conditions.push_back(std::make_unique<Prepared>(r, axes, options.trimming));
  check_alike(conditions);
  return conditions;
}

std::unique_ptr<Log> open_log(Work& work, const std::string& identity) {
  std::unique_ptr<Log> log;
  if (!work.options.log.empty() && rank() == 0) {
    try {
      log = std::make_unique<Log>(work.options.log, identity);
    } catch (const LogError&) {
      work.failure = std::current_exception();
    }
    work.log = log.get();
  }
  agree(work);
  recover(work);
  return log;
}

void recover(Work& work) {
  std::vector<std::pair<std::uint64_t, Bytes>> found;
  if (work.log)
    for (const Log::Record& record : work.log->recovered())
      found.emplace_back(record.tile, record.bytes);
  unpack(broadcast(packed(found)), [&](std::uint64_t number, Bytes bytes) {
    work.recovered.emplace(number, std::move(bytes));
  });
}

void write(Work& work) {
  if (!work.log || work.failure) return;
  try {
    for (const auto& [number, bytes] : work.unwritten) work.log->append(number, bytes);
    if (!work.unwritten.empty()) work.log->sync();
  } catch (const LogError&) {
    work.failure = std::current_exception();
  }
  work.unwritten.clear();
  work.written = Clock::now();
}

void agree(Work& work, bool last) {
  constexpr std::byte go_on{0}, stop{1}, fail{2};
  const bool stops = work.options.stop.stop_requested() && !last;
  const std::byte own = work.failure ? fail : stops ? stop : go_on;
  std::byte most = own;
  for (const Bytes& other : gather({own})) most = std::max(most, other.at(0));
  if (most == go_on) return;
  if (most == stop) write(work);
  if (work.failure) std::rethrow_exception(work.failure);
  throw SweepInterrupted("interrupted", most == fail);
}

void exchange(std::size_t from, std::vector<Bytes>& bytes) {
  if (ranks() == 1) return;
  std::vector<std::pair<std::uint64_t, Bytes>> own;
  for (std::size_t k = 0; k < bytes.size(); ++k)
    if (!bytes[k].empty()) own.emplace_back(from + k, bytes[k]);
  for (const Bytes& part : gather(packed(own)))
    unpack(part, [&](std::uint64_t i, Bytes b) { bytes[i - from] = std::move(b); });
}

}  // namespace tiltrim
