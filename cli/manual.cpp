// Manual pages in roff (man), generated from the same options as --help.
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <stdexcept>

#include "cli/options.hpp"

namespace tiltrim::cli {

namespace {

// Escapes text for roff: literal hyphens, no line that begins with a request.
std::string roff(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((i == 0 || text[i - 1] == '\n') && (c == '.' || c == '\'')) out += "\\&";
    out += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
  }
  return out;
}

std::string option_entry(const CLI::Option& option) {
  const std::string value = "\\fI" + roff(value_name(option)) + "\\fR";
  std::string name;
  for (const std::string& flag : flags(option))
    name += fmt::format("{}\\fB{}\\fR", name.empty() ? "" : ", ", roff(flag));
  if (takes_value(option)) name += (name.empty() ? "" : " ") + value;
  return fmt::format(".TP\n{}\n{}\n", name, roff(option.get_description()));
}

std::string options_of(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : command.get_options({})) text += option_entry(*option);
  for (const CLI::App* group : command.get_subcommands({}))
    if (group->get_name().empty()) text += options_of(*group);
  return text;
}

std::string synopsis(const CLI::App& command) {
  std::string text = fmt::format("\\fBtiltrim {}\\fR", command.get_name());
  for (const CLI::Option* option :
       command.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string name = fmt::format("\\fI{}\\fR", roff(value_name(*option)));
    text += option->get_required() ? " " + name : " [" + name + "]";
  }
  return text + " [\\fIoptions\\fR]";
}

std::string examples_of(const std::string& command) {
  std::string text = ".SH EXAMPLES\n";
  for (const Example& e : examples())
    if (command.empty() || e.command == command)
      text += fmt::format(".TP\n\\fBtiltrim {}\\fR\n{}\n", roff(e.line), roff(e.answers));
  return text;
}

std::string head(const std::string& name, const std::string& what) {
  std::string title = name;
  std::ranges::transform(title, title.begin(),
                         [](unsigned char c) { return char(std::toupper(c)); });
  return fmt::format(".TH {} 1 \"\" \"tiltrim {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n",
                     roff(title), TILTRIM_VERSION, roff(name), roff(what));
}

constexpr const char* exit_status =
    ".SH EXIT STATUS\n"
    ".TP\n0\nEvery condition is answered.\n"
    ".TP\n1\nSome condition has no verified answer; the rest are still written.\n"
    ".TP\n2\nBad input; the message names file, line and key.\n"
    ".TP\n128 + n\nStopped by signal n; results finished before it are printed.\n";

std::string page_of_command(const CLI::App& command) {
  const std::string name = command.get_name();
  return head("tiltrim-" + name, command.get_description()) +
         fmt::format(".SH SYNOPSIS\n{}\n.SH OPTIONS\n{}", synopsis(command), options_of(command)) +
         examples_of(name) + exit_status + ".SH SEE ALSO\n.BR tiltrim (1)\n";
}

std::string page_of_program(const CLI::App& app) {
  std::string commands, see;
  for (const CLI::App* command : app.get_subcommands({})) {
    commands +=
        fmt::format(".TP\n\\fB{}\\fR\n{}\n", command->get_name(), roff(command->get_description()));
    see += fmt::format("{}.BR tiltrim\\-{} (1)", see.empty() ? "" : ",\n", command->get_name());
  }
  return head("tiltrim", "trim and linear stability of flight-dynamics models") +
         fmt::format(
             ".SH SYNOPSIS\n\\fBtiltrim\\fR \\fIcommand\\fR [\\fIoptions\\fR]\n.SH "
             "DESCRIPTION\n{}\n"
             ".SH COMMANDS\n{}",
             roff(app.get_description()), commands) +
         examples_of("") + exit_status + ".SH SEE ALSO\n" + see + "\n";
}

}  // namespace

std::string manual_page(const CLI::App& app, const std::string& command) {
  if (command.empty()) return page_of_program(app);
  std::vector<std::string> names;
  for (const CLI::App* c : app.get_subcommands({})) {
    names.push_back(c->get_name());
    if (names.back() == command) return page_of_command(*c);
  }
  throw std::invalid_argument(
      fmt::format("no command '{}'; there are: {}", command, fmt::join(names, ", ")));
}

}  // namespace tiltrim::cli
