#include "cli/options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "cli/within.hpp"

namespace tiltrim::cli {

namespace {

const std::map<std::string, Format> formats{{"text", Format::text},
                                            {"json", Format::json},
                                            {"csv", Format::csv},
                                            {"markdown", Format::markdown},
                                            {"latex", Format::latex}};
const std::map<std::string, Method> jacobians{{"exact", Method::exact},
                                              {"differences", Method::differences}};
const std::map<std::string, TrimMethod> methods{{"ipopt", TrimMethod::ipopt},
                                                {"newton", TrimMethod::newton}};

template <class Map>
CLI::Option* add_choice(CLI::App* app, const std::string& flag, auto& value, const Map& map,
                        const std::string& help) {
  std::string names;
  for (const auto& [name, choice] : map) names += (names.empty() ? "" : "|") + name;
  const auto convert = [map, names](std::string& word) {
    const auto found = map.find(CLI::detail::to_lower(word));
    if (found == map.end()) return fmt::format("no '{}'; expected {}", word, names);
    word = std::to_string(static_cast<int>(found->second));  // as CLI11 reads an enumerator
    return std::string();
  };
  return app->add_option(flag, value, help)
      ->transform(CLI::Validator(convert, "", "choice"))
      ->type_name(names);
}

const CLI::Validator named(
    [](std::string& file) {
      return std::string(file.empty() ? "the name of the file is empty; expected a name" : "");
    },
    "");

}  // namespace

void add_output_file(CLI::App* app, Common& common, const std::string& type,
                     const std::string& help) {
  app->add_option("-o,--output", common.output, help)->check(named)->type_name(type);
}

void add_output(CLI::App* app, Common& common) {
  add_choice(app, "-f,--format", common.asked, formats,
             "text (default), json and csv with every digit, markdown or latex tables; if omitted, "
             "the ending of FILE decides");
  add_output_file(app, common, "FILE", "write the output to this file (never a partial file)");
}

void add_formats(CLI::App* app, Common& common, const std::vector<std::string>& some,
                 const std::string& help) {
  std::map<std::string, Format> offered;
  for (const std::string& name : some) offered[name] = formats.at(name);
  add_choice(app, "-f,--format", common.asked, offered, help);
}

void add_study(CLI::App* app, Common& common, bool needed) {
  auto* study =
      app->add_option("study", common.study, "the study file (TOML)")->type_name("STUDY.toml");
  if (needed) study->required();
}

void add_common(CLI::App* app, Common& common, bool needs_study) {
  add_study(app, common, needs_study);
  add_output(app, common);
}

void add_only(CLI::App* app, Common& common) {
  app->add_option("--only", common.only, "only the condition with this name; may be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME");
}

void add_threads(CLI::App* app, int& threads) {
  app->add_option("--threads", threads, "number of threads; 0 (default): one per processor")
      ->check(within(0, 1024))
      ->type_name("N");
}

namespace {

void add_trim_options(CLI::App* app, Common& common, TrimOptions& options) {
  add_only(app, common);
  add_choice(app, "--solver", options.method, methods,
             "ipopt (default), or newton (needs as many unknowns as equations)");
  app->add_option("--starts", options.starts,
                  "additional starts to search for other equilibria (32)")
      ->check(within(0, 100000))
      ->type_name("N");
}

}  // namespace

void settle_format(Common& common, const std::string& own) {
  static const std::map<std::string, Format> endings{{".json", Format::json},
                                                     {".csv", Format::csv},
                                                     {".md", Format::markdown},
                                                     {".tex", Format::latex},
                                                     {".txt", Format::text}};
  static const std::set<std::string> of_others{".nc",  ".html", ".mat", ".py",
                                               ".svg", ".pdf",  ".png"};
  const std::string written = common.output.extension().string();
  if (!common.asked && written != own && of_others.contains(written))
    throw std::invalid_argument(fmt::format(
        "-o {}: this command writes no {}; expected {}.json, .csv, .md, .tex or .txt, or --format",
        common.output.string(), written, own.empty() ? "" : own + ", "));
  const auto ending = endings.find(written);
  if (ending != endings.end() && common.asked && *common.asked != ending->second)
    throw std::invalid_argument(
        fmt::format("-o {}: the ending belongs to another format than --format; expected one of "
                    "the two, or another ending",
                    common.output.string()));
  common.format = common.asked.value_or(ending != endings.end() ? ending->second : Format::text);
}

CLI::App* add_trim(CLI::App& app, TrimCommand& command) {
  CLI::App* trim = app.add_subcommand("trim", "find and verify the equilibrium of each condition");
  add_common(trim, command.common, true);
  add_trim_options(trim, command.common, command.options);
  trim->add_flag("--all", command.all,
                 "all equilibria found from 200 starts (or --starts) and along their branches");
  return trim;
}

CLI::App* add_linearize(CLI::App& app, LinearizeCommand& command) {
  CLI::App* linearize = app.add_subcommand(
      "linearize", "trim and linearize: linear model, eigenvalues, modes and stability verdict");
  add_common(linearize, command.common, true);
  add_trim_options(linearize, command.common, command.options);
  add_choice(linearize, "--jacobian", command.method, jacobians,
             "exact derivatives (default), or differences");
  linearize
      ->add_option("--inputs", command.inputs,
                   "inputs of B and D: any inputs or parameters, e.g. V,gains.K_Lp (default: the "
                   "model's inputs; closed loop: V,gamma,eta)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME,...");
  linearize
      ->add_option("--models", command.models,
                   "write all linear models to this file, .mat, .json, .csv or .py")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("FILE");
  return linearize;
}

CLI::App* add_modes(CLI::App& app, ModesCommand& command) {
  CLI::App* modes = app.add_subcommand(
      "modes", "compute eigenvalues, modes and stability verdict of a matrix from a file");
  modes
      ->add_option("matrix", command.common.study,
                   "the matrix as a CSV, JSON or MATLAB file; - reads standard input")
      ->type_name("A.csv")
      ->required();
  modes
      ->add_option("--error", command.error,
                   "error bounds of the matrix entries, in a file of one of these formats")
      ->type_name("E.csv");
  modes
      ->add_option("--states", command.states,
                   "names of the states (default: the file's, or x1,x2,...)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME,...");
  modes
      ->add_option("--variable", command.variable,
                   "variable of a .mat file or JSON object (A); for --error, the same with _error")
      ->type_name("NAME");
  add_output(modes, command.common);
  return modes;
}

CLI::App* add_follow(CLI::App& app, FollowCommand& command) {
  CLI::App* follow = app.add_subcommand(
      "follow", "trace a branch of equilibria from each condition, through folds and along limits");
  add_common(follow, command.common, true);
  add_trim_options(follow, command.common, command.trimming);
  follow
      ->add_option("--parameter", command.parameter,
                   "any variable of the study: V, gamma_deg, aircraft.mass, gains.K_Lp (default: "
                   "the study's [follow])")
      ->type_name("KEY");
  follow->add_option("--to", command.to, "final value, in the study's unit")->type_name("VALUE");
  follow
      ->add_option("--max-step", command.options.max_step,
                   "longest step, in nominal sizes of the unknowns (0.5)")
      ->check(within(1e-6, 100.0))
      ->type_name("STEP");
  follow
      ->add_option("--max-points", command.options.max_points,
                   "maximum number of points on a branch (5000)")
      ->check(within(2, 1000000))
      ->type_name("N");
  return follow;
}

CLI::App* add_envelope(CLI::App& app, EnvelopeCommand& command) {
  CLI::App* envelope = app.add_subcommand(
      "envelope",
      "find the speeds and tilts (or path angles) that can be trimmed, and what limits them");
  add_common(envelope, command.common, true);
  add_only(envelope, command.common);
  envelope
      ->add_option("--over", command.over,
                   "the second axis, next to V: eta_deg or gamma_deg (default: that of the study's "
                   "[envelope], or eta_deg)")
      ->check(CLI::IsMember({"eta_deg", "gamma_deg"}))
      ->type_name("KEY");
  envelope->add_option("--count", command.count, "points per axis (default: [envelope], or 100)")
      ->check(within(5, 1000))
      ->type_name("N");
  add_threads(envelope, command.threads);
  return envelope;
}

CLI::App* add_sensitivities(CLI::App& app, SensitivitiesCommand& command) {
  CLI::App* sensitivities = app.add_subcommand(
      "sensitivities", "rank the parameters by their effect on the trim and on each mode");
  add_common(sensitivities, command.common, true);
  add_trim_options(sensitivities, command.common, command.trimming);
  sensitivities
      ->add_option("--parameters", command.parameters,
                   "variables of the study, e.g. V,aircraft.mass,gains.K_Lp (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("KEY,...");
  sensitivities
      ->add_option("--most", command.most, "number of parameters printed for each mode (8)")
      ->check(within(1, 1000))
      ->type_name("N");
  return sensitivities;
}

CLI::App* add_margins(CLI::App& app, MarginsCommand& command) {
  CLI::App* margins = app.add_subcommand(
      "margins", "compute gain, phase, delay and disk margins of the loop broken at each actuator");
  LoopsOptions& options = command.options;
  add_common(margins, command.common, true);
  add_trim_options(margins, command.common, command.trimming);
  margins
      ->add_option("--loop", options.actuators,
                   "loop to break: theta0, a1s, delta_e, or a loop of the model (default: each)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("ACTUATOR,...");
  margins->add_option("--bode", command.bode, "write Bode data to this CSV file")
      ->type_name("FILE.csv");
  margins
      ->add_option("--from", options.from,
                   "lowest frequency of the Bode data (default: a tenth of the slowest eigenvalue)")
      ->type_name("RAD_PER_S");
  margins
      ->add_option("--to", options.to,
                   "highest frequency (default: ten times the fastest eigenvalue)")
      ->type_name("RAD_PER_S");
  margins->add_option("--points", options.points, "number of frequencies in the Bode data (200)")
      ->check(within(2, 1000000))
      ->type_name("N");
  return margins;
}

CLI::App* add_qualities(CLI::App& app, QualitiesCommand& command) {
  CLI::App* qualities = app.add_subcommand(
      "qualities",
      "evaluate flying-qualities levels: short period, phugoid, hover oscillation, bandwidth");
  add_common(qualities, command.common, true);
  add_trim_options(qualities, command.common, command.trimming);
  add_choice(qualities, "--jacobian", command.method, jacobians,
             "exact derivatives (default), or differences");
  return qualities;
}

CLI::App* add_loads(CLI::App& app, LoadsCommand& command) {
  CLI::App* loads = app.add_subcommand(
      "loads", "compute forces and moments of each component at given states, without a trim");
  add_common(loads, command.common, true);
  add_only(loads, command.common);
  return loads;
}

CLI::App* add_validate(CLI::App& app, ValidateCommand& command) {
  CLI::App* validate = app.add_subcommand(
      "validate", "compare a published vehicle with the numbers published about it");
  validate->add_option("vehicle", command.vehicle, "xv15")->type_name("VEHICLE")->required();
  add_output(validate, command.common);
  return validate;
}

CLI::App* add_tune(CLI::App& app, TuneCommand& command) {
  CLI::App* tune = app.add_subcommand(
      "tune", "optimize gains for the worst case over the operating points of [tune]");
  add_common(tune, command.common, true);
  tune->add_option("--gains", command.gains,
                   "write the gains to this file, in the format of a study")
      ->type_name("FILE.toml");
  tune->add_option("--evaluations", command.evaluations,
                   "maximum number of candidates (default: the study's, 100000)")
      ->check(within(0L, 1'000'000'000L))
      ->type_name("N");
  tune->add_option("--seconds", command.seconds,
                   "time limit of each search; 0: no limit (default: the study's, 0)")
      ->check(within(0.0, 1e6))
      ->type_name("S");
  tune->add_option("--seed", command.seed, "seed of all random numbers (default: the study's, 1)")
      ->check(within(std::uint64_t{0}, std::uint64_t{1} << 53))
      ->type_name("N");
  tune->add_option("--threads", command.threads,
                   "number of threads; 0 (default): one per processor")
      ->check(within(0, 1024))
      ->type_name("N");
  return tune;
}

CLI::App* add_simulate(CLI::App& app, SimulateCommand& command) {
  CLI::App* simulate = app.add_subcommand(
      "simulate", "simulate the nonlinear flight of [simulate]: transition, reconversion, gusts");
  add_common(simulate, command.common, true);
  add_only(simulate, command.common);
  simulate->add_option("--samples", command.samples, "write every sample to this file, .nc or .csv")
      ->type_name("FILE");
  simulate
      ->add_option("--plots", command.plots,
                   "draw the paper's Figures 5-9 into this folder, SVG and PNG (gnuplot)")
      ->type_name("DIR");
  CLI::App* const instead = simulate->add_option_group("alternatives to the single flight");
  instead->add_flag(
      "--tilt-rate-limit", command.tilt_rate_limit,
      "find the fastest tilt rate at which frozen eigenvalues still predict the flight");
  instead->add_flag("--monte-carlo", command.monte_carlo,
                    "fly the scattered flights of the study's [montecarlo]");
  instead->add_option("--flight", command.flight, "fly only this flight of the Monte Carlo run")
      ->check(within(0L, 10'000'000L))
      ->type_name("N");
  instead
      ->add_option("--response", command.response,
                   "compare the linear and nonlinear response of each condition to an offset of V, "
                   "gamma_deg, theta_deg, q, energy_integral, distribution_integral")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE,...");
  instead->require_option(0, 1);
  simulate
      ->add_option("--tilts", command.tilts,
                   "for --tilt-rate-limit: first and last tilt in degrees (90,0)")
      ->delimiter(',')
      ->expected(2)
      ->check(within(0.0, 90.0))
      ->type_name("FROM,TO");
  simulate
      ->add_option("--log", command.log,
                   "log of finished Monte Carlo flights, from which a run can be resumed")
      ->type_name("FILE");
  add_threads(simulate, command.threads);
  return simulate;
}

CLI::App* add_report(CLI::App& app, ReportCommand& command) {
  CLI::App* report = app.add_subcommand(
      "report",
      "write one HTML page with everything: tables, figures, maps, margins, flight, audit");
  report->add_option("study", command.common.study, "the study file (TOML)")
      ->type_name("STUDY.toml")
      ->required();
  report
      ->add_option(
          "-o,--output", command.common.output,
          "write the page to this file (never a partial file; default: STUDY.html in this folder)")
      ->check(named)
      ->type_name("FILE.html");
  add_only(report, command.common);
  report
      ->add_option("--sweep", command.sweeps,
                   "show this map, written by sweep; one with the same axes and points is not "
                   "computed again; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("MAP.nc");
  report
      ->add_option("--figures", command.figures,
                   "also write each figure to this folder: SVG, PDF, PNG, 88 mm wide")
      ->type_name("DIR");
  report
      ->add_option("--tables", command.tables,
                   "also write each table to this folder: text, CSV, Markdown, LaTeX")
      ->type_name("DIR");
  add_threads(report, command.threads);
  return report;
}

CLI::App* add_tables(CLI::App& app, TablesCommand& command) {
  CLI::App* tables = app.add_subcommand(
      "tables", "print the paper's Tables 1-3: published, recomputed, audited and corrected");
  add_common(tables, command.common, false);
  return tables;
}

}  // namespace tiltrim::cli
