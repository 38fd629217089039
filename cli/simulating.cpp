// tiltrim simulate: a flight, the tilt-rate limit, responses, Monte Carlo.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "cli/commands.hpp"
#include "cli/gnuplot.hpp"
#include "cli/terminal.hpp"
#include "flight/fly.hpp"
#include "model/degrees.hpp"
#include "model/lookup.hpp"
#include "report/flights.hpp"
#include "report/motions.hpp"
#include "runtime/whole_file.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim::cli {

namespace {

namespace fs = std::filesystem;

std::string study_name(const Study& study) { return study.file.stem().string(); }

// ---- Options ------------------------------------------------------------------------------------

void check_samples(const SimulateCommand& command) {
  const fs::path& samples = command.samples;
  if (samples.empty()) return;
  if (samples.extension() != ".nc" && samples.extension() != ".csv")
    throw std::invalid_argument(
        fmt::format("--samples: {}: expected a file that ends in .nc or .csv", samples.string()));
  check_writable(samples);
}

// Refuses options that would be ignored, and files that cannot be written.
void check(const SimulateCommand& command) {
  const auto goes_with = [](bool given, const char* option, bool asked, const char* what) {
    if (given && !asked)
      throw std::invalid_argument(fmt::format("{} applies to {} only", option, what));
  };
  const bool flies = !command.tilt_rate_limit && !command.monte_carlo && command.response.empty();
  goes_with(!command.samples.empty(), "--samples", flies, "a flight");
  goes_with(!command.plots.empty(), "--plots", flies, "a flight");
  goes_with(!command.tilts.empty(), "--tilts", command.tilt_rate_limit, "--tilt-rate-limit");
  if (const auto& tilts = command.tilts; !tilts.empty() && !(tilts.front() > tilts.back()))
    throw std::invalid_argument(
        fmt::format("--tilts: {} to {} does not decrease; expected FROM above TO, as 90,0",
                    tilts.front(), tilts.back()));
  goes_with(!command.log.empty(), "--log", command.monte_carlo, "--monte-carlo");
  goes_with(!command.common.only.empty(), "--only", !command.response.empty(), "--response");
  check_samples(command);
  check_folder(command.plots);
}

// ---- The flight ---------------------------------------------------------------------------------

// The paper's flight: from the ground, vertically, over a schedule of height to its level flight.
bool as_in_paper(const Study& study, const Schedule& schedule) {
  const SimulateTable table = study.simulate.value_or(SimulateTable{});
  if (!from_ground(table) || table.schedule.over_time) return false;
  constexpr double aloft = 1e6, same = 1e-9;  // m; rad, m/s
  const Command first = schedule.command(0, 0), last = schedule.command(0, aloft);
  const Command foot = corridor(0), top = corridor(aloft);
  const auto apart = [](const Command& a, const Command& b) {
    return std::max(std::abs(a.gamma - b.gamma), std::abs(a.eta - b.eta));
  };
  return apart(first, foot) < same && apart(last, top) < same && std::abs(last.V - top.V) < same;
}

}  // namespace

FlightReport flown(const Study& study, std::optional<long> number, const std::stop_token& stop) {
  FlightReport report{study_name(study), {}, {}, {}, {}, {}};
  report.plan = number ? flight_plan_of(study, *number) : flight_plan(study);
  if (number) report.name += fmt::format(", flight {}", *number);
  if (!is_equilibrium(report.plan.start_status)) return report;
  HandOverOptions checking;
  checking.duration = report.plan.options.duration;
  report.hand_over = check_hand_over(report.plan.flight, checking);
  report.plan.options.integrate.stop = stop;
  report.plan.options.global_error = true;
  report.flown = fly(report.plan.flight, report.plan.start, report.plan.options);
  report.table = flight_table(report.plan.flight, *report.flown);
  if (as_in_paper(study, report.plan.flight.schedule)) report.facts = paper_facts(report.table);
  return report;
}

