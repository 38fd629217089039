#include "report/load_sheets.hpp"

#include <fmt/core.h>

#include "model/degrees.hpp"
#include "report/json.hpp"
#include "vehicles/xv15/loads.hpp"

namespace tiltrim {

namespace {

using json::ordered_json;

std::vector<SheetCell> cells(const std::string& name, const xv15::Load& load) {
  return {SheetCell(name), load.X, load.Z, load.M};
}

const std::vector<SheetColumn>& columns() {
  static const std::vector<SheetColumn> all{{"component", "component", ""},
                                            {"X", "X", "N", "{:.1f}"},
                                            {"Z", "Z", "N", "{:.1f}"},
                                            {"M", "M", "N m", "{:.1f}"}};
  return all;
}

Sheet sheet_of(const LoadsAnswer& answer) {
  Sheet sheet{answer.name, columns(), {}, {}};
  if (!answer.message.empty()) {
    sheet.columns.clear();
    sheet.notes = {"no loads: " + answer.message};
    return sheet;
  }
  const xv15::Loads& at = answer.loads;
  for (const auto& [name, load] : at.components) sheet.rows.push_back(cells(name, load));
  sheet.rows.push_back(cells("total", at.total));
  sheet.notes = {fmt::format(
      "induced velocity {:.4f} m/s, thrust of each rotor {:.1f} N, collective {:.4f}°, wing alpha "
      "{:.4f}°",
      at.induced_velocity, at.thrust, at.collective * degrees, at.wing_alpha * degrees)};
  return sheet;
}

ordered_json json_of(const xv15::Load& load) {
  return {{"X", load.X}, {"Z", load.Z}, {"M", load.M}};
}

}  // namespace

std::vector<Sheet> loads_document(const std::vector<LoadsAnswer>& answers) {
  std::vector<Sheet> sheets;
  for (const LoadsAnswer& answer : answers) sheets.push_back(sheet_of(answer));
  return sheets;
}

std::string loads_text(const std::vector<LoadsAnswer>& answers, const TextStyle& style) {
  std::string text;
  for (const Sheet& sheet : loads_document(answers))
    text += (text.empty() ? "" : "\n") + as_text(sheet, style);
  return text;
}

Sheet loads_sheet(const std::vector<LoadsAnswer>& answers) {
  Sheet sheet{"", columns(), {}, {}};
  sheet.columns.insert(sheet.columns.begin(), {"condition", "condition", ""});
  for (const LoadsAnswer& answer : answers)
    for (const Sheet& own : loads_document({answer}))
      for (std::vector<SheetCell> row : own.rows) {
        row.insert(row.begin(), SheetCell(answer.name));
        sheet.rows.push_back(row);
      }
  return sheet;
}

std::string loads_json(const std::vector<LoadsAnswer>& answers) {
  ordered_json conditions = ordered_json::array();
  for (const LoadsAnswer& answer : answers) {
    ordered_json own{{"name", answer.name},
                     {"status", answer.message.empty() ? "evaluated" : "silent"},
                     {"message", answer.message}};
    if (answer.message.empty()) {
      for (const auto& [name, load] : answer.loads.components)
        own["components"][name] = json_of(load);
      own["total"] = json_of(answer.loads.total);
      own["induced_velocity"] = answer.loads.induced_velocity;
      own["thrust"] = answer.loads.thrust;
      own["collective_deg"] = answer.loads.collective * degrees;
      own["wing_alpha_deg"] = answer.loads.wing_alpha * degrees;
    }
    conditions.push_back(own);
  }
  return ordered_json{{"conditions", conditions}}.dump(2) + "\n";
}

}  // namespace tiltrim
