#include "sweep/map_dataset.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <netcdf.h>
#include <netcdf_mem.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "runtime/whole_file.hpp"

namespace tiltrim::filing {

Dataset::~Dataset() {
  NC_memio memory{};
  // Not nc_abort(): that deletes any file with the name given to the memory image.
  if (id >= 0 && nc_close_memio(id, &memory) == NC_NOERR && owner) std::free(memory.memory);
}

void Dataset::check(int status, const std::string& what) const {
  if (status != NC_NOERR) refuse(name, fmt::format("{}: {}", what, nc_strerror(status)));
}

namespace {

constexpr const char* in_memory = "map";  // placeholder for the file name

template <class T>
constexpr nc_type type_of() {
  if constexpr (std::is_same_v<T, double>) return NC_DOUBLE;
  if constexpr (std::is_same_v<T, std::int8_t>) return NC_BYTE;
  if constexpr (std::is_same_v<T, std::uint8_t>) return NC_UBYTE;
  if constexpr (std::is_same_v<T, std::int16_t>) return NC_SHORT;
  if constexpr (std::is_same_v<T, int>) return NC_INT;
  if constexpr (std::is_same_v<T, std::uint64_t>) return NC_UINT64;
}

}  // namespace

// ---- Writing -----------------------------------------------------------------------------------

void create(Dataset& set) {
  set.owner = true;
  set.check(nc_create_mem(in_memory, NC_NETCDF4, 0, &set.id), "memory");
  set.check(nc_set_fill(set.id, NC_NOFILL, nullptr), "memory");
}

void end_definitions(const Dataset& set, const Puts& puts) {
  set.check(nc_enddef(set.id), "memory");
  for (const auto& put_one : puts) put_one();
}

std::pair<Image, std::size_t> finished(Dataset& set) {
  NC_memio memory{};
  set.check(nc_close_memio(std::exchange(set.id, -1), &memory), "memory");
  return {Image(static_cast<std::byte*>(memory.memory), &std::free), memory.size};
}

static void put_text(const Dataset& set, int variable, const std::string& name,
                     const std::string& text) {
  set.check(nc_put_att_text(set.id, variable, name.c_str(), text.size(), text.data()), name);
}

void put_text(const Dataset& set, const std::string& name, const std::string& text) {
  put_text(set, NC_GLOBAL, name, text);
}

void put_number(const Dataset& set, const std::string& name, int number) {
  set.check(nc_put_att_int(set.id, NC_GLOBAL, name.c_str(), NC_INT, 1, &number), name);
}

void add_dimension(Dataset& set, const std::string& name, std::size_t size) {
  if (size == 0) return;
  int id = -1;
  set.check(nc_def_dim(set.id, name.c_str(), size, &id), name);
  set.dimensions[name] = {{id}, {size}};
}

template <class T>
static void choose_storage(const Dataset& set, int variable, const Shape& shape, const Field& field,
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

static void describe(const Dataset& set, int variable, const Field& field) {
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
static int define(Dataset& set, const Field& field, const Shape& shape,
                  const std::vector<T>& array) {
  int variable = -1;
  set.check(nc_def_var(set.id, field.name.c_str(), type_of<T>(), int(shape.ids.size()),
                       shape.ids.data(), &variable),
            field.name);
  choose_storage(set, variable, shape, field, array);
  describe(set, variable, field);
  return variable;
}

static int define(Dataset& set, const Field& field, Shape shape, const Strings& texts) {
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
static void put(const Dataset& set, int variable, const Field& field, const std::vector<T>& array) {
  set.check(nc_put_var(set.id, variable, array.data()), field.name);
}

static void put(const Dataset& set, int variable, const Field& field, const Strings& texts) {
  std::size_t longest = 1;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  std::string padded;
  for (const std::string& text : texts) {
    padded += text;
    padded.resize(padded.size() + longest - text.size(), '\0');
  }
  set.check(nc_put_var(set.id, variable, padded.data()), field.name);
}

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

template int add(Dataset&, Puts&, const Field&, const std::vector<double>&);
template int add(Dataset&, Puts&, const Field&, const std::vector<int>&);
template int add(Dataset&, Puts&, const Field&, const std::vector<std::int8_t>&);
template int add(Dataset&, Puts&, const Field&, const std::vector<std::uint8_t>&);
template int add(Dataset&, Puts&, const Field&, const std::vector<std::int16_t>&);
template int add(Dataset&, Puts&, const Field&, const std::vector<std::uint64_t>&);
template int add(Dataset&, Puts&, const Field&, const Strings&);

int define_bytes(Dataset& set, const Field& field) {
  const Shape shape = shape_of(set, field).value();
  int variable = -1;
  set.check(nc_def_var(set.id, field.name.c_str(), NC_BYTE, int(shape.ids.size()), shape.ids.data(),
                       &variable),
            field.name);
  const auto chunk = chunk_of(shape.sizes, 1);
  constexpr std::size_t cache = 1 << 20;
  set.check(nc_def_var_chunking(set.id, variable, NC_CHUNKED, chunk.data()), field.name);
  set.check(nc_def_var_deflate(set.id, variable, 0, 1, 1), field.name);
  set.check(nc_set_var_chunk_cache(set.id, variable, cache, 101, 1.0F), field.name);
  describe(set, variable, field);
  return variable;
}

void put_bytes(const Dataset& set, int variable, const std::vector<std::size_t>& start,
               const std::vector<std::size_t>& count, const std::int8_t* bytes) {
  set.check(nc_put_vara_schar(set.id, variable, start.data(), count.data(), bytes), "verdict");
}

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

// HDF5 attributes are limited to 64 KiB: a longer study is stored as a variable.
static constexpr std::size_t longest_attribute = 60'000;

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

// ---- Reading -----------------------------------------------------------------------------------

void open(Dataset& set, std::span<std::byte> content) {
  set.check(nc_open_mem(in_memory, NC_NOWRITE, content.size(), content.data(), &set.id),
            "contents");
}

static std::string attribute(const Dataset& set, int variable, const char* name) {
  std::size_t size = 0;
  set.check(nc_inq_attlen(set.id, variable, name, &size), name);
  std::string text(size, '\0');
  set.check(nc_get_att_text(set.id, variable, name, text.data()), name);
  return text;
}

std::string get_text(const Dataset& set, const std::string& name) {
  return attribute(set, NC_GLOBAL, name.c_str());
}

bool has(const Dataset& set, const std::string& name) {
  return nc_inq_attid(set.id, NC_GLOBAL, name.c_str(), nullptr) == NC_NOERR;
}

int get_number(const Dataset& set, const std::string& name) {
  int found = 0;
  set.check(nc_get_att_int(set.id, NC_GLOBAL, name.c_str(), &found), name);
  return found;
}

std::string get_study(const Dataset& set) {
  if (nc_inq_attid(set.id, NC_GLOBAL, "study", nullptr) == NC_NOERR)
    return attribute(set, NC_GLOBAL, "study");
  int variable = -1, length = -1;
  std::size_t size = 0;
  set.check(nc_inq_varid(set.id, "study", &variable), "study");
  set.check(nc_inq_dimid(set.id, "study_length", &length), "study");
  set.check(nc_inq_dimlen(set.id, length, &size), "study");
  std::string study(size, '\0');
  set.check(nc_get_var_text(set.id, variable, study.data()), "study");
  return study;
}

static std::string dimension_name(const Dataset& set, int dimension) {
  std::array<char, NC_MAX_NAME + 1> name{};
  set.check(nc_inq_dimname(set.id, dimension, name.data()), "a dimension");
  return name.data();
}

static Shape dimension(const Dataset& set, int id) {
  std::size_t size = 0;
  set.check(nc_inq_dimlen(set.id, id, &size), "a dimension");
  return {{id}, {size}};
}

Strings find_dimensions(Dataset& set, const std::string& over) {
  for (const std::string& name : reserved_names())
    if (int id = -1; nc_inq_dimid(set.id, name.c_str(), &id) == NC_NOERR)
      set.dimensions[name] = dimension(set, id);
  int variable = -1, count = 0;
  set.check(nc_inq_varid(set.id, over.c_str(), &variable), over.c_str());
  set.check(nc_inq_varndims(set.id, variable, &count), over.c_str());
  std::vector<int> ids(std::size_t(count), -1);
  set.check(nc_inq_vardimid(set.id, variable, ids.data()), over.c_str());
  Strings axes;
  Shape& point = set.dimensions["point"];
  for (const int id : ids) {
    append(point, dimension(set, id));
    axes.push_back(dimension_name(set, id));
    set.dimensions[axes.back()] = dimension(set, id);
  }
  if (axes.empty() || axes.front() != "condition")
    refuse(set.name, over + ": has no dimension condition");
  axes.erase(axes.begin());
  return axes;
}

// The variable, if it has the expected type and dimensions.
static int find_variable(const Dataset& set, const Field& field, nc_type type, const Shape& shape,
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
    refuse(set.name, fmt::format("{}: has another type or other dimensions", field.name));
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

template void get(const Dataset&, const Field&, std::vector<double>&);
template void get(const Dataset&, const Field&, std::vector<int>&);
template void get(const Dataset&, const Field&, std::vector<std::int8_t>&);
template void get(const Dataset&, const Field&, std::vector<std::uint8_t>&);
template void get(const Dataset&, const Field&, std::vector<std::int16_t>&);
template void get(const Dataset&, const Field&, std::vector<std::uint64_t>&);

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
    column.name = attribute(set, variable, "study_key");
    column.unit = attribute(set, variable, "study_unit");
    column.signal = attribute(set, variable, "signal");
    column.si = column.values;
    if (nc_inq_attid(set.id, variable, "si", nullptr) == NC_NOERR)
      get(set, Field{attribute(set, variable, "si"), over, ""}, column.si);
    axis.columns.push_back(column);
    if (nc_inq_attid(set.id, variable, "next", nullptr) != NC_NOERR) break;
    name = attribute(set, variable, "next");
  }
  return axis;
}

int find_bytes(const Dataset& set, const Field& field) {
  Shape none;
  return find_variable(set, field, NC_BYTE, shape_of(set, field).value(), none);
}

void get_bytes(const Dataset& set, int variable, const std::vector<std::size_t>& start,
               const std::vector<std::size_t>& count, std::int8_t* bytes) {
  set.check(nc_get_vara_schar(set.id, variable, start.data(), count.data(), bytes), "verdict");
}

}  // namespace tiltrim::filing
