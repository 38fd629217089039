// Crossings of eigenvalues with the imaginary axis on a line of matrices.
#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <map>
#include <numeric>

#include "linearize/balance.hpp"
#include "linearize/modes.hpp"
#include "sweep/boundary.hpp"

namespace tiltrim {

using dense::SmallComplexMatrix;
using dense::SmallMatrix;
using dense::SmallVector;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double safety = 4.0;      // on the second difference as a bound between samples
constexpr double jump_size = 1e-6;  // nominal sizes: a larger change over `least` is a jump
constexpr int most_pieces = 4000;   // of one step of the grid

// B = X⁻¹ A X at the ends and in the middle of a piece, minus the diagonal in the middle.
struct Piece {
  PerMode<Complex> lambda;  // that diagonal
  SmallComplexMatrix at_a, at_m, at_b;
  SmallComplexMatrix bend;  // a second difference of the same width next to the piece, or none
  double rounding;          // of an eigenvalue, in the matrix's own norm
};

Piece piece_of(const Eigenvectors& X, const SmallMatrix& a, const SmallMatrix& m,
               const SmallMatrix& b, const SmallMatrix& bend) {
  Piece p{{},
          in_eigenvectors(X.basis, a),
          in_eigenvectors(X.basis, m),
          in_eigenvectors(X.basis, b),
          bend.size() > 0 ? in_eigenvectors(X.basis, bend) : SmallComplexMatrix(),
          X.rounding};
  for (Index i = 0; i < m.rows(); ++i) {
    const Complex middle = p.at_m(i, i);
    p.lambda.push_back(middle);
    for (SmallComplexMatrix* B : {&p.at_a, &p.at_m, &p.at_b}) (*B)(i, i) -= middle;
  }
  return p;
}

double size(Complex z) { return std::sqrt(std::norm(z)); }

// Bounds of the entries of B along the piece; on the diagonal, of the real part's motion. A smooth
// curve deviates from the halves of the polygon by at most an eighth of the second difference,
// which may vanish at a point of inflection: then that next to the piece counts.
SmallMatrix entries_along(const Piece& p) {
  const Index n = p.at_m.rows();
  SmallMatrix most(n, n);
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i < n; ++i) {
      const Complex a = p.at_a(i, j), m = p.at_m(i, j), b = p.at_b(i, j);
      const double corner = i == j ? std::max(std::abs(a.real()), std::abs(b.real()))
                                   : std::max({size(a), size(m), size(b)});
      const double beside = p.bend.size() > 0 ? size(p.bend(i, j)) : 0.0;
      most(i, j) = corner + safety / 8 * std::max(size(a - 2.0 * m + b), beside);
    }
  return most;
}

// How far each disk of D⁻¹ B D may reach from λᵢ, D = diag(w), with these bounds of B's entries:
// the radius is Σ Bᵢⱼ wⱼ/wᵢ. The eigenvalue nearest to the axis has w = 1, the others twice the
// least that keeps them off the axis: the farther they are, the less they widen its disk.
SmallVector reaches(const SmallMatrix& most, Spectrum lambda, std::size_t nearest) {
  constexpr int sweeps = 4;
  constexpr double least = 1e-3;
  const Index n = most.rows();
  SmallVector w = SmallVector::Ones(n);
  const auto radius = [&](Index i) { return most.row(i).dot(w) - most(i, i) * w[i]; };
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (Index i = 0; i < n; ++i) {
      const Complex z = lambda[std::size_t(i)];
      if (z == lambda[nearest] || z == std::conj(lambda[nearest])) continue;
      w[i] = std::max(least, std::min(1.0, 2 * radius(i) / std::abs(z.real())));
    }
  SmallVector reach(n);
  for (Index i = 0; i < n; ++i) reach[i] = most(i, i) + radius(i) / w[i];
  return reach;
}

struct Judged {
  std::vector<Index> unclear;  // eigenvalues of the middle whose disks may reach the axis
  bool monotone = false;       // only one unclear eigenvalue or pair, with monotone real part
  bool rounding = false;       // its motion within the piece is at rounding level
};

