#include "linearize/modes.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/mode_name.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "vehicles/mode_names.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace modes_test {

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double largest_backward_error = 20;  // LAPACK's limit of its own eigenvalue tests [12]

int whole(Random& random, int low, int high) {
  return std::uniform_int_distribution(low, high)(random);
}

MatrixXd filled(Index n, const std::function<double(Index, Index)>& entry) {
  MatrixXd A(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) A(i, j) = entry(i, j);
  return A;
}

MatrixXd dense(Random& random, Index n) {
  return filled(n, [&](Index, Index) { return uniform(random, -1, 1); });
}

// --- Matrices from the literature.

// Upper Hessenberg, its eigenvalues in reciprocal pairs, the small ones ill conditioned.
MatrixXd frank(Index n) {
  return filled(n, [n](Index i, Index j) { return i > j + 1 ? 0.0 : double(n - std::max(i, j)); });
}

// Toeplitz: sensitive eigenvalues, none of them near a defective one.
MatrixXd grcar(Index n) {
  return filled(n, [](Index i, Index j) {
    return i == j + 1 ? -1.0 : j >= i && j <= i + 3 ? 1.0 : 0.0;
  });
}

// Eigenvalues 0, ±1, ±2, ±4, conditions up to 1e13.
MatrixXd godunov() {
  return (MatrixXd(7, 7) << 289, 2064, 336, 128, 80, 32, 16,  //
          1152, 30, 1312, 512, 288, 128, 32,                  //
          -29, -2000, 756, 384, 1008, 224, 48,                //
          512, 128, 640, 0, 640, 512, 128,                    //
          1053, 2256, -504, -384, -756, 800, 208,             //
          -287, -16, 1712, -128, 1968, -30, 2032,             //
          -2176, -287, -1565, -512, -541, -1152, -289)
      .finished();
}

MatrixXd jordan(double lambda, Index n) {
  return filled(n, [=](Index i, Index j) { return i == j ? lambda : j == i + 1 ? 1.0 : 0.0; });
}

// Roots from their polynomial's coefficients.
MatrixXd companion(const std::vector<double>& roots) {
  std::vector<double> c = {1};  // highest power first
  for (const double r : roots) {
    c.push_back(0);
    for (std::size_t k = c.size() - 1; k > 0; --k) c[k] -= r * c[k - 1];
  }
  const Index n = std::ssize(roots);
  return filled(n, [&](Index i, Index j) {
    return i == 0 ? -c[std::size_t(j + 1)] : i == j + 1 ? 1.0 : 0.0;
  });
}

// Tridiagonal, |i - n/2| on the diagonal, ones next to it: eigenvalues in nearly equal pairs.
MatrixXd wilkinson(Index n) {
  return filled(n, [n](Index i, Index j) {
    return i == j ? std::abs(double(i) - double(n - 1) / 2) : std::abs(i - j) == 1 ? 1.0 : 0.0;
  });
}

// Triangular with decreasing rows: ill conditioned although no entry shows it.
MatrixXd kahan(Index n) {
  const double s = std::sin(1.2), c = std::cos(1.2);
  return filled(n, [=](Index i, Index j) {
    return j < i ? 0.0 : std::pow(s, double(i)) * (i == j ? 1.0 : -c);
  });
}

std::vector<Index> shuffled(Random& random, Index n) {
  std::vector<Index> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::shuffle(order, random);
  return order;
}

MatrixXd permuted(const MatrixXd& A, const std::vector<Index>& order) { return A(order, order); }

MatrixXd rescaled(const MatrixXd& A, const VectorXd& d) {
  return d.asDiagonal() * A * d.cwiseInverse().asDiagonal();
}

VectorXd powers_of_two(Random& random, Index n, int farthest) {
  return VectorXd::NullaryExpr(n,
                               [&] { return std::ldexp(1.0, whole(random, -farthest, farthest)); });
}

MatrixXd block_diagonal(const MatrixXd& A, const MatrixXd& B) {
  MatrixXd both = MatrixXd::Zero(A.rows() + B.rows(), A.rows() + B.rows());
  both.topLeftCorner(A.rows(), A.rows()) = A;
  both.bottomRightCorner(B.rows(), B.rows()) = B;
  return both;
}

// --- Matrices with known eigenvalues: S T S⁻¹ in whole numbers, S a product of shears, so that
// neither S⁻¹ nor any product rounds.

struct Planted {
  MatrixXd A;
  std::vector<Complex> eigenvalues;
};

__extension__ using Integer = __int128;  // products of doubles' whole numbers do not overflow it
using Whole = Eigen::Matrix<Integer, Eigen::Dynamic, Eigen::Dynamic>;

// The same spectrum in a similar matrix, its condition growing with the shears, while every entry
// is a double.
void shear(Random& random, Whole& T, int count, int largest) {
  const auto n = int(T.rows());
  const auto fits = [](const Whole& m) {
    for (Index k = 0; k < m.size(); ++k)
      if (m.data()[k] > (Integer{1} << 53) || m.data()[k] < -(Integer{1} << 53)) return false;
    return true;
  };
  for (int k = 0; k < count && n > 1; ++k) {
    const int i = whole(random, 0, n - 1);
    const int j = (i + whole(random, 1, n - 1)) % n;
    const Integer by = whole(random, -largest, largest);
    Whole next = T;
    next.row(i) += by * T.row(j);
    const Whole column = next.col(i);
    next.col(j) -= by * column;
    if (!fits(next)) return;
    T = next;
  }
}

MatrixXd as_doubles(const Whole& T) {
  MatrixXd A(T.rows(), T.cols());
  for (Index k = 0; k < T.size(); ++k) A.data()[k] = double(T.data()[k]);
  return A;
}

// Whole-number eigenvalues, single ones and pairs, drawn by `draw`, above whole-number couplings.
Planted planted(Random& random, int n, const std::function<int()>& draw, int shears, int largest,
                int coupling = 2) {
  Whole T = Whole::Zero(n, n);
  Planted p;
  for (int i = 0; i < n; ++i) {
    const int real = draw();
    T(i, i) = real;
    if (i + 1 < n && whole(random, 0, 2) == 0) {
      const int imag = whole(random, 1, 9);
      T(i + 1, i + 1) = real;
      T(i, i + 1) = imag;
      T(i + 1, i) = -imag;
      p.eigenvalues.insert(p.eigenvalues.end(), {Complex(real, imag), Complex(real, -imag)});
      for (int j = i + 2; j < n; ++j) T(i + 1, j) = whole(random, -coupling, coupling);
      for (int j = i + 2; j < n; ++j) T(i, j) = whole(random, -coupling, coupling);
      ++i;
    } else {
      p.eigenvalues.emplace_back(real);
      for (int j = i + 1; j < n; ++j) T(i, j) = whole(random, -coupling, coupling);
    }
  }
  shear(random, T, shears, largest);
  p.A = as_doubles(T);
  return p;
}

