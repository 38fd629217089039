#include "study/requirement_reader.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tiltrim::reading {

namespace {

using std::filesystem::path;

// A number in the file's unit.
double as_written(const Section& section, const char* key, const Accepted& accepted) {
  (void)section.number(key, accepted);
  return section.find(key)->number;
}

// Range of a limit, in the measure's unit.
Accepted range_of(Measure measure) {
  switch (measure) {
    case Measure::decay:
      return {-largest, largest, unit(measure)};
    case Measure::damping:
      return {-1, 1, unit(measure)};
    case Measure::phase_margin_deg:
      return {0, 180, unit(measure)};
    default:
      return {0, largest, unit(measure)};
  }
}

bool of_an_actuator(Measure measure) {
  switch (measure) {
    case Measure::gain_margin_db:
    case Measure::phase_margin_deg:
    case Measure::delay_margin:
    case Measure::disk_margin:
    case Measure::use:
    case Measure::response_use:
      return true;
    default:
      return false;
  }
}

std::string read_of(const Section& section, const Tuned& tuned, const Requirement& asked) {
  if (asked.measure == Measure::half_time) {
    section.require("of", "the name of a mode, as of = \"phugoid\"");
    return section.text("of");
  }
  const Entry* of = section.find("of");
  if (!of) return {};
  if (!of_an_actuator(asked.measure))
    section.refuse(*of,
                   fmt::format("{} does not apply to a mode or an actuator; expected no key of",
                               name_of(asked)));
  if (tuned.actuators.empty())
    section.refuse(*of, "the model has no [[model.loop]]; expected no key of");
  return tuned.actuators[section.choice("of", tuned.actuators)];
}

// A measure and its subject, without a limit.
Requirement read_measure(const Section& section, const Tuned& tuned, const TuneTable& tune) {
  section.require("measure", "the name of a measure in quotes, as \"damping\"");
  std::vector<std::string> names;
  for (const Requirement& measure : tuned.measures) names.push_back(name_of(measure));
  Requirement asked = tuned.measures[section.choice("measure", names)];
  asked.of = read_of(section, tuned, asked);
  const bool disturbed =
      std::ranges::any_of(tune.disturbance, [](const auto& start) { return start.second != 0; });
  if (asked.measure == Measure::response_use && !disturbed)
    section.refuse(
        *section.find("measure"),
        "response_use needs a disturbance; expected [tune.disturbance] with a nonzero number");
  if (asked.measure == Measure::sensitivity && tune.uncertain.empty())
    section.refuse(*section.find("measure"),
                   "sensitivity needs uncertain numbers; expected [[tune.uncertain]] tables");
  return asked;
}

}  // namespace

std::size_t read_count(const Section& section, double most) {
  return std::size_t(
      section.whole(section.require("count", "a whole number of points"), {2, most}));
}

std::vector<Requirement> measures_with(const std::vector<std::string>& figures) {
  std::vector<Requirement> all;
  for (const Measure measure : measures())
    if (measure != Measure::figure)
      all.push_back({measure});
    else
      for (const std::string& figure : figures)
        all.push_back({.measure = measure, .figure = figure});
  return all;
}

// A name alone is short for {measure = name}.
Requirement read_goal(const Section& section, const path& file, const Tuned& tuned,
                      const TuneTable& tune) {
  const Entry* goal = section.find("goal");
  if (!goal) return tune.goal;
  Entry written = *goal;
  if (goal->kind == Entry::Kind::text) {
    written = {Entry::Kind::table, goal->key, goal->key_place, goal->place, 0.0, {}, {*goal}};
    written.entries.front().key = "measure";
  } else if (goal->kind != Entry::Kind::table) {
    section.refuse(*goal, fmt::format("{} is not a measure; expected \"decay\" or {{measure = "
                                      "\"disk_margin\", of = \"delta_e\"}}",
                                      described(*goal)));
  }
  const Section asked(file, written, "in goal", "tune.goal.");
  const std::string no_limit = "a goal has no limit";
  asked.allow_only({"measure", "of"}, {{"at_least", no_limit}, {"at_most", no_limit}});
  return read_measure(asked, tuned, tune);
}

Requirement read_limit(const Section& section, const Tuned& tuned, const TuneTable& tune) {
  section.allow_only({"measure", "at_least", "at_most", "of"});
  Requirement limit = read_measure(section, tuned, tune);
  const bool more = more_is_better(limit.measure);
  const char* right = more ? "at_least" : "at_most";
  if (const Entry* wrong = section.find(more ? "at_most" : "at_least"))
    section.refuse(*wrong, fmt::format("for {}, {} is better; expected {}", name_of(limit),
                                       more ? "more" : "less", right));
  limit.limit = as_written(section, right, range_of(limit.measure));
  return limit;
}

TuneTable::Front read_front(const Section& section, const Tuned& tuned, const TuneTable& tune) {
  const std::string moves = "the limit goes from `from` to `to`";
  section.allow_only({"measure", "of", "from", "to", "count"},
                     {{"at_least", moves}, {"at_most", moves}});
  TuneTable::Front front{read_measure(section, tuned, tune)};
  const Accepted accepted = range_of(front.limit.measure);
  front.from = as_written(section, "from", accepted);
  front.to = as_written(section, "to", accepted);
  if (front.from == front.to)
    section.refuse(*section.find("to"),
                   fmt::format("{} is `from` again; expected another number", front.to));
  front.count = int(read_count(section, 100));
  return front;
}

}  // namespace tiltrim::reading
