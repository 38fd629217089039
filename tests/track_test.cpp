#include "sweep/track.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "linearize/eigenvalues.hpp"
#include "linearize/modes.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using Spectrum = std::vector<Complex>;
using Matrices = std::function<MatrixXd(double)>;

namespace track_test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double trusted = TrackOptions{}.trusted;

MatrixXd dense(Random& random, Index n, double size) {
  return MatrixXd::NullaryExpr(n, n, [&] { return uniform(random, -size, size); });
}

// A well-conditioned basis of states whose units are up to 1e8 apart.
MatrixXd similarity(Random& random, Index n) {
  MatrixXd T = algebra::orthogonal(dense(random, n, 1));
  T += dense(random, n, 0.3);
  for (Index i = 0; i < n; ++i) T.row(i) *= std::pow(10, uniform(random, -4, 4));
  return T;
}

MatrixXd block_diagonal(const std::vector<MatrixXd>& blocks) {
  Index n = 0;
  for (const MatrixXd& b : blocks) n += b.rows();
  MatrixXd A = MatrixXd::Zero(n, n);
  Index at = 0;
  for (const MatrixXd& b : blocks) {
    A.block(at, at, b.rows(), b.cols()) = b;
    at += b.rows();
  }
  return A;
}

MatrixXd number(double value) { return MatrixXd::Constant(1, 1, value); }

MatrixXd pair(double re, double im, double shape = 1) {  // the shape affects the eigenvectors only
  return (MatrixXd(2, 2) << re, im * shape, -im / shape, re).finished();
}

MatrixXd in_basis(const MatrixXd& T, const MatrixXd& D) { return T * D * algebra::inverse(T); }

Spectrum spectrum(const MatrixXd& A) {
  const Eigen::VectorXcd lambda = eigenvalues(A);
  return {lambda.begin(), lambda.end()};
}

// Matches planted with computed values: the nearest two first, each once.
std::vector<int> find(const Spectrum& planted, const Spectrum& in) {
  std::vector<int> at(planted.size(), -1);
  std::vector<char> taken(in.size(), false);
  for (std::size_t round = 0; round < planted.size(); ++round) {
    double least = infinity;
    std::size_t best_i = 0, best_j = 0;
    for (std::size_t i = 0; i < planted.size(); ++i)
      for (std::size_t j = 0; j < in.size(); ++j) {
        const double miss = std::abs(planted[i] - in[j]);
        if (at[i] >= 0 || taken[j] || miss >= least) continue;
        least = miss;
        best_i = i;
        best_j = j;
      }
    at[best_i] = int(best_j);
    taken[best_j] = true;
  }
  return at;
}

Spectrum ordered(const Spectrum& values, const std::vector<int>& order) {
  Spectrum in_order;
  for (const int i : order) in_order.push_back(values[std::size_t(i)]);
  return in_order;
}

Spectrum reals(const VectorXd& v) { return {v.begin(), v.end()}; }

double weakest(const Link& link) { return *std::ranges::min_element(link.confidence); }

// Outcome of links with known truth.
struct Score {
  int links = 0, low = 0, wrong = 0, wrong_trusted = 0;

  void count(const Link& link, const std::vector<int>& truth) {
    for (std::size_t i = 0; i < truth.size(); ++i) {
      ++links;
      low += link.confidence[i] < trusted;
      wrong += link.to[i] != truth[i];
      wrong_trusted += link.to[i] != truth[i] && link.confidence[i] >= trusted;
    }
  }
};

// The two ends of a path whose eigenvalues are planted: the modes are numbered as planted.
struct Planted {
  Matrices A;  // of the share of the way, 0 .. 1
  Spectrum last, next;
  std::vector<int> truth;

  Planted(Matrices path, const Spectrum& from, const Spectrum& to)
      : A(std::move(path)), last(spectrum(A(0))), next(spectrum(A(1))), truth(find(to, next)) {
    last = ordered(last, find(from, last));
  }
  Link once() const { return link(A(0), last, last, A(1), next); }
  Link refined(const TrackOptions& options = {}) const {
    return link(
        A(0), last, last, A(1), next, [&](double s) { return A(s); }, options);
  }
};

// sI - A's adjugate in partial fractions: P_i = prod (A - l_k I)/(l_i - l_k), no eigenvectors used.
Eigen::MatrixXcd projector(const MatrixXd& A, const Spectrum& lambda, std::size_t i) {
  const Eigen::MatrixXcd I = Eigen::MatrixXcd::Identity(A.rows(), A.cols());
  Eigen::MatrixXcd P = I;
  for (std::size_t k = 0; k < lambda.size(); ++k)
    if (k != i) P = (P * (A - lambda[k] * I) / (lambda[i] - lambda[k])).eval();
  return P;
}

// Pairs keep their side; the larger of two real ones belongs to the positive imaginary part.
void by_convention(const Spectrum& at, const Spectrum& next, std::vector<int>& to) {
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t k = 0; k < at.size(); ++k) {
      const Complex a = next[std::size_t(to[i])], b = next[std::size_t(to[k])];
      const bool was_pair = at[i].imag() > 0 && at[k] == std::conj(at[i]);
      const bool is_pair = a.imag() > 0 && b == std::conj(a);
      const bool flips = was_pair && a.imag() < 0 && b == std::conj(a);
      const bool splits = was_pair && a.imag() == 0 && b.imag() == 0 && a.real() < b.real();
      const bool joins =
          is_pair && at[i].imag() == 0 && at[k].imag() == 0 && at[i].real() < at[k].real();
      if (flips || splits || joins) std::swap(to[i], to[k]);
    }
}

// Truth from small steps only: from `first`, the nearest at each.
Spectrum walked(const Matrices& A, Spectrum first, int steps) {
  for (int k = 1; k <= steps; ++k) {
    const Spectrum next = spectrum(A(double(k) / steps));
    std::vector<int> to = find(first, next);
    by_convention(first, next, to);
    first = ordered(next, to);
  }
  return first;
}

std::vector<int> identity(std::size_t n) {
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

}  // namespace

