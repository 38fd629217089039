// Models in which a small part of the box is unstable, without a trim or beyond a limit: no box
// that touches it is proved stable, none beside it unstable. `make planted` draws 10,000 of them.
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "model/provable.hpp"
#include "prove/prove.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;

namespace prove_planted_test {

namespace {

enum class Plant { window, pair, margin, second, switched, fold, limit, rim };
constexpr std::array all_plants{Plant::window,   Plant::pair, Plant::margin, Plant::second,
                                Plant::switched, Plant::fold, Plant::limit,  Plant::rim};

struct Planted {
  Plant plant;
  int parameters;           // 1 or 2: a window or a disc
  bool bell;                // a bell between -1 and 1, which samples miss, or a parabola
  bool through_state;       // it depends on the equilibrium, not on p itself
  std::array<double, 2> c;  // middle
  double w;                 // radius
  double first;             // of `second`: the other crossing, of all the box
  static constexpr double sigma = 0.5;  // of `margin`
};

Planted draw_planted(Random& draw, int i) {
  const auto place = [&] { return uniform(draw, 0.02, 0.98); };
  Planted p{all_plants[std::size_t(i) % all_plants.size()],
            1 + int(draw() % 2),
            draw() % 2 == 0,
            draw() % 2 == 0,
            {place(), place()},
            std::pow(10.0, uniform(draw, -9, -1)),
            0.3 * place()};
  p.through_state = p.through_state && p.plant != Plant::fold;
  if (p.plant == Plant::rim) p.c = {0.5, 0.5};
  return p;
}

// Positive within w of the middle; of `rim` beyond the root of w, from the middle of the box, where
// it equals its quadratic part but for the fourth order.
template <class S, class X, class P>
S bump(const Planted& planted, const X& x, const P& p) {
  const double per_unit = 1 / planted.w, ln2 = std::log(2.0);
  S square = 0.0;
  const bool bell = planted.bell && planted.plant != Plant::rim;
  for (int k = 0; k < planted.parameters; ++k) {
    const S at = planted.through_state && k == 0 ? S(0.5 * x[0]) : S(p[std::size_t(k)]);
    const S d = (at - planted.c[std::size_t(k)]) * (bell ? per_unit : 1.0);
    square = square + d * d;
  }
  using std::exp;
  if (planted.plant == Plant::rim) return square * square - planted.w * planted.w;
  if (bell) return 2.0 * exp(-ln2 * square) - 1.0;
  return planted.w * planted.w - square;
}

template <class X, class P, class R>
void rates_of(const Planted& planted, const X& x, const P& p, const R& rates) {
  using S = std::remove_cvref_t<decltype(rates[0])>;
  const S b = bump<S>(planted, x, p);
  rates[0] = 2.0 * p[0] - x[0];
  rates[1] = -1.0 * x[1];
  rates[2] = -2.0 * x[2];
  switch (planted.plant) {
    case Plant::window:
      rates[1] = b * x[1];
      break;
    case Plant::pair:
    case Plant::rim:
      rates[1] = b * x[1] + x[2];
      rates[2] = b * x[2] - x[1];
      break;
    case Plant::margin:
      rates[1] = (b - Planted::sigma) * x[1];
      break;
    case Plant::second:
      rates[1] = b * x[1];
      rates[2] = (planted.first - p[0]) * x[2];
      break;
    case Plant::switched:
      rates[1] = (b > 0.0 ? 1.0 : -1.0) * x[1];
      break;
    case Plant::fold:
      rates[0] = -b - x[0] * x[0];
      break;
    case Plant::limit:
      break;
  }
}

ProveProblem problem_of(const Planted& planted) {
  Model m;
  m.name = "planted";
  m.states = {{"x", "", 1}, {"y", "", 1}, {"z", "", 1}};
  m.outputs = {{"out", "", 1}};
  const auto f = [planted](auto x, auto, auto p, auto rates) { rates_of(planted, x, p, rates); };
  const auto h = [planted](auto x, auto, auto p, auto out) {
    using S = std::remove_cvref_t<decltype(out[0])>;
    out[0] = planted.plant == Plant::limit ? S(1.0 + bump<S>(planted, x, p)) : S(0.0 * x[0]);
  };
  ProveProblem problem;
  problem.name = "planted";
  const Eigen::Index n = planted.parameters;
  for (const char* name : {"p", "q"})
    if (std::ssize(m.parameters) < n) {
      m.parameters.push_back({name, "", 1});
      problem.parameters.push_back({name, 0, 1});
    }
  problem.model = provable_model(m, f, h);
  problem.unknowns = problem.equations = {"x", "y", "z"};
  problem.limits = {{"out", {-1.5, 1}}};
  problem.guess = {Eigen::Vector3d(1, 0, 0), Eigen::VectorXd(0), Eigen::VectorXd::Constant(n, 0.5)};
  return problem;
}

// The least and largest distance of a box from the planted middle.
std::pair<double, double> distances(const Planted& planted, const std::vector<Range>& box) {
  double least = 0, most = 0;
  for (std::size_t k = 0; k < box.size(); ++k) {
    const double below = box[k].lower - planted.c[k], above = box[k].upper - planted.c[k];
    const double near = below > 0 ? below : above < 0 ? above : 0;
    least = std::hypot(least, near);
    most = std::hypot(most, std::max(std::abs(below), std::abs(above)));
  }
  return {least, most};
}

// What is wrong with a leaf, or nothing. The edge itself is known to rounding of p: 1e-16 of 1e-9.
const char* wrong(const Planted& planted, const ProofNode& leaf) {
  constexpr double edge = 1e-3;
  const auto [least, most] = distances(planted, leaf.box);
  if (planted.plant == Plant::rim) {
    const double rim = std::sqrt(planted.w);
    const bool beyond = most > rim * (1 + edge), within = least < rim * (1 - edge);
    if (leaf.verdict == ProofVerdict::stable && beyond) return "proved stable";
    if (leaf.verdict == ProofVerdict::unstable && within) return "proved unstable";
    return leaf.verdict == ProofVerdict::no_trim ? "proved to have no trim" : nullptr;
  }
  const bool touches = least < planted.w * (1 - edge);
  const bool leaves = planted.w * (1 + edge) < most;
  const bool second = planted.plant == Plant::second;
  const double rounding = 1e-12;
  const bool below = second && leaf.box[0].lower < planted.first - rounding;
  const bool beyond = second && leaf.box[0].upper > planted.first + rounding;
  switch (leaf.verdict) {
    case ProofVerdict::stable:
      return touches || below ? "proved stable" : nullptr;
    case ProofVerdict::unstable:
      if (planted.plant == Plant::limit) return "proved unstable";
      if (planted.plant == Plant::fold)  // of its two branches one is unstable
        return touches ? "proved unstable" : nullptr;
      return leaves && (!second || beyond) ? "proved unstable" : nullptr;
    case ProofVerdict::no_trim:
      return "proved to have no trim";
    default:
      return nullptr;
  }
}

}  // namespace

TEST_CASE("what is planted in a box is never certified away") {
  Random draw = draws(31);
  int count = trials(200);
  int faults = 0, vain = 0;  // nothing proved at all
  double proved = 0;
  for (int i = 0; i < count; ++i) {
    const Planted planted = draw_planted(draw, i);
    ProveOptions options;
    options.max_boxes = 100;
    options.smallest = 1e-11;
    if (planted.plant == Plant::margin) options.margin = Planted::sigma;
    const Theorem t = prove(problem_of(planted), options);
    std::string fault = t.status() == ProofStatus::proved ? "all proved" : "";
    for (const ProofNode& node : t.tree)
      if (const char* const why = node.split < 0 ? wrong(planted, node) : nullptr) fault = why;
    CAPTURE(int(planted.plant));
    CAPTURE(planted.parameters);
    CAPTURE(planted.bell);
    CAPTURE(planted.through_state);
    CAPTURE(planted.c[0]);
    CAPTURE(planted.w);
    CHECK_MESSAGE(fault.empty(), fault);
    faults += !fault.empty();
    vain += t.undecided == 1;
    proved += t.stable;
  }
  CHECK(proved > 0.5 * count);  // nor does it refuse everything
  tally("a window, fold, limit or crossing in a box", count, faults, vain);
}

namespace {

// Oscillators with damping 1, coupled in a ring by factors whose product is c d^order, d = 2 p - 1:
// eigenvalues -1 + λ ± 5 i with λ^n = c d^order. Of det(I - F) at the middle only terms of this
// order are not zero: whoever drops them sees a stable box.
struct Ring {
  std::vector<int> powers;  // of d in the factor of each oscillator
  int order;                // their sum
  double c;
};

ProveProblem problem_of(const Ring& ring) {
  const std::size_t n = ring.powers.size();
  Model m;
  m.name = "ring";
  m.states = {{"x", "", 1}};
  for (std::size_t i = 0; i < 2 * n; ++i)
    m.states.push_back({(i < n ? "y" : "z") + std::to_string(i % n), "", 1});
  m.parameters = {{"p", "", 1}};
  const auto f = [ring, n](auto x, auto, auto p, auto rates) {
    using S = std::remove_cvref_t<decltype(rates[0])>;
    const S d = 2.0 * p[0] - 1.0;
    rates[0] = 2.0 * p[0] - x[0];
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t y = 1 + i, z = 1 + n + i, next = (i + 1) % n;
      S factor = i == 0 ? ring.c * d : S(1.0 * d);
      if (ring.powers[i] == 2) factor = factor * d;
      rates[y] = factor * x[1 + next] - x[y] - 5.0 * x[z];
      rates[z] = factor * x[1 + n + next] - x[z] + 5.0 * x[y];
    }
  };
  ProveProblem problem;
  problem.name = "ring";
  problem.parameters = {{"p", 0, 1}};
  problem.model = provable_model(m, f, [](auto, auto, auto, auto) {});
  problem.unknowns = problem.equations = {"x"};
  problem.guess = {Eigen::VectorXd::Zero(Eigen::Index(1 + 2 * n)), Eigen::VectorXd(0),
                   Eigen::VectorXd::Constant(1, 0.5)};
  problem.guess.x[0] = 1;
  return problem;
}

}  // namespace

