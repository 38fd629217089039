#include "sweep/map_file.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <netcdf.h>
#include <netcdf_mem.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "runtime/checksum.hpp"
#include "runtime/whole_file.hpp"
#include "sweep/map_fields.hpp"

namespace tiltrim {

// The file is built in memory and written by us: HDF5 does not survive a full disk, cannot say that
// it was one, and gives wrong numbers or crashes on a damaged file. So a checksum of all of it
// stands behind the NetCDF part, where its readers do not look.

namespace {

using namespace filing;

constexpr int map_format = 1;
constexpr std::string_view seal = "tiltmap\n";  // then the checksum, at the end of the file

// ---- Between a map and its lists ---------------------------------------------------------------

Lists lists_of(const SweepMap& map) {
  Lists l;
  for (const SweepAxis& axis : map.axes) l.axis_name.push_back(axis.name);
  for (const Strings& names : map.mode_names)
    l.mode_name.insert(l.mode_name.end(), names.begin(), names.end());
  const auto signals = [](const Signals& from, Strings& names, Strings& units,
                          std::vector<double>& nominal) {
    for (const Signal& s : from) {
      names.push_back(s.name);
      units.push_back(s.unit);
      nominal.push_back(s.nominal);
    }
  };
  signals(map.states, l.state_name, l.state_unit, l.state_nominal);
  signals(map.inputs, l.input_name, l.input_unit, l.input_nominal);
  for (const AxisCrossing& x : map.crossings) {
    auto& c = l.crossing;
    c.condition.push_back(x.condition);
    c.axis.push_back(x.axis);
    c.at.insert(c.at.end(), x.at.begin(), x.at.end());
    c.error.push_back(x.error);
    c.kind.push_back(std::int8_t(x.kind));
    c.unstable_before.push_back(x.unstable_before);
    c.unstable_after.push_back(x.unstable_after);
    c.frequency.push_back(x.frequency);
    c.mode.push_back(x.mode);
    c.mode_name.push_back(x.mode_name);
  }
  for (const AxisInterval& x : map.intervals) {
    auto& i = l.interval;
    i.condition.push_back(x.condition);
    i.axis.push_back(x.axis);
    i.at.insert(i.at.end(), x.at.begin(), x.at.end());
    i.from.push_back(x.from);
    i.to.push_back(x.to);
    i.verdict.push_back(std::int8_t(x.verdict));
    i.unstable.push_back(x.unstable);
    i.abscissa.push_back(x.abscissa);
    i.abscissa_at.push_back(x.abscissa_at);
  }
  return l;
}

std::vector<double> row(const std::vector<double>& all, std::size_t k, std::size_t width) {
  return {all.begin() + std::ptrdiff_t(k * width), all.begin() + std::ptrdiff_t((k + 1) * width)};
}

void put_back(const Lists& l, SweepMap& map) {
  for (std::size_t k = 0; k < l.axis_name.size(); ++k) map.axes[k].name = l.axis_name[k];
  for (std::size_t k = 0; k < l.state_name.size(); ++k)
    map.states.push_back({l.state_name[k], l.state_unit[k], l.state_nominal[k]});
  for (std::size_t k = 0; k < l.input_name.size(); ++k)
    map.inputs.push_back({l.input_name[k], l.input_unit[k], l.input_nominal[k]});
  for (std::size_t k = 0; k < map.conditions.size(); ++k) {
    const auto from = l.mode_name.begin() + std::ptrdiff_t(k * map.modes());
    map.mode_names.emplace_back(from, from + std::ptrdiff_t(map.modes()));
  }
  const std::size_t axes = map.axes.size();
  for (std::size_t k = 0; k < l.crossing.condition.size(); ++k) {
    const auto& c = l.crossing;
    map.crossings.push_back({c.condition[k], c.axis[k], row(c.at, k, axes), c.error[k],
                             CrossingKind(c.kind[k]), c.unstable_before[k], c.unstable_after[k],
                             c.frequency[k], c.mode[k], c.mode_name[k]});
  }
  for (std::size_t k = 0; k < l.interval.condition.size(); ++k) {
    const auto& i = l.interval;
    map.intervals.push_back({i.condition[k], i.axis[k], row(i.at, k, axes), i.from[k], i.to[k],
                             IntervalVerdict(i.verdict[k]), i.unstable[k], i.abscissa[k],
                             i.abscissa_at[k]});
  }
}

// ---- Names and units -------------------------------------------------------------------------

// A NetCDF name out of anything: letters, digits and _ stay, the rest becomes _.
std::string netcdf_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    const bool kept = (u >= '0' && u <= '9') || (u >= 'A' && u <= 'Z') || (u >= 'a' && u <= 'z');
    name += kept ? c : '_';
  }
  if (name.size() > 100) name.resize(100);
  return name.empty() || (name[0] >= '0' && name[0] <= '9') ? "_" + name : name;
}

