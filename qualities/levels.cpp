#include "qualities/levels.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tiltrim {

constexpr double unlimited = std::numeric_limits<double>::infinity();

std::string to_string(Level level) {
  switch (level) {
    case Level::not_judged:
      return "not judged";
    case Level::undecided:
      return "undecided";
    case Level::none:
      return "none";
    default:
      return std::to_string(int(level));
  }
}

std::size_t Criterion::nearest() const {
  const auto at = std::ranges::min_element(margins, {}, [](double m) { return std::abs(m); });
  return std::size_t(at - margins.begin());
}

double Criterion::distance() const {
  return margins.empty() ? std::numeric_limits<double>::quiet_NaN() : margins[nearest()];
}

Criterion judged(Criterion c) {
  if (c.margins.empty()) return c;
  std::size_t worse = 0;  // than the limits of so many levels
  while (worse < c.margins.size() && c.margins[worse] < -c.margin_error) ++worse;
  const double margin = worse < c.margins.size() ? c.margins[worse] : unlimited;
  c.level = margin > c.margin_error ? Level(int(worse) + 1) : Level::undecided;
  if (worse > 0 && margin == unlimited && c.level < Level::none)
    c.remark += fmt::format("{}worse than level {}; level {} has no limit",
                            c.remark.empty() ? "" : ", ", worse, worse + 1);
  return c;
}

Criterion within(std::string name, std::string requirement, std::string unit, double value,
                 double error, const std::vector<Range>& limits) {
  Criterion c{std::move(name), std::move(requirement), unit, value, error};
  c.margin_unit = std::move(unit);
  c.margin_error = error;
  for (const Range& limit : limits)
    c.margins.push_back(std::min(value - limit.lower, limit.upper - value));
  return judged(c);
}

// The levels that a criterion may have.
static std::pair<int, int> possible(const Criterion& c) {
  if (c.level != Level::undecided) return {int(c.level), int(c.level)};
  int best = int(c.margins.size()) + 1, last = 1;
  for (std::size_t k = c.margins.size(); k-- > 0;)
    if (!(c.margins[k] < -c.margin_error)) best = int(k) + 1;
  for (const double m : c.margins)
    if (m > c.margin_error)
      break;
    else
      ++last;
  return {best, last};
}

Level worst_of(const std::vector<Criterion>& criteria) {
  int least = int(Level::not_judged), most = least;
  for (const Criterion& c : criteria) {
    if (c.level == Level::not_judged) continue;
    const auto [best, worst] = possible(c);
    least = std::max(least, best);
    most = std::max(most, worst);
  }
  return least == most ? Level(least) : Level::undecided;
}

}  // namespace tiltrim
