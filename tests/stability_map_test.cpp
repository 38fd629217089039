#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "linearize/batch.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/lanes_routh.hpp"
#include "linearize/modes.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace stability_map_test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();

double abscissa(const MatrixXd& A) { return eigenvalues(A).real().maxCoeff(); }

// A verdict that contradicts modes(). The eigenvalues alone are tested first: modes() is slow.
bool contradicted(const MatrixXd& A, Verdict verdict) {
  if (verdict == Verdict::undecided) return false;
  if ((abscissa(A) < 0) == (verdict == Verdict::stable)) return false;
  const Verdict by_modes = modes(A).verdict;
  return by_modes != Verdict::undecided && by_modes != verdict;
}

MatrixBatch batch(const std::vector<MatrixXd>& matrices) {
  MatrixBatch b(matrices.front().rows(), std::ssize(matrices));
  for (Index k = 0; k < b.count; ++k) b.set(k, matrices[std::size_t(k)]);
  return b;
}

std::vector<Verdict> verdicts(const std::vector<MatrixXd>& matrices, double entry_error = 0.0) {
  std::vector<Verdict> answer;
  verdicts(batch(matrices), answer, entry_error);
  return answer;
}

int contradictions(const std::vector<MatrixXd>& matrices) {
  const std::vector<Verdict> said = verdicts(matrices);
  int count = 0;
  for (std::size_t k = 0; k < matrices.size(); ++k) count += contradicted(matrices[k], said[k]);
  return count;
}

// Fraction of matrices that the kernel leaves to the eigenvalue solver.
double undecided_share(const std::vector<MatrixXd>& matrices, bool balanced) {
  const MatrixBatch b = batch(matrices);
  std::vector<RouthVerdict> said(matrices.size());
  routh_of_matrices<InstructionSet::baseline>({b.entries.data(), std::size_t(b.n), said.size(), 0,
                                               said.size(), 0.0, balanced, said.data()});
  return double(std::ranges::count(said, RouthVerdict::undecided)) / double(said.size());
}

template <class Make>
std::vector<MatrixXd> many(int count, const Make& make) {
  std::vector<MatrixXd> all;
  for (int k = 0; k < count; ++k) all.push_back(make());
  return all;
}

// --- The tiltrotor's closed loop at its trims.

struct Trimmed {
  Command command;
  VectorXd x;
};

const std::vector<Trimmed>& trims() {
  static const std::vector<Trimmed> all = [] {
    constexpr double degree = std::numbers::pi / 180;
    std::ifstream file(TILTRIM_SOURCE_DIR "/data/reference_cases.json");
    std::vector<Trimmed> read;
    const nlohmann::json cases = nlohmann::json::parse(file)["cases"];
    for (const auto& c : cases) {
      const auto& d = c["condition"];
      VectorXd x(6);
      x << 0.0, 0.0, double(c["state"]["theta"]), 0.0, double(c["state"]["energy_integral"]),
          double(c["state"]["distribution_integral"]);
      read.push_back({{d["V"], double(d["gamma_deg"]) * degree, double(d["eta_deg"]) * degree}, x});
    }
    return read;
  }();
  return all;
}

Vehicle craft(const Gains& gains = {}) {
  static const auto polar =
      std::make_shared<Polar>(load_polar(TILTRIM_SOURCE_DIR "/data/naca8h12_re150k.csv"));
  Vehicle v;
  v.gains = gains;
  v.polar = polar;
  return v;
}

struct Loop {
  VectorXd x;
  MatrixXd A;
};

// Newton's method on some of the states for some of the rates and outputs [f; h].
void solve(const Model& model, OperatingPoint& at, const std::vector<Index>& states,
           const std::vector<Index>& rows, const VectorXd& wanted) {
  for (int step = 0; step < 5; ++step) {
    VectorXd y(model.states.size() + model.outputs.size());
    y << model.f(at.x, at.u, at.p), model.h(at.x, at.u, at.p);
    const MatrixXd J = model.derivatives(at, states)(rows, Eigen::all);
    at.x(states) -= algebra::solve(J, MatrixXd(y(rows) - wanted));
  }
}

// Trim and exact Jacobian with other gains at the same inputs: the integrals first take the values
// that give the same theta0 and a1s or delta_e; from far away Newton finds other trims.
Loop loop(const Trimmed& trimmed, const Gains& gains) {
  static const Model model = closed_loop(craft());
  const VectorXd p = closed_loop_parameters(craft(), trimmed.command);
  const VectorXd inputs = model.h(trimmed.x, VectorXd(), p);
  const Index pitch = authority(Aircraft{}, trimmed.command.eta) > 0 ? 1 : 2;
  OperatingPoint at{trimmed.x, VectorXd(), closed_loop_parameters(craft(gains), trimmed.command)};
  solve(model, at, {4, 5}, {6, 6 + pitch}, Eigen::Vector2d(inputs[0], inputs[pitch]));
  solve(model, at, {2, 4, 5}, {0, 1, 3}, Eigen::Vector3d::Zero());
  return {at.x, model.derivatives(at, {0, 1, 2, 3, 4, 5}).topRows(6)};
}

