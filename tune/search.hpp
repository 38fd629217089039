/// The search for gains: candidates counted, the best one remembered, local searches from it.
/// Internal to tune/.
#pragma once

#include <chrono>
#include <random>

#include "tune/requirement.hpp"

namespace tiltrim {

/// A candidate as the searches see it: y in [0, 1]ⁿ, each gain linear or logarithmic between its
/// bounds.
class Search {
 public:
  Search(const TuneProblem& problem, const TuneOptions& options);

  Eigen::Index gains() const { return std::ssize(problem.gains); }
  Eigen::VectorXd gains_at(const Eigen::VectorXd& y) const;
  /// dgain/dy.
  Eigen::VectorXd scales_at(const Eigen::VectorXd& y) const;

  struct Seen {
    Eigen::VectorXd y;
    std::vector<PointModes> points;
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
  void keep();
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  bool last_has_slopes_ = false;
};

/// Two eigenvalues of a point that meet where they decide, on the real axis or (two upper members
/// of pairs) off it.
struct Meeting {
  std::size_t point;
  std::complex<double> middle;
  bool real;
};
/// Those of the best that decide, or nearly, and are near to each other.
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
