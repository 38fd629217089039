/// A table described once, printed as text for people and as CSV for programs.
#pragma once

#include <cstddef>
#include <string>
#include <variant>
#include <vector>

namespace tiltrim {

/// How a cell's text is coloured on a terminal.
enum class Tone { plain, good, bad, doubtful };

/// A number (printed by its column's format in text, to 17 digits in CSV), words, or nothing.
struct SheetCell {
  std::variant<std::monostate, double, std::string> value;
  Tone tone = Tone::plain;

  SheetCell() = default;
  SheetCell(double number) : value(number) {}
  SheetCell(std::string words, Tone t = Tone::plain) : value(std::move(words)), tone(t) {}
  SheetCell(const char* words) : value(std::string(words)) {}
};

struct SheetColumn {
  std::string key;            ///< CSV header: "theta_deg"
  std::string title;          ///< text header: "θ"
  std::string unit;           ///< text, second header line: "°"
  std::string format = "{}";  ///< of numbers in text, fmt's notation: "{:.3f}"
};

struct Sheet {
  std::string title;
  std::vector<SheetColumn> columns;
  std::vector<std::vector<SheetCell>> rows;
  std::vector<std::string> notes;  ///< printed below, one line each
};

struct TextStyle {
  bool colour = false;
  std::size_t width = 100;  ///< notes are wrapped here
};

/// Aligned text: numbers to the right, words to the left; widths counted in characters, not bytes.
std::string as_text(const Sheet& sheet, const TextStyle& style = {});
/// One header line, then the rows; notes are left out.
std::string as_csv(const Sheet& sheet);

/// Words broken into lines of at most `width` characters, each after `indent` spaces.
std::string wrapped(const std::string& words, std::size_t indent, std::size_t width);
/// Words between the terminal's colour codes, if colour is asked for.
std::string toned(const std::string& words, Tone tone, const TextStyle& style);

}  // namespace tiltrim
