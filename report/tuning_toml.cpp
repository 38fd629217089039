#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "report/tuning_parts.hpp"
#include "tune/measures.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

using Eigen::Index;
using namespace tuning;

std::size_t tuning::places(const TuningReport& report) {
  return report.result.achieved.size() / asked_of(report.problem).size();
}

bool tuning::has_gains(const TuneProblem& problem, const TuneResult& result) {
  return problem.variables() > 0 && std::size_t(result.gains.size()) == problem.variables();
}

const std::string& tuning::point_name(const TuneProblem& problem, const Achieved::Place& place) {
  return problem.points.at(place.point).name;
}

std::vector<double> tuning::values_of(const TuneProblem& problem, const TuneResult& result,
                                      std::size_t gain) {
  const std::size_t n = std::max<std::size_t>(1, problem.schedule.size());
  const double* first = result.gains.data() + gain * n;
  return {first, first + n};
}

Key tuning::key_of(const TuneProblem& problem, const std::string& signal) {
  const Signals parameters =
      problem.points.empty() ? Signals{} : problem.points.front().model.parameters;
  const Index i = find(parameters, signal);
  const bool tiltrotor = find(parameters, gain_signals().front().name) >= 0;
  if (i >= 0 && !tiltrotor) return {signal, signal, parameters[std::size_t(i)].unit, {}};
  const std::vector<Key> keys = study_keys();
  const auto at = std::ranges::find(keys, signal, &Key::signal);
  return at == keys.end() ? Key{signal, signal, "", {}} : *at;
}

namespace {

bool in_a_study(const std::string& signal) {
  return (signal.starts_with("gains.") || signal.starts_with("aircraft.")) &&
         std::ranges::any_of(study_keys(), [&](const Key& key) { return key.signal == signal; });
}

// In the study's unit, the shortest number that reads back as these bits, or the nearest.
double as_written(const Key& key, double si) {
  const double near = key.in_study(si);
  for (const double value : {std::strtod(fmt::format("{:.15g}", near).c_str(), nullptr), near,
                             std::nextafter(near, -INFINITY), std::nextafter(near, INFINITY)})
    if (key.in_si(value) == si) return value;
  return near;
}

// A TOML float: the fewest digits that read back as the same bits, never an integer.
std::string toml_number(double value) {
  const std::string digits = fmt::format("{}", value);
  return digits.find_first_not_of("-0123456789") == std::string::npos ? digits + ".0" : digits;
}

std::string as_comment(std::string words) {
  std::ranges::replace_if(
      words, [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
  return "# " + words + "\n";
}

std::string toml_list(const std::vector<double>& si, const Key& key) {
  std::vector<std::string> numbers;
  for (const double value : si) numbers.push_back(toml_number(as_written(key, value)));
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

std::string constant_toml(const TuneProblem& problem, const TuneResult& result) {
  std::string text;
  for (const std::string section : {"gains", "aircraft"}) {
    std::string lines;
    for (std::size_t g = 0; g < problem.gains.size(); ++g) {
      const std::string& signal = problem.gains[g].name;
      if (!in_a_study(signal) || !signal.starts_with(section + ".")) continue;
      const Key key = key_of(problem, signal);
      lines += fmt::format("{} = {}\n", key.name.substr(section.size() + 1),
                           toml_number(as_written(key, result.gains[Index(g)])));
    }
    if (!lines.empty()) text += (text.empty() ? "[" : "\n[") + section + "]\n" + lines;
  }
  for (std::size_t g = 0; g < problem.gains.size(); ++g)
    if (const std::string& signal = problem.gains[g].name; !in_a_study(signal))
      text += as_comment(fmt::format("{} = {}, which studies do not have", signal,
                                     toml_number(result.gains[Index(g)])));
  return text;
}

std::string scheduled_toml(const TuneProblem& problem, const TuneResult& result) {
  constexpr std::string_view prefix = "gains.";
  const Key over = key_of(problem, problem.schedule_over);
  std::string gains, others;
  for (std::size_t g = 0; g < problem.gains.size(); ++g) {
    const std::string& signal = problem.gains[g].name;
    const std::string values = toml_list(values_of(problem, result, g), key_of(problem, signal));
    if (over.name == "eta_deg" && in_a_study(signal) && signal.starts_with(prefix))
      gains += fmt::format("{} = {}\n", signal.substr(prefix.size()), values);
    else
      others += as_comment(fmt::format("{} = {}, which studies do not schedule", signal, values));
  }
  if (gains.empty()) return others;
  return fmt::format("[gains]\nschedule_eta_deg = {}\n{}{}", toml_list(problem.schedule, over),
                     gains, others);
}

std::string user_toml(const UserModel& own, const TuneProblem& problem, const TuneResult& result) {
  std::string text, others;
  for (std::size_t g = 0; g < problem.gains.size(); ++g) {
    const std::string& name = problem.gains[g].name;
    const std::string line = fmt::format("{} = {}", name, toml_number(result.gains[Index(g)]));
    if (own.xv15 && std::ranges::find(own.gains, name) == own.gains.end())
      others += as_comment(line + ", which [gains] does not have");
    else
      text += line + '\n';
  }
  if (text.empty()) return others;
  return (own.xv15 ? "[gains]\n" : "[model.values]\n") + text + others;
}

}  // namespace

std::string tuning_toml(const TuningReport& report) {
  if (report.result.status == TuneStatus::no_trim) return "";  // no trim: gains are meaningless
  if (!has_gains(report.problem, report.result) || !report.result.gains.allFinite()) return "";
  if (report.user_model) return user_toml(*report.user_model, report.problem, report.result);
  return report.problem.schedule.empty() ? constant_toml(report.problem, report.result)
                                         : scheduled_toml(report.problem, report.result);
}

}  // namespace tiltrim
