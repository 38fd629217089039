// Sheets as Markdown and HTML.
#include <fmt/format.h>

#include <algorithm>

#include "report/markup.hpp"

namespace tiltrim {

using namespace markup;

void markup::append_utf8(std::string& text, char32_t c) {
  const auto add = [&](char32_t byte) { text += static_cast<char>(byte); };
  const int more = c < 0x80 ? 0 : c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
  add(more == 0 ? c : (0xFF00u >> (more + 1) & 0xFFu) | c >> 6 * more);
  for (int k = more - 1; k >= 0; --k) add(0x80 | (c >> 6 * k & 0x3F));
}

std::string markup::trimmed(const std::string& text) {
  constexpr const char* blank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blank);
  return first == std::string::npos ? ""
                                    : text.substr(first, text.find_last_not_of(blank) + 1 - first);
}

std::string markup::without_bullet(const std::string& note) {
  const std::string words = trimmed(note);
  return words.starts_with("- ") ? trimmed(words.substr(2)) : words;
}

namespace {

bool is_nothing(const SheetCell& cell) {
  return std::holds_alternative<std::monostate>(cell.value);
}

// Notes without table or title are paragraphs, not a list.
bool is_words(const Sheet& sheet) { return sheet.columns.empty() && trimmed(sheet.title).empty(); }

// ---- Markdown -----------------------------------------------------------------------------------

std::string markdown_cell(const SheetCell& cell, const SheetColumn& column) {
  return is_nothing(cell) ? "–" : markdown_escaped(trimmed(cell_text(cell, column)));
}

std::string markdown_table(const Sheet& sheet) {
  const std::size_t n = sheet.columns.size();
  std::vector<std::vector<std::string>> lines(1);
  for (const SheetColumn& c : sheet.columns)
    lines.front().push_back(heading(c, markdown_escaped));  // "[°]" has no link definition
  for (const auto& row : sheet.rows) {
    lines.emplace_back();
    for (std::size_t k = 0; k < n; ++k)
      lines.back().push_back(markdown_cell(row.at(k), sheet.columns[k]));
  }
  std::vector<std::size_t> width(n, 3);
  for (const auto& line : lines)
    for (std::size_t k = 0; k < n; ++k) width[k] = std::max(width[k], characters(line[k]));
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += '|';
    for (std::size_t k = 0; k < n; ++k) {
      const std::string space(width[k] - characters(lines[i][k]), ' ');
      text += is_numeric(sheet, k) ? ' ' + space + lines[i][k] + " |"
                                   : ' ' + lines[i][k] + space + " |";
    }
    text += '\n';
    if (i > 0) continue;
    text += '|';
    for (std::size_t k = 0; k < n; ++k)
      text += is_numeric(sheet, k) ? ' ' + std::string(width[k] - 1, '-') + ": |"
                                   : " :" + std::string(width[k] - 1, '-') + " |";
    text += '\n';
  }
  return text;
}

// ---- HTML ---------------------------------------------------------------------------------------

const char* tone_class(Tone tone) {
  switch (tone) {
    case Tone::good:
      return "good";
    case Tone::bad:
      return "bad";
    case Tone::doubtful:
      return "doubtful";
    case Tone::plain:
      break;
  }
  return "";
}

std::string attribute(const char* name, const std::string& value) {
  return value.empty() ? "" : fmt::format(" {}=\"{}\"", name, html_escaped(value));
}

std::string html_head(const SheetColumn& column, bool number) {
  std::string words = heading(column, html_escaped, "<span class=\"unit\">[", "]</span>");
  if (words.starts_with("± ")) words.replace(0, std::string("± ").size(), "±&nbsp;");
  return fmt::format("<th scope=\"col\"{}{}>{}</th>", attribute("data-key", column.key),
                     attribute("class", number ? "number" : ""), words);
}

std::string html_cell(const SheetCell& cell, const SheetColumn& column, bool number, bool heads) {
  std::string classes = number ? "number" : "";
  if (cell.tone != Tone::plain)
    classes += (classes.empty() ? "" : " ") + std::string(tone_class(cell.tone));
  std::string words = is_nothing(cell) ? "–" : html_escaped(trimmed(cell_text(cell, column)));
  // A name may break before its last part, if that is a word.
  constexpr std::size_t least = 5;  // letters
  for (std::size_t at = words.find('_'); at != words.npos; at = words.find('_', at + 1)) {
    const std::size_t end = words.find_first_not_of("abcdefghijklmnopqrstuvwxyz", at + 1);
    if (std::min(end, words.size()) - at > least) words.insert(at + 1, "<wbr>");
  }
  return fmt::format("<{}{}>{}</{}>", heads ? "th scope=\"row\"" : "td",
                     attribute("class", classes), words, heads ? "th" : "td");
}

