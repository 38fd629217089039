// Sweeps that walk lines side by side in SIMD lanes, against the same sweeps by the scalar path;
// the kernel of the closed loop against f, h and the derivatives.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <optional>

// The scalars of the kernels, here one lane at a time.
#define TILTRIM_LANES lanes_in_test
#define TILTRIM_LANES_SCALAR
#include "linearize/batch.hpp"
#include "model/lane_scalars.hpp"
#include "model/lookup.hpp"
#include "study/reference_vehicle.hpp"
#include "sweep/sweep.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "tests/toy_models.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace lanes_test {

namespace {

constexpr std::size_t L = Model::model_lanes;

// The instruction set of the kernels, during its lifetime.
class InSet {
 public:
  explicit InSet(const char* set) {
    if (const char* before = std::getenv("TILTRIM_SIMD")) before_ = before;
    setenv("TILTRIM_SIMD", set, 1);
  }
  ~InSet() { before_ ? setenv("TILTRIM_SIMD", before_->c_str(), 1) : unsetenv("TILTRIM_SIMD"); }
  InSet(const InSet&) = delete;
  InSet& operator=(const InSet&) = delete;

 private:
  std::optional<std::string> before_;
};

std::vector<const char*> sets_present() {
  std::vector<const char*> sets;
  for (const char* set : {"scalar", "baseline", "avx2", "avx512"}) {
    const InSet asked(set);
    try {
      (void)instruction_set();
      sets.push_back(set);
    } catch (const std::invalid_argument&) {
    }
  }
  return sets;
}

// ---- the kernel of the closed loop ----

Vehicle reference_vehicle() {
  Vehicle v;
  v.polar = std::make_shared<Polar>(
      load_polar(std::string(TILTRIM_SOURCE_DIR) + "/data/naca8h12_re150k.csv"));
  return v;
}

// Every other knot of the left half left out.
Vehicle with_uneven_polar() {
  Vehicle v = reference_vehicle();
  std::vector<double> alpha;
  std::vector<Coefficients> rows;
  const std::vector<double>& knots = v.polar->knots();
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (knots[i] < 0 && i % 2 == 1) continue;
    alpha.push_back(knots[i]);
    rows.push_back(v.polar->rows()[i]);
  }
  v.polar = std::make_shared<Polar>(alpha, rows);
  return v;
}

using Points = std::array<OperatingPoint, L>;

Points random_points(Random& random, const Vehicle& v) {
  Points points;
  for (OperatingPoint& at : points) {
    const auto in = [&](double half) { return uniform(random, -half, half); };
    at.x = vec({in(2), in(0.3), in(4), in(1), in(3), in(3)});
    at.u.resize(0);
    at.p = closed_loop_parameters(v, {uniform(random, 3, 20), in(1.5), uniform(random, 0, 1.6)});
  }
  return points;
}

struct LaneAnswer {
  std::vector<double> values, with_slopes, slopes;
};

const std::vector<Index> all_states{0, 1, 2, 3, 4, 5};

LaneAnswer in_lanes(const Model& m, const Points& points) {
  const std::size_t rows = m.states.size() + m.outputs.size();
  std::vector<double> z;
  for (Index j = 0; j < points[0].x.size() + points[0].p.size(); ++j)
    for (const OperatingPoint& at : points) z.push_back(value_of(at, j));
  LaneAnswer answer{std::vector<double>(rows * L), std::vector<double>(rows * L),
                    std::vector<double>(rows * L * all_states.size())};
  m.lanes(z.data(), {}, answer.values.data(), nullptr);
  m.lanes(z.data(), all_states, answer.with_slopes.data(), answer.slopes.data());
  return answer;
}

// Largest difference of values and derivatives, each over the largest of its kind at the point.
double miss_of(const Model& m, const Points& points) {
  const LaneAnswer answer = in_lanes(m, points);
  double worst = 0.0;
  for (std::size_t l = 0; l < L; ++l) {
    VectorXd y(12);
    y << m.f(points[l].x, points[l].u, points[l].p), m.h(points[l].x, points[l].u, points[l].p);
    const MatrixXd J = m.derivatives(points[l], all_states);
    const double size = std::max(1.0, y.lpNorm<Eigen::Infinity>());
    const double steep = std::max(1.0, J.lpNorm<Eigen::Infinity>());
    for (std::size_t i = 0; i < 12; ++i) {
      worst = std::max(worst, std::abs(answer.values[i * L + l] - y[Index(i)]) / size);
      for (std::size_t c = 0; c < 6; ++c)
        worst = std::max(
            worst, std::abs(answer.slopes[(c * 12 + i) * L + l] - J(Index(i), Index(c))) / steep);
    }
  }
  return worst;
}

bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace

TEST_CASE(
    "sine and cosine in lanes: within a unit in the last place of the C library's in long double") {
  Random random(23);
  double worst = 0.0;
  const auto compare = [&](double x) {
    const auto [sin, cos] = lanes_in_test::sine_cosine(x);
    const auto miss = [](double value, long double exact) {
      const double here = std::abs(double(exact));
      const double unit = std::nextafter(here, std::numeric_limits<double>::infinity()) - here;
      return double(std::abs((long double)(value)-exact)) / unit;
    };
    worst = std::max({worst, miss(sin.of[0][0], std::sin((long double)(x))),
                      miss(cos.of[0][0], std::cos((long double)(x)))});
  };
  for (const double reach : {1e-3, 1.0, 10.0, 1e5})
    for (int i = 0; i < trials(20000); ++i) compare(uniform(random, -reach, reach));
  for (int i = -1000; i <= 1000; ++i) compare(i * (std::numbers::pi / 4));
  CHECK(worst <= 1.0);
}

TEST_CASE("the closed loop in lanes is f, h and the derivatives, the same bits by every set") {
  constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();  // of long sums
  Vehicle blended = with_uneven_polar(), printed = reference_vehicle();
  blended.aircraft.cyclic_blend = 0.4;
  printed.equations = Equations::printed;
  Random random(24);
  for (const Vehicle& v : {reference_vehicle(), blended, printed})
    for (int i = 0; i < trials(50); ++i) {
      Points points = random_points(random, v);
      points[0].x[2] = 40.0;  // several turns beyond the polar
      std::optional<LaneAnswer> first;
      for (const char* set : sets_present()) {
        const InSet asked(set);
        const Model m = closed_loop(v);
        CHECK(miss_of(m, points) <= rounding);
        const LaneAnswer answer = in_lanes(m, points);
        CHECK(same(answer.values, answer.with_slopes));
        if (!first) first = answer;
        CHECK(same(answer.values, first->values));
        CHECK(same(answer.slopes, first->slopes));
      }
    }
}

TEST_CASE(
    "angles beyond what the lanes reduce, and NaN: not a number, and no other lane's concern") {
  Random random(25);
  const Model m = closed_loop(reference_vehicle());
  Points points = random_points(random, reference_vehicle());
  const LaneAnswer before = in_lanes(m, points);
  points[2].x[1] = 1e6;
  points[5].x[2] = std::numeric_limits<double>::quiet_NaN();
  const LaneAnswer after = in_lanes(m, points);
  CHECK(std::isnan(after.values[0 * L + 2]));
  CHECK(std::isnan(after.values[0 * L + 5]));
  for (std::size_t i = 0; i < 12; ++i)
    for (const std::size_t l : {0, 1, 3, 4, 6, 7})
      CHECK(after.values[i * L + l] == before.values[i * L + l]);
}

// ---- sweeps ----

