// Maps of verdicts alone against the detailed maps of the same grids, by parts, stopped, resumed.
#include "sweep/verdict_map.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <stop_token>

#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/difference.hpp"
#include "sweep/sweep.hpp"
#include "sweep/verdict_runs.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace verdict_map_test {

namespace {

using Codes = std::vector<std::int8_t>;

Codes codes_of(const VerdictMap& map) {
  Codes codes;
  for (std::size_t at = 0; at < map.runs.size();)
    each_run(map.runs, at, map.grid.axes.back().size(),
             [&](std::int8_t code, std::size_t n) { codes.insert(codes.end(), n, code); });
  return codes;
}

struct Grid {
  std::vector<SweepRequest> requests;
  std::vector<SweepAxis> axes;
};

Grid grid_of(const std::string& text) {
  const Study study = parse_study(text, "verdict_map_test.toml");
  return {sweep_requests(study, study.conditions, study.sweep->axes), study.sweep->axes};
}

std::string condition(const std::string& name, double V, double gamma, double eta,
                      const std::string& more = "") {
  return fmt::format("[[condition]]\nname = \"{}\"\nV = {}\ngamma_deg = {}\neta_deg = {}\n{}", name,
                     V, gamma, eta, more);
}

std::string axis(const std::string& key, double from, double to, int count) {
  return fmt::format("[[sweep.axis]]\nkey = \"{}\"\nfrom = {}\nto = {}\ncount = {}\n", key, from,
                     to, count);
}

// The verdicts of the detailed map at every point; returns how often each occurs.
VerdictCounts check_same(const Grid& p) {
  const SweepMap whole = sweep(p.requests, p.axes, {.crossings = false});
  const VerdictMap alone = sweep_verdicts(p.requests, p.axes, {.crossings = false});
  CHECK(codes_of(alone) == whole.verdict);
  VerdictCounts all{};
  for (const VerdictCounts& c : counts_of(alone))
    for (std::size_t k = 0; k < c.size(); ++k) all[k] += c[k];
  for (std::size_t k = 0; k < all.size(); ++k)
    CHECK(all[k] == std::size_t(std::ranges::count(whole.verdict, k < 3 ? int(k) : -1)));
  return all;
}

const std::string airplane = condition("airplane", 8, 30, 30);
const std::string helicopter = condition("helicopter", 2, 90, 90);

// Lines enough for several units of the log, on two conditions and two slower axes.
std::string three_axes() {
  return airplane + helicopter + axis("gains.K_Li", 0.1, 2, 3) + axis("gains.K_Lp", 0.05, 5, 4) +
         axis("gains.k_de", 0.05, 20, 20000);
}

std::string bytes_of(const VerdictMap& map) {
  const Folder folder;
  write_netcdf(map, folder.path / "map.nc");
  return contents(folder.path / "map.nc");
}

VerdictMap signed_by(VerdictMap map) {
  map.grid.program = "tiltrim test";
  map.grid.study = "the study";
  return map;
}

}  // namespace

TEST_CASE("runs: any verdicts of any length come back") {
  Random random = draws(1);
  for (const std::size_t points : {1, 31, 32, 5000, 200000}) {
    Codes line, back;
    while (line.size() < points) {
      const std::size_t most = random() % 3 == 0 ? points : 40;
      const auto code = std::int8_t(int(random() % 4) - 1);
      line.insert(line.end(), std::min(1 + random() % most, points - line.size()), code);
    }
    std::vector<std::uint8_t> runs;
    append_runs(line, runs);
    append_runs(line, runs);
    CHECK(runs.size() <= 2 * points);
    std::size_t at = 0;
    for (int k = 0; k < 2; ++k)
      each_run(runs, at, points,
               [&](std::int8_t code, std::size_t n) { back.insert(back.end(), n, code); });
    CHECK(at == runs.size());
    line.insert(line.end(), line.begin(), line.end());
    CHECK(back == line);
    at = runs.size();
    CHECK_THROWS_AS(each_run(runs, at, points, [](std::int8_t, std::size_t) {}),
                    std::runtime_error);
  }
}