// Units as UDUNITS spells them: "m/s" -> "m s-1", "rad/s²" -> "rad s-2", "degrees" -> "degree".
std::string udunits(const std::string& unit) {
  if (unit.empty()) return "1";
  std::string answer;
  bool below = false;  // behind the stroke
  for (std::size_t i = 0; i < unit.size();) {
    const std::size_t end = std::min(unit.find_first_of(" /*", i), unit.size());
    std::string word = unit.substr(i, end - i);
    for (const auto& [super, digit] : {std::pair("²", "2"), {"³", "3"}, {"^", ""}})
      if (const auto at = word.find(super); at != std::string::npos)
        word.replace(at, std::strlen(super), digit);
    const bool powered = !word.empty() && word.back() >= '0' && word.back() <= '9';
    if (below && powered) word.insert(word.find_first_of("0123456789"), "-");
    if (below && !powered) word += "-1";
    if (word == "degrees") word = "degree";
    if (word != "1" && !word.empty()) answer += (answer.empty() ? "" : " ") + word;
    if (end < unit.size()) below = unit[end] == '/';
    i = end + 1;
  }
  return answer;
}

std::string last_part(const std::string& name) { return name.substr(name.rfind('.') + 1); }

// The file's own variables and dimensions.
std::set<std::string> reserved_names() {
  SweepMap map;
  Lists lists;
  std::set<std::string> names{"study", "study_length"};
  each_field(map, lists, [&](const Field& field, const auto&) {
    names.insert(field.over.begin(), field.over.end());
    names.insert({field.name, field.name + "_length"});
  });
  return names;
}

// `text` as a name, with _2, _3, ... behind it where that is taken.
std::string give(std::set<std::string>& taken, const std::string& text) {
  const std::string first = netcdf_name(text);
  std::string name = first;
  for (int k = 2; !taken.insert(name).second; ++k) name = fmt::format("{}_{}", first, k);
  return name;
}

struct ColumnNames {
  std::string own;
  std::string si;  ///< empty where the values are SI already
};

/// [axis][column]; the first column's is the dimension's, too.
std::vector<std::vector<ColumnNames>> column_names(const std::vector<SweepAxis>& axes) {
  auto taken = reserved_names();
  std::vector<std::vector<ColumnNames>> names;
  for (const SweepAxis& axis : axes) names.push_back({{give(taken, axis.name), ""}});
  for (std::size_t a = 0; a < axes.size(); ++a)
    for (std::size_t c = 1; c < axes[a].columns.size(); ++c)
      names[a].push_back({give(taken, last_part(axes[a].columns[c].name)), ""});
  for (std::size_t a = 0; a < axes.size(); ++a)
    for (std::size_t c = 0; c < axes[a].columns.size(); ++c)
      if (axes[a].columns[c].si != axes[a].columns[c].values)
        names[a][c].si = give(taken, names[a][c].own + "_si");
  return names;
}

// ---- Writing -----------------------------------------------------------------------------------

struct Shape {
  std::vector<int> ids;
  std::vector<std::size_t> sizes;
  std::size_t size() const {
    return std::accumulate(sizes.begin(), sizes.end(), std::size_t(1), std::multiplies<>());
  }
};

constexpr const char* in_memory = "map";  // a name, where the library asks for a file's

void append(Shape& shape, const Shape& further) {
  shape.ids.insert(shape.ids.end(), further.ids.begin(), further.ids.end());
  shape.sizes.insert(shape.sizes.end(), further.sizes.begin(), further.sizes.end());
}

