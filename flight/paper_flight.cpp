#include "flight/paper_flight.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tiltrim {

namespace {

constexpr double radians = std::numbers::pi / 180;

// Columns of the table over a time interval, by name.
class Flown {
 public:
  explicit Flown(const FlightTable& table) : table_(table), t_(table["time"]) {}

  bool comes_to(double t) const { return t_.back() >= t - 1e-6; }
  double end() const { return t_.back(); }

  double at(const char* name, double t) const {
    const auto after = std::ranges::lower_bound(t_, t);
    return table_[name][std::size_t(std::min(after - t_.begin(), std::ssize(t_) - 1))];
  }
  double least(const char* name, double from, double to) const {
    double least = std::numeric_limits<double>::infinity();
    each(from, to, [&](std::size_t k) { least = std::min(least, table_[name][k]); });
    return least;
  }
  double most(const char* name, double from, double to) const {
    double most = -std::numeric_limits<double>::infinity();
    each(from, to, [&](std::size_t k) { most = std::max(most, table_[name][k]); });
    return most;
  }
  double largest(const char* name, double from, double to) const {
    return std::max(std::abs(least(name, from, to)), std::abs(most(name, from, to)));
  }
  // The first time at a height; the end if it is not reached.
  double passes(double height) const {
    for (std::size_t k = 0; k < t_.size(); ++k)
      if (table_["height"][k] >= height) return t_[k];
    return t_.back();
  }

 private:
  const FlightTable& table_;
  const std::vector<double>& t_;

  void each(double from, double to, const auto& visit) const {
    for (std::size_t k = 0; k < t_.size(); ++k)
      if (t_[k] >= from && t_[k] <= to) visit(k);
  }
};

constexpr const char* schedule_over_height =
    "schedule (16) over height bends the path from the ground up: it commands 83° at 20 m and 60° "
    "at 46 m; the paper's 25 s of vertical climb need a schedule that joins (16) at about 55 m, as "
    "in studies/transition_as_drawn.toml";

constexpr double climb_from = 5.0, climb_to = 25.0, whole = 90.0;  // s, as in the paper

// The paper's statements about its flight, one per figure, with the same quantity of this flight.
class Facts {
 public:
  explicit Facts(const FlightTable& table) : flown(table) {}

  // `fact` fills in the flight's part if the flight lasts at least `needs` seconds.
  void say(const char* figure, const char* paper, double needs, const auto& fact) {
    PaperFact f{figure, paper, {}, false, {}, flown.comes_to(needs)};
    if (f.reached)
      fact(f);
    else
      f.flight = fmt::format("ends at {:.1f} s", flown.end()), f.why = "the flight ends earlier";
    all.push_back(std::move(f));
  }

