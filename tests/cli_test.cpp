// The program as a user runs it: commands, files, exit codes.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/check.hpp"

namespace cli_test {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Ran {
  int exit_code;
  std::string out, err;
};

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A temporary folder of this process, removed when the test ends.
struct Scratch {
  fs::path path = fs::temp_directory_path() / ("tiltrim-cli-" + std::to_string(::getpid()));
  Scratch() { fs::create_directories(path); }
  ~Scratch() { fs::remove_all(path); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
    return path / name;
  }
};

Ran tiltrim(const Scratch& scratch, const std::string& arguments) {
  const fs::path out = scratch.path / "stdout", err = scratch.path / "stderr";
  const std::string command = "cd " + scratch.path.string() + " && " + TILTRIM_PROGRAM + " " +
                              arguments + " >" + out.string() + " 2>" + err.string() +
                              " </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(out), slurp(err)};
}

json json_of(const Scratch& scratch, const std::string& arguments) {
  return json::parse(tiltrim(scratch, arguments + " -f json").out);
}

const std::string studies = std::string(TILTRIM_SOURCE_DIR) + "/studies/";

std::string condition(double V, double gamma_deg, double eta_deg) {
  return fmt::format("[[condition]]\nname = \"a\"\nV = {}\ngamma_deg = {}\neta_deg = {}\n", V,
                     gamma_deg, eta_deg);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

TEST_CASE("trim and linearize answer the paper's three conditions, to the contract") {
  const Scratch scratch;
  const json reference =
      json::parse(slurp(std::string(TILTRIM_SOURCE_DIR) + "/data/reference_cases.json"));
  const Ran ran = tiltrim(scratch, "linearize " + studies + "paper.toml --format json");
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  const json got = json::parse(ran.out);
  REQUIRE(got["conditions"].size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const json &c = got["conditions"][i], &r = reference["cases"][i];
    CAPTURE(c["name"].get<std::string>());
    CHECK(c["name"] == r["condition"]["name"]);
    CHECK(c["status"] == "converged");
    CHECK(c["verdict"] == "stable");
    CHECK(c["message"] == "");
    CHECK(c["limits_active"].empty());
    CHECK(c["residual"].get<double>() <= 1e-11);
    for (const auto& [name, value] : r["input"].items())
      CHECK_NEAR(c["input"][name].get<double>(), value.get<double>(), 1e-8);
    CHECK_NEAR(c["state"]["theta"].get<double>(), r["state"]["theta"].get<double>(), 1e-8);
    REQUIRE(c["modes"].size() == r["eigenvalues"].size());
    double largest = 0;
    for (const auto& row : r["A"])
      for (const auto& entry : row) largest = std::max(largest, std::abs(entry.get<double>()));
    for (std::size_t j = 0; j < 6; ++j) {
      CHECK_NEAR(c["modes"][j]["re"].get<double>(), r["eigenvalues"][j][0].get<double>(), 1e-7);
      CHECK_NEAR(c["modes"][j]["im"].get<double>(), r["eigenvalues"][j][1].get<double>(), 1e-7);
      for (std::size_t k = 0; k < 6; ++k) {
        const double expected = r["A"][j][k].get<double>();
        CHECK_NEAR(c["linear"]["A"][j][k].get<double>(), expected, 1e-11 * largest);
        CHECK_NEAR(c["linear"]["A_differences"][j][k].get<double>(), expected, 1e-7 * largest);
        CHECK(c["linear"]["A_error"][j][k].get<double>() >= 0);
      }
    }
  }
}

TEST_CASE("text, CSV and JSON say the same; output goes to a file whole; same input, same bytes") {
  const Scratch scratch;
  const Ran text = tiltrim(scratch, "trim " + studies + "paper.toml");
  CHECK(text.exit_code == 0);
  CHECK(text.out.find("converged") != std::string::npos);
  CHECK(text.out.find("\033[") == std::string::npos);  // no colour in a pipe
  const Ran csv = tiltrim(scratch, "trim " + studies + "paper.toml -f csv");
  const json j = json::parse(tiltrim(scratch, "trim " + studies + "paper.toml -f json").out);
  std::istringstream lines(csv.out);
  std::string line;
  std::getline(lines, line);
  CHECK(line ==
        "name,V,gamma_deg,eta_deg,theta_deg,alpha_deg,theta0,a1s_deg,delta_e_deg,residual,status");
  for (const json& c : j["conditions"]) {
    REQUIRE(std::getline(lines, line));
    std::vector<std::string> cells;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    REQUIRE(cells.size() == 11);
    CHECK(cells[0] == c["name"]);
    CHECK(std::stod(cells[6]) == c["input"]["theta0"].get<double>());
  }
  const fs::path file = scratch.path / "out.json";
  CHECK(tiltrim(scratch, "linearize " + studies + "paper.toml -f json -o " + file.string())
            .exit_code == 0);
  const std::string first = slurp(file);
  CHECK(first == tiltrim(scratch, "linearize " + studies + "paper.toml -f json").out);
  CHECK(std::distance(fs::directory_iterator(scratch.path), {}) == 3);  // no temporary files left
}

TEST_CASE(
    "a condition without equilibrium: exit 1, the others are still answered, no false numbers") {
  const Scratch scratch;
  const fs::path study =
      scratch.write("s.toml",
                    "[aircraft]\npitch_scale = 1.0\nwake_immersion = 1.0\n"
                    "[[condition]]\nname = \"climb\"\nV = 2.0\ngamma_deg = 90\neta_deg = 90\n"
                    "[[condition]]\nname = \"level\"\nV = 15\ngamma_deg = 0\neta_deg = 0\n");
  const Ran ran = tiltrim(scratch, "linearize " + study.string() + " -f json");
  CHECK(ran.exit_code == 1);
  const json j = json::parse(ran.out);
  CHECK(j["conditions"][0]["status"] == "infeasible");
  CHECK(j["conditions"][0]["state"].is_null());
  CHECK(j["conditions"][0]["input"].is_null());
  CHECK(j["conditions"][0]["message"].get<std::string>().find("theta0") != std::string::npos);
  CHECK_FALSE(j["conditions"][0].contains("modes"));
  CHECK(j["conditions"][1]["status"] == "converged");
  CHECK(j["conditions"][1].contains("modes"));
  CHECK_FALSE(j["conditions"][1].contains("diagnosis"));

  // The reasons, and the limits that would have to be relaxed.
  const json& why = j["conditions"][0]["diagnosis"];
  const auto said = [&](const std::string& words) {
    return std::ranges::any_of(why["words"], [&](const json& line) {
      return line.get<std::string>().find(words) != std::string::npos;
    });
  };
  CHECK(said("theta0 at its lower limit 0"));  // the wake of any thrust adds more download
  CHECK(said("at the thrust limit, theta0 = 1: "));
  CHECK(said(" N down; thrust would have to be "));
  CHECK(said("any V between 0.5 m/s and 60 m/s (proved)"));
  CHECK(said("any eta between 60° and 90° (proved)"));
  CHECK(why["holding"][0]["limit"] == "theta0 lower");
  for (const json& held : why["holding"]) CHECK(held["pull"].get<double>() < 0);
  const auto remedy = [&](const std::string& kind, const std::string& signal) {
    for (const json& one : why["remedies"])
      if (one["kind"] == kind && one["signal"] == signal) return one;
    return json();
  };
  CHECK(remedy("lever", "V")["status"] == "infeasible");
  CHECK(remedy("lever", "V")["to"].is_null());
  CHECK(remedy("lever", "V")["searched"] == json({0.5, 60.0}));
  CHECK(remedy("limit", "theta0")["helps"] == false);
  CHECK(remedy("equation", "q")["kind"] == "equation");
  // With wake immersion reduced to the reported value, an equilibrium exists.
  const json wake = remedy("lever", "aircraft.wake_immersion");
  REQUIRE(wake["helps"] == true);
  const fs::path less =
      scratch.write("less.toml", fmt::format("aircraft.pitch_scale = 1.0\n"
                                             "aircraft.wake_immersion = {:.17g}\n",
                                             wake["to"].get<double>()) +
                                     condition(2, 90, 90));
  CHECK(tiltrim(scratch, "trim " + less.string()).exit_code == 0);
}

// The branch's speeds, each confirmed by an optimiser or a plain trim, independent of continuation.
TEST_CASE("follow: level flight through the stall, to the contract; its speeds by another road") {
  const Scratch scratch;
  const std::string level = "follow " + studies + "stall.toml --only level";
  const Ran ran = tiltrim(scratch, level + " -f json");
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  const json all = json::parse(ran.out);
  REQUIRE(all["branches"].size() == 1);
  const json& branch = all["branches"][0];
  CHECK(branch["condition"] == "level");
  CHECK(branch["parameter"] == "V");
  CHECK(branch["end"] == "limit");
  for (const char* list : {"points", "events"})
    for (const json& at : branch[list]) {
      CHECK(at["V"].is_number());
      CHECK(at["state"]["theta"].is_number());
      for (const char* input : {"theta0", "a1s", "delta_e"}) CHECK(at["input"][input].is_number());
      CHECK_NEAR(at["output"]["airspeed"].get<double>(), at["V"].get<double>(), 1e-9);
      CHECK(at["residual"].get<double>() <= 1e-10);
      CHECK(at["input"]["delta_e"].get<double>() >= -0.53 - 1e-9);
    }
  CHECK(branch["points"][0]["V"] == 20.0);
  std::string kinds;
  for (const json& event : branch["events"]) kinds += event["kind"].get<std::string>() + " ";
  CHECK(kinds == "hopf fold hopf fold hopf limit end ");
  const json& events = branch["events"];
  CHECK(events[5]["which"] == "delta_e lower");
  CHECK(events[6]["which"] == branch["message"]);
  CHECK(events[6]["after"] == branch["points"].size());

  const std::string head = "formulation = \"airframe\"\neta_deg = 0.0\na1s_deg = 0.0\n";
  const fs::path road = scratch.write(
      "road.toml",
      "[[condition]]\nname = \"slowest in front of the stall\"\n" + head +
          "V = [8.0, 12.0]\ntheta_deg = [0.0, 14.0]\nobjective = [{ signal = \"V\" }]\n" +
          "[[condition]]\nname = \"fastest behind it\"\n" + head +
          "V = [9.0, 12.0]\ntheta_deg = [14.0, 25.0]\n"
          "objective = [{ signal = \"V\", reference = 20.0 }]\n" +
          "[[condition]]\nname = \"elevator at its limit\"\n" + head +
          fmt::format("V = [5.0, 9.0]\ntheta_deg = [20.0, 60.0]\ndelta_e_deg = {:.17g}\n",
                      -0.53 * 180 / std::numbers::pi));
  const json conditions = json_of(scratch, "trim " + road.string())["conditions"];
  const std::size_t place[]{1, 3, 5};
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(conditions[i]["name"].get<std::string>());
    REQUIRE(conditions[i]["status"] == "converged");
    CHECK_NEAR(events[place[i]]["V"].get<double>(), conditions[i]["state"]["V"].get<double>(),
               1e-8);
  }

  // Either side of the first crossing: stable, unstable.
  for (const double side : {1.0, -1.0}) {
    const fs::path beside = scratch.write(
        "beside.toml", condition(events[0]["V"].get<double>() + side * 1e-5, 0.0, 0.0));
    CHECK(json_of(scratch, "linearize " + beside.string())["conditions"][0]["verdict"] ==
          (side > 0 ? "stable" : "unstable"));
  }
  CHECK_NEAR(events[0]["eigenvalue"]["re"].get<double>(), 0.0, 1e-9);
  CHECK(events[0]["eigenvalue"]["im"].get<double>() > 0.1);
}

TEST_CASE("follow: text, CSV and JSON say the same; same input, same bytes") {
  const Scratch scratch;
  const std::string follow = "follow " + studies + "stall.toml";
  const Ran text = tiltrim(scratch, follow), csv = tiltrim(scratch, follow + " -f csv"),
            first = tiltrim(scratch, follow + " -f json");
  for (const Ran* ran : {&text, &csv, &first}) {
    CHECK(ran->exit_code == 0);
    CHECK(ran->err.empty());
  }
  for (const char* words : {"level: V from 20 towards 5 m/s: limit", "the branch turns back",
                            "delta_e lower limit", "i crosses: ", "descent beyond the stall: V"})
    CHECK(text.out.find(words) != std::string::npos);
  CHECK(first.out == tiltrim(scratch, follow + " -f json").out);
  CHECK(tiltrim(scratch, follow + " -f csv -o out.csv").exit_code == 0);
  CHECK(slurp(scratch.path / "out.csv") == csv.out);

  const std::vector<std::string> lines = lines_of(csv.out);
  CHECK(lines.at(0) ==
        "name,kind,V,gamma_deg,eta_deg,theta_deg,alpha_deg,theta0,a1s_deg,delta_e_deg,unstable,"
        "eigenvalue_re,eigenvalue_im,residual,which");
  std::size_t row = 1;
  const json all = json::parse(first.out);
  for (const json& branch : all["branches"]) {
    const std::size_t points = branch["points"].size(), events = branch["events"].size();
    REQUIRE(lines.size() >= row + points + events);
    CHECK(cells_of(lines[row])[1] == "start");
    CHECK(cells_of(lines[row + points + events - 1])[1] == "end");
    for (const json& event : branch["events"]) {
      // In branch order: the number of points and events before it.
      const auto at =
          row + event["after"].get<std::size_t>() + std::size_t(&event - &branch["events"][0]);
      const std::vector<std::string> cells = cells_of(lines[at]);
      CHECK(cells[0] == branch["condition"]);
      CHECK(cells[1] == event["kind"]);
      CHECK(std::stod(cells[2]) == event["V"].get<double>());
      CHECK(std::stod(cells[7]) == event["input"]["theta0"].get<double>());
    }
    row += points + events;
  }
  CHECK(row == lines.size());
}

TEST_CASE("follow: any number of the study; both ends of the descent; no trim to start from") {
  const Scratch scratch;
  const json up = json_of(scratch, "follow " + studies +
                                       "stall.toml --only 'descent beyond the stall' "
                                       "--parameter V --to 20")["branches"][0];
  CHECK(up["to"] == 20.0);
  CHECK(up["events"].back()["kind"] == "end");
  CHECK(up["events"][up["events"].size() - 2]["which"] == "theta0 lower");
  CHECK_NEAR(up["events"].back()["V"].get<double>(), 9.7555, printed_to("9.7555"));

  const std::string paper = "follow " + studies + "paper.toml ";
  for (const auto& [key, to] :
       {std::pair{"gamma_deg", 10.0}, {"aircraft.mass", 4.5}, {"gains.K_Lp", 1.0}}) {
    const std::string captured = key;  // clang 14 captures no structured binding
    CAPTURE(captured);
    const json all = json_of(scratch, fmt::format("{} --parameter {} --to {}", paper, key, to));
    for (const json& branch : all["branches"]) {
      CHECK(branch["parameter"] == key);
      CHECK(branch["end"] == "reached");
      CHECK_NEAR(branch["events"].back()[key].get<double>(), to, 1e-9);
    }
  }
  const json tilted =
      json_of(scratch, paper + "--only climb --parameter eta_deg --to 0")["branches"][0];
  CHECK(tilted["end"] == "switched");
  CHECK_NEAR(tilted["events"].back()["eta_deg"].get<double>(), 60.0, 1e-3);
  const Ran few = tiltrim(scratch, paper + "--parameter V --to 1 --max-points 3");
  CHECK(few.exit_code == 1);
  CHECK(few.out.find("stopped after 3 points") != std::string::npos);

  const fs::path none = scratch.write(
      "none.toml", "[follow]\nparameter = \"V\"\nto = 5\n" + condition(20, -5, 0) +
                       "[[condition]]\nname = \"b\"\nV = 15\ngamma_deg = 0\neta_deg = 0\n");
  const Ran ran = tiltrim(scratch, "follow " + none.string() + " -f json");
  CHECK(ran.exit_code == 1);
  const json branches = json::parse(ran.out)["branches"];
  CHECK(branches[0]["end"] == "no_start");
  CHECK(branches[0]["points"].empty());
  REQUIRE(branches[0]["events"].size() == 1);
  CHECK(branches[0]["events"][0]["kind"] == "end");
  CHECK(branches[0]["events"][0]["state"].is_null());
  CHECK(branches[0]["message"].get<std::string>().find("theta0") != std::string::npos);
  CHECK(branches[1]["end"] == "limit");
  CHECK(tiltrim(scratch, "follow " + none.string()).out.find("no trim to start from") !=
        std::string::npos);
}

TEST_CASE("envelope: its rows end where branches do; CSV and JSON") {
  const Scratch scratch;
  const std::string level = "envelope " + studies + "stall.toml --only level --count 20";
  const Ran ran = tiltrim(scratch, level + " -f json");
  CHECK(ran.exit_code == 0);
  CHECK(ran.out == tiltrim(scratch, level + " -f json").out);
  const json e = json::parse(ran.out)["envelopes"][0];
  CHECK(e["condition"] == "level");
  CHECK(e["over"] == "eta_deg");
  REQUIRE(e["parts"].size() == 2);  // below the handover and from it on
  const json& row = e["parts"][0]["rows"][0];
  CHECK(row["eta_deg"] == 0.0);
  REQUIRE(row["intervals"].size() == 1);
  const json& interval = row["intervals"][0];
  CHECK(interval["from"]["which"] == "delta_e lower");
  CHECK(interval["to"] == json{{"V", 30.0}, {"which", "edge"}});
  const json followed =
      json_of(scratch, "follow " + studies + "stall.toml --only level")["branches"][0];
  CHECK_NEAR(interval["from"]["V"].get<double>(), followed["events"].back()["V"].get<double>(),
             1e-8);
  std::size_t points = 0;
  for (const json& part : e["parts"]) {
    CHECK(part["status"] == "complete");
    CHECK(part["count"].size() == 20);
    for (const json& piece : part["pieces"])
      for (const json& at : piece["points"]) {
        ++points;
        CHECK(at["residual"].get<double>() <= 1e-9);
        if (piece["which"] == "delta_e lower")
          CHECK_NEAR(at["input"]["delta_e"].get<double>(), -0.53, 1e-9);
      }
  }
  const Ran csv = tiltrim(scratch, level + " -f csv");
  CHECK(csv.out.starts_with("name,piece,stopped_by,V,eta_deg,theta_deg,theta0,"));
  CHECK(lines_of(csv.out).size() == points + 1);

  // The study's request, then the command line's.
  const fs::path study = scratch.write(
      "s.toml", "[envelope]\nover = \"gamma_deg\"\nV = [9, 12]\ngamma_deg = [0, 15]\ncount = 8\n" +
                    condition(10, 0, 0));
  const json path = json_of(scratch, "envelope " + study.string())["envelopes"][0];
  CHECK(path["over"] == "gamma_deg");
  REQUIRE(path["parts"].size() == 1);
  CHECK(path["parts"][0]["V"] == json({9.0, 12.0}));
  CHECK(path["parts"][0]["count"].size() == 8);
  CHECK(path["parts"][0]["rows"].size() == 3);  // 0, 10, 15 degrees
  const json tilt = json_of(scratch, "envelope " + study.string() + " --over eta_deg --count 5");
  CHECK(tilt["envelopes"][0]["over"] == "eta_deg");
}

TEST_CASE("envelope: any number of threads gives the same; the first condition in error is named") {
  const Scratch scratch;
  std::string all =
      "[envelope]\nover = \"gamma_deg\"\nV = [9, 12]\ngamma_deg = [0, 15]\ncount = 6\n";
  for (const int V : {10, 11, 12})
    all += std::regex_replace(condition(V, 0, 0), std::regex("\"a\""), fmt::format("\"{}\"", V));
  const std::string command = "envelope " + scratch.write("s.toml", all).string() + " -f csv ";
  const Ran alone = tiltrim(scratch, command + "--threads 1");
  CHECK(alone.exit_code == 0);
  CHECK(tiltrim(scratch, command + "--threads 3").out == alone.out);
  for (const char* threads : {"1", "3"}) {
    const Ran ran = tiltrim(scratch, "envelope " + studies + "printed.toml --threads " + threads);
    CHECK(ran.exit_code == 2);
    CHECK(ran.err.find("condition 'Table 3, climb'") != std::string::npos);
  }
}

TEST_CASE("sensitivities: as differences of trims and of eigenvalues") {
  const Scratch scratch;
  const std::string level = "sensitivities " + studies + "paper.toml --only level";
  const Ran ran = tiltrim(scratch, level + " --parameters V,gains.K_Lp -f json");
  CHECK(ran.exit_code == 0);
  const json c = json::parse(ran.out)["conditions"][0];
  CHECK(c["name"] == "level");
  CHECK(c["status"] == "converged");
  CHECK(c["sensitivities"] == "found");
  REQUIRE(c["parameters"].size() == 2);
  const json& V = c["parameters"][0];
  CHECK(V["parameter"] == "V");
  CHECK(V["value"] == 15.0);
  CHECK(V["unit"] == "m/s");
  REQUIRE(V["modes"].size() == c["modes"].size());
  constexpr double h = 1e-3;  // m/s: the truncation error is h² times a third derivative, near 1e-8
  json side[2];
  for (const int up : {0, 1}) {
    const fs::path study = scratch.write("h.toml", condition(15 + (up ? h : -h), 0, 0));
    side[up] = json_of(scratch, "linearize " + study.string())["conditions"][0];
  }
  const auto slope = [&](const json::json_pointer& at) {
    return (side[1][at].get<double>() - side[0][at].get<double>()) / (2 * h);
  };
  CHECK_NEAR(V["state"]["theta"].get<double>(), slope("/state/theta"_json_pointer), 1e-8);
  CHECK_NEAR(V["input"]["theta0"].get<double>(), slope("/input/theta0"_json_pointer), 1e-8);
  CHECK_NEAR(V["input"]["delta_e"].get<double>(), slope("/input/delta_e"_json_pointer), 1e-8);
  for (std::size_t i = 0; i < c["modes"].size(); ++i)
    for (const char* part : {"re", "im"})
      CHECK_NEAR(V["modes"][i][part].get<double>(),
                 slope(json::json_pointer(fmt::format("/modes/{}/{}", i, part))), 1e-5);
  // A gain of the law does not change attitude and inputs.
  CHECK_NEAR(c["parameters"][1]["state"]["theta"].get<double>(), 0.0, 1e-12);

  const Ran text = tiltrim(scratch, level + " --most 2");
  CHECK(text.exit_code == 0);
  CHECK(text.out.find("better damped") != std::string::npos);
  const Ran csv = tiltrim(scratch, level + " -f csv");
  CHECK(csv.out.starts_with("name,parameter,value,unit,quantity,derivative\n"));
  // A negative parameter: one percent more is a larger magnitude.
  const Ran negative =
      tiltrim(scratch, "sensitivities " + studies + "airframe.toml --parameters aircraft.CM_q");
  const std::regex row("CM_q +-7 +([+-])[^ ]+ +- +[^ ]+ +(larger|smaller)");
  int rows = 0;
  for (std::sregex_iterator r(negative.out.begin(), negative.out.end(), row), end; r != end; ++r) {
    CHECK(((*r)[1] == "+") == ((*r)[2] == "larger"));
    ++rows;
  }
  CHECK(rows >= 4);
  const fs::path none = scratch.write("none.toml", condition(20, -5, 0));
  const Ran untrimmed = tiltrim(scratch, "sensitivities " + none.string() + " -f json");
  CHECK(untrimmed.exit_code == 1);
  CHECK(json::parse(untrimmed.out)["conditions"][0]["sensitivities"] == "not_trim");
}

TEST_CASE("trim --all: three trims of one speed near the stall, on one branch") {
  const Scratch scratch;
  const fs::path study = scratch.write("near.toml", condition(9.5, 0, 0));
  const std::string trim = "trim " + study.string();
  CHECK_FALSE(json_of(scratch, trim)["conditions"][0].contains("equilibria"));
  const Ran ran = tiltrim(scratch, trim + " --all -f json");
  CHECK(ran.exit_code == 0);
  const json all = json::parse(ran.out)["conditions"][0]["equilibria"];
  CHECK(all["starts"] == 201);
  CHECK(all["branches"].get<int>() > 0);
  const std::vector<std::string> verdicts{"stable", "unstable", "stable"};
  REQUIRE(all["found"].size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const json& one = all["found"][i];
    CHECK(one["status"] == "converged");
    CHECK(one["residual"].get<double>() <= 1e-10);
    CHECK(one["verdict"] == verdicts[i]);
    if (i > 0) CHECK(one["effort"] >= all["found"][i - 1]["effort"]);
  }
  // Without random starts the branches find the same.
  const json led = json_of(scratch, trim + " --all --starts 0")["conditions"][0]["equilibria"];
  REQUIRE(led["found"].size() == 3);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK_NEAR(led["found"][i]["state"]["theta"].get<double>(),
               all["found"][i]["state"]["theta"].get<double>(), 1e-8);
  CHECK(led["found"][1]["found"].get<std::string>().find("branch") != std::string::npos);
  CHECK(tiltrim(scratch, trim + " --all").out.find("3 equilibria found from") != std::string::npos);
  CHECK(lines_of(tiltrim(scratch, trim + " --all -f csv").out).size() == 4);
}

TEST_CASE("bad input: exit 2, one line that says what and where, nothing written") {
  const Scratch scratch;
  const std::string condition = "[[condition]]\nname = \"a\"\nV = 15\ngamma_deg = 0\neta_deg = 0\n";
  const std::string polar_head = "alpha_deg,CL,CD,CM\n";
  scratch.write("unsorted.csv", polar_head + "-180,0,1,0\n90,0,1,0\n0,0,1,0\n180,0,1,0\n");
  scratch.write("open.csv", polar_head + "-180,0,1,0\n-90,0,1,0\n0,0,1,0\n180,0,2,0\n");
  scratch.write("short.csv", polar_head + "-180,0,1,0\n180,0,1,0\n");
  std::string garbage(10'000'000, '\0');
  for (std::size_t i = 0; i < garbage.size(); ++i) garbage[i] = char((i * 2654435761u) >> 11);
  struct Bad {
    const char* name;
    std::string text;
    std::vector<std::string> said;
  };
  const std::vector<Bad> cases{
      {"misspelt key", "[gains]\nk_v = 10.0\n" + condition, {"s.toml:2", "k_v", "k_V"}},
      {"wrong type", "[aircraft]\nmass = \"heavy\"\n" + condition, {"s.toml:2", "mass"}},
      {"not a number", "[aircraft]\nmass = nan\n" + condition, {"s.toml:2", "mass"}},
      {"negative mass", "[aircraft]\nmass = -4.0\n" + condition, {"s.toml:2", "mass"}},
      {"missing polar", "[aircraft]\npolar = \"none.csv\"\n" + condition, {"s.toml:2", "none.csv"}},
      {"polar not periodic",
       "[aircraft]\npolar = \"open.csv\"\n" + condition,
       {"s.toml:2", "periodic"}},
      {"polar unsorted",
       "[aircraft]\npolar = \"unsorted.csv\"\n" + condition,
       {"s.toml:2", "unsorted.csv:4"}},
      {"polar of two rows",
       "[aircraft]\npolar = \"short.csv\"\n" + condition,
       {"s.toml:2", "4 rows"}},
      {"empty file", "", {"s.toml", "condition"}},
      {"garbage", garbage, {"s.toml"}},
      {"no condition", "[aircraft]\nmass = 4.0\n", {"s.toml", "condition"}},
      {"two of one name", condition + condition, {"s.toml:7", "name"}},
      {"not enough free",
       "[[condition]]\nname = \"a\"\nformulation = \"airframe\"\nV = 15\neta_deg = 0\ntheta_deg = "
       "0\n"
       "theta0 = 0.5\na1s_deg = 0\n",
       {"s.toml", "'a'", "free"}},
  };
  for (const Bad& bad : cases) {
    CAPTURE(bad.name);
    const fs::path study = scratch.write("s.toml", bad.text), out = scratch.path / "out";
    for (const char* verb : {"trim ", "linearize "}) {
      const Ran ran = tiltrim(scratch, verb + study.string() + " -o " + out.string());
      CHECK(ran.exit_code == 2);
      CHECK(ran.out.empty());
      CHECK_FALSE(fs::exists(out));
      CHECK(ran.err.starts_with("tiltrim: "));
      CHECK(std::ranges::count(ran.err, '\n') == 1);
      for (const std::string& words : bad.said) {
        CAPTURE(words);
        CAPTURE(ran.err);
        CHECK(ran.err.find(words) != std::string::npos);
      }
    }
  }
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    CAPTURE(arguments);
    const Ran ran = tiltrim(scratch, arguments);
    CAPTURE(ran.err);
    CHECK(ran.exit_code == 2);
    CHECK(ran.err.find(words) != std::string::npos);
  };
  const std::string good = scratch.write("good.toml", condition).string();
  refused("trim " + scratch.path.string() + "/nowhere.toml", "nowhere.toml");
  refused("trim " + scratch.path.string(), "directory");
  refused("trim " + good + " -o " + scratch.path.string(), "directory");
  refused("trim " + good + " -o " + scratch.path.string() + "/none/out", "none");
  refused("trim " + good + " --only b", "there are: a");
  refused("trim " + good + " -o ''", "--output: the name of the file is empty");
  refused("trim " + good + " -o a.nc", "-o a.nc: this command writes no .nc; expected .json, .csv");
  refused("trim " + good + " -o a.html", "this command writes no .html");
  refused("sweep " + good + " -o a.html", "this command writes no .html; expected .nc, .json");
  refused("report " + good + " -o a.json", "-o a.json: a report is a page; expected");
  refused("trim " + good + " --starts 3.5", "--starts: 3.5 is not a whole number from 0 to 100000");
  refused("prove " + good + " --boxes 0", "--boxes: 0 is not a whole number from 1 to 100000000");
  refused("prove " + good + " --margin -1", "--margin: -1 is not a number from 0 to 1000");
  refused("linearize " + good + " --inputs V,V",
          "--inputs: 'V' names two inputs; expected each once");
  refused("trim " + good + " --format xml", "--format: no 'xml'; expected csv|json|latex");
  refused("trim " + scratch.path.string() + "/god.toml", "did you mean 'good.toml'?");
  refused("modes " + good, "is a study; expected a matrix");
  refused("linearize " + good + " --inputs Vv", "Vv");
  refused("trimm " + good, "did you mean 'trim'");
  refused("", "no command");
  refused("trim", "STUDY.toml is missing; expected 'tiltrim trim STUDY.toml'");
  refused("merge", "PART.nc... is missing");
  refused("completion", "expected 'tiltrim completion bash|fish|zsh'");
  refused("trim " + good + " --sarts 3", "--sarts");

