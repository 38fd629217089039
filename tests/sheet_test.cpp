// Sheets as Markdown, LaTeX and HTML: nothing in a name acts as markup, and every number is equal
// in all five formats.
#include "report/sheet.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <random>
#include <regex>
#include <sstream>

#include "tests/check.hpp"

using namespace tiltrim;

namespace sheet_test {

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> split(const std::string& text, const std::string& at) {
  std::vector<std::string> parts{""};
  for (std::size_t i = 0; i < text.size();)
    if (text.compare(i, at.size(), at) == 0) {
      parts.emplace_back();
      i += at.size();
    } else {
      parts.back() += text[i++];
    }
  return parts;
}

std::string stripped(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \n");
  return first == std::string::npos ? ""
                                    : text.substr(first, text.find_last_not_of(" \n") + 1 - first);
}

using Cells = std::vector<std::vector<std::string>>;

// Each reader knows its format only, not the writer. Cells contain no blanks here.
Cells of_text(const std::string& text, std::size_t head) {
  Cells cells;
  std::istringstream in(text);
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    if (number++ < head) continue;
    std::istringstream words(line);
    cells.emplace_back();
    for (std::string word; words >> word;) cells.back().push_back(word);
  }
  return cells;
}

Cells of_csv(const std::string& text) {
  Cells cells;
  const std::vector<std::string> lines = split(text, "\n");
  for (std::size_t i = 1; i + 1 < lines.size(); ++i) cells.push_back(split(lines[i], ","));
  return cells;
}

Cells of_markdown(const std::string& text) {
  Cells cells;
  for (const std::string& line : split(text, "\n")) {
    if (!line.starts_with('|')) continue;
    std::vector<std::string> row = split(line, "|");
    cells.emplace_back();
    for (std::size_t k = 1; k + 1 < row.size(); ++k) cells.back().push_back(stripped(row[k]));
  }
  cells.erase(cells.begin(), cells.begin() + 2);  // head and rule
  return cells;
}

Cells of_latex(const std::string& text) {
  const std::size_t from = text.find("\\midrule\n") + 9, to = text.find("\\bottomrule");
  Cells cells;
  for (const std::string& line : split(text.substr(from, to - from), "\\\\\n")) {
    if (stripped(line).empty()) continue;
    cells.emplace_back();
    for (std::string cell : split(line, "&")) {
      cell = stripped(cell);
      if (cell.starts_with('{') && cell.ends_with('}')) cell = cell.substr(1, cell.size() - 2);
      cells.back().push_back(cell);
    }
  }
  return cells;
}

Cells of_html(const std::string& text) {
  const std::string body = split(split(text, "<tbody>").at(1), "</tbody>").at(0);
  const std::regex cell("<t[dh][^>]*>([^<]*)</t[dh]>");
  Cells cells;
  for (const std::string& row : split(body, "</tr>")) {
    if (row.find("<tr>") == std::string::npos) continue;
    cells.emplace_back();
    for (std::sregex_iterator at(row.begin(), row.end(), cell), end; at != end; ++at)
      cells.back().push_back((*at)[1]);
  }
  return cells;
}

