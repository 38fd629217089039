/// Motions of a user-defined model as text, JSON and figures.
#pragma once

#include <string>
#include <vector>

#include "report/figure.hpp"
#include "report/sheet.hpp"
#include "study/problems.hpp"

namespace tiltrim {

std::string motion_text(const MotionAnswer& motion, const TextStyle& style);
std::string motion_json(const MotionAnswer& motion);
/// The contents of the text, for documents.
std::vector<Sheet> motion_document(const MotionAnswer& motion);
/// One panel per state, then one per input and output that varies.
Figure motion_figure(const MotionAnswer& motion);
/// "levitation, from the trim of held: completed at 0.5 s."
std::string outcome_of(const MotionAnswer& motion);
/// Notes stored with the samples in a file.
FlightNotes notes_of(const MotionAnswer& motion);

}  // namespace tiltrim
