// Sweeps against planted truth: closed-form eigenvalues and equilibria, roots, re-trims.
#include "sweep/sweep.hpp"

#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <complex>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <numbers>
#include <set>
#include <thread>

#include "linearize/batch.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "model/formulas.hpp"
#include "model/lookup.hpp"
#include "runtime/log.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "sweep/record.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"
#include "tests/random_draws.hpp"
#include "tests/toy_models.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
namespace fs = std::filesystem;

namespace sweep_test {

namespace {

constexpr double located = 1e-8;   // of a crossing, in the axis's unit
constexpr double rounded = 1e-15;  // of a coordinate near one, in addition to its stated error
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double pi = std::numbers::pi;

using Complex = std::complex<double>;

// ---- planted models: x' = A(p) x + u - u0(p), trimmed at x = 0 by u = u0(p), whatever A is ----

using Spectrum = std::vector<Complex>;  // real eigenvalues, and of each pair the upper one
using Matrices = std::function<MatrixXd(const VectorXd& p)>;

MatrixXd blocks(const Spectrum& spectrum) {
  Index n = 0, at = 0;
  for (const Complex& z : spectrum) n += z.imag() == 0 ? 1 : 2;
  MatrixXd A = MatrixXd::Zero(n, n);
  for (const Complex& z : spectrum) {
    const Index size = z.imag() == 0 ? 1 : 2;
    A.block(at, at, size, size).diagonal().setConstant(z.real());
    if (size == 2) A(at, at + 1) = z.imag(), A(at + 1, at) = -z.imag();
    at += size;
  }
  return A;
}

// Singular values 0.5 .. 2: a change of coordinates that loses no digits.
MatrixXd change_of_coordinates(Random& random, Index n) {
  const auto orthogonal = [&] {
    const MatrixXd raw = MatrixXd::NullaryExpr(n, n, [&] { return uniform(random, -1, 1); });
    return algebra::orthogonal(raw);
  };
  const VectorXd sizes =
      VectorXd::NullaryExpr(n, [&] { return std::exp2(uniform(random, -1, 1)); });
  return orthogonal() * sizes.asDiagonal() * orthogonal();
}

Matrices in_other_coordinates(Random& random, Index n, const Matrices& A) {
  const MatrixXd T = change_of_coordinates(random, n);
  return [A, T, inverse = algebra::inverse(T)](const VectorXd& p) -> MatrixXd {
    return T * A(p) * inverse;
  };
}

VectorXd trimmed_input(Index n, const VectorXd& p) {
  return VectorXd::NullaryExpr(n, [&](Index i) { return 0.3 * std::sin(double(i) + p.sum()); });
}

Signals numbered(const std::string& letter, Index n) {
  Signals all;
  for (Index i = 0; i < n; ++i) all.push_back({fmt::format("{}{}", letter, i), "", 1.0});
  return all;
}

Model planted(const std::vector<std::string>& parameters, const Matrices& A) {
  Model m;
  m.name = "planted";
  const Index n = A(VectorXd::Ones(std::ssize(parameters))).rows();
  m.states = numbered("x", n);
  m.inputs = numbered("u", n);
  for (const std::string& name : parameters) m.parameters.push_back({name, "", 1.0});
  m.f = [A](const VectorXd& x, const VectorXd& u, const VectorXd& p) -> VectorXd {
    return A(p) * x + u - trimmed_input(x.size(), p);
  };
  m.derivatives = [A, n](const OperatingPoint& at,
                         const std::vector<Index>& variables) -> MatrixXd {
    MatrixXd all(n, 2 * n);
    all << A(at.p), MatrixXd::Identity(n, n);
    return all(Eigen::all, variables);
  };
  return m;
}

// One state, x' = rate(x, p).
Model scalar(const std::function<double(double x, double p)>& rate,
             const std::function<double(double x, double p)>& slope) {
  Model m = ::scalar(rate);
  m.derivatives = [slope](const OperatingPoint& at, const std::vector<Index>&) -> MatrixXd {
    return MatrixXd::Constant(1, 1, slope(at.x[0], at.p[0]));
  };
  return m;
}

// All states steady; the inputs free, or the states if there are none.
SweepRequest request(const Model& m, const std::string& name = "planted") {
  const std::vector<std::string> inputs = names(m.inputs), states = names(m.states);
  const OperatingPoint guess{VectorXd::Zero(std::ssize(states)), VectorXd::Zero(std::ssize(inputs)),
                             VectorXd::Ones(std::ssize(m.parameters))};
  return {name, m, {.free = inputs.empty() ? states : inputs, .steady = states}, guess, inputs};
}

SweepRequest with_spectrum(const std::function<Spectrum(double p)>& spectrum) {
  return request(planted({"p"}, [=](const VectorXd& p) { return blocks(spectrum(p[0])); }));
}

SweepAxis axis(const std::string& name, const std::vector<double>& values) {
  return {name, {{name, "", name, values, values}}};
}

std::vector<double> spaced(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(from + (to - from) * i / (count - 1));
  return values;
}

// Planted models need only Newton's method.
SweepOptions newton_only() {
  SweepOptions options;
  options.trimming.method = TrimMethod::newton;
  return options;
}

SweepMap swept(const SweepRequest& r, const std::vector<SweepAxis>& axes) {
  return sweep({r}, axes, newton_only());
}

// ---- expectations of a line ----

struct Event {
  double at;
  CrossingKind kind;
  int before, after;
  double frequency = 0.0;
};

std::vector<AxisCrossing> crossings_of(const SweepMap& map, int condition, int axis = 0) {
  std::vector<AxisCrossing> own;
  for (const AxisCrossing& c : map.crossings)
    if (c.condition == condition && c.axis == axis) own.push_back(c);
  return own;
}

void check_crossings(const SweepMap& map, const std::vector<Event>& expected, int condition = 0,
                     int axis = 0) {
  const std::vector<AxisCrossing> found = crossings_of(map, condition, axis);
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double at = found[i].at[std::size_t(axis)];
    CHECK_NEAR(at, expected[i].at, located);
    CHECK_NEAR(at, expected[i].at, found[i].error + rounded);
    CHECK(to_string(found[i].kind) == to_string(expected[i].kind));
    CHECK(found[i].unstable_before == expected[i].before);
    CHECK(found[i].unstable_after == expected[i].after);
    CHECK_NEAR(found[i].frequency, expected[i].frequency, located);
    CHECK(found[i].error <= located);
  }
}

struct Stretch {
  double from, to;
  IntervalVerdict verdict;
  int unstable = 0;
};

void check_intervals(const SweepMap& map, const std::vector<Stretch>& expected) {
  REQUIRE(map.intervals.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const AxisInterval& found = map.intervals[i];
    CHECK_NEAR(found.from, expected[i].from, located);
    CHECK_NEAR(found.to, expected[i].to, located);
    CHECK(to_string(found.verdict) == to_string(expected[i].verdict));
    CHECK(found.unstable == expected[i].unstable);
    if (expected[i].verdict == IntervalVerdict::stable) CHECK(found.abscissa <= located);
    if (expected[i].verdict == IntervalVerdict::unstable) CHECK(found.abscissa > 0);
  }
}

double bisected(double low, double high, const std::function<bool(double)>& as_at_low) {
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (as_at_low(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// ---- studies ----

Study study(const std::string& text) { return parse_study(text, "sweep_test.toml"); }

SweepMap swept(const Study& s, const SweepOptions& options = {}) {
  return sweep(sweep_requests(s, s.conditions, s.sweep->axes), s.sweep->axes, options);
}

// One point at a time: trim without a neighbour, linearize, modes.
Eigen::VectorXcd spectrum_of(const Vehicle& vehicle, const Command& command) {
  const TrimResult level = trim_closed_loop(vehicle, command);
  REQUIRE(level);
  const Modes found = modes(linearize(closed_loop(vehicle), level.point));
  return Eigen::VectorXcd::NullaryExpr(
      std::ssize(found.modes), [&](Index i) { return found.modes[std::size_t(i)].eigenvalue; });
}

int unstable(const Eigen::VectorXcd& spectrum) {
  return int(std::ranges::count_if(spectrum, [](const Complex& z) { return z.real() > 0; }));
}

Spectrum spectrum_at(const SweepMap& map, std::size_t point) {
  Spectrum all;
  for (std::size_t i = point * map.modes(); i < (point + 1) * map.modes(); ++i)
    all.emplace_back(map.eigenvalue_re[i], map.eigenvalue_im[i]);
  return all;
}

// Largest relative distance of two spectra, each eigenvalue to the nearest unmatched one.
double relative_distance(Spectrum a, const Eigen::VectorXcd& b) {
  double most = 0.0;
  for (const Complex& z : b) {
    const auto nearest =
        std::ranges::min_element(a, {}, [&](const Complex& y) { return std::abs(y - z); });
    most = std::max(most, std::abs(*nearest - z) / std::abs(z));
    a.erase(nearest);
  }
  return most;
}

// ---- the same bits ----

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void check_same(const SweepMap& a, const SweepMap& b) {
  CHECK(a.conditions == b.conditions);
  CHECK(a.mode_names == b.mode_names);
  CHECK(a.reasons == b.reasons);
  CHECK(same_bits(a.status, b.status));
  CHECK(same_bits(a.verdict, b.verdict));
  CHECK(same_bits(a.reason, b.reason));
  CHECK(same_bits(a.residual, b.residual));
  CHECK(same_bits(a.spectral_abscissa, b.spectral_abscissa));
  CHECK(same_bits(a.damping, b.damping));
  CHECK(same_bits(a.state, b.state));
  CHECK(same_bits(a.input, b.input));
  CHECK(same_bits(a.eigenvalue_re, b.eigenvalue_re));
  CHECK(same_bits(a.eigenvalue_im, b.eigenvalue_im));
  CHECK(same_bits(a.confidence, b.confidence));
  CHECK(same_bits(a.second_branch, b.second_branch));
  CHECK(same_bits(a.second.points, b.second.points));
  CHECK(same_bits(a.second.state, b.second.state));
  CHECK(same_bits(a.second.input, b.second.input));
  CHECK(same_bits(a.second.eigenvalue_re, b.second.eigenvalue_re));
  CHECK(same_bits(a.second.eigenvalue_im, b.second.eigenvalue_im));
  CHECK(same_bits(a.second.verdict, b.second.verdict));
  CHECK(as_bytes(LineVerdicts{a.crossings, a.intervals}) ==
        as_bytes(LineVerdicts{b.crossings, b.intervals}));
}

std::string reason_at(const SweepMap& map, std::size_t point) {
  return map.reasons[std::size_t(map.reason[point])];
}

}  // namespace

// ---- 1. crossings along an axis ----

namespace {

// Crosses at r (real, leaving) and at s (a pair of frequency 3 + p, entering).
struct PlantedCrossing {
  double r, s;

  Spectrum operator()(double p) const {
    return {p - r, Complex(2 * (s - p), 3 + p), -1 - p, Complex(-0.5, 1)};
  }
  int unstable(double p) const { return (p > r) + 2 * (p < s); }
  std::vector<Event> expected(bool rising) const {
    const double step = rising ? 1e-7 : -1e-7;
    std::vector<Event> events{
        {r, CrossingKind::zero, unstable(r - step), unstable(r + step)},
        {s, CrossingKind::hopf, unstable(s - step), unstable(s + step), 3 + s}};
    std::ranges::sort(events, {}, [&](const Event& e) { return rising ? e.at : -e.at; });
    return events;
  }
};

SweepRequest crossing_request(Random& random, const PlantedCrossing& c) {
  const auto A = [c](const VectorXd& p) { return blocks(c(p[0])); };
  return request(planted({"p"}, in_other_coordinates(random, 6, A)));
}

}  // namespace

TEST_CASE("real and Hopf crossings are located on linear, log, listed and falling axes") {
  Random random(1);
  std::vector<double> logarithmic;
  for (int i = 0; i <= 8; ++i) logarithmic.push_back(0.01 * std::pow(100.0, i / 8.0));
  for (const std::vector<double>& values :
       {spaced(0.01, 1, 11), logarithmic, {0.01, 0.05, 0.3, 0.31, 0.7, 1.0}, spaced(1, 0.01, 7)}) {
    for (int i = 0; i < trials(20); ++i) {
      const PlantedCrossing c{uniform(random, 0.02, 0.99), uniform(random, 0.02, 0.99)};
      const SweepMap map = swept(crossing_request(random, c), {axis("p", values)});
      check_crossings(map, c.expected(values.front() < values.back()));
      for (const AxisInterval& v : map.intervals)
        CHECK(v.unstable == c.unstable(0.5 * (v.from + v.to)));
      CHECK(map.intervals.size() == 3);
      CHECK(map.intervals.front().from == values.front());
      CHECK(map.intervals.back().to == values.back());
    }
  }
}

TEST_CASE("a crossing says which mode it is") {
  const PlantedCrossing c{0.33, 0.61};
  const SweepMap map = swept(with_spectrum(c), {axis("p", spaced(0, 1, 6))});
  check_crossings(map, c.expected(true));
  REQUIRE(map.crossings.size() == 2);
  CHECK(map.crossings[0].mode_name == "x0");
  CHECK(map.crossings[1].mode_name == "x1 + x2");
  for (const AxisCrossing& found : map.crossings) {
    REQUIRE(found.mode >= 0);
    CHECK(map.mode_names[0][std::size_t(found.mode)] == found.mode_name);
    const Complex start = spectrum_at(map, 0)[std::size_t(found.mode)];
    CHECK_NEAR(start.real(), found.frequency > 0 ? 2 * c.s : -c.r, 1e-12);
  }
}

TEST_CASE("a crossing at a grid point") {
  Random random(2);
  for (int draw = 0; draw < 20; ++draw)  // of the rounding at the point
    for (const double r : {0.25, 0.5}) {
      const PlantedCrossing c{r, 0.75};
      check_crossings(swept(crossing_request(random, c), {axis("p", spaced(0, 1, 9))}),
                      c.expected(true));
    }
}

TEST_CASE("a crossing exactly at a grid point is one") {
  const PlantedCrossing c{0.25, 0.75};
  check_crossings(swept(with_spectrum(c), {axis("p", spaced(0, 1, 9))}), c.expected(true));
}

TEST_CASE("a crossing at an end of the axis leaves the interval as planted") {
  for (const double end : {0.0, 1.0})
    for (const double sign : {-1.0, 1.0}) {
      const auto spectrum = [=](double p) { return Spectrum{sign * (p - end), -1.0}; };
      const SweepMap map = swept(with_spectrum(spectrum), {axis("p", spaced(0, 1, 9))});
      const bool left = sign * (0.5 - end) < 0;
      for (const AxisCrossing& x : map.crossings) CHECK_NEAR(x.at[0], end, located);
      double inside = 0.0;
      for (const AxisInterval& v : map.intervals)
        if (v.verdict == (left ? IntervalVerdict::stable : IntervalVerdict::unstable))
          inside += v.to - v.from;
      CHECK_NEAR(inside, 1.0, located);
    }
}

// x' = A(p) (x - x0(p)) with the states free: the trim's Jacobian is the matrix itself.
TEST_CASE("a real crossing at which the trim itself is singular") {
  SweepRequest r = request(scalar([](double x, double p) { return (p - 0.37) * (x - p); },
                                  [](double, double p) { return p - 0.37; }));
  check_crossings(swept(r, {axis("p", spaced(0, 1, 6))}), {{0.37, CrossingKind::zero, 0, 1}});
}

TEST_CASE("coupled columns move together, between the points too") {
  const auto A = [](const VectorXd& p) {
    return blocks({p[0] + p[1] - 2.9, Complex(p[0] * p[1] - 1.7, 2), -1.0});
  };
  SweepAxis both = axis("p", spaced(0, 1, 5));
  both.columns.push_back({"q", "", "q", spaced(2, 3, 5), spaced(2, 3, 5)});
  const double r = 0.45, s = -1 + std::sqrt(1 + 1.7);  // p (p + 2) = 1.7
  check_crossings(swept(request(planted({"p", "q"}, A)), {both}),
                  {{r, CrossingKind::zero, 0, 1}, {s, CrossingKind::hopf, 1, 3, 2}});
}

TEST_CASE("along h the corridor holds between the points") {
  const auto A = [](const VectorXd& p) {
    return blocks({p[0] - 7.3, Complex(0.5 - p[2], 2), p[1] - 10});
  };
  const Study s = study(R"([[condition]]
name = "any"
V = 5
gamma_deg = 0
eta_deg = 0
[[sweep.axis]]
key = "h"
from = 0
to = 120
count = 9)");
  const double V = bisected(0, 120, [](double h) { return corridor(h).V < 7.3; });
  const double eta = bisected(0, 120, [](double h) { return corridor(h).eta > 0.5; });
  check_crossings(swept(request(planted({"V", "gamma", "eta"}, A)), s.sweep->axes),
                  {{V, CrossingKind::zero, 0, 1}, {eta, CrossingKind::hopf, 1, 3, 2}});
}

// ---- 2. windows narrower than the grid ----

namespace {

// The real part c ((p - middle)² + bend) of one eigenvalue or a pair, among others that stay left.
struct Window {
  double middle, c, bend;
  bool pair;
  int others;

  Spectrum operator()(double p) const {
    const double d = p - middle;
    const double re = c * (d * d + bend);
    Spectrum all{pair ? Complex(re, 2 + p) : Complex(re)};
    for (int i = 0; i < others; ++i)
      all.push_back(i % 2 ? Complex(-0.7 * i, 1.3 * i) : Complex(-1.0 - i));
    return all;
  }
};

std::vector<SweepRequest> window_requests(Random& random, const std::vector<Window>& windows) {
  std::vector<SweepRequest> all;
  for (const Window& w : windows) {
    const auto A = [w](const VectorXd& p) { return blocks(w(p[0])); };
    const Index n = A(vec({0})).rows();
    all.push_back(request(planted({"p"}, in_other_coordinates(random, n, A))));
    // Conditions of one map have the same states.
    REQUIRE(n == all.front().model.states.size());
  }
  return all;
}

Window random_window(Random& random, double bend_sign) {
  constexpr double step = 0.1;
  const double width = step * std::pow(10.0, uniform(random, -3, -1));
  Window w{uniform(random, 0.01, 0.99), 0, bend_sign * width * width / 4, random() % 2 == 0, 3};
  w.c = uniform(random, 0.3, 3) * (random() % 2 ? 1 : -1);
  if (w.pair) w.others = 2;  // five states each: 2 + 1 + 2 or 1 + 1 + 2 + 1
  return w;
}

}  // namespace

TEST_CASE("windows from a tenth to a thousandth of a grid step are found, both ends") {
  Random random(3);
  std::vector<Window> windows;
  for (int i = 0; i < trials(500); ++i) windows.push_back(random_window(random, -1));
  const SweepMap map =
      sweep(window_requests(random, windows), {axis("p", spaced(0, 1, 11))}, newton_only());
  int missed = 0, invented = 0, beyond_error = 0;
  double worst = 0.0;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const Window& w = windows[i];
    const std::vector<AxisCrossing> found = crossings_of(map, int(i));
    missed += found.size() < 2;
    invented += found.size() > 2;
    for (std::size_t k = 0; k < found.size() && found.size() == 2; ++k) {
      const double end = w.middle + (k ? 1 : -1) * std::sqrt(-w.bend);
      const double miss = std::abs(found[k].at[0] - end);
      worst = std::max(worst, miss);
      beyond_error += miss > found[k].error;
      CHECK(found[k].kind == (w.pair ? CrossingKind::hopf : CrossingKind::zero));
      CHECK(std::abs(found[k].unstable_after - found[k].unstable_before) == (w.pair ? 2 : 1));
    }
  }
  CHECK(missed == 0);
  CHECK(invented == 0);
  CHECK(worst <= located);
  CHECK(beyond_error == 0);
}

TEST_CASE("curves that just miss the axis do not cross it") {
  Random random(4);
  std::vector<Window> windows;
  for (int i = 0; i < trials(200); ++i) windows.push_back(random_window(random, 1));
  const SweepMap map =
      sweep(window_requests(random, windows), {axis("p", spaced(0, 1, 11))}, newton_only());
  CHECK(map.crossings.empty());
  CHECK(map.intervals.size() == windows.size());
}

TEST_CASE("where an eigenvalue stays on the axis nothing is stable, and others still cross") {
  // V' = a - s V², h' = k (s V² - a), s = exp(-h/7): every h has its V, so one eigenvalue is zero
  // but for rounding. The other, -s V (2 + k V/7), changes sign at k = -14/V.
  const double crossing = -14 / std::sqrt(2 * std::exp(3.0 / 7));
  const auto along = [](const std::string& range) {
    return swept(study(R"x([model]
      state = [{name = "V", unit = "m/s", rate = "a - exp(-h/7)*V^2"},
               {name = "h", unit = "m", rate = "k*(exp(-h/7)*V^2 - a)"}]
      parameter = [{name = "k", unit = "1/s", value = 0.1}, {name = "a", value = 2}]
      [[condition]]
      name = "level"
      h = 3
      V = [0.1, 10]
      rates = {h = "implied"}
      [[sweep.axis]]
      key = "k"
      )x" + range));
  };
  for (const int count : {2, 5, 16, 31, 64}) {
    const SweepMap map = along("from = 0.1\nto = 3\ncount = " + std::to_string(count));
    CHECK(map.crossings.empty());
    check_intervals(map, {{0.1, 3, IntervalVerdict::undecided}});
  }
  for (const int count : {2, 7, 12, 40}) {
    const SweepMap map = along("from = -12\nto = -3\ncount = " + std::to_string(count));
    REQUIRE(map.crossings.size() == 1);
    const AxisCrossing& c = map.crossings.front();
    CHECK_NEAR(c.at[0], crossing, c.error);
    CHECK(c.error <= 1e-5);
    CHECK(to_string(c.kind) == "zero");
    REQUIRE(map.intervals.size() == 2);
    CHECK(map.intervals[0].verdict == IntervalVerdict::unstable);
    CHECK(map.intervals[0].unstable == 1);
    CHECK(map.intervals[0].from == -12);
    CHECK(map.intervals[0].to == map.intervals[1].from);
    CHECK_NEAR(map.intervals[0].to, crossing, c.error);
    CHECK(map.intervals[1].verdict == IntervalVerdict::undecided);
    CHECK(map.intervals[1].to == -3);
  }
}

TEST_CASE(
    "where the search spends its pieces next to the axis, the rest is undecided, not stable") {
  // λ² + d λ + k = 0: unstable where k < 0, undamped where d = 0.
  const auto oscillator = [](const std::function<double(double p)>& k,
                             const std::function<double(double p)>& d) {
    return request(planted({"p"}, [=](const VectorXd& p) {
      return MatrixXd{{0, 1}, {-k(p[0]), -d(p[0])}};
    }));
  };
  const auto away = [](double p) { return -p; };
  const struct {
    SweepRequest request;
    double from, to, stable_to;
  } cases[] = {
      {oscillator(away, [](double p) { return 0.01 * std::abs(p) + 1e-6; }), -1.3, 1, 0},
      {oscillator(away, [](double p) { return p * p; }), -1.3, 1, 0},
      {oscillator(away, [](double) { return 0.0; }), -1, 1, -INFINITY},
      {oscillator(away, [](double) { return 0.0; }), -2, 1, -INFINITY},
  };
  for (const auto& c : cases)
    for (const int count : {2, 3, 4, 5, 12}) {
      const SweepMap map = swept(c.request, {axis("p", spaced(c.from, c.to, count))});
      CAPTURE(count);
      for (const AxisInterval& i : map.intervals) {
        if (i.verdict == IntervalVerdict::stable) CHECK(i.to <= c.stable_to + 1e-6);
        if (i.verdict == IntervalVerdict::unstable) CHECK(i.from >= -1e-6);
      }
      CHECK(map.intervals.front().from == c.from);
      if (c.stable_to == 0) CHECK(map.intervals.front().verdict == IntervalVerdict::stable);
      CHECK_NEAR(map.intervals.back().to, c.to, 1e-15);
    }
}

TEST_CASE("a curve that touches the axis is a touch") {
  Random random(5);
  for (int i = 0; i < 4; ++i) {
    Window w = random_window(random, 1);
    w.bend = 0;
    const SweepMap map =
        sweep(window_requests(random, {w}), {axis("p", spaced(0, 1, 11))}, newton_only());
    for (const AxisCrossing& c : map.crossings) {
      CHECK_NEAR(c.at[0], w.middle, 1e-6);  // rounding of 1e-13 / c, and the root of it
      CHECK(c.kind == CrossingKind::touch);
    }
    CHECK(!map.crossings.empty());
    CHECK(map.crossings.size() < 10);
  }
}

// ---- 3. mode identity ----

namespace {

// Three pieces: two real modes that veer at a gap (or cross), a pair that comes and goes as two
// real ones, a real one that passes through. Labels continue where the path is continuous.
struct Paths {
  double a, gap, at;      // a ± √((p - at)² + gap²)
  double b, merge, part;  // b ± √(4 (p - merge)(p - part))
  double c;               // c - p

  MatrixXd matrix(double p) const {
    MatrixXd A = MatrixXd::Zero(5, 5);
    A(0, 0) = a + (p - at), A(1, 1) = a - (p - at), A(0, 1) = A(1, 0) = gap;
    A(2, 2) = A(3, 3) = b, A(2, 3) = 1, A(3, 2) = discriminant(p);
    A(4, 4) = c - p;
    return A;
  }
  double discriminant(double p) const { return 4 * (p - merge) * (p - part); }
  Spectrum labels(double p) const {
    const double d = gap > 0 ? std::hypot(p - at, gap) : p - at;
    const Complex root = std::sqrt(Complex(discriminant(p)));
    return {a + d, a - d, b + root, b - root, c - p};
  }
};

Paths random_paths(Random& random) {
  Paths paths{};
  paths.a = uniform(random, -3, -2);
  paths.gap = random() % 3 == 0 ? 0.0 : std::pow(10.0, uniform(random, -2.5, -0.5));
  paths.at = uniform(random, 0.1, 0.9);
  paths.b = uniform(random, -7, -6);
  paths.merge = uniform(random, 0.1, 0.4), paths.part = uniform(random, 0.6, 0.9);
  paths.c = uniform(random, -2.8, -1.2);
  return paths;
}

// The label nearest to an eigenvalue; -1 if two are too close to distinguish.
int label_of(const Spectrum& labels, const Complex& z) {
  int nearest = 0, close = 0;
  for (int i = 0; i < std::ssize(labels); ++i) {
    if (std::abs(labels[std::size_t(i)] - z) < std::abs(labels[std::size_t(nearest)] - z))
      nearest = i;
    close += std::abs(labels[std::size_t(i)] - z) < 1e-6;
  }
  CHECK(close >= 1);
  return close == 1 ? nearest : -1;
}

}  // namespace

namespace {

// Links from a grid point to the next, and their outcome.
struct Links {
  int all = 0, trusted = 0, swapped = 0;
};

Links links_of(std::size_t first, std::size_t last, int points = 21, bool crossings = true) {
  Random random(6);
  const std::vector<double> values = spaced(0, 1, points);
  std::vector<SweepRequest> requests;
  std::vector<Paths> all;
  for (int i = 0; i < trials(points > 100 ? 60 : 300); ++i) {
    all.push_back(random_paths(random));
    if (!crossings) all.back().gap = std::max(all.back().gap, 1e-3), all.back().c -= 9;
    const auto A = [paths = all.back()](const VectorXd& p) { return paths.matrix(p[0]); };
    requests.push_back(request(planted({"p"}, in_other_coordinates(random, 5, A))));
  }
  SweepOptions options = newton_only();
  options.crossings = false;
  const SweepMap map = sweep(requests, {axis("p", values)}, options);
  Links links;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = first; k <= last; ++k)
      for (std::size_t mode = 0; mode < 5; ++mode) {
        const std::size_t here = i * values.size() + k;
        const int before = label_of(all[i].labels(values[k - 1]), spectrum_at(map, here - 1)[mode]);
        const int after = label_of(all[i].labels(values[k]), spectrum_at(map, here)[mode]);
        if (before < 0 || after < 0) continue;
        ++links.all;
        if (map.confidence[here * 5 + mode] < 128) continue;
        ++links.trusted;
        links.swapped += before != after;
      }
  return links;
}

}  // namespace

TEST_CASE("modes keep their places through veerings, crossings, merging pairs") {
  const Links links = links_of(2, 20);
  CHECK(links.swapped == 0);
  CHECK(double(links.trusted) / double(links.all) > 0.95);
}

TEST_CASE("modes that change places in the first step") { CHECK(links_of(1, 1).swapped == 0); }

// ---- 4. jumps ----

namespace {

constexpr double jump_at = 0.43219876543;

// One eigenvalue jumps from `before` to `after`; the equilibrium does if `moves`.
Model jumping(double before, double after, bool moves, bool declared) {
  const auto A = [=](const VectorXd& p) {
    return blocks({p[0] < jump_at ? before : after, Complex(-1, 2)});
  };
  Model m = planted({"p"}, A);
  if (moves)
    m.f = [A](const VectorXd& x, const VectorXd& u, const VectorXd& p) -> VectorXd {
      const VectorXd shift = VectorXd::Constant(3, p[0] < jump_at ? 0.0 : 0.2);
      return A(p) * x + u - trimmed_input(3, p) - shift;
    };
  if (declared)
    m.switches = {{"p = jump", [](const OperatingPoint& at) { return at.p[0] - jump_at; }}};
  return m;
}

}  // namespace

TEST_CASE("a jump across the axis is located, declared or not") {
  for (const bool declared : {true, false})
    for (const bool moves : {false, true}) {
      const SweepMap map =
          swept(request(jumping(-1, 0.5, moves, declared)), {axis("p", spaced(0, 1, 6))});
      int changes = 0;
      for (const AxisCrossing& c : map.crossings) {
        CHECK_NEAR(c.at[0], jump_at, located);
        if (c.unstable_before == c.unstable_after) continue;
        CHECK_NEAR(c.at[0], jump_at, c.error + rounded);
        CHECK((c.unstable_before == 0 && c.unstable_after == 1));
        if (declared || moves) CHECK(c.kind == CrossingKind::jump);
        ++changes;
      }
      CHECK(changes == 1);
      if (declared)
        check_intervals(map, {{0, jump_at, IntervalVerdict::stable},
                              {jump_at, 1, IntervalVerdict::unstable, 1}});
      for (const AxisInterval& i : map.intervals) CHECK(i.unstable == (i.to > jump_at + located));
    }
}

TEST_CASE("an undeclared jump is one jump") {
  for (const bool moves : {false, true}) {
    const SweepMap map =
        swept(request(jumping(-1, 0.5, moves, false)), {axis("p", spaced(0, 1, 6))});
    REQUIRE(map.crossings.size() == 1);
    CHECK(map.crossings[0].kind == CrossingKind::jump);
  }
}

TEST_CASE("a jump on one side of the axis changes no verdict") {
  for (const bool declared : {true, false}) {
    const SweepMap map =
        swept(request(jumping(-3, -0.5, true, declared)), {axis("p", spaced(0, 1, 6))});
    for (const AxisCrossing& c : map.crossings) {
      CHECK_NEAR(c.at[0], jump_at, located);
      CHECK(c.unstable_before == c.unstable_after);
    }
    CHECK(std::ranges::all_of(
        map.intervals, [](const AxisInterval& i) { return i.verdict == IntervalVerdict::stable; }));
  }
}

// ---- 5. existence ----

namespace {

double without_trim(const SweepMap& map) {
  double length = 0.0;
  for (const AxisInterval& i : map.intervals)
    if (i.verdict == IntervalVerdict::no_trim) length += std::abs(i.to - i.from);
  return length;
}

// x' = p - fold - x², the stable root from x = 1.
SweepRequest fold_request(double fold) {
  SweepRequest r = request(scalar([fold](double x, double p) { return p - fold - x * x; },
                                  [](double x, double) { return -2 * x; }));
  r.spec.bounds = {{"x", {-0.1, 5}}};
  r.guess.x[0] = 1.0;
  return r;
}

}  // namespace

TEST_CASE("a fold ends the interval with trims, and every point says so") {
  Random random(7);
  for (int i = 0; i < trials(20); ++i) {
    const double fold = uniform(random, 0.02, 0.98);
    const std::vector<double> values = spaced(0, 1, 11);
    const SweepMap map = swept(fold_request(fold), {axis("p", values)});
    check_intervals(map, {{0, fold, IntervalVerdict::no_trim}, {fold, 1, IntervalVerdict::stable}});
    REQUIRE(map.crossings.size() == 1);
    CHECK(map.crossings[0].kind == CrossingKind::end);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool there = values[k] > fold;
      CHECK((TrimStatus(map.status[k]) == TrimStatus::converged) == there);
      CHECK((map.verdict[k] == (there ? int(Verdict::stable) : -1)));
      CHECK(reason_at(map, k).empty() == there);
      if (there) CHECK_NEAR(map.state[k], std::sqrt(values[k] - fold), 1e-9);
      if (there) CHECK_NEAR(map.eigenvalue_re[k], -2 * std::sqrt(values[k] - fold), 2e-9);
      if (!there) CHECK((std::isnan(map.state[k]) && std::isnan(map.eigenvalue_re[k])));
    }
  }
}

TEST_CASE("modes have names where the first point has no trim") {
  CHECK(swept(fold_request(0.5), {axis("p", spaced(0, 1, 11))}).mode_names[0][0] == "x");
}

static SweepMap fold_beside(double by) {  // the middle of a step
  return swept(fold_request(0.55 + by), {axis("p", spaced(0, 1, 11))});
}

TEST_CASE("a fold just beside a place that halving visits") {
  for (const double by : {1e-3, 1e-5, 1e-7, 1e-9, 0.0, -1e-9, -1e-5})
    CHECK_NEAR(without_trim(fold_beside(by)), 0.55 + by, located);
}

TEST_CASE("a fold 1e-7 before a place that halving visits") {
  CHECK_NEAR(without_trim(fold_beside(-1e-7)), 0.55 - 1e-7, located);
}

namespace {

constexpr double limit = 0.7313;

// x' = p - x with a limit on the state or on twice the state.
SweepMap limited(bool output, const std::vector<double>& values) {
  Model m = scalar([](double x, double p) { return p - x; }, [](double, double) { return -1.0; });
  m.outputs = {{"y", "kg", 1.0}};
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) { return vec({2 * x[0]}); };
  m.derivatives = {};
  SweepRequest r = request(m);
  r.spec.bounds = {{output ? "y" : "x", {-10, (output ? 2 : 1) * limit}}};
  r.guess.x[0] = 0.5;
  return swept(r, {axis("p", values)});
}

}  // namespace

