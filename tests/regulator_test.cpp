#include <complex>
#include <limits>

#include "design/design.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector4d;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace regulator_test {

namespace {

constexpr double rounding = 1e-13;  // of numbers of order one

// A matrix as printed.
MatrixXd rows(std::initializer_list<std::initializer_list<double>> values) {
  return MatrixXd(values);
}

void check_entries(const MatrixXd& actual, const MatrixXd& expected, double tolerance) {
  REQUIRE(actual.rows() == expected.rows());
  REQUIRE(actual.cols() == expected.cols());
  for (Index j = 0; j < actual.cols(); ++j)
    for (Index i = 0; i < actual.rows(); ++i) CHECK_NEAR(actual(i, j), expected(i, j), tolerance);
}

VectorXcd complex(std::initializer_list<Complex> values) {
  return Eigen::Map<const VectorXcd>(values.begin(), std::ssize(values));
}

const MatrixXd double_integrator = rows({{0, 1}, {0, 0}});
const MatrixXd force = rows({{0}, {1}});
const MatrixXd one = MatrixXd::Identity(1, 1);

// A chemical reactor.                                                              [80, sec. 4,
// example 1]
const MatrixXd reactor = rows({{1.380, -0.2077, 6.715, -5.676},
                               {-0.5814, -4.290, 0, 0.6750},
                               {1.067, 4.273, -6.654, 5.893},
                               {0.0480, 4.273, 1.343, -2.104}});
const MatrixXd reactor_inputs = rows({{0, 0}, {5.679, 0}, {1.136, -3.146}, {1.136, 0}});

}  // namespace

TEST_CASE("lqr: closed forms") {
  // x'' = u, cost x² + r u²: K = (r^-1/2, √2 r^-1/4)                            [81]
  for (const double r : {1e-8, 1e-2, 1.0, 1e4, 1e8}) {
    CAPTURE(r);
    const Regulator found = lqr(double_integrator, force, rows({{1, 0}, {0, 0}}), r * one);
    REQUIRE(found);
    CHECK_NEAR(found.K(0, 0) * std::sqrt(r), 1, 1e-12);
    CHECK_NEAR(found.K(0, 1) * std::pow(r, 0.25), std::sqrt(2), 1e-12);
    CHECK(found.residual < rounding);
  }
  // x' = a x + b u, cost q x² + r u²: s = r (a + √(a² + q b²/r))/b²
  const double a = 3, b = 0.5, q = 2, r = 4;
  const Regulator scalar = lqr(a * one, b * one, q * one, r * one);
  REQUIRE(scalar);
  CHECK_NEAR(scalar.S(0, 0), r * (a + std::sqrt(a * a + q * b * b / r)) / (b * b), 1e-11);
  CHECK_NEAR(scalar.poles[0].real(), -std::sqrt(a * a + q * b * b / r), 1e-12);
  // Nothing to control.
  CHECK(lqr(MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(0, 0), one));
}

TEST_CASE("lqr: published solutions") {
  // The example of SB02MD [79]; also example 1.1 of [82].
  const Regulator slicot = lqr(double_integrator, force, rows({{1, 0}, {0, 2}}), one);
  REQUIRE(slicot);
  check_entries(slicot.S, rows({{2, 1}, {1, 2}}), rounding);
  // That of SB02OD.
  const Regulator pencil = lqr(double_integrator, force, MatrixXd::Identity(2, 2), one);
  REQUIRE(pencil);
  check_entries(pencil.S, rows({{1.7321, 1}, {1, 1.7321}}), printed_to("1.7321"));
  // Example 1.2 of [82]: S = (1 + √2) Q, poles -1/2 and -√2.
  const MatrixXd Q = rows({{9, 6}, {6, 4}});
  const Regulator laub = lqr(rows({{4, 3}, {-4.5, -3.5}}), rows({{1}, {-1}}), Q, one);
  REQUIRE(laub);
  check_entries(laub.S, (1 + std::sqrt(2)) * Q, 1e-12);
  CHECK_NEAR(laub.poles[0].real(), -std::sqrt(2), 1e-13);
  CHECK_NEAR(laub.poles[1].real(), -0.5, 1e-13);
}

TEST_CASE("lqr: an unstable mode that the cost does not contain is mirrored at least effort") {
  const Regulator found = lqr(2 * one, one, 0 * one, one);
  REQUIRE(found);
  CHECK_NEAR(found.poles[0].real(), -2, 1e-13);
}

