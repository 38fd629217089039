#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <new>
#include <sstream>
#include <system_error>

#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/terminal.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim::cli {

namespace {

constexpr const char* about =
    "Trim and linear stability of flight-dynamics models: the built-in tiltrotor, or your own. "
    "Every answer is verified and comes with an error bound or estimate; if there is no answer, "
    "tiltrim gives the reason.";

constexpr const char* study_and_codes =
    "\n\nA study is one TOML file (docs/study.md). The smallest:\n"
    "  [[condition]]\n"
    "  name = \"level\"\n"
    "  V = 15.0           # m/s\n"
    "  gamma_deg = 0.0    # flight path\n"
    "  eta_deg = 0.0      # nacelle tilt: 90 helicopter, 0 airplane\n"
    "\nExit code: 0 every condition answered; 1 some condition has no verified answer (the rest "
    "are still written); 2 bad input, with file, line and key; 128 + n after signal n.";

template <class Run>
int finish(const Common& common, const Run& run) {
  check_apart(common.output, "-o", common.study, "the study");
  if (!common.output.empty()) check_writable(common.output);
  TextStyle style;
  const bool terminal = common.output.empty() && isatty(STDOUT_FILENO) == 1;
  style.colour = terminal && !std::getenv("NO_COLOR");
  if (terminal) style.width = terminal_width(style.width);
  const Interrupt interrupt;
  const Outcome outcome = run(style, interrupt.token());
  if (common.output.empty() || outcome.written)
    print_whole(outcome.output);
  else
    write_whole(common.output, outcome.output);
  return interrupt.signal() == 0 ? outcome.exit_code : 128 + interrupt.signal();
}

// "AFTER.nc is missing; expected 'tiltrim diff BEFORE.nc AFTER.nc'", or nothing.
std::string missing(const CLI::App& command) {
  std::string first, usage = "tiltrim " + command.get_name();
  for (const CLI::Option* option :
       command.get_options([](const CLI::Option* o) { return o->get_required(); })) {
    const std::string name = value_name(*option);
    usage += " " + name;
    if (first.empty() && option->count() == 0) first = name;
  }
  return first.empty() ? "" : fmt::format("{} is missing; expected '{}'", first, usage);
}

// An error in the arguments, in one line.
std::string refusal(const CLI::App& app, const CLI::ParseError& error, const std::string& first) {
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
  const bool known = std::ranges::find(commands, first) != commands.end();
  if (known) {
    const bool required = error.get_exit_code() == int(CLI::ExitCodes::RequiredError);
    const std::string lacks = required ? missing(*app.get_subcommand(first)) : "";
    return fmt::format("{}; see 'tiltrim {} --help'", lacks.empty() ? error.what() : lacks, first);
  }
  const std::string all = fmt::format("there are: {}", fmt::join(commands, ", "));
  if (first.empty()) return "no command; " + all + "; see 'tiltrim --help'";
  if (first.front() == '-') return fmt::format("{}; see 'tiltrim --help'", error.what());
  const std::string near = nearest_name(first, commands);
  return fmt::format("no command '{}'; {}{}", first,
                     near.empty() ? "" : fmt::format("did you mean '{}'? ", near), all);
}

// A subcommand and the function that runs it.
struct Choice {
  const CLI::App* command;
  std::function<int()> go;
};

template <class Command>
Choice choice(const CLI::App* app, const Command& command) {
  return {app, [&command] {
            return finish(command.common, [&](const TextStyle& style, const std::stop_token& stop) {
              return run(command, style, stop);
            });
          }};
}

// Breaks lines of help that are too long; a description stays in its column.
std::string folded(const std::string& help, std::size_t width) {
  std::istringstream in(help);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.size() <= width) {
      text += line + '\n';
      continue;
    }
    const std::size_t first = line.find_first_not_of(' ');
    const std::size_t gap = line.find("  ", first);
    const std::size_t column = gap == std::string::npos ? first : line.find_first_not_of(' ', gap);
    const std::string rest = wrapped(line.substr(column), column, width);
    text += line.substr(0, column) + rest.substr(column);
  }
  return text;
}

struct FoldedHelp : CLI::Formatter {
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    return folded(CLI::Formatter::make_help(app, std::move(name), mode), TextStyle{}.width);
  }
  // A positional is shown by its value, STUDY.toml, as in messages and in the manual.
  std::string make_option_usage(const CLI::Option* option) const override {
    const std::string name = value_name(*option);
    return option->get_required() ? name : "[" + name + "]";
  }
  std::string make_option_name(const CLI::Option* option, bool positional) const override {
    return positional ? value_name(*option) : CLI::Formatter::make_option_name(option, positional);
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    return option->get_positional() ? "" : CLI::Formatter::make_option_opts(option);
  }
};

// The default options of every command.
struct Commands {
  TrimCommand trim;
  LinearizeCommand linearize;
  ModesCommand modes;
  FollowCommand follow;
  EnvelopeCommand envelope;
  SensitivitiesCommand sensitivities;
  MarginsCommand margins;
  QualitiesCommand qualities;
  LoadsCommand loads;
  ValidateCommand validate;
  SweepCommand sweep;
  MergeCommand merge;
  ProveCommand prove;
  CheckProofCommand check_proof;
  TuneCommand tune;
  SimulateCommand simulate;
  ReportCommand report;
  DiffCommand diff;
  TablesCommand tables;
};

