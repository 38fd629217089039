// tiltrim report: all results of a study, computed unless given, on one page.
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <complex>
#include <fstream>
#include <iterator>

#include "cli/commands.hpp"
#include "cli/gnuplot.hpp"
#include "cli/terminal.hpp"
#include "report/study_report.hpp"
#include "study/axes.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/section.hpp"
#include "sweep/map.hpp"
#include "tables/tables.hpp"

namespace tiltrim::cli {

namespace {

namespace fs = std::filesystem;

// ---- Which maps ---------------------------------------------------------------------------------

// The printed equations do not describe flight, and no gain stabilizes them: only their conditions
// are reported.
bool has_closed_loop(const Study& study) {
  return !study.user_model && study.vehicle.equations == Equations::consistent &&
         std::ranges::any_of(study.conditions,
                             [](const Condition& c) { return bool(c.command()); });
}

// Default maps: the corridor, and a gain over the corridor.
std::vector<ReportTable::Map> maps_of(const Study& study) {
  if (study.report && !study.report->maps.empty()) return study.report->maps;
  if (study.sweep && study.sweep->axes.size() <= 2) return {{"", *study.sweep}};
  if (!has_closed_loop(study)) return {};
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

// A map has conditions of one formulation; the corridor makes all conditions equal.
std::vector<Condition> conditions_of(const ReportTable::Map& map,
                                     const std::vector<Condition>& all) {
  std::vector<Condition> closed, airframe;
  for (const Condition& c : all) {
    if (!map.condition.empty() && c.name != map.condition) continue;
    if (c.command())
      closed.push_back(c);
    else if (!c.table())
      airframe.push_back(c);
  }
  std::vector<Condition> chosen = closed.empty() ? airframe : closed;
  if (map.condition.empty() && along_corridor(map.grid) && !chosen.empty()) chosen.resize(1);
  return chosen;
}

// ---- Precomputed maps ---------------------------------------------------------------------------

// Parameters, limits and polar in which two studies differ, except those set by the map's axes.
std::vector<std::string> differences(const Study& a, const Study& b, const SweepMap& map) {
  const auto is_axis = [&](const std::string& signal) {
    return std::ranges::any_of(map.axes, [&](const SweepAxis& axis) {
      return std::ranges::any_of(axis.columns,
                                 [&](const SweepAxis::Column& c) { return c.signal == signal; });
    });
  };
  std::vector<std::string> found;
  if (a.user_model || b.user_model) {
    if (a.text != b.text) found.emplace_back("their texts");
    return found;
  }
  const Command any{};
  const TrimProblem p = closed_loop_problem(a.vehicle, any),
                    q = closed_loop_problem(b.vehicle, any);
  for (std::size_t i = 0; i < p.model.parameters.size(); ++i)
    if (p.guess.p[Eigen::Index(i)] != q.guess.p[Eigen::Index(i)] &&
        !is_axis(p.model.parameters[i].name))
      found.push_back(p.model.parameters[i].name);
  const auto limit = [&](const char* name, const Range& r, const Range& s) {
    if (r.lower != s.lower || r.upper != s.upper) found.push_back(std::string("limits.") + name);
  };
  limit("theta0", a.vehicle.limits.theta0, b.vehicle.limits.theta0);
  limit("a1s_deg", a.vehicle.limits.a1s, b.vehicle.limits.a1s);
  limit("delta_e_deg", a.vehicle.limits.delta_e, b.vehicle.limits.delta_e);
  limit("theta_deg", a.vehicle.limits.theta, b.vehicle.limits.theta);
  if (a.vehicle.equations != b.vehicle.equations) found.emplace_back("equations");
  if (a.polar_name != b.polar_name) found.emplace_back("aircraft.polar");
  return found;
}

StudyReport::Map given(const fs::path& file, const Study& study) {
  SweepMap map = read_netcdf(file);
  if (map.axes.empty() || map.axes.size() > 2)
    throw std::runtime_error(
        fmt::format("{}: a map over {} axes cannot be plotted; expected one or two", file.string(),
                    map.axes.size()));
  std::vector<std::string> differ;
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

bool same_axes(const SweepMap& map, const SweepTable& grid) {
  return std::ranges::equal(map.axes, grid.axes, {}, &SweepAxis::name, &SweepAxis::name);
}

std::string in_words(const ReportTable::Map& map) {
  std::string axes;
  for (const SweepAxis& axis : map.grid.axes) axes += (axes.empty() ? "" : " and ") + axis.name;
  return "the map over " + axes;
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

void add_maps(const ReportCommand& command, const std::stop_token& stop, StudyReport& report) {
  const Study& study = report.study;
  const std::size_t files = report.maps.size();
  const std::vector<Condition> all = chosen(study, command.common.only);
  for (const ReportTable::Map& map : maps_of(study)) {
    const bool there =
        std::any_of(report.maps.begin(), report.maps.begin() + std::ptrdiff_t(files),
                    [&](const StudyReport::Map& m) { return same_axes(m.map, map.grid); });
    const std::vector<Condition> conditions = conditions_of(map, all);
    if (there || conditions.empty()) continue;
    if (stop.stop_requested()) {
      report.not_examined.push_back(in_words(map));
      continue;
    }
    SweepOptions options;
    options.threads = command.threads;
    options.stop = stop;
    try {
      const bool line = map.grid.axes.size() == 1;
      report.maps.push_back({line ? swept_line(study, conditions, map.grid, options)
                                  : swept(study, conditions, map.grid, options),
                             ""});
    } catch (const SweepInterrupted&) {
      report.not_examined.push_back(in_words(map));
    }
  }
}

// ---- The rest -----------------------------------------------------------------------------------

// Tables 1-3 are for the paper's aircraft.
bool wants_audit(const Study& study) {
  if (study.user_model) return false;
  if (study.report && study.report->audit) return *study.report->audit;
  const Vehicle reference = reference_vehicle();
  const TrimProblem p = closed_loop_problem(study.vehicle, {}),
                    q = closed_loop_problem(reference, {});
  for (std::size_t i = 0; i < p.model.parameters.size(); ++i)
    if (!p.model.parameters[i].name.starts_with("gains.") &&
        p.guess.p[Eigen::Index(i)] != q.guess.p[Eigen::Index(i)])
      return false;
  return true;
}

bool wants_flight(const Study& study) {
  return has_closed_loop(study) && (!study.report || study.report->flight.value_or(true));
}

// Conditions that the study's [prove] can be about.
std::vector<std::string> provable(const Study& study, const std::vector<std::string>& only) {
  std::vector<std::string> all;
  if (!study.prove || (!study.user_model && !has_closed_loop(study))) return all;
  for (const Condition& condition : chosen(study, only)) {
    if (!condition.user() && !condition.command()) continue;
    try {
      (void)prove_problem(study, condition);
      all.push_back(condition.name);
    } catch (const StudyError&) {  // `prove` reports why
    }
  }
  return all;
}

StudyReport computed(const Study& study, const ReportCommand& command,
                     const std::stop_token& stop) {
  StudyReport report{study, "tiltrim " TILTRIM_VERSION, {}, {}, {}, {}, {}, {}, {}};
  for (const fs::path& file : command.sweeps) report.maps.push_back(given(file, study));
  TrimOptions trimming;
  trimming.stop = stop;
  trimming.time_limit = study.time_limit;
  // After an interrupt, analyses are skipped and listed.
  const auto examined = [&](bool wanted, const std::string& what) {
    if (wanted && stop.stop_requested()) report.not_examined.push_back(what);
    return wanted && !stop.stop_requested();
  };
  for_each(study, command.common, [&](const Condition& c, Progress&) {
    if (!examined(true, "condition '" + c.name + "'")) return;
    report.conditions.push_back(linearized(study, c, trimming));
    const bool has_loops = c.command() || (c.user() && !c.user()->model->loops.empty());
    const bool has_margins = report.conditions.back().answer.has_equilibrium();
    if (examined(has_loops && (has_margins || !stop.stop_requested()),
                 "the margins of '" + c.name + "'"))
      report.loops.push_back(actuator_loops(vehicle_at(study, c), c, {}, trimming));
  });
  const std::vector<std::string> to_prove = provable(study, command.common.only);
  if (examined(!to_prove.empty(), "the proofs")) {
    constexpr std::size_t most_boxes = 3000;  // `prove` takes as many as the study asks for
    ProveCommand proving;
    proving.common.only = to_prove;
    proving.threads = command.threads;
    proving.boxes = std::min(study.prove->boxes, most_boxes);
    report.theorems = theorems(study, proving, stop, [](auto...) {});
  }
  add_maps(command, stop, report);
  if (examined(wants_flight(study), "the flight")) report.flight = flown(study, {}, stop);
  if (examined(study.user_motion && (!study.report || study.report->flight.value_or(true)),
               "the motion"))
    report.motion = user_motion(study, trimming);
  if (examined(wants_audit(study), "the paper's tables"))
    report.paper = paper_tables(data_directory(), study.vehicle);
  return report;
}

// ---- Files --------------------------------------------------------------------------------------

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A temporary folder of this process, removed at the end.
struct Workshop {
  fs::path path;
  Workshop() {
    std::string name = (fs::temp_directory_path() / "tiltrim-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error(name + ": cannot be made");
    path = name;
  }
  ~Workshop() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
};

std::vector<std::string> drawn(const std::vector<Figure>& figures) {
  const Workshop shop;
  write_whole(shop.path / "figures.gp", gnuplot_script(figures, Device::page));
  run_gnuplot(shop.path, "figures.gp", "");
  std::vector<std::string> svg;
  for (const Figure& f : figures) svg.push_back(slurp(shop.path / (f.name + ".svg")));
  return svg;
}

void write_figures(const fs::path& folder, const std::vector<Figure>& figures) {
  if (folder.empty()) return;
  make_folder(folder);
  write_whole(folder / "figures.gp", gnuplot_script(figures, Device::column));
  run_gnuplot(folder, "figures.gp", fmt::format("; its script is in {}", folder.string()));
}

void write_tables(const fs::path& folder, const std::vector<NamedSheet>& sheets) {
  if (folder.empty()) return;
  make_folder(folder);
  for (const auto& [name, sheet] : sheets) {
    write_whole(folder / (name + ".txt"), as_text(sheet));
    write_whole(folder / (name + ".csv"), as_csv(sheet));
    write_whole(folder / (name + ".md"), as_markdown(sheet));
    write_whole(folder / (name + ".tex"), as_latex(sheet));
  }
}

// The command line, quoted for a shell.
std::string command_line(const ReportCommand& command) {
  const auto word = [](const std::string& text) {
    const bool plain = !text.empty() &&
                       text.find_first_not_of(
                           "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=") ==
                           std::string::npos;
    if (plain) return text;
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
  };
  std::string line = "tiltrim report " + word(command.common.study.string()) + " -o " +
                     word(command.common.output.string());
  for (const std::string& name : command.common.only) line += " --only " + word(name);
  for (const fs::path& file : command.sweeps) line += " --sweep " + word(file.string());
  return line;
}

std::string summary(const StudyReport& report, const fs::path& page, const TextStyle& style) {
  std::string text = wrapped(verdict_in_words(report), 0, style.width);
  for (const Unanswered& u : tiltrim::unanswered(report)) {
    text += wrapped("- " + u.what + ": " + u.why, 2, style.width);
    for (const std::string& words : u.more) text += wrapped("- " + words, 4, style.width);
  }
  return text + page.string() + "\n";
}

void check(const ReportCommand& command) {
  for (const fs::path& file : command.sweeps)
    check_apart(command.common.output, "-o", file, "--sweep");
  check_folder(command.figures);
  check_folder(command.tables);
}

}  // namespace

Outcome run(const ReportCommand& command, const TextStyle& style, const std::stop_token& stop) {
  check(command);
  return reported(read_study(command.common), command, style, stop);
}

Outcome reported(const Study& study, const ReportCommand& command, const TextStyle& style,
                 const std::stop_token& stop) {
  check(command);
  StudyReport report = computed(study, command, stop);
  report.command = command_line(command);
  const ReportFigures figures = report_figures(report);
  write_tables(command.tables, report_sheets(report));
  write_figures(command.figures, figures.figures);
  write_whole(command.common.output, report_page(report, figures, drawn(figures.figures)));
  return {summary(report, command.common.output, style),
          tiltrim::unanswered(report).empty() ? answered : Exit::unanswered, true};
}

}  // namespace tiltrim::cli
