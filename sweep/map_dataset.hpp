/// An open NetCDF file, its dimensions, and how arrays over them are stored. The NetCDF header is
/// included in one source only. Internal to sweep/.
#pragma once

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "sweep/map_fields.hpp"

namespace tiltrim::filing {

/// A sequence of dimensions.
struct Shape {
  std::vector<int> ids;
  std::vector<std::size_t> sizes;
  std::size_t size() const {
    return std::accumulate(sizes.begin(), sizes.end(), std::size_t(1), std::multiplies<>());
  }
};

inline void append(Shape& shape, const Shape& further) {
  shape.ids.insert(shape.ids.end(), further.ids.begin(), further.ids.end());
  shape.sizes.insert(shape.sizes.end(), further.sizes.begin(), further.sizes.end());
}

/// An open NetCDF file; `name` is used in messages.
struct Dataset {
  std::filesystem::path name;
  int id = -1;
  bool owner = false;                         ///< owns the memory image
  std::map<std::string, Shape> dimensions{};  ///< and "point"
  std::string at_points{};                    ///< coordinates of all variables over "point"

  explicit Dataset(const std::filesystem::path& file) : name(file) {}
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;
  ~Dataset();
  void check(int status, const std::string& what) const;
};

/// Empty if one of the dimensions does not exist.
inline std::optional<Shape> shape_of(const Dataset& set, const Field& field) {
  Shape shape;
  for (const std::string& over : field.over) {
    const auto found = set.dimensions.find(over);
    if (found == set.dimensions.end()) return {};
    append(shape, found->second);
  }
  return shape;
}

/// True if most rows equal the previous row bit for bit: only then is compression worth its time.
/// Varying doubles shrink by a third and take ten times as long.
template <class T>
bool repeats(const std::vector<T>& array, std::size_t width) {
  if (sizeof(T) <= 2) return true;
  std::size_t same = 0;
  for (std::size_t i = width; i < array.size(); ++i)
    same += std::memcmp(&array[i], &array[i - width], sizeof(T)) == 0;
  return same >= array.size() / 4 * 3;
}

/// Whole rows of the last dimensions, up to a quarter of a megabyte.
inline std::vector<std::size_t> chunk_of(const std::vector<std::size_t>& sizes,
                                         std::size_t element) {
  std::size_t left = (std::size_t(1) << 18) / element;
  std::vector<std::size_t> chunk(sizes.size());
  for (std::size_t k = sizes.size(); k-- > 0;) {
    chunk[k] = std::min(sizes[k], std::max<std::size_t>(left, 1));
    left /= chunk[k];
  }
  return chunk;
}

}  // namespace tiltrim::filing