TEST_CASE("position: confidence is 1 - 3 d/s") {
  const Spectrum predicted = {-1.0, {-2, 3}, {-2, -3}, -5.0};
  const Spectrum next = {-5.5, {-2, -3.5}, {-2, 3.5}, -1.2};
  std::vector<int> to(4);
  std::vector<double> confidence(4);
  REQUIRE(link_by_position(predicted, next, to, confidence));
  CHECK(to == std::vector<int>{3, 2, 1, 0});
  CHECK_NEAR(confidence[0], 1 - 3 * 0.2 / std::hypot(1, 3.5), 1e-15);
  CHECK_NEAR(confidence[1], 1 - 3 * 0.5 / std::hypot(0.8, 3), 1e-15);
  CHECK_NEAR(confidence[2], confidence[1], 0);
  CHECK_NEAR(confidence[3], 1 - 3 * 0.5 / 3.8, 1e-15);
}

TEST_CASE("position: what leaves doubt is refused") {
  std::vector<int> to(2);
  std::vector<double> confidence(2);
  const auto sure = [&](const Spectrum& predicted, const Spectrum& next) {
    return link_by_position(predicted, next, to, confidence);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(sure({0.0, 3.0}, {0.99, 3.0}));
  CHECK_FALSE(sure({0.0, 3.0}, {1.0, 3.0}));          // a third of the way, no nearer
  CHECK_FALSE(sure({0.0, 0.5}, {0.2, 9.0}));          // one place for two
  CHECK_FALSE(sure({1.0, 1.0}, {1.0, 1.0}));          // which is which
  CHECK_FALSE(sure({{0, 1}, {0, -1}}, {0.0, 9.0}));   // a pair stays a pair,
  CHECK_FALSE(sure({0.0, 9.0}, {{0, 1}, {0, -1}}));   // a real one real,
  CHECK_FALSE(sure({0.1, 9.0}, {{0.1, 1e-9}, 9.0}));  // however near
  CHECK_FALSE(sure({nan, 1.0}, {0.0, 1.0}));
  CHECK_FALSE(sure({0.0, 1.0}, {0.0, nan}));
  CHECK_FALSE(sure({0.0, infinity}, {0.0, infinity}));
  CHECK_THROWS_AS(sure({0.0}, {0.0}), std::invalid_argument);
}

TEST_CASE("position: a crossing that was predicted is no certainty") {
  const Spectrum last = {-1.0, 1.0, {-5, 1}, {-5, -1}}, predicted = {1.0, -1.0, {-5, 2}, {-5, -2}};
  std::vector<int> to(4);
  std::vector<double> confidence(4);
  CHECK(link_by_position(predicted, predicted, to, confidence));
  CHECK_FALSE(link_by_position(last, predicted, predicted, to, confidence));
  const Spectrum shifted = {2.0, 4.0, {-5, 2}, {-5, -2}};  // two that go together
  CHECK(link_by_position(last, shifted, shifted, to, confidence));
  CHECK_THROWS_AS(link_by_position(Spectrum{1.0}, last, last, to, confidence),
                  std::invalid_argument);
}

TEST_CASE("no mode and one mode") {
  CHECK(link_by_position({}, {}, {}, {}));
  CHECK(link(MatrixXd(0, 0), {}, {}, MatrixXd(0, 0), {}).to.empty());
  const Spectrum a = {-1.0}, b = {70.0};
  const Link one = link(number(-1), a, a, number(70), b);
  CHECK(one.to == std::vector<int>{0});
  CHECK_NEAR(one.confidence[0], 1.0, 0);
}

TEST_CASE("the assignment has the least total cost of all permutations") {
  Random random(5);
  for (int t = 0; t < trials(100); ++t) {
    const MatrixXd T = dense(random, 5, 1) + 2 * MatrixXd::Identity(5, 5);
    const VectorXd p = uniform(random, 5, -3, 0), q = uniform(random, 5, -3, 0);
    const MatrixXd A = in_basis(T, MatrixXd(p.asDiagonal()));
    const MatrixXd B = in_basis(T + dense(random, 5, 0.7), MatrixXd(q.asDiagonal()));
    const Spectrum a = reals(p), b = reals(q);
    const auto cost = [&](std::size_t i, std::size_t j) {
      double gap = infinity;
      for (std::size_t k = 0; k < 5; ++k)
        if (k != i) gap = std::min(gap, std::abs(a[i] - a[k]));
      const double d = std::abs(a[i] - b[j]);
      const double alike = (projector(A, a, i) * projector(B, b, j)).trace().real();
      return 1 - std::clamp(alike, 0.0, 1.0) + d / (d + gap);
    };
    MatrixXd costs(5, 5);
    for (std::size_t i = 0; i < 5; ++i)
      for (std::size_t j = 0; j < 5; ++j) costs(Index(i), Index(j)) = cost(i, j);
    const auto total = [&](const std::vector<int>& to) {
      double sum = 0.0;
      for (Index i = 0; i < 5; ++i) sum += costs(i, to[std::size_t(i)]);
      return sum;
    };
    double least = infinity;
    std::vector<int> to = identity(5);
    do least = std::min(least, total(to));
    while (std::ranges::next_permutation(to).found);
    CHECK_NEAR(total(link(A, a, a, B, b).to), least, 1e-8);
  }
}

TEST_CASE("uncoupled modes cross in one coarse step, in any units") {
  Random random(1);
  Score score;
  for (int t = 0; t < trials(2000); ++t) {
    const bool two_pairs = t % 2;
    const MatrixXd T = similarity(random, 6);
    const auto build = [&](const VectorXd& p) {
      const MatrixXd last =
          two_pairs ? pair(p[1], p[6]) : block_diagonal({number(p[1]), number(p[2])});
      return in_basis(T,
                      block_diagonal({pair(p[0], p[5], p[7]), number(p[3]), number(p[4]), last}));
    };
    const auto values = [&](const VectorXd& p) -> Spectrum {
      if (two_pairs) return {{p[0], p[5]}, {p[0], -p[5]}, p[3], p[4], {p[1], p[6]}, {p[1], -p[6]}};
      return {{p[0], p[5]}, {p[0], -p[5]}, p[3], p[4], p[1], p[2]};
    };
    VectorXd p(8), q(8);
    p << uniform(random, 5, -3, 0), uniform(random, 3, 0.3, 2);
    q << uniform(random, 5, -3, 0), uniform(random, 3, 0.3, 2);
    const Planted path([&](double s) { return build((1 - s) * p + s * q); }, values(p), values(q));
    score.count(path.once(), path.truth);
  }
  CHECK(score.wrong == 0);
  CHECK(score.low == 0);
}

TEST_CASE("crossings while the eigenvectors turn: flagged in one step, resolved by halving") {
  Random random(2);
  for (const double size : {0.1, 0.5}) {
    Score once, refined;
    for (int t = 0; t < trials(300); ++t) {
      const MatrixXd T = similarity(random, 6), K = dense(random, 6, size),
                     I = MatrixXd::Identity(6, 6);
      const MatrixXd skew = 0.5 * (K - K.transpose());
      const VectorXd p = uniform(random, 6, -3, 0), q = uniform(random, 6, -3, 0);
      const Matrices A = [&](double s) {  // turned by Cayley's rotation
        const MatrixXd R = algebra::inverse(MatrixXd(I - s * skew)) * (I + s * skew);
        return in_basis(T * R, MatrixXd(((1 - s) * p + s * q).asDiagonal()));
      };
      const Planted path(A, reals(p), reals(q));
      once.count(path.once(), path.truth);
      refined.count(path.refined(), path.truth);
    }
    CHECK(once.wrong_trusted == 0);
    CHECK(once.low > once.links / 2);
    CHECK(refined.wrong == 0);
    CHECK(refined.low == 0);
  }
}

TEST_CASE("veering keeps the branch where halving resolves the gap, else it is a crossing") {
  Random random(3);
  const auto modes_veering = [&](Index n, double gap, bool crosses) {
    const MatrixXd T = similarity(random, n);
    const double start = uniform(random, -1.2, -0.8);
    const auto radius = [=](double s) { return std::hypot(start + 2 * s, gap); };
    const Matrices A = [=](double s) {
      const double x = start + 2 * s;
      std::vector<MatrixXd> blocks = {(MatrixXd(2, 2) << x, gap, gap, -x).finished()};
      if (n > 2) blocks.push_back(pair(-1, 1 + s));
      if (n > 4) blocks.push_back(block_diagonal({number(-2), number(-3 + s / 2)}));
      return in_basis(T, block_diagonal(blocks));
    };
    Spectrum from = {-radius(0), radius(0)}, to = {-radius(1), radius(1)};
    if (crosses) std::swap(to[0], to[1]);
    if (n > 2)
      from.insert(from.end(), {{-1, 1}, {-1, -1}}), to.insert(to.end(), {{-1, 2}, {-1, -2}});
    if (n > 4) from.insert(from.end(), {-2, -3}), to.insert(to.end(), {-2, -2.5});
    return Planted(A, from, to);
  };
  for (const Index n : {2, 4, 6})
    for (const double gap : {0.3, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-7, 0.0}) {
      CAPTURE(n);
      CAPTURE(gap);
      Score score;
      for (int t = 0; t < trials(50); ++t) {
        const Planted path = modes_veering(n, gap, gap < 5e-4);
        score.count(path.refined(), path.truth);
      }
      CHECK(score.wrong == 0);
      CHECK(score.low == 0);
    }
  // without intermediate points, a veering this wide is not accepted as a crossing
  CHECK(weakest(modes_veering(6, 1e-2, false).once()) < trusted);
}

TEST_CASE("any path: what is trusted is what small steps find") {
  Random random(4);
  Score once, refined;
  for (const double size : {0.3, 2.0})
    for (int t = 0; t < trials(50); ++t) {
      const MatrixXd A0 = dense(random, 6, 1), K = dense(random, 6, size);
      const Matrices A = [&](double s) -> MatrixXd { return A0 + s * K; };
      const Spectrum first = spectrum(A0);
      const Planted path(A, first, walked(A, first, 1000));
      once.count(path.once(), path.truth);
      refined.count(path.refined(), path.truth);
    }
  CHECK(once.wrong_trusted == 0);
  CHECK(once.wrong > once.links / 10);  // the steps are coarse
  CHECK(refined.wrong_trusted == 0);
  CHECK(50 * refined.low < refined.links);
}

TEST_CASE("one to one, and conjugates stay together, however far apart the matrices are") {
  Random random(11);
  for (int t = 0; t < trials(300); ++t) {
    const Index n = 1 + t % 16;
    const MatrixXd A = dense(random, n, 1), B = dense(random, n, 1);
    const Spectrum a = spectrum(A), b = spectrum(B);
    const Link one = link(A, a, a, B, b);
    CHECK(one.to == link(A, a, a, B, b).to);
    std::vector<int> taken = one.to;
    std::ranges::sort(taken);
    CHECK(taken == identity(a.size()));
    std::vector<int> kept = one.to;
    by_convention(a, b, kept);
    CHECK(kept == one.to);
    for (std::size_t i = 0; i < a.size(); ++i) {
      CHECK(one.confidence[i] >= 0);
      CHECK(one.confidence[i] <= 1);
      for (std::size_t k = 0; k < a.size(); ++k) {
        if (a[i].imag() == 0 || a[k] != std::conj(a[i])) continue;
        const Complex plus = b[std::size_t(one.to[i])], minus = b[std::size_t(one.to[k])];
        CHECK((minus == std::conj(plus) || (plus.imag() == 0 && minus.imag() == 0)));
        CHECK_NEAR(one.confidence[i], one.confidence[k], 0);
      }
    }
  }
}

TEST_CASE("pairs merge and split, reals join") {
  // [0 1; c 0] has ±√c
  Random random(6);
  for (int t = 0; t < trials(300); ++t) {
    const MatrixXd T = similarity(random, 6);
    const double c0 = uniform(random, -1, -0.01), c1 = uniform(random, 0.01, 1);
    const Matrices A = [&](double s) {
      const double c = (1 - s) * c0 + s * c1;
      const MatrixXd merging = (MatrixXd(2, 2) << 0, 1, c, 0).finished();
      return in_basis(
          T, block_diagonal({merging, pair(-1, 0.5 + s), number(-0.1 + 0.2 * s), number(2)}));
    };
    const double w = std::sqrt(-c0), r = std::sqrt(c1);
    const Spectrum a = {{0, w}, {0, -w}, {-1, 0.5}, {-1, -0.5}, -0.1, 2};
    const Spectrum b = {r, -r, {-1, 1.5}, {-1, -1.5}, 0.1, 2};
    for (const bool back : {false, true}) {
      const Planted path([&](double s) { return A(back ? 1 - s : s); }, back ? b : a, back ? a : b);
      for (const Link& link : {path.once(), path.refined()}) {
        CHECK(link.to == path.truth);
        CHECK(weakest(link) >= trusted);
      }
    }
  }
}

TEST_CASE("merged and split again, a pair is itself" * thorough) {
  Random random(7);
  const MatrixXd T = similarity(random, 4);
  const Matrices A = [&](double s) {
    const double c = std::cos(2 * std::numbers::pi * s);
    return in_basis(T, block_diagonal({(MatrixXd(2, 2) << 0, 1, c, 0).finished(), pair(-1, 1)}));
  };
  const Spectrum a = {1, -1, {-1, 1}, {-1, -1}};
  const Planted path(A, a, a);
  for (const int halvings : {1, 3, 12}) {
    Spectrum at = path.last;
    const int steps = 1 << halvings;
    double least = 1.0;
    for (int k = 0; k < steps; ++k) {
      const MatrixXd from = A(double(k) / steps), to = A(double(k + 1) / steps);
      const Spectrum next = spectrum(to);
      const Link one = link(from, at, at, to, next);
      least = std::min(least, weakest(one));
      at = ordered(next, one.to);
    }
    CHECK(find(at, path.last) == identity(4));
    CHECK(least >= trusted);
  }
}

TEST_CASE("once around an exceptional point two pairs change places, beside it they do not") {
  // [c 1; z c] has c ± √z; as a real matrix, with the conjugates
  Random random(8);
  for (int t = 0; t < trials(100); ++t) {
    const MatrixXd T = similarity(random, 4);
    const bool around = t % 2;
    const double radius = uniform(random, 0.1, 0.5), phase = uniform(random, 0, 6),
                 turn = t % 4 < 2 ? 1 : -1;
    const Complex c(-1, 2), centre = around ? 0.0 : 2 * radius;
    const auto z = [&](double s) {
      return centre + std::polar(radius, phase + turn * 2 * std::numbers::pi * s);
    };
    const Matrices A = [&](double s) {
      const Eigen::Matrix2cd C = (Eigen::Matrix2cd() << c, 1, z(s), c).finished();
      MatrixXd real(4, 4);
      real << C.real(), -C.imag(), C.imag(), C.real();
      return in_basis(T, real);
    };
    const Complex plus = c + std::sqrt(z(0)), minus = c - std::sqrt(z(0));
    const Spectrum start = {plus, minus, std::conj(plus), std::conj(minus)};
    const int steps = 3;
    std::vector<int> now = identity(4);
    Spectrum at = start;
    double least = 1.0;
    for (int k = 0; k < steps; ++k) {
      const auto share = [&](double s) { return (k + s) / steps; };
      const MatrixXd from = A(share(0)), to = A(share(1));
      const Spectrum next = spectrum(to);
      const Link one = link(from, at, at, to, next, [&](double s) { return A(share(s)); });
      least = std::min(least, weakest(one));
      at = ordered(next, one.to);
    }
    CHECK(least >= trusted);
    CHECK(find(at, start) == (around ? std::vector<int>{1, 0, 3, 2} : identity(4)));
  }
}

TEST_CASE("units and order do not matter") {
  Random random(9);
  for (int t = 0; t < trials(100); ++t) {
    const MatrixXd A = dense(random, 5, 1), B = A + dense(random, 5, 0.2);
    const VectorXd unit =
        uniform(random, 5, -6, 6).unaryExpr([](double x) { return std::pow(10, x); });
    const auto in_units = [&](const MatrixXd& M) -> MatrixXd {
      return unit.asDiagonal() * M * unit.cwiseInverse().asDiagonal();
    };
    const Spectrum a = spectrum(A), b = spectrum(B);
    const Link one = link(A, a, a, B, b), scaled = link(in_units(A), a, a, in_units(B), b);
    CHECK(scaled.to == one.to);
    std::vector<int> order = identity(5);
    std::ranges::shuffle(order, random);
    const Spectrum mixed = ordered(b, order), modes = ordered(a, order);
    const Link to_mixed = link(A, a, a, B, mixed), of_mixed = link(A, modes, modes, B, b);
    for (std::size_t i = 0; i < 5; ++i) {
      CHECK_NEAR(scaled.confidence[i], one.confidence[i], 1e-9);
      CHECK(order[std::size_t(to_mixed.to[i])] == one.to[i]);
      CHECK(of_mixed.to[i] == one.to[std::size_t(order[i])]);
      CHECK_NEAR(of_mixed.confidence[i], one.confidence[std::size_t(order[i])], 1e-9);
    }
  }
}

TEST_CASE("equal eigenvalues go on by index, and as one where they stay equal") {
  const MatrixXd I = MatrixXd::Identity(3, 3);
  const Spectrum ones(3, 1.0);
  const Link same = link(I, ones, ones, I, ones);
  CHECK(same.to == identity(3));
  CHECK_NEAR(weakest(same), 1.0, 0);
  // two integrators in a row stay defective all the way
  const auto integrators = [](double pole) {
    MatrixXd A = MatrixXd::Zero(3, 3);
    A(0, 1) = A(1, 2) = 1;
    A(2, 2) = pole;
    return A;
  };
  const Spectrum a = {0.0, 0.0, -1.0}, b = {-1.1, 0.0, 0.0};
  const Link chain = link(integrators(-1), a, a, integrators(-1.1), b);
  CHECK(chain.to == std::vector<int>{1, 2, 0});
  CHECK(weakest(chain) >= trusted);
}

TEST_CASE("at an exactly defective point the pair is known, its members are not") {
  const auto block = [](double c) { return (MatrixXd(2, 2) << 0, 1, c, 0).finished(); };
  const Spectrum zero = {0.0, 0.0}, split = {-0.1, 0.1}, complex = {{0, -0.1}, {0, 0.1}};
  CHECK(link(block(-0.01), complex, complex, block(0), zero).confidence[0] == 1.0);
  CHECK(link(block(0), zero, zero, block(-0.01), complex).confidence[0] == 1.0);
  CHECK(weakest(link(block(0), zero, zero, block(0.01), split)) < trusted);
  CHECK(weakest(link(block(0.01), split, split, block(0), zero)) < trusted);
}

TEST_CASE("refinement keeps to its limits, and to what there is between") {
  Random random(10);
  const MatrixXd A = dense(random, 6, 1), B = A + dense(random, 6, 2);
  const Spectrum a = spectrum(A), b = spectrum(B);
  const Link direct = link(A, a, a, B, b);
  REQUIRE(weakest(direct) < trusted);
  int calls = 0;
  const auto count = [&](const std::function<std::optional<MatrixXd>(double)>& path,
                         const TrackOptions& options) {
    calls = 0;
    const auto between = [&](double s) {
      CHECK(s > 0);
      CHECK(s < 1);
      ++calls;
      return path(s);
    };
    return link(A, a, a, B, b, between, options);
  };
  const auto straight = [&](double s) { return std::optional<MatrixXd>(A + s * (B - A)); };
  const auto kept = [&](const Link& link) {
    return link.to == direct.to && link.confidence == direct.confidence;
  };
  SUBCASE("trusted where it can be halved") {
    CHECK(weakest(count(straight, {})) >= trusted);
    CHECK(calls > 2);
  }
  SUBCASE("no depth") {
    CHECK(kept(count(straight, {.max_depth = 0})));
    CHECK(calls == 0);
  }
  SUBCASE("few matrices") {
    static_cast<void>(count(straight, {.max_between = 2}));
    CHECK(calls == 2);
  }
  SUBCASE("no depth is trusted more than it can be") {
    const Link strict = count(straight, {.trusted = 2, .max_depth = 3});
    CHECK(calls == 7);
    CHECK(weakest(strict) < trusted);
  }
  SUBCASE("nothing between") {
    CHECK(kept(count([](double) { return std::optional<MatrixXd>(); }, {})));
    CHECK(calls == 1);
    CHECK(kept(link(A, a, a, B, b, {}, {})));
  }
  SUBCASE("not finite between") {
    CHECK(kept(count([](double) { return MatrixXd::Constant(6, 6, infinity).eval(); }, {})));
  }
  SUBCASE("another size between") {
    CHECK_THROWS_AS(count([](double) { return MatrixXd::Zero(5, 5).eval(); }, {}),
                    std::invalid_argument);
  }
}

TEST_CASE("the caller's mistakes") {
  const MatrixXd A = pair(-1, 1), row = MatrixXd::Zero(1, 2), three = MatrixXd::Zero(3, 3);
  const Spectrum a = {{-1, -1}, {-1, 1}}, one = {-1.0}, alone = {{-1, 1}, -1.0},
                 off = {infinity, 1.0};
  CHECK_THROWS_AS(static_cast<void>(link(row, a, a, A, a)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, a, a, three, a)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, one, a, A, a)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, a, one, A, a)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, a, a, A, one)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, alone, a, A, a)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, a, a, A, alone)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(A, a, off, A, a)), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(link(infinity * A, a, a, A, a)), std::invalid_argument);
  const auto to_itself = [](int n) {
    const VectorXd rates = VectorXd::LinSpaced(n, -n, -1);
    const MatrixXd D = rates.asDiagonal();
    const Spectrum same(rates.begin(), rates.end());
    return link(D, same, same, D, same).to.size();
  };
  CHECK(to_itself(16) == 16);
  CHECK_THROWS_AS(static_cast<void>(to_itself(17)), std::invalid_argument);
}