double value(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  CHECK_MESSAGE(end == text.c_str() + text.size(), text);
  return number;
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

std::size_t count_of(const std::string& text, const std::string& what) {
  return split(text, what).size() - 1;
}

// Converts LaTeX text back to characters, for commands that represent ASCII; "" for any others.
std::string read_latex(std::string text) {
  const std::vector<std::pair<std::string, std::string>> commands{{"\\textbackslash{}", "\x01"},
                                                                  {"\\textasciicircum{}", "^"},
                                                                  {"\\textasciitilde{}", "~"},
                                                                  {"\\textless{}", "<"},
                                                                  {"\\textgreater{}", ">"},
                                                                  {"\\textbar{}", "|"},
                                                                  {"\\char34{}", "\""},
                                                                  {"\\`{}", "`"},
                                                                  {"{[}", "["},
                                                                  {"{]}", "]"},
                                                                  {"{*}", "*"},
                                                                  {"$-$", "-"},
                                                                  {"{}", ""},
                                                                  {"\\{", "\x02"},
                                                                  {"\\}", "\x03"},
                                                                  {"\\$", "\x04"},
                                                                  {"\\&", "\x05"},
                                                                  {"\\#", "\x06"},
                                                                  {"\\%", "\x07"},
                                                                  {"\\_", "\x08"}};
  for (const auto& [command, character] : commands) {
    std::string joined;
    const std::vector<std::string> parts = split(text, command);
    for (std::size_t i = 0; i < parts.size(); ++i) joined += (i ? character : "") + parts[i];
    text = joined;
  }
  if (text.find_first_of("\\{}$&#%_") != std::string::npos) return "";
  const std::string_view special = "\\{}$&#%_";
  for (char& c : text)
    if (c >= 1 && c <= 8) c = special[std::size_t(c) - 1];
  return text;
}

std::string read_html(std::string text) {
  if (text.find_first_of("<>\"'") != std::string::npos) return "";
  for (const auto& [entity, character] : std::vector<std::pair<std::string, std::string>>{
           {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&amp;", "&"}}) {
    std::string joined;
    const std::vector<std::string> parts = split(text, entity);
    for (std::size_t i = 0; i < parts.size(); ++i) joined += (i ? character : "") + parts[i];
    text = joined;
  }
  return text;
}

// CommonMark: a backslash before punctuation stands for it; "" if something is left that marks.
std::string read_markdown(const std::string& text) {
  std::string read;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\') {
      if (++i == text.size()) return "";
      read += text[i];
    } else if (std::string_view("|*_`[]<>#~$").find(text[i]) != std::string_view::npos) {
      return "";
    } else if (text[i] == '&') {
      const std::size_t end = text.find(';', i);
      read += read_html(text.substr(i, end + 1 - i));
      i = end;
    } else {
      read += text[i];
    }
  }
  return read;
}

Sheet one_cell(const std::string& words) {
  return {words, {{"name", words, words}, {"n", "n", ""}}, {{SheetCell(words), 1.0}}, {words}};
}

const std::vector<std::string> hostile{"<script>alert(1)</script>",
                                       "_ % $ & # { } \\ ^ ~",
                                       "\"double\" 'single' `back`",
                                       "a|b||c",
                                       "]]> --> <!-- &amp; &lt;",
                                       "\\input{/etc/passwd} \\write18{ls}",
                                       "[link](javascript:alert(1)) ![x](y)",
                                       "[1] *starred* **bold**",
                                       "$x$ $$y$$ \\(z\\)",
                                       "--only -- '' ,, ---",
                                       "\" onmouseover=\"alert(1)",
                                       "1. first",
                                       "# head",
                                       "- bullet",
                                       "+ plus",
                                       "===",
                                       "\\\\ \\| \\",
                                       "{{}}}{",
                                       "%comment",
                                       "~/x~y~~z"};

}  // namespace

TEST_CASE("hostile names are shown as they are in every format") {
  for (const std::string& words : hostile) {
    CAPTURE(words);
    CHECK(read_html(html_escaped(words)) == words);
    CHECK(read_markdown(markdown_escaped(words)) == words);
    CHECK(read_latex(latex_escaped(words)) == words);
  }
}

TEST_CASE("any ASCII text is shown as it is in every format") {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> letter(0x20, 0x7E), length(1, 12);
  for (int i = 0; i < trials(20000); ++i) {
    std::string words;
    for (int n = length(random); n > 0; --n) words += char(letter(random));
    CAPTURE(words);
    REQUIRE(read_html(html_escaped(words)) == words);
    REQUIRE(read_markdown(markdown_escaped(words)) == words);
    REQUIRE(read_latex(latex_escaped(words)) == words);
  }
}

TEST_CASE("names make no rows, columns, tags or lines of their own") {
  for (const std::string& words : hostile) {
    CAPTURE(words);
    const Sheet sheet = one_cell(words);
    const std::string html = as_html(sheet), latex = as_latex(sheet), text = as_markdown(sheet);
    const Sheet plain = one_cell("x");
    CHECK(count_of(html, "<") == count_of(as_html(plain), "<"));
    CHECK(count_of(html, ">") == count_of(as_html(plain), ">"));
    CHECK(html.find("script>") == std::string::npos);
    CHECK(count_of(latex, "\\\\\n") == count_of(as_latex(plain), "\\\\\n"));
    CHECK(of_latex(latex).size() == 1);
    // title, head, rule, row, note and two empty lines
    CHECK(split(text, "\n").size() == 8);
    const std::string row = split(text, "\n")[4];
    std::size_t columns = 0;
    for (std::size_t i = 0; i < row.size(); ++i)
      if (row[i] == '\\')
        ++i;
      else
        columns += row[i] == '|';
    CHECK(columns == 3);
  }
}

