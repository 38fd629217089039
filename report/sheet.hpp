/// @file
/// A table described once and printed as text, as CSV, and as Markdown, LaTeX and HTML for
/// documents. Numbers are formatted identically in all of them except CSV, which has every digit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace tiltrim {

/// Colour of a cell's text on a terminal.
enum class Tone {
  plain,     ///< default colour
  good,      ///< green
  bad,       ///< red
  doubtful,  ///< yellow
};

/// A number (in its column's format in text, with 17 digits in CSV), text, or nothing.
struct SheetCell {
  std::variant<std::monostate, double, std::string> value;  ///< one of the three
  Tone tone = Tone::plain;                                  ///< of text

  SheetCell() = default;                       ///< empty
  SheetCell(double number) : value(number) {}  ///< a number
  /// Text.
  SheetCell(std::string words, Tone t = Tone::plain) : value(std::move(words)), tone(t) {}
  SheetCell(const char* words) : value(std::string(words)) {}  ///< text
};

/// A number; nothing for NaN.
SheetCell number_cell(double number);

/// Key, heading, unit and format of a column.
struct SheetColumn {
  std::string key;            ///< CSV header: "theta_deg"
  std::string title;          ///< text header: "θ"
  std::string unit;           ///< text, second header line: "°"
  std::string format = "{}";  ///< of numbers in text, fmt syntax: "{:.3f}"
  double rounding = 0.0;      ///< smaller numbers are printed as 0, except in CSV
};

/// A table.
struct Sheet {
  std::string title;                         ///< printed above; empty: none
  std::vector<SheetColumn> columns;          ///< from left to right
  std::vector<std::vector<SheetCell>> rows;  ///< one cell per column
  std::vector<std::string> notes;            ///< printed below, one line each
};

/// Layout of text.
struct TextStyle {
  bool colour = false;     ///< with ANSI colour codes
  std::size_t width = 80;  ///< longest line
};

/// Aligned text: numbers right, text left; widths in characters, not bytes. A table that is wider
/// than the style's lines has narrower gaps, cells of several lines, or blocks of columns.
std::string as_text(const Sheet& sheet, const TextStyle& style = {});
/// One header line, then the rows; without notes.
std::string as_csv(const Sheet& sheet);
/// A GitHub Markdown table: bold title, numbers right-aligned, notes as a list.
std::string as_markdown(const Sheet& sheet);
/// A table* (two columns wide), scaled down if wider; requires amsmath, array, booktabs, graphicx
/// and siunitx 3.
std::string as_latex(const Sheet& sheet);
/// Sheets in sequence, for a report; a sheet without columns is a paragraph of its title and notes.
std::string as_markdown(const std::vector<Sheet>& sheets);
std::string as_latex(const std::vector<Sheet>& sheets);  ///< the same
/// An HTML table with classes (number, unit, good, bad, doubtful), then a list of class notes; no
/// styles.
std::string as_html(const Sheet& sheet);

/// A number in its column's format; in fixed notation, a number with more than ten digits before
/// the point is printed as 1.234567e+300.
std::string number_text(double number, const std::string& format);
/// "2 conditions", "1 condition".
std::string number_of(std::size_t n, const std::string& what);
/// A cell as text prints it: a number in its column's format, "-" if empty.
std::string cell_text(const SheetCell& cell, const SheetColumn& column);
/// Whether the column contains a number.
bool is_numeric(const Sheet& sheet, std::size_t column);

/// Escapes text for HTML, including attribute values. Control characters are dropped, invalid
/// UTF-8 becomes U+FFFD.
std::string html_escaped(const std::string& text);
/// The same for LaTeX; known symbols become commands, line ends become spaces.
std::string latex_escaped(const std::string& text);
/// The same for Markdown, on one line or in one cell: line ends become spaces.
std::string markdown_escaped(const std::string& text);

/// Notes on one line each.
inline constexpr TextStyle unwrapped{.colour = false, .width = SIZE_MAX};
/// A paragraph: a sheet without columns; the first of these lines is its title, the rest its notes.
Sheet paragraph_sheet(const std::string& lines);

/// Text wrapped to lines of at most `width` characters, each indented by `indent` spaces.
std::string wrapped(const std::string& words, std::size_t indent, std::size_t width);
/// Text between ANSI colour codes, if the style has colour.
std::string toned(const std::string& words, Tone tone, const TextStyle& style);

/// The key of a quantity of the study among these fields: "damping_2" if "damping" is one.
std::string key_among(const std::string& name, const std::vector<std::string_view>& fields);
/// The same among the columns of a CSV file that are not the study's.
std::string column_key(const std::string& name);

}  // namespace tiltrim
