/// @file
/// A study's [tune] as a problem.
#pragma once

#include "study/study.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// The study's [tune] as a problem. Throws std::invalid_argument where there is no [tune] or it
/// asks for what its conditions do not have.
[[nodiscard]] TuneProblem tune_problem(const Study& study);
/// The study's choice of algorithms, seed and budget; the start is its own numbers. Throws as
/// tune_problem().
[[nodiscard]] TuneOptions tune_options(const Study& study);

}  // namespace tiltrim
