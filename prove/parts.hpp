/// The steps of a proof on one box. Internal to prove/.
#pragma once

#include <complex>

#include "prove/prove.hpp"

namespace tiltrim::proving {

/// The problem with names resolved.
struct Setup {
  const ProveProblem& problem;
  std::vector<Eigen::Index> unknowns;   // variables of the model
  std::vector<Eigen::Index> equations;  // rows of [f; h]
  struct Limit {
    Eigen::Index unknown, row;  // one is -1
    Range range;
  };
  std::vector<Limit> limits;
  std::vector<Eigen::Index> placed;        // variable of each parameter, without `numbers`
  std::size_t states, directions, moving;  // moving: states and unknown inputs

  explicit Setup(const ProveProblem& p);
  std::size_t nz() const { return unknowns.size(); }
  std::size_t k() const { return problem.parameters.size(); }
  std::size_t direction(std::size_t unknown) const;  // of an unknown among the directions
};

/// A box of parameters: middle and a radius that covers it.
struct Cell {
  std::vector<Range> box;
  std::vector<double> m, r;
  explicit Cell(std::vector<Range> box);
};

/// [f; h] over the record's tube, or at its middle. The directions are the states and unknown
/// inputs, as deviations from the tube's centre line, and the parameters along that line.
Jets evaluate(const Setup& setup, const Record& tube, const Cell& cell, bool middle, bool curved);

/// A failure: its cause and the parameter to cut.
struct Failure {
  std::string cause;
  std::size_t cut = 0;
};

struct Tube {
  Record record;
  Jets centre, over;  // [f; h] at the middle, and over the tube
  std::optional<Failure> failed;
};
/// A tube of equilibria; `taken` are the outcomes of open comparisons.
Tube find_tube(const Setup& setup, const Cell& cell, const Eigen::VectorXd& start, Branches sides);

/// Whether all limits hold (1), some fail for all of the box (-1) or neither (0, with failure).
int within_limits(const Setup& setup, const Tube& tube, Failure& failure);

/// Counts the roots right of the line Re s = -margin; false with failure if it cannot.
bool count_roots(const Setup& setup, Tube& tube, double margin, Failure& failure);

/// Proves that no equilibrium exists within the limits; fills record.absent.
bool prove_absent(const Setup& setup, const Cell& cell, const Branches& sides, Record& record);

}  // namespace tiltrim::proving