namespace {

std::vector<double> steps(double from, double to, int count) {
  std::vector<double> v;
  for (int i = 0; i < count; ++i) v.push_back(from + (to - from) * i / std::max(1, count - 1));
  return v;
}

SweepAxis axis_of(const std::string& signal, const std::vector<double>& v) {
  return {signal, {{signal, "", signal, v, v}}};
}

// The corridor from 20 to 120 m as the fastest axis, a gain as the other.
SweepMap corridor_map(const std::vector<double>& gains, int threads, bool lanes, int points = 97) {
  const Vehicle v = reference_vehicle();
  TrimProblem problem = without_integral_bounds(closed_loop_problem(v, corridor(120.0)));
  if (!lanes) problem.model.lanes = nullptr;
  SweepAxis height{"h", {}};
  for (const char* signal : {"", "V", "gamma", "eta"})
    height.columns.push_back({"h", "", signal, {}, {}});
  height.between = [](std::vector<double>& columns) {
    const Command d = corridor(columns[0]);
    columns = {columns[0], d.V, d.gamma, d.eta};
  };
  for (const double h : steps(20, 120, points)) {
    std::vector<double> values{h, 0, 0, 0};
    height.between(values);
    for (std::size_t c = 0; c < values.size(); ++c) {
      height.columns[c].values.push_back(values[c]);
      height.columns[c].si.push_back(values[c]);
    }
  }
  SweepOptions options;
  options.threads = threads;
  return sweep(
      {{"corridor", problem.model, problem.spec, problem.guess, {"theta0", "a1s", "delta_e"}}},
      {axis_of("gains.K_Lp", gains), height}, options);
}

bool same_map(const SweepMap& a, const SweepMap& b) {
  return a.status == b.status && a.verdict == b.verdict && a.confidence == b.confidence &&
         same(a.state, b.state) && same(a.input, b.input) && same(a.residual, b.residual) &&
         same(a.eigenvalue_re, b.eigenvalue_re) && same(a.eigenvalue_im, b.eigenvalue_im) &&
         same(a.damping, b.damping) && a.reasons == b.reasons && a.reason == b.reason;
}

template <class Found>
std::vector<Found> along(int axis, std::vector<Found> found) {
  std::erase_if(found, [&](const Found& f) { return f.axis != axis; });
  return found;
}

// What lies between the points along an axis: the same crossings and intervals, within their
// errors.
void check_between(int axis, const SweepMap& a, const SweepMap& b) {
  const auto crossings = along(axis, a.crossings), others = along(axis, b.crossings);
  REQUIRE(crossings.size() == others.size());
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const AxisCrossing &one = crossings[i], &other = others[i];
    CAPTURE(i);
    CHECK(one.kind == other.kind);
    CHECK(one.unstable_before == other.unstable_before);
    CHECK(one.unstable_after == other.unstable_after);
    CHECK(one.mode == other.mode);
    CHECK_NEAR(one.at[std::size_t(axis)], other.at[std::size_t(axis)], one.error + other.error);
  }
  const auto intervals = along(axis, a.intervals), others_between = along(axis, b.intervals);
  REQUIRE(intervals.size() == others_between.size());
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    CHECK(intervals[i].verdict == others_between[i].verdict);
    CHECK(intervals[i].unstable == others_between[i].unstable);
  }
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::isnan(a[i]) != std::isnan(b[i]))
      return std::numeric_limits<double>::infinity();
    else if (!std::isnan(a[i]))
      worst = std::max(worst, std::abs(a[i] - b[i]) / std::max(1.0, std::abs(a[i])));
  return worst;
}

}  // namespace

TEST_CASE("the corridor in lanes is the corridor by the scalar path") {
  const SweepMap alone = corridor_map(steps(0.05, 5, 11), 1, false);
  const SweepMap together = corridor_map(steps(0.05, 5, 11), 1, true);
  CHECK(together.status == alone.status);
  CHECK(together.verdict == alone.verdict);
  CHECK(together.second_branch == alone.second_branch);
  CHECK(largest_difference(together.state, alone.state) <= 1e-12);
  CHECK(largest_difference(together.input, alone.input) <= 1e-12);
  // Trims that differ by round-off, times the condition of the eigenvalues.
  CHECK(largest_difference(together.eigenvalue_re, alone.eigenvalue_re) <= 1e-11);
  CHECK(largest_difference(together.eigenvalue_im, alone.eigenvalue_im) <= 1e-11);
  CHECK(!same(together.residual, alone.residual));  // it was another path
  CHECK(together.crossings.size() > 30);
  for (const int axis : {0, 1}) check_between(axis, together, alone);
}

// Other middles, other pieces, other trims: the errors cover what that changes.
TEST_CASE("crossings on two grids of heights agree within their errors") {
  const auto coarse = along(1, corridor_map(steps(0.05, 5, 11), 1, true, 97).crossings),
             fine = along(1, corridor_map(steps(0.05, 5, 11), 1, true, 200).crossings);
  REQUIRE(coarse.size() == fine.size());
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    CHECK(coarse[i].kind == fine[i].kind);
    CHECK_NEAR(coarse[i].at[1], fine[i].at[1], coarse[i].error + fine[i].error);
  }
}

TEST_CASE("the same bits by every instruction set, on any number of threads, in any company") {
  const std::vector<double> gains = steps(0.05, 5, 11);
  const SweepMap first = corridor_map(gains, 1, true);
  for (const char* set : sets_present()) {
    const InSet asked(set);
    CAPTURE(set);
    CHECK(same_map(corridor_map(gains, 3, true), first));
  }
  // The first line's start, hence its bits, is that of the gain alone.
  const SweepMap few = corridor_map({gains.begin(), gains.begin() + 3}, 1, true);
  const std::size_t numbers = few.state.size();
  CHECK(same(few.state, {first.state.begin(), first.state.begin() + std::ptrdiff_t(numbers)}));
}

