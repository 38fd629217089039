#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "study/analyses.hpp"
#include "trim/remedy.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double slowest_V = body_axes_below, fastest_V = 60.0;  // m/s, range searched for V
constexpr double most_thrust = 100.0;                            // over the weight

// The bare airframe with the pitch control available at this tilt: the freedom of any control law.
AirframeCondition alone(const Vehicle& vehicle, const Condition& condition, double eta) {
  if (const AirframeCondition* airframe = condition.airframe()) return *airframe;
  const Command& d = *condition.command();
  AirframeCondition c;
  c.values = {{"V", {d.V, d.V}}, {"gamma", {d.gamma, d.gamma}}, {"eta", {eta, eta}}};
  const double s = authority(vehicle.aircraft, eta);
  if (s == 0) c.values["a1s"] = {0, 0};
  if (s == 1) c.values["delta_e"] = {0, 0};
  return c;
}

bool held(const TrimProblem& p, const std::string& name) {
  return std::ranges::find(p.spec.free, name) == p.spec.free.end();
}

// At any point: the wing carries what thrust, weight and acceleration leave.
// m (V' sin γ + V γ' cos γ) = T sin(θ + η - a1s) + wing - m g
VerticalForces forces(const Model& model, const TrimResult& at) {
  const auto value = [&](const char* name) { return value_of(at.point, variable(model, name)); };
  const double m = value("aircraft.mass"), g = value("aircraft.gravity");
  const double thrust = at.outputs[find(model.outputs, "thrust")] *
                        std::sin(value("theta") + value("eta") - value("a1s"));
  const double gamma = value("gamma");
  const double up = at.rates[find(model.states, "V")] * std::sin(gamma) +
                    value("V") * at.rates[find(model.states, "gamma")] * std::cos(gamma);
  return {thrust, m * up - thrust + m * g, m * g};
}

std::string words(const VerticalForces& f) {
  const double thrust = std::round(10 * f.thrust) / 10 + 0.0;  // no minus sign before zero
  return fmt::format("thrust {:.1f} N up, weight {:.1f} N, wing force {:.1f} N {}", thrust,
                     f.weight, std::abs(f.wing), f.wing < 0 ? "down" : "up");
}

struct Unit {
  double factor;
  const char* name;
};

Unit unit_of(const Model& model, const std::string& signal) {
  const Index output = find(model.outputs, signal);
  const std::string& unit = find(model.states, signal) < 0 && output >= 0
                                ? model.outputs[std::size_t(output)].unit
                                : signal_of(model, variable(model, signal)).unit;
  if (unit == "rad") return {180 / pi, "°"};
  return {1.0, unit == "m/s" ? "m/s" : unit == "m" ? "m" : ""};
}

// The printed equations have lift and thrust point down: their forces are not physical.
bool consistent(const Vehicle& vehicle) { return vehicle.equations == Equations::consistent; }

std::string words(const Remedy& r, const Model& model, bool with_forces) {
  if (r.kind == RemedyKind::equation) return in_words(r);
  const Unit unit = unit_of(model, r.signal);
  std::string text = in_words(r, unit.factor, unit.name);
  if (with_forces && r.signal.starts_with("aircraft.") && r.helps())
    text += fmt::format(" ({})", words(forces(model, r.trim)));
  return text;
}

// At maximum thrust, directed up as far as pitch allows: its lift, and the download of its wake on
// the wing. Empty if the wing helps, or if no force is missing.
std::string at_full_thrust(const Model& model, const TrimSpec& spec, OperatingPoint point) {
  const auto bound = [&](const char* name) {
    const auto at = spec.bounds.find(name);
    return at == spec.bounds.end() ? Range{} : at->second;
  };
  const double full = bound("theta0").upper;
  if (!std::isfinite(full)) return {};
  const auto set = [&](const char* name, double value) {
    set_value(point, variable(model, name), value);
  };
  const double eta = value_of(point, variable(model, "eta"));
  const Range pitch = bound("theta");
  set("theta0", full);
  set("a1s", 0.0);
  set("delta_e", 0.0);
  set("theta", std::clamp(pi / 2 - eta, pitch.lower, pitch.upper));
  const Evaluation e = evaluate(model, point);
  TrimResult at;
  at.point = point;
  at.rates = e.rates;
  at.outputs = e.outputs;
  const VerticalForces f = forces(model, at);
  const double missing = f.weight - f.thrust - f.wing;
  if (missing <= 0 || f.wing >= 0) return {};
  return fmt::format(
      "at the thrust limit, theta0 = {:.4g}: {}; thrust would have to be {:.1f} N, or the download "
      "on the wing at most {:.1f} N",
      full, words(f), f.thrust + missing, std::max(0.0, f.thrust - f.weight));
}

