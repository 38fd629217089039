#include "sweep/line.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "linearize/batch.hpp"
#include "sweep/track.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double other_branch = 1e-6;  // unknowns apart by more, scaled, are another equilibrium

// A line while it is walked.
struct Walk {
  const Prepared& sweep;
  GridPlace place;
  std::size_t axis, count;
  OperatingPoint base;  // the line's numbers, but for the axis's own
  LinePoints points;
  std::vector<char> valid;       // there is an equilibrium
  std::vector<double> unknowns;  // of each point
  MatrixBatch A;

  std::size_t n_unknowns() const { return sweep.unknowns.size(); }
  const std::vector<double>& coordinates() const { return sweep.axes[axis].columns.front().values; }
  OperatingPoint at(std::size_t k) const {
    OperatingPoint point = base;
    move_to(sweep, axis, double(k), point);
    for (std::size_t i = 0; i < n_unknowns(); ++i)
      set_value(point, sweep.problem.unknowns[i], unknowns[k * n_unknowns() + i]);
    return point;
  }
};

std::uint8_t as_byte(double confidence) {
  return std::uint8_t(std::lround(255 * std::clamp(confidence, 0.0, 1.0)));
}

std::int16_t reason_number(LinePoints& points, const std::string& reason) {
  const auto known = std::ranges::find(points.reasons, reason);
  constexpr std::size_t most = 1000;  // of one line; then one that stands for the others
  if (known == points.reasons.end() && points.reasons.size() >= most)
    return reason_number(points, points.reasons[1]);
  if (known == points.reasons.end()) points.reasons.push_back(reason);
  return std::int16_t(std::ranges::find(points.reasons, reason) - points.reasons.begin());
}

void keep_matrix(Walk& w, std::size_t k, const MatrixXd& slopes) {
  for (Index j = 0; j < w.A.n; ++j)
    for (Index i = 0; i < w.A.n; ++i) w.A(i, j, Index(k)) = slopes(i, j);
}

void keep(Walk& w, std::size_t k, const Settled& e) {
  LinePoints& p = w.points;
  p.status[k] = std::int8_t(e.status);
  p.reason[k] = e.message.empty() ? std::int16_t(0) : reason_number(p, e.message);
  w.valid[k] = e.valid();
  if (!e.valid()) return;
  p.residual[k] = e.residual;
  const std::size_t n = std::size_t(w.sweep.states()), m = w.sweep.inputs.size();
  for (std::size_t i = 0; i < w.n_unknowns(); ++i)
    w.unknowns[k * w.n_unknowns() + i] = value_of(e.at, w.sweep.problem.unknowns[i]);
  for (std::size_t i = 0; i < n; ++i) p.state[k * n + i] = e.at.x[Index(i)];
  for (std::size_t i = 0; i < m; ++i) p.input[k * m + i] = input_at(w.sweep, e, i);
}

Walk begin(const Prepared& sweep, const LineStart& start) {
  const std::size_t axis = sweep.axes.size() - 1, count = sweep.axes[axis].size();
  const std::size_t n = std::size_t(sweep.states()), m = sweep.inputs.size();
  Walk w{sweep, start.place, axis, count, numbers_at(sweep, start.place), {}, {}, {}, {}};
  w.A = MatrixBatch(Index(n), Index(count));
  std::ranges::fill(w.A.entries, not_a_number);
  w.valid.resize(count);
  w.unknowns.resize(count * sweep.unknowns.size());
  LinePoints& p = w.points;
  p.status.resize(count);
  p.verdict.resize(count);
  p.second_branch.resize(count);
  p.reason.resize(count);
  p.confidence.resize(count * n);
  for (auto* numbers : {&p.residual, &p.spectral_abscissa, &p.damping})
    numbers->assign(count, not_a_number);
  for (auto* numbers : {&p.state, &p.eigenvalue_re, &p.eigenvalue_im})
    numbers->assign(count * n, not_a_number);
  p.input.assign(count * m, not_a_number);
  return w;
}

