// [model] of a study and the analyses it allows: valid input read, everything else refused.
#include "study/user_model.hpp"

#include <algorithm>
#include <functional>
#include <numbers>

#include "study/angle_remarks.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"

using namespace tiltrim;
using Eigen::VectorXd;

namespace user_model_test {

namespace {

constexpr double degree = std::numbers::pi / 180;
const VectorXd none(0);

const std::string pendulum = R"toml([model]
name = "pendulum"
[[model.state]]
name = "angle"
unit = "rad"
nominal = 0.1
rate = "speed"
[[model.state]]
name = "speed"
unit = "rad/s"
rate = "(torque + added - damping*speed)/inertia - g/length*sin(angle)"
[[model.input]]
name = "torque"
unit = "N m"
nominal = 0.5
[[model.input]]
name = "added"
[[model.let]]
name = "inertia"
value = "mass*length^2"
[[model.let]]
name = "twice"
value = "2*inertia"
[[model.output]]
name = "height"
unit = "m"
nominal = 0.25
value = "-length*cos(angle)"
[[model.output]]
name = "twice"
value = "twice"
[[model.switch]]
name = "upright"
at = "cos(angle)"
[[model.parameter]]
name = "mass"
value = 2
unit = "kg"
[[model.parameter]]
name = "length"
value = 0.5
nominal = 0.02
[[model.parameter]]
name = "damping"
value = 0
[[model.parameter]]
name = "g"
value = 9.81
[[model.parameter]]
name = "slope"
unit = "rad"
value = 0.2
[[model.loop]]
input = "added"
output = "height"
)toml";

const std::string down = "[[condition]]\nname = \"down\"\ntorque = 0.5\n";

Study parsed(const std::string& text) { return parse_study(text, "t.toml"); }

UserCondition condition(const std::string& lines) {
  return *parsed(pendulum + "[[condition]]\nname = \"a\"\n" + lines).conditions.at(0).user();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != text.npos);
  return text.replace(at, from.size(), to);
}

// The study is refused at the position of @, with every one of the words.
void check_refused(std::string text, const std::vector<std::string>& words) {
  const std::size_t at = text.find('@');
  REQUIRE(at != text.npos);
  text.erase(at, 1);
  const auto line = std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n') + 1;
  const std::size_t column = at - (text.substr(0, at).rfind('\n') + 1) + 1;
  std::string message = "(accepted)";
  try {
    (void)parsed(text);
  } catch (const StudyError& e) {
    message = e.what();
  }
  CAPTURE(text.substr(at - std::min<std::size_t>(at, 60), 200));
  CAPTURE(message);
  CHECK(message.starts_with(fmt::format("t.toml:{}:{}: ", line, column)));
  for (const std::string& word : words) {
    CAPTURE(word);
    CHECK(message.find(word) != std::string::npos);
  }
}

// Errors in [model].
void check_model_refused(const std::string& from, const std::string& to,
                         const std::vector<std::string>& words) {
  check_refused(replaced(pendulum, from, to) + down, words);
}

// Errors in a condition, or in another table after a valid one.
void check_condition_refused(const std::string& lines, const std::vector<std::string>& words) {
  check_refused(pendulum + "[[condition]]\nname = \"a\"\n" + lines, words);
}
void check_table_refused(const std::string& lines, const std::vector<std::string>& words) {
  check_refused(pendulum + down + lines, words);
}

std::string names_of(const Signals& signals) {
  std::string all;
  for (const Signal& s : signals) all += fmt::format("{} [{}] {:.6g}; ", s.name, s.unit, s.nominal);
  return all;
}

}  // namespace

TEST_CASE("every table of [model] is read") {
  const Study study = parsed(pendulum + down);
  REQUIRE(study.user_model);
  const Model& m = study.user_model->model;
  CHECK(m.name == "pendulum");
  CHECK(names_of(m.states) == "angle [rad] 0.1; speed [rad/s] 1; ");
  CHECK(names_of(m.inputs) == "torque [N m] 0.5; added [] 1; ");
  CHECK(names_of(m.outputs) == "height [m] 0.25; twice [] 1; ");
  CHECK(names_of(m.parameters) ==  // a tenth of the value, or 1 of nothing
        "mass [kg] 0.2; length [] 0.02; damping [] 1; g [] 0.981; slope [rad] 0.02; ");
  CHECK(study.user_model->parameters == (VectorXd(5) << 2, 0.5, 0, 9.81, 0.2).finished());
  const Eigen::Vector2d x{0.3, 0.7}, u{1.1, 0.2};
  const VectorXd p = study.user_model->parameters;
  const VectorXd rates = m.f(x, u, p);
  CHECK(rates[0] == 0.7);
  CHECK_NEAR(rates[1], 1.3 / 0.5 - 9.81 / 0.5 * std::sin(0.3), 1e-14);
  CHECK(m.h(x, u, p) == Eigen::Vector2d{-0.5 * std::cos(0.3), 1.0});
  REQUIRE(m.switches.size() == 1);
  CHECK(m.switches[0].name == "upright");
  CHECK(m.switches[0].distance({x, u, p}) == std::cos(0.3));
  REQUIRE(study.user_model->loops.size() == 1);
  CHECK(study.user_model->loops[0].name == "height");
  CHECK(study.user_model->loops[0].input == "added");
  CHECK(study.user_model->loops[0].output == "height");
}

