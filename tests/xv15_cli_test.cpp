// The published vehicle by the program: loads, trims, validation and its page.
#include <nlohmann/json.hpp>

#include "tests/check.hpp"
#include "tests/files.hpp"
#include "tests/program.hpp"

using namespace program;
using nlohmann::json;

namespace xv15_cli_test {

namespace {

const fs::path source = TILTRIM_SOURCE_DIR;

const std::string at_40_kt =
    "vehicle = 'xv15'\nvariant = 'printed_1983'\n[[condition]]\nname = '40 kt'\nu = 20.5588\n"
    "w = -0.904342\nflap_deg = 40\nmast_angle_deg = 0\ninduced_velocity = 10.8171\n";

json answer_of(const Ran& ran) {
  CAPTURE(ran.err);
  CHECK(ran.exit_code == 0);
  return json::parse(ran.out);
}

}  // namespace

TEST_CASE("loads: the same by stick or elevator; the total is the sum") {
  const Scratch scratch("xv15_loads");
  scratch.write("stick.toml", at_40_kt + "stick = 5.0691\n");
  scratch.write("elevator.toml", at_40_kt + "elevator_deg = 1.2741885\n");
  const json by_stick = answer_of(run(scratch, "loads stick.toml --format json"));
  const json by_elevator = answer_of(run(scratch, "loads elevator.toml --format json"));
  const json& one = by_stick["conditions"][0];
  CHECK(one["name"] == "40 kt");
  for (const char* axis : {"X", "Z", "M"}) {
    CAPTURE(axis);
    double sum = 0;
    for (const auto& [name, load] : one["components"].items()) {
      sum += load[axis].get<double>();
      const double other = by_elevator["conditions"][0]["components"][name][axis];
      CHECK(other == doctest::Approx(load[axis].get<double>()).epsilon(1e-9));
    }
    CHECK(sum == doctest::Approx(one["total"][axis].get<double>()).epsilon(1e-12));
  }
  // CR-166537 A-11: the printed spinners, 4.4482216 N/lbf
  CHECK(std::abs(one["components"]["spinners"]["X"].get<double>() / 4.4482216 + 57.326) < 0.5);
}

TEST_CASE("trim: text prints rounding errors as 0, JSON and CSV print the numbers") {
  const Scratch scratch("xv15_rounding");
  const std::string trim = "trim " + (source / "studies/xv15.toml").string();
  const Ran text = run(scratch, trim), csv = run(scratch, trim + " --format csv");
  CHECK(text.exit_code == 0);
  for (const char* const power : {"e-1", "e-2", "e-3", "e-4"}) {
    CAPTURE(power);
    CHECK(text.out.find(power) == std::string::npos);
  }
  const json exact = answer_of(run(scratch, trim + " --format json"));
  double largest = 0;
  for (const json& condition : exact["conditions"])
    largest = std::max(largest, std::abs(condition["state"]["q"].get<double>()));
  CHECK(largest > 0);
  CHECK(largest < 1e-12);
  CHECK(csv.out.find("e-2") != std::string::npos);
}

TEST_CASE("loads: what is missing, what is silent, what has no components") {
  const Scratch scratch("xv15_refused");
  scratch.write("no_stick.toml", at_40_kt);
  const Ran missing = run(scratch, "loads no_stick.toml");
  CHECK(missing.exit_code == 2);
  CHECK(missing.err.find("condition '40 kt': no stick or elevator_deg") != std::string::npos);
  std::string steep = at_40_kt + "stick = 4.8\n";
  steep.replace(steep.find("w = -0.904342"), 13, "w = -300");
  scratch.write("steep.toml", steep);
  const Ran silent = run(scratch, "loads steep.toml");
  CHECK(silent.exit_code == 1);
  CHECK(silent.out.find("no loads: the table") != std::string::npos);
  const Ran other = run(scratch, "loads " + (source / "studies/paper.toml").string());
  CHECK(other.exit_code == 2);
  CHECK(other.err.find("expected a study with vehicle = \"xv15\"") != std::string::npos);
  const Ran unknown = run(scratch, "validate v22");
  CHECK(unknown.exit_code == 2);
  CHECK(unknown.err.find("there are: xv15") != std::string::npos);
}

TEST_CASE("trims: pitch within 1 degree of the printed ones, stick within 5 percent of travel") {
  const Scratch scratch("xv15_trim");
  const json all = answer_of(run(
      scratch, "trim " + (source / "studies/xv15.toml").string() + " --starts 0 --format json"));
  // data/xv15/trims_gtrs.csv: 40, 60, 80, 100 kt
  constexpr std::array pitch{-2.519, -5.689, -9.346, -12.614};
  constexpr std::array stick{5.0691, 5.2942, 5.7948, 6.9384};
  for (std::size_t k = 0; k < 4; ++k) {
    const json& one = all["conditions"][k];
    CAPTURE(one["name"].get<std::string>());
    const double theta = one["state"]["theta"];
    CHECK(std::abs(theta * 57.29577951 - pitch[k]) < 1);
    CHECK(std::abs(one["input"]["stick"].get<double>() - stick[k]) < 0.05 * 9.6);
  }
}

TEST_CASE(
    "the control law's loops have margins, which limit tuned gains; these fit into the study") {
  const Scratch scratch("xv15_law");
  const std::string study =
      "vehicle = 'xv15'\ncontrol = 'energy'\n[[condition]]\nname = 'half way'\nairspeed_kt = 100\n"
      "mast_angle_deg = 45\nflap_deg = 20\n";
  scratch.write("study.toml", study);
  const json margins = answer_of(run(scratch, "margins study.toml --format json"));
  const json& loops = margins["conditions"][0]["loops"];
  REQUIRE(loops.size() == 2);
  constexpr double degree = 0.017453292519943295;
  CHECK(loops[1]["margins"]["phase"] > 70 * degree);
  scratch.write("tune.toml",
                study +
                    "[tune]\ngoal = 'decay'\nevaluations = 60\nrobustness = 0\nsecond = 'none'\n"
                    "limit = [{measure = 'phase_margin_deg', of = 'stick', at_least = 70}]\n"
                    "gain = [{key = 'k_d_helicopter', from = 1, to = 20}, {key = 'mass', from = "
                    "5000, to = 6000}]\n");
  const json tuned = answer_of(run(scratch, "tune tune.toml --gains gains.toml --format json"));
  const std::string gains = contents(scratch.path / "gains.toml");
  CHECK(gains.starts_with("[gains]\nk_d_helicopter = "));
  CHECK(gains.find("\n# mass = ") != std::string::npos);
  scratch.write("with_gains.toml", study + gains);
  const json again = answer_of(run(scratch, "margins with_gains.toml --format json"));
  CHECK(again["conditions"][0]["loops"][1]["margins"]["phase"] > 70 * degree);
}

TEST_CASE("a branch ends at the end of the nacelles' travel; what has no weight is refused") {
  const Scratch scratch("xv15_ends");
  const std::string study =
      "vehicle = 'xv15'\ncontrol = 'energy'\n[[condition]]\nname = 'slow'\nairspeed_kt = 100\n"
      "mast_angle_deg = 80\nflap_deg = 20\n";
  scratch.write("study.toml", study);
  const json turned =
      answer_of(run(scratch, "follow study.toml --parameter mast_angle_deg --to 90 -f json"));
  CHECK(turned["branches"][0]["end"] == "reached");
  for (const char* number : {"mass = -5", "gravity = 0", "rotor_speed = -60"}) {
    CAPTURE(number);
    scratch.write("none.toml", study + number + "\n");
    const Ran ran = run(scratch, "trim none.toml");
    CHECK(ran.exit_code == 2);
    CHECK(ran.err.find("is out of range; expected a number from 1e-06") != std::string::npos);
  }
}

TEST_CASE("the page of the validation is what the program prints") {
  const Scratch scratch("xv15_page");
  const fs::path file = source / "docs/validation-xv15.md";
  const std::string page = contents(file), heading = "## The comparison\n\n";
  const Ran ran = run(scratch, "validate xv15 --format markdown");
  CHECK(ran.exit_code == 0);
  const std::string intro = page.substr(0, page.find(heading) + heading.size());
  if (std::getenv("TILTRIM_WRITE")) set_contents(file, intro + ran.out);
  CHECK(contents(file) == intro + ran.out);
}

}  // namespace xv15_cli_test