  const std::string stall = studies + "stall.toml ";
  refused("follow " + good, "no [follow] table");
  refused("follow " + stall + "--only lvel", "nearest: 'level'");
  refused("follow " + stall + "--parameter Vv --to 3",
          "tiltrim: --parameter: 'Vv' is not a number of a study; did you mean 'V'?");
  refused("follow " + stall + "--parameter v --to 3", "did you mean 'V'?");
  refused(
      "sensitivities " + good + " --parameters gains.Klp",
      "tiltrim: --parameters: 'gains.Klp' is not a number of a study; did you mean 'gains.K_Lp'?");
  refused("follow " + stall + "--parameter gamma --to 3", "did you mean 'gamma_deg'?");
  refused("follow " + stall + "--parameter V --to -3", "expected V from 0 to");
  refused("follow " + stall + "--parameter V --to nan", "--to");
  refused("follow " + stall + "--parameter V", "--to");
  refused("follow " + stall + "--to 3", "--parameter");
  refused("follow " + stall + "--parameter V --to 20 --only level", "'level'");
  refused("follow " + stall + "--parameter theta_deg --to 3", "'theta' is free");
  refused("follow " + stall + "--max-step 0", "--max-step");
  refused("follow " + stall + "--max-step nan", "--max-step: nan is not a number from");
  refused("linearize " + good + " --inputs K_Lp",
          "inputs: no signal 'K_Lp' (nearest: 'gains.K_Lp'");
  refused("sensitivities " + good + " --parameters V,V", "'V' is listed twice");
  const std::string table = studies + "printed.toml --only 'Table 3, level'";
  refused("follow " + table + " --parameter V --to 3", "formulation table");
  refused("sensitivities " + table, "formulation table");
  refused("sensitivities " + good + " --parameters V,gains.K_L", "'gains.K_Lp'");
  refused("envelope " + table, "closed_loop");
  refused("envelope " + good + " --over V", "--over");
  refused("envelope " + good + " --count 2", "--count");
}

