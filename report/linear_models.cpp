#include "report/linear_models.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "report/code_points.hpp"
#include "report/json.hpp"
#include "report/linear_point.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace json;

namespace {

ordered_json model_json(const ConditionReport& c) {
  const LinearModel& l = *c.linear;
  const LinearPoint at = point_of(c);
  ordered_json j{{"name", c.answer.condition.name},
                 {"states", names(l.states)},
                 {"inputs", names(l.inputs)},
                 {"outputs", names(l.outputs)},
                 {"A", rows(l.A)},
                 {"B", rows(l.B)},
                 {"C", rows(l.C)},
                 {"D", rows(l.D)},
                 {"A_error", rows(l.A_error)},
                 {"B_error", rows(l.B_error)},
                 {"C_error", rows(l.C_error)},
                 {"D_error", rows(l.D_error)}};
  j["point"] = {{"state", named(l.states, at.x0)},
                {"input", named(l.inputs, at.u0)},
                {"output", named(l.outputs, at.y0)}};
  j["eigenvalues"] = ordered_json::array();
  for (const Mode& m : c.modes->modes)
    j["eigenvalues"].push_back(
        {{"re", m.eigenvalue.real()}, {"im", m.eigenvalue.imag()}, {"error", m.error}});
  j["verdict"] = to_string(c.modes->verdict);
  return j;
}

// An ASCII Python literal that represents any name exactly and terminates correctly.
std::string python_string(const std::string& text) {
  std::string literal = "\"";
  for (const char32_t c : code_points(text))
    if (c == U'"' || c == U'\\')
      literal += fmt::format("\\{}", static_cast<char>(c));
    else if (c >= 0x20 && c < 0x7F)
      literal += static_cast<char>(c);
    else
      literal += fmt::format("\\U{:08x}", static_cast<std::uint32_t>(c));
  return literal + '"';
}

std::string python_number(double value) {
  if (std::isnan(value)) return "np.nan";
  if (std::isinf(value)) return value > 0 ? "np.inf" : "-np.inf";
  const std::string shortest = fmt::format("{}", value);  // round-trips to the same double
  const bool whole = shortest.find_first_of(".e") == shortest.npos;
  return shortest + (whole ? ".0" : "");  // Python reads -0 as an integer without sign
}

template <class Values>
std::string python_numbers(const Values& values) {
  std::vector<std::string> words;
  for (const double value : values) words.push_back(python_number(value));
  return fmt::format("[{}]", fmt::join(words, ", "));
}

std::string python_strings(const std::vector<std::string>& list) {
  std::vector<std::string> words;
  for (const std::string& text : list) words.push_back(python_string(text));
  return fmt::format("[{}]", fmt::join(words, ", "));
}

// The shape is written separately: a matrix without columns is no list of lists.
std::string python_matrix(const MatrixXd& m) {
  std::string list;
  for (const auto& row : m.rowwise()) list += fmt::format("            {},\n", python_numbers(row));
  return fmt::format("np.array([\n{}        ], dtype=float).reshape({}, {})", list, m.rows(),
                     m.cols());
}

std::string python_model(const ConditionReport& c) {
  const LinearModel& l = *c.linear;
  const LinearPoint at = point_of(c);
  std::string text = fmt::format("    {}: {{\n", python_string(c.answer.condition.name));
  const auto add = [&](const char* key, const std::string& value) {
    text += fmt::format("        \"{}\": {},\n", key, value);
  };
  add("states", python_strings(names(l.states)));
  add("inputs", python_strings(names(l.inputs)));
  add("outputs", python_strings(names(l.outputs)));
  for (const auto& [key, matrix] :
       {std::pair{"A", &l.A}, {"B", &l.B}, {"C", &l.C}, {"D", &l.D}, {"A_error", &l.A_error}})
    add(key, python_matrix(*matrix));
  for (const auto& [key, values] : {std::pair{"x0", &at.x0}, {"u0", &at.u0}, {"y0", &at.y0}})
    add(key, fmt::format("np.array({}, dtype=float)", python_numbers(*values)));
  VectorXd re(Index(c.modes->modes.size())), im(re.size());
  for (Index i = 0; i < re.size(); ++i) {
    re[i] = c.modes->modes[std::size_t(i)].eigenvalue.real();
    im[i] = c.modes->modes[std::size_t(i)].eigenvalue.imag();
  }
  add("eigenvalues", fmt::format("np.array({}, dtype=float) + 1j * np.array({}, dtype=float)",
                                 python_numbers(re), python_numbers(im)));
  add("verdict", python_string(to_string(c.modes->verdict)));
  return text + "    },\n";
}

constexpr const char* python_head = R"(# Linear models written by tiltrim.
"""dx' = A dx + B du, dy = C dx + D du: deviations from the trim x0, u0, y0; SI units, radians.

    import THIS_FILE as linear
    linear.names                            the models' names
    linear.models[name]["A"]                also B, C, D, A_error, x0, u0, y0, eigenvalues, verdict,
                                            and the names: states, inputs, outputs
    linear.to_scipy(name)                   as scipy.signal.StateSpace
    linear.to_control(name)                 as control.ss, with the signals' names
"""

import numpy as np

)";

