/// @file
/// One axis of a grid: numbers of a model that move together.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace tiltrim {

/// One axis of a sweep's grid: a number of the model, and those that move with it.
struct SweepAxis {
  /// A number that the axis moves.
  struct Column {
    std::string name;            ///< as the caller writes it: "eta_deg", "gains.K_Lp"
    std::string unit;            ///< of these values
    std::string signal;          ///< of the model that it sets; empty: it only names the points
    std::vector<double> values;  ///< in that unit, one for each point
    std::vector<double> si;      ///< the same in SI, radians
  };
  std::string name;             ///< the dimension: the first key's last part, "K_Lp"
  std::vector<Column> columns;  ///< the axis's own key first
  /// What the columns are between two points of the grid, from what they would be on straight lines
  /// (SI, one value for each column); empty: that.
  std::function<void(std::vector<double>& columns)> between{};
  /// Points along it.
  std::size_t size() const { return columns.front().values.size(); }
};

}  // namespace tiltrim
