#include <fmt/core.h>

#include <algorithm>
#include <initializer_list>

#include "model/degrees.hpp"
#include "report/conditions.hpp"
#include "report/mode_sheets.hpp"
#include "report/user_columns.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

const char* const magnitude_only = "{:.0e}";

// The first of these names that the answer's model has, among variables and outputs.
std::optional<double> value(const Answer& a, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const TrimResult& t = a.trim;
    if (const Index i = find(a.model.states, name); i >= 0) return t.point.x[i];
    if (const Index i = find(a.model.inputs, name); i >= 0) return t.point.u[i];
    if (const Index i = find(a.model.parameters, name); i >= 0) return t.point.p[i];
    if (const Index i = find(a.model.outputs, name); i >= 0 && t.outputs.size() > i)
      return t.outputs[i];
  }
  return {};
}

SheetCell cell(std::optional<double> number, double factor = 1.0) {
  return number ? SheetCell(*number * factor) : SheetCell();
}

bool is_own(const std::vector<ConditionReport>& conditions) {
  return !conditions.empty() && conditions.front().answer.condition.user();
}

std::vector<std::string> shown_parameters(const std::vector<ConditionReport>& conditions) {
  std::vector<Condition> all;
  for (const ConditionReport& c : conditions) all.push_back(c.answer.condition);
  return tiltrim::shown_parameters(all);
}

// Status and kind of the trim.
void add_status(const Answer& a, std::vector<SheetCell>& row) {
  row.push_back(SheetCell(a.trim.residual));
  const Tone tone = a.trim ? Tone::good : a.has_equilibrium() ? Tone::doubtful : Tone::bad;
  row.push_back(SheetCell(to_string(a.trim.status), tone));
}

// Of a study with [model]: every signal, if there is an equilibrium.
std::vector<SheetCell> user_row(const ConditionReport& c,
                                const std::vector<std::string>& parameters) {
  const Answer& a = c.answer;
  std::vector<SheetCell> row{a.condition.name};
  std::vector<SheetCell> cells = user_cells(a.model, parameters, a.trim.point, a.trim.outputs);
  if (!a.has_equilibrium()) cells.assign(cells.size(), {});
  row.insert(row.end(), cells.begin(), cells.end());
  add_status(a, row);
  return row;
}

// Given values appear whatever the outcome, computed values for an equilibrium only.
std::vector<SheetCell> trim_row(const ConditionReport& c,
                                const std::vector<std::string>& parameters) {
  const Answer& a = c.answer;
  if (a.condition.user()) return user_row(c, parameters);
  const bool found = a.has_equilibrium();
  const Command* asked = a.condition.command();
  const auto show = [&](bool known, std::initializer_list<const char*> names, double factor) {
    return known ? cell(value(a, names), factor) : SheetCell();
  };
  std::vector<SheetCell> row{a.condition.name};
  if (const TableCondition* t = a.condition.table()) {
    row.insert(row.end(), {SheetCell(), t->gamma * degrees, t->eta * degrees, SheetCell(),
                           t->alpha * degrees});
  } else {
    row.push_back(show(found || asked, {"airspeed", "V"}, 1.0));
    if (asked) row.back() = asked->V;
    const bool rest = value(a, {"airspeed"}).value_or(1.0) == 0.0;  // no path or flow angle at rest
    row.push_back(show((found && !rest) || asked, {"gamma", "flight_path"}, degrees));
    row.push_back(show(found || asked, {"eta"}, degrees));
    row.push_back(show(found, {"theta"}, degrees));
    row.push_back(show(found && !rest, {"alpha"}, degrees));
  }
  row.push_back(show(found, {"theta0"}, 1.0));
  row.push_back(show(found, {"a1s"}, degrees));
  row.push_back(show(found, {"delta_e"}, degrees));
  add_status(a, row);
  return row;
}

