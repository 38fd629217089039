/// One set of gains at all places: trims, eigenvalues, scores of the requirements, and their
/// derivatives with respect to the gains. Internal to tune/.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sweep/neighbour.hpp"
#include "tune/measures.hpp"
#include "tune/shift.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// An operating point with one set of uncertain parameters, preprocessed.
struct Place {
  Achieved::Place where;
  SweepRequest request;
  std::unique_ptr<Prepared> prepared;
  const Model* loops = nullptr;           // the point's model with inputs, if margins are required
  const Model* responses = nullptr;       // the same for transfers; null: the point's own
  std::vector<Eigen::Index> gains;        // variables of the model
  std::vector<Eigen::Index> uncertain;    // variables of the model
  Eigen::VectorXd shares;                 // weight of each schedule breakpoint, summing to one
  std::optional<OperatingPoint> nearest;  // an equilibrium at other gains
};

/// The results of a candidate at one place.
struct PlaceModes {
  TrimStatus status = TrimStatus::not_found;
  std::string message;
  OperatingPoint at;
  Eigen::MatrixXd A;
  std::shared_ptr<const GridTrim> trim;  ///< at which the slopes are computed when asked for
  Eigen::VectorXcd eigenvalues;
  Eigen::MatrixXcd slopes;       ///< dλ/dvariable, [eigenvalue, variable], with the trim's shift
  Eigen::VectorXd scores;        ///< [asked] for requirements on the whole system; otherwise NaN
  Eigen::MatrixXd score_slopes;  ///< [asked, variable]

  bool valid() const { return eigenvalues.size() > 0; }
  bool has_slopes() const { return slopes.size() > 0; }
};

/// The problem's points at every corner and sample, each with its most recent equilibrium.
class Candidates {
 public:
  Candidates(const TuneProblem& problem, const TrimOptions& trimming);

  const TuneProblem& problem() const { return problem_; }
  const std::vector<Requirement>& asked() const { return asked_; }
  /// The goals are the first of these.
  bool is_goal(std::size_t asked) const { return asked < goals_of(problem_); }
  const std::vector<Place>& places() const { return places_; }
  /// Results for tuned values in SI units, computed in parallel.
  std::vector<PlaceModes> at(const Eigen::VectorXd& variables, bool slopes);
  /// Adds derivatives to results of at(), at those of `places` that are valid and lack them.
  void add_slopes(std::vector<PlaceModes>& all, const std::vector<std::size_t>& places) const;
  /// The same with every trim computed anew, not from a neighbour's.
  std::vector<PlaceModes> anew(const Eigen::VectorXd& variables);
  /// A point with other uncertain parameters, starting from the equilibrium of its place.
  PlaceModes scattered(std::size_t place, const Eigen::VectorXd& variables,
                       const Eigen::VectorXd& uncertain) const;

 private:
  enum class From { nearest, nothing };
  PlaceModes modes(const Place& place, const Eigen::VectorXd& variables, From from,
                   const Eigen::VectorXd& uncertain) const;
  PlaceModes computed(const Place& place, const Eigen::VectorXd& variables, From from,
                      const Eigen::VectorXd& uncertain) const;
  void differentiate(const Place& place, PlaceModes& modes) const;
  GridTrim settled(const Place& place, const Eigen::VectorXd& gains,
                   const Eigen::VectorXd& uncertain, From from) const;
  void describe(const Place& place, const GridTrim& e, const EigenvalueSlopes& spectrum,
                bool slopes, PlaceModes& result) const;
  void difference_scores(const Place& place, const GridTrim& e, PlaceModes& result) const;

  const TuneProblem& problem_;
  std::vector<Requirement> asked_;
  std::vector<Place> places_;
};

/// The gains at a place with these schedule weights; `variables` are ordered gain by gain.
Eigen::VectorXd gains_of(const Eigen::VectorXd& variables, const Eigen::VectorXd& shares);

}  // namespace tiltrim
