#include "report/envelopes.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "model/degrees.hpp"
#include "report/json.hpp"
#include "report/user_columns.hpp"

namespace tiltrim {

using Eigen::Index;
using json::ordered_json;

namespace {

// A coordinate of the envelope's plane in the study's unit: angles of the tiltrotor in degrees.
double across(const EnvelopeAnswer& e, double x) { return e.table.along.in_study(x); }
double up(const EnvelopeAnswer& e, double y) {
  return e.condition.user() ? e.table.over.in_study(y) : y * degrees;
}

std::string unit_of(const Key& key) { return key.unit == "degrees" ? "°" : key.unit; }

SheetColumn over_column(const EnvelopeAnswer& e, const char* format) {
  const Key& over = e.table.over;
  if (e.condition.user()) return {over.name, over.signal, unit_of(over), "{:.6g}"};
  return {over.name, over.signal == "eta" ? "η" : "γ", "°", format};
}

SheetColumn along_column(const EnvelopeAnswer& e, const std::string& which, const char* format) {
  const Key& along = e.table.along;
  return {which.empty() ? along.name : along.name + "_" + which,
          which.empty() ? along.signal : along.signal + " " + which, unit_of(along),
          e.condition.user() ? "{:.7g}" : format};
}

std::string held(const EnvelopeAnswer& e) {
  const bool over_tilt = e.table.over.signal == "eta";
  return fmt::format(
      "{} = {:.6g}°", over_tilt ? "γ" : "η",
      (over_tilt ? e.condition.command()->gamma : e.condition.command()->eta) * degrees);
}

std::string words(const std::string& name) {
  const bool limit = name.ends_with(" upper") || name.ends_with(" lower");
  return name == "edge" ? "end of the range" : limit ? name + " limit" : name;
}

}  // namespace

Sheet envelope_sheet(const EnvelopeAnswer& e) {
  Sheet sheet;
  sheet.columns = {over_column(e, "{:.2f}"),
                   along_column(e, "from", "{:.6f}"),
                   {"from", "stopped by", ""},
                   along_column(e, "to", "{:.6f}"),
                   {"to", "stopped by", ""}};
  for (const Envelope& part : e.parts)
    for (const EnvelopeRow& row : part.rows) {
      if (row.intervals.empty())
        sheet.rows.push_back({up(e, row.y), {}, SheetCell("no trim found"), {}, {}});
      for (const EnvelopeInterval& i : row.intervals)
        sheet.rows.push_back({up(e, row.y), across(e, i.from.x), SheetCell(words(i.from.name)),
                              across(e, i.to.x), SheetCell(words(i.to.name))});
    }
  return sheet;
}

namespace {

std::vector<SheetColumn> border_columns(const EnvelopeAnswer& e) {
  std::vector<SheetColumn> columns{{"name", "", ""},
                                   {"piece", "", ""},
                                   {"stopped_by", "", ""},
                                   along_column(e, "", "{}"),
                                   over_column(e, "{}")};
  const std::vector<SheetColumn> own = e.condition.user()
                                           ? user_columns(e.model, {})
                                           : std::vector<SheetColumn>{{"theta_deg", "", ""},
                                                                      {"theta0", "", ""},
                                                                      {"a1s_deg", "", ""},
                                                                      {"delta_e_deg", "", ""}};
  columns.insert(columns.end(), own.begin(), own.end());
  columns.insert(columns.end(), {{"outer", "", ""}, {"residual", "", ""}});
  return columns;
}

std::vector<SheetCell> border_cells(const EnvelopeAnswer& e, const BorderPiece::Point& p) {
  if (e.condition.user()) return user_cells(e.model, {}, p.point, p.outputs);
  const auto output = [&](const char* name) { return p.outputs[find(e.model.outputs, name)]; };
  return {p.point.x[find(e.model.states, "theta")] * degrees, output("theta0"),
          output("a1s") * degrees, output("delta_e") * degrees};
}

}  // namespace

Sheet border_sheet(const std::vector<EnvelopeAnswer>& envelopes) {
  Sheet sheet;
  for (const EnvelopeAnswer& e : envelopes) {
    if (sheet.columns.empty()) sheet.columns = border_columns(e);
    double piece = 0;
    for (const Envelope& part : e.parts)
      for (const BorderPiece& b : part.pieces) {
        ++piece;
        for (const BorderPiece::Point& p : b.points) {
          std::vector<SheetCell> row{e.condition.name, piece, b.name, across(e, p.x), up(e, p.y)};
          const std::vector<SheetCell> own = border_cells(e, p);
          row.insert(row.end(), own.begin(), own.end());
          row.insert(row.end(), {p.outer ? 1.0 : 0.0, p.residual});
          sheet.rows.push_back(row);
        }
      }
  }
  return sheet;
}

namespace {

// The pieces of the boundary, for reading.
Sheet pieces_sheet(const EnvelopeAnswer& e) {
  Sheet border;
  border.columns = {{"", "boundary", ""},  along_column(e, "", "{:.4f}"), over_column(e, "{:.3f}"),
                    {"", "begins at", ""}, along_column(e, "", "{:.4f}"), over_column(e, "{:.3f}"),
                    {"", "ends at", ""},   {"", "points", "", "{:.0f}"}};
  std::size_t inner = 0, multiple = 0;
  for (const Envelope& part : e.parts) {
    for (Index k = 0; k < part.count.size(); ++k) multiple += part.count.data()[k] > 1;
    for (const BorderPiece& b : part.pieces) {
      if (b.points.empty()) continue;
      if (std::ranges::none_of(b.points, &BorderPiece::Point::outer)) {
        ++inner;
        continue;
      }
      const BorderPiece::Point &first = b.points.front(), &last = b.points.back();
      border.rows.push_back({SheetCell(words(b.name)), across(e, first.x), up(e, first.y),
                             SheetCell(words(b.from)), across(e, last.x), up(e, last.y),
                             SheetCell(words(b.to)), double(b.points.size())});
    }
  }
  if (multiple > 0)
    border.notes.push_back(fmt::format("{} {} more than one trim.",
                                       number_of(multiple, "grid point"),
                                       multiple == 1 ? "has" : "have"));
  if (multiple > 0 && inner > 0)
    border.notes.back() += fmt::format(
        " {} of the boundary {} inside (folds, or limits of one of several trims); "
        "--format csv or json lists them.",
        number_of(inner, "piece"), inner == 1 ? "lies" : "lie");
  return border;
}

std::string asked(const EnvelopeAnswer& e) {
  if (e.condition.user())
    return fmt::format("{}: {} with a trim within the limits, over {}", e.condition.name,
                       e.table.along.signal, e.table.over.signal);
  return fmt::format("{}: speeds with a trim within the limits, over {} at {}", e.condition.name,
                     e.table.over.signal == "eta" ? "tilt (conversion corridor)" : "path angle",
                     held(e));
}

std::string incomplete(const EnvelopeAnswer& e) {
  const char* const may = "regions missing here may still have trims";
  if (e.has(EnvelopeStatus::interrupted)) return fmt::format("interrupted: {}", may);
  return fmt::format(
      "the boundary has more than {} pieces, or a piece with more points than are followed, or a "
      "point has more than {} trims (an angle without limits has the same again every turn): {}",
      most_border_pieces, most_sheets, may);
}

}  // namespace

std::string envelopes_text(const std::vector<EnvelopeAnswer>& envelopes, const TextStyle& style) {
  std::string text;
  for (const EnvelopeAnswer& e : envelopes) {
    text += (text.empty() ? "" : "\n") + wrapped(asked(e), 0, style.width);
    if (!e.answered())
      text += wrapped(toned(incomplete(e), Tone::bad, style) + ".", 2, style.width);
    text += as_text(envelope_sheet(e), style);
    const Sheet border = pieces_sheet(e);
    if (!border.rows.empty()) text += '\n' + as_text(border, style);
  }
  return text;
}

std::vector<Sheet> envelopes_document(const std::vector<EnvelopeAnswer>& envelopes) {
  std::vector<Sheet> sheets;
  for (const EnvelopeAnswer& e : envelopes) {
    sheets.push_back(envelope_sheet(e));
    sheets.back().title = asked(e);
    if (!e.answered()) sheets.back().notes.push_back(incomplete(e) + ".");
    Sheet border = pieces_sheet(e);
    border.title = e.condition.name + ": the boundary";
    if (!border.rows.empty()) sheets.push_back(std::move(border));
  }
  return sheets;
}

// Of parts, rows, ends of intervals and points.
static const std::vector<std::string_view> envelope_fields{
    "status", "evaluations", "rows",  "pieces", "count",  "intervals",
    "which",  "outer",       "state", "input",  "output", "residual"};

std::string envelopes_json(const std::vector<EnvelopeAnswer>& envelopes) {
  ordered_json all{{"envelopes", ordered_json::array()}};
  for (const EnvelopeAnswer& e : envelopes) {
    const std::string over = key_among(e.table.over.name, envelope_fields);
    const std::string along = key_among(e.table.along.name, envelope_fields);
    ordered_json j{
        {"condition", e.condition.name}, {"over", e.table.over.name}, {"model", e.model.name}};
    j["parts"] = ordered_json::array();
    for (const Envelope& part : e.parts) {
      ordered_json p;
      p["status"] = to_string(part.status);
      p[along] = {across(e, part.x.range.lower), across(e, part.x.range.upper)};
      p[over] = {up(e, part.y.range.lower), up(e, part.y.range.upper)};
      p["evaluations"] = part.evaluations;
      p["rows"] = ordered_json::array();
      for (const EnvelopeRow& row : part.rows) {
        ordered_json r{{over, up(e, row.y)}, {"intervals", ordered_json::array()}};
        for (const EnvelopeInterval& i : row.intervals)
          r["intervals"].push_back(
              {{"from", {{along, across(e, i.from.x)}, {"which", i.from.name}}},
               {"to", {{along, across(e, i.to.x)}, {"which", i.to.name}}}});
        p["rows"].push_back(r);
      }
      p["pieces"] = ordered_json::array();
      for (const BorderPiece& b : part.pieces) {
        ordered_json piece{{"which", b.name}, {"from", b.from}, {"to", b.to}};
        piece["points"] = ordered_json::array();
        for (const BorderPiece::Point& at : b.points) {
          ordered_json point{{along, across(e, at.x)}, {over, up(e, at.y)}, {"outer", at.outer}};
          point.update(json::point(e.model, at.point, at.outputs));
          point["residual"] = at.residual;
          piece["points"].push_back(point);
        }
        p["pieces"].push_back(piece);
      }
      p["count"] = ordered_json::array();  // number of trims, a list for each V
      for (Index i = 0; i < part.count.rows(); ++i) {
        p["count"].push_back(ordered_json::array());
        for (Index k = 0; k < part.count.cols(); ++k) p["count"].back().push_back(part.count(i, k));
      }
      j["parts"].push_back(p);
    }
    all["envelopes"].push_back(j);
  }
  return all.dump(1) + '\n';
}

}  // namespace tiltrim
