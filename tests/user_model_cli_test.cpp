// Studies with [model] as a user runs them: every command, every format, models that misbehave.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace user_model_cli_test {

namespace {

using nlohmann::json;
using program::csv_of;
using program::finish;
using program::holds_soon;
using program::Ran;
using program::records_in;
using program::Row;
using program::run;
using program::Running;
using program::Scratch;
using program::size_of;
using program::slurp;
using program::start;

const std::string levitation = "'" TILTRIM_SOURCE_DIR "/studies/levitation.toml' ";
// Under sanitizers a start takes a while.
const std::vector<std::string> every_format =
    sanitized ? std::vector<std::string>{"text", "json"}
              : std::vector<std::string>{"text", "json", "csv", "markdown", "latex"};

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

// JSON output of a command for the levitated ball; its exit code is checked.
json json_of(const Scratch& scratch, const std::string& command, const std::string& options = "",
             int exit_code = 0) {
  const Ran ran = run(scratch, fmt::format("{} {} {} -f json", command, levitation, options));
  CAPTURE(command);
  CAPTURE(ran.err);
  CHECK(ran.exit_code == exit_code);
  return json::parse(ran.out);
}

// Refused: exit code 2, nothing printed, these words.
void check_refused(const Scratch& scratch, const std::string& arguments, const std::string& words) {
  const Ran ran = run(scratch, arguments);
  CAPTURE(arguments);
  CAPTURE(ran.err);
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(says(ran.err, words));
}

double cell(const std::vector<Row>& csv, const std::string& column, std::size_t row) {
  const auto at = std::ranges::find(csv.at(0), column);
  REQUIRE(at != csv[0].end());
  return std::stod(csv.at(row).at(std::size_t(at - csv[0].begin())));
}

// x' = rate, of x and p = 1, with the tables that all commands need.
std::string study_of(const std::string& rate) {
  return "[model]\nstate = [{name = \"x\", rate = \"" + rate +
         "\"}]\nparameter = [{name = \"p\", value = 1}]\n"
         "[[condition]]\nname = \"a\"\nx = [-10, 10]\nguess = {x = 0.5}\n"
         "[follow]\nparameter = \"p\"\nto = 2\n"
         "[[sweep.axis]]\nkey = \"p\"\nvalues = [1.0, 1.5, 2.0]\n"
         "[simulate]\nduration = 1.0\n[simulate.offset]\nx = 0.1\n";
}

// Status or end and exit code of each command.
struct Said {
  std::string status;
  int exit_code;
};
struct Misbehaviour {
  const char *what, *rate;
  Said trim, linearize, follow, sweep, simulate;
};

}  // namespace

// ---- every command ----

TEST_CASE("every command answers in every format, and to a file what it prints") {
  const Scratch scratch("own-formats");
  for (const std::string command : {"trim", "trim --all", "linearize", "sensitivities", "margins",
                                    "simulate", "simulate --response gap=1e-4", "follow",
                                    "envelope --count 9", "tune --evaluations 200 --seconds 0"})
    for (const std::string& format : every_format) {
      const std::string arguments = fmt::format("{} {} -f {}", command, levitation, format);
      CAPTURE(arguments);
      const Ran ran = run(scratch, arguments);
      CHECK(ran.exit_code == 0);
      CHECK(ran.err.empty());
      CHECK(ran.out.size() > 50);
      if (format != "json") continue;
      CHECK(json::accept(ran.out));
      const Ran file = run(scratch, arguments + " -o answer");
      CHECK(file.out.empty());
      const bool same = slurp(scratch.path / "answer") == ran.out;
      CHECK(same);
    }
}

