#include "tune/search.hpp"

#include <algorithm>
#include <cmath>

#include "tune/optimizer.hpp"

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Search::Search(const TuneProblem& p, const TuneOptions& o)
    : problem(p), options(o), candidates(p, o.trimming) {}

VectorXd Search::gains_at(const VectorXd& y) const {
  VectorXd g(y.size());
  for (Index j = 0; j < y.size(); ++j) {
    const FreeGain& gain = problem.gains[std::size_t(j)];
    const double share = std::clamp(y[j], 0.0, 1.0);
    g[j] = gain.logarithmic ? gain.lower * std::pow(gain.upper / gain.lower, share)
                            : gain.lower + share * (gain.upper - gain.lower);
    g[j] = std::clamp(g[j], gain.lower, gain.upper);
  }
  return g;
}

VectorXd Search::scales_at(const VectorXd& y) const {
  const VectorXd g = gains_at(y);
  VectorXd scale(y.size());
  for (Index j = 0; j < y.size(); ++j) {
    const FreeGain& gain = problem.gains[std::size_t(j)];
    scale[j] = gain.logarithmic ? g[j] * std::log(gain.upper / gain.lower) : gain.upper - gain.lower;
  }
  return scale;
}

const Search::Seen& Search::evaluate(const VectorXd& y, bool slopes) {
  const bool known = last.y.size() == y.size() && last.y == y && (last_has_slopes_ || !slopes);
  if (known) return last;
  interrupted = options.stop.stop_requested();
  out_of_evaluations = evaluations >= options.evaluations;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begun_;
  out_of_time = options.seconds > 0 && spent.count() > options.seconds;
  if (interrupted || out_of_evaluations || out_of_time) throw EndSearch{};
  ++evaluations;
  last = {y, candidates.at(gains_at(y), slopes), {}};
  last.merit = merit(problem, last.points);
  last_has_slopes_ = slopes;
  if (best.y.size() == 0 || best.merit < last.merit) best = last;
  if (options.observe) options.observe({evaluations, best.merit.goal, best.merit.feasible});
  return last;
}

namespace {

// ---- the epigraph form: max t, every eigenvalue of every point keeping t and the limits ----

// Unknowns (y, t). Constraints, none positive where all is well: for each point and eigenvalue the
// goal's, then each limit's. Of a pair the upper member alone is asked.
struct Epigraph {
  Search& search;
  Index n;                   // gains
  std::vector<Index> states; // eigenvalues of each point

  explicit Epigraph(Search& s) : search(s), n(s.gains()) {
    for (const SweepRequest& r : s.problem.points) states.push_back(std::ssize(r.model.states));
  }
  Index per_eigenvalue() const { return 1 + std::ssize(search.problem.limits); }
  Index count() const {
    Index all = 0;
    for (const Index k : states) all += k * per_eigenvalue();
    return all;
  }

  // Row `row` of c and J: sign (value - level) <= 0 turned about; d of the level along t is dt.
  void put(Index row, Measure what, Complex lambda, const Eigen::RowVectorXcd& slope, double level,
           double size, bool with_t, VectorXd& c, MatrixXd* J) const {
    const Measured m = measure(what, lambda);
    const double sign = better(what) / size;
    c[row] = sign * (level - m.value);
    if (!J) return;
    for (Index j = 0; j < n; ++j)
      (*J)(row, j) = -sign * (std::conj(m.slope) * slope[j]).real();
    if (with_t) (*J)(row, n) = sign;
  }