TEST_CASE("the least that a model needs") {
  const Study study =
      parsed("model.state = [{name = 'x', rate = '1 - x'}]\n[[condition]]\nname = 'a'\n");
  CHECK(study.user_model->model.name == "model");
  CHECK(study.user_model->model.f(VectorXd::Constant(1, 0.25), none, none)[0] == 0.75);
  CHECK(formulation_of(study.conditions[0]) == "model");
  CHECK(study.conditions[0].user()->model == study.user_model);
}

TEST_CASE("angles have two keys, in rad and in degrees") {
  const Study study = parsed(pendulum + down);
  std::string all;
  for (const Key& key : keys_of(study))
    all += fmt::format("{} {} {}; ", key.name, key.signal, key.unit);
  CHECK(all ==
        "angle angle rad; angle_deg angle degrees; speed speed rad/s; torque torque N m; "
        "added added ; mass mass kg; length length ; damping damping ; g g ; slope slope rad; "
        "slope_deg slope degrees; ");
  // A name with suffix _deg that already exists keeps its meaning.
  const Study taken = parsed(
      "model.state = [{name = 'a', unit = 'rad', rate = '-a'}]\n"
      "model.parameter = [{name = 'a_deg', value = 3}]\n[[condition]]\nname = 'c'\na_deg = 5\n");
  CHECK(taken.conditions[0].user()->values.at("a_deg").lower == 5);
  CHECK_FALSE(taken.conditions[0].user()->values.contains("a"));
}

TEST_CASE("what is no model") {
  check_refused("[model]\n@stat = 1\n" + down,
                {"unknown key 'stat' in [model]", "did you mean 'state'?",
                 "valid keys: name, state, input, parameter, values, table, "
                 "let, output, switch, loop"});
  check_refused("model = @3\n" + down, {"model: ", "is not a table; expected a table [model]"});
  check_refused("@[model]\nname = 'a'\n" + down,
                {"model.state: is missing; expected at least one [[model.state]] table"});
  check_refused("[model]\nstate = @[]\n" + down, {"model.state: an empty array is not a list"});
  check_refused("@[model.state]\nname = 'x'\n" + down,
                {"model.state: is one table; expected double brackets, [[model.state]]"});
  check_model_refused("name = \"pendulum\"", "name = @3", {"model.name: 3 is not text"});
  check_refused("[model]\n@[[model.state]]\nrate = '1'\n" + down,
                {"model.state.name: is missing; expected a name in quotes"});
}

TEST_CASE("unknown keys of its tables, with the nearest") {
  check_model_refused("nominal = 0.1", "@nominl = 0.1",
                      {"unknown key 'nominl' in [[model.state]]", "did you mean 'nominal'?"});
  check_model_refused("nominal = 0.5", "@value = 0.5",
                      {"unknown key 'value' in [[model.input]]",
                       "the value of an input belongs into the [[condition]]"});
  check_model_refused("value = 2\n", "value = 2\n@rate = '1'\n",
                      {"unknown key 'rate' in [[model.parameter]]"});
  check_model_refused("value = \"2*inertia\"", "value = \"2*inertia\"\n@unit = 'kg'",
                      {"unknown key 'unit' in [[model.let]]; valid keys: name, value"});
  check_model_refused("nominal = 0.25", "@nominals = 0.25",
                      {"unknown key 'nominals' in [[model.output]]"});
  check_model_refused("at = \"cos(angle)\"", "@when = \"cos(angle)\"",
                      {"unknown key 'when' in [[model.switch]]"});
  check_model_refused("input = \"added\"\n", "@inputs = \"added\"\n",
                      {"unknown key 'inputs' in [[model.loop]]", "did you mean 'input'?"});
}

