/// Faults of the prover that a test switches on (mutants.py).
#pragma once

#include <cstdlib>
#include <string_view>

/// Whether the environment's TILTRIM_MUTANT names this fault.
inline bool mutant(std::string_view name) {
  static const char* const on = std::getenv("TILTRIM_MUTANT");
  return on && name == on;
}