MatrixXd random_loop(Random& random, double spread) {
  Gains gains;
  for (std::size_t g = 0; g < gain_signals().size(); ++g)
    gain_value(gains, g) *= std::pow(spread, uniform(random, -1, 1));
  return loop(trims()[random() % trims().size()], gains).A;
}

using Gain = double Gains::*;

MatrixXd loop_matrix(const Trimmed& trimmed, Gain first, double a, Gain second, double b) {
  Gains gains;
  gains.*first = a;
  gains.*second = b;
  return loop(trimmed, gains).A;
}

// A as an affine function of two gains, from three of its values.
AffineFamily family_of(const Trimmed& trimmed, Gain first, Gain second) {
  const MatrixXd A0 = loop_matrix(trimmed, first, 0, second, 0);
  const auto slope = [&](double a, double b) {
    const MatrixXd steep = loop_matrix(trimmed, first, a, second, b) - A0;
    const double noise = 64 * epsilon * A0.cwiseAbs().maxCoeff();
    return MatrixXd((steep.array().abs() > noise).select(steep, 0.0) / (a + b));
  };
  return {A0, slope(8, 0), slope(0, 8)};
}

const Trimmed& helicopter() { return trims()[0]; }
const Trimmed& airplane() { return trims()[6]; }

// --- Classic difficult matrices with n states.

MatrixXd frank(Index n) {
  return MatrixXd::NullaryExpr(
      n, n, [n](Index i, Index j) { return j < i - 1 ? 0.0 : double(n - std::max(i, j)); });
}

MatrixXd grcar(Index n) {
  return MatrixXd::NullaryExpr(n, n, [](Index i, Index j) {
    return i == j + 1 ? -1.0 : j >= i && j <= i + 3 ? 1.0 : 0.0;
  });
}

MatrixXd godunov() {
  return MatrixXd{{289, 2064, 336, 128, 80, 32, 16},
                  {1152, 30, 1312, 512, 288, 128, 32},
                  {-29, -2000, 756, 384, 1008, 224, 48},
                  {512, 128, 640, 0, 640, 512, 128},
                  {1053, 2256, -504, -384, -756, 800, 208},
                  {-287, -16, 1712, -128, 1968, -30, 2032},
                  {-2176, -287, -1565, -512, -541, -1152, -289}};
}

MatrixXd wilkinson(Index n) {
  MatrixXd W = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i) W(i, i) = std::abs(double(i) - double(n - 1) / 2);
  W.diagonal(1).setOnes();
  W.diagonal(-1).setOnes();
  return W;
}

MatrixXd kahan(Index n) {
  const double s = std::sin(1.2), c = std::cos(1.2);
  return MatrixXd::NullaryExpr(n, n, [&](Index i, Index j) {
    return j < i ? 0.0 : std::pow(s, double(i)) * (i == j ? 1.0 : -c);
  });
}

MatrixXd jordan(Index n) {
  MatrixXd J = -MatrixXd::Identity(n, n);
  J.diagonal(1).setOnes();
  return J;
}

// Of (s + 1)ⁿ: one eigenvalue n times, and a triangle of binomials.
MatrixXd clustered_companion(Index n) {
  MatrixXd C = MatrixXd::Zero(n, n);
  C.diagonal(-1).setOnes();
  double binomial = 1;
  for (Index k = 1; k <= n; ++k) {
    binomial = binomial * double(n - k + 1) / double(k);
    C(0, k - 1) = -binomial;
  }
  return C;
}

MatrixXd huge_range(Random& random, Index n, double decades) {
  MatrixXd A = normal(random, n, n);
  for (double& entry : A.reshaped()) entry *= std::pow(10.0, uniform(random, -decades, decades));
  return A;
}