TEST_CASE("an attribute cannot be left") {
  Sheet sheet = one_cell("x");
  sheet.columns[0].key = "\" onload='x' a=\"<b>";
  CHECK(as_html(sheet).find("data-key=\"&quot; onload=&#39;x&#39; a=&quot;&lt;b&gt;\"") !=
        std::string::npos);
}

TEST_CASE("control characters are dropped, what is no UTF-8 is replaced, other UTF-8 is kept") {
  const std::string controls = std::string("a\0b\x01\x1B[31mc\x7F\r", 12) + "\xC2\x85" + "d";
  CHECK(html_escaped(controls) == "ab[31mcd");
  CHECK(markdown_escaped(controls) == "ab\\[31mcd");
  CHECK(latex_escaped(controls) == "ab{[}31mcd");
  CHECK(html_escaped("a\nb\tc") == "a\nb\tc");
  CHECK(markdown_escaped("a\nb\tc") == "a b c");
  CHECK(latex_escaped("a\nb\tc") == "a b c");

  // Lone and missing continuations, overlong forms, half a surrogate pair, beyond U+10FFFF.
  for (const char* bad : {"\x80", "\xC3", "\xC0\xAF", "\xE2\x82", "\xED\xA0\x80",
                          "\xF4\x90\x80\x80", "\xF8\x88\x80\x80\x80", "\xFF", "\xF0\x80\x80\xBC"}) {
    const std::string html = html_escaped(std::string("a") + bad + "b");
    CAPTURE(html);
    CHECK(html.starts_with("a\uFFFD"));
    CHECK(html.ends_with("b"));
    const std::string plain = std::regex_replace(html, std::regex("\uFFFD"), "");
    CHECK(plain == "ab");
    CHECK(latex_escaped(std::string("a") + bad + "b").starts_with("a?"));
    CHECK(markdown_escaped(std::string("a") + bad + "b").starts_with("a\uFFFD"));
  }

  for (const std::string kept : {"é", "ß", "漢字", "😀", "ő", "\uFFFD"}) {
    CHECK(html_escaped(kept) == kept);
    CHECK(markdown_escaped(kept) == kept);
    if (kept != "\uFFFD") CHECK(latex_escaped(kept) == kept);
  }
}

TEST_CASE("symbols of the field are commands in LaTeX") {
  CHECK(latex_escaped("θ₀") == "$\\theta$\\textsubscript{0}");
  CHECK(latex_escaped("ζ λ η γ ω Δ Ω") ==
        "$\\zeta$ $\\lambda$ $\\eta$ $\\gamma$ $\\omega$ $\\Delta$ $\\Omega$");
  CHECK(latex_escaped("½V² + gh") == "$\\tfrac{1}{2}$V\\textsuperscript{2} + gh");
  CHECK(latex_escaped("≤ ≥ ∞ · × → − –") ==
        "$\\leq$ $\\geq$ $\\infty$ $\\cdot$ $\\times$ $\\rightarrow$ $-$ --");
  CHECK(latex_escaped("s⁻¹") == "s\\textsuperscript{$-$}\\textsuperscript{1}");
  CHECK(latex_escaped("45°") == "45$^\\circ$");
  // a minus before a number, a hyphen within words
  CHECK(latex_escaped("-0.0323 ± 0.5736i") == "$-$0.0323 $\\pm$ 0.5736i");
  CHECK(latex_escaped("short-period, x-1, 1e-3") == "short-period, x-1, 1e-3");
}