namespace {

void write_table(const SimulateCommand& command, const Study& study, const FlightTable& table,
                 FlightNotes notes) {
  if (command.samples.extension() == ".csv") {
    write_whole(command.samples, as_csv(table_sheet(table)));
    return;
  }
  notes.study = study.text;
  notes.program = "tiltrim " TILTRIM_VERSION;
  write_netcdf(table, notes, command.samples);
}

void write_samples(const SimulateCommand& command, const Study& study, const FlightReport& report) {
  if (command.samples.empty() || !report.flown) return;
  write_table(command, study, report.table, notes_of(*report.flown));
}

void draw(const SimulateCommand& command, const FlightReport& report) {
  if (command.plots.empty() || !report.flown) return;
  make_folder(command.plots);
  write_whole(command.plots / "flight.csv", as_csv(flight_sheet(report)));
  write_whole(command.plots / "figures.gp", flight_plots(report));
  run_gnuplot(command.plots, "figures.gp",
              fmt::format("; its script and data are in {}", command.plots.string()));
}

Outcome fly_study(const SimulateCommand& command, const Study& study, const TextStyle& style,
                  const std::stop_token& stop) {
  const FlightReport report = flown(study, command.flight, stop);
  write_samples(command, study, report);
  draw(command, report);
  const bool whole = report.flown && (report.flown->status == FlightStatus::flown ||
                                      report.flown->status == FlightStatus::landed);
  const int code = whole ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return flight_json(report); },
              [&] { return as_csv(flight_sheet(report)); },
              [&] { return flight_text(report, style); }, [&] { return flight_document(report); }),
          code};
}

// The motion of a study with [model].
Outcome move_model(const SimulateCommand& command, const Study& study, const TextStyle& style,
                   const std::stop_token& stop) {
  TrimOptions trimming;
  trimming.stop = stop;
  const MotionAnswer motion = user_motion(study, trimming);
  if (motion.motion && !command.samples.empty())
    write_table(command, study, motion.table, notes_of(motion));
  if (motion.motion && !motion.motion->t.empty() && !command.plots.empty()) {
    make_folder(command.plots);
    write_whole(command.plots / "figures.gp",
                gnuplot_script({motion_figure(motion)}, Device::column));
    run_gnuplot(command.plots, "figures.gp",
                fmt::format("; its script is in {}", command.plots.string()));
  }
  return {in_format(
              command.common.format, [&] { return motion_json(motion); },
              [&] { return as_csv(table_sheet(motion.table)); },
              [&] { return motion_text(motion, style); }, [&] { return motion_document(motion); }),
          motion.answered() ? answered : unanswered};
}

// ---- Alternatives to the flight -----------------------------------------------------------------

Outcome limit_tilt_rate(const SimulateCommand& command, const Study& study, const TextStyle& style,
                        const std::stop_token& stop) {
  const Flight flight = flight_of(study, study.simulate.value_or(SimulateTable{}));
  TiltRateOptions options;
  if (!command.tilts.empty()) {
    options.from = command.tilts.front() / degrees;
    options.to = command.tilts.back() / degrees;
  }
  options.threads = command.threads;
  options.stop = stop;
  Progress progress(1, "tilt-rate limits");
  std::size_t flights = 0;
  options.observe = [&](const TiltFlight& f) {
    progress.say(fmt::format("flight {} at {:.4g}°/s {}", ++flights, f.rate * degrees,
                             f.holds ? "holds" : "fails"));
  };
  const TiltRateLimit limit = tilt_rate_limit(flight, options);
  const bool open =
      limit.status == TiltRateStatus::no_trim || limit.status == TiltRateStatus::interrupted;
  const int code = open ? unanswered : answered;
  return {
      in_format(
          command.common.format, [&] { return tilt_rate_json(limit); },
          [&] { return as_csv(tilt_rate_sheet(limit)); },
          [&] { return tilt_rate_text(limit, style); }, [&] { return tilt_rate_document(limit); }),
      code};
}

// States of the tiltrotor in which a response may be offset.
std::vector<Key> flight_keys() {
  std::vector<Key> keys;
  for (const char* name :
       {"V", "gamma_deg", "theta_deg", "q", "energy_integral", "distribution_integral"}) {
    const std::string key = name;
    const bool angle = key.ends_with("_deg");
    keys.push_back({key, angle ? key.substr(0, key.size() - 4) : key, angle ? "degrees" : "", {}});
  }
  return keys;
}

std::vector<Key> states_of(const UserModel& own) {
  std::vector<Key> keys = own.keys;
  std::erase_if(keys, [&](const Key& key) { return find(own.model.states, key.signal) < 0; });
  return keys;
}

