#include "cli/matrix_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "cli/terminal.hpp"

namespace tiltrim::cli {

using Eigen::Index;
using Eigen::MatrixXd;
using nlohmann::json;

void refuse(const std::string& where, const std::string& what, const std::string& expected) {
  throw std::runtime_error(fmt::format("{}: {}; expected {}", where, what, expected));
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t longest = 24;
  std::string shown(text.substr(0, longest));
  while (shown.size() < text.size() && !shown.empty() && (text[shown.size()] & 0xC0) == 0x80)
    shown.pop_back();  // keeps characters complete
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  return "'" + shown + (shown.size() < text.size() ? "...'" : "'");
}

void check_size(const std::string& where, std::size_t rows, std::size_t columns) {
  if (rows == 0 || columns == 0) refuse(where, "an empty matrix", "numbers");
  if (rows != columns)
    refuse(where,
           fmt::format("{} row{} of {} number{}", rows, rows == 1 ? "" : "s", columns,
                       columns == 1 ? "" : "s"),
           "as many rows as columns");
  if (rows > std::size_t(largest_matrix))
    refuse(where, fmt::format("{0} x {0} numbers", rows),
           fmt::format("at most {0} x {0}", largest_matrix));
}

namespace {

constexpr std::size_t largest_file = std::size_t{64} << 20;  // bytes

std::string bytes_of(const std::filesystem::path& file, const std::string& name) {
  const Reading now;
  const bool standard = file == "-";
  std::error_code ignored;
  if (!standard && std::filesystem::is_directory(file, ignored))
    throw std::runtime_error(fmt::format("{}: {}", name, std::strerror(EISDIR)));
  struct Close {
    void operator()(std::FILE* f) const {
      if (f != stdin) std::fclose(f);
    }
  };
  const std::unique_ptr<std::FILE, Close> in(standard ? stdin : std::fopen(file.c_str(), "rb"));
  if (!in) throw std::runtime_error(fmt::format("{}: {}", name, std::strerror(errno)));
  std::string bytes;
  char piece[1 << 16];
  while (const std::size_t n = std::fread(piece, 1, sizeof piece, in.get())) {
    bytes.append(piece, n);
    if (bytes.size() > largest_file)
      refuse(name, "is too large", fmt::format("at most {} MB", largest_file >> 20));
  }
  if (std::ferror(in.get()) != 0)
    throw std::runtime_error(fmt::format("{}: {}", name, std::strerror(errno)));
  return bytes;
}

constexpr std::string_view blanks = " \t";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

struct Line {
  std::string_view text;
  std::string where;  // "FILE:line"
  std::string at(std::size_t byte) const {
    const auto before = text.substr(0, byte);
    const auto characters =
        std::ranges::count_if(before, [](char c) { return (c & 0xC0) != 0x80; });
    return fmt::format("{}:{}", where, characters + 1);
  }
};

struct Field {
  std::string text;
  std::size_t byte;  // offset of its first byte
};

// Fields between separators; ' ' stands for runs of blanks. A quoted field may contain separators,
// and "" for a quote.
std::vector<Field> fields_of(const Line& line, char separator) {
  const std::string_view text = line.text;
  const auto is_blank = [&](std::size_t i) {
    return i < text.size() && (text[i] == ' ' || (text[i] == '\t' && separator != '\t'));
  };
  const auto is_end = [&](std::size_t i) {
    return i >= text.size() || text[i] == separator || (separator == ' ' && is_blank(i));
  };
  std::vector<Field> fields;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    while (is_blank(i)) ++i;
    if (separator == ' ' && i >= text.size()) break;
    Field field{{}, i};
    if (i < text.size() && text[i] == '"') {
      for (++i;; ++i) {
        if (i >= text.size()) refuse(line.at(field.byte), "a quote that is not closed", "\"");
        if (text[i] == '"' && (i + 1 >= text.size() || text[i + 1] != '"')) break;
        if (text[i] == '"') ++i;
        field.text += text[i];
      }
      for (++i; !is_end(i); ++i)
        if (!is_blank(i)) refuse(line.at(i), "text after a closing quote", "the next field");
    } else {
      const std::size_t from = i;
      while (!is_end(i)) ++i;
      field.text = trimmed(text.substr(from, i - from));
    }
    fields.push_back(std::move(field));
  }
  return fields;
}

std::optional<double> number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || error == std::errc::invalid_argument) return {};
  if (error == std::errc::result_out_of_range) return std::nan("");  // reported as not finite
  return value;
}

