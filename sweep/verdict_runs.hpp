/// Verdicts along a line as runs of equal ones. Internal to sweep/ and report/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

namespace tiltrim {

/// A run is verdict + 1 in two bits, then its length, seven bits a byte and five in the first, the
/// lowest first; the highest bit of a byte is set if another follows. At most a byte per point.
inline void append_runs(std::span<const std::int8_t> codes, std::vector<std::uint8_t>& runs) {
  for (std::size_t k = 0; k < codes.size();) {
    std::size_t end = k + 1;
    while (end < codes.size() && codes[end] == codes[k]) ++end;
    std::size_t length = end - k;
    std::size_t byte = std::size_t(codes[k] + 1) | (length & 31) << 2;
    for (length >>= 5; length > 0; length >>= 7) {
      runs.push_back(std::uint8_t(byte | 128));
      byte = length & 127;
    }
    runs.push_back(std::uint8_t(byte));
    k = end;
  }
}

/// Calls each(code, length) for the runs of the line of `points` points that begins at `at`, and
/// moves `at` to the next line. Throws std::runtime_error if they are not a line of that length.
inline void each_run(std::span<const std::uint8_t> runs, std::size_t& at, std::size_t points,
                     const auto& each) {
  const auto next = [&] {
    if (at >= runs.size()) throw std::runtime_error("is damaged: a line of verdicts is truncated");
    return std::size_t(runs[at++]);
  };
  for (std::size_t done = 0; done < points;) {
    std::size_t byte = next();
    const auto code = std::int8_t(int(byte & 3) - 1);
    std::size_t length = byte >> 2 & 31;
    constexpr int most = 40;  // bits of a length
    for (int shift = 5; (byte & 128) != 0 && shift < most; shift += 7) {
      byte = next();
      length |= (byte & 127) << shift;
    }
    if (length == 0 || length > points - done)
      throw std::runtime_error("is damaged: a line of verdicts has another length");
    each(code, length);
    done += length;
  }
}

}  // namespace tiltrim
