/// A judge of proved regions that is no proof: random points, trimmed and linearized.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "check_proof/certificate.hpp"
#include "study/study.hpp"

struct OracleFindings {
  std::size_t stable = 0, unstable = 0, no_trim = 0;  ///< points judged
  std::size_t contradictions = 0;
  std::string first;  ///< of the contradictions
};

/// Points uniform in the volume of what is proved; every hundredth of a box without trim only,
/// which takes a search.
OracleFindings oracle(const tiltrim::checking::Theorem& theorem, const tiltrim::Study& study,
                      std::size_t count, std::uint64_t seed);
