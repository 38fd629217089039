/// Look-up tables of formulas on any scalar. Internal to model/.
///
/// Between its entries a table is linear along each argument or, if it is smooth, a cubic with the
/// entries' values and, as its slope there, that of the parabola through three neighbours [105].
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "model/formulas.hpp"
#include "model/jet.hpp"

namespace tiltrim::formula {

inline constexpr std::size_t most_arguments = 3;

/// Throws std::invalid_argument unless the table has one to three arguments, each with at least two
/// rising entries, and one finite value for each combination of them.
void check(const LookupTable& table);

/// Whether the table has values over all of [lower, upper] of this argument: rounding may put a
/// number just outside the entries.
inline bool covers(const LookupTable& table, std::size_t argument, double lower, double upper) {
  const std::vector<double>& at = table.at[argument];
  const double margin = 1e-9 * (at.back() - at.front());
  return lower >= at.front() - margin && upper <= at.back() + margin;
}
/// Throws std::domain_error, which names the table and what it covers.
[[noreturn]] void refuse(const LookupTable& table, std::size_t argument, double x);

/// The last entry but one that is not above x; the first if all are.
inline std::size_t cell(const std::vector<double>& at, double x) {
  const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, x);
  return std::size_t(above - at.begin()) - 1;
}

/// The shares of up to four neighbouring entries in a value, with their first and second
/// derivatives.
template <class T>
struct Shares {
  std::size_t first = 0, count = 2;
  std::array<std::array<T, 4>, 3> of{};
};

/// The slope at entry j of the parabola through entries `first` to first + 2, by their values.
template <class T>
std::array<T, 3> parabola_slope(const std::vector<double>& at, std::size_t first, std::size_t j) {
  const auto gap = [&](std::size_t a, std::size_t b) { return T(at[a]) - T(at[b]); };
  std::array<T, 3> c;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = first + (k + 1) % 3, m = first + (k + 2) % 3;
    c[k] = (gap(j, l) + gap(j, m)) / (gap(first + k, l) * gap(first + k, m));
  }
  return c;
}

/// Within cell i, between entries i and i + 1.
template <class T>
Shares<T> linear_shares(const std::vector<double>& at, std::size_t i, const T& x) {
  const T width = T(at[i + 1]) - T(at[i]), t = (x - T(at[i])) / width;
  Shares<T> s{i};
  s.of[0] = {T(1.0) - t, t};
  s.of[1] = {T(-1.0) / width, T(1.0) / width};
  return s;
}

/// The Hermite cubic of cell i; its ends' slopes are those of parabolas.
template <class T>
Shares<T> cubic_shares(const std::vector<double>& at, std::size_t i, const T& x) {
  const std::size_t n = at.size();
  if (n == 2) return linear_shares(at, i, x);
  const T width = T(at[i + 1]) - T(at[i]), t = (x - T(at[i])) / width, r = T(1.0) - t;
  // By order of the derivative: of the right value, and of the slopes at both ends.
  const std::array<T, 3> value{t * t * (T(3.0) - T(2.0) * t), T(6.0) * t * r / width,
                               (T(6.0) - T(12.0) * t) / (width * width)};
  const std::array<T, 3> left{width * t * r * r, r * (T(1.0) - T(3.0) * t),
                              (T(6.0) * t - T(4.0)) / width};
  const std::array<T, 3> right{-(width * t * t * r), t * (T(3.0) * t - T(2.0)),
                               (T(6.0) * t - T(2.0)) / width};
  Shares<T> s;
  s.first = i > 0 ? i - 1 : 0;
  s.count = std::min(n - 1, i + 2) - s.first + 1;
  for (std::size_t order = 0; order < 3; ++order) {
    s.of[order].fill(T(0.0));
    s.of[order][i - s.first] = (order == 0 ? T(1.0) : T(0.0)) - value[order];
    s.of[order][i + 1 - s.first] = value[order];
  }
  for (const std::size_t j : {i, i + 1}) {
    const std::size_t from = std::min(j > 0 ? j - 1 : 0, n - 3);
    const std::array<T, 3> slope = parabola_slope<T>(at, from, j);
    for (std::size_t order = 0; order < 3; ++order)
      for (std::size_t k = 0; k < 3; ++k)
        s.of[order][from + k - s.first] += (j == i ? left : right)[order] * slope[k];
  }
  return s;
}