void check_value(const std::string& where, const std::string& shown, double value, bool bounds) {
  if (!std::isfinite(value))
    refuse(where, shown + " is not finite or exceeds the range of a double", "a finite number");
  if (bounds && value < 0) refuse(where, shown + " is below zero", "bounds that are not negative");
}

std::string matrix_numbers(std::size_t n) {
  return fmt::format("{} number{}", n, n == 1 ? "" : "s");
}

// The lines with content, in order.
class Lines {
 public:
  Lines(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {
    constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
    if (rest_.starts_with(byte_order_mark)) rest_.remove_prefix(byte_order_mark.size());
  }
  std::optional<Line> next() {
    while (!rest_.empty()) {
      const std::size_t end = rest_.find('\n');
      std::string_view text = rest_.substr(0, end);
      rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1);
      ++number_;
      if (text.ends_with('\r')) text.remove_suffix(1);
      const std::string_view said = trimmed(text);
      if (!said.empty() && said.front() != '#') return Line{text, where()};
    }
    return {};
  }
  std::string where() const { return fmt::format("{}:{}", name_, number_); }

 private:
  std::string_view rest_;
  std::string name_;
  std::size_t number_ = 0;
};

char separator_of(std::string_view line) {
  for (const char c : {';', ',', '\t'})
    if (line.find(c) != line.npos) return c;
  return ' ';
}

std::vector<double> row_of(const Line& line, const std::vector<Field>& fields, bool bounds) {
  std::vector<double> row;
  for (const Field& field : fields) {
    const std::string where = line.at(field.byte);
    const std::optional<double> value = number(field.text);
    if (!value)
      refuse(where, field.text.empty() ? "nothing" : in_quotes(field.text) + " is not a number",
             "a number, as -1.5e-3");
    check_value(where, in_quotes(field.text), *value, bounds);
    row.push_back(*value);
  }
  return row;
}

MatrixFile read_csv(const std::string& name, std::string_view text, bool bounds) {
  MatrixFile file;
  std::vector<std::vector<double>> rows;
  std::size_t columns = 0;
  char separator = ' ';
  Lines lines(text, name);
  for (bool first = true; const std::optional<Line> line = lines.next(); first = false) {
    if (first) separator = separator_of(line->text);
    const std::vector<Field> fields = fields_of(*line, separator);
    if (first) {
      columns = fields.size();
      if (columns > std::size_t(largest_matrix))
        refuse(line->at(0), fmt::format("{} fields", columns),
               fmt::format("at most {0} x {0} numbers", largest_matrix));
      if (std::ranges::none_of(fields, [](const Field& f) { return number(f.text).has_value(); })) {
        for (const Field& f : fields) file.states.push_back(f.text);
        continue;
      }
    }
    if (fields.size() != columns)
      refuse(line->at(fields.size() > columns ? fields[columns].byte : line->text.size()),
             matrix_numbers(fields.size()),
             fmt::format("{} as in the first line", matrix_numbers(columns)));
    if (rows.size() == columns)
      refuse(line->at(0), fmt::format("row {} of {} numbers", rows.size() + 1, columns),
             "as many rows as columns");
    rows.push_back(row_of(*line, fields, bounds));
  }
  check_size(trimmed(text).empty() ? name : lines.where() + ":1", rows.size(),
             rows.empty() ? 0 : columns);
  file.values.resize(Index(columns), Index(columns));
  for (std::size_t i = 0; i < columns; ++i)
    for (std::size_t j = 0; j < columns; ++j) file.values(Index(i), Index(j)) = rows[i][j];
  return file;
}