TEST_CASE("lqr: why there is no regulator") {
  const MatrixXd A = rows({{3, 0}, {0, -1}});
  const Regulator uncontrolled = lqr(A, force, MatrixXd::Identity(2, 2), one);
  CHECK(to_string(uncontrolled.status) == "not_stabilizable");
  REQUIRE(uncontrolled.modes.size() == 1);
  CHECK_NEAR(uncontrolled.modes[0].real(), 3, rounding);
  // The position costs nothing.
  const Regulator drifts = lqr(double_integrator, force, rows({{0, 0}, {0, 1}}), one);
  CHECK(to_string(drifts.status) == "not_detectable");
  CHECK(!drifts);
  // A mode 1e-9 of the norm from uncontrollable has a regulator, with gains of 1e9.
  const Regulator weak = lqr(A, rows({{1e-9}, {1}}), MatrixXd::Identity(2, 2), one);
  CHECK(weak.status != LqrStatus::not_stabilizable);
  CHECK(bool(weak) == (weak.residual <= 1e-8 && weak.poles.real().maxCoeff() < 0));
}

TEST_CASE("lqr: mistakes are named") {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const auto given = [&](const MatrixXd& Q, const MatrixXd& R) {
    return refusal([&] { (void)lqr(double_integrator, force, Q, R); });
  };
  CHECK(given(I, I) == "lqr: A is 2 x 2, B is 2 x 1, Q is 2 x 2, R is 2 x 2 (expected 1 x 1)");
  CHECK(given(I, 0 * one) == "lqr: R is not positive definite: it has the eigenvalue 0");
  CHECK(given(-I, one) == "lqr: Q is not positive semidefinite: it has the eigenvalue -1");
  CHECK(contains(given(rows({{1, 2}, {3, 4}}), one), "Q is not symmetric: 2 in row 1, column 2"));
  MatrixXd infinite = I;
  infinite(1, 0) = std::numeric_limits<double>::infinity();
  CHECK(given(infinite, one) == "lqr: Q(2, 1) is inf");
}

TEST_CASE("lqr: random systems in units of unlike size") {
  Random random = draws(5);
  for (int trial = 0; trial < trials(60); ++trial) {
    const Index n = 1 + trial % 12, m = 1 + trial % 3;
    const Eigen::VectorXd unit = (3 * normal(random, n, 1)).array().exp();  // of each state
    const MatrixXd over = unit.cwiseInverse().asDiagonal();
    const MatrixXd A = unit.asDiagonal() * normal(random, n, n) * over;
    const MatrixXd B = unit.asDiagonal() * normal(random, n, m), C = normal(random, n, n) * over;
    const Regulator found = lqr(A, B, C.transpose() * C, MatrixXd::Identity(m, m));
    CAPTURE(trial);
    CHECK(found);
    CHECK(found.residual < 1e-10);
  }
}

TEST_CASE("place: gains of one input are unique") {
  // x'' = u: K = (ω², 2 ζ ω), here ω = 5, ζ = 0.6.
  const Placement second = place(double_integrator, force, complex({{-3, 4}, {-3, -4}}));
  REQUIRE(second);
  check_entries(second.K, rows({{25, 6}}), 1e-13);
  // A regulator of [83].
  const Placement third = place(rows({{0, 1, 0}, {0, 0, 1}, {-1, -5, -6}}), rows({{0}, {0}, {1}}),
                                complex({{-2, 4}, {-10, 0}, {-2, -4}}));
  REQUIRE(third);
  check_entries(third.K, rows({{199, 55, 8}}), 1e-10);
  // An inverted pendulum on a cart [83]; its gains are printed to 0.01 and 0.001.
  const Placement pendulum =
      place(rows({{0, 1, 0, 0}, {20.601, 0, 0, 0}, {0, 0, 0, 1}, {-0.4905, 0, 0, 0}}),
            rows({{0}, {-1}, {0}, {0.5}}),
            complex({{-2, 2 * std::sqrt(3)}, {-2, -2 * std::sqrt(3)}, {-10, 0}, {-10, 0}}));
  REQUIRE(pendulum);
  CHECK_NEAR(pendulum.K(0, 0), -298.15, printed_to("298.15"));
  CHECK_NEAR(pendulum.K(0, 1), -60.697, printed_to("60.697"));
  CHECK_NEAR(pendulum.K(0, 2), -163.099, printed_to("163.099"));
  CHECK_NEAR(pendulum.K(0, 3), -73.394, 2 * printed_to("73.394"));  // -73.3945 to more digits
}

