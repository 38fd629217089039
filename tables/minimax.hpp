/// Least largest miss of six functions of two numbers, and how far the numbers can move: NLopt
/// behind a counter and a memory of our own. Internal to tables/.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <vector>

namespace tiltrim::minimax {

inline constexpr std::size_t pair_size = 2;
using Pair = std::array<double, pair_size>;
using Misses = std::array<double, 6>;
using Slopes = std::array<Pair, 6>;  // of each miss along the pair

/// A miss up to here leaves every printed digit as it is.
inline constexpr double half_unit = 0.5;
inline constexpr double miss_noise = 1e-9;  // rounding of the six functions, units

/// Thrown where the evaluations allowed are used up, or a search does not settle.
struct OutOfEvaluations {};

double largest(const Misses& misses);

/// The six functions, counted; keeps the best pair seen by a score of the caller's choice.
class Search {
 public:
  using Function = std::function<Misses(const Pair&, Slopes*)>;
  using Score = std::function<double(const Pair&, double worst)>;

  Search(Function six, long max_evaluations) : six_(std::move(six)), max_(max_evaluations) {}

  Misses evaluate(const Pair& z, Slopes* slopes = nullptr);
  /// Forgets the best pair and looks for another.
  void seek(Score by);

  const Pair& best() const { return best_; }
  double best_score() const { return best_score_; }
  long evaluations() const { return evaluations_; }

 private:
  Function six_;
  long max_;
  Score score_ = [](const Pair&, double worst) { return worst; };
  Pair best_{};
  double best_score_ = std::numeric_limits<double>::infinity();
  long evaluations_ = 0;
};

/// A box of pairs; the members with room in it are free.
struct Box {
  Pair lower, upper;
  std::vector<std::size_t> free;

  Box(const Pair& low, const Pair& high);
};

/// Looks everywhere in the box for a small largest miss.
void search_box(Search& search, const Box& box);

/// Least largest miss in the box, from a start; search.best() is where.
double least_miss(Search& search, const Box& box, const Pair& from);

/// How far member j can move, to the side -1 or +1, among pairs that miss by no more than half a
/// unit.
struct RangeEnd {
  double value;
  bool shown;  ///< beyond it no pair was found; otherwise the box ends first
};
RangeEnd range_end(Search& search, const Box& box, const Pair& centre, std::size_t j, double side);

}  // namespace tiltrim::minimax
