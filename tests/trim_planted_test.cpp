// Planted truth: random models whose equilibria, or lack of them, are known by construction.
#include <Eigen/Core>
#include <cstdint>
#include <cstdlib>

#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "trim/trim.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace trim_planted_test {

static VectorXd random_vector(Random& g, Index n) {
  VectorXd v(n);
  for (double& x : v) x = uniform(g, -1, 1);
  return v;
}

// A matrix with singular values from 0.3 to 3: a well-scaled model.
static MatrixXd random_matrix(Random& g, Index n) {
  MatrixXd raw(n, n);
  for (Index j = 0; j < n; ++j) raw.col(j) = random_vector(g, n);
  const algebra::SingularValues svd = algebra::singular_values(raw);
  VectorXd sigma(n);
  for (double& s : sigma) s = 0.3 * std::pow(10.0, uniform(g, 0, 1));
  return svd.U * sigma.asDiagonal() * svd.V.transpose();
}

namespace {

// Variants of the first row.
enum class Planted { root, no_root, singular_root };

// fᵢ = size (M d + ½ curvature (a d)² + ⅙ curvature (b d)³), with d = (x - x*)/size: x* is a root.
// The first row may become size ((a d)² + c): no root for c > 0, a singular one for c = 0.
struct Planting {
  MatrixXd M, a, b;
  VectorXd root, size;
  double curvature, gap = 0.0;
  Planted what;

  Planting(Random& g, Index n, double bent, Planted kind)
      : M(random_matrix(g, n)), a(n, n), b(n, n), curvature(bent), what(kind) {
    for (Index i = 0; i < n; ++i) {
      a.row(i) = random_vector(g, n).normalized();
      b.row(i) = random_vector(g, n).normalized();
    }
    size.resize(n);
    for (double& s : size) s = std::pow(10.0, uniform(g, -3, 3));
    root = 5 * random_vector(g, n).cwiseProduct(size);
    if (what == Planted::no_root) gap = std::pow(10.0, uniform(g, -4, 0));
  }

  VectorXd rates(const VectorXd& x) const {
    const VectorXd d = (x - root).cwiseQuotient(size);
    const VectorXd s = a * d, t = b * d;
    VectorXd f = M * d + curvature * (s.cwiseAbs2() / 2 + t.cwiseAbs2().cwiseProduct(t) / 6);
    if (what != Planted::root) f[0] = s[0] * s[0] + gap;
    return f.cwiseProduct(size);
  }

  MatrixXd slopes(const VectorXd& x) const {
    const VectorXd d = (x - root).cwiseQuotient(size);
    const VectorXd s = a * d, t = b * d;
    MatrixXd J = M;
    for (Index i = 0; i < d.size(); ++i)
      J.row(i) += curvature * (s[i] * a.row(i) + t[i] * t[i] / 2 * b.row(i));
    if (what != Planted::root) J.row(0) = 2 * s[0] * a.row(0);
    return size.asDiagonal() * J * size.cwiseInverse().asDiagonal();
  }

  Model model(bool exact) const {
    Model m;
    for (Index i = 0; i < size.size(); ++i)
      m.states.push_back({fmt::format("x{}", i), "", size[i]});
    m.f = [this](const VectorXd& x, const VectorXd&, const VectorXd&) { return rates(x); };
    if (exact)
      m.derivatives = [this](const OperatingPoint& at, const std::vector<Index>& variables) {
        return MatrixXd(slopes(at.x)(Eigen::all, variables));
      };
    return m;
  }

  TrimSpec spec() const {
    TrimSpec s;
    for (Index i = 0; i < size.size(); ++i) s.free.push_back(fmt::format("x{}", i));
    s.steady = s.free;
    return s;
  }

  // A start within two scale lengths of x*.
  OperatingPoint guess(Random& g) const {
    const VectorXd off = random_vector(g, size.size()).normalized() * uniform(g, 0, 2);
    return {root + off.cwiseProduct(size), VectorXd(), VectorXd()};
  }
};

}  // namespace

// Bounds that keep x* inside, or cut it off in one variable.
static void bound(TrimSpec& spec, const Planting& p, Random& g, bool cut_off) {
  const Index n = p.size.size();
  const Index cut = cut_off ? Index(g() % std::uint64_t(n)) : -1;
  for (Index i = 0; i < n; ++i) {
    Range r{p.root[i] - uniform(g, 2, 4) * p.size[i], p.root[i] + uniform(g, 2, 4) * p.size[i]};
    if (i == cut) (g() % 2 ? r.lower : r.upper) = p.root[i];
    if (i == cut && r.lower == p.root[i]) r.lower += uniform(g, 1e-6, 0.5) * p.size[i];
    if (i == cut && r.upper == p.root[i]) r.upper -= uniform(g, 1e-6, 0.5) * p.size[i];
    spec.bounds[fmt::format("x{}", i)] = r;
  }
}