TEST_CASE("an instability by terms of third or fourth order alone is never certified away" *
          thorough) {
  Random draw = draws(32);
  const std::vector<std::vector<int>> rings{{1, 1, 1}, {1, 1, 1, 1}, {2, 2}, {1, 2}};
  for (int i = 0; i < trials(40); ++i) {
    Ring ring{rings[std::size_t(i) % rings.size()], 0, uniform(draw, 1.05, 1.5)};
    for (const int power : ring.powers) ring.order += power;
    ProveOptions options;
    options.max_boxes = 100;
    const Theorem t = prove(problem_of(ring), options);
    const double edge = std::pow(ring.c, -1.0 / ring.order);
    const bool both_ends = ring.order % 2 == 0;
    std::string fault;
    for (const ProofNode& node : t.tree) {
      if (node.split >= 0) continue;
      const double from = 2 * node.box[0].lower - 1, to = 2 * node.box[0].upper - 1;
      constexpr double rounding = 1e-12;
      const bool touches = to > edge + rounding || (both_ends && from < -edge - rounding);
      const bool leaves = to > -edge + rounding && from < edge - rounding;
      if (node.verdict == ProofVerdict::stable && touches) fault = "proved stable";
      if (node.verdict == ProofVerdict::unstable && leaves) fault = "proved unstable";
    }
    CAPTURE(i % 4);
    CAPTURE(ring.c);
    CHECK_MESSAGE(fault.empty(), fault);
    CHECK(t.stable > 0.9 * (both_ends ? edge : 0.5 * (1 + edge)));
    CHECK(t.unstable > 0.5 * (both_ends ? 1 - edge : 0.5 * (1 - edge)));
  }
}

}  // namespace prove_planted_test
