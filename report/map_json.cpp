#include "report/json.hpp"
#include "report/map_parts.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

ordered_json coordinates(const SweepMap& map, const std::vector<double>& at) {
  ordered_json object = ordered_json::object();
  for (std::size_t a = 0; a < at.size(); ++a) object[map.axes[a].columns.front().name] = at[a];
  return object;
}

}  // namespace

ordered_json axes_json(const SweepMap& map) {
  ordered_json axes = ordered_json::array();
  for (const SweepAxis& axis : map.axes) {
    ordered_json columns = ordered_json::array();
    for (const SweepAxis::Column& c : axis.columns)
      columns.push_back({{"key", c.name}, {"unit", c.unit}, {"values", c.values}});
    axes.push_back({{"name", axis.name}, {"columns", columns}});
  }
  return axes;
}

namespace {

const std::vector<std::string_view> point_fields{
    "condition", "status",        "verdict", "message", "residual", "spectral_abscissa",
    "damping",   "second_branch", "state",   "input",   "modes"};

ordered_json point_json(const SweepMap& map, std::size_t p) {
  const std::vector<std::size_t> at = map.position(p);
  ordered_json object{{"condition", map.conditions[at[0]]}};
  for (std::size_t a = 0; a < map.axes.size(); ++a)
    for (const SweepAxis::Column& column : map.axes[a].columns)
      object[key_among(column.name, point_fields)] = column.values[at[a + 1]];
  object["status"] = status_name(map.status[p]);
  object["verdict"] =
      map.verdict[p] < 0 ? ordered_json() : ordered_json(verdict_name(map.verdict[p]));
  object["message"] = map.reasons[std::size_t(map.reason[p])];
  if (map.verdict[p] < 0) return object;
  object["residual"] = map.residual[p];
  object["spectral_abscissa"] = map.spectral_abscissa[p];
  object["damping"] = map.damping[p];
  object["second_branch"] = map.second_branch[p] != 0;
  const std::size_t n = map.modes(), m = map.inputs.size();
  for (std::size_t i = 0; i < n; ++i) object["state"][map.states[i].name] = map.state[p * n + i];
  for (std::size_t i = 0; i < m; ++i) object["input"][map.inputs[i].name] = map.input[p * m + i];
  for (std::size_t i = 0; i < n; ++i)
    object["modes"].push_back({{"name", map.mode_names[at[0]][i]},
                               {"re", map.eigenvalue_re[p * n + i]},
                               {"im", map.eigenvalue_im[p * n + i]},
                               {"confidence", map.confidence[p * n + i] / 255.0}});
  return object;
}

}  // namespace

ordered_json crossing_json(const SweepMap& map, const AxisCrossing& c) {
  return {{"condition", map.conditions[std::size_t(c.condition)]},
          {"axis", map.axes[std::size_t(c.axis)].name},
          {"at", coordinates(map, c.at)},
          {"error", c.error},
          {"kind", to_string(c.kind)},
          {"unstable_before", c.unstable_before},
          {"unstable_after", c.unstable_after},
          {"frequency", c.frequency},
          {"mode", c.mode},
          {"mode_name", c.mode_name}};
}

std::string map_json(const SweepMap& map) {
  ordered_json all{
      {"program", map.program}, {"conditions", map.conditions}, {"axes", axes_json(map)}};
  all["points"] = ordered_json::array();
  for (std::size_t p = 0; p < map.points(); ++p) all["points"].push_back(point_json(map, p));
  const Threw thrown = threw(map, 0, map.points());
  all["model_threw"] = thrown.points == 0
                           ? ordered_json()
                           : ordered_json{{"points", thrown.points}, {"first", thrown.first}};
  all["crossings"] = ordered_json::array();
  for (const AxisCrossing& c : map.crossings) all["crossings"].push_back(crossing_json(map, c));
  all["intervals"] = ordered_json::array();
  for (const AxisInterval& i : map.intervals)
    all["intervals"].push_back({{"condition", map.conditions[std::size_t(i.condition)]},
                                {"axis", map.axes[std::size_t(i.axis)].name},
                                {"at", coordinates(map, i.at)},
                                {"from", i.from},
                                {"to", i.to},
                                {"verdict", to_string(i.verdict)},
                                {"unstable", i.unstable},
                                {"abscissa", i.abscissa},
                                {"abscissa_at", i.abscissa_at}});
  return all.dump(1) + "\n";
}

}  // namespace tiltrim
