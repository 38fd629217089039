#include "report/sheet.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <sstream>

#include "report/code_points.hpp"

namespace tiltrim {

namespace {

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string space(width - std::min(width, characters(text)), ' ');
  return right ? space + text : text + space;
}

std::string csv_field(const SheetCell& cell) {
  if (const auto* number = std::get_if<double>(&cell.value)) return fmt::format("{:.17g}", *number);
  const auto* words = std::get_if<std::string>(&cell.value);
  if (!words) return "";
  if (words->find_first_of(",\"\r\n") == std::string::npos) return *words;
  std::string quoted = "\"";
  for (const char c : *words) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace

SheetCell number_cell(double number) {
  return std::isnan(number) ? SheetCell() : SheetCell(number);
}

std::string cell_text(const SheetCell& cell, const SheetColumn& column) {
  if (const auto* number = std::get_if<double>(&cell.value)) {
    const bool noise = std::abs(*number) < column.rounding;
    const std::string shown = number_text(noise ? 0.0 : *number, column.format);
    const bool zero = shown.find_first_of("123456789ni") == std::string::npos;  // not nan, not inf
    return zero ? fmt::format(fmt::runtime(column.format), 0.0) : shown;  // no minus sign before 0
  }
  if (const auto* words = std::get_if<std::string>(&cell.value)) return *words;
  return "-";
}

std::string number_text(double number, const std::string& format) {
  constexpr double many_digits = 1e10;  // too many to read
  const bool fixed = format.ends_with("f}");
  return fixed && std::isfinite(number) && std::abs(number) >= many_digits
             ? fmt::format("{:.7g}", number)
             : fmt::format(fmt::runtime(format), number);
}

std::string number_of(std::size_t n, const std::string& what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : what.ends_with("ch") ? "es" : "s");
}

bool is_numeric(const Sheet& sheet, std::size_t column) {
  return std::ranges::any_of(sheet.rows, [&](const auto& row) {
    return column < row.size() && std::holds_alternative<double>(row[column].value);
  });
}

std::string toned(const std::string& words, Tone tone, const TextStyle& style) {
  if (!style.colour || tone == Tone::plain) return words;
  const char* code = tone == Tone::good ? "32" : tone == Tone::bad ? "31" : "33";
  return fmt::format("\033[{}m{}\033[0m", code, words);
}

Sheet paragraph_sheet(const std::string& lines) {
  Sheet sheet;
  std::istringstream in(lines);
  for (std::string line; std::getline(in, line);) {
    const std::size_t first = line.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    if (sheet.title.empty())
      sheet.title = line.substr(first);
    else
      sheet.notes.push_back(line.substr(first));
  }
  return sheet;
}

std::string wrapped(const std::string& words, std::size_t indent, std::size_t width) {
  std::istringstream in(words);
  std::string text, line(indent, ' '), word;
  bool empty = true;
  while (in >> word) {
    if (!empty && characters(line) + 1 + characters(word) > width) {
      text += line + '\n';
      line.assign(indent, ' ');
      empty = true;
    }
    line += empty ? word : ' ' + word;
    empty = false;
  }
  return text + line + '\n';
}

// ---- Text ---------------------------------------------------------------------------------------

namespace {

constexpr std::size_t left_margin = 2;

// A table or some of its columns as text.
struct Layout {
  std::vector<std::size_t> columns, width;  // width: of each of these
  std::size_t gap = 2;

