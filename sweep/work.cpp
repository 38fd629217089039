#include "sweep/work.hpp"

#include <algorithm>
#include <cstring>

namespace tiltrim {

double seconds_since(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

namespace {

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

void recover(Work& work) {
  std::vector<std::pair<std::uint64_t, Bytes>> found;
  if (work.log)
    for (const Record& record : work.log->recovered())
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