constexpr const char* python_tail = R"(
names = list(models)


def to_scipy(name):
    """The model of this name as scipy.signal.StateSpace."""
    from scipy.signal import StateSpace

    m = models[name]
    return StateSpace(m["A"], m["B"], m["C"], m["D"])


def to_control(name):
    """The model of this name as control.ss. Python-control takes no dots in names: they become _."""
    import control

    m = models[name]
    signals = {key: [s.replace(".", "_") for s in m[key]] for key in ("states", "inputs", "outputs")}
    return control.ss(m["A"], m["B"], m["C"], m["D"], name=name.replace(".", "_"), **signals)
)";

}  // namespace

std::string why_left_out(const ConditionReport& c) {
  if (c.linear && *c.linear) return {};
  if (c.linear) return c.linear->message;
  if (c.answer.table) return "formulation table has no linear model";
  return "no equilibrium: " + to_string(c.answer.trim.status);
}

std::string left_out_text(const std::vector<ConditionReport>& conditions, const TextStyle& style) {
  std::string text;
  for (const ConditionReport& c : conditions)
    if (const std::string why = why_left_out(c); !why.empty())
      text +=
          wrapped(fmt::format("{} is left out of the models: {}.", c.answer.condition.name, why), 0,
                  style.width);
  return text;
}

std::string linear_models_json(const std::vector<ConditionReport>& conditions) {
  ordered_json all{{"models", ordered_json::array()}, {"left_out", ordered_json::array()}};
  for (const ConditionReport* c : linear_ones(conditions)) all["models"].push_back(model_json(*c));
  for (const ConditionReport& c : conditions)
    if (const std::string why = why_left_out(c); !why.empty())
      all["left_out"].push_back({{"name", c.answer.condition.name}, {"why", why}});
  return all.dump(1) + '\n';
}

Sheet linear_models_sheet(const std::vector<ConditionReport>& conditions) {
  Sheet sheet;
  for (const char* const key : {"condition", "matrix", "row", "column", "value", "error"})
    sheet.columns.push_back({key, "", ""});
  for (const ConditionReport* c : linear_ones(conditions)) {
    const LinearModel& l = *c->linear;
    const std::string& name = c->answer.condition.name;
    const auto add = [&](const char* matrix, const MatrixXd& m, const MatrixXd& error,
                         const Signals& of_rows, const Signals& of_columns) {
      for (Index i = 0; i < m.rows(); ++i)
        for (Index j = 0; j < m.cols(); ++j)
          sheet.rows.push_back({name, matrix, of_rows[std::size_t(i)].name,
                                of_columns[std::size_t(j)].name, m(i, j), error(i, j)});
    };
    const auto add_point = [&](const char* vector, const VectorXd& v, const Signals& signals) {
      for (Index i = 0; i < v.size(); ++i)
        sheet.rows.push_back(
            {name, vector, signals[std::size_t(i)].name, SheetCell(), v[i], SheetCell()});
    };
    add("A", l.A, l.A_error, l.states, l.states);
    add("B", l.B, l.B_error, l.states, l.inputs);
    add("C", l.C, l.C_error, l.outputs, l.states);
    add("D", l.D, l.D_error, l.outputs, l.inputs);
    const LinearPoint at = point_of(*c);
    add_point("x0", at.x0, l.states);
    add_point("u0", at.u0, l.inputs);
    add_point("y0", at.y0, l.outputs);
  }
  return sheet;
}

std::string linear_models_python(const std::vector<ConditionReport>& conditions) {
  std::string text = python_head;
  text += "models = {\n";
  for (const ConditionReport* c : linear_ones(conditions)) text += python_model(*c);
  text += "}\nleft_out = {  # conditions without a linear model, and why\n";
  for (const ConditionReport& c : conditions)
    if (const std::string why = why_left_out(c); !why.empty())
      text +=
          fmt::format("    {}: {},\n", python_string(c.answer.condition.name), python_string(why));
  return text + "}\n" + python_tail;
}

std::vector<std::string> matlab_names(const std::vector<std::string>& names) {
  constexpr std::array keywords{"break",  "case",   "catch",     "classdef", "continue",
                                "else",   "elseif", "end",       "for",      "function",
                                "global", "if",     "otherwise", "parfor",   "persistent",
                                "return", "spmd",   "switch",    "try",      "while"};
  constexpr std::size_t longest = 63;
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  std::vector<std::string> valid;
  for (const std::string& given : names) {
    std::string name;
    for (const char32_t c : code_points(given)) {
      const char ascii = c < 0x80 ? static_cast<char>(c) : '_';
      name += is_letter(ascii) || (ascii >= '0' && ascii <= '9') ? ascii : '_';
    }
    if (name.empty() || !is_letter(name.front())) name = "m_" + name;
    if (std::ranges::find(keywords, name) != keywords.end()) name += '_';
    name.resize(std::min(name.size(), longest));
    std::string unique = name;
    for (int k = 2; std::ranges::find(valid, unique) != valid.end(); ++k) {
      const std::string number = fmt::format("_{}", k);
      unique = name.substr(0, longest - number.size()) + number;
    }
    valid.push_back(unique);
  }
  return valid;
}

}  // namespace tiltrim
