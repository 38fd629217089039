// Monte-Carlo flights: laws of probability, of the log, of threads, and of the flights themselves.
#include "flight/monte_carlo.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "flight/fly.hpp"
#include "runtime/log.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"

using namespace tiltrim;

namespace fs = std::filesystem;

namespace monte_carlo_test {

namespace {}  // namespace

static constexpr double degrees = 180 / std::numbers::pi;

// Gains of studies/transition.toml: short flights level at 15 m/s.
static const std::string level =
    "[gains]\nk_V = 3.53\nK_Ep = 1.77\nK_Ei = 0.183\nK_Lp = 0.987\nK_Li = 0.00215\nk_pa = 1.11\n"
    "k_da = 1.14\nk_pe = 1.17\nk_de = 7.66\n"
    "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n";
static const std::string in_hover =
    level + "[simulate]\nschedule = 'hold'\nheight = 100\nduration = 2\n";

static std::string within(const std::string& key, double from, double to) {
  return fmt::format("[[montecarlo.scatter]]\nkey = '{}'\nfrom = {:.3f}\nto = {:.3f}\n", key, from,
                     to);
}
static const std::string mass = within("aircraft.mass", 3.8, 4.2);
static const std::string pitch = within("theta_deg", -4, 8);

static std::string again(long flights, const std::string& keys = "") {
  return fmt::format("[montecarlo]\nflights = {}\n{}", flights, keys);
}
static std::string all_kept(int flights) {
  return again(flights, fmt::format("worst = {}\n", flights));
}

static Study parsed(const std::string& text) {
  return parse_study(text, TILTRIM_SOURCE_DIR "/studies/s.toml");
}

static MonteCarlo flown(const std::string& text, MonteCarloOptions options = {}) {
  return monte_carlo(parsed(text), options);
}

static std::vector<MonteCarlo::Kept> by_number(MonteCarlo run) {
  std::ranges::sort(run.worst, {}, [](const auto& kept) { return kept.outcome.number; });
  return run.worst;
}

static void check_same(const MonteCarlo& a, const MonteCarlo& b) {
  CHECK(a.flown == b.flown);
  CHECK(a.good == b.good);
  CHECK(a.ends == b.ends);
  REQUIRE(a.worst.size() == b.worst.size());
  for (std::size_t k = 0; k < a.worst.size(); ++k) {
    CHECK(a.worst[k].outcome.number == b.worst[k].outcome.number);
    CHECK(a.worst[k].outcome.miss == b.worst[k].outcome.miss);
    CHECK(a.worst[k].outcome.height == b.worst[k].outcome.height);
    CHECK(a.worst[k].numbers == b.worst[k].numbers);
  }
}

// ---- Chance ------------------------------------------------------------------------------------

// Largest distance between the numbers' distribution and the uniform one [Kolmogorov].
static double kolmogorov(std::vector<double> shares) {
  std::ranges::sort(shares);
  const auto n = double(shares.size());
  double most = 0.0;
  for (std::size_t k = 0; k < shares.size(); ++k)
    most = std::max({most, shares[k] - double(k) / n, double(k + 1) / n - shares[k]});
  return most;
}

TEST_CASE("the scattered numbers are uniform within their bounds and independent") {
  constexpr int n = trials(1000);
  const auto kept = by_number(flown(in_hover + all_kept(n) + mass + pitch));
  REQUIRE(kept.size() == n);
  std::vector<double> masses, pitches;
  for (int k = 0; k < n; ++k) {
    CHECK(kept[std::size_t(k)].outcome.number == k);
    masses.push_back((kept[std::size_t(k)].numbers.at(0) - 3.8) / 0.4);
    pitches.push_back((kept[std::size_t(k)].numbers.at(1) + 4) / 12);
  }
  double correlation = 0.0;
  for (const auto* shares : {&masses, &pitches}) {
    CHECK(*std::ranges::min_element(*shares) >= 0);
    CHECK(*std::ranges::max_element(*shares) <= 1);
    CHECK(std::set<double>(shares->begin(), shares->end()).size() == n);
    CHECK(kolmogorov(*shares) < 1.95 / std::sqrt(n));  // of true chance once in a thousand
  }
  for (int k = 0; k < n; ++k)
    correlation += 12 * (masses[std::size_t(k)] - 0.5) * (pitches[std::size_t(k)] - 0.5) / n;
  CHECK_NEAR(correlation, 0.0, 3.3 / std::sqrt(n));
}

TEST_CASE("the numbers are named and counted in the study's words") {
  const MonteCarlo run = flown(in_hover + again(2) + within("aircraft.cyclic_off_deg", 55, 65) +
                               pitch + within("gains.k_de", 7, 8));
  CHECK(run.names ==
        std::vector<std::string>{"aircraft.cyclic_off_deg", "theta_deg", "gains.k_de"});
  for (const auto& [outcome, numbers] : run.worst) {
    CHECK((numbers.at(0) >= 55 && numbers.at(0) <= 65));
    CHECK((numbers.at(1) >= -4 && numbers.at(1) <= 8));
    CHECK((numbers.at(2) >= 7 && numbers.at(2) <= 8));
  }
}

TEST_CASE("a flight depends on the seed and its number, not on how many there are") {
  const auto few = by_number(flown(in_hover + all_kept(5) + mass));
  const auto many = by_number(flown(in_hover + all_kept(40) + mass));
  const auto others = by_number(flown(in_hover + again(5, "worst = 5\nseed = 2\n") + mass));
  REQUIRE(many.size() == 40);
  for (std::size_t k = 0; k < few.size(); ++k) {
    CHECK(few[k].numbers == many[k].numbers);
    CHECK(few[k].outcome.miss == many[k].outcome.miss);
    CHECK(few[k].numbers != others[k].numbers);
  }
}

// ---- Flights -----------------------------------------------------------------------------------

TEST_CASE("each has its own numbers: flown alone it ends the same") {
  const Study study = parsed(in_hover + all_kept(4) + mass + pitch + within("height", 50, 60) +
                             within("gains.K_Lp", 0.9, 1.1));
  for (const auto& [outcome, numbers] : monte_carlo(study).worst) {
    const FlightPlan plan = flight_plan_of(study, outcome.number);
    CHECK(plan.flight.vehicle.aircraft.mass == numbers[0]);
    CHECK_NEAR(plan.start.state.theta * degrees, numbers[1], 1e-12);
    CHECK(plan.start.state.height == numbers[2]);
    CHECK(plan.flight.vehicle.gains.K_Lp == numbers[3]);
    const FlightResult alone = fly(plan.flight, plan.start, plan.options);
    CHECK(alone.status == outcome.status);
    CHECK(alone.t.back() == outcome.t);
    CHECK(alone.states.back().height == outcome.height);
  }
}

TEST_CASE("pitch at the start is scattered about an unmoved path") {
  const Study study = parsed(in_hover + again(3) + pitch);
  const FlightState nominal = flight_plan(study).start.state;
  for (long k = 0; k < 3; ++k) {
    const FlightState x = flight_plan_of(study, k).start.state;
    CHECK(x.theta != nominal.theta);
    CHECK_NEAR(std::hypot(x.along, x.across), 15.0, 1e-12);
    CHECK_NEAR(x.theta - std::atan2(x.across, x.along), 0.0, 1e-12);
  }
}

TEST_CASE("a gain that is the same at all tilts is scattered at all of them") {
  const Study study = parsed(
      "[gains]\nschedule_eta_deg = [0, 90]\nK_Lp = [0.9, 1.1]\nk_pe = 1.0\n"
      "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n"
      "[simulate]\nschedule = 'hold'\n" +
      again(3) + within("gains.k_pe", 1.0, 2.0));
  for (long k = 0; k < 3; ++k) {
    const FlightPlan plan = flight_plan_of(study, k);
    REQUIRE(plan.flight.gains.gains.size() == 2);
    CHECK(plan.flight.gains.gains[0].k_pe != 1.0);
    CHECK(plan.flight.gains.gains[0].k_pe == plan.flight.gains.gains[1].k_pe);
    CHECK(plan.flight.gains.gains[0].K_Lp == 0.9);
  }
}

TEST_CASE("every flight has turbulence of its own, whatever the gust's seed") {
  const auto gust = [](int seed) {
    return fmt::format(
        "[[simulate.gust]]\nkind = 'dryden'\ndirection = 'up'\nsize = 1\nseed = {}\n", seed);
  };
  const auto kept = by_number(flown(in_hover + gust(1) + all_kept(8)));
  std::set<double> ends;
  for (const auto& k : kept) ends.insert(k.outcome.gamma_off);
  CHECK(ends.size() == 8);
  const auto reseeded = by_number(flown(in_hover + gust(2) + all_kept(8)));
  for (std::size_t k = 0; k < kept.size(); ++k)
    CHECK(kept[k].outcome.gamma_off == reseeded[k].outcome.gamma_off);
}

TEST_CASE("gust_size is that of every gust") {
  const Study study = parsed(in_hover +
                             "[[simulate.gust]]\nkind = 'steady'\nsize = 0\n"
                             "[[simulate.gust]]\nkind = 'steady'\ndirection = 'up'\nsize = 0\n" +
                             all_kept(3) + within("gust_size", 0.5, 1.5));
  for (const auto& [outcome, numbers] : monte_carlo(study).worst) {
    const Wind wind = flight_plan_of(study, outcome.number).flight.wind(0.0);
    CHECK(wind.forward == numbers[0]);
    CHECK(wind.up == numbers[0]);
  }
}

TEST_CASE("good is what keeps its aims; miss is the largest figure over what is allowed") {
  const std::string text =
      in_hover +
      again(60, "worst = 60\nV_within = 0.02\ngamma_within_deg = 0.5\ntheta_within_deg = 6\n") +
      mass + pitch;
  const MonteCarlo run = flown(text);
  long good = 0;
  double before = 1e9;
  for (const auto& [o, numbers] : run.worst) {
    const double miss = std::max({std::abs(o.V_off) / 0.02, std::abs(o.gamma_off) * degrees / 0.5,
                                  o.theta_most * degrees / 6});
    CHECK_NEAR(o.miss, miss, 1e-12 * (1 + miss));
    CHECK(o.good == (o.miss <= 1));
    CHECK(o.miss <= before);
    before = o.miss;
    good += o.good;
  }
  CHECK(good == run.good);
  CHECK((good > 0 && good < 60));
  CHECK(run.ends[std::size_t(FlightStatus::flown)] == 60);
}

TEST_CASE("the worst that are kept are the worst of all") {
  const auto all = flown(in_hover + all_kept(200) + mass + pitch).worst;
  const auto few = flown(in_hover + again(200, "worst = 7\n") + mass + pitch).worst;
  REQUIRE(few.size() == 7);
  for (std::size_t k = 0; k < few.size(); ++k)
    CHECK(few[k].outcome.number == all[k].outcome.number);
  CHECK(flown(in_hover + again(5, "worst = 0\n") + mass).worst.empty());
}

TEST_CASE("a flight that ends early is worse than any that ends in time, the earlier the worse") {
  const std::string falls = level +
                            "[simulate]\nschedule = 'hold'\nheight = 5\nduration = 4\n"
                            "[simulate.states]\ngamma_deg = -60\n";
  const MonteCarlo run = flown(falls + all_kept(20) + within("height", 2, 6));
  CHECK(run.good == 0);
  CHECK(run.ends[std::size_t(FlightStatus::ground_contact)] == 20);
  for (std::size_t k = 1; k < run.worst.size(); ++k) {
    CHECK(run.worst[k].outcome.miss > 1e6);
    CHECK(run.worst[k].outcome.t >= run.worst[k - 1].outcome.t);
  }
  CHECK(run.share.share == 0.0);
  CHECK(run.share.lower == 0.0);
  CHECK_NEAR(run.share.upper, 1 - std::pow(0.025, 1.0 / 20), 1e-12);
}

TEST_CASE("no trim to start from: said, none flown, no log left" * thorough) {
  const Folder folder;
  MonteCarloOptions options;
  options.log = folder.path / "log";
  const MonteCarlo run = flown(
      "[[condition]]\nname = 'slow'\nV = 3\ngamma_deg = 0\neta_deg = 0\n"
      "[simulate]\nschedule = 'hold'\n" +
          again(5) + mass,
      options);
  CHECK_FALSE(run.message.empty());
  CHECK(run.asked == 5);
  CHECK(run.flown == 0);
  CHECK(fs::is_empty(folder.path));
}

TEST_CASE("no [montecarlo], no flight of the number") {
  CHECK_THROWS_WITH_AS((void)flown(in_hover), doctest::Contains("no [montecarlo] table"),
                       std::invalid_argument);
  const std::string same = "montecarlo.scatter: is missing, so that every flight would be the same";
  CHECK_THROWS_WITH_AS((void)flown(in_hover + again(5)), doctest::Contains(same.c_str()),
                       std::invalid_argument);
  const Study study = parsed(in_hover + again(5) + mass);
  for (const long number : {-1L, 5L})
    CHECK_THROWS_WITH_AS((void)flight_plan_of(study, number), doctest::Contains("numbered from 0"),
                         std::invalid_argument);
}

// ---- The interval ------------------------------------------------------------------------------

static double log_choose(int n, int k) {
  return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
}

// P(from <= K <= to) of K good among n, each with probability p.
static double chance(int n, int from, int to, double p) {
  double sum = 0.0;
  for (int k = from; k <= to; ++k)
    sum += std::exp(log_choose(n, k) + k * std::log(p) + (n - k) * std::log1p(-p));
  return sum;
}

TEST_CASE("Clopper and Pearson: 2.5 % of the binomial lie beyond either end") {
  for (const int n : {1, 7, 100})
    for (int k = 0; k <= n; k += n == 100 ? 9 : 1) {
      const Proportion p = proportion(k, n);
      CAPTURE(n);
      CAPTURE(k);
      CHECK(p.share == double(k) / n);
      if (k == 0)
        CHECK(p.lower == 0.0);
      else
        CHECK_NEAR(chance(n, k, n, p.lower), 0.025, 1e-10);
      if (k == n)
        CHECK(p.upper == 1.0);
      else
        CHECK_NEAR(chance(n, 0, k, p.upper), 0.025, 1e-10);
    }
  CHECK(proportion(0, 0).lower == 0.0);
  CHECK(proportion(0, 0).upper == 1.0);
}

TEST_CASE("the run says this interval of its own share") {
  const MonteCarlo run = flown(in_hover + again(60, "theta_within_deg = 6\n") + pitch);
  const Proportion expected = proportion(run.good, 60);
  CHECK(run.share.share == expected.share);
  CHECK(run.share.lower == expected.lower);
  CHECK(run.share.upper == expected.upper);
}

// ---- Threads and the log -----------------------------------------------------------------------

TEST_CASE("the answer is the same for any number of threads") {
  const std::string text = in_hover + again(trials(330)) + mass + pitch;
  const MonteCarlo one = flown(text, {.threads = 1});
  for (const int threads : {2, 3, 8}) check_same(flown(text, {.threads = threads}), one);
}

TEST_CASE("stopped after some flights it goes on from the log to the same answer") {
  const Folder folder;
  const std::string text = in_hover + again(trials(330)) + mass + pitch;
  const MonteCarlo whole = flown(text);
  MonteCarloOptions options;
  options.log = folder.path / "log";
  options.checkpoint = 0.0;
  options.identity = "this study";
  long before = 0;
  for (const long until : {1L, whole.asked / 4, whole.asked / 2}) {
    std::stop_source source;
    options.stop = source.get_token();
    options.observe = [&](const MonteCarlo& so_far) {
      CHECK(so_far.flown > before);
      if (so_far.flown >= until) source.request_stop();
    };
    const MonteCarlo part = flown(text, options);
    CHECK(part.interrupted);
    CHECK(part.flown >= until);
    CHECK(part.flown < whole.flown);
    CHECK(fs::exists(options.log));
    before = part.flown;
  }
  options.stop = {};
  options.observe = {};
  const MonteCarlo rest = flown(text, options);
  CHECK_FALSE(rest.interrupted);
  check_same(rest, whole);
  const MonteCarlo again_from_log = flown(text, options);  // the log is kept: nothing runs twice
  check_same(again_from_log, whole);
}

TEST_CASE("flights are logged as they are done, not at the end") {
  const Folder folder;
  MonteCarloOptions options{.threads = 1};
  options.log = folder.path / "log";
  std::uintmax_t size = 0;
  int grown = 0;
  options.observe = [&](const MonteCarlo&) {
    const std::uintmax_t now = fs::file_size(options.log);
    grown += now > size;
    size = now;
  };
  CHECK(flown(in_hover + again(40) + mass, options).flown == 40);
  CHECK(grown == 40);
}

TEST_CASE("the log of other work is refused and kept") {
  const Folder folder;
  MonteCarloOptions options;
  options.log = folder.path / "log";
  options.identity = "this study";
  std::stop_source source;
  options.stop = source.get_token();
  options.observe = [&](const MonteCarlo&) { source.request_stop(); };
  CHECK(flown(in_hover + again(100) + mass, options).interrupted);
  options.identity = "that study";
  CHECK_THROWS_AS((void)flown(in_hover + again(100) + mass, options), LogError);
  CHECK(fs::exists(options.log));
}

TEST_CASE("told to stop before it begins: none flown, nothing claimed") {
  std::stop_source source;
  source.request_stop();
  MonteCarloOptions options;
  options.stop = source.get_token();
  const MonteCarlo run = flown(in_hover + again(10) + mass, options);
  CHECK(run.interrupted);
  CHECK(run.flown == 0);
  CHECK(run.share.upper == 1.0);
  CHECK(run.worst.empty());
}

}  // namespace monte_carlo_test