TEST_CASE("the verdicts of the detailed map at every point of the tiltrotor's grids") {
  SUBCASE("two gains, of both pitch controls") {
    const VerdictCounts c =
        check_same(grid_of(airplane + helicopter + axis("gains.K_Lp", 0.05, 5, 30) +
                           axis("gains.k_de", 0.05, 20, 400)));
    CHECK(c[0] > 0);
    CHECK(c[1] > 0);
  }
  SUBCASE("a gain that moves the integrals") {
    (void)check_same(
        grid_of(airplane + axis("gains.K_Lp", 0.05, 5, 7) + axis("gains.K_Ei", 0.05, 5, 300)));
  }
  SUBCASE("the corridor, whose middle has two pitch controls") {
    const VerdictCounts c = check_same(grid_of(
        condition("corridor", 15, 0, 0) + axis("h", 0, 120, 25) + axis("gains.K_Lp", 0.05, 5, 40)));
    CHECK(c[1] > 0);
  }
  SUBCASE("a speed as the last axis, and points without an equilibrium") {
    const VerdictCounts c =
        check_same(grid_of(airplane + axis("gains.K_Lp", 0.05, 5, 3) + axis("V", 1, 20, 30)));
    CHECK(c[3] > 0);
  }
  SUBCASE("one axis") { (void)check_same(grid_of(airplane + axis("gains.k_de", 0.05, 20, 500))); }
}

TEST_CASE("closer and closer to a border: the same verdicts, undecided ones included") {
  const Grid coarse =
      grid_of(airplane + axis("gains.K_Lp", 1, 2, 2) + axis("gains.k_de", 0.05, 20, 200));
  const VerdictMap map = sweep_verdicts(coarse.requests, coarse.axes);
  REQUIRE(map.located == std::vector<std::int8_t>{1, 1});
  REQUIRE(!map.grid.crossings.empty());
  const double border = map.grid.crossings[0].at[1];
  Grid fine = coarse;
  std::vector<double> ladder;
  for (int k = 3; k < 53; ++k) ladder.push_back(border * (1 - std::ldexp(1.0, -k)));
  for (int k = 52; k > 2; --k) ladder.push_back(border * (1 + std::ldexp(1.0, -k)));
  SweepAxis::Column& own = fine.axes[1].columns.front();
  own.values = own.si = ladder;
  const VerdictCounts c = check_same(fine);
  CHECK(c[0] > 0);
  CHECK(c[1] > 0);
  CHECK(c[2] > 0);
}

TEST_CASE("borders: the detailed map's crossings along the last axis") {
  const Grid p = grid_of(airplane + helicopter + axis("gains.K_Lp", 0.05, 5, 15) +
                         axis("gains.k_de", 0.05, 20, 60));
  const SweepMap whole = sweep(p.requests, p.axes);
  const VerdictMap map = sweep_verdicts(p.requests, p.axes);
  std::vector<AxisCrossing> expected;
  for (const AxisCrossing& c : whole.crossings)
    if (c.axis == 1) expected.push_back(c);
  REQUIRE(map.grid.crossings.size() == expected.size());
  CHECK(std::ranges::count(map.located, 1) == 30);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const AxisCrossing& c = map.grid.crossings[i];
    CHECK(c.condition == expected[i].condition);
    CHECK(c.at[0] == expected[i].at[0]);
    CHECK_NEAR(c.at[1], expected[i].at[1], c.error + expected[i].error);
    CHECK(c.unstable_after == expected[i].unstable_after);
    CHECK(c.frequency == expected[i].frequency);
  }
}

// ---- Models that break what the polynomial needs: each check is needed for the same verdicts
// ------