TEST_CASE(
    "an angle that appears to be in the other unit: a remark on standard error, and an answer") {
  const Scratch scratch;
  scratch.write("s.toml", "[[condition]]\nname = \"a\"\nV = 15\ngamma_deg = 1.5708\neta_deg = 0\n");
  const Ran ran = tiltrim(scratch, "trim s.toml -f json");
  CHECK(ran.exit_code == 0);
  CHECK(
      ran.err ==
      "tiltrim: s.toml:4:13: gamma_deg = 1.5708 is 1.57 degrees; 1.5708 rad would be 90 degrees\n");
  CHECK(json::parse(ran.out)["conditions"][0]["status"] == "converged");
}

TEST_CASE("every shipped study runs; hover trims in body axes") {
  const Scratch scratch;
  const json airframe =
      json::parse(tiltrim(scratch, "trim " + studies + "airframe.toml -f json").out);
  for (const json& c : airframe["conditions"]) {
    CAPTURE(c["message"].get<std::string>());
    CHECK(c["status"] == "converged");
  }
  CHECK(airframe["conditions"][0]["model"] == "airframe, body axes");
  CHECK(tiltrim(scratch, "linearize " + studies + "corridor.toml -f csv").exit_code == 0);
  const Ran printed = tiltrim(scratch, "trim " + studies + "printed.toml -f json");
  const json tables = json::parse(printed.out);
  CHECK(tables["conditions"].back()["status"] == "converged");
}

