// data/study.schema.json, the JSON schema of studies for editors, is generated from the readers'
// queries of every key: ranges, units, choices and lists of keys. What relates the keys of a table,
// such as those that a kind requires, is in study_rules.json. TILTRIM_WRITE=1 writes the schema.
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "study/section.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"
#include "tests/study_text.hpp"

using namespace tiltrim;
using namespace tiltrim::reading;
using nlohmann::ordered_json;
namespace fs = std::filesystem;

namespace {

const fs::path source = TILTRIM_SOURCE_DIR;

// A value as it stands in studies: of an array, `entry` has all that its entries are.
struct Shape {
  std::set<std::string> kinds;
  std::map<std::string, Shape> keys;
  std::vector<Shape> entry;
  std::set<std::string> words;
};

// Studies of one family, of the tiltrotor or with [model], and the queries while they are read.
struct Family {
  bool user = false;
  Shape root;
  std::map<std::string, Asked> numbers, choices, lists;
  std::map<std::string, std::vector<ordered_json>>
      rules;  // of a table "gains.", of a list "gains.K"
  std::map<std::string, std::set<std::string>> keys;
  std::set<std::string> open;  // tables whose keys are user-defined names
};

void merge(Shape& into, const Entry& e) {
  const std::map<Entry::Kind, std::string> kinds{{Entry::Kind::table, "object"},
                                                 {Entry::Kind::array, "array"},
                                                 {Entry::Kind::text, "string"},
                                                 {Entry::Kind::number, "number"}};
  into.kinds.insert(kinds.at(e.kind));
  if (e.kind == Entry::Kind::text) into.words.insert(e.text);
  if (e.kind == Entry::Kind::table)
    for (const Entry& child : e.entries) merge(into.keys[child.key], child);
  if (e.kind == Entry::Kind::array) {
    into.entry.resize(1);
    for (const Entry& child : e.entries) merge(into.entry[0], child);
  }
}

void hear(Family& family, const Asked& asked) {
  const bool table = asked.path.empty() || asked.path.ends_with('.');
  if (asked.number) {
    const auto [known, first] = family.numbers.try_emplace(asked.path, asked);
    Asked& all = known->second;  // of an axis the range is that of its key
    all.whole = all.whole || asked.whole;
    all.lower = std::min(all.lower, asked.lower);
    all.upper = std::max(all.upper, asked.upper);
    if (all.unit != asked.unit) all.unit.clear();
  }
  if (asked.least > 0) {
    family.lists.try_emplace(asked.path, asked);
    return;
  }
  if (!asked.number && !table) {
    const auto [known, first] = family.choices.try_emplace(asked.path, asked);
    if (!first && known->second.words != asked.words) known->second.words.clear();  // any name
  }
  if (!table) return;
  const std::set<std::string> keys(asked.words.begin(), asked.words.end());
  const auto [known, first] = family.keys.try_emplace(asked.path, keys);
  if (first || known->second == keys) return;
  if (family.user && !asked.path.empty()) {  // common to both are the keys, the others are names
    family.open.insert(asked.path);
    std::erase_if(known->second, [&](const std::string& k) { return !keys.contains(k); });
  } else {
    known->second.insert(keys.begin(), keys.end());
  }
}

void merge(Shape& into, const Shape& other) {
  into.kinds.insert(other.kinds.begin(), other.kinds.end());
  into.words.insert(other.words.begin(), other.words.end());
  for (const auto& [key, shape] : other.keys) merge(into.keys[key], shape);
  if (!other.entry.empty()) into.entry.resize(1);
  if (!other.entry.empty()) merge(into.entry[0], other.entry[0]);
}

// Tables that the same readers read in both families.
void share(const Family& from, Family& to) {
  for (const std::string table : {"follow", "sweep", "tune", "report"}) {
    merge(to.root.keys[table], from.root.keys.at(table));
    const auto of_table = [&](const auto& asked) { return asked.first.starts_with(table + "."); };
    std::ranges::copy_if(from.numbers, std::inserter(to.numbers, to.numbers.end()), of_table);
    std::ranges::copy_if(from.choices, std::inserter(to.choices, to.choices.end()), of_table);
    std::ranges::copy_if(from.lists, std::inserter(to.lists, to.lists.end()), of_table);
  }
}

void learn(Family& family, const std::string& text) {
  listener = [&](const Asked& asked) { hear(family, asked); };
  (void)parse_study(text, source / "studies/study.toml");
  listener = {};
  merge(family.root, parse_toml(text, "study.toml"));
}

ordered_json described_value(const Family& family, const Shape& shape, const std::string& path);

ordered_json table_of(const Family& family, const Shape& shape, const std::string& prefix) {
  ordered_json properties = ordered_json::object();
  const auto listed = family.keys.find(prefix);
  const bool open = listed == family.keys.end() || family.open.contains(prefix);
  if (listed != family.keys.end())
    for (const std::string& key : listed->second) {
      if (key == "model" && !family.user) continue;  // studies with it are the other family
      const bool target = prefix == "tune.goal." && key.starts_with("at_");
      if (target && !shape.keys.contains(key)) continue;  // a single goal has none
      CAPTURE(prefix + key);
      const auto known = shape.keys.find(key);
      CHECK(known != shape.keys.end());  // a study above has each key
      if (known != shape.keys.end())
        properties[key] = described_value(family, known->second, prefix + key);
    }
  ordered_json table{{"type", "object"}, {"properties", properties}};
  if (!open) table["additionalProperties"] = false;
  if (const auto rules = family.rules.find(prefix); rules != family.rules.end())
    table["allOf"] = rules->second;
  return table;
}

ordered_json list_of(const Family& family, const Shape& shape, const std::string& path) {
  ordered_json list{
      {"type", "array"}, {"minItems", 1}, {"items", described_value(family, shape.entry[0], path)}};
  if (const auto asked = family.lists.find(path); asked != family.lists.end()) {
    list["minItems"] = asked->second.least;
    if (asked->second.most > 0) list["maxItems"] = asked->second.most;
    list["uniqueItems"] = true;  // in ascending order
  }
  if (const auto rules = family.rules.find(path); rules != family.rules.end())
    list["allOf"] = rules->second;
  return list;
}

// Reads tests/study_rules.json.
void add_rules(Family& family, const ordered_json& rules) {
  for (const auto& [path, parts] : rules.items()) {
    std::vector<ordered_json>& all = family.rules[path];
    all.insert(all.end(), parts.begin(), parts.end());
  }
}

// A table whose `key` names a number of the study: the range that its other keys then have.
ordered_json range_by(const std::string& key, const std::vector<std::string>& others) {
  std::vector<Key> keys = study_keys();
  keys.push_back({"h", "h", "m", {-1e6, 1e6}});
  std::map<std::pair<double, double>, std::vector<std::string>> of_range;
  std::vector<std::string> all;
  for (const Key& k : keys) {
    of_range[{k.accepted.lower, k.accepted.upper}].push_back(k.name);
    all.push_back(k.name);
  }
  std::vector<ordered_json> rules{{{"properties", {{key, {{"enum", all}}}}}}};
  for (const auto& [range, names] : of_range) {
    const ordered_json limits{{"minimum", range.first}, {"maximum", range.second}};
    ordered_json values{{"values", {{"items", limits}}}};
    for (const std::string& other : others) values[other] = limits;
    rules.push_back({{"if", {{"properties", {{key, {{"enum", names}}}}}, {"required", {key}}}},
                     {"then", {{"properties", values}}}});
  }
  return {{"allOf", rules}};
}

ordered_json number_of(const Family& family, const std::string& path) {
  const auto asked = family.numbers.find(path);
  if (asked == family.numbers.end()) return {{"type", "number"}};
  const Asked& a = asked->second;
  ordered_json number{{"type", a.whole ? "integer" : "number"}};
  if (a.lower > -1e300) number["minimum"] = a.lower;
  if (a.upper < 1e300) number["maximum"] = a.upper;
  if (!a.unit.empty()) number["description"] = a.unit;
  return number;
}

ordered_json described_value(const Family& family, const Shape& shape, const std::string& path) {
  std::vector<ordered_json> ways;
  for (const std::string& kind : shape.kinds) {
    const auto choices = family.choices.find(path);
    if (kind == "number") ways.push_back(number_of(family, path));
    if (kind == "object") ways.push_back(table_of(family, shape, path + "."));
    if (kind == "array") ways.push_back(list_of(family, shape, path));
    if (kind != "string") continue;
    ordered_json text{{"type", "string"}, {"minLength", 1}};
    if (choices != family.choices.end() && !choices->second.words.empty())
      text["enum"] = choices->second.words;
    if (shape.words == std::set<std::string>{"free"}) text["enum"] = {"free"};
    ways.push_back(text);
  }
  if (ways.empty()) return ordered_json::object();
  return ways.size() == 1 ? ways.front() : ordered_json{{"anyOf", ways}};
}

std::vector<std::string> shipped() {
  std::vector<std::string> texts;
  for (const auto& file : fs::directory_iterator(source / "studies"))
    if (file.path().extension() == ".toml") texts.push_back(contents(file.path()));
  const std::string manual = contents(source / "docs/study.md"), fence = "```toml\n";
  for (std::size_t at = manual.find(fence); at != manual.npos; at = manual.find(fence, at)) {
    at += fence.size();
    texts.push_back(manual.substr(at, manual.find("```", at) - at));
  }
  return texts;
}

// The published vehicle is a model whose equations are built in.
bool of_a_model(const std::string& text) {
  return text.find("[model]") != text.npos || text.find("vehicle = \"xv15\"") != text.npos;
}

const std::string level = "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n";

// Keys that appear in no study above.
const std::vector<std::string> of_the_tiltrotor{
    R"(time_limit = 10
vehicle = "tiltrotor"
[aircraft]
gravity = 9.81
rotor_radius = 0.3
rotor_speed_rpm = 4000
rotor_x = 0
rotor_z = 0
blade_count = 3
blade_chord = 0.03
blade_lift_slope = 5.7
cyclic_blend_deg = 60
CL_de = 0.4
CL_q = 4.0
CM_de = -1.3
CM_q = -12
[limits]
theta0 = [0, 1]
a1s_deg = [-20, 20]
delta_e_deg = [-30, 30]
theta_deg = [-90, 90]
[[condition]]
name = "a"
formulation = "airframe"
V = [10, 12]
gamma_deg = "free"
alpha_deg = [0, 3]
theta_deg = "free"
q = 0.25
eta_deg = [0.0, 90.0]
theta0 = "free"
a1s_deg = [0, 1]
delta_e_deg = "free"
V_dot = 0.1
gamma_dot = 0.2
theta_dot = 0.3
q_dot = 0.4
objective = [{signal = "theta0", scale = 0.35, reference = 0.1}]
[[condition]]
name = "b"
formulation = "airframe"
V = "free"
gamma_deg = [-5, 5]
alpha_deg = "free"
theta_deg = [0, 5]
q = [0, 0.1]
eta_deg = "free"
theta0 = [0, 0.5]
a1s_deg = "free"
delta_e_deg = [-5, 5]
[[condition]]
name = "c"
formulation = "airframe"
V = 10
q = "free"
eta_deg = 0
theta0 = 0.2
a1s_deg = 0
delta_e_deg = 0
[envelope]
eta_deg = [0, 90]
[[report.map]]
crossings = "skip"
[[report.map.axis]]
key = "V"
values = [14, 16]
with = [{key = "gamma_deg", values = [0, 1]}, {key = "gains.K_Lp", from = 1, to = 2, spacing = "log"}]
[sweep]
crossings = "skip"
[[sweep.axis]]
key = "V"
from = 15
to = 20
count = 3
spacing = "log"
with = [{key = "gains.K_Lp", from = 1, to = 2, spacing = "log"}, {key = "gamma_deg", values = [0, 1, 2]}]
[[sweep.axis]]
key = "eta_deg"
from = 0
to = 10
count = 3
with = [{key = "gains.K_Li", from = 1, to = 2, spacing = "log"}]
)",
    level + R"([tune]
conditions = ["level"]
corridor = [0, 60]
schedule_eta_deg = [0, 45, 90]
goal = {measure = "disk_margin", of = "delta_e"}
corners = "all"
samples = 20
global = "crs2"
local = "mma"
second = "esch"
seed = 7
evaluations = 100
seconds = 60
robustness = 1000
[tune.disturbance]
V = 1.0
gamma_deg = 5.0
theta_deg = 0.0
q_deg = 0.0
[[tune.gain]]
key = "gains.K_Lp"
from = 0.02
to = 10
spacing = "log"
[[tune.uncertain]]
key = "aircraft.mass"
percent = 15
[[tune.uncertain]]
key = "aircraft.inertia_yy"
from = 0.02
to = 0.03
[[tune.limit]]
measure = "half_time"
of = "phugoid"
at_most = 10
[[tune.limit]]
measure = "damping"
at_least = 0.3
[tune.front]
measure = "half_time"
of = "phugoid"
from = 2
to = 8
count = 7
)",
    level + R"([tune]
