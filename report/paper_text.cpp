#include <fmt/ranges.h>

#include "model/degrees.hpp"
#include "report/paper.hpp"

namespace tiltrim {

namespace {

Tone tone_of(const Cell& cell) {
  return cell.matches()                              ? Tone::good
         : cell.agreement == Agreement::not_computed ? Tone::plain
                                                     : Tone::bad;
}

// Printed, computed, and the deviation in units of the last printed digit, in adjacent columns.
Sheet table_sheet(const Table& table, const Columns<std::string>& columns) {
  Sheet sheet{table.title, {{"quantity", "", ""}}, {}, table.notes};
  for (const std::string& name : columns) {
    sheet.columns.push_back({name + "_published", name, "printed"});
    sheet.columns.push_back({name + "_computed", "", "computed", "{:.7g}"});
    sheet.columns.push_back({name + "_off", "", "off", "{:+.2f}"});
  }
  for (const Row& row : table.rows) {
    std::vector<SheetCell> cells{row.name + (row.unit.empty() ? "" : " [" + row.unit + "]")};
    for (const Cell& cell : row.cells) {
      cells.push_back(SheetCell(cell.published.text, tone_of(cell)));
      cells.push_back(cell.computed ? SheetCell(*cell.computed) : SheetCell());
      cells.push_back(cell.deviation ? SheetCell(*cell.deviation) : SheetCell());
    }
    sheet.rows.push_back(cells);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const Cell& cell = row.cells[k];
      const std::string where = row.name + ", " + columns[k] + ": " + to_string(cell.agreement);
      if (!cell.remark.empty()) sheet.notes.push_back(where + "; " + cell.remark + ".");
    }
  }
  return sheet;
}

Sheet identification_sheet(const PaperTables& t) {
  Sheet sheet{"The two constants that give the six numbers theta0 and a1s of Table 3",
              {{"reading", "digits read as", ""},
               {"thrust_excess", "Ep", "", "{:.5f}"},
               {"thrust_excess_lower", "Ep from", "", "{:.6f}"},
               {"thrust_excess_upper", "to", "", "{:.6f}"},
               {"k", "k", "", "{:.7f}"},
               {"k_lower", "k from", "", "{:.7f}"},
               {"k_upper", "to", "", "{:.7f}"},
               {"effective_speed", "V + vi", "m/s", "{:.4f}"},
               {"worst", "worst miss", "digits", "{:.3f}"},
               {"status", "status", ""}},
              {},
              {}};
  const auto add = [&](const std::string& name, const Identification& id) {
    const auto end = [](const std::optional<Range>& r, double Range::*which) {
      return r ? SheetCell((*r).*which) : SheetCell();
    };
    sheet.rows.push_back(
        {SheetCell(name), id.thrust_excess, end(id.thrust_excess_range, &Range::lower),
         end(id.thrust_excess_range, &Range::upper), id.k, end(id.k_range, &Range::lower),
         end(id.k_range, &Range::upper), id.effective_speed, id.worst,
         SheetCell(to_string(id.status),
                   id.status == IdentifyStatus::reproduced ? Tone::good : Tone::doubtful)});
    if (!id.message.empty()) sheet.notes.push_back(name + ": " + id.message + ".");
  };
  add("truncated", t.identified);
  add("truncated, Ep = 1.4", t.at_excess_1_4);
  add("rounded", t.as_rounded);
  add("rounded, Ep = 1.4", t.as_rounded_at_excess_1_4);
  return sheet;
}

Sheet elevator_sheet(const PaperTables& t) {
  Sheet sheet{"What Table 3 implies for the elevator (third row of (15))",
              {{"column", "column", ""},
               {"CM_required", "CM required", "", "{:.5f}"},
               {"CM_published", "Table 2", "", "{:.5f}"},
               {"CM_increment", "increment", "", "{:+.5f}"},
               {"slope", "per printed δe", "1/rad", "{:+.4f}"},
               {"delta_e_deg", "δe here", "°", "{:.2f}"}},
              {},
              {t.elevator.finding}};
  for (std::size_t k = 0; k < 3; ++k) {
    const ElevatorColumn& e = t.elevator.columns[k];
    sheet.rows.push_back({SheetCell(t.published.columns[k]), e.CM_required, e.CM_published,
                          e.CM_increment, e.slope,
                          e.delta_e ? SheetCell(*e.delta_e * degrees) : SheetCell()});
  }
  return sheet;
}

std::vector<SheetCell> corrected_row(const CorrectedColumn& c) {
  const auto angle = [](const std::optional<double>& a) {
    return a ? SheetCell(*a * degrees) : SheetCell();
  };
  return {SheetCell(c.name),
          c.condition.V,
          c.condition.gamma * degrees,
          c.condition.eta * degrees,
          angle(c.theta),
          c.theta0 ? SheetCell(*c.theta0) : SheetCell(),
          angle(c.a1s),
          angle(c.delta_e),
          SheetCell(to_string(c.trim.status), c.trim ? Tone::good : Tone::bad),
          c.verdict ? SheetCell(to_string(*c.verdict)) : SheetCell()};
}

Sheet corrected_sheet(const std::string& title, const std::vector<CorrectedColumn>& columns) {
  Sheet sheet{title,
              {{"name", "condition", ""},
               {"V", "V", "m/s", "{:.2f}"},
               {"gamma_deg", "γ", "°", "{:.1f}"},
               {"eta_deg", "η", "°", "{:.1f}"},
               {"theta_deg", "θ", "°", "{:.3f}"},
               {"theta0", "θ₀", "", "{:.5f}"},
               {"a1s_deg", "a1s", "°", "{:.3f}"},
               {"delta_e_deg", "δe", "°", "{:.3f}"},
               {"status", "status", ""},
               {"verdict", "verdict", ""}},
              {},
              {}};
  for (const CorrectedColumn& c : columns) {
    sheet.rows.push_back(corrected_row(c));
    if (!c.finding.empty()) sheet.notes.push_back(c.finding + ".");
  }
  return sheet;
}

std::string slip_text(const Slip& slip, std::size_t number, const TextStyle& style) {
  const std::string state = slip.confirmed() ? toned("confirmed", Tone::good, style)
                                             : toned("not confirmed", Tone::doubtful, style);
  std::string text = fmt::format("  {}. {} ({})\n", number, slip.where, state);
  text += wrapped("printed: " + slip.printed, 5, style.width);
  text += wrapped("consistent: " + slip.consistent, 5, style.width);
  text += wrapped(slip.why, 5, style.width);
  for (const Evidence& e : slip.evidence)
    text +=
        wrapped(fmt::format("{}: {:.6g}{}{}", e.what, e.value, e.unit.empty() ? "" : " ", e.unit),
                7, style.width);
  return text;
}

std::vector<CorrectedColumn> list(const CorrectedTable& table) {
  return {table.columns.begin(), table.columns.end()};
}

}  // namespace

