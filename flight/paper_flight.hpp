/// What the paper's Figures 5-9 show, beside what a flight does.
#pragma once

#include <string>
#include <vector>

#include "flight/fly.hpp"

namespace tiltrim {

/// One thing that can be seen in the paper's figures [1].
struct PaperFact {
  std::string figure;   ///< "5", "9"
  std::string paper;    ///< what the paper's figure shows
  std::string flight;   ///< the same of this flight
  bool agrees = false;  ///< by the criterion that docs/simulate.md gives
  std::string why;      ///< what differs and the likely reason; empty where they agree
};

/// For a flight along corridor (16) from the ground of 90 s; facts that a shorter or a lost flight
/// does not come to say so.
std::vector<PaperFact> paper_facts(const FlightTable& table);

}  // namespace tiltrim