Verdict truth(const std::vector<Complex>& eigenvalues) {
  double rightmost = -infinity;
  for (const Complex z : eigenvalues) rightmost = std::max(rightmost, z.real());
  return rightmost < 0 ? Verdict::stable : rightmost > 0 ? Verdict::unstable : Verdict::undecided;
}

// Eigenvalues with eleven bits more than a double: compared with discs that include the rounding of
// doubles they are exact, up to a fraction of each disc, which is checked.
std::vector<std::complex<long double>> precise(const algebra::WideMatrix& A) {
  std::vector<std::complex<long double>> values;
  REQUIRE_NOTHROW(values = algebra::eigenvalues(A));
  return values;
}

// Distance of a value outside the discs, over the nearest disc's radius: <= 1 if inside.
template <class Value>
double outside(const Modes& m, const Value& z) {
  double least = infinity;
  for (const Mode& mode : m.modes) {
    const auto centre = std::complex<long double>(mode.eigenvalue);
    const auto apart = double(std::abs(std::complex<long double>(z) - centre));
    least = std::min(least, apart == 0 ? 0.0 : apart / mode.error);
  }
  return least;
}

template <class Values>
void check_contained(const Modes& m, const Values& eigenvalues) {
  for (const auto& z : eigenvalues) CHECK_NEAR(outside(m, z), 0, 1);
}

// Properties of every result, whatever the matrix.
void check_modes(const MatrixXd& A, const Modes& m) {
  REQUIRE(m.converged);
  REQUIRE(std::ssize(m.modes) == A.rows());
  Complex before(-infinity, 0);
  for (const Mode& mode : m.modes) {
    CHECK(mode.backward_error <= largest_backward_error);
    CHECK(mode.error >= 0);
    CHECK(mode.condition >= 1 - 1e-6);
    CHECK(mode.determined == (mode.condition <= 1e8));
    const double total = mode.participation.sum();
    CHECK((std::abs(total - 1) < 1e-12 || total == 0));
    CHECK(std::pair(before.real(), before.imag()) <=
          std::pair(mode.eigenvalue.real(), mode.eigenvalue.imag()));
    before = mode.eigenvalue;
    if (mode.eigenvalue.imag() != 0)
      CHECK(std::ranges::count(m.modes, std::conj(mode.eigenvalue), &Mode::eigenvalue) ==
            std::ranges::count(m.modes, mode.eigenvalue, &Mode::eigenvalue));
  }
  if (A.rows() > 0) CHECK(m.spectral_abscissa == m.modes.back().eigenvalue.real());
}

double relative_miss(const std::vector<Complex>& found, const std::vector<double>& expected) {
  double worst = 0;
  for (const double e : expected) {
    double nearest = infinity;
    for (const Complex z : found) nearest = std::min(nearest, std::abs(z - e));
    worst = std::max(worst, nearest / std::abs(e));
  }
  return worst;
}

std::vector<Complex> eigenvalues_of(const Modes& m) {
  std::vector<Complex> all;
  for (const Mode& mode : m.modes) all.push_back(mode.eigenvalue);
  return all;
}

std::vector<Complex> plain_eigenvalues(const MatrixXd& A) {
  const Eigen::VectorXcd values = algebra::eigenvalues(A);
  return {values.begin(), values.end()};
}

}  // namespace

TEST_CASE("random matrices of many kinds: eigenvalues to LAPACK's measure" * thorough) {
  Random random(1);
  std::normal_distribution<double> normal;
  const std::function<MatrixXd(Index)> kinds[] = {
      [&](Index n) { return dense(random, n); },
      [&](Index n) { return filled(n, [&](Index, Index) { return normal(random); }); },
      [&](Index n) {
        return filled(n, [&](Index, Index) { return double(whole(random, -1, 1)); });
      },
      // sparse
      [&](Index n) {
        return filled(n, [&](Index, Index) {
          return whole(random, 0, 3) > 0 ? 0.0 : uniform(random, -1, 1);
        });
      },
      // magnitudes over many orders
      [&](Index n) {
        return filled(n, [&](Index, Index) {
          return uniform(random, -1, 1) * std::pow(10, uniform(random, -12, 12));
        });
      },
      // graded by rows and columns
      [&](Index n) {
        return filled(n, [&](Index i, Index j) {
          return uniform(random, -1, 1) * std::pow(10, -double(i + j));
        });
      },
      // Hessenberg, symmetric, skew, triangular, of low rank
      [&](Index n) {
        return filled(n,
                      [&](Index i, Index j) { return i > j + 1 ? 0.0 : uniform(random, -1, 1); });
      },
      [&](Index n) {
        const MatrixXd R = dense(random, n);
        return MatrixXd(R + R.transpose());
      },
      [&](Index n) {
        const MatrixXd R = dense(random, n);
        return MatrixXd(R - R.transpose());
      },
      [&](Index n) {
        return permuted(dense(random, n).triangularView<Eigen::Upper>().toDenseMatrix(),
                        shuffled(random, n));
      },
      [&](Index n) {
        const MatrixXd R = dense(random, n);
        return MatrixXd(R.col(0) * R.row(n - 1));
      },
  };
  for (int trial = 0; trial < 2000; ++trial) {
    const Index n = 1 + trial % 12;
    const MatrixXd A = kinds[std::size_t(trial) % std::size(kinds)](n);
    CAPTURE(trial);
    const Modes m = modes(A);
    check_modes(A, m);
  }
}

TEST_CASE("the same, badly scaled") {
  Random random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 2 + trial % 11;
    const MatrixXd R = trial % 3 == 0 ? MatrixXd(frank(n)) : dense(random, n);
    const VectorXd d =
        trial % 2 == 0
            ? powers_of_two(random, n, 27)  // about 1e±8
            : VectorXd::NullaryExpr(n, [&] { return std::pow(10, uniform(random, -8, 8)); });
    const MatrixXd A = rescaled(R, d);
    CAPTURE(trial);
    const Modes m = modes(A);
    check_modes(A, m);
  }
}

TEST_CASE("up to sixteen rows: the bits of Eigen's own iteration") {
  Random random = draws(12);
  for (Index n = 2; n <= 16; ++n)
    for (int i = 0; i < trials(100); ++i) {
      const MatrixXd A = normal(random, n, n);
      CHECK(dense::real_eigensystem(A).values == algebra::eigensystem(A).values);
    }
}

using Values = std::vector<std::complex<double>>;

static Values upper_half(const MatrixXd& A) {
  Values upper;
  for (const auto& z : algebra::eigenvalues(A))
    if (z.imag() >= 0) upper.push_back(z);
  return upper;
}