namespace {

using Rates = std::function<VectorXd(const VectorXd& x, const VectorXd& p)>;
using Jacobian = std::function<MatrixXd(const VectorXd& x, const VectorXd& p)>;
using Phi = std::function<std::optional<double>(const VectorXd& p)>;

// Parameters s and p; φ is claimed for p. Without derivatives they are differences.
Grid claimed(Index n, const Rates& f, const Jacobian& A, const Phi& phi,
             const std::vector<double>& s, const std::vector<double>& p) {
  Model m;
  m.name = "claimed";
  for (Index i = 0; i < n; ++i) m.states.push_back({fmt::format("x{}", i), "", 1.0});
  m.parameters = {{"s", "", 1.0}, {"p", "", 1.0}};
  m.f = [f](const VectorXd& x, const VectorXd&, const VectorXd& q) { return f(x, q); };
  if (A)
    m.derivatives = [A](const OperatingPoint& at, const std::vector<Index>& along) {
      return MatrixXd(A(at.x, at.p)(Eigen::all, along));
    };
  m.affine = {{"p", phi}};
  const std::vector<std::string> states = names(m.states);
  SweepRequest r{"claimed",
                 m,
                 {.free = states, .steady = states},
                 {VectorXd::Zero(n), VectorXd(), VectorXd::Zero(2)},
                 {}};
  r.spec.effort = {{"x0", 1.0, 0.0}};
  return {{r}, {{"s", {{"s", "", "s", s, s}}}, {"p", {{"p", "", "p", p, p}}}}};
}

std::vector<double> spaced(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(from + (to - from) * i / (count - 1));
  return values;
}

Phi own() {
  return [](const VectorXd& p) { return p[1]; };
}

Grid linear(const std::function<MatrixXd(const VectorXd& p)>& A, const Phi& phi) {
  return claimed(
      A(VectorXd::Zero(2)).rows(),
      [A](const VectorXd& x, const VectorXd& p) -> VectorXd { return A(p) * x; },
      [A](const VectorXd&, const VectorXd& p) { return A(p); }, phi, spaced(0, 1, 3),
      spaced(0, 1, 101));
}

MatrixXd diagonal(double a, double b) { return Eigen::Vector2d(a, b).asDiagonal(); }

}  // namespace

TEST_CASE("a claim that does not hold: the verdicts are those of each point") {
  SUBCASE("not affine: the ends agree, the middle does not") {
    const VerdictCounts c = check_same(
        linear([](const VectorXd& p) { return diagonal(-1, -1 + 8 * p[1] * (1 - p[1])); }, own()));
    CHECK(c[1] > 0);
  }
  SUBCASE("a slope of rank two") {
    const VerdictCounts c = check_same(
        linear([](const VectorXd& p) { return diagonal(-1 + 3 * p[1], -1 + 2 * p[1]); }, own()));
    CHECK(c[1] > 0);
  }
  SUBCASE("φ does not hold at some points, nor does A") {
    const auto gap = [](const VectorXd& p) { return p[1] > 0.2 && p[1] < 0.4; };
    const VerdictCounts c =
        check_same(linear([gap](const VectorXd& p) { return diagonal(-1, gap(p) ? 1 : -2 + p[1]); },
                          [gap](const VectorXd& p) -> std::optional<double> {
                            return gap(p) ? std::nullopt : std::optional(p[1]);
                          }));
    CHECK(c[1] > 0);
  }
  SUBCASE("the equilibrium moves, beyond a limit at some points") {
    Grid g = claimed(
        2,
        [](const VectorXd& x, const VectorXd& p) -> VectorXd {
          const double at = p[1] + 0.4 * std::sin(4 * std::numbers::pi * p[1]);
          return Eigen::Vector2d(at - x[0], (p[1] - 0.6) * x[1]);
        },
        [](const VectorXd&, const VectorXd& p) { return diagonal(-1, p[1] - 0.6); }, own(), {0, 1},
        spaced(0, 1, 81));
    g.requests[0].spec.bounds["x0"] = {0.0, 10.0};
    const VerdictCounts c = check_same(g);
    CHECK(c[3] > 0);
  }
  SUBCASE("φ changes from line to line") {
    const VerdictCounts c = check_same(
        linear([](const VectorXd& p) { return diagonal(-1, -0.5 + std::pow(p[1], 1 + p[0])); },
               [](const VectorXd& p) { return std::pow(p[1], 1 + p[0]); }));
    CHECK(c[1] > 0);
  }
  SUBCASE("the equilibrium moves, and A with it") {
    (void)check_same(claimed(
        1,
        [](const VectorXd& x, const VectorXd& p) -> VectorXd {
          return VectorXd::Constant(1, p[1] - x[0] - x[0] * x[0] * x[0]);
        },
        [](const VectorXd& x, const VectorXd&) -> MatrixXd {
          return MatrixXd::Constant(1, 1, -1 - 3 * x[0] * x[0]);
        },
        own(), spaced(0, 1, 2), spaced(-1, 1, 41)));
  }
  SUBCASE("derivatives by differences: near the axis linearize decides") {
    // 1000 x³ adds the square of the step, some 1e-8, to the slope p.
    const Rates f = [](const VectorXd& x, const VectorXd& p) -> VectorXd {
      return Eigen::Vector2d(-x[0], p[1] * x[1] + 1000 * x[1] * x[1] * x[1]);
    };
    const VerdictCounts c = check_same(
        claimed(2, f, {}, own(), {0, 1}, {-1, -1e-9, -1e-12, -1e-15, 1e-15, 1e-12, 1e-9, 1}));
    CHECK(c[2] > 0);
  }
  SUBCASE("a second equilibrium from the other end") {
    // x' = x - x³ + s: two stable branches for |s| < 0.385; the smaller |x| is the one kept
    const VerdictCounts c = check_same(claimed(
        2,
        [](const VectorXd& x, const VectorXd& p) -> VectorXd {
          return Eigen::Vector2d(x[0] - std::pow(x[0], 3) + p[0], (x[0] + p[1]) * x[1]);
        },
        [](const VectorXd& x, const VectorXd& p) -> MatrixXd {
          MatrixXd A(2, 2);
          A << 1 - 3 * x[0] * x[0], 0, x[1], x[0] + p[1];
          return A;
        },
        own(), spaced(-1, 1, 21), spaced(-2, 2, 40)));
    CHECK(c[0] > 0);
    CHECK(c[1] > 0);
  }
}

