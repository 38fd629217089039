// Maps as the variables of their files, in both directions, and the files.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <type_traits>

#include "python/src/calls.hpp"
#include "python/src/convert.hpp"
#include "python/src/sweeps.hpp"
#include "python/src/verbs.hpp"
#include "sweep/map_fields.hpp"

namespace tiltrim::python {

namespace {

using filing::Strings;

/// name, key, unit, unit in UDUNITS, signal, values, name of the SI values (or empty), SI values
using ColumnTuple = std::tuple<std::string, std::string, std::string, std::string, std::string,
                               py::array_t<double>, std::string, py::array_t<double>>;
using NamedColumns = std::tuple<std::string, std::vector<ColumnTuple>>;

template <class T>
py::object values_of(const std::vector<T>& values) {
  if constexpr (std::is_same_v<T, std::string>)
    return py::cast(values);
  else
    return array_of(values);
}

template <class T>
std::vector<T> vector_of(const py::array_t<T, py::array::c_style | py::array::forcecast>& array) {
  return {array.data(), array.data() + array.size()};
}

template <class T>
void take(const py::handle& given, std::vector<T>& values) {
  if constexpr (std::is_same_v<T, std::string>)
    values = given.cast<Strings>();
  else
    values = vector_of(given.cast<py::array_t<T, py::array::c_style | py::array::forcecast>>());
}

std::vector<NamedColumns> columns_of(const SweepMap& map) {
  const auto names = filing::column_names(map.axes);
  std::vector<NamedColumns> axes;
  for (std::size_t a = 0; a < map.axes.size(); ++a) {
    std::vector<ColumnTuple> columns;
    for (std::size_t c = 0; c < map.axes[a].columns.size(); ++c) {
      const SweepAxis::Column& column = map.axes[a].columns[c];
      columns.emplace_back(names[a][c].own, column.name, column.unit, filing::udunits(column.unit),
                           column.signal, array_of(column.values), names[a][c].si,
                           array_of(column.si));
    }
    axes.emplace_back(map.axes[a].name, columns);
  }
  return axes;
}

SweepMap map_of(const py::dict& d) {
  SweepMap map;
  filing::Lists lists;
  map.study = d["study"].cast<std::string>();
  map.program = d["program"].cast<std::string>();
  map.instruction_set = d["instruction_set"].cast<std::string>();
  map.polar = d["polar"].cast<std::string>();
  for (const auto& [name, columns] : d["axes"].cast<std::vector<NamedColumns>>()) {
    SweepAxis& axis = map.axes.emplace_back(SweepAxis{name, {}});
    for (const auto& [own, key, unit, units, signal, values, si_name, si] : columns)
      axis.columns.push_back({key, unit, signal, vector_of<double>(values), vector_of<double>(si)});
  }
  const py::dict fields = d["fields"];
  filing::each_field(map, lists, [&](const filing::Field& field, auto& array) {
    take(fields[field.name.c_str()], array);
  });
  try {
    filing::check_parts(map, lists);
  } catch (const std::runtime_error& e) {
    throw std::invalid_argument(fmt::format("save(): not a whole map: {}", e.what()));
  }
  filing::put_back(lists, map);
  return map;
}

// Python's exception for a file.
template <class Work>
auto with_file(const Work& work) {
  try {
    return run(false, work, Lasts::a_moment).first;
  } catch (const std::runtime_error& e) {
    PyErr_SetString(PyExc_OSError, e.what());
    throw py::error_already_set();
  }
}

py::dict opened_map(const std::string& file) {
  return dict_of(with_file([&](const std::stop_token&) { return read_netcdf(file); }));
}

void saved(const py::dict& d, const std::string& file) {
  const SweepMap map = map_of(d);
  with_file([&](const std::stop_token&) {
    write_netcdf(map, file);
    return true;
  });
}

}  // namespace

static py::dict fields_of(const SweepMap& map) {
  const filing::Lists lists = filing::lists_of(map);
  py::dict fields;
  filing::each_field(map, lists, [&](const filing::Field& f, const auto& array) {
    fields[f.name.c_str()] = py::make_tuple(f.over, f.long_name, f.units, f.flags, bool(f.nothing),
                                            f.scale.value_or(0.0), values_of(array));
  });
  return fields;
}

py::dict dict_of(const SweepMap& map) {
  py::dict d;
  d["fields"] = fields_of(map);
  d["axes"] = columns_of(map);
  d["study"] = map.study;
  d["program"] = map.program;
  d["instruction_set"] = map.instruction_set;
  d["polar"] = map.polar;
  return d;
}

void add_map_files(py::module_& module) {
  module.def("map_fields", [] { return fields_of({}); });
  module.def("open_map", &opened_map, py::arg("file"));
  module.def("save_map", &saved, py::arg("map"), py::arg("file"));
}

}  // namespace tiltrim::python