// ---- many points at once, and two modes that meet ----

namespace {

// Modes along a line as in a sweep, mode by mode; their identity is planted.
struct Line {
  std::vector<double> at;
  std::vector<std::vector<double>> re, im;

  std::size_t size() const { return at.size(); }
  Spectrum modes(std::size_t k) const {
    Spectrum z;
    for (std::size_t i = 0; i < re.size(); ++i) z.emplace_back(re[i][k], im[i][k]);
    return z;
  }
  double ratio(std::size_t k) const { return (at[k] - at[k - 1]) / (at[k - 1] - at[k - 2]); }
  Spectrum straight_on(std::size_t k) const {
    const Spectrum last = modes(k - 1), before = modes(k - 2);
    Spectrum z = last;
    for (std::size_t i = 0; i < z.size(); ++i) z[i] += ratio(k) * (last[i] - before[i]);
    return z;
  }
  // Of `length` points from k on, how many keep their links.
  std::size_t stay(IsolatedModes& isolated, std::size_t k, std::size_t length) const {
    std::vector<const double*> x, y;
    for (std::size_t i = 0; i < re.size(); ++i) {
      x.push_back(&re[i][k]);
      y.push_back(&im[i][k]);
    }
    std::vector<double> ratios;
    for (std::size_t m = 0; m < length; ++m) ratios.push_back(ratio(k + m));
    isolated.assign(modes(k - 1));
    return isolated.stay(x.data(), y.data(), ratios);
  }
};

using Branch = std::function<Spectrum(double s)>;  // one mode or two

// A real mode, a pair, or two on the square root of a line or of a hyperbola: they merge and part,
// veer or cross.
Branch random_branch(Random& random, std::size_t room) {
  const double a = uniform(random, -4, 0), b = uniform(random, -1, 1), bend = uniform(random, 1, 9);
  const double w = uniform(random, 0.1, 3), at = uniform(random, 0, 1);
  const auto middle = [=](double s) { return a + b * std::sin(bend * s); };
  const std::size_t kind = random() % 5;
  if (room == 1 || kind == 0) return [=](double s) { return Spectrum{middle(s)}; };
  if (kind == 1)
    return [=](double s) {
      const Complex z(middle(s), w + 0.5 * w * std::cos(bend * s + w));
      return Spectrum{z, std::conj(z)};
    };
  if (kind == 2)
    return [=](double s) {
      const Complex root = std::sqrt(Complex(w * (s - at)));
      return Spectrum{middle(s) + root, middle(s) - root};
    };
  const double gap = kind == 3 ? std::pow(10, uniform(random, -4, -0.5)) : 0.0;
  return [=](double s) {
    const double d = gap > 0 ? std::hypot(s - at, gap) : s - at;
    return Spectrum{middle(s) + w * d, middle(s) - w * d};
  };
}

// Even, geometric or arbitrary steps, from coarse to fine.
std::vector<double> random_coordinates(Random& random, std::size_t count) {
  const double size = std::pow(10, uniform(random, -4, -1)), factor = uniform(random, 0.9, 1.1);
  const std::size_t kind = random() % 3;
  std::vector<double> at{uniform(random, 0, 1)};
  for (double step = size; at.size() < count;) {
    at.push_back(at.back() + step);
    if (kind == 1) step *= factor;
    if (kind == 2) step = size * uniform(random, 0.2, 2);
  }
  return at;
}

Line random_line(Random& random, std::size_t n, std::size_t count) {
  Line line{random_coordinates(random, count), {}, {}};
  while (line.re.size() < n) {
    const std::size_t first = line.re.size();
    const Branch branch = random_branch(random, n - first);
    for (const double s : line.at) {
      const Spectrum z = branch(s);
      line.re.resize(first + z.size());
      line.im.resize(first + z.size());
      for (std::size_t i = 0; i < z.size(); ++i) {
        line.re[first + i].push_back(z[i].real());
        line.im[first + i].push_back(z[i].imag());
      }
    }
  }
  return line;
}

// Up to 1 the point k satisfies the chapter's conditions, its line coming from point `from`: each
// mode within an eighth of its distance to the nearest other, and off the straight line by d with 3
// d < 3/4 of that distance - d.
double strain(const Line& line, std::size_t from, std::size_t k) {
  const Spectrum centre = line.modes(from), here = line.modes(k), foreseen = line.straight_on(k);
  double most = 0.0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    double gap = infinity;
    for (std::size_t j = 0; j < here.size(); ++j)
      if (j != i) gap = std::min(gap, std::abs(centre[i] - centre[j]));
    most = std::max({most, 8 * std::abs(here[i] - centre[i]) / gap,
                     16.0 / 3 * std::abs(here[i] - foreseen[i]) / gap});
  }
  return most;
}