  void constraints(const VectorXd& x, VectorXd& c, MatrixXd* J) const {
    const VectorXd y = x.head(n);
    const Search::Seen& seen = search.evaluate(y, J != nullptr);
    const VectorXd scale = search.scales_at(y);
    const TuneProblem& problem = search.problem;
    constexpr double kept = -1.0, hopeless = 1e3;
    Index row = 0;
    for (std::size_t p = 0; p < states.size(); ++p) {
      const PointModes& point = seen.points[p];
      for (Index i = 0; i < states[p]; ++i) {
        if (!point.valid() || point.eigenvalues[i].imag() < 0) {
          c.segment(row, per_eigenvalue()).setConstant(point.valid() ? kept : hopeless);
          row += per_eigenvalue();
          continue;
        }
        Eigen::RowVectorXcd slope;
        if (J) slope = point.slopes.row(i).cwiseProduct(scale.transpose().cast<Complex>());
        const Complex lambda = point.eigenvalues[i];
        const double t = better(problem.goal) * x[n];
        put(row++, problem.goal, lambda, slope, t, 1.0, true, c, J);
        if (J) (*J)(row - 1, n) = 1.0;
        for (const Requirement& r : problem.limits)
          put(row++, r.measure, lambda, slope, r.limit, std::max(std::abs(r.limit), 1e-3), false, c,
              J);
      }
    }
  }
};

Optimizer named(GlobalSearch algorithm) {
  switch (algorithm) {
    case GlobalSearch::isres:
      return Optimizer::isres;
    case GlobalSearch::esch:
      return Optimizer::esch;
    case GlobalSearch::direct:
      return Optimizer::direct;
    case GlobalSearch::mlsl:
      return Optimizer::mlsl;
    default:
      return Optimizer::crs2;
  }
}

VectorXd random_point(std::mt19937_64& random, Index n) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  VectorXd y(n);
  for (double& v : y) v = uniform(random);
  return y;
}

// Local searches from the best of many random points, while the budget lasts.
void from_many_starts(Search& search) {
  constexpr int samples = 40, steps = 120;
  std::mt19937_64 random(search.options.seed);
  const long end = search.options.evaluations * 3 / 4;
  while (search.evaluations < end) {
    Search::Seen start;
    for (int i = 0; i < samples; ++i) {
      const Search::Seen& seen = search.evaluate(random_point(random, search.gains()), false);
      if (start.y.size() == 0 || start.merit < seen.merit) start = seen;
    }
    search_locally(search, start.y, search.options.local, steps);
  }
}

}  // namespace

void search_globally(Search& search) {
  const Index n = search.gains();
  if (search.options.global == GlobalSearch::multistart) return from_many_starts(search);
  std::mt19937_64 random(search.options.seed);
  Optimization o;
  o.algorithm = named(search.options.global);
  o.start = random_point(random, n);
  o.lower = VectorXd::Zero(n);
  o.upper = VectorXd::Ones(n);
  o.objective = [&](const VectorXd& y, VectorXd*) { return -search.evaluate(y, false).merit.value(); };
  o.evaluations = int(search.options.evaluations / 2);
  o.seed = search.options.seed;
  o.step_tolerance = 1e-6;
  optimize(o);
}

void search_locally(Search& search, const VectorXd& y, LocalSearch local, int evaluations) {
  const Index n = search.gains();
  Optimization o;
  o.evaluations = evaluations;
  if (local == LocalSearch::bobyqa) {
    o.algorithm = Optimizer::bobyqa;
    o.start = y;
    o.lower = VectorXd::Zero(n);
    o.upper = VectorXd::Ones(n);
    o.first_step = 0.05;
    o.objective = [&](const VectorXd& at, VectorXd*) {
      return -search.evaluate(at, false).merit.value();
    };
    return optimize(o);
  }
  const Epigraph epigraph(search);
  constexpr double far = 1e3;
  o.algorithm = local == LocalSearch::slsqp ? Optimizer::slsqp : Optimizer::cobyla;
  o.start.resize(n + 1);
  const Merit at_start = search.evaluate(y, false).merit;
  o.start << y, std::isfinite(at_start.goal) ? at_start.goal : 0.0;
  o.lower = VectorXd::Zero(n + 1);
  o.upper = VectorXd::Ones(n + 1);
  o.lower[n] = -far;
  o.upper[n] = far;
  o.objective = [n](const VectorXd& x, VectorXd* slope) {
    if (slope) {
      slope->setZero();
      (*slope)[n] = -1.0;
    }
    return -x[n];
  };
  o.inequalities = epigraph.count();
  o.inequality = [&](const VectorXd& x, VectorXd& c, MatrixXd* J) { epigraph.constraints(x, c, J); };
  optimize(o);
}

bool search_coalesced(Search&, double, int) { return false; }

}  // namespace tiltrim