TEST_CASE("look-up tables: read as written, and what is none, at its place") {
  const std::string two =
      "[[model.table]]\nname = \"CM\"\nat = [[-1, 0, 1], [0, 5]]\n"
      "values = [[1, 2], [3, 4], [5, 6]]\ninterpolation = \"cubic\"\n";
  const std::string with = two + "[[model.let]]\nname = \"moment\"\nvalue = \"CM(x, 0)\"\n";
  const std::string state = "[[model.state]]\nname = \"x\"\nrate = \"moment\"\n";
  const std::string condition = "[[condition]]\nname = \"rest\"\n";
  const Model m = parsed(with + state + condition).user_model->model;
  CHECK(m.f(VectorXd::Constant(1, 0.0), none, none)[0] == 3);
  CHECK_NEAR(m.f(VectorXd::Constant(1, 0.5), none, none)[0], 4, 1e-15);
  const auto refused = [&](const std::string& what, const std::string& by,
                           const std::vector<std::string>& words) {
    check_refused(replaced(with + state, what, by) + condition, words);
  };
  refused("at = [[", "@ats = [[", {"unknown key 'ats' in [[model.table]]", "did you mean 'at'?"});
  refused("\"CM\"\nat", "@\"sin\"\nat", {"model.table.name: 'sin' has another meaning"});
  refused("\"x\"\nrate", "@\"CM\"\nrate", {"model.state.name: 'CM' occurs twice"});
  refused("\"CM(x, 0)\"", "@\"CM(x)\"", {"too few arguments for CM"});
  refused("[[-1, 0, 1], [0, 5]]", "@3", {"model.table.at: 3 is not a list of numbers"});
  refused("[[-1, 0, 1], [0, 5]]", "@[[1, 2]]", {"model.table.at: 1 lists; expected"});
  refused("[[-1, 0, 1], [0, 5]]", "@[[1, 2], [1, 2], [1, 2], [1, 2]]",
          {"model.table.at: 4 lists; expected"});
  refused("[0, 5]", "@[0, 0]", {"model.table.at: 0 after 0 does not rise"});
  refused("[0, 5]", "@[0]", {"model.table.at: a single number"});
  refused("[0, 5]", "[0, @nan]", {"model.table.at: ", "is not finite"});
  refused("[0, 5]", "[@\"0\", 5]", {"model.table.at: the text '0' is not a number"});
  refused("[[1, 2], [3, 4], [5, 6]]", "@[[1, 2], [3, 4]]",
          {"model.table.values: a list of 2; expected a list of 3 lists"});
  refused("[3, 4]", "@[3, 4, 5]",
          {"model.table.values: a list of 3; expected a list of 2 numbers"});
  refused("[[1, 2], [3, 4], [5, 6]]", "@[1, 2, 3]",
          {"model.table.values: a list of 3; expected a list of 3 lists"});
  refused("[3, 4]", "@3", {"model.table.values: 3; expected a list of 2 numbers"});
  refused("[3, 4]", "[@inf, 4]", {"model.table.values: ", "is not finite"});
  refused("\"cubic\"", "@\"cubics\"",
          {"model.table.interpolation: 'cubics' is not known; expected one of linear, cubic"});
}

TEST_CASE("names that cannot be") {
  check_model_refused("\"speed\"\nunit", "@\"angle\"\nunit",
                      {"model.state.name: 'angle' occurs twice; expected distinct names"});
  check_model_refused("\"torque\"", "@\"angle\"", {"model.input.name: 'angle' occurs twice"});
  check_model_refused("\"mass\"", "@\"torque\"", {"model.parameter.name: 'torque' occurs twice"});
  check_model_refused("name = \"inertia\"", "name = @\"mass\"",
                      {"model.let.name: 'mass' occurs twice"});
  check_model_refused("name = \"height\"", "name = @\"mass\"",
                      {"model.output.name: 'mass' occurs twice"});
  check_model_refused("name = \"twice\"\nvalue = \"twice\"",
                      "name = @\"height\"\nvalue = \"twice\"",
                      {"model.output.name: 'height' occurs twice"});
  check_model_refused("\"mass\"", "@\"sin\"",
                      {"model.parameter.name: 'sin' has another meaning in formulas"});
  check_model_refused("\"mass\"", "@\"pi\"", {"'pi' has another meaning in formulas;"});
  check_model_refused("\"mass\"", "@\"2m\"",
                      {"'2m' cannot be a name in a formula; expected letters,"});
  check_model_refused("\"mass\"", "@\"the mass\"", {"cannot be a name in a formula;"});
  check_model_refused("\"mass\"", "@\"\"", {"model.parameter.name: 0 bytes long"});
  check_model_refused("\"mass\"", "@\"" + std::string(101, 'm') + "\"",
                      {"101 characters long; expected at most 100"});
  for (const char* word : {"name", "guess", "rates", "objective", "formulation"})
    check_model_refused("\"mass\"", fmt::format("@\"{}\"", word),
                        {fmt::format("'{}' is a key of every [[condition]]", word)});
}

