// tiltrim qualities, and the borders of levels along a sweep, as a user runs them.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace qualities_cli_test {

namespace {

using nlohmann::json;
using program::Ran;
using program::run;
using program::Scratch;
using program::slurp;

const std::string studies = TILTRIM_SOURCE_DIR "/studies/";
const std::string jet = "'" + studies + "boeing747.toml' ";

json json_of(const Scratch& scratch, const std::string& arguments, int exit_code = 0) {
  const Ran ran = run(scratch, arguments + " -f json");
  CAPTURE(arguments);
  CAPTURE(ran.err);
  CHECK(ran.exit_code == exit_code);
  return json::parse(ran.out);
}

// s² + (Z + D) s + Z D + M for angle of attack and pitch rate, n/α = (U/g) Z with U/g = 20 s.
const std::string short_period = R"([model]
name = "short period"
[[model.state]]
name = "alpha"
nominal = 0.1
rate = "-z*alpha + q"
[[model.state]]
name = "q"
nominal = 0.1
rate = "-m*alpha - d*q + stick"
[[model.state]]
name = "u"
rate = "-0.02*u - 0.1*theta"
[[model.state]]
name = "theta"
nominal = 0.1
rate = "q + 0.02*u"
[[model.input]]
name = "stick"
[[model.parameter]]
name = "z"
value = 1.2
[[model.parameter]]
name = "d"
value = 1.3
[[model.parameter]]
name = "m"
value = 4.0
[[condition]]
name = "flight"
stick = 0
[qualities]
category = "A"
class = "IV"
pitch = "theta"
pitch_rate = "q"
alpha = "alpha"
speed = "u"
stick = "stick"
airspeed = 200.0
gravity = 10.0
[[sweep.axis]]
key = "m"
from = 1.0
to = 40.0
count = 14
)";

}  // namespace

TEST_CASE("the transcript of docs/qualities.md") {
  const Scratch scratch("qualities_transcript");
  const Ran ran = run(scratch, "qualities " + jet);
  CHECK(ran.exit_code == 0);
  std::string indented;
  for (std::size_t at = 0; at < ran.out.size();) {
    const std::size_t end = ran.out.find('\n', at);
    const std::string line = ran.out.substr(at, end - at);
    indented += line.empty() ? "\n" : "    " + line + "\n";
    at = end + 1;
  }
  const std::string page = slurp(TILTRIM_SOURCE_DIR "/docs/qualities.md");
  CHECK_MESSAGE(page.find(indented) != std::string::npos, indented);
}

TEST_CASE("every format of qualities; linearize has them too") {
  const Scratch scratch("qualities_formats");
  const json all = json_of(scratch, "qualities " + jet);
  const json& q = all["conditions"][0]["qualities"];
  CHECK(q["level"] == 1);
  CHECK(q["attitude"]["zeros"].size() == 2);
  CHECK(q["criteria"][2]["name"] == "short-period damping");
  CHECK(q["criteria"][2]["border"] == "1|2");
  CHECK(json_of(scratch, "linearize " + jet)["conditions"][0]["qualities"] == q);
  const auto csv = program::csv_of(run(scratch, "qualities " + jet + "-f csv").out);
  CHECK(csv.size() == 1 + q["criteria"].size());
  CHECK(csv[0][0] == "condition");
  CHECK(contains(run(scratch, "qualities " + jet + "-f markdown").out, "| phugoid damping"));
  CHECK(contains(run(scratch, "qualities " + jet + "-f latex").out, "phugoid damping"));
}