std::vector<std::string> remarks(const ConditionReport& c) {
  const TrimResult& t = c.answer.trim;
  std::vector<std::string> notes;
  if (!t.message.empty()) notes.push_back(t.message);
  if (c.answer.has_equilibrium())
    for (const ActiveLimit& l : t.limits_active)
      notes.push_back(fmt::format("{} is at its {} limit, {:.6g}", l.signal,
                                  l.upper ? "upper" : "lower", l.value));
  if (!t.others.empty())
    notes.push_back(fmt::format(
        "{} more equilibri{} within the limits, found from {}; none needs less control effort",
        t.others.size(), t.others.size() == 1 ? "um" : "a",
        number_of(std::size_t(t.starts), "start")));
  if (c.answer.table)
    notes.push_back(
        fmt::format("moment about the center of gravity: CM {:.5f} balances the thrust, the "
                    "elevator must add {:+.5f}",
                    c.answer.table->CM_required, c.answer.table->CM_elevator));
  return notes;
}

const char* formulation_name(const Condition& c) {
  if (c.user() && c.user()->model->xv15) return "XV-15";
  return c.command()    ? "closed loop"
         : c.airframe() ? "airframe"
         : c.user()     ? "user model"
                        : "table";
}

std::vector<SheetColumn> trim_columns(const std::vector<ConditionReport>& conditions) {
  const SheetColumn name{"name", "condition", ""}, status{"status", "status", ""};
  const SheetColumn residual{"residual", "residual", "1/s", magnitude_only};
  if (is_own(conditions)) {
    std::vector<SheetColumn> columns =
        user_columns(conditions.front().answer.model, shown_parameters(conditions));
    columns.insert(columns.begin(), name);
    columns.insert(columns.end(), {residual, status});
    return columns;
  }
  return {name,
          {"V", "V", "m/s", "{:.2f}"},
          {"gamma_deg", "γ", "°", "{:.2f}"},
          {"eta_deg", "η", "°", "{:.2f}"},
          {"theta_deg", "θ", "°", "{:.3f}"},
          {"alpha_deg", "α", "°", "{:.3f}"},
          {"theta0", "θ₀", "", "{:.5f}"},
          {"a1s_deg", "a1s", "°", "{:.3f}"},
          {"delta_e_deg", "δe", "°", "{:.3f}"},
          residual,
          status};
}

}  // namespace

Sheet trim_sheet(const std::vector<ConditionReport>& conditions) {
  Sheet sheet;
  sheet.columns = trim_columns(conditions);
  const std::vector<std::string> parameters = shown_parameters(conditions);
  for (const ConditionReport& c : conditions) {
    sheet.rows.push_back(trim_row(c, parameters));
    for (const std::string& note : remarks(c))
      sheet.notes.push_back(c.answer.condition.name + ": " + note + ".");
    if (c.why)
      for (const std::string& words : c.why->words) sheet.notes.push_back("- " + words + ".");
  }
  return sheet;
}

Sheet all_sheet(const std::vector<ConditionReport>& conditions) {
  Sheet sheet;
  sheet.columns = trim_columns(conditions);
  const std::vector<std::string> parameters = shown_parameters(conditions);
  sheet.columns[0].title = "equilibrium";
  sheet.columns.push_back({"verdict", "verdict", ""});
  sheet.columns.push_back({"spectral_abscissa", "largest Re", "1/s", "{:.4f}"});
  sheet.columns.push_back({"found", "found by", ""});
  for (const ConditionReport& c : conditions) {
    if (!c.all) continue;
    const std::string& name = c.answer.condition.name;
    std::size_t number = 0;
    for (const Equilibrium& e : c.all->equilibria) {
      ConditionReport one = c;
      one.answer.trim = e.trim;
      std::vector<SheetCell> row = trim_row(one, parameters);
      row[0] = SheetCell(fmt::format("{} {}", name, ++number));
      row.push_back(e.modes ? SheetCell(to_string(e.modes->verdict), tone_of(e.modes->verdict))
                            : SheetCell());
      row.push_back(e.modes ? SheetCell(e.modes->spectral_abscissa) : SheetCell());
      row.push_back(SheetCell(e.found));
      sheet.rows.push_back(row);
    }
    sheet.notes.push_back(fmt::format(
        "{}: {} equilibri{} found from {} and along {}; there may be others.", name, number,
        number == 1 ? "um" : "a", number_of(std::size_t(c.all->starts), "start"),
        number_of(std::size_t(c.all->branches), "branch")));
  }
  return sheet;
}

