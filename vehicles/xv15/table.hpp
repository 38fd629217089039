/// Tables as printed, interpolated linearly as the simulation that they come from does, with the
/// corners rounded so that second derivatives exist.
/// Internal to vehicles/xv15/.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "vehicles/xv15/scalar.hpp"

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

  /// Throws std::domain_error, naming the table, where it is silent.
  void refuse(double x) const;
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
  const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, v);
  const auto i = std::size_t(above - at.begin()) - 1;
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

  /// The value at one scalar for each variable, those from `k` on.
  template <std::size_t k = 0, class S, std::size_t n>
  S operator()(const std::array<S, n>& x) const {
    const Weights<S> by = weights(axis, x[k]);
    S sum(0.0);
    for (std::size_t j = 0; j < by.count; ++j) {
      if constexpr (k + 1 == n)
        sum = sum + by.w[j] * values[by.first + j];
      else if (!vanishes(by.w[j]))
        sum = sum + by.w[j] * rows[by.first + j].template operator()<k + 1>(x);
    }
    return sum;
  }
  template <class S, class... More>
  S at(const S& first, const More&... more) const {
    return (*this)(std::array<S, 1 + sizeof...(More)>{first, S(more)...});
  }
};

/// Two tables over the same two variables, evaluated together.
struct Pair {
  Axis x, y;
  std::vector<std::array<double, 2>> values;  ///< y faster

  struct Sloped {
    std::array<double, 2> value{}, slope_x{}, slope_y{};
  };
  Sloped at(double first, double second) const {
    using Dual1 = DualOf<double, 1>;
    const auto dual = [](double a) { return Dual1(a, Dual1::Slopes::Ones()); };
    const Weights<Dual1> by_x = weights(x, dual(first)), by_y = weights(y, dual(second));
    Sloped sum;
    for (std::size_t i = 0; i < by_x.count; ++i)
      for (std::size_t j = 0; j < by_y.count; ++j) {
        const Dual1 &a = by_x.w[i], &b = by_y.w[j];
        const auto& entry = values[(by_x.first + i) * y.at.size() + by_y.first + j];
        for (std::size_t k = 0; k < 2; ++k) {
          sum.value[k] += a.value * b.value * entry[k];
          sum.slope_x[k] += a.slopes[0] * b.value * entry[k];
          sum.slope_y[k] += a.value * b.slopes[0] * entry[k];
        }
      }
    return sum;
  }
};

/// Both tables on the union of their entries.
Pair pair_of(const Table& first, const Table& second);

/// The rows of a CSV file, each by column name.
using Rows = std::vector<std::map<std::string, std::string>>;
/// Throws std::runtime_error, naming the file.
Rows read_rows(const std::filesystem::path& file);
/// The value of a column. Throws std::runtime_error, naming both, unless it is a number.
double number(const std::map<std::string, std::string>& row, const std::string& column);
/// "mach_lo", "mach_hi" as entries "mach": a band becomes two.
Rows with_mach(const Rows& rows);

/// The table of `value` over `columns`; "all" in a column is a single entry. `hold`: columns whose
/// last entry holds above.
Table table_of(const std::string& name, const Rows& rows, std::span<const std::string> columns,
               const std::string& value, const std::vector<std::string>& hold = {});

}  // namespace tiltrim::xv15
