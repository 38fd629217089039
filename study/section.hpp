/// One table of a study; every value is checked as it is read. Internal to study/.
#pragma once

#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "study/keys.hpp"
#include "study/toml_reader.hpp"

namespace tiltrim::reading {

constexpr double most_seeds = 9007199254740992.;  // 2^53: doubles represent all integers up to here

/// The range of a number in the file's unit; values are returned in SI, radians.
struct Accepted {
  double lower, upper;
  std::string_view unit = "";  ///< "degrees" and "degrees/s" are converted
  bool degrees() const { return unit == "degrees"; }
};
constexpr double largest = 1e6;  ///< far beyond any aircraft, far below overflow
constexpr Accepted speed{0, largest, "m/s"};
constexpr Accepted any_angle{-180, 180, "degrees"};

/// The range of a key; the key must outlive the result.
inline Accepted accepted_by(const Key& key) {
  return {key.accepted.lower, key.accepted.upper, key.unit};
}

/// Converts a number in the file's unit to SI.
constexpr double in_si(double value, std::string_view unit) {
  return unit.starts_with("degrees") ? value * (std::numbers::pi / 180) : value;
}

/// "a number from 0 to 180 degrees"
std::string describe(const Accepted& accepted);
/// describe(), also telling whether an array is empty.
std::string described(const Entry& entry);

/// A query of a reader for a table or key, from which the schema of studies is built.
struct Asked {
  std::string path;                     ///< "aircraft.mass"; of a table "aircraft."
  std::vector<std::string> words = {};  ///< keys of the table, or the choices of a text
  bool number = false, whole = false;
  double lower = 0.0, upper = 0.0;  ///< limits of a number
  std::string unit = {};
  unsigned least = 0, most = 0;  ///< entries of a list; 0: any
};
/// Called for every query while studies are read; empty except in tests.
inline std::function<void(const Asked&)> listener;

class Section {
 public:
  /// `title` as the table is written, "[gains]"; `prefix` of its keys in messages, "gains.".
  Section(const std::filesystem::path& file, const Entry& table, std::string title,
          std::string prefix);

  /// Refuses every other key, with the nearest of these names or the hint in `elsewhere`.
  void allow_only(const std::vector<std::string>& keys,
                  const std::map<std::string, std::string>& elsewhere = {}) const;

  const Entry* find(std::string_view key) const;
  const Entry& require(std::string_view key, std::string_view expected) const;

  double number(std::string_view key, const Accepted& accepted) const;
  double number(const Entry& entry, const Accepted& accepted) const;
  double whole(const Entry& entry, const Accepted& accepted) const;
  /// The numbers of a list, each checked, in the file's unit.
  std::vector<double> numbers(const Entry& list, const Accepted& accepted) const;
  /// The same for at least two rising numbers; `things` names them, "tilts".
  std::vector<double> rising(const Entry& list, const Accepted& accepted,
                             std::string_view things) const;
  Range range(const Entry& entry, const Accepted& accepted) const;
  /// Text of 1 to 200 bytes without control characters.
  std::string text(std::string_view key) const;
  /// Text of 1 to 5000 bytes, possibly of several lines.
  std::string passage(std::string_view key) const;
  /// Index of the text in `names`; 0 if the key is missing.
  std::size_t choice(std::string_view key, const std::vector<std::string>& names) const;

  /// The table [prefix.key], if present.
  std::optional<Section> table(std::string_view key) const;
  /// The tables [[prefix.key]]; empty if there are none.
  std::vector<Section> tables(std::string_view key) const;

  /// Throws StudyError "file:line:column: prefix.key: message" at the entry's value.
  [[noreturn]] void refuse(const Entry& entry, std::string_view message) const;
  /// The same at the table's header, for a missing key.
  [[noreturn]] void refuse(std::string_view key, std::string_view message) const;

 private:
  double accept(const Entry& entry, const Entry& named, const Accepted& accepted,
                std::string_view expected) const;
  std::string words(std::string_view key, std::size_t longest, bool lines) const;

  const std::filesystem::path& file_;
  const Entry& table_;
  std::string title_, prefix_;
};

/// Reads a number if the key is present.
inline void read_number(const Section& section, std::string_view key, const Accepted& accepted,
                        double& value) {
  if (section.find(key)) value = section.number(key, accepted);
}

/// Reads an integer if the key is present.
template <class Whole>
void read_whole(const Section& section, std::string_view key, const Accepted& accepted,
                Whole& value) {
  if (const Entry* entry = section.find(key)) value = Whole(section.whole(*entry, accepted));
}

}  // namespace tiltrim::reading
