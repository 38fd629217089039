/// Motions of a model of the user's own as text, JSON and figures.
#pragma once

#include <string>
#include <vector>

#include "report/figure.hpp"
#include "report/sheet.hpp"
#include "study/problems.hpp"

namespace tiltrim {

std::string motion_text(const MotionAnswer& motion, const TextStyle& style);
std::string motion_json(const MotionAnswer& motion);
/// What the text has, for documents.
std::vector<Sheet> motion_document(const MotionAnswer& motion);
/// One panel for each state, then each input and output that moves.
Figure motion_figure(const MotionAnswer& motion);
/// "levitation, from the trim of held: completed at 0.5 s."
std::string outcome_of(const MotionAnswer& motion);
/// What stands beside the samples in a file.
FlightNotes notes_of(const MotionAnswer& motion);

}  // namespace tiltrim
