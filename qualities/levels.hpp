/// How a figure is judged by the limits of a requirement.
#pragma once

#include <string>
#include <vector>

#include "qualities/qualities.hpp"

namespace tiltrim {

/// Completes a criterion: its level from its margins and their error. A level without a margin, or
/// with an infinite one, has no limit: whatever is worse than the level before meets it.
[[nodiscard]] Criterion judged(Criterion criterion);

/// A figure that must lie within limits[k] for level k + 1, borders included.
[[nodiscard]] Criterion within(std::string name, std::string requirement, std::string unit,
                               double value, double error, const std::vector<Range>& limits);

/// The worst level of all that are judged; undecided if one of those that are could be worse.
[[nodiscard]] Level worst_of(const std::vector<Criterion>& criteria);

}  // namespace tiltrim
