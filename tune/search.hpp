/// The search for gains: candidates counted, the best one remembered, local searches from it.
/// Internal to tune/.
#pragma once

#include <chrono>
#include <random>

#include "tune/requirement.hpp"

namespace tiltrim {

/// A candidate as the searches see it: y in [0, 1]ⁿ, each tuned number linear or logarithmic
/// between its bounds.
class Search {
 public:
  Search(const TuneProblem& problem, const TuneOptions& options);

  Eigen::Index variables() const { return Eigen::Index(problem.variables()); }
  const std::vector<Requirement>& asked() const { return candidates.asked(); }
  /// In SI units.
  Eigen::VectorXd numbers_at(const Eigen::VectorXd& y) const;
  /// The y of such numbers, each cut to its bounds.
  Eigen::VectorXd place_of(const Eigen::VectorXd& numbers) const;
  /// Their slopes in y.
  Eigen::VectorXd scales_at(const Eigen::VectorXd& y) const;

  struct Seen {
    Eigen::VectorXd y;
    std::vector<PlaceModes> places;
    Merit merit;
  };
  /// Counted; the last one is remembered, since a solver asks for a point's functions one by one.
  /// Throws EndSearch when the budget or the time is used up or a stop is asked for.
  const Seen& evaluate(const Eigen::VectorXd& y, bool slopes);

  const TuneProblem& problem;
  const TuneOptions& options;
  Candidates candidates;
  Seen last, best;
  std::vector<Seen> kept;  ///< the best of each neighbourhood, best first
  long evaluations = 0;
  bool interrupted = false, out_of_time = false, out_of_evaluations = false;

 private:
  const FreeGain& gain_of(Eigen::Index variable) const;
  void keep();
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  bool last_has_slopes_ = false;
  std::string decides_;  // deciding(), of the best
};

/// What holds the best where it is, in words: requirement, point, where in the scatter.
std::string deciding(const Search& search);

/// Two eigenvalues of a place that meet where they decide, on the real axis or (two upper members
/// of pairs) off it.
struct Meeting {
  std::size_t place;
  std::complex<double> middle;
  double apart;
  bool real;
};
/// Those of the best that decide, or nearly, and are near to each other; nearest first.
std::vector<Meeting> meetings_at(const Search& search, double within);

/// From anywhere.
void search_globally(Search& search);
/// From y and no farther than `radius`: the epigraph form with slopes, or without (`local`). At
/// most `evaluations` more.
void search_locally(Search& search, Eigen::VectorXd y, LocalSearch local, double radius,
                    int evaluations);
/// From the best, where eigenvalues that decide coalesce: they are held together. True if better.
bool search_coalesced(Search& search, double within, double radius, int evaluations);

}  // namespace tiltrim
