/// Mode tracking: which eigenvalue of the next matrix continues each mode of this one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace tiltrim {

/// A one-to-one assignment of the modes of one matrix to the eigenvalues of the next.
struct Link {
  std::vector<int> to;             ///< mode i continues as eigenvalue to[i]
  std::vector<double> confidence;  ///< of each, 0 .. 1; defined in docs/sweep.md
};

struct TrackOptions {
  double trusted = 0.5;   ///< a link below this confidence is refined between the two points
  int max_depth = 12;     ///< bisections of a step; links then keep their confidence
  int max_between = 256;  ///< limit on the matrices between the two points; with the same effect
};

/// By position only, if that is unambiguous: every eigenvalue is closer to its predicted place than
/// a third of its distance to any other, real ones stay real, and the members of a pair stay on
/// their side of the real axis. Otherwise false, with `to` and `confidence` unspecified. Does not
/// allocate: it runs once per point of a map. Throws std::invalid_argument if the sizes differ.
bool link_by_position(std::span<const std::complex<double>> predicted,
                      std::span<const std::complex<double>> next, std::span<int> to,
                      std::span<double> confidence);

/// The same, but also false if two modes pass each other, or rotate around each other by more than
/// 60°, on the way from `last`: position cannot distinguish a crossing from a veering there.
bool link_by_position(std::span<const std::complex<double>> last,
                      std::span<const std::complex<double>> predicted,
                      std::span<const std::complex<double>> next, std::span<int> to,
                      std::span<double> confidence);

/// The same where a pair is about to split or two real modes have joined, far from all others: the
/// two are linked as a pair, as in link(). False unless the others are six times as far away as the
/// two are from their middle, and as the middle is from its predicted place.
bool link_meeting(std::span<const std::complex<double>> last,
                  std::span<const std::complex<double>> predicted,
                  std::span<const std::complex<double>> next, std::span<int> to,
                  std::span<double> confidence);

/// Modes at one point, each with a disk whose radius is a fraction of its distance to the nearest
/// other. While all stay in their disks they cannot pass each other, rotate around each other by
/// more than 60° or leave the real axis. Needs n distances per point; link_by_position() needs n².
struct IsolatedModes {
  std::vector<std::complex<double>> modes;
  std::vector<double> gap;  ///< distance of each to the nearest other

  void assign(std::span<const std::complex<double>> at);
  static constexpr std::size_t longest = 64;
  /// How many points of a line, at most `longest`, stay in the disks and follow the straight line
  /// through the two points before each as link_by_position() requires. Mode i is at re[i][m],
  /// im[i][m] at point m, from m = -2; step_ratio[m] is the step to m over the previous one. Zero
  /// if a pair has just split or joined.
  std::size_t stay(const double* const* re, const double* const* im,
                   std::span<const double> step_ratio);
  /// Confidence of mode i at point m: at most that of link_by_position().
  double confidence(std::size_t i, std::size_t m) const;
  bool certain(std::size_t m) const;  ///< all confidences are 1 to within half of 1/255

 private:
  std::vector<double> off;  // squared distances from the straight line, over the gaps
  std::array<double, longest> worst{};
};

/// By eigenvector correlation and predicted position together, one to one, at minimum total cost
/// (the assignment problem). Pairs that split into two real eigenvalues, or two that join into a
/// pair, are linked as a pair: the member with positive imaginary part is the larger real one.
/// `last` are the eigenvalues of A in mode order, `predicted` their extrapolation (equal to `last`
/// at a first step), `next` those of B, all in 1/s. Throws std::invalid_argument if sizes differ or
/// are above 16, a value is not finite, or `last` or `next` are not in conjugate pairs.
[[nodiscard]] Link link(const Eigen::MatrixXd& A, std::span<const std::complex<double>> last,
                        std::span<const std::complex<double>> predicted, const Eigen::MatrixXd& B,
                        std::span<const std::complex<double>> next);

/// The same with refinement: if the confidence is too low the step is bisected, with
/// between(fraction) the matrix at that fraction of the way (empty if there is none), and the links
/// of the halves are joined: the confidence of a chain is that of its weakest link.
[[nodiscard]] Link link(const Eigen::MatrixXd& A, std::span<const std::complex<double>> last,
                        std::span<const std::complex<double>> predicted, const Eigen::MatrixXd& B,
                        std::span<const std::complex<double>> next,
                        const std::function<std::optional<Eigen::MatrixXd>(double share)>& between,
                        const TrackOptions& options = {});

}  // namespace tiltrim