TEST_CASE("tables: the contract's keys") {
  const Scratch scratch;
  const Ran ran = tiltrim(scratch, "tables --format json");
  CHECK(ran.exit_code == 0);
  const json t = json::parse(ran.out);
  CHECK_NEAR(t["identified"]["thrust_excess"].get<double>(), 1.4, printed_to("1.4000"));
  CHECK_NEAR(t["identified"]["effective_speed"].get<double>(), 2.0146, printed_to("2.0146"));
  for (const char* row : {"theta0", "a1s", "delta_e"}) {
    CHECK(t["table3"][row]["published"].size() == 3);
    CHECK(t["table3"][row]["computed"].size() == 3);
  }
  if (sanitized) return;  // the same again, slowly
  CHECK(tiltrim(scratch, "tables").out.find("Table 3") != std::string::npos);
  CHECK(tiltrim(scratch, "tables -f csv").out.starts_with("table,quantity,column,"));
}

// Round-off magnitudes ("3e-15") differ between compilers; all other digits must agree.
static std::string without_round_off(const std::string& text) {
  return std::regex_replace(text, std::regex("[0-9]e-[0-9]+"), "#e-##");
}

// Steps and evaluations along a curve also differ between compilers.
static std::string comparable(const std::string& text) {
  const std::regex counts("[0-9]+(?=\\s+(verified|evaluations))| +[0-9]+(?=\n)");
  return std::regex_replace(without_round_off(text), counts, "#");
}

