/// Slips of the paper by section. Internal to tables/.
#pragma once

#include <vector>

#include "tables/tables.hpp"

namespace tiltrim::slips {

inline const Aircraft paper;  ///< the paper's numbers
inline const double weight = paper.mass * paper.gravity;

struct Source {
  const PublishedTables& published;
  const Identification& identified;
  const Polar& section;
  const Vehicle& vehicle;
  const CorrectedTable& free_pitch;
};

/// Residuals of (1) as printed with the signs of Table 3, column by column.
std::vector<Evidence> climb_from_body_axes(const Source& source);

std::vector<Slip> in_airframe(const Source& source);     ///< (1)-(3)
std::vector<Slip> in_control_law(const Source& source);  ///< (7)-(15)
std::vector<Slip> in_tables(const Source& source);       ///< Tables 1-3
std::vector<Slip> in_flight(const Source& source);       ///< (16), parameters, text and figures

}  // namespace tiltrim::slips
