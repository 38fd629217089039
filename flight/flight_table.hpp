/// @file
/// A flight as a table: what is written, drawn and compared, all from one description.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flight/fly.hpp"

namespace tiltrim {

/// One number over time.
struct FlightColumn {
  std::string name;            ///< "theta_deg"
  std::string unit;            ///< "degrees"
  std::string what;            ///< "pitch attitude"
  std::vector<double> values;  ///< one for each sample
};

/// Time, states, commands, controls, energy errors, forces and powers at every sample. Angles are
/// in degrees, all else SI.
struct FlightTable {
  std::vector<FlightColumn> columns;  ///< time first
  /// How many samples.
  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  /// Throws std::invalid_argument with all names if there is none of this one.
  const std::vector<double>& operator[](const std::string& name) const;
};
/// The table of a flight.
FlightTable flight_table(const Flight& flight, const FlightResult& flown);

/// What stands in a file beside the table: attributes and events.
struct FlightNotes {
  /// Something that happened.
  struct Event {
    double t = 0.0;          ///< s
    std::string kind, what;  ///< in words
  };
  std::string title, study, program, status, message;  ///< attributes of these names
  std::vector<Event> events;                           ///< in their order
};
/// Of a flight.
FlightNotes notes_of(const FlightResult& flown);

/// NetCDF-4 with dimension `time`, and the events beside it; written whole or not at all. Throws
/// std::runtime_error "path: why".
void write_netcdf(const FlightTable& table, const FlightNotes& notes,
                  const std::filesystem::path& file);

}  // namespace tiltrim