// Unknowns at point k from those at up to three points next to it, by the polynomial through them.
void extrapolate(const Walk& w, std::size_t k, std::array<std::size_t, 3> near, int count,
                 OperatingPoint& at) {
  const std::vector<double>& v = w.coordinates();
  std::array<double, 3> weight{};
  for (std::size_t a = 0; a < std::size_t(count); ++a) {
    weight[a] = 1.0;
    for (std::size_t b = 0; b < std::size_t(count); ++b)
      if (b != a) weight[a] *= (v[k] - v[near[b]]) / (v[near[a]] - v[near[b]]);
  }
  const std::size_t n = w.n_unknowns();
  for (std::size_t i = 0; i < n; ++i) {
    double value = 0.0;
    for (std::size_t a = 0; a < std::size_t(count); ++a)
      value += weight[a] * w.unknowns[near[a] * n + i];
    set_value(at, w.sweep.problem.unknowns[i], value);
  }
}

// The equilibria next to k on the side where the walk comes from (-1: before it), nearest first.
int known_beside(const Walk& w, std::size_t k, int side, std::array<std::size_t, 3>& near) {
  int count = 0;
  for (std::ptrdiff_t j = std::ptrdiff_t(k) + side;
       count < 3 && j >= 0 && j < std::ptrdiff_t(w.count) && w.valid[std::size_t(j)]; j += side)
    near[std::size_t(count++)] = std::size_t(j);
  return count;
}

// From the equilibria before by Newton, from nothing where that fails.
Settled next_forward(const Walk& w, std::size_t k) {
  GridPlace place = w.place;
  place[w.axis] = double(k);
  Settled e;
  std::array<std::size_t, 3> near{};
  if (const int known = known_beside(w, k, -1, near)) {
    e.at = w.base;
    move_to(w.sweep, w.axis, double(k), e.at);
    extrapolate(w, k, near, known, e.at);
    if (settle(w.sweep, e)) return e;
    if (const auto beside = settle(w.sweep, place, w.at(k - 1))) return *beside;
  }
  const std::string neighbour = e.message;
  e = from_nothing(w.sweep, place);
  if (!e.valid() && !neighbour.empty()) e.message += "; from the point before, " + neighbour;
  return e;
}

void walk_forward(Walk& w, const LineStart& start) {
  for (std::size_t k = 0; k < w.count; ++k) {
    const Settled e = k == 0 ? start.first : next_forward(w, k);
    keep(w, k, e);
    if (e.valid()) keep_matrix(w, k, e.slopes);
  }
}

// Along an axis that leaves the airframe's equilibrium alone: A is affine, the rest is verified.
// False as soon as a point is not.
bool walk_affine(Walk& w, const LineStart& start, const AffineLine& line) {
  keep(w, 0, start.first);
  keep_matrix(w, 0, line.first);
  Settled e = start.first;
  MatrixXd A;
  for (std::size_t k = 1; k < w.count; ++k) {
    move_to(w.sweep, w.axis, double(k), e.at);
    extrapolate(w, k, {k - 1, k < 2 ? 0 : k - 2}, k < 2 ? 1 : 2, e.at);
    if (!settle(w.sweep, line, e, A)) {
      GridPlace place = w.place;
      place[w.axis] = double(k);
      const auto beside = settle(w.sweep, place, w.at(k - 1));
      if (!beside) return false;
      e = *beside;
    }
    keep(w, k, e);
    keep_matrix(w, k, A);
  }
  return true;
}

