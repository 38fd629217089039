#include "sweep/line.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "linearize/batch.hpp"
#include "sweep/spectrum.hpp"
#include "sweep/track.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double other_branch = 1e-6;  // unknowns apart by more, scaled, are another equilibrium

// What a thread needs for a line, and for its next one again.
struct Room {
  std::vector<char> valid;       // there is an equilibrium
  std::vector<double> unknowns;  // of each point
  std::vector<double> shares;    // of an affine line's slope
  MatrixBatch A;
  BatchEigenvalues eigenvalues;
  std::vector<Verdict> verdicts;
};

// A line while it is walked.
struct LineTracker {
  const Prepared& sweep;
  GridPlace place;
  std::size_t axis, count;
  OperatingPoint base;  // the line's numbers, but for the axis's own
  LinePoints& points;
  std::vector<char>& valid;
  std::vector<double>& unknowns;
  MatrixBatch& A;

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

void keep_matrix(LineTracker& w, std::size_t k, const MatrixXd& slopes) {
  for (Index j = 0; j < w.A.n; ++j)
    for (Index i = 0; i < w.A.n; ++i) w.A(i, j, Index(k)) = slopes(i, j);
}

void keep_no_matrix(LineTracker& w, std::size_t k) {
  for (Index j = 0; j < w.A.n; ++j)
    for (Index i = 0; i < w.A.n; ++i) w.A(i, j, Index(k)) = not_a_number;
}

void keep(LineTracker& w, std::size_t k, const GridTrim& e) {
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

LineTracker begin(const Prepared& sweep, const LineStart& start, LinePoints& p, Room& room) {
  const std::size_t axis = sweep.axes.size() - 1, count = sweep.axes[axis].size();
  const std::size_t n = std::size_t(sweep.states()), m = sweep.inputs.size();
  room.A.n = Index(n);
  room.A.count = Index(count);
  room.A.entries.resize(n * n * count);
  room.valid.assign(count, 0);
  room.unknowns.resize(count * sweep.unknowns.size());
  for (auto* numbers : {&p.status, &p.verdict}) numbers->resize(count);
  p.second_branch.assign(count, 0);
  p.reason.resize(count);
  p.reasons.assign(1, "");
  p.confidence.resize(count * n);
  for (auto* numbers : {&p.residual, &p.spectral_abscissa, &p.damping}) numbers->resize(count);
  for (auto* numbers : {&p.state, &p.eigenvalue_re, &p.eigenvalue_im}) numbers->resize(count * n);
  p.input.resize(count * m);
  for (auto* numbers : {&p.second_state, &p.second_input, &p.second_re, &p.second_im})
    numbers->clear();
  p.second_verdict.clear();
  p.second.clear();
  return {sweep, start.place, axis,          count, numbers_at(sweep, start.place),
          p,     room.valid,  room.unknowns, room.A};
}

// Unknowns at point k from those at up to four points next to it, by the polynomial through them.
void extrapolate(const LineTracker& w, std::size_t k, std::array<std::size_t, 4> near, int count,
                 OperatingPoint& at) {
  const std::vector<double>& v = w.coordinates();
  std::array<double, 4> weight{};
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
int known_beside(const LineTracker& w, std::size_t k, int side, std::array<std::size_t, 4>& near) {
  int count = 0;
  for (std::ptrdiff_t j = std::ptrdiff_t(k) + side;
       count < 4 && j >= 0 && j < std::ptrdiff_t(w.count) && w.valid[std::size_t(j)]; j += side)
    near[std::size_t(count++)] = std::size_t(j);
  return count;
}

// From the equilibria before by Newton, from nothing where that fails.
GridTrim next_forward(const LineTracker& w, std::size_t k) {
  GridPlace place = w.place;
  place[w.axis] = double(k);
  GridTrim e;
  std::array<std::size_t, 4> near{};
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

void walk_forward(LineTracker& w, const LineStart& start) {
  for (std::size_t k = 0; k < w.count; ++k) {
    const GridTrim e = k == 0 ? start.first : next_forward(w, k);
    keep(w, k, e);
    if (e.valid())
      keep_matrix(w, k, e.slopes);
    else
      keep_no_matrix(w, k);
  }
}

// The matrices of points whose shares of the line's slope these are.
void keep_matrices(LineTracker& w, const AffineLine& line, const std::vector<double>& shares) {
  for (Index i = 0; i < w.A.n; ++i)
    for (Index j = 0; j < w.A.n; ++j) {
      const double first = line.first(i, j), slope = line.slope(i, j);
      double* const entries = &w.A(i, j, 0);
      if (slope == 0)
        std::fill_n(entries, w.count, first);
      else
        for (std::size_t k = 0; k < w.count; ++k) entries[k] = first + shares[k] * slope;
    }
}

// Of a steady line every point is the first.
void keep_steady(LineTracker& w, const GridTrim& e) {
  keep(w, 0, e);
  const auto repeat = [&](auto& values) {
    const std::size_t width = values.size() / w.count;
    for (std::size_t known = width; known < values.size(); known *= 2)
      std::copy_n(values.begin(), std::min(known, values.size() - known),
                  values.begin() + std::ptrdiff_t(known));
  };
  LinePoints& p = w.points;
  repeat(p.status), repeat(p.reason), repeat(p.residual), repeat(p.state), repeat(p.input);
  repeat(w.valid), repeat(w.unknowns);
}

// From the point before, a Newton step or none. False as soon as it is no equilibrium.
bool next_affine(LineTracker& w, const AffineLine& line, std::size_t k, GridTrim& e) {
  extrapolate(w, k, {k - 1, k < 2 ? 0 : k - 2}, k < 2 ? 1 : 2, e.at);
  if (settle(w.sweep, line, e)) return true;
  GridPlace place = w.place;
  place[w.axis] = double(k);
  const auto beside = settle(w.sweep, place, w.at(k - 1));
  if (beside) e = *beside;
  return beside.has_value();
}

// Along an axis that leaves the airframe's equilibrium alone.
bool walk_affine(LineTracker& w, const LineStart& start, const AffineLine& line,
                 std::vector<double>& shares) {
  GridTrim e = start.first;
  if (line.steady) {
    e.residual = line.residual;
    keep_steady(w, e);
  }
  shares.assign(w.count, 0.0);
  for (std::size_t k = 0; k < w.count; ++k) {
    move_to(w.sweep, w.axis, double(k), e.at);
    const auto share = line.share(e.at.p);
    if (!share) return false;
    shares[k] = *share;
    if (line.steady) continue;
    if (k > 0 && !next_affine(w, line, k, e)) return false;
    keep(w, k, e);
  }
  keep_matrices(w, line, shares);
  return true;
}

void add_second(LineTracker& w, std::size_t k, const OperatingPoint& at) {
  const GridTrim e = equilibrium_at(w.sweep, at);
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

bool near_point(const LineTracker& w, std::size_t k, const OperatingPoint& at, double within) {
  const Problem& p = w.sweep.problem;
  for (std::size_t i = 0; i < w.n_unknowns(); ++i) {
    const double here = w.unknowns[k * w.n_unknowns() + i];
    if (!(std::abs(value_of(at, p.unknowns[i]) - here) <= within * p.nominal[Index(i)]))
      return false;
  }
  return true;
}

// Two equilibria of one point: the one of less effort stays, the other is its second branch.
void settle_between(LineTracker& w, std::size_t k, const GridTrim& other) {
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

// The line walked from its other end. Where Newton comes to the same equilibrium at both ends of a
// steady line there is nothing to walk. What the first walk found is this walk's too where it lies
// as near to the continuation of the points behind it as Newton needs; else Newton decides.
void walk_backward(LineTracker& w, const LineStart& start, bool steady) {
  constexpr double near_enough = 1e-2;              // nominal sizes
  std::optional<OperatingPoint> last = start.last;  // set while this walk is on another branch
  if (last && w.valid[w.count - 1] && apart(w.sweep, *last, w.at(w.count - 1)) <= other_branch)
    last.reset();
  if (steady && !last) return;
  std::array<std::size_t, 4> near{};
  for (std::size_t k = w.count; k-- > 0;) {
    GridTrim e;
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

// Modes of `length` points from k on, mode by mode: largest real part and least damping with them.
void keep_modes(LineTracker& w, std::size_t k, std::size_t length, const double* const* re,
                const double* const* im) {
  const std::size_t n = std::size_t(w.sweep.states());
  std::array<double, IsolatedModes::longest> abscissa, damping;
  abscissa.fill(-std::numeric_limits<double>::infinity());
  damping.fill(1.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t m = 0; m < length; ++m) {
      const double x = re[i][m], y = im[i][m], size2 = x * x + y * y;
      abscissa[m] = std::max(abscissa[m], x);
      damping[m] = std::min(damping[m], size2 > 0 ? -x * std::abs(x) / size2 : 0.0);
    }
    for (std::size_t m = 0; m < length; ++m) {
      w.points.eigenvalue_re[(k + m) * n + i] = re[i][m];
      w.points.eigenvalue_im[(k + m) * n + i] = im[i][m];
    }
  }
  for (std::size_t m = 0; m < length; ++m) {
    w.points.spectral_abscissa[k + m] = abscissa[m];
    // What is least is ζ |ζ|, which rises with ζ.
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

// The modes' order carried along the line from its first equilibrium.
struct Following {
  LineTracker& w;
  const BatchEigenvalues& all;
  std::optional<Reference> from;  // the point before
  Eigenvalues before{};           // and the modes of the one before that
  Eigenvalues lambda, predicted, ordered;
  std::vector<int> to{}, to_before{};  // mode i is lambda[to[i]]; empty: linked by vectors
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
      if (side(before[i]) == side(from->modes[i]))  // where a pair has parted the way is no line
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
    const bool within = w.valid[last] && last < k;  // else the reference is another line's
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

  // Many points at once, whose modes stay by themselves; how many.
  std::size_t run(std::size_t k, std::size_t most) {
    const bool straight =
        k >= 2 && last == k - 1 && last_but_one == k - 2 && !to.empty() && to == to_before;
    if (!straight) return 0;
    const std::vector<double>& v = w.coordinates();
    std::array<double, IsolatedModes::longest> ratio{};
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
    if (!f.from) {  // nothing before it: its own order, named by nothing
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

}  // namespace

Eigenvalues eigenvalues_of(const MatrixXd& A) {
  if (!A.allFinite()) return {};
  const Eigen::VectorXcd lambda = eigenvalues(A);
  return {lambda.begin(), lambda.end()};
}

Ordered in_order(const Reference& from, const Eigenvalues& predicted, const MatrixXd& B,
                 const Eigenvalues& lambda,
                 const std::function<std::optional<MatrixXd>(double)>& between) {
  Link found{std::vector<int>(lambda.size()), std::vector<double>(lambda.size())};
  const bool first = predicted == from.modes;  // nothing says where a mode goes
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

// What a point has not got: without an equilibrium nothing, without eigenvalues none of theirs.
static void clear(LineTracker& w, std::size_t k) {
  LinePoints& p = w.points;
  const std::size_t n = std::size_t(w.sweep.states()), m = w.sweep.inputs.size();
  p.spectral_abscissa[k] = p.damping[k] = not_a_number;
  std::fill_n(&p.eigenvalue_re[k * n], n, not_a_number);
  std::fill_n(&p.eigenvalue_im[k * n], n, not_a_number);
  std::fill_n(&p.confidence[k * n], n, std::uint8_t{0});
  if (w.valid[k]) return;
  p.verdict[k] = -1;
  p.residual[k] = not_a_number;
  std::fill_n(&p.state[k * n], n, not_a_number);
  if (m > 0) std::fill_n(&p.input[k * m], m, not_a_number);
}

// A matrix of differences has errors that verdicts() knows nothing of: near the axis the bounds of
// linearize() decide.
static void judge_differences(LineTracker& w) {
  constexpr double near = 1e-6;  // 1/s, or of the largest entry: well above what differences leave
  for (std::size_t k = 0; k < w.count; ++k) {
    if (!w.valid[k] || std::isnan(w.points.spectral_abscissa[k])) continue;
    const double size = std::max(1.0, w.A.matrix(Index(k)).cwiseAbs().maxCoeff());
    if (!(std::abs(w.points.spectral_abscissa[k]) <= near * size)) continue;
    const double any_rate = std::numeric_limits<double>::infinity();
    const LinearModel linear = linearize(w.sweep.model(), w.at(k), {.tolerance = any_rate});
    const Verdict verdict = linear ? modes(linear).verdict : Verdict::undecided;
    w.points.verdict[k] = std::int8_t(verdict);
  }
}

void walk_line(const Prepared& sweep, const LineStart& start, LinePoints& points) {
  static thread_local Room room;
  LineTracker w = begin(sweep, start, points, room);
  std::optional<AffineLine> line;
  if (start.first.valid()) line = affine_line(sweep, start.place, w.axis, start.first);
  const bool affine = line && walk_affine(w, start, *line, room.shares);
  if (!affine) walk_forward(w, start);
  walk_backward(w, start, affine && line->steady);
  eigenvalues(w.A, room.eigenvalues);
  verdicts(w.A, room.verdicts);
  for (std::size_t k = 0; k < w.count; ++k) {
    points.verdict[k] = std::int8_t(room.verdicts[k]);
    if (!w.valid[k] || room.eigenvalues.status[k] >= LaneStatus::not_converged) clear(w, k);
  }
  follow_modes(w, start, room.eigenvalues);
  if (!sweep.model().derivatives) judge_differences(w);
}

}  // namespace tiltrim
