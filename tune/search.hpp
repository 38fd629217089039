/// The search for gains: counts candidates, stores the best one, and searches locally from it.
/// Internal to tune/.
#pragma once

#include <chrono>
#include <random>
#include <tuple>

#include "tune/requirement.hpp"

namespace tiltrim {

/// The budget or the time is used up, or a stop was requested.
struct EndSearch {};

/// Candidates in normalized coordinates: y in [0, 1]ⁿ, each tuned value linear or logarithmic
/// between its bounds.
class Search {
 public:
  Search(const TuneProblem& problem, const TuneOptions& options);

  Eigen::Index variables() const { return Eigen::Index(problem.variables()); }
  const std::vector<Requirement>& asked() const { return candidates.asked(); }
  /// Tuned values in SI units.
  Eigen::VectorXd numbers_at(const Eigen::VectorXd& y) const;
  /// The y of given values, each limited to its bounds.
  Eigen::VectorXd place_of(const Eigen::VectorXd& numbers) const;
  /// Derivatives of the values with respect to y.
  Eigen::VectorXd scales_at(const Eigen::VectorXd& y) const;

  struct Seen {
    Eigen::VectorXd y;
    std::vector<PlaceModes> places;
    Merit merit;
  };
  /// Evaluates and counts a candidate. The last one is cached, as solvers call a point's functions
  /// separately. Throws EndSearch when the budget or time is used up or a stop is requested.
  const Seen& evaluate(const Eigen::VectorXd& y);
  /// What it evaluates counts for nothing, and ends only if a stop is requested.
  template <class Work>
  void beyond_budget(const Work& work) {
    const std::tuple before(evaluations, out_of_evaluations, out_of_time);
    unlimited = true;
    try {
      work();
    } catch (const EndSearch&) {
    }
    unlimited = false;
    std::tie(evaluations, out_of_evaluations, out_of_time) = before;
  }
  /// The last candidate, with derivatives at these places as well.
  const Seen& with_slopes(const std::vector<std::size_t>& at);

  const TuneProblem& problem;
  const TuneOptions& options;
  Candidates candidates;
  Seen last, best;
  Seen own;                ///< best since the current start; reset by the caller
  std::vector<Seen> kept;  ///< best of each neighbourhood, best first
  long evaluations = 0, starts = 0;
  double stationary =
      std::numeric_limits<double>::quiet_NaN();  ///< of the best, when a start ended
  double lowest_goal = 0.0, highest_goal = 0.0;  ///< over all candidates with trims
  bool unlimited = false;                        ///< no budget, for what is measured at the end
  bool interrupted = false, out_of_time = false, out_of_evaluations = false;

 private:
  const FreeGain& gain_of(Eigen::Index variable) const;
  void keep();
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::string decides_;  // deciding() for the best
};

/// Uniform in [0, 1]ⁿ.
Eigen::VectorXd random_point(std::mt19937_64& random, Eigen::Index n);

/// What limits the best candidate, as text: requirement, point, uncertain parameters.
std::string deciding(const Search& search);

/// Two decisive eigenvalues of a place that coalesce, on the real axis or (two upper members of
/// pairs) off it.
struct Meeting {
  std::size_t place;
  std::complex<double> middle;
  double apart;
  bool real;
};
/// Those of the start's best candidate that are decisive, or nearly, and close together; closest
/// first.
std::vector<Meeting> meetings_at(const Search& search, double within);

/// NLopt's global search, of a length that depends only on the number of variables; none for
/// multistart.
void search_globally(Search& search);
/// From y, within `radius`: the epigraph form with derivatives, or a method without (`local`). At
/// most `evaluations` further evaluations.
void search_locally(Search& search, Eigen::VectorXd y, LocalSearch local, double radius,
                    int evaluations);
/// From the start's best, where decisive eigenvalues coalesce: they are kept together. True if
/// better.
bool search_coalesced(Search& search, double within, double radius, int evaluations);

}  // namespace tiltrim