TEST_CASE("trim: the columns are the model's signals") {
  const Scratch scratch("own-trim");
  const std::vector<Row> csv = csv_of(run(scratch, "trim " + levitation + "-f csv").out);
  CHECK(csv.at(0) ==
        Row{"name", "gap", "speed", "added", "bias", "command", "pull", "residual", "status"});
  CHECK_NEAR(cell(csv, "gap", 1), 0.01, 1e-12);
  CHECK_NEAR(cell(csv, "bias", 2), 1.2, 1e-10);
  const json c = json_of(scratch, "trim")["conditions"][1];
  CHECK(c["name"] == "which bias");
  CHECK(c["status"] == "converged");
  CHECK(c["model"] == "levitation");
  CHECK(c["state"]["gap"] == 0.008);
  CHECK_NEAR(c["parameter"]["bias"].get<double>(), 1.2, 1e-10);
  CHECK_NEAR(c["output"]["pull"].get<double>(), 0.981, 1e-9);
  const json all = json_of(scratch, "trim", "--all --only held")["conditions"];
  REQUIRE(all.size() == 1);
  CHECK(all[0]["equilibria"]["starts"] == 201);
  CHECK(all[0]["equilibria"]["found"].size() >= 1);
}

TEST_CASE("angles are in degrees for people and in CSV, in rad in JSON") {
  const Scratch scratch("own-angles");
  scratch.write("s.toml",
                "[model]\nstate = [{name = \"tilt\", unit = \"rad\", rate = \"0.5 - tilt\"}]\n"
                "[[condition]]\nname = \"a\"\n");
  const std::vector<Row> csv = csv_of(run(scratch, "trim s.toml -f csv").out);
  CHECK_NEAR(cell(csv, "tilt_deg", 1), 28.64788975654116, 1e-9);
  const json c = json::parse(run(scratch, "trim s.toml -f json").out)["conditions"][0];
  CHECK_NEAR(c["state"]["tilt"].get<double>(), 0.5, 1e-12);
}

TEST_CASE("linearize: matrices, modes, verdict; models for other programs") {
  const Scratch scratch("own-linearize");
  const json c = json_of(scratch, "linearize",
                         "--models m.mat --models m.json --models m.py")["conditions"][0];
  CHECK(c["verdict"] == "stable");
  CHECK(c["linear"]["inputs"] == json{"added"});
  const json& A = c["linear"]["A"];
  CHECK_NEAR(A[0][1].get<double>(), 1, 1e-9);
  CHECK_NEAR(A[1][0].get<double>(), 1962 - 19.62 * 200, 1e-4);
  CHECK_NEAR(A[1][1].get<double>(), -19.62 * 2, 1e-6);
  CHECK_NEAR(c["linear"]["B"][1][0].get<double>(), -19.62, 1e-6);
  CHECK_NEAR(c["modes"][0]["re"].get<double>(), -19.62, 1e-5);
  CHECK(size_of(scratch.path / "m.mat") > 500);
  CHECK(says(slurp(scratch.path / "m.py"), "speed"));
  CHECK(json::accept(slurp(scratch.path / "m.json")));
  const json inputs = json_of(scratch, "linearize", "--inputs k_p,added --only held");
  CHECK(inputs["conditions"][0]["linear"]["inputs"] == json{"k_p", "added"});
  check_refused(scratch, "linearize " + levitation + "--inputs V", "no signal 'V'");
}

TEST_CASE("follow: the study's parameter or another") {
  const Scratch scratch("own-follow");
  const json b = json_of(scratch, "follow", "--only 'which bias'")["branches"][0];
  CHECK(b["parameter"] == "k_p");
  CHECK(b["end"] == "reached");
  REQUIRE(b["events"].size() >= 2);
  CHECK(b["events"][0]["kind"] == "zero");
  CHECK_NEAR(b["events"][0]["k_p"].get<double>(), 100, 1e-6);
  const json limit =
      json_of(scratch, "follow", "--parameter aim --to 0.03 --only held")["branches"][0];
  CHECK(limit["end"] == "limit");
  CHECK_NEAR(limit["points"].back()["state"]["gap"].get<double>(), 0.02, 1e-2);
  CHECK_NEAR(limit["events"].back()["aim"].get<double>(), 0.015, 1e-9);
  std::string text = slurp(TILTRIM_SOURCE_DIR "/studies/levitation.toml");
  text.replace(text.find("unit = \"m\""), 10, "unit = \"rad\"");
  scratch.write("angle.toml", text);
  const std::string table =
      run(scratch, "follow angle.toml --only 'which bias' --parameter gap --to 0.01 -f csv").out;
  CHECK(table.starts_with("name,kind,gap,speed,"));  // not in degrees as well
  check_refused(scratch, "follow " + levitation + "--parameter V --to 5",
                "'V' is not a number of a study; there are: gap, speed, added, mass");
}

