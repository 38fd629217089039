// Parts of a flight: schedules, weather, plans, actuators, integrals, the ground, handover.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include "flight/flight.hpp"
#include "flight/fly.hpp"
#include "runtime/proportion.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

using namespace tiltrim;

namespace flight_parts_test {

static constexpr double pi = std::numbers::pi;
static constexpr double degree = pi / 180;
static constexpr double inf = std::numeric_limits<double>::infinity();
static constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

// ---- schedules ----

TEST_CASE("corridor_height inverts (16) to rounding") {
  for (int k = 0; k <= 100'000; ++k) {
    const double h = 120.0 * k / 100'000, eta = corridor(h).eta, back = corridor_height(eta);
    REQUIRE(std::abs(corridor(back).eta - eta) <= 1e-15);
    // (16) is flat at its ends: there round-off in the tilt is 1e-6 m of height.
    const double u = h / 120, slope = 3 * pi * u * (1 - u);
    REQUIRE(std::abs(back - h) * slope <= 2e-13);
  }
  CHECK_NEAR(corridor_height(pi / 2), 0.0, 1e-13);
  CHECK_NEAR(corridor_height(0.0), 120.0, 1e-13);
  CHECK_NEAR(corridor_height(2.0), 0.0, 1e-13);
  CHECK_NEAR(corridor_height(-1.0), 120.0, 1e-13);
  CHECK_NEAR(corridor_height(pi / 4), 60.0, 1e-13);
}

TEST_CASE("the corridor at a tilt rate tilts at that rate, on the corridor") {
  const SteadyTilt tilt{3.0, 2 * degree, 88 * degree, 5 * degree};
  CHECK_NEAR(tilt.ends(), 3.0 + 83.0 / 2.0, 1e-13);
  const Schedule schedule = corridor_at_tilt_rate(tilt);
  const auto at = [&](double t) { return schedule.command(t, nan_value); };  // not over height
  for (double t = 3.0; t + 0.01 < tilt.ends(); t += 0.173) {
    CHECK_NEAR(at(t).eta, 88 * degree - 2 * degree * (t - 3), 1e-15);
    CHECK_NEAR((at(t).eta - at(t + 0.01).eta) / 0.01, 2 * degree, 1e-13);
    const Command on = corridor(corridor_height(at(t).eta));
    CHECK_NEAR(at(t).V, on.V, 1e-12);
    CHECK_NEAR(at(t).gamma, at(t).eta, 1e-14);  // (16) has both the same
  }
  for (const double t : {-1.0, 0.0, 3.0}) CHECK(at(t).eta == 88 * degree);
  for (const double t : {tilt.ends(), 100.0}) CHECK_NEAR(at(t).eta, 5 * degree, 1e-15);
  // The kink between the ends is where the speed begins to rise.
  REQUIRE(schedule.kink_times.size() == 3);
  CHECK(schedule.kink_times.front() == 3.0);
  CHECK(schedule.kink_times.back() == tilt.ends());
  const double rises = schedule.kink_times[1];
  CHECK_NEAR(corridor_height(at(rises).eta), 20.0, 1e-10);
  CHECK(at(rises - 0.01).V == 2.0);
  CHECK(at(rises + 0.01).V > 2.0);
  CHECK(corridor_at_tilt_rate({0, 1, 60 * degree, 0}).kink_times.size() == 2);  // risen already
}

TEST_CASE("a tilt that does not fall at a rate above zero is refused") {
  for (const double rate : {0.0, -1.0, nan_value})
    CHECK(refusal([&] {
            (void)corridor_at_tilt_rate({0, rate});
          }).find("rate") != std::string::npos);
  CHECK(refusal([&] {
          (void)corridor_at_tilt_rate({0, 1, 0.5, 0.5});
        }).find("decrease") != std::string::npos);
}

TEST_CASE("reconversion: (16) backwards on a level path, then the path turns down") {
  const Reconversion times{4.0, 100.0, 8.0, 16.0, -0.4};
  const Schedule schedule = reconversion(times);
  const auto at = [&](double t) { return schedule.command(t, 50.0); };
  for (const double t : {0.0, 4.0}) {
    CHECK(at(t).V == 15.0);
    CHECK_NEAR(at(t).eta, 0.0, 1e-15);
    CHECK(at(t).gamma == 0.0);
  }
  for (const double share : {0.1, 0.35, 0.5, 0.9}) {
    const Command command = at(4.0 + 100.0 * share), mapped = corridor(120.0 * (1 - share));
    CHECK_NEAR(command.eta, mapped.eta, 1e-13);
    CHECK_NEAR(command.V, mapped.V, 1e-12);
    CHECK(command.gamma == 0.0);
  }
  for (const double t : {104.0, 112.0, 120.0, 128.0, 500.0}) {
    CHECK(at(t).V == 2.0);
    CHECK(at(t).eta == pi / 2);
  }
  CHECK(at(112.0).gamma == 0.0);
  CHECK_NEAR(at(120.0).gamma, -0.2, 1e-15);
  for (const double t : {128.0, 500.0}) CHECK(at(t).gamma == -0.4);
  for (double t = 0.0; t < 130.0; t += 0.1) {
    CHECK(at(t + 0.1).eta >= at(t).eta);
    CHECK(at(t + 0.1).V <= at(t).V);
    CHECK(at(t + 0.1).gamma <= at(t).gamma);
  }
  REQUIRE(schedule.kink_times.size() == 5);
  CHECK(std::ranges::is_sorted(schedule.kink_times));
  CHECK(at(schedule.kink_times[1] - 0.01).V > 2.0);  // the speed's slope ends
  CHECK(at(schedule.kink_times[1] + 0.01).V == 2.0);
  CHECK(schedule.kink_heights.empty());
}

// Hermite's cubic with the slopes of Brodlie's weighted harmonic mean, written out.
static double monotone_cubic(const std::vector<double>& x, const std::vector<double>& y,
                             double at) {
  const std::size_t n = x.size();
  const auto secant = [&](std::size_t k) { return (y[k + 1] - y[k]) / (x[k + 1] - x[k]); };
  const auto slope = [&](std::size_t k) {
    if (k == 0) return secant(0);
    if (k == n - 1) return secant(n - 2);
    const double before = secant(k - 1), behind = secant(k);
    if (!(before * behind > 0)) return 0.0;
    const double a = x[k] - x[k - 1], b = x[k + 1] - x[k], share = (a + 2 * b) / (3 * (a + b));
    return before * behind / (share * behind + (1 - share) * before);
  };
  std::size_t k = 0;
  while (at > x[k + 1]) ++k;
  const double h = x[k + 1] - x[k], t = (at - x[k]) / h;
  return (1 + 2 * t) * (1 - t) * (1 - t) * y[k] + t * (1 - t) * (1 - t) * h * slope(k) +
         t * t * (3 - 2 * t) * y[k + 1] - t * t * (1 - t) * h * slope(k + 1);
}

TEST_CASE("commands over height: through the points, monotone, smooth, held outside") {
  const std::vector<double> at{-5, 10, 14, 40, 90}, V{2, 3, 8, 8, 15};
  const std::vector<double> gamma{1.5, 1.0, 1.2, 0.3, 0.0};  // two extrema
  Commands commands{at, {}};
  for (std::size_t k = 0; k < at.size(); ++k)
    commands.values.push_back({V[k], gamma[k], 1.5 - at[k] / 100});
  const Schedule schedule = over_height(commands);
  const auto here = [&](double h) { return schedule.command(nan_value, h); };
  CHECK(schedule.kink_heights == at);
  CHECK(schedule.kink_times.empty());
  for (std::size_t k = 0; k < at.size(); ++k) {
    CHECK_NEAR(here(at[k]).V, V[k], 1e-14);
    CHECK_NEAR(here(at[k]).gamma, gamma[k], 1e-14);
    CHECK_NEAR(here(at[k]).eta, 1.5 - at[k] / 100, 1e-14);
  }
  for (const double beyond : {0.0, 1.0, 1e9}) {
    CHECK(here(at.front() - beyond).V == 2);
    CHECK(here(at.back() + beyond).V == 15);
  }
  for (double h = at.front(); h < at.back(); h += 0.1) {
    CHECK_NEAR(here(h).V, monotone_cubic(at, V, h), 1e-13);
    CHECK_NEAR(here(h).gamma, monotone_cubic(at, gamma, h), 1e-13);
    CHECK_NEAR(here(h).eta, 1.5 - h / 100, 1e-13);  // of a line the line
    CHECK(here(h + 0.1).V >= here(h).V - 1e-14);
    CHECK(here(h).gamma <= 1.5);
    CHECK(here(h).gamma >= 0.0);
  }
  // Its slope is the same on both sides of a point.
  for (const double h : {10.0, 14.0, 40.0}) {
    constexpr double e = 1e-6;
    const double before = (here(h).V - here(h - e).V) / e, behind = (here(h + e).V - here(h).V) / e;
    CHECK_NEAR(before, behind, 1e-5);
  }
}

TEST_CASE("two or three commands over time are joined by lines") {
  const Schedule two = over_time({{1, 3}, {{2, 1, 0.5}, {4, 0, 1.5}}});
  CHECK(two.kink_times == std::vector<double>{1, 3});
  CHECK(two.kink_heights.empty());
  for (const double t : {0.0, 1.0, 1.2, 2.0, 2.9, 3.0, 7.0}) {
    const double share = std::clamp((t - 1) / 2, 0.0, 1.0);
    CHECK_NEAR(two.command(t, nan_value).V, 2 + 2 * share, 1e-15);
    CHECK_NEAR(two.command(t, nan_value).gamma, 1 - share, 1e-15);
    CHECK_NEAR(two.command(t, nan_value).eta, 0.5 + share, 1e-15);
  }
  const Schedule three = over_time({{0, 1, 3}, {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}});
  for (const double t : {0.25, 0.5, 1.0}) CHECK_NEAR(three.command(t, 0).V, t, 1e-15);
  for (const double t : {1.5, 2.0, 3.0}) CHECK_NEAR(three.command(t, 0).V, (3 - t) / 2, 1e-15);
}

TEST_CASE("commands that are no schedule are refused") {
  const Command any;
  for (const Commands& wrong :
       {Commands{}, Commands{{0}, {any}}, Commands{{0, 1}, {any}},
        Commands{{0, 1}, {any, any, any}}, Commands{{1, 0}, {any, any}},
        Commands{{0, 0}, {any, any}}, Commands{{0, nan_value}, {any, any}}}) {
    CHECK_THROWS_AS((void)over_height(wrong), std::invalid_argument);
    CHECK_THROWS_AS((void)over_time(wrong), std::invalid_argument);
  }
}

static const std::string conditions =
    "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n"
    "[[condition]]\nname = 'foot'\nV = 2\ngamma_deg = 90\neta_deg = 90\n";

static Study studied(const std::string& simulate) {
  return parse_study(conditions + simulate, TILTRIM_SOURCE_DIR "/studies/t.toml");
}

TEST_CASE("what a table over height leaves out is (16) itself, with its kinks") {
  const Study study =
      studied("[simulate]\n[simulate.schedule]\nover = 'height'\nat = [0, 60]\nV = [3, 9]\n");
  const Schedule schedule = flight_of(study, *study.simulate).schedule;
  for (const double h : {0.0, 7.3, 20.0, 59.0, 61.0, 119.0, 130.0}) {
    CHECK_NEAR(schedule.command(0, h).V, 3 + std::min(h, 60.0) / 10, 1e-14);
    CHECK(schedule.command(0, h).gamma == corridor(h).gamma);
    CHECK(schedule.command(0, h).eta == corridor(h).eta);
  }
  CHECK(schedule.kink_heights == std::vector<double>{0, 20, 60, 120});
}

// ---- weather ----

static GustTable dryden(double sigma, std::uint64_t seed = 1, bool up = false) {
  GustTable gust{GustTable::Kind::dryden, up, sigma};
  gust.seed = seed;
  return gust;
}

static std::vector<double> record(const Weather& air, bool up, int count, double dt) {
  std::vector<double> all;
  for (int k = 0; k < count; ++k)
    all.push_back(up ? air.wind(k * dt).up : air.wind(k * dt).forward);
  return all;
}

static double variance(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v * v / double(x.size());
  return sum;
}

TEST_CASE("the integral of the Dryden spectra is the variance") {
  for (const bool across : {false, true}) {
    // Over x = LΩ = tan φ, which leaves a smooth function of φ on [0, π/2]: midpoints.
    constexpr int n = 2000;
    constexpr double sigma = 1.7, length = 80.0;
    double sum = 0;
    for (int k = 0; k < n; ++k) {
      const double phi = pi / 2 * (k + 0.5) / n, x = std::tan(phi);
      const double dx = (1 + x * x) * pi / 2 / n;
      sum += dryden_spectrum(x / length, sigma, length, across) * dx / length;
    }
    CHECK_NEAR(sum, sigma * sigma, 1e-12);
  }
  CHECK_NEAR(dryden_spectrum(0, 2, 50, false), 4 * 2 * 50 / pi, 1e-12);
  CHECK_NEAR(dryden_spectrum(0, 2, 50, true), 4 * 50 / pi, 1e-12);
}

TEST_CASE("turbulence has the deviation asked for, in the long run") {
  // The slowest wave takes 2π 50 m/(0.01 · 15 m/s) = 2100 s; over a hundred of them its square's
  // mean is known to 1/(4π 100).
  for (const bool up : {false, true})
    for (const std::uint64_t seed : {1U, 2U, 77U}) {
      const Weather air = weather({dryden(1.3, seed, up)});
      const auto x = record(air, up, trials(400'000), sanitized ? 5.0 : 0.5);
      CHECK_NEAR(variance(x), 1.3 * 1.3, 0.03 * 1.3 * 1.3);
      double mean = 0;
      for (const double v : x) mean += v / double(x.size());
      CHECK_NEAR(mean, 0.0, 0.01);
      CHECK(variance(record(air, !up, 100, 0.5)) == 0);
    }
}

TEST_CASE("turbulence follows the Dryden spectra in octaves") {
  // Each bin of one record contains few waves: average over many seeds.
  constexpr int n = 2048, seeds = sanitized ? 8 : 60;
  constexpr double dt = 0.25, length = 50.0, speed = 15.0, sigma = 2.0;
  for (const bool up : {false, true}) {
    std::vector<double> power(n / 2, 0.0);  // of the k-th harmonic
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const auto x = record(weather({dryden(sigma, seed, up)}), up, n, dt);
      for (int k = 4; k < 256; ++k) {
        double re = 0, im = 0;
        for (int i = 0; i < n; ++i) {
          const double window = std::sqrt(2.0 / 3) * (1 - std::cos(2 * pi * i / n));  // Hann
          const double phase = 2 * pi * ((k * i) % n) / n;
          re += window * x[std::size_t(i)] * std::cos(phase);
          im += window * x[std::size_t(i)] * std::sin(phase);
        }
        power[std::size_t(k)] += 2 * (re * re + im * im) / (double(n) * n * seeds);
      }
    }
    for (int from = 8; from < 256; from *= 2) {
      double measured = 0, expected = 0;
      for (int k = from; k < std::min(2 * from, 256); ++k) {
        const double step = 2 * pi / (n * dt * speed);  // wave numbers between harmonics
        measured += power[std::size_t(k)];
        expected += dryden_spectrum(k * step, sigma, length, up) * step;
      }
      CAPTURE(from);
      CHECK_NEAR(measured / expected, 1.0, sanitized ? 0.5 : 0.2);
    }
  }
}

TEST_CASE("the rates of wind are the slopes of its speeds; seeds differ and repeat") {
  GustTable cosine{GustTable::Kind::one_minus_cosine, true, 4.0, 2.0};
  cosine.duration = 3.0;
  const Weather air = weather({dryden(1.0, 5), dryden(0.7, 6, true), cosine});
  constexpr double e = 1e-5;
  for (double t = 0.013; t < 8; t += 0.37) {
    const Wind at = air.wind(t), before = air.wind(t - e), behind = air.wind(t + e);
    CHECK_NEAR((behind.forward - before.forward) / (2 * e), at.forward_rate, 1e-7);
    CHECK_NEAR((behind.up - before.up) / (2 * e), at.up_rate, 1e-7);
  }
  const Weather again = weather({dryden(1.0, 5), dryden(0.7, 6, true), cosine});
  const Weather other = weather({dryden(1.0, 4), dryden(0.7, 6, true), cosine});
  CHECK(again.wind(3.3).forward == air.wind(3.3).forward);
  CHECK(other.wind(3.3).forward != air.wind(3.3).forward);
  CHECK(other.wind(3.3).up == air.wind(3.3).up);
}

TEST_CASE("a (1 - cosine) gust: its value, its peak, its kinks") {
  GustTable gust{GustTable::Kind::one_minus_cosine, true, 3.0, 2.0};
  gust.duration = 4.0;
  const Weather air = weather({gust});
  CHECK(air.kink_times == std::vector<double>{2, 6});
  for (const double t : {-5.0, 0.0, 2.0, 6.0, 7.0}) {
    CHECK(air.wind(t).up == 0);
    CHECK(air.wind(t).up_rate == 0);
  }
  CHECK_NEAR(air.wind(4.0).up, 3.0, 1e-15);
  CHECK_NEAR(air.wind(4.0).up_rate, 0.0, 1e-15);
  CHECK_NEAR(air.wind(3.0).up, 1.5, 1e-15);
  CHECK_NEAR(air.wind(3.0).up_rate, 1.5 * pi / 2, 1e-14);
  for (double t = 2; t <= 6; t += 0.1) {
    const double sine = std::sin(pi * (t - 2) / 4);
    CHECK_NEAR(air.wind(t).up, 3 * sine * sine, 1e-14);
    CHECK(air.wind(t).forward == 0);
  }
  for (const double t : {2 + 1e-7, 6 - 1e-7}) CHECK_NEAR(air.wind(t).up_rate, 0.0, 1e-6);
}

TEST_CASE("gusts add up; no gusts are calm") {
  CHECK_FALSE(weather({}).wind);
  const GustTable steady{GustTable::Kind::steady, false, 3.0};
  GustTable cosine{GustTable::Kind::one_minus_cosine, false, 2.0, 1.0};
  const Weather air = weather({steady, cosine, dryden(0.0), cosine});
  CHECK(air.kink_times == std::vector<double>{1, 2});
  CHECK_NEAR(air.wind(1.5).forward, 7.0, 1e-14);
  CHECK(air.wind(2.5).forward == 3.0);
  CHECK(air.wind(2.5).forward_rate == 0.0);
}

TEST_CASE("gusts that are none are refused") {
  const auto refused = [](const auto& change) {
    GustTable gust = dryden(1.0);
    change(gust);
    return refusal([&] { (void)weather({gust}); }).starts_with("gust: ");
  };
  CHECK_FALSE(refused([](GustTable&) {}));
  for (const double wrong : {nan_value, inf, -inf}) {
    CHECK(refused([&](GustTable& g) { g.size = wrong; }));
    CHECK(refused([&](GustTable& g) { g.at = wrong; }));
  }
  for (const double wrong : {0.0, -1.0, nan_value, inf}) {
    CHECK(refused([&](GustTable& g) { g.duration = wrong; }));
    CHECK(refused([&](GustTable& g) { g.length = wrong; }));
    CHECK(refused([&](GustTable& g) { g.speed = wrong; }));
  }
}

TEST_CASE("disturbances: steps, doublets, sums") {
  using Kind = DisturbanceTable::Kind;
  const Disturbances all = disturbances({{Kind::step, "V", 1.0, 2.0, 3.0},
                                         {Kind::step, "V", 2.0, 5.0},
                                         {Kind::doublet, "delta_e", 1.0, 0.1, 0.5},
                                         {Kind::step, "gamma", 0.0, 0.3, 1.0},
                                         {Kind::step, "theta0", 0.0, 0.4, 1.0},
                                         {Kind::step, "a1s", 0.0, 0.6, 1.0}});
  CHECK(all.kink_times == std::vector<double>{0, 1, 1.5, 2, 4});
  const std::map<double, double> V{{0.99, 0}, {1.0, 2}, {1.99, 2}, {2.0, 7},
                                   {3.99, 7}, {4, 5},   {1e9, 5}};
  for (const auto& [t, expected] : V) CHECK(all.at(t).V == expected);
  const std::map<double, double> elevator{{0.99, 0},   {1.0, 0.1},   {1.49, 0.1},
                                          {1.5, -0.1}, {1.99, -0.1}, {2.0, 0}};
  for (const auto& [t, expected] : elevator) CHECK(all.at(t).delta_e == expected);
  CHECK(all.at(0.5).gamma == 0.3);
  CHECK(all.at(0.5).theta0 == 0.4);
  CHECK(all.at(0.5).a1s == 0.6);
  CHECK(all.at(1.0).a1s == 0);
  CHECK_FALSE(disturbances({}).at);
}

TEST_CASE("disturbances that are none are refused") {
  using Kind = DisturbanceTable::Kind;
  CHECK(refusal([] {
          (void)disturbances({{Kind::step, "alpha", 0, 1}});
        }) == "disturbance: no 'alpha'; there are: V, gamma, theta0, a1s, delta_e");
  for (const double wrong : {nan_value, inf}) {
    CHECK(refusal([&] { (void)disturbances({{Kind::step, "V", wrong, 1}}); }) != "");
    CHECK(refusal([&] { (void)disturbances({{Kind::step, "V", 0, wrong}}); }) != "");
    CHECK(refusal([&] { (void)disturbances({{Kind::step, "V", 0, 1, wrong}}); }) != "");
  }
  CHECK(refusal([] { (void)disturbances({{Kind::step, "V", 0, 1, -1}}); }) != "");
  CHECK(refusal([] { (void)disturbances({{Kind::doublet, "V", 0, 1, 0}}); }) != "");
}

// ---- proportion ----

// P(at most met) of the binomial distribution.
static double at_most(long met, long of, double p) {
  double sum = 0;
  for (long k = 0; k <= met; ++k)
    sum += std::exp(std::lgamma(double(of + 1)) - std::lgamma(double(k + 1)) -
                    std::lgamma(double(of - k + 1)) + double(k) * std::log(p) +
                    double(of - k) * std::log1p(-p));
  return sum;
}

TEST_CASE("Clopper and Pearson's interval: closed forms, its own definition, monotone") {
  CHECK(proportion(0, 0).lower == 0);
  CHECK(proportion(0, 0).upper == 1);
  for (const long n : {1L, 2L, 10L, 1000L, 1'000'000L}) {
    CAPTURE(n);
    const double one_sided = -std::expm1(std::log(0.025) / double(n));  // 1 - 0.025^(1/n)
    CHECK(proportion(0, n).lower == 0);
    CHECK_NEAR(proportion(0, n).upper / one_sided, 1.0, 1e-9);
    CHECK(proportion(n, n).upper == 1);
    CHECK_NEAR(1 - proportion(n, n).lower, one_sided, 1e-9 * one_sided + 1e-15);
  }
  Proportion before = proportion(0, 30);
  for (long k = 1; k <= 30; ++k) {
    const Proportion here = proportion(k, 30);
    CHECK(here.share == double(k) / 30);
    CHECK(here.lower > before.lower);
    CHECK(here.upper > before.upper);
    CHECK(here.lower < here.share);
    CHECK(here.upper >= here.share);
    if (k < 30) CHECK_NEAR(at_most(k, 30, here.upper), 0.025, 1e-12);
    CHECK_NEAR(1 - at_most(k - 1, 30, here.lower), 0.025, 1e-12);
    before = here;
  }
}

// ---- plans ----

static FlightPlan planned(const std::string& simulate) { return flight_plan(studied(simulate)); }

TEST_CASE("where a plan starts: on the ground, from the first command's trim, from a condition's" *
          thorough) {
  const FlightPlan ground = planned("[simulate]\n");
  CHECK(ground.start.on_ground);
  CHECK(ground.start.state.along == 0);
  CHECK(ground.start.state.eta == pi / 2);
  CHECK(ground.start_words == "at rest on the ground");
  CHECK_FALSE(ground.lands);
  const FlightPlan foot = planned("[simulate]\nstart = 'foot'\nheight = 7\nduration = 3\n");
  CHECK_FALSE(foot.start.on_ground);
  CHECK(foot.start.state.height == 7);
  CHECK(foot.options.duration == 3);
  CHECK(foot.start_words == "from the trim at V = 2 m/s, γ = 90°, η = 90°");
  CHECK_NEAR(std::hypot(foot.start.state.along, foot.start.state.across), 2.0, 1e-14);
  const FlightPlan held_level = planned("[simulate]\nschedule = 'hold'\n");
  CHECK(held_level.start_words == "from the trim at V = 15 m/s, γ = 0°, η = 0°");
  CHECK(held_level.flight.schedule.command(9, 9).V == 15);
  const FlightPlan held_foot = planned("[simulate]\nschedule = 'hold'\nstart = 'foot'\n");
  CHECK(held_foot.flight.schedule.command(9, 9).V == 2);
  const FlightPlan back = planned("[simulate]\nschedule = 'reconversion'\n");
  CHECK(back.lands);
  CHECK(back.start.state.height == 120);
  CHECK(back.start_words == held_level.start_words);
  const FlightPlan impossible = planned(
      "[simulate]\nstart = 'trim'\n[simulate.schedule]\nover = 'time'\nat = [0, 1]\n"
      "V = [30, 30]\ngamma_deg = [90, 90]\neta_deg = [0, 0]\n");
  CHECK(!is_equilibrium(impossible.start_status));
  CHECK_FALSE(impossible.message.empty());
}

TEST_CASE("a plan's start is a trim: its rates vanish, in either axes, with scheduled gains") {
  const std::string scheduled =
      "[gains]\nschedule_eta_deg = [0, 90]\nK_Lp = [0.75, 1.5]\nK_Ei = [1.25, 0.5]\n";
  for (const char* axes : {"body", "wind"})
    for (const char* start : {"foot", "level"}) {
      const FlightPlan plan =
          planned(fmt::format("[simulate]\nschedule = 'hold'\nheight = 50\nstart = '{}'\n"
                              "axes = '{}'\n",
                              start, axes) +
                  scheduled);
      const FlightMode mode = mode_at(plan.flight, plan.start);
      const FlightPoint at = flight_point(plan.flight, mode, 0, plan.start.state);
      const FlightState& rates = at.rates;
      for (const double rate :
           {rates.along, rates.across, rates.theta, rates.q, rates.x1, rates.x2})
        CHECK_NEAR(rate, 0.0, 1e-8);
      CHECK_NEAR(at.used.theta0, plan.start.state.theta0, 1e-9);
      CHECK_NEAR(at.used.a1s, plan.start.state.a1s, 1e-9);
      CHECK_NEAR(at.used.delta_e, plan.start.state.delta_e, 1e-9);
      CHECK(mode.airplane == (plan.start.state.eta == 0));
    }
}

TEST_CASE("states put in by name: V and gamma stay where only the attitude is given") {
  for (const Axes axes : {Axes::body, Axes::wind}) {
    FlightState x;
    put({{"V", 8.0}, {"gamma", 0.3}, {"theta", 0.5}}, axes, x);
    put({{"theta", 0.9}, {"q", 0.1}, {"energy_integral", 2}, {"distribution_integral", 3}}, axes,
        x);
    Flight flight{reference_vehicle()};
    flight.axes = axes;
    const FlightPoint at = flight_point(flight, {}, 0, x);
    CHECK_NEAR(at.V, 8.0, 1e-14);
    CHECK_NEAR(at.gamma, 0.3, 1e-15);
    CHECK_NEAR(at.alpha, 0.6, 1e-15);
    CHECK(x.q == 0.1);
    CHECK(x.x1 == 2);
    CHECK(x.x2 == 3);
  }
}

TEST_CASE("a plan of what the study has not is refused; so is an aircraft of no mass") {
  const Study study = studied("[simulate]\n");
  SimulateTable table;
  table.start = "hover";
  CHECK(refusal([&] { (void)flight_of(study, table); }).empty());  // not applicable to a corridor
  table.schedule.kind = ScheduleTable::Kind::hold;
  CHECK(refusal([&] { (void)flight_of(study, table); }) == "simulate: no condition 'hover'");
  Study other = study;
  other.simulate->start = "hover";
  CHECK(refusal([&] { (void)flight_plan(other); }) == "simulate: no condition 'hover'");
  other.simulate->start = "foot";
  other.conditions[1].asked = AirframeCondition{};
  CHECK(refusal([&] { (void)flight_plan(other); }) ==
        "simulate: the condition 'foot' is not a closed loop");
  for (const char* mass : {"0", "-4", "nan"})
    CHECK_THROWS_AS((void)studied(fmt::format("[aircraft]\nmass = {}\n[simulate]\n", mass)),
                    StudyError);
}

TEST_CASE("disturbances and gusts of a study bring their kinks, in order") {
  const Study study = studied(
      "[simulate]\n[[simulate.disturbance]]\nkind = 'step'\non = 'V'\nat = 2\nsize = 1\n"
      "[[simulate.gust]]\nkind = 'one_minus_cosine'\nsize = 2\nat = 1\nduration = 3\n");
  CHECK(flight_of(study, *study.simulate).kink_times == std::vector<double>{1, 2, 4});
}

// ---- flights ----

static const Command climbing{2.0, pi / 2, pi / 2}, level{15.0, 0.0, 0.0};
static constexpr double high = 1e4;  // m: no ground

static Flight holding(const Command& command) {
  Flight flight{reference_vehicle()};
  flight.schedule = held(command);
  return flight;
}

static FlightStart trimmed(const Flight& flight, double height = high) {
  const TrimmedStart trim = trimmed_start(flight, flight.schedule.command(0, height), height);
  REQUIRE(trim);
  return trim.start;
}

static FlyOptions for_seconds(double duration, double sample = 0.1) {
  FlyOptions options;
  options.duration = duration;
  options.integrate.tolerance = 1e-11;
  options.integrate.sample = sample;
  return options;
}

static std::vector<FlightPoint> points(const Flight& flight, const FlightResult& flown) {
  std::vector<FlightPoint> all;
  for (std::size_t k = 0; k < flown.t.size(); ++k)
    all.push_back(flight_point(flight, flown.modes[k], flown.t[k], flown.states[k]));
  return all;
}

static std::vector<FlightEvent> events(const FlightResult& flown, FlightEventKind kind) {
  std::vector<FlightEvent> all;
  std::ranges::copy_if(flown.events, std::back_inserter(all),
                       [&](const FlightEvent& e) { return e.kind == kind; });
  return all;
}

// Both commands are stepped and the elevator kicked.
static Flight shaken(Flight flight) {
  using Kind = DisturbanceTable::Kind;
  const Disturbances added = disturbances({{Kind::step, "V", 1.0, 2.0, 3.0},
                                           {Kind::doublet, "gamma", 2.0, 0.2, 2.0},
                                           {Kind::step, "delta_e", 5.0, 0.1, 0.5}});
  flight.disturbance = added.at;
  flight.kink_times = added.kink_times;
  return flight;
}

TEST_CASE("steady wind carries the flight along and changes nothing else") {
  const Flight calm = shaken(holding(level));
  Flight windy = calm;
  windy.wind = [](double) { return Wind{4.0, -1.5}; };
  const FlightStart start = trimmed(calm);
  const FlightResult a = fly(calm, start, for_seconds(10));
  const FlightResult b = fly(windy, start, for_seconds(10));
  REQUIRE(a);
  REQUIRE(b);
  REQUIRE(a.t == b.t);
  for (std::size_t k = 0; k < a.t.size(); ++k) {
    const FlightState &x = a.states[k], &y = b.states[k];
    CHECK_NEAR(y.along, x.along, 1e-9);
    CHECK_NEAR(y.across, x.across, 1e-9);
    CHECK_NEAR(y.theta, x.theta, 1e-9);
    CHECK_NEAR(y.q, x.q, 1e-9);
    CHECK_NEAR(y.x1, x.x1, 1e-9);
    CHECK_NEAR(y.x2, x.x2, 1e-9);
    CHECK_NEAR(y.thrust_work, x.thrust_work, 1e-7);  // thousands of m²/s²
    CHECK_NEAR(y.distance, x.distance + 4.0 * a.t[k], 1e-8);
    CHECK_NEAR(y.height, x.height - 1.5 * a.t[k], 1e-8);
  }
}

TEST_CASE("an actuator is a lag that goes no faster than its rate: a closed form") {
  // A 0.2 rad step of the tilt command at 1 s, on a tilt that nothing else acts on: at 0.1 rad/s
  // while the remaining error exceeds 0.1 rad/s times the lag.
  constexpr double rate = 0.1, lag = 0.3, step = 0.2;
  Flight flight = holding(level);
  flight.rates.eta = rate;
  flight.lag = lag;
  flight.schedule.command = [](double t, double) {
    return Command{15, 0, t < 1 ? 0.3 : 0.3 - step};
  };
  flight.schedule.kink_times = {1.0};
  FlightStart start = trimmed(holding({15, 0, 0.3}));
  const FlightResult flown = fly(flight, start, for_seconds(5, 0.01));
  REQUIRE(flown);
  const double slows = 1 + (step - rate * lag) / rate;
  for (std::size_t k = 0; k < flown.t.size(); ++k) {
    const double t = flown.t[k];
    const double rest = t < 1       ? step
                        : t < slows ? step - rate * (t - 1)
                                    : rate * lag * std::exp(-(t - slows) / lag);
    CHECK_NEAR(flown.states[k].eta, 0.3 - step + rest, 1e-8);
  }
}

TEST_CASE("no actuator is faster than its rate nor beyond its limits, and each comes to both") {
  Flight flight = shaken(holding({8.0, 0.3, 65 * degree}));
  flight.rates = {0.3, 0.2, 0.4, 0.05};
  flight.schedule.command = [](double t, double) {
    return Command{8.0 + (t > 3 ? 6 : 0), t > 1 ? 0.9 : 0.3, (t > 2 ? 50 : 65) * degree};
  };
  flight.schedule.kink_times = {1, 2, 3};
  flight.vehicle.limits.a1s = {-0.2, 0.2};
  flight.vehicle.limits.delta_e = {-0.1, 0.1};
  FlightState x;
  put({{"V", 8.0}, {"gamma", 0.3}, {"theta", 0.3}}, Axes::body, x);
  x.height = high;
  x.eta = 65 * degree;
  const FlightResult flown = fly(flight, {x, false}, for_seconds(9, 0.005));
  REQUIRE(flown.t.size() > 200);
  const Limits& limits = flight.vehicle.limits;
  double theta0 = 0, a1s = 0, delta_e = 0, eta = 0, largest_a1s = 0, largest_delta_e = 0;
  for (const FlightPoint& at : points(flight, flown)) {
    theta0 = std::max(theta0, std::abs(at.rates.theta0));
    a1s = std::max(a1s, std::abs(at.rates.a1s));
    delta_e = std::max(delta_e, std::abs(at.rates.delta_e));
    eta = std::max(eta, std::abs(at.rates.eta));
    largest_a1s = std::max(largest_a1s, std::abs(at.used.a1s));
    largest_delta_e = std::max(largest_delta_e, std::abs(at.used.delta_e));
    CHECK(at.used.theta0 <= limits.theta0.upper);
    CHECK(at.used.theta0 >= limits.theta0.lower);
  }
  CHECK(theta0 == 0.3);
  CHECK(a1s == 0.2);
  CHECK(delta_e == 0.4);
  CHECK(eta == 0.05);
  CHECK_NEAR(largest_a1s, 0.2, 1e-6);  // a lag approaches its limit asymptotically
  CHECK(largest_a1s <= 0.2);
  CHECK_NEAR(largest_delta_e, 0.1, 1e-6);
  CHECK(largest_delta_e <= 0.1);
  // The samples themselves obey the rate limit.
  for (std::size_t k = 1; k < flown.t.size(); ++k) {
    const double dt = flown.t[k] - flown.t[k - 1];
    const FlightState &a = flown.states[k - 1], &b = flown.states[k];
    CHECK(std::abs(b.theta0 - a.theta0) <= 0.3 * dt + 1e-10);
    CHECK(std::abs(b.a1s - a.a1s) <= 0.2 * dt + 1e-10);
    CHECK(std::abs(b.delta_e - a.delta_e) <= 0.4 * dt + 1e-10);
    CHECK(std::abs(b.eta - a.eta) <= 0.05 * dt + 1e-10);
  }
}

TEST_CASE("ever shorter lags come to actuators that follow at once, as the lag itself") {
  const Flight ideal = shaken(holding(level));
  const FlightStart start = trimmed(ideal);
  const FlightResult expected = fly(ideal, start, for_seconds(2.5));
  REQUIRE(expected);
  const auto apart = [&](double lag) {
    Flight flight = ideal;
    flight.rates = {1e6, 1e6, 1e6, 1e6};
    flight.lag = lag;
    const FlightResult flown = fly(flight, start, for_seconds(2.5));
    REQUIRE(flown);
    const FlightState &x = flown.states.back(), &at_once = expected.states.back();
    return std::hypot(x.along - at_once.along, x.across - at_once.across);
  };
  const double coarse = apart(4e-4), fine = apart(2e-4);
  CHECK(fine < 0.002);
  CHECK_NEAR(std::log2(coarse / fine), 1.0, 0.1);
}

// ---- limits and integrals ----

// On the ground at full thrust that does not carry the weight; the wake misses the wing, so that
// only the integrals change.
static Flight too_heavy() {
  Flight flight = holding(climbing);
  flight.vehicle.aircraft.thrust_excess = 0.9;
  flight.vehicle.aircraft.wake_immersion = 0;
  return flight;
}

TEST_CASE("a command beyond its limit comes back in the stated time: a closed form") {
  for (const double seconds : {0.4, 1.0, 5.0}) {
    CAPTURE(seconds);
    Flight flight = too_heavy();
    flight.anti_windup = seconds;
    FlightStart start = at_rest();
    start.state.x1 = 3;
    const FlightResult flown = fly(flight, start, for_seconds(10));
    REQUIRE(flown);
    const Gains& k = flight.vehicle.gains;
    const double Ep = flight.vehicle.aircraft.thrust_excess;
    const auto at = points(flight, flown);
    // (K_Ei x1/(1 + Ep K_Ep))' = K_Ei He/(1 + Ep K_Ep) - excess/T, He being constant.
    const double stays = seconds * k.K_Ei * at[0].He / (1 + Ep * k.K_Ep);
    const double first = at[0].asked.theta0 - 1;
    CHECK(first > 0);
    for (std::size_t i = 0; i < at.size(); ++i) {
      REQUIRE_MESSAGE(at[i].He == at[0].He, flown.t[i]);
      const double excess = stays + (first - stays) * std::exp(-flown.t[i] / seconds);
      CHECK_NEAR(at[i].asked.theta0 - 1, excess, 1e-9);
    }
  }
}

TEST_CASE("the same of the integral that the cyclic's command has, and of the elevator's") {
  for (const bool airplane : {false, true}) {
    CAPTURE(airplane);
    Flight flight = too_heavy();
    flight.schedule = held({2.0, pi / 2, airplane ? 50 * degree : pi / 2});
    flight.anti_windup = 2.0;
    FlightStart start = at_rest();
    start.state.x2 = 100;
    const FlightResult flown = fly(flight, start, for_seconds(6));
    REQUIRE(flown);
    const Gains& k = flight.vehicle.gains;
    const auto at = points(flight, flown);
    const Limits& limits = flight.vehicle.limits;
    const auto beyond = [&](const FlightPoint& p) {
      return airplane ? p.asked.delta_e - limits.delta_e.upper : p.asked.a1s - limits.a1s.upper;
    };
    const double stays = 2.0 * k.K_Li / (airplane ? 1 : 1 + k.K_Lp) * at[0].Le;
    CHECK(beyond(at[0]) > 0);
    for (std::size_t i = 0; i < at.size(); ++i) {
      REQUIRE_MESSAGE(at[i].Le == at[0].Le, flown.t[i]);
      CHECK_NEAR(beyond(at[i]), stays + (beyond(at[0]) - stays) * std::exp(-flown.t[i] / 2), 1e-9);
    }
  }
}

TEST_CASE("without anti-windup the integral of a saturated flight grows without end") {
  Flight flight = too_heavy();
  flight.anti_windup = inf;
  const FlightResult wound = fly(flight, at_rest(), for_seconds(30));
  const FlightPoint at = flight_point(flight, {true, false}, 0, {});
  CHECK_NEAR(wound.states.back().x1, 30 * at.He, 1e-8);
  flight.anti_windup = 1;
  const FlightResult unwound = fly(flight, at_rest(), for_seconds(30));
  CHECK(std::abs(unwound.states.back().x1) < std::abs(wound.states.back().x1) / 5);
}

TEST_CASE("a limit that is reached is left, by turns, and never exceeded") {
  Flight flight = shaken(Flight{reference_vehicle()});
  const FlightResult flown = fly(flight, at_rest(), for_seconds(60));
  std::map<std::string, int> side;
  for (const FlightEvent& e : flown.events) {
    if (e.kind == FlightEventKind::limit_reached) CHECK(side[e.what]++ == 0);
    if (e.kind == FlightEventKind::limit_left && !side.contains(e.what)) side[e.what] = 1;
    if (e.kind == FlightEventKind::limit_left) CHECK(side[e.what]-- == 1);
  }
  CHECK(side.size() >= 4);
  const Limits& limits = flight.vehicle.limits;
  bool reached = false, left = false;
  for (const FlightPoint& at : points(flight, flown)) {
    CHECK(at.used.theta0 == std::clamp(at.asked.theta0, limits.theta0.lower, limits.theta0.upper));
    CHECK(at.used.a1s == std::clamp(at.asked.a1s, limits.a1s.lower, limits.a1s.upper));
    CHECK(at.used.delta_e ==
          std::clamp(at.asked.delta_e, limits.delta_e.lower, limits.delta_e.upper));
    reached |= at.asked.theta0 > limits.theta0.upper;
    left |= at.asked.theta0 < limits.theta0.upper;
  }
  CHECK(reached);
  CHECK(left);
}

TEST_CASE("a climb at full thrust that lasts: with anti-windup a tenth of the integral") {
  Flight flight = holding(climbing);
  FlightStart start = trimmed(flight);
  flight.schedule = held({30.0, pi / 2, pi / 2});
  const auto wound = [&](double anti_windup) {
    flight.anti_windup = anti_windup;
    const FlightResult flown = fly(flight, start, for_seconds(10));
    CHECK(flown.t.back() == 10);
    for (const FlightPoint& at : points(flight, flown)) CHECK(at.used.theta0 <= 1);
    return flown.states.back().x1;
  };
  CHECK(wound(inf) > 100);
  CHECK(wound(1) < wound(inf) / 10);
}

// ---- the ground ----

TEST_CASE("too heavy to lift off: it stays, at rest, to the end") {
  const FlightResult flown = fly(too_heavy(), at_rest(), for_seconds(20));
  CHECK(flown.status == FlightStatus::flown);
  CHECK(events(flown, FlightEventKind::lift_off).empty());
  for (std::size_t k = 0; k < flown.t.size(); ++k) {
    CHECK(flown.modes[k].on_ground);
    CHECK(flown.states[k].height == 0);
    CHECK(flown.states[k].distance == 0);
    CHECK(flown.states[k].along == 0);
  }
}

TEST_CASE("it lifts off when the integral has wound up: a closed form") {
  Flight flight = holding({0.05, pi / 2, pi / 2});
  Aircraft& a = flight.vehicle.aircraft;
  const Gains& k = flight.vehicle.gains;
  // Straight up: no wake on the wing, no moment, no cyclic.
  a.wake_immersion = a.rotor_x = 0;
  flight.vehicle.limits.a1s = {0, 0};
  // Held, V' is 0: x1' = He = k_V V/g, theta0 = (K_Ep (He + 1) + K_Ei x1)/(1 + Ep K_Ep), until
  // Ep theta0 is 1.
  const double He = k.k_V * 0.05 / a.gravity;
  const double expected = (1 / a.thrust_excess - k.K_Ep * He) / (k.K_Ei * He);
  const FlightResult flown = fly(flight, at_rest(), for_seconds(expected + 0.5));
  const auto lift_offs = events(flown, FlightEventKind::lift_off);
  REQUIRE(lift_offs.size() == 1);
  CHECK(expected > 1);
  CHECK_NEAR(lift_offs[0].t, expected, 1e-8);
  CHECK(lift_offs[0].mode_before.on_ground);
  CHECK_FALSE(lift_offs[0].mode_after.on_ground);
  CHECK(flown.states.back().height > 0);
}

TEST_CASE("lift-off at once has the flight's own time") {
  const Flight flight{reference_vehicle()};
  FlyOptions options = for_seconds(2);
  options.begins = 5;
  const FlightResult flown = fly(flight, at_rest(), options);
  const auto lift_offs = events(flown, FlightEventKind::lift_off);
  REQUIRE(lift_offs.size() == 1);
  CHECK(lift_offs[0].t == 5);
  CHECK(lift_offs[0].what == "at once");
  CHECK_FALSE(flown.modes.front().on_ground);
}

// A trim in level flight, carried by a steady wind, half a metre above the ground.
static FlightResult touched_down(const Wind& wind, double leans = FlyOptions{}.leans) {
  Flight flight = holding(level);
  flight.wind = [wind](double) { return wind; };
  FlyOptions options = for_seconds(2);
  options.leans = leans;
  return fly(flight, trimmed(flight, 0.5), options);
}

TEST_CASE("on the ground: landed if softly, else not") {
  const FlightResult soft = touched_down({-14, -1});
  CHECK(soft.status == FlightStatus::landed);
  CHECK(
      soft.message.starts_with("touches down at 1 m/s vertical and 1 m/s horizontal speed, θ = "));
  CHECK_NEAR(soft.t.back(), 0.5, 2e-6);  // a thousandth of a millimetre is no contact
  CHECK(soft.states.back().height == 0.0);
  CHECK_NEAR(soft.states.back().distance, 0.5, 2e-6);
  const auto contacts = events(soft, FlightEventKind::ground_contact);
  REQUIRE(contacts.size() == 1);
  CHECK(contacts[0].t == soft.t.back());
  CHECK(touched_down({0, -1}).status == FlightStatus::ground_contact);      // 15 m/s along
  CHECK(touched_down({-14, -3.1}).status == FlightStatus::ground_contact);  // down
  CHECK(touched_down({-14, -2.9}).status == FlightStatus::landed);
  CHECK(touched_down({-14, -2.9}, 1e-3).status == FlightStatus::ground_contact);  // leans
}

TEST_CASE("a flight that starts at the ground's height and sinks is on the ground") {
  Flight flight = holding(level);
  flight.wind = [](double) { return Wind{0, -1}; };
  const FlightResult flown = fly(flight, trimmed(flight, 0.0), for_seconds(2));
  CHECK(flown.status == FlightStatus::ground_contact);
  CHECK_NEAR(flown.t.back(), 0.0, 2e-6);
  // Level flight does not touch down until a gust pushes it down.
  flight.wind = {};
  CHECK(fly(flight, trimmed(flight, 0.0), for_seconds(50)));
  flight.wind = [](double t) { return Wind{0, t < 1 ? 0.0 : -1.0}; };
  flight.kink_times = {1};
  const FlightResult pressed = fly(flight, trimmed(flight, 0.0), for_seconds(50));
  CHECK(pressed.status == FlightStatus::ground_contact);
  CHECK_NEAR(pressed.t.back(), 1.0, 2e-6);
}

// ---- every way of ending ----

TEST_CASE("flown, with schedule kinks on the way") {
  const FlightPlan plan = planned("[simulate]\nstart = 'foot'\nheight = 10\nduration = 20\n");
  const FlightResult flown = fly(plan.flight, plan.start, plan.options);
  CHECK(flown);
  CHECK(flown.message.empty());
  const auto kinks = events(flown, FlightEventKind::schedule_kink);
  REQUIRE(kinks.size() == 1);
  CHECK(kinks[0].what == "h = 20 m");
  CHECK_NEAR(kinks[0].after.height, 20.0, 1e-9);
}

TEST_CASE("lost: too fast, pitched over, or so already at the start") {
  Flight flight = holding(level);
  const FlightStart start = trimmed(flight);
  flight.schedule = held({25, 0, 0});
  FlyOptions options = for_seconds(60);
  options.fastest = 17;
  const FlightResult fast = fly(flight, start, options);
  CHECK(fast.status == FlightStatus::lost);
  CHECK(fast.message == "too fast");
  CHECK(events(fast, FlightEventKind::lost).size() == 1);
  CHECK_NEAR(points(flight, fast).back().V, 17.0, 1e-9);
  options.fastest = 60;
  flight.schedule = held(level);
  FlightStart turning = start;
  turning.state.q = 40;
  const FlightResult over = fly(flight, turning, options);
  CHECK(over.status == FlightStatus::lost);
  CHECK(over.message == "pitched over (beyond 3 rad)");
  CHECK_NEAR(std::abs(over.states.back().theta), 3.0, 1e-9);
  for (const auto& [state, value] : {std::pair{"V", 61.0}, {"theta", -3.1}}) {
    FlightStart beyond = start;
    put({{state, value}}, Axes::body, beyond.state);
    const FlightResult at_once = fly(flight, beyond, options);
    CHECK(at_once.status == FlightStatus::lost);
    CHECK(at_once.t == std::vector<double>{0.0});
    CHECK(at_once.states.size() == 1);
    CHECK(at_once.modes.size() == 1);
    REQUIRE(at_once.events.size() == 1);
    CHECK(at_once.events[0].what == at_once.message);
  }
}

TEST_CASE("not finite: a gust without a number, at its time") {
  Flight flight = holding(level);
  flight.wind = [](double t) {
    return Wind{t < 1.25 ? 0 : nan_value, 0, t < 1.25 ? 0 : nan_value};
  };
  flight.kink_times = {1.25};
  const FlightResult flown = fly(flight, trimmed(flight), for_seconds(5));
  CHECK(flown.status == FlightStatus::not_finite);
  CHECK(flown.t.back() == 1.25);
  CHECK_FALSE(flown.message.empty());
}

TEST_CASE("stuck: gains without measure and hardly a lag end with the steps") {
  Flight flight = shaken(holding(level));
  const FlightStart start = trimmed(flight);
  flight.vehicle.gains.k_de = 1e6;
  flight.rates = {1e3, 1e3, 1e3, 1e3};
  flight.lag = 1e-6;
  FlyOptions options = for_seconds(20);
  options.integrate.max_steps = 3000;
  const FlightResult flown = fly(flight, start, options);
  CHECK(flown.status == FlightStatus::stuck);
  CHECK_FALSE(flown.message.empty());
  CHECK(flown.steps <= 3000);
}

TEST_CASE("interrupted: by the caller's stop") {
  std::stop_source source;
  Flight flight = holding(level);
  flight.wind = [&](double t) {
    if (t > 1) source.request_stop();
    return Wind{};
  };
  FlyOptions options = for_seconds(50);
  options.integrate.stop = source.get_token();
  const FlightResult flown = fly(flight, trimmed(flight), options);
  CHECK(flown.status == FlightStatus::interrupted);
  CHECK(flown.t.back() < 5);
}

TEST_CASE("every kind of event and every status has a name of its own") {
  std::set<std::string> names;
  for (int k = 0; k <= int(FlightEventKind::lost); ++k) names.insert(to_string(FlightEventKind(k)));
  CHECK(names.size() == 7);
  names.clear();
  for (std::size_t k = 0; k < flight_statuses; ++k) names.insert(to_string(FlightStatus(k)));
  CHECK(names.size() == flight_statuses);
}

TEST_CASE("what cannot fly is refused in words") {
  const Flight good = holding(level);
  const FlightStart start = trimmed(good);
  const auto refused = [&](const auto& change, const std::string& word) {
    Flight flight = good;
    FlightStart from = start;
    FlyOptions options = for_seconds(1);
    change(flight, from, options);
    const std::string why = refusal([&] { (void)fly(flight, from, options); });
    CAPTURE(why);
    CHECK(why.find(word) != std::string::npos);
  };
  refused([](auto& f, auto&, auto&) { f.vehicle.polar = nullptr; }, "no polar");
  refused([](auto& f, auto&, auto&) { f.vehicle.equations = Equations::printed; }, "printed");
  refused([](auto& f, auto&, auto&) { f.schedule.command = {}; }, "no schedule");
  refused([](auto&, auto& x, auto&) { x.state.height = -1; }, "below the ground");
  refused([](auto& f, auto& x, auto&) { f.axes = Axes::wind, x = at_rest(); }, "wind axes");
  refused([](auto& f, auto& x, auto&) { f.axes = Axes::wind, x.state.along = 0; }, "airspeed");
  for (const double wrong : {0.0, -1.0, nan_value}) {
    refused([&](auto& f, auto&, auto&) { f.lag = wrong; }, "lag");
    refused([&](auto& f, auto&, auto&) { f.anti_windup = wrong; }, "anti_windup");
    refused([&](auto&, auto&, auto& o) { o.duration = wrong; }, "duration");
    refused([&](auto& f, auto&, auto&) { f.rates.a1s = wrong; }, "rate limits");
  }
  for (const double wrong : {inf, nan_value}) {
    refused([&](auto& f, auto&, auto&) { f.vehicle.limits.a1s.upper = wrong; }, "limits");
    refused([&](auto&, auto&, auto& o) { o.steepest = wrong; }, "finite");
    refused([&](auto&, auto&, auto& o) { o.sinks = wrong; }, "finite");
    refused([&](auto&, auto& x, auto&) { x.state.q = wrong; }, "starts at");
  }
  refused([](auto& f, auto&, auto&) { f.vehicle.limits.theta0 = {1, 0}; }, "limits");
}

// ---- handover ----

// Near the handover with every state moving, gains of studies/transition_bumpless.toml.
static Flight handed_over() {
  Flight flight =
      flight_plan(load_study(TILTRIM_SOURCE_DIR "/studies/transition_bumpless.toml")).flight;
  flight.schedule = held({6.0, 0.9, 60 * degree});
  return flight;
}

static FlightState moving(double x2) {
  FlightState x;
  put({{"V", 6.0}, {"gamma", 0.9}, {"theta", 0.2}, {"q", 0.02}, {"distribution_integral", x2}},
      Axes::body, x);
  x.height = high;
  return x;
}

TEST_CASE("bumpless: the pitching moment behind is the one in front, both ways") {
  const Flight flight = handed_over();
  for (const bool airplane : {false, true}) {
    CAPTURE(airplane);
    FlightState x = moving(airplane ? -6.0 : -10.0);
    const FlightPoint before = flight_point(flight, {false, airplane}, 0, x);
    x.x2 = bumpless_x2(flight, {false, airplane}, 0, x);
    const FlightPoint behind = flight_point(flight, {false, !airplane}, 0, x);
    const Limits& limits = flight.vehicle.limits;
    if (!airplane) {
      CHECK(std::abs(behind.asked.delta_e) < limits.delta_e.upper);
      CHECK(std::abs(before.pitch_acceleration) > 0.01);
    } else {
      CHECK(std::abs(behind.asked.a1s) < limits.a1s.upper);
    }
    CHECK_NEAR(behind.pitch_acceleration, before.pitch_acceleration, 1e-12);
  }
}

TEST_CASE("bumpless beyond the limits: the nearer limit; without K_Li nothing") {
  Flight flight = handed_over();
  flight.vehicle.limits.delta_e = {-0.001, 0.002};
  for (const double push : {-1e4, 1e4}) {
    FlightState x = moving(push);
    const FlightPoint before = flight_point(flight, {false, false}, 0, x);
    CHECK(std::abs(before.used.a1s) == 0.35);
    x.x2 = bumpless_x2(flight, {false, false}, 0, x);
    const FlightPoint behind = flight_point(flight, {false, true}, 0, x);
    // Disc tilted forward pitches down, like a positive elevator deflection.
    CHECK_NEAR(behind.asked.delta_e, push > 0 ? 0.002 : -0.001, 1e-12);
  }
  flight.vehicle.gains.K_Li = 0;
  CHECK(bumpless_x2(flight, {false, false}, 0, moving(-7)) == -7);
  CHECK(bumpless_x2(flight, {false, true}, 0, moving(-7)) == -7);
}

TEST_CASE("a flight over the hand-over: x2 jumps if bumpless, nothing else does, once") {
  for (const HandOver kind : {HandOver::as_printed, HandOver::bumpless})
    for (const double sign : {-1.0, 1.0}) {
      CAPTURE(sign);
      Flight flight = handed_over();
      flight.hand_over = kind;
      flight.schedule.command = [sign](double t, double) {
        return Command{6.0, 0.9, 60 * degree + sign * degree * (t - 1.5)};
      };
      const FlightResult flown = fly(flight, {moving(-10), false}, for_seconds(2));
      const auto crossed = events(flown, FlightEventKind::hand_over);
      REQUIRE(crossed.size() == 1);
      const FlightEvent& e = crossed[0];
      CHECK_NEAR(e.t, 1.5, 1e-9);
      CHECK(e.what == (sign < 0 ? "to the elevator" : "to the cyclic"));
      CHECK(e.mode_before.airplane == (sign > 0));
      CHECK(e.mode_after.airplane == (sign < 0));
      CHECK((e.after.x2 == e.before.x2) == (kind == HandOver::as_printed));
      CHECK(e.after.theta == e.before.theta);
      CHECK(e.after.along == e.before.along);
      CHECK(e.after.x1 == e.before.x1);
    }
}

TEST_CASE("a flight that starts at the hand-over's tilt has the cyclic, until the tilt falls") {
  for (const double sign : {-1.0, 1.0}) {
    CAPTURE(sign);
    Flight flight = handed_over();
    const double off = flight.vehicle.aircraft.cyclic_off;
    flight.schedule.command = [=](double t, double) {
      return Command{6.0, 0.9, off + sign * degree * t};
    };
    const FlightResult flown = fly(flight, {moving(-10), false}, for_seconds(1));
    CHECK(flown.modes.back().airplane == (sign < 0));
    CHECK(events(flown, FlightEventKind::hand_over).size() == (sign < 0 ? 1 : 0));
    if (sign > 0) CHECK(flown.states.front().x2 == -10);
  }
}

TEST_CASE("with a blend there is no hand-over") {
  Flight flight = handed_over();
  flight.vehicle.aircraft.cyclic_blend = 5 * degree;
  flight.schedule.command = [](double t, double) { return Command{6.0, 0.9, (63 - t) * degree}; };
  const FlightResult flown = fly(flight, {moving(-10), false}, for_seconds(6));
  CHECK(events(flown, FlightEventKind::hand_over).empty());
}

}  // namespace flight_parts_test
