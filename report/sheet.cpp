#include "report/sheet.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
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

std::string cell_text(const SheetCell& cell, const SheetColumn& column) {
  if (const auto* number = std::get_if<double>(&cell.value)) {
    const std::string shown = number_text(*number, column.format);
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

std::string as_text(const Sheet& sheet, const TextStyle& style) {
  const std::size_t n = sheet.columns.size();
  std::vector<std::size_t> width(n);
  std::vector<bool> right(n);
  for (std::size_t k = 0; k < n; ++k) {
    const SheetColumn& c = sheet.columns[k];
    width[k] = std::max(characters(c.title), characters(c.unit));
    right[k] = is_numeric(sheet, k);
    for (const auto& row : sheet.rows)
      width[k] = std::max(width[k], characters(cell_text(row.at(k), c)));
  }
  const auto line = [&](const auto& text_at, const auto& tone_at) {
    std::string text = " ";
    for (std::size_t k = 0; k < n; ++k)
      text += ' ' + toned(padded(text_at(k), width[k], right[k]), tone_at(k), style) + ' ';
    return text.substr(0, text.find_last_not_of(' ') + 1) + '\n';
  };
  const auto plain = [](std::size_t) { return Tone::plain; };
  std::string text = sheet.title.empty() ? "" : sheet.title + "\n";
  text += line([&](std::size_t k) { return sheet.columns[k].title; }, plain);
  if (std::ranges::any_of(sheet.columns, [](const auto& c) { return !c.unit.empty(); }))
    text += line([&](std::size_t k) { return sheet.columns[k].unit; }, plain);
  for (const auto& row : sheet.rows)
    text += line([&](std::size_t k) { return cell_text(row[k], sheet.columns[k]); },
                 [&](std::size_t k) { return row[k].tone; });
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

}  // namespace tiltrim
