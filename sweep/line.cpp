#include "sweep/line.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "linearize/batch.hpp"
#include "model/lookup.hpp"
#include "sweep/extrapolation.hpp"
#include "sweep/line_affine.hpp"
#include "sweep/line_tracking.hpp"
#include "sweep/side_by_side.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

std::int16_t reason_number(LinePoints& points, const std::string& reason) {
  const auto known = std::ranges::find(points.reasons, reason);
  constexpr std::size_t most = 1000;  // messages of one line; then a common one
  if (known == points.reasons.end() && points.reasons.size() >= most)
    return reason_number(points, points.reasons[1]);
  if (known == points.reasons.end()) points.reasons.push_back(reason);
  return std::int16_t(std::ranges::find(points.reasons, reason) - points.reasons.begin());
}

void keep_matrix(LineTracker& w, std::size_t k, const GridTrim& e) {
  w.exact[k] = e.exact;
  if (w.judged) return;
  for (Index j = 0; j < w.A.n; ++j)
    for (Index i = 0; i < w.A.n; ++i) w.A(i, j, Index(k)) = e.slopes(i, j);
}

void keep_no_matrix(LineTracker& w, std::size_t k) {
  if (w.judged) return;
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

}  // namespace

LineTracker begin_line(const Prepared& sweep, const GridPlace& place, std::size_t axis,
                       LinePoints& p, Room& room, bool judged) {
  const std::size_t count = sweep.axes[axis].size();
  const std::size_t n = std::size_t(sweep.states()), m = sweep.inputs.size();
  room.A.n = Index(n);
  room.A.count = Index(count);
  if (!judged) room.A.entries.resize(n * n * count);
  room.valid.assign(count, 0);
  room.exact.assign(count, 0);
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
  return {sweep,      place,         axis,   count, numbers_at(sweep, place), p, room.valid,
          room.exact, room.unknowns, room.A, judged};
}

void keep_trim(LineTracker& w, std::size_t k, const GridTrim& e) {
  keep(w, k, e);
  if (e.valid())
    keep_matrix(w, k, e);
  else
    keep_no_matrix(w, k);
}

