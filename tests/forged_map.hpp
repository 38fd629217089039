/// Maps with inconsistent contents: numbers in HDF5's structure changed, with every checksum
/// corrected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// A piece of the file: a part of HDF5's structure followed by its checksum (Jenkins' lookup3), or
/// the superblock or the whole file, which have none.
struct Hdf5Piece {
  std::size_t at, size;
  bool checked = true;
};

/// A change within a piece; every number is reduced modulo its range.
struct Hdf5Change {
  std::uint16_t piece, at;
  std::uint8_t width, choice;  ///< 1, 2, 4 or 8 bytes; value itself, a bit of it flipped, or an end
  std::uint16_t value;
};

/// The pieces of a map as write_netcdf() wrote it.
std::vector<Hdf5Piece> hdf5_pieces(const std::string& map);

/// The map with these changes.
std::string forged(std::string map, const std::vector<Hdf5Piece>& pieces,
                   const std::vector<Hdf5Change>& changes);

/// The bytes with the mark and the CRC-64/XZ after them, bit by bit by definition.
std::string sealed_map(std::string bytes);