bool same_kinds(const Spectrum& a, const Spectrum& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if ((a[i].imag() == 0) != (b[i].imag() == 0)) return false;
  return true;
}

// The points kept, compared with link_by_position().
struct Stays {
  int points = 0, refused = 0, swapped = 0, surer = 0, not_certain = 0, too_short = 0, too_long = 0;

  void count(const Line& line, std::size_t k, std::size_t length, IsolatedModes& isolated) {
    const std::size_t n = line.re.size(), stays = line.stay(isolated, k, length);
    points += int(stays);
    too_long += stays > std::min(length, IsolatedModes::longest);
    for (std::size_t m = 0; m < stays; ++m) {
      std::vector<int> to(n);
      std::vector<double> sure(n);
      refused += !link_by_position(line.modes(k + m - 1), line.straight_on(k + m),
                                   line.modes(k + m), to, sure);
      swapped += to != identity(n);
      too_long += strain(line, k - 1, k + m) > 1 + 1e-9;
      for (std::size_t i = 0; i < n; ++i) {
        const double rounding = 1e-12 + 1e-14 / isolated.gap[i];  // of places that are below 8
        surer += !(isolated.confidence(i, m) <= sure[i] + rounding);
        not_certain += isolated.certain(m) && !(isolated.confidence(i, m) >= 1 - 0.5 / 255);
      }
    }
    if (stays < std::min(length, IsolatedModes::longest))
      too_short += strain(line, k - 1, k + stays) < 1 - 1e-9;
  }
};

}  // namespace

