/// Minimax of six functions of two variables, and the range of each variable: NLopt with a count of
/// evaluations and a record of the best pair. Internal to tables/.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <vector>

namespace tiltrim::minimax {

inline constexpr std::size_t pair_size = 2;
using Pair = std::array<double, pair_size>;
using Misses = std::array<double, 6>;
using Slopes = std::array<Pair, 6>;  // of each deviation with respect to the pair

/// A deviation up to here reproduces every printed digit.
inline constexpr double half_unit = 0.5;
inline constexpr double miss_noise = 1e-9;  // rounding of the six functions, units

/// Thrown if the allowed evaluations are used up, or a search does not converge.
struct OutOfEvaluations {};

double largest(const Misses& misses);

/// Evaluates and counts the six functions; keeps the best pair by a score of the caller's choice.
class Search {
 public:
  using Function = std::function<Misses(const Pair&, Slopes*)>;
  using Score = std::function<double(const Pair&, double worst)>;

  Search(Function six, long max_evaluations) : six_(std::move(six)), max_(max_evaluations) {}

  Misses evaluate(const Pair& z, Slopes* slopes = nullptr);
  /// Discards the best pair and starts a new search.
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

/// A box of pairs; members with nonzero width are free.
struct Box {
  Pair lower, upper;
  std::vector<std::size_t> free;

  Box(const Pair& low, const Pair& high);
};

/// Global search of the box for a small largest deviation.
void search_box(Search& search, const Box& box);

/// The minimum of the largest deviation in the box, from a start; search.best() is its location.
double least_miss(Search& search, const Box& box, const Pair& from);

/// The end of member j's range, on the side -1 or +1, among pairs that deviate by at most half a
/// unit.
struct RangeEnd {
  double value;
  bool shown;  ///< no pair was found beyond it; otherwise the box ends first
};
RangeEnd range_end(Search& search, const Box& box, const Pair& centre, std::size_t j, double side);

}  // namespace tiltrim::minimax