  std::size_t total() const {
    return std::accumulate(width.begin(), width.end(), left_margin + gap * (width.size() - 1));
  }
};

std::vector<std::string> lines_of(const std::string& text, std::size_t width) {
  if (characters(text) <= width) return {text};
  std::istringstream in(wrapped(text, 0, width));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// The widest of a column's cells, or of the words in them.
std::size_t widest(const Sheet& sheet, std::size_t k, bool word) {
  const SheetColumn& c = sheet.columns[k];
  std::size_t most = std::max(characters(c.title), characters(c.unit));
  for (const auto& row : sheet.rows)
    for (const std::string& line : lines_of(cell_text(row.at(k), c), word ? 1 : SIZE_MAX))
      most = std::max(most, characters(line));
  return most;
}

Layout natural(const Sheet& sheet, const std::vector<std::size_t>& columns, std::size_t gap) {
  Layout layout{columns, {}, gap};
  for (const std::size_t k : columns) layout.width.push_back(widest(sheet, k, false));
  return layout;
}

// Narrows the widest columns of text, whose cells then take several lines.
Layout squeezed(const Sheet& sheet, Layout layout, std::size_t width) {
  constexpr std::size_t readable = 15;
  std::vector<std::size_t> least;
  for (std::size_t i = 0; i < layout.columns.size(); ++i)
    least.push_back(is_numeric(sheet, layout.columns[i])
                        ? layout.width[i]
                        : std::max(readable, widest(sheet, layout.columns[i], true)));
  while (layout.total() > width) {
    std::size_t most = layout.width.size();
    for (std::size_t i = 0; i < layout.width.size(); ++i)
      if (layout.width[i] > least[i] &&
          (most == layout.width.size() || layout.width[i] > layout.width[most]))
        most = i;
    if (most == layout.width.size()) break;
    --layout.width[most];
  }
  return layout;
}

// The columns that identify a row: the first, or the first two if rows share it.
std::size_t identifying(const Sheet& sheet) {
  std::set<std::string> names;
  for (const auto& row : sheet.rows) names.insert(cell_text(row.at(0), sheet.columns[0]));
  return std::min<std::size_t>(names.size() < sheet.rows.size() ? 2 : 1, sheet.columns.size());
}

// The widest layout that fits; otherwise blocks of columns, each with those that identify the row.
// A column without a title belongs to the one on its left.
std::vector<Layout> layouts(const Sheet& sheet, std::size_t width) {
  std::vector<std::size_t> all(sheet.columns.size());
  std::iota(all.begin(), all.end(), 0);
  for (const Layout& one : {natural(sheet, all, 2), natural(sheet, all, 1),
                            squeezed(sheet, natural(sheet, all, 1), width)})
    if (one.total() <= width) return {one};
  const std::size_t keys = identifying(sheet);
  std::vector<std::size_t> block(all.begin(), all.begin() + std::ptrdiff_t(keys));
  std::vector<Layout> blocks;
  for (std::size_t k = keys, end = k; k < all.size(); k = end) {
    std::vector<std::size_t> longer = block;
    do longer.push_back(end++);
    while (end < all.size() && sheet.columns[end].title.empty());
    if (block.size() > keys && squeezed(sheet, natural(sheet, longer, 2), width).total() > width) {
      blocks.push_back(squeezed(sheet, natural(sheet, block, 2), width));
      longer.erase(longer.begin() + std::ptrdiff_t(keys),
                   longer.begin() + std::ptrdiff_t(block.size()));
    }
    block = longer;
  }
  blocks.push_back(squeezed(sheet, natural(sheet, block, 2), width));
  return blocks;
}

// One row, on as many lines as its longest cell takes.
std::string row_text(const Sheet& sheet, const Layout& layout, const auto& text_at,
                     const auto& tone_at, const TextStyle& style) {
  std::vector<std::vector<std::string>> cells;
  std::size_t lines = 1;
  for (std::size_t i = 0; i < layout.columns.size(); ++i) {
    cells.push_back(lines_of(text_at(layout.columns[i]), layout.width[i]));
    lines = std::max(lines, cells.back().size());
  }
  std::string text;
  for (std::size_t l = 0; l < lines; ++l) {
    std::string line(left_margin, ' ');
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::size_t k = layout.columns[i];
      const std::string cell =
          padded(l < cells[i].size() ? cells[i][l] : "", layout.width[i], is_numeric(sheet, k));
      line += std::string(i > 0 ? layout.gap : 0, ' ') + toned(cell, tone_at(k), style);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

}  // namespace

std::string as_text(const Sheet& sheet, const TextStyle& style) {
  const std::size_t above = std::min(sheet.title.find_first_not_of('\n'), sheet.title.size());
  std::string text = sheet.title.substr(0, above);
  if (above < sheet.title.size()) text += wrapped(sheet.title.substr(above), 0, style.width);
  const auto plain = [](std::size_t) { return Tone::plain; };
  const auto unit = [&](std::size_t k) { return sheet.columns[k].unit; };
  const auto blocks = sheet.columns.empty() ? std::vector<Layout>{} : layouts(sheet, style.width);
  for (const Layout& block : blocks) {
    if (&block != &blocks.front()) text += '\n';
    text += row_text(
        sheet, block, [&](std::size_t k) { return sheet.columns[k].title; }, plain, style);
    if (!std::ranges::all_of(block.columns, [&](std::size_t k) { return unit(k).empty(); }))
      text += row_text(sheet, block, unit, plain, style);
    for (const auto& row : sheet.rows)
      text += row_text(
          sheet, block, [&](std::size_t k) { return cell_text(row[k], sheet.columns[k]); },
          [&](std::size_t k) { return row[k].tone; }, style);
  }
  for (const std::string& note : sheet.notes) text += wrapped(note, 2, style.width);
  return text;
}

std::string as_csv(const Sheet& sheet) {
  std::string text;
  for (std::size_t k = 0; k < sheet.columns.size(); ++k)
    text += (k ? "," : "") + sheet.columns[k].key;
  text += '\n';
  for (const auto& row : sheet.rows) {
    for (std::size_t k = 0; k < row.size(); ++k) text += (k ? "," : "") + csv_field(row[k]);
    text += '\n';
  }
  return text;
}

std::string key_among(const std::string& name, const std::vector<std::string_view>& fields) {
  std::string key = name;
  for (int k = 2; std::ranges::find(fields, key) != fields.end(); ++k)
    key = fmt::format("{}_{}", name, k);
  return key;
}

std::string column_key(const std::string& name) {
  static const std::vector<std::string_view> columns{
      "condition", "name",     "kind",          "status",        "verdict",
      "reason",    "residual", "damping",       "second_branch", "spectral_abscissa",
      "unstable",  "which",    "eigenvalue_re", "eigenvalue_im"};
  return key_among(name, columns);
}

}  // namespace tiltrim
