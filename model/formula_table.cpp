// Look-up tables of formulas: their checks, and their values on ranges.
#include "model/formula_table.hpp"

#include <fmt/core.h>

#include <functional>
#include <numeric>
#include <stdexcept>

#include "model/branches.hpp"

namespace tiltrim::formula {

namespace {

using Cells = std::array<std::size_t, most_arguments>;
using Box = std::array<Interval, most_arguments>;
using Order = std::array<int, most_arguments>;

// The part of a range within cell i; its ends may lie just outside the entries.
Interval within(const std::vector<double>& at, std::size_t i, const Interval& x) {
  return {i == 0 ? x.lower() : std::max(x.lower(), at[i]),
          i + 2 == at.size() ? x.upper() : std::min(x.upper(), at[i + 1])};
}

// A derivative over a box within cells, or a value of order 0.
Interval derivative(const LookupTable& table, const Cells& cells, const Box& x,
                    const Order& order) {
  const double reference = corner(table, cells);
  const auto by = shares<Interval>(table, cells, std::span(x.data(), table.at.size()));
  const Interval sum = combined<Interval>(table, by, order, reference);
  return std::accumulate(order.begin(), order.end(), 0) == 0 ? reference + sum : sum;
}

// The hull of `part` over the cells that the box touches.
Interval over_cells(const LookupTable& table, std::span<const Interval> x,
                    const std::function<Interval(const Cells&, const Box&)>& part) {
  const std::size_t n = table.at.size();
  Cells first{}, last{}, cells{};
  for (std::size_t k = 0; k < n; ++k) {
    first[k] = cell(table.at[k], x[k].lower());
    last[k] = cell(table.at[k], x[k].upper());
  }
  cells = first;
  Interval all = Interval::unknown();
  for (bool begun = false;; begun = true) {
    Box box;
    for (std::size_t k = 0; k < n; ++k) box[k] = within(table.at[k], cells[k], x[k]);
    const Interval here = part(cells, box);
    all = begun ? hull(all, here) : here;
    std::size_t k = 0;
    while (k < n && cells[k] == last[k]) {
      cells[k] = first[k];
      ++k;
    }
    if (k == n) return all;
    ++cells[k];
  }
}

// Linear along each argument, it has its extremes at corners.
Interval at_corners(const LookupTable& table, const Cells& cells, const Box& box) {
  Interval all;
  for (unsigned corner = 0; corner < 1u << table.at.size(); ++corner) {
    Box point;
    for (std::size_t k = 0; k < table.at.size(); ++k)
      point[k] = corner >> k & 1 ? box[k].upper() : box[k].lower();
    const Interval value = derivative(table, cells, point, {});
    all = corner == 0 ? value : hull(all, value);
  }
  return all;
}

// By the mean value theorem and by the shares themselves: both contain all values.
Interval of_cubic(const LookupTable& table, const Cells& cells, const Box& box) {
  Box centre;
  for (std::size_t k = 0; k < table.at.size(); ++k) centre[k] = middle(box[k]);
  Interval mean = derivative(table, cells, centre, {});
  for (std::size_t k = 0; k < table.at.size(); ++k) {
    Order along{};
    along[k] = 1;
    mean += derivative(table, cells, box, along) * (box[k] - centre[k]);
  }
  const Interval direct = derivative(table, cells, box, {});
  if (!mean.finite()) return direct;
  return direct.finite() ? both(mean, direct) : mean;
}

bool all_covered(const LookupTable& table, std::span<const Interval> x) {
  for (std::size_t k = 0; k < x.size(); ++k)
    if (!x[k].finite() || !covers(table, k, x[k].lower(), x[k].upper())) return false;
  return true;
}

// The cell by comparisons with its entries, by halves, so that a kink is a switch of the formula.
std::size_t chosen_cell(const std::vector<double>& at, const Jet& x) {
  std::size_t low = 0, high = at.size() - 1;
  while (high - low > 1) {
    const std::size_t half = (low + high) / 2;
    (x < at[half] ? high : low) = half;
  }
  return low;
}

Jet linear(const LookupTable& table, std::span<const Jet> x, std::span<const Interval> box) {
  const std::size_t n = x.size();
  bool moves = false, across = false;
  Cells cells{};
  for (std::size_t k = 0; k < n; ++k) {
    moves = moves || x[k].depends_on_unknowns();
    across = across || cell(table.at[k], box[k].lower()) != cell(table.at[k], box[k].upper());
  }
  if (across && !current_branches) return Interval::unknown();
  if (across && moves && current_branches->values)  // no derivatives are wanted: both sides count
    return Jet::value_within(range(table, box));
  for (std::size_t k = 0; k < n; ++k) cells[k] = chosen_cell(table.at[k], x[k]);
  const double reference = corner(table, cells);
  return Jet(reference) + combined<Jet>(table, shares<Jet>(table, cells, x), {}, reference);
}

// Taylor's formula with the second derivatives of all cells: the first are continuous.
Jet cubic(const LookupTable& table, std::span<const Jet> x, std::span<const Interval> box) {
  const std::size_t n = x.size();
  Cells cells{};
  Box centre;
  std::array<Jet, most_arguments> away;
  for (std::size_t k = 0; k < n; ++k) {
    const double c = x[k].value().centre();
    cells[k] = cell(table.at[k], c);
    centre[k] = c;
    away[k] = x[k].value_only() - Jet(c);
  }
  Jet value = derivative(table, cells, centre, {});
  std::array<Jet, most_arguments> slopes;
  for (std::size_t k = 0; k < n; ++k) {
    Order order{};
    order[k] = 1;
    const Jet slope = derivative(table, cells, centre, order);
    value += slope * away[k];
    slopes[k] = slope;
    for (std::size_t l = 0; l < n; ++l) {
      Order second = order;
      ++second[l];
      const Jet bend = over_cells(table, box, [&](const Cells& c, const Box& part) {
        return derivative(table, c, part, second);
      });
      slopes[k] += bend * away[l];
      value += 0.5 * bend * away[k] * away[l];
    }
  }
  for (std::size_t k = 0; k < n; ++k) value += slopes[k] * x[k].change();
  return value;
}

}  // namespace

void check(const LookupTable& table) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("table '{}': {}", table.name, why));
  };
  if (table.at.empty() || table.at.size() > most_arguments)
    refuse(fmt::format("{} arguments; expected 1 to {}", table.at.size(), most_arguments));
  std::size_t count = 1;
  for (const std::vector<double>& at : table.at) {
    if (at.size() < 2) refuse("an argument has fewer than two entries");
    for (std::size_t i = 0; i < at.size(); ++i)
      if (!std::isfinite(at[i]) || (i > 0 && !(at[i] > at[i - 1])))
        refuse("the entries of an argument are not finite and rising");
    count *= at.size();
  }
  if (table.values.size() != count)
    refuse(fmt::format("{} values for {} combinations of entries", table.values.size(), count));
  if (!std::ranges::all_of(table.values, [](double v) { return std::isfinite(v); }))
    refuse("a value is not finite");
}

void refuse(const LookupTable& table, std::size_t argument, double x) {
  const std::vector<double>& at = table.at[argument];
  const std::string which =
      table.at.size() == 1 ? "argument" : fmt::format("argument {}", argument + 1);
  throw std::domain_error(fmt::format("the table '{}' has no value at {} = {}; it covers {} to {}",
                                      table.name, which, x, at.front(), at.back()));
}

Interval range(const LookupTable& table, std::span<const Interval> x) {
  if (!all_covered(table, x)) return Interval::unknown();
  return over_cells(table, x, [&](const Cells& cells, const Box& box) {
    return table.smooth ? of_cubic(table, cells, box) : at_corners(table, cells, box);
  });
}

Jet on_jets(const LookupTable& table, std::span<const Jet> x) {
  std::vector<Interval> box;
  for (const Jet& a : x) box.push_back(a.range());
  if (!all_covered(table, box)) return Interval::unknown();
  return table.smooth ? cubic(table, x, box) : linear(table, x, box);
}

}  // namespace tiltrim::formula
