// Crossings of eigenvalues with the imaginary axis on a line of matrices.
#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <numeric>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/modes.hpp"
#include "sweep/boundary.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double safety = 4.0;      // on the second difference as a bound between samples
constexpr double jump_size = 1e-6;  // nominal sizes: a larger change over `least` is a jump
constexpr int most_pieces = 4000;   // of one step of the grid

// A(t) in the eigenvectors at the middle, at the ends of the piece, minus the middle's eigenvalues.
struct Piece {
  Eigen::VectorXcd lambda;  // at the middle
  MatrixXcd at_a, at_b;     // X⁻¹ (A(a) - A(m)) X, the same at b
  double rounding;          // of an eigenvalue, in the matrix's own norm
};

std::optional<Piece> in_eigenvectors(const Sample& a, const Sample& m, const Sample& b) {
  const Balanced balanced = balance(m.A);
  const Index n = m.A.rows();
  const auto alike = [&](const MatrixXd& A) {
    MatrixXd B(n, n);
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j)
        B(i, j) = A(balanced.order[std::size_t(i)], balanced.order[std::size_t(j)]) *
                  (balanced.scale[j] / balanced.scale[i]);
    return B;
  };
  const dense::Eigensystem middle = dense::eigensystem(balanced.B);
  if (!middle.converged) return {};
  const MatrixXcd& X = middle.V;
  const dense::LU<MatrixXcd> lu = dense::lu(X);
  constexpr double units = 64;  // rounding units that an eigenvalue of a balanced matrix may be off
  Piece piece{middle.values, dense::solve(lu, alike(a.A - m.A) * X),
              dense::solve(lu, alike(b.A - m.A) * X),
              units * std::numeric_limits<double>::epsilon() * balanced.B.norm()};
  if (!piece.at_a.allFinite() || !piece.at_b.allFinite()) return {};  // defective at the middle
  return piece;
}

struct Judged {
  std::vector<Index> unclear;  // eigenvalues of the middle whose disks may reach the axis
  bool monotone = false;       // only one unclear eigenvalue or pair, with monotone real part
  bool rounding = false;       // its motion within the piece is at rounding level
};

Judged judge(const Piece& p, Index riding) {
  const Index n = p.lambda.size();
  std::vector<Index> nearest(p.lambda.size());  // to the axis first
  std::iota(nearest.begin(), nearest.end(), Index{0});
  std::ranges::stable_sort(nearest, {}, [&](Index i) { return std::abs(p.lambda[i].real()); });
  const std::vector<Index> left_out(nearest.begin(), nearest.begin() + riding);
  const MatrixXcd bend = p.at_a + p.at_b;  // A(a) - 2 A(m) + A(b)
  // A smooth curve deviates from the halves of the polygon by at most bend/8.
  const VectorXd off = safety / 8 * bend.cwiseAbs().rowwise().sum();
  const auto reach = [&](const MatrixXcd& E, Index i) {
    const VectorXd row = E.row(i).cwiseAbs();
    return std::abs(E(i, i).real()) + row.sum() - row[i] + off[i];
  };
  Judged j;
  double most = 0.0;
  for (Index i = 0; i < n; ++i) {
    if (std::ranges::find(left_out, i) != left_out.end()) continue;
    const double moved = std::max(reach(p.at_a, i), reach(p.at_b, i));
    if (std::abs(p.lambda[i].real()) > moved) continue;
    j.unclear.push_back(i);
    most = std::max(most, std::abs(p.lambda[i].real()) + moved);
  }
  j.rounding = !j.unclear.empty() && most <= p.rounding;
  if (j.unclear.empty() || j.unclear.size() > 2) return j;
  const Index i = j.unclear.front();
  const bool pair = j.unclear.size() == 2;
  if (pair && p.lambda[j.unclear[1]] != std::conj(p.lambda[i])) return j;
  if (!pair && p.lambda[i].imag() != 0) return j;
  // dλ/dτ = B'ᵢᵢ,  |d²λ/dτ²| <= |B''ᵢᵢ| + 2 Σ |B'ᵢⱼ B'ⱼᵢ| / |λᵢ - λⱼ|, τ = -1 .. 1.         [26]
  const MatrixXcd slope = 0.5 * (p.at_b - p.at_a);
  double curvature = std::abs(bend(i, i)), gap = std::numeric_limits<double>::infinity();
  for (Index k = 0; k < n; ++k) {
    if (k == i) continue;
    gap = std::min(gap, std::abs(p.lambda[i] - p.lambda[k]));
    curvature += 2 * std::abs(slope(i, k) * slope(k, i)) / std::abs(p.lambda[i] - p.lambda[k]);
  }
  const double moved = std::max(reach(p.at_a, i), reach(p.at_b, i));
  j.monotone = gap > safety * moved && std::abs(slope(i, i).real()) > safety * curvature;
  return j;
}

