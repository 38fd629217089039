#include "report/branch_sheets.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <initializer_list>
#include <optional>

#include "model/degrees.hpp"
#include "report/json.hpp"
#include "report/user_columns.hpp"

namespace tiltrim {

using Eigen::Index;
using json::ordered_json;

namespace {

// The first of these names that the model has.
SheetCell value(const Model& model, const BranchPoint& at, std::initializer_list<const char*> names,
                double factor = 1.0) {
  for (const char* name : names) {
    if (const Index i = find(model.states, name); i >= 0) return at.point.x[i] * factor;
    if (const Index i = find(model.inputs, name); i >= 0) return at.point.u[i] * factor;
    if (const Index i = find(model.parameters, name); i >= 0) return at.point.p[i] * factor;
    if (const Index i = find(model.outputs, name); i >= 0) return at.outputs[i] * factor;
  }
  return {};
}

using Names = std::vector<std::string>;  // parameters shown for a user-defined model

std::vector<SheetColumn> columns(const BranchAnswer& b, const Names& parameters) {
  const Key& parameter = b.parameter;
  const SheetColumn along{column_key(parameter.name), parameter.name,
                          parameter.unit == "degrees" ? "°" : parameter.unit, "{:.8g}"};
  if (b.start.condition.user()) {
    std::vector<SheetColumn> all = user_columns(b.start.model, parameters);
    all.insert(all.begin(), {{"name", "condition", ""}, {"kind", "event", ""}, along});
    all.insert(all.end(), {{"unstable", "unstable", "", "{:.0f}"},
                           {"eigenvalue_re", "", "", "{}"},
                           {"eigenvalue_im", "", "", "{}"},
                           {"residual", "residual", "1/s", "{:.0e}"},
                           {"which", "which", ""}});
    return all;
  }
  return {{"name", "condition", ""},
          {"kind", "event", ""},
          along,
          {"V", "V", "m/s", "{:.6f}"},
          {"gamma_deg", "γ", "°", "{:.4f}"},
          {"eta_deg", "η", "°", "{:.4f}"},
          {"theta_deg", "θ", "°", "{:.6f}"},
          {"alpha_deg", "α", "°", "{:.4f}"},
          {"theta0", "θ₀", "", "{:.7f}"},
          {"a1s_deg", "a1s", "°", "{:.5f}"},
          {"delta_e_deg", "δe", "°", "{:.5f}"},
          {"unstable", "unstable", "", "{:.0f}"},
          {"eigenvalue_re", "", "", "{}"},
          {"eigenvalue_im", "", "", "{}"},
          {"residual", "residual", "1/s", "{:.0e}"},
          {"which", "which", ""}};
}

std::vector<SheetCell> row(const BranchAnswer& b, const Names& parameters, const BranchPoint& at,
                           std::string kind) {
  const Model& m = b.start.model;
  const SheetCell unstable = at.unstable ? SheetCell(double(*at.unstable)) : SheetCell();
  if (b.start.condition.user()) {
    std::vector<SheetCell> all = user_cells(m, parameters, at.point, at.outputs);
    all.insert(all.begin(), {b.start.condition.name, SheetCell(std::move(kind)),
                             b.parameter.in_study(at.parameter)});
    all.insert(all.end(), {unstable, {}, {}, at.residual, {}});
    return all;
  }
  return {b.start.condition.name,
          std::move(kind),
          b.parameter.in_study(at.parameter),
          value(m, at, {"airspeed", "V"}),
          value(m, at, {"gamma", "flight_path"}, degrees),
          value(m, at, {"eta"}, degrees),
          value(m, at, {"theta"}, degrees),
          value(m, at, {"alpha"}, degrees),
          value(m, at, {"theta0"}),
          value(m, at, {"a1s"}, degrees),
          value(m, at, {"delta_e"}, degrees),
          unstable,
          {},
          {},
          at.residual,
          {}};
}

std::vector<SheetCell> row(const BranchAnswer& b, const Names& parameters, const BranchEvent& e) {
  std::vector<SheetCell> cells = row(b, parameters, e.at, to_string(e.kind));
  if (e.eigenvalue) {
    cells[cells.size() - 4] = e.eigenvalue->real();
    cells[cells.size() - 3] = e.eigenvalue->imag();
  }
  cells.back() = SheetCell(e.which);
  return cells;
}

// An event in words.
std::string words(const BranchEvent& e) {
  switch (e.kind) {
    case EventKind::fold:
      return "the branch turns back";
    case EventKind::limit:
      return e.which + " limit";
    case EventKind::limit_left:
      return e.which + " limit left";
    case EventKind::zero:
      return "a real eigenvalue crosses zero: " + e.which;
    case EventKind::hopf:
      return fmt::format("±{}i crosses: {}", number_text(e.eigenvalue->imag(), "{:.4f}"), e.which);
    case EventKind::branch_point:
      return "another branch crosses";
    case EventKind::end:
      return "";
  }
  return {};
}

template <class Which>
void drop(Sheet& sheet, const Which& which) {
  for (std::size_t k = sheet.columns.size(); k-- > 0;) {
    if (!which(k)) continue;
    sheet.columns.erase(sheet.columns.begin() + std::ptrdiff_t(k));
    for (auto& row : sheet.rows) row.erase(row.begin() + std::ptrdiff_t(k));
  }
}

// Drops the column that repeats the parameter's, in radians or degrees.
void drop_repeated(Sheet& sheet, const Key& parameter) {
  constexpr std::size_t own = 2;
  drop(sheet, [&](std::size_t k) {
    const std::string& key = sheet.columns[k].key;
    return k != own && (key == parameter.signal || key == parameter.signal + "_deg");
  });
}

// Columns of one value become a note: "Constant: γ = 0°, η = 0°."
void note_constants(Sheet& sheet) {
  constexpr std::size_t own = 2;
  if (sheet.rows.size() < 2) return;
  const auto constant = [&](std::size_t k) {
    const auto text = [&](const auto& row) { return cell_text(row[k], sheet.columns[k]); };
    return k >= own && is_numeric(sheet, k) && sheet.columns[k].key != "unstable" &&
           std::ranges::all_of(sheet.rows,
                               [&](const auto& row) { return text(row) == text(sheet.rows[0]); });
  };
  std::string words;
  for (std::size_t k = 0; k < sheet.columns.size(); ++k) {
    if (!constant(k)) continue;
    const SheetColumn& c = sheet.columns[k];
    words += fmt::format("{}{} = {:.6g}{}{}", words.empty() ? "" : ", ", c.title,
                         std::get<double>(sheet.rows[0][k].value) + 0.0,
                         c.unit.empty() || c.unit == "°" ? "" : " ", c.unit);
  }
  if (words.empty()) return;
  drop(sheet, constant);
  sheet.notes.push_back("Constant: " + words + ".");
}

}  // namespace

// For reading: eigenvalues in words.
Sheet events_sheet(const BranchAnswer& b) {
  Sheet sheet;
  const Names parameters = shown_parameters({b.start.condition});
  sheet.columns = columns(b, parameters);
  if (!b.branch.points.empty())
    sheet.rows.push_back(row(b, parameters, b.branch.points.front(), "start"));
  for (const BranchEvent& e : b.branch.events) {
    if (b.branch.points.empty()) break;  // no trim at the end
    std::vector<SheetCell> cells = row(b, parameters, e);
    cells.back() = SheetCell(words(e));
    sheet.rows.push_back(cells);
  }
  drop_repeated(sheet, b.parameter);
  for (const char* untold : {"name", "eigenvalue_re", "eigenvalue_im", "residual"})
    drop(sheet, [&](std::size_t k) { return sheet.columns[k].key == untold; });
  note_constants(sheet);
  return sheet;
}

Sheet branches_sheet(const std::vector<BranchAnswer>& branches) {
  Sheet sheet;
  std::vector<Condition> conditions;
  for (const BranchAnswer& b : branches) conditions.push_back(b.start.condition);
  const Names parameters = shown_parameters(conditions);
  for (const BranchAnswer& b : branches) {
    if (sheet.columns.empty()) sheet.columns = columns(b, parameters);
    auto event = b.branch.events.begin();
    const auto events_before = [&](std::size_t points) {
      for (; event != b.branch.events.end() && event->after <= points; ++event)
        if (!b.branch.points.empty()) sheet.rows.push_back(row(b, parameters, *event));
    };
    for (std::size_t i = 0; i < b.branch.points.size(); ++i) {
      events_before(i);
      sheet.rows.push_back(row(b, parameters, b.branch.points[i], i == 0 ? "start" : "point"));
    }
    events_before(b.branch.points.size());
  }
  if (!branches.empty()) drop_repeated(sheet, branches.front().parameter);
  return sheet;
}

namespace {

// "level: V from 15 towards 5 m/s"
std::string way(const BranchAnswer& b) {
  return fmt::format("{}: {} from {:.6g} towards {:.6g}{}", b.start.condition.name,
                     b.parameter.name, b.from(), b.parameter.in_study(b.to),
                     b.parameter.unit.empty() ? "" : " " + b.parameter.unit);
}

std::string how_it_went(const BranchAnswer& b) {
  return fmt::format("{}{}.", b.branch.message,
                     b.branch.points.empty()
                         ? ""
                         : fmt::format("; {} verified points, {} evaluations",
                                       b.branch.points.size(), b.branch.evaluations));
}

}  // namespace

std::string branches_text(const std::vector<BranchAnswer>& branches, const TextStyle& style) {
  std::string text;
  for (const BranchAnswer& b : branches) {
    const bool good = b.answered();
    text += fmt::format("{}{}: {}\n", text.empty() ? "" : "\n", way(b),
                        toned(to_string(b.branch.end), good ? Tone::good : Tone::bad, style));
    text += wrapped(how_it_went(b), 2, style.width);
    if (!b.branch.points.empty()) text += as_text(events_sheet(b), style);
  }
  return text;
}

std::vector<Sheet> branches_document(const std::vector<BranchAnswer>& branches) {
  std::vector<Sheet> sheets;
  for (const BranchAnswer& b : branches) {
    Sheet sheet = b.branch.points.empty() ? Sheet{} : events_sheet(b);
    sheet.title = way(b) + ": " + to_string(b.branch.end);
    sheet.notes.push_back(how_it_went(b));
    sheets.push_back(std::move(sheet));
  }
  return sheets;
}

// Of points and of events.
static const std::vector<std::string_view> branch_fields{
    "kind",     "state", "input", "output", "residual",   "step",  "least",
    "unstable", "error", "which", "after",  "eigenvalue", "modes", "verdict"};

std::string branches_json(const std::vector<BranchAnswer>& branches) {
  ordered_json all{{"branches", ordered_json::array()}};
  for (const BranchAnswer& b : branches) {
    const Model& model = b.start.model;
    const std::string parameter = key_among(b.parameter.name, branch_fields);
    const auto point = [&](const BranchPoint& at) {
      ordered_json j{{parameter, b.parameter.in_study(at.parameter)}};
      j.update(json::point(model, at.point, at.outputs));
      j["residual"] = at.residual;
      j["step"] = at.step;
      j["least"] = at.least;
      j["unstable"] = at.unstable ? ordered_json(*at.unstable) : ordered_json();
      return j;
    };
    ordered_json j{
        {"condition", b.start.condition.name},   {"parameter", b.parameter.name},
        {"to", b.parameter.in_study(b.to)},      {"start", to_string(b.start.trim.status)},
        {"end", to_string(b.branch.end)},        {"message", b.branch.message},
        {"no_stability", b.branch.no_stability}, {"model", model.name},
        {"evaluations", b.branch.evaluations},   {"points", ordered_json::array()},
        {"events", ordered_json::array()}};
    for (const BranchPoint& at : b.branch.points) j["points"].push_back(point(at));
    for (const BranchEvent& e : b.branch.events) {
      ordered_json event{{"kind", to_string(e.kind)}};
      event.update(point(e.at));
      if (b.branch.end == BranchEnd::no_start)
        event.update({{"state", nullptr}, {"input", nullptr}, {"output", nullptr}});
      event["error"] = b.parameter.in_study(e.error);
      event["which"] = e.which;
      event["after"] = e.after;
      if (e.eigenvalue)
        event["eigenvalue"] = {{"re", e.eigenvalue->real()}, {"im", e.eigenvalue->imag()}};
      if (e.modes) {
        event["modes"] = ordered_json::array();
        for (const Mode& m : e.modes->modes) event["modes"].push_back(json::mode(m, model.states));
        event["verdict"] = to_string(e.modes->verdict);
      }
      j["events"].push_back(event);
    }
    all["branches"].push_back(j);
  }
  return all.dump(1) + '\n';
}

}  // namespace tiltrim
