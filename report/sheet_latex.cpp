// Sheets as LaTeX: booktabs tables with numbers aligned by siunitx.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <utility>

#include "report/markup.hpp"

namespace tiltrim {

using namespace markup;

namespace {

constexpr const char* packages =
    "% Needs \\usepackage{amsmath,array,booktabs,graphicx,siunitx}, siunitx 3 or later.\n"
    "% A table* is as wide as the text of a two-column page; a wider table is scaled down to it.\n";

// ---- Words --------------------------------------------------------------------------------------

// α to ω and Α to Ω; letters that look Latin are written as Latin.
constexpr std::array<const char*, 25> lower_greek{
    "\\alpha",  "\\beta", "\\gamma", "\\delta",    "\\varepsilon", "\\zeta", "\\eta",
    "\\theta",  "\\iota", "\\kappa", "\\lambda",   "\\mu",         "\\nu",   "\\xi",
    "o",        "\\pi",   "\\rho",   "\\varsigma", "\\sigma",      "\\tau",  "\\upsilon",
    "\\varphi", "\\chi",  "\\psi",   "\\omega"};
constexpr std::array<const char*, 25> upper_greek{
    "A",       "B",        "\\Gamma",   "\\Delta", "E",    "Z",     "H",      "\\Theta", "I",
    "K",       "\\Lambda", "M",         "N",       "\\Xi", "O",     "\\Pi",   "P",       "",
    "\\Sigma", "T",        "\\Upsilon", "\\Phi",   "X",    "\\Psi", "\\Omega"};

constexpr std::pair<char32_t, const char*> commands[]{
    {U'\\', "\\textbackslash{}"},
    {U'{', "\\{"},
    {U'}', "\\}"},
    {U'$', "\\$"},
    {U'&', "\\&"},
    {U'#', "\\#"},
    {U'%', "\\%"},
    {U'_', "\\_"},
    {U'^', "\\textasciicircum{}"},
    {U'~', "\\textasciitilde{}"},
    {U'<', "\\textless{}"},
    {U'>', "\\textgreater{}"},
    {U'|', "\\textbar{}"},
    {U'"', "\\char34{}"},  // \textquotedbl is not in every font
    {U'`', "\\`{}"},
    {U'[', "{[}"},  // after a line break these three would be its options
    {U']', "{]}"},
    {U'*', "{*}"},
    {U'\n', " "},
    {U'\t', " "},
    {U'\u00A0', "~"},
    {U'±', "$\\pm$"},
    {U'°', "$^\\circ$"},
    {U'µ', "$\\mu$"},
    {U'¹', "\\textsuperscript{1}"},
    {U'²', "\\textsuperscript{2}"},
    {U'³', "\\textsuperscript{3}"},
    {U'⁺', "\\textsuperscript{$+$}"},
    {U'⁻', "\\textsuperscript{$-$}"},
    {U'₊', "\\textsubscript{$+$}"},
    {U'₋', "\\textsubscript{$-$}"},
    {U'ₖ', "\\textsubscript{k}"},
    {U'ₘ', "\\textsubscript{m}"},
    {U'ᵢ', "\\textsubscript{i}"},
    {U'ᵀ', "\\textsuperscript{T}"},
    {U'½', "$\\tfrac{1}{2}$"},
    {U'·', "$\\cdot$"},
    {U'×', "$\\times$"},
    {U'−', "$-$"},
    {U'–', "--"},
    {U'—', "---"},
    {U'…', "\\dots{}"},
    {U'‘', "\\textquoteleft{}"},
    {U'’', "\\textquoteright{}"},
    {U'“', "\\textquotedblleft{}"},
    {U'”', "\\textquotedblright{}"},
    {U'∞', "$\\infty$"},
    {U'≤', "$\\leq$"},
    {U'≥', "$\\geq$"},
    {U'≠', "$\\neq$"},
    {U'≈', "$\\approx$"},
    {U'∈', "$\\in$"},
    {U'→', "$\\rightarrow$"},
    {U'←', "$\\leftarrow$"},
    {U'√', "$\\surd$"},
    {U'∫', "$\\int$"},
    {U'∂', "$\\partial$"},
    {U'∑', "$\\sum$"},
    {U'‖', "$\\Vert$"},
    {U'ϑ', "$\\vartheta$"},
    {U'ϕ', "$\\phi$"},
    {U'ẋ', "$\\dot{x}$"},
    {U'ẏ', "$\\dot{y}$"},
    {U'\uFFFD', "?"}};

std::optional<std::string> command(char32_t c) {
  const auto math = [](const char* name) { return *name ? fmt::format("${}$", name) : "?"; };
  if (c >= U'α' && c <= U'ω') return math(lower_greek[c - U'α']);
  if (c >= U'Α' && c <= U'Ω') return math(upper_greek[c - U'Α']);
  if (c >= U'⁴' && c <= U'⁹') return fmt::format("\\textsuperscript{{{}}}", c - U'⁰');
  if (c >= U'₀' && c <= U'₉') return fmt::format("\\textsubscript{{{}}}", c - U'₀');
  const auto known = std::ranges::find(commands, c, &std::pair<char32_t, const char*>::first);
  if (known == std::end(commands)) return {};
  return known->second;
}

bool is_alpha(char32_t c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char32_t c) { return c >= '0' && c <= '9'; }

// A column's title: a single symbol is set in math mode, "K_Lp" gets a subscript.
std::string latex_title(const std::string& title) {
  static const std::map<std::string, const char*> symbols{{"δe", "$\\delta_e$"},
                                                          {"θ₀", "$\\theta_0$"},
                                                          {"a1s", "$a_{1s}$"},
                                                          {"He", "$H_e$"},
                                                          {"Le", "$L_e$"}};
  if (const auto known = symbols.find(title); known != symbols.end()) return known->second;
  if (title.size() == 1 && is_alpha(title[0])) return '$' + title + '$';
  const bool subscript = title.size() > 2 && is_alpha(title[0]) && title[1] == '_' &&
                         std::ranges::all_of(title.substr(2), is_alpha);
  if (subscript) return fmt::format("${}_\\mathrm{{{}}}$", title[0], title.substr(2));
  return latex_escaped(title);
}

// ---- Numbers ------------------------------------------------------------------------------------

// A formatted number in parts: -12.50e-3 is '-', "12", "50", '-', "3".
struct Digits {
  std::string sign, whole, decimals, exponent_sign, exponent;
};

std::optional<Digits> printed(const std::string& text) {
  Digits p;
  std::size_t at = 0;
  const auto sign = [&] {
    return at < text.size() && (text[at] == '-' || text[at] == '+') ? std::string(1, text[at++])
                                                                    : std::string();
  };
  const auto digits = [&] {
    const std::size_t first = at;
    while (at < text.size() && is_digit(text[at])) ++at;
    return text.substr(first, at - first);
  };
  p.sign = sign();
  p.whole = digits();
  if (at < text.size() && text[at] == '.') ++at, p.decimals = digits();
  if (p.whole.empty()) return {};
  if (at < text.size() && text[at] == 'e') {
    ++at;
    p.exponent_sign = sign();
    if (p.exponent_sign == "+") p.exponent_sign.clear();
    p.exponent = digits();
    const std::size_t first = std::min(p.exponent.find_first_not_of('0'), p.exponent.size() - 1);
    if (p.exponent.empty()) return {};
    p.exponent.erase(0, first);
  }
  if (at != text.size()) return {};
  return p;
}

std::string as_latex(const Digits& p) {
  return p.sign + p.whole + (p.decimals.empty() ? "" : "." + p.decimals) +
         (p.exponent.empty() ? "" : "e" + p.exponent_sign + p.exponent);
}

std::string latex_cell(const SheetCell& cell, const SheetColumn& column, bool numeric) {
  if (std::holds_alternative<std::monostate>(cell.value)) return numeric ? "{--}" : "--";
  const std::string text = trimmed(cell_text(cell, column));
  if (numeric && std::holds_alternative<double>(cell.value))
    if (const auto number = printed(text)) return as_latex(*number);
  return numeric ? '{' + latex_escaped(text) + '}' : latex_escaped(text);
}

// Space for the widest of each part: S[table-format = -2.3e-1].
std::string number_column(const Sheet& sheet, std::size_t k) {
  Digits widest{"", "1", "", "", ""};
  bool plus = false;
  const auto widen = [](std::string& to, const std::string& part) {
    if (part.size() > to.size()) to = part;
  };
  for (const auto& row : sheet.rows) {
    if (!std::holds_alternative<double>(row[k].value)) continue;
    const auto p = printed(trimmed(cell_text(row[k], sheet.columns[k])));
    if (!p) continue;
    plus = plus || p->sign == "+";
    for (const auto part : {&Digits::sign, &Digits::whole, &Digits::decimals,
                            &Digits::exponent_sign, &Digits::exponent})
      widen(widest.*part, (*p).*part);
  }
  std::string format = widest.sign.empty() ? "" : plus ? "+" : "-";
  format += fmt::format("{}.{}", widest.whole.size(), widest.decimals.size());
  if (!widest.exponent.empty())
    format += fmt::format("e{}{}", widest.exponent_sign, widest.exponent.size());
  return fmt::format("S[table-format = {}{}]", format, plus ? ", retain-explicit-plus" : "");
}

// ---- The table ----------------------------------------------------------------------------------

std::string words_column(const Sheet& sheet, std::size_t k) {
  constexpr std::size_t most = 40;  // bytes on one line
  const bool wide = std::ranges::any_of(sheet.rows, [&](const auto& row) {
    const auto* words = std::get_if<std::string>(&row[k].value);
    return words && words->size() > most;
  });
  return wide ? ">{\\raggedright\\arraybackslash}p{16em}" : "l";
}

std::string latex_unit(const SheetColumn& column) {
  const std::string unit = trimmed(column.unit);
  if (unit.empty()) return "";
  const auto known = siunitx(unit);
  return known ? fmt::format("(\\unit{{{}}})", *known) : latex_escaped(unit);
}

bool continues(const SheetColumn& column) {
  return trimmed(column.title).empty() && !trimmed(column.unit).empty() &&
         !siunitx(trimmed(column.unit));
}

// Titles, then units or subheadings: "climb" over "printed", "computed", "off".
std::string head_rows(const Sheet& sheet) {
  const std::size_t n = sheet.columns.size();
  std::string titles, rules, units;
  bool any_unit = false;
  for (std::size_t k = 0, next = 0; k < n; k = next) {
    next = k + 1;
    while (next < n && continues(sheet.columns[next])) ++next;
    const SheetColumn& c = sheet.columns[k];
    const std::string title =
        latex_title(trimmed(c.title.empty() && c.unit.empty() ? c.key : c.title));
    titles += k > 0 ? " & " : "";
    if (next - k > 1) {
      titles += fmt::format("\\multicolumn{{{}}}{{c}}{{{}}}", next - k, title);
      rules += fmt::format("\\cmidrule(lr){{{}-{}}}", k + 1, next);
    } else {
      titles += '{' + title + '}';
    }
    for (std::size_t j = k; j < next; ++j) {
      const std::string unit = latex_unit(sheet.columns[j]);
      any_unit = any_unit || !unit.empty();
      units += (j > 0 ? " & {" : "{") + unit + '}';
    }
  }
  return titles + " \\\\\n" + (rules.empty() ? "" : rules + '\n') +
         (any_unit ? units + " \\\\\n" : "");
}

std::string latex_notes(const Sheet& sheet) {
  std::string text;
  for (const std::string& note : sheet.notes)
    text += latex_escaped(without_bullet(note)) + "\\par\n";
  return text;
}

std::string tabular(const Sheet& sheet, std::size_t from, std::size_t to) {
  const std::size_t n = sheet.columns.size();
  std::string columns, rows;
  for (std::size_t k = 0; k < n; ++k)
    columns +=
        "  " + (is_numeric(sheet, k) ? number_column(sheet, k) : words_column(sheet, k)) + '\n';
  for (std::size_t i = from; i < to; ++i) {
    for (std::size_t k = 0; k < n; ++k)
      rows += (k > 0 ? " & " : "") +
              latex_cell(sheet.rows[i].at(k), sheet.columns[k], is_numeric(sheet, k));
    rows += " \\\\\n";
  }
  return "\\begin{tabular}{\n" + columns + "}\n\\toprule\n" + head_rows(sheet) + "\\midrule\n" +
         rows + "\\bottomrule\n\\end{tabular}";
}

std::string float_of(const Sheet& sheet, std::size_t from, std::size_t to) {
  std::string caption = latex_escaped(trimmed(sheet.title));
  if (from > 0) caption += caption.empty() ? "Continued" : " (continued)";
  std::string text = "\\begin{table*}[tp]\n\\centering\n";
  if (!caption.empty()) text += "\\caption{" + caption + "}\n";
  text +=
      "\\footnotesize\n\\setlength{\\tabcolsep}{4pt}\n"
      "\\resizebox{\\ifdim\\width>\\textwidth\\textwidth\\else\\width\\fi}{!}{%\n" +
      tabular(sheet, from, to) + "}\n";
  if (to == sheet.rows.size() && !sheet.notes.empty())
    text += "\\par\\medskip\n\\begin{minipage}{\\textwidth}\n\\raggedright\n" + latex_notes(sheet) +
            "\\end{minipage}\n";
  return text + "\\end{table*}\n";
}

std::string without_packages(const Sheet& sheet) {
  if (sheet.columns.empty()) {
    const std::string title = latex_escaped(trimmed(sheet.title));
    return (title.empty() ? "" : "\\paragraph{" + title + "}\n") + latex_notes(sheet);
  }
  constexpr std::size_t page = 50;  // rows
  std::string text;
  std::size_t from = 0;
  do {
    const std::size_t to = std::min(from + page, sheet.rows.size());
    text += (from > 0 ? "\n" : "") + float_of(sheet, from, to);
    from = to;
  } while (from < sheet.rows.size());
  return text;
}

}  // namespace

std::optional<std::string> markup::siunitx(const std::string& unit) {
  static const std::map<std::string, const char*> names{
      {"1", ""},           {"m", "\\metre"},    {"s", "\\second"}, {"kg", "\\kilogram"},
      {"N", "\\newton"},   {"rad", "\\radian"}, {"°", "\\degree"}, {"Hz", "\\hertz"},
      {"Pa", "\\pascal"},  {"W", "\\watt"},     {"J", "\\joule"},  {"K", "\\kelvin"},
      {"dB", "\\decibel"}, {"%", "\\percent"},  {"A", "\\ampere"}, {"V", "\\volt"}};
  std::string text;
  bool below = false;
  for (std::size_t at = 0; at < unit.size();) {
    const std::size_t end = std::min(unit.find_first_of(" /", at), unit.size());
    std::string name = unit.substr(at, end - at);
    const char* power = "";
    for (const auto& [mark, words] : {std::pair{"²", "\\squared"}, std::pair{"³", "\\cubed"}})
      if (name.ends_with(mark)) {
        name.resize(name.size() - std::string_view(mark).size());
        power = words;
      }
    const auto known = names.find(name);
    if (known == names.end()) return {};
    if (*known->second) text += (below ? "\\per" : "") + std::string(known->second) + power;
    below = below || (end < unit.size() && unit[end] == '/');
    at = end + 1;
  }
  if (text.empty()) return {};
  return text;
}

std::string latex_escaped(const std::string& text) {
  return rewritten(
      text, [](const std::u32string& points, std::size_t at) -> std::optional<std::string> {
        const char32_t c = points[at], before = at > 0 ? points[at - 1] : U' ',
                       after = at + 1 < points.size() ? points[at + 1] : U' ';
        const bool in_word =
            is_alpha(before) || is_digit(before) || before == '_' || before == ')' || before == '-';
        if (c == '-' && is_digit(after) && !in_word) return "$-$";
        // Two of these would form a dash or a quotation mark.
        if ((c == '-' || c == ',' || c == '\'') && after == c)
          return std::string{char(c), '{', '}'};
        return command(c);
      });
}

std::string as_latex(const Sheet& sheet) { return packages + without_packages(sheet); }

std::string as_latex(const std::vector<Sheet>& sheets) {
  std::string text = packages;
  for (const Sheet& sheet : sheets)
    if (const std::string one = without_packages(sheet); !one.empty()) text += '\n' + one;
  return text;
}

}  // namespace tiltrim
