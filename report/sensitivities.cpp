#include "report/sensitivities.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "report/json.hpp"
#include "report/mode_sheets.hpp"

namespace tiltrim {

using Eigen::Index;
using json::ordered_json;

namespace {

constexpr double percent = 0.01;

// One percent of the parameter's value, or of its nominal size if the value is zero.
double one_percent(const ParameterSensitivity& p) {
  return percent * (p.value != 0 ? p.value : p.parameter.nominal);
}

std::string title(const Mode& m) {
  const double damping = m.damping();
  return fmt::format("{} ({} 1/s, damping {})", m.name, eigenvalue_text(m),
                     std::isnan(damping) ? "not determined" : fmt::format("{:.3f}", damping));
}

Sheet mode_sheet(const Sensitivities& s, std::size_t mode, std::size_t most) {
  const Mode& m = s.modes.modes[mode];
  const bool oscillates = m.eigenvalue.imag() != 0;
  Sheet sheet;
  sheet.title = title(m);
  sheet.columns = {{"parameter", "+1 % of", ""},
                   {"value", "value", "", "{:.5g}"},
                   {"unit", "unit", ""},
                   {"decay", "decay rate", "1/s", "{:+.2e}"},
                   {"damping", "damping", "", "{:+.2e}"},
                   {"frequency", "frequency", "rad/s", "{:+.2e}"},
                   {"better", "better damped", ""}};
  for (const std::size_t i : s.ranked(mode)) {
    if (sheet.rows.size() >= most) break;
    const ParameterSensitivity& p = s.parameters[i];
    const ParameterSensitivity::ModeSensitivity& d = p.modes[mode];
    const double by = one_percent(p);
    const auto shown = [by](double derivative) {
      return std::isnan(derivative) ? SheetCell() : SheetCell(derivative * by);
    };
    const double gain = oscillates ? d.damping : -d.eigenvalue.real();
    const bool up = (gain > 0) == (p.value >= 0);  // increases the magnitude
    sheet.rows.push_back({p.parameter.name, p.value, SheetCell(p.parameter.unit),
                          shown(-d.eigenvalue.real()), shown(oscillates ? d.damping : NAN),
                          shown(d.frequency),
                          SheetCell(gain == 0 || std::isnan(gain) ? "-"
                                    : up                          ? "larger"
                                                                  : "smaller")});
  }
  return sheet;
}

}  // namespace

Sheet sensitivities_sheet(const std::vector<SensitivityAnswer>& conditions) {
  Sheet sheet;
  sheet.columns = {{"name", "", ""}, {"parameter", "", ""}, {"value", "", ""},
                   {"unit", "", ""}, {"quantity", "", ""},  {"derivative", "", ""}};
  for (const SensitivityAnswer& c : conditions)
    for (const ParameterSensitivity& p : c.sensitivities.parameters) {
      const auto add = [&](const std::string& quantity, double derivative) {
        sheet.rows.push_back({c.trimmed.condition.name, p.parameter.name, p.value,
                              SheetCell(p.parameter.unit), SheetCell(quantity), derivative});
      };
      const Model& model = c.trimmed.model;
      for (Index i = 0; i < p.x.size(); ++i) add(model.states[std::size_t(i)].name, p.x[i]);
      for (Index i = 0; i < p.u.size(); ++i) add(model.inputs[std::size_t(i)].name, p.u[i]);
      for (Index i = 0; i < p.outputs.size(); ++i)
        add(model.outputs[std::size_t(i)].name, p.outputs[i]);
      for (std::size_t k = 0; k < p.modes.size(); ++k) {
        add(fmt::format("mode {} re", k + 1), p.modes[k].eigenvalue.real());
        add(fmt::format("mode {} im", k + 1), p.modes[k].eigenvalue.imag());
        add(fmt::format("mode {} damping", k + 1), p.modes[k].damping);
        add(fmt::format("mode {} frequency", k + 1), p.modes[k].frequency);
      }
    }
  return sheet;
}

namespace {

const char* const explained =
    "Changes caused by a 1 % increase in each parameter, including the shift of the trim; "
    "largest first.";

std::vector<Sheet> mode_sheets(const Sensitivities& s, std::size_t most) {
  std::vector<Sheet> sheets;
  for (std::size_t k = 0; k < s.modes.modes.size(); ++k)
    if (s.modes.modes[k].eigenvalue.imag() >= 0 && s.simple[k])
      sheets.push_back(mode_sheet(s, k, most));
  return sheets;
}

}  // namespace

std::vector<Sheet> sensitivities_document(const std::vector<SensitivityAnswer>& conditions,
                                          std::size_t most) {
  std::vector<Sheet> sheets;
  for (const SensitivityAnswer& c : conditions) {
    const Sensitivities& s = c.sensitivities;
    const std::string& name = c.trimmed.condition.name;
    sheets.push_back({name + ": " + to_string(s.status), {}, {}, {}});
    if (!s.message.empty()) sheets.back().notes.push_back(s.message + ".");
    if (!s) continue;
    sheets.back().notes.emplace_back(explained);
    for (Sheet& sheet : mode_sheets(s, most)) {
      sheet.title = name + ": " + sheet.title;
      sheets.push_back(std::move(sheet));
    }
  }
  return sheets;
}

std::string sensitivities_text(const std::vector<SensitivityAnswer>& conditions, std::size_t most,
                               const TextStyle& style) {
  std::string text;
  for (const SensitivityAnswer& c : conditions) {
    const Sensitivities& s = c.sensitivities;
    text += fmt::format("{}{}: {}\n", text.empty() ? "" : "\n", c.trimmed.condition.name,
                        toned(to_string(s.status), s ? Tone::good : Tone::bad, style));
    if (!s.message.empty()) text += wrapped(s.message + ".", 2, style.width);
    if (!s) continue;
    text += wrapped(explained, 2, style.width);
    for (const Sheet& sheet : mode_sheets(s, most)) text += '\n' + as_text(sheet, style);
  }
  return text;
}

std::string sensitivities_json(const std::vector<SensitivityAnswer>& conditions) {
  ordered_json all{{"conditions", ordered_json::array()}};
  for (const SensitivityAnswer& c : conditions) {
    const Model& model = c.trimmed.model;
    const Sensitivities& s = c.sensitivities;
    ordered_json j{{"name", c.trimmed.condition.name},
                   {"status", to_string(c.trimmed.trim.status)},
                   {"sensitivities", to_string(s.status)},
                   {"message", s.message},
                   {"rcond", s.rcond}};
    if (c.trimmed.has_equilibrium())
      j.update(json::point(model, c.trimmed.trim.point, c.trimmed.trim.outputs));
    j["modes"] = ordered_json::array();
    for (const Mode& m : s.modes.modes) j["modes"].push_back(json::mode(m, model.states));
    j["parameters"] = ordered_json::array();
    for (const ParameterSensitivity& p : s.parameters) {
      ordered_json one{{"parameter", p.parameter.name},
                       {"value", p.value},
                       {"unit", p.parameter.unit},
                       {"state", json::named(model.states, p.x)},
                       {"input", json::actuators(model, {p.x, p.u, {}}, p.outputs)},
                       {"output", json::named(model.outputs, p.outputs)}};
      one["modes"] = ordered_json::array();
      for (const ParameterSensitivity::ModeSensitivity& m : p.modes)
        one["modes"].push_back({{"re", m.eigenvalue.real()},
                                {"im", m.eigenvalue.imag()},
                                {"damping", m.damping},
                                {"frequency", m.frequency},
                                {"error", m.error}});
      j["parameters"].push_back(one);
    }
    all["conditions"].push_back(j);
  }
  return all.dump(1) + '\n';
}

}  // namespace tiltrim
