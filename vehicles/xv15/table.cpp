#include "vehicles/xv15/table.hpp"

#include <fmt/core.h>
#include <fmt/std.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace tiltrim::xv15 {

void Axis::refuse(double x) const {
  throw std::domain_error(fmt::format("the table {} is silent at {:.6g}; it covers {} to {}", name,
                                      x, at.front(), at.back()));
}

void Axis::prepare() {
  if (at.size() < 3) return;
  const std::size_t last = at.size() - 2;
  corners.assign(at.size(), {});
  double closest = at.back() - at.front();
  for (std::size_t k = 1; k <= last; ++k) {
    const double before = at[k] - at[k - 1], after = at[k + 1] - at[k];
    const double width = 0.25 * std::min(before, after);
    const double until = k < last ? at[k] + after / 2 : at.back();
    corners[k] = {at[k], until, width, 1 / width, 0.5 / before, 0.5 / after};
    if (k > 1) closest = std::min(closest, until - corners[k - 1].until);
  }
  // No step holds two borders, so that one comparison finds the entry.
  const double count = std::ceil(2 * (at.back() - at.front()) / closest);
  per_step = count / (at.back() - at.front());
  nearest.clear();
  std::size_t k = 1;
  for (double step = 0; step <= count + 1; ++step) {
    const double x = at.front() + (step - 1e-6) / per_step;
    while (k < last && corners[k].until < x) ++k;
    nearest.push_back(std::uint16_t(k));
  }
}

// Fields of a line; quotes protect commas.
static std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> all(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      all.emplace_back();
    else if (c != '\r')
      all.back() += c;
  }
  return all;
}

Rows read_rows(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line))
    throw std::runtime_error(fmt::format("{}: cannot be read", file.string()));
  const std::vector<std::string> header = fields(line);
  Rows rows;
  while (std::getline(in, line)) {
    if (line.empty()) continue;
    const std::vector<std::string> values = fields(line);
    if (values.size() != header.size())
      throw std::runtime_error(fmt::format("{}:{}: {} fields; expected {}", file.string(),
                                           rows.size() + 2, values.size(), header.size()));
    for (std::size_t j = 0; j < header.size(); ++j) {
      if (j == 0) rows.emplace_back();
      rows.back()[header[j]] = values[j];
    }
  }
  return rows;
}

double number(const Row& row, const std::string& column) {
  const auto found = row.find(column);
  if (found == row.end()) throw std::runtime_error(fmt::format("no column {}", column));
  double value = 0;
  const std::string& text = found->second;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::runtime_error(fmt::format("column {}: '{}' is not a number", column, text));
  return value;
}

Rows with_mach(const Rows& rows) {
  Rows all;
  for (const auto& row : rows)
    for (const char* end : {"mach_lo", "mach_hi"}) {
      if (end == std::string("mach_hi") && row.at("mach_hi") == row.at("mach_lo")) continue;
      all.push_back(row);
      all.back()["mach"] = row.at(end);
    }
  return all;
}

// By pointers: a group at each level would copy its rows.
static Table table_of(const std::string& name, const std::vector<const Row*>& rows,
                      std::span<const std::string> columns, const std::string& value,
                      const std::vector<std::string>& hold) {
  if (rows.empty()) throw std::runtime_error(fmt::format("{}: no rows", name));
  const std::string& column = columns.front();
  std::map<double, std::vector<const Row*>> groups;
  for (const Row* row : rows)
    groups[row->at(column) == "all" ? 0.0 : number(*row, column)].push_back(row);
  Table table;
  table.axis.name = fmt::format("{} over {}", name, column);
  table.axis.hold = std::ranges::find(hold, column) != hold.end();
  for (const auto& [at, group] : groups) {
    table.axis.at.push_back(at);
    if (columns.size() == 1)
      table.values.push_back(number(*group.front(), value));
    else
      table.rows.push_back(table_of(name, group, columns.subspan(1), value, hold));
  }
  // The entry that holds is repeated, so that its corner is rounded too.
  std::vector<double>& at = table.axis.at;
  if (table.axis.hold && at.size() > 1) {
    at.push_back(2 * at.back() - at[at.size() - 2]);
    if (columns.size() == 1)
      table.values.push_back(table.values.back());
    else
      table.rows.push_back(table.rows.back());
  }
  table.axis.prepare();
  return table;
}

