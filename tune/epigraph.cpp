#include "tune/epigraph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// For two eigenvalues that coalesce, the mean m and D = ((λ₁ - λ₂)/2)² remain smooth.
struct Twin {
  Index first, second;
  Complex middle, D;
  Eigen::RowVectorXcd middle_slope, D_slope;
};

Twin twin_at(const PlaceModes& place, const Meeting& meeting, bool slopes) {
  const auto distance = [&](Index i) {
    const Complex z = place.eigenvalues[i];
    const bool other_side = !meeting.real && z.imag() < 0;
    return other_side ? std::numeric_limits<double>::infinity() : std::abs(z - meeting.middle);
  };
  Twin twin{0, 1, {}, {}, {}, {}};
  if (distance(1) < distance(0)) std::swap(twin.first, twin.second);
  for (Index i = 2; i < place.eigenvalues.size(); ++i) {
    if (distance(i) < distance(twin.second)) twin.second = i;
    if (distance(twin.second) < distance(twin.first)) std::swap(twin.first, twin.second);
  }
  const Complex a = place.eigenvalues[twin.first], b = place.eigenvalues[twin.second];
  const Complex half = 0.5 * (a - b);
  twin.middle = 0.5 * (a + b);
  twin.D = half * half;
  if (!slopes) return twin;
  twin.middle_slope = 0.5 * (place.slopes.row(twin.first) + place.slopes.row(twin.second));
  twin.D_slope = half * (place.slopes.row(twin.first) - place.slopes.row(twin.second));
  return twin;
}

// Unknowns (y, t). Constraints, feasible if <= 0: for each place and eigenvalue the goal's, then
// each limit's, then those on the whole system; at places far from their limits where the search
// starts, only those on the worst eigenvalue. A pair is represented by its upper member; two
// eigenvalues that coalesce by their mean, with a constraint that on the real axis they stay a pair
// (D < 0), and off it that they are equal (D = 0).
struct Epigraph {
  Search& search;
  std::vector<Meeting> meetings{};
  bool limits_only = false;  // t is minus the largest violation
  Index n = search.variables();
  Eigen::RowVectorXd none{};
  std::vector<char> near{};  // [place] where the search starts

  static constexpr double kept = -1.0, hopeless = 1e3;
  static constexpr Index per_variable = 3;  // near places
  static constexpr double apart = 1e-5;     // rad/s, separation of a pair that must stay complex

  Index states(std::size_t place) const {
    return std::ssize(search.candidates.places()[place].request.model.states);
  }
  // Number of requirements on every eigenvalue, and of those on the whole system.
  Index per_eigenvalue() const {
    return std::ranges::count_if(search.asked(), spectral, &Requirement::measure);
  }
  Index per_place(std::size_t place) const {
    const Index eigenvalues = near[place] ? states(place) : 1;
    return eigenvalues * per_eigenvalue() + std::ssize(search.asked()) - per_eigenvalue();
  }
  Index count() const {
    Index all = 0;
    for (std::size_t p = 0; p < near.size(); ++p) all += per_place(p);
    return all;
  }
  Index equalities() const { return 2 * std::ranges::count(meetings, false, &Meeting::real); }

  // The constraints row by row, and their derivatives if J is given.
  struct Rows {
    const VectorXd& x;
    VectorXd& c;
    MatrixXd* J;
    Index next = 0;
  };

  // Adds requirement i, with score `own` and derivative `slope` with respect to the variables.
  void put(Rows& rows, std::size_t i, double own, const Eigen::RowVectorXd& slope) const {
    const Requirement& r = search.asked()[i];
    const bool goal = search.candidates.is_goal(i);
    if (limits_only && goal) return skip(rows, 1, kept);
    const double size = goal ? 1.0 / goal_slope(search.problem, r) : size_of(r);
    const double short_of =
        goal ? rows.x[n] - goal_score(search.problem, r, own) : missed_by(r, own);
    const double relaxed = limits_only ? rows.x[n] : 0.0;
    rows.c[rows.next] = std::clamp(short_of + relaxed, -hopeless, hopeless);
    if (rows.J) {
      rows.J->row(rows.next).head(n).setZero();
      if (slope.size() > 0 && slope.allFinite()) rows.J->row(rows.next).head(n) = -slope / size;
      if (goal || limits_only) (*rows.J)(rows.next, n) = 1.0;
    }
    ++rows.next;
  }