regulator_starts = [1]
[[tune.goal]]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
at_least = 1
[[tune.goal]]
measure = "peak_sensitivity"
of = "a1s"
weight = {numerator = [1, 2], denominator = [1, 3]}
at_most = 2
[[tune.gain]]
key = "gains.K_Lp"
from = 0.02
to = 10
[[tune.limit]]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
at_least = 1
[[tune.limit]]
measure = "peak_sensitivity"
weight = {numerator = [1, 2], denominator = [1, 3]}
at_most = 2
[tune.front]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
from = 0.5
to = 1
count = 2
)",
    level + R"([tune]
goal = {measure = "pole_region", decay = 0.1, damping = 0.4, frequency = 20}
[[tune.gain]]
key = "gains.K_Lp"
from = 0.02
to = 10
)",
    level + R"([tune]
goal = {measure = "peak_sensitivity", of = "a1s", weight = {numerator = [1, 2], denominator = [1, 3]}}
[[tune.gain]]
key = "gains.K_Lp"
from = 0.02
to = 10
)",
    level + R"([tune]
[[tune.gain]]
key = "gains.K_Lp"
from = 0.02
to = 10
[tune.front]
measure = "peak_sensitivity"
weight = {numerator = [1, 2], denominator = [1, 3]}
from = 2
to = 3
count = 2
)",
    level + R"([simulate]