std::string html_table(const Sheet& sheet) {
  const std::size_t n = sheet.columns.size();
  std::vector<bool> number(n);
  for (std::size_t k = 0; k < n; ++k) number[k] = is_numeric(sheet, k);
  std::string html = "<table>\n";
  if (!sheet.title.empty())
    html += fmt::format("<caption><span>{}</span></caption>\n", html_escaped(trimmed(sheet.title)));
  html += "<thead>\n<tr>";
  for (std::size_t k = 0; k < n; ++k) html += html_head(sheet.columns[k], number[k]);
  html += "</tr>\n</thead>\n<tbody>\n";
  for (const auto& row : sheet.rows) {
    html += "<tr>";
    for (std::size_t k = 0; k < n; ++k)
      html += html_cell(row.at(k), sheet.columns[k], number[k], k == 0 && !number[k]);
    html += "</tr>\n";
  }
  return html + "</tbody>\n</table>\n";
}

}  // namespace

std::string markdown_escaped(const std::string& text) {
  // Markers of lists and heading underlines count only at the beginning.
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto begins_block = [&](const std::u32string& points, std::size_t at) {
    const char32_t c = points[at], next = at + 1 < points.size() ? points[at + 1] : U' ';
    if (at == 0 && (c == '-' || c == '+' || c == '=')) return next == ' ' || next == c;
    return at > 0 && at == digits && (c == '.' || c == ')') && next == ' ';
  };
  return rewritten(text, [&](const std::u32string& points, std::size_t at) {
    const char32_t c = points[at];
    constexpr std::u32string_view marks = U"\\|*_`[]#~$";
    std::optional<std::string> words;
    if (c == '<')
      words = "&lt;";
    else if (c == '>')
      words = "&gt;";
    else if (c == '&')
      words = "&amp;";
    else if (c == '\n' || c == '\t')
      words = " ";
    else if (marks.find(c) != marks.npos || begins_block(points, at))
      words = {'\\', char(c)};
    return words;
  });
}

std::string as_markdown(const Sheet& sheet) {
  std::string text;
  const auto block = [&](const std::string& words) { text += (text.empty() ? "" : "\n") + words; };
  if (!trimmed(sheet.title).empty()) block("**" + markdown_escaped(trimmed(sheet.title)) + "**\n");
  if (!sheet.columns.empty()) block(markdown_table(sheet));
  const bool words = is_words(sheet);
  std::string notes;
  for (const std::string& note : sheet.notes)
    notes += std::string(!words          ? "- "
                         : notes.empty() ? ""
                                         : "\n") +
             markdown_escaped(without_bullet(note)) + '\n';
  if (!notes.empty()) block(notes);
  return text;
}

std::string as_markdown(const std::vector<Sheet>& sheets) {
  std::string text;
  for (const Sheet& sheet : sheets)
    if (const std::string one = as_markdown(sheet); !one.empty())
      text += (text.empty() ? "" : "\n") + one;
  return text;
}

std::string html_escaped(const std::string& text) {
  return rewritten(text,
                   [](const std::u32string& points, std::size_t at) -> std::optional<std::string> {
                     switch (points[at]) {
                       case '&':
                         return "&amp;";
                       case '<':
                         return "&lt;";
                       case '>':
                         return "&gt;";
                       case '"':
                         return "&quot;";
                       case '\'':
                         return "&#39;";
                       default:
                         return {};
                     }
                   });
}

std::string as_html(const Sheet& sheet) {
  std::string html;
  if (!sheet.columns.empty())
    html += html_table(sheet);
  else if (!sheet.title.empty())
    html += fmt::format("<p>{}</p>\n", html_escaped(trimmed(sheet.title)));
  if (sheet.notes.empty()) return html;
  const bool words = is_words(sheet);
  if (!words) html += "<ul class=\"notes\">\n";
  for (const std::string& note : sheet.notes)
    html += fmt::format("<{0}>{1}</{0}>\n", words ? "p" : "li", html_escaped(without_bullet(note)));
  return html + (words ? "" : "</ul>\n");
}

}  // namespace tiltrim
