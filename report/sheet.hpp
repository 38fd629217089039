/// @file
/// A table described once, printed as text for people, as CSV for programs, and for documents as
/// Markdown, LaTeX and HTML. The numbers are the same words in all but CSV, which has every digit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace tiltrim {

/// How a cell's text is coloured on a terminal.
enum class Tone {
  plain,     ///< as the rest
  good,      ///< green
  bad,       ///< red
  doubtful,  ///< yellow
};

/// A number (printed by its column's format in text, to 17 digits in CSV), words, or nothing.
struct SheetCell {
  std::variant<std::monostate, double, std::string> value;  ///< one of the three
  Tone tone = Tone::plain;                                  ///< of words

  SheetCell() = default;                       ///< nothing
  SheetCell(double number) : value(number) {}  ///< a number
  /// Words.
  SheetCell(std::string words, Tone t = Tone::plain) : value(std::move(words)), tone(t) {}
  SheetCell(const char* words) : value(std::string(words)) {}  ///< words
};

/// What a column holds.
struct SheetColumn {
  std::string key;            ///< CSV header: "theta_deg"
  std::string title;          ///< text header: "θ"
  std::string unit;           ///< text, second header line: "°"
  std::string format = "{}";  ///< of numbers in text, fmt's notation: "{:.3f}"
};

/// A table.
struct Sheet {
  std::string title;                         ///< above it; empty: none
  std::vector<SheetColumn> columns;          ///< from the left
  std::vector<std::vector<SheetCell>> rows;  ///< a cell for each column
  std::vector<std::string> notes;            ///< printed below, one line each
};

/// How text is laid out.
struct TextStyle {
  bool colour = false;      ///< with the terminal's codes
  std::size_t width = 100;  ///< notes are wrapped here
};

/// Aligned text: numbers to the right, words to the left; widths counted in characters, not bytes.
std::string as_text(const Sheet& sheet, const TextStyle& style = {});
/// One header line, then the rows; notes are left out.
std::string as_csv(const Sheet& sheet);
/// A table of GitHub's Markdown: title in bold, numbers to the right, notes as a list.
std::string as_markdown(const Sheet& sheet);
/// A table* (two columns wide), scaled down if it is wider; needs amsmath, array, booktabs,
/// graphicx and siunitx 3.
std::string as_latex(const Sheet& sheet);
/// One after the other, as a report has them; a sheet without columns is a paragraph of its title
/// and its notes.
std::string as_markdown(const std::vector<Sheet>& sheets);
std::string as_latex(const std::vector<Sheet>& sheets);  ///< the same
/// A table of HTML with classes (number, unit, good, bad, doubtful), then a list of class notes; no
/// styles.
std::string as_html(const Sheet& sheet);

/// A number by its column's format; of fixed notation, one with more than ten digits before its
/// point as 1.234567e+300.
std::string number_text(double number, const std::string& format);
/// "2 conditions", "1 condition".
std::string number_of(std::size_t n, const std::string& what);
/// A cell as text prints it: a number by its column's format, "-" for nothing.
std::string cell_text(const SheetCell& cell, const SheetColumn& column);
/// Is there any number in this column?
bool is_numeric(const Sheet& sheet, std::size_t column);

/// Words so that a document shows them as they are: nothing in them acts as markup. Control
/// characters are dropped, what is not UTF-8 becomes U+FFFD. Also for attribute values.
std::string html_escaped(const std::string& text);
/// The same; known symbols become commands, line ends become spaces.
std::string latex_escaped(const std::string& text);
/// The same, for one line or one cell: line ends become spaces.
std::string markdown_escaped(const std::string& text);

/// Every note on one line.
inline constexpr TextStyle unwrapped{.colour = false, .width = SIZE_MAX};
/// A paragraph: a sheet without columns whose title is the first of these lines, its notes the
/// rest.
Sheet paragraph_sheet(const std::string& lines);

/// Words broken into lines of at most `width` characters, each after `indent` spaces.
std::string wrapped(const std::string& words, std::size_t indent, std::size_t width);
/// Words between the terminal's colour codes, if colour is asked for.
std::string toned(const std::string& words, Tone tone, const TextStyle& style);

}  // namespace tiltrim