// ---- where lanes fail ----

namespace {

// The model with lanes made of its own functions; `spoil` changes what they give.
using Spoil = std::function<void(std::vector<double>& values, MatrixXd& slopes, double p)>;

Model with_lanes(Model m, const Spoil& spoil = {}) {
  const Model plain = m;
  m.lanes = [plain, spoil](const double* z, const std::vector<Index>& variables, double* values,
                           double* slopes) {
    const Index nx = std::ssize(plain.states), ny = std::ssize(plain.outputs);
    for (std::size_t l = 0; l < L; ++l) {
      OperatingPoint at{VectorXd(nx), VectorXd(std::ssize(plain.inputs)),
                        VectorXd(std::ssize(plain.parameters))};
      for (Index j = 0; j < nx + at.u.size() + at.p.size(); ++j)
        set_value(at, j, z[std::size_t(j) * L + l]);
      std::vector<double> y;
      for (const double rate : plain.f(at.x, at.u, at.p)) y.push_back(rate);
      if (plain.h)
        for (const double output : plain.h(at.x, at.u, at.p)) y.push_back(output);
      MatrixXd J = plain.derivatives(at, variables);
      if (spoil) spoil(y, J, at.p[0]);
      for (Index i = 0; i < nx + ny; ++i) {
        values[std::size_t(i) * L + l] = y[std::size_t(i)];
        for (Index c = 0; slopes && c < J.cols(); ++c)
          slopes[std::size_t(c * (nx + ny) + i) * L + l] = J(i, c);
      }
    }
  };
  return m;
}

using Rate = std::function<double(double x, double p)>;

// x' = rate(x, p), y = 2 x; a second state w' = drift(p) - w.
Model two_states(const Rate& rate, const Rate& slope) {
  Model m;
  m.name = "toy";
  m.states = {{"x", "", 1.0}, {"w", "", 1.0}};
  m.outputs = {{"y", "", 1.0}};
  m.parameters = {{"p", "", 1.0}, {"a", "", 1.0}};
  m.f = [rate](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    return vec({rate(x[0], p[0]), std::max(0.0, p[0] - 0.5) * p[1] - x[1]});
  };
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) { return vec({2 * x[0]}); };
  m.derivatives = [slope](const OperatingPoint& at,
                          const std::vector<Index>& variables) -> MatrixXd {
    MatrixXd J(3, 2);
    J << slope(at.x[0], at.p[0]), 0, 0, -1, 2, 0;
    return J(Eigen::all, variables);
  };
  return m;
}

Model curved() {
  return two_states([](double x, double p) { return std::sin(p) - x - 0.1 * x * x * x; },
                    [](double x, double) { return -1 - 0.3 * x * x; });
}

TrimSpec x_and_w() {
  TrimSpec spec;
  spec.free = {"x", "w"};
  spec.steady = {"x", "w"};
  return spec;
}

SweepMap toy_map(const Model& m, const TrimSpec& spec) {
  SweepOptions options;
  options.threads = 1;
  options.trimming.method = TrimMethod::newton;
  const OperatingPoint guess{vec({0, 0}), VectorXd(0), vec({0, 1})};
  return sweep({{"toy", m, spec, guess, {"y"}}},
               {axis_of("a", {1.0, 1.5, 2.0}), axis_of("p", steps(0, 1, 41))}, options);
}

// With lanes as without: every status, every reason, and the numbers to a step at round-off, 1e-12,
// with which the scalar path ends; outputs and eigenvalues change at most twice as much.
void check_as_alone(const Model& m, const TrimSpec& spec, const Spoil& spoil = {}) {
  const SweepMap alone = toy_map(m, spec), together = toy_map(with_lanes(m, spoil), spec);
  CHECK(together.status == alone.status);
  CHECK(together.reasons == alone.reasons);
  CHECK(together.reason == alone.reason);
  CHECK(together.verdict == alone.verdict);
  CHECK(largest_difference(together.state, alone.state) <= 1e-12);
  CHECK(largest_difference(together.input, alone.input) <= 2e-12);
  CHECK(largest_difference(together.eigenvalue_re, alone.eigenvalue_re) <= 2e-12);
  check_between(1, together, alone);
}