/// An open NetCDF file; `name` stands in messages.
struct Dataset {
  std::filesystem::path name;
  int id = -1;
  bool owner = false;                         ///< of the memory it is in
  std::map<std::string, Shape> dimensions{};  ///< and "point"
  std::string at_points{};                    ///< coordinates of everything over "point"

  explicit Dataset(const std::filesystem::path& file) : name(file) {}
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;
  ~Dataset() {
    NC_memio memory{};
    // Not nc_abort(): that deletes a file of the name that was given for what is in memory.
    if (id >= 0 && nc_close_memio(id, &memory) == NC_NOERR && owner) std::free(memory.memory);
  }
  void check(int status, const std::string& what) const {
    if (status != NC_NOERR) refuse(name, fmt::format("{}: {}", what, nc_strerror(status)));
  }
};

template <class T>
constexpr nc_type type_of() {
  if constexpr (std::is_same_v<T, double>) return NC_DOUBLE;
  if constexpr (std::is_same_v<T, std::int8_t>) return NC_BYTE;
  if constexpr (std::is_same_v<T, std::uint8_t>) return NC_UBYTE;
  if constexpr (std::is_same_v<T, std::int16_t>) return NC_SHORT;
  if constexpr (std::is_same_v<T, int>) return NC_INT;
  if constexpr (std::is_same_v<T, std::uint64_t>) return NC_UINT64;
}

void put_text(const Dataset& set, int variable, const std::string& name, const std::string& text) {
  set.check(nc_put_att_text(set.id, variable, name.c_str(), text.size(), text.data()), name);
}

// A dimension of no length does not exist: what lies over it is not written.
void add_dimension(Dataset& set, const std::string& name, std::size_t size) {
  if (size == 0) return;
  int id = -1;
  set.check(nc_def_dim(set.id, name.c_str(), size, &id), name);
  set.dimensions[name] = {{id}, {size}};
}

void define_dimensions(Dataset& set, const SweepMap& map,
                       const std::vector<std::vector<ColumnNames>>& names) {
  add_dimension(set, "condition", map.conditions.size());
  set.dimensions["point"] = set.dimensions["condition"];
  for (std::size_t a = 0; a < map.axes.size(); ++a) {
    add_dimension(set, names[a].front().own, map.axes[a].size());
    append(set.dimensions["point"], set.dimensions[names[a].front().own]);
  }
  add_dimension(set, "axis", map.axes.size());
  add_dimension(set, "state", map.states.size());
  add_dimension(set, "input", map.inputs.size());
  add_dimension(set, "mode", map.modes());
  add_dimension(set, "distinct_reason", map.reasons.size());
  add_dimension(set, "second", map.second.points.size());
  add_dimension(set, "crossing", map.crossings.size());
  add_dimension(set, "interval", map.intervals.size());
}

/// Nothing if one of the dimensions does not exist.
std::optional<Shape> shape_of(const Dataset& set, const Field& field) {
  Shape shape;
  for (const std::string& over : field.over) {
    const auto found = set.dimensions.find(over);
    if (found == set.dimensions.end()) return {};
    append(shape, found->second);
  }
  return shape;
}

// Whether most rows are those before them, bit for bit: only then is deflating worth its time.
// Doubles that vary lose a third of their size and take ten times as long.
template <class T>
bool repeats(const std::vector<T>& array, std::size_t width) {
  if (sizeof(T) <= 2) return true;
  std::size_t same = 0;
  for (std::size_t i = width; i < array.size(); ++i)
    same += std::memcmp(&array[i], &array[i - width], sizeof(T)) == 0;
  return same >= array.size() / 4 * 3;
}

// Whole rows of the last dimensions, up to a quarter of a megabyte.
std::vector<std::size_t> chunk_of(const std::vector<std::size_t>& sizes, std::size_t element) {
  std::size_t left = (std::size_t(1) << 18) / element;
  std::vector<std::size_t> chunk(sizes.size());
  for (std::size_t k = sizes.size(); k-- > 0;) {
    chunk[k] = std::min(sizes[k], std::max<std::size_t>(left, 1));
    left /= chunk[k];
  }
  return chunk;
}

