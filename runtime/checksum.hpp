/// CRC-64/XZ of data stored on disk.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tiltrim {

/// Eight tables for eight bytes at a time (slicing, [42]) of the polynomial of [40, annex B],
/// bit-reflected. [41, ch. 6]
consteval std::array<std::array<std::uint64_t, 256>, 8> crc_tables() {
  constexpr std::uint64_t polynomial = 0xC96C5795D7870F42;
  std::array<std::array<std::uint64_t, 256>, 8> table{};
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    std::uint64_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? polynomial : 0);
    table[0][byte] = crc;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t byte = 0; byte < 256; ++byte)
      table[k][byte] = table[0][table[k - 1][byte] & 0xFF] ^ (table[k - 1][byte] >> 8);
  return table;
}

/// The checksum of earlier data followed by `bytes`; `before` is the checksum of the earlier data.
/// Detects every burst of up to 64 wrong bits; longer damage passes undetected once in 2⁶⁴ cases.
inline std::uint64_t checksum(std::span<const std::byte> bytes, std::uint64_t before = 0) {
  static constexpr auto table = crc_tables();
  std::uint64_t crc = ~before;
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      const std::uint64_t index = ((crc >> (8 * k)) & 0xFF) ^ std::uint64_t(bytes[i + k]);
      sum ^= table[7 - k][index];
    }
    crc = sum;
  }
  for (; i < bytes.size(); ++i) crc = table[0][(crc & 0xFF) ^ std::uint64_t(bytes[i])] ^ (crc >> 8);
  return ~crc;
}

}  // namespace tiltrim
