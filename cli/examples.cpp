// The examples in the program's help and manual.
#include <fmt/core.h>

#include "cli/options.hpp"

namespace tiltrim::cli {

const std::vector<Example>& examples() {
  static const std::vector<Example> all{
      {"trim", "trim studies/paper.toml", "equilibria of climb, transition and level flight"},
      {"trim", "trim studies/stall.toml --all", "every equilibrium of each condition"},
      {"linearize", "linearize studies/paper.toml", "eigenvalues, modes and stability verdicts"},
      {"linearize", "linearize studies/levitation.toml",
       "the same for a user's equations in a study"},
      {"linearize", "linearize studies/paper.toml -o paper.json", "every digit, as JSON"},
      {"linearize", "linearize studies/paper.toml --models paper.mat", "A, B, C, D for MATLAB"},
      {"modes", "modes studies/boeing747.csv", "eigenvalues and modes of any matrix"},
      {"follow", "follow studies/stall.toml", "a branch of trims: folds, limits, crossings"},
      {"follow", "follow studies/paper.toml --only level --parameter V --to 8", "over the speed"},
      {"envelope", "envelope studies/stall.toml --only level", "the conversion corridor"},
      {"sensitivities", "sensitivities studies/paper.toml",
       "parameters ranked by their effect on each mode"},
      {"margins", "margins studies/paper.toml --bode bode.csv", "stability margins, Bode data"},
      {"qualities", "qualities studies/boeing747.toml", "levels of MIL-F-8785C, distances to them"},
      {"loads", "loads studies/xv15_loads.toml",
       "forces of wing, tail, rotors, ... at given states"},
      {"validate", "validate xv15",
       "our loads, trims, hover runs and poles against the published ones"},
      {"sweep", "sweep studies/map_corridor.toml",
       "eigenvalues over a grid, and crossings between its points"},
      {"sweep", "sweep studies/map_two_gains.toml -o map.nc", "a map that can be resumed"},
      {"merge", "merge part1.nc part2.nc -o map.nc", "a map from the parts of sweep --part"},
      {"prove", "prove studies/prove_corridor.toml",
       "a theorem: trim and stability at every height of the corridor"},
      {"check-proof", "check-proof corridor.proof",
       "verify every statement of a certificate, without the prover"},
      {"tune", "tune studies/tune_corridor.toml",
       "gains optimized for the worst case over the operating points"},
      {"simulate", "simulate studies/transition.toml", "the flight from take-off to level flight"},
      {"simulate", "simulate studies/transition.toml --monte-carlo", "10,000 scattered flights"},
      {"report", "report studies/paper.toml", "everything on one page: paper.html"},
      {"diff", "diff before.nc after.nc", "where two maps differ in status or stability"},
      {"tables", "tables", "the paper's Tables 1-3, recomputed and audited"},
  };
  return all;
}

std::string examples_text(const std::string& command) {
  std::string text;
  for (const Example& e : examples())
    if (command.empty() || e.command == command)
      text += fmt::format("\n  tiltrim {}\n      {}", e.line, e.answers);
  return text;
}

}  // namespace tiltrim::cli
