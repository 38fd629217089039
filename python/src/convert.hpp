/// Values to and from Python: plain tuples, dictionaries and numpy arrays.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "linearize/modes.hpp"
#include "model/model.hpp"
#include "trim/trim.hpp"

namespace tiltrim::python {

namespace py = pybind11;

using SignalTuple = std::tuple<std::string, std::string, double>;  ///< name, unit, nominal
using PointTuple = std::tuple<Eigen::VectorXd, Eigen::VectorXd, Eigen::VectorXd>;  ///< x, u, p
using RangeTuple = std::tuple<double, double>;
using EffortTuple = std::tuple<std::string, double, double>;  ///< signal, scale, reference

Signals signals_of(const std::vector<SignalTuple>& tuples);
std::vector<SignalTuple> tuples_of(const Signals& signals);

inline OperatingPoint point_of(const PointTuple& point) {
  return {std::get<0>(point), std::get<1>(point), std::get<2>(point)};
}
inline PointTuple tuple_of(const OperatingPoint& point) { return {point.x, point.u, point.p}; }

/// Calls `set` with each option's name and value. A value of another type is a TypeError that names
/// the option.
void for_each_option(const py::dict& options,
                     const std::function<void(const std::string& name, py::handle value)>& set);

/// A trim specification from its fields: free, steady, rates, bounds, implied, effort, moving.
TrimSpec spec_of(const py::dict& fields);
py::dict dict_of(const TrimSpec& spec);
/// method, tolerance, step_tolerance, starts, others, max_iterations, max_boxes, closest,
/// time_limit; omitted fields keep the values of `defaults`. Throws std::invalid_argument for other
/// names.
TrimOptions trim_options_of(const py::dict& fields, TrimOptions defaults = {});

py::dict dict_of(const TrimResult& result);
py::dict dict_of(const LinearModel& linear);
py::dict dict_of(const Modes& modes);

template <class T>
py::array_t<T> array_of(const std::vector<T>& values) {
  return py::array_t<T>(py::ssize_t(values.size()), values.data());
}

}  // namespace tiltrim::python