Table table_of(const std::string& name, const Rows& rows, std::span<const std::string> columns,
               const std::string& value, const std::vector<std::string>& hold) {
  std::vector<const Row*> all;
  for (const Row& row : rows) all.push_back(&row);
  return table_of(name, all, columns, value, hold);
}

// Linear between entries, without rounded corners: entries of the other table come in between.
static double linear(const std::vector<double>& at, double x, const auto& value) {
  const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, x) - at.begin();
  const auto i = std::size_t(above) - 1;
  const double s = std::min((x - at[i]) / (at[i + 1] - at[i]), 1.0);
  return (1 - s) * value(i) + s * value(i + 1);
}

Pair pair_of(const Table& first, const Table& second) {
  const auto joined = [](std::vector<double> a, const std::vector<double>& b) {
    a.insert(a.end(), b.begin(), b.end());
    std::ranges::sort(a);
    a.erase(std::unique(a.begin(), a.end()), a.end());
    return a;
  };
  Pair pair;
  pair.x = {first.axis.name, joined(first.axis.at, second.axis.at), first.axis.hold, {}, {}, 0};
  for (const Table* table : {&first, &second})
    for (const Table& row : table->rows)
      pair.y = {row.axis.name, joined(pair.y.at, row.axis.at), false, {}, {}, 0};
  for (const double x : pair.x.at)
    for (const double y : pair.y.at) {
      const auto value = [&](const Table& table) {
        return linear(table.axis.at, x, [&](std::size_t i) {
          const Table& row = table.rows[i];
          return linear(row.axis.at, y, [&](std::size_t j) { return row.values[j]; });
        });
      };
      pair.values.push_back({value(first), value(second)});
    }
  pair.prepare();
  return pair;
}

void Pair::prepare() {
  x.prepare();
  y.prepare();
  const std::size_t n = y.at.size();
  // low (before - here) + high (after - here) with the weights of weights(): d times their mean
  // slope and |d| times half of its change.
  const auto basis = [](const Corner& corner, const auto& before, const auto& here,
                        const auto& after) {
    const Eigen::Array2d up = corner.up * (after - here), down = corner.down * (here - before);
    return std::array<Eigen::Array2d, 3>{here, up + down, up - down};
  };
  cells.resize(values.size());
  for (std::size_t i = 1; i + 1 < x.at.size(); ++i)
    for (std::size_t j = 1; j + 1 < n; ++j) {
      std::array<std::array<Eigen::Array2d, 3>, 3> rows;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Array2d* row = &values[(i + k - 1) * n + j];
        rows[k] = basis(y.corners[j], row[-1], row[0], row[1]);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const auto along = basis(x.corners[i], rows[0][k], rows[1][k], rows[2][k]);
        for (std::size_t m = 0; m < 3; ++m)
          for (std::size_t c = 0; c < 2; ++c)
            cells[i * n + j][(m * 3 + k) * 2 + c] = along[m][Eigen::Index(c)];
      }
    }
}

Eigen::Array2d Pair::at(double first, double second) const {
  const Weights<double> by_x = weights(x, first), by_y = weights(y, second);
  Eigen::Array2d sum = Eigen::Array2d::Zero();
  for (std::size_t i = 0; i < by_x.count; ++i)
    for (std::size_t j = 0; j < by_y.count; ++j)
      sum += by_x.w[i] * by_y.w[j] * values[(by_x.first + i) * y.at.size() + by_y.first + j];
  return sum;
}

SectionView Pair::view() const {
  const auto of = [](const Axis& axis) {
    return AxisView{axis.corners.data(), axis.nearest.data(), axis.at.front(),
                    axis.at.back(),      axis.per_step,       axis.hold};
  };
  return {of(x), of(y), cells.data()->data(), y.at.size()};
}

}  // namespace tiltrim::xv15
