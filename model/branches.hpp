/// Which side of each comparison a proof follows. Internal to model/ and prove/.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tiltrim {

/// The outcomes of comparisons while a model is evaluated on ranges. A comparison that a range
/// leaves open has two sides; which one holds must not depend on the unknowns.
struct Branches {
  std::vector<char> taken{};  ///< outcomes of the comparisons of known quantities, in order
  std::size_t next = 0;       ///< position in `taken`; what follows is appended
  std::vector<char> open{};   ///< whether each of `taken` was open: both outcomes are possible
  bool blocked = false;       ///< a comparison of unknowns was open, or one contradicts `taken`
  bool replay = false;        ///< `taken` is complete: a further open comparison blocks
  bool values = false;        ///< no derivatives are wanted: |a| of a range across zero is a range
  /// The first function of a formula that blocks or has no known value, and where:
  /// "switch: abs in the rate of 'v'", "undefined: sqrt in the output 'lift'".
  std::string trouble{};
};

/// The sides of this thread; null: an open comparison gives NaN.
inline thread_local Branches* current_branches = nullptr;

/// Makes these the sides of this thread during its lifetime.
class BranchScope {
 public:
  explicit BranchScope(Branches& sides) { current_branches = &sides; }  ///< from now on
  ~BranchScope() { current_branches = nullptr; }
  BranchScope(const BranchScope&) = delete;
  BranchScope& operator=(const BranchScope&) = delete;
};

}  // namespace tiltrim