TEST_CASE("envelope over two numbers of the model") {
  const Scratch scratch("own-envelope");
  const json e = json_of(scratch, "envelope", "--only held")["envelopes"][0];
  CHECK(e["over"] == "k_p");
  const json& rows = e["parts"][0]["rows"];
  REQUIRE(rows.size() == 11);
  CHECK(rows[10]["k_p"] == 240.0);
  CHECK_NEAR(rows[10]["intervals"][0]["from"]["aim"].get<double>(), 0.005 + 0.5 / 240, 1e-8);
  CHECK(rows[10]["intervals"][0]["from"]["which"] == "gap lower");
  check_refused(
      scratch, "envelope " + levitation + "--over eta_deg",
      "--over applies to the built-in tiltrotor; a study with [model] sets `over` in [envelope]");
}

TEST_CASE("sensitivities and margins") {
  const Scratch scratch("own-margins");
  const json s =
      json_of(scratch, "sensitivities", "--parameters bias,k_d --only held")["conditions"][0];
  REQUIRE(s["parameters"].size() == 2);
  CHECK_NEAR(s["parameters"][0]["state"]["gap"].get<double>(), -0.01, 1e-9);
  const json m =
      json_of(scratch, "margins", "--loop coil --only held --bode bode.csv")["conditions"][0];
  REQUIRE(m["loops"].size() == 1);
  CHECK(m["loops"][0]["actuator"] == "coil");
  CHECK_NEAR(m["loops"][0]["margins"]["gain_down"].get<double>(), 0.5, 1e-7);
  CHECK(csv_of(slurp(scratch.path / "bode.csv")).size() == 201);
  check_refused(scratch, "margins " + levitation + "--loop theta0",
                "no loop 'theta0'; there are: coil");
  scratch.write("s.toml", study_of("p - x"));
  check_refused(scratch, "margins s.toml", "expected [[model.loop]] tables");
  // An output that no state reaches: in the words of a model that has no tilt and no law.
  scratch.write("zero.toml",
                "[model]\nstate = [{name = \"x\", rate = \"-x + u\"}]\n"
                "input = [{name = \"u\"}]\noutput = [{name = \"y\", value = \"0*x\"}]\n"
                "loop = [{name = \"idle\", input = \"u\", output = \"y\"}]\n"
                "[[condition]]\nname = \"a\"\nx = [-10, 10]\nu = 0\n");
  const Ran idle = run(scratch, "margins zero.toml");
  CAPTURE(idle.out);
  CAPTURE(idle.err);
  CHECK(says(idle.out, "not in use"));
  CHECK(says(idle.out, "the output of this loop does not depend on the states"));
  CHECK_FALSE(says(idle.out, "tilt"));
}

TEST_CASE("sweep: text, CSV, JSON, a map, and what changed between two") {
  const Scratch scratch("own-sweep");
  // At k_p = 100 every gap is an equilibrium: that point of the grid has no verdict.
  const json map = json_of(scratch, "sweep", "", 1);
  CHECK(map["points"].size() == 82);
  REQUIRE(map["crossings"].size() >= 1);
  const Ran bias = run(scratch, "sweep " + levitation + "--only 'which bias'");
  CHECK(says(bias.out, "zero, gap"));
  CHECK(csv_of(run(scratch, "sweep " + levitation + "-f csv").out).size() == 83);
  for (const char* file : {"a.nc", "b.nc"})
    CHECK(run(scratch, fmt::format("sweep {} -o {}", levitation, file)).exit_code == 1);
  CHECK(slurp(scratch.path / "a.nc") == slurp(scratch.path / "b.nc"));
  const Ran same = run(scratch, "diff a.nc b.nc");
  CHECK(same.exit_code == 0);
  std::string stiffer = slurp(TILTRIM_SOURCE_DIR "/studies/levitation.toml");
  const std::string k = "value = 9.81e-5";
  scratch.write("s.toml", stiffer.replace(stiffer.find(k), k.size(), "value = 6e-5"));
  (void)run(scratch, "sweep s.toml -o c.nc");
  const Ran other = run(scratch, "diff a.nc c.nc");
  CHECK(other.out != same.out);
  CHECK(says(other.out, "stable"));
}

