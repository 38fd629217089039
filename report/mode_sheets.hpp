/// @file
/// Modes of one matrix, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>

#include "linearize/modes.hpp"
#include "report/sheet.hpp"

namespace tiltrim {

/// Eigenvalues, one row each (one row per complex pair).
Sheet modes_sheet(const Modes& modes, const Signals& states);
/// Eigenvalues, one row each (both of a pair), for CSV.
Sheet all_modes_sheet(const Modes& modes);

/// Empty for an eigenvalue of zero, which has no damping ratio.
SheetCell damping_cell(const Mode& mode);
Tone tone_of(Verdict verdict);  ///< good, bad or doubtful
/// "-0.4681 ± 0.0999i"
std::string eigenvalue_text(const Mode& mode);
/// "the rightmost eigenvalue is -0.1686 1/s (phugoid); it is left of the axis by more than its
/// error bound".
std::string verdict_in_words(const Modes& modes);

/// Eigenvalues with the name, and the verdict in a note, for documents.
Sheet judged_modes_sheet(const std::string& name, const Modes& modes, const Signals& states);
/// Verdict and eigenvalues of the named matrix.
std::string modes_text(const std::string& name, const Modes& modes, const Signals& states,
                       const TextStyle& style);
/// The modes, spectral abscissa and verdict, with the keys of `linearize` for a condition.
std::string modes_json(const Modes& modes, const Signals& states);

}  // namespace tiltrim