TEST_CASE("beyond a limit every point has its status and reason; it is located") {
  for (const bool output : {false, true})
    for (const std::vector<double>& values : {spaced(0, 1, 6), spaced(1, 0, 6)}) {
      const SweepMap map = limited(output, values);
      for (std::size_t k = 0; k < values.size(); ++k) {
        const bool there = values[k] < limit;
        CHECK((TrimStatus(map.status[k]) == TrimStatus::converged) == there);
        CHECK(reason_at(map, k).empty() == there);
      }
      CHECK_NEAR(without_trim(map), 1 - limit, located);
      CHECK(std::ranges::count(map.crossings, CrossingKind::end, &AxisCrossing::kind) == 1);
    }
}

static Model formulas(const std::vector<std::string>& states, const std::string& parameter,
                      const std::vector<std::string>& rates) {
  Signals x;
  for (const std::string& name : states) x.push_back({name, "", 1.0});
  return model_of({.name = "formulas",
                   .states = x,
                   .inputs = {},
                   .outputs = {},
                   .parameters = {{parameter, "", 1.0}},
                   .rates = rates});
}

// A missile whose fin f lags its saturated command: at f = -0.35 no incidence beyond r holds.
TEST_CASE("an end is where the trims end, not where Newton fails from the neighbor") {
  const Model missile =
      formulas({"a", "q", "f", "i"}, "r",
               {"q - a - 0.1*f", "-20 - 20*(a - 0.3) - 1.5*q - 60*f",
                "50*(max(-0.35, min(0.35, 0.5*(a - r) + 0.3*q - 3*i)) - f)", "r - a"});
  constexpr double end = 7.0525 / 21.5;  // -20 - 20 (r - 0.3) - 1.5 (r - 0.035) + 21 = 0
  for (const int count : {2, 3, 5, 6, 12}) {
    CAPTURE(count);
    check_intervals(swept(request(missile), {axis("r", spaced(0.3, 0.4, count))}),
                    {{0.3, end, IntervalVerdict::stable}, {end, 0.4, IntervalVerdict::no_trim}});
  }
}