TEST_CASE("tune, and the gains that it found stand a trial") {
  const Scratch scratch("own-tune");
  const json t = json_of(scratch, "tune", "--evaluations 1000 --gains gains.toml");
  CHECK(t["status"] == "tuned");
  const double best = t["gains"]["k_d"];
  CHECK_NEAR(best, 2 * std::sqrt(1962.0) / 19.62, 1e-3);
  CHECK(says(slurp(scratch.path / "gains.toml"), "k_d"));
  std::string tuned = slurp(TILTRIM_SOURCE_DIR "/studies/levitation.toml");
  const std::string k_d = "value = 2.0";
  scratch.write("s.toml",
                tuned.replace(tuned.find(k_d), k_d.size(), fmt::format("value = {:.17g}", best)));
  const json c = json::parse(run(scratch, "linearize s.toml --only held -f json").out);
  CHECK_NEAR(c["conditions"][0]["spectral_abscissa"].get<double>(),
             -t["goal"]["value"].get<double>(), 1e-4);
}

TEST_CASE("simulate: the study's motion, its samples and plots, a response") {
  const Scratch scratch("own-simulate");
  const json s = json_of(scratch, "simulate", "--samples s.csv");
  CHECK(s["name"] == "levitation");
  CHECK(s["start"] == "held");
  CHECK(s["status"] == "completed");
  CHECK(s["samples"]["time"].size() == 101);
  CHECK(s["units"]["gap"] == "m");
  CHECK_NEAR(s["samples"]["gap"][0].get<double>(), 0.0105,
             1e-17);  // rounding of the trim and the step
  const std::vector<Row> rows = csv_of(slurp(scratch.path / "s.csv"));
  CHECK(rows == csv_of(run(scratch, "simulate " + levitation + "-f csv").out));
  CHECK(rows.size() == 102);
  CHECK_NEAR(cell(rows, "added", 50), 0.05, 0);
  CHECK(run(scratch, "simulate " + levitation + "--samples s.nc").exit_code == 0);
  CHECK(slurp(scratch.path / "s.nc").substr(1, 3) == "HDF");
  if (run(scratch, "trim " + levitation + "-o /dev/null && gnuplot --version").exit_code == 0) {
    CHECK(run(scratch, "simulate " + levitation + "--plots plots").exit_code == 0);
    CHECK(size_of(scratch.path / "plots/motion.svg") > 1000);
  }
  const json r = json_of(scratch, "simulate", "--response gap=1e-5,speed=0 --only held");
  REQUIRE(r["responses"].size() == 1);
  CHECK(r["responses"][0]["apart"].get<double>() < 1e-3);
  check_refused(scratch, "simulate " + levitation + "--response bias=1",
                "--response: no 'bias'; there are: gap, speed");
  for (const char* other : {"--monte-carlo", "--tilt-rate-limit", "--flight 3"})
    check_refused(scratch, "simulate " + levitation + other, "apply to the built-in tiltrotor;");
}

TEST_CASE("an option with a list takes one word: the study may stand behind it") {
  const Scratch scratch("own-words");
  for (const std::string front :
       {"simulate --response gap=1e-4,speed=0 ", "sensitivities --only held --parameters bias,k_d ",
        "linearize --inputs added,k_p ", "margins --loop coil ",
        "trim --only held --only 'which bias' "}) {
    const Ran ran = run(scratch, front + levitation);
    CAPTURE(front);
    CAPTURE(ran.err);
    CHECK(ran.exit_code == 0);
  }
  scratch.write("A.csv", "-1,0\n0,-2\n");
  CHECK(run(scratch, "modes --states a,b A.csv").exit_code == 0);
  CHECK(run(scratch, "margins --loop coil --loop coil " + levitation).exit_code == 0);
}

TEST_CASE("report: one page") {
  const Scratch scratch("own-report");
  const Ran ran = run(scratch, "report " + levitation + "-o page.html");
  CHECK(ran.exit_code == 1);  // the map's point without a verdict
  const std::string page = slurp(scratch.path / "page.html");
  CHECK(says(page, "levitation"));
  CHECK(says(page, "which bias"));
  CHECK_FALSE(says(page, "theta0"));
}

