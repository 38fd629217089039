// Shell completion scripts, generated from the same options as --help.
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>

#include "cli/options.hpp"

namespace tiltrim::cli {

std::vector<std::string> flags(const CLI::Option& option) {
  std::vector<std::string> all;
  for (const std::string& s : option.get_snames()) all.push_back("-" + s);
  for (const std::string& l : option.get_lnames()) all.push_back("--" + l);
  return all;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string value_name(const CLI::Option& option) {
  const std::string name = option.get_type_name();  // includes the range, "N:INT in [0 - 9]"
  return name.substr(0, name.find(':'));
}

namespace {

using Options = std::vector<const CLI::Option*>;

Options named(const CLI::App& command) {
  Options all = command.get_options([](const CLI::Option* o) { return o->nonpositional(); });
  for (const CLI::App* group : command.get_subcommands({}))
    if (group->get_name().empty()) std::ranges::copy(named(*group), std::back_inserter(all));
  return all;
}

std::vector<const CLI::App*> commands(const CLI::App& app) { return app.get_subcommands({}); }

// "csv json text" for an option with these choices.
std::string choices(const CLI::Option& option) {
  std::string names = option.get_type_name();
  if (names.find('|') == names.npos) return {};
  std::ranges::replace(names, '|', ' ');
  return names;
}

// The first argument without a flag; null if there is none.
const CLI::Option* positional(const CLI::App& command) {
  const auto all = command.get_options([](const CLI::Option* o) { return o->get_positional(); });
  return all.empty() ? nullptr : all.front();
}

// Ending of the positional argument: "toml" for STUDY.toml; empty if the command takes no file.
std::string positional_ending(const CLI::App& command) {
  const CLI::Option* first = positional(command);
  const std::string name = first ? first->get_type_name() : std::string();
  const std::size_t dot = name.rfind('.');
  return dot == name.npos ? std::string() : name.substr(dot + 1);
}

std::string positional_choices(const CLI::App& command) {
  const CLI::Option* first = positional(command);
  return first ? choices(*first) : std::string();
}

std::string bash(const CLI::App& app) {
  std::vector<std::string> names;
  std::string words, values;
  for (const CLI::App* command : commands(app)) {
    names.push_back(command->get_name());
    std::vector<std::string> all;
    for (const CLI::Option* option : named(*command)) {
      for (const std::string& flag : flags(*option)) {
        all.push_back(flag);
        const std::string among = choices(*option);
        if (!among.empty())
          values +=
              fmt::format("    '{} {}') COMPREPLY=($(compgen -W '{}' -- \"$word\")); return ;;\n",
                          command->get_name(), flag, among);
        else if (takes_value(*option))
          values += fmt::format("    '{} {}') COMPREPLY=($(compgen -f -- \"$word\")); return ;;\n",
                                command->get_name(), flag);
      }
    }
    const std::string among = positional_choices(*command), ending = positional_ending(*command);
    const std::string rest = !among.empty()    ? fmt::format("-W '{}'", among)
                             : !ending.empty() ? fmt::format("-f -X '!*.{}'", ending)
                                               : "-f";
    words += fmt::format("    {}) flags='{}'; rest=(compgen -o plusdirs {}) ;;\n",
                         command->get_name(), fmt::join(all, " "), rest);
  }
  return fmt::format(R"(# Completes the commands and options of tiltrim in bash:
#   source <(tiltrim completion bash)
_tiltrim() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} flags rest
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{} --help --version' -- "$word"))
    return
  fi
  case "${{COMP_WORDS[1]}} $before" in
{}  esac
  case "${{COMP_WORDS[1]}}" in
{}    *) return ;;
  esac
  case "$word" in
    -*) COMPREPLY=($(compgen -W "$flags" -- "$word")) ;;
    *) COMPREPLY=($("${{rest[@]}}" -- "$word")) ;;
  esac
}}
complete -o filenames -F _tiltrim tiltrim
)",
                     fmt::join(names, " "), values, words);
}

// Text for single quotes in a shell, without characters that zsh's _arguments interprets.
std::string quoted(std::string text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      out += std::string("\\") + c;
    else
      out += c;
  }
  return out;
}

std::string zsh(const CLI::App& app) {
  std::string described, cases;
  for (const CLI::App* command : commands(app)) {
    described +=
        fmt::format("  '{}:{}'\n", command->get_name(), quoted(command->get_description()));
    cases += fmt::format("  {})\n    _arguments", command->get_name());
    for (const CLI::Option* option : named(*command)) {
      const std::string among = choices(*option);
      const std::string value = !takes_value(*option) ? ""
                                : among.empty()
                                    ? fmt::format(":{}:_files", quoted(value_name(*option)))
                                    : fmt::format(":value:({})", among);
      for (const std::string& flag : flags(*option))
        cases +=
            fmt::format(" \\\n      '{}[{}]{}'", flag, quoted(option->get_description()), value);
    }
    const std::string among = positional_choices(*command), ending = positional_ending(*command);
    if (!among.empty())
      cases += fmt::format(" \\\n      '1:value:({})'", among);
    else if (!ending.empty())
      cases += fmt::format(" \\\n      '*:file:_files -g \"*.{}\"'", ending);
    cases += "\n    ;;\n";
  }
  return fmt::format(R"(#compdef tiltrim
# Completes the commands and options of tiltrim in zsh: save it as _tiltrim in a folder of $fpath.
local -a all
all=(
{})
if (( CURRENT == 2 )); then
  _describe command all
  return
fi
shift words
(( CURRENT-- ))
case $words[1] in
{}esac
)",
                     described, cases);
}

std::string fish(const CLI::App& app) {
  std::string text =
      "# Completes the commands and options of tiltrim in fish:\n"
      "#   tiltrim completion fish > ~/.config/fish/completions/tiltrim.fish\n"
      "complete -c tiltrim -n __fish_use_subcommand -l help -d 'Print the help'\n"
      "complete -c tiltrim -n __fish_use_subcommand -l version -d 'Print the version'\n";
  const auto escaped = [](const std::string& words) {
    std::string out;
    for (const char c : words)
      out += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    return out;
  };
  for (const CLI::App* command : commands(app)) {
    const std::string name = command->get_name();
    text += fmt::format("complete -c tiltrim -f -n __fish_use_subcommand -a {} -d '{}'\n", name,
                        escaped(command->get_description()));
    for (const CLI::Option* option : named(*command)) {
      text += fmt::format("complete -c tiltrim -n '__fish_seen_subcommand_from {}'", name);
      for (const std::string& s : option->get_snames()) text += " -s " + s;
      for (const std::string& l : option->get_lnames()) text += " -l " + l;
      const std::string among = choices(*option);
      if (!among.empty())
        text += fmt::format(" -x -a '{}'", among);
      else if (takes_value(*option))
        text += " -r";
      text += fmt::format(" -d '{}'\n", escaped(option->get_description()));
    }
    if (const std::string among = positional_choices(*command); !among.empty())
      text += fmt::format("complete -c tiltrim -f -n '__fish_seen_subcommand_from {}' -a '{}'\n",
                          name, among);
  }
  return text;
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  return shell == "bash" ? bash(app) : shell == "zsh" ? zsh(app) : fish(app);
}

}  // namespace tiltrim::cli
