/// A Model whose functions may be Python's.
#pragma once

#include <memory>
#include <vector>

#include "model/model.hpp"
#include "python/src/convert.hpp"

namespace tiltrim::python {

/// A Python callable that C++ holds. Its owner, a HeldModel, shows it to the garbage collector.
struct Held {
  py::object function;
};

/// A model, and the Python objects behind it.
struct HeldModel {
  Model model;
  std::vector<std::shared_ptr<Held>> own;  ///< callables of this model
  std::vector<py::object> parts;           ///< models that it was made of
  bool callables = false;                  ///< somewhere in it Python is called

  static HeldModel built_in(Model model) { return {std::move(model), {}, {}, false}; }
};

/// The callable's answer to these arguments, as a vector of so many numbers; `what` names it.
Eigen::VectorXd call_for_vector(const Held& held, const std::string& what, Eigen::Index expected,
                                const py::tuple& arguments);

/// Adds Model, feedback, evaluate to the module.
void add_model(py::module_& module);

}  // namespace tiltrim::python
