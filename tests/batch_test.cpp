#include "linearize/batch.hpp"

#include <algorithm>
#include <complex>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <random>

#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace batch_test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double denormal = std::numeric_limits<double>::denorm_min();
constexpr double backward = 1e-14;  // times n ‖A‖: backward error allowed for an eigenvalue

MatrixXd filled(Index n, const std::function<double(Index, Index)>& entry) {
  MatrixXd A(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) A(i, j) = entry(i, j);
  return A;
}

MatrixXd gaussian(Random& random, Index n) {
  std::normal_distribution normal;
  return filled(n, [&](Index, Index) { return normal(random); });
}

// The closed loop at three trims, every entry perturbed by up to 40 %.
const std::vector<MatrixXd>& loops() {
  static const std::vector<MatrixXd> matrices = [] {
    const double degree = 3.14159265358979 / 180;
    std::vector<MatrixXd> found;
    for (const Command& command : {Command{2.0, 90 * degree, 90 * degree},
                                   {6.0, 45 * degree, 45 * degree},
                                   {15.0, 0.0, 0.0}}) {
      const TrimProblem p = closed_loop_problem(reference_vehicle(), command);
      const TrimResult level = trim(p.model, p.spec, p.guess, {.starts = 0});
      REQUIRE(level);
      found.push_back(linearize(p.model, level.point).A);
    }
    return found;
  }();
  return matrices;
}

MatrixXd closed_loop_like(Random& random) {
  const MatrixXd& A = loops()[std::size_t(random() % 3)];
  return filled(6, [&](Index i, Index j) { return A(i, j) * uniform(random, 0.6, 1.4); });
}

// --- Matrices known to be difficult.

MatrixXd companion(const std::vector<double>& roots) {
  std::vector<double> c = {1};  // highest power first
  for (const double r : roots) {
    c.push_back(0);
    for (std::size_t k = c.size() - 1; k > 0; --k) c[k] -= r * c[k - 1];
  }
  return filled(std::ssize(roots), [&](Index i, Index j) {
    return i == 0 ? -c[std::size_t(j + 1)] : i == j + 1 ? 1.0 : 0.0;
  });
}

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

// Frank, Grcar, Wilkinson, Kahan, Jordan, nilpotent, cyclic, clustered roots, triangular, graded.
std::vector<MatrixXd> classics(Index n) {
  const double s = std::sin(1.2), c = std::cos(1.2);
  Random random{std::uint64_t(n)};
  std::vector<double> cluster;
  for (Index i = 0; i < n; ++i) cluster.push_back(1 + 1e-3 * double(i));
  return {
      MatrixXd::Zero(n, n),
      MatrixXd::Identity(n, n),
      -1e-3 * MatrixXd::Ones(n, n),
      filled(n, [n](Index i, Index j) { return i > j + 1 ? 0.0 : double(n - std::max(i, j)); }),
      filled(n, [](Index i, Index j) { return i == j + 1 ? -1.0 : j >= i && j <= i + 3; }),
      filled(n,
             [n](Index i, Index j) {
               return i == j ? std::abs(double(i) - double(n - 1) / 2) : std::abs(i - j) == 1;
             }),
      filled(n,
             [=](Index i, Index j) {
               return j < i ? 0.0 : std::pow(s, double(i)) * (i == j ? 1.0 : -c);
             }),
      filled(n, [](Index i, Index j) { return i == j ? 2.0 : j == i + 1; }),
      filled(n, [](Index i, Index j) { return double(j == i + 1); }),
      filled(n, [n](Index i, Index j) { return double(j == (i + 1) % n); }),
      filled(n, [n](Index i, Index j) { return double(i == (j + 1) % n); }),
      filled(n, [n](Index i, Index j) { return double(i == n - 1 - j); }),
      companion(cluster),
      filled(n, [&](Index i, Index j) { return j < i ? 0.0 : uniform(random, -1, 1); }),
      filled(n, [&](Index i, Index j) { return i < j ? 0.0 : uniform(random, -1, 1); }),
      filled(n, [&](Index i,
                    Index j) { return uniform(random, -1, 1) * std::pow(10.0, -double(i + j)); }),
      filled(n, [&](Index i, Index j) {
        return uniform(random, -1, 1) * std::pow(10.0, double(j - i));
      })};
}

