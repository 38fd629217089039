/// The steps of a proof on one box. Internal to prove/.
#pragma once

#include <complex>

#include "model/branches.hpp"
#include "prove/prove.hpp"

namespace tiltrim::proving {

using Jets = std::vector<Jet>;  // one per signal
using Record = ProofNode::Record;

inline constexpr std::size_t most_parameters = 8;  // of a box
inline constexpr std::size_t most_moving = 16;     // states and unknown inputs

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
  std::vector<Eigen::Index> placed;  // variable of each parameter, without `numbers`
  std::size_t states, moving;        // moving: states and unknown inputs

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
  Jets numbers() const;  // the parameters on the box
};

/// The model's variables on a cell, on one side of the switches; of unknowns the guess.
struct Known {
  Jets x, u, p;
  std::size_t next = 0;  // comparisons it took
};
Known known(const Setup& setup, const Cell& cell);

enum class Along { nothing, unknowns, states };  // derivatives along what

/// [f; h] with the unknowns at these functions of the box.
Jets evaluate(const Setup& setup, const Known& known, const Jets& unknowns, Along along);

/// A failure: its cause and the parameter to cut, or -1: the widest.
struct Failure {
  std::string cause{};
  int cut = -1;
  // What each parameter adds to the failing quantity; and what a remainder of an entry of [f; h],
  // or of the matrix ∂f/∂x, adds to it: one column, or one per state.
  Eigen::VectorXd share{};
  Eigen::MatrixXd weight{};
};

/// The parameter that adds most to a failure, remainders included.
int worst(const Setup& setup, const Cell& cell, const Record& tube, const Branches& sides,
          const Failure& failure);

/// What is found of a box.
struct Answer {
  ProofVerdict verdict = ProofVerdict::undecided;
  Failure failure{"stopped", -1, {}, {}};
  std::vector<Record> sides{};
  Eigen::VectorXd z{};
  Eigen::MatrixXd S{};
  bool found = false;    // a tube of equilibria within the limits
  bool trimmed = false;  // z was searched for here
};

struct Tube {
  Record record;
  Jets unknowns;  // that solve the equations, to second order
  Jets over;      // [f; h] there, with derivatives along the states
  Jets line;      // [f; h] on the tube's centre line
  std::optional<Failure> failed;
  bool trimmed = false;  // near the middle of the box there is an equilibrium
};
/// A tube of equilibria; `sides` has the outcomes of open comparisons.
Tube find_tube(const Setup& setup, const Cell& cell, const Eigen::VectorXd& start, Branches sides);

/// What number k of the box adds to it.
double share_of(const Quadratic& of, std::size_t k);
/// The parameter that moves it most.
int widest_share(const Quadratic& of);

/// Whether all limits hold (1), some fail for all of the box (-1) or neither (0, with failure).
int within_limits(const Setup& setup, const Tube& tube, Failure& failure);

/// Whether they hold at the middle of the box, as far as seen.
bool middle_within_limits(const Setup& setup, const Tube& tube);

/// What is required of every eigenvalue: docs/prove.md.
struct Required {
  double margin = 0.0, damping = 0.0;
};
/// Counts the roots right of the line Re s = -margin and, if a damping ratio is required, those
/// with less; false with failure if it cannot.
bool count_roots(const Setup& setup, Tube& tube, const Required& required, Failure& failure);

/// Proves that no equilibrium exists within the limits; fills record.absent.
bool prove_absent(const Setup& setup, const Cell& cell, const Branches& sides, Record& record);

}  // namespace tiltrim::proving
