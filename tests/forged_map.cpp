#include "tests/forged_map.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <string_view>

namespace {

// lookup3.c, Bob Jenkins, 2006, public domain: hashlittle() with initval 0, as HDF5's file format
// uses it.
std::uint32_t lookup3(std::string_view key) {
  std::uint32_t a = 0xdeadbeef + std::uint32_t(key.size()), b = a, c = a;
  const auto add = [&](std::string_view words) {
    std::array<std::uint32_t, 3> w{};
    std::memcpy(w.data(), words.data(), words.size());
    a += w[0], b += w[1], c += w[2];
  };
  const auto mix = [](std::uint32_t& x, std::uint32_t& y, std::uint32_t& z, int turn) {
    x = (x - z) ^ std::rotl(z, turn);
    z += y;
  };
  for (; key.size() > 12; key.remove_prefix(12)) {
    add(key.substr(0, 12));
    mix(a, b, c, 4), mix(b, c, a, 6), mix(c, a, b, 8);
    mix(a, b, c, 16), mix(b, c, a, 19), mix(c, a, b, 4);
  }
  if (key.empty()) return c;
  add(key);
  const auto end = [](std::uint32_t& x, std::uint32_t y, int turn) {
    x = (x ^ y) - std::rotl(y, turn);
  };
  end(c, b, 14), end(a, c, 11), end(b, a, 25), end(c, b, 16), end(a, c, 4), end(b, a, 14);
  end(c, b, 24);
  return c;
}

std::uint32_t word_at(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

constexpr std::size_t seal = 16;  // bytes

}  // namespace

std::vector<Hdf5Piece> hdf5_pieces(const std::string& map) {
  constexpr std::size_t longest = 600;
  constexpr std::size_t superblock = 96;
  std::vector<Hdf5Piece> pieces{{0, superblock, false}, {0, map.size() - seal, false}};
  for (const char* mark : {"OHDR", "OCHK", "FRHP", "BTHD", "BTLF", "FSHD", "FSSE"})
    for (std::size_t at = map.find(mark); at != map.npos; at = map.find(mark, at + 1))
      for (std::size_t size = 8; size < longest && at + size + 4 + seal <= map.size(); ++size)
        if (lookup3(std::string_view(map).substr(at, size)) == word_at(map, at + size)) {
          pieces.push_back({at, size});
          break;
        }
  return pieces;
}

std::string forged(std::string map, const std::vector<Hdf5Piece>& pieces,
                   const std::vector<Hdf5Change>& changes) {
  for (const Hdf5Change& f : changes) {
    const Hdf5Piece piece = pieces[f.piece % pieces.size()];
    const std::size_t width = std::size_t(1) << f.width % 4, mark = 4;
    const std::size_t at = piece.at + mark + f.at % (piece.size - mark - 7);
    std::uint64_t value = 0;
    std::memcpy(&value, map.data() + at, width);
    const std::array<std::uint64_t, 4> values{f.value, value ^ std::uint64_t(1) << f.value % 64,
                                              ~std::uint64_t(0) >> f.value % 64,
                                              std::uint64_t(1) << f.value % 64};
    value = values[f.choice % 4];
    std::memcpy(map.data() + at, &value, width);
    if (!piece.checked) continue;
    const std::uint32_t sum = lookup3(std::string_view(map).substr(piece.at, piece.size));
    std::memcpy(map.data() + piece.at + piece.size, &sum, sizeof sum);
  }
  return sealed_map(map.substr(0, map.size() - seal));
}

std::string sealed_map(std::string bytes) {
  bytes += "tiltmap\n";
  std::uint64_t crc = ~std::uint64_t(0);
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) * 0xC96C5795D7870F42);
  }
  crc = ~crc;
  for (int byte = 0; byte < 8; ++byte) bytes += char(crc >> (8 * byte));
  return bytes;
}