// Each also shifted so that its rightmost eigenvalue stands ever closer to the axis.
std::vector<MatrixXd> hard_matrices(Index n) {
  Random random(17);
  std::vector<MatrixXd> bases{frank(n), grcar(n),  wilkinson(n),
                              kahan(n), jordan(n), clustered_companion(n)};
  if (n == 7) bases.push_back(godunov());
  for (const double decades : {1.0, 5.0, 20.0, 100.0, 150.0, 307.0})
    for (int k = 0; k < trials(4); ++k) bases.push_back(huge_range(random, n, decades));
  std::vector<MatrixXd> all{MatrixXd::Zero(n, n), -MatrixXd::Identity(n, n),
                            MatrixXd::Constant(n, n, 5e-324), -5e-324 * MatrixXd::Identity(n, n)};
  for (const MatrixXd& A : bases) {
    all.push_back(A);
    all.push_back(-A);
    all.push_back(A.transpose());
    for (const double unit : {1e-320, 1e-300, 1e-150, 1e150}) all.push_back(unit * A);
    const double right = abscissa(A);
    for (int digits = 0; digits <= 17; ++digits)
      for (const double side : {-1.0, 1.0}) {
        const double shift = right + side * std::abs(right) * std::pow(10.0, -digits);
        all.push_back(A - shift * MatrixXd::Identity(n, n));
      }
  }
  std::erase_if(all, [](const MatrixXd& A) { return !A.allFinite(); });
  return all;
}

}  // namespace

