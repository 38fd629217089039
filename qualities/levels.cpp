#include "qualities/levels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tiltrim {

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
  c.level = Level::none;
  for (std::size_t k = 0; k < c.margins.size(); ++k) {
    if (c.margins[k] < -c.margin_error) continue;
    const bool inside = c.margins[k] > c.margin_error;
    c.level = inside ? Level(int(k) + 1) : Level::undecided;
    break;
  }
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
  const int worst = int(Level::none);
  if (c.level != Level::undecided) return {int(c.level), int(c.level)};
  int best = worst, last = 1;
  for (std::size_t k = c.margins.size(); k-- > 0;)
    if (!(c.margins[k] < -c.margin_error)) best = int(k) + 1;
  for (const double m : c.margins)
    if (m > c.margin_error)
      break;
    else
      ++last;
  return {best, last > int(c.margins.size()) ? worst : last};
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
