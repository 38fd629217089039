// The program as a user runs it: commands, files, exit codes.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/check.hpp"

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

// A folder of this process's own, emptied when the test ends.
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
  const std::string command = std::string(TILTRIM_PROGRAM) + " " + arguments + " >" + out.string() +
                              " 2>" + err.string() + " </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(out), slurp(err)};
}

const std::string studies = std::string(TILTRIM_SOURCE_DIR) + "/studies/";

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
  CHECK(std::distance(fs::directory_iterator(scratch.path), {}) == 3);  // no debris beside it
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
  refused("trim " + good + " --format xml", "text");
  refused("linearize " + good + " --inputs Vv", "Vv");
  refused("trimm " + good, "did you mean 'trim'");
  refused("", "no command");
  refused("trim", "study");
  refused("trim " + good + " --sarts 3", "--sarts");
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
  CHECK(tiltrim(scratch, "tables").out.find("Table 3") != std::string::npos);
  CHECK(tiltrim(scratch, "tables -f csv").out.starts_with("table,quantity,column,"));
}

// One-digit magnitudes of round-off ("3e-15") differ between compilers; the rest may not.
static std::string without_round_off(const std::string& text) {
  return std::regex_replace(text, std::regex("[0-9]e-[0-9]+"), "#e-##");
}

TEST_CASE("README shows what the program prints") {
  const Scratch scratch;
  const Ran ran = tiltrim(scratch, "linearize " + studies + "paper.toml");
  std::istringstream readme(slurp(std::string(TILTRIM_SOURCE_DIR) + "/README.md"));
  std::string shown;
  bool inside = false;
  for (std::string line; std::getline(readme, line);) {
    if (inside && !line.empty() && !line.starts_with("    ")) break;
    if (inside) shown += (line.empty() ? line : line.substr(4)) + "\n";
    inside = inside || line == "    $ build/bin/tiltrim linearize studies/paper.toml";
  }
  CHECK(without_round_off(shown) == without_round_off(ran.out) + "\n");
}

TEST_CASE("help teaches, on every level") {
  const Scratch scratch;
  for (const char* arguments : {"--help", "trim --help", "linearize --help", "tables --help"}) {
    const Ran ran = tiltrim(scratch, arguments);
    CHECK(ran.exit_code == 0);
    CHECK(ran.out.find("study") != std::string::npos);
    CHECK(ran.err.empty());
  }
}
