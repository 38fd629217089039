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
  CLI::App* sweep = app.add_subcommand("sweep",
                                       "map eigenvalues and stability over the study's "
                                       "[[sweep.axis]]; locate crossings between the grid points");
  add_common(sweep, command.common, true);
  sweep->get_option("--output")
      ->description("write the output to this file (never a partial file); FILE.nc: as NetCDF");
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
      app.add_subcommand("merge", "merge the parts written by sweep --part into one map");
  merge->add_option("parts", command.parts, "all parts of the map, in any order")
      ->type_name("PART.nc...")
      ->required();
  add_output_file(merge, command.common, "MAP.nc",
                  "required: write the map to this NetCDF file (never a partial file)");
  add_formats(merge, command.common, {"text", "markdown", "latex"},
              "format of the summary on standard output: text (default), markdown or latex");
  return merge;
}

CLI::App* add_diff(CLI::App& app, DiffCommand& command) {
  CLI::App* diff =
      app.add_subcommand("diff", "list the points at which two maps differ in status or stability");
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