TEST_CASE("up to sixteen rows: each eigenvector on its own") {
  Random random = draws(13);
  int found = 0, all = 0;
  for (Index n = 1; n <= 16; ++n)
    for (int i = 0; i < trials(100); ++i, ++all) {
      MatrixXd A = normal(random, n, n);
      if (i % 2 == 1)  // entries that are zero: H falls into blocks
        A = A.unaryExpr([&](double a) { return uniform(random, 0, 1) < 0.3 ? 0.0 : a; });
      const Values upper = upper_half(A);
      const auto P = dense::small_vectors(A, upper);
      if (!P) continue;
      ++found;
      Index column = 0;
      for (const auto& z : upper) {
        Eigen::VectorXcd v = P->col(column++).cast<std::complex<double>>();
        if (z.imag() > 0) v += std::complex<double>(0, 1) * P->col(column++);
        CHECK(v.cwiseAbs().maxCoeff() >= 0.5);
        CHECK((A * v - z * v).norm() <= 1e-10 * A.norm());
      }
      CHECK(column == n);
    }
  CHECK(found > 0.9 * all);
}

TEST_CASE("no eigenvector of a wrong eigenvalue, of close ones, of too few") {
  Random random = draws(14);
  const auto vectors = [](const MatrixXd& A, const Values& upper) {
    return dense::small_vectors(A, upper);
  };
  const MatrixXd A = normal(random, 6, 6);
  const Values upper = upper_half(A);
  CHECK(vectors(A, upper));
  CHECK(!vectors(A, Values(upper.begin() + 1, upper.end())));
  for (std::size_t i = 0; i < upper.size(); ++i) {
    Values wrong = upper;
    wrong[i] += 1e-6 * A.norm();
    CHECK(!vectors(A, wrong));
  }
  const MatrixXd close = (MatrixXd(2, 2) << 1, 1, 0, 1 + 1e-6).finished();
  CHECK(!vectors(close, upper_half(close)));
  const MatrixXd near_axis = (MatrixXd(2, 2) << 1, 1, -1e-12, 1).finished();
  CHECK(!vectors(near_axis, upper_half(near_axis)));
}

TEST_CASE("hard matrices: eigenvalues within their discs") {
  Random random(3);
  const std::pair<std::string, MatrixXd> hard[] = {
      {"Frank 12", frank(12)},
      {"Frank 9, transposed", frank(9).transpose()},
      {"Grcar 20", grcar(20)},
      {"Wilkinson 11", wilkinson(11)},
      {"Wilkinson 21", wilkinson(21)},
      {"clustered roots", companion({1, 1.001, 1.002, 1.003, -2})},
      {"roots 1 to 10", companion({1, 2, 3, 4, 5, 6, 7, 8, 9, 10})},
      {"circulant", filled(8, [](Index i, Index j) { return double((j - i + 8) % 8); })},
      {"Hilbert", filled(8, [](Index i, Index j) { return 1 / double(i + j + 1); })},
      {"harmful balancing",  // small entries are rounding, and balancing makes them matter
       (MatrixXd(4, 4) << 1, 2, 0, 1e-17, 3, 1, 1, 0, 1e-16, 1, 2, 1, 0, 2e-16, 1e-17, 3)
           .finished()},
  };
  for (const auto& [name, A] : hard) {
    const auto& captured = name;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const Modes m = modes(A);
    check_modes(A, m);
    const auto eigenvalues = precise(A.cast<long double>());
    check_contained(m, eigenvalues);
    const MatrixXd scaled = rescaled(A, powers_of_two(random, A.rows(), 40));
    check_modes(scaled, modes(scaled));
    check_contained(modes(scaled), eigenvalues);
  }
}

TEST_CASE("known eigenvalues within their discs" * thorough) {
  Random random(4);
  SUBCASE("Godunov") {
    const Modes m = modes(godunov());
    check_modes(godunov(), m);
    check_contained(m, std::vector<Complex>{0, 1, -1, 2, -2, 4, -4});
    CHECK(m.verdict == Verdict::undecided);  // a perturbation of 1e-13 moves them across the axis
  }
  SUBCASE("Kahan and permuted triangular matrices: the diagonal") {
    for (int trial = 0; trial < 200; ++trial) {
      const Index n = 2 + trial % 11;
      const MatrixXd T =
          trial % 4 == 0
              ? kahan(n)
              : MatrixXd(dense(random, n).triangularView<Eigen::Upper>().toDenseMatrix());
      const MatrixXd A = permuted(T, shuffled(random, n));
      const Modes m = modes(A);
      check_modes(A, m);
      const VectorXd diagonal = T.diagonal();
      check_contained(m, std::vector<Complex>(diagonal.begin(), diagonal.end()));
    }
  }
  SUBCASE("whole-number spectra") {
    for (int trial = 0; trial < 1000; ++trial) {
      CAPTURE(trial);
      const Planted p = planted(
          random, 1 + trial % 10, [&] { return whole(random, -6, 3); }, trial % 60, 3);
      const Modes m = modes(p.A);
      check_modes(p.A, m);
      check_contained(m, p.eigenvalues);
    }
  }
  SUBCASE("whole-number spectra, badly scaled") {
    for (int trial = 0; trial < 300; ++trial) {
      CAPTURE(trial);
      const Index n = 2 + trial % 8;
      const Planted p = planted(
          random, int(n), [&] { return whole(random, -50, 50); }, trial % 20, 2);
      const MatrixXd A = rescaled(p.A, powers_of_two(random, n, 60));
      const Modes m = modes(A);
      check_modes(A, m);
      check_contained(m, p.eigenvalues);
    }
  }
  SUBCASE("Jordan blocks, as they are and hidden") {
    for (int trial = 0; trial < 200; ++trial) {
      CAPTURE(trial);
      const int n = 2 + trial % 5;
      const int lambda = whole(random, -2, 2);
      Whole T = Whole::Zero(n, n);
      for (int i = 0; i < n; ++i) T(i, i) = lambda;
      for (int i = 0; i + 1 < n; ++i) T(i, i + 1) = 1;
      shear(random, T, trial % 30, 2);
      const MatrixXd A = as_doubles(T);
      const Modes m = modes(A);
      check_modes(A, m);
      check_contained(m, std::vector<Complex>{double(lambda)});
      CHECK(m.verdict != (lambda <= 0 ? Verdict::unstable : Verdict::stable));
      if (lambda == 0) CHECK(m.verdict == Verdict::undecided);
    }
  }
}

TEST_CASE("eigenvalues of every matrix within A_error lie in the discs") {
  Random random(5);
  for (int trial = 0; trial < 1000; ++trial) {
    CAPTURE(trial);
    const Index n = 1 + trial % 7;
    const MatrixXd A = trial % 5 == 0   ? MatrixXd(jordan(uniform(random, -1, 1), n))
                       : trial % 5 == 1 ? MatrixXd(frank(n))
                                        : dense(random, n);
    const VectorXd units = powers_of_two(random, n, trial % 3 == 0 ? 20 : 0);
    const double size = std::pow(10, uniform(random, -14, 0));
    const MatrixXd within = size * dense(random, n).cwiseAbs().cwiseProduct(A.cwiseAbs());
    const Modes m = modes(rescaled(A, units), rescaled(within, units));
    check_modes(rescaled(A, units), m);
    // Half of them at a corner of what is allowed
    const MatrixXd E = within.cwiseProduct(trial % 2 == 0 ? dense(random, n)
                                                          : MatrixXd(dense(random, n).cwiseSign()));
    const auto moved = precise(A.cast<long double>() + E.cast<long double>());
    check_contained(m, moved);
    for (const auto& z : moved) {
      if (m.verdict == Verdict::stable) CHECK(z.real() < 0);
    }
    if (m.verdict == Verdict::unstable)
      CHECK(std::ranges::any_of(moved, [](const auto& z) { return z.real() > 0; }));
  }
  const Modes unknown = modes(-MatrixXd::Identity(3, 3), MatrixXd::Constant(3, 3, infinity));
  CHECK(unknown.verdict == Verdict::undecided);
  CHECK(unknown.modes[0].error == infinity);
}