TEST_CASE("what is not of such a study") {
  const Scratch scratch("own-others");
  check_refused(scratch, "tables " + levitation, "the tables are those of the paper's tiltrotor;");
  scratch.write(
      "s.toml",
      "[model]\nstate = [{name = \"x\", rate = \"1 - x\"}]\n[[condition]]\nname = \"a\"\n");
  check_refused(scratch, "follow s.toml", "no [follow] table");
  check_refused(scratch, "envelope s.toml",
                "no [envelope] table; expected one with along and over");
  check_refused(scratch, "sweep s.toml", "no [[sweep.axis]] table");
  check_refused(scratch, "tune s.toml", "no [tune] table");
  CHECK(run(scratch, "simulate s.toml").exit_code == 0);  // its defaults
  scratch.write("w.toml", "[model]\nstate = [{name = \"x\", rate = \"1 -\"}]\n");
  for (const char* command : {"trim", "linearize", "follow", "envelope", "sensitivities", "margins",
                              "sweep", "tune", "simulate", "report"})
    check_refused(scratch, fmt::format("{} w.toml", command),
                  "w.toml:2:30: model.state.rate: ends where a value is expected");
}

TEST_CASE("an output in rad is held in degrees too") {
  const Scratch scratch("own-degrees");
  const std::string model =
      "[model]\nstate = [{name = \"x\", rate = \"u - x\"}]\ninput = [{name = \"u\"}]\n"
      "output = [{name = \"gam\", unit = \"rad\", value = \"atan(x)\"}]\n"
      "[[condition]]\nname = \"a\"\nu = \"free\"\ngam_deg = 45\n";
  scratch.write("s.toml", model);
  const Ran ran = run(scratch, "trim s.toml -f json");
  REQUIRE(ran.exit_code == 0);
  CHECK_NEAR(json::parse(ran.out)["conditions"][0]["state"]["x"].get<double>(), 1.0, 1e-12);
  scratch.write("s.toml", model + "gam = 0.5\n");
  check_refused(scratch, "trim s.toml", "gam is already given; expected only one of the two");
}

TEST_CASE("an output may have the name of an angle's second key; a guess is given once") {
  const Scratch scratch("own-degrees-twice");
  const std::string model =
      "[model]\nstate = [{name = \"gam\", unit = \"rad\", rate = \"u - gam\"}, "
      "{name = \"x\", unit = \"rad\", rate = \"1 - x\"}]\n"
      "input = [{name = \"u\"}]\n"
      "output = [{name = \"gam_deg\", unit = \"deg\", value = \"gam*180/pi\"}]\n"
      "[[condition]]\nname = \"a\"\nu = \"free\"\n";
  scratch.write("s.toml", model + "gam_deg = 45\n");
  const Ran ran = run(scratch, "trim s.toml -f json");
  REQUIRE(ran.exit_code == 0);
  CHECK_NEAR(json::parse(ran.out)["conditions"][0]["input"]["u"].get<double>(), std::atan(1),
             1e-12);
  scratch.write("s.toml", model + "guess = {x_deg = 1, x = 0}\n");
  check_refused(scratch, "trim s.toml", "x is already given; expected only one of the two");
}