// Where the second difference of a step vanishes, its curvature shows next to it.
TEST_CASE("windows about points of inflection are found, both ends") {
  Random random(23);
  int missed = 0, invented = 0;
  for (int trial = 0; trial < trials(300); ++trial) {
    const int count = std::array{2, 3, 4, 9}[std::size_t(trial % 4)];
    const double step = 0.5, last = 0.25 * (count - 1);
    const double speed = uniform(random, 2.0, 8.6), phase = uniform(random, 0.0, 2 * pi);
    const double height = uniform(random, 1.05, 2.0);
    const Model m =
        formulas({"x"}, "a",
                 {fmt::format("x*({:.17g}*sin({:.17g}*a + {:.17g}) - 1)", height, speed, phase)});
    std::vector<double> ends;  // of the windows
    const double half = std::acos(1 / height);
    for (int turn = -5; turn <= 5; ++turn)
      for (const double side : {-half, half}) {
        const double a = (pi / 2 + side + 2 * pi * turn - phase) / speed;
        if (std::abs(a) < last) ends.push_back(a);
      }
    std::ranges::sort(ends);
    const SweepMap map =
        swept(request(m), {axis("a", spaced(-last, -last + step * (count - 1), count))});
    missed += map.crossings.size() < ends.size();
    invented += map.crossings.size() > ends.size();
    if (map.crossings.size() != ends.size()) continue;
    for (std::size_t i = 0; i < ends.size(); ++i)
      CHECK_NEAR(map.crossings[i].at[0], ends[i], located);
  }
  CHECK(missed == 0);
  CHECK(invented == 0);
}

