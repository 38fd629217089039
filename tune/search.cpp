#include "tune/search.hpp"

#include <algorithm>
#include <cmath>

#include "optimize/optimize.hpp"

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

std::string to_string(GlobalSearch algorithm) {
  switch (algorithm) {
    case GlobalSearch::crs2:
      return "crs2";
    case GlobalSearch::isres:
      return "isres";
    case GlobalSearch::esch:
      return "esch";
    case GlobalSearch::direct:
      return "direct";
    case GlobalSearch::mlsl:
      return "mlsl";
    case GlobalSearch::multistart:
      return "multistart";
  }
  return "unknown";
}

std::string to_string(LocalSearch algorithm) {
  switch (algorithm) {
    case LocalSearch::slsqp:
      return "slsqp";
    case LocalSearch::bobyqa:
      return "bobyqa";
    case LocalSearch::cobyla:
      return "cobyla";
  }
  return "unknown";
}

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
    scale[j] =
        gain.logarithmic ? g[j] * std::log(gain.upper / gain.lower) : gain.upper - gain.lower;
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
  keep();
  if (options.observe) options.observe({evaluations, best.merit.goal, best.merit.feasible});
  return last;
}

// One candidate for each neighbourhood, a dozen in all.
void Search::keep() {
  constexpr double wide = 0.25;  // of each gain's range
  constexpr std::size_t most = 12;
  if (kept.size() == most && !(kept.back().merit < last.merit)) return;
  const auto near = [&](const Seen& other) {
    return (other.y - last.y).lpNorm<Eigen::Infinity>() < wide;
  };
  if (std::ranges::any_of(kept, [&](const Seen& k) { return near(k) && !(k.merit < last.merit); }))
    return;
  std::erase_if(kept, near);
  kept.push_back(last);
  std::ranges::stable_sort(kept, [](const Seen& a, const Seen& b) { return b.merit < a.merit; });
  if (kept.size() > most) kept.pop_back();
}

namespace {

// ---- the epigraph form: max t, every eigenvalue of every point keeping t and the limits ----

// Of two that meet, the middle m and D = ((λ₁ - λ₂)/2)² are smooth where they themselves are not.
struct Twin {
  Index first, second;
  Complex middle, D;
  Eigen::RowVectorXcd middle_slope, D_slope;
};

Twin twin_at(const PointModes& point, const Meeting& meeting, bool slopes) {
  const auto distance = [&](Index i) {
    const Complex z = point.eigenvalues[i];
    const bool other_side = !meeting.real && z.imag() < 0;
    return other_side ? std::numeric_limits<double>::infinity() : std::abs(z - meeting.middle);
  };
  Twin twin{0, 1, {}, {}, {}, {}};
  if (distance(1) < distance(0)) std::swap(twin.first, twin.second);
  for (Index i = 2; i < point.eigenvalues.size(); ++i) {
    if (distance(i) < distance(twin.second)) twin.second = i;
    if (distance(twin.second) < distance(twin.first)) std::swap(twin.first, twin.second);
  }
  const Complex a = point.eigenvalues[twin.first], b = point.eigenvalues[twin.second];
  const Complex half = 0.5 * (a - b);
  twin.middle = 0.5 * (a + b);
  twin.D = half * half;
  if (!slopes) return twin;
  twin.middle_slope = 0.5 * (point.slopes.row(twin.first) + point.slopes.row(twin.second));
  twin.D_slope = half * (point.slopes.row(twin.first) - point.slopes.row(twin.second));
  return twin;
}

// Unknowns (y, t). Constraints, none positive where all is well: for each point and eigenvalue the
// goal's, then each limit's. Of a pair the upper member alone is asked; of two that meet, their
// middle, and that on the real axis they stay a pair (D < 0), off it that they are one (D = 0).
struct Epigraph {
  Search& search;
  std::vector<Meeting> meetings{};
  Index n = search.gains();

  static constexpr double kept = -1.0, hopeless = 1e3;
  static constexpr double apart = 1e-5;  // rad/s, of a pair that is to stay one