// "theta_deg=2" as a state and SI.
std::pair<std::string, double> offset_of(const std::string& text, const std::vector<Key>& allowed) {
  std::vector<std::string> keys;
  for (const Key& key : allowed) keys.push_back(key.name);
  const std::size_t equals = text.find('=');
  std::string key = text.substr(0, equals);
  if (std::ranges::find(keys, key) == keys.end()) {
    const std::string near = nearest_name(key, keys);
    throw std::invalid_argument(fmt::format(
        "--response: no '{}'{}; there are: {}", key,
        near.empty() ? "" : fmt::format(" (nearest: '{}')", near), fmt::join(keys, ", ")));
  }
  double value = 0.0;
  const std::string number = equals == std::string::npos ? "" : text.substr(equals + 1);
  const auto [end, failed] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (failed != std::errc() || end != number.data() + number.size() || !std::isfinite(value))
    throw std::invalid_argument(fmt::format(
        "--response: '{}' is not a number; expected {}=NUMBER, as {}=2", number, key, key));
  const Key& found = *std::ranges::find(allowed, key, &Key::name);
  return {found.signal, found.unit == "degrees" ? value / degrees : value};
}

std::map<std::string, double> offsets_of(const std::vector<std::string>& texts,
                                         const std::vector<Key>& allowed) {
  std::map<std::string, double> offsets;
  for (const std::string& text : texts)
    if (!offsets.insert(offset_of(text, allowed)).second)
      throw std::invalid_argument(
          fmt::format("--response: '{}' is given twice", text.substr(0, text.find('='))));
  return offsets;
}

Outcome respond(const SimulateCommand& command, const Study& study, const TextStyle& style,
                const std::stop_token& stop) {
  const std::map<std::string, double> offset =
      offsets_of(command.response, study.user_model ? states_of(*study.user_model) : flight_keys());
  std::vector<NamedResponse> responses;
  bool all = true;
  for (const Condition& c : chosen(study, command.common.only)) {
    if (stop.stop_requested()) break;
    if (study.user_model)
      responses.push_back({c.name, user_response(c, offset)});
    else if (const Command* asked = c.command())
      responses.push_back({c.name, response(flight_of(study, SimulateTable{}), *asked, offset)});
    else
      continue;
    all = all && responses.back().response.status == ResponseStatus::responded;
  }
  if (responses.empty() && !stop.stop_requested())
    throw StudyError(
        fmt::format("{}: no condition of formulation closed_loop", study.file.string()));
  const int code = all ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return responses_json(responses); },
              [&] { return as_csv(responses_sheet(responses)); },
              [&] { return responses_text(responses, style); },
              [&] { return responses_document(responses); }),
          code};
}

Outcome scatter(const SimulateCommand& command, const Study& study, const TextStyle& style,
                const std::stop_token& stop) {
  MonteCarloOptions options;
  options.threads = command.threads;
  options.log = filing::target_of(command.log);
  options.identity = identity_of(study, study.conditions);
  options.stop = stop;
  Progress progress(1);
  options.observe = [&](const MonteCarlo& so_far) {
    progress.tell(fmt::format("{} of {} flights, {} good", so_far.flown, so_far.asked, so_far.good),
                  double(so_far.flown) / double(so_far.asked));
  };
  const MonteCarlo run = monte_carlo(study, options);
  const int code = run.interrupted || !run.message.empty() ? unanswered : answered;
  const std::string text = in_format(
      command.common.format, [&] { return monte_carlo_json(run); },
      [&] { return as_csv(monte_carlo_sheet(run)); }, [&] { return monte_carlo_text(run, style); },
      [&] { return monte_carlo_document(run); });
  // The log is removed only after the result is saved.
  if (command.common.output.empty())
    print_whole(text);
  else
    write_whole(command.common.output, text);
  if (!run.interrupted && !command.log.empty()) fs::remove(options.log);
  return {"", code, true};
}

Outcome simulated(const SimulateCommand& command, const Study& study, const TextStyle& style,
                  const std::stop_token& stop) {
  if (study.user_model && (command.tilt_rate_limit || command.monte_carlo || command.flight))
    throw std::invalid_argument(
        "--tilt-rate-limit, --monte-carlo and --flight apply to the built-in tiltrotor; a study "
        "with [model] has its motion and --response");
  if (command.tilt_rate_limit) return limit_tilt_rate(command, study, style, stop);
  if (!command.response.empty()) return respond(command, study, style, stop);
  if (command.monte_carlo) return scatter(command, study, style, stop);
  if (study.user_model) return move_model(command, study, style, stop);
  return fly_study(command, study, style, stop);
}

}  // namespace

Outcome run(const SimulateCommand& command, const TextStyle& style, const std::stop_token& stop) {
  check(command);
  const Study study =
      read_study(command.common, {{command.samples, "--samples"}, {command.log, "--log"}});
  if (!study.user_model) (void)offsets_of(command.response, flight_keys());
  try {
    return simulated(command, study, style, stop);
  } catch (const std::invalid_argument& e) {
    throw placed(study, e);
  }
}

}  // namespace tiltrim::cli
