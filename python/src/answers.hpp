/// What a model's callables return, as numbers; and arrays for their arguments.
#pragma once

#include <stdexcept>
#include <string>

#include "python/src/convert.hpp"

namespace tiltrim::python {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A callable returned an object of the wrong kind or shape, whatever its numbers.
struct WrongAnswer : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};
/// Throws it: "what: expected ..., got ...".
[[noreturn]] void refuse(const std::string& what, const std::string& expected,
                         const std::string& got);

/// A vector of this size from a number, list, tuple or array.
Eigen::VectorXd as_vector(const py::handle& answer, const std::string& what, Eigen::Index expected);
/// A matrix of this shape.
Eigen::MatrixXd as_matrix(const py::handle& answer, const std::string& what, Eigen::Index rows,
                          Eigen::Index columns);
/// Rows of an answer to `columns` points: an array of this shape, or a sequence with one entry for
/// each row, an array of `columns` values or a number that holds for all.
Eigen::MatrixXd as_columns(const py::object& answer, const std::string& what, Eigen::Index rows,
                           Eigen::Index columns);

/// The matrix as an array of numpy's own order.
py::array_t<double> columns_of(const Eigen::MatrixXd& m);

}  // namespace tiltrim::python