namespace {

// At most `most` equilibria next to k on the side already tracked (-1: before it), nearest first.
int known_beside(const LineTracker& w, std::size_t k, int side, int most,
                 std::array<std::size_t, 4>& near) {
  int count = 0;
  for (std::ptrdiff_t j = std::ptrdiff_t(k) + side;
       count < most && j >= 0 && j < std::ptrdiff_t(w.count) && w.valid[std::size_t(j)]; j += side)
    near[std::size_t(count++)] = std::size_t(j);
  return count;
}

GridPlace place_of(const LineTracker& w, std::size_t k) {
  GridPlace place = w.place;
  place[w.axis] = double(k);
  return place;
}

// From the preceding equilibria by Newton; if that fails, without a starting point.
GridTrim next_forward(const LineTracker& w, std::size_t k) {
  const GridPlace place = place_of(w, k);
  GridTrim e;
  std::array<std::size_t, 4> near{};
  if (const int known = known_beside(w, k, -1, 4, near)) {
    e.at = w.base;
    move_to(w.sweep, w.axis, double(k), e.at);
    extrapolate(w, k, near, known, e.at);
    if (settle(w.sweep, e)) return e;
    if (const auto beside = settle(w.sweep, place, w.at(k - 1))) return *beside;
  }
  const std::string neighbour = e.message;
  e = from_nothing(w.sweep, place);
  if (!e.valid() && !neighbour.empty()) e.message += "; from the preceding point, " + neighbour;
  return e;
}

// Finds and stores the trim at a point, from the preceding equilibria.
GridTrim step_forward(LineTracker& w, const LineStart& start, std::size_t k) {
  GridTrim e = k == 0 ? start.first : next_forward(w, k);
  keep_trim(w, k, e);
  return e;
}

// On a steady line every point equals the first.
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

// From the previous point, with at most one Newton step. False if it is not an equilibrium.
bool next_affine(LineTracker& w, const AffineLine& line, std::size_t k, GridTrim& e) {
  extrapolate(w, k, {k - 1, k < 2 ? 0 : k - 2}, k < 2 ? 1 : 2, e.at);
  if (settle(w.sweep, line, e)) return true;
  const auto beside = settle(w.sweep, place_of(w, k), w.at(k - 1));
  if (beside) e = *beside;
  return beside.has_value();
}

// Tracks a line along an axis that does not change the airframe's equilibrium.
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
  fill_matrices(line, shares, w.A);
  std::ranges::fill(w.exact, char(start.first.exact));
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

// The same as near_point() of the line through the two points after k, where there are two: of most
// points nothing else is asked.
bool straight(const LineTracker& w, std::size_t k, double within) {
  if (k + 2 >= w.count || !w.valid[k] || !w.valid[k + 1] || !w.valid[k + 2]) return false;
  const double* const v = &w.coordinates()[k];
  const double next = (v[0] - v[2]) / (v[1] - v[2]), after = (v[0] - v[1]) / (v[2] - v[1]);
  const std::size_t n = w.n_unknowns();
  const double* const here = &w.unknowns[k * n];
  bool near = true;
  for (std::size_t i = 0; i < n; ++i) {
    const double miss = next * here[n + i] + after * here[2 * n + i] - here[i];
    near = near && std::abs(miss) <= within * w.sweep.problem.nominal[Index(i)];
  }
  return near;
}

bool near_point(const LineTracker& w, std::size_t k, const Extrapolation& curve, double within) {
  for (std::size_t i = 0; i < w.n_unknowns(); ++i) {
    const double here = w.unknowns[k * w.n_unknowns() + i];
    if (!(std::abs(curve.unknown(i) - here) <= within * w.sweep.problem.nominal[Index(i)]))
      return false;
  }
  return true;
}

void judge(LineTracker& w, std::size_t k, const GridTrim& e) {
  MatrixBatch one(w.sweep.states(), 1);
  one.set(0, e.A(w.sweep));
  std::vector<Verdict> verdict;
  verdicts(one, verdict);
  w.points.verdict[k] = std::int8_t(verdict[0]);
}

// Two equilibria at one point: the one of lower cost is kept, the other is the second branch.
void settle_between(LineTracker& w, std::size_t k, const GridTrim& other) {
  const bool first = !w.valid[k];
  const OperatingPoint here = first ? other.at : w.at(k);
  if (!first && apart(w.sweep, here, other.at) <= other_branch) return;
  const bool less = first || effort_at(w.sweep, other.at) < effort_at(w.sweep, here);
  if (less) {
    keep(w, k, other);
    keep_matrix(w, k, other);
    if (w.judged) judge(w, k, other);
  }
  if (!first) add_second(w, k, less ? here : other.at);
}

// The last equilibrium before points without one: from the other end, the first after them.
bool before_gap(const LineTracker& w, std::size_t k) {
  return k + 1 < w.count && w.valid[k] && !w.valid[k + 1];
}

// Tracks the line from its other end. If Newton finds the same equilibrium at both ends of a steady
// line, nothing needs tracking. A point of the forward pass is accepted if it is close enough to
// the extrapolation of the points already tracked; otherwise Newton decides. After a gap it begins
// without a starting point, as the forward pass does.
void walk_backward(LineTracker& w, const LineStart& start, bool steady) {
  constexpr double near_enough = 1e-2;              // nominal sizes
  std::optional<OperatingPoint> last = start.last;  // set while on another branch
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
      if (straight(w, k, near_enough)) continue;
      const int known = known_beside(w, k, +1, 2, near);
      if (known == 0 && !before_gap(w, k)) continue;
      if (known > 0) {
        const Extrapolation curve(w, k, near, known);
        if (w.valid[k] && near_point(w, k, curve, near_enough)) continue;
        e.at = w.base;
        move_to(w.sweep, w.axis, double(k), e.at);
        extrapolate(w, k, near, known, e.at);
      } else {
        e.at = from_nothing(w.sweep, place_of(w, k)).at;
      }
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

// NaN for everything without an equilibrium; for eigenvalue results without eigenvalues.
void clear(LineTracker& w, std::size_t k) {
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

}  // namespace

std::vector<Room>& rooms_of_thread() {
  static thread_local std::vector<Room> rooms(Model::model_lanes);
  return rooms;
}

std::optional<AffineLine> structure_of(const Prepared& sweep, const LineStart& start) {
  if (!start.first.valid()) return {};
  return affine_line(sweep, start.place, sweep.axes.size() - 1, start.first);
}

std::vector<LineTracker> track_lines(const Prepared& sweep,
                                     const std::vector<const LineStart*>& starts,
                                     const std::vector<std::optional<AffineLine>>& structures,
                                     const std::vector<LinePoints*>& points,
                                     std::vector<Room>& rooms, bool judged) {
  const bool lanes = has_lanes(sweep);
  std::vector<LineTracker> lines;
  std::vector<LineTracker*> unaided;  // not along an affine axis
  std::vector<std::size_t> numbers;
  std::vector<char> steady(starts.size(), 0);
  lines.reserve(starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const std::optional<AffineLine>& line = structures[i];
    LineTracker& w =
        lines.emplace_back(begin_line(sweep, starts[i]->place, sweep.axes.size() - 1, *points[i],
                                      rooms.at(i), judged && lanes && !line));
    const bool affine = line && walk_affine(w, *starts[i], *line, rooms[i].shares);
    steady[i] = affine && line->steady;
    if (affine) continue;
    unaided.push_back(&w);
    numbers.push_back(i);
  }
  const auto alone = [&](std::size_t l, std::size_t k) {
    return step_forward(*unaided[l], *starts[numbers[l]], k);
  };
  if (lanes && !unaided.empty())
    walk_side_by_side(unaided, alone);
  else
    for (std::size_t l = 0; l < unaided.size(); ++l)
      for (std::size_t k = 0; k < unaided[l]->count; ++k) (void)alone(l, k);
  for (std::size_t i = 0; i < lines.size(); ++i)
    walk_backward(lines[i], *starts[i], steady[i] != 0);
  return lines;
}

void finish_line(LineTracker& w, const LineStart& start, Room& room) {
  eigenvalues(w.A, room.eigenvalues);
  verdicts(w.A, room.verdicts);
  for (std::size_t k = 0; k < w.count; ++k) {
    w.points.verdict[k] = std::int8_t(room.verdicts[k]);
    if (!w.valid[k] || room.eigenvalues.status[k] >= LaneStatus::not_converged) clear(w, k);
  }
  follow_modes(w, start, room.eigenvalues);
  judge_near_axis(w);
}

std::size_t lines_together(const Prepared& sweep) {
  return has_lanes(sweep) ? Model::model_lanes : 1;
}

void walk_lines(const Prepared& sweep, const std::vector<const LineStart*>& starts,
                const std::vector<LinePoints*>& points) {
  std::vector<Room>& rooms = rooms_of_thread();
  std::vector<std::optional<AffineLine>> structures;
  for (const LineStart* start : starts) structures.push_back(structure_of(sweep, *start));
  std::vector<LineTracker> lines = track_lines(sweep, starts, structures, points, rooms);
  for (std::size_t i = 0; i < lines.size(); ++i) finish_line(lines[i], *starts[i], rooms[i]);
}

}  // namespace tiltrim