TEST_CASE("borders of levels by sweep, against the closed form") {
  const Scratch scratch("qualities_borders");
  scratch.write("a.toml", short_period);
  const json map = json_of(scratch, "sweep a.toml --threads 1");
  CHECK(json_of(scratch, "sweep a.toml --threads 3") == map);
  const json& layer = map["qualities"];
  CHECK(layer["level"].size() == 14);
  CHECK(layer["complete"] == true);
  constexpr double z = 1.2, d = 1.3, n = 20 * z;
  // ω² = CAP n/α = z d + m;  ζ = (z + d)/(2 ω)
  const auto by_anticipation = [&](double cap) { return cap * n - z * d; };
  const auto by_damping = [&](double ratio) { return std::pow((z + d) / (2 * ratio), 2) - z * d; };
  const std::map<std::pair<std::string, std::string>, double> expected{
      {{"control anticipation", "1|2"}, by_anticipation(0.28)},
      {{"control anticipation", "2|3"}, by_anticipation(0.16)},
      {{"short-period damping", "1|2"}, by_damping(0.35)},
      {{"short-period damping", "2|3"}, by_damping(0.25)}};
  std::size_t found = 0;
  for (const json& b : layer["borders"]) {
    const auto at = expected.find({b["criterion"], b["border"]});
    CAPTURE(b.dump());
    REQUIRE(at != expected.end());
    ++found;
    CHECK_NEAR(b["at"][0], at->second, 1e-8);
    CHECK_NEAR(b["at"][0], at->second, b["error"].get<double>());
    CHECK(b["error"] < 1e-8);
  }
  CHECK(found == expected.size());
  CHECK(contains(run(scratch, "sweep a.toml").out, "Borders of levels"));

  // Every height has its speed v: an eigenvalue is zero but for rounding, on no known side of a
  // border, and the others have theirs as before.
  std::string beside = short_period;
  beside.insert(beside.find("[[model.input]]"), R"x(
[[model.state]]
name = "v"
rate = "2 - exp(-h/7)*v^2"
[[model.state]]
name = "h"
rate = "m*(exp(-h/7)*v^2 - 2)"
)x");
  beside.insert(beside.find("stick = 0"), "h = 3\nv = [0.1, 10]\nrates = {h = \"implied\"}\n");
  scratch.write("b.toml", beside);
  const json others = json_of(scratch, "sweep b.toml", 1);
  CHECK(others["qualities"]["borders"].size() == expected.size());
  for (const json& b : others["qualities"]["borders"])
    CHECK_NEAR(b["at"][0], expected.at({b["criterion"], b["border"]}), 1e-8);
  REQUIRE(others["intervals"].size() == 1);
  CHECK(others["intervals"][0]["verdict"] == "undecided");
}

TEST_CASE("a level as a requirement of tune: the least frequency that is level 1") {
  const Scratch scratch("qualities_tune");
  scratch.write("t.toml", short_period + R"([tune]
conditions = ["flight"]
goal = "frequency"
second = "none"
evaluations = 400
robustness = 0
[[tune.gain]]
key = "m"
from = 1.0
to = 40.0
[[tune.limit]]
measure = "level_1_control_anticipation"
at_most = 0.0
)");
  const json tuned = json_of(scratch, "tune t.toml");
  CHECK(tuned["status"] == "tuned");
  CHECK_NEAR(tuned["gains"]["m"], 0.28 * 20 * 1.2 - 1.2 * 1.3, 1e-3);  // as in the test above
}

TEST_CASE("the built-in vehicles have roles; a [model] must give them") {
  const Scratch scratch("qualities_vehicles");
  const json level =
      json_of(scratch, "qualities '" + studies + "airframe.toml' --only 'level, attitude free'");
  const json& q = level["conditions"][0]["qualities"];
  CHECK(q["phase"] == "hover");  // 15 m/s is below 35 kt
  CHECK(q["criteria"].size() >= 3);
  const Ran without = run(scratch, "qualities '" + studies + "levitation.toml'");
  CHECK(without.exit_code == 2);
  CHECK(contains(without.err, "no [qualities] table"));
}

TEST_CASE("mistakes in [qualities] are answered with the place") {
  const Scratch scratch("qualities_mistakes");
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = short_period;
    text.replace(text.find(from), from.size(), to);
    scratch.write("b.toml", text);
    const Ran ran = run(scratch, "qualities b.toml");
    CHECK(ran.exit_code == 2);
    return ran.err;
  };
  CHECK(contains(refused("stick = \"stick\"", "stick = \"stik\""), "(nearest: 'stick')"));
  CHECK(contains(refused("class = \"IV\"", "class = \"V\""), "expected one of"));
  CHECK(contains(refused("pitch = \"theta\"", ""), "pitch"));
  CHECK(contains(refused("gravity = 10.0", "hover = [\"landing\"]"), "there are: flight"));
  CHECK(contains(refused("gravity = 10.0", "phase = \"hover\"\nhover = [\"flight\"]"), "phase"));
  CHECK(contains(refused("gravity = 10.0", "bandwidth_level_1 = [1.0]"), "bandwidth_delay"));
  CHECK(contains(refused("gravity = 10.0", "bandwidth_delay = [0, 1]\nbandwidth_level_1 = [1.0]"),
                 "1 bandwidths for 2 phase delays"));
}

}  // namespace qualities_cli_test