template <class T>
void choose_storage(const Dataset& set, int variable, const Shape& shape, const Field& field,
                    const std::vector<T>& array) {
  constexpr std::size_t small = 1 << 14, cache = 1 << 20;  // bytes
  const bool rows = field.over.size() > 1;
  if (array.size() * sizeof(T) < small || !repeats(array, rows ? shape.sizes.back() : 1)) {
    set.check(nc_def_var_chunking(set.id, variable, NC_CONTIGUOUS, nullptr), field.name);
    return;
  }
  const auto chunk = chunk_of(shape.sizes, sizeof(T));
  set.check(nc_def_var_chunking(set.id, variable, NC_CHUNKED, chunk.data()), field.name);
  set.check(nc_def_var_deflate(set.id, variable, sizeof(T) > 1, 1, 1), field.name);
  set.check(nc_set_var_chunk_cache(set.id, variable, cache, 101, 1.0F), field.name);
}

void describe(const Dataset& set, int variable, const Field& field) {
  put_text(set, variable, "long_name", field.long_name);
  if (!field.units.empty()) put_text(set, variable, "units", field.units);
  if (field.nothing)
    set.check(nc_def_var_fill(set.id, variable, NC_FILL, &*field.nothing), field.name);
  if (field.scale)
    set.check(nc_put_att_double(set.id, variable, "scale_factor", NC_DOUBLE, 1, &*field.scale),
              field.name);
  if (!field.flags.empty()) {
    std::vector<signed char> values(field.flags.size());
    std::iota(values.begin(), values.end(), static_cast<signed char>(0));
    set.check(
        nc_put_att_schar(set.id, variable, "flag_values", NC_BYTE, values.size(), values.data()),
        field.name);
    put_text(set, variable, "flag_meanings", fmt::format("{}", fmt::join(field.flags, " ")));
  }
  if (field.over.front() != "point") return;
  std::string coordinates = set.at_points;
  if (field.over.size() > 1) coordinates += fmt::format(" {}_name", field.over.back());
  put_text(set, variable, "coordinates", coordinates);
}

template <class T>
int define(Dataset& set, const Field& field, const Shape& shape, const std::vector<T>& array) {
  int variable = -1;
  set.check(nc_def_var(set.id, field.name.c_str(), type_of<T>(), int(shape.ids.size()),
                       shape.ids.data(), &variable),
            field.name);
  choose_storage(set, variable, shape, field, array);
  describe(set, variable, field);
  return variable;
}

int define(Dataset& set, const Field& field, Shape shape, const Strings& texts) {
  std::size_t longest = 1;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  int length = -1, variable = -1;
  set.check(nc_def_dim(set.id, (field.name + "_length").c_str(), longest, &length), field.name);
  shape.ids.push_back(length);
  set.check(nc_def_var(set.id, field.name.c_str(), NC_CHAR, int(shape.ids.size()), shape.ids.data(),
                       &variable),
            field.name);
  set.check(nc_def_var_chunking(set.id, variable, NC_CONTIGUOUS, nullptr), field.name);
  describe(set, variable, field);
  put_text(set, variable, "_Encoding", "utf-8");
  return variable;
}

template <class T>
void put(const Dataset& set, int variable, const Field& field, const std::vector<T>& array) {
  set.check(nc_put_var(set.id, variable, array.data()), field.name);
}

void put(const Dataset& set, int variable, const Field& field, const Strings& texts) {
  std::size_t longest = 1;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  std::string padded;
  for (const std::string& text : texts) {
    padded += text;
    padded.resize(padded.size() + longest - text.size(), '\0');
  }
  set.check(nc_put_var(set.id, variable, padded.data()), field.name);
}

/// What is left to do when all is defined.
using Puts = std::vector<std::function<void()>>;

// Defines the variable and leaves its values to be put.
template <class T>
int add(Dataset& set, Puts& puts, const Field& field, const std::vector<T>& array) {
  const auto shape = shape_of(set, field);
  if (array.size() != (shape ? shape->size() : 0))
    throw std::invalid_argument(fmt::format("write_netcdf: {} numbers in {} for a map of {}",
                                            array.size(), field.name, shape ? shape->size() : 0));
  if (!shape) return -1;
  const int variable = define(set, field, *shape, array);
  puts.push_back([&set, &array, field, variable] { put(set, variable, field, array); });
  return variable;
}

