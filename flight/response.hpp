/// @file
/// How far the linear model of a flight's trim reaches: its response beside the nonlinear one.
#pragma once

#include <map>
#include <string>

#include "flight/fly.hpp"
#include "simulate/response.hpp"

namespace tiltrim {

/// At the trim of a command that is held, in wind axes. `offset` by state name: V, gamma, theta, q,
/// energy_integral, distribution_integral (SI). Throws std::invalid_argument for other names and an
/// offset of nothing.
[[nodiscard]] Response response(const Flight& flight, const Command& command,
                                const std::map<std::string, double>& offset,
                                const ResponseOptions& options = {});

}  // namespace tiltrim