TEST_CASE("what one polynomial cannot decide, the matrices of the points decide") {
  std::vector<double> p;
  for (int k = -60; k < 0; k += 4) p.push_back(-std::ldexp(1.0, k));
  std::ranges::sort(p);
  p.push_back(0);
  for (int k = -60; k < 0; k += 4) p.push_back(std::ldexp(1.0, k));
  const VerdictCounts c = check_same(claimed(
      2,
      [](const VectorXd& x, const VectorXd& q) -> VectorXd {
        return Eigen::Vector2d(-x[0] + 0.3, q[1] * x[1]);
      },
      [](const VectorXd&, const VectorXd& q) { return diagonal(-1, q[1]); }, own(), {0, 1}, p));
  CHECK(c[0] > 20);
  CHECK(c[1] > 20);
}

// ---- Parts, threads, the log, the file
// -------------------------------------------------------------

TEST_CASE("parts, merged in any order, give the bytes of one run; threads change nothing") {
  const Grid p = grid_of(three_axes());
  const VerdictMap whole = signed_by(sweep_verdicts(p.requests, p.axes, {.threads = 1}));
  const std::string bytes = bytes_of(whole);
  CHECK(bytes_of(signed_by(sweep_verdicts(p.requests, p.axes, {.threads = 3}))) == bytes);
  for (const std::uint64_t n : {2, 3, 8}) {
    CAPTURE(n);
    std::vector<VerdictMap> parts;
    std::vector<std::string> names;
    const Folder folder;
    for (std::uint64_t k = n; k > 0; --k) {
      names.push_back(fmt::format("{}.nc", k));
      write_netcdf(signed_by(sweep_verdicts(p.requests, p.axes, {}, {k, n})),
                   folder.path / names.back());
      parts.push_back(read_verdict_map(folder.path / names.back()));
      CHECK(parts.back().part.number == k);
    }
    CHECK(bytes_of(merged(parts, names)) == bytes);
  }
  CHECK_THROWS_AS((void)sweep_verdicts(p.requests, p.axes, {}, {3, 2}), std::invalid_argument);
  CHECK_THROWS_AS((void)sweep_verdicts(p.requests, p.axes, {}, {0, 2}), std::invalid_argument);
  CHECK(contains(refusal<std::invalid_argument>([&] {
                   (void)sweep_verdicts(p.requests, p.axes, {}, {1, 9});
                 }),
                 "9 parts of a map that divides into 8"));
}

