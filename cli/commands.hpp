/// The program's commands: each calls the library and returns what is to be printed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "cli/terminal.hpp"
#include "report/branches.hpp"
#include "report/conditions.hpp"
#include "report/flights.hpp"
#include "study/analyses.hpp"
#include "sweep/sweep.hpp"

namespace tiltrim::cli {

/// Exit codes: docs/cli.md.
enum Exit { answered = 0, unanswered = 1, bad_input = 2 };

enum class Format { text, json, csv, markdown, latex };

/// What every command takes.
struct Common {
  std::filesystem::path study;
  std::optional<Format> asked;    ///< --format
  Format format = Format::text;   ///< asked for, or what the ending of `output` names
  std::filesystem::path output;   ///< empty: standard output
  std::vector<std::string> only;  ///< names of conditions; empty: all
};

struct TrimCommand {
  Common common;
  TrimOptions options;
  bool all = false;  ///< every equilibrium that can be found
};

struct LinearizeCommand {
  Common common;
  TrimOptions options;
  Method method = Method::exact;
  std::vector<std::string> inputs;
  std::vector<std::filesystem::path> models;  ///< files of all linear models; empty: none
};

struct ModesCommand {
  Common common;                    ///< its study is the matrix; "-": standard input
  std::filesystem::path error;      ///< bounds of its entries; empty: none
  std::vector<std::string> states;  ///< empty: those of the file, or x1, x2, ...
  std::string variable = "A";       ///< of MATLAB files and JSON objects
};

struct FollowCommand {
  Common common;
  TrimOptions trimming;
  FollowOptions options;
  std::string parameter;     ///< empty: the study's [follow]
  std::optional<double> to;  ///< in the parameter's unit
};

struct EnvelopeCommand {
  Common common;
  std::string over;  ///< "eta_deg" or "gamma_deg"; empty: the study's [envelope], or eta_deg
  std::optional<int> count;  ///< grid points along each axis
};

struct SensitivitiesCommand {
  Common common;
  TrimOptions trimming;
  std::vector<std::string> parameters;
  std::size_t most = 8;  ///< parameters for each mode, in text
};

struct MarginsCommand {
  Common common;
  TrimOptions trimming;
  LoopsOptions options;
  std::filesystem::path bode;  ///< Bode data as CSV; empty: none
};

struct SweepCommand {
  Common common;
  int threads = 0;          ///< 0: as many as the machine has
  double checkpoint = 1.0;  ///< s
};

struct TuneCommand {
  Common common;
  std::optional<long> evaluations;  ///< these three: else the study's
  std::optional<double> seconds;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  std::filesystem::path gains;  ///< where they are written as TOML; empty: nowhere
};

struct SimulateCommand {
  Common common;
  std::filesystem::path samples;  ///< every sample as .nc or .csv; empty: nowhere
  std::filesystem::path plots;    ///< folder for the paper's figures; empty: none
  bool tilt_rate_limit = false;   ///< these three: instead of the study's flight
  std::vector<double> tilts;      ///< degrees, from and to; empty: 90, 0
  bool monte_carlo = false;
  std::vector<std::string> response;  ///< "theta_deg=2", ...: linear against nonlinear
  std::optional<long> flight;         ///< this one of the Monte-Carlo flights
  std::filesystem::path log;          ///< from which a killed Monte-Carlo run goes on
  int threads = 0;
};

struct ReportCommand {
  Common common;                              ///< its output is the page
  std::vector<std::filesystem::path> sweeps;  ///< maps to use instead of computing them
  std::filesystem::path figures, tables;      ///< folders for both as files; empty: none
  int threads = 0;
};

struct DiffCommand {
  Common common;  ///< its study is the map before
  std::filesystem::path after;
};

struct TablesCommand {
  Common common;  ///< its study may be empty: the reference vehicle
};

/// What a command has to say: the text for its output, and the exit code.
struct Outcome {
  std::string output;
  int exit_code = answered;
  bool written = false;  ///< the output file is there already, `output` is for the terminal
};

Outcome run(const TrimCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const LinearizeCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const ModesCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const FollowCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const EnvelopeCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const SensitivitiesCommand& command, const TextStyle& style,
            const std::stop_token& stop);
Outcome run(const MarginsCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const SweepCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const TuneCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const SimulateCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const ReportCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const TablesCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const DiffCommand& command, const TextStyle& style, const std::stop_token& stop);
/// What is asked for, and nothing else, is made: `document` for Markdown and LaTeX.
template <class Json, class Csv, class Text, class Document>
std::string in_format(Format format, const Json& json, const Csv& csv, const Text& text,
                      const Document& document) {
  switch (format) {
    case Format::json:
      return json();
    case Format::csv:
      return csv();
    case Format::markdown:
      return as_markdown(document());
    case Format::latex:
      return as_latex(document());
    case Format::text:
      break;
  }
  return text();
}

/// load_study(), which the first signal ends.
Study read_study(const std::filesystem::path& file);
/// The conditions asked for by name, in the study's order. Throws StudyError with all names.
std::vector<Condition> chosen(const Study& study, const std::vector<std::string>& only);
/// What decides the numbers of a run that can be taken up again: a log is for the same alone.
std::string identity_of(const Study& study, const std::vector<Condition>& conditions);

/// Calls work(condition, progress) on each condition in turn. What cannot be asked of one is said
/// with its name, as a StudyError.
void for_each(const Study& study, const Common& common,
              const std::function<void(const Condition&, Progress&)>& work);
/// Trimmed, linearized and its modes found, as far as it goes. Inputs: LinearizeCommand's.
ConditionReport linearized(const Study& study, const Condition& condition,
                           const TrimOptions& trimming, const LinearizeOptions& options = {});
/// The study's flight, or this one of its Monte-Carlo flights.
FlightReport flown(const Study& study, std::optional<long> number, const std::stop_token& stop);
/// The study's grid for these conditions, progress said. Throws StudyError where it cannot be
/// swept.
SweepMap swept(const Study& study, const std::vector<Condition>& conditions, const SweepTable& grid,
               SweepOptions options);

}  // namespace tiltrim::cli