// The axis's coordinate, the columns that move with it, and their values in SI where those differ.
void add_axis(Dataset& set, Puts& puts, const SweepAxis& axis,
              const std::vector<ColumnNames>& names) {
  const Strings over{names.front().own};
  for (std::size_t c = 0; c < names.size(); ++c) {
    const SweepAxis::Column& column = axis.columns[c];
    const int variable =
        add(set, puts, {names[c].own, over, column.name, udunits(column.unit)}, column.values);
    put_text(set, variable, "study_key", column.name);
    put_text(set, variable, "study_unit", column.unit);
    put_text(set, variable, "signal", column.signal);
    if (c + 1 < names.size()) put_text(set, variable, "next", names[c + 1].own);
    if (names[c].si.empty()) continue;
    put_text(set, variable, "si", names[c].si);
    add(set, puts, {names[c].si, over, column.name + " in SI units"}, column.si);
  }
}

// HDF5 takes attributes of up to 64 KiB: a longer study is a variable.
constexpr std::size_t longest_attribute = 60'000;

void add_study(const Dataset& set, Puts& puts, const std::string& study) {
  if (study.size() <= longest_attribute) return put_text(set, NC_GLOBAL, "study", study);
  int length = -1, variable = -1;
  set.check(nc_def_dim(set.id, "study_length", study.size(), &length), "study");
  set.check(nc_def_var(set.id, "study", NC_CHAR, 1, &length, &variable), "study");
  put_text(set, variable, "long_name", "the study file's text");
  put_text(set, variable, "_Encoding", "utf-8");
  puts.push_back([&set, &study, variable] {
    set.check(nc_put_var_text(set.id, variable, study.data()), "study");
  });
}

void define_globals(const Dataset& set, const SweepMap& map) {
  put_text(set, NC_GLOBAL, "Conventions", "CF-1.8");
  put_text(set, NC_GLOBAL, "title", "Equilibria and their eigenvalues over a grid");
  put_text(set, NC_GLOBAL, "program", map.program);
  put_text(set, NC_GLOBAL, "instruction_set", map.instruction_set);
  set.check(nc_put_att_int(set.id, NC_GLOBAL, "format_version", NC_INT, 1, &map_format), "format");
}

// Throws unless there is memory for a copy of the map: neither library below survives the lack of
// it half way.
void check_memory(const SweepMap& map, const std::filesystem::path& file) {
  constexpr std::size_t others = std::size_t(16) << 20;  // caches, what belongs to no point
  std::size_t bytes = others;
  each_over_points(
      map, [&](const Field&, const auto& array) { bytes += array.size() * sizeof(array[0]); });
  bytes += bytes / 8;
  void* room = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (room == MAP_FAILED) refuse(file, errno);
  ::munmap(room, bytes);
}

using Image = std::unique_ptr<std::byte, decltype(&std::free)>;

/// The map as the bytes of a NetCDF-4 file, and how many.
std::pair<Image, std::size_t> image_of(const SweepMap& map, const std::filesystem::path& file) {
  const Lists lists = lists_of(map);
  const auto names = column_names(map.axes);
  Dataset set(file);
  set.owner = true;
  set.check(nc_create_mem(in_memory, NC_NETCDF4, 0, &set.id), "memory");
  set.check(nc_set_fill(set.id, NC_NOFILL, nullptr), "memory");
  define_dimensions(set, map, names);
  define_globals(set, map);
  set.at_points = "condition_name";
  for (const auto& columns : names)
    for (std::size_t c = 1; c < columns.size(); ++c) set.at_points += " " + columns[c].own;
  Puts puts;
  add_study(set, puts, map.study);
  for (std::size_t a = 0; a < names.size(); ++a) add_axis(set, puts, map.axes[a], names[a]);
  each_field(map, lists,
             [&](const Field& field, const auto& array) { add(set, puts, field, array); });
  set.check(nc_enddef(set.id), "memory");
  for (const auto& put_one : puts) put_one();
  NC_memio memory{};
  set.check(nc_close_memio(std::exchange(set.id, -1), &memory), "memory");
  return {Image(static_cast<std::byte*>(memory.memory), &std::free), memory.size};
}