TEST_CASE("parts that do not belong together are refused by name") {
  const Grid p =
      grid_of(airplane + axis("gains.K_Lp", 0.05, 5, 9) + axis("gains.k_de", 0.05, 20, 20000));
  const auto part = [&](std::uint64_t k) {
    return signed_by(sweep_verdicts(p.requests, p.axes, {.crossings = false}, {k, 3}));
  };
  const std::vector<VerdictMap> all{part(1), part(2), part(3)};
  const auto why = [](const std::vector<VerdictMap>& parts) {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < parts.size(); ++k) names.push_back(fmt::format("{}.nc", k));
    return refusal<std::invalid_argument>([&] { (void)merged(parts, names); });
  };
  CHECK(why({all[0], all[2]}) == "part 2/3 is missing; there are 2 of 3");
  CHECK(why({all[0], all[1], all[1]}) == "1.nc and 2.nc are both part 2 of 3");
  CHECK(why({}) == "no part to merge");
  const std::string another = "1.nc is not a part of the same map as 0.nc: ";
  const auto changed = [&](const std::function<void(VerdictMap&)>& change) {
    VerdictMap other = all[1];
    change(other);
    return why({all[0], other, all[2]});
  };
  CHECK(changed([](VerdictMap& m) { m.grid.study = "s"; }) ==
        another + "its study has another text");
  CHECK(changed([](VerdictMap& m) { m.grid.program = "tiltrim 2"; }) ==
        another + "tiltrim 2 wrote it, not tiltrim test");
  CHECK(changed([](VerdictMap& m) { m.grid.conditions = {"other"}; }) ==
        another + "it has other conditions");
  CHECK(changed([](VerdictMap& m) { m.part.of = 4; }) == another + "it is part 2 of 4, not of 3");
  CHECK(contains(changed([](VerdictMap& m) { m.grid.instruction_set = "abacus"; }), "abacus"));
  CHECK(contains(changed([](VerdictMap& m) { m.work = "0"; }), "or an option, has changed"));
}

TEST_CASE("stopped and resumed: the same map") {
  const Grid p = grid_of(three_axes());
  const std::string bytes = bytes_of(signed_by(sweep_verdicts(p.requests, p.axes)));
  const Folder folder;
  SweepOptions options{.threads = 1, .checkpoint = 0};
  options.log = folder.path / "map.log";
  int stops = 0;
  for (;; ++stops) {
    REQUIRE(stops < 20);
    std::stop_source stop;
    options.stop = stop.get_token();
    options.observe = [&](const SweepProgress& now) {
      if (now.done > 70000 * std::size_t(stops + 1)) stop.request_stop();
    };
    try {
      const VerdictMap map = sweep_verdicts(p.requests, p.axes, options);
      CHECK(bytes_of(signed_by(map)) == bytes);
      break;
    } catch (const SweepInterrupted& e) {
      CHECK(!e.finished);
    }
  }
  CHECK(stops > 0);
  options.stop = {};
  CHECK_THROWS_AS((void)sweep_verdicts(p.requests, p.axes, options, {1, 2}), std::runtime_error);
}