// The same scaled to the ends of the range of doubles, and with mixed scales.
std::vector<MatrixXd> hard(Index n) {
  std::vector<MatrixXd> all = classics(n);
  if (n == 7) all.push_back(godunov());
  Random random{std::uint64_t(100 + n)};
  const MatrixXd A = gaussian(random, n);
  for (const double size : {1e300, 1e-300, 1e-310, 5e-324, 1e150, 1e-150}) all.push_back(size * A);
  for (const double decades : {5.0, 20.0, 100.0, 300.0})
    for (int k = 0; k < 5; ++k)
      all.push_back(filled(n, [&](Index, Index) {
        return uniform(random, -1, 1) * std::pow(10.0, uniform(random, -decades, decades));
      }));
  for (const double decades : {4.0, 12.0, 40.0}) {  // units of states
    const Eigen::VectorXd d = Eigen::VectorXd::NullaryExpr(
        n, [&] { return std::pow(10.0, uniform(random, -decades, decades)); });
    all.push_back(d.asDiagonal() * A * d.cwiseInverse().asDiagonal());
  }
  return all;
}

MatrixBatch batch_of(const std::vector<MatrixXd>& matrices) {
  MatrixBatch batch(matrices.front().rows(), std::ssize(matrices));
  for (Index k = 0; k < batch.count; ++k) batch.set(k, matrices[std::size_t(k)]);
  return batch;
}

BatchEigenvalues eigenvalues_of(const MatrixBatch& batch, const BatchOptions& options = {}) {
  BatchEigenvalues answer;
  eigenvalues(batch, answer, options);
  return answer;
}

VectorXcd spectrum(const MatrixBatch& A, const BatchEigenvalues& answer, Index k) {
  VectorXcd lambda(A.n);
  for (Index i = 0; i < A.n; ++i) {
    const auto at = std::size_t(i * A.count + k);
    lambda[i] = {answer.re[at], answer.im[at]};
  }
  return lambda;
}

// Scaled near one by a power of two, so that no square overflows or vanishes.
double unit(const MatrixXd& A) {
  const double largest = A.cwiseAbs().maxCoeff();
  return largest > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(largest), -1000, 1000)) : 1.0;
}

// σ_min(A - λI)/(n ‖A‖₂): the smallest perturbation that makes λ an eigenvalue. Bounded above by
// one inverse iteration; decomposed only if that bound is not small enough.
double backward_error(const MatrixXd& A, double norm, Complex lambda) {
  const Index n = A.rows();
  const MatrixXcd shifted = A - lambda * MatrixXcd::Identity(n, n);
  const VectorXcd v = algebra::solve(shifted, MatrixXcd::Ones(n, 1));
  const double by_vector = (shifted * v).norm() / v.norm() / (double(n) * norm);
  if (by_vector <= backward) return by_vector;
  return algebra::least_singular_value(shifted) / (double(n) * norm);
}

// The largest over the spectrum, and of the sum against the trace: no eigenvalue is repeated in
// place of another.
double worst_of(const MatrixXd& given, VectorXcd lambda) {
  const double size = unit(given);
  const MatrixXd A = given / size;
  if (!lambda.allFinite()) return infinity;
  lambda *= 1 / size;
  const double norm = algebra::largest_singular_value(A);
  if (norm == 0) return lambda.cwiseAbs().maxCoeff() == 0 ? 0.0 : infinity;
  double worst = std::abs(lambda.sum() - A.trace()) / (double(A.rows()) * norm);
  for (const Complex& z : lambda) {
    if (z.imag() < 0) continue;  // its conjugate has the same
    worst = std::max(worst, backward_error(A, norm, z));
  }
  return worst - denormal / size / norm;  // below it no result can be represented
}

// Complex pairs are adjacent, positive imaginary part first.
bool paired(const VectorXcd& lambda) {
  for (Index i = 0; i < lambda.size(); ++i) {
    if (lambda[i].imag() == 0) continue;
    if (!(lambda[i].imag() > 0) || i + 1 == lambda.size()) return false;
    if (lambda[i + 1] != std::conj(lambda[i])) return false;
    ++i;
  }
  return true;
}