TEST_CASE("numbers are the same to the printed digit in all five formats") {
  const std::vector<std::string> formats{"{}",     "{:.3f}", "{:.0e}",  "{:.4g}", "{:+.2e}",
                                         "{:.7g}", "{:.0f}", "{:+.2f}", "{:.17g}"};
  Sheet sheet;
  sheet.columns = {{"name", "name", ""}};
  for (std::size_t k = 0; k < formats.size(); ++k)
    sheet.columns.push_back({fmt::format("c{}", k), fmt::format("c{}", k), "", formats[k]});
  std::mt19937 random(11);
  std::uniform_real_distribution<double> mantissa(-10, 10), power(-18, 18);
  const std::vector<double> special{0.0,    -0.0,        1.0,   -1.0,   1e-15, -1e-15,
                                    1e5,    123456789.0, 0.5,   inf,    -inf,  not_a_number,
                                    5e-324, 1e308,       -1e-4, 99.9996};
  for (int i = 0; i < trials(500); ++i) {
    std::vector<SheetCell> row{fmt::format("r{}", i)};
    for (std::size_t k = 0; k < formats.size(); ++k)
      row.emplace_back(i < std::ssize(special) ? special[std::size_t(i)]
                                               : mantissa(random) * std::pow(10, power(random)));
    // one page of LaTeX at a time
    sheet.rows = {row};
    const std::vector<Cells> all{of_text(as_text(sheet, unwrapped), 1), of_csv(as_csv(sheet)),
                                 of_markdown(as_markdown(sheet)), of_latex(as_latex(sheet)),
                                 of_html(as_html(sheet))};
    for (const Cells& cells : all) {
      REQUIRE(cells.size() == 1);
      REQUIRE(cells[0].size() == sheet.columns.size());
    }
    for (std::size_t k = 1; k < sheet.columns.size(); ++k) {
      const std::string shown = all[0][0][k];
      CAPTURE(shown);
      // CSV has every digit, and rounds to what is shown
      const double exact = value(all[1][0][k]);
      CHECK(same(exact, std::get<double>(row[k].value)));
      CHECK(cell_text(exact, sheet.columns[k]) == shown);
      CHECK(all[2][0][k] == shown);
      CHECK(all[4][0][k] == shown);
      CHECK(same(value(all[3][0][k]), value(shown)));
      // and in LaTeX the same digits: only an exponent's own sign and zeros may go
      const std::string mantissa_shown = shown.substr(0, shown.find('e'));
      if (std::isfinite(exact))
        CHECK(all[3][0][k].substr(0, all[3][0][k].find('e')) == mantissa_shown);
    }
  }
}

TEST_CASE("what siunitx reads in a column of numbers") {
  const Sheet sheet{"",
                    {{"a", "a", "", "{:.0e}"}, {"b", "b", "", "{:.2f}"}, {"c", "c", "", "{:+.1e}"}},
                    {{1e-15, -12.5, 3e-5},
                     {inf, not_a_number, SheetCell()},
                     {-inf, SheetCell("no trim"), SheetCell("-")},
                     {0.0, -0.0, 2e12}},
                    {}};
  const std::string latex = as_latex(sheet);
  for (const char* line : {"S[table-format = 1.0e-2]\n", "S[table-format = -2.2]\n",
                           "S[table-format = +1.1e-2, retain-explicit-plus]\n",
                           "1e-15 & -12.50 & +3.0e-5 \\\\\n", "{inf} & {nan} & {--} \\\\\n",
                           "{-inf} & {no trim} & {-} \\\\\n", "0e0 & 0.00 & +2.0e12 \\\\\n"})
    CHECK_MESSAGE(latex.find(line) != std::string::npos, line, latex);
}

TEST_CASE("units: siunitx's, in brackets, or words behind a comma") {
  const auto head = [](const char* title, const char* unit) {
    const Sheet sheet{"", {{"key", title, unit, "{:.1f}"}}, {{1.0}}, {}};
    const std::string markdown = split(as_markdown(sheet), "\n")[0];
    return std::array{stripped(markdown.substr(1, markdown.size() - 2)), as_latex(sheet),
                      as_html(sheet)};
  };
  CHECK(head("θ", "°")[0] == "θ [°]");
  CHECK(head("θ", "°")[1].find("{$\\theta$} \\\\\n{(\\unit{\\degree})} \\\\\n") !=
        std::string::npos);
  CHECK(head("θ", "°")[2].find("<th scope=\"col\" data-key=\"key\" class=\"number\">θ <span "
                               "class=\"unit\">[°]</span></th>") != std::string::npos);
  for (const auto& [unit, command] :
       std::map<std::string, std::string>{{"m/s", "\\metre\\per\\second"},
                                          {"1/s", "\\per\\second"},
                                          {"rad/s", "\\radian\\per\\second"},
                                          {"°/s", "\\degree\\per\\second"},
                                          {"m/s²", "\\metre\\per\\second\\squared"},
                                          {"kg m²", "\\kilogram\\metre\\squared"},
                                          {"kg/m³", "\\kilogram\\per\\metre\\cubed"},
                                          {"m²/s²", "\\metre\\squared\\per\\second\\squared"},
                                          {"dB", "\\decibel"},
                                          {"A/m", "\\ampere\\per\\metre"},
                                          {"%", "\\percent"}})
    CHECK(contains(head("x", unit.c_str())[1], "(\\unit{" + command + "})"));
  CHECK(head("worst miss", "digits")[0] == "worst miss, digits");
  CHECK(head("", "computed")[0] == "computed");
  CHECK(head("", "")[0] == "key");
}

