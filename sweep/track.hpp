/// Mode identity: which eigenvalue of the next matrix is which of this one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace tiltrim {

/// A one-to-one assignment from the modes of one matrix to the eigenvalues of the next.
struct Link {
  std::vector<int> to;             ///< mode i goes on as eigenvalue to[i]
  std::vector<double> confidence;  ///< of each, 0 .. 1; docs/sweep.md says what it means
};

struct TrackOptions {
  double trusted = 0.5;   ///< a link below it is refined between the two points
  int max_depth = 12;     ///< halvings of a step; what is not trusted then stays at its confidence
  int max_between = 256;  ///< matrices between the two points; the same holds when they are used up
};

/// By position alone, where that leaves no doubt: every eigenvalue is nearer to its predicted
/// place than a third of the way to any other, real ones stay real and the members of a pair stay
/// on their side of the real axis. False if it does leave doubt; `to` and `confidence` are then
/// unspecified. No allocation: it runs once for each point of a map. Throws std::invalid_argument
/// if the sizes differ.
bool link_by_position(std::span<const std::complex<double>> predicted,
                      std::span<const std::complex<double>> next, std::span<int> to,
                      std::span<double> confidence);

/// The same, and false as well where two modes pass each other, or turn about each other by more
/// than 60°, on their way from `last`: there position cannot tell a crossing from a veering.
bool link_by_position(std::span<const std::complex<double>> last,
                      std::span<const std::complex<double>> predicted,
                      std::span<const std::complex<double>> next, std::span<int> to,
                      std::span<double> confidence);

/// The same where a pair is about to part or two real modes have joined into one, far from all
/// others: the two are linked as a pair, as in link(). False where the others are not six times as
/// far as the two are from their middle and that from its predicted place.
bool link_meeting(std::span<const std::complex<double>> last,
                  std::span<const std::complex<double>> predicted,
                  std::span<const std::complex<double>> next, std::span<int> to,
                  std::span<double> confidence);

/// Modes at one place, each with a disc about it: a part of its distance to the nearest other.
/// While all stay in their discs none can pass another, turn about it by more than 60° or leave the
/// real axis: n distances at each point where link_by_position() has n².
struct IsolatedModes {
  std::vector<std::complex<double>> modes;
  std::vector<double> gap;  ///< of each to the nearest other

  void assign(std::span<const std::complex<double>> at);
  static constexpr std::size_t longest = 64;
  /// How many points of a line, `longest` at most, stay there and follow the straight line through
  /// the two points before each as link_by_position() asks. Mode i is at re[i][m], im[i][m] at
  /// point m, from m = -2 on; step_ratio[m] is the step to m over the one before. None where a pair
  /// has just parted or joined.
  std::size_t stay(const double* const* re, const double* const* im,
                   std::span<const double> step_ratio);
  /// Of mode i at point m then: at most link_by_position()'s.
  double confidence(std::size_t i, std::size_t m) const;
  bool certain(std::size_t m) const;  ///< all modes' are 1 to half a 255th

 private:
  std::vector<double> off;  // squares of the distances from the straight line, over the gaps
  std::array<double, longest> worst{};
};

/// By eigenvector correlation and predicted position together, one to one, at least total cost
/// (the assignment problem). Pairs that merge into two real eigenvalues, or two that join into a
/// pair, are linked as a pair: the member with the positive imaginary part is the larger real one.
/// `last` are the eigenvalues of A in the modes' order, `predicted` where the last steps point to
/// (equal to `last` at a first step), `next` those of B, all in 1/s. Throws std::invalid_argument
/// if sizes differ, something is not finite or `last` or `next` are not in conjugate pairs.
[[nodiscard]] Link link(const Eigen::MatrixXd& A, std::span<const std::complex<double>> last,
                        std::span<const std::complex<double>> predicted, const Eigen::MatrixXd& B,
                        std::span<const std::complex<double>> next);

/// The same with refinement: where a link is not trusted the step is halved, between(share) being
/// the matrix at that share of the way (nothing where there is none), and the halves' links are
/// joined: the confidence of a chain is that of its weakest link.
[[nodiscard]] Link link(const Eigen::MatrixXd& A, std::span<const std::complex<double>> last,
                        std::span<const std::complex<double>> predicted, const Eigen::MatrixXd& B,
                        std::span<const std::complex<double>> next,
                        const std::function<std::optional<Eigen::MatrixXd>(double share)>& between,
                        const TrackOptions& options = {});

}  // namespace tiltrim