TEST_CASE("formulas that are none, at their place") {
  check_model_refused(
      "rate = \"speed\"", "rate = @\"sped\"",
      {"model.state.rate: 'sped' at character 1 is not a known name", "did you mean 'speed'?"});
  check_refused(
      replaced(replaced(pendulum, "rate = \"speed\"\n", ""), "[[model.state]]\nname = \"angle\"",
               "@[[model.state]]\nname = \"angle\"") +
          down,
      {"model.state.rate: is missing; expected the formula of its rate of change"});
  check_model_refused("rate = \"speed\"", "rate = @0", {"model.state.rate: 0 is not text"});
  check_model_refused("rate = \"speed\"", "rate = @\"speed = 1\"", {"has a single ="});
  check_model_refused("rate = \"speed\"", "rate = @\"height\"",
                      {"'height' at character 1 is not a known name;"});
  check_model_refused("rate = \"speed\"", "rate = @\"" + std::string(5001, '1') + "\"",
                      {"5001 bytes long; expected 1 to 5000"});
  check_model_refused(
      "\"mass*length^2\"", "@\"twice/2\"",
      {"model.let.value: 'twice' at character 1 is not a known name"});  // defined later
  check_model_refused("\"-length*cos(angle)\"", "@\"-length*cos(angle\"",
                      {"model.output.value: a closing parenthesis is missing"});
  check_model_refused("\"cos(angle)\"\n[[model.par", "@\"log(angle)\"\n[[model.par",
                      {"model.switch.at: 'log' at character 1", "did you mean 'ln' or 'log10'?"});
  check_refused(
      replaced(pendulum, "[[model.switch]]\nname = \"upright\"", "@[[model.switch]]") + down,
      {"model.switch.name: is missing; expected what happens there in quotes"});
}

TEST_CASE("numbers of the model that cannot be") {
  check_refused(replaced(pendulum, "[[model.parameter]]\nname = \"mass\"\nvalue = 2",
                         "@[[model.parameter]]\nname = \"mass\"") +
                    down,
                {"model.parameter.value: is missing; expected a number"});
  check_model_refused("value = 2\n", "value = @\"2\"\n",
                      {"model.parameter.value: the text '2' is not a number"});
  check_model_refused("value = 2\n", "value = @nan\n", {"is not finite"});
  check_model_refused("value = 2\n", "value = @1e101\n", {"is out of range"});
  check_model_refused("nominal = 0.1", "nominal = @0", {"model.state.nominal: 0 is out of range"});
  check_model_refused("nominal = 0.1", "nominal = @-1",
                      {"model.state.nominal: -1 is out of range"});
  check_model_refused("nominal = 0.1", "nominal = @[1, 2]", {"is not a number"});
  check_model_refused("unit = \"rad\"", "unit = @1", {"model.state.unit: 1 is not text"});
}

TEST_CASE("[model.values] comes before a parameter's own value, and may be all there is of it") {
  const Study study = parsed(pendulum + "[model.values]\nmass = 3\nslope = -0.5\n" + down);
  CHECK(study.user_model->parameters == (VectorXd(5) << 3, 0.5, 0, 9.81, -0.5).finished());
  CHECK_NEAR(study.user_model->model.parameters[0].nominal, 0.3, 1e-15);
  const Study only = parsed(
      "[model]\nstate = [{name = 'x', rate = 'p - x'}]\nparameter = [{name = 'p'}]\n"
      "[model.values]\np = 4\n[[condition]]\nname = 'a'\n");
  CHECK(only.user_model->parameters[0] == 4);
  check_refused(pendulum + "[model.values]\n@mas = 3\n" + down,
                {"unknown key 'mas' in [model.values]; did you mean 'mass'?"});
  check_refused(pendulum + "[model.values]\n@slope_deg = 3\n" + down, {"unknown key 'slope_deg'"});
  check_refused(pendulum + "[model.values]\nmass = @'3'\n" + down,
                {"model.values.mass: the text '3' is not a number"});
}

TEST_CASE("places to break a loop at that are none") {
  check_model_refused("input = \"added\"", "input = @\"angle\"",
                      {"model.loop.input: 'angle' is not known; expected one of torque, added"});
  check_model_refused("output = \"height\"", "output = @\"hight\"",
                      {"expected one of height, twice; did you mean 'height'?"});
  check_refused(replaced(pendulum, "[[model.loop]]\ninput = \"added\"", "@[[model.loop]]") + down,
                {"model.loop.input: is missing; expected the name of an input of the model"});
  check_refused(pendulum + "@[[model.loop]]\ninput = 'torque'\noutput = 'height'\n" + down,
                {"model.loop.name: height occurs twice; expected distinct names"});
  const std::string first = "[model]\nstate = [{name = 'x', rate = '-x'}]\n";
  check_refused(first + "loop = [{input = @'u', output = 'y'}]\n" + down,
                {"model.loop.input: the model has none; expected an input"});
}

TEST_CASE("a condition fixes, bounds, frees") {
  const UserCondition c = condition(
      "angle_deg = [-10, 20]\nspeed = 'free'\ntorque = 0.5\nmass = [1, 3]\nslope_deg = 6\n"
      "g = 'free'\nheight = [-0.5, 0.0]\ntwice = 1.5\n");
  const auto is = [&](const char* name, double lower, double upper) {
    CAPTURE(name);
    REQUIRE(c.values.contains(name));
    CHECK(c.values.at(name).lower == lower);
    CHECK(c.values.at(name).upper == upper);
  };
  constexpr double far = std::numeric_limits<double>::infinity();
  CHECK(c.values.size() == 9);
  is("angle", -10 * degree, 20 * degree);
  is("speed", -far, far);
  is("torque", 0.5, 0.5);
  is("added", 0, 0);  // only for breaking the loop: zero
  is("mass", 1, 3);
  is("slope", 6 * degree, 6 * degree);
  is("g", -far, far);
  is("height", -0.5, 0);
  is("twice", 1.5, 1.5);
  CHECK(condition("torque = 0\nadded = 0.25\n").values.at("added").lower == 0.25);
}

