/// One choice of gains at all places: trims, eigenvalues, what is asked of them, and how all of it
/// moves with the gains. Internal to tune/.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sweep/neighbour.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// An operating point somewhere in the scatter, made ready.
struct Place {
  TunePlace where;
  SweepRequest request;
  std::unique_ptr<Prepared> prepared;
  const Model* loops = nullptr;           // the point's, if margins are asked for
  std::vector<Eigen::Index> gains;        // variables of the model
  std::vector<Eigen::Index> uncertain;    // the same
  Eigen::VectorXd shares;                 // of each place of the schedule, summing to one
  std::optional<OperatingPoint> nearest;  // an equilibrium at other gains
};

/// What is known of a candidate at one place.
struct PlaceModes {
  TrimStatus status = TrimStatus::not_found;
  std::string message;
  OperatingPoint at;
  Eigen::MatrixXd A;
  Eigen::VectorXcd eigenvalues;
  Eigen::MatrixXcd slopes;  ///< dλ/dvariable, [eigenvalue, variable], the trim's shift included
  Eigen::VectorXd scores;   ///< [asked] of those that no single eigenvalue decides; else NaN
  Eigen::MatrixXd score_slopes;  ///< [asked, variable]

  bool valid() const { return eigenvalues.size() > 0; }
};

/// The problem's points at every corner and sample, each with the equilibrium it was last at.
class Candidates {
 public:
  Candidates(const TuneProblem& problem, const TrimOptions& trimming);

  const std::vector<Requirement>& asked() const { return asked_; }
  const std::vector<Place>& places() const { return places_; }
  /// At tuned numbers in SI units, by all threads.
  std::vector<PlaceModes> at(const Eigen::VectorXd& variables, bool slopes);
  /// The same from trims of their own, not from a neighbour's.
  std::vector<PlaceModes> anew(const Eigen::VectorXd& variables);
  /// A point with its uncertain numbers elsewhere, from the equilibrium that its place has.
  PlaceModes scattered(std::size_t place, const Eigen::VectorXd& variables,
                       const Eigen::VectorXd& uncertain) const;

 private:
  enum class From { nearest, nothing };
  PlaceModes modes(const Place& place, const Eigen::VectorXd& variables, bool slopes, From from,
                   const Eigen::VectorXd& uncertain) const;
  PlaceModes computed(const Place& place, const Eigen::VectorXd& variables, bool slopes, From from,
                      const Eigen::VectorXd& uncertain) const;
  GridTrim settled(const Place& place, const Eigen::VectorXd& gains,
                   const Eigen::VectorXd& uncertain, From from) const;
  void describe(const Place& place, const GridTrim& e, bool slopes, PlaceModes& result) const;

  const TuneProblem& problem_;
  std::vector<Requirement> asked_;
  std::vector<Place> places_;
};

/// The gains at a place whose shares of the schedule are these; variables gain by gain.
Eigen::VectorXd gains_of(const Eigen::VectorXd& variables, const Eigen::VectorXd& shares);

}  // namespace tiltrim