// Matched one to one with the eigenvalues of modes(): each with the nearest unmatched one, by
// condition number, within the distance it explains. A perturbation E moves an eigenvalue of
// condition κ by κ ‖E‖, and none by more than (2n - 1) (2‖A‖ + ‖E‖)^(1 - 1/n) ‖E‖^(1/n).   [31]
double farthest_from_reference(const MatrixXd& given, VectorXcd lambda) {
  const double size = unit(given);
  const MatrixXd A = given / size;
  lambda *= 1 / size;
  const double n = double(A.rows()), norm = A.norm(),
               E = 2 * backward * n * norm + n * denormal / size;
  const double any = (2 * n - 1) * std::pow(2 * norm + E, 1 - 1 / n) * std::pow(E, 1 / n);
  std::vector<Mode> reference = modes(A).modes;
  std::ranges::sort(reference, {}, &Mode::condition);
  std::vector<Complex> left(lambda.begin(), lambda.end());
  double worst = 0.0;
  for (const Mode& mode : reference) {
    const auto distance = [&](const Complex& z) { return std::abs(z - mode.eigenvalue); };
    const auto nearest = std::ranges::min_element(left, {}, distance);
    const double explained = mode.condition < 1e3 ? 10 * mode.condition * E + mode.error : any;
    const double apart = distance(*nearest);
    worst = std::max(worst, apart == 0 ? 0.0 : apart / explained);
    left.erase(nearest);
  }
  return worst;
}

// --- Instruction sets.

// Sets TILTRIM_SIMD during its lifetime.
class Asked {
 public:
  explicit Asked(const std::string& set) {
    if (const char* before = std::getenv("TILTRIM_SIMD")) before_ = before;
    setenv("TILTRIM_SIMD", set.c_str(), 1);
  }
  ~Asked() { before_ ? setenv("TILTRIM_SIMD", before_->c_str(), 1) : unsetenv("TILTRIM_SIMD"); }
  Asked(const Asked&) = delete;
  Asked& operator=(const Asked&) = delete;

 private:
  std::optional<std::string> before_;
};

// The instruction sets of this processor. Not evaluated in CHECK, which would count exceptions.
std::vector<std::string> sets_here() {
  std::vector<std::string> sets;
  for (const char* set : {"scalar", "baseline", "avx2", "avx512"}) {
    const Asked asked(set);
    std::string used;
    try {
      used = instruction_set();
    } catch (const std::invalid_argument&) {
      continue;
    }
    CHECK(used == set);
    sets.push_back(set);
  }
  return sets;
}

struct Answers {
  BatchEigenvalues eigenvalues;
  std::vector<Verdict> verdicts;
};

Answers answers_by(const std::string& set, const MatrixBatch& batch) {
  const Asked asked(set);
  Answers answers{eigenvalues_of(batch), {}};
  verdicts(batch, answers.verdicts);
  return answers;
}

int different(const Answers& a, const Answers& b) {
  int found = 0;
  for (std::size_t i = 0; i < a.eigenvalues.re.size(); ++i) {
    const double here[] = {a.eigenvalues.re[i], a.eigenvalues.im[i]};
    const double there[] = {b.eigenvalues.re[i], b.eigenvalues.im[i]};
    found += std::memcmp(here, there, sizeof here) != 0;
  }
  for (std::size_t k = 0; k < a.verdicts.size(); ++k)
    found += a.eigenvalues.status[k] != b.eigenvalues.status[k] || a.verdicts[k] != b.verdicts[k];
  return found;
}

}  // namespace

TEST_CASE("closed loops and random matrices: every eigenvalue, to its backward error" * thorough) {
  Random random(1);
  Index count = trials(100000);
  const auto check_all = [&](Index n, Index matrices, const std::function<MatrixXd()>& draw) {
    MatrixBatch batch(n, matrices);
    for (Index k = 0; k < matrices; ++k) batch.set(k, draw());
    const BatchEigenvalues answer = eigenvalues_of(batch);
    double worst = 0.0, farthest = 0.0;
    Index fell_back = 0;
    bool in_pairs = true;
    for (Index k = 0; k < matrices; ++k) {
      const MatrixXd A = batch.matrix(k);
      const VectorXcd lambda = spectrum(batch, answer, k);
      worst = std::max(worst, worst_of(A, lambda));
      if (k % 20 == 0) farthest = std::max(farthest, farthest_from_reference(A, lambda));
      fell_back += answer.status[std::size_t(k)] != LaneStatus::converged;
      in_pairs = in_pairs && paired(lambda);
    }
    CHECK(worst <= backward);
    CHECK(farthest <= 1);
    CHECK(fell_back == 0);
    CHECK(in_pairs);
  };
  check_all(6, count / 2, [&] { return closed_loop_like(random); });
  check_all(6, count / 4, [&] { return gaussian(random, 6); });
  for (Index n = 1; n <= largest_batch_matrix; ++n)
    check_all(n, count / 4 / (n * n), [&] { return gaussian(random, n); });
}

