// qualities of a study's condition, by the program's own functions, and of any linear model.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "python/src/calls.hpp"
#include "python/src/studies.hpp"
#include "python/src/verbs.hpp"
#include "report/quality_sheets.hpp"

namespace tiltrim::python {

namespace {

using Eigen::MatrixXd;

std::string of_condition(const HeldCondition& held, const py::dict& fields) {
  refuse_within_callable("qualities", "qualities of a LinearModel");
  TrimOptions trimming = trim_options_of(fields, {.time_limit = held.study->time_limit});
  const ConditionReport report = run(false, [&](const std::stop_token& stop) {
                                   trimming.stop = stop;
                                   return cli::judged(*held.study, held.condition, trimming);
                                 }).first;
  return qualities_json({report});
}

// The enumerator whose to_string() is `word`.
template <class Enum>
Enum chosen(const char* what, const std::string& word, int count) {
  std::string known;
  for (int k = 0; k < count; ++k) {
    if (to_string(Enum(k)) == word) return Enum(k);
    known += (k > 0 ? ", " : "") + to_string(Enum(k));
  }
  throw std::invalid_argument(std::string(what) + " '" + word + "'; expected one of " + known);
}

Roles roles_of(const std::map<std::string, std::string>& names) {
  Roles roles;
  const std::map<std::string, std::string*> places{
      {"pitch", &roles.pitch},
      {"pitch_rate", &roles.pitch_rate},
      {"alpha", &roles.alpha},
      {"downward_speed", &roles.downward_speed},
      {"speed", &roles.speed},
      {"height", &roles.height},
      {"normal_acceleration", &roles.normal_acceleration},
      {"stick", &roles.stick}};
  std::string known;
  for (const auto& [role, place] : places) known += (known.empty() ? "" : ", ") + role;
  for (const auto& [role, name] : names) {
    const auto place = places.find(role);
    if (place == places.end())
      throw std::invalid_argument("no role '" + role + "'; there are: " + known);
    *place->second = name;
  }
  return roles;
}

LinearModel linear_of(const py::dict& d) {
  const auto matrix = [&](const char* name) { return d[name].cast<MatrixXd>(); };
  const auto signals = [&](const char* name) {
    return signals_of(d[name].cast<std::vector<SignalTuple>>());
  };
  LinearModel l;
  l.status = LinearizeStatus::linear;
  l.states = signals("states");
  l.inputs = signals("inputs");
  l.outputs = signals("outputs");
  l.point.x = d["x"].cast<Eigen::VectorXd>();
  l.A = matrix("A");
  l.B = matrix("B");
  l.C = matrix("C");
  l.D = matrix("D");
  l.A_error = matrix("A_error");
  l.B_error = matrix("B_error");
  l.C_error = matrix("C_error");
  l.D_error = matrix("D_error");
  return l;
}

std::string of_linear(const py::dict& linear, const std::map<std::string, std::string>& roles,
                      const std::tuple<std::string, std::string, std::string, std::string>& words,
                      double airspeed, double gravity, double n_per_alpha,
                      const std::array<std::vector<std::array<double, 2>>, 2>& bandwidth) {
  const auto& [aircraft, category, phase, response] = words;
  QualitiesOptions options;
  options.roles = roles_of(roles);
  options.aircraft = chosen<AircraftClass>("aircraft", aircraft, 5);
  options.category = chosen<FlightCategory>("category", category, 3);
  options.regime = chosen<FlightRegime>("phase", phase, 2);
  options.response = chosen<ResponseType>("response", response, 2);
  options.airspeed = airspeed;
  options.gravity = gravity;
  options.n_per_alpha = n_per_alpha;
  options.least_bandwidth = bandwidth;
  const JudgedQualities judged{options, qualities(linear_of(linear), options)};
  return qualities_object(judged).dump();
}

}  // namespace

void add_qualities(py::module_& module) {
  using py::arg;
  module.def("qualities_condition", &of_condition, arg("condition"), arg("trimming"));
  module.def("qualities", &of_linear, arg("linear"), arg("roles"), arg("words"), arg("airspeed"),
             arg("gravity"), arg("n_per_alpha"), arg("bandwidth"));
}

}  // namespace tiltrim::python