duration = 60
start = "level"
height = 10
axes = "body"
hand_over = "bumpless"
anti_windup = 2
lag = 0.1
tolerance = 1e-8
sample = 0.5
[simulate.schedule]
over = "height"
at = [0, 20, 120]
V = [2, 2, 15]
gamma_deg = [90, 80, 0]
eta_deg = [90, 80, 0]
[simulate.states]
V = 3
gamma_deg = 80
theta_deg = 5
q = 0.1
energy_integral = 0
distribution_integral = 0
[simulate.rates]
theta0 = 1
a1s_deg = 60
delta_e_deg = 60
eta_deg = 5
[[simulate.disturbance]]
kind = "doublet"
on = "delta_e_deg"
at = 5
size = 3
duration = 1
[[simulate.gust]]
kind = "one_minus_cosine"
direction = "up"
size = 1
at = 2
duration = 3
[[simulate.gust]]
kind = "dryden"
size = 0.5
length = 50
speed = 15
seed = 3
[montecarlo]
flights = 100
seed = 2
worst = 5
V_within = 0.3
gamma_within_deg = 1
theta_within_deg = 60
[[montecarlo.scatter]]
key = "aircraft.mass"
percent = 15
[[montecarlo.scatter]]
key = "height"
from = 5
to = 20
)"};
const std::vector<std::string> with_a_model{
    R"(time_limit = 10
[model]
name = "integrator"
[model.values]
a = 2
[[model.state]]
name = "x"
unit = "m"
nominal = 0.1
rate = "u - a*x"
[[model.state]]
name = "v"
rate = "x - v"
[[model.input]]
name = "u"
unit = "N"
nominal = 1
[[model.parameter]]
name = "a"
unit = "1/s"
nominal = 0.1
value = 1
[[model.let]]
name = "twice"
value = "2*x"
[[model.output]]
name = "y"
unit = "m"
nominal = 1
value = "twice"
[[model.switch]]
name = "middle"
at = "x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
u = [0, 2]
x = 1
rates = {x = 0, v = "implied"}
guess = {u = 1}
objective = [{signal = "u", scale = 1, reference = 0}]
[sweep]
crossings = "skip"
[[sweep.axis]]
key = "a"
values = [1, 2]
with = [{key = "x", values = [1, 2]}]
[[sweep.axis]]
key = "v"
from = 1
to = 2
count = 3
spacing = "log"
)",
    R"([model]