// Tilts with the other pitch control have other inputs and are searched separately.
std::vector<Remedy> nearest_tilt(const Vehicle& vehicle, const Condition& condition,
                                 const TrimOptions& options) {
  const Aircraft& a = vehicle.aircraft;
  const double eta = condition.command()->eta, half = a.cyclic_blend / 2;
  // From the handover on the cyclic is active: the elevator's range of tilts ends just below.
  constexpr double clear = 1e-4;
  const auto tilts = [](double lower, double upper) {
    return DecisionVariable{"eta", {std::max(lower, 0.0), std::min(upper, pi / 2)}};
  };
  std::vector<DecisionVariable> stretches{tilts(0.0, a.cyclic_off - half - clear),
                                          tilts(a.cyclic_off + half, pi / 2)};
  if (half > 0) stretches.push_back(tilts(a.cyclic_off - half, a.cyclic_off + half));
  std::vector<Remedy> remedies;
  for (const DecisionVariable& stretch : stretches) {
    const Range& r = stretch.range;
    if (!(r.lower < r.upper)) continue;
    const double middle = 0.5 * (r.lower + r.upper);
    TrimProblem p = airframe_problem(vehicle, alone(vehicle, condition, middle), Axes::wind);
    set_value(p.guess, variable(p.model, "eta"), eta);
    Remedy remedy = nearest(p.model, p.spec, p.guess, stretch, options);
    remedies.push_back(std::move(remedy));
  }
  const auto away = [&](const Remedy& r) { return r.helps() ? std::abs(r.to - eta) : 1e9; };
  std::ranges::stable_sort(remedies, {}, away);
  if (remedies.front().helps()) remedies.resize(1);
  return remedies;
}

std::vector<DecisionVariable> decision_variables(const Vehicle& vehicle, const Condition& condition,
                                                 const TrimProblem& p) {
  const Aircraft& a = vehicle.aircraft;
  std::vector<DecisionVariable> all;
  if (held(p, "V")) all.push_back({"V", {slowest_V, fastest_V}});
  if (held(p, "gamma")) all.push_back({"gamma", {-pi / 2, pi / 2}});
  if (condition.airframe() && held(p, "eta")) all.push_back({"eta", {0.0, pi / 2}});
  if (a.thrust_excess < most_thrust)
    all.push_back({"aircraft.thrust_excess", {a.thrust_excess, most_thrust}});
  if (a.wake_immersion > 0) all.push_back({"aircraft.wake_immersion", {0.0, a.wake_immersion}});
  return all;
}

void put_into_words(Explanation& e, const TrimProblem& p, const TrimResult& closest,
                    bool with_forces) {
  const Diagnosis& d = *e.diagnosis;
  const Model& model = e.airframe;
  std::vector<std::string> back;
  for (const Diagnosis::Holding& h : d.holding) {
    const Unit unit = unit_of(model, h.limit.signal);
    back.push_back(fmt::format("{} at its {} limit {:.4g}{}", h.limit.signal,
                               h.limit.upper ? "upper" : "lower", h.limit.value * unit.factor,
                               unit.name));
  }
  const std::string acting = with_forces ? words(forces(model, closest)) + "; " : "";
  e.words.push_back(fmt::format("closest point: {}limited by {}", acting,
                                back.empty() ? "the equations alone, not by a limit"
                                             : fmt::format("{}", fmt::join(back, ", "))));
  const std::string full =
      with_forces ? at_full_thrust(model, p.spec, closest.point) : std::string();
  if (!full.empty()) e.words.push_back(full);
  // All remedies that work; of those that do not, only what a pilot or designer would try first.
  for (const Remedy& r : d.remedies)
    if (r.helps() && r.kind != RemedyKind::equation)
      e.words.push_back("one change that suffices: " + words(r, model, with_forces));
  for (const Remedy& r : d.remedies)
    if (!r.helps() &&
        (r.kind == RemedyKind::decision_variable || (r.signal == "theta0" && r.upper)))
      e.words.push_back("does not help: " + words(r, model, with_forces));
  if (d.interrupted) e.words.push_back("interrupted: other remedies were not examined");
  if (d.out_of_time) e.words.push_back("not all remedies were examined within time_limit");
}

}  // namespace

std::optional<Explanation> explain(const Vehicle& vehicle, const Condition& condition,
                                   const TrimOptions& options) {
  const RoundToNearest environment;
  const Command* closed = condition.command();
  if (!closed && !condition.airframe()) return {};
  if (closed && closed->V <= 0) return {};
  const AirframeCondition c = alone(vehicle, condition, closed ? closed->eta : 0.0);
  const TrimProblem p =
      closed ? airframe_problem(vehicle, c, Axes::wind) : airframe_problem(vehicle, c);
  if (find(p.model.states, "V") < 0) return {};  // body axes: V and gamma are no variables
  const TrimResult open = trim(p.model, p.spec, p.guess, options);
  Explanation e{p.model, {}, {}};
  if (open.status == TrimStatus::interrupted) {
    e.words.push_back("interrupted: remedies were not examined");
    return e;
  }
  if (open.status == TrimStatus::time_limit) {
    e.words.push_back("remedies were not examined: " + open.message);
    return e;
  }
  if (is_equilibrium(open.status)) {
    e.words.push_back(
        "the airframe has an equilibrium within the limits; with the control law none was found");
    return e;
  }
  e.diagnosis = diagnose(p.model, p.spec, p.guess, open.point,
                         decision_variables(vehicle, condition, p), options);
  if (closed)
    for (Remedy& r : nearest_tilt(vehicle, condition, options)) {
      const bool examined = r.trim.status != TrimStatus::time_limit;
      if (!examined) e.diagnosis->out_of_time = true;
      if (examined) e.diagnosis->remedies.push_back(std::move(r));
    }
  put_into_words(e, p, open, consistent(vehicle));
  return e;
}

}  // namespace tiltrim
