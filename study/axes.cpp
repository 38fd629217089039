#include "study/axes.hpp"

#include <algorithm>
#include <cmath>

#include "study/section.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

std::vector<double> spaced(double from, double to, std::size_t count, bool logarithmic) {
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double share = double(i) / double(count - 1);
    values[i] = logarithmic ? from * std::pow(to / from, share) : from + share * (to - from);
  }
  values.front() = from;
  values.back() = to;
  return values;
}

SweepAxis::Column column_of(const Key& key, const std::vector<double>& values) {
  SweepAxis::Column column{key.name, key.unit, key.signal, values, {}};
  for (const double value : values) column.si.push_back(key.in_si(value));
  return column;
}

Key height_key() { return {"h", "", "m", {-1e6, 1e6}}; }

void add_corridor(SweepAxis& axis) {
  SweepAxis::Column V{"V", "m/s", "V", {}, {}}, gamma{"gamma_deg", "degrees", "gamma", {}, {}},
      eta{"eta_deg", "degrees", "eta", {}, {}};
  const auto add = [](SweepAxis::Column& column, double si) {
    column.si.push_back(si);
    column.values.push_back(si / reading::in_si(1.0, column.unit));
  };
  for (const double h : axis.columns.front().values) {
    const Command command = corridor(h);
    add(V, command.V);
    add(gamma, command.gamma);
    add(eta, command.eta);
  }
  axis.columns.insert(axis.columns.end(), {V, gamma, eta});
  axis.between = [](std::vector<double>& columns) {
    const Command command = corridor(columns[0]);
    columns[1] = command.V;
    columns[2] = command.gamma;
    columns[3] = command.eta;
  };
}

void add_schedule(const GainSchedule& schedule, SweepAxis& axis) {
  const auto tilt = std::ranges::find(axis.columns, "eta", &SweepAxis::Column::signal);
  if (schedule.eta.empty() || tilt == axis.columns.end()) return;
  const auto at = std::size_t(tilt - axis.columns.begin()), first = axis.columns.size();
  const std::vector<double> tilts = tilt->si;
  const std::vector<Key> keys = number_keys(gain_signals());
  for (std::size_t j = 0; j < keys.size(); ++j) {
    SweepAxis::Column column{keys[j].name, keys[j].unit, keys[j].signal, {}, {}};
    for (const double eta : tilts) {
      Gains gains = gains_at(schedule, eta);
      column.si.push_back(gain_value(gains, j));
      column.values.push_back(keys[j].in_study(column.si.back()));
    }
    axis.columns.push_back(column);
  }
  axis.between = [=, corridor = axis.between](std::vector<double>& columns) {
    if (corridor) corridor(columns);
    Gains gains = gains_at(schedule, columns[at]);
    for (std::size_t j = 0; first + j < columns.size(); ++j)
      columns[first + j] = gain_value(gains, j);
  };
}

SweepAxis corridor_axis(const std::vector<double>& heights, const GainSchedule& schedule) {
  SweepAxis axis{"h", {column_of(height_key(), heights)}};
  add_corridor(axis);
  add_schedule(schedule, axis);
  return axis;
}

}  // namespace tiltrim
