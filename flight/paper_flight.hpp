/// The paper's Figures 5-9 compared with a flight.
#pragma once

#include <string>
#include <vector>

#include "flight/fly.hpp"

namespace tiltrim {

/// One feature of the paper's figures [1].
struct PaperFact {
  std::string figure;   ///< "5", "9"
  std::string paper;    ///< the feature in the paper's figure
  std::string flight;   ///< the same in this flight
  bool agrees = false;  ///< by the criterion that docs/simulate.md gives
  std::string why;      ///< the difference and its likely cause; empty if they agree
  bool reached = true;  ///< false: the flight ends before
};

/// For a flight of 90 s along corridor (16) from the ground; a feature that a shorter or lost
/// flight does not reach is reported as such.
std::vector<PaperFact> paper_facts(const FlightTable& table);

}  // namespace tiltrim
