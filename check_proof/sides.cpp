// The numbers of the loop over a box, and where its equations switch.
#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "check_proof/leaf.hpp"

namespace tiltrim::checking {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

Form number(const Bounds& of, std::size_t k, std::size_t n) {
  return Form::variable(halved(Ball(of.lower) + Ball(of.upper)),
                        halved(Ball(of.upper) - Ball(of.lower)), k, n);
}

struct Segment {
  std::size_t at;  ///< of the schedule: 0 before the first tilt, i after tilt i - 1
  double overlap;  ///< with the range of the tilt
};

// dk/dη of gain k on a segment.
Ball slope_on(const Statement& s, std::size_t segment, std::size_t k) {
  if (segment == 0 || segment == s.tilts.size()) return {};
  return (Ball(s.gains[segment][k]) - Ball(s.gains[segment - 1][k])) /
         (Ball(s.tilts[segment]) - Ball(s.tilts[segment - 1]));
}

std::vector<Segment> segments(const Statement& s, const Ball& eta) {
  const double low = double_below(eta), high = double_above(eta);
  std::vector<Segment> all;
  for (std::size_t i = 0; i <= s.tilts.size(); ++i) {
    const double from = i == 0 ? -infinite : s.tilts[i - 1];
    const double to = i == s.tilts.size() ? infinite : s.tilts[i];
    const double overlap = std::min(high, to) - std::max(low, from);
    // Not "overlap < 0": a tilt that is not a number touches every segment.
    if (!(std::min(high, to) < std::max(low, from))) all.push_back({i, overlap});
  }
  return all;
}

// Segments that the box barely touches are covered by their neighbour, whose gains are widened by
// what the two differ there: then the ends of the schedule are no sides.
constexpr double barely = 1e-9;  // rad

std::vector<std::pair<Segment, std::vector<Segment>>> with_neighbours(std::vector<Segment> all) {
  std::vector<std::pair<Segment, std::vector<Segment>>> kept;
  const auto widest = std::ranges::max_element(all, {}, &Segment::overlap);
  const std::size_t main = widest == all.end() ? 0 : widest->at;
  const auto touched = [&](const Segment& s) { return s.overlap < barely && s.at != main; };
  for (const Segment& s : all)
    if (!touched(s)) kept.push_back({s, {}});
  for (const Segment& s : all) {
    if (!touched(s)) continue;
    const auto near = std::ranges::find_if(
        kept, [&](const auto& k) { return k.first.at + 1 == s.at || s.at + 1 == k.first.at; });
    if (near == kept.end())
      kept.push_back({s, {}});
    else
      near->second.push_back(s);
  }
  return kept;
}

void set_gains(const Statement& s, Numbers& numbers, const Segment& on,
               const std::vector<Segment>& touched) {
  const std::size_t base = std::min(on.at, s.tilts.size() - 1);
  for (std::size_t k = 0; k < gain_count; ++k) {
    const Ball slope = slope_on(s, on.at, k);
    Form gain =
        Form(Ball(s.gains[base][k])) + Form(slope) * (numbers.eta - Form(Ball(s.tilts[base])));
    for (const Segment& other : touched)
      gain.rest = upper(gain.rest + magnitude(slope - slope_on(s, other.at, k)) * Ball(barely));
    numbers.*gains()[k] = gain;
  }
}

// Each way in which (12) may share the pitch control.
void add_authorities(std::vector<Side>& all, const Side& side) {
  const auto add = [&](const char* name, Form share, bool cyclic, bool elevator) {
    Side one = side;
    one.name += name;
    one.numbers.authority = std::move(share);
    one.cyclic = cyclic;
    one.elevator = elevator;
    all.push_back(std::move(one));
  };
  const Numbers& a = side.numbers;
  const Form past = a.eta - a.cyclic_off;
  if (a.cyclic_blend.is_zero()) {
    const Ball over = range(past);
    if (!over.is_negative()) add("cyclic", 1.0, true, false);
    if (!less_equal(Ball(0), over)) add("elevator", 0.0, false, true);
    return;
  }
  const Form t = past / a.cyclic_blend + Form(0.5);
  const Ball over = range(t);
  if (!less(over, Ball(1))) add("cyclic", 1.0, true, false);
  if (!less(Ball(0), over)) add("elevator", 0.0, false, true);
  if (!less_equal(over, Ball(0)) && !less_equal(Ball(1), over))
    add("blend", t * t * (Form(3.0) - Form(2.0) * t), false, false);
}

// The pieces of (16) whose interior the heights meet; on a common end neighbours agree.
std::vector<int> pieces_of(const Bounds& h) {
  constexpr std::array<double, 5> ends{-infinite, 0, 20, 120, infinite};
  std::vector<int> all;
  for (int i = 0; i < 4; ++i)
    if (h.lower < ends[std::size_t(i) + 1] && h.upper > ends[std::size_t(i)]) all.push_back(i);
  return all;
}

}  // namespace

std::vector<Side> sides(const Statement& s, const Box& box) {
  const std::size_t n = box.size();
  std::vector<int> pieces{0};
  std::size_t height = n;
  for (std::size_t k = 0; k < n; ++k)
    if (!s.parameters[k].member) {
      height = k;
      pieces = pieces_of(box[k]);
    }
  std::vector<Side> all;
  for (const int piece : pieces) {
    Side side{{}, s.numbers};
    if (height < n) {
      const Commanded commanded = corridor(number(box[height], height, n), piece);
      side.numbers.V = commanded.V;
      side.numbers.gamma = side.numbers.eta = commanded.angle;
    }
    const auto set_own = [&](Numbers& numbers) {
      for (std::size_t k = 0; k < n; ++k)
        if (s.parameters[k].member) numbers.*(s.parameters[k].member) = number(box[k], k, n);
    };
    set_own(side.numbers);
    if (s.tilts.empty()) {
      add_authorities(all, side);
      continue;
    }
    for (const auto& [segment, touched] : with_neighbours(segments(s, range(side.numbers.eta)))) {
      Side on = side;
      set_gains(s, on.numbers, segment, touched);
      set_own(on.numbers);
      on.name = fmt::format("tilts {} of the schedule, ", segment.at);
      add_authorities(all, on);
    }
  }
  return all;
}

}  // namespace tiltrim::checking