// All samples of the steps are alike; the search for the largest real part comes upon a crest.
TEST_CASE("an unstable point that no step showed leaves the interval undecided") {
  for (const int periods : {16, 64, 128}) {
    CAPTURE(periods);
    const Model m = formulas({"x"}, "a", {fmt::format("x*(1.1*sin({}*pi*a) - 1)", 2 * periods)});
    const SweepMap map = swept(request(m), {axis("a", spaced(0, 1, 3))});
    REQUIRE(map.intervals.size() == 1);
    CHECK(map.intervals[0].verdict == IntervalVerdict::undecided);
    CHECK_NEAR(map.intervals[0].abscissa, 0.1, located);
  }
}

TEST_CASE("trims that Newton reaches in small steps only are no hole between grid points") {
  // x = p³: from p Newton reaches 3/2 p and no farther; at p = 0 no slope exists.
  const Model m = formulas({"x"}, "p", {"p - cbrt(x)"});
  CHECK(without_trim(swept(request(m), {axis("p", spaced(-1, 3, 4))})) < located);
}

TEST_CASE("a limit, or a fold beside a grid point, ends one interval") {
  check_intervals(limited(false, spaced(0, 1, 6)),
                  {{0, limit, IntervalVerdict::stable}, {limit, 1, IntervalVerdict::no_trim}});
  const double fold = 0.55 - 1e-9;
  check_intervals(fold_beside(-1e-9),
                  {{0, fold, IntervalVerdict::no_trim}, {fold, 1, IntervalVerdict::stable}});
}

// ---- 6. second branch ----

namespace {

// x' = p + x - x³ in states of effort x²: between the folds the branch nearer to zero is the
// point's.
SweepRequest hysteresis() {
  SweepRequest r = request(scalar([](double x, double p) { return p + x - x * x * x; },
                                  [](double x, double) { return 1 - 3 * x * x; }));
  r.spec.effort = {{"x", 1.0, 0.0}};
  r.spec.bounds = {{"x", {-4, 4}}};
  r.guess.x[0] = -1;
  return r;
}

// Roots of x³ - x = p that are stable: rising.                                    [Vieta, by
// cosine]
std::vector<double> stable_roots(double p) {
  std::vector<double> roots;
  const double c = 1.5 * std::sqrt(3.0) * p;
  if (std::abs(c) > 1) {
    const double d = std::sqrt(p * p / 4 - 1.0 / 27);
    return {std::cbrt(p / 2 + d) + std::cbrt(p / 2 - d)};
  }
  for (const double turn : {2 * pi / 3, 0.0})
    roots.push_back(2 / std::sqrt(3.0) * std::cos(std::acos(c) / 3 + turn));
  return roots;
}

}  // namespace

TEST_CASE("two branches are flagged between the folds and nowhere else") {
  for (const bool falling : {false, true}) {
    std::vector<double> values = spaced(-1, 1, 60);
    if (falling) std::ranges::reverse(values);
    const SweepMap map = swept(hysteresis(), {axis("p", values)});
    const double fold = 2 / (3 * std::sqrt(3.0));
    std::size_t seconds = 0;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool two = std::abs(values[k]) < fold;
      CHECK(bool(map.second_branch[k]) == two);
      std::vector<double> roots = stable_roots(values[k]);
      REQUIRE(roots.size() == (two ? 2U : 1U));
      std::ranges::sort(roots, {}, [](double x) { return std::abs(x); });
      CHECK_NEAR(map.state[k], roots[0], 1e-9);
      CHECK_NEAR(map.eigenvalue_re[k], 1 - 3 * roots[0] * roots[0], 1e-8);
      if (!two || !map.second_branch[k]) continue;
      REQUIRE(seconds < map.second.points.size());
      CHECK(map.second.points[seconds] == k);
      CHECK_NEAR(map.second.state[seconds], roots[1], 1e-9);
      CHECK_NEAR(map.second.eigenvalue_re[seconds], 1 - 3 * roots[1] * roots[1], 1e-8);
      CHECK(map.second.verdict[seconds] == int(Verdict::stable));
      ++seconds;
    }
    CHECK(map.second.points.size() == seconds);
  }
}

