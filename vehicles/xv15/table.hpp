/// Tables as printed, interpolated linearly as the simulation that they come from does, with the
/// corners rounded so that second derivatives exist.
/// Internal to vehicles/xv15/.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "vehicles/xv15/disc_kernel.hpp"
#include "vehicles/xv15/scalar_functions.hpp"

namespace tiltrim::xv15 {

/// Weights of up to three neighbouring entries.
template <class S>
struct Weights {
  std::size_t first = 0, count = 0;
  std::array<S, 3> w;
};

/// The entries along one variable; a single entry is a constant.
struct Axis {
  std::string name;        ///< "wing_cl over alpha_W_deg", in messages
  std::vector<double> at;  ///< rising
  bool hold = false;       ///< above the last entry its value holds

  std::vector<Corner> corners{};         ///< by entry; of the first and last the neighbour's
  std::vector<std::uint16_t> nearest{};  ///< inner entry at the start of equal steps
  double per_step = 0;

  /// Throws std::domain_error, naming the table, where it is silent.
  [[noreturn]] void refuse(double x) const;
  /// Fills `corners` and `nearest`.
  void prepare();
  /// The last entry but one that is not above x; x lies within the entries.
  std::size_t interval(double x) const {
    std::size_t i = 0;
    if (!nearest.empty()) i = nearest[std::size_t((x - at.front()) * per_step)] - 1u;
    while (i + 2 < at.size() && at[i + 1] <= x) ++i;
    return i;
  }
};

/// Within a quarter of the shorter neighbouring interval of an inner entry, the corner is replaced
/// by the polynomial that continues both lines up to the second derivative. Every entry is met.
template <class S>
Weights<S> weights(const Axis& axis, const S& x) {
  const std::vector<double>& at = axis.at;
  if (at.size() == 1) return {0, 1, {S(1.0)}};
  const double v = real_part(x);
  if (axis.hold && v >= at.back()) return {at.size() - 1, 1, {S(1.0)}};
  if (!(v >= at.front() && v <= at.back())) axis.refuse(v);
  const std::size_t i = axis.interval(v);
  const std::size_t k = v - at[i] < at[i + 1] - v ? i : i + 1;
  if (k > 0 && k + 1 < at.size()) {
    const double before = at[k] - at[k - 1], after = at[k + 1] - at[k];
    const double width = 0.25 * std::min(before, after);
    const S d = x - at[k];
    if (std::abs(v - at[k]) < width) {
      const S g = rounded_kink(d, width);
      const S low = (g - d) * (0.5 / before), high = (g + d) * (0.5 / after);
      return {k - 1, 3, {low, 1.0 - low - high, high}};
    }
  }
  const S s = (x - at[i]) * (1 / (at[i + 1] - at[i]));
  return {i, 2, {1.0 - s, s}};
}

/// A table over several variables, the first slowest. Its rows may have entries of their own.
struct Table {
  Axis axis;
  std::vector<double> values;  ///< over the last variable
  std::vector<Table> rows;     ///< over the others

  /// The value over the variables from `k` on; and with its slopes.
  template <std::size_t k, std::size_t n>
  double value(const std::array<double, n>& x) const {
    const Weights<double> by = weights(axis, x[k]);
    double sum = 0;
    for (std::size_t j = 0; j < by.count; ++j) {
      if constexpr (k + 1 == n)
        sum += by.w[j] * values[by.first + j];
      else if (by.w[j] != 0)
        sum += by.w[j] * rows[by.first + j].template value<k + 1>(x);
    }
    return sum;
  }
  template <std::size_t k, std::size_t n>
  double sloped(const std::array<double, n>& x, const std::array<bool, n>& moves,
                std::array<double, n>& slopes) const {
    using Dual1 = DualOf<double, 1>;
    // Rows without a share of value or slope may be silent here.
    const Weights<Dual1> by = weights(axis, Dual1(x[k], Dual1::Slopes::Constant(moves[k] ? 1 : 0)));
    double sum = 0;
    slopes[k] = 0;
    std::array<double, n> inner{};
    for (std::size_t j = k + 1; j < n; ++j) slopes[j] = 0;
    for (std::size_t j = 0; j < by.count; ++j) {
      const Dual1& w = by.w[j];
      if (vanishes(w)) continue;
      double value;
      if constexpr (k + 1 == n)
        value = values[by.first + j];
      else
        value = rows[by.first + j].template sloped<k + 1>(x, moves, inner);
      sum += w.value * value;
      slopes[k] += w.slopes[0] * value;
      for (std::size_t i = k + 1; i < n; ++i) slopes[i] += w.value * inner[i];
    }
    return sum;
  }

  /// The value at one scalar for each variable, exact to first order.
  template <class S, std::size_t n>
  S operator()(const std::array<S, n>& x) const {
    std::array<double, n> at;
    for (std::size_t i = 0; i < n; ++i) at[i] = real_part(x[i]);
    if constexpr (without_slopes<S>) {
      return S(value<0>(at));
    } else {
      std::array<double, n> slopes{};
      std::array<bool, n> moves;
      for (std::size_t i = 0; i < n; ++i) moves[i] = !vanishes(S(x[i] - at[i]));
      S sum(sloped<0>(at, moves, slopes));
      for (std::size_t i = 0; i < n; ++i)
        if (moves[i]) sum = sum + slopes[i] * (x[i] - at[i]);
      return sum;
    }
  }
  template <class S, class... More>
  S at(const S& first, const More&... more) const {
    return (*this)(std::array<S, 1 + sizeof...(More)>{first, S(more)...});
  }
};

/// Two tables over the same two variables, evaluated together.
struct Pair {
  Axis x, y;
  std::vector<Eigen::Array2d> values;  ///< y faster
  /// Of each inner entry, the values as a polynomial: of 1, the distance d from the entry and |d|
  /// with its rounded kink, along both variables.
  std::vector<std::array<double, 18>> cells{};

  /// Fills `cells`; both axes have at least three entries.
  void prepare();
  Eigen::Array2d at(double first, double second) const;
  SectionView view() const;
};

/// Both tables on the union of their entries.
Pair pair_of(const Table& first, const Table& second);

/// The rows of a CSV file, each by column name.
using Row = std::map<std::string, std::string>;
using Rows = std::vector<Row>;
/// Throws std::runtime_error, naming the file.
Rows read_rows(const std::filesystem::path& file);
/// The value of a column. Throws std::runtime_error, naming both, unless it is a number.
double number(const Row& row, const std::string& column);
/// "mach_lo", "mach_hi" as entries "mach": a band becomes two.
Rows with_mach(const Rows& rows);

/// The table of `value` over `columns`; "all" in a column is a single entry. `hold`: columns whose
/// last entry holds above.
Table table_of(const std::string& name, const Rows& rows, std::span<const std::string> columns,
               const std::string& value, const std::vector<std::string>& hold = {});

}  // namespace tiltrim::xv15