namespace {

// Output of a command as printed in a document: "..." stands for any lines.
struct Shown {
  std::string arguments;
  std::vector<std::string> stretches{""};
};

}  // namespace

// Commands after "$ build/bin/tiltrim", and the studies printed with their name, "# my.toml".
static std::vector<Shown> shown_in(const fs::path& document, const Scratch& scratch) {
  const std::string prompt = "    $ build/bin/tiltrim ";
  std::vector<Shown> all;
  std::string study, *into = nullptr;
  bool inside = false;
  for (const std::string& line : lines_of(slurp(document))) {
    if (line == "```toml" || line == "```") {
      into = line == "```" ? nullptr : &study;
      study.clear();
    } else if (into) {
      study += line + "\n";
      if (study.starts_with("# ") && study.find(".toml\n") != study.npos)
        scratch.write(study.substr(2, study.find('\n') - 2), study);
    }
    inside = inside && (line.empty() || line.starts_with("    "));
    if (inside && line == "    ...")
      all.back().stretches.emplace_back();
    else if (inside)
      all.back().stretches.back() += (line.empty() ? line : line.substr(4)) + "\n";
    if (!line.starts_with(prompt)) continue;
    all.push_back({line.substr(prompt.size())});
    inside = true;
  }
  for (Shown& shown : all) shown.stretches.back().pop_back();  // the empty line after it
  return all;
}