TEST_CASE("discs are no larger than the eigenvalues' condition makes them") {
  Random random(6);
  std::vector<double> excess;
  for (int trial = 0; trial < 500; ++trial) {
    const Index n = 2 + trial % 11;
    const MatrixXd A = dense(random, n);
    for (const Mode& m : modes(A).modes)
      excess.push_back(m.error / (double(n) * epsilon * A.norm() * m.condition));
  }
  std::ranges::sort(excess);
  CHECK(excess[excess.size() / 2] < 1e4);
  CHECK(excess.front() > 0.01);  // nor smaller than rounding
}

TEST_CASE("the verdict never contradicts a planted spectrum") {
  Random random = draws(7);
  int n = trials(2000);
  int decided = 0, wrong = 0, outside_discs = 0;
  double largest_condition = 0;
  for (int trial = 0; trial < n; ++trial) {
    // Some far from the axis, some close to it relative to the norm
    const int farthest = trial % 2 == 0 ? 1 : 1000;
    const int shift = whole(random, -1, 1);
    const Planted p = planted(
        random, 1 + trial % 8,
        [&] { return whole(random, 0, 1) == 0 ? shift : -whole(random, 1, farthest); }, trial % 50,
        1 + trial % 3, trial % 3 == 0 ? 100 : 2);
    const double unit = std::ldexp(1.0, whole(random, -30, 30));
    const Modes m = modes(MatrixXd(unit * p.A));
    for (const auto& z : p.eigenvalues) outside_discs += outside(m, unit * z) > 1;
    for (const Mode& mode : m.modes)
      if (std::isfinite(mode.condition))
        largest_condition = std::max(largest_condition, mode.condition);
    if (m.verdict == Verdict::undecided) continue;
    ++decided;
    wrong += m.verdict != truth(p.eigenvalues);
  }
  tally("spectrum", n, wrong + outside_discs, n - decided);
  CHECK(wrong == 0);
  CHECK(outside_discs == 0);
  CHECK(decided > 0.4 * n);  // and it does decide
  CHECK(largest_condition > 1e10);
}

TEST_CASE("clear cases are decided") {
  Random random(8);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 8;
    const int shears = whole(random, 0, 4);
    const Planted left = planted(
        random, n, [&] { return whole(random, -9, -1); }, shears, 1, 1);
    CHECK(modes(left.A).verdict == Verdict::stable);
    const Planted right = planted(
        random, n, [&] { return whole(random, 1, 9); }, shears, 1, 1);
    CHECK(modes(right.A).verdict == Verdict::unstable);
    if (n <= 3) CHECK(modes(block_diagonal(left.A, right.A)).verdict == Verdict::unstable);
  }
}

TEST_CASE("on the axis nothing is decided") {
  Random random(9);
  const MatrixXd rotation = (MatrixXd(2, 2) << 0, 3, -3, 0).finished();
  CHECK(modes(rotation).verdict == Verdict::undecided);
  CHECK(modes(block_diagonal(rotation, -MatrixXd::Identity(3, 3))).verdict == Verdict::undecided);
  CHECK(modes(MatrixXd::Zero(3, 3)).verdict == Verdict::undecided);
  CHECK(modes(MatrixXd::Zero(1, 1)).verdict == Verdict::undecided);
  for (const Index n : {2, 3, 4}) {
    CHECK(modes(jordan(0, n)).verdict == Verdict::undecided);
    CHECK(modes(jordan(0, n).transpose()).verdict == Verdict::undecided);
    // In a larger stable matrix, coupled and rotated
    MatrixXd A =
        block_diagonal(jordan(0, n), -2 * MatrixXd::Identity(4, 4) + 0.3 * dense(random, 4));
    A.topRightCorner(n, 4).setOnes();
    CHECK(modes(A).verdict == Verdict::undecided);
    const MatrixXd Q = algebra::orthogonal(dense(random, n + 4));
    CHECK(modes(Q * A * Q.transpose()).verdict == Verdict::undecided);
    // Two rotations that share their vectors
    MatrixXd pair = block_diagonal(rotation, rotation);
    pair.topRightCorner(2, 2).setIdentity();
    CHECK(modes(pair).verdict == Verdict::undecided);
  }
  // A defective eigenvalue left of the axis by less than rounding moves it, and by more. As it
  // stands the block is triangular and none of its zeros is rounded: then 1e-5 is enough.
  const MatrixXd Q = algebra::orthogonal(dense(random, 4));
  const MatrixXd J = jordan(-1e-5, 4);
  CHECK(modes(Q * J * Q.transpose()).verdict == Verdict::undecided);
  CHECK(modes(J, MatrixXd::Constant(4, 4, epsilon)).verdict == Verdict::undecided);
  CHECK(modes(J).verdict == Verdict::stable);
  CHECK(modes(jordan(-0.1, 3)).verdict == Verdict::stable);
  CHECK(modes(jordan(0.1, 3)).verdict == Verdict::unstable);
}

TEST_CASE("a sign within the matrix's own error is not called") {
  const MatrixXd A = -0.01 * MatrixXd::Identity(2, 2);
  CHECK(modes(A, MatrixXd::Constant(2, 2, 0.001)).verdict == Verdict::stable);
  CHECK(modes(A, MatrixXd::Constant(2, 2, 0.02)).verdict == Verdict::undecided);
  CHECK(modes(-A, MatrixXd::Constant(2, 2, 0.001)).verdict == Verdict::unstable);
  CHECK(modes(-A, MatrixXd::Constant(2, 2, 0.02)).verdict == Verdict::undecided);
  // One of three within its error: not stable, and unstable only if another one is
  const MatrixXd near = Eigen::Vector3d(-1, -2, 1e-9).asDiagonal();
  const MatrixXd error = MatrixXd::Constant(3, 3, 1e-8);
  CHECK(modes(near, error).verdict == Verdict::undecided);
  const MatrixXd one = Eigen::Vector3d(-1, 2, 1e-9).asDiagonal();
  CHECK(modes(one, error).verdict == Verdict::unstable);
}