TEST_CASE("the file: read back, refused where a map with eigenvalues is expected, small") {
  const Grid p =
      grid_of(airplane + axis("gains.K_Lp", 0.05, 5, 50) + axis("gains.k_de", 0.05, 20, 20000));
  const VerdictMap map = signed_by(sweep_verdicts(p.requests, p.axes, {.crossings = false}));
  const Folder folder;
  const auto file = folder.path / "map.nc";
  write_netcdf(map, file);
  CHECK(std::filesystem::file_size(file) < 250'000);  // a million points, 20 050 coordinates
  const VerdictMap back = read_verdict_map(file);
  CHECK(back.runs == map.runs);
  CHECK(back.located == map.located);
  CHECK(back.work == map.work);
  CHECK(bytes_of(back) == bytes_of(map));
  CHECK(contains(refusal<std::runtime_error>([&] { (void)read_netcdf(file); }),
                 "is a map of verdicts alone"));
  write_netcdf(signed_by(sweep_verdicts(p.requests, p.axes, {}, {2, 3})), file);
  CHECK(contains(refusal<std::runtime_error>([&] { (void)read_netcdf(file); }),
                 "is a part of a map of verdicts"));
  const Grid small = grid_of(airplane + axis("gains.k_de", 0.05, 20, 5));
  write_netcdf(sweep(small.requests, small.axes), file);
  CHECK(contains(refusal<std::runtime_error>([&] { (void)read_verdict_map(file); }),
                 "is a map with equilibria and eigenvalues"));
  VerdictMap short_of_a_line = map;
  short_of_a_line.located.pop_back();
  CHECK_THROWS_AS(write_netcdf(short_of_a_line, file), std::invalid_argument);
}

// ---- Two maps ----

TEST_CASE("differences are those of the detailed maps of the same grids, point by point") {
  const std::string axes = axis("gains.K_Lp", 0.05, 5, 15) + axis("gains.k_de", 0.05, 20, 60);
  const Grid first = grid_of(airplane + helicopter + axes),
             second = grid_of("[gains]\nK_Li = 3\n" + airplane + helicopter + axes);
  const VerdictMap before = sweep_verdicts(first.requests, first.axes),
                   after = sweep_verdicts(second.requests, second.axes);
  const SweepMap a = sweep(first.requests, first.axes), b = sweep(second.requests, second.axes);
  const VerdictDifference found = difference(before, after);
  const MapDifference expected = difference(a, b);

  std::array<VerdictCounts, 4> counts{};
  Codes changed = a.verdict;  // by the stretches: those after
  for (std::size_t p = 0; p < a.points(); ++p)
    ++counts[a.verdict[p] < 0 ? 3 : std::size_t(a.verdict[p])]
            [b.verdict[p] < 0 ? 3 : std::size_t(b.verdict[p])];
  for (const VerdictStretch& stretch : found.stretches)
    for (std::size_t k = stretch.from; k <= stretch.to; ++k) {
      CHECK(changed[stretch.line * 60 + k] == stretch.before);
      changed[stretch.line * 60 + k] = std::int8_t(stretch.after);
    }
  CHECK(found.counts == counts);
  CHECK(changed == b.verdict);
  CHECK(found.compared() == a.points());
  std::size_t other_verdict = 0;
  for (const PointDifference& p : expected.changed)
    other_verdict += p.verdict_before != p.verdict_after;
  CHECK(found.changed() == other_verdict);
  CHECK(found.changed() > 0);

  CHECK(found.lines_not_located == 0);
  const auto along_last = [](const AxisCrossing& c) { return c.axis == 1; };
  const CrossingDifferences& crossings = found.crossings;
  CHECK(std::ssize(crossings.appeared) ==
        std::ranges::count_if(expected.crossings.appeared, along_last));
  CHECK(std::ssize(crossings.vanished) ==
        std::ranges::count_if(expected.crossings.vanished, along_last));
  CHECK(std::ssize(crossings.moved) ==
        std::ranges::count_if(expected.crossings.moved,
                              [&](const auto& m) { return along_last(m.before); }));
  CHECK(!crossings.moved.empty());
}

TEST_CASE("differences of equal maps, of lines without borders, of maps that do not compare") {
  const Grid p =
      grid_of(airplane + axis("gains.K_Lp", 0.05, 5, 4) + axis("gains.k_de", 0.05, 20, 60));
  const VerdictMap map = sweep_verdicts(p.requests, p.axes);
  const VerdictDifference none = difference(map, map);
  CHECK(none.compared() == 240);
  CHECK(none.changed() == 0);
  CHECK(none.stretches.empty());
  CHECK(none.crossings.moved.empty());
  CHECK(none.crossings.appeared.empty());
  CHECK(none.crossings.vanished.empty());

  VerdictMap doubtful = map;  // a border is missing where not all are located: no difference
  REQUIRE(!map.grid.crossings.empty());
  const double line = map.grid.crossings.front().at[0];
  std::erase_if(doubtful.grid.crossings, [&](const AxisCrossing& c) { return c.at[0] == line; });
  CHECK(!difference(map, doubtful).crossings.vanished.empty());
  const auto number =
      std::ranges::find(p.axes[0].columns[0].values, line) - p.axes[0].columns[0].values.begin();
  doubtful.located[std::size_t(number)] = 0;
  CHECK(difference(map, doubtful).crossings.vanished.empty());
  CHECK(difference(map, doubtful).lines_not_located == 1);

  VerdictMap part = map;
  part.part = {1, 2};
  CHECK(contains(refusal<std::invalid_argument>([&] { (void)difference(map, part); }),
                 "a part of a map"));
  const Grid other =
      grid_of(airplane + axis("gains.K_Lp", 0.05, 5, 4) + axis("gains.k_de", 0.05, 21, 60));
  CHECK(contains(refusal<std::invalid_argument>(
                     [&] { (void)difference(map, sweep_verdicts(other.requests, other.axes)); }),
                 "the maps cannot be compared: value 2 of gains.k_de"));
}

}  // namespace verdict_map_test
