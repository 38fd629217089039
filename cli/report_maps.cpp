#include "cli/report_maps.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <complex>
#include <set>

#include "study/axes.hpp"
#include "study/problems.hpp"
#include "study/section.hpp"
#include "sweep/map.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim::cli {

namespace fs = std::filesystem;

bool has_closed_loop(const Study& study) {
  return !study.user_model && study.vehicle.equations == Equations::consistent &&
         std::ranges::any_of(study.conditions,
                             [](const Condition& c) { return bool(c.command()); });
}

namespace {

// ---- Which maps ---------------------------------------------------------------------------------

std::vector<ReportTable::Map> asked_maps(const Study& study) {
  if (study.report && !study.report->maps.empty()) return study.report->maps;
  if (study.sweep && study.sweep->axes.size() <= 2) return {{"", *study.sweep}};
  return {};
}

// Of closed loops: the corridor, and a gain over the corridor.
std::vector<ReportTable::Map> default_maps(const Study& study) {
  const auto heights = [](std::size_t count) { return spaced(0, 120, count); };
  std::vector<ReportTable::Map> maps{{"", {{corridor_axis(heights(481), study.schedule)}}}};
  if (!study.schedule.eta.empty()) return maps;  // a scheduled gain cannot be an axis
  const SweepAxis gain{"K_Lp", {column_of(study_key("gains.K_Lp"), spaced(0.05, 5, 101, true))}};
  maps.push_back({"", {{corridor_axis(heights(121), {}), gain}}});
  return maps;
}

bool along_corridor(const SweepTable& grid) {
  return std::ranges::any_of(grid.axes,
                             [](const SweepAxis& a) { return a.columns.front().signal.empty(); });
}

// A sweep takes conditions of one formulation.
struct Wanted {
  SweepTable grid;
  std::vector<Condition> conditions;
  bool only_formulation = true;  // of the map
};

// The corridor sets everything that a closed-loop condition gives, hence makes them equal.
std::vector<Wanted> by_formulation(const ReportTable::Map& map, const std::vector<Condition>& all) {
  std::vector<Condition> closed, others;
  for (const Condition& c : all) {
    const bool named = c.name == map.condition;
    if (!map.condition.empty() && !named) continue;
    if (c.command())
      closed.push_back(c);
    else if (!c.table() || named)
      others.push_back(c);
  }
  if (map.condition.empty() && along_corridor(map.grid) && !closed.empty()) closed.resize(1);
  std::vector<Wanted> wanted;
  for (const auto& conditions : {closed, others})
    if (!conditions.empty())
      wanted.push_back({map.grid, conditions, closed.empty() || others.empty()});
  return wanted;
}

std::vector<Wanted> wanted_maps(const Study& study, const std::vector<Condition>& all) {
  std::vector<ReportTable::Map> maps = asked_maps(study);
  std::vector<Condition> of = all;
  if (maps.empty() && has_closed_loop(study)) {
    maps = default_maps(study);
    std::erase_if(of, [](const Condition& c) { return !c.command(); });
  }
  std::vector<Wanted> wanted;
  for (const ReportTable::Map& map : maps)
    for (Wanted& one : by_formulation(map, of)) wanted.push_back(std::move(one));
  return wanted;
}

// ---- Precomputed maps ---------------------------------------------------------------------------

// The signals that a map's axes set: two studies may differ in them.
std::set<std::string> signals_of(const SweepMap& map) {
  std::set<std::string> signals;
  for (const SweepAxis& axis : map.axes)
    for (const SweepAxis::Column& column : axis.columns) signals.insert(column.signal);
  return signals;
}

bool equal(const Range& r, const Range& s) { return r.lower == s.lower && r.upper == s.upper; }

bool fixed(const Range& r) { return r.lower == r.upper; }

using Names = std::vector<std::string>;

Names differences(const Command& a, const Command& b, const std::set<std::string>& set) {
  Names found;
  if (a.V != b.V && !set.contains("V")) found.emplace_back("V");
  if (a.gamma != b.gamma && !set.contains("gamma")) found.emplace_back("gamma_deg");
  if (a.eta != b.eta && !set.contains("eta")) found.emplace_back("eta_deg");
  return found;
}

Names differences(const AirframeCondition& a, const AirframeCondition& b,
                  const std::set<std::string>& set) {
  Names found;
  std::set<std::string> given;
  for (const auto& values : {a.values, b.values})
    for (const auto& [name, range] : values) given.insert(name);
  for (const std::string& name : given) {
    const auto in_a = a.values.find(name), in_b = b.values.find(name);
    const bool both = in_a != a.values.end() && in_b != b.values.end();
    if (both && equal(in_a->second, in_b->second)) continue;
    if (both && set.contains(name) && fixed(in_a->second) && fixed(in_b->second)) continue;
    found.push_back(name);
  }
  if (a.rates != b.rates) found.emplace_back("rates");
  const auto same = [](const CostTerm& s, const CostTerm& t) {
    return s.signal == t.signal && s.scale == t.scale && s.reference == t.reference;
  };
  if (!std::ranges::equal(a.effort, b.effort, same)) found.emplace_back("effort");
  return found;
}

// Of the map's conditions, in the study that it was computed from and in this one.
void add_conditions(const Study& a, const Study& b, const SweepMap& map, Names& found) {
  const std::set<std::string> set = signals_of(map);
  for (const std::string& name : map.conditions) {
    const auto c = std::ranges::find(a.conditions, name, &Condition::name),
               d = std::ranges::find(b.conditions, name, &Condition::name);
    if (c == a.conditions.end() || d == b.conditions.end()) {
      found.push_back(fmt::format("condition '{}', which only the map has", name));
      continue;
    }
    Names differ;
    if (formulation_of(*c) != formulation_of(*d))
      differ = {"formulation"};
    else if (c->command())
      differ = differences(*c->command(), *d->command(), set);
    else if (c->airframe())
      differ = differences(*c->airframe(), *d->airframe(), set);
    for (const std::string& what : differ)
      found.push_back(fmt::format("{} of condition '{}'", what, name));
  }
}

void add_numbers(const Study& a, const Study& b, const SweepMap& map, Names& found) {
  const std::set<std::string> set = signals_of(map);
  const TrimProblem p = closed_loop_problem(a.vehicle, {}), q = closed_loop_problem(b.vehicle, {});
  for (std::size_t i = 0; i < p.model.parameters.size(); ++i)
    if (p.guess.p[Eigen::Index(i)] != q.guess.p[Eigen::Index(i)] &&
        !set.contains(p.model.parameters[i].name))
      found.push_back(p.model.parameters[i].name);
}

// Without exception: scheduled gains are columns of an axis over tilt, but their values come from
// here.
void add_schedule(const GainSchedule& a, const GainSchedule& b, Names& found) {
  if (a.eta != b.eta) {
    found.emplace_back("gains.schedule_eta_deg");
    return;
  }
  const Names gains = names(gain_signals());
  for (std::size_t j = 0; j < gains.size(); ++j) {
    const auto same = [j](Gains s, Gains t) { return gain_value(s, j) == gain_value(t, j); };
    if (!std::ranges::equal(a.gains, b.gains, same)) found.push_back(gains[j]);
  }
}

void add_limits(const Limits& a, const Limits& b, Names& found) {
  if (!equal(a.theta0, b.theta0)) found.emplace_back("limits.theta0");
  if (!equal(a.a1s, b.a1s)) found.emplace_back("limits.a1s_deg");
  if (!equal(a.delta_e, b.delta_e)) found.emplace_back("limits.delta_e_deg");
  if (!equal(a.theta, b.theta)) found.emplace_back("limits.theta_deg");
}

// What determines a map of study `b` and is another in `a`, except what the map's axes set.
Names differences(const Study& a, const Study& b, const SweepMap& map) {
  if (a.user_model || b.user_model) return a.text == b.text ? Names{} : Names{"their texts"};
  Names found;
  add_numbers(a, b, map, found);
  add_schedule(a.schedule, b.schedule, found);
  add_limits(a.vehicle.limits, b.vehicle.limits, found);
  if (a.vehicle.equations != b.vehicle.equations) found.emplace_back("equations");
  if (map.polar.empty())
    found.emplace_back("aircraft.polar, perhaps: the map has no checksum of it, sweep it again");
  else if (map.polar != polar_checksum(a))
    found.emplace_back("the numbers of aircraft.polar");
  add_conditions(a, b, map, found);
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

// ---- Computed maps ------------------------------------------------------------------------------

bool same_axis(const SweepAxis& a, const SweepAxis& b) {
  return std::ranges::equal(a.columns, b.columns,
                            [](const SweepAxis::Column& c, const SweepAxis::Column& d) {
                              return c.name == d.name && c.values == d.values;
                            });
}

// Whether the map has all that is wanted of the condition: a map over other points does not.
bool covers(const SweepMap& map, const SweepTable& grid, const Condition& condition) {
  return std::ranges::equal(map.axes, grid.axes, same_axis) &&
         std::ranges::count(map.conditions, condition.name) > 0 &&
         (!grid.crossings || !map.intervals.empty());
}

std::string in_words(const Wanted& wanted) {
  Names axes, of;
  for (const SweepAxis& axis : wanted.grid.axes) axes.push_back(axis.name);
  for (const Condition& c : wanted.conditions) of.push_back(c.name);
  return fmt::format("map over {}{}", fmt::join(axes, " and "),
                     wanted.only_formulation ? "" : fmt::format(" of {}", fmt::join(of, ", ")));
}

// Does an eigenvalue of any condition move by more than a share of itself between points i, i + 1?
bool moves(const SweepMap& map, std::size_t i) {
  constexpr double share = 0.03;
  const std::size_t n = map.modes(), points = map.axes[0].size();
  for (std::size_t c = 0; c < map.conditions.size(); ++c)
    for (std::size_t k = (c * points + i) * n; k < (c * points + i + 1) * n; ++k) {
      const std::complex<double> from(map.eigenvalue_re[k], map.eigenvalue_im[k]),
          to(map.eigenvalue_re[k + n], map.eigenvalue_im[k + n]);
      if (std::abs(to - from) > share * std::abs(from)) return true;
    }
  return false;
}

// The axis and, where an eigenvalue moves, the middle between two of its points.
SweepAxis with_middles(const SweepMap& map, const SweepAxis& axis) {
  SweepAxis all = axis;
  for (SweepAxis::Column& c : all.columns) c.values.clear(), c.si.clear();
  for (std::size_t i = 0; i < axis.size(); ++i) {
    for (std::size_t c = 0; c < axis.columns.size(); ++c) {
      all.columns[c].values.push_back(axis.columns[c].values[i]);
      all.columns[c].si.push_back(axis.columns[c].si[i]);
    }
    if (i + 1 == axis.size() || !moves(map, i)) continue;
    std::vector<double> middle;
    for (const SweepAxis::Column& c : axis.columns) middle.push_back(0.5 * (c.si[i] + c.si[i + 1]));
    if (axis.between) axis.between(middle);
    for (std::size_t c = 0; c < middle.size(); ++c) {
      all.columns[c].si.push_back(middle[c]);
      all.columns[c].values.push_back(
          c == 0 ? 0.5 * (axis.columns[c].values[i] + axis.columns[c].values[i + 1])
                 : middle[c] / reading::in_si(1.0, all.columns[c].unit));
    }
  }
  return all;
}

// A line of a report has more points where the eigenvalues move quickly, unless it is logarithmic,
// has many, or a tenth of it has no trim.
SweepMap swept_line(const Study& study, const std::vector<Condition>& conditions,
                    const SweepTable& grid, const SweepOptions& options) {
  constexpr int rounds = 2;
  constexpr std::size_t most = 10'000;  // points
  SweepMap map = swept(study, conditions, grid, options);
  SweepAxis axis = grid.axes.front();
  const std::vector<double>& v = axis.columns.front().values;
  const bool even = v.size() > 2 && std::abs(v[2] - 2 * v[1] + v[0]) < 1e-6 * std::abs(v[1] - v[0]);
  // A point without a trim takes as long as a hundred others.
  const auto holes = std::ranges::count_if(map.verdict, [](auto verdict) { return verdict < 0; });
  const bool trimmed = 10 * std::size_t(holes) <= map.verdict.size();
  for (int k = 0; k < rounds && even && trimmed && axis.size() <= most; ++k) {
    axis = with_middles(map, axis);
    map = swept(study, conditions, {{axis}}, options);
  }
  return map;
}

SweepMap computed(const Study& study, const Wanted& wanted, const SweepOptions& options) {
  return wanted.grid.axes.size() == 1 ? swept_line(study, wanted.conditions, wanted.grid, options)
                                      : swept(study, wanted.conditions, wanted.grid, options);
}

}  // namespace

StudyReport::Map map_in(const fs::path& file, const Study& study) {
  SweepMap map = read_netcdf(file);
  if (map.axes.empty() || map.axes.size() > 2)
    throw std::runtime_error(
        fmt::format("{}: a map over {} axes cannot be plotted; expected one or two", file.string(),
                    map.axes.size()));
  Names differ;
  try {
    differ = differences(study, parse_study(map.study, study.file), map);
  } catch (const StudyError& e) {
    throw std::runtime_error(fmt::format(
        "{}: the study that it was computed from cannot be read: {}", file.string(), e.what()));
  }
  if (!differ.empty())
    throw std::runtime_error(
        fmt::format("{}: computed from another study than {}: they differ in {}; expected a map of "
                    "this study, or no map",
                    file.string(), study.file.string(), fmt::join(differ, ", ")));
  return {std::move(map), file.filename().string()};
}

void add_maps(const ReportCommand& command, const std::stop_token& stop, StudyReport& report) {
  const Study& study = report.study;
  const std::vector<StudyReport::Map> files = report.maps;
  SweepOptions options;
  options.threads = command.threads;
  options.stop = stop;
  for (Wanted& wanted : wanted_maps(study, chosen(study, command.common.only))) {
    std::erase_if(wanted.conditions, [&](const Condition& c) {
      return std::ranges::any_of(
          files, [&](const StudyReport::Map& m) { return covers(m.map, wanted.grid, c); });
    });
    if (wanted.conditions.empty()) continue;
    if (stop.stop_requested()) {
      report.not_examined.push_back("the " + in_words(wanted));
      continue;
    }
    try {
      report.maps.push_back({computed(study, wanted, options), ""});
    } catch (const SweepInterrupted&) {
      report.not_examined.push_back("the " + in_words(wanted));
    } catch (const StudyError& e) {
      if (wanted.only_formulation) throw;
      report.not_swept.push_back({"The " + in_words(wanted), e.what()});
    }
  }
}

}  // namespace tiltrim::cli