// True if the three may lie on one curve: a jump between two of them makes up all of the bend.
bool continuous(const MatrixLine& line, const Sample& a, const Sample& m, const Sample& b) {
  const double left = line.apart(a, m), right = line.apart(m, b), whole = line.apart(a, b);
  const double most = std::max(left, right);
  if (most <= jump_size) return true;
  constexpr double all = 0.9;  // a parabola from its vertex has two thirds
  return std::min(left, right) >= (1 - all) * most || whole <= most * (1 - all);
}

// The real part that changes sign when the number of unstable eigenvalues changes as given.
double crossing_part(const Sample& s, int before, int after) {
  const Index k = s.eigenvalues.size() - 1 - std::min(before, after);
  return s.eigenvalues[k].real();
}

class Search {
 public:
  Search(const MatrixLine& line, double from, const std::optional<Sample>& a, double to,
         const std::optional<Sample>& b, double least, std::vector<LineEvent>& events,
         std::vector<Sample>& seen, Index riding)
      : line_(line),
        least_(least),
        length_(to - from),
        size_(std::max(a ? a->A.norm() : 0.0, b ? b->A.norm() : 0.0)),
        apart_(a && b ? line.apart(*a, *b) : 0.0),
        change_(a && b ? (a->A - b->A).norm() : 0.0),
        events_(events),
        seen_(seen),
        riding_(riding) {}

  void look(double from, const std::optional<Sample>& a, double to,
            const std::optional<Sample>& b) {
    if (!a && !b) return;
    if (std::abs(to - from) <= least_ || ++pieces_ > most_pieces) return ended(from, a, to, b);
    const double middle = 0.5 * (from + to);
    std::optional<Sample> m = line_.sample(middle, a ? *a : *b);
    if (!m && a && b) m = line_.sample(middle, *b);
    if (m) seen_.push_back(*m);
    if (a && m && b && continuous(line_, *a, *m, *b)) {
      if (const auto piece = in_eigenvectors(*a, *m, *b)) {
        const Judged judged = judge(*piece, riding_);
        // An end may lie on the axis, where its own number of unstable eigenvalues is that of no
        // side.
        if (judged.unclear.empty() && a->unstable() == b->unstable()) return;
        if (judged.rounding) return ended(from, a, to, b, true);
        if (judged.monotone && (a->unstable() == b->unstable() || locate(*a, *b))) return;
      }
    }
    look(from, a, middle, m);
    look(middle, m, to, b);
  }

 private:
  // Records a piece that cannot be bisected further. Adjacent pieces of this kind are one event.
  void ended(double from, const std::optional<Sample>& a, double to, const std::optional<Sample>& b,
             bool rounding = false) {
    const bool goes_on = ended_at_ && *ended_at_ == from;
    if (!goes_on) {
      events_.push_back({from, to});
      begin_ = a;
    }
    ended_at_ = to;
    LineEvent& e = events_.back();
    e.right = to;
    e.before = begin_ ? begin_->unstable() : -1;
    e.after = b ? b->unstable() : -1;
    e.kind = CrossingKind::end;
    if (!begin_ || !b) return;
    const Index changed = b->eigenvalues.size() - 1 - std::min(e.before, e.after);
    const double frequency = changed >= 0 ? std::abs(b->eigenvalues[changed].imag()) : 0.0;
    e.kind = !rounding && jumps(*begin_, *b) ? CrossingKind::jump
             : e.before == e.after           ? CrossingKind::touch
             : frequency > 0                 ? CrossingKind::hopf
                                             : CrossingKind::zero;
    e.frequency = e.kind == CrossingKind::hopf ? frequency : 0.0;
  }