TEST_CASE("matrices known to be hard, of every size") {
  for (Index n = 1; n <= largest_batch_matrix; ++n) {
    const MatrixBatch batch = batch_of(hard(n));
    const BatchEigenvalues answer = eigenvalues_of(batch);
    for (Index k = 0; k < batch.count; ++k) {
      CAPTURE(n);
      CAPTURE(k);
      const VectorXcd lambda = spectrum(batch, answer, k);
      CHECK(answer.status[std::size_t(k)] <= LaneStatus::fallback);
      CHECK(paired(lambda));
      CHECK(worst_of(batch.matrix(k), lambda) <= backward);
      CHECK(farthest_from_reference(batch.matrix(k), lambda) <= 1);
    }
  }
}

TEST_CASE("triangular in disguise and states in units of their own keep small eigenvalues") {
  // A chain of first-order lags with rows shuffled and units far apart: balancing recovers digits
  // that no normwise bound promises.
  const std::vector<Index> order = {3, 0, 5, 2, 4, 1};
  const MatrixXd chain = filled(6, [](Index i, Index j) {
    return i == j ? -std::pow(10.0, -double(i)) : j == i + 1 ? 1e6 : 0.0;
  });
  const MatrixBatch batch = batch_of({chain(order, order)});
  const BatchEigenvalues answer = eigenvalues_of(batch);
  std::vector<double> found = answer.re;
  std::ranges::sort(found);
  for (int i = 0; i < 6; ++i) {
    const double expected = -std::pow(10.0, -double(i));
    CHECK_NEAR(found[std::size_t(i)], expected, 1e-15 * std::abs(expected));
  }
  CHECK(answer.status[0] == LaneStatus::converged);
}

TEST_CASE("a matrix has the same bits whatever its neighbours, position and count") {
  Random random(2);
  for (const Index n : {1, 2, 3, 4, 5, 6, 7, 10, 16}) {
    std::vector<MatrixXd> matrices = hard(n);
    for (int k = 0; k < 40; ++k) matrices.push_back(gaussian(random, n));
    std::vector<BatchEigenvalues> alone;
    for (const MatrixXd& A : matrices) alone.push_back(eigenvalues_of(batch_of({A})));
    matrices.push_back(MatrixXd::Constant(n, n, not_a_number));
    matrices.push_back(MatrixXd::Constant(n, n, infinity));
    alone.push_back(eigenvalues_of(batch_of({matrices.end()[-2]})));
    alone.push_back(eigenvalues_of(batch_of({matrices.end()[-1]})));
    std::vector<std::size_t> order(matrices.size());
    for (int shuffle = 0; shuffle < 10; ++shuffle) {
      for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
      std::ranges::shuffle(order, random);
      order.resize(1 + random() % order.size());
      std::vector<MatrixXd> some;
      for (const std::size_t k : order) some.push_back(matrices[k]);
      const MatrixBatch batch = batch_of(some);
      const BatchEigenvalues answer = eigenvalues_of(batch);
      int different = 0;
      for (Index k = 0; k < batch.count; ++k) {
        const BatchEigenvalues& own = alone[order[std::size_t(k)]];
        const VectorXcd here = spectrum(batch, answer, k);
        for (Index i = 0; i < n; ++i) {
          const Complex there(own.re[std::size_t(i)], own.im[std::size_t(i)]);
          different += std::memcmp(&here[i], &there, sizeof there) != 0;
        }
        different += own.status[0] != answer.status[std::size_t(k)];
      }
      CHECK(different == 0);
      order.resize(matrices.size());
    }
  }
}

