#include "study/model_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>

#include "model/formula_check.hpp"
#include "model/formulas.hpp"
#include "model/lookup.hpp"
#include "study/lookup_table_reader.hpp"
#include "vehicles/mode_names.hpp"

namespace tiltrim::reading {

namespace {

constexpr double largest_number = 1e100;
constexpr Accepted any{-largest_number, largest_number};
constexpr Accepted positive{1e-100, largest_number};
constexpr std::string_view angle = "_deg";
constexpr std::size_t most_signals = 1000;  // of each kind

// Keys of a [[condition]] in addition to the model's own names.
const std::vector<std::string>& condition_words() {
  static const std::vector<std::string> words{"name", "guess", "rates", "objective", "formulation"};
  return words;
}

// Reports at the key what `check` throws.
void checked(const Section& section, std::string_view key, const std::function<void()>& check) {
  try {
    check();
  } catch (const std::invalid_argument& e) {
    section.refuse(*section.find(key), e.what());
  }
}

// ---- [model] ----

// What formulas know.
struct Known {
  std::vector<std::string> names;
  const std::vector<LookupTable>& tables;

  bool has(const std::string& name) const {
    return std::ranges::find(names, name) != names.end() ||
           std::ranges::find(tables, name, &LookupTable::name) != tables.end();
  }
};

// A new name that formulas and conditions can use.
std::string read_name(const Section& section, const Known& known) {
  section.require("name", "a name in quotes");
  const std::string name = section.text("name");
  checked(section, "name", [&] {
    check_formula_name(name);
    if (known.has(name))
      throw std::invalid_argument(
          fmt::format("{} occurs twice; expected distinct names", in_quotes(name)));
    if (std::ranges::find(condition_words(), name) != condition_words().end())
      throw std::invalid_argument(fmt::format(
          "{} is a key of every [[condition]]; expected another name", in_quotes(name)));
  });
  return name;
}

std::string new_name(const Section& section, Known& known) {
  return known.names.emplace_back(read_name(section, known));
}

Signal read_signal(const Section& section, Known& known, double nominal = 1.0) {
  Signal signal{new_name(section, known), "", nominal};
  const Entry* unit = section.find("unit");
  const bool none = unit && unit->kind == Entry::Kind::text && unit->text.empty();
  if (unit && !none) signal.unit = section.text("unit");
  if (section.find("nominal")) signal.nominal = section.number("nominal", positive);
  return signal;
}

std::string read_formula(const Section& section, const char* key, const std::string& expected,
                         const Known& known) {
  section.require(key, expected);
  std::string text = section.passage(key);
  checked(section, key, [&] { check_formula(text, known.names, known.tables); });
  return text;
}

std::vector<Section> tables_of(const Section& section, const char* key) {
  std::vector<Section> tables = section.tables(key);
  if (tables.size() > most_signals)
    section.refuse(*section.find(key),
                   fmt::format("{} tables; expected at most {}", tables.size(), most_signals));
  return tables;
}

// A parameter's value: [model.values], which holds tuned values, has precedence.
double value_of(const Section& model, const Section& parameter) {
  parameter.require("name", "a name in quotes");
  const std::string name = parameter.text("name");
  const std::optional<Section> values = model.table("values");
  return values && values->find(name) ? values->number(name, any) : parameter.number("value", any);
}

void read_tables(const Section& section, Formulas& model) {
  for (const Section& s : tables_of(section, "table")) {
    LookupTable table = read_lookup_table(s);
    table.name = read_name(s, {{}, model.tables});
    model.tables.push_back(std::move(table));
  }
}

// Reads all names first, so that any formula may use any of them.
void read_names(const Section& section, Formulas& model, std::vector<double>& values,
                Known& known) {
  section.require("state", "at least one [[model.state]] table");
  for (const Section& s : tables_of(section, "state")) {
    s.allow_only({"name", "unit", "nominal", "rate"});
    model.states.push_back(read_signal(s, known));
  }
  for (const Section& s : tables_of(section, "input")) {
    s.allow_only({"name", "unit", "nominal"},
                 {{"value", "the value of an input belongs into the [[condition]]"}});
    model.inputs.push_back(read_signal(s, known));
  }
  for (const Section& s : tables_of(section, "parameter")) {
    s.allow_only({"name", "unit", "nominal", "value"});
    values.push_back(value_of(section, s));
    const double tenth = std::abs(values.back()) / 10;
    model.parameters.push_back(read_signal(s, known, tenth > 0 ? tenth : 1.0));
  }
}

void read_formulas(const Section& section, Formulas& model, Known& known) {
  for (const Section& s : tables_of(section, "let")) {
    s.allow_only({"name", "value"});
    const std::string text = read_formula(s, "value", "a formula in quotes, as \"k*x^2\"", known);
    model.let.push_back({new_name(s, known), text});
  }
  for (const Section& s : tables_of(section, "state"))
    model.rates.push_back(
        read_formula(s, "rate", "the formula of its rate of change in quotes, as \"-k*x\"", known));
  Known taken{names(model.states), model.tables};  // outputs may have the names of `let`
  for (const Signals* signals : {&model.inputs, &model.parameters})
    for (const Signal& s : *signals) taken.names.push_back(s.name);
  for (const Section& s : tables_of(section, "output")) {
    s.allow_only({"name", "unit", "nominal", "value"});
    model.outputs.push_back(read_signal(s, taken));
    model.values.push_back(read_formula(s, "value", "a formula in quotes, as \"k*x^2\"", known));
  }
  for (const Section& s : tables_of(section, "switch")) {
    s.allow_only({"name", "at"});
    s.require("name", "what happens there in quotes");
    model.switches.push_back(
        {s.text("name"),
         read_formula(s, "at", "a formula that is zero at the kink, as \"alpha - 0.2\"", known)});
  }
}

void check_values(const Section& section, const Model& model) {
  if (const std::optional<Section> values = section.table("values"))
    values->allow_only(names(model.parameters));
}

std::vector<UserModel::Loop> read_loops(const Section& section, const Model& model) {
  std::vector<UserModel::Loop> loops;
  for (const Section& s : tables_of(section, "loop")) {
    s.allow_only({"name", "input", "output"});
    UserModel::Loop loop;
    const auto chosen = [&](const char* key, const Signals& signals, std::string_view what) {
      s.require(key, fmt::format("the name of {} of the model", what));
      if (signals.empty())
        s.refuse(*s.find(key), fmt::format("the model has none; expected {}", what));
      const std::vector<std::string> all = names(signals);
      return all[s.choice(key, all)];
    };
    loop.input = chosen("input", model.inputs, "an input");
    loop.output = chosen("output", model.outputs, "an output");
    loop.name = s.find("name") ? s.text("name") : loop.output;
    if (std::ranges::find(loops, loop.name, &UserModel::Loop::name) != loops.end())
      s.refuse("name", fmt::format("{} occurs twice; expected distinct names", loop.name));
    loops.push_back(loop);
  }
  return loops;
}

// ---- [[condition]] ----

// A number fixes, [lower, upper] bounds, "free" leaves free.
Range read_value(const Section& section, const Entry& entry, const Key& key) {
  const Accepted accepted = accepted_by(key);
  if (entry.kind == Entry::Kind::array) return section.range(entry, accepted);
  if (entry.kind == Entry::Kind::text && entry.text == "free") return {};
  if (entry.kind != Entry::Kind::number)
    section.refuse(entry, fmt::format("{} is not a value; expected a number, [lower, upper] or "
                                      "\"free\"",
                                      describe(entry)));
  const double value = section.number(entry, accepted);
  return {value, value};
}

// An angle is given in rad or in degrees; `given` has the key of each signal so far.
void check_once(const Section& section, const Key& key, std::map<std::string, std::string>& given) {
  const auto [at, once] = given.insert({key.signal, key.name});
  if (!once)
    section.refuse(*section.find(key.name),
                   fmt::format("{} is already given; expected only one of the two", at->second));
}

void read_values(const Section& section, const std::vector<Key>& keys, UserCondition& condition) {
  std::map<std::string, std::string> given;
  for (const Key& key : keys) {
    const Entry* entry = section.find(key.name);
    if (!entry) continue;
    check_once(section, key, given);
    condition.values[key.signal] = read_value(section, *entry, key);
  }
}

// A number prescribes the rate; "free" leaves it free; "implied" only verifies that it vanishes.
void read_rates(const Section& section, const Model& model, UserCondition& condition) {
  const std::optional<Section> rates = section.table("rates");
  if (!rates) return;
  rates->allow_only(names(model.states));
  for (const Signal& s : model.states) {
    const Entry* entry = rates->find(s.name);
    if (!entry) continue;
    if (entry->kind == Entry::Kind::number) {
      condition.rates[s.name] = rates->number(*entry, any);
    } else {
      const bool implied = rates->choice(s.name, {"free", "implied"}) == 1;
      (implied ? condition.implied : condition.moving).push_back(s.name);
    }
  }
}

// A guess of what the trim does not vary would have no effect.
void check_guess(const Section& guess, const Key& key, const Model& model,
                 const UserCondition& condition) {
  const auto refuse = [&](const std::string& why) {
    guess.refuse(*guess.find(key.name), why + "; expected the guess of an unknown");
  };
  const auto given = condition.values.find(key.signal);
  if (given == condition.values.end() && find(model.parameters, key.signal) >= 0)
    refuse("the condition does not vary this parameter");
  if (given != condition.values.end() && given->second.lower == given->second.upper)
    refuse(fmt::format("the condition fixes it at {:.6g}", key.in_study(given->second.lower)));
}

void read_guess(const Section& section, const UserModel& own, UserCondition& condition) {
  const std::optional<Section> guess = section.table("guess");
  if (!guess) return;
  std::vector<std::string> allowed;
  for (const Key& key : own.keys) allowed.push_back(key.name);
  guess->allow_only(allowed);
  std::map<std::string, std::string> given;
  for (const Key& key : own.keys) {
    if (!guess->find(key.name)) continue;
    check_once(*guess, key, given);
    check_guess(*guess, key, own.model, condition);
    condition.guess[key.signal] = guess->number(key.name, accepted_by(key));
  }
}

void read_objective(const Section& section, const Model& model, UserCondition& condition) {
  std::vector<std::string> all;
  for (const Signals* signals : {&model.states, &model.inputs, &model.parameters, &model.outputs})
    for (const Signal& s : *signals) all.push_back(s.name);
  for (const Section& term : section.tables("objective")) {
    term.allow_only({"signal", "scale", "reference"});
    term.require("signal", "the name of a signal in quotes");
    CostTerm effort{all[term.choice("signal", all)]};
    if (term.find("scale")) effort.scale = term.number("scale", positive);
    if (term.find("reference")) effort.reference = term.number("reference", any);
    condition.effort.push_back(effort);
  }
}

// Inputs have no default value, except those that break a loop.
void check_inputs(const Section& section, const UserModel& own, UserCondition& condition) {
  for (const Signal& s : own.model.inputs) {
    if (condition.values.contains(s.name)) continue;
    if (std::ranges::find(own.loops, s.name, &UserModel::Loop::input) == own.loops.end())
      section.require(s.name, "a number, [lower, upper] or \"free\" for this input");
    condition.values[s.name] = {0.0, 0.0};
  }
}

}  // namespace

std::vector<Key> keys_for(const Model& model, const Signals& signals) {
  std::vector<Key> keys;
  for (const Signal& s : signals) {
    keys.push_back({s.name, s.name, s.unit, {-largest_number, largest_number}});
    const std::string in_degrees = s.name + std::string(angle);
    const auto all = {&model.states, &model.inputs, &model.parameters, &model.outputs};
    const bool taken =
        std::ranges::any_of(all, [&](const Signals* own) { return find(*own, in_degrees) >= 0; });
    if (s.unit == "rad" && !taken)
      keys.push_back({in_degrees, s.name, "degrees", {-largest_number, largest_number}});
  }
  return keys;
}

std::vector<Key> keys_of(const Model& model) {
  std::vector<Key> keys;
  for (const Signals* signals : {&model.states, &model.inputs, &model.parameters})
    std::ranges::copy(keys_for(model, *signals), std::back_inserter(keys));
  return keys;
}

UserModel read_model(const Section& section) {
  section.allow_only({"name", "state", "input", "parameter", "values", "table", "let", "output",
                      "switch", "loop"});
  Formulas formulas;
  formulas.name = section.find("name") ? section.text("name") : "model";
  std::vector<double> values;
  Known known{{}, formulas.tables};
  read_tables(section, formulas);
  read_names(section, formulas, values, known);
  read_formulas(section, formulas, known);
  UserModel own;
  own.model = model_of(formulas);
  own.model.mode_names = aircraft_modes();
  check_values(section, own.model);
  own.parameters = Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
  own.keys = keys_of(own.model);
  own.loops = read_loops(section, own.model);
  return own;
}

Condition read_user_condition(const Entry& entry, const std::filesystem::path& file,
                              const std::shared_ptr<const UserModel>& own) {
  const Section section(file, entry, "in [[condition]] of this model", "condition.");
  std::vector<Key> keys = own->keys;
  std::ranges::copy(keys_for(own->model, own->model.outputs), std::back_inserter(keys));
  std::vector<std::string> allowed{"name", "guess", "rates", "objective"};
  for (const Key& key : keys) allowed.push_back(key.name);
  section.allow_only(allowed, {{"formulation", "a study with [model] has one way to trim it"}});
  Condition condition;
  condition.name = section.text("name");
  UserCondition& asked = condition.asked.emplace<UserCondition>();
  asked.model = own;
  read_values(section, keys, asked);
  if (own->xv15) complete_published(section, *own, asked);
  check_inputs(section, *own, asked);
  read_rates(section, own->model, asked);
  read_guess(section, *own, asked);
  read_objective(section, own->model, asked);
  return condition;
}

}  // namespace tiltrim::reading