  const Flown flown;
  std::vector<PaperFact> all;
};

void settle(PaperFact& f, bool agrees, std::string why) {
  f.agrees = agrees;
  if (!agrees) f.why = std::move(why);
}

// Figure 5.
void say_pitch(Facts& facts) {
  const Flown& flown = facts.flown;
  facts.say("5", "pitch swings nose up in the first 5 s", climb_from, [&](PaperFact& f) {
    const double up = flown.most("theta_deg", 0, climb_from) * radians;
    f.flight = fmt::format("up to {:.2f} rad", up);
    settle(f, up > 0.05, "the gains differ: the paper does not give its own");
  });
  facts.say("5", "pitch near 0.2 rad in the climb", climb_to, [&](PaperFact& f) {
    const double from = flown.least("theta_deg", climb_from, climb_to) * radians;
    const double to = flown.most("theta_deg", climb_from, climb_to) * radians;
    f.flight = fmt::format("{:.2f} to {:.2f} rad from 5 to 25 s", from, to);
    settle(f, from > 0.1 && to < 0.3,
           "the trim itself is pitched up: 0.29 rad at the start of the climb and more higher up, "
           "where the hub offset and the wake determine the cyclic; the paper's hub data, wake and "
           "polar are unknown");
  });
  facts.say("5", "pitch rises in the transition, 25 to 30 s", 30.0, [&](PaperFact& f) {
    const double before = flown.at("theta_deg", climb_to) * radians;
    const double most = flown.most("theta_deg", climb_to, 35.0) * radians;
    f.flight = fmt::format("from {:.2f} to {:.2f} rad between 25 and 35 s", before, most);
    settle(f, most > before + 0.02, "the handover to the elevator causes no transient");
  });
  facts.say("5", "pitch settles near 0.15 rad in level flight", whole, [&](PaperFact& f) {
    const double theta = flown.at("theta_deg", whole) * radians;
    f.flight = fmt::format("{:.3f} rad at 90 s", theta);
    settle(f, std::abs(theta - 0.15) < 0.05,
           "at 15 m/s this polar supports the weight at 0.03 rad; the paper plots its polar "
           "without a table");
  });
}

// Figures 5 and 6.
void say_path_and_speed(Facts& facts) {
  const Flown& flown = facts.flown;
  facts.say("5", "path within 0.8 to 1.5 rad in the climb", climb_to, [&](PaperFact& f) {
    const double from = flown.least("gamma_deg", climb_from, climb_to) * radians;
    const double to = flown.most("gamma_deg", climb_from, climb_to) * radians;
    f.flight = fmt::format("{:.2f} to {:.2f} rad from 5 to 25 s", from, to);
    settle(f, from > 0.75 && to < 1.55,
           std::string("the path angle converges to its command only as fast as the integral x2 "
                       "converges to its trim; and ") +
               schedule_over_height);
  });
  facts.say("5", "path to 0 in level flight", whole, [&](PaperFact& f) {
    const double gamma = flown.at("gamma_deg", whole) * radians;
    f.flight = fmt::format("{:.4f} rad at 90 s", gamma);
    settle(f, std::abs(gamma) < 0.01, "not settled at 90 s");
  });
  facts.say("6", "2 m/s up in the climb", climb_to, [&](PaperFact& f) {
    const double done = std::min(climb_to, flown.passes(20.0));
    const double from = flown.least("climb_rate", climb_from, done);
    const double to = flown.most("climb_rate", climb_from, done);
    f.flight = fmt::format("{:.2f} to {:.2f} m/s from 5 s to 20 m", from, to);
    settle(f, from > 1.9 && to < 2.1, "the gains differ: the paper does not give its own");
  });
  facts.say("6", "no speed forward for the first 25 s", climb_to, [&](PaperFact& f) {
    const double most = flown.most("ground_speed", 0, climb_to);
    f.flight = fmt::format("up to {:.1f} m/s", most);
    settle(f, most < 0.5, schedule_over_height);
  });
  facts.say("6", "then forward to 15 m/s", whole, [&](PaperFact& f) {
    const double speed = flown.at("ground_speed", whole);
    f.flight = fmt::format("{:.2f} m/s at 90 s", speed);
    settle(f, std::abs(speed - 15) < 0.2, "not settled at 90 s");
  });
}

// Figures 7 to 9.
void say_energy_and_way(Facts& facts) {
  const Flown& flown = facts.flown;
  facts.say("7", "He and Le change most in the transition", 45.0, [&](PaperFact& f) {
    const double start = flown.largest("He", 0, climb_from);
    const double transition = flown.largest("He", climb_to, 45.0);
    const double Le = flown.largest("Le", climb_to, 45.0),
                 Le_start = flown.largest("Le", 0, climb_from);
    f.flight =
        fmt::format("|He| up to {:.2f} from 25 to 45 s ({:.2f} at take-off), |Le| {:.2f} ({:.2f})",
                    transition, start, Le, Le_start);
    settle(f, transition > start && Le > Le_start,
           "at rest the law commands a step to 2 m/s, which is the largest error of the flight");
  });
  facts.say("7", "He and Le return to zero", whole, [&](PaperFact& f) {
    const double He = flown.at("He", whole), Le = flown.at("Le", whole);
    f.flight = fmt::format("{:.4f} and {:.4f} at 90 s", He, Le);
    settle(f, std::abs(He) < 0.01 && std::abs(Le) < 0.01, "not settled at 90 s");
  });
  facts.say("8", "just under 1000 m flown at 90 s", whole, [&](PaperFact& f) {
    const double distance = flown.at("distance", whole);
    f.flight = fmt::format("{:.0f} m", distance);
    settle(f, distance > 850 && distance < 1000, "the paper does not give its speed schedule");
  });
  facts.say("9", "about 55 m climbed before the transition at 25 s", climb_to, [&](PaperFact& f) {
    const double height = flown.at("height", climb_to);
    f.flight = fmt::format("{:.1f} m at 25 s", height);
    settle(f, std::abs(height - 55) < 10, "2 m/s for 25 s gives 50 m; this climb starts at rest");
  });
  facts.say("9", "the transition climbs faster", 45.0, [&](PaperFact& f) {
    const double most = flown.most("climb_rate", climb_to, 45.0);
    f.flight = fmt::format("up to {:.1f} m/s", most);
    settle(f, most > 2.2, "not faster than the climb");
  });
  facts.say("9", "level between 120 and 180 m", whole, [&](PaperFact& f) {
    const double height = flown.at("height", whole);
    f.flight = fmt::format("{:.1f} m at 90 s", height);
    settle(f, height >= 120 && height <= 180,
           "(16) levels off from below and approaches 120 m ever more slowly");
  });
}

}  // namespace

std::vector<PaperFact> paper_facts(const FlightTable& table) {
  Facts facts(table);
  say_pitch(facts);
  say_path_and_speed(facts);
  say_energy_and_way(facts);
  return facts.all;
}

}  // namespace tiltrim