  void ask(Rows& rows, Complex lambda, const Eigen::RowVectorXcd& slope) const {
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      if (!spectral(search.asked()[i].measure)) continue;
      const Scored s = score(search.asked()[i], lambda);
      put(rows, i, s.score, slope.size() > 0 ? (std::conj(s.slope) * slope).real().eval() : none);
    }
  }

  // A constraint for each requirement on the whole system, or for each of all: that of the worst
  // eigenvalue.
  void ask_as_a_whole(Rows& rows, const PlaceModes& place, const VectorXd& scale, bool all) const {
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      const Requirement& r = search.asked()[i];
      if (spectral(r.measure) && !all) continue;
      const double own = worst(i, r, place).score;
      if (std::isnan(own)) {  // not applicable here
        skip(rows, 1, kept);
        continue;
      }
      put(rows, i, own,
          rows.J && place.has_slopes()
              ? score_slope(i, r, place).cwiseProduct(scale.transpose()).eval()
              : none);
    }
  }

  // How far a place is from its limits, and its goal from `level`, relative to their sizes.
  double slack(const PlaceModes& place, double level) const {
    double least = std::numeric_limits<double>::infinity();
    const bool reserves = !search.problem.goals.empty();  // relative already
    const double goal_size = reserves ? 1.0 : std::max(std::abs(level), 1e-3);
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      const Requirement& r = search.asked()[i];
      const double own = worst(i, r, place).score;
      const double left = search.candidates.is_goal(i)
                              ? (goal_score(search.problem, r, own) - level) / goal_size
                              : -missed_by(r, own);
      if (left < least) least = left;
    }
    return least;
  }

  // The places where limits or goal may soon be active, and where eigenvalues are kept together.
  std::vector<std::size_t> nearest(const Search::Seen& seen, double level) const {
    std::vector<std::size_t> order(seen.places.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto most = std::size_t(per_variable * (n + 1));
    if (order.size() <= most) return order;
    std::vector<double> left;
    for (const PlaceModes& place : seen.places) left.push_back(slack(place, level));
    for (const Meeting& m : meetings) left[m.place] = -std::numeric_limits<double>::infinity();
    std::ranges::stable_sort(order, {}, [&](std::size_t p) { return left[p]; });
    order.resize(most);
    return order;
  }

  // A candidate, if asked for with derivatives where they may matter: at the other places they
  // count as zero.
  const Search::Seen& seen_at(const VectorXd& y, double level, bool slopes) const {
    const Search::Seen& seen = search.evaluate(y);
    return slopes ? search.with_slopes(nearest(seen, level)) : seen;
  }

  static void skip(Rows& rows, Index count, double value) {
    rows.c.segment(rows.next, count).setConstant(value);
    rows.next += count;
  }

  void inequalities(const VectorXd& x, VectorXd& c, MatrixXd* J) const {
    const Search::Seen& seen = seen_at(x.head(n), x[n], J != nullptr);
    const VectorXd scale = search.scales_at(x.head(n));
    const Eigen::RowVectorXcd scales = scale.transpose().cast<Complex>();
    Rows rows{x, c, J};
    for (std::size_t p = 0; p < seen.places.size(); ++p) {
      const PlaceModes& place = seen.places[p];
      if (!place.valid()) {
        skip(rows, per_place(p), hopeless);
        continue;
      }
      if (!near[p]) {
        ask_as_a_whole(rows, place, scale, true);
        continue;
      }
      std::vector<const Meeting*> own;
      std::vector<Twin> twins;
      for (const Meeting& m : meetings)
        if (m.place == p) {
          own.push_back(&m);
          twins.push_back(twin_at(place, m, J && place.has_slopes()));
        }
      for (Index i = 0; i < states(p); ++i) {
        const auto among = [&](const Twin& t) { return t.first == i || t.second == i; };
        const auto twin = std::ranges::find_if(twins, among);
        Eigen::RowVectorXcd slope;
        if (twin != twins.end() && twin->first == i) {
          if (J && place.has_slopes()) slope = twin->middle_slope.cwiseProduct(scales);
          ask(rows, twin->middle, slope);
        } else if (twin != twins.end()) {
          const Index row = rows.next;
          skip(rows, per_eigenvalue(), kept);
          if (!own[std::size_t(twin - twins.begin())]->real) continue;
          c[row] = twin->D.real() + apart * apart;
          if (J && place.has_slopes())
            J->row(row).head(n) = twin->D_slope.cwiseProduct(scales).real();
        } else if (place.eigenvalues[i].imag() < 0) {
          skip(rows, per_eigenvalue(), kept);
        } else {
          if (J && place.has_slopes()) slope = place.slopes.row(i).cwiseProduct(scales);
          ask(rows, place.eigenvalues[i], slope);
        }
      }
      ask_as_a_whole(rows, place, scale, false);
    }
  }

  void equal(const VectorXd& x, VectorXd& e, MatrixXd* J) const {
    const Search::Seen& seen = seen_at(x.head(n), x[n], J != nullptr);
    const Eigen::RowVectorXcd scales = search.scales_at(x.head(n)).transpose().cast<Complex>();
    Index row = 0;
    for (const Meeting& m : meetings) {
      if (m.real) continue;
      const PlaceModes& place = seen.places[m.place];
      if (!place.valid()) {
        e.segment(row, 2).setConstant(hopeless);
      } else {
        const Twin twin = twin_at(place, m, J != nullptr);
        e[row] = twin.D.real();
        e[row + 1] = twin.D.imag();
        if (J) {
          const Eigen::RowVectorXcd slope = twin.D_slope.cwiseProduct(scales);
          J->row(row).head(n) = slope.real();
          J->row(row + 1).head(n) = slope.imag();
        }
      }
      row += 2;
    }
  }

  // Searches within `radius` of y.
  void run(VectorXd y, double t, Optimizer algorithm, double radius, int evaluations) {
    constexpr double far = 1e3, reserve = 1e-3;
    const Search::Seen& start = search.evaluate(y);
    near.assign(start.places.size(), false);
    for (const std::size_t p : nearest(start, t)) near[p] = true;
    Optimization o;
    o.algorithm = algorithm;
    o.evaluations = evaluations;
    o.start.resize(n + 1);
    o.start << y, t;
    o.lower.resize(n + 1);
    o.upper.resize(n + 1);
    o.lower << (y.array() - radius).max(0.0), -far;
    o.upper << (y.array() + radius).min(1.0), limits_only ? reserve : far;
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

}  // namespace

void search_epigraph(Search& search, const std::vector<Meeting>& meetings, const VectorXd& y,
                     double t, Optimizer algorithm, double radius, int evaluations) {
  Epigraph{search, meetings}.run(y, t, algorithm, radius, evaluations);
}

void meet_limits(Search& search, const VectorXd& y, Optimizer algorithm, double radius,
                 int evaluations) {
  Epigraph{search, {}, true}.run(y, -search.evaluate(y).merit.missed, algorithm, radius,
                                 evaluations);
}

}  // namespace tiltrim