void add_second(Walk& w, std::size_t k, const OperatingPoint& at) {
  const Settled e = equilibrium_at(w.sweep, at);
  const MatrixXd A = e.A(w.sweep);
  const Eigenvalues lambda = eigenvalues_of(A);
  LinePoints& p = w.points;
  p.second_branch[k] = 1;
  p.second.push_back(k);
  p.second_state.insert(p.second_state.end(), at.x.begin(), at.x.end());
  for (std::size_t i = 0; i < w.sweep.inputs.size(); ++i)
    p.second_input.push_back(input_at(w.sweep, e, i));
  for (Index i = 0; i < w.sweep.states(); ++i) {
    const bool known = i < std::ssize(lambda);
    p.second_re.push_back(known ? lambda[std::size_t(i)].real() : not_a_number);
    p.second_im.push_back(known ? lambda[std::size_t(i)].imag() : not_a_number);
  }
  p.second_verdict.push_back(std::int8_t(modes(A).verdict));
}

bool near_point(const Walk& w, std::size_t k, const OperatingPoint& at, double within) {
  const Problem& p = w.sweep.problem;
  for (std::size_t i = 0; i < w.n_unknowns(); ++i) {
    const double here = w.unknowns[k * w.n_unknowns() + i];
    if (!(std::abs(value_of(at, p.unknowns[i]) - here) <= within * p.nominal[Index(i)]))
      return false;
  }
  return true;
}

// Two equilibria of one point: the one of less effort stays, the other is its second branch.
void settle_between(Walk& w, std::size_t k, const Settled& other) {
  const bool first = !w.valid[k];
  const OperatingPoint here = first ? other.at : w.at(k);
  if (!first && apart(w.sweep, here, other.at) <= other_branch) return;
  const bool less = first || effort_at(w.sweep, other.at) < effort_at(w.sweep, here);
  if (less) {
    keep(w, k, other);
    keep_matrix(w, k, other.slopes);
  }
  if (!first) add_second(w, k, less ? here : other.at);
}

// The line walked from its other end. What the first walk found is this walk's too where it lies as
// near to the continuation of the points behind it as Newton needs; else Newton decides.
void walk_backward(Walk& w, const LineStart& start) {
  constexpr double near_enough = 1e-2;              // nominal sizes
  std::optional<OperatingPoint> last = start.last;  // set while this walk is on another branch
  if (last && w.valid[w.count - 1] && apart(w.sweep, *last, w.at(w.count - 1)) <= other_branch)
    last.reset();
  std::array<std::size_t, 3> near{};
  for (std::size_t k = w.count; k-- > 0;) {
    Settled e;
    if (last) {
      e.at = *last;
      move_to(w.sweep, w.axis, double(k), e.at);
    } else {
      const int known = known_beside(w, k, +1, near);
      if (known == 0) continue;
      e.at = w.base;
      move_to(w.sweep, w.axis, double(k), e.at);
      extrapolate(w, k, near, std::min(known, 2), e.at);
      if (w.valid[k] && near_point(w, k, e.at, near_enough)) continue;
    }
    if (!settle(w.sweep, e)) {
      last.reset();
      continue;
    }
    const bool same = w.valid[k] && apart(w.sweep, e.at, w.at(k)) <= other_branch;
    if (!same) settle_between(w, k, e);
    const bool taken = same || apart(w.sweep, e.at, w.at(k)) <= other_branch;
    last = taken ? std::nullopt : std::optional(e.at);
  }
}

void add_eigenvalues(Walk& w, const BatchEigenvalues& all, std::size_t k, Eigenvalues& lambda) {
  const std::size_t n = lambda.size();
  for (std::size_t i = 0; i < n; ++i)
    lambda[i] = {all.re[i * w.count + k], all.im[i * w.count + k]};
}

void keep_modes(Walk& w, std::size_t k, const Eigenvalues& modes,
                const std::vector<std::uint8_t>& confidence) {
  const std::size_t n = modes.size();
  double abscissa = -std::numeric_limits<double>::infinity();
  double damping = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i) {
    const auto [re, im] = std::pair(modes[i].real(), modes[i].imag());
    w.points.eigenvalue_re[k * n + i] = re;
    w.points.eigenvalue_im[k * n + i] = im;
    w.points.confidence[k * n + i] = confidence[i];
    abscissa = std::max(abscissa, re);
    const double size = std::sqrt(re * re + im * im);
    damping = std::min(damping, size > 0 ? -re / size : 0.0);
  }
  w.points.spectral_abscissa[k] = abscissa;
  w.points.damping[k] = damping;
}