long refused(const SweepMap& map) { return std::ranges::count(map.verdict, std::int8_t(-1)); }

}  // namespace

TEST_CASE("lanes of any model: points, limits, folds and failures as alone") {
  check_as_alone(curved(), x_and_w());
  TrimSpec limited = x_and_w();
  limited.bounds["x"] = {-1, 0.5};
  CHECK(refused(toy_map(with_lanes(curved()), limited)) > 0);
  check_as_alone(curved(), limited);
  TrimSpec output = x_and_w();
  output.bounds["y"] = {-1, 1.0};
  CHECK(refused(toy_map(with_lanes(curved()), output)) > 0);
  check_as_alone(curved(), output);
  TrimSpec implied;  // w is given: its rate vanishes up to p = 0.5 only
  implied.free = {"x"};
  implied.steady = {"x"};
  implied.implied = {"w"};
  CHECK(refused(toy_map(with_lanes(curved()), implied)) > 0);
  check_as_alone(curved(), implied);
  // A fold at p = 0.5.
  check_as_alone(two_states([](double x, double p) { return 0.5 - p - x * x; },
                            [](double x, double) { return -2 * x; }),
                 x_and_w());
}

TEST_CASE("lanes: a Jacobian that is singular, a derivative that is not finite, a noisy rate") {
  const auto late = [](double p) { return p > 0.5; };
  const Model flat =
      two_states([&](double x, double p) { return (late(p) ? 1e-13 : 1.0) * (p - x); },
                 [&](double, double p) { return late(p) ? -1e-13 : -1.0; });
  CHECK(std::ranges::count(toy_map(with_lanes(flat), x_and_w()).status,
                           std::int8_t(TrimStatus::converged)) < 123);
  check_as_alone(flat, x_and_w());
  const Model noisy = two_states(  // never below 1e-8
      [&](double x, double p) { return p - x + (late(p) ? std::copysign(1e-8, p - x) : 0.0); },
      [](double, double) { return -1.0; });
  CHECK(refused(toy_map(with_lanes(noisy), x_and_w())) > 0);
  check_as_alone(noisy, x_and_w());
  const Model flat_noise = two_states(  // residuals within the tolerance, steps of 5e-8
      [&](double x, double p) {
        return late(p) ? 1e-3 * (p - x) + std::copysign(5e-11, p - x) : p - x;
      },
      [&](double, double p) { return late(p) ? -1e-3 : -1.0; });
  check_as_alone(flat_noise, x_and_w());
  const Model steep = two_states(  // steps at round-off, residuals of 1e-8
      [&](double x, double p) { return (late(p) ? 1e8 : 1.0) * (p - x - x * x * x / 3); },
      [&](double x, double p) { return (late(p) ? -1e8 : -1.0) * (1 + x * x); });
  check_as_alone(steep, x_and_w());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  check_as_alone(curved(), x_and_w(), [&](std::vector<double>&, MatrixXd& J, double p) {
    if (late(p) && J.cols() > 0) J(1, 1) = nan;
  });
  TrimSpec without_w;  // whose derivative no step meets
  without_w.free = {"x"};
  without_w.steady = {"x"};
  without_w.moving = {"w"};
  check_as_alone(curved(), without_w, [&](std::vector<double>&, MatrixXd& J, double p) {
    if (late(p) && J.cols() > 1) J(1, J.cols() - 1) = nan;
  });
  check_as_alone(curved(), x_and_w(), [&](std::vector<double>& y, MatrixXd&, double p) {
    if (late(p)) y[2] = nan;
  });
}

TEST_CASE("lanes that do not give what the model gives are not used") {
  const SweepMap alone = toy_map(curved(), x_and_w());
  const Spoil rates = [](std::vector<double>& y, MatrixXd&, double) { y[0] += 1e-6; };
  const Spoil outputs = [](std::vector<double>& y, MatrixXd&, double) { y[2] += 1e-6; };
  const Spoil slopes = [](std::vector<double>&, MatrixXd& J, double) { J *= 1 + 1e-6; };
  for (const Spoil& spoil : {rates, outputs, slopes}) {
    const SweepMap spoiled = toy_map(with_lanes(curved(), spoil), x_and_w());
    CHECK(same_map(spoiled, alone));
    check_between(1, spoiled, alone);
  }
}

}  // namespace lanes_test