std::vector<Choice> add_all(CLI::App& app, Commands& all) {
  return {choice(add_trim(app, all.trim), all.trim),
          choice(add_linearize(app, all.linearize), all.linearize),
          choice(add_modes(app, all.modes), all.modes),
          choice(add_follow(app, all.follow), all.follow),
          choice(add_envelope(app, all.envelope), all.envelope),
          choice(add_sensitivities(app, all.sensitivities), all.sensitivities),
          choice(add_margins(app, all.margins), all.margins),
          choice(add_qualities(app, all.qualities), all.qualities),
          choice(add_loads(app, all.loads), all.loads),
          choice(add_validate(app, all.validate), all.validate),
          choice(add_sweep(app, all.sweep), all.sweep),
          choice(add_merge(app, all.merge), all.merge),
          choice(add_prove(app, all.prove), all.prove),
          choice(add_check_proof(app, all.check_proof), all.check_proof),
          choice(add_tune(app, all.tune), all.tune),
          choice(add_simulate(app, all.simulate), all.simulate),
          choice(add_report(app, all.report), all.report),
          choice(add_diff(app, all.diff), all.diff),
          choice(add_tables(app, all.tables), all.tables)};
}

// Commands about the program: completion scripts and manual pages.
struct Itself {
  std::string shell, page;
};

std::vector<Choice> add_itself(CLI::App& app, Itself& itself) {
  CLI::App* completion = app.add_subcommand(
      "completion", "print a shell completion script: source <(tiltrim completion bash)");
  completion->add_option("shell", itself.shell, "bash, zsh or fish")
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->type_name("bash|fish|zsh")
      ->required();
  CLI::App* manual =
      app.add_subcommand("manual", "print a manual page (to view it: tiltrim manual | man -l -)");
  manual->add_option("command", itself.page, "command to describe (default: the program)")
      ->type_name("COMMAND");
  for (CLI::App* own : {completion, manual}) own->footer("");
  const auto print = [](const std::string& text) {
    print_whole(text);
    return int(answered);
  };
  return {
      {completion, [&app, &itself, print] { return print(completion_script(app, itself.shell)); }},
      {manual, [&app, &itself, print] { return print(manual_page(app, itself.page)); }}};
}

void check_page(const std::filesystem::path& file) {
  const std::filesystem::path ending = file.extension();
  if (!ending.empty() && ending != ".html" && ending != ".htm")
    throw std::invalid_argument(fmt::format(
        "-o {}: a report is a page; expected a file that ends in .html", file.string()));
}

// Fills in options that depend on others.
void fill_in(const CLI::App& app, Commands& all) {
  for (Common* common :
       {&all.trim.common, &all.linearize.common, &all.modes.common, &all.follow.common,
        &all.envelope.common, &all.sensitivities.common, &all.margins.common, &all.qualities.common,
        &all.loads.common, &all.validate.common, &all.prove.common, &all.check_proof.common,
        &all.tune.common, &all.simulate.common, &all.diff.common, &all.tables.common})
    settle_format(*common);
  for (Common* common : {&all.sweep.common, &all.merge.common}) settle_format(*common, ".nc");
  check_page(all.report.common.output);
  constexpr int many = 200;  // starts, when searching for all equilibria
  if (all.trim.all && app.get_subcommand("trim")->get_option("--starts")->count() == 0)
    all.trim.options.starts = many;
  if (all.report.common.output.empty())
    all.report.common.output = all.report.common.study.stem().string() + ".html";
}

int run_program(int argc, char** argv) {
  CLI::App app{about, "tiltrim"};
  app.formatter(std::make_shared<FoldedHelp>());
  app.set_version_flag("--version", "tiltrim " TILTRIM_VERSION);
  app.footer("\nExamples:" + examples_text("") + study_and_codes);
  app.require_subcommand(1);
  Commands all;
  Itself itself;
  std::vector<Choice> choices = add_all(app, all);
  for (const Choice& c : choices)
    app.get_subcommand(c.command->get_name())
        ->footer("\nExamples:" + examples_text(c.command->get_name()));
  std::ranges::copy(add_itself(app, itself), std::back_inserter(choices));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {  // --help, --version
      const int code = app.exit(e);
      if (!std::cout.flush())
        throw std::runtime_error(
            fmt::format("standard output: {}", std::generic_category().message(errno)));
      return code;
    }
    throw std::invalid_argument(refusal(app, e, argc > 1 ? argv[1] : ""));
  }
  fill_in(app, all);
  const auto chosen = [](const Choice& c) { return bool(*c.command); };
  return std::ranges::find_if(choices, chosen)->go();
}

}  // namespace
}  // namespace tiltrim::cli

// Destructors of JSON allocate, and would end the program where memory has run out. What they need
// is set aside; it is address space alone until then.
static std::atomic<void*> set_aside{};
static void out_of_memory() {
  std::free(set_aside.exchange(nullptr));
  throw std::bad_alloc();
}

int main(int argc, char** argv) {
  set_aside = std::malloc(std::size_t{64} << 20);
  std::set_new_handler(out_of_memory);
  const tiltrim::RoundToNearest environment;  // libraries may have changed it while loading
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the file-size limit fails with an error
  try {
    return tiltrim::cli::run_program(argc, argv);
  } catch (const std::bad_alloc&) {  // formatting a message would need memory
    std::fputs("tiltrim: not enough memory for:", stderr);
    for (int i = 1; i < argc; ++i) {
      std::fputc(' ', stderr);
      std::fputs(argv[i], stderr);
    }
    std::fputc('\n', stderr);
    return tiltrim::cli::bad_input;
  } catch (const std::exception& e) {
    fmt::print(stderr, "tiltrim: {}\n", e.what());
    return tiltrim::cli::bad_input;
  }
}