// ---- 7. the tiltrotor ----

TEST_CASE("the corridor is unstable in two intervals of height, by two roads" *
          doctest::skip(sanitized)) {
  const Study s = study(R"([[condition]]
name = "corridor"
V = 2
gamma_deg = 90
eta_deg = 90
[[sweep.axis]]
key = "h"
from = 0
to = 120
count = 61)");
  const Vehicle vehicle = reference_vehicle();
  const auto count_at = [&](double h) { return unstable(spectrum_of(vehicle, corridor(h))); };
  const auto end = [&](double low, double high, int at_low) {
    return bisected(low, high, [&](double h) { return (count_at(h) > 0) == (at_low > 0); });
  };
  const double over = bisected(46, 47, [](double h) { return corridor(h).eta > pi / 3; });
  const double first = end(51, 51.2, 1), second = end(51.5, 51.7, 0), third = end(53.6, 53.8, 1);
  CHECK_NEAR(over, 46.4355771726, printed_to("46.4355771726"));
  CHECK_NEAR(first, 51.0964218661, 2 * located);
  const SweepMap map = swept(s);
  check_intervals(map, {{0, over, IntervalVerdict::stable},
                        {over, first, IntervalVerdict::unstable, count_at(over + 1)},
                        {first, second, IntervalVerdict::stable},
                        {second, third, IntervalVerdict::unstable, count_at(53)},
                        {third, 120, IntervalVerdict::stable}});
  REQUIRE(map.crossings.size() == 4);
  CHECK(map.crossings[0].kind == CrossingKind::jump);
  for (std::size_t k = 0; k < map.points(); ++k)
    CHECK(relative_distance(spectrum_at(map, k), spectrum_of(vehicle, corridor(2.0 * double(k)))) <=
          1e-9);
}

namespace {

struct FlownAt {
  std::string name;
  double V, gamma, eta, blend;
};
const FlownAt helicopter{"helicopter", 2, 90, 90, 0}, airplane{"airplane", 15, 0, 0, 0},
    hand_over{"hand-over", 12, 0, 60, 20};  // where cyclic and elevator are blended

std::string flight_text(const FlownAt& f) {
  return fmt::format(
      "[aircraft]\ncyclic_blend_deg = {}\n[[condition]]\nname = \"{}\"\nV = {}\ngamma_deg = "
      "{}\neta_deg = {}\n",
      f.blend, f.name, f.V, f.gamma, f.eta);
}

std::string axis_text(const std::string& gain, double from, double to, int count) {
  return fmt::format("[[sweep.axis]]\nkey = \"{}\"\nfrom = {}\nto = {}\ncount = {}\n", gain, from,
                     to, count);
}

// The vehicle of the study at a point of its map.
Vehicle vehicle_at(const Study& s, const SweepMap& map, std::size_t point) {
  Vehicle vehicle = s.vehicle;
  const std::vector<std::size_t> position = map.position(point);
  for (std::size_t a = 0; a < map.axes.size(); ++a)
    gain_value(vehicle.gains, std::size_t(find(gain_signals(), map.axes[a].columns[0].signal))) =
        map.axes[a].columns[0].si[position[a + 1]];
  return vehicle;
}

}  // namespace

TEST_CASE("along every gain each point is what trim, linearize and modes say" * thorough) {
  SweepOptions options;
  options.crossings = false;
  const Gains reference;
  for (const FlownAt& flight : {helicopter, airplane, hand_over})
    for (std::size_t g = 0; g < gain_signals().size(); ++g) {
      Gains gains = reference;
      const double middle = gain_value(gains, g);
      const std::string name = gain_signals()[g].name;
      INFO(flight.name << ", " << name);
      const Study s = study(flight_text(flight) + axis_text(name, 0.7 * middle, 1.4 * middle, 4));
      const SweepMap map = swept(s, options);
      for (std::size_t k = 0; k < map.points(); ++k) {
        REQUIRE(map.verdict[k] >= 0);
        const Eigen::VectorXcd expected =
            spectrum_of(vehicle_at(s, map, k), *s.conditions[0].command());
        CHECK(relative_distance(spectrum_at(map, k), expected) <= 1e-9);
      }
    }
}

TEST_CASE("one gain, its crossings, no other axis") {
  const SweepMap map = swept(study(flight_text(airplane) + axis_text("gains.K_Lp", 0.05, 8, 9)));
  for (const AxisInterval& i : map.intervals)
    CHECK((i.verdict == IntervalVerdict::stable ? i.abscissa <= located : i.abscissa > 0));
}

TEST_CASE("crossings along gains are those of bisection" * doctest::skip(sanitized)) {
  const std::vector<std::tuple<FlownAt, std::string, double, double>> lines{
      {airplane, "gains.k_pe", 0.01, 30},   {airplane, "gains.k_de", 0.01, 10},
      {airplane, "gains.K_Lp", 0.05, 30},   {airplane, "gains.K_Li", 0.01, 30},
      {helicopter, "gains.K_Ei", 0.1, 100}, {helicopter, "gains.K_Ep", 0.1, 20},
      {helicopter, "gains.k_pa", 0.1, 20},  {helicopter, "gains.K_Li", 0.01, 30},
      {helicopter, "gains.k_V", 0.5, 60},   {airplane, "gains.k_V", 0.1, 60},
      {hand_over, "gains.k_de", 0.05, 8},   {hand_over, "gains.k_pa", 4, 8}};
  const std::string point_axis = "[[sweep.axis]]\nkey = \"aircraft.mass\"\nvalues = [4.0]\n";
  int crossings = 0;
  for (const auto& [flight, gain, from, to] : lines) {
    const std::string where = std::string(flight.name) + ", " + gain;
    CAPTURE(where);
    const Study s = study(flight_text(flight) + point_axis + axis_text(gain, from, to, 9));
    const SweepMap map = swept(s);
    const auto count_at = [&, signal = gain](double value) {
      Vehicle vehicle = s.vehicle;
      gain_value(vehicle.gains, std::size_t(find(gain_signals(), signal))) = value;
      return unstable(spectrum_of(vehicle, *s.conditions[0].command()));
    };
    for (const AxisCrossing& c : map.crossings) {
      const double around = 1e-4 * (to - from), at = c.at[1];
      CHECK(count_at(at - around) == c.unstable_before);
      CHECK(count_at(at + around) == c.unstable_after);
      const double by_bisection = bisected(at - around, at + around, [&](double value) {
        return count_at(value) == c.unstable_before;
      });
      CHECK_NEAR(at, by_bisection, std::max(located, c.error));
      ++crossings;
    }
    for (const AxisInterval& i : map.intervals)
      for (const double share : {0.1, 0.5, 0.9})
        CHECK(count_at(i.from + share * (i.to - i.from)) == i.unstable);
  }
  CHECK(crossings >= 6);
}

// Between two points on both sides of K_Lp = -1, where 1/(1 + K_Lp) has a pole.
TEST_CASE("a gain beyond the pole of the law hides no crossing") {
  const Study s = study("[[condition]]\nname = \"hover\"\nV = 2\ngamma_deg = 90\neta_deg = 90\n" +
                        axis_text("gains.K_Lp", -40, 40, 2));
  const SweepMap map = swept(s);
  const auto unstable_at = [&](double value) {
    Vehicle vehicle = s.vehicle;
    gain_value(vehicle.gains, std::size_t(find(gain_signals(), "gains.K_Lp"))) = value;
    return unstable(spectrum_of(vehicle, *s.conditions[0].command()));
  };
  int within = 0;
  for (const AxisInterval& i : map.intervals) {
    if (i.verdict == IntervalVerdict::no_trim || i.to < -0.99) continue;
    for (const double share : {0.1, 0.5, 0.9})
      CHECK(unstable_at(i.from + share * (i.to - i.from)) == i.unstable);
    ++within;
  }
  CHECK(within == 4);
}

TEST_CASE("at the pole of the law the model has no value, however many points the line has") {
  const std::string level = "[[condition]]\nname = \"level\"\nV = 15\ngamma_deg = 0\neta_deg = 0\n";
  for (const int count : {3, 5, 9}) {
    CAPTURE(count);
    const SweepMap map = swept(study(level + axis_text("gains.K_Lp", -2, 0, count)));
    for (int k = 0; k < count; ++k)
      CHECK(map.status[std::size_t(k)] ==
            int(2 * k == count - 1 ? TrimStatus::not_finite : TrimStatus::converged));
  }
}

TEST_CASE("the handover at a grid point, stable on both sides, is no event") {
  const SweepMap map = swept(
      study("[gains]\nk_V = 3\nK_Li = 0.3\n[[condition]]\nname = \"climb\"\nV = 7\ngamma_deg = "
            "30\neta_deg = 70\n[[sweep.axis]]\nkey = \"eta_deg\"\nvalues = [70, 60, 50]\n"));
  CHECK(map.crossings.empty());
  REQUIRE(map.intervals.size() == 1);
  CHECK(map.intervals[0].verdict == IntervalVerdict::stable);
}

// Beyond the stall both passes would follow a branch of more effort than a trim's.
TEST_CASE("behind points without a trim a line begins with the trim of least effort") {
  const Study s = study(
      "[[condition]]\nname = \"descent\"\nV = 10\ngamma_deg = -3.7\neta_deg = 0\n[[sweep.axis]]\n"
      "key = \"V\"\nvalues = [9, 9.25, 9.5, 9.75, 10, 10.25, 10.5, 11]\n");
  const SweepMap map = swept(s);
  for (std::size_t k = 0; k < map.verdict.size(); ++k) {
    Command command = *s.conditions[0].command();
    command.V = map.axes[0].columns[0].si[k];
    const TrimResult own = trim_closed_loop(s.vehicle, command);
    CAPTURE(command.V);
    CHECK(is_equilibrium(own.status) == (map.verdict[k] >= 0));
    if (!own) continue;
    for (Index i = 0; i < own.point.x.size(); ++i)
      CHECK_NEAR(map.state[k * map.modes() + std::size_t(i)], own.point.x[i], 1e-9);
  }
}

// ---- 8. the same bits ----