TEST_CASE("isolated: what stays is what position links, no surer") {
  Random random(12);
  for (std::size_t n = 1; n <= 8; ++n) {
    CAPTURE(n);
    Stays all;
    int steps = 0;
    IsolatedModes isolated;
    for (int t = 0; t < trials(200); ++t) {
      const Line line = random_line(random, n, 160);
      for (std::size_t k = 2; k < line.size(); k += 1 + random() % 30, ++steps) {
        const std::size_t length = std::min(random() % 100, line.size() - k);
        if (same_kinds(line.modes(k - 2), line.modes(k - 1))) all.count(line, k, length, isolated);
      }
    }
    CHECK(all.refused == 0);
    CHECK(all.swapped == 0);
    CHECK(all.surer == 0);
    CHECK(all.not_certain == 0);
    CHECK(all.too_short == 0);
    CHECK(all.too_long == 0);
    CHECK(all.points > 2 * steps);
  }
}

namespace {

// Modes at rest at these places; `points` of them.
Line at_rest(const Spectrum& places, std::size_t points) {
  Line line;
  for (std::size_t k = 0; k < points; ++k) line.at.push_back(double(k));
  for (const Complex& z : places) {
    line.re.emplace_back(points, z.real());
    line.im.emplace_back(points, z.imag());
  }
  return line;
}

const Spectrum three_modes = {-3.0, {-1, 2}, {-1, -2}};

}  // namespace

