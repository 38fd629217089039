// tiltrim report: all results of a study, computed unless given, on one page.
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "cli/commands.hpp"
#include "cli/gnuplot.hpp"
#include "cli/report_maps.hpp"
#include "cli/terminal.hpp"
#include "report/study_report.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "sweep/map.hpp"
#include "tables/tables.hpp"

namespace tiltrim::cli {

namespace {

namespace fs = std::filesystem;

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
  for (const fs::path& file : command.sweeps) report.maps.push_back(map_in(file, study));
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