TEST_CASE("an empty unit is the default") {
  const Study study = parsed("[model]\nstate = [{name = 'x', unit = '', rate = '-x'}]\n" +
                             down.substr(0, down.find("torque")));
  CHECK(study.user_model->model.states[0].unit.empty());
  check_refused("[model]\nstate = [{name = 'x', unit = @3, rate = '-x'}]\n" + down,
                {"model.state.unit: 3 is not text"});
}

TEST_CASE("rates, guess and objective") {
  const UserCondition c = condition(
      "torque = 'free'\nmass = [1, 3]\nrates = {angle = 0.5, speed = 'free'}\n"
      "guess = {angle_deg = 30, torque = 2, mass = 1.5}\n"
      "objective = [{signal = 'torque', scale = 2, reference = 1}, {signal = 'height'}]\n");
  CHECK(c.rates == std::map<std::string, double>{{"angle", 0.5}});
  CHECK(c.moving == std::vector<std::string>{"speed"});
  CHECK(c.implied.empty());
  CHECK(c.guess ==
        std::map<std::string, double>{{"angle", 30 * degree}, {"torque", 2}, {"mass", 1.5}});
  REQUIRE(c.effort.size() == 2);
  CHECK(c.effort[0].signal == "torque");
  CHECK(c.effort[0].scale == 2);
  CHECK(c.effort[0].reference == 1);
  CHECK(c.effort[1].signal == "height");
  CHECK(condition("torque = 0\nrates = {speed = 'implied'}\n").implied ==
        std::vector<std::string>{"speed"});
}

TEST_CASE("an angle in rad beyond a full turn is remarked upon, and its key in degrees is not") {
  const auto remarks = [](const std::string& rest) {
    return angle_remarks(parse_study(pendulum + "[[condition]]\nname = 'a'\n" + rest, "t.toml"));
  };
  const auto one = remarks("angle = -45\ntorque = 0\n");
  REQUIRE(one.size() == 1);
  CHECK(
      one[0].ends_with(": angle = -45 is in rad, -2578 degrees; -45 degrees would be -0.7854 rad"));
  CHECK(remarks("torque = 'free'\nangle = [0, 6.3]\n").size() == 1);
  CHECK(remarks("torque = 0\nguess = {angle = 90}\nrates = {angle = 90, speed = 90}\n").size() ==
        1);
  CHECK(remarks("torque = 90\nangle_deg = 90\n").empty());
  CHECK(remarks("torque = 'free'\nangle = 6.28\nspeed = 90\n").empty());
  CHECK(remarks("torque = 0\nangle_deg = 1.5708\n").size() == 1);
  CHECK(remarks("torque = 0\nangle = 1\n[[sweep.axis]]\nkey = 'angle'\nvalues = [0, 45, 90]\n")
            .size() == 2);
}