namespace {

// x' = p + q x - x³ together with a pair and a real mode: second branches, folds, crossings.
SweepRequest cusp() {
  Model m;
  m.states = {{"x", "", 1.0}, {"y", "", 1.0}, {"z", "", 1.0}};
  m.parameters = {{"p", "", 1.0}, {"q", "", 1.0}};
  m.f = [](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    const double damped = p[0] - 0.3 * p[1];
    return vec({p[0] + p[1] * x[0] - std::pow(x[0], 3), damped * x[1] + x[2] - x[0],
                -x[1] + damped * x[2]});
  };
  SweepRequest r = request(m, "cusp");
  r.spec.effort = {{"x", 1.0, 0.0}};
  r.guess.x[0] = -1;
  return r;
}

std::vector<SweepAxis> cusp_axes() {
  return {axis("q", spaced(0.5, 1.5, 7)), axis("p", spaced(-1, 1, 19))};
}

// Swept with a log, interrupted at random moments until it is done.
SweepMap with_interruptions(Random& random, const std::vector<SweepRequest>& requests,
                            const std::vector<SweepAxis>& axes, SweepOptions options, int& times) {
  for (times = 0; times < 100; ++times) {
    std::stop_source stop;
    options.stop = stop.get_token();
    options.observe = [&](const SweepProgress&) {
      if (random() % 3 == 0) stop.request_stop();
    };
    try {
      return sweep(requests, axes, options);
    } catch (const SweepInterrupted&) {
    }
  }
  FAIL("no progress");
  return {};
}

}  // namespace

TEST_CASE("the same bits on 1, 2, 3 and 8 threads, and taken up again") {
  Random random(8);
  SweepOptions options = newton_only();
  options.threads = 1;
  const SweepMap alone = sweep({cusp()}, cusp_axes(), options);
  CHECK(!alone.second.points.empty());
  CHECK(alone.crossings.size() > 10);
  for (const int threads : {2, 3, 8}) {
    options.threads = threads;
    check_same(alone, sweep({cusp()}, cusp_axes(), options));
  }
  int interruptions = 0;
  for (int i = 0; i < trials(20); ++i) {
    const Folder folder;
    options.threads = 1 + i % 4;
    options.log = folder.path / "log";
    options.checkpoint = 0;
    options.identity = "cusp";
    int times = 0;
    check_same(alone, with_interruptions(random, {cusp()}, cusp_axes(), options, times));
    interruptions += times;
  }
  CHECK(interruptions > trials(20));
}

// Blocks of one line at a time would leave all threads but one without work.
TEST_CASE("lines that take long are shared by the threads") {
  std::set<std::thread::id> met;
  std::mutex meeting;
  std::condition_variable arrived;
  bool waits = true;  // for the other thread, once
  const auto meet = [&] {
    std::unique_lock<std::mutex> lock(meeting);
    met.insert(std::this_thread::get_id());
    arrived.notify_all();
    waits =
        waits && arrived.wait_for(lock, std::chrono::minutes(1), [&] { return met.size() > 1; });
  };
  Model m;
  m.states = numbered("x", 1);
  m.parameters = {{"line", "", 1.0}, {"point", "", 1.0}};
  m.f = [&](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    const bool between_ends = p[1] > 0 && p[1] < 1;  // the ends of lines are found one by one
    if (between_ends) meet();
    return VectorXd::Constant(1, p[0] + p[1] - x[0]);
  };
  SweepOptions options = newton_only();
  options.threads = 2;
  const SweepMap map =
      sweep({request(m)}, {axis("line", spaced(1, 2, 2)), axis("point", spaced(0, 1, 3))}, options);
  CHECK(met.size() == 2);
  CHECK(std::ranges::count(map.status, std::int8_t(TrimStatus::converged)) == 6);
}

TEST_CASE("a stopped sweep has its finished lines, the same as of the whole map") {
  SweepOptions options = newton_only();
  options.threads = 1;
  const SweepMap whole = sweep({cusp()}, cusp_axes(), options);
  std::stop_source stop;
  options.stop = stop.get_token();
  std::size_t done = 0;
  options.observe = [&](const SweepProgress& p) {
    done = p.done;
    stop.request_stop();
  };
  std::shared_ptr<const SweepMap> part;
  try {
    (void)sweep({cusp()}, cusp_axes(), options);
  } catch (const SweepInterrupted& e) {
    part = e.finished;
  }
  REQUIRE(part);
  REQUIRE(done > 0);
  REQUIRE(done < whole.points());
  CHECK(part->crossings.empty());
  for (std::size_t i = 0; i < whole.points(); ++i) {
    CAPTURE(i);
    CHECK(part->status[i] == (i < done ? whole.status[i] : -1));
    CHECK(part->verdict[i] == (i < done ? whole.verdict[i] : -1));
    const double expected = i < done ? whole.spectral_abscissa[i] : not_a_number;
    CHECK(same_bits(std::vector{part->spectral_abscissa[i]}, std::vector{expected}));
  }
  for (const std::uint64_t point : part->second.points) CHECK(point < done);
}

TEST_CASE("the same bits of the tiltrotor, two gains, two threads and one") {
  const Study s = study(flight_text(airplane) + axis_text("gains.K_Lp", 0.1, 4, 5) +
                        axis_text("gains.k_de", 0.1, 8, 5));
  SweepOptions options;
  options.threads = 1;
  const SweepMap alone = swept(s, options);
  options.threads = 2;
  check_same(alone, swept(s, options));
}

TEST_CASE("a log of other work, or of a processor that rounds otherwise, is refused") {
  const Folder folder;
  SweepOptions options = newton_only();
  options.log = folder.path / "log";
  options.identity = "this study";
  (void)sweep({cusp()}, cusp_axes(), options);
  options.identity = "another study";
  CHECK(contains(refusal<LogError>([&] { (void)sweep({cusp()}, cusp_axes(), options); }),
                 "another study"));
  options.log = folder.path / "other";
  { Log(options.log, options.identity + "\nof a machine to come"); }
  CHECK(contains(refusal<LogError>([&] { (void)sweep({cusp()}, cusp_axes(), options); }),
                 rounding()));
}

// ---- 9. mistakes and models that fail ----

TEST_CASE("the caller's mistakes are named") {
  const SweepRequest r = cusp();
  const auto said = [&](const std::vector<SweepRequest>& requests,
                        const std::vector<SweepAxis>& axes) {
    return refusal<std::invalid_argument>([&] { (void)sweep(requests, axes, newton_only()); });
  };
  const SweepAxis p = axis("p", spaced(0, 1, 3));
  CHECK(contains(said({}, {p}), "no condition"));
  CHECK(contains(said({r}, {}), "no axis"));
  CHECK(contains(said({r}, {axis("pp", {0, 1})}), "pp"));
  SweepAxis again = p;
  again.name = again.columns[0].name = "p_deg";
  CHECK(contains(said({r}, {p, again}), "p_deg is set twice"));
  CHECK(contains(said({r}, {axis("x", {0, 1})}), "x is a free variable of this trim;"));
  SweepRequest limited = r;
  limited.spec.bounds["p"] = {-1, 0.5};
  CHECK(contains(said({limited}, {axis("p", {0, 1})}),
                 "p is to be 1, outside its limits in the trim, [-1, 0.5]"));
  CHECK(contains(said({r, fold_request(0)}, {p}), "differ from those of 'cusp'"));
  SweepRequest unknown_input = r;
  unknown_input.inputs = {"rudder"};
  CHECK(contains(said({unknown_input}, {p}), "rudder"));
  const Study s = study(flight_text(airplane) + axis_text("gains.K_Lp", 1, 2, 2));
  Condition table = s.conditions[0];
  table.asked = TableCondition{};
  CHECK(contains(refusal<StudyError>([&] { (void)sweep_requests(s, {table}, s.sweep->axes); }),
                 ":3:1: condition 'airplane'"));
  CHECK(contains(refusal<StudyError>([&] {
                   (void)sweep_requests(s, s.conditions, {axis("theta0", {0, 1})});
                 }),
                 "theta0"));
}

TEST_CASE("points where the model throws or answers NaN have a status and a reason") {
  Model m = scalar([](double x, double p) { return p - x; }, [](double, double) { return -1.0; });
  m.derivatives = {};
  m.f = [](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    if (p[0] > 0.6) throw std::runtime_error("the table ends at 0.6");
    return vec({p[0] < 0.3 ? not_a_number : p[0] - x[0]});
  };
  SweepRequest r = request(m);
  r.guess.p[0] = 0.5;
  const std::vector<double> values = spaced(0, 1, 21);
  const SweepMap map = swept(r, {axis("p", values)});
  for (std::size_t k = 0; k < values.size(); ++k) {
    const TrimStatus status{map.status[k]};
    const bool there = values[k] >= 0.3 && values[k] <= 0.6;
    CHECK((map.verdict[k] >= 0) == there);
    CHECK(reason_at(map, k).empty() == there);
    if (there) CHECK_NEAR(map.state[k], values[k], 1e-10);
    if (values[k] < 0.3) CHECK(status == TrimStatus::not_finite);
    if (values[k] > 0.6) CHECK(status == TrimStatus::model_threw);
    if (values[k] > 0.6) CHECK(contains(reason_at(map, k), "the table ends at 0.6"));
  }
  check_intervals(map, {{0, 0.3, IntervalVerdict::no_trim},
                        {0.3, 0.6, IntervalVerdict::stable},
                        {0.6, 1, IntervalVerdict::no_trim}});
}

// (s + a)³, whose eigenvalues move by the cube root of the differences' error.
TEST_CASE("differences near a triple eigenvalue: the verdict is that of linearize and modes") {
  const Model m = flow({"x", "y", "z"}, {"a"}, [](const VectorXd& x, const VectorXd& p) {
    const double a = p[0];
    return vec({x[1], x[2], -a * a * a * std::sin(x[0]) - 3 * a * a * x[1] - 3 * a * x[2]});
  });
  SweepRequest r = request(m);
  r.guess.p[0] = 1e-3;
  const std::vector<double> values{1e-3, 1e-4, 3e-5, 1e-5, 1e-6};
  const SweepMap map = swept(r, {axis("a", values)});
  int undecided = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const OperatingPoint at{VectorXd::Zero(3), VectorXd(), vec({values[k]})};
    const Verdict verdict = modes(linearize(m, at)).verdict;
    CHECK(map.verdict[k] == int(verdict));
    undecided += verdict == Verdict::undecided;
  }
  CHECK(map.verdict[0] == int(Verdict::stable));
  CHECK(undecided >= 2);
}

// ---- 10. sizes ----