TEST_CASE("a title over several columns spans them in LaTeX") {
  const Sheet sheet{"",
                    {{"quantity", "", ""},
                     {"a", "climb", "printed", "{:.1f}"},
                     {"b", "", "computed", "{:.1f}"},
                     {"c", "V", "m/s", "{:.1f}"}},
                    {{"x", 1.0, 2.0, 3.0}},
                    {}};
  CHECK(as_latex(sheet).find(
            "{quantity} & \\multicolumn{2}{c}{climb} & {$V$} \\\\\n\\cmidrule(lr){2-3}\n"
            "{} & {printed} & {computed} & {(\\unit{\\metre\\per\\second})} \\\\\n") !=
        std::string::npos);
}

TEST_CASE("HTML: rows have heads, tones are classes, nothing is styled") {
  const Sheet sheet{"modes",
                    {{"name", "name", ""}, {"x", "x", "", "{:.1f}"}, {"verdict", "verdict", ""}},
                    {{"a", 1.0, SheetCell("stable", Tone::good)},
                     {"b", SheetCell(), SheetCell("unstable", Tone::bad)},
                     {"c", 2.0, SheetCell("undecided", Tone::doubtful)}},
                    {"- a note"}};
  CHECK(as_html(sheet) ==
        "<table>\n<caption><span>modes</span></caption>\n<thead>\n<tr>"
        "<th scope=\"col\" data-key=\"name\">name</th>"
        "<th scope=\"col\" data-key=\"x\" class=\"number\">x</th>"
        "<th scope=\"col\" data-key=\"verdict\">verdict</th></tr>\n</thead>\n<tbody>\n"
        "<tr><th scope=\"row\">a</th><td class=\"number\">1.0</td>"
        "<td class=\"good\">stable</td></tr>\n"
        "<tr><th scope=\"row\">b</th><td class=\"number\">–</td>"
        "<td class=\"bad\">unstable</td></tr>\n"
        "<tr><th scope=\"row\">c</th><td class=\"number\">2.0</td>"
        "<td class=\"doubtful\">undecided</td></tr>\n"
        "</tbody>\n</table>\n<ul class=\"notes\">\n<li>a note</li>\n</ul>\n");
}

TEST_CASE("nothing, no rows, no columns") {
  CHECK(as_markdown(Sheet{}).empty());
  CHECK(as_html(Sheet{}).empty());
  const Sheet no_rows{"t", {{"a", "a", "m"}, {"b", "b", ""}}, {}, {}};
  CHECK(as_markdown(no_rows) == "**t**\n\n| a [m] | b   |\n| :---- | :-- |\n");
  CHECK(of_html(as_html(no_rows)).empty());
  CHECK(of_latex(as_latex(no_rows)).empty());
  const Sheet words{"level: no trim", {}, {}, {"why_not: 5 %."}};
  CHECK(as_markdown(words) == "**level: no trim**\n\n- why\\_not: 5 %.\n");
  CHECK(as_html(words) ==
        "<p>level: no trim</p>\n<ul class=\"notes\">\n<li>why_not: 5 %.</li>\n</ul>\n");
  CHECK(as_latex(words).ends_with("\\paragraph{level: no trim}\nwhy\\_not: 5 \\%.\\par\n"));
  const Sheet paragraphs{"", {}, {}, {"first", "- second"}};
  CHECK(as_markdown(paragraphs) == "first\n\nsecond\n");
  CHECK(as_html(paragraphs) == "<p>first</p>\n<p>second</p>\n");
  CHECK(as_latex(paragraphs).ends_with("first\\par\nsecond\\par\n"));
  CHECK(as_markdown(std::vector<Sheet>{no_rows, {}, words}) ==
        as_markdown(no_rows) + "\n" + as_markdown(words));
}

TEST_CASE("a long table goes on over the page, its notes at the end") {
  Sheet sheet{"long", {{"n", "n", "", "{:.0f}"}}, {}, {"the note"}};
  for (int i = 0; i < 120; ++i) sheet.rows.push_back({double(i)});
  const std::string latex = as_latex(sheet);
  CHECK(count_of(latex, "\\begin{table*}") == 3);
  CHECK(count_of(latex, "\\end{table*}") == 3);
  CHECK(count_of(latex, "\\caption{long (continued)}") == 2);
  CHECK(count_of(latex, "the note") == 1);
  for (int i = 0; i < 120; ++i)
    CHECK(latex.find(fmt::format("\n{} \\\\\n", i)) != std::string::npos);
}

}  // namespace sheet_test