TEST_CASE("balancing is an exact similarity") {
  Random random(10);
  for (int trial = 0; trial < 500; ++trial) {
    const Index n = 1 + trial % 10;
    MatrixXd A = dense(random, n);
    if (trial % 2 == 0) A = (A.array().abs() < 0.6).select(0, A);
    if (trial % 3 == 0) A = rescaled(A, powers_of_two(random, n, 50));
    const Balanced b = balance(A);
    std::vector<Index> order = b.order;
    std::ranges::sort(order);
    for (Index i = 0; i < n; ++i) {
      CHECK(order[std::size_t(i)] == i);
      int exponent = 0;
      CHECK(std::frexp(b.scale[i], &exponent) == 0.5);  // a power of two
      for (Index j = 0; j < n; ++j)
        CHECK(b.B(i, j) * (b.scale[i] / b.scale[j]) ==
              A(b.order[std::size_t(i)], b.order[std::size_t(j)]));
    }
    CHECK(b.same(A) == b.B);
    // The part without isolated states does not grow. (Couplings to isolated states may.)
    if ((A.array() != 0).all()) CHECK(b.B.cwiseAbs().sum() <= A.cwiseAbs().sum() * (1 + 1e-12));
    // Eigenvectors come back as those of A
    const algebra::Eigensystem system = algebra::eigensystem(b.B);
    Eigen::MatrixXcd V(n, n);
    for (Index i = 0; i < n; ++i)
      V.row(b.order[std::size_t(i)]) = b.scale[i] * system.vectors.row(i);
    for (Index k = 0; k < n; ++k) {
      const double miss = (A * V.col(k) - system.values[k] * V.col(k)).norm();
      CHECK_NEAR(miss, 0, 1e-12 * A.norm() * V.col(k).norm());
    }
  }
}

TEST_CASE("balancing makes a permuted triangular matrix triangular") {
  Random random(11);
  for (Index n = 1; n <= 10; ++n) {
    MatrixXd T = dense(random, n).triangularView<Eigen::Upper>();
    for (Index i = 0; i < n; i += 3) T(i, i) = 0;
    const Balanced b = balance(permuted(T, shuffled(random, n)));
    CHECK(b.B.isUpperTriangular(0));
    // and its eigenvalues are its diagonal to the last digit
    std::vector<double> diagonal(T.diagonal().begin(), T.diagonal().end());
    std::ranges::sort(diagonal);
    const Modes m = modes(b.B);
    for (std::size_t i = 0; i < diagonal.size(); ++i) {
      CHECK_NEAR(m.modes[i].eigenvalue.real(), diagonal[i], 2 * epsilon * std::abs(diagonal[i]));
      CHECK(m.modes[i].eigenvalue.imag() == 0);
    }
  }
}

TEST_CASE("a badly scaled chain keeps the digits that plain QR loses") {
  // Tanks in a row, each state in a unit of its own: two-way coupling, 1e12 from unit to unit
  const Index n = 6;
  const MatrixXd chain = filled(n, [](Index i, Index j) {
    return i == j ? -double(i + 1) : std::abs(i - j) == 1 ? 0.1 : 0.0;
  });
  VectorXd units(n);
  for (Index i = 0; i < n; ++i) units[i] = std::ldexp(1.0, int(40 * ((i * 5) % n)));
  const MatrixXd A = rescaled(chain, units);
  std::vector<double> expected;
  for (const auto& z : precise(chain.cast<long double>())) expected.push_back(double(z.real()));
  CHECK_NEAR(relative_miss(eigenvalues_of(modes(A)), expected), 0, 1e-14);
  CHECK(relative_miss(plain_eigenvalues(A), expected) > 1e-6);
  for (const Mode& m : modes(A).modes) {
    CHECK(m.error < 1e-12);
    CHECK(m.determined);
  }
  CHECK(modes(A).verdict == Verdict::stable);
}

TEST_CASE("balancing sees entries far below the diagonal") {
  for (const double far : {0x1p40, 0x1p70, 0x1p120}) {
    CAPTURE(far);
    const MatrixXd A = (MatrixXd(2, 2) << 1, far, 1 / far, 2).finished();
    const std::vector<double> expected = {(3 - std::sqrt(5.0)) / 2, (3 + std::sqrt(5.0)) / 2};
    CHECK_NEAR(relative_miss(eigenvalues_of(modes(A)), expected), 0, 1e-14);
    CHECK(modes(A).verdict == Verdict::unstable);
    CHECK(modes(-A).verdict == Verdict::stable);
  }
}

TEST_CASE("huge, tiny and empty") {
  Random random(12);
  SUBCASE("no states") {
    const Modes m = modes(MatrixXd(0, 0));
    CHECK(m.modes.empty());
    CHECK(m.converged);
    CHECK(m.verdict == Verdict::stable);
    CHECK(m.spectral_abscissa == -infinity);
  }
  SUBCASE("one state") {
    const Modes m = modes(MatrixXd::Constant(1, 1, -3.25));
    check_modes(MatrixXd::Constant(1, 1, -3.25), m);
    CHECK(m.modes[0].eigenvalue == -3.25);
    CHECK(m.modes[0].condition == 1);
    CHECK(m.modes[0].backward_error == 0);
    CHECK(m.modes[0].participation == VectorXd::Ones(1));
    CHECK(m.verdict == Verdict::stable);
  }
  SUBCASE("the same matrix in any unit of time") {
    const MatrixXd A = dense(random, 6);
    const Modes ordinary = modes(A);
    for (const int power : {-1060, -1000, -300, 300, 1000, 1020}) {
      CAPTURE(power);
      const MatrixXd B = A.unaryExpr([=](double a) { return std::ldexp(a, power); });
      const Modes m = modes(B);
      check_modes(B, m);
      if (power > -1000) {  // below, the matrix itself is rounded
        for (std::size_t i = 0; i < 6; ++i)
          CHECK(m.modes[i].eigenvalue == ordinary.modes[i].eigenvalue * std::ldexp(1.0, power));
        CHECK(m.verdict == ordinary.verdict);
      }
      if (power < 1000) check_contained(m, precise(B.cast<long double>()));
    }
  }
  SUBCASE("zeros and denormals") {
    for (const double size : {0.0, 5e-324, 1e-320, 1e-310}) {
      CAPTURE(size);
      const MatrixXd A = size * MatrixXd::Identity(4, 4);
      const Modes m = modes(A);
      check_modes(A, m);
      check_contained(m, std::vector<Complex>{size});
      CHECK(m.verdict != Verdict::stable);
      const MatrixXd J = jordan(0, 4) * size;
      check_modes(J, modes(J));
      check_contained(modes(J), std::vector<Complex>{0.0});
      CHECK(modes(J).verdict == Verdict::undecided);
    }
  }
  SUBCASE("tiny and huge in one matrix") {
    // Eigenvalues ±1: no scaling by one power of two leaves both entries
    const MatrixXd A = (MatrixXd(2, 2) << 0, 1e300, 1e-300, 0).finished();
    check_contained(modes(A), std::vector<Complex>{1, -1});
    const MatrixXd B = (MatrixXd(2, 2) << -1e-300, 1e300, 1e-300, -1e-300).finished();
    check_contained(modes(B), std::vector<Complex>{1, -1});
    CHECK(modes(B).verdict != Verdict::stable);
  }
}