  // The equilibrium or the matrix differs by more than so short a piece can explain.
  bool jumps(const Sample& a, const Sample& b) const {
    constexpr double steep = 100.0;  // of the mean slope
    const double share = steep * std::abs((b.t - a.t) / length_);
    return line_.apart(a, b) > jump_size + share * apart_ ||
           (a.A - b.A).norm() > jump_size * size_ + share * change_;
  }

  // Locates the only crossing between a and b; false if it cannot be bracketed.
  bool locate(const Sample& a, const Sample& b) {
    const int before = a.unstable(), after = b.unstable();
    std::optional<Sample> at;
    bool lost = false;
    const auto real_part = [&](double t) {
      at = line_.sample(t, a);
      if (!at) at = line_.sample(t, b);
      lost = lost || !at;
      return at ? crossing_part(*at, before, after) : 0.0;
    };
    boost::uintmax_t most = 60;
    const double at_a = crossing_part(a, before, after), at_b = crossing_part(b, before, after);
    if (!(at_a * at_b < 0)) return false;
    const auto [low, high] = boost::math::tools::toms748_solve(
        real_part, std::min(a.t, b.t), std::max(a.t, b.t), a.t < b.t ? at_a : at_b,
        a.t < b.t ? at_b : at_a, boost::math::tools::eps_tolerance<double>(52), most);
    const double t = 0.5 * (low + high);
    (void)real_part(t);
    if (lost || !at) return false;
    seen_.push_back(*at);
    const Index k = at->eigenvalues.size() - 1 - std::min(before, after);
    const double frequency = std::abs(at->eigenvalues[k].imag());
    // Round-off of the eigenvalue over its derivative, added to the bracket.
    const double slope = std::abs((at_b - at_a) / (b.t - a.t));
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * at->A.norm() / slope;
    const double error = (high - low) + rounding;
    const auto within = [&](double place) {
      return std::clamp(place, std::min(a.t, b.t), std::max(a.t, b.t));
    };
    events_.push_back(
        {within(t - std::copysign(error, b.t - a.t)), within(t + std::copysign(error, b.t - a.t)),
         frequency > 0 ? CrossingKind::hopf : CrossingKind::zero, before, after, frequency});
    return true;
  }

  const MatrixLine& line_;
  double least_, length_;         // the shortest piece; all
  double size_, apart_, change_;  // of the matrices at the ends; between these
  std::vector<LineEvent>& events_;
  std::vector<Sample>& seen_;
  Index riding_;
  int pieces_ = 0;
  std::optional<double> ended_at_;  // right end of the last piece that could not be bisected
  std::optional<Sample> begin_;     // sample at the left end of the adjacent ones
};

}  // namespace

int Sample::unstable() const {
  return int(std::ranges::count_if(eigenvalues, [](const auto& z) { return z.real() > 0; }));
}

double Sample::abscissa() const {
  return eigenvalues.size() > 0 ? eigenvalues[eigenvalues.size() - 1].real()
                                : -std::numeric_limits<double>::infinity();
}

Index on_axis(const Sample& s) {
  const double near = std::sqrt(std::numeric_limits<double>::epsilon()) * s.A.norm();
  if (s.eigenvalues.size() == 0 || s.eigenvalues.real().cwiseAbs().minCoeff() > near) return 0;
  return std::ranges::count_if(modes(s.A).modes, [](const Mode& mode) {
    return std::abs(mode.eigenvalue.real()) <= mode.error;
  });
}

Sample without(Sample s, Index riding) {
  std::vector<std::complex<double>> kept(s.eigenvalues.begin(), s.eigenvalues.end());
  for (; riding > 0 && !kept.empty(); --riding)
    kept.erase(
        std::ranges::min_element(kept, {}, [](const auto& z) { return std::abs(z.real()); }));
  s.eigenvalues = Eigen::Map<const Eigen::VectorXcd>(kept.data(), std::ssize(kept));
  return s;
}

void events_between(const MatrixLine& line, double from, const std::optional<Sample>& a, double to,
                    const std::optional<Sample>& b, double least, std::vector<LineEvent>& events,
                    std::vector<Sample>& seen, Index riding) {
  Search(line, from, a, to, b, least, events, seen, riding).look(from, a, to, b);
}

}  // namespace tiltrim