TEST_CASE("isolated: it ends where a mode leaves its place or another goes past it") {
  IsolatedModes isolated;
  constexpr std::size_t from = 2, bend = 12;
  const auto stays = [&](std::size_t mode, Complex by) {
    Line line = at_rest(three_modes, 40);
    for (std::size_t k = bend; k < line.size(); ++k) {
      line.re[mode][k] += by.real();
      line.im[mode][k] += by.imag();
    }
    return line.stay(isolated, from, 38);
  };
  const double g = std::sqrt(8);  // of the real one to the pair
  CHECK(stays(0, 0) == 38);
  CHECK(stays(0, 0.124 * g) == 38);
  CHECK(stays(0, 0.126 * g) == bend - from);
  CHECK(stays(1, Complex(0, -0.126 * g)) == bend - from);
  CHECK(stays(0, 4) == bend - from);  // past the pair
  Line crossing = at_rest({-3.0, -2.0}, 40);
  for (std::size_t k = 0; k < 40; ++k) crossing.re[0][k] += 0.01 * double(k * k);
  const std::size_t kept = crossing.stay(isolated, from, 38);
  CHECK(kept > 0);
  CHECK(crossing.re[0][from + kept - 1] < -2);
  // drifting within its place, but off the straight line
  Line bent = at_rest(three_modes, 40);
  for (std::size_t k = 3; k < 40; ++k) bent.re[0][k] += 0.1 * g * (k % 2 ? 1 : -1);
  CHECK(bent.stay(isolated, from, 38) == 2);  // the turn is the third
}