Judged judge(const Piece& p, std::size_t riding) {
  const std::size_t n = p.lambda.size();
  PerMode<std::size_t> nearest(n);  // to the axis first
  std::iota(nearest.begin(), nearest.end(), std::size_t{0});
  std::ranges::stable_sort(nearest, {},
                           [&](std::size_t i) { return std::abs(p.lambda[i].real()); });
  Judged j;
  if (riding >= n) return j;
  const SmallVector moved = reaches(entries_along(p), spectrum(p.lambda), nearest[riding]);
  double most = 0.0;
  for (std::size_t k = riding; k < n; ++k) {
    const auto i = Index(nearest[k]);
    const double away = std::abs(p.lambda[nearest[k]].real());
    if (away > moved[i]) continue;
    j.unclear.push_back(i);
    most = std::max(most, away + moved[i]);
  }
  j.rounding = !j.unclear.empty() && most <= p.rounding;
  if (j.unclear.empty() || j.unclear.size() > 2) return j;
  const Index i = j.unclear.front();
  const Complex lambda = p.lambda[std::size_t(i)];
  if (j.unclear.size() == 2 ? p.lambda[std::size_t(j.unclear[1])] != std::conj(lambda)
                            : lambda.imag() != 0)
    return j;
  // dλ/dτ = B'ᵢᵢ,  |d²λ/dτ²| <= |B''ᵢᵢ| + 2 Σ |B'ᵢⱼ B'ⱼᵢ| / |λᵢ - λⱼ|, τ = -1 .. 1.         [26]
  const SmallComplexMatrix slope = 0.5 * (p.at_b - p.at_a);
  double curvature = std::abs(p.at_a(i, i) + p.at_b(i, i)), gap = infinity;
  for (Index k = 0; k < Index(n); ++k) {
    if (k == i) continue;
    const double apart = std::abs(lambda - p.lambda[std::size_t(k)]);
    gap = std::min(gap, apart);
    curvature += 2 * std::abs(slope(i, k) * slope(k, i)) / apart;
  }
  j.monotone = gap > safety * moved[i] && std::abs(slope(i, i).real()) > safety * curvature;
  return j;
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
        from_(from),
        to_(to),
        least_(least),
        length_(to - from),
        size_(std::max(a ? a->A.norm() : 0.0, b ? b->A.norm() : 0.0)),
        apart_(a && b ? line.apart(*a, *b) : 0.0),
        change_(a && b ? (a->A - b->A).norm() : 0.0),
        events_(events),
        seen_(seen),
        riding_(riding) {}

  // Newton may fail from afar and succeed from next to the end that it leaves: then the search
  // begins anew with what was found there.
  void run(double from, const std::optional<Sample>& a, double to, const std::optional<Sample>& b) {
    constexpr int most_searches = 64;
    const std::size_t events = events_.size(), seen = seen_.size();
    for (int k = 0; k < most_searches; ++k) {
      again_ = k + 1 < most_searches;
      const std::size_t known = found_again_.size();
      look(from, a, to, b, {});
      if (found_again_.size() == known) return;
      events_.resize(events);
      seen_.resize(seen);
      pieces_ = 0;
      ended_at_.reset();
    }
  }

 private:
  // `bend`: the largest second difference of the pieces that this one is a part of, at its width. A
  // piece that is part of no other is halved.
  void look(double from, const std::optional<Sample>& a, double to, const std::optional<Sample>& b,
            const std::optional<MatrixXd>& bend) {
    if (!a && !b) return;
    if (std::abs(to - from) <= least_ || ++pieces_ > most_pieces) return ended(from, a, to, b);
    const double middle = 0.5 * (from + to);
    const auto nearby = found_again_.find(middle);
    std::optional<Sample> m =
        nearby != found_again_.end() ? nearby->second : line_.sample(middle, a ? *a : *b);
    if (!m && a && b) m = line_.sample(middle, *b);
    if (m) seen_.push_back(*m);
    std::optional<MatrixXd> own = bend;
    if (a && m && b) {
      own = a->A - 2.0 * m->A + b->A;
      if (bend && bend->norm() > own->norm()) own = bend;
    }
    const bool smooth =
        a && m && b && continuous(line_.apart(*a, *m), line_.apart(*m, *b), line_.apart(*a, *b));
    if (smooth && bend) {
      if (const auto X = eigenvectors(m->A, m->spectrum())) {
        const Judged judged = judge(piece_of(*X, a->A, m->A, b->A, *own), std::size_t(riding_));
        // An end may lie on the axis, where its own number of unstable eigenvalues is that of no
        // side.
        if (judged.unclear.empty() && a->unstable() == b->unstable()) return;
        if (judged.rounding) return ended(from, a, to, b, true);
        if (judged.monotone && (a->unstable() == b->unstable() || locate(*a, *b))) return;
      }
    }
    if (own) *own /= 4;
    look(from, a, middle, m, own);
    look(middle, m, to, b, own);
  }

  // The missing end of a piece that cannot be bisected further, from the other one.
  void try_again(const Sample& near, double t) {
    if (t == from_ || t == to_) return;
    const std::optional<Sample> found = line_.sample(t, near);
    if (found && line_.apart(near, *found) <= jump_size) found_again_.emplace(t, *found);
  }

  // Records a piece that cannot be bisected further. Adjacent pieces of this kind are one event.
  void ended(double from, const std::optional<Sample>& a, double to, const std::optional<Sample>& b,
             bool rounding = false) {
    if (again_ && a && !b) try_again(*a, to);
    if (again_ && b && !a) try_again(*b, from);
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
    // The bracket, and over the slope what rounding and the trim's tolerance move the matrix by.
    const double slope = std::abs((at_b - at_a) / (b.t - a.t));
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * at->A.norm();
    const double error = (high - low) + (rounding + line_.blur(*at)) / slope;
    const auto within = [&](double place) {
      return std::clamp(place, std::min(a.t, b.t), std::max(a.t, b.t));
    };
    events_.push_back(
        {within(t - std::copysign(error, b.t - a.t)), within(t + std::copysign(error, b.t - a.t)),
         frequency > 0 ? CrossingKind::hopf : CrossingKind::zero, before, after, frequency, t});
    return true;
  }

  const MatrixLine& line_;
  double from_, to_;
  double least_, length_;         // the shortest piece; all
  double size_, apart_, change_;  // of the matrices at the ends; between these
  std::vector<LineEvent>& events_;
  std::vector<Sample>& seen_;
  Index riding_;
  int pieces_ = 0;
  bool again_ = true;
  std::map<double, Sample> found_again_;  // by position
  std::optional<double> ended_at_;        // right end of the last piece that could not be bisected
  std::optional<Sample> begin_;           // sample at the left end of the adjacent ones
};

}  // namespace

