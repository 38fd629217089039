// Ep and k from the rows theta0 and a1s of Table 3: a minimax over six printed numbers.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tables/minimax.hpp"
#include "tables/tables.hpp"

namespace tiltrim {

namespace {

using namespace minimax;

// |theta0| = hypot(1 - k CD, k CL)/Ep,  |a1s| = atan(k CL/(1 - k CD)), deviation from the centre of
// the interval of the printed digits, in units of the last.
Misses misses_at(const SixNumbers& numbers, double middle, const Pair& z, Slopes* slopes) {
  const auto& [Ep, k] = z;
  Misses misses;
  for (std::size_t i = 0; i < 3; ++i) {
    const double CL = std::abs(numbers.CL[i]), CD = numbers.CD[i];
    const double along = 1.0 - k * CD, across = k * CL;
    const double force = std::hypot(along, across);
    const Printed &theta0 = numbers.theta0[i], &a1s = numbers.a1s[i];
    misses[i] = (force / Ep - std::abs(theta0.value)) / theta0.unit - middle;
    misses[i + 3] = (std::atan2(across, along) - std::abs(a1s.value)) / a1s.unit - middle;
    if (!slopes) continue;
    (*slopes)[i] = {-force / (Ep * Ep) / theta0.unit,
                    (across * CL - along * CD) / force / Ep / theta0.unit};
    (*slopes)[i + 3] = {0.0, CL / (force * force) / a1s.unit};
  }
  return misses;
}

std::string name_of(const SixNumbers& numbers, std::size_t i) {
  return fmt::format("{} of {}", i < 3 ? "theta0" : "a1s", numbers.columns[i % 3]);
}

void check_input(const SixNumbers& numbers, const IdentifyOptions& options) {
  for (std::size_t i = 0; i < 3; ++i) {
    const double all =
        numbers.CL[i] + numbers.CD[i] + numbers.theta0[i].value + numbers.a1s[i].value;
    if (!std::isfinite(all))
      throw std::invalid_argument("identify: a number of column " + numbers.columns[i] +
                                  " is not finite");
  }
  if (options.max_evaluations < 1)
    throw std::invalid_argument("identify: max_evaluations must be at least 1");
  for (const Range& r : {options.thrust_excess, options.k})
    if (!(r.lower > 0.0 && r.lower <= r.upper && std::isfinite(r.upper)))
      throw std::invalid_argument(
          fmt::format("identify: [{}, {}] is not a range of positive numbers", r.lower, r.upper));
}

// From theta0 and a1s of one column: k = tan a/(CL + CD tan a), Ep = hypot(...)/theta0.
ColumnConstants constants_of(const SixNumbers& numbers, std::size_t i, Reading reading) {
  const double below = reading == Reading::truncated ? 0.0 : 0.5;
  const double CL = std::abs(numbers.CL[i]), CD = numbers.CD[i];
  const auto end = [&](const Printed& p, double units) {
    return std::abs(p.value) + units * p.unit;
  };
  const auto k = [&](double units) {
    const double slope = std::tan(end(numbers.a1s[i], units));
    return slope / (CL + CD * slope);
  };
  const Range ks{k(-below), k(1.0 - below)};
  const auto force = [&](double at) { return std::hypot(1.0 - at * CD, at * CL); };
  const auto [least, most] = std::minmax({force(ks.lower), force(ks.upper)});
  return {{least / end(numbers.theta0[i], 1.0 - below), most / end(numbers.theta0[i], -below)}, ks};
}

void find_ranges(Search& search, const Box& box, const Pair& centre, Identification& found) {
  for (std::size_t j = 0; j < pair_size; ++j) {
    std::optional<Range>& range = j == 0 ? found.thrust_excess_range : found.k_range;
    range = Range{centre[j], centre[j]};
    if (box.lower[j] == box.upper[j]) continue;
    const RangeEnd lower = range_end(search, box, centre, j, -1.0);
    const RangeEnd upper = range_end(search, box, centre, j, 1.0);
    range = Range{lower.value, upper.value};
    if (lower.shown && upper.shown) continue;
    found.status = IdentifyStatus::not_determined;
    found.message = fmt::format("{} is not determined: the search ends before the digits change",
                                j == 0 ? "Ep" : "k");
  }
}

void solve(Search& search, const SixNumbers& numbers, const IdentifyOptions& options,
           Identification& found) {
  const Box box({options.thrust_excess.lower, options.k.lower},
                {options.thrust_excess.upper, options.k.upper});
  search_box(search, box);
  found.worst = least_miss(search, box, search.best());
  const Pair centre = search.best();
  found.thrust_excess = centre[0];
  found.k = centre[1];
  found.misses = search.evaluate(centre);
  if (found.worst > half_unit + miss_noise) {
    const auto at =
        std::ranges::max_element(found.misses, {}, [](double m) { return std::abs(m); });
    found.status = IdentifyStatus::not_reproduced;
    found.message = fmt::format(
        "no pair Ep, k found that gives the printed digits; with the best, {} misses by {:.3g} "
        "units of its last digit",
        name_of(numbers, std::size_t(at - found.misses.begin())), std::abs(*at) - half_unit);
    return;
  }
  found.status = IdentifyStatus::reproduced;
  find_ranges(search, box, centre, found);
}

}  // namespace

std::string to_string(Reading reading) {
  return reading == Reading::truncated ? "truncated" : "rounded";
}

std::string to_string(IdentifyStatus status) {
  switch (status) {
    case IdentifyStatus::reproduced:
      return "reproduced";
    case IdentifyStatus::not_reproduced:
      return "not_reproduced";
    case IdentifyStatus::not_determined:
      return "not_determined";
    case IdentifyStatus::evaluation_limit:
      break;
  }
  return "evaluation_limit";
}

SixNumbers six_numbers(const PublishedTables& published) {
  SixNumbers six{published.columns, {}, {}, published.theta0, published.a1s};
  for (std::size_t i = 0; i < 3; ++i) {
    six.CL[i] = published.CL[i].value;
    six.CD[i] = published.CD[i].value;
  }
  return six;
}

Identification identify(const SixNumbers& numbers, const Aircraft& aircraft,
                        const IdentifyOptions& options) {
  check_input(numbers, options);
  Identification found;
  found.reading = options.reading;
  const double middle = options.reading == Reading::truncated ? 0.5 : 0.0;
  Search search(
      [&](const Pair& z, Slopes* slopes) { return misses_at(numbers, middle, z, slopes); },
      options.max_evaluations);
  try {
    solve(search, numbers, options, found);
  } catch (const OutOfEvaluations&) {
    found.status = IdentifyStatus::evaluation_limit;
    found.thrust_excess_range = found.k_range = std::nullopt;
    found.message = fmt::format("no verified answer within {} evaluations", search.evaluations());
    if (found.k == 0.0) {
      found.thrust_excess = search.best()[0];
      found.k = search.best()[1];
      found.worst = search.best_score();
    }
  }
  found.evaluations = search.evaluations();
  // k = ½ρ(V + vi)²S/(m g)
  const Aircraft& a = aircraft;
  found.effective_speed =
      std::sqrt(2.0 * found.k * a.mass * a.gravity / (a.air_density * a.wing_area));
  for (std::size_t i = 0; i < 3; ++i) found.columns[i] = constants_of(numbers, i, options.reading);
  return found;
}

}  // namespace tiltrim
