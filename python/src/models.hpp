/// A Model whose functions may be Python callables.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "model/model.hpp"
#include "python/src/convert.hpp"

namespace tiltrim::python {

/// A Python callable held by C++. Its owner, a HeldModel, reports it to the garbage collector.
struct Held {
  py::object function;
  std::array<py::object, 3> spare{};  ///< arguments of the last call that it did not keep
};

/// A model and the Python objects it depends on.
struct HeldModel {
  Model model;
  std::vector<std::shared_ptr<Held>> own;  ///< callables of this model
  std::vector<py::object> parts;           ///< models it is composed of
  bool callables = false;                  ///< whether it calls Python anywhere

  static HeldModel built_in(Model model) { return {std::move(model), {}, {}, false}; }
};

/// Calls the callable with these arguments; returns a vector of the expected size. `what` names it.
Eigen::VectorXd call_for_vector(const Held& held, const std::string& what, Eigen::Index expected,
                                const py::tuple& arguments);

/// Adds Model, feedback, evaluate to the module.
void add_model(py::module_& module);

}  // namespace tiltrim::python