[[model.state]]
name = "angle"
rate = "push - angle"
[[model.input]]
name = "push"
[[condition]]
name = "rest"
push = 1
guess = {angle = 1}
rates = {angle = 0}
[simulate]
duration = 1
tolerance = 1e-8
offset = {angle = 0.1}
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
[[tune.goal]]
measure = "peak_gain"
input = "u"
output = ["y", "x"]
weight = {numerator = [1, 2], denominator = [1, 3]}
at_most = 1
[[tune.goal]]
measure = "h2_norm"
input = ["u"]
output = "y"
at_most = 1
[[tune.goal]]
measure = "settling_time"
input = "u"
output = "x"
band = 0.05
at_most = 1
[[tune.goal]]
measure = "quadratic_cost"
weights = {x = 1, y = 1}
at_most = 1
[[tune.goal]]
measure = "peak_sensitivity"
of = "loop"
at_most = 1
[[tune.goal]]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
at_least = 1
[[tune.limit]]
measure = "peak_gain"
input = "u"
output = ["y", "x"]
weight = {numerator = [1, 2], denominator = [1, 3]}
at_most = 1
[[tune.limit]]
measure = "h2_norm"
input = ["u"]
output = "y"
at_most = 1
[[tune.limit]]
measure = "settling_time"
input = "u"
output = "x"
band = 0.05
at_most = 1
[[tune.limit]]
measure = "quadratic_cost"
weights = {x = 1, y = 1}
at_most = 1
[[tune.limit]]
measure = "peak_sensitivity"
of = "loop"
at_most = 1
[[tune.limit]]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
at_least = 1
[tune.front]
measure = "peak_gain"
input = "u"
output = ["y", "x"]
weight = {numerator = [1, 2], denominator = [1, 3]}
from = 1
to = 2
count = 2
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
[tune.front]
measure = "settling_time"
input = ["u"]
output = "x"
band = 0.05
from = 0.5
to = 1
count = 2
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
[tune.front]
measure = "quadratic_cost"
weights = {x = 1, y = 1}
from = 0.5
to = 1
count = 2
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
[tune.front]
measure = "peak_sensitivity"
of = "loop"
from = 0.5
to = 1
count = 2
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
[tune.front]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
from = 0.5
to = 1
count = 2
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
goal = {measure = "peak_gain", input = "u", output = "y", weight = {numerator = [1], denominator = [1, 2]}}
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
goal = {measure = "settling_time", input = "u", output = "y", band = 0.1}
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
goal = {measure = "quadratic_cost", weights = {x = 1, y = 1}}
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
goal = {measure = "pole_region", decay = 0.1, damping = 0.4, frequency = 20}
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
goal = {measure = "peak_sensitivity", of = "loop"}
)"};

}  // namespace

