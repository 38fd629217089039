#include "sweep/line_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "linearize/eigenvalues.hpp"
#include "sweep/spectrum.hpp"
#include "sweep/track.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

std::uint8_t as_byte(double confidence) {
  const double size = 255 * std::clamp(confidence, 0.0, 1.0);
  const int whole = int(size);
  return std::uint8_t(whole + (size - whole >= 0.5));  // std::lround(size), without a call
}

// Stores the modes of `length` points from k, with their largest real part and smallest damping.
void keep_modes(LineTracker& w, std::size_t k, std::size_t length, const double* const* re,
                const double* const* im) {
  const std::size_t n = std::size_t(w.sweep.states());
  constexpr double least = std::numeric_limits<double>::min();  // zero has no damping
  std::array<double, IsolatedModes::longest> abscissa, damping;
  std::fill_n(abscissa.begin(), length, -std::numeric_limits<double>::infinity());
  std::fill_n(damping.begin(), length, 1.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t m = 0; m < length; ++m) {
      const double x = re[i][m], y = im[i][m], size2 = x * x + y * y;
      abscissa[m] = abscissa[m] < x ? x : abscissa[m];
      const double zeta2 = (0.0 - x * std::abs(x)) / (size2 > least ? size2 : least);
      damping[m] = zeta2 < damping[m] ? zeta2 : damping[m];
    }
    for (std::size_t m = 0; m < length; ++m) {
      w.points.eigenvalue_re[(k + m) * n + i] = re[i][m];
      w.points.eigenvalue_im[(k + m) * n + i] = im[i][m];
    }
  }
  for (std::size_t m = 0; m < length; ++m) {
    w.points.spectral_abscissa[k + m] = abscissa[m];
    // The minimum is of ζ |ζ|, which increases with ζ.
    w.points.damping[k + m] = std::copysign(std::sqrt(std::abs(damping[m])), damping[m]);
  }
}

void keep_modes(LineTracker& w, std::size_t k, const Eigenvalues& modes,
                const std::vector<std::uint8_t>& confidence) {
  std::array<double, largest_batch_matrix> re{}, im{};
  std::array<const double*, largest_batch_matrix> re_at{}, im_at{};
  for (std::size_t i = 0; i < modes.size(); ++i) {
    re[i] = modes[i].real();
    im[i] = modes[i].imag();
    re_at[i] = &re[i];
    im_at[i] = &im[i];
  }
  keep_modes(w, k, 1, re_at.data(), im_at.data());
  std::ranges::copy(confidence, w.points.confidence.begin() + std::ptrdiff_t(k * modes.size()));
}

// Propagates the order of the modes along the line from its first equilibrium.
struct Following {
  LineTracker& w;
  const BatchEigenvalues& all;
  std::optional<Reference> from;  // the previous point
  Eigenvalues before{};           // and the modes of the one before it
  Eigenvalues lambda, predicted, ordered;
  std::vector<int> to{}, to_before{};  // mode i is lambda[to[i]]; empty: linked by eigenvectors
  std::vector<double> sure;
  std::vector<std::uint8_t> confidence;
  IsolatedModes isolated{};
  std::size_t last = 0, last_but_one = 0;

  Following(LineTracker& walk, const BatchEigenvalues& eigenvalues,
            const std::optional<Reference>& start, std::size_t n)
      : w(walk),
        all(eigenvalues),
        from(start),
        lambda(n),
        predicted(n),
        ordered(n),
        sure(n),
        confidence(n) {}

  std::complex<double> eigenvalue(std::size_t i, std::size_t k) const {
    return {all.re[i * w.count + k], all.im[i * w.count + k]};
  }
  bool known(std::size_t k) const {
    return w.valid[k] && all.status[k] < LaneStatus::not_converged;
  }
  void predict(std::size_t k) {
    const std::vector<double>& v = w.coordinates();
    predicted = from->modes;
    if (before.empty()) return;
    const double ratio = (v[k] - v[last]) / (v[last] - v[last_but_one]);
    for (std::size_t i = 0; i < lambda.size(); ++i)
      if (side(before[i]) == side(from->modes[i]))  // after a split the path is not straight
        predicted[i] += ratio * (from->modes[i] - before[i]);
  }
  bool by_position() {
    to.resize(lambda.size());
    if (!link_by_position(from->modes, predicted, lambda, to, sure) &&
        !link_meeting(from->modes, predicted, lambda, to, sure))
      return false;
    for (std::size_t i = 0; i < lambda.size(); ++i) {
      ordered[i] = lambda[std::size_t(to[i])];
      confidence[i] = as_byte(sure[i]);
    }
    return true;
  }
  void by_vectors(std::size_t k) {
    GridPlace here = w.place, there = w.place;
    here[w.axis] = double(last);
    there[w.axis] = double(k);
    const bool within = w.valid[last] && last < k;  // otherwise it belongs to another line
    if (within) from->A = w.A.matrix(Index(last));
    const Ordered linked =
        in_order(*from, predicted, w.A.matrix(Index(k)), lambda,
                 within ? trims_between(w.sweep, here, there, w.at(last)) : nullptr);
    ordered = linked.modes;
    confidence = linked.confidence;
    to.clear();
  }
  void go_on(std::size_t k) {
    std::swap(from->modes, ordered);
    if (k > 0) before.assign(ordered.begin(), ordered.end());
    to_before = to;
    last_but_one = std::exchange(last, k);
  }

