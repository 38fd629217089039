/// @file
/// Levels of flying qualities: a figure, its limits, and on which side of them it lies.
#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A level of a requirement.
enum class Level : std::int8_t {
  not_judged = -1,  ///< the requirement does not apply, or its figure is not known
  undecided = 0,    ///< a border lies within the error bound
  one = 1,          ///< clearly adequate
  two = 2,          ///< adequate with more workload
  three = 3,        ///< controllable
  none = 4,         ///< worse than every limit of the requirement
};
std::string to_string(Level level);  ///< "1", "2", "3", "none", "undecided", "not judged"

/// A figure judged by one requirement.
struct Criterion {
  std::string name;                 ///< "short-period damping"
  std::string requirement;          ///< "MIL-F-8785C 3.2.2.1.2"
  std::string unit;                 ///< of the figure
  double value = 0.0;               ///< NaN: not known
  double error = 0.0;               ///< its bound
  Level level = Level::not_judged;  ///< its level
  /// Signed distances to the border of level 1, 2, ...: positive inside.
  std::vector<double> margins{};
  double margin_error = 0.0;  ///< bound of each margin's error
  std::string margin_unit{};  ///< of the margins
  std::string remark{};       ///< why it is not judged, or how it was found

  std::size_t nearest() const;  ///< index of the nearest border in `margins`
  double distance() const;      ///< to that border, signed; NaN without margins
};

/// Completes a criterion: its level from its margins and their error.
[[nodiscard]] Criterion judged(Criterion criterion);

/// A figure that must lie within limits[k] for level k + 1, borders included.
[[nodiscard]] Criterion within(std::string name, std::string requirement, std::string unit,
                               double value, double error, const std::vector<Range>& limits);

/// The worst level of all that are judged; undecided if one of those that are could be worse.
[[nodiscard]] Level worst_of(const std::vector<Criterion>& criteria);

}  // namespace tiltrim