TEST_CASE("three axes: every point is its own, lines cross where planted") {
  const auto A = [](const VectorXd& p) {
    return blocks({p[0] + 2 * p[1] - 3 * p[2] - 0.55, Complex(-1 - p[0], 2 + p[1])});
  };
  const SweepMap map =
      swept(request(planted({"a", "b", "c"}, A)),
            {axis("a", spaced(0, 1, 3)), axis("b", spaced(0, 1, 4)), axis("c", spaced(0, 1, 5))});
  REQUIRE(map.points() == 60);
  for (std::size_t k = 0; k < map.points(); ++k) {
    const std::vector<std::size_t> at = map.position(k);
    const VectorXd p = vec({double(at[1]) / 2, double(at[2]) / 3, double(at[3]) / 4});
    CHECK(relative_distance(spectrum_at(map, k), eigenvalues(A(p))) <= 1e-12);
    CHECK_NEAR(map.eigenvalue_re[k * 3 + 2], A(p)(0, 0), 1e-12);  // the same mode everywhere
    for (Index i = 0; i < 3; ++i)
      CHECK_NEAR(map.input[k * 3 + std::size_t(i)], trimmed_input(3, p)[i], 1e-12);
  }
  std::size_t lines = 0;
  for (const AxisCrossing& c : map.crossings) {
    CHECK_NEAR(c.at[0] + 2 * c.at[1] - 3 * c.at[2], 0.55, 3 * located);
    lines += c.axis == 2;
  }
  CHECK(lines == 10);  // of 12 along c: where 0 < a + 2 b - 0.55 < 3
}

TEST_CASE("axes of one point, grids of one, one state") {
  const PlantedCrossing c{0.3, 0.6};
  const SweepMap point = swept(with_spectrum(c), {axis("p", {0.4})});
  CHECK(point.points() == 1);
  CHECK(relative_distance(spectrum_at(point, 0), eigenvalues(blocks(c(0.4)))) <= 1e-12);
  const auto A = [](const VectorXd& p) { return blocks({p[0] - 0.4 * p[1]}); };
  const SweepRequest one_state = request(planted({"p", "q"}, A));
  const SweepMap square = swept(one_state, {axis("p", {0.5}), axis("q", {1})});
  CHECK(square.points() == 1);
  CHECK_NEAR(square.eigenvalue_re[0], 0.1, 1e-15);
  CHECK(square.verdict[0] == int(Verdict::unstable));
  const SweepMap column = swept(one_state, {axis("p", spaced(0, 1, 3)), axis("q", {1})});
  check_crossings(column, {{0.4, CrossingKind::zero, 0, 1}});
  const SweepMap row = swept(one_state, {axis("p", {0.4}), axis("q", spaced(0.1, 2, 4))});
  check_crossings(row, {{1.0, CrossingKind::zero, 1, 0}}, 0, 1);
}

TEST_CASE("17 states are more than the batch takes: refused in words") {
  const auto A = [](const VectorXd& p) -> MatrixXd {
    return (VectorXd::LinSpaced(17, -17, -1) * (1 + p[0])).asDiagonal();
  };
  const SweepRequest r = request(planted({"p"}, A));
  const std::string words =
      refusal<std::invalid_argument>([&] { (void)swept(r, {axis("p", spaced(0, 1, 3))}); });
  CHECK(contains(words, "17"));
  CHECK(contains(words, "16"));
}

TEST_CASE("an axis without values, of unlike or unordered ones: refused in words") {
  const SweepRequest r =
      request(planted({"p"}, [](const VectorXd& p) { return MatrixXd::Constant(1, 1, -p[0]); }));
  const auto refused = [&](const SweepAxis& axis) {
    return refusal<std::invalid_argument>([&] { (void)swept(r, {axis}); });
  };
  CHECK(refused({"p", {}}) == "axis p: no values; expected at least one");
  CHECK(refused(axis("p", {})) == "axis p: no values; expected at least one");
  CHECK(refused({"p", {{"p", "", "p", {1, 2}, {1}}}}) ==
        "axis p: 2 values of p, 1 in SI; expected 2 of each");
  CHECK(contains(refused(axis("p", {1, std::nan("")})), "p = nan; expected finite values"));
  for (const std::vector<double>& values : {std::vector{1.0, 1.0}, {2.0, 1.0, 3.0}})
    CHECK(contains(refused(axis("p", values)), "expected ascending or descending values"));
}

// ---- 11. more unknowns than equations ----

namespace {

// x' = u1 + u2 + p + (p - 0.4) x at x = 0, least u1² + 2 u2²: u = -p (2/3, 1/3).
SweepRequest allocation() {
  Model m;
  m.states = {{"x", "", 1.0}};
  m.inputs = {{"u1", "", 1.0}, {"u2", "", 1.0}};
  m.parameters = {{"p", "", 1.0}};
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return vec({u[0] + u[1] + p[0] + (p[0] - 0.4) * x[0]});
  };
  SweepRequest r{"allocation", m, {.free = {"u1", "u2"}, .steady = {"x"}}, {}, {"u1", "u2"}};
  r.spec.effort = {{"u1", 1.0}, {"u2", std::sqrt(0.5)}};
  r.guess = {VectorXd::Zero(1), VectorXd::Zero(2), VectorXd::Zero(1)};
  return r;
}

}  // namespace

TEST_CASE("least effort: point by point") {
  const std::vector<double> values = spaced(0, 1, 6);
  const SweepMap map = sweep({allocation()}, {axis("p", values)});
  for (std::size_t k = 0; k < values.size(); ++k) {
    CHECK(map.verdict[k] >= 0);
    CHECK_NEAR(map.input[2 * k], -2 * values[k] / 3, 1e-7);
    CHECK_NEAR(map.input[2 * k + 1], -values[k] / 3, 1e-7);
    CHECK_NEAR(map.eigenvalue_re[k], values[k] - 0.4, 1e-9);
  }
}

TEST_CASE("least effort: nothing is invented between the points") {
  const SweepMap map = sweep({allocation()}, {axis("p", {0.5, 0.7, 1.0})});
  for (const AxisInterval& i : map.intervals) CHECK(i.verdict != IntervalVerdict::no_trim);
  CHECK(map.crossings.empty());
}

TEST_CASE("free variables that are not kept, between the points") {
  Model m;
  m.states = {{"x", "", 1.0}, {"y", "", 1.0}};
  m.inputs = {{"u", "", 1.0}};
  m.parameters = {{"p", "", 1.0}, {"c", "", 1.0}};
  // At rest u = p and c = u²; ∂y'/∂y = c - 0.3.
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return vec({u[0] - p[0] - x[0], p[1] - u[0] * u[0] + (p[1] - 0.3) * x[1]});
  };
  SweepRequest r{"free", m, {.free = {"u", "c"}, .steady = {"x", "y"}}, {}, {}};
  r.guess = {VectorXd::Zero(2), vec({0.4}), vec({0.4, 0.2})};
  check_crossings(swept(r, {axis("p", spaced(0.2, 1, 5))}),
                  {{std::sqrt(0.3), CrossingKind::zero, 0, 1}});
}

TEST_CASE("the airframe with more unknowns than equations, along V") {
  const Study s = study(R"([[condition]]
name = "free"
formulation = "airframe"
V = 15
eta_deg = 20
[[sweep.axis]]
key = "V"
from = 12
to = 16
count = 3)");
  const std::vector<SweepRequest> requests = sweep_requests(s, s.conditions, s.sweep->axes);
  const SweepMap map = sweep(requests, s.sweep->axes, {.crossings = false});
  for (std::size_t k = 0; k < map.points(); ++k) {
    AirframeCondition condition = *s.conditions[0].airframe();
    condition.values["V"] = {s.sweep->axes[0].columns[0].si[k], s.sweep->axes[0].columns[0].si[k]};
    const TrimProblem own = airframe_problem(s.vehicle, condition);
    const TrimResult level = trim(own.model, own.spec, own.guess);
    REQUIRE(level);
    CHECK(TrimStatus(map.status[k]) == level.status);
    for (std::size_t i = 0; i < map.inputs.size(); ++i)
      CHECK_NEAR(map.input[k * map.inputs.size() + i], level.point.u[Index(i)], 1e-6);
  }
}

// ---- 12. lines whose matrices are declared affine ----

namespace {

using Curve = std::function<double(double p)>;

// x' = A(p) (x - x0(p)) with an output y(p), the states free; the parameter declared affine.
struct Claimed {
  Matrices A;
  Curve place = [](double) { return 0.3; };
  Curve output = [](double) { return 1.0; };
  std::function<std::optional<double>(double p)> phi = [](double p) { return p; };