TEST_CASE("names that fields of the output have too get a number") {
  const Scratch scratch("own-fields");
  const auto study = [](const std::string& name) {
    return fmt::format(
        "[model]\nstate = [{{name = \"x\", rate = \"v\"}}, {{name = \"v\", rate = \"b - x - "
        "{0}*v\"}}]\n"
        "parameter = [{{name = \"{0}\", value = 1}}, {{name = \"b\", value = 0}}]\n"
        "[[condition]]\nname = \"c\"\nx = [-2, 2]\n[follow]\nparameter = \"{0}\"\nto = 2\n"
        "[[sweep.axis]]\nkey = \"{0}\"\nvalues = [0.5, 1]\n"
        "[envelope]\nalong = \"b\"\nover = \"{0}\"\nb = [0, 1]\n{0} = [0.5, 1]\ncount = 5\n",
        name);
  };
  for (const char* name : {"damping", "state", "status", "intervals", "residual"}) {
    CAPTURE(name);
    scratch.write("s.toml", study(name));
    const std::string numbered = std::string(name) + "_2";
    const auto value = [&](const json& object) {
      return object[object.contains(numbered) ? numbered : std::string(name)];
    };
    const json sweep = json::parse(run(scratch, "sweep s.toml -f json").out);
    CHECK(value(sweep["points"][0]) == 0.5);
    const json branch = json::parse(run(scratch, "follow s.toml -f json").out)["branches"][0];
    CHECK(value(branch["points"][0]) == 1);
    CHECK(branch["points"][0]["state"].contains("v"));
    CHECK(branch["events"].back()["kind"] == "end");
    const json envelope = json::parse(run(scratch, "envelope s.toml -f json").out);
    const json part = envelope["envelopes"][0]["parts"][0];
    CHECK(part["status"] == "complete");
    CHECK(value(part["rows"][0]) == 0.5);
  }
  scratch.write("s.toml", study("damping"));
  const std::vector<Row> points = csv_of(run(scratch, "sweep s.toml -f csv").out);
  CHECK(cell(points, "damping_2", 1) == 0.5);
  CHECK(cell(points, "damping", 1) == 0.25);
  scratch.write(
      "t.toml",
      "[model]\nstate = [{name = 'time', rate = '2 - time'}, {name = 'a', unit = 'rad', rate "
      "= '-a'}, {name = 'a_deg', rate = '-a_deg'}]\n[[condition]]\nname = 'c'\n[simulate]\n"
      "duration = 1\n");
  const json motion = json::parse(run(scratch, "simulate t.toml --samples t.nc -f json").out);
  CHECK(motion["samples"]["time"].back() == 1);
  CHECK(motion["samples"]["time_2"].back() == 2);
  CHECK(motion["samples"].contains("a_deg_2"));
  CHECK(std::filesystem::exists(scratch.path / "t.nc"));
}

TEST_CASE("an error of one of several conditions names it, whatever the command") {
  const Scratch scratch("own-placed");
  scratch.write("s.toml",
                "[model]\nstate = [{name = \"x\", rate = \"k - x\"}]\n"
                "parameter = [{name = \"k\", value = 1}]\n"
                "[[condition]]\nname = \"good\"\n[[condition]]\nname = \"bad\"\nx = 1\n"
                "[[sweep.axis]]\nkey = \"k\"\nfrom = 1\nto = 2\ncount = 2\n"
                "[simulate]\nstart = \"bad\"\n[tune]\ngain = [{key = \"k\", from = 1, to = 2}]\n");
  for (const char* command : {"trim", "sweep", "simulate", "tune"})
    check_refused(scratch, fmt::format("{} s.toml", command),
                  "s.toml:6:1: condition 'bad': nothing is free to hold 1 condition (x')");
}

// ---- models that misbehave ----

TEST_CASE("proved by one rate that there is no trim, where another is finite nowhere") {
  const Scratch scratch("own-nowhere");
  for (const char* rate : {"ln(x - 3)", "sqrt(x - 3)", "exp(1e6 + x)", "acos(x - 3)"}) {
    CAPTURE(rate);
    scratch.write("s.toml", fmt::format("[model]\nstate = [{{name = \"x\", rate = \"{}\"}}, "
                                        "{{name = \"y\", rate = \"y + 5\"}}]\n"
                                        "[[condition]]\nname = \"a\"\nx = [0, 1]\ny = [0, 1]\n",
                                        rate));
    for (const char* command : {"trim", "linearize", "sensitivities"}) {
      const Ran ran = run(scratch, fmt::format("{} s.toml -f json", command));
      CHECK(ran.exit_code == 1);
      CHECK(says(ran.out, "infeasible"));
      CHECK(says(ran.out, "the model is not finite at any point tried; at the guess x' = "));
    }
  }
}