std::optional<Eigenvectors> eigenvectors(const SmallMatrix& A, Spectrum lambda) {
  constexpr double units = 64;  // rounding units that an eigenvalue of a balanced matrix may be off
  const Balanced balanced = balance(A);
  Eigenvectors X{basis(balanced.B, lambda),
                 units * std::numeric_limits<double>::epsilon() * balanced.B.norm()};
  if (X.basis.lambda.empty() || !X.basis.R.allFinite()) return {};  // defective
  const Basis scaled = X.basis;
  for (Index k = 0; k < A.rows(); ++k) {
    const Index row = balanced.order[std::size_t(k)];
    X.basis.P.row(row) = scaled.P.row(k) * balanced.scale[k];
    X.basis.R.col(row) = scaled.R.col(k) / balanced.scale[k];
  }
  return X;
}

bool continuous(double left, double right, double whole) {
  const double most = std::max(left, right);
  if (most <= jump_size) return true;
  constexpr double all = 0.9;  // a parabola from its vertex has two thirds
  return std::min(left, right) >= (1 - all) * most || whole <= most * (1 - all);
}

bool is_clear(std::optional<Eigenvectors>& nearby, const SmallMatrix& a, const SmallMatrix& m,
              Spectrum lambda, const SmallMatrix& b, const SmallMatrix& bend) {
  const auto clear = [&](const Eigenvectors& X) {
    return judge(piece_of(X, a, m, b, bend), 0).unclear.empty();
  };
  if (nearby && clear(*nearby)) return true;
  nearby = eigenvectors(m, lambda);
  return nearby && clear(*nearby);
}

// Without those that are left out, the eigenvectors are computed with all.
Spectrum Sample::spectrum() const {
  return eigenvalues.size() == A.rows() ? Spectrum(eigenvalues.data(), std::size_t(A.rows()))
                                        : Spectrum();
}

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
  Search(line, from, a, to, b, least, events, seen, riding).run(from, a, to, b);
}

}  // namespace tiltrim