  Index states(std::size_t point) const {
    return std::ssize(search.problem.points[point].model.states);
  }
  Index per_eigenvalue() const { return 1 + std::ssize(search.problem.limits); }
  Index count() const {
    Index all = 0;
    for (std::size_t p = 0; p < search.problem.points.size(); ++p) all += states(p);
    return all * per_eigenvalue();
  }
  Index equalities() const { return 2 * std::ranges::count(meetings, false, &Meeting::real); }

  // The goal's row and the limits' of an eigenvalue, or of the middle of two.
  void ask(Index& row, Complex lambda, const Eigen::RowVectorXcd& slope, const VectorXd& x,
           VectorXd& c, MatrixXd* J) const {
    const TuneProblem& problem = search.problem;
    const auto put = [&](Measure what, double level, double size) {
      const Measured m = measure(what, lambda);
      const double sign = better(what) / size;
      c[row] = sign * (level - m.value);
      for (Index j = 0; J && j < n; ++j)
        (*J)(row, j) = -sign * (std::conj(m.slope) * slope[j]).real();
      ++row;
    };
    put(problem.goal, better(problem.goal) * x[n], 1.0);
    if (J) (*J)(row - 1, n) = 1.0;
    for (const Requirement& r : problem.limits)
      put(r.measure, r.limit, std::max(std::abs(r.limit), 1e-3));
  }

  void inequalities(const VectorXd& x, VectorXd& c, MatrixXd* J) const {
    const Search::Seen& seen = search.evaluate(x.head(n), J != nullptr);
    const VectorXcd scale = search.scales_at(x.head(n)).cast<Complex>();
    Index row = 0;
    for (std::size_t p = 0; p < seen.points.size(); ++p) {
      const PointModes& point = seen.points[p];
      std::vector<const Meeting*> own;
      std::vector<Twin> twins;
      for (const Meeting& m : meetings)
        if (m.point == p && point.valid()) {
          own.push_back(&m);
          twins.push_back(twin_at(point, m, J != nullptr));
        }
      for (Index i = 0; i < states(p); ++i) {
        const auto among = [&](const Twin& t) { return t.first == i || t.second == i; };
        const auto twin = std::ranges::find_if(twins, among);
        if (!point.valid()) {
          c.segment(row, per_eigenvalue()).setConstant(hopeless);
          row += per_eigenvalue();
        } else if (twin != twins.end() && twin->first == i) {
          Eigen::RowVectorXcd slope;
          if (J) slope = twin->middle_slope.cwiseProduct(scale.transpose());
          ask(row, twin->middle, slope, x, c, J);
        } else if (twin != twins.end()) {
          c.segment(row, per_eigenvalue()).setConstant(kept);
          if (own[std::size_t(twin - twins.begin())]->real) {
            c[row] = twin->D.real() + apart * apart;
            for (Index j = 0; J && j < n; ++j) (*J)(row, j) = (twin->D_slope[j] * scale[j]).real();
          }
          row += per_eigenvalue();
        } else if (point.eigenvalues[i].imag() < 0) {
          c.segment(row, per_eigenvalue()).setConstant(kept);
          row += per_eigenvalue();
        } else {
          Eigen::RowVectorXcd slope;
          if (J) slope = point.slopes.row(i).cwiseProduct(scale.transpose());
          ask(row, point.eigenvalues[i], slope, x, c, J);
        }
      }
    }
  }

  void equal(const VectorXd& x, VectorXd& e, MatrixXd* J) const {
    const Search::Seen& seen = search.evaluate(x.head(n), J != nullptr);
    const VectorXcd scale = search.scales_at(x.head(n)).cast<Complex>();
    Index row = 0;
    for (const Meeting& m : meetings) {
      if (m.real) continue;
      const PointModes& point = seen.points[m.point];
      if (!point.valid()) {
        e.segment(row, 2).setConstant(hopeless);
      } else {
        const Twin twin = twin_at(point, m, J != nullptr);
        e[row] = twin.D.real();
        e[row + 1] = twin.D.imag();
        for (Index j = 0; J && j < n; ++j) {
          const Complex slope = twin.D_slope[j] * scale[j];
          (*J)(row, j) = slope.real();
          (*J)(row + 1, j) = slope.imag();
        }
      }
      row += 2;
    }
  }