  // Handles many points at once while modes are well separated; returns their number.
  std::size_t run(std::size_t k, std::size_t most) {
    const bool straight =
        k >= 2 && last == k - 1 && last_but_one == k - 2 && !to.empty() && to == to_before;
    if (!straight) return 0;
    const std::vector<double>& v = w.coordinates();
    std::array<double, IsolatedModes::longest> ratio;
    std::size_t length = 0;
    for (; length < std::min(most, w.count - k) && known(k + length); ++length) {
      const double* const at = &v[k + length];
      ratio[length] = (at[0] - at[-1]) / (at[-1] - at[-2]);
    }
    std::array<const double*, largest_batch_matrix> re{}, im{};
    for (std::size_t i = 0; i < to.size(); ++i) {
      re[i] = &all.re[std::size_t(to[i]) * w.count + k];
      im[i] = &all.im[std::size_t(to[i]) * w.count + k];
    }
    isolated.assign(from->modes);
    length = isolated.stay(re.data(), im.data(), std::span(ratio).first(length));
    if (length == 0) return 0;
    keep_modes(w, k, length, re.data(), im.data());
    std::fill_n(&w.points.confidence[k * to.size()], length * to.size(), 255);
    for (std::size_t m = 0; m < length; ++m)
      for (std::size_t i = 0; i < to.size() && !isolated.certain(m); ++i)
        w.points.confidence[(k + m) * to.size() + i] = as_byte(isolated.confidence(i, m));
    last = k + length - 1;
    last_but_one = last - 1;
    for (std::size_t i = 0; i < to.size(); ++i) {
      before[i] = eigenvalue(std::size_t(to[i]), last_but_one);
      from->modes[i] = eigenvalue(std::size_t(to[i]), last);
    }
    return length;
  }
};

}  // namespace

void follow_modes(LineTracker& w, const LineStart& start, const BatchEigenvalues& all) {
  Following f(w, all, start.reference, std::size_t(w.sweep.states()));
  for (std::size_t k = 0; k < w.count; ++k) {
    std::size_t run = IsolatedModes::longest / 16;
    while (const std::size_t length = k < w.count ? f.run(k, run) : 0) {
      k += length;
      run = length == run ? std::min(2 * run, IsolatedModes::longest)
                          : std::max<std::size_t>(length, 4);
    }
    if (k == w.count) break;
    if (!f.known(k)) continue;
    for (std::size_t i = 0; i < f.lambda.size(); ++i) f.lambda[i] = f.eigenvalue(i, k);
    if (!f.from) {  // no previous point: its own order
      f.from = Reference{w.A.matrix(Index(k)), f.lambda};
      keep_modes(w, k, f.lambda, f.confidence);
      f.last = k;
      continue;
    }
    f.predict(k);
    const bool foreseen = k == 0 || !f.before.empty();
    if (!foreseen || !f.by_position()) f.by_vectors(k);
    if (k == 0) f.confidence = start.confidence;
    keep_modes(w, k, f.ordered, f.confidence);
    f.go_on(k);
  }
}

Eigenvalues eigenvalues_of(const MatrixXd& A) {
  if (!A.allFinite()) return {};
  const Eigen::VectorXcd lambda = eigenvalues(A);
  return {lambda.begin(), lambda.end()};
}

Ordered in_order(const Reference& from, const Eigenvalues& predicted, const MatrixXd& B,
                 const Eigenvalues& lambda,
                 const std::function<std::optional<MatrixXd>(double)>& between) {
  Link found{std::vector<int>(lambda.size()), std::vector<double>(lambda.size())};
  const bool first = predicted == from.modes;  // no prediction yet
  if (first || !link_by_position(from.modes, predicted, lambda, found.to, found.confidence))
    found = link(from.A, from.modes, predicted, B, lambda, between);
  Ordered ordered;
  for (std::size_t i = 0; i < lambda.size(); ++i) {
    ordered.modes.push_back(lambda[std::size_t(found.to[i])]);
    ordered.confidence.push_back(as_byte(found.confidence[i]));
  }
  return ordered;
}

std::function<std::optional<MatrixXd>(double)> trims_between(const Prepared& sweep,
                                                             const GridPlace& from,
                                                             const GridPlace& to,
                                                             const OperatingPoint& near) {
  return [&sweep, from, to, near](double share) -> std::optional<MatrixXd> {
    GridPlace place = from;
    for (std::size_t axis = 0; axis < place.size(); ++axis)
      place[axis] += share * (to[axis] - from[axis]);
    const auto e = settle(sweep, place, near);
    if (!e) return {};
    return e->A(sweep);
  };
}

namespace {

// Bound of the effect of differentiation errors on an eigenvalue of any matrix, by Elsner:
// (2 |A| + |E|)^(1-1/n) |E|^(1/n) [31].
double reach_of_differences(const MatrixXd& A) {
  constexpr double relative = 1e-9;  // of the matrix's norm, or of 1/s: well above their errors
  const double size = A.norm(), error = relative * std::max(1.0, size);
  return (2 * size + error) * std::pow(error / (2 * size + error), 1.0 / double(A.rows()));
}

}  // namespace

bool by_matrix(bool exact, TrimStatus status) { return exact && status != TrimStatus::singular; }

void judge_near_axis(LineTracker& w) {
  for (std::size_t k = 0; k < w.count; ++k) {
    if (!w.valid[k] || std::isnan(w.points.spectral_abscissa[k])) continue;
    if (by_matrix(w.exact[k], TrimStatus(w.points.status[k]))) continue;
    const double reach = reach_of_differences(w.A.matrix(Index(k)));
    if (!(std::abs(w.points.spectral_abscissa[k]) <= reach)) continue;
    const double any_rate = std::numeric_limits<double>::infinity();
    const LinearModel linear = linearize(w.sweep.model(), w.at(k), {.tolerance = any_rate});
    const Verdict verdict = linear ? modes(linear).verdict : Verdict::undecided;
    w.points.verdict[k] = std::int8_t(verdict);
  }
}

}  // namespace tiltrim