TEST_CASE("what is no matrix is refused") {
  const auto refusal = [](const MatrixXd& A, const MatrixXd& error = {},
                          const std::vector<std::string>& state_names = {}) -> std::string {
    try {
      (void)modes(A, error, state_names);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return {};
  };
  const auto contains = [](const std::string& text, std::string_view part) {
    return text.find(part) != std::string::npos;
  };
  const MatrixXd I = MatrixXd::Identity(2, 2);
  CHECK(contains(refusal(MatrixXd::Zero(2, 3)), "square matrix, this one is 2 x 3"));
  for (const double odd : {std::nan(""), infinity, -infinity})
    CHECK(contains(refusal(MatrixXd::Constant(2, 2, odd)), "not finite"));
  const MatrixXd huge{{-1e308, 1e308}, {1e308, -1e308}};            // 0 and -2e308
  const MatrixXd turning{{1.5e308, 1.5e308}, {-1.5e308, 1.5e308}};  // the parts are finite
  for (const MatrixXd& A : {huge, turning})
    CHECK(contains(refusal(A), "an eigenvalue is beyond 1.8e308"));
  CHECK_NEAR(modes(0.5 * huge).modes[0].eigenvalue.real(), -1e308, 1e293);  // a few ε
  CHECK(contains(refusal(I, MatrixXd::Zero(3, 3)), "the error is 3 x 3, the matrix 2 x 2"));
  CHECK(contains(refusal(I, MatrixXd::Constant(2, 2, -1e-9)), "negative or not a number"));
  CHECK(contains(refusal(I, MatrixXd::Constant(2, 2, std::nan(""))), "negative or not a number"));
  CHECK(contains(refusal(I, {}, {"u"}), "1 names for 2 states"));
  LinearModel nothing;
  nothing.message = "not an equilibrium: u' = 3";
  CHECK_THROWS_WITH_AS((void)modes(nothing), "modes: no linear model: not an equilibrium: u' = 3",
                       std::invalid_argument);
}

TEST_CASE("an iteration that meets its cap says so") {
  Random random(13);
  const Modes m = modes(dense(random, 6), {}, {}, {}, 0);
  CHECK_FALSE(m.converged);
  CHECK(m.modes.empty());
  CHECK(m.verdict == Verdict::undecided);
  CHECK(modes(dense(random, 6)).converged);
}

TEST_CASE("same matrix, same bytes") {
  Random random(14);
  for (int trial = 0; trial < 50; ++trial) {
    const MatrixXd A = dense(random, 6);
    const Modes first = modes(A), again = modes(A);
    const auto same = [](double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; };
    for (std::size_t i = 0; i < first.modes.size(); ++i) {
      const Mode &a = first.modes[i], &b = again.modes[i];
      CHECK(same(a.eigenvalue.real(), b.eigenvalue.real()));
      CHECK(same(a.eigenvalue.imag(), b.eigenvalue.imag()));
      CHECK(same(a.error, b.error));
      CHECK(same(a.condition, b.condition));
      CHECK(same(a.backward_error, b.backward_error));
      for (Index k = 0; k < 6; ++k) CHECK(same(a.participation[k], b.participation[k]));
    }
  }
}

TEST_CASE("an eigenvalue of condition above 1e8 is not determined") {
  // Eigenvalues 1 and 1 + d, condition 1/d within a factor of two, in any units
  for (const double d : {1e-3, 1e-7, 1e-10, 1e-13}) {
    CAPTURE(d);
    const Modes m = modes((MatrixXd(2, 2) << 1, 1, 0, 1 + d).finished());
    for (const Mode& mode : m.modes) {
      if (std::isfinite(mode.condition)) CHECK_NEAR(std::log2(mode.condition * d), 0, 1.01);
      CHECK(mode.determined == (d > 1e-8));
    }
  }
  const Modes defective = modes(jordan(-1, 3));
  for (const Mode& mode : defective.modes) {
    CHECK_FALSE(mode.determined);
    CHECK(mode.condition > 1e8);
  }
}

TEST_CASE("participation sums to one, and does not depend on units") {
  Random random(15);
  for (int trial = 0; trial < 100; ++trial) {
    const Index n = 2 + trial % 6;
    const MatrixXd A = dense(random, n);
    const Modes plain = modes(A);
    const Modes scaled = modes(rescaled(A, powers_of_two(random, n, 20)));
    const std::vector<Index> order = shuffled(random, n);
    const Modes turned = modes(permuted(A, order));
    for (std::size_t i = 0; i < plain.modes.size(); ++i) {
      const Mode& m = plain.modes[i];
      CHECK_NEAR(m.participation.sum(), 1, 1e-14);
      CHECK((m.participation.array() >= 0).all());
      const double tolerance = 1e3 * epsilon * std::max(1.0, m.condition * m.condition);
      CHECK_NEAR((m.participation - scaled.modes[i].participation).cwiseAbs().maxCoeff(), 0,
                 tolerance);
      CHECK_NEAR((m.participation(order) - turned.modes[i].participation).cwiseAbs().maxCoeff(), 0,
                 tolerance);
    }
  }
  const Modes diagonal = modes(MatrixXd(Eigen::Vector4d(-4, -3, -2, -1).asDiagonal()));
  for (Index i = 0; i < 4; ++i)
    CHECK(diagonal.modes[std::size_t(i)].participation == VectorXd::Unit(4, i));
}

TEST_CASE("frequency, damping, time to half") {
  const auto mode = [](double re, double im, double error = 0) {
    Mode m;
    m.eigenvalue = {re, im};
    m.error = error;
    return m;
  };
  CHECK_NEAR(mode(-3, 4).frequency(), 5, 0);
  CHECK_NEAR(mode(-3, 4).damping(), 0.6, 1e-16);
  CHECK_NEAR(mode(3, -4).damping(), -0.6, 1e-16);
  CHECK_NEAR(mode(-2, 0).damping(), 1, 0);
  CHECK_NEAR(mode(2, 0).damping(), -1, 0);
  CHECK_NEAR(mode(0, 4).damping(), 0, 0);
  CHECK_NEAR(mode(0, 0).damping(), 0, 0);
  CHECK(mode(0, 0).frequency() == 0);
  CHECK(mode(0, 0).time_to_half() == infinity);
  CHECK(mode(0, 4).time_to_half() == infinity);
  CHECK_NEAR(mode(-std::numbers::ln2 / 5, 4).time_to_half(), 5, 1e-15);
  CHECK_NEAR(mode(std::numbers::ln2 / 5, 4).time_to_half(), 5, 1e-15);
  CHECK(std::isnan(mode(-1e-16, 0, 1e-15).damping()));  // 1 or -1
  CHECK(std::isnan(mode(-1e-16, 0, 1e-15).time_to_half()));
  CHECK_NEAR(mode(1e-16, 2, 1e-15).damping(), 0, 1e-16);
  CHECK(std::isnan(mode(1e-16, 2, 1e-15).time_to_half()));
  CHECK_NEAR(mode(-2e-15, 0, 1e-15).damping(), 1, 0);
  CHECK(to_string(Verdict::stable) == "stable");
  CHECK(to_string(Verdict::unstable) == "unstable");
  CHECK(to_string(Verdict::undecided) == "undecided");
}

TEST_CASE("classical names from the states that take part") {
  const Complex oscillation(-1, 2), real(-1, 0);
  const std::vector<std::string> wind = {"V", "gamma", "theta", "q"},
                                 body = {"u", "w", "theta", "q"},
                                 loop = {"V_err", "gamma_err",       "theta",
                                         "q",     "energy_integral", "distribution_integral"};
  const auto name = [](Complex z, const std::vector<double>& share,
                       const std::vector<std::string>& states) {
    return mode_name(z, Eigen::Map<const VectorXd>(share.data(), std::ssize(share)), states,
                     aircraft_modes());
  };
  CHECK(name(oscillation, {0.02, 0.08, 0.4, 0.5}, wind) == "short period");
  CHECK(name(oscillation, {0.02, 0.5, 0.08, 0.4}, body) == "short period");
  CHECK(name(oscillation, {0.5, 0.4, 0.1, 0}, wind) == "phugoid");
  CHECK(name(oscillation, {0.5, 0.1, 0.4, 0}, wind) == "phugoid");
  CHECK(name(oscillation, {0.5, 0.1, 0.4, 0}, body) == "phugoid");
  CHECK(name(oscillation, {0.5, 0.5, 0, 0, 0, 0}, loop) == "speed and path");
  CHECK(name(oscillation, {0.1, 0, 0, 0, 0.5, 0.4}, loop) == "both integrals");
  CHECK(name(real, {0.9, 0.1, 0, 0}, wind) == "speed");
  CHECK(name(real, {0.9, 0.1, 0, 0}, body) == "speed");
  CHECK(name(real, {0.9, 0.1, 0, 0, 0, 0}, loop) == "speed");
  CHECK(name(real, {0.1, 0.8, 0.1, 0}, body) == "heave");
  CHECK(name(real, {0.1, 0.8, 0.1, 0}, wind) == "flight path");
  CHECK(name(real, {0.1, 0.8, 0.1, 0, 0, 0}, loop) == "flight path");
  CHECK(name(real, {0, 0.1, 0.8, 0.1}, wind) == "pitch");
  CHECK(name(real, {0, 0.1, 0.1, 0.8}, wind) == "pitch rate");
  CHECK(name(real, {0, 0, 0, 0.1, 0.9, 0}, loop) == "energy integral");
  CHECK(name(real, {0, 0, 0, 0.1, 0, 0.9}, loop) == "distribution integral");
  const std::vector<std::string> lateral = {"beta", "p", "r", "phi"};
  CHECK(name(oscillation, {0.48, 0.03, 0.46, 0.03}, lateral) == "dutch roll");
  CHECK(name(oscillation, {0.48, 0.03, 0.46, 0.03}, {"v", "p", "r", "phi"}) == "dutch roll");
  CHECK(name(oscillation, {0.1, 0.4, 0.1, 0.4}, lateral) == "roll-spiral oscillation");
  CHECK(name(real, {0.04, 0.71, 0.11, 0.14}, lateral) == "roll");
  CHECK(name(real, {0.02, 0, 0.24, 0.74}, lateral) == "spiral");
  CHECK(name(real, {0, 0, 1}, {"p", "r", "psi"}) == "heading");
  // A pressure p or an angle phi alone is no aircraft's
  CHECK(name(real, {0.9, 0.1}, {"p", "tank"}) == "p");
  CHECK(name(real, {0.9, 0.1}, {"phi", "tank"}) == "phi");
  // A pair's names are for pairs: the same shares on a real eigenvalue
  CHECK(name(real, {0.02, 0.08, 0.4, 0.5}, wind) == "q + theta");
  // No classical mode: named by the states that take part, largest first
  CHECK(name(oscillation, {0.3, 0.1, 0, 0.1, 0.5, 0}, loop) == "energy_integral + V_err");
  CHECK(name(real, {0.5, 0.4, 0.1}, {"tank", "valve", "pump"}) == "tank + valve");
  CHECK(name(real, {1, 0, 0}, {"tank", "valve", "pump"}) == "tank");
  // No dominant state: a name all the same; no participation: no name
  CHECK(name(real, {0.1, 0.1, 0.1, 0.2 / 3, 0.2 / 3, 0.2 / 3, 0.1, 0.1, 0.1, 0.1, 0.1},
             {"a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k"}) != "");
  CHECK(name(real, {0, 0, 0}, {"tank", "valve", "pump"}).empty());
}

TEST_CASE("planted modes are named as planted") {
  // A fast pitch oscillation and a slow exchange of speed and path, coupled weakly
  MatrixXd A(4, 4);
  A << -0.05, -0.3, 0.01, 0,  //
      0.3, -0.02, 0.02, 0,    //
      0, 0, 0, 1,             //
      0.02, 0.1, -16, -4;
  const Modes m = modes(A, {}, {"V", "gamma", "theta", "q"}, aircraft_modes());
  REQUIRE(m.modes.size() == 4);
  CHECK(m.modes[0].name == "short period");
  CHECK(m.modes[1].name == "short period");
  CHECK(m.modes[2].name == "phugoid");
  CHECK(m.modes[3].name == "phugoid");
  CHECK(modes(A).modes[0].name.empty());  // without state names there is none
}

// ---- block by block ----

TEST_CASE("positions behind an aircraft: zero to the last bit, and the others as if alone") {
  // Heading to position is a Jordan block at zero; the rest is stable but for +0.58.
  MatrixXd A = MatrixXd::Zero(6, 6);
  A.topLeftCorner(3, 3) << -2, 1, 0, -3, -1, 0.5, 0.2, 0.1, 0.58;
  A(3, 2) = 1;    // heading' = rate
  A(4, 3) = 502;  // across' = V heading
  A(5, 0) = 1;    // along'
  const MatrixXd error = epsilon * A.cwiseAbs();
  const Modes alone = modes(A.topLeftCorner(3, 3), error.topLeftCorner(3, 3));
  const Modes all = modes(A, error);
  REQUIRE(alone.verdict == Verdict::unstable);
  CHECK(all.verdict == Verdict::unstable);
  int zeros = 0;
  for (const Mode& m : all.modes) {
    if (m.eigenvalue == 0.0) {
      CHECK(m.error == 0);
      ++zeros;
      continue;
    }
    CHECK(std::ranges::any_of(alone.modes, [&](const Mode& own) {
      return m.eigenvalue == own.eigenvalue && m.error == own.error;
    }));
  }
  CHECK(zeros == 3);
  CHECK(all.spectral_abscissa == alone.spectral_abscissa);
  // Nothing unstable except the zeros: the axis is within the bounds.
  A(2, 2) = -0.58;
  CHECK(modes(A).verdict == Verdict::undecided);
  // An error where there is a zero joins the blocks.
  CHECK(modes(A, MatrixXd::Constant(6, 6, 1e-9)).modes.back().error > 1e-6);
  const Eigen::VectorXcd values = eigenvalues(A);
  CHECK(std::ranges::count(values, std::complex<double>(0)) == 3);
}

TEST_CASE("a permuted block triangular matrix has the eigenvalues of its blocks") {
  Random random(11);
  for (int trial = 0; trial < 200; ++trial) {
    const Index n = whole(random, 1, 4), m = whole(random, 1, 4);
    const MatrixXd a = dense(random, n), b = dense(random, m);
    MatrixXd A = block_diagonal(a, b);
    A.topRightCorner(n, m) = MatrixXd::Constant(n, m, 1e3);
    std::vector<Index> order(std::size_t(n + m));
    std::iota(order.begin(), order.end(), Index{0});
    std::ranges::shuffle(order, random);
    const Modes turned = modes(A(order, order));
    for (const MatrixXd& block : {a, b})
      for (const Mode& own : modes(block).modes)
        CHECK(std::ranges::any_of(turned.modes, [&](const Mode& k) {
          return std::abs(k.eigenvalue - own.eigenvalue) <= k.error + own.error;
        }));
  }
}

struct Blocks {
  MatrixXd A;
  std::vector<std::complex<long double>> eigenvalues;
};

// Of 1 to 6 states above couplings, of five kinds, permuted; eigenvalues from the blocks.
static Blocks coupled_blocks(Random& random, int kind) {
  const Index n = whole(random, 2, 24);
  const MatrixXd same = dense(random, 2);
  const double coupling = kind == 1 ? std::pow(10, uniform(random, -8, 8)) : 1;
  MatrixXd A = coupling * dense(random, n).triangularView<Eigen::StrictlyUpper>().toDenseMatrix();
  Blocks all;
  for (Index at = 0, m = 0; at < n; at += m) {
    m = std::min<Index>(n - at, kind == 2 ? 2 : whole(random, 1, 6));
    A.block(at, at, m, m) = kind == 2 && m == 2 ? same : dense(random, m);
    if (kind == 3 && whole(random, 0, 2) == 0) A.middleRows(at, m).setZero();
    const auto own = precise(A.block(at, at, m, m).cast<long double>());
    all.eigenvalues.insert(all.eigenvalues.end(), own.begin(), own.end());
  }
  if (kind == 4) A = rescaled(A, powers_of_two(random, n, 40));
  all.A = permuted(A, shuffled(random, n));
  return all;
}

TEST_CASE("block triangular: values within their discs, vectors on both sides") {
  Random random(16);
  for (int trial = 0; trial < 400; ++trial) {
    CAPTURE(trial);
    const auto [A, eigenvalues] = coupled_blocks(random, trial % 5);
    const Modes m = modes(A);
    check_modes(A, m);
    check_contained(m, eigenvalues);
    const auto n = double(A.rows());
    for (const Mode& mode : m.modes) {
      const double small = 1e3 * n * epsilon * A.norm();  // with the blocks' own scaling
      CHECK_NEAR((A * mode.right - mode.eigenvalue * mode.right).norm(), 0, small);
      if (!std::isfinite(mode.condition)) continue;
      const Eigen::VectorXcd miss =
          A.transpose() * mode.left.conjugate() - mode.eigenvalue * mode.left.conjugate();
      CHECK_NEAR(miss.norm(), 0, small * mode.left.norm());
      CHECK_NEAR(std::abs(mode.left.dot(mode.right) - 1.0), 0, n * epsilon * mode.left.norm());
    }
  }
}

TEST_CASE("a defective coupling leaves the other modes theirs") {
  // Two equal oscillators, one driving the other, beside a mode that both drive
  MatrixXd A = MatrixXd::Zero(5, 5);
  A.topLeftCorner(2, 2) << 0, 1, -4, -1;
  A.block(2, 2, 2, 2) = A.topLeftCorner(2, 2);
  A(1, 2) = 1;
  A.row(4) << 1, 0, 1, 0, -3;
  const Modes m = modes(A, {}, {"a", "b", "c", "d", "e"});
  check_modes(A, m);
  CHECK(m.modes[0].eigenvalue == -3.0);
  CHECK_NEAR(m.modes[0].condition, 1, 1);
  CHECK(m.modes[0].name == "e");
  CHECK_NEAR(m.modes[0].participation[4], 1, 1e-14);
  for (std::size_t i = 1; i < 5; ++i) {
    CHECK_FALSE(m.modes[i].determined);
    CHECK(m.modes[i].error < 1e-13);  // that of the oscillator alone
  }
}

TEST_CASE("an axis that is clear decides where no disc does") {
  // Grcar: subdiagonal -1, diagonal and three superdiagonals 1; eigenvalues of condition 1e10 and
  // more
  const auto grcar = [](Index n) {
    return filled(n, [](Index i, Index j) { return i == j + 1 ? -1.0 : j >= i && j <= i + 3; });
  };
  const Modes m = modes(grcar(100));
  CHECK(m.modes.back().error > 1);
  CHECK(m.verdict == Verdict::unstable);
  CHECK(modes(-grcar(20)).verdict != Verdict::unstable);
  // A stable one that is far from normal, known from its triangle.
  Random random(12);
  const MatrixXd Q = algebra::orthogonal(dense(random, 12));
  MatrixXd T = dense(random, 12).triangularView<Eigen::StrictlyUpper>();
  T *= 2;
  T.diagonal().setConstant(-2);
  CHECK(modes(Q * T * Q.transpose()).verdict == Verdict::stable);
  T.diagonal()[5] = 2;
  CHECK(modes(Q * T * Q.transpose()).verdict == Verdict::unstable);
}

TEST_CASE("balancing is left out where it makes an eigenvalue worse") {
  // Frank: its smallest eigenvalues are ill-conditioned, and balancing makes them more so [67]
  const MatrixXd frank =
      filled(12, [](Index i, Index j) { return j + 1 < i ? 0.0 : double(12 - std::max(i, j)); });
  double worst = 0;
  for (const Mode& m : modes(frank).modes) worst = std::max(worst, m.condition);
  CHECK(worst < 1e8);
  // The eigenvalues come in pairs of product one.
  const Modes m = modes(frank);
  for (std::size_t i = 0; i < 6; ++i) {
    const auto [small, large] = std::pair(m.modes[i], m.modes[11 - i]);
    const double product = std::abs(small.eigenvalue * large.eigenvalue);
    CHECK_NEAR(product, 1,
               small.error * std::abs(large.eigenvalue) + large.error * std::abs(small.eigenvalue) +
                   1e-12);
  }
}

}  // namespace modes_test