Sheet modes_sheet(const ConditionReport& c) { return modes_sheet(*c.modes, c.linear->states); }

Sheet all_modes_sheet(const std::vector<ConditionReport>& conditions) {
  Sheet sheet;
  sheet.columns = {{"name", "", ""},
                   {"status", "", ""},
                   {"verdict", "", ""},
                   {"re", "", ""},
                   {"im", "", ""},
                   {"error", "", ""},
                   {"frequency", "", ""},
                   {"damping", "", ""},
                   {"time_to_half", "", ""},
                   {"condition", "", ""},
                   {"backward_error", "", ""},
                   {"mode", "", ""}};
  for (const ConditionReport& c : conditions) {
    const std::string status = to_string(c.answer.trim.status);
    if (!c.modes || c.modes->modes.empty()) {
      std::vector<SheetCell> row(sheet.columns.size());
      row[0] = c.answer.condition.name;
      row[1] = status;
      sheet.rows.push_back(row);
      continue;
    }
    for (const Mode& m : c.modes->modes)
      sheet.rows.push_back({c.answer.condition.name, status, to_string(c.modes->verdict),
                            m.eigenvalue.real(), m.eigenvalue.imag(), m.error, m.frequency(),
                            number_cell(m.damping()), number_cell(m.time_to_half()), m.condition,
                            m.backward_error, m.name});
  }
  return sheet;
}

namespace {

bool any_all(const std::vector<ConditionReport>& conditions) {
  return std::ranges::any_of(conditions, [](const auto& c) { return c.all.has_value(); });
}

// Verdict, eigenvalues and remarks, or why there is no linear model.
Sheet linear_sheet(const ConditionReport& c) {
  const std::string& name = c.answer.condition.name;
  if (!c.modes) return {name + ": no linear model", {}, {}, {c.linear->message + "."}};
  Sheet sheet =
      judged_modes_sheet(fmt::format("{} ({})", name, formulation_name(c.answer.condition)),
                         *c.modes, c.linear->states);
  for (const std::string& remark : c.linear->remarks) sheet.notes.push_back(remark + ".");
  return sheet;
}

}  // namespace

std::vector<Sheet> conditions_document(const std::vector<ConditionReport>& conditions) {
  std::vector<Sheet> sheets{trim_sheet(conditions)};
  sheets.front().title = "Equilibria";
  if (any_all(conditions)) {
    sheets.push_back(all_sheet(conditions));
    sheets.back().title = "All equilibria found";
  }
  for (const ConditionReport& c : conditions)
    if (c.linear) sheets.push_back(linear_sheet(c));
  return sheets;
}

// Text has no room for the residual, which is below the tolerance where the status is converged.
static Sheet without_residual(Sheet sheet) {
  const auto at = std::ranges::find(sheet.columns, "residual", &SheetColumn::key);
  if (at == sheet.columns.end()) return sheet;
  const auto column = at - sheet.columns.begin();
  sheet.columns.erase(at);
  for (auto& row : sheet.rows) row.erase(row.begin() + column);
  return sheet;
}

std::string conditions_text(const std::vector<ConditionReport>& conditions,
                            const TextStyle& style) {
  std::string text = as_text(without_residual(trim_sheet(conditions)), style);
  if (any_all(conditions)) text += '\n' + as_text(without_residual(all_sheet(conditions)), style);
  for (const ConditionReport& c : conditions) {
    if (!c.linear) continue;
    const std::string& name = c.answer.condition.name;
    if (!c.modes) {
      text += fmt::format("\n{}: {}\n", name, toned("no linear model", Tone::bad, style));
      text += wrapped(c.linear->message + ".", 2, style.width);
      continue;
    }
    text += fmt::format("\n{} ({}): {}\n", name, formulation_name(c.answer.condition),
                        toned(to_string(c.modes->verdict), tone_of(c.modes->verdict), style));
    text += wrapped(verdict_in_words(*c.modes) + ".", 2, style.width);
    text += as_text(modes_sheet(c), style);
    for (const std::string& remark : c.linear->remarks)
      text += wrapped(remark + ".", 2, style.width);
  }
  return text;
}

}  // namespace tiltrim