  SweepRequest request() const {
    const Index n = A(vec({0})).rows();
    Model m = planted({"p"}, A);
    m.inputs.clear();
    m.outputs = {{"y", "", 1.0}};
    m.f = [*this, n](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
      return A(p) * (x - VectorXd::Constant(n, place(p[0])));
    };
    m.h = [*this](const VectorXd&, const VectorXd&, const VectorXd& p) {
      return vec({output(p[0])});
    };
    m.derivatives = [*this, n](const OperatingPoint& at, const std::vector<Index>& along) {
      MatrixXd all = MatrixXd::Zero(n + 1, n);
      all.topRows(n) = A(at.p);
      return MatrixXd(all(Eigen::all, along));
    };
    m.affine = {{"p", [*this](const VectorXd& p) { return phi(p[0]); }}};
    SweepRequest r = sweep_test::request(m, "claimed");
    r.inputs = {"y"};
    return r;
  }
};

// A pair that crosses where g is 0.4, another and a real mode: never singular.
Matrices bent_by(Random& random, const Curve& g) {
  return in_other_coordinates(random, 5, [g](const VectorXd& p) {
    const double x = g(p[0]);
    return blocks({Complex(x - 0.4, 3), Complex(-1, 1 + 0.2 * x), -2 + 0.3 * x});
  });
}

SweepRequest unclaimed(SweepRequest r) {
  r.model.affine.clear();
  return r;
}

// How often a sweep asks the model for derivatives.
int derivatives_of(SweepRequest r, const std::vector<SweepAxis>& axes, SweepOptions options) {
  int count = 0;
  r.model.derivatives = [&count, own = r.model.derivatives](const OperatingPoint& at,
                                                            const std::vector<Index>& along) {
    ++count;
    return own(at, along);
  };
  options.threads = 1;
  options.crossings = false;
  (void)sweep({r}, axes, options);
  return count;
}

OperatingPoint point_of(const SweepMap& map, std::size_t k, const SweepRequest& r) {
  OperatingPoint at = r.guess;
  const std::vector<std::size_t> position = map.position(k);
  for (std::size_t a = 0; a < map.axes.size(); ++a) {
    const SweepAxis::Column& column = map.axes[a].columns[0];
    at.p[find(r.model.parameters, column.signal)] = column.si[position[a + 1]];
  }
  const std::size_t n = map.modes();
  at.x = Eigen::Map<const VectorXd>(&map.state[k * n], Index(n));
  return at;
}

MatrixXd matrix_at(const Model& m, const OperatingPoint& at) {
  std::vector<Index> states;
  for (Index i = 0; i < std::ssize(m.states); ++i) states.push_back(i);
  return jacobian(m, at, states).topRows(std::ssize(m.states));
}

// The map of a request with the declaration equals the map without it, and the model's values.
void check_claim(const SweepRequest& r, const std::vector<SweepAxis>& axes,
                 const SweepOptions& options) {
  const SweepMap map = sweep({r}, axes, options), plain = sweep({unclaimed(r)}, axes, options);
  const double moved = 2 * options.trimming.step_tolerance;
  const std::size_t n = map.modes(), m = map.inputs.size();
  CHECK(same_bits(map.status, plain.status));
  CHECK(same_bits(map.verdict, plain.verdict));
  CHECK(same_bits(map.second_branch, plain.second_branch));
  for (std::size_t k = 0; k < map.points(); ++k) {
    REQUIRE(TrimStatus(map.status[k]) == TrimStatus::converged);
    const OperatingPoint at = point_of(map, k, r);
    const VectorXd rates = r.model.f(at.x, at.u, at.p).cwiseQuotient(nominals(r.model.states));
    CHECK(rates.lpNorm<Eigen::Infinity>() <= options.trimming.tolerance);
    CHECK(map.residual[k] <= options.trimming.tolerance);
    const double size = matrix_at(r.model, at).norm();
    for (std::size_t i = k * n; i < (k + 1) * n; ++i) {
      CHECK_NEAR(map.state[i], plain.state[i], moved * map.states[i % n].nominal);
      CHECK_NEAR(map.eigenvalue_re[i], plain.eigenvalue_re[i], 1e-9 * size);
      CHECK_NEAR(map.eigenvalue_im[i], plain.eigenvalue_im[i], 1e-9 * size);
    }
    for (std::size_t i = k * m; i < (k + 1) * m; ++i)
      CHECK_NEAR(map.input[i], plain.input[i], moved * map.inputs[i % m].nominal);
  }
  REQUIRE(map.crossings.size() == plain.crossings.size());
  for (std::size_t i = 0; i < map.crossings.size(); ++i) {
    const AxisCrossing &with = map.crossings[i], &without = plain.crossings[i];
    CHECK(to_string(with.kind) == to_string(without.kind));
    CHECK(with.unstable_after == without.unstable_after);
    const std::size_t a = std::size_t(with.axis);
    CHECK_NEAR(with.at[a], without.at[a], with.error + without.error + located);
  }
}

std::vector<SweepAxis> along_p(double from, double to, int count) {
  return {axis("p", spaced(from, to, count))};
}

}  // namespace

TEST_CASE("a claim that is false in the middle of a line spoils nothing" * thorough) {
  Random random(9);
  for (const auto& [from, to] : {std::pair(-1.0, 1.0), std::pair(0.0, 1.0), std::pair(1.2, -0.5)}) {
    const double middle = 0.5 * (from + to);
    const auto bump = [=](double height, double width) {
      return [=](double p) { return p + height * std::exp(-std::pow((p - middle) / width, 2)); };
    };
    for (const Curve& g :
         {Curve([](double p) { return p * p; }), Curve([](double p) { return std::abs(p - 0.1); }),
          Curve([](double p) { return p < 0.1 ? p : p + 0.2; }), Curve(bump(1, 0.1)),
          Curve(bump(1e-6, 0.3))})
      for (const int count : {2, 3, 13}) {
        const auto& captured = from;  // clang 14 captures no structured binding
        CAPTURE(captured);
        CAPTURE(count);
        const Claimed false_claim{bent_by(random, g)};
        check_claim(false_claim.request(), along_p(from, to, count), newton_only());
        const SweepMap map = swept(false_claim.request(), along_p(from, to, count));
        for (std::size_t k = 0; k < map.points(); ++k) {
          const VectorXd p = vec({map.axes[0].columns[0].values[k]});
          CHECK(relative_distance(spectrum_at(map, k), eigenvalues(false_claim.A(p))) <= 1e-9);
        }
      }
  }
}

TEST_CASE("a claim of which only the matrices keep to it spoils nothing") {
  Random random(10);
  const auto straight = [](double p) { return p; };
  const auto bent = [](double p) { return p * p; };  // from -1 to 1 equal at both ends
  Claimed place{bent_by(random, straight)}, output = place, no_phi = place;
  place.place = bent;
  output.output = bent;
  no_phi.phi = [](double p) { return p == 0 ? std::nullopt : std::optional(p); };
  for (const Claimed& claim : {place, output, no_phi})
    for (const int count : {3, 8, 33})
      check_claim(claim.request(), along_p(-1, 1, count), newton_only());
}

TEST_CASE("where a parameter is said not to be affine, between the points of a line") {
  Random random(11);
  const auto outside = [](double p) { return p < 0.2 || p > 0.4; };
  Claimed claim{bent_by(random, [=](double p) { return outside(p) ? p : p + 0.5; })};
  claim.phi = [=](double p) { return outside(p) ? std::optional(p) : std::nullopt; };
  const SweepMap map = swept(claim.request(), along_p(0, 1, 21));
  for (std::size_t k = 0; k < map.points(); ++k)
    CHECK(relative_distance(spectrum_at(map, k), eigenvalues(claim.A(vec({double(k) / 20})))) <=
          1e-9);
}

TEST_CASE("a true claim: three points of a line are differentiated, the map is the same") {
  Random random(12);
  const Curve square = [](double p) { return p * p; };
  Claimed steady{bent_by(random, square)};
  steady.phi = square;
  Claimed moving = steady;
  moving.place = [](double p) { return 1 + 3 * p; };
  for (const Claimed& claim : {steady, moving})
    for (const auto& [from, to] : {std::pair(0.0, 1.0), std::pair(1.2, 0.3)}) {
      for (const int count : {2, 3, 8, 300})
        check_claim(claim.request(), along_p(from, to, count), newton_only());
      const int calls = derivatives_of(claim.request(), along_p(from, to, 300), newton_only());
      CHECK(calls < 100);  // the lines' ends, names, what lies between two points
      CHECK(derivatives_of(unclaimed(claim.request()), along_p(from, to, 300), newton_only()) >=
            300);
    }
}

TEST_CASE("a true claim whose φ turns on the line: its crossings") {
  Random random(13);
  const Curve square = [](double p) { return p * p; };
  Claimed claim{bent_by(random, square)};
  claim.phi = square;
  const double r = std::sqrt(0.4);
  const std::vector<Event> both{{-r, CrossingKind::hopf, 2, 0, 3},
                                {r, CrossingKind::hopf, 0, 2, 3}};
  check_crossings(swept(unclaimed(claim.request()), along_p(-1, 1.1, 22)), both);
  check_crossings(swept(claim.request(), along_p(-1, 1.1, 22)), both);
}

TEST_CASE("the tiltrotor's gains: the map with the claim is the map without" * thorough) {
  int steady = 0, moving = 0, saved = 0;  // derivatives: most lines need a dozen less
  for (const FlownAt& flight : {helicopter, airplane})
    for (std::size_t g = 0; g < gain_signals().size(); ++g) {
      const std::string name = gain_signals()[g].name;
      INFO(flight.name << ", " << name);
      Gains gains;
      const double middle = gain_value(gains, g);
      for (const auto& [low, high] : {std::pair(0.3, 3.0), std::pair(1.5, 0.6)}) {
        const Study s =
            study(flight_text(flight) + axis_text(name, low * middle, high * middle, 13));
        const std::vector<SweepAxis>& axes = s.sweep->axes;
        SweepRequest r = sweep_requests(s, s.conditions, axes).at(0);
        check_claim(r, axes, {});
        r.model.lanes = nullptr;  // which differentiate uncounted
        saved += derivatives_of(unclaimed(r), axes, {}) - derivatives_of(r, axes, {});
        const SweepMap map = sweep({r}, axes, {.crossings = false});
        double change = 0.0;
        for (std::size_t i = map.modes(); i < map.state.size(); ++i)
          change = std::max(change, std::abs(map.state[i] - map.state[i % map.modes()]));
        (change > 0 ? moving : steady) += 1;
      }
    }
  CHECK(steady >= 4);
  CHECK(moving >= 4);
  CHECK(saved > 4 * (steady + moving));
}

// ---- 13. many points at a time, and real modes near a pair ----

TEST_CASE("modes that do not cross keep their places, many points at a time" * thorough) {
  for (const int count : {200, 1000}) {
    const Links links = links_of(2, std::size_t(count - 1), count, false);
    CHECK(links.swapped == 0);
    CHECK(double(links.trusted) / double(links.all) > 0.99);
  }
}

namespace {

// For two decoupled real modes that cross, and a pair far from them: places where a mode is trusted
// although it is on the other's branch.
int swapped_beside(double pair, double crossing) {
  const auto spectrum = [=](double p) {
    return Spectrum{-1 - 0.1 * (p - crossing), -1 + 0.1 * (p - crossing), Complex(pair, 5)};
  };
  const SweepMap map = swept(with_spectrum(spectrum), along_p(0, 1, 18));
  int swapped = 0;
  for (std::size_t mode = 0; mode < map.modes(); ++mode) {
    const Complex first = spectrum_at(map, 0)[mode];
    if (first.imag() != 0) continue;
    const double slope = first.real() < -1 ? 0.1 : -0.1;
    for (std::size_t k = 0; k < map.points(); ++k) {
      const double branch = first.real() + slope * map.axes[0].columns[0].values[k];
      const bool trusted = map.confidence[k * map.modes() + mode] >= 128;
      swapped += trusted && std::abs(spectrum_at(map, k)[mode] - branch) > 1e-9;
    }
  }
  return swapped;
}

}  // namespace

TEST_CASE("two real modes cross, a pair aside") {
  for (const double crossing : {0.49, 0.52, 0.55}) CHECK(swapped_beside(-9, crossing) == 0);
}

TEST_CASE("two real modes cross, a pair above and below them") {
  for (const double pair : {-1.0, -0.2, -4.0})
    for (const double crossing : {0.49, 0.52, 0.55}) CHECK(swapped_beside(pair, crossing) == 0);
}

TEST_CASE("two real modes cross half way between two points") {
  CHECK(swapped_beside(-9, 0.5) == 0);
}

}  // namespace sweep_test