TEST_CASE("place: a chemical reactor and an aircraft with two inputs") {
  // Open-loop eigenvalues as printed in [80]; two of them stay.
  const Placement found = place(reactor, reactor_inputs, complex({-0.2, -0.5, -5.0566, -8.6659}));
  REQUIRE(found);
  CHECK(found.residual < 1e-12);
  CHECK(found.K.norm() < 1.5);
  // The example of SB01BD [79], whose closed loop is printed to four decimals.
  const MatrixXd A = rows({{-6.8, 0, -207, 0}, {1, 0, 0, 0}, {43.2, 0, 0, -4.2}, {0, 0, 1, 0}});
  const MatrixXd B = rows({{5.64, 0}, {0, 0}, {0, 1.18}, {0, 0}});
  const VectorXcd wanted =
      complex({{-3.3984, 94.5253}, {-3.3984, -94.5253}, {-0.5, 0.15}, {-0.5, -0.15}});
  const Placement aircraft = place(A, B, wanted);
  REQUIRE(aircraft);
  const MatrixXd slicot =
      rows({{-0.0876, -4.2138, 0.0837, -18.1412}, {-0.0233, 18.2483, -0.4259, -4.8120}});
  CHECK(aircraft.K.norm() < 1.2 * slicot.norm());
}

TEST_CASE("place: any multiplicity, pairs made real, real ones made pairs") {
  const MatrixXd A = rows({{0, 1, 0, 0}, {-1, 0, 0, 0}, {0, 0, 2, 1}, {0, 0, 0, 3}});
  const MatrixXd B = rows({{0, 1}, {1, 0}, {0, 1}, {1, 1}});
  for (const VectorXcd& poles :
       {complex({-1, -1, -1, -1}), complex({{-1, 2}, {-1, -2}, {-1, 2}, {-1, -2}}),
        complex({{-1, 5}, {-1, -5}, -2, -3}), complex({{0, 1}, {0, -1}, 2, 3}),
        complex({0, 0, 0, -1})}) {
    const Placement two = place(A, B, poles), single = place(A, B.col(0) + B.col(1), poles);
    CHECK(two);
    CHECK(single);
  }
  // Four equal real eigenvalues to two pairs: each input reaches two of them.
  MatrixXd four = MatrixXd::Zero(4, 4);
  four(0, 1) = four(2, 3) = 1;
  const Placement pairs = place(four, rows({{0, 0}, {1, 0}, {0, 0}, {0, 1}}),
                                complex({{-1, 2}, {-1, -2}, {-3, 1}, {-3, -1}}));
  CHECK(pairs);
}

TEST_CASE("place: uncontrollable modes are named and stay") {
  const MatrixXd A = rows({{0, 1, 0, 0}, {0, 0, 0, 0}, {0, 0, -3, 2}, {0, 0, -2, -3}});
  const MatrixXd B = rows({{0}, {1}, {0}, {0}});
  const Placement found = place(A, B, complex({-1, -2, -4, -5}));
  CHECK(to_string(found.status) == "uncontrollable");
  REQUIRE(found.uncontrollable.size() == 2);
  CHECK(std::abs(found.uncontrollable[0] - Complex(-3, 2)) < rounding);
  check_entries(found.K, rows({{2, 3, 0, 0}}), 1e-12);  // -4 and -5 are nearest to the pair
  // Wanted where they are.
  const Placement same = place(A, B, complex({-1, -2, {-3, 2}, {-3, -2}}));
  CHECK(same);
  CHECK(same.uncontrollable.size() == 2);
  // One real mode takes half of a pair.
  const Placement half = place(rows({{0, 0}, {0, 1}}), force, complex({{-1, 1}, {-1, -1}}));
  CHECK(half.status == PlaceStatus::uncontrollable);
  CHECK_NEAR(half.poles[0].real(), -1, rounding);
  // Two modes of one value: the input moves their sum and nothing across it. A third is moved
  // freely.
  for (const MatrixXd& a : {rows({{1, 0}, {0, 1}}), rows({{1, 0.5}, {0.5, 1}})}) {
    const Placement one = place(a, rows({{1}, {1}}), complex({{-1, 1}, {-1, -1}}));
    CHECK(one.status == PlaceStatus::uncontrollable);
    REQUIRE(one.uncontrollable.size() == 1);
    CHECK_NEAR(one.uncontrollable[0].real(), 1 - a(0, 1), rounding);
    check_entries(one.K, rows({{1 + a(0, 1) / 2, 1 + a(0, 1) / 2}}), 1e-12);  // the sum to -1
  }
  const Placement third = place(rows({{1, 0, 0}, {0, 1, 0}, {0, 0, 2}}), rows({{1}, {1}, {1}}),
                                complex({{-1, 1}, {-1, -1}, -3}));
  CHECK(third.status == PlaceStatus::uncontrollable);
  CHECK(third.uncontrollable.size() == 1);
}

TEST_CASE("place: mistakes are named") {
  const auto given = [](const VectorXcd& poles) {
    return refusal([&] { (void)place(double_integrator, force, poles); });
  };
  CHECK(given(complex({-1})) == "place: 1 poles for 2 states; expected 2");
  CHECK(given(complex({{-1, 2}, -3})) == "place: the pole -1+2i has no conjugate -1-2i");
  CHECK(given(complex({{-1, -2}, -3})) == "place: the pole -1-2i has no conjugate -1+2i");
  CHECK(given(complex({NAN, -3})) == "place: a pole is not finite");
}