TEST_CASE("isolated: no modes, one, no points, the longest") {
  IsolatedModes isolated;
  const auto stays = [&](const Spectrum& modes, std::size_t length) {
    const std::size_t count = at_rest(modes, 102).stay(isolated, 2, length);
    for (std::size_t m = 0; m < count; ++m) {
      CHECK(isolated.certain(m));
      for (std::size_t i = 0; i < modes.size(); ++i) CHECK_NEAR(isolated.confidence(i, m), 1.0, 0);
    }
    return count;
  };
  CHECK(stays(three_modes, 0) == 0);
  CHECK(stays(three_modes, 1) == 1);
  CHECK(stays({}, 0) == 0);
  CHECK(stays({-1.0}, 0) == 0);
  for (const Spectrum& modes : {Spectrum{}, Spectrum{-1.0}, three_modes}) {
    CHECK(stays(modes, 10) == 10);
    CHECK(stays(modes, IsolatedModes::longest) == IsolatedModes::longest);
    CHECK(stays(modes, 100) == IsolatedModes::longest);
  }
  CHECK(stays(three_modes, 5) == 5);  // after more modes and after fewer
  Line alone = at_rest({-1.0}, 40);   // has no other to be confused with
  for (std::size_t k = 0; k < 40; ++k) alone.re[0][k] = k % 2 ? 1e6 : -1e-6;
  CHECK(alone.stay(isolated, 2, 38) == 38);
  CHECK_NEAR(isolated.confidence(0, 37), 1.0, 0);
}

TEST_CASE("isolated: what is no number ends it") {
  IsolatedModes isolated;
  for (const std::size_t mode : {0, 1, 2})
    for (const bool real : {false, true}) {
      Line line = at_rest(three_modes, 40);
      (real ? line.re : line.im)[mode][12] = std::numeric_limits<double>::quiet_NaN();
      CHECK(line.stay(isolated, 2, 38) == 10);
      CHECK(line.stay(isolated, 13, 10) == 0);  // from there nothing is known
    }
}

TEST_CASE("isolated: equal modes are no two places") {
  IsolatedModes isolated;
  const Line line = at_rest({0.0, 0.0, -1.0}, 40);
  CHECK(line.stay(isolated, 2, 38) == 0);
}

TEST_CASE("isolated: what has just left a pair is not foreseen to go straight on") {
  const Line parted{
      {0, 4, 5}, {{-1, -0.9, -0.88}, {-1, -1.1, -1.12}}, {{0.02, 0, 0}, {-0.02, 0, 0}}};
  std::vector<int> to(2);
  std::vector<double> sure(2);
  CHECK_FALSE(link_by_position(parted.modes(1), parted.straight_on(2), parted.modes(2), to, sure));
  REQUIRE(link_by_position(parted.modes(1), parted.modes(1), parted.modes(2), to, sure));
  IsolatedModes isolated;
  if (parted.stay(isolated, 2, 1) == 1) CHECK(isolated.confidence(0, 0) <= sure[0] + 1e-12);
}

namespace {

// [b 1; c b] has b ± √c: modes 0 and 1 are a pair that parts or, in reverse, two real ones that
// join, of this size. The others are at least that far away, and move at most that far.
Planted meeting(Random& random, bool back, std::size_t n, double size, double away, double way) {
  const double b0 = uniform(random, -1, 1), b1 = b0 + size * uniform(random, -0.3, 0.3);
  const double w = size * uniform(random, 0.1, 1), r = size * uniform(random, 0.1, 1);
  Spectrum pair_end = {{b0, w}, {b0, -w}}, real_end = {b1 + r, b1 - r};
  while (pair_end.size() < n) {
    const double far = away * (double(pair_end.size()) - uniform(random, 0.5, 1)),
                 go = way * uniform(random, -1, 1);
    const bool real = pair_end.size() + 1 == n || random() % 2;
    const Complex z = b0 + std::polar(far, real ? 0.0 : uniform(random, 0.3, 2.8));
    pair_end.push_back(real && random() % 2 ? b0 - far : z);
    if (!real) pair_end.push_back(std::conj(z));
    while (real_end.size() < pair_end.size()) real_end.push_back(pair_end[real_end.size()] + go);
  }
  const MatrixXd T = similarity(random, Index(n));
  const Matrices A = [=](double share) {
    const double s = back ? 1 - share : share, b = b0 + s * (b1 - b0);
    std::vector<MatrixXd> all{(MatrixXd(2, 2) << b, 1, -(1 - s) * w * w + s * r * r, b).finished()};
    for (std::size_t i = 2; i < n; ++i) {
      const Complex z = (1 - s) * pair_end[i] + s * real_end[i];
      if (z.imag() == 0) all.push_back(number(z.real()));
      if (z.imag() > 0) all.push_back(pair(z.real(), z.imag()));
    }
    return in_basis(T, block_diagonal(all));
  };
  return {A, back ? real_end : pair_end, back ? pair_end : real_end};
}

// A fraction of the way to their destination, the two at their mean, and off it by up to `miss`.
Spectrum foreseen(Random& random, const Planted& path, double share, double miss) {
  Spectrum z = path.last;
  const auto way = [&](std::size_t i) { return path.next[std::size_t(path.truth[i])] - z[i]; };
  const Complex middle = 0.5 * (way(0) + way(1)) + uniform(random, -miss, miss);
  for (std::size_t i = 2; i < z.size(); ++i) z[i] += share * way(i);
  z[0] += share * middle;
  z[1] += share * middle;
  return z;
}

}  // namespace