TEST_CASE("the schema of studies is what the readers ask") {
  Family tiltrotor, user;
  user.user = true;
  for (const std::string& text : shipped()) learn(of_a_model(text) ? user : tiltrotor, text);
  for (const std::string& text : of_the_tiltrotor) learn(tiltrotor, text);
  for (const std::string& text : with_a_model) learn(user, text);
  share(tiltrotor, user);
  tiltrotor.choices["tune.goal"] = tiltrotor.choices.at("tune.goal.measure");
  user.choices["tune.goal"] = user.choices.at("tune.goal.measure");
  const auto rules = ordered_json::parse(contents(source / "tests/study_rules.json"));
  for (Family* family : {&tiltrotor, &user}) add_rules(*family, rules["both"]);
  add_rules(tiltrotor, rules["tiltrotor"]);
  const ordered_json tiltrotor_schema = table_of(tiltrotor, tiltrotor.root, "");
  const ordered_json user_schema = table_of(user, user.root, "");
  const ordered_json schema{
      {"$schema", "http://json-schema.org/draft-07/schema#"},
      {"title", "a study of tiltrim"},
      {"definitions",
       {{"range_of_key", range_by("key", {"from", "to"})},
        {"range_of_parameter", range_by("parameter", {"to"})}}},
      {"if",
       {{"anyOf",
         {{{"required", {"model"}}},
          {{"properties", {{"vehicle", {{"const", "xv15"}}}}}, {"required", {"vehicle"}}}}}}},
      {"then", user_schema},
      {"else", tiltrotor_schema}};
  const fs::path file = source / "data/study.schema.json";
  const std::string text = schema.dump(1) + "\n";
  if (std::getenv("TILTRIM_WRITE")) set_contents(file, text);
  CHECK(contents(file) == text);
}
