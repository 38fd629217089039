// Lines judged by verdicts alone.
#include <algorithm>

#include "sweep/line_affine.hpp"
#include "sweep/line_tracking.hpp"

namespace tiltrim {

namespace {

// No other equilibrium is found from the line's end than the steady one of all its points.
bool same_from_end(const Prepared& sweep, const LineStart& start) {
  return !start.last || apart(sweep, *start.last, start.first.at) <= other_branch;
}

// Of a line whose matrices are affine in φ, with one equilibrium; false where that is not so or
// the polynomial cannot tell.
bool judge_by_polynomial(const Prepared& sweep, const LineStart& start,
                         std::optional<AffineLine>& line, JudgedLine& judged) {
  static thread_local std::vector<Verdict> verdicts;
  if (!line || !line->steady || !by_matrix(start.first.exact, start.first.status) ||
      !same_from_end(sweep, start))
    return false;
  judged.shares = shares_along(sweep, start, *line);
  if (judged.shares.empty() || !judge_by_polynomial(*line, judged.shares, verdicts)) return false;
  judged.verdicts.resize(verdicts.size());
  std::ranges::transform(verdicts, judged.verdicts.begin(),
                         [](Verdict v) { return std::int8_t(v); });
  judged.affine = std::move(line);
  return true;
}

void judge_tracked(LineTracker& w, const LineStart& start, Room& room,
                   std::vector<std::int8_t>& codes) {
  const LinePoints& points = w.points;
  bool plain = true;
  for (std::size_t k = 0; k < w.count; ++k)
    plain = plain && (!w.valid[k] || by_matrix(w.exact[k], TrimStatus(points.status[k])));
  if (plain && w.judged) {
    codes = points.verdict;
    return;
  }
  if (!plain) {
    if (w.judged)
      walk_lines(w.sweep, {&start}, {&w.points});
    else
      finish_line(w, start, room);
    codes = points.verdict;
    return;
  }
  verdicts(w.A, room.verdicts);
  codes.resize(w.count);
  for (std::size_t k = 0; k < w.count; ++k)
    codes[k] = w.valid[k] ? std::int8_t(room.verdicts[k]) : std::int8_t(-1);
}

}  // namespace

void judge_lines(const Prepared& sweep, std::span<const LineStart> starts,
                 std::vector<JudgedLine>& judged) {
  static thread_local std::vector<LinePoints> points(Model::model_lanes);
  std::vector<const LineStart*> left;
  std::vector<LinePoints*> points_left;
  std::vector<std::optional<AffineLine>> structures;
  std::vector<std::size_t> numbers;
  judged.resize(starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    judged[i].affine.reset();
    std::optional<AffineLine> line = structure_of(sweep, starts[i]);
    if (judge_by_polynomial(sweep, starts[i], line, judged[i])) continue;
    points_left.push_back(&points[left.size()]);
    left.push_back(&starts[i]);
    structures.push_back(std::move(line));
    numbers.push_back(i);
  }
  std::vector<Room>& rooms = rooms_of_thread();
  std::vector<LineTracker> lines = track_lines(sweep, left, structures, points_left, rooms, true);
  for (std::size_t i = 0; i < lines.size(); ++i)
    judge_tracked(lines[i], *left[i], rooms[i], judged[numbers[i]].verdicts);
}

}  // namespace tiltrim
