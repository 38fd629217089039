/// @file
/// Proof of trim and stability over a box of parameters, by ranges rounded outward.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "model/jet.hpp"
#include "model/model.hpp"

namespace tiltrim {

class Log;

/// A problem for prove().
struct ProveProblem {
  /// A system of equations that every equilibrium within the limits solves: where it has no
  /// solution over bounded unknowns, there is no equilibrium.
  struct NecessarySystem {
    Model model;                           ///< with jets
    std::vector<std::string> equations{};  ///< states whose rates vanish
    /// Unknown states and inputs with their bounds, all finite.
    std::vector<std::pair<std::string, Range>> unknowns{};
    /// x, u, p at parameters c; of the unknowns any value. Unknowns that a side of a switch fixes
    /// are given there as a constant with `fixed` set.
    struct Values {
      std::vector<Jet> x;         ///< states
      std::vector<Jet> u;         ///< inputs
      std::vector<Jet> p;         ///< parameters
      std::vector<char> fixed{};  ///< one per unknown, or none
    };
    std::function<Values(const std::vector<Jet>& c)> at{};  ///< as Values has it
  };

  std::string name;                       ///< of the condition
  Model model;                            ///< with jets
  std::vector<std::string> unknowns{};    ///< states and inputs; other states are as in `guess`
  std::vector<std::string> equations{};   ///< states whose rates vanish
  std::map<std::string, Range> limits{};  ///< on unknowns and outputs
  OperatingPoint guess;                   ///< starting point, and what does not vary
  std::vector<Uncertain> parameters{};    ///< the box
  /// The model's parameters at c, the values of `parameters`. Empty: by name.
  std::function<std::vector<Jet>(const std::vector<Jet>& c)> numbers{};
  /// [f; h] as a function of the unknowns, if the model's jets, from which ∂f/∂x is taken, have
  /// other derivatives along them; with the same values and comparisons. Empty: the model's.
  decltype(Model::jets) trim{};
  /// Starting values of the unknowns at c. Empty: `guess`.
  std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd& c)> start{};
  std::optional<NecessarySystem> necessary{};  ///< empty: absence of a trim is not proved
};

/// What is proved of a part of the box.
enum class ProofVerdict { stable, unstable, no_trim, undecided };
std::string to_string(ProofVerdict verdict);  ///< "proved_stable", ..., "undecided"

/// A node of the bisection tree.
struct ProofNode {
  /// Evidence of one side of the switches on a box: docs/prove.md.
  struct Record {
    Eigen::VectorXd z, Z;                 ///< centre and radii of the tube
    Eigen::MatrixXd S, C, T;              ///< its slopes; preconditioner; basis
    std::vector<double> w;                ///< frequencies, one more than directions
    std::vector<std::complex<double>> v;  ///< directions
    int roots = 0;                        ///< right of the line
    /// The same along the ray of the damping ratio, if one is required.
    std::vector<double> ray_w{};
    std::vector<std::complex<double>> ray_v{};  ///< directions
    int outside = 0;                            ///< roots of less damping
    /// A node of the tree over the unknowns that excludes a trim.
    struct Exclusion {
      int split = -1;             ///< unknown, or -1: `weights`
      double at = 0.0;            ///< where
      Eigen::VectorXd weights{};  ///< of the equations
    };
    std::vector<Exclusion> absent{};  ///< preorder; of no_trim
  };

  int split = -1;                                  ///< parameter that is cut, or -1: a leaf
  double at = 0.0;                                 ///< where
  std::size_t lower = 0, upper = 0;                ///< the two parts' nodes
  ProofVerdict verdict = ProofVerdict::undecided;  ///< of a leaf
  std::string cause{};          ///< of undecided: "crossing", "fold", "limit", "switch", ...
  std::vector<Range> box{};     ///< one per parameter
  double volume = 0.0;          ///< share of the whole
  std::vector<Record> sides{};  ///< evidence
};

/// What prove() has shown of the whole box.
enum class ProofStatus { proved, partly, refuted };
std::string to_string(ProofStatus status);  ///< "proved", "partly", "refuted"

/// The result of prove().
struct Theorem {
  std::string name;                                             ///< of the condition
  std::vector<Uncertain> parameters{};                          ///< the box
  std::vector<std::string> unknowns{};                          ///< of the tubes
  double margin = 0.0;                                          ///< decay rate [1/s]
  double damping = 0.0;                                         ///< damping ratio
  std::vector<ProofNode> tree{};                                ///< the first is the whole box
  std::size_t boxes = 0;                                        ///< examined
  double stable = 0, unstable = 0, no_trim = 0, undecided = 0;  ///< shares of the volume
  std::vector<ProofNode> regions{};  ///< neighboring boxes with one verdict, as one
  bool interrupted = false;          ///< stopped by the caller
  ProofStatus status() const;        ///< proved: nothing unstable, nothing undecided
};

/// Options of prove().
struct ProveOptions {
  double margin = 0.0;             ///< σ: all eigenvalues have a real part below -σ [1/s]
  double damping = 0.0;            ///< and a damping ratio above this, from 0 to below 1; 0: any
  std::size_t max_boxes = 20000;   ///< examined at most
  double smallest = 1e-10;         ///< share of a parameter's range that is not cut further
  double undecided = 0.0;          ///< stop once the undecided volume is at most this share
  bool refuted_is_enough = false;  ///< stop at the first box that is unstable
  std::stop_token stop{};          ///< what is proved until then is kept
  std::function<void(double proved, std::size_t boxes)> observe{};  ///< progress
  /// Of examined boxes (runtime/log.hpp): those found in it are not examined again. Its identity
  /// must distinguish problems and margins. Not used by prove_largest_margin().
  Log* log = nullptr;
  std::uint64_t log_part = 0;  ///< which of the proofs that share the log
};

/// Proves, for every value of the parameters within their ranges, that there is exactly one
/// equilibrium in a stated tube, within the limits, and that every eigenvalue has a real part below
/// -margin and a damping ratio above options.damping; or that some eigenvalue violates this; or
/// that there is no equilibrium within the limits. Throws std::invalid_argument if the model has no
/// jets or a name is unknown.
[[nodiscard]] Theorem prove(const ProveProblem& problem, const ProveOptions& options = {});

/// The same for the largest margin of at least options.margin that it can prove, to within 1 % of
/// itself, by bisection; the search ends where a proof needs more than options.max_boxes. If
/// options.margin itself cannot be proved, returns the theorem for options.margin.
[[nodiscard]] Theorem prove_largest_margin(const ProveProblem& problem,
                                           const ProveOptions& options = {});

}  // namespace tiltrim
