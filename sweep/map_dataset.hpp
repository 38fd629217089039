/// An open NetCDF file, its dimensions, and how arrays over them are stored. The NetCDF header is
/// included in one source only. Internal to sweep/.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
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

using Image = std::unique_ptr<std::byte, decltype(&std::free)>;
/// Deferred writes, run after all definitions.
using Puts = std::vector<std::function<void()>>;

/// Begins a file in memory.
void create(Dataset& set);
/// A dimension of length zero is not created: variables over it are not written.
void add_dimension(Dataset& set, const std::string& name, std::size_t size);
/// Global attributes.
void put_text(const Dataset& set, const std::string& name, const std::string& text);
void put_number(const Dataset& set, const std::string& name, int number);
/// Defines the variable and defers writing its values, which must outlive `puts`. For the types of
/// each_field(); -1 if it has no values.
template <class T>
int add(Dataset& set, Puts& puts, const Field& field, const std::vector<T>& array);
/// The axis's coordinate, the columns that change with it, and their SI values if different.
void add_axis(Dataset& set, Puts& puts, const SweepAxis& axis,
              const std::vector<ColumnNames>& names);
void add_study(const Dataset& set, Puts& puts, const std::string& study);
/// A variable of bytes that is written in pieces, deflated.
int define_bytes(Dataset& set, const Field& field);
void end_definitions(const Dataset& set, const Puts& puts);
void put_bytes(const Dataset& set, int variable, const std::vector<std::size_t>& start,
               const std::vector<std::size_t>& count, const std::int8_t* bytes);
/// The bytes of the file and their number.
std::pair<Image, std::size_t> finished(Dataset& set);

void open(Dataset& set, std::span<std::byte> content);
bool has(const Dataset& set, const std::string& name);  ///< a global attribute
std::string get_text(const Dataset& set, const std::string& name);
int get_number(const Dataset& set, const std::string& name);
std::string get_study(const Dataset& set);
/// Finds the dimensions of the file; the axes are those of variable `over` after the condition.
/// Returns their names.
Strings find_dimensions(Dataset& set, const std::string& over);
template <class T>
void get(const Dataset& set, const Field& field, std::vector<T>& array);
void get(const Dataset& set, const Field& field, Strings& texts);
SweepAxis get_axis(const Dataset& set, const std::string& dimension_of_it);
/// A piece of a variable of bytes over these dimensions.
int find_bytes(const Dataset& set, const Field& field);
void get_bytes(const Dataset& set, int variable, const std::vector<std::size_t>& start,
               const std::vector<std::size_t>& count, std::int8_t* bytes);

}  // namespace tiltrim::filing
