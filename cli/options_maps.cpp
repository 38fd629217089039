// Options of the commands on maps.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <string>

#include "cli/options.hpp"
#include "cli/within.hpp"
#include "sweep/verdict_map.hpp"

namespace tiltrim::cli {

namespace {

// "2/4"
SweepPart part_of(const std::string& text) {
  SweepPart part;
  const char *const end = text.data() + text.size(), *at = text.data();
  const auto number = [&](std::uint64_t& to) {
    const auto [next, error] = std::from_chars(at, end, to);
    const bool found = error == std::errc() && next != at;
    at = next;
    return found;
  };
  const bool parsed = number(part.number) && at != end && *at++ == '/' && number(part.of);
  if (!parsed || at != end || part.number < 1 || part.number > part.of)
    throw CLI::ValidationError(
        "--part", fmt::format("{} is not a part; expected I/N with I from 1 to N", text));
  return part;
}

}  // namespace

CLI::App* add_sweep(CLI::App& app, SweepCommand& command) {
  CLI::App* sweep = app.add_subcommand(
      "sweep", "eigenvalues over a grid of the study's [[sweep.axis]], and between its points");
  add_common(sweep, command.common, true);
  add_only(sweep, command.common);
  add_threads(sweep, command.threads);
  sweep
      ->add_option("--checkpoint", command.checkpoint,
                   "seconds between writes to FILE.log, from which a sweep can be resumed (1)")
      ->check(within(0.0, 1e6))
      ->type_name("S");
  sweep
      ->add_option_function<std::string>(
          "--part", [&command](const std::string& text) { command.part = part_of(text); },
          "only part I of N of a map with detail = \"verdict\"; see merge")
      ->type_name("I/N");
  return sweep;
}

CLI::App* add_merge(CLI::App& app, MergeCommand& command) {
  CLI::App* merge =
      app.add_subcommand("merge", "one map of the parts that sweep --part wrote, in any order");
  merge->add_option("parts", command.parts, "all parts of the map")
      ->type_name("PART.nc...")
      ->required();
  add_output(merge, command.common);
  return merge;
}

CLI::App* add_diff(CLI::App& app, DiffCommand& command) {
  CLI::App* diff =
      app.add_subcommand("diff", "which points of two maps differ in status or stability");
  diff->add_option("before", command.common.study, "a map written by sweep")
      ->type_name("BEFORE.nc")
      ->required();
  diff->add_option("after", command.after, "another, over the same grid")
      ->type_name("AFTER.nc")
      ->required();
  add_output(diff, command.common);
  return diff;
}

}  // namespace tiltrim::cli
