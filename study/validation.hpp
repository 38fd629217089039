/// @file
/// A published vehicle compared with every number published about it.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tiltrim {

/// One published number and ours.
struct Comparison {
  std::string group;           ///< "component loads, printed_1983"
  std::string condition;       ///< "40 kt"
  std::string quantity;        ///< "fuselage X"
  std::string unit;            ///< of all numbers, as published
  double published = 0.0;      ///< as printed
  std::optional<double> ours;  ///< empty: no answer, `cause` says why
  std::optional<double>
      allowed;          ///< largest difference that counts as agreement; empty: none given
  std::string source;   ///< report and page
  std::string cause{};  ///< of a miss
  std::optional<double> simpler{};  ///< of Kleinhesselink's model

  /// Ours minus published.
  std::optional<double> difference() const {
    return ours ? std::optional(*ours - published) : std::nullopt;
  }
  /// "agrees", "misses", or "no bound" where the source states no error.
  std::string verdict() const;
};

/// Root mean square of the differences in trim: ours, and of Kleinhesselink's model.
struct AgainstSimpler {
  std::string quantity;  ///< "pitch attitude"
  std::string unit;      ///< of both numbers
  double ours = 0.0;     ///< root mean square of ours
  double simpler = 0.0;  ///< of Kleinhesselink's
};

/// All comparisons, in groups.
struct Validation {
  std::string vehicle;                  ///< its name in study files
  std::vector<Comparison> comparisons;  ///< in the order of the page
  std::vector<AgainstSimpler> summary;  ///< by quantity
};

/// The vehicles that can be validated.
const std::vector<std::string>& validated_vehicles();
/// Throws std::invalid_argument with the names if there is no such vehicle, std::runtime_error for
/// missing data.
[[nodiscard]] Validation validate(const std::string& vehicle);

}  // namespace tiltrim
