/// Registration of the verbs, one function per part of the module.
#pragma once

#include <pybind11/pybind11.h>

#include "follow/follow.hpp"
#include "follow/sensitivity.hpp"

namespace tiltrim::python {

namespace py = pybind11;

void add_equilibria(py::module_& module);  ///< trim, follow, linearize, modes, sensitivities
void add_maps(py::module_& module);        ///< sweep, tune
void add_map_files(py::module_& module);   ///< files of maps
void add_studies(py::module_& module);     ///< studies and their conditions
void add_analyses(py::module_& module);    ///< what else is of conditions
void add_design(py::module_& module);      ///< lqr, place, norms, lyapunov
void add_qualities(py::module_& module);   ///< levels of flying qualities
void add_proving(py::module_& module);     ///< prove
void add_envelopes(py::module_& module);   ///< envelope, all_equilibria
void add_report(py::module_& module);      ///< a study's page
void add_motion(py::module_& module);      ///< simulate, flights

py::dict dict_of(const Branch& branch);
py::dict dict_of(const Sensitivities& sensitivities);
FollowOptions follow_options_of(const py::dict& fields);

}  // namespace tiltrim::python