// Compares text with text; the other cases test the commands.
TEST_CASE("the documents show what the program prints" * doctest::skip(sanitized)) {
  const Scratch scratch;
  const fs::path source = TILTRIM_SOURCE_DIR;
  fs::create_directory_symlink(source / "studies", scratch.path / "studies");
  std::map<std::string, std::string> ran;  // a study name means the same study in all documents
  std::vector<std::string> documents = {"README.md",       "docs/follow.md",    "docs/trim.md",
                                        "docs/sweep.md",   "docs/linearize.md", "docs/tune.md",
                                        "docs/simulate.md"};
  for (const auto& page : fs::directory_iterator(source / "docs/tutorials"))
    documents.push_back("docs/tutorials/" + page.path().filename().string());
  std::sort(documents.begin(), documents.end());  // a tutorial may use a study of an earlier one
  for (const std::string& document : documents) {
    const std::vector<Shown> all = shown_in(source / document, scratch);
    CHECK(!all.empty());
    for (const Shown& shown : all) {
      CAPTURE(document);
      CAPTURE(shown.arguments);
      std::string& printed = ran[shown.arguments];
      if (printed.empty()) printed = comparable(tiltrim(scratch, shown.arguments).out);
      std::size_t at = 0;
      for (const std::string& stretch : shown.stretches) {
        CAPTURE(stretch);
        const std::size_t found = printed.find(comparable(stretch), at);
        CHECK(found != std::string::npos);
        if (&stretch == &shown.stretches.front()) CHECK(found == 0);
        at = found + comparable(stretch).size();
      }
      if (!shown.stretches.back().empty()) CHECK(at == printed.size());
    }
  }
}

TEST_CASE("help teaches, on every level") {
  const Scratch scratch;
  for (const char* arguments : {"--help", "trim --help", "linearize --help", "follow --help",
                                "envelope --help", "sensitivities --help", "tables --help"}) {
    const Ran ran = tiltrim(scratch, arguments);
    CHECK(ran.exit_code == 0);
    CHECK(ran.out.find("study") != std::string::npos);
    CHECK(ran.err.empty());
  }
  const auto usage = [&](const std::string& command) {
    const std::string text = tiltrim(scratch, command + " --help").out;
    const std::size_t at = text.find("Usage: ");
    return text.substr(at, text.find('\n', at) - at);
  };
  CHECK(usage("trim") == "Usage: tiltrim trim [OPTIONS] STUDY.toml");
  CHECK(usage("diff") == "Usage: tiltrim diff [OPTIONS] BEFORE.nc AFTER.nc");
  CHECK(usage("merge") == "Usage: tiltrim merge [OPTIONS] PART.nc...");
  CHECK(usage("tables") == "Usage: tiltrim tables [OPTIONS] [STUDY.toml]");
}

}  // namespace cli_test