// ---- Reading -----------------------------------------------------------------------------------

// The NetCDF part of the file, once the checksum behind it has been found and holds.
std::span<std::byte> unsealed(std::vector<std::byte>& bytes, const std::filesystem::path& file) {
  constexpr std::array<unsigned char, 8> hdf5{0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n'};
  if (bytes.size() < hdf5.size() || std::memcmp(bytes.data(), hdf5.data(), hdf5.size()) != 0)
    refuse(file, "is not a NetCDF-4 file");
  constexpr std::size_t behind = seal.size() + sizeof(std::uint64_t);
  const std::size_t size = bytes.size() - std::min(bytes.size(), behind);
  if (size == 0 || std::memcmp(bytes.data() + size, seal.data(), seal.size()) != 0)
    refuse(file, "is not a map as it was written: cut off, or changed by another program");
  std::uint64_t expected = 0;
  std::memcpy(&expected, bytes.data() + size + seal.size(), sizeof expected);
  if (checksum(std::span(bytes).first(size + seal.size())) != expected)
    refuse(file, "is damaged: its checksum does not hold");
  return std::span(bytes).first(size);
}

std::string get_text(const Dataset& set, int variable, const char* name) {
  std::size_t size = 0;
  set.check(nc_inq_attlen(set.id, variable, name, &size), name);
  std::string text(size, '\0');
  set.check(nc_get_att_text(set.id, variable, name, text.data()), name);
  return text;
}

std::string get_study(const Dataset& set) {
  if (nc_inq_attid(set.id, NC_GLOBAL, "study", nullptr) == NC_NOERR)
    return get_text(set, NC_GLOBAL, "study");
  int variable = -1, length = -1;
  std::size_t size = 0;
  set.check(nc_inq_varid(set.id, "study", &variable), "study");
  set.check(nc_inq_dimid(set.id, "study_length", &length), "study");
  set.check(nc_inq_dimlen(set.id, length, &size), "study");
  std::string study(size, '\0');
  set.check(nc_get_var_text(set.id, variable, study.data()), "study");
  return study;
}

std::string dimension_name(const Dataset& set, int dimension) {
  std::array<char, NC_MAX_NAME + 1> name{};
  set.check(nc_inq_dimname(set.id, dimension, name.data()), "a dimension");
  return name.data();
}

Shape dimension(const Dataset& set, int id) {
  std::size_t size = 0;
  set.check(nc_inq_dimlen(set.id, id, &size), "a dimension");
  return {{id}, {size}};
}

// The dimensions of the file; those of the axes are what lies between condition and the end in
// status. Returns their names.
Strings find_dimensions(Dataset& set) {
  for (const std::string& name : reserved_names())
    if (int id = -1; nc_inq_dimid(set.id, name.c_str(), &id) == NC_NOERR)
      set.dimensions[name] = dimension(set, id);
  int variable = -1, count = 0;
  set.check(nc_inq_varid(set.id, "status", &variable), "status");
  set.check(nc_inq_varndims(set.id, variable, &count), "status");
  std::vector<int> ids(std::size_t(count), -1);
  set.check(nc_inq_vardimid(set.id, variable, ids.data()), "status");
  Strings axes;
  Shape& point = set.dimensions["point"];
  for (const int id : ids) {
    append(point, dimension(set, id));
    axes.push_back(dimension_name(set, id));
    set.dimensions[axes.back()] = dimension(set, id);
  }
  if (axes.empty() || axes.front() != "condition") refuse(set.name, "status: not over condition");
  axes.erase(axes.begin());
  return axes;
}

// The variable, when it is of the type and over the dimensions that are expected.
int find_variable(const Dataset& set, const Field& field, nc_type type, const Shape& shape,
                  Shape& text) {
  int id = -1, count = 0;
  nc_type found = NC_NAT;
  set.check(nc_inq_varid(set.id, field.name.c_str(), &id), field.name);
  set.check(nc_inq_var(set.id, id, nullptr, &found, &count, nullptr, nullptr), field.name);
  std::vector<int> ids(std::size_t(count), -1);
  set.check(nc_inq_vardimid(set.id, id, ids.data()), field.name);
  if (type == NC_CHAR && !ids.empty()) {
    text = dimension(set, ids.back());
    ids.pop_back();
  }
  if (found != type || ids != shape.ids)
    refuse(set.name, fmt::format("{}: is of another type or over other dimensions", field.name));
  return id;
}

template <class T>
void get(const Dataset& set, const Field& field, std::vector<T>& array) {
  const auto shape = shape_of(set, field);
  if (!shape) return;
  Shape none;
  const int variable = find_variable(set, field, type_of<T>(), *shape, none);
  array.resize(shape->size());
  set.check(nc_get_var(set.id, variable, array.data()), field.name);
}

void get(const Dataset& set, const Field& field, Strings& texts) {
  const auto shape = shape_of(set, field);
  if (!shape) return;
  Shape length;
  const int variable = find_variable(set, field, NC_CHAR, *shape, length);
  std::string padded(shape->size() * length.size(), '\0');
  set.check(nc_get_var_text(set.id, variable, padded.data()), field.name);
  for (std::size_t k = 0; k < shape->size(); ++k) {
    const std::string text = padded.substr(k * length.size(), length.size());
    texts.push_back(text.substr(0, text.find_last_not_of('\0') + 1));
  }
}

SweepAxis get_axis(const Dataset& set, const std::string& dimension_of_it) {
  SweepAxis axis;
  constexpr int most = 100;  // columns
  std::string name = dimension_of_it;
  for (int c = 0; c < most; ++c) {
    SweepAxis::Column column;
    const Strings over{dimension_of_it};
    int variable = -1;
    get(set, Field{name, over, ""}, column.values);
    set.check(nc_inq_varid(set.id, name.c_str(), &variable), name);
    column.name = get_text(set, variable, "study_key");
    column.unit = get_text(set, variable, "study_unit");
    column.signal = get_text(set, variable, "signal");
    column.si = column.values;
    if (nc_inq_attid(set.id, variable, "si", nullptr) == NC_NOERR)
      get(set, Field{get_text(set, variable, "si"), over, ""}, column.si);
    axis.columns.push_back(column);
    if (nc_inq_attid(set.id, variable, "next", nullptr) != NC_NOERR) break;
    name = get_text(set, variable, "next");
  }
  return axis;
}

void get_globals(const Dataset& set, SweepMap& map) {
  int found = 0;
  set.check(nc_get_att_int(set.id, NC_GLOBAL, "format_version", &found), "format_version");
  if (found != map_format)
    refuse(set.name, fmt::format("is of another format, {} in place of {}", found, map_format));
  map.program = get_text(set, NC_GLOBAL, "program");
  map.instruction_set = get_text(set, NC_GLOBAL, "instruction_set");
  map.study = get_study(set);
}

SweepMap read_map(const std::filesystem::path& file) {
  std::vector<std::byte> bytes = read_whole(file);
  const auto content = unsealed(bytes, file);
  Dataset set(file);
  set.check(nc_open_mem(in_memory, NC_NOWRITE, content.size(), content.data(), &set.id),
            "contents");
  SweepMap map;
  Lists lists;
  get_globals(set, map);
  for (const std::string& axis : find_dimensions(set)) map.axes.push_back(get_axis(set, axis));
  each_field(map, lists, [&](const Field& field, auto& array) { get(set, field, array); });
  put_back(lists, map);
  return map;
}

}  // namespace

void write_netcdf(const SweepMap& map, const std::filesystem::path& file) {
  check_memory(map, file);
  const auto [image, size] = image_of(map, file);
  const std::span<const std::byte> content(image.get(), size);
  std::array<std::byte, seal.size() + sizeof(std::uint64_t)> behind{};
  std::memcpy(behind.data(), seal.data(), seal.size());
  const std::uint64_t sum = checksum(std::span(behind).first(seal.size()), checksum(content));
  std::memcpy(behind.data() + seal.size(), &sum, sizeof sum);
  write_whole(file, {content, behind});
}

SweepMap read_netcdf(const std::filesystem::path& file) {
  try {
    return read_map(file);
  } catch (const std::bad_alloc&) {
    refuse(file, ENOMEM);
  }
}

}  // namespace tiltrim
