// Envelopes of known regions and of the tiltrotor, by independent methods; all equilibria of a
// condition.
#include "follow/envelope.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>

#include "follow/curve.hpp"
#include "model/exact.hpp"
#include "model/lookup.hpp"
#include "study/analyses.hpp"
#include "study/reference_vehicle.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

using namespace tiltrim;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace envelope_test {

static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
static constexpr double degree = std::numbers::pi / 180;
static constexpr double located = 1e-9;  // of an end or corner: convergence of Newton's method

// ---- regions known in closed form ----

using Rate = std::function<double(double x, double a, double b)>;

// x' = rate(x, a, b), with an output d = a - b.
static Model scalar(const Rate& rate) {
  Model m = flow({"x"}, {"a", "b"}, [rate](const VectorXd& x, const VectorXd& p) {
    return vec({rate(x[0], p[0], p[1])});
  });
  m.outputs = {{"d", "", 1.0}};
  m.h = [](const VectorXd&, const VectorXd&, const VectorXd& p) { return vec({p[0] - p[1]}); };
  return m;
}

namespace {

struct Region {
  Rate rate;
  std::map<std::string, Range> bounds{};
  Range a{-1.5, 1.5}, b{-1.5, 1.5};
  int count = 21;
};

}  // namespace

static const TrimSpec equilibrium{.free = {"x"}, .steady = {"x"}};
static const OperatingPoint origin{vec({0.5}), {}, vec({0, 0})};

// Consistency checks for every envelope.
static Envelope explored(const Region& r, const EnvelopeOptions& options = {}) {
  const Model m = scalar(r.rate);
  TrimSpec spec = equilibrium;
  spec.bounds = r.bounds;
  const Envelope e =
      envelope(m, spec, origin, {"a", r.a, r.count}, {"b", r.b, r.count + 2}, options);
  REQUIRE(e.count.rows() == r.count);
  REQUIRE(e.count.cols() == r.count + 2);
  CHECK(e.rows.size() == options.rows.size());
  for (const BorderPiece& piece : e.pieces)
    for (const BorderPiece::Point& p : piece.points) {
      CHECK_NEAR(evaluate(m, p.point).rates[0], 0.0, 1e-10);
      CHECK(p.residual <= 1e-10);
      CHECK(p.x == p.point.p[0]);
      CHECK(p.y == p.point.p[1]);
      CHECK_NEAR(p.outputs[0], p.x - p.y, 1e-15);
    }
  return e;
}

static double at(const EnvelopeAxis& axis, int k) {
  return axis.range.lower + (axis.range.upper - axis.range.lower) * k / (axis.count - 1);
}

// The number of trims at every grid point except within 1e-6 of a change.
static void check_count(const Envelope& e, const std::function<int(double a, double b)>& expected) {
  int wrong = 0;
  for (int i = 0; i < e.x.count; ++i)
    for (int j = 0; j < e.y.count; ++j) {
      const double a = at(e.x, i), b = at(e.y, j), near = 1e-6;
      const int here = expected(a, b);
      const bool clear = expected(a + near, b) == here && expected(a - near, b) == here &&
                         expected(a, b + near) == here && expected(a, b - near) == here;
      wrong += clear && e.count(i, j) != here;
    }
  CHECK(wrong == 0);
}

static void check_row(const EnvelopeRow& row, std::initializer_list<EnvelopeInterval> expected) {
  REQUIRE(row.intervals.size() == expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const EnvelopeInterval &found = row.intervals[k], &known = expected.begin()[k];
    CHECK(found.from.name == known.from.name);
    CHECK(found.to.name == known.to.name);
    CHECK_NEAR(found.from.x, known.from.x, located);
    CHECK_NEAR(found.to.x, known.to.x, located);
  }
}

static const BorderPiece& piece(const Envelope& e, const std::string& name) {
  const auto found = std::ranges::find(e.pieces, name, &BorderPiece::name);
  REQUIRE(found != e.pieces.end());
  return *found;
}

static bool all_outer(const BorderPiece& p, bool outer) {
  return std::ranges::all_of(p.points,
                             [&](const BorderPiece::Point& b) { return b.outer == outer; });
}

static double circle(double x, double a, double b) { return x * x + a * a + b * b - 1; }

TEST_CASE("a disc bounded by a fold: x² = 1 - a² - b²" * thorough) {
  for (const int count : {11, 21, 30}) {
    CAPTURE(count);
    const Envelope e =
        explored({.rate = circle, .count = count}, {.rows = {-1.2, -0.6, 0, 0.3, 0.8}});
    CHECK(e.status == EnvelopeStatus::complete);
    REQUIRE(e.pieces.size() == 1);
    CHECK(e.pieces[0].name == "fold");
    CHECK(e.pieces[0].from == "loop");
    CHECK(e.pieces[0].to == "loop");
    CHECK(all_outer(e.pieces[0], true));
    for (const BorderPiece::Point& p : e.pieces[0].points)
      CHECK_NEAR(std::hypot(p.x, p.y), 1.0, located);
    check_count(e, [](double a, double b) { return std::hypot(a, b) < 1 ? 2 : 0; });
    for (const EnvelopeRow& row : e.rows)
      if (const double half = std::sqrt(1 - row.y * row.y); half > 0)
        check_row(row, {{{-half, "fold"}, {half, "fold"}}});
      else
        check_row(row, {});
  }
}

TEST_CASE("a limit within the disc: the sheet that is cut off, where the other is there or not" *
          thorough) {
  const double least = -0.5, r = std::sqrt(0.75);
  const Envelope both = explored({.rate = circle, .bounds = {{"x", {least, 5}}}}, {.rows = {0}});
  REQUIRE(both.pieces.size() == 2);
  CHECK(all_outer(piece(both, "fold"), true));
  CHECK(all_outer(piece(both, "x lower"), false));
  for (const BorderPiece::Point& p : piece(both, "x lower").points)
    CHECK_NEAR(std::hypot(p.x, p.y), r, located);
  check_count(both, [&](double a, double b) {
    const double s = std::hypot(a, b);
    return s < r ? 1 : s < 1 ? 2 : 0;
  });
  check_row(both.rows[0], {{{-1, "fold"}, {1, "fold"}}});

  const Envelope upper = explored({.rate = circle, .bounds = {{"x", {-least, 5}}}}, {.rows = {0}});
  REQUIRE(upper.pieces.size() == 1);
  CHECK(all_outer(piece(upper, "x lower"), true));
  check_row(upper.rows[0], {{{-r, "x lower"}, {r, "x lower"}}});
}

TEST_CASE("a rectangle of limits: |a + b| <= 1 and -0.5 <= a - b <= 0.7") {
  const Envelope e = explored({.rate = [](double x, double a, double b) { return a + b - x; },
                               .bounds = {{"x", {-1, 1}}, {"d", {-0.5, 0.7}}}},
                              {.rows = {-0.6, 0, 0.3, 1}});
  REQUIRE(e.pieces.size() == 4);
  struct Side {
    std::string name, others[2];
    double sum[2], difference[2];  // a + b and a - b at its ends
  };
  for (const Side& s : {Side{"x lower", {"d lower", "d upper"}, {-1, -1}, {-0.5, 0.7}},
                        Side{"x upper", {"d lower", "d upper"}, {1, 1}, {-0.5, 0.7}},
                        Side{"d lower", {"x lower", "x upper"}, {-1, 1}, {-0.5, -0.5}},
                        Side{"d upper", {"x lower", "x upper"}, {-1, 1}, {0.7, 0.7}}}) {
    CAPTURE(s.name);
    BorderPiece p = piece(e, s.name);
    CHECK(all_outer(p, true));
    if (p.from != s.others[0]) {
      std::ranges::reverse(p.points);
      std::swap(p.from, p.to);
    }
    CHECK(p.from == s.others[0]);
    CHECK(p.to == s.others[1]);
    for (const int end : {0, 1}) {
      const BorderPiece::Point& corner = end == 0 ? p.points.front() : p.points.back();
      CHECK_NEAR(corner.x, 0.5 * (s.sum[end] + s.difference[end]), located);
      CHECK_NEAR(corner.y, 0.5 * (s.sum[end] - s.difference[end]), located);
    }
  }
  check_count(e, [](double a, double b) {
    return std::abs(a + b) < 1 && a - b > -0.5 && a - b < 0.7 ? 1 : 0;
  });
  check_row(e.rows[0], {{{-0.4, "x lower"}, {0.1, "d upper"}}});
  check_row(e.rows[1], {{{-0.5, "d lower"}, {0.7, "d upper"}}});
  check_row(e.rows[2], {{{-0.2, "d lower"}, {0.7, "x upper"}}});
  check_row(e.rows[3], {});
}

static double cusp(double x, double a, double b) { return a + b * x - x * x * x; }

TEST_CASE("a cusp: a trim everywhere, folds on 4 b³ = 27 a², all of them inner") {
  const Envelope e = explored({.rate = cusp, .a = {-1, 1}, .b = {-1, 1.5}}, {.rows = {-0.6, 0, 1}});
  CHECK(e.count.minCoeff() == 1);
  REQUIRE(e.pieces.size() == 1);
  CHECK(e.pieces[0].name == "fold");
  CHECK(e.pieces[0].from == "edge");
  CHECK(e.pieces[0].to == "edge");
  CHECK(all_outer(e.pieces[0], false));
  for (const BorderPiece::Point& p : e.pieces[0].points)
    CHECK_NEAR(4 * std::pow(p.y, 3), 27 * p.x * p.x, 1e-8);
  check_count(e, [](double a, double b) { return 4 * b * b * b > 27 * a * a ? 3 : 1; });
  for (const EnvelopeRow& row : e.rows) check_row(row, {{{-1, "edge"}, {1, "edge"}}});
}

TEST_CASE("two sheets, each within limits in part: inner where the other has a trim") {
  // x = 3 + a up to a = 0.25, x = b - 3 from b = -0.5 on.
  const Envelope e =
      explored({[](double x, double a, double b) { return (x - 3 - a) * (x + 3 - b); },
                {{"x", {-3.5, 3.25}}},
                {-1, 1},
                {-1, 1}},
               {.rows = {-0.75, 0.3}});
  REQUIRE(e.pieces.size() == 2);
  for (const BorderPiece::Point& p : piece(e, "x upper").points) {
    CHECK_NEAR(p.x, 0.25, located);
    if (std::abs(p.y + 0.5) > 1e-6) CHECK(p.outer == (p.y < -0.5));
  }
  for (const BorderPiece::Point& p : piece(e, "x lower").points) {
    CHECK_NEAR(p.y, -0.5, located);
    if (std::abs(p.x - 0.25) > 1e-6) CHECK(p.outer == (p.x > 0.25));
  }
  check_count(e, [](double a, double b) { return int(a < 0.25) + int(b > -0.5); });
  check_row(e.rows[0], {{{-1, "edge"}, {0.25, "x upper"}}});
  check_row(e.rows[1], {{{-1, "edge"}, {1, "edge"}}});
}

// ---- edges, refusals, models without finite values ----

TEST_CASE("a region that goes on beyond the plane ends at its edge") {
  const Envelope e = explored({.rate = circle, .a = {0, 1.5}}, {.rows = {-0.6, 1.2}});
  REQUIRE(e.pieces.size() == 1);
  CHECK(e.pieces[0].from == "edge");
  CHECK(e.pieces[0].to == "edge");
  for (const BorderPiece::Point* end : {&e.pieces[0].points.front(), &e.pieces[0].points.back()}) {
    CHECK_NEAR(end->x, 0.0, located);
    CHECK_NEAR(std::abs(end->y), 1.0, located);
  }
  check_row(e.rows[0], {{{0, "edge"}, {0.8, "fold"}}});
  check_row(e.rows[1], {});
}

TEST_CASE("islands of one sheet are all found, whatever the unit of the state") {
  for (const double size : {1.0, 10.0, 1000.0}) {
    CAPTURE(size);
    const Envelope e =
        explored({.rate = [size](double x, double a,
                                 double b) { return size * std::sin(6 * a) * std::sin(6 * b) - x; },
                  .bounds = {{"x", {0.6 * size, 2 * size}}},
                  .a = {-2, 2},
                  .b = {-2, 2},
                  .count = 41});
    CHECK(e.status == EnvelopeStatus::complete);
    CHECK(e.pieces.size() == 32);  // 8 x 8 peaks, every other one below zero
  }
}

TEST_CASE("more pieces of the boundary than are followed: said so") {
  // Hills and hollows of x = sin 22a sin 22b above and below the limits: some 440 holes.
  const auto hills = [](double x, double a, double b) {
    return std::sin(22 * a) * std::sin(22 * b) - x;
  };
  const Envelope e = explored({.rate = hills, .bounds = {{"x", {-0.5, 0.5}}}, .count = 81});
  CHECK(e.status == EnvelopeStatus::incomplete);
  CHECK(to_string(e.status) == "incomplete");
  CHECK(e.pieces.size() >= most_border_pieces);
}

TEST_CASE("a boundary longer than is followed: said so") {
  const auto plane = [](double x, double a, double) { return a - x; };
  const Envelope e = explored({.rate = plane, .bounds = {{"x", {-9, 0.5}}}, .b = {-1000, 1000}});
  CHECK(e.status == EnvelopeStatus::incomplete);
  CHECK(piece(e, "x upper").to == "too many points");
}

TEST_CASE("a boundary of hundreds of nominal sizes closes, x² = 1 - (a² + b²)/100² >= 0.04") {
  const auto hill = [](double x, double a, double b) { return 1 - (a * a + b * b) / 1e4 - x * x; };
  const Envelope e =
      explored({.rate = hill, .bounds = {{"x", {0.2, 2}}}, .a = {-200, 200}, .b = {-200, 200}});
  CHECK(e.status == EnvelopeStatus::complete);
  REQUIRE(e.pieces.size() == 1);
  CHECK(e.pieces[0].from == "loop");
  for (const BorderPiece::Point& p : e.pieces[0].points)
    CHECK_NEAR(std::hypot(p.x, p.y), std::sqrt(9600), 100 * located);
}

TEST_CASE("every status is reached") {
  const Region nowhere{.rate = [](double x, double a, double b) { return 2 + circle(x, a, b); }};
  SUBCASE("empty") {
    const Envelope e = explored(nowhere, {.rows = {0}});
    CHECK(e.status == EnvelopeStatus::empty);
    CHECK(to_string(e.status) == "empty");
    CHECK(e.count.maxCoeff() == 0);
    CHECK(e.pieces.empty());
    check_row(e.rows[0], {});
  }
  SUBCASE("interrupted before it began") {
    std::stop_source stop;
    stop.request_stop();
    const Envelope e = explored({.rate = circle}, {.stop = stop.get_token()});
    CHECK(e.status == EnvelopeStatus::interrupted);
  }
  SUBCASE("interrupted on the way") {
    std::stop_source stop;
    EnvelopeOptions options{.stop = stop.get_token()};
    double last = 0;
    options.observe = [&](double share) {
      CHECK(share >= last);
      CHECK(share <= 1);
      last = share;
      stop.request_stop();
    };
    CHECK(explored({.rate = cusp, .count = 30}, options).status == EnvelopeStatus::interrupted);
    CHECK(last > 0);
  }
}

TEST_CASE("no numbers in half of the plane: what is found elsewhere is verified" * thorough) {
  const auto half = [](const Rate& rate, bool throws) {
    return [=](double x, double a, double b) {
      if (a > 0.2 && throws) throw std::runtime_error("no");
      return a > 0.2 ? NaN : rate(x, a, b);
    };
  };
  for (const bool throws : {false, true}) {
    const Envelope e = explored({.rate = half(circle, throws)});
    CHECK(e.status == EnvelopeStatus::complete);
    check_count(e, [](double a, double b) { return a <= 0.2 && std::hypot(a, b) < 1 ? 2 : 0; });
    for (const BorderPiece::Point& p : piece(e, "fold").points) {
      CHECK_NEAR(std::hypot(p.x, p.y), 1.0, located);
      CHECK(p.x <= 0.2);
    }
    const Envelope none = explored({.rate = [&](double x, double a, double b) {
      return half(circle, throws)(x, a, b) + (throws ? 2 : NaN);
    }});
    CHECK(none.status == EnvelopeStatus::empty);
  }
}

// ---- the tiltrotor ----

static EnvelopeAnswer tiltrotor(const char* angle, int count, EnvelopeOptions options = {}) {
  EnvelopeTable table = envelope_over(angle);
  table.count = count;
  Condition level;
  level.asked = Command{10, 0, 0};
  return envelope(reference_vehicle(), level, table, options);
}

TEST_CASE("an envelope has the same bits on one thread and on three") {
  const auto on = [](int threads) {
    return tiltrotor("eta_deg", 12, {.rows = {0.4}, .threads = threads});
  };
  const EnvelopeAnswer a = on(1), b = on(3);
  REQUIRE(a.parts.size() == b.parts.size());
  for (std::size_t k = 0; k < a.parts.size(); ++k) {
    const Envelope &one = a.parts[k], &three = b.parts[k];
    CHECK(one.count == three.count);
    CHECK(one.evaluations == three.evaluations);
    REQUIRE(one.pieces.size() == three.pieces.size());
    for (std::size_t i = 0; i < one.pieces.size(); ++i) {
      const BorderPiece &p = one.pieces[i], &q = three.pieces[i];
      REQUIRE(p.points.size() == q.points.size());
      for (std::size_t j = 0; j < p.points.size(); ++j) {
        CHECK(p.points[j].point.x == q.points[j].point.x);
        CHECK(p.points[j].outer == q.points[j].outer);
      }
    }
    REQUIRE(one.rows.size() == three.rows.size());
    for (std::size_t i = 0; i < one.rows.size(); ++i) {
      REQUIRE(one.rows[i].intervals.size() == three.rows[i].intervals.size());
      for (std::size_t j = 0; j < one.rows[i].intervals.size(); ++j)
        CHECK(one.rows[i].intervals[j].to.x == three.rows[i].intervals[j].to.x);
    }
  }
}

// The trims at V and an angle from many starts, as seen by trim().
static std::vector<OperatingPoint> trims(const EnvelopeAnswer& a, double V, double angle) {
  Command c = *a.condition.command();
  c.V = V;
  (a.table.over.signal == "eta" ? c.eta : c.gamma) = angle;
  const TrimProblem p = closed_loop_problem(reference_vehicle(), c, Axes::wind);
  const TrimResult r =
      trim(p.model, p.spec, p.guess,
           {.method = TrimMethod::newton, .starts = 60, .max_boxes = 0, .closest = false});
  if (!r) return {};
  std::vector<OperatingPoint> all{r.point};
  all.insert(all.end(), r.others.begin(), r.others.end());
  return all;
}

// det ∂(rates held)/∂(unknowns) by central differences of the model's f.
static double determinant(const TrimProblem& problem, const OperatingPoint& point) {
  const Model& m = problem.model;
  const auto n = std::ssize(problem.spec.free);
  MatrixXd J(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto j = variable(m, problem.spec.free[std::size_t(k)]);
    const double h = 1e-5 * signal_of(m, j).nominal;
    OperatingPoint ahead = point, behind = point;
    set_value(ahead, j, value_of(point, j) + h);
    set_value(behind, j, value_of(point, j) - h);
    const VectorXd slope = (evaluate(m, ahead).rates - evaluate(m, behind).rates) / (2 * h);
    for (Eigen::Index i = 0; i < n; ++i)
      J(i, k) = slope[index_of(m.states, problem.spec.steady[std::size_t(i)], "state")];
  }
  return algebra::determinant(J);
}

static TrimProblem limited_problem(const EnvelopeAnswer& a) {
  TrimProblem p = closed_loop_problem(reference_vehicle(), *a.condition.command(), Axes::wind);
  std::erase_if(p.spec.bounds, [](const auto& b) { return b.first.ends_with("_integral"); });
  return p;
}

// The trim holds, the named limit with equality, the others are satisfied; at a fold J is singular.
static void check_border_points(const EnvelopeAnswer& a) {
  const TrimProblem problem = limited_problem(a);
  std::vector<double> elsewhere;
  for (const Envelope& part : a.parts)
    for (const BorderPiece& piece : part.pieces)
      for (const BorderPiece::Point& p : piece.points)
        if (piece.name != "fold") elsewhere.push_back(std::abs(determinant(problem, p.point)));
  std::ranges::sort(elsewhere);
  const double usual = elsewhere[elsewhere.size() / 2];
  for (const Envelope& part : a.parts)
    for (const BorderPiece& piece : part.pieces) {
      CAPTURE(piece.name);
      double residual = 0, beyond = 0, off = 0;
      for (const BorderPiece::Point& p : piece.points) {
        const Evaluation e = evaluate(a.model, p.point);
        for (const std::string& still : problem.spec.steady) {
          const auto i = index_of(a.model.states, still, "state");
          residual =
              std::max(residual, std::abs(e.rates[i]) / a.model.states[std::size_t(i)].nominal);
        }
        for (const auto& [name, range] : problem.spec.bounds) {
          const auto output = find(a.model.outputs, name);
          const double v =
              output >= 0 ? e.outputs[output] : value_of(p.point, variable(a.model, name));
          beyond = std::max({beyond, range.lower - v, v - range.upper});
          if (piece.name == name + " lower") off = std::max(off, std::abs(v - range.lower));
          if (piece.name == name + " upper") off = std::max(off, std::abs(v - range.upper));
        }
        if (piece.name == "fold")
          off = std::max(off, std::abs(determinant(problem, p.point)) / usual);
      }
      CHECK(residual <= 1e-10);
      CHECK(beyond <= 1e-9);
      CHECK(off <= (piece.name == "fold" ? 1e-6 : 1e-9));  // 2e-7 by differences across theta0 = 0
    }
}

// Just across an outer boundary there is no trim; across an inner one there is another.
static int check_sides(const EnvelopeAnswer& a, std::size_t stride) {
  int looked_at = 0;
  constexpr double step = 1e-3, end = 0.02;  // m/s; m/s and rad
  for (const Envelope& part : a.parts)
    for (const BorderPiece& piece : part.pieces) {
      const auto near = [&](const BorderPiece::Point& p, const BorderPiece::Point& q) {
        return std::hypot(p.x - q.x, p.y - q.y) < end;
      };
      for (std::size_t k = stride / 2; k < piece.points.size(); k += stride) {
        const BorderPiece::Point& p = piece.points[k];
        if (near(p, piece.points.front()) || near(p, piece.points.back())) continue;
        CAPTURE(piece.name);
        CAPTURE(p.x);
        CAPTURE(p.y);
        const bool slower = !trims(a, p.x - step, p.y).empty();
        const bool faster = !trims(a, p.x + step, p.y).empty();
        CHECK((p.outer ? slower != faster : slower && faster));
        ++looked_at;
      }
    }
  return looked_at;
}
// The interval's ends are the ends or folds of the branch computed by follow().
static double event(const Branch& branch, EventKind kind, const std::string& which, int k = 0) {
  for (const BranchEvent& e : branch.events)
    if (e.kind == kind && (which.empty() || e.which == which) && k-- == 0) return e.at.parameter;
  return NaN;
}

static Branch along_V(double V, double gamma, double to) {
  Condition c;
  c.asked = Command{V, gamma, 0};
  return follow(reference_vehicle(), c, study_key("V"), to).branch;
}

TEST_CASE("the conversion corridor: its border holds what it says, by differences and by trim()") {
  const EnvelopeAnswer a = tiltrotor("eta_deg", 30);
  REQUIRE(a.parts.size() == 2);
  const double off = reference_vehicle().aircraft.cyclic_off;
  CHECK(a.parts[0].y.range.lower == 0);
  CHECK_NEAR(a.parts[0].y.range.upper, off, 2e-6);
  CHECK(a.parts[0].y.range.upper < off);
  CHECK(a.parts[1].y.range.lower == off);
  CHECK(a.answered());
  check_border_points(a);
  CHECK(check_sides(a, sanitized ? 100 : 20) >= (sanitized ? 4 : 25));
}

TEST_CASE("the corridor's ends in level flight are those of follow()" * thorough) {
  const EnvelopeAnswer a = tiltrotor("eta_deg", 30, {.rows = {0}});
  const double slowest = event(along_V(20, 0, 5), EventKind::limit, "delta_e lower");
  CHECK_NEAR(slowest, 6.685575, printed_to("6.685575"));
  REQUIRE(a.parts[0].rows.size() == 1);
  REQUIRE(a.parts[0].rows[0].intervals.size() == 1);
  const EnvelopeInterval& level = a.parts[0].rows[0].intervals[0];
  CHECK(level.from.name == "delta_e lower");
  CHECK_NEAR(level.from.x, slowest, 1e-8);
  CHECK(level.to.name == "edge");
  CHECK(level.to.x == 30);
  CHECK(along_V(20, 0, 30).end == BranchEnd::reached);
}

TEST_CASE("another grid and other seeds find the same corridor" * doctest::skip(sanitized)) {
  const std::vector<double> rows{0, 0.1, 0.25, 0.4, 0.8, 1.0, 1.1, 1.3, 1.57};
  const EnvelopeAnswer a = tiltrotor("eta_deg", 30, {.rows = rows});
  for (const EnvelopeAnswer& b :
       {tiltrotor("eta_deg", 20, {.rows = rows}), tiltrotor("eta_deg", 33, {.rows = rows}),
        tiltrotor("eta_deg", 25, {.rows = rows, .coarse = 4, .starts = 40, .max_step = 0.1})})
    for (std::size_t part = 0; part < 2; ++part) {
      const Envelope &one = a.parts[part], &other = b.parts[part];
      REQUIRE(one.rows.size() == other.rows.size());
      for (std::size_t k = 0; k < one.rows.size(); ++k) {
        CAPTURE(one.rows[k].y);
        REQUIRE(one.rows[k].intervals.size() == other.rows[k].intervals.size());
        for (std::size_t i = 0; i < one.rows[k].intervals.size(); ++i) {
          const EnvelopeInterval &p = one.rows[k].intervals[i], &q = other.rows[k].intervals[i];
          CHECK(p.from.name == q.from.name);
          CHECK(p.to.name == q.to.name);
          CHECK_NEAR(p.from.x, q.from.x, 1e-8);
          CHECK_NEAR(p.to.x, q.to.x, 1e-8);
        }
      }
    }
}

TEST_CASE("over the path angle: ends and folds as follow() meets them" * thorough) {
  const EnvelopeAnswer a = tiltrotor("gamma_deg", 30, {.rows = {-5 * degree}});
  REQUIRE(a.parts.size() == 1);
  const double slowest = event(along_V(8, -5 * degree, 5), EventKind::limit, "delta_e lower");
  const double fold = event(along_V(8, -5 * degree, 20), EventKind::fold, "");
  CHECK_NEAR(slowest, 6.9435710, printed_to("6.9435710"));
  CHECK_NEAR(fold, 10.4529388, printed_to("10.4529388"));
  REQUIRE(!a.parts[0].rows[0].intervals.empty());
  const EnvelopeInterval& slow = a.parts[0].rows[0].intervals[0];
  CHECK(slow.from.name == "delta_e lower");
  CHECK(slow.to.name == "fold");
  CHECK_NEAR(slow.from.x, slowest, 1e-8);
  CHECK_NEAR(slow.to.x, fold, 1e-8);
  // At higher speed, thrust is freed again where the branch from 28 m/s loses it.
  REQUIRE(a.parts[0].rows[0].intervals.size() == 2);
  const EnvelopeInterval& fast = a.parts[0].rows[0].intervals[1];
  CHECK(fast.from.name == "theta0 lower");
  CHECK_NEAR(fast.from.x, event(along_V(28, -5 * degree, 15), EventKind::limit, "theta0 lower"),
             1e-8);
  CHECK(fast.to.name == "edge");
  check_border_points(a);
  CHECK(check_sides(a, sanitized ? 100 : 15) >= (sanitized ? 2 : 15));
}

// ---- all equilibria ----

static std::vector<Verdict> verdicts_by_x(AllEquilibria all) {
  std::ranges::sort(all.equilibria, {}, [](const Equilibrium& e) { return e.trim.point.x[0]; });
  std::vector<Verdict> v;
  for (const Equilibrium& e : all.equilibria) v.push_back(e.modes.value().verdict);
  return v;
}

static AllEquilibria all_at(double a, double b, const std::vector<std::string>& parameters,
                            int starts) {
  return all_equilibria(scalar(cusp), equilibrium, {vec({1.0}), {}, vec({a, b})}, parameters, 3.0,
                        {.starts = starts});
}

TEST_CASE("all equilibria of the cusp: three within it, one without, each once") {
  const std::vector<Verdict> three{Verdict::stable, Verdict::unstable, Verdict::stable};
  for (const int starts : {32, 300}) {
    const AllEquilibria inside = all_at(0.1, 1, {"a", "b"}, starts);
    CHECK(verdicts_by_x(inside) == three);
    for (const Equilibrium& e : inside.equilibria)
      CHECK_NEAR(cusp(e.trim.point.x[0], 0.1, 1), 0.0, 1e-10);
    CHECK(verdicts_by_x(all_at(1, 1, {"a", "b"}, starts)) == std::vector{Verdict::stable});
  }
}

TEST_CASE("without starts only the branch leads to the others") {
  CHECK(all_at(0.1, 1, {}, 0).equilibria.size() == 1);
  const AllEquilibria all = all_at(0.1, 1, {"a"}, 0);
  REQUIRE(all.equilibria.size() == 3);
  CHECK(all.branches == 6);
  const auto by_branch = [](const Equilibrium& e) { return e.found == "the branch in a"; };
  CHECK(std::ranges::count_if(all.equilibria, by_branch) == 2);
}

TEST_CASE("all equilibria of the tiltrotor at 9.7 m/s: three, each verified, least effort first") {
  Condition c;
  c.asked = Command{9.7, 0, 0};
  const AllEquilibria all = all_equilibria(reference_vehicle(), c, {});
  const TrimProblem p = closed_loop_problem(reference_vehicle(), *c.command());
  REQUIRE(all.equilibria.size() == 3);
  std::vector<std::pair<double, Verdict>> by_pitch;
  for (const Equilibrium& e : all.equilibria) {
    CHECK(e.trim);
    const VectorXd rates = evaluate(p.model, e.trim.point).rates;
    for (Eigen::Index i = 0; i < rates.size(); ++i)
      CHECK_NEAR(rates[i] / p.model.states[std::size_t(i)].nominal, 0.0, 1e-10);
    by_pitch.emplace_back(value_of(e.trim.point, variable(p.model, "theta")),
                          e.modes.value().verdict);
  }
  CHECK(std::ranges::is_sorted(all.equilibria, {},
                               [](const Equilibrium& e) { return e.trim.effort; }));
  std::ranges::sort(by_pitch);
  CHECK(by_pitch[0].second == Verdict::stable);
  CHECK(by_pitch[1].second == Verdict::unstable);
  CHECK(by_pitch[2].second == Verdict::stable);
}

// rate(u1, u2) = p of least (u1 - 0.1)² + (u2 - 0.1)².
static AllEquilibria least(const std::function<double(double u1, double u2)>& rate) {
  Model m;
  m.states = {{"x", "", 1.0}};
  m.inputs = {{"u1", "", 1.0}, {"u2", "", 1.0}};
  m.parameters = {{"p", "", 1.0}};
  m.f = [rate](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return vec({rate(u[0], u[1]) - p[0] - x[0]});
  };
  TrimSpec spec{.free = {"u1", "u2"}, .steady = {"x"}};
  spec.bounds = {{"u1", {-5, 5}}, {"u2", {-5, 5}}};
  spec.effort = {{"u1", 1.0, 0.1}, {"u2", 1.0, 0.1}};
  return all_equilibria(m, spec, {vec({0}), vec({0.5, 1}), vec({1})}, {"p"}, 2.0, {});
}

TEST_CASE("of least effort, too: the one, or both of two, the lesser first") {
  const double tolerance = 1e-7;  // the effort's gradient vanishes to 1e-9; conditioning 100
  const AllEquilibria one = least([](double u1, double u2) { return u1 + 2 * u2; });
  REQUIRE(one.equilibria.size() == 1);
  CHECK_NEAR(one.equilibria[0].trim.point.u[0], 0.1 + 0.7 / 5, tolerance);
  CHECK_NEAR(one.equilibria[0].trim.point.u[1], 0.1 + 1.4 / 5, tolerance);
  // u1 u2 = 1: (1, 1) and (-1, -1), efforts 2 · 0.9² and 2 · 1.1²
  const AllEquilibria two = least([](double u1, double u2) { return u1 * u2; });
  REQUIRE(two.equilibria.size() == 2);
  for (const int k : {0, 1}) {
    const TrimResult& t = two.equilibria[std::size_t(k)].trim;
    CHECK_NEAR(t.point.u[0], k == 0 ? 1 : -1, tolerance);
    CHECK_NEAR(t.point.u[1], k == 0 ? 1 : -1, tolerance);
    CHECK_NEAR(t.effort, k == 0 ? 1.62 : 2.42, tolerance);
  }
}

// ---- the caller's mistakes ----

TEST_CASE("the caller's mistakes throw") {
  const auto asked = [](const EnvelopeAxis& x, const EnvelopeAxis& y,
                        const TrimSpec& spec = equilibrium) {
    return envelope(scalar(circle), spec, origin, x, y);
  };
  const EnvelopeAxis a{"a", {-1, 1}, 5}, b{"b", {-1, 1}, 5};
  const auto wrong = [&](const EnvelopeAxis& axis) {
    CHECK_THROWS_AS(asked(axis, b), std::invalid_argument);
    CHECK_THROWS_AS(asked(a, axis), std::invalid_argument);
  };
  CHECK(asked(a, b).status == EnvelopeStatus::complete);
  wrong({"speed", {-1, 1}, 5});  // unknown
  wrong({"d", {-1, 1}, 5});      // an output
  wrong({"x", {-1, 1}, 5});      // free in the trim
  for (const Range& range : {Range{1, -1}, Range{1, 1}, Range{NaN, 1},
                             Range{0, std::numeric_limits<double>::infinity()}}) {
    wrong({"a", range, 5});
    wrong({"b", range, 5});
  }
  for (const int count : {1, 0, -3}) wrong({"a", {-1, 1}, count});
  CHECK_THROWS_AS(asked(a, a), std::invalid_argument);
  CHECK_THROWS_AS(asked(a, b, {.free = {"x"}, .moving = {"x"}}), std::invalid_argument);
  CHECK_THROWS_AS(asked(a, b, {.free = {}, .steady = {"x"}}), std::invalid_argument);
  CHECK_THROWS_AS(asked(a, b, {.free = {"x"}, .steady = {"y"}}), std::invalid_argument);
  TrimSpec limited = equilibrium;
  limited.bounds["a"] = {-0.5, 2};
  CHECK_THROWS_WITH_AS(asked(a, b, limited),
                       "a is to be -1, outside its limits in the trim, [-0.5, 2]",
                       std::invalid_argument);
  // x' = y - c and y' = a, implied, x and c given: trims where a vanishes, nowhere else in a plane
  const Model line = flow({"x", "y"}, {"a", "b", "c"}, [](const VectorXd& x, const VectorXd& p) {
    return vec({x[1] - p[2], p[0]});
  });
  TrimSpec implying{.free = {"y"}, .steady = {"x"}, .implied = {"y"}};
  const OperatingPoint start{vec({0, 0}), {}, vec({0, 0, 2})};
  CHECK_THROWS_WITH_AS((void)envelope(line, implying, start, a, b),
                       doctest::Contains("y' = -1, which should vanish with its equations"),
                       std::invalid_argument);
  CHECK(envelope(line, implying, start, {"b", {-1, 1}, 5}, {"c", {-1, 1}, 5}).count.minCoeff() ==
        1);
  implying.bounds["a"] = {1, 2};  // at 0
  CHECK_THROWS_WITH_AS((void)envelope(line, implying, start, {"b", {-1, 1}, 5}, {"c", {-1, 1}, 5}),
                       "a is to be 0, outside its limits in the trim, [1, 2]",
                       std::invalid_argument);
  const AirframeCondition airframe{.values = {{"V", {10, 10}}, {"eta", {0, 0}}}};
  for (const Condition& c : {Condition{"", TableCondition{}}, Condition{"", airframe}}) {
    CHECK_THROWS_AS((void)envelope(reference_vehicle(), c, envelope_over("eta_deg")),
                    std::invalid_argument);
  }
}

// ---- regressions ----

TEST_CASE("a row's interval between two grid points") {
  const double y = 0.999, half = std::sqrt(1 - y * y);  // 0.045, of 0.14 between grid points
  const Envelope e = explored({.rate = circle, .count = 22}, {.rows = {y}});
  check_row(e.rows[0], {{{-half, "fold"}, {half, "fold"}}});
}

TEST_CASE("a row ends where the further of two sheets does") {
  // x = 3 + a up to a = 0.25, x = -3 - a up to a = 0.28; grid points at 0.2 and 0.3.
  const Envelope e = explored({[](double x, double a, double) { return (x - 3 - a) * (x + 3 + a); },
                               {{"x", {-3.28, 3.25}}},
                               {-1, 1},
                               {-1, 1}},
                              {.rows = {0}});
  check_row(e.rows[0], {{{-1, "edge"}, {0.28, "x lower"}}});
}

TEST_CASE("a row that meets a model without numbers is one interval") {
  const Envelope e =
      explored({[](double x, double a, double b) { return a > 0.2 ? NaN : a + b - x; },
                {},
                {-1, 1},
                {-1, 1}},
               {.rows = {0}});
  REQUIRE(e.rows[0].intervals.size() == 1);
  CHECK_NEAR(e.rows[0].intervals[0].to.x, 0.2, 1e-4);
}

TEST_CASE("a fold is followed to the edge beyond which the model has no values") {
  const Model m = exact_model(flow({"x"}, {"a", "b"}, {}), [](auto x, auto, auto p, auto rates) {
    const auto b = p[1] < 0 ? p[1] * NaN : p[1];
    rates[0] = x[0] * x[0] + p[0] * p[0] + b * b - 1;
  });
  const EnvelopeOptions options{.rows = {0}};
  const Envelope e =
      envelope(m, equilibrium, origin, {"a", {-1.5, 1.5}, 21}, {"b", {0, 1.5}, 21}, options);
  const BorderPiece& half = piece(e, "fold");
  for (const BorderPiece::Point* end : {&half.points.front(), &half.points.back()}) {
    CHECK_NEAR(std::abs(end->x), 1.0, located);
    CHECK_NEAR(end->y, 0.0, 2 * TraceOptions{}.min_step);  // the last step is not halved again
  }
  check_row(e.rows[0], {{{-1, "fold"}, {1, "fold"}}});
}

TEST_CASE("every piece of the tiltrotor's border over the path angle comes to an end" * thorough) {
  const EnvelopeAnswer a = tiltrotor("gamma_deg", 20);
  for (const BorderPiece& p : a.parts[0].pieces) {
    CHECK(p.points.size() < 1000);
    for (const std::string& end : {p.from, p.to})
      CHECK((end == "edge" || end == "fold" || end.ends_with("er")));
  }
}

TEST_CASE("an angle without limits has trims every turn: an end, and the rows of the first turns") {
  const Envelope e = explored(
      {[](double x, double a, double b) { return a - b * std::sin(x); }, {}, {-3, 3}, {1, 2}},
      {.rows = {1.5}});
  CHECK(e.status == EnvelopeStatus::incomplete);
  CHECK(e.count.maxCoeff() == int(most_sheets));
  check_row(e.rows[0], {{{-1.5, "fold"}, {1.5, "fold"}}});
}

TEST_CASE("a limit's piece ends where its sheet folds") {
  // x² = a, x - b >= 0.5: d x/d a changes sign on it at a = 0, b = -0.5.
  Model m = scalar([](double x, double a, double) { return x * x - a; });
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd& p) { return vec({x[0] - p[1]}); };
  TrimSpec spec = equilibrium;
  spec.bounds = {{"d", {0.5, 9}}};
  const Envelope e = envelope(m, spec, origin, {"a", {-1, 1}, 21}, {"b", {-1, 1}, 21});
  CHECK(piece(e, "fold").points.size() > 2);
  CHECK(std::ranges::count(e.pieces, "d lower", &BorderPiece::name) == 2);
}