// The modes' order carried along the line from its first equilibrium.
void follow_modes(Walk& w, const LineStart& start, const BatchEigenvalues& all) {
  const std::size_t n = std::size_t(w.sweep.states());
  const std::vector<double>& v = w.sweep.axes[w.axis].columns.front().values;
  std::optional<Reference> from = start.reference;
  Eigenvalues lambda(n), before, predicted(n), ordered(n);
  std::vector<int> to(n);
  std::vector<double> sure(n);
  std::vector<std::uint8_t> confidence(n, 0);
  std::size_t last = 0, last_but_one = 0;
  for (std::size_t k = 0; k < w.count; ++k) {
    if (!w.valid[k] || all.status[k] >= LaneStatus::not_converged) continue;
    add_eigenvalues(w, all, k, lambda);
    if (!from) {  // nothing before it: its own order, named by nothing
      from = Reference{w.A.matrix(Index(k)), lambda};
      keep_modes(w, k, lambda, confidence);
      last = k;
      continue;
    }
    const double ratio = before.empty() ? 0.0 : (v[k] - v[last]) / (v[last] - v[last_but_one]);
    for (std::size_t i = 0; i < n; ++i)
      predicted[i] = from->modes[i] + (before.empty() ? 0.0 : ratio * (from->modes[i] - before[i]));
    const bool foreseen = !before.empty() || k == 0;  // else nothing says where a mode goes
    if (foreseen && link_by_position(from->modes, predicted, lambda, to, sure)) {
      for (std::size_t i = 0; i < n; ++i) {
        ordered[i] = lambda[std::size_t(to[i])];
        confidence[i] = as_byte(sure[i]);
      }
    } else {
      GridPlace here = w.place, there = w.place;
      here[w.axis] = double(last);
      there[w.axis] = double(k);
      const bool within = w.valid[last] && last < k;  // else the reference is another line's
      if (within) from->A = w.A.matrix(Index(last));
      Ordered by_vectors =
          in_order(*from, predicted, w.A.matrix(Index(k)), lambda,
                   within ? trims_between(w.sweep, here, there, w.at(last)) : nullptr);
      ordered = by_vectors.modes;
      confidence = by_vectors.confidence;
    }
    if (k == 0) confidence = start.confidence;
    keep_modes(w, k, ordered, confidence);
    before = k == 0 ? Eigenvalues{} : from->modes;
    last_but_one = last;
    from->modes = ordered;
    last = k;
  }
}

}  // namespace

Eigenvalues eigenvalues_of(const MatrixXd& A) {
  if (!A.allFinite()) return {};
  const Eigen::VectorXcd lambda = eigenvalues(A);
  return {lambda.begin(), lambda.end()};
}

Ordered in_order(const Reference& from, const Eigenvalues& predicted, const MatrixXd& B,
                 const Eigenvalues& lambda,
                 const std::function<std::optional<MatrixXd>(double)>& between) {
  const Link found = link(from.A, from.modes, predicted, B, lambda, between);
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

LinePoints walk_line(const Prepared& sweep, const LineStart& start) {
  Walk w = begin(sweep, start);
  std::optional<AffineLine> line;
  if (start.first.valid()) line = affine_line(sweep, start.place, w.axis, start.first);
  const bool affine = line && walk_affine(w, start, *line);
  if (!affine) walk_forward(w, start);
  walk_backward(w, start);
  BatchEigenvalues all;
  std::vector<Verdict> verdict;
  eigenvalues(w.A, all);
  verdicts(w.A, verdict);
  for (std::size_t k = 0; k < w.count; ++k)
    w.points.verdict[k] = w.valid[k] ? std::int8_t(verdict[k]) : std::int8_t(-1);
  follow_modes(w, start, all);
  return w.points;
}

}  // namespace tiltrim