/// In these cells, one per argument.
template <class T>
std::array<Shares<T>, most_arguments> shares(const LookupTable& table,
                                             std::span<const std::size_t> cells,
                                             std::span<const T> x) {
  std::array<Shares<T>, most_arguments> all;
  for (std::size_t k = 0; k < x.size(); ++k)
    all[k] = table.smooth ? cubic_shares(table.at[k], cells[k], x[k])
                          : linear_shares(table.at[k], cells[k], x[k]);
  return all;
}

inline constexpr std::size_t no_row = std::size_t(-1);

/// The derivative of this order along each argument; of order 0, of what exceeds `reference`, so
/// that ranges of the shares, whose sum is known, cost little. Shares of a slope sum to zero: they
/// multiply differences of entries, so that rounding of equal ones leaves nothing. Those are of
/// `row` less `base`.
template <class T, std::size_t argument = 0>
T combined(const LookupTable& table, const std::array<Shares<T>, most_arguments>& by,
           const std::array<int, most_arguments>& order, double reference, std::size_t row = 0,
           std::size_t base = no_row) {
  const Shares<T>& s = by[argument];
  const std::array<T, 4>& share = s.of[std::size_t(order[argument])];
  const std::size_t from = row * table.at[argument].size() + s.first;
  const bool differs = base == no_row && order[argument] > 0;
  const auto less = [&](std::size_t k) {
    return differs          ? from
           : base == no_row ? no_row
                            : base * table.at[argument].size() + s.first + k;
  };
  T sum(0.0);
  for (std::size_t k = 0; k < s.count; ++k)
    if (argument + 1 == table.at.size())
      sum += share[k] *
             (T(table.values[from + k]) - T(less(k) == no_row ? reference : table.values[less(k)]));
    else if constexpr (argument + 1 < most_arguments)
      sum += share[k] * combined<T, argument + 1>(table, by, order, reference, from + k, less(k));
  return sum;
}

/// The entry at the lower corner of the cells.
inline double corner(const LookupTable& table, std::span<const std::size_t> cells) {
  std::size_t row = 0;
  for (std::size_t k = 0; k < table.at.size(); ++k) row = row * table.at[k].size() + cells[k];
  return table.values[row];
}

/// The value at one scalar for each argument. Throws std::domain_error outside the entries;
/// `doubtful` is set at a kink.
template <class S>
S at(const LookupTable& table, const S* x, bool& doubtful) {
  constexpr bool plain = std::is_floating_point_v<S>;
  using T = decltype([](const S& a) {
    if constexpr (plain)
      return a;
    else
      return a.value;
  }(S(0)));
  const std::size_t n = table.at.size();
  std::array<T, most_arguments> v{};
  std::array<std::size_t, most_arguments> cells{};
  for (std::size_t k = 0; k < n; ++k) {
    if constexpr (plain)
      v[k] = x[k];
    else
      v[k] = x[k].value;
    if (std::isnan(v[k])) return x[k];
    if (!covers(table, k, double(v[k]), double(v[k]))) refuse(table, k, double(v[k]));
    cells[k] = cell(table.at[k], double(v[k]));
  }
  const auto by = shares<T>(table, cells, std::span<const T>(v.data(), n));
  std::array<int, most_arguments> order{};
  const double reference = corner(table, cells);
  S sum(T(reference) + combined<T>(table, by, order, reference));
  if constexpr (!plain)
    for (std::size_t k = 0; k < n; ++k) {
      if (!(x[k].slopes != 0).any()) continue;
      const bool entry = cells[k] > 0 && v[k] == table.at[k][cells[k]];
      doubtful = doubtful || (entry && !table.smooth);
      order[k] = 1;
      sum.slopes += combined<T>(table, by, order, reference) * x[k].slopes;
      order[k] = 0;
    }
  return sum;
}

/// What contains the values over these ranges; NaN if it cannot be determined.
Interval range(const LookupTable& table, std::span<const Interval> x);
/// With derivatives; not known outside the entries, and at a kink that unknowns may cross.
Jet on_jets(const LookupTable& table, std::span<const Jet> x);

}  // namespace tiltrim::formula