TEST_CASE("place: random systems") {
  Random random = draws(6);
  for (int trial = 0; trial < trials(60); ++trial) {
    const Index n = 2 + trial % 7, m = 1 + trial % 3;
    VectorXcd poles = VectorXcd::Zero(n);
    for (Index k = 0; k < n; ++k) poles[k] = -1.0 - double(k);
    if (trial % 2 == 1) poles.head(2) << Complex(-2, 3), Complex(-2, -3);
    CAPTURE(trial);
    CHECK(place(normal(random, n, n), normal(random, n, m), poles));
  }
}

TEST_CASE("lyapunov and sylvester: closed forms") {
  // x'' + 2 ζ ω x' + ω² x = w: variances 1/(4 ζ ω³) and 1/(4 ζ ω).
  const double omega = 3, zeta = 0.2;
  const EquationSolution found =
      lyapunov(rows({{0, 1}, {-omega * omega, -2 * zeta * omega}}), rows({{0, 0}, {0, 1}}));
  REQUIRE(found);
  check_entries(found.X,
                rows({{1 / (4 * zeta * std::pow(omega, 3)), 0}, {0, 1 / (4 * zeta * omega)}}),
                1e-15);
  CHECK(found.residual < rounding);
  // The example of SB03OD [79]: Aᵀ X + X A + Bᵀ B = 0.
  const MatrixXd A = rows({{-1, 37, -12, -12}, {-1, -10, 0, 4}, {2, -4, 7, -6}, {2, 2, 7, -9}});
  const MatrixXd B = rows({{1, 2.5, 1, 3.5},
                           {0, 1, 0, 1},
                           {-1, -2.5, -1, -1.5},
                           {1, 2.5, 4, -5.5},
                           {-1, -2.5, -4, 3.5}});
  const EquationSolution factored = lyapunov(A.transpose(), B.transpose() * B);
  REQUIRE(factored);
  check_entries(factored.X, rows({{1, 3, 2, -1}, {3, 10, 5, -2}, {2, 5, 6, -5}, {-1, -2, -5, 7}}),
                1e-11);
  // That of SB04MD.
  const EquationSolution slicot = sylvester(rows({{2, 1, 3}, {0, 2, 1}, {6, 1, 2}}),
                                            rows({{2, 1}, {1, 6}}), rows({{2, 1}, {1, 4}, {0, 5}}));
  REQUIRE(slicot);
  check_entries(slicot.X, rows({{-2.7685, 0.5498}, {-1.0531, 0.6865}, {4.5257, -0.4389}}),
                printed_to("0.5498"));
  CHECK(lyapunov(MatrixXd(0, 0), MatrixXd(0, 0)));
}

TEST_CASE("lyapunov and sylvester do not depend on the units of the states") {
  // x'' + k x' + x = w with x in units of 1/s: variances s²/(2 k) and 1/(2 k).
  const double k = 0.9;
  for (const double s : {1.0, 1e3, 1e6, 1e9}) {
    CAPTURE(s);
    const MatrixXd A = rows({{0, s}, {-1 / s, -k}}), Q = rows({{0, 0}, {0, 1}});
    const MatrixXd X = rows({{s * s / (2 * k), 0}, {0, 1 / (2 * k)}});
    const EquationSolution variance = lyapunov(A, Q), same = sylvester(A, A.transpose(), -Q);
    REQUIRE(variance);
    REQUIRE(same);
    for (const Index i : {0, 1}) {
      CHECK_NEAR(variance.X(i, i) / X(i, i), 1, 1e-14);
      CHECK_NEAR(same.X(i, i) / X(i, i), 1, 1e-14);
    }
  }
}

TEST_CASE("lyapunov: statuses and mistakes") {
  // Eigenvalues -1 and 1 + 2e-14: a small residual does not make X accurate.
  const MatrixXd turn = rows({{0.8, -0.6}, {0.6, 0.8}});
  const MatrixXd nearly = turn * rows({{-1, 0}, {0, 1 + 2e-14}}) * turn.transpose();
  const EquationSolution rounded =
      lyapunov(nearly, MatrixXd::Identity(2, 2) + turn + turn.transpose());
  CHECK(to_string(rounded.status) == "inaccurate");
  CHECK(rounded.residual < rounding);
  const EquationSolution singular = lyapunov(rows({{0, 1}, {-1, 0}}), MatrixXd::Identity(2, 2));
  CHECK(to_string(singular.status) == "singular");
  CHECK(contains(refusal([] { (void)lyapunov(double_integrator, one); }),
                 "lyapunov: A is 2 x 2, Q is 1 x 1 (expected 2 x 2)"));
}

}  // namespace regulator_test
