// Some malformed files, "[é]" for one, violate assertions of toml++: with assertions it aborts;
// with NDEBUG under Clang the behaviour is undefined; without either it reports the error. Hence
// the header-only version with empty assertions, not the compiled library.
#undef NDEBUG
#undef TOML_HEADER_ONLY
#undef TOML_SHARED_LIB
#define TOML_HEADER_ONLY 1
#define TOML_ASSERT(expr) static_assert(true)

#include "study/toml_reader.hpp"

#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "model/lookup.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

constexpr int deepest = 12;         // arrays and tables; a study needs four
constexpr int most_dots = 16;       // in a dotted key
constexpr std::size_t widest = 60;  // quotation in a message

void refuse(const std::filesystem::path& file, Place place, std::string_view message) {
  throw StudyError(fmt::format("{}:{}:{}: {}", file.string(), place.line, place.column, message));
}

std::string in_quotes(std::string_view text) {
  std::string shown(text.substr(0, widest));
  if (shown.size() < text.size()) {
    while (!shown.empty() && (shown.back() & 0xC0) == 0x80) shown.pop_back();  // valid UTF-8
    if (!shown.empty() && (shown.back() & 0x80)) shown.pop_back();
    shown += "...";
  }
  const auto control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  std::ranges::replace_if(shown, control, '?');
  return fmt::format("'{}'", shown);
}

std::string describe(const Entry& entry) {
  switch (entry.kind) {
    case Entry::Kind::table:
      return "a table";
    case Entry::Kind::array:
      return "an array";
    case Entry::Kind::text:
      return "the text " + in_quotes(entry.text);
    case Entry::Kind::number:
      return fmt::format("{}", entry.number);
    case Entry::Kind::other:
      break;
  }
  return entry.text;
}

// "; did you mean 'paper.toml'?", if a file next to a missing one has nearly its name.
static std::string near(const std::filesystem::path& missing) {
  constexpr std::size_t most = 1000;  // files of a folder
  std::vector<std::string> names;
  std::error_code ignored;
  const std::filesystem::path folder = missing.has_parent_path() ? missing.parent_path() : ".";
  for (std::filesystem::directory_iterator file(folder, ignored), end;
       file != end && names.size() < most; file.increment(ignored))
    if (file->path().extension() == missing.extension())
      names.push_back(file->path().filename().string());
  std::ranges::sort(names);
  const std::string name = nearest_name(missing.filename().string(), names);
  return name.empty() || name == missing.filename() ? "" : "; did you mean '" + name + "'?";
}

std::string read_text(const std::filesystem::path& file, std::size_t limit) {
  const auto unreadable = [&](std::string_view why) {
    throw StudyError(fmt::format("{}: cannot be read: {}", file.string(), why));
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) unreadable("is a directory");
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) unreadable(std::generic_category().message(errno != 0 ? errno : ENOENT) + near(file));
  // Limits the bytes read, not the file size: pipes have none.
  std::string text(limit + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) unreadable(std::generic_category().message(errno != 0 ? errno : EIO));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

static Place place_at(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, offset);
  const auto line = std::ranges::count(before, '\n') + 1;
  const std::size_t start = before.rfind('\n') + 1;  // npos + 1 is 0
  return {static_cast<unsigned>(line), static_cast<unsigned>(offset - start + 1)};
}

static void check_encoding(std::string_view text, const std::filesystem::path& file) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    refuse(file, {}, "the file is UTF-16; expected UTF-8 text");
  if (const std::size_t nul = text.find('\0'); nul != text.npos)
    refuse(file, place_at(text, nul), "a NUL byte; expected UTF-8 text");
}

static std::size_t end_of_string(std::string_view text, std::size_t begin,
                                 const std::filesystem::path& file) {
  const char quote = text[begin];
  if (text.substr(begin, 3) == std::string(3, quote))
    refuse(file, place_at(text, begin), "a string of several lines; expected one line");
  std::size_t i = begin + 1;
  while (i < text.size() && text[i] != quote && text[i] != '\n')
    i += quote == '"' && text[i] == '\\' ? 2 : 1;
  return std::min(i + 1, text.size());
}

