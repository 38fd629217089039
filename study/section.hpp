/// One table of a study, read key by key with every value checked.
/// Internal to study/.
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

constexpr double most_seeds = 9007199254740992.;  // 2^53: the whole numbers a double tells apart

/// What a number may be, in the file's unit; the numbers read are SI, radians.
struct Accepted {
  double lower, upper;
  std::string_view unit = "";  ///< "degrees" and "degrees/s" are converted
  bool degrees() const { return unit == "degrees"; }
};
constexpr double largest = 1e6;  ///< far beyond any aircraft, far from overflow
constexpr Accepted speed{0, largest, "m/s"};
constexpr Accepted any_angle{-180, 180, "degrees"};

/// The range of a key, which must outlive the answer.
inline Accepted accepted_by(const Key& key) {
  return {key.accepted.lower, key.accepted.upper, key.unit};
}

/// A number in the file's unit, in SI.
constexpr double in_si(double value, std::string_view unit) {
  return unit.starts_with("degrees") ? value * (std::numbers::pi / 180) : value;
}

/// "a number from 0 to 180 degrees"
std::string describe(const Accepted& accepted);
/// describe(), and whether an array is empty.
std::string described(const Entry& entry);

/// What a reader asks of a table or a key, for whoever listens: the schema of studies is made of
/// it.
struct Asked {
  std::string path;                     ///< "aircraft.mass"; of a table "aircraft."
  std::vector<std::string> words = {};  ///< keys of the table, or what a text may be
  bool number = false, whole = false;
  double lower = 0.0, upper = 0.0;  ///< of a number
  std::string unit = {};
};
/// Called for everything that is asked while studies are read; none, unless a test listens.
inline std::function<void(const Asked&)> listener;

class Section {
 public:
  /// `title` as the table is written, "[gains]"; `prefix` of its keys in messages, "gains.".
  Section(const std::filesystem::path& file, const Entry& table, std::string title,
          std::string prefix);

  /// Refuses every other key, naming the nearest of these, or what `elsewhere` says of it.
  void allow_only(const std::vector<std::string>& keys,
                  const std::map<std::string, std::string>& elsewhere = {}) const;

  const Entry* find(std::string_view key) const;
  const Entry& require(std::string_view key, std::string_view expected) const;

  double number(std::string_view key, const Accepted& accepted) const;
  double number(const Entry& entry, const Accepted& accepted) const;
  double whole(const Entry& entry, const Accepted& accepted) const;
  /// The numbers of a list, each checked, in the file's own unit.
  std::vector<double> numbers(const Entry& list, const Accepted& accepted) const;
  /// At least two of them, rising; `things` is what they are, "tilts".
  std::vector<double> rising(const Entry& list, const Accepted& accepted,
                             std::string_view things) const;
  Range range(const Entry& entry, const Accepted& accepted) const;
  /// Text of 1 to 200 bytes without control characters.
  std::string text(std::string_view key) const;
  /// Text of 1 to 5000 bytes that may have lines.
  std::string passage(std::string_view key) const;
  /// Position of the text among `names`; 0 if the key is not there.
  std::size_t choice(std::string_view key, const std::vector<std::string>& names) const;

  /// The table [prefix.key] if there is one.
  std::optional<Section> table(std::string_view key) const;
  /// The tables [[prefix.key]]; none if there is no such key.
  std::vector<Section> tables(std::string_view key) const;

  /// Throws StudyError "file:line:column: prefix.key: message" at the entry's value.
  [[noreturn]] void refuse(const Entry& entry, std::string_view message) const;
  /// The same at the table's head, for a key that is not there.
  [[noreturn]] void refuse(std::string_view key, std::string_view message) const;

 private:
  double accept(const Entry& entry, const Entry& named, const Accepted& accepted,
                std::string_view expected) const;
  std::string words(std::string_view key, std::size_t longest, bool lines) const;

  const std::filesystem::path& file_;
  const Entry& table_;
  std::string title_, prefix_;
};

/// A number, where there is one at the key.
inline void read_number(const Section& section, std::string_view key, const Accepted& accepted,
                        double& value) {
  if (section.find(key)) value = section.number(key, accepted);
}

/// A whole number, where there is one at the key.
template <class Whole>
void read_whole(const Section& section, std::string_view key, const Accepted& accepted,
                Whole& value) {
  if (const Entry* entry = section.find(key)) value = Whole(section.whole(*entry, accepted));
}

}  // namespace tiltrim::reading
