#include "study/requirement_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "tune/measures.hpp"

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
    case Measure::peak_sensitivity:
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

// ---- keys of single measures ----

// Of all measures.
const std::vector<std::string> subjects{"of",    "weight", "decay",   "damping", "frequency",
                                        "input", "output", "weights", "band"};

// The keys that a measure has, besides `of`.
std::vector<std::string> keys_of(Measure measure) {
  switch (measure) {
    case Measure::peak_gain:
    case Measure::h2_norm:
      return {"input", "output", "weight"};
    case Measure::peak_sensitivity:
      return {"weight"};
    case Measure::quadratic_cost:
      return {"weights"};
    case Measure::overshoot:
      return {"input", "output"};
    case Measure::settling_time:
      return {"input", "output", "band"};
    case Measure::pole_region:
      return {"decay", "damping", "frequency"};
    default:
      return {};
  }
}

std::vector<std::string> with(std::vector<std::string> keys, const std::vector<std::string>& more) {
  keys.insert(keys.end(), more.begin(), more.end());
  return keys;
}

// A name, or a list of names.
std::vector<std::string> read_signals(const Section& section, const char* key,
                                      const std::vector<std::string>& names) {
  const Entry& given = section.require(key, "the name of a signal in quotes, or a list of names");
  const bool list = given.kind == Entry::Kind::array;
  std::vector<std::string> signals;
  for (const Entry& entry : list ? given.entries : std::vector<Entry>{given}) {
    if (entry.kind != Entry::Kind::text)
      section.refuse(entry, fmt::format("{} is not a name; expected the name of a signal in quotes",
                                        described(entry)));
    if (std::ranges::find(names, entry.text) == names.end())
      section.refuse(entry, fmt::format("no signal {}; expected one of {}", in_quotes(entry.text),
                                        fmt::join(names, ", ")));
    signals.push_back(entry.text);
  }
  if (signals.empty()) section.refuse(given, "is empty; expected the name of a signal");
  return signals;
}

void read_weight(const Section& section, Requirement& asked) {
  const auto weight = section.table("weight");
  if (!weight) return;
  weight->allow_only({"numerator", "denominator"});
  const Accepted any{-largest, largest};
  if (const Entry* list = weight->find("numerator")) asked.numerator = weight->numbers(*list, any);
  if (const Entry* list = weight->find("denominator"))
    asked.denominator = weight->numbers(*list, any);
}

void read_weights(const Section& section, const Tuned& tuned, Requirement& asked) {
  section.require("weights", "a table of weights, as {angle = 1, force = 0.1}");
  const auto weights = section.table("weights");
  const std::vector<std::string> names = with(tuned.states, tuned.outputs);
  weights->allow_only(names);
  for (const std::string& name : names)
    if (weights->find(name)) asked.weights[name] = weights->number(name, {0, largest});
}

void read_region(const Section& section, Requirement& asked) {
  read_number(section, "decay", {0, largest, "1/s"}, asked.decay);
  read_number(section, "damping", {0, 1}, asked.damping);
  read_number(section, "frequency", {0, largest, "rad/s"}, asked.frequency);
  if (!(asked.decay > 0 || asked.damping > 0 || asked.frequency > 0))
    section.refuse(*section.find("measure"),
                   "pole_region needs bounds; expected a positive decay, damping or frequency");
}

void read_subject(const Section& section, const Tuned& tuned, Requirement& asked) {
  const std::vector<std::string> own = keys_of(asked.measure);
  const auto has = [&](const char* key) { return std::ranges::find(own, key) != own.end(); };
  for (const std::string& key : subjects)
    if (const Entry* given = section.find(key); given && key != "of" && !has(key.c_str()))
      section.refuse(*given, fmt::format("{} does not apply to {}", key, name_of(asked)));
  if (has("input")) {
    asked.from = read_signals(section, "input", tuned.inputs);
    asked.to = read_signals(section, "output", with(tuned.outputs, tuned.states));
  }
  if (has("weight")) read_weight(section, asked);
  if (has("weights")) read_weights(section, tuned, asked);
  if (has("band")) read_number(section, "band", {1e-6, 0.9}, asked.band);
  if (has("decay")) read_region(section, asked);
}

// A measure and its subject, without a limit.
Requirement read_measure(const Section& section, const Tuned& tuned, const TuneTable& tune) {
  section.require("measure", "the name of a measure in quotes, as \"damping\"");
  std::vector<std::string> names;
  for (const Requirement& measure : tuned.measures) names.push_back(name_of(measure));
  Requirement asked = tuned.measures[section.choice("measure", names)];
  asked.of = read_of(section, tuned, asked);
  read_subject(section, tuned, asked);
  const bool disturbed =
      std::ranges::any_of(tune.disturbance, [](const auto& start) { return start.second != 0; });
  const bool disturbs =
      asked.measure == Measure::response_use || asked.measure == Measure::quadratic_cost;
  if (disturbs && !disturbed)
    section.refuse(*section.find("measure"),
                   fmt::format("{} needs a disturbance; expected [tune.disturbance] with a nonzero "
                               "number",
                               to_string(asked.measure)));
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

// Each figure of merit by its name.
std::vector<Requirement> measures_with(const std::vector<std::string>& figures) {
  std::vector<Requirement> all;
  for (const Measure measure : measures()) {
    if (measure == Measure::figure)
      for (const std::string& figure : figures)
        all.push_back({.measure = measure, .figure = figure});
    else
      all.push_back({.measure = measure});
  }
  return all;
}

// A name alone is short for {measure = name}; a list has a target for each.
void read_goals(const Section& section, const path& file, const Tuned& tuned, TuneTable& tune) {
  const Entry* goal = section.find("goal");
  if (!goal) return;
  const bool list = goal->kind == Entry::Kind::array && !goal->entries.empty() &&
                    goal->entries.front().kind == Entry::Kind::table;
  if (list) {
    for (const Section& one : section.tables("goal"))
      tune.goals.push_back(read_limit(one, tuned, tune));
    return;
  }
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
  const std::string no_limit = "a single goal has no limit";
  asked.allow_only(with({"measure"}, subjects), {{"at_least", no_limit}, {"at_most", no_limit}});
  tune.goal = read_measure(asked, tuned, tune);
}

Requirement read_limit(const Section& section, const Tuned& tuned, const TuneTable& tune) {
  section.allow_only(with({"measure", "at_least", "at_most"}, subjects));
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
  section.allow_only(with({"measure", "from", "to", "count"}, subjects),
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