// Verifies the result by evaluating the planted model only, without trim's code.
static bool wrong(const Planting& p, const TrimSpec& spec, const TrimResult& r) {
  const double residual = p.rates(r.point.x).cwiseQuotient(p.size).lpNorm<Eigen::Infinity>();
  bool inside = true;
  for (Index i = 0; i < p.size.size(); ++i)
    if (const auto b = spec.bounds.find(fmt::format("x{}", i)); b != spec.bounds.end())
      inside = inside && r.point.x[i] >= b->second.lower - 1e-9 * p.size[i] &&
               r.point.x[i] <= b->second.upper + 1e-9 * p.size[i];
  return !(residual <= TrimOptions{}.tolerance && inside);
}

// Mostly Newton: Ipopt's time is spent in its linear solver, which is not under test. The million
// trims of `make planted` use it once in forty, without closest points.
static const bool million = std::getenv("TILTRIM_SEED");

static TrimMethod random_method(Random& g) {
  return g() % (million ? 40 : 4) ? TrimMethod::newton : TrimMethod::ipopt;
}

static TrimOptions with_starts(int starts, TrimMethod method) {
  return {.method = method, .starts = starts, .closest = !million};
}

// Fewer further starts than the default: a harder test.
static TrimOptions few_starts(TrimMethod method) { return with_starts(8, method); }

TEST_CASE("planted equilibria: found from two scale lengths away, never a wrong one" * thorough) {
  Random g = draws(2013);
  int n = trials(2000);
  int solved = 0, silently_wrong = 0, at_the_planted = 0;
  for (int i = 0; i < n; ++i) {
    const Planting p(g, 1 + Index(g() % 6), uniform(g, 0, 0.6), Planted::root);
    const Model model = p.model(g() % 4 != 0);
    TrimSpec spec = p.spec();
    if (g() % 2) bound(spec, p, g, false);
    const OperatingPoint guess = p.guess(g);
    const TrimMethod method = random_method(g);
    const TrimResult r = trim(model, spec, guess, few_starts(method));
    if (!r) continue;
    ++solved;
    silently_wrong += wrong(p, spec, r);
    at_the_planted += (r.point.x - p.root).cwiseQuotient(p.size).norm() < 1e-6;
  }
  CAPTURE(solved);
  CAPTURE(at_the_planted);
  tally("root within two scale lengths", n, silently_wrong, n - solved);
  CHECK(silently_wrong == 0);
  CHECK(solved >= 0.995 * n);
  CHECK(at_the_planted >= 0.9 * n);  // the cubic may have others
}

TEST_CASE("planted without equilibrium: none is reported" * thorough) {
  Random g = draws(14);
  int converged = 0, called_singular = 0, small_gaps = 0;
  int n = trials(200);
  for (int i = 0; i < n; ++i) {
    const Planting p(g, 1 + Index(g() % 4), uniform(g, 0, 0.5), Planted::no_root);
    TrimSpec spec = p.spec();
    if (g() % 2) bound(spec, p, g, false);
    const TrimMethod method = random_method(g);
    const TrimResult r = trim(p.model(true), spec, p.guess(g), with_starts(1, method));
    converged += r.status == TrimStatus::converged;
    called_singular += r.status == TrimStatus::singular;
    small_gaps += p.gap < 1e-3;
  }
  tally("no root", n, converged + called_singular, 0);
  CHECK(converged == 0);
  CHECK(called_singular == 0);
  CHECK(small_gaps > n / 10);
}

TEST_CASE("planted singular equilibria are not called well-conditioned") {
  Random g = draws(15);
  int converged = 0, reached = 0;
  int n = trials(200);
  for (int i = 0; i < n; ++i) {
    const Planting p(g, 1 + Index(g() % 4), uniform(g, 0, 0.5), Planted::singular_root);
    const TrimMethod method = random_method(g);
    const TrimResult r = trim(p.model(true), p.spec(), p.guess(g), with_starts(1, method));
    converged += r.status == TrimStatus::converged;
    reached += r.status == TrimStatus::singular;
  }
  tally("singular root", n, converged, n - reached);
  CHECK(converged == 0);
  CHECK(reached >= 0.95 * n);
}

TEST_CASE("planted equilibria outside the bounds are not answers" * thorough) {
  Random g = draws(16);
  int silently_wrong = 0, converged = 0, beyond = 0;
  int n = trials(200);
  for (int i = 0; i < n; ++i) {
    const Planting p(g, 1 + Index(g() % 4), i % 2 ? 0.0 : 0.4, Planted::root);
    TrimSpec spec = p.spec();
    bound(spec, p, g, true);
    const TrimMethod method = random_method(g);
    const TrimResult r = trim(p.model(true), spec, p.guess(g), with_starts(1, method));
    converged += bool(r);
    silently_wrong += bool(r) && wrong(p, spec, r);
    beyond += p.curvature == 0 && bool(r);  // x* was the only one
  }
  tally("root outside the bounds", n, silently_wrong + beyond, 0);
  CHECK(beyond == 0);
  CHECK(silently_wrong == 0);
  CHECK(converged < n / 2);  // bent ones may have another root within
}

