/// The program's commands: each calls the library and returns the text to print.
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
#include "prove/prove.hpp"
#include "report/branch_sheets.hpp"
#include "report/conditions.hpp"
#include "report/flights.hpp"
#include "study/analyses.hpp"
#include "sweep/verdict_map.hpp"

namespace tiltrim::cli {

/// Exit codes: docs/cli.md.
enum Exit { answered = 0, unanswered = 1, bad_input = 2 };

enum class Format { text, json, csv, markdown, latex };

/// Options common to all commands.
struct Common {
  std::filesystem::path study;
  std::optional<Format> asked;    ///< --format
  Format format = Format::text;   ///< as requested, or implied by the ending of `output`
  std::filesystem::path output;   ///< empty: standard output
  std::vector<std::string> only;  ///< condition names; empty: all
};

struct TrimCommand {
  Common common;
  TrimOptions options;
  bool all = false;  ///< find all equilibria
};

struct LinearizeCommand {
  Common common;
  TrimOptions options;
  Method method = Method::exact;
  std::vector<std::string> inputs;
  std::vector<std::filesystem::path> models;  ///< files for all linear models; empty: none
};

struct ModesCommand {
  Common common;                        ///< its study is the matrix file; "-": standard input
  std::filesystem::path error;          ///< error bounds of the entries; empty: none
  std::vector<std::string> states;      ///< empty: those of the file, or x1, x2, ...
  std::optional<std::string> variable;  ///< of MATLAB files and JSON objects; default: A
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
  int threads = 0;           ///< 0: one per processor
};

struct SensitivitiesCommand {
  Common common;
  TrimOptions trimming;
  std::vector<std::string> parameters;
  std::size_t most = 8;  ///< parameters per mode, in text
};

struct MarginsCommand {
  Common common;
  TrimOptions trimming;
  LoopsOptions options;
  std::filesystem::path bode;  ///< Bode data as CSV; empty: none
};

struct LoadsCommand {
  Common common;
};

struct QualitiesCommand {
  Common common;
  TrimOptions trimming;
  Method method = Method::exact;
};

struct ValidateCommand {
  Common common;        ///< without a study
  std::string vehicle;  ///< "xv15"
};

struct SweepCommand {
  Common common;
  int threads = 0;          ///< 0: one per processor
  double checkpoint = 1.0;  ///< s
  std::optional<SweepPart> part;
};

struct MergeCommand {
  Common common;                             ///< without a study
  std::vector<std::filesystem::path> parts;  ///< files of sweep --part
};

struct ProveCommand {
  Common common;
  int threads = 0;                    ///< 0: one per processor
  std::optional<double> margin;       ///< 1/s; default, as of the next and of boxes: the study's
  std::optional<double> damping;      ///< damping ratio
  bool largest = false;               ///< the largest margin that it can prove
  std::optional<std::size_t> boxes;   ///< examined at most
  std::filesystem::path certificate;  ///< empty: none
  std::filesystem::path log;          ///< of examined boxes; empty: none
};

struct TuneCommand {
  Common common;
  std::optional<long> evaluations;  ///< these three: default from the study
  std::optional<double> seconds;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  std::filesystem::path gains;  ///< TOML file for the gains; empty: none
};

struct SimulateCommand {
  Common common;
  std::filesystem::path samples;  ///< .nc or .csv file for all samples; empty: none
  std::filesystem::path plots;    ///< folder for the paper's figures; empty: none
  bool tilt_rate_limit = false;   ///< these three replace the study's flight
  std::vector<double> tilts;      ///< degrees, from and to; empty: 90, 0
  bool monte_carlo = false;
  std::vector<std::string> response;  ///< "theta_deg=2", ...: linear and nonlinear response
  std::optional<long> flight;         ///< number of a Monte-Carlo flight to simulate
  std::filesystem::path log;          ///< to resume an interrupted Monte-Carlo run
  int threads = 0;
};

struct ReportCommand {
  Common common;                              ///< its output is the page
  std::vector<std::filesystem::path> sweeps;  ///< maps to use instead of computing them
  std::filesystem::path figures, tables;  ///< folders for figures and tables as files; empty: none
  int threads = 0;
};

struct DiffCommand {
  Common common;  ///< its study is the first map
  std::filesystem::path after;
};

struct CheckProofCommand {
  Common common;                ///< its study is the certificate
  std::filesystem::path about;  ///< the study that it must be about; empty: any
  int threads = 0;
};

struct TablesCommand {
  Common common;  ///< its study may be empty: the reference vehicle
};

/// The result of a command: the text for its output, and the exit code.
struct Outcome {
  std::string output;
  int exit_code = answered;
  bool written = false;  ///< the output file is already written, `output` goes to the terminal
};

Outcome run(const TrimCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const LinearizeCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const ModesCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const FollowCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const EnvelopeCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const SensitivitiesCommand& command, const TextStyle& style,
            const std::stop_token& stop);
Outcome run(const MarginsCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const LoadsCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const QualitiesCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const ValidateCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const SweepCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const MergeCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const ProveCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const TuneCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const SimulateCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const ReportCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const TablesCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const CheckProofCommand& command, const TextStyle& style, const std::stop_token& stop);
Outcome run(const DiffCommand& command, const TextStyle& style, const std::stop_token& stop);
/// Makes only the requested format: `document` for Markdown and LaTeX.
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

/// load_study(), terminated by the first signal.
Study read_study(const std::filesystem::path& file);
/// A file that a command writes besides its output, and the option that names it.
struct FurtherFile {
  std::filesystem::path file;  ///< empty: none
  const char* option;
};
/// The same; throws std::invalid_argument if a file to be written is the study, its polar or that
/// of -o.
Study read_study(const Common& common, const std::vector<FurtherFile>& further = {});
/// The conditions of these names, in the study's order. Throws StudyError with all names.
std::vector<Condition> chosen(const Study& study, const std::vector<std::string>& only);
/// Identifies everything that determines the results of a resumable run; a log is valid only for
/// the same.
std::string identity_of(const Study& study, const std::vector<Condition>& conditions);
/// Checksum of the study's polar, which its text only names; empty for a study with [model].
std::string polar_checksum(const Study& study);
/// Enters in the map the study, its polar and this program.
void sign(const Study& study, SweepMap& map);

/// Calls work(condition, progress) on each condition in turn. Errors are reported with the
/// condition's name, as a StudyError.
void for_each(const Study& study, const Common& common,
              const std::function<void(const Condition&, Progress&)>& work);
/// The same on several threads, with the number of each among those chosen; 0: one per processor.
void for_each(const Study& study, const Common& common, int threads,
              const std::function<void(std::size_t, const Condition&, Progress&)>& work);
/// The same for the error of an analysis of several conditions: with the place and name of the one
/// whose trim it is about, otherwise with the file.
StudyError placed(const Study& study, const std::invalid_argument& error);
/// Trims, linearizes and computes modes, as far as possible. Inputs: LinearizeCommand's.
ConditionReport linearized(const Study& study, const Condition& condition,
                           const TrimOptions& trimming, const LinearizeOptions& options = {});
/// The same with flying qualities, whether the study has [qualities] or not.
ConditionReport judged(const Study& study, const Condition& condition, const TrimOptions& trimming,
                       const LinearizeOptions& options = {});
/// theorems before this one, of how many, share of the volume proved, boxes
using ProofProgress = std::function<void(std::size_t, std::size_t, double, std::size_t)>;
/// What [prove] of a study that has been read asks for; the log is that of the command, opened.
std::vector<Theorem> theorems(const Study& study, const ProveCommand& command,
                              const std::stop_token& stop, const ProofProgress& observe,
                              Log* log = nullptr);
/// The report of a study that has been read; the command's path names it.
Outcome reported(const Study& study, const ReportCommand& command, const TextStyle& style,
                 const std::stop_token& stop);
/// The study's flight, or one of its Monte-Carlo flights.
FlightReport flown(const Study& study, std::optional<long> number, const std::stop_token& stop);
/// The study's grid for these conditions, with a progress display. Throws StudyError if it cannot
/// be swept.
SweepMap swept(const Study& study, const std::vector<Condition>& conditions, const SweepTable& grid,
               SweepOptions options);

}  // namespace tiltrim::cli