TEST_CASE("meeting: a pair that parts and two that join go on by the convention") {
  Random random(13);
  int missed = 0, wrong = 0, doubted = 0, by_position = 0;
  for (int t = 0; t < trials(1000); ++t) {
    const std::size_t n = 2 + std::size_t(t % 7);
    const Planted path = meeting(random, t % 2, n, 0.1, 2, 0.05);
    const Spectrum predicted = foreseen(random, path, uniform(random, 0, 1), 0.02);
    std::vector<int> to(n);
    std::vector<double> sure(n);
    by_position += link_by_position(path.last, predicted, path.next, to, sure);
    if (!link_meeting(path.last, predicted, path.next, to, sure)) {
      ++missed;
      continue;
    }
    wrong += to != path.truth;
    std::vector<int> kept = to;
    by_convention(path.last, path.next, kept);
    wrong += kept != to;
    CHECK_NEAR(sure[0], sure[1], 0);
    for (const double c : sure) doubted += !(c >= 0.5 && c <= 1);
  }
  CHECK(missed == 0);
  CHECK(wrong == 0);
  CHECK(doubted == 0);
  CHECK(by_position == 0);
}

TEST_CASE("meeting: where it answers, it answers as the eigenvectors do") {
  Random random(14);
  int asked = 0, answered = 0, wrong = 0, doubted = 0;
  for (; answered < trials(1500) && asked < 30'000; ++asked) {
    const std::size_t n = 2 + std::size_t(asked % 7);
    const double away = uniform(random, 0.3, 3);
    const Planted path = meeting(random, asked % 2, n, 0.3, away, 0.2 * away);
    const Spectrum predicted = foreseen(random, path, uniform(random, 0, 1), 0.3);
    std::vector<int> to(n);
    std::vector<double> sure(n);
    if (!link_meeting(path.last, predicted, path.next, to, sure)) continue;
    ++answered;
    wrong += to != link(path.A(0), path.last, predicted, path.A(1), path.next).to;
    doubted += !(sure[0] >= 0.5);
    for (const double c : sure) doubted += !(c > 0 && c <= 1);
  }
  CHECK(answered == trials(1500));
  CHECK(answered < 0.9 * asked);
  CHECK(wrong == 0);
  CHECK(doubted == 0);
}

TEST_CASE("meeting: any step, what is linked is what small steps find") {
  Random random(15);
  int answered = 0, wrong = 0;
  for (int t = 0; t < trials(20'000); ++t) {
    const Index n = 2 + t % 7;
    const MatrixXd A0 = dense(random, n, 1);
    const MatrixXd K = dense(random, n, std::pow(10, uniform(random, -2, 0)));
    const Matrices A = [&](double s) -> MatrixXd { return A0 + s * K; };
    const Spectrum last = spectrum(A(0)), next = spectrum(A(1));
    std::vector<int> to(last.size());
    std::vector<double> sure(last.size());
    if (link_by_position(last, last, next, to, sure)) continue;
    if (!link_meeting(last, last, next, to, sure)) continue;
    ++answered;
    wrong += to != find(walked(A, last, 300), next);
  }
  CHECK(answered > trials(300));
  CHECK(wrong == 0);
}

namespace {

bool meets(const Spectrum& last, const Spectrum& predicted, const Spectrum& next) {
  std::vector<int> to(last.size());
  std::vector<double> confidence(last.size());
  return link_meeting(last, predicted, next, to, confidence);
}

}  // namespace

TEST_CASE("meeting: others near, or no two that meet") {
  const Spectrum two = {{-1, 0.1}, {-1, -0.1}}, reals = {-0.9, -1.1};
  const auto beside = [&](const Spectrum& from, const Spectrum& to, Spectrum others) {
    Spectrum last = from, next = to;
    last.insert(last.end(), others.begin(), others.end());
    next.insert(next.end(), others.begin(), others.end());
    return meets(last, last, next);
  };
  for (const bool parts : {true, false}) {
    const Spectrum &from = parts ? two : reals, &to = parts ? reals : two;
    CHECK(meets(from, from, to));
    CHECK(beside(from, to, {-1.61}));  // six times as far as they are from their middle
    CHECK_FALSE(beside(from, to, {-1.59}));
    CHECK_FALSE(beside(from, to, {{-1.1, 0.3}, {-1.1, -0.3}}));
    CHECK(meets({from[0], from[1], -3.0}, {-1.2, -1.2, -3.0}, {to[0], to[1], -3.0}));
    CHECK_FALSE(meets({from[0], from[1], -3.0}, {-1.3, -1.3, -3.0}, {to[0], to[1], -3.0}));
  }
  CHECK_FALSE(meets({}, {}, {}));
  CHECK_FALSE(meets({-1.0}, {-1.0}, {-1.1}));
  CHECK_FALSE(meets(reals, reals, reals));
  CHECK_FALSE(meets(reals, {-1.1, -0.9}, reals));  // two real modes that pass, nothing complex
  CHECK_FALSE(meets({-1, -2, -1.1, -2.1}, {-1.1, -2.1, -1, -2}, {-1.1, -2.1, -1, -2}));
  // one pair parts while two real modes join
  CHECK_FALSE(meets({{-1, 0.1}, {-1, -0.1}, -4.9, -5.1}, {{-1, 0.1}, {-1, -0.1}, -4.9, -5.1},
                    {-0.9, -1.1, {-5, 0.1}, {-5, -0.1}}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(
      meets({{-1, 0.1}, {-1, -0.1}, -9.0}, {{-1, 0.1}, {-1, -0.1}, -9.0}, {-0.9, -1.1, nan}));
  CHECK_FALSE(
      meets({{-1, 0.1}, {-1, -0.1}, -9.0}, {{-1, 0.1}, {-1, -0.1}, nan}, {-0.9, -1.1, -9.0}));
  CHECK_FALSE(meets(two, {nan, nan}, reals));
  CHECK_FALSE(meets(two, two, {nan, nan}));
}

TEST_CASE("meeting: two real modes that pass each other, beside a pair, do not meet") {
  const Spectrum last = {-1.0, -1.1, {-1.05, 5}, {-1.05, -5}};
  const Spectrum next = {-1.08, -1.02, {-1.05, 5}, {-1.05, -5}};
  CHECK_FALSE(meets(last, next, next));
}

}  // namespace track_test
