/// Shared by Markdown, LaTeX and HTML. Internal to report/.
#pragma once

#include <optional>
#include <string>

#include "report/code_points.hpp"
#include "report/sheet.hpp"

namespace tiltrim::markup {

void append_utf8(std::string& text, char32_t c);

/// Escapes text: `written(points, at)` returns the replacement of the character points[at], or
/// nothing to keep it. Control characters other than tab and line feed are dropped; invalid UTF-8
/// becomes U+FFFD.
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

/// Without blanks at either end, which only align text; a note without its "- ".
std::string trimmed(const std::string& text);
std::string without_bullet(const std::string& note);

/// A unit in siunitx notation: "m/s" is \metre\per\second; empty for words that are no unit.
std::optional<std::string> siunitx(const std::string& unit);

/// A column's heading with its unit in brackets; an entry of the unit line that is no unit follows
/// a comma. `escaped` is applied to every part.
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
