// The module tiltrim._tiltrim: the functions that the package's Python code calls.
#include <pybind11/pybind11.h>

#include "python/src/models.hpp"
#include "python/src/verbs.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"

namespace py = pybind11;
using namespace tiltrim;

// The exceptions of the package: ValueErrors with the library's messages.
static void add_exceptions(py::module_& module) {
  static PyObject* const invalid =
      py::exception<std::invalid_argument>(module, "InvalidArgument", PyExc_ValueError)
          .release()
          .ptr();
  static PyObject* const study =
      py::exception<StudyError>(module, "StudyError", PyExc_ValueError).release().ptr();
  for (PyObject* type : {invalid, study}) py::setattr(type, "__module__", py::str("tiltrim"));
  py::setattr(invalid, "__doc__",
              py::str("The request is invalid; the message states what was expected."));
  py::setattr(study, "__doc__",
              py::str("A study that cannot be read: file, line, column, key and the problem."));
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const StudyError& e) {
      PyErr_SetString(study, e.what());
    } catch (const std::invalid_argument& e) {
      PyErr_SetString(invalid, e.what());
    }
  });
}

PYBIND11_MODULE(_tiltrim, module) {
  module.attr("version") = TILTRIM_VERSION;
  module.def("data_directory", [] { return data_directory().string(); });
  add_exceptions(module);
  python::add_model(module);
  python::add_equilibria(module);
  python::add_maps(module);
  python::add_map_files(module);
  python::add_studies(module);
  python::add_analyses(module);
  python::add_design(module);
  python::add_qualities(module);
  python::add_proving(module);
  python::add_envelopes(module);
  python::add_report(module);
  python::add_motion(module);
}
