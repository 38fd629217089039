/// @file
/// Two models around each other: a controller closes the loop of a plant, by the signals' names.
#pragma once

#include "model/model.hpp"

namespace tiltrim {

/// The plant with the controller around it, as one model. Each input of one that bears the name of
/// an output of the other, or else of a state, is fed by it; the others stay inputs. States,
/// inputs, outputs and parameters are the plant's, then the controller's. Exact derivatives, by the
/// chain rule, where both have them. Switches are carried over; enclosure and affine are not. A
/// static controller, without states, needs no f. To find the fed inputs h is called with others
/// first, of the size of the inputs' nominals: it must bear that.
///
/// Throws std::invalid_argument if a model cannot be used, if nothing feeds anything, if a name
/// would stand for two signals, if an input and what feeds it name different units, and for an
/// algebraic loop, a fed signal that depends on itself without a state between: here if it shows at
/// one of a few points tried, else from the loop's functions at the point where it is met.
[[nodiscard]] Model feedback(const Model& plant, const Model& controller);

}  // namespace tiltrim