  // Within `radius` of y.
  void run(VectorXd y, double t, Optimizer algorithm, double radius, int evaluations) const {
    constexpr double far = 1e3;
    Optimization o;
    o.algorithm = algorithm;
    o.evaluations = evaluations;
    o.start.resize(n + 1);
    o.start << y, t;
    o.lower.resize(n + 1);
    o.upper.resize(n + 1);
    o.lower << (y.array() - radius).max(0.0), -far;
    o.upper << (y.array() + radius).min(1.0), far;
    o.objective = [this](const VectorXd& x, VectorXd* slope) {
      if (slope) *slope = -VectorXd::Unit(n + 1, n);
      return -x[n];
    };
    o.inequalities = count();
    o.inequality = [this](const VectorXd& x, VectorXd& c, MatrixXd* J) { inequalities(x, c, J); };
    o.equalities = equalities();
    o.equality = [this](const VectorXd& x, VectorXd& e, MatrixXd* J) { equal(x, e, J); };
    o.constraint_tolerance = 1e-11;
    optimize(o);
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
  constexpr int samples = 20, steps = 60;
  std::mt19937_64 random(search.options.seed);
  const long end = search.options.evaluations / 2;
  while (search.evaluations < end) {
    Search::Seen start;
    for (int i = 0; i < samples; ++i) {
      const Search::Seen& seen = search.evaluate(random_point(random, search.gains()), false);
      if (start.y.size() == 0 || start.merit < seen.merit) start = seen;
    }
    search_locally(search, start.y, search.options.local, 1.0, steps);
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
  o.objective = [&](const VectorXd& y, VectorXd*) {
    return -search.evaluate(y, false).merit.value();
  };
  o.evaluations = int(search.options.evaluations / 3);
  o.seed = search.options.seed;
  o.step_tolerance = 1e-6;
  optimize(o);
}

void search_locally(Search& search, VectorXd y, LocalSearch local, double radius, int evaluations) {
  Optimization o;
  o.evaluations = evaluations;
  if (local == LocalSearch::bobyqa) {
    o.algorithm = Optimizer::bobyqa;
    o.start = y;
    o.lower = (y.array() - radius).max(0.0);
    o.upper = (y.array() + radius).min(1.0);
    o.first_step = 0.05;
    o.objective = [&](const VectorXd& at, VectorXd*) {
      return -search.evaluate(at, false).merit.value();
    };
    return optimize(o);
  }
  const Merit at_start = search.evaluate(y, false).merit;
  Epigraph{search}.run(y, std::isfinite(at_start.goal) ? at_start.goal : 0.0,
                       local == LocalSearch::slsqp ? Optimizer::slsqp : Optimizer::cobyla, radius,
                       evaluations);
}

// Eigenvalues that decide, or nearly, and are near to each other.
std::vector<Meeting> meetings_at(const Search& search, double within) {
  std::vector<Meeting> found;
  const Search::Seen& best = search.best;
  for (std::size_t p = 0; p < best.points.size(); ++p) {
    const Eigen::VectorXcd& lambda = best.points[p].eigenvalues;
    const auto decides = [&](Index i) {
      const double value =
          better(search.problem.goal) * measure(search.problem.goal, lambda[i]).value;
      return value <= best.merit.goal + within;
    };
    for (Index i = 0; i < lambda.size(); ++i)
      for (Index k = 0; k < i; ++k) {
        if (!decides(i) || !decides(k) || std::abs(lambda[i] - lambda[k]) > 2 * within) continue;
        const bool pair = lambda[i] == std::conj(lambda[k]) && lambda[i].imag() != 0;
        const bool real = pair || (lambda[i].imag() == 0 && lambda[k].imag() == 0);
        const bool upper = lambda[i].imag() > 0 && lambda[k].imag() > 0;
        if (real || upper) found.push_back({p, 0.5 * (lambda[i] + lambda[k]), real});
      }
  }
  return found;
}

bool search_coalesced(Search& search, double within, double radius, int evaluations) {
  if (!search.best.merit.trimmed) return false;
  const double before = search.best.merit.value();
  const std::vector<Meeting> meetings = meetings_at(search, within);
  if (meetings.empty()) return false;
  Epigraph{search, meetings}.run(search.best.y, search.best.merit.goal, Optimizer::slsqp, radius,
                                 evaluations);
  return search.best.merit.value() > before;
}

}  // namespace tiltrim
