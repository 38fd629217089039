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
#include "tests/schema_studies.hpp"
#include "tests/study_text.hpp"

using namespace tiltrim;
using namespace tiltrim::reading;
using nlohmann::ordered_json;
namespace fs = std::filesystem;

namespace study_schema_test {

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
  for (const std::string table : {"follow", "sweep", "tune", "report", "qualities"}) {
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
    ordered_json text{{"type", "string"}};
    if (!path.ends_with(".unit")) text["minLength"] = 1;  // a quantity may have none
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

// `text` with the names of this kind of study's signals.
std::string with_signals(std::string text,
                         const std::vector<std::pair<std::string, std::string>>& names) {
  for (const auto& [placeholder, name] : names)
    for (std::size_t at = 0; (at = text.find(placeholder, at)) != text.npos; at += name.size())
      text.replace(at, placeholder.size(), name);
  return text;
}

// The published vehicle is a model whose equations are built in.
bool of_a_model(const std::string& text) {
  return text.find("[model]") != text.npos || text.find("vehicle = \"xv15\"") != text.npos;
}

}  // namespace

TEST_CASE("the schema of studies is what the readers ask") {
  Family tiltrotor, user;
  user.user = true;
  for (const std::string& text : shipped()) learn(of_a_model(text) ? user : tiltrotor, text);
  for (const std::string& text : of_the_tiltrotor) learn(tiltrotor, text);
  for (const std::string& text : with_a_model) learn(user, text);
  for (const std::string& text : over_responses) {
    learn(tiltrotor, one_gain + with_signals(text, {{"INPUT", "V_added"},
                                                    {"OUTPUT", "airspeed"},
                                                    {"STATE", "theta"},
                                                    {"LOOP", "a1s"},
                                                    {"WEIGHTS", all_of_the_loop}}));
    learn(user, one_loop + with_signals(text, {{"INPUT", "u"},
                                               {"OUTPUT", "y"},
                                               {"STATE", "x"},
                                               {"LOOP", "loop"},
                                               {"WEIGHTS", "x = 1, y = 1"}}));
  }
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

}  // namespace study_schema_test