TEST_CASE("every status is reached and named") {
  MatrixBatch batch(3, 3);
  const MatrixXd cyclic = filled(3, [](Index i, Index j) { return double(j == (i + 1) % 3); });
  batch.set(0, cyclic);
  batch.set(1, MatrixXd::Identity(3, 3));
  batch.set(2, MatrixXd::Identity(3, 3));
  batch(0, 1, 2) = infinity;
  SUBCASE("converged, and not finite beside it") {
    const BatchEigenvalues answer = eigenvalues_of(batch);
    CHECK(to_string(answer.status[0]) == "converged");
    CHECK(to_string(answer.status[1]) == "converged");
    CHECK(to_string(answer.status[2]) == "not finite");
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(std::isnan(answer.re[i * 3 + 2]));
      CHECK(std::isnan(answer.im[i * 3 + 2]));
    }
  }
  SUBCASE("fallback, where the lanes met their cap") {
    const BatchEigenvalues answer = eigenvalues_of(batch, {.max_iterations = 1});
    CHECK(to_string(answer.status[0]) == "fallback");
    CHECK(answer.status[1] == LaneStatus::converged);
    CHECK(worst_of(cyclic, spectrum(batch, answer, 0)) <= backward);
    CHECK(paired(spectrum(batch, answer, 0)));
  }
  SUBCASE("fallback, where balancing does not settle") {
    MatrixBatch wide(4, 1);
    wide.set(0, filled(4, [](Index i, Index j) {
               return j == (i + 1) % 4 ? std::pow(10.0, i % 2 ? 100.0 : -100.0) : 0.0;
             }));
    const BatchEigenvalues answer = eigenvalues_of(wide);
    CHECK(answer.status[0] == LaneStatus::fallback);
  }
  SUBCASE("not converged, where the fallback met its own") {
    const BatchEigenvalues answer =
        eigenvalues_of(batch, {.max_iterations = 1, .fallback_iterations = 0});
    CHECK(to_string(answer.status[0]) == "not converged");
    for (std::size_t i = 0; i < 3; ++i) CHECK(std::isnan(answer.re[i * 3]));
    CHECK(answer.status[1] == LaneStatus::converged);
  }
}

TEST_CASE("every instruction set gives the eigenvalues") {
  Random random(4);
  std::vector<MatrixXd> matrices = hard(6);
  for (int k = 0; k < 200; ++k) matrices.push_back(closed_loop_like(random));
  const MatrixBatch batch = batch_of(matrices);
  const std::vector<std::string> sets = sets_here();
  CHECK(sets.size() >= 2);
  for (const std::string& set : sets) {
    const Asked asked(set);
    const BatchEigenvalues answer = eigenvalues_of(batch);
    double worst = 0.0;
    for (Index k = 0; k < batch.count; ++k)
      worst = std::max(worst, worst_of(batch.matrix(k), spectrum(batch, answer, k)));
    CAPTURE(set);
    CHECK(worst <= backward);
  }
}

TEST_CASE("every instruction set gives the same bits") {
  Random random(5);
  const std::vector<std::string> sets = sets_here();
  for (Index n = 1; n <= largest_batch_matrix; ++n) {
    std::vector<MatrixXd> matrices = hard(n);
    int more = trials(200);
    for (int k = 0; k < more; ++k) {
      const double scale = std::pow(10.0, uniform(random, -3, 3));
      // With these shifts some are stable, some unstable, some undecided.
      const double shift = uniform(random, 0, 2 * std::sqrt(double(n)));
      matrices.push_back(scale * (gaussian(random, n) - shift * MatrixXd::Identity(n, n)));
      if (n == 6) matrices.push_back(closed_loop_like(random));
    }
    matrices.push_back(MatrixXd::Constant(n, n, not_a_number));
    matrices.push_back(MatrixXd::Constant(n, n, infinity));
    const MatrixBatch batch = batch_of(matrices);
    const Answers expected = answers_by(sets.front(), batch);
    for (const std::string& set : sets) {
      CAPTURE(n);
      CAPTURE(set);
      CHECK(different(answers_by(set, batch), expected) == 0);
    }
  }
}

TEST_CASE("what is wrong with a batch or the environment is said") {
  const auto message = [](const std::function<void()>& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing thrown";
  };
  BatchEigenvalues answer;
  CHECK(message([&] { eigenvalues(MatrixBatch(17, 2), answer); }) ==
        "batch of 2 matrices of size 17: supported sizes are 0 to 16");
  MatrixBatch short_one(3, 4);
  short_one.entries.pop_back();
  CHECK(message([&] { eigenvalues(short_one, answer); }) ==
        "batch of 4 matrices of size 3: 35 entries");
  MatrixBatch two(2, 1);
  CHECK(message([&] { two.set(0, MatrixXd::Zero(3, 3)); }) ==
        "batch of 1 matrices of size 2: number 0 cannot be 3 x 3");
  CHECK(message([&] { (void)two.matrix(1); }) == "batch of 1 matrices: no number 1");
  const Asked asked("mmx");
  CHECK(message([] {
          (void)instruction_set();
        }).starts_with("TILTRIM_SIMD is 'mmx'; this processor has: scalar, baseline"));
}

TEST_CASE("nothing in, nothing out") {
  CHECK(eigenvalues_of(MatrixBatch(6, 0)).status.empty());
  const BatchEigenvalues none = eigenvalues_of(MatrixBatch(0, 3));
  CHECK(none.re.empty());
  CHECK(none.status == std::vector(3, LaneStatus::converged));
}

}  // namespace batch_test
