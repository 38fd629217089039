#include "python/src/answers.hpp"

#include <fmt/core.h>

namespace tiltrim::python {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void refuse(const std::string& what, const std::string& expected, const std::string& got) {
  throw WrongAnswer(fmt::format("{}: expected {}, got {}", what, expected, got));
}

namespace {

std::string kind_of(const py::handle& answer) {
  if (answer.is_none()) return "None";
  if (py::isinstance<py::str>(answer)) return "a string";
  return fmt::format("{} {}", std::string(Py_TYPE(answer.ptr())->tp_name),
                     std::string(py::repr(answer)).substr(0, 60));
}

std::string shape_of(const py::array& array) {
  return fmt::format("an array of shape {}", std::string(py::str(array.attr("shape"))));
}

// Converted by numpy, if it holds real numbers.
py::array_t<double> as_numbers(const py::handle& answer, const std::string& what,
                               const std::string& expected) {
  const py::array given = py::array::ensure(answer);
  if (!given) refuse(what, expected, kind_of(answer));  // lists of unequal length
  const char kind = given.dtype().kind();
  if (kind == 'c') refuse(what, "real values", "complex ones");
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
    refuse(what, expected, kind_of(answer));
  // Differences and error bounds count on 16 digits.
  if (kind == 'f' && given.dtype().itemsize() < py::ssize_t(sizeof(double)))
    refuse(what, "numbers of double precision (float64)",
           "ones of " + std::string(py::str(given.dtype())));
  return py::array_t<double, py::array::c_style | py::array::forcecast>(given);
}

// The common return values, read without copies or conversion: a suitable array, or a list or tuple
// of floats. False for any other.
bool read_floats(const py::handle& answer, VectorXd& values) {
  PyObject* const p = answer.ptr();
  using Plain = py::array_t<double, py::array::c_style>;
  if (py::isinstance<Plain>(answer)) {
    const auto array = py::reinterpret_borrow<Plain>(answer);
    if (array.ndim() > 1) return false;
    values = Eigen::Map<const VectorXd>(array.data(), array.size());
    return true;
  }
  if (!PyList_CheckExact(p) && !PyTuple_CheckExact(p)) return false;
  const Py_ssize_t size = PySequence_Fast_GET_SIZE(p);
  values.resize(size);
  for (Py_ssize_t i = 0; i < size; ++i) {
    PyObject* const item = PySequence_Fast_GET_ITEM(p, i);
    if (!PyFloat_Check(item)) return false;  // includes numpy.float64
    values[i] = PyFloat_AS_DOUBLE(item);
  }
  return true;
}

}  // namespace

VectorXd as_vector(const py::handle& answer, const std::string& what, Index expected) {
  const auto words = [](Index count) { return fmt::format("{} values", count); };
  VectorXd values;
  if (!read_floats(answer, values)) {
    const py::array_t<double> array = as_numbers(answer, what, words(expected));
    if (array.ndim() > 1) refuse(what, words(expected), shape_of(array));
    values = Eigen::Map<const VectorXd>(array.data(), array.size());
  }
  if (values.size() != expected) refuse(what, words(expected), fmt::format("{}", values.size()));
  return values;
}

MatrixXd as_matrix(const py::handle& answer, const std::string& what, Index rows, Index columns) {
  const std::string expected = fmt::format("{} x {} values", rows, columns);
  const py::array_t<double> array = as_numbers(answer, what, expected);
  if (array.ndim() != 2) refuse(what, expected, shape_of(array));
  if (array.shape(0) != rows || array.shape(1) != columns)
    refuse(what, expected, fmt::format("{} x {}", array.shape(0), array.shape(1)));
  return Eigen::Map<const Rows>(array.data(), rows, columns);
}

MatrixXd as_columns(const py::object& answer, const std::string& what, Index rows, Index columns) {
  const std::string expected =
      fmt::format("{} x {} values, one column for each of the {} points", rows, columns, columns);
  if (!py::isinstance<py::array>(answer) && py::isinstance<py::sequence>(answer)) {
    const auto parts = py::reinterpret_borrow<py::sequence>(answer);
    if (Index(parts.size()) != rows) refuse(what, expected, fmt::format("{} rows", parts.size()));
    MatrixXd all(rows, columns);
    for (Index i = 0; i < rows; ++i) {
      const py::array_t<double> row = as_numbers(parts[std::size_t(i)], what, expected);
      if (row.ndim() == 0)
        all.row(i).setConstant(*row.data());
      else if (row.ndim() == 1 && row.size() == columns)
        all.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), columns);
      else
        refuse(what, expected, fmt::format("{} in row {}", shape_of(row), i + 1));
    }
    return all;
  }
  return as_matrix(answer, what, rows, columns);
}

py::array_t<double> columns_of(const MatrixXd& m) {
  py::array_t<double> array({m.rows(), m.cols()});
  Eigen::Map<Rows>(array.mutable_data(), m.rows(), m.cols()) = m;
  return array;
}

}  // namespace tiltrim::python