// The document; if it is invalid, throws with line and column.
json parsed(const std::string& name, std::string_view text) {
  // Limits the memory that a malicious file can use.
  constexpr int deepest = 12;
  constexpr std::size_t most = 4 * std::size_t(largest_matrix * largest_matrix);
  std::size_t values = 0;
  const auto within = [&](int depth, json::parse_event_t, json&) {
    if (depth > deepest || ++values > most)
      refuse(name, depth > deepest ? "is nested too deeply" : "has too many values",
             "a list of lists of numbers");
    return true;
  };
  try {
    return json::parse(text, within);
  } catch (const json::parse_error& e) {
    const std::string_view before = text.substr(0, std::min(e.byte, text.size() + 1) - 1);
    const std::size_t line = std::size_t(std::ranges::count(before, '\n')) + 1;
    const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1;
    refuse(fmt::format("{}:{}:{}", name, line, column), "is not JSON here",
           "a list of lists of numbers");
  } catch (const json::exception&) {
    refuse(name, "has a number that exceeds the range of a double", "finite numbers");
  }
}

const json& member(const std::string& name, const json& object, const std::string& variable) {
  if (const auto found = object.find(variable); found != object.end()) return *found;
  std::string others;
  for (const auto& [key, value] : object.items())
    if (value.is_array() && others.size() < 200)
      others += (others.empty() ? "" : ", ") + in_quotes(key);
  refuse(name, fmt::format("has no {}", in_quotes(variable)),
         others.empty() ? "an object with a matrix" : "one of " + others + " (--variable)");
}

MatrixFile read_json(const std::string& name, std::string_view text, const std::string& variable,
                     bool bounds) {
  const json document = parsed(name, text);
  const json& list = document.is_object() ? member(name, document, variable) : document;
  MatrixFile file;
  file.named = document.is_object();
  if (file.named)
    if (const auto states = document.find("states"); states != document.end() && states->is_array())
      for (const json& state : *states)
        if (state.is_string()) file.states.push_back(state.get<std::string>());
  if (!list.is_array()) refuse(name, "is not a matrix", "a list of lists of numbers");
  if (list.empty()) check_size(name, 0, 0);
  if (list[0].is_array()) check_size(name, list.size(), list[0].size());
  const std::size_t n = list.size();
  file.values.resize(Index(n), Index(n));
  for (std::size_t i = 0; i < n; ++i) {
    if (!list[i].is_array() || list[i].size() != n)
      refuse(fmt::format("{}: row {}", name, i + 1),
             list[i].is_array() ? matrix_numbers(list[i].size()) : std::string("not a list"),
             matrix_numbers(n));
    for (std::size_t j = 0; j < n; ++j) {
      const json& entry = list[i][j];
      const std::string where = fmt::format("{}: row {}, column {}", name, i + 1, j + 1);
      const std::string shown = in_quotes(entry.is_structured() ? "a list" : entry.dump());
      if (!entry.is_number()) refuse(where, shown + " is not a number", "a number");
      check_value(where, shown, entry.get<double>(), bounds);
      file.values(Index(i), Index(j)) = entry.get<double>();
    }
  }
  return file;
}

}  // namespace

MatrixFile read_matrix(const std::filesystem::path& file, const std::string& variable,
                       bool bounds) {
  const std::string name = file == "-" ? "standard input" : file.string();
  const std::string bytes = bytes_of(file, name);
  if (file.extension() == ".mat") {
    MatrixFile read{read_mat(name, bytes, variable), {}, true};
    for (Index i = 0; i < read.values.rows(); ++i)
      for (Index j = 0; j < read.values.cols(); ++j)
        check_value(fmt::format("{}: variable {}, row {}, column {}", name, in_quotes(variable),
                                i + 1, j + 1),
                    fmt::format("{}", read.values(i, j)), read.values(i, j), bounds);
    return read;
  }
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  const bool is_json = first != bytes.npos && (bytes[first] == '[' || bytes[first] == '{');
  return file.extension() == ".json" || is_json ? read_json(name, bytes, variable, bounds)
                                                : read_csv(name, bytes, bounds);
}

}  // namespace tiltrim::cli