std::vector<Sheet> paper_sheets(const PaperTables& t) {
  std::vector<Sheet> sheets;
  for (const Table* table : {&t.table1, &t.table2, &t.table3})
    sheets.push_back(table_sheet(*table, t.published.columns));
  sheets.push_back(identification_sheet(t));
  sheets.push_back(elevator_sheet(t));
  for (const CorrectedTable* table : {&t.level_body, &t.free_pitch})
    sheets.push_back(corrected_sheet(table->title, list(*table)));
  sheets.push_back(corrected_sheet("The climb with (3) as printed", {t.wake_as_printed}));
  return sheets;
}

static const char* const off = "off: computed less printed, in units of the last printed digit.";

std::string paper_text(const PaperTables& t, const TextStyle& style) {
  std::string text = wrapped("Source: " + t.published.source + ".", 0, style.width);
  text += wrapped(off, 0, style.width);
  for (const Sheet& sheet : paper_sheets(t)) text += '\n' + as_text(sheet, style);
  text += "\nSlips in the printed equations and tables\n";
  for (std::size_t i = 0; i < t.slips.size(); ++i) text += slip_text(t.slips[i], i + 1, style);
  text += "\nFindings\n";
  for (const std::string& finding : t.findings) text += wrapped("- " + finding, 2, style.width);
  return text;
}

std::vector<Sheet> paper_document(const PaperTables& t) {
  std::vector<Sheet> sheets{{"Source: " + t.published.source + ".", {}, {}, {off}}};
  for (Sheet& sheet : paper_sheets(t)) {
    if (sheet.title.starts_with("Table ")) sheet.title.insert(0, "The paper's ");
    sheets.push_back(std::move(sheet));
  }
  sheets.push_back({"Slips in the printed equations and tables", {}, {}, {}});
  for (std::size_t i = 0; i < t.slips.size(); ++i)
    sheets.push_back(paragraph_sheet(slip_text(t.slips[i], i + 1, unwrapped)));
  sheets.push_back({"Findings", {}, {}, t.findings});
  return sheets;
}

std::string paper_csv(const PaperTables& t) {
  Sheet sheet{"",
              {{"table", "", ""},
               {"quantity", "", ""},
               {"column", "", ""},
               {"published", "", ""},
               {"computed", "", ""},
               {"deviation", "", ""},
               {"agreement", "", ""}},
              {},
              {}};
  int number = 0;
  for (const Table* table : {&t.table1, &t.table2, &t.table3}) {
    ++number;
    for (const Row& row : table->rows)
      for (std::size_t k = 0; k < 3; ++k) {
        const Cell& c = row.cells[k];
        sheet.rows.push_back({SheetCell(std::to_string(number)), SheetCell(row.name),
                              SheetCell(t.published.columns[k]), SheetCell(c.published.text),
                              c.computed ? SheetCell(*c.computed) : SheetCell(),
                              c.deviation ? SheetCell(*c.deviation) : SheetCell(),
                              SheetCell(to_string(c.agreement))});
      }
  }
  return as_csv(sheet);
}

}  // namespace tiltrim