TEST_CASE("verdicts: no random matrix is contradicted by its eigenvalues" * thorough) {
  Random random = draws(1);
  int each = trials(250'000) / 20;  // a million: `make planted`
  for (const Index n : {1, 2, 3, 4, 4, 5, 6, 6, 6, 8}) {
    CAPTURE(n);
    const double shift = 0.9 * std::sqrt(double(n));
    CHECK(contradictions(many(each, [&] {
            return MatrixXd(normal(random, n, n) - shift * MatrixXd::Identity(n, n));
          })) == 0);
    // rightmost eigenvalue at ±10^-k of the axis
    CHECK(contradictions(many(each, [&] {
            const MatrixXd A = huge_range(random, n, 1.5);
            const double off = std::pow(10.0, uniform(random, -17, 0));
            const double right = abscissa(A), sign = random() % 2 == 0 ? 1.0 : -1.0;
            return MatrixXd(A - right * (1 + sign * off) * MatrixXd::Identity(n, n));
          })) == 0);
  }
}

TEST_CASE("verdicts: larger matrices") {
  Random random(2);
  for (const Index n : {7, 9, 10, 11, 12, 13, 14, 15, 16}) {
    CAPTURE(n);
    const double shift = 0.9 * std::sqrt(double(n));
    CHECK(contradictions(many(trials(2000), [&] {
            return MatrixXd(normal(random, n, n) - shift * MatrixXd::Identity(n, n));
          })) == 0);
  }
}

TEST_CASE("verdicts: closed loops, nearly all of them without eigenvalues") {
  Random random(3);
  const auto ordinary = many(trials(50'000), [&] { return random_loop(random, 3); });
  CHECK(contradictions(ordinary) == 0);
  CHECK(undecided_share(ordinary, false) <= 1e-3);
  CHECK(undecided_share(ordinary, true) <= 1e-4);
  CHECK(contradictions(many(trials(20'000), [&] { return random_loop(random, 100); })) == 0);
}

TEST_CASE("verdicts: the classic hard matrices, close to the axis too" * doctest::skip(sanitized)) {
  for (Index n = 1; n <= largest_batch_matrix; n += sanitized ? 3 : 1) {
    CAPTURE(n);
    CHECK(contradictions(hard_matrices(n)) == 0);
  }
}

TEST_CASE("verdicts: what is undecided is what modes() cannot tell") {
  Random random(4);
  std::vector<MatrixXd> matrices;
  for (int k = 0; k < 200; ++k) {
    MatrixXd A = normal(random, 6, 6);
    A.row(0) = A.row(1);  // a zero eigenvalue, to rounding
    matrices.push_back(A - 5 * (k % 2) * MatrixXd::Identity(6, 6));
  }
  const std::vector<Verdict> said = verdicts(matrices);
  for (std::size_t k = 0; k < said.size(); ++k)
    if (said[k] == Verdict::undecided) CHECK(modes(matrices[k]).verdict == Verdict::undecided);
  CHECK(verdicts({MatrixXd::Zero(6, 6)})[0] == Verdict::undecided);
}

TEST_CASE("verdicts: not finite is undecided, and leaves the neighbours alone") {
  Random random(5);
  for (const Index n : {1, 4, 6, 7}) {
    const auto matrices =
        many(37, [&] { return MatrixXd(normal(random, n, n) - 2 * MatrixXd::Identity(n, n)); });
    const std::vector<Verdict> alone = verdicts(matrices);
    for (const double bad : {infinity, -infinity, std::nan("")})
      for (std::size_t k = 0; k < matrices.size(); ++k) {
        auto spoiled = matrices;
        spoiled[k](Index(k) % n, Index(k / 2) % n) = bad;
        std::vector<Verdict> expected = alone;
        expected[k] = Verdict::undecided;
        CHECK(verdicts(spoiled) == expected);
      }
  }
}

TEST_CASE("verdicts: the same whatever the number of matrices and their order") {
  Random random(6);
  const auto matrices = many(100, [&] { return random_loop(random, 30); });
  const std::vector<Verdict> all = verdicts(matrices);
  for (std::size_t count = 1; count <= matrices.size(); ++count) {
    const std::vector<MatrixXd> last(matrices.end() - std::ptrdiff_t(count), matrices.end());
    CHECK(std::ranges::equal(verdicts(last), std::span(all).last(count)));
  }
}

TEST_CASE("verdicts: an error of the entries is held against") {
  Random random(7);
  int decided = 0;
  for (int k = 0; k < trials(2000); ++k) {
    const MatrixXd A = random_loop(random, 3);
    const double error = std::pow(10.0, uniform(random, -12, -2));
    const Verdict verdict = verdicts({A}, error)[0];
    if (verdict == Verdict::undecided) continue;
    ++decided;
    for (int m = 0; m < 5; ++m) {
      MatrixXd moved = A;
      for (double& entry : moved.reshaped()) entry *= 1 + (random() % 2 == 0 ? error : -error);
      CHECK_FALSE(contradicted(moved, verdict));
    }
  }
  CHECK(decided > trials(2000) / 2);
  // -1 within 100 % may be zero; within 50 % not
  CHECK(verdicts({-MatrixXd::Identity(1, 1)}, 1.0)[0] == Verdict::undecided);
  CHECK(verdicts({-MatrixXd::Identity(1, 1)}, 0.5)[0] == Verdict::stable);
  CHECK(verdicts({-MatrixXd::Identity(6, 6)}, infinity)[0] == Verdict::undecided);
}

TEST_CASE("verdicts: empty, and refused") {
  std::vector<Verdict> answer{Verdict::unstable};
  verdicts(MatrixBatch(6, 0), answer);
  CHECK(answer.empty());
  verdicts(MatrixBatch(0, 3), answer);
  CHECK(answer == std::vector<Verdict>(3, Verdict::stable));
  CHECK_THROWS_AS(verdicts(MatrixBatch(17, 1), answer), std::invalid_argument);
  MatrixBatch wrong(2, 2);
  wrong.entries.pop_back();
  CHECK_THROWS_AS(verdicts(wrong, answer), std::invalid_argument);
  CHECK_THROWS_AS(verdicts(MatrixBatch(2, 2), answer, -1e-3), std::invalid_argument);
  CHECK_THROWS_AS(verdicts(MatrixBatch(2, 2), answer, std::nan("")), std::invalid_argument);
}

TEST_CASE("the closed loop's A is affine in the gains, at the trims that move with them") {
  struct Pair {
    const Trimmed& trimmed;
    Gain first, second;
  };
  for (const auto& [trimmed, first, second] : {Pair{helicopter(), &Gains::k_pa, &Gains::k_da},
                                               Pair{airplane(), &Gains::k_pe, &Gains::k_de}}) {
    const AffineFamily family = family_of(trimmed, first, second);
    for (const double a : {0.3, 5.0, 12.0})
      for (const double b : {-0.5, 0.03, 4.0}) {
        const MatrixXd A = loop_matrix(trimmed, first, a, second, b);
        const MatrixXd affine = family.A0 + a * family.A1 + b * family.A2;
        CHECK_NEAR((A - affine).norm(), 0, 1e-12 * A.norm());
      }
  }
}

namespace {

std::vector<double> grid(double from, double to, int count) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back(from + (to - from) * k / (count - 1));
  return values;
}

int contradictions(const AffineFamily& family, const std::vector<double>& a,
                   const std::vector<double>& b) {
  const std::vector<Verdict> map = stability_map(family, a, b);
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      count += contradicted(family.A0 + a[i] * family.A1 + b[j] * family.A2, map[i * b.size() + j]);
  return count;
}

AffineFamily random_family(Random& random, Index n) {
  const auto term = [&] { return MatrixXd(normal(random, n, 1) * normal(random, 1, n)); };
  return {normal(random, n, n) - 2 * MatrixXd::Identity(n, n), term(), term()};
}

}  // namespace

TEST_CASE("the map over two gains agrees with modes() at every point") {
  constexpr int points = trials(300);
  const AffineFamily cyclic = family_of(helicopter(), &Gains::k_pa, &Gains::k_da);
  CHECK(contradictions(cyclic, grid(-2, 20, points), grid(-1, 4, points)) == 0);
  const AffineFamily elevator = family_of(airplane(), &Gains::k_pe, &Gains::k_de);
  CHECK(contradictions(elevator, grid(-3, 10, points), grid(-2, 10, points)) == 0);
  const std::vector<Verdict> map = stability_map(cyclic, grid(-2, 20, points), grid(-1, 4, points));
  CHECK(std::ranges::count(map, Verdict::stable) > points);
  CHECK(std::ranges::count(map, Verdict::unstable) > points);
}

TEST_CASE("maps of random families, of any size") {
  Random random(8);
  for (Index n = 1; n <= largest_batch_matrix; ++n) {
    CAPTURE(n);
    for (int k = 0; k < trials(20); ++k) {
      const AffineFamily family = random_family(random, n);
      std::vector<double> a, b;
      for (int m = 0; m < 17; ++m) {
        a.push_back(uniform(random, -3, 3));
        b.push_back(std::pow(10, uniform(random, -3, 3)));
      }
      CHECK(contradictions(family, a, b) == 0);
    }
  }
}

TEST_CASE("map: badly scaled families are the same families") {
  Random random(9);
  const AffineFamily family = random_family(random, 6);
  VectorXd d(6);
  d << 1e-6, 1e3, 1, 1e8, 1e-2, 1e5;
  const auto scaled = [&d](const MatrixXd& A) {
    return MatrixXd(d.asDiagonal() * A * d.cwiseInverse().asDiagonal());
  };
  const auto a = grid(-3, 3, 50), b = grid(-3, 3, 50);
  CHECK(stability_map(family, a, b) ==
        stability_map({scaled(family.A0), scaled(family.A1), scaled(family.A2)}, a, b));
}

TEST_CASE("map: on the boundary it is undecided, beside it decided") {
  // s² + a s + b
  const AffineFamily family{MatrixXd{{0, 1}, {0, 0}}, MatrixXd{{0, 0}, {0, -1}},
                            MatrixXd{{0, 0}, {-1, 0}}};
  CHECK(stability_map(family, {0.0, 1e-9, -1e-9}, {1.0}) ==
        std::vector{Verdict::undecided, Verdict::stable, Verdict::unstable});
  CHECK(stability_map(family, {1.0}, {0.0, 1e-9, -1e-9}) ==
        std::vector{Verdict::undecided, Verdict::stable, Verdict::unstable});
}

TEST_CASE("map: empty, and refused") {
  Random random(10);
  const AffineFamily family = random_family(random, 3);
  CHECK(stability_map(family, {}, {1.0}).empty());
  CHECK(stability_map({MatrixXd(0, 0), MatrixXd(0, 0), MatrixXd(0, 0)}, {1.0}, {1.0}) ==
        std::vector{Verdict::stable});
  AffineFamily wrong = family;
  wrong.A1 = normal(random, 3, 3);
  CHECK_THROWS_AS((void)stability_map(wrong, {1.0}, {1.0}), std::invalid_argument);
  wrong = family;
  wrong.A2 = MatrixXd::Zero(2, 2);
  CHECK_THROWS_AS((void)stability_map(wrong, {1.0}, {1.0}), std::invalid_argument);
  wrong = family;
  wrong.A0(0, 0) = infinity;
  CHECK_THROWS_AS((void)stability_map(wrong, {1.0}, {1.0}), std::invalid_argument);
  CHECK_THROWS_AS((void)stability_map(family, {std::nan("")}, {1.0}), std::invalid_argument);
  CHECK_THROWS_AS((void)stability_map(family, {1e308}, {1e308}), std::invalid_argument);
  const MatrixXd large = MatrixXd::Zero(17, 17);
  CHECK_THROWS_AS((void)stability_map({large, large, large}, {1.0}, {1.0}), std::invalid_argument);
  std::array<Verdict, 3> room{};
  const std::vector<double> two{1.0, 2.0};
  CHECK_THROWS_AS(stability_map(family, two, two, room), std::invalid_argument);
}

// --- Crossings.

namespace {

// Companion form of s³ + a s² + b s + t: stable up to t = a b.
MatrixXd cubic(double a, double b) { return MatrixXd{{0, 1, 0}, {0, 0, 1}, {0, -b, -a}}; }
MatrixXd last_coefficient() { return MatrixXd{{0, 0, 0}, {0, 0, 0}, {-1, 0, 0}}; }

MatrixXd block(const MatrixXd& A, const MatrixXd& B) {
  MatrixXd both = MatrixXd::Zero(A.rows() + B.rows(), A.cols() + B.cols());
  both.topLeftCorner(A.rows(), A.cols()) = A;
  both.bottomRightCorner(B.rows(), B.cols()) = B;
  return both;
}

double distance_to_axis(const MatrixXd& A, double frequency) {
  double nearest = infinity;
  for (const std::complex<double>& z : eigenvalues(A))
    nearest = std::min(nearest, std::abs(z - std::complex(0.0, frequency)));
  return nearest;
}

int right_of_axis(const MatrixXd& A) { return int((eigenvalues(A).real().array() > 0).count()); }

// Places where the number of eigenvalues right of the axis changes, by halving.
void bisect(const MatrixXd& A0, const MatrixXd& A1, double low, double high, int below, int above,
            std::vector<double>& found) {
  if (below == above) return;
  const double middle = 0.5 * (low + high);
  if (high - low < 1e-11) return found.push_back(middle);
  const int between = right_of_axis(A0 + middle * A1);
  bisect(A0, A1, low, middle, below, between, found);
  bisect(A0, A1, middle, high, between, above, found);
}

std::vector<double> by_brute_force(const MatrixXd& A0, const MatrixXd& A1, int pieces) {
  std::vector<double> found;
  int below = right_of_axis(A0);
  for (int k = 0; k < pieces; ++k) {
    const double low = double(k) / pieces, high = double(k + 1) / pieces;
    const int above = right_of_axis(A0 + high * A1);
    bisect(A0, A1, low, high, below, above, found);
    below = above;
  }
  return found;
}

// s³ + (1 + t) s² + (1 + σt) s + 1 + (1 + σ)t - δ: Routh's a₁a₂ - a₃ is σt² + δ, on the axis ω² =
// 1 + σt. At t = 0 a pair comes to the axis at ±i, from the left if σ = 1 and from the right if σ =
// -1, and turns back at the real part -δ/4.
struct Turning {
  double side, gap;  // σ, and δ as it is in A0
  MatrixXd A0, A1;
};

Turning turning(double side, double gap) {
  const double last = 1 - gap;
  return {side, 1 - last, MatrixXd{{0, 1, 0}, {0, 0, 1}, {-last, -1, -1}},
          MatrixXd{{0, 0, 0}, {0, 0, 0}, {-1 - side, -side, -1}}};
}

// Three more stable states mixed in by two reflections and an integer shear: with a gap of few bits
// nothing is rounded.
Turning hidden(Random& random, const Turning& pair, double shear) {
  MatrixXd T = MatrixXd::Identity(6, 6), inverse = T;
  T(1, 4) = shear;
  inverse(1, 4) = -shear;
  for (int k = 0; k < 2; ++k) {
    VectorXd v{{1, -1, 1, -1, 0, 0}};  // |v|² = 4
    std::ranges::shuffle(v.reshaped(), random);
    const MatrixXd reflection = MatrixXd::Identity(6, 6) - v * v.transpose() / 2;
    T = T * reflection;
    inverse = reflection * inverse;
  }
  const MatrixXd rest{{-1, 2, -1}, {0, -3, 1}, {0, 0, -2}};
  return {pair.side, pair.gap, T * block(pair.A0, rest) * inverse,
          T * block(pair.A1, MatrixXd::Zero(3, 3)) * inverse};
}

// Complete results must be right; incomplete ones may contain any crossings close to t = 0.
bool found_completely(const Turning& pair) {
  const LineCrossings found = line_crossings(pair.A0, pair.A1, -0.4, 0.9);
  const double off = std::sqrt(std::abs(pair.gap));
  for (const LineCrossing& c : found.crossings) {
    const bool doubtful = !found.complete;
    CHECK_NEAR(std::abs(c.t), off, doubtful ? 1e-6 : c.error + epsilon);
    CHECK_NEAR(c.frequency, std::sqrt(1 + pair.side * c.t), doubtful ? 1e-6 : 1e-14 + c.error);
  }
  if (!found.complete) return false;
  const bool pierced = pair.side * pair.gap < 0;
  REQUIRE(found.crossings.size() == (pierced ? 2 : 0));
  if (pierced) CHECK(found.crossings[0].t * found.crossings[1].t < 0);
  return true;
}

}  // namespace

TEST_CASE("crossings: Routh's boundary of the cubic is met where it is known to be") {
  Random random(11);
  for (int k = 0; k < trials(1000); ++k) {
    const double a = std::pow(10, uniform(random, -2, 2)), b = std::pow(10, uniform(random, -3, 3));
    const double to = 2 * a * b;
    const LineCrossings found = line_crossings(cubic(a, b), last_coefficient(), -0.5 * a * b, to);
    REQUIRE(found.crossings.size() == 2);
    CHECK(found.complete);
    CHECK_NEAR(found.crossings[0].t, 0, 1e-14 * to);
    CHECK(found.crossings[0].frequency == 0);
    CHECK_NEAR(found.crossings[1].t, a * b, 1e-14 * to);
    CHECK_NEAR(found.crossings[1].frequency, std::sqrt(b), 1e-14 * std::sqrt(b));
    CHECK(found.crossings[1].error <= 1e-10 * to);
  }
}

TEST_CASE("crossings: planted in blocks behind a similarity") {
  Random random(12);
  for (int k = 0; k < trials(1000); ++k) {
    const double a = uniform(random, 0.2, 3), b = uniform(random, 0.2, 3);
    const MatrixXd rest = normal(random, 3, 3) - 4 * MatrixXd::Identity(3, 3);
    const MatrixXd T = algebra::orthogonal(normal(random, 6, 6));
    const MatrixXd A0 = T * block(cubic(a, b), rest) * T.transpose();
    const MatrixXd A1 = T * block(last_coefficient(), MatrixXd::Zero(3, 3)) * T.transpose();
    const LineCrossings found = line_crossings(A0, A1, 0.1 * a * b, 3 * a * b);
    REQUIRE(found.crossings.size() == 1);
    CHECK_NEAR(found.crossings[0].t, a * b, 1e-12 * (1 + a * b));
    CHECK_NEAR(found.crossings[0].frequency, std::sqrt(b), 1e-12 * (1 + b));
  }
}

TEST_CASE("crossings: a window of stability as narrow as a millionth of the interval") {
  // s³ + a s² + (b + t) s + (c + d t): from t1 on stable by the zero eigenvalue, unstable again
  // where a (b + t) = c + d t
  for (const double width : {1e-2, 1e-4, 1e-6, 1e-8}) {
    const double a = 1, d = 2, t1 = 0.3, t2 = t1 + width;
    const double c = -d * t1, b = (c + d * t2) / a - t2;
    const MatrixXd A0{{0, 1, 0}, {0, 0, 1}, {-c, -b, -a}}, A1{{0, 0, 0}, {0, 0, 0}, {-d, -1, 0}};
    const LineCrossings found = line_crossings(A0, A1, 0, 1);
    REQUIRE(found.crossings.size() == 2);
    CHECK(found.complete);
    CHECK_NEAR(found.crossings[0].t, t1, 1e-14);
    CHECK_NEAR(found.crossings[1].t, t2, 1e-14);
    CHECK(modes(A0 + 0.5 * (t1 + t2) * A1).verdict == Verdict::stable);
  }
}

TEST_CASE("crossings: none missed and none invented, against bisection on random lines") {
  Random random(13);
  int lines = 0, met = 0, precise = 0;
  for (int k = 0; k < trials(2000); ++k) {
    const Index n = 2 + Index(random() % 7);
    const MatrixXd A0 = normal(random, n, n) - uniform(random, 0, 3) * MatrixXd::Identity(n, n);
    const MatrixXd A1 =
        std::pow(10, uniform(random, -1, 1)) * normal(random, n, 1) * normal(random, 1, n);
    const LineCrossings found = line_crossings(A0, A1, 0, 1);
    const std::vector<double> expected = by_brute_force(A0, A1, 400);
    lines += found.complete;
    // Bisection misses two crossings within one of its pieces, or more than one bisected there
    std::vector<double> separate;
    for (const LineCrossing& c : found.crossings) separate.push_back(c.t);
    if (found.crossings.size() > expected.size())
      std::erase_if(separate, [&](double t) {
        return std::ranges::any_of(found.crossings, [t](const LineCrossing& other) {
          return other.t != t && std::abs(other.t - t) < 1.0 / 400;
        });
      });
    for (const double t : expected) {
      const bool there = std::ranges::any_of(
          found.crossings, [t](const LineCrossing& c) { return std::abs(c.t - t) < 1e-8; });
      CHECK_MESSAGE(there, "missed");
      met += there;
    }
    if (separate.size() == found.crossings.size()) CHECK(separate.size() == expected.size());
    for (const LineCrossing& c : found.crossings) {
      precise += c.error < 1e-9;
      CHECK(distance_to_axis(A0 + c.t * A1, c.frequency) < 1e-7);
    }
  }
  CHECK(lines >= trials(2000) * 999 / 1000);
  CHECK(met > trials(700));
  CHECK(precise > met * 99 / 100);
}

TEST_CASE("crossings: the tiltrotor's loop along a gain") {
  const AffineFamily family = family_of(helicopter(), &Gains::k_pa, &Gains::k_da);
  const LineCrossings found = line_crossings(family.A0, family.A1, -5, 20);
  CHECK(found.complete);
  CHECK_FALSE(found.crossings.empty());
  for (const LineCrossing& c : found.crossings) {
    CHECK(c.error < 1e-10);
    CHECK(right_of_axis(family.A0 + (c.t - 1e-6) * family.A1) !=
          right_of_axis(family.A0 + (c.t + 1e-6) * family.A1));
  }
}

TEST_CASE("crossings: a pair that turns back just left of the axis, just right of it, or on it") {
  Random random(14);
  for (const double side : {1.0, -1.0}) {
    for (const double distance : {1e-6, -1e-6, 1e-9, -1e-9}) {
      CAPTURE(distance);
      const Turning pair = turning(side, 4 * distance);
      CHECK_NEAR(abscissa(pair.A0), -distance, 1e-14 + 4 * distance * distance);
      CHECK(found_completely(pair));
    }
    for (int bits = 4; bits <= 53; ++bits)
      for (const double sign : {1.0, -1.0}) {
        CAPTURE(bits);
        const bool complete = found_completely(turning(side, sign * std::ldexp(1.0, -bits)));
        if (bits <= 30) CHECK(complete);
      }
    CHECK_FALSE(found_completely(turning(side, 0)));
  }
}

TEST_CASE("crossings: the same pair behind a similarity is found, or said to be in doubt") {
  Random random(15);
  int complete = 0, in_doubt = 0;
  for (int k = 0; k < trials(4000); ++k) {
    const int bits = 4 + int(random() % 27);
    CAPTURE(bits);
    const double side = k % 2 == 0 ? 1 : -1, sign = k / 2 % 2 == 0 ? 1 : -1;
    const Turning pair = turning(side, sign * std::ldexp(1.0, -bits));
    CHECK(found_completely(hidden(random, pair, 0)));
    (found_completely(hidden(random, pair, 32)) ? complete : in_doubt) += 1;
    CHECK_FALSE(found_completely(hidden(random, turning(side, 0), 0)));
  }
  CHECK(complete > trials(3000));
  CHECK(in_doubt > 0);
}

TEST_CASE("crossings: what rounding leaves in doubt is said") {
  SUBCASE("a pair stays on the axis") {
    const MatrixXd A0 = block(MatrixXd{{0, 1}, {-1, 0}}, MatrixXd{{0, 1}, {-2, -3}});
    MatrixXd A1 = MatrixXd::Zero(4, 4);
    A1(3, 2) = -1;
    CHECK_FALSE(line_crossings(A0, A1, 0, 1).complete);
  }
  SUBCASE("an eigenvalue stays at zero") {
    const MatrixXd A0 = block(MatrixXd{{0}}, MatrixXd{{-1}}),
                   A1 = block(MatrixXd{{0}}, MatrixXd{{1}});
    CHECK_FALSE(line_crossings(A0, A1, 0, 0.5).complete);
  }
  SUBCASE("a line on the axis") {
    const MatrixXd A0{{0, 1}, {-1, 0}}, A1{{0, 0}, {-1, 0}};
    CHECK_FALSE(line_crossings(A0, A1, 0, 1).complete);
  }
  SUBCASE("nothing moves") {
    const MatrixXd Z = MatrixXd::Zero(2, 2);
    CHECK(line_crossings(-MatrixXd::Identity(2, 2), Z, 0, 1).complete);
    CHECK_FALSE(line_crossings(MatrixXd{{0, 1}, {-1, 0}}, Z, 0, 1).complete);
  }
}

TEST_CASE("crossings: at the ends of the interval, and refused") {
  CHECK(line_crossings(cubic(1, 1), last_coefficient(), 0, 1).crossings.size() == 2);
  CHECK(line_crossings(cubic(1, 1), last_coefficient(), 0.01, 0.99).crossings.empty());
  CHECK(line_crossings(MatrixXd(0, 0), MatrixXd(0, 0), 0, 1).crossings.empty());
  CHECK_THROWS_AS((void)line_crossings(cubic(1, 1), last_coefficient(), 1, 1),
                  std::invalid_argument);
  CHECK_THROWS_AS((void)line_crossings(cubic(1, 1), last_coefficient(), 0, infinity),
                  std::invalid_argument);
  CHECK_THROWS_AS((void)line_crossings(cubic(1, 1), MatrixXd::Identity(3, 3), 0, 1),
                  std::invalid_argument);
  CHECK_THROWS_AS((void)line_crossings(cubic(1, 1), MatrixXd::Zero(2, 2), 0, 1),
                  std::invalid_argument);
}

}  // namespace stability_map_test