TEST_CASE("a model that misbehaves has a named status from every command, and no crash") {
  const Scratch scratch("own-misbehaves");
  const Said no_start{"no_start", 1}, no_trim{"no_trim", 1}, completed{"completed", 0};
  const Misbehaviour rows[] = {{"NaN",
                                "sqrt(x - 20)",
                                {"not_finite", 1},
                                {"not_finite", 1},
                                no_start,
                                {"not_finite", 1},
                                no_trim},
                               {"infinite",
                                "1/(p - p)",
                                {"not_finite", 1},
                                {"not_finite", 1},
                                no_start,
                                {"not_finite", 1},
                                no_trim},
                               {"NaN ahead",
                                "(p > 1.4 ? sqrt(-p) : p) - x",
                                {"converged", 0},
                                {"linear", 0},
                                {"not_finite", 1},
                                {"not_finite", 1},
                                completed},
                               {"jumps over zero",
                                "x < p - 0.3 ? 1 : -1",
                                {"not_found", 1},
                                {"not_found", 1},
                                no_start,
                                {"not_found", 1},
                                no_trim},
                               {"kink",
                                "(x < p ? 2 : 1)*(p - x)",
                                {"converged", 0},
                                {"linear", 0},
                                {"reached", 0},
                                {"converged", 0},
                                completed},
                               {"stiff",
                                "1e9*(p - x)",
                                {"converged", 0},
                                {"linear", 0},
                                {"reached", 0},
                                {"converged", 0},
                                completed},
                               {"singular",
                                "-(x - p)^3",
                                {"singular", 1},
                                {"linear", 1},
                                {"", 1},
                                {"singular", 1},
                                completed},
                               {"no equilibrium",
                                "p + x^2",
                                {"infeasible", 1},
                                {"infeasible", 1},
                                no_start,
                                {"infeasible", 1},
                                no_trim},
                               {"at rest everywhere",
                                "0*x",
                                {"singular", 1},
                                {"linear", 1},
                                {"singular", 1},
                                {"singular", 1},
                                completed}};
  for (const Misbehaviour& row : rows) {
    CAPTURE(row.what);
    scratch.write("s.toml", study_of(row.rate));
    const auto ask = [&](const char* command, int exit_code) {
      const Ran ran = run(scratch, fmt::format("{} s.toml -f json", command));
      CAPTURE(command);
      CAPTURE(ran.err);
      CHECK(ran.signal == -1);
      CHECK(ran.exit_code == exit_code);
      return json::parse(ran.out);
    };
    CHECK(ask("trim", row.trim.exit_code)["conditions"][0]["status"] == row.trim.status);
    const json c = ask("linearize", row.linearize.exit_code)["conditions"][0];
    CHECK((c.contains("linear") && !c["linear"].is_null() ? c["linear"]["status"] : c["status"]) ==
          row.linearize.status);
    const json b = ask("follow", row.follow.exit_code)["branches"][0];
    if (!row.follow.status.empty()) CHECK(b["end"] == row.follow.status);
    CHECK(ask("sweep", row.sweep.exit_code)["points"][2]["status"] == row.sweep.status);
    CHECK(ask("simulate", row.simulate.exit_code)["status"] == row.simulate.status);
  }
}

TEST_CASE("a line without any trim is not called stable") {
  const Scratch scratch("own-nowhere");
  scratch.write("s.toml", study_of("x^2 + p"));
  const Ran ran = run(scratch, "sweep s.toml");
  CHECK(ran.exit_code == 1);
  CHECK(says(ran.out, "no trim or undecided throughout [1, 2]"));
  CHECK(!says(ran.out, "stable on"));
}

TEST_CASE("a motion that ends early says why, and its samples up to there are written") {
  const Scratch scratch("own-ends");
  scratch.write("s.toml",
                "[model]\nstate = [{name = \"x\", rate = \"x^2 - 1\"}]\n"
                "[[condition]]\nname = \"a\"\nguess = {x = 1.2}\nx = [0.5, 2]\n"
                "[simulate]\nduration = 10\n[simulate.offset]\nx = 1\n");
  const Ran ran = run(scratch, "simulate s.toml -f json --samples s.csv");
  CHECK(ran.exit_code == 1);
  const json s = json::parse(ran.out);
  CHECK(s["status"] == "diverged");
  CHECK(says(s["message"], "x is "));
  // x = coth(c - t), coth c = 2: without bound at c.
  const double c = std::log(3.0) / 2;
  CHECK_NEAR(s["samples"]["time"].back().get<double>(), c, 1e-6);
  CHECK(csv_of(slurp(scratch.path / "s.csv")).size() == s["samples"]["time"].size() + 1);
}