// Two inputs crash toml++ 3.3. It destroys the tree recursively but limits only the nesting of
// values, not the dots in a key. And its test for blanks has undefined behaviour for characters
// like é outside comments and single-line strings.
static void check_characters(std::string_view text, const std::filesystem::path& file) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF", ends_key = "=,[]{}\n";
  int dots = 0;
  std::size_t i = text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
  while (i < text.size()) {
    const char c = text[i];
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
    } else if (c == '"' || c == '\'') {
      i = end_of_string(text, i, file);
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      refuse(file, place_at(text, i),
             "not TOML: a letter beyond ASCII; expected such only in quotes and comments");
    } else {
      if (c == '.' && ++dots > most_dots)
        refuse(file, place_at(text, i), fmt::format("a key with more than {} dots", most_dots));
      if (ends_key.find(c) != ends_key.npos) dots = 0;
      ++i;
    }
  }
}

// toml++ reports a position; the line there contains the key.
static std::string line_at(std::string_view text, Place place) {
  for (unsigned line = 1; line < place.line && !text.empty(); ++line)
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  text = text.substr(0, text.find_first_of("\r\n"));
  const std::size_t first = text.find_first_not_of(" \t");
  std::string line(first == text.npos ? "" : text.substr(first));
  const auto foreign = [](unsigned char c) { return c >= 0x80; };  // possibly not UTF-8
  std::ranges::replace_if(line, foreign, '?');
  return line;
}

static Place place_of(const toml::source_position& position, Place otherwise) {
  return position ? Place{position.line, position.column} : otherwise;
}

static Entry convert(const toml::node& node, Place parent, int depth,
                     const std::filesystem::path& file) {
  Entry entry;
  entry.place = entry.key_place = place_of(node.source().begin, parent);
  if (depth > deepest) refuse(file, entry.place, fmt::format("nested more than {} deep", deepest));
  if (const auto number = node.value<double>(); number && node.is_number()) {
    entry.kind = Entry::Kind::number;
    entry.number = *number;
  } else if (const auto* text = node.as_string()) {
    entry.kind = Entry::Kind::text;
    entry.text = text->get();
  } else if (const auto* array = node.as_array()) {
    entry.kind = Entry::Kind::array;
    for (const toml::node& item : *array)
      entry.entries.push_back(convert(item, entry.place, depth + 1, file));
  } else if (const auto* table = node.as_table()) {
    entry.kind = Entry::Kind::table;
    for (const auto& [key, value] : *table) {
      Entry& child = entry.entries.emplace_back(convert(value, entry.place, depth + 1, file));
      child.key = key.str();
      child.key_place = place_of(key.source().begin, child.place);
    }
    std::ranges::stable_sort(entry.entries, {}, [](const Entry& e) {
      return std::pair(e.key_place.line, e.key_place.column);
    });
  } else {
    entry.kind = Entry::Kind::other;
    entry.text = node.is_boolean() ? "a boolean" : "a date or time";
  }
  return entry;
}

// The line of the first occurrence of a repeated key in its table; 0 if it is not found.
static unsigned first_given(std::string_view text, const Place& repeated) {
  const auto key_of = [&](unsigned number) {
    std::string line = line_at(text, {number, 1});
    return line.substr(0, line.find_first_of(" =\t"));
  };
  const std::string key = key_of(repeated.line);
  if (key.empty()) return 0;
  for (unsigned n = repeated.line - 1; n > 0; --n) {
    const std::string other = key_of(n);
    if (other == key) return n;
    if (other.starts_with('[')) break;
  }
  return 0;
}

Entry parse_toml(std::string_view text, const std::filesystem::path& file) {
  check_encoding(text, file);
  check_characters(text, file);
  try {
    return convert(toml::parse(text), {}, 0, file);
  } catch (const toml::parse_error& e) {
    const Place place = place_of(e.source().begin, {});
    const std::string line = line_at(text, place);
    const bool twice = std::string_view(e.description()).find("redefine") != std::string_view::npos;
    const unsigned first = twice ? first_given(text, place) : 0;
    refuse(file, place,
           fmt::format("not TOML: {}{}{}", e.description(),
                       first > 0 ? fmt::format(", given in line {}", first) : "",
                       line.empty() ? "" : fmt::format("; in the line {}", in_quotes(line))));
  }
}

}  // namespace tiltrim::reading
