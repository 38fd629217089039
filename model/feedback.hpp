/// @file
/// Feedback interconnection of two models, a plant and its controller, by signal names.
#pragma once

#include "model/model.hpp"

namespace tiltrim {

/// The closed loop of plant and controller as one model. An input of one that has the name of an
/// output, or else of a state, of the other is fed by it; the other inputs remain inputs. States,
/// inputs, outputs and parameters are the plant's, then the controller's. Derivatives are exact, by
/// the chain rule, if both models have them. Switches are kept; enclosure and affine are not. A
/// static controller, without states, needs no f. To find the fed inputs, h is first called with
/// arbitrary values of the size of the inputs' nominals and must accept them.
///
/// Throws std::invalid_argument if a model cannot be used, if no input is fed, if a name would
/// denote two signals, if an input and its source have different units, and for an algebraic loop,
/// that is a fed signal that depends on itself without a state between. An algebraic loop is found
/// here if it appears at one of a few trial points, otherwise when the model is evaluated.
[[nodiscard]] Model feedback(const Model& plant, const Model& controller);

}  // namespace tiltrim