TEST_CASE("a long sweep of formulas is stopped cleanly, and goes on to the same bytes") {
  const Scratch scratch("own-interrupted");
  const int count = sanitized ? 60 : 250;
  scratch.write("s.toml",
                "[model]\nstate = [{name = \"x\", rate = \"p - x - x^3 + q*y\"}, "
                "{name = \"y\", rate = \"-x - y\"}]\n"
                "parameter = [{name = \"p\", value = 1}, {name = \"q\", value = 1}]\n"
                "[[condition]]\nname = \"a\"\n" +
                    fmt::format("[[sweep.axis]]\nkey = \"p\"\nfrom = -5\nto = 5\ncount = {0}\n"
                                "[[sweep.axis]]\nkey = \"q\"\nfrom = 0\nto = 5\ncount = {0}\n",
                                count));
  const std::string command = "sweep s.toml -o map.nc --threads 1 --checkpoint 0";
  const Running sweep = start(scratch, command);
  CHECK(holds_soon([&] { return records_in(scratch.path / "map.nc.log") > 1000; }));
  ::kill(sweep.pid, SIGINT);
  const Ran ran = finish(sweep);
  CHECK(ran.exit_code == 128 + SIGINT);
  CHECK(ran.out.empty());
  CHECK(says(ran.err, "tiltrim: stopped; finished lines are in map.nc.log"));
  CHECK(scratch.files() == std::set<std::string>{"map.nc.log", "s.toml"});
  CHECK(run(scratch, command).exit_code == 0);
  const std::string resumed = slurp(scratch.path / "map.nc");
  CHECK(run(scratch, "sweep s.toml -o whole.nc").exit_code == 0);
  CHECK(resumed == slurp(scratch.path / "whole.nc"));
}

TEST_CASE("a study limits the time of each trim: status, words and exit code") {
  const Scratch scratch("user_model");
  scratch.write("s.toml",
                "time_limit = 1e-6\n" + slurp(TILTRIM_SOURCE_DIR "/studies/levitation.toml"));
  const Ran text = run(scratch, "trim s.toml");
  CHECK(text.exit_code == 1);
  CHECK(says(text.out, "time_limit"));
  CHECK(says(text.out, "the model exceeded the time limit of 1e-06 s: "));
  const json trimmed = json::parse(run(scratch, "trim s.toml -f json").out)["conditions"][0];
  CHECK(trimmed["status"] == "time_limit");
  for (const char* const command :
       {"linearize", "follow", "sensitivities", "margins", "simulate"}) {
    CAPTURE(command);
    const Ran ran = run(scratch, fmt::format("{} s.toml", command));
    CHECK(ran.exit_code == 1);
    CHECK(says(ran.out, "the model exceeded the time limit of"));
  }
  const Ran swept = run(scratch, "sweep s.toml");
  CHECK(swept.exit_code == 1);
  CHECK(says(swept.out, " x the model exceeded the time limit of 1e-06 s"));
}

TEST_CASE("sensitivities: what has a kink has neither number nor direction") {
  const Scratch scratch("kink");
  const auto study = [](const std::string& rate, double a) {
    return fmt::format(
        "[model]\nname = \"m\"\n[[model.state]]\nname = \"x\"\nrate = \"{}\"\n"
        "[[model.parameter]]\nname = \"a\"\nvalue = {:.1f}\n[[condition]]\nname = \"here\"\n",
        rate, a);
  };
  const auto check = [&](int exit_code, const std::string& words) {
    const Ran ran = run(scratch, "sensitivities m.toml");
    CHECK(ran.exit_code == exit_code);
    CHECK(says(ran.out, words));
    for (const char* wrong : {"nan", "larger", "smaller"}) CHECK_FALSE(says(ran.out, wrong));
  };
  scratch.write("m.toml", study("-x*max(1, 2*a - 1)", 1));
  check(0, "x along a");
  scratch.write("m.toml", study("-x*(1 + sqrt(a))", 0));
  check(1, "here: singular");
}

}  // namespace user_model_cli_test
