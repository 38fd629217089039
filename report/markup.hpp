/// What Markdown, LaTeX and HTML have in common. Internal to report/.
#pragma once

#include <optional>
#include <string>

#include "report/code_points.hpp"
#include "report/sheet.hpp"

namespace tiltrim::markup {

void append_utf8(std::string& text, char32_t c);

/// `written(points, at)` says what becomes of the character points[at]; none: it stays. Control
/// characters but '\n' and '\t' are dropped unasked; what is not UTF-8 is U+FFFD.
template <class Written>
std::string rewritten(const std::string& text, const Written& written) {
  const std::u32string points = code_points(text);
  std::string out;
  for (std::size_t at = 0; at < points.size(); ++at) {
    const char32_t c = points[at];
    const bool control = c < 0x20 || (c >= 0x7F && c < 0xA0);
    if (control && c != '\n' && c != '\t') continue;
    if (const std::optional<std::string> words = written(points, at))
      out += *words;
    else
      append_utf8(out, c);
  }
  return out;
}

/// Without the blanks at either end, which only align text; a note without its "- ".
std::string trimmed(const std::string& text);
std::string without_bullet(const std::string& note);

/// A unit as siunitx has it: "m/s" is \metre\per\second; none for words that are no unit.
std::optional<std::string> siunitx(const std::string& unit);

/// What a column is called, its unit in brackets; what stands for a unit but is none, behind a
/// comma. `escaped` is called on every part.
template <class Escaped>
std::string heading(const SheetColumn& column, const Escaped& escaped, const char* open = "[",
                    const char* close = "]") {
  const std::string title = trimmed(column.title), unit = trimmed(column.unit);
  const std::string words = escaped(title.empty() && unit.empty() ? column.key : title);
  if (unit.empty()) return words;
  if (siunitx(unit)) return words + (words.empty() ? "" : " ") + open + escaped(unit) + close;
  return words + (words.empty() ? "" : ", ") + escaped(unit);
}

}  // namespace tiltrim::markup