// Starts on arcs that bulge from their chords by more than a twentieth counted as new pieces.
TEST_CASE("a closed border is one piece, whatever its size: a² + b² = R²") {
  for (const int count : {20, 100})
    for (const double R : {0.2, 0.5, 1.0}) {
      CAPTURE(count);
      CAPTURE(R);
      const Envelope e =
          explored({.rate = [](double x, double a, double b) { return a * a + b * b + x; },
                    .bounds = {{"x", {-R * R, 9}}},
                    .a = {-2, 2},
                    .b = {-2, 2},
                    .count = count},
                   {.rows = {0}});
      REQUIRE(e.pieces.size() == 1);
      CHECK(e.pieces[0].name == "x lower");
      CHECK(e.pieces[0].from == "loop");
      CHECK(e.pieces[0].points.size() >= 12);
      for (const BorderPiece::Point& p : e.pieces[0].points)
        CHECK_NEAR(std::hypot(p.x, p.y), R, located);
      check_row(e.rows[0], {{{-R, "x lower"}, {R, "x lower"}}});
    }
}

// What is near another piece was told by nominal sizes: of two ovals within 0.002, one was lost.
TEST_CASE("two borders next to each other are two, whatever their size: ovals of Cassini") {
  constexpr double level = 0.9;  // at 1 they touch
  for (const double c : {0.5, 1e-2, 5e-4}) {
    CAPTURE(c);
    const auto product = [](double u, double v) {
      return (std::pow(u - 1, 2) + v * v) * (std::pow(u + 1, 2) + v * v);
    };
    const Envelope e =
        explored({.rate = [=](double x, double a, double b) { return product(a / c, b / c) - x; },
                  .bounds = {{"x", {-1, level}}},
                  .a = {-2 * c, 2 * c},
                  .b = {-2 * c, 2 * c},
                  .count = 20},
                 {.rows = {0}});
    REQUIRE(e.pieces.size() == 2);
    for (const BorderPiece& p : e.pieces) {
      CHECK(p.from == "loop");
      for (const BorderPiece::Point& q : p.points)
        CHECK_NEAR(product(q.x / c, q.y / c), level, 1e-9);
    }
    CHECK(e.pieces[0].points[0].x * e.pieces[1].points[0].x < 0);
    const double inner = c * std::sqrt(1 - std::sqrt(level)),
                 outer = c * std::sqrt(1 + std::sqrt(level));
    check_row(e.rows[0], {{{-outer, "x upper"}, {-inner, "x upper"}},
                          {{inner, "x upper"}, {outer, "x upper"}}});
  }
}

}  // namespace envelope_test