TEST_CASE("conditions that are none") {
  check_refused(pendulum + "@[[condition]]\nname = 'a'\n",
                {"condition.torque: is missing; expected a number, [lower, upper] or \"free\" for "
                 "this input"});
  check_condition_refused(
      "torque = 0\n@angel = 1\n",
      {"unknown key 'angel' in [[condition]] of this model", "did you mean 'angle'?",
       "valid keys: name, guess, rates, objective, "
       "angle, angle_deg, speed, torque, added, mass"});
  check_condition_refused("torque = 0\n@torque_deg = 1\n",
                          {"unknown key 'torque_deg'", "did you mean 'torque'? valid"});
  check_condition_refused("torque = 0\n@angle_rad = 1\n", {"did you mean 'angle'? valid"});
  check_condition_refused("torque = 0\n@angle_degrees = 1\n",
                          {"did you mean 'angle_deg'? it is in degrees; valid"});
  check_condition_refused("torque = 0\n@formulation = 'airframe'\n",
                          {"a study with [model] has one way to trim it"});
  check_condition_refused("torque = 0\n@V = 15\n", {"unknown key 'V'"});
  check_condition_refused(
      "angle = 1\nangle_deg = @2\ntorque = 0\n",
      {"condition.angle_deg: angle is already given; expected only one of the two"});
  check_condition_refused("torque = @'fre'\n",
                          {"condition.torque: the text 'fre' is not a value; expected a "
                           "number, [lower, upper] or \"free\""});
  check_condition_refused("torque = @true\n", {"is not a value"});
  check_condition_refused("torque = @[1]\n", {"is not a pair of numbers; expected [lower, upper]"});
  check_condition_refused("torque = @[2, 1]\n", {"lower 2 is not below upper 1"});
  check_condition_refused("torque = @[1, 1]\n", {"lower 1 is not below upper 1"});
  check_condition_refused("torque = [0, @inf]\n", {"is not finite"});
  check_condition_refused("torque = @1e200\n", {"is out of range"});
  check_condition_refused("torque = 0\nrates = {@height = 0}\n",
                          {"unknown key 'height' in [condition.rates]; valid keys: angle, speed"});
  check_condition_refused(
      "torque = 0\nrates = {speed = @'none'}\n",
      {"condition.rates.speed: 'none' is not known; expected one of free, implied"});
  check_condition_refused("torque = 0\nrates = {speed = @[1, 2]}\n", {"condition.rates.speed: "});
  check_condition_refused("torque = 0\nrates = @3\n", {"expected a table [condition.rates]"});
  check_condition_refused("torque = 0\nguess = {@height = 0}\n",
                          {"unknown key 'height' in [condition.guess]"});
  check_condition_refused("torque = 0\nguess = {torque = @3}\n",
                          {"condition.guess.torque: the condition fixes it at 0; expected"});
  check_condition_refused("torque = 0\nguess = {mass = @3}\n",
                          {"condition.guess.mass: the condition does not vary this parameter"});
  check_condition_refused("torque = 0\nguess = {angle = @'here'}\n",
                          {"condition.guess.angle: ", "is not a number"});
  check_condition_refused(
      "torque = 0\nobjective = [{signal = @'hight'}]\n",
      {"condition.objective.signal: 'hight' is not known", "did you mean 'height'?"});
  check_condition_refused("torque = 0\nobjective = [{signal = 'torque', scale = @0}]\n",
                          {"condition.objective.scale: 0 is out of range"});
  check_condition_refused(
      "torque = 0\nobjective = [@{scale = 1}]\n",
      {"condition.objective.signal: is missing; expected the name of a signal"});
  check_refused(pendulum + down + "[[condition]]\nname = @\"down\"\ntorque = 1\n", {"down"});
}

TEST_CASE("a study with [model] has none of the tiltrotor's tables") {
  const std::string words =
      "it belongs to the built-in tiltrotor, and a study with [model] defines its own numbers";
  for (const char* table : {"aircraft", "gains", "limits", "montecarlo"})
    check_table_refused(fmt::format("[@{}]\n", table),
                        {fmt::format("unknown key '{}'", table), words});
  check_refused("@equations = 'printed'\n" + pendulum + down, {words});
  check_refused("@models = 1\n" + pendulum + down,
                {"unknown key 'models'", "did you mean 'model'?"});
}

TEST_CASE("[follow], [sweep], [report] and [envelope] over its numbers") {
  const Study study = parsed(pendulum + down + R"(
[follow]
parameter = "slope_deg"
to = 30
[sweep]
crossings = "skip"
[[sweep.axis]]
key = "angle_deg"
values = [0, 90]
with = [{key = "mass", from = 1, to = 2}]
[envelope]
along = "torque"
torque = [-1, 1]
over = "slope_deg"
slope_deg = [0, 45]
count = 9
[[report.map]]
condition = "down"
[[report.map.axis]]
key = "g"
from = 1
to = 10
count = 3
)");
  CHECK(study.follow->parameter.signal == "slope");
  CHECK(study.follow->to == 30 * degree);
  REQUIRE(study.sweep);
  CHECK_FALSE(study.sweep->crossings);
  const SweepAxis& axis = study.sweep->axes.at(0);
  CHECK(axis.name == "angle_deg");
  CHECK(axis.columns.at(0).signal == "angle");
  CHECK(axis.columns[0].si == std::vector<double>{0, 90 * degree});
  CHECK(axis.columns.at(1).signal == "mass");
  CHECK(axis.columns[1].si == std::vector<double>{1, 2});
  CHECK(study.envelope->along.signal == "torque");
  CHECK(study.envelope->along_range.lower == -1);
  CHECK(study.envelope->over.signal == "slope");
  CHECK(study.envelope->range.upper == 45 * degree);
  CHECK(study.envelope->count == 9);
  CHECK(study.report->maps.at(0).grid.axes.at(0).columns.at(0).signal == "g");
}

