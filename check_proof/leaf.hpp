/// A theorem's statement, and the verification of one leaf of its tree. Internal to check_proof/.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "check_proof/roots.hpp"

namespace tiltrim::checking {

struct Bounds {
  double lower = 0, upper = 0;
};
using Box = std::vector<Bounds>;

struct Parameter {
  std::string key;
  Form Numbers::*member = nullptr;  ///< null: the height, which sets V, gamma and eta
  Bounds domain;
};

/// What a theorem is about.
struct Statement {
  std::string condition;
  std::vector<Parameter> parameters;
  double margin = 0;
  double damping = 0;         ///< 0: any
  Numbers numbers;            ///< constants; parameters and scheduled gains replace their own
  std::vector<double> tilts;  ///< of the schedule; empty: constant gains
  std::vector<std::array<double, gain_count>> gains;  ///< one set per tilt
  std::vector<double> alpha;                          ///< nodes of the polar
  std::array<std::vector<double>, 3> coefficients;
  std::optional<Spline> polar;
  Bounds theta0, a1s, delta_e, theta;
  bool actuators = false;  ///< the tubes are of theta, theta0 and a deflection, not of x1 and x2
};

/// Evidence for an equilibrium in the tube z + S d ± Z and the roots there. The tube is of theta,
/// x1 and x2, or of theta, theta0 and the deflection of the actuator that controls pitch.
struct Record {
  std::array<double, 3> z{}, Z{};
  std::array<std::vector<double>, 3> S;
  std::array<std::array<double, 3>, 3> C{};
  std::vector<Half> line;
  int roots = 0;
  std::vector<Half> ray;     ///< of the damping ratio, if the statement has one
  bool less_damped = false;  ///< some root is
};

/// Evidence for no equilibrium: a tree over theta, theta0 and the actuator, in preorder.
struct Node {
  int split = -1;                   ///< of theta, theta0, a1s, delta_e; -1: a leaf
  double at = 0;                    ///< of the split
  std::array<double, 3> weights{};  ///< of the leaf
};
using Exclusion = std::vector<Node>;

enum class Claim { stable, unstable, no_trim, undecided };

struct Leaf {
  std::size_t line = 0;  ///< in the file
  Claim claim = Claim::undecided;
  Box box;
  std::vector<Record> records;
  std::vector<Exclusion> exclusions;
};

/// Of a leaf's box, where the bounds over all of it are too wide.
inline constexpr int most_halvings_of_a_box = 8;

/// Empty if the leaf's claim holds for every number of its box; else what fails.
std::optional<std::string> refuted(const Statement& statement, const Leaf& leaf,
                                   int halvings = most_halvings_of_a_box);

/// A way the equations may read somewhere in a box, with the numbers of that way.
struct Side {
  std::string name;
  Numbers numbers;
  bool cyclic = false, elevator = false;  ///< which of them alone controls pitch, if one does
};
std::vector<Side> sides(const Statement& statement, const Box& box);

/// theta, theta0, and a1s or delta_e.
using Region = std::array<Bounds, 3>;
/// Whether a weighted sum of V', gamma', q' of the airframe has one sign over the region, for every
/// number of a box of `numbers` parameters: then no equilibrium is there.
bool unbalanced(const Statement& statement, const Side& side, std::size_t numbers,
                const Region& region, const std::array<double, 3>& weights);

}  // namespace tiltrim::checking
