/// Starts of a condition's lines in their order, as start_first_points() and start_last_points()
/// compute them, with memory for one row of lines along each slower axis. Internal to sweep/.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sweep/starts.hpp"

namespace tiltrim {

/// Starts for the lines from `first` on; next() gives one after the other. `sweep` must outlive it.
class LineChain {
 public:
  LineChain(const Prepared& sweep, std::size_t first);
  /// Without the order of the modes.
  LineStart next();

 private:
  /// Starts at the last points of the lines along one slower axis, those on the faster ones at
  /// their ends: unknowns, one row after the other.
  struct Ends {
    std::vector<char> known;
    std::vector<double> unknowns;
  };

  const Prepared& sweep_;
  Lines lines_;
  std::size_t line_;
  std::vector<std::optional<OperatingPoint>> firsts_;  ///< [axis]: the last known along it
  std::vector<Ends> ends_;                             ///< [axis]
  std::vector<std::optional<double>> some_phi_;        ///< of the line before, at some points
  std::shared_ptr<const std::vector<double>> phi_;     ///< as long as those stay

  std::shared_ptr<const std::vector<double>> phi_of(const LineStart& start);
  GridTrim first(std::size_t line);
  void fill_ends(std::size_t axis, GridPlace place);
  std::optional<OperatingPoint> end(std::size_t axis, GridPlace place) const;
};

}  // namespace tiltrim