TEST_CASE("numbers that the model does not have, in any table") {
  const std::string there_are = "there are: angle, angle_deg, speed, torque, added, mass, length";
  check_table_refused("[follow]\nparameter = @'V'\nto = 1\n", {"follow.parameter: ", there_are});
  check_table_refused("[follow]\nparameter = @'height'\nto = 1\n", {there_are});  // an output
  check_table_refused("[follow]\nparameter = @'masss'\nto = 1\n", {"did you mean 'mass'?"});
  check_table_refused("[[sweep.axis]]\nkey = @'h'\nvalues = [1, 2]\n",
                      {"sweep.axis.key: ", there_are});
  check_table_refused("[[sweep.axis]]\nkey = @'gains.K_Lp'\nvalues = [1, 2]\n", {there_are});
  check_table_refused(
      "@[[sweep.axis]]\nkey = 'angle'\nvalues = [0, 1]\n"
      "[[sweep.axis]]\nkey = 'angle_deg'\nvalues = [0, 10]\n",
      {"sweep.axis: angle_deg is set twice"});
  check_table_refused("[[report.map]]\n[[report.map.axis]]\nkey = @'eta_deg'\nvalues = [1, 2]\n",
                      {there_are});
  check_table_refused("[envelope]\nalong = @'V'\nover = 'mass'\n", {"envelope.along: ", there_are});
  check_table_refused("@[envelope]\nover = 'mass'\n",
                      {"envelope.along: is missing; expected a number of the model in quotes"});
  check_table_refused("@[envelope]\nalong = 'mass'\n", {"envelope.over: is missing"});
  check_table_refused("[envelope]\nalong = 'slope'\nover = @'slope_deg'\n",
                      {"envelope.over: is `along` again; expected another number"});
  check_table_refused("@[envelope]\nalong = 'g'\nover = 'mass'\nmass = [1, 2]\n",
                      {"envelope.g: is missing; expected [lower, upper], the axis's ends"});
  check_table_refused(
      "[envelope]\nalong = 'g'\nover = 'mass'\n@V = [1, 2]\n",
      {"unknown key 'V' in [envelope]; ", "valid keys: along, over, g, mass, count"});
  check_table_refused(
      "[envelope]\nalong = 'g'\ng = [1, 2]\nover = 'mass'\nmass = [1, 2]\ncount = @4\n",
      {"envelope.count: 4 is out of range"});
}

TEST_CASE("[tune] over its numbers") {
  const Study study = parsed(pendulum + down + R"(
[tune]
goal = {measure = "gain_margin_db", of = "height"}
[[tune.gain]]
key = "damping"
from = 0.1
to = 10
[[tune.gain]]
key = "slope_deg"
from = -30
to = 30
spacing = "linear"
[[tune.uncertain]]
key = "mass"
percent = 10
[tune.disturbance]
angle_deg = 5
[[tune.limit]]
measure = "response_use"
of = "height"
at_most = 1
)");
  const TuneTable& tune = *study.tune;
  CHECK(tune.conditions == std::vector<std::string>{"down"});
  CHECK(tune.gains.at(0).name == "damping");
  CHECK(tune.gains[0].logarithmic);
  CHECK(tune.gains.at(1).name == "slope");
  CHECK(tune.gains[1].lower == -30 * degree);
  CHECK(tune.uncertain.at(0).name == "mass");
  CHECK_NEAR(tune.uncertain[0].lower, 1.8, 1e-15);
  CHECK_NEAR(tune.uncertain[0].upper, 2.2, 1e-15);
  CHECK(tune.disturbance == std::map<std::string, double>{{"angle", 5 * degree}});
  CHECK(tune.goal.of == "height");
}

TEST_CASE("what [tune] of such a study cannot ask") {
  const std::string gain = "[[tune.gain]]\nkey = 'damping'\nfrom = 0.1\nto = 10\n";
  check_table_refused("[[tune.gain]]\nkey = @'gains.K_Lp'\nfrom = 1\nto = 2\n",
                      {"tune.gain.key: ", "expected a parameter of the model"});
  check_table_refused("[[tune.gain]]\nkey = @'torque'\nfrom = 1\nto = 2\n",
                      {"'torque' is not a number", "there are: mass, length, damping, g, slope",
                       "expected a parameter of the model"});
  check_table_refused("[tune]\n@heights = [0, 1]\n" + gain, {"unknown key 'heights' in [tune]"});
  check_table_refused("[tune]\n@schedule_eta_deg = [0, 90]\n" + gain,
                      {"unknown key 'schedule_eta_deg'"});
  check_table_refused("[tune]\ngoal = @'flight'\n" + gain,
                      {"flight", "is not known; expected one of"});
  check_table_refused(
      gain + "[[tune.limit]]\nmeasure = 'phase_margin_deg'\nof = @'theta0'\nat_least = 1\n",
      {"tune.limit.of: 'theta0' is not known; expected one of height"});
  check_table_refused(gain + "[tune.disturbance]\n@V = 1\n",
                      {"unknown key 'V'", "valid keys: angle, angle_deg, speed"});
  check_table_refused(gain + "[[tune.uncertain]]\nkey = @'damping'\npercent = 1\n",
                      {"damping is free in [[tune.gain]]"});
  check_table_refused(
      "[[tune.gain]]\nkey = 'g'\nfrom = 1\nto = 2\n[[tune.uncertain]]\nkey = 'damping'\npercent = "
      "@1\n",
      {"damping is 0, so a percentage of it is 0 too; expected from and to"});
  check_refused(replaced(pendulum, "[[model.loop]]\ninput = \"added\"\noutput = \"height\"\n", "") +
                    "[[condition]]\nname = 'a'\ntorque = 0\nadded = 0\n" + gain +
                    "[[tune.limit]]\nmeasure = 'phase_margin_deg'\nof = @'height'\nat_least = 1\n",
                {"tune.limit.of: the model has no [[model.loop]]; expected no key of"});
}

