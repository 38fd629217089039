#include <fmt/core.h>

#include <array>

#include "tune/measures.hpp"

namespace tiltrim {

namespace {

struct Spelling {
  Measure measure;
  const char* name;
  const char* unit;
  bool more_is_better;
};

constexpr std::array<Spelling, 19> spellings{{
    {Measure::decay, "decay", "1/s", true},
    {Measure::damping, "damping", "", true},
    {Measure::frequency, "frequency", "rad/s", false},
    {Measure::half_time, "half_time", "s", false},
    {Measure::gain_margin_db, "gain_margin_db", "dB", true},
    {Measure::phase_margin_deg, "phase_margin_deg", "degrees", true},
    {Measure::delay_margin, "delay_margin", "s", true},
    {Measure::disk_margin, "disk_margin", "", true},
    {Measure::use, "use", "", false},
    {Measure::response_use, "response_use", "", false},
    {Measure::figure, "figure", "", false},
    {Measure::sensitivity, "sensitivity", "rad/s", false},
    {Measure::peak_gain, "peak_gain", "", false},
    {Measure::peak_sensitivity, "peak_sensitivity", "", false},
    {Measure::h2_norm, "h2_norm", "", false},
    {Measure::quadratic_cost, "quadratic_cost", "", false},
    {Measure::overshoot, "overshoot", "", false},
    {Measure::settling_time, "settling_time", "s", false},
    {Measure::pole_region, "pole_region", "", true},
}};

const Spelling& spelling(Measure measure) { return spellings.at(std::size_t(measure)); }

}  // namespace

std::string to_string(Measure measure) { return spelling(measure).name; }

std::string_view unit(Measure measure) { return spelling(measure).unit; }

bool more_is_better(Measure measure) { return spelling(measure).more_is_better; }

std::string name_of(const Requirement& requirement) {
  return requirement.measure == Measure::figure ? requirement.figure
                                                : to_string(requirement.measure);
}

bool Requirement::same_measure(const Requirement& other) const {
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  return measure == other.measure && of == other.of && figure == other.figure &&
         from == other.from && to == other.to && numerator == other.numerator &&
         denominator == other.denominator && weights == other.weights && band == other.band &&
         same(decay, other.decay) && same(damping, other.damping) &&
         same(frequency, other.frequency);
}

std::string goal_name(const TuneProblem& problem) {
  return problem.goals.empty() ? name_of(problem.goal)
                               : fmt::format("reserve of {} goals", problem.goals.size());
}

std::string_view goal_unit(const TuneProblem& problem) {
  return problem.goals.empty() ? unit(problem.goal.measure) : "";
}

bool more_goal_is_better(const TuneProblem& problem) {
  return !problem.goals.empty() || more_is_better(problem.goal.measure);
}

const std::vector<Measure>& measures() {
  static const std::vector<Measure> all = [] {
    std::vector<Measure> measures;
    for (const Spelling& s : spellings) measures.push_back(s.measure);
    return measures;
  }();
  return all;
}

}  // namespace tiltrim
