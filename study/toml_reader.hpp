/// A TOML file as plain entries with positions; keeps toml++ in one source file. Internal to
/// study/.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tiltrim::reading {

/// Position in a file, counted from 1.
struct Place {
  unsigned line = 1, column = 1;
};

struct Entry {
  enum class Kind { table, array, text, number, other };
  Kind kind = Kind::table;
  std::string key;         ///< empty for the file itself and inside arrays
  Place key_place, place;  ///< of the key and of the value
  double number = 0.0;
  std::string text;            ///< kind other: a description, "a boolean"
  std::vector<Entry> entries;  ///< of a table or array, in file order
};

/// At most the first `limit` + 1 bytes of a file; throws StudyError if it cannot be read.
std::string read_text(const std::filesystem::path& file, std::size_t limit);

/// Parses TOML; `file` names the text in messages. Throws StudyError.
Entry parse_toml(std::string_view text, const std::filesystem::path& file);

/// An entry's value for messages: "the text 'abc'", "an array", "-4".
std::string describe(const Entry& entry);

/// The text in quotes, truncated to the length of a message.
std::string in_quotes(std::string_view text);

/// Throws StudyError "file:line:column: message".
[[noreturn]] void refuse(const std::filesystem::path& file, Place place, std::string_view message);

}  // namespace tiltrim::reading
