// Analyses of a study's conditions.
#include "study/analyses.hpp"

#include <algorithm>

#include "python/src/calls.hpp"
#include "python/src/studies.hpp"
#include "python/src/verbs.hpp"

namespace tiltrim::python {

namespace {

constexpr const char* no_ipopt = "trim with method='newton' and closest=False";

TrimOptions trimming_of(const HeldCondition& held, const py::dict& fields) {
  return trim_options_of(fields, {.time_limit = held.study->time_limit});
}

// A study's key, or the key of a model's signal.
Key key_of(const Study& study, const std::string& name) {
  const std::vector<Key> keys = keys_of(study);
  const auto found = std::ranges::find(keys, name, &Key::signal);
  return found != keys.end() ? *found : key_among(keys, name);
}

py::dict sensitive(const HeldCondition& held, const std::vector<std::string>& parameters,
                   const py::dict& fields) {
  refuse_within_callable("sensitivities", no_ipopt);
  std::vector<Key> keys;
  for (const std::string& name : parameters) keys.push_back(key_of(*held.study, name));
  TrimOptions trimming = trimming_of(held, fields);
  const SensitivityAnswer answer =
      run(false, [&](const std::stop_token& stop) {
        trimming.stop = stop;
        return sensitivities(held.vehicle(), held.condition, keys, trimming);
      }).first;
  py::dict d = dict_of(answer.sensitivities);
  d["model"] = HeldModel::built_in(answer.trimmed.model);
  return d;
}

}  // namespace

void add_analyses(py::module_& module) {
  using py::arg;
  module.def("sensitivities_condition", &sensitive, arg("condition"), arg("parameters"),
             arg("trimming"));
}

}  // namespace tiltrim::python
