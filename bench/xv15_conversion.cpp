// Nonlinear conversion flights of the XV-15 under total-energy control: from hover to 160 kt as an
// airplane and back to hover; the first as studied, the others with scattered mass, air density,
// rotor speed and start.
//
//     xv15_conversion [flights] [studies/xv15_conversion.toml] [first-flight.csv] [seed]
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include "model/lookup.hpp"
#include "simulate/integrate.hpp"
#include "study/study.hpp"
#include "trim/trim.hpp"

using namespace tiltrim;

namespace {

constexpr double degree = std::numbers::pi / 180, knot = 0.514444;
constexpr double flap = 20 * degree;
constexpr double slow = 0, fast = 160, rise = 75, hold = 15;  // kt; s
constexpr double until = 5 + rise + hold + rise + 20;         // s

double smooth(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}
double command(double t) {  // kt
  return slow + (fast - slow) * (smooth((t - 5) / rise) - smooth((t - 5 - rise - hold) / rise));
}
double mast_at(double knots) { return 90 * degree * smooth((knots - 60) / 80); }

struct Worst {
  double pitch = 0, climb = 0, speed = 0, stick_low = 1e9, stick_high = -1e9, height = 0, end = 0;
};

struct Conversion {
  const Model& loop;
  Eigen::VectorXd p;
  Eigen::Index airspeed =
      variable(loop, "airspeed_kt") - std::ssize(loop.states) - std::ssize(loop.inputs);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  Eigen::Vector4d u{flap, 0, 0, 0};

  void at(double t) {
    p[airspeed] = command(t);
    u[1] = mast_at(command(t));
  }
  double output(const Eigen::VectorXd& y, const char* name) const {
    return y[find(loop.outputs, name)];
  }

  // The last state is the height.
  Trajectory fly(const std::vector<double>& x0) {
    Motion motion{.states = loop.states, .f = [this](double t, const double* now, int, double* to) {
                    at(t);
                    x = Eigen::Map<const Eigen::VectorXd>(now, 6);
                    Eigen::Map<Eigen::VectorXd>(to, 6) = loop.f(x, u, p);
                    to[6] = x[0] * std::sin(x[2]) - x[1] * std::cos(x[2]);
                  }};
    motion.states.push_back({"height", "m", 100});
    motion.breaks = {5, 5 + rise, 5 + rise + hold, 5 + rise + hold + rise};
    return integrate(motion, x0, 0, 0, until, {.tolerance = 1e-5, .sample = 0.5});
  }

  void note(const Trajectory& flown, std::FILE* file, Worst& worst) {
    for (std::size_t k = 0; k < flown.samples(); ++k) {
      const double t = flown.t[k];
      const double* now = flown.state(k);
      at(t);
      x = Eigen::Map<const Eigen::VectorXd>(now, 6);
      const Eigen::VectorXd y = loop.h(x, u, p);
      const double stick = output(y, "stick"), speed = output(y, "speed_kt");
      const double climb = output(y, "climb");
      worst.pitch = std::max(worst.pitch, std::abs(now[2]) / degree);
      worst.climb = std::max(worst.climb, std::abs(climb));
      worst.speed = std::max(worst.speed, std::abs(speed - command(t)));
      worst.stick_low = std::min(worst.stick_low, stick);
      worst.stick_high = std::max(worst.stick_high, stick);
      worst.height = std::max(worst.height, std::abs(now[6]));
      if (k + 1 == flown.samples()) worst.end = std::max(worst.end, std::abs(speed - slow));
      if (file)
        fmt::print(file, "{:.2f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.3f},{:.3f}\n",
                   t, command(t), speed, u[1] / degree, now[2] / degree, stick,
                   output(y, "collective") / degree, climb, output(y, "power") / 1000, now[6]);
    }
  }
};

}  // namespace

int main(int count, char** arguments) {
  const int flights = count > 1 ? std::stoi(arguments[1]) : 1000;
  const Study study = load_study(count > 2 ? arguments[2] : "studies/xv15_conversion.toml");
  const UserModel& own = *study.user_model;
  const TrimSpec spec{.free = names(own.model.states)};
  std::mt19937 random(count > 4 ? unsigned(std::stoul(arguments[4])) : 1U);
  std::uniform_real_distribution<double> share(-1, 1);
  Worst worst;
  int good = 0;
  for (int k = 0; k < flights; ++k) {
    const auto scattered = [&](double size) { return k == 0 ? 0.0 : size * share(random); };
    Conversion flight{own.model, own.parameters};
    for (const auto& [name, size] :
         {std::pair{"mass", 0.1}, std::pair{"air_density", 0.1}, std::pair{"rotor_speed", 0.02}})
      flight.p[find(own.model.parameters, name)] *= 1 + scattered(size);
    flight.at(0);
    Eigen::VectorXd guess(6);
    guess << slow * knot, 0, 0, 0, 0.2, 0;
    const TrimResult start = trim(own.model, spec, {guess, flight.u, flight.p},
                                  {.method = TrimMethod::newton, .starts = 8});
    std::vector<double> x0(start.point.x.begin(), start.point.x.end());
    x0[0] += scattered(2);  // m/s, m/s, rad
    x0[1] += scattered(1);
    x0[2] += scattered(3 * degree);
    x0.push_back(0);
    const Trajectory flown = flight.fly(x0);
    std::FILE* file = k == 0 && count > 3 ? std::fopen(arguments[3], "w") : nullptr;
    if (file)
      fmt::print(
          file,
          "t,command_kt,speed_kt,mast_deg,pitch_deg,stick,collective_deg,climb,power_kW,height\n");
    Worst one;
    if (start && flown) flight.note(flown, file, one);
    if (file) std::fclose(file);
    const bool held = start && flown && one.stick_low >= 0 && one.stick_high <= 9.6 && one.end < 3;
    good += held;
    if (!held)
      fmt::print("flight {}: {} {}, t = {:.1f} s, stick {:.2f} to {:.2f}\n", k,
                 to_string(start.status), flown.message, flown.end(), one.stick_low,
                 one.stick_high);
    worst = {std::max(worst.pitch, one.pitch),
             std::max(worst.climb, one.climb),
             std::max(worst.speed, one.speed),
             std::min(worst.stick_low, one.stick_low),
             std::max(worst.stick_high, one.stick_high),
             std::max(worst.height, one.height),
             std::max(worst.end, one.end)};
  }
  fmt::print(
      "{} of {} flights end within 3 kt of {} kt with the stick in its travel\n"
      "largest: pitch {:.1f} degrees, climb {:.2f} m/s, speed error {:.1f} kt, stick {:.2f} to "
      "{:.2f} in, height {:.0f} m, speed error at the end {:.2f} kt\n",
      good, flights, slow, worst.pitch, worst.climb, worst.speed, worst.stick_low, worst.stick_high,
      worst.height, worst.end);
  return good == flights ? 0 : 1;
}