TEST_CASE("[simulate] of a model") {
  const Study study = parsed(pendulum + down + "[[condition]]\nname = 'up'\ntorque = 1\n" + R"(
[simulate]
start = "up"
duration = 4
sample = 0.5
tolerance = 1e-7
[simulate.offset]
angle_deg = 2
speed = 0.1
[[simulate.disturbance]]
kind = "step"
on = "torque"
at = 1
size = 0.2
[[simulate.disturbance]]
kind = "doublet"
on = "slope_deg"
size = 3
duration = 0.75
)");
  REQUIRE(study.user_motion);
  CHECK_FALSE(study.simulate);
  const UserMotion& m = *study.user_motion;
  CHECK(m.start == "up");
  CHECK(m.duration == 4);
  CHECK(m.sample == 0.5);
  CHECK(m.tolerance == 1e-7);
  CHECK(m.offset == std::map<std::string, double>{{"angle", 2 * degree}, {"speed", 0.1}});
  REQUIRE(m.changes.size() == 2);
  CHECK(m.changes[0].signal == "torque");
  CHECK_FALSE(m.changes[0].doublet);
  CHECK(m.changes[0].at == 1);
  CHECK(m.changes[0].size == 0.2);
  CHECK(m.changes[0].duration == 0);
  CHECK(m.changes[1].signal == "slope");
  CHECK(m.changes[1].doublet);
  CHECK(m.changes[1].at == 0);
  CHECK(m.changes[1].size == 3 * degree);
  CHECK(m.changes[1].duration == 0.75);
  CHECK(parsed(pendulum + down + "[simulate]\n").user_motion->start == "down");
}

TEST_CASE("what [simulate] of a model refuses") {
  const std::string change = "[[simulate.disturbance]]\nkind = 'step'\non = 'torque'\nsize = 1\n";
  check_table_refused("[simulate]\n@schedule = 1\n", {"unknown key 'schedule' in [simulate]"});
  check_table_refused("[simulate]\nstart = @'dwon'\n",
                      {"simulate.start: 'dwon' is not known; expected one of down"});
  check_table_refused("[simulate]\nduration = @0\n", {"simulate.duration: 0 is out of range"});
  check_table_refused("[simulate]\nduration = @1e6\n", {"is out of range"});
  check_table_refused("[simulate]\nsample = @20\n",
                      {"simulate.sample: 20 is out of range"});  // of 10 s
  check_table_refused("[simulate]\ntolerance = @1\n", {"simulate.tolerance: 1 is out of range"});
  check_table_refused("[simulate]\nduration = 1e5\nsample = @1e-4\n",
                      {"simulate.sample: ", "samples"});
  check_table_refused(
      "[simulate.offset]\n@torque = 1\n",
      {"unknown key 'torque' in [simulate.offset]; ", "valid keys: angle, angle_deg, speed"});
  check_table_refused(
      "[[simulate.disturbance]]\nkind = 'step'\non = @'angle'\nsize = 1\n",
      {"simulate.disturbance.on: 'angle' is not known; expected one of torque, added, mass"});
  check_table_refused("[[simulate.disturbance]]\nkind = @'ramp'\non = 'mass'\nsize = 1\n",
                      {"'ramp' is not known; expected one of step, doublet"});
  check_table_refused("@[[simulate.disturbance]]\non = 'mass'\nsize = 1\n",
                      {"simulate.disturbance.kind: is missing"});
  check_table_refused("@[[simulate.disturbance]]\nkind = 'step'\nsize = 1\n",
                      {"simulate.disturbance.on: is missing"});
  check_table_refused("@[[simulate.disturbance]]\nkind = 'step'\non = 'mass'\n",
                      {"simulate.disturbance.size: is missing"});
  check_table_refused("@" + replaced(change, "step", "doublet"),
                      {"a doublet needs one; expected a number above 0 s"});
  check_table_refused("[simulate]\nduration = 5\n" + change + "at = @7\n",
                      {"simulate.disturbance.at: 7 s is not before the end of the motion, 5 s"});
  check_table_refused(change + "at = @-1\n", {"simulate.disturbance.at: -1 is out of range"});
  check_table_refused(change + "duration = @1e-6\n",
                      {"is too short; expected 0, or at least 0.0001 s"});
  check_refused(
      "[model]\nstate = [{name = 'x', rate = '-x'}]\n[[condition]]\nname = 'a'\n"
      "[[simulate.disturbance]]\nkind = 'step'\non = @'x'\nsize = 1\n",
      {"the model has neither inputs nor parameters"});
}

}  // namespace user_model_test