// ---- with an enclosure: proofs of infeasibility, never where an equilibrium exists ----

namespace {

// f = C q with qᵢ = (xᵢ - rᵢ)(xᵢ - sᵢ): the 2ⁿ points of all rᵢ, sᵢ are the equilibria.
struct Lattice {
  MatrixXd C;
  VectorXd r, s;

  Lattice(Random& g, Index n)
      : C(random_matrix(g, n)), r(2 * random_vector(g, n)), s(2 * random_vector(g, n)) {}

  static Range quadratic(const Range& x, double r, double s) {
    const auto q = [&](double v) { return (v - r) * (v - s); };
    const double middle = 0.5 * (r + s);
    const double a = q(x.lower), b = q(x.upper);
    return {x.lower <= middle && middle <= x.upper ? q(middle) : std::min(a, b), std::max(a, b)};
  }

  Model model() const {
    Model m;
    const Index n = r.size();
    for (Index i = 0; i < n; ++i) m.states.push_back({fmt::format("x{}", i), "", 1.0});
    m.f = [this](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd {
      return C * (x - r).cwiseProduct(x - s);
    };
    m.derivatives = [this](const OperatingPoint& at, const std::vector<Index>& variables) {
      return MatrixXd((C * (2 * at.x - r - s).asDiagonal())(Eigen::all, variables));
    };
    m.enclosure = [this, n](const std::vector<Range>& box) {
      std::vector<Range> f(std::size_t(n), Range{0, 0});
      for (Index j = 0; j < n; ++j) {
        const Range q = quadratic(box[std::size_t(j)], r[j], s[j]);
        for (Index i = 0; i < n; ++i) {
          const double a = C(i, j) * q.lower, b = C(i, j) * q.upper;
          f[std::size_t(i)].lower += std::min(a, b);
          f[std::size_t(i)].upper += std::max(a, b);
        }
      }
      return f;
    };
    return m;
  }

  // How deep the box holds its deepest equilibrium; negative: how far all are outside.
  double depth(const std::vector<Range>& box) const {
    double deepest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < box.size(); ++i) {
      const auto inside = [&](double v) { return std::min(v - box[i].lower, box[i].upper - v); };
      deepest = std::min(deepest, std::max(inside(r[Index(i)]), inside(s[Index(i)])));
    }
    return deepest;
  }
};

}  // namespace

TEST_CASE("random boxes: infeasible is shown where it is true, and only there" * thorough) {
  Random g = draws(17);
  int with = 0, without = 0, shown = 0, solved = 0, wrongly_shown = 0, silently_wrong = 0;
  int boxes = trials(1000);
  for (int i = 0; i < boxes; ++i) {
    const Index n = 1 + Index(g() % 3);
    const Lattice lattice(g, n);
    std::vector<Range> box;
    TrimSpec spec;
    OperatingPoint guess{VectorXd(n), VectorXd(), VectorXd()};
    for (Index k = 0; k < n; ++k) {
      const double middle = uniform(g, -2, 2), half = uniform(g, 0.1, 1.5);
      box.push_back({middle - half, middle + half});
      guess.x[k] = middle;
      spec.free.push_back(fmt::format("x{}", k));
      spec.bounds[spec.free.back()] = box.back();
    }
    spec.steady = spec.free;
    const double depth = lattice.depth(box);
    // Neither a root on the very edge, which is undecided, nor a double one, which is singular.
    if (std::abs(depth) < 1e-3 || (lattice.r - lattice.s).cwiseAbs().minCoeff() < 1e-3) continue;
    TrimResult r = trim(lattice.model(), spec, guess, with_starts(0, TrimMethod::newton));
    if (r.status == TrimStatus::not_found)
      r = trim(lattice.model(), spec, guess, few_starts(TrimMethod::newton));
    with += depth > 0;
    without += depth < 0;
    solved += bool(r);
    shown += r.status == TrimStatus::infeasible;
    wrongly_shown += r.status == TrimStatus::infeasible && depth > 0;
    if (r) {
      const VectorXd q = (r.point.x - lattice.r).cwiseProduct(r.point.x - lattice.s);
      silently_wrong += depth < 0 || (lattice.C * q).lpNorm<Eigen::Infinity>() > 1e-10;
    }
  }
  tally("boxes with and without roots", with + without, wrongly_shown + silently_wrong,
        with + without - shown - solved);
  CAPTURE(with);
  CAPTURE(without);
  CHECK(with > boxes / 8);
  CHECK(without > boxes / 8);
  CHECK(wrongly_shown == 0);
  CHECK(silently_wrong == 0);
  CHECK(shown >= without - without / 1000);  // the proof has a budget
  CHECK(solved >= with - with / 1000);
}

}  // namespace trim_planted_test
