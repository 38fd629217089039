// `tiltrim simulate` as a user runs it: flights and their files, what it refuses, Monte Carlo
// killed and interrupted.
#include <pty.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <regex>
#include <string>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace simulate_cli_test {

namespace {

using namespace std::chrono_literals;
using nlohmann::json;
namespace fs = std::filesystem;
using program::csv_of;
using program::finish;
using program::holds_soon;
using program::Ran;
using program::records_in;
using program::run;
using program::Running;
using program::Scratch;
using program::size_of;
using program::slurp;
using program::start;
using Names = std::set<std::string>;

bool says(const std::string& text, const std::string& words) {
  INFO(text);
  INFO(words);
  const bool found = text.find(words) != std::string::npos;
  CHECK(found);
  return found;
}

const std::string studies = TILTRIM_SOURCE_DIR "/studies/";

std::string simulate(const std::string& study, const std::string& options) {
  return fmt::format("simulate '{}{}.toml' {}", studies, study, options);
}

// Samples of a flight, with the quantities of the paper's figures.
class Samples {
 public:
  explicit Samples(const json& flight) : all_(flight["samples"]), t_(all_["time"]) {}

  std::vector<double> operator[](const std::string& name) const {
    const std::vector<double> values = all_[name];
    if (!name.ends_with("_deg")) return values;
    std::vector<double> radians;
    for (const double v : values) radians.push_back(v * std::numbers::pi / 180);
    return radians;
  }
  double last(const std::string& name) const { return (*this)[name].back(); }
  double at(const std::string& name, double t) const {
    const auto after = std::ranges::find_if(t_, [&](double s) { return s >= t - 1e-9; });
    REQUIRE(after != t_.end());
    return (*this)[name].at(std::size_t(after - t_.begin()));
  }
  std::vector<double> between(const std::string& name, double from, double to,
                              const std::string& over = "time") const {
    const std::vector<double> values = (*this)[name], where = (*this)[over];
    std::vector<double> chosen;
    for (std::size_t k = 0; k < t_.size(); ++k)
      if (where[k] >= from && where[k] <= to) chosen.push_back(values[k]);
    REQUIRE_FALSE(chosen.empty());
    return chosen;
  }
  double least(const std::string& name, double from, double to) const {
    return std::ranges::min(between(name, from, to));
  }
  double most(const std::string& name, double from, double to) const {
    return std::ranges::max(between(name, from, to));
  }
  double largest(const std::string& name, double from, double to) const {
    return std::max(-least(name, from, to), most(name, from, to));
  }
  double passes(double height) const {
    const std::vector<double> h = (*this)["height"];
    return t_.at(
        std::size_t(std::ranges::find_if(h, [&](double v) { return v >= height; }) - h.begin()));
  }

 private:
  json all_;
  std::vector<double> t_;
};

}  // namespace

// ---- The studies -------------------------------------------------------------------------------

TEST_CASE("the transition: from rest on the ground up at 2 m/s, through the handover, to 15 m/s") {
  const Scratch scratch("simulate");
  const Ran ran = run(scratch, simulate("transition", "-f json"));
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  const json flight = json::parse(ran.out);
  CHECK(flight["status"] == "flown");
  CHECK(flight["start"] == "at rest on the ground");
  const Samples s(flight);
  for (const char* still : {"time", "height", "distance", "theta_deg", "q", "energy_integral"})
    CHECK(s[still].front() == 0.0);
  CHECK(s["V"].front() < 1e-9);
  for (const double rate : s.between("climb_rate", 8, 20, "height")) CHECK_NEAR(rate, 2.0, 0.1);
  CHECK(s.last("time") == 90.0);
  CHECK_NEAR(s.last("V"), 15.0, 0.2);
  for (const char* small : {"gamma_deg", "He", "Le"}) CHECK_NEAR(s.last(small), 0.0, 0.01);
  CHECK(s["elevator_side"].front() == 0.0);
  CHECK(s.last("elevator_side") == 1.0);
}

TEST_CASE("limits reached are events: where a command is beyond its limit, what is used is there") {
  const Scratch scratch("simulate");
  const json flight = json::parse(run(scratch, simulate("transition", "-f json")).out);
  Names touched, limited;
  for (const json& e : flight["events"])
    if (e["kind"] == "limit_reached" || e["kind"] == "limit_left") touched.insert(e["what"]);
  const Samples s(flight);
  for (const auto& [name, used] : {std::pair<std::string, std::string>{"theta0", "theta0"},
                                   {"a1s", "a1s_deg"},
                                   {"delta_e", "delta_e_deg"}}) {
    const std::string asked = std::regex_replace(used, std::regex("_deg$|$"), "_asked$&",
                                                 std::regex_constants::format_first_only);
    const std::vector<double> a = s[asked], u = s[used], elevator = s["elevator_side"];
    for (std::size_t k = 0; k < a.size(); ++k) {
      const bool acts = name == "theta0" || (name == "delta_e") == (elevator[k] > 0);
      if (acts && a[k] > u[k] + 1e-9) limited.insert(name + " upper");
      if (acts && a[k] < u[k] - 1e-9) limited.insert(name + " lower");
    }
  }
  CHECK(touched == limited);
  CHECK(touched == Names{"a1s upper", "delta_e lower", "theta0 upper"});
  says(run(scratch, simulate("transition", "")).out,
       "limits reached: a1s upper, delta_e lower, theta0 upper\n");
}

TEST_CASE("beside the paper's figures: fifteen facts with the numbers of the samples") {
  const Scratch scratch("simulate");
  for (const std::string study : {"transition", "transition_bumpless", "transition_as_drawn"}) {
    const json flight = json::parse(run(scratch, simulate(study, "-f json")).out);
    const Samples s(flight);
    const double twenty = std::min(25.0, s.passes(20));
    const std::vector<std::string> expected{
        fmt::format("up to {:.2f} rad", s.most("theta_deg", 0, 5)),
        fmt::format("{:.2f} to {:.2f} rad from 5 to 25 s", s.least("theta_deg", 5, 25),
                    s.most("theta_deg", 5, 25)),
        fmt::format("from {:.2f} to {:.2f} rad between 25 and 35 s", s.at("theta_deg", 25),
                    s.most("theta_deg", 25, 35)),
        fmt::format("{:.3f} rad at 90 s", s.last("theta_deg")),
        fmt::format("{:.2f} to {:.2f} rad from 5 to 25 s", s.least("gamma_deg", 5, 25),
                    s.most("gamma_deg", 5, 25)),
        fmt::format("{:.4f} rad at 90 s", s.last("gamma_deg")),
        fmt::format("{:.2f} to {:.2f} m/s from 5 s to 20 m", s.least("climb_rate", 5, twenty),
                    s.most("climb_rate", 5, twenty)),
        fmt::format("up to {:.1f} m/s", s.most("ground_speed", 0, 25)),
        fmt::format("{:.2f} m/s at 90 s", s.last("ground_speed")),
        fmt::format("|He| up to {:.2f} from 25 to 45 s ({:.2f} at take-off), |Le| {:.2f} ({:.2f})",
                    s.largest("He", 25, 45), s.largest("He", 0, 5), s.largest("Le", 25, 45),
                    s.largest("Le", 0, 5)),
        fmt::format("{:.4f} and {:.4f} at 90 s", s.last("He"), s.last("Le")),
        fmt::format("{:.0f} m", s.last("distance")),
        fmt::format("{:.1f} m at 25 s", s.at("height", 25)),
        fmt::format("up to {:.1f} m/s", s.most("climb_rate", 25, 45)),
        fmt::format("{:.1f} m at 90 s", s.last("height"))};
    REQUIRE(flight["paper"].size() == expected.size());
    long agree = 0;
    for (std::size_t k = 0; k < expected.size(); ++k) {
      const json& fact = flight["paper"][k];
      CHECK(fact["flight"] == expected[k]);
      CHECK(fact["why"].get<std::string>().empty() == fact["agrees"].get<bool>());
      agree += fact["agrees"].get<bool>();
    }
    const Ran text = run(scratch, simulate(study, ""));
    says(text.out, fmt::format("Compared with the paper's figures, {} of 15 agree:\n", agree));
    std::istringstream lines(text.out);
    for (std::string line; std::getline(lines, line);) {
      CAPTURE(line);
      const auto bytes_within =
          std::ranges::count_if(line, [](char c) { return (c & 0xC0) == 0x80; });
      CHECK(line.size() - std::size_t(bytes_within) <= 100);  // characters
    }
  }
}

TEST_CASE("the other studies: bumpless arrives, the reference gains are lost, the way back lands") {
  const Scratch scratch("simulate");
  const Ran bumpless = run(scratch, simulate("transition_bumpless", "-f json"));
  CHECK(bumpless.exit_code == 0);
  CHECK(json::parse(bumpless.out)["hand_over"][0]["verdict"] == "settles");
  const Ran lost = run(scratch, simulate("transition_reference", "-f json"));
  CHECK(lost.exit_code == 1);
  CHECK(lost.err.empty());
  const json flight = json::parse(lost.out);
  CHECK(flight["status"] == "lost");
  CHECK(flight["events"].back()["kind"] == "lost");
  const json& check = flight["hand_over"][0];
  CHECK(check["verdict"] == "lost");
  for (const char* words : {"x2", "K_Li", "elevator"}) says(check["message"], words);
  CHECK_NEAR(check["height"].get<double>(), 46.44, 0.01);
  const Ran text = run(scratch, simulate("transition_reference", ""));
  CHECK(text.exit_code == 1);
  for (const char* words :
       {"transition_reference, starting at rest on the ground: lost at 33.6", "predicted",
        "h = 46.44 m", "K_Li x2 must change from", "features at later times: ends at 33.6 s"})
    says(text.out, words);
  const Ran landed = run(scratch, simulate("reconversion", ""));
  CHECK(landed.exit_code == 0);
  says(landed.out, "landed");
  says(landed.out, "ground contact");
  CHECK(landed.out.find(" -0.0 ") == std::string::npos);
  CHECK(landed.out.find("Compared with the paper") == std::string::npos);
}

// ---- Files -------------------------------------------------------------------------------------

TEST_CASE("CSV and --samples have the numbers of JSON to the last digit") {
  const Scratch scratch("simulate");
  const Ran ran = run(scratch, simulate("transition", "-f json --samples f.csv"));
  REQUIRE(ran.exit_code == 0);
  const json flight = json::parse(ran.out);
  const std::string samples = slurp(scratch.path / "f.csv");
  CHECK(run(scratch, simulate("transition", "-f csv")).out == samples);
  const auto rows = csv_of(samples);
  CHECK(rows[0].size() == flight["samples"].size());
  CHECK(flight["units"].size() == flight["samples"].size());
  for (std::size_t c = 0; c < rows[0].size(); ++c) {
    const std::vector<double> values = flight["samples"][rows[0][c]];
    REQUIRE(rows.size() == 1 + values.size());
    long other = 0;
    for (std::size_t k = 0; k < values.size(); ++k)
      other += std::stod(rows[k + 1].at(c)) != values[k];
    CHECK(other == 0);
  }
  CHECK(scratch.files() == Names{"f.csv"});
}

namespace {

const std::string read_netcdf = R"(
import csv, sys
try:
    import netCDF4
except ImportError:
    sys.exit(77)
rows = list(csv.DictReader(open("f.csv")))
with netCDF4.Dataset("f.nc") as data:
    assert data.Conventions == "CF-1.8"
    assert data.status == "flown"
    assert data.study == open(sys.argv[1], encoding="utf-8").read()
    assert data.dimensions["time"].size == len(rows)
    for name in rows[0]:
        assert data[name].dimensions == ("time",), name
        assert data[name][:].tolist() == [float(row[name]) for row in rows], name
        assert data[name].units and data[name].long_name, name
    units = {"time": "s", "V": "m s-1", "q": "rad s-1", "theta_deg": "degree", "height": "m",
             "He": "1", "thrust": "N", "drag_power": "W"}
    for name, unit in units.items():
        assert data[name].units == unit, name
    kinds = data["event_kind"][:].tolist()
    assert data["event_what"][kinds.index("hand_over")] == "to the elevator"
    assert 24 < data["event_time"][kinds.index("hand_over")] < 25
    shape = data["height"].shape
try:
    import xarray
except ImportError:
    sys.exit(0)
with xarray.open_dataset("f.nc") as data:
    assert data.height.shape == shape
    assert float(data.time[-1]) == 90 and abs(float(data.V[-1]) - 15) < 0.2
)";

}  // namespace

TEST_CASE("--samples f.nc, read back by other programs") {
  const Scratch scratch("simulate");
  REQUIRE(run(scratch, simulate("transition", "-f csv -o f.csv --samples f.nc")).exit_code == 0);
  CHECK(scratch.files() == Names{"f.csv", "f.nc"});
  scratch.write("read.py", read_netcdf);
  const Ran read =
      run(scratch, fmt::format("read.py '{}transition.toml'", studies), {"", "/usr/bin/python3"});
  if (read.exit_code == 77 || read.exit_code == 127) {
    MESSAGE("python3-netcdf4 is not installed");
    return;
  }
  INFO(read.err);
  CHECK(read.exit_code == 0);
}

namespace {

const std::vector<std::string> figures{"fig5_angles", "fig6_speeds", "fig7_energy_errors",
                                       "fig8_path", "fig9_height"};

bool gnuplot_installed() {
  const bool there = std::system("gnuplot --version >/dev/null 2>&1") == 0;
  if (!there) MESSAGE("gnuplot is not installed");
  return there;
}

void check_figures(const fs::path& folder) {
  Names expected{"figures.gp", "flight.csv"}, found;
  for (const std::string& name : figures) {
    CAPTURE(name);
    const std::string svg = slurp(folder / (name + ".svg")), png = slurp(folder / (name + ".png"));
    CHECK(svg.starts_with("<?xml"));
    CHECK(svg.ends_with("</svg>\n\n"));
    CHECK(svg.find("<path") != std::string::npos);
    CHECK(png.starts_with("\x89PNG\r\n\x1a\n"));
    CHECK(png.ends_with("IEND\xae\x42\x60\x82"));
    expected.insert({name + ".svg", name + ".png"});
  }
  for (const auto& entry : fs::directory_iterator(folder)) found.insert(entry.path().filename());
  CHECK(found == expected);
}

}  // namespace

TEST_CASE("--plots: five figures, drawn twice, in folders that are made") {
  if (!gnuplot_installed()) return;
  const Scratch scratch("simulate");
  const Ran ran = run(scratch, simulate("transition", "--plots a/b"));
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  check_figures(scratch.path / "a/b");
  CHECK(slurp(scratch.path / "a/b/figures.gp").find("set key tmargin") != std::string::npos);
  CHECK(slurp(scratch.path / "a/b/fig5_angles.svg").find("handover to the elevator") !=
        std::string::npos);
  CHECK(run(scratch, simulate("transition_reference", "--plots a/b")).exit_code == 1);
  check_figures(scratch.path / "a/b");
  CHECK(scratch.files() == Names{"a"});
}

TEST_CASE("--plots of studies of any name") {
  if (!gnuplot_installed()) return;
  const Scratch scratch("simulate");
  const std::string text = slurp(studies + "transition.toml");
  for (const std::string name : {"it's", "two words", "\"quoted\"", "a_b^c{d}@e", "50 % \\n $HOME",
                                 "Übergang 転", "two\nlines", "`date`; exit"}) {
    CAPTURE(name);
    scratch.write(name + ".toml", text);
    const std::string quoted = std::regex_replace(name, std::regex("'"), "'\\''");
    const Ran ran = run(scratch, fmt::format("simulate './{}.toml' --plots figures", quoted));
    CHECK(ran.exit_code == 0);
    CHECK(ran.err.empty());
    check_figures(scratch.path / "figures");
    fs::remove_all(scratch.path / "figures");
  }
  scratch.write("a_b ü.toml", text);
  CHECK(run(scratch, "simulate 'a_b ü.toml' --plots figures").exit_code == 0);
  CHECK(slurp(scratch.path / "figures/fig8_path.svg").find("Height over distance (a_b ü)") !=
        std::string::npos);
}

TEST_CASE("--plots without gnuplot: said, and what it would have drawn is kept") {
  const Scratch scratch("simulate");
  const Ran ran =
      run(scratch, simulate("transition", "--plots figures"), {"export PATH=/nonexistent;"});
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(ran.err ==
        "tiltrim: gnuplot is not installed (Debian: gnuplot-nox); its script and data are in "
        "figures\n");
  CHECK(fs::exists(scratch.path / "figures/figures.gp"));
  CHECK(fs::exists(scratch.path / "figures/flight.csv"));
}

// ---- Refusals ----------------------------------------------------------------------------------

namespace {

const std::string gains =
    "[gains]\nk_V = 3.53\nK_Ep = 1.77\nK_Ei = 0.183\nK_Lp = 0.987\nK_Li = 0.00215\nk_pa = 1.11\n"
    "k_da = 1.14\nk_pe = 1.17\nk_de = 7.66\n";
const std::string level =
    "[[condition]]\nname = \"level\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";
const std::string held =
    gains + level + "[simulate]\nschedule = \"hold\"\nheight = 100.0\nduration = 2.0\n";
const std::string scatter =
    "[[montecarlo.scatter]]\nkey = \"aircraft.mass\"\npercent = 5\n"
    "[[montecarlo.scatter]]\nkey = \"theta_deg\"\nfrom = -4.0\nto = 8.0\n";

std::string flights(int n, const std::string& keys = "") {
  return fmt::format("[montecarlo]\nflights = {}\n{}", n, keys);
}

// In one line, without writing anything.
void refused(const Scratch& scratch, const std::string& arguments, const std::string& words) {
  CAPTURE(arguments);
  const Names before = scratch.files();
  const Ran ran = run(scratch, "simulate " + arguments);
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(std::ranges::count(ran.err, '\n') == 1);
  says(ran.err, words);
  CHECK(scratch.files() == before);
}

}  // namespace

TEST_CASE("exit 2: options that are none, that exclude each other, or would be passed over") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held + flights(5) + scatter);
  const std::map<std::string, std::string> mistakes{
      {"--sample f.nc", "--sample"},
      {"--monte-carlo --tilt-rate-limit", "at most 1"},
      {"--flight 1 --response V=1", "at most 1"},
      {"--monte-carlo --samples f.nc", "--samples applies to a flight only"},
      {"--tilt-rate-limit --plots figures", "--plots applies to a flight only"},
      {"--tilts 90,0", "--tilts applies to --tilt-rate-limit only"},
      {"--log f.log", "--log applies to --monte-carlo only"},
      {"--only level", "--only applies to --response only"},
      {"--threads -1", "-1 is not a whole number from 0 to 1024"},
      {"--threads 1.5", "1.5 is not a whole number from 0 to 1024"},
      {"--threads two", "--threads"}};
  for (const auto& [options, words] : mistakes) refused(scratch, "s.toml " + options, words);
  for (const char* threads : {"0", "1", "8"})
    CHECK(run(scratch, fmt::format("simulate s.toml --threads {}", threads)).exit_code == 0);
}

TEST_CASE("exit 2: responses to no such state, to no number, to nothing") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held);
  const std::map<std::string, std::string> mistakes{
      {"thta_deg=2", "no 'thta_deg' (nearest: 'theta_deg'); there are: V, gamma_deg"},
      {"theta=2", "(nearest: 'theta_deg')"},
      {"energy_integal=1", "(nearest: 'energy_integral')"},
      {"altitude=1", "no 'altitude'; there are: V, gamma_deg, theta_deg, q"},
      {"theta_deg", "'' is not a number; expected theta_deg=NUMBER, as theta_deg=2"},
      {"q=", "'' is not a number"},
      {"q=nan", "'nan' is not a number"},
      {"q=-inf", "'-inf' is not a number"},
      {"V=2x", "'2x' is not a number"},
      {"V=1,V=2", "'V' is given twice"},
      {"V=0,q=0", "an empty offset;"}};
  for (const auto& [offset, words] : mistakes)
    refused(scratch, "s.toml --response " + offset, words);
  refused(scratch, "s.toml --response V=1 --only levl", "levl");
}

TEST_CASE("exit 2: tilts that are not two, that rise, or are none") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held);
  const std::map<std::string, std::string> mistakes{
      {"90", "--tilts: At least 2 required"},
      {"90,45,0", "--tilts: At Most 2 required"},
      {"0,90", "tiltrim: --tilts: 0 to 90 does not decrease"},
      {"45,45", "tiltrim: --tilts: 45 to 45 does not decrease"},
      {"91,0", "is not a number from 0 to 90"},
      {"90,-1", "is not a number from 0 to 90"},
      {"nan,0", "--tilts: nan is not a number from 0 to 90"},
      {"a,b", "--tilts"}};
  for (const auto& [tilts, words] : mistakes)
    refused(scratch, "s.toml --tilt-rate-limit --tilts " + tilts, words);
}

TEST_CASE("exit 2: files of no such kind, files that are one, places that cannot be written") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held + flights(5) + scatter);
  scratch.write("s.csv", held);
  scratch.write("file", "");
  const std::string text = slurp(scratch.path / "s.toml");
  const std::map<std::string, std::string> mistakes{
      {"s.toml --samples f.txt", "--samples: f.txt: expected a file that ends in .nc or .csv"},
      {"s.toml --samples f", "expected a file that ends in"},
      {"s.toml --samples s.toml", "expected a file that ends in"},
      {"s.csv --samples ./s.csv", "--samples and the study name the same file"},
      {"s.toml --samples f.csv -o ./f.csv", "--samples and -o name the same file;"},
      {"s.toml -o s.toml", "-o and the study name the same file"},
      {"s.toml --samples absent/f.nc", "absent: No such file or directory"},
      {"s.toml -o absent/f.txt", "absent: No such file or directory"},
      {"s.toml --samples /dev/null.nc/f.nc", "/dev/null.nc"},
      {"s.toml --plots file", "file: Not a directory"},
      {"s.toml --plots file/figures", "file: Not a directory"},
      {"s.toml --monte-carlo --log s.toml", "--log and the study name the same file"},
      {"s.toml --monte-carlo --log f -o f", "--log and -o name the same file;"},
      {"s.toml --monte-carlo --log s.csv", "s.csv: is not a log"},
      {"s.toml --monte-carlo --log .", "Is a directory"},
      {"s.toml --monte-carlo --log absent/f", "absent/f: No such file or directory"}};
  for (const auto& [arguments, words] : mistakes) refused(scratch, arguments, words);
  fs::create_directory(scratch.path / "folder.nc");
  refused(scratch, "s.toml --samples folder.nc", "folder.nc: Is a directory");
  CHECK(slurp(scratch.path / "s.toml") == text);
  CHECK(slurp(scratch.path / "s.csv") == held);
}

TEST_CASE("exit 2: studies that have nothing to fly again, or are wrong") {
  const Scratch scratch("simulate");
  scratch.write("once.toml", held);
  scratch.write("s.toml", held + flights(5) + scatter);
  refused(scratch, "once.toml --monte-carlo", "once.toml: no [montecarlo] table; expected one");
  refused(scratch, "once.toml --flight 0", "once.toml: no [montecarlo] table; expected one");
  refused(scratch, "s.toml --flight 5",
          "no flight 5; the 5 flights of [montecarlo] are numbered from 0");
  for (const char* number : {"-1", "1.5", "10000001", "nan"})
    refused(scratch, fmt::format("s.toml --flight {}", number), "--flight");
  refused(scratch, "absent.toml", "absent.toml: cannot be read");
  scratch.write("key.toml", level + "[simulate]\nduraton = 5\n");
  refused(scratch, "key.toml", "key.toml:7:1: unknown key 'duraton'");
  scratch.write("printed.toml", "equations = \"printed\"\n" + level);
  refused(scratch, "printed.toml", "printed.toml");
  scratch.write("glide.toml",
                "[[condition]]\nname = \"glide\"\nformulation = \"airframe\"\nV = 15.0\n"
                "eta_deg = 0.0\na1s_deg = 0.0\n");
  refused(scratch, "glide.toml --response V=1", "no condition of formulation closed_loop");
}

TEST_CASE("exit 1: no trim to start from") {
  const Scratch scratch("simulate");
  scratch.write("s.toml",
                "[[condition]]\nname = \"slow\"\nV = 3.0\ngamma_deg = 0.0\neta_deg = 0.0\n"
                "[simulate]\nschedule = \"hold\"\n" +
                    flights(5) + scatter);
  const Ran ran = run(scratch, "simulate s.toml --samples f.nc");
  CHECK(ran.exit_code == 1);
  says(ran.out, "no trim to start from");
  CHECK(scratch.files() == Names{"s.toml"});
  CHECK(json::parse(run(scratch, "simulate s.toml -f json").out)["status"] == "no_trim");
  const Ran many = run(scratch, "simulate s.toml --monte-carlo");
  CHECK(many.exit_code == 1);
  says(many.out, "no flight: ");
}

TEST_CASE("Ctrl-C in a flight: exit 130, as far as it came") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", gains + level +
                              "[simulate]\nschedule = \"hold\"\nheight = 1e5\nduration = 1e5\n"
                              "[[simulate.gust]]\nkind = \"dryden\"\nsize = 0.5\n");
  const Running flight = start(scratch, "simulate s.toml -f json");
  let_compute(flight, 500ms);
  ::kill(flight.pid, SIGINT);
  const Ran ran = finish(flight, 60s);
  CHECK(ran.exit_code == 128 + SIGINT);
  CHECK(ran.err.empty());
  const json j = json::parse(ran.out);
  CHECK(j["status"] == "interrupted");
  CHECK(j["samples"]["time"].back() < 1e5);
}

// ---- Monte Carlo -------------------------------------------------------------------------------

namespace {

std::string scattered() { return held + flights(trials(4000), "worst = 5\n") + scatter; }

const std::string monte_carlo = "simulate s.toml --monte-carlo -f json ";

double now() {  // s
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Uninterrupted {
  std::string out;
  double seconds = 0.0;
};

// Once for all cases.
const Uninterrupted& uninterrupted() {
  static const Uninterrupted whole = [] {
    const Scratch scratch("simulate-whole");
    scratch.write("s.toml", scattered());
    const double begun = now();
    const Ran ran = run(scratch, monte_carlo);
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.err.empty());
    CHECK(scratch.files() == Names{"s.toml"});
    return Uninterrupted{ran.out, now() - begun};
  }();
  return whole;
}

// A run that has logged some flights. On a busy machine one may end before that is seen: again.
Running under_way(const Scratch& scratch) {
  const fs::path log = scratch.path / "mc.log";
  for (int i = 0; i < 20; ++i) {
    const Running many = start(scratch, monte_carlo + "--log mc.log");
    CHECK(holds_soon([&] { return records_in(log) > 0 || has_ended(many); }));
    if (!has_ended(many)) return many;
    (void)finish(many);
  }
  throw std::runtime_error("each of 20 runs ended unseen");
}

// What a run answers to a signal among its flights; one that came after the last is no such answer.
Ran interrupted_by(const Scratch& scratch, int signal) {
  for (int i = 0; i < 20; ++i) {
    const Running many = under_way(scratch);
    ::kill(many.pid, signal);
    const Ran ran = finish(many);
    if (ran.out != uninterrupted().out) return ran;
  }
  throw std::runtime_error("each of 20 runs ended before the signal");
}

}  // namespace

TEST_CASE("Monte Carlo: the same bytes for any number of threads") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", scattered());
  for (const int threads : {1, 2, 3, 8})
    CHECK(run(scratch, monte_carlo + fmt::format("--threads {}", threads)).out ==
          uninterrupted().out);
}

TEST_CASE("Monte Carlo killed at random moments goes on to the same bytes") {
  constexpr std::uintmax_t record = 1 << 12;  // more than the one that a kill may tear
  const Scratch scratch("simulate");
  scratch.write("s.toml", scattered());
  const fs::path log = scratch.path / "mc.log";
  const std::string command = monte_carlo + "--log mc.log";
  const int kills = trials(10);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::uintmax_t logged = 0;
  int landed = 0;
  for (int i = 0; i < 20 * kills && landed < kills; ++i) {
    const Running many = start(scratch, command);
    std::this_thread::sleep_for(
        std::chrono::duration<double>(uninterrupted().seconds * share(random)));
    ::kill(many.pid, SIGKILL);
    const Ran ran = finish(many);
    if (ran.signal == SIGKILL) {
      ++landed;
      if (fs::exists(log)) CHECK(size_of(log) + record >= logged);  // else it was about to end
      logged = size_of(log);
    } else {
      CHECK(ran.exit_code == 0);
      CHECK(ran.out == uninterrupted().out);
      CHECK_FALSE(fs::exists(log));
      logged = 0;
    }
  }
  CHECK(landed == kills);
  const Ran last = run(scratch, command);
  CHECK(last.exit_code == 0);
  CHECK(last.out == uninterrupted().out);
  CHECK(scratch.files() == Names{"s.toml"});
}

TEST_CASE("Ctrl-C in Monte Carlo: exit 130, the flights so far, and on from the log") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", scattered());
  for (const int signal : {SIGINT, SIGTERM}) {
    const Ran ran = interrupted_by(scratch, signal);
    CHECK(ran.exit_code == 128 + signal);
    CHECK(ran.err.empty());
    const json j = json::parse(ran.out);
    CHECK(j["interrupted"] == true);
    CHECK(j["asked"] == trials(4000));
    CHECK(j["flown"].get<long>() > 0);
    CHECK(j["flown"].get<long>() < trials(4000));
    CHECK(j["ends"]["flown"] == j["flown"]);
    CHECK(j["worst"].size() == std::min(std::size_t{5}, j["flown"].get<std::size_t>()));
    CHECK(scratch.files() == Names{"mc.log", "s.toml"});
    CHECK(run(scratch, monte_carlo + "--log mc.log").out == uninterrupted().out);
    CHECK(scratch.files() == Names{"s.toml"});
  }
}

TEST_CASE("the log of another study, or one that is in use, is refused and kept") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", scattered());
  const Running many = under_way(scratch);
  ::kill(many.pid, SIGSTOP);
  refused(scratch, "s.toml --monte-carlo --log mc.log", "another process is using it;");
  ::kill(many.pid, SIGKILL);
  (void)finish(many);
  const std::string log = slurp(scratch.path / "mc.log");
  scratch.write("s.toml", std::regex_replace(scattered(), std::regex("to = 8"), "to = 9"));
  refused(scratch, "s.toml --monte-carlo --log mc.log", "'to = 8.0' in the log, 'to = 9.0' now");
  CHECK(slurp(scratch.path / "mc.log") == log);
}

TEST_CASE("no room for the log: said; then it goes on") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", scattered());
  const Running many = under_way(scratch);
  ::kill(many.pid, SIGKILL);
  (void)finish(many);
  const std::uintmax_t blocks = size_of(scratch.path / "mc.log") / 512;  // a shell's, or half
  const Ran full = run(scratch, monte_carlo + "--log mc.log",
                       {fmt::format("ulimit -f {}; trap '' XFSZ;", blocks)});
  if (full.exit_code != 0) {  // of blocks of 1024 there was room
    CHECK(full.exit_code == 2);
    CHECK(full.out.empty());
    CHECK(full.err == "tiltrim: mc.log: File too large\n");
  }
  CHECK(run(scratch, monte_carlo + "--log mc.log").out == uninterrupted().out);
  CHECK(scratch.files() == Names{"s.toml"});
}

TEST_CASE("the worst flights fly with --flight as they are said to miss") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", scattered());
  const json j = json::parse(uninterrupted().out);
  const auto rows = csv_of(run(scratch, "simulate s.toml --monte-carlo -f csv").out);
  REQUIRE(rows.size() == 1 + 5);
  double before = 1e9;
  for (std::size_t k = 0; k < 5; ++k) {
    const json& worst = j["worst"][k];
    const long number = worst["number"];
    const json flight =
        json::parse(run(scratch, fmt::format("simulate s.toml --flight {} -f json", number)).out);
    CHECK(flight["name"] == fmt::format("s, flight {}", number));
    const json& s = flight["samples"];
    const auto last = [&](const char* name) { return s[name].back().get<double>(); };
    CHECK(flight["status"] == worst["status"]);
    CHECK(last("time") == worst["t"]);
    CHECK(last("height") == worst["height"]);
    const double V_off = last("V") - last("V_commanded");
    const double gamma_off = last("gamma_deg") - last("gamma_commanded_deg");
    CHECK_NEAR(V_off, worst["V_off"].get<double>(), 1e-12);
    CHECK_NEAR(gamma_off, worst["gamma_off_deg"].get<double>(), 1e-12);
    CHECK_NEAR(s["theta_deg"][0].get<double>(), worst["scattered"]["theta_deg"].get<double>(),
               1e-12);
    const double miss = worst["miss"];
    CHECK_NEAR(miss,
               std::max(std::abs(V_off) / 0.2, std::abs(gamma_off) * std::numbers::pi / 180 / 0.01),
               1e-9 * miss);
    CHECK(miss <= before);
    before = miss;
    CHECK(std::stol(rows[k + 1].at(0)) == number);
    CHECK(std::stod(rows[k + 1].at(7)) == miss);
  }
}

TEST_CASE("a study in which all are lost: 0 %, and that is an answer") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", slurp(studies + "transition_reference.toml") + flights(20) +
                              "[[montecarlo.scatter]]\nkey = \"aircraft.mass\"\npercent = 1\n");
  const Ran ran = run(scratch, monte_carlo);
  CHECK(ran.exit_code == 0);
  const json j = json::parse(ran.out);
  CHECK(j["good"] == 0);
  CHECK(j["ends"]["lost"] == 20);
  CHECK(j["share"] == 0.0);
  CHECK(j["lower"] == 0.0);
  CHECK_NEAR(j["upper"].get<double>(), 1 - std::pow(0.025, 1.0 / 20), 1e-12);
  const Ran text = run(scratch, "simulate s.toml --monte-carlo");
  says(text.out, "0 of 20 flights succeeded: 0 % (95 % confidence interval 0 to 16.84 %)");
  says(text.out, "outcomes: 20 lost");
  says(text.out, "an error above a million tolerances means that");
}

TEST_CASE("of the way back landings are good") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", slurp(studies + "reconversion.toml") + flights(3) +
                              "[[montecarlo.scatter]]\nkey = \"aircraft.mass\"\npercent = 1\n");
  const json j = json::parse(run(scratch, monte_carlo).out);
  CHECK(j["good"] == 3);
  CHECK(j["ends"]["landed"] == 3);
}

// ---- Alternatives to the flight ----------------------------------------------------------------

TEST_CASE("--response: text, JSON and CSV agree, and a small offset is a linear one") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held);
  const std::string small = "simulate s.toml --response theta_deg=0.01 ";
  const Ran ran = run(scratch, small + "-f json");
  CHECK(ran.exit_code == 0);
  const json one = json::parse(ran.out)["responses"][0];
  CHECK(one["name"] == "level");
  CHECK(one["status"] == "responded");
  CHECK(one["apart"].get<double>() < 0.01);
  CHECK_NEAR(one["nonlinear"]["theta"][0].get<double>(), 0.01 * std::numbers::pi / 180, 1e-15);
  const auto rows = csv_of(run(scratch, small + "-f csv").out);
  REQUIRE(rows.size() == 1 + one["t"].size());
  for (std::size_t c = 0; c < rows[0].size(); ++c) {
    if (rows[0][c] != "V_linear" && rows[0][c] != "q_linear") continue;
    const json& values = one["linear"][rows[0][c].substr(0, 1)];
    for (std::size_t k = 0; k < values.size(); ++k)
      CHECK(std::stod(rows[k + 1].at(c)) == values[k].get<double>());
  }
  const Ran large = run(scratch, "simulate s.toml --response theta_deg=2,V=0.5");
  says(large.out, "level: linear and nonlinear response differ by at most ");
  const Ran beyond = run(scratch, "simulate s.toml --response V=1e200");
  CHECK(beyond.exit_code == 1);
  says(beyond.out, "level: the nonlinear motion ends early: ");
}

TEST_CASE("--tilt-rate-limit between two tilts: text, JSON and CSV agree") {
  const Scratch scratch("simulate");
  const std::string command = simulate("transition_bumpless", "--tilt-rate-limit --tilts 90,80 ");
  const Ran ran = run(scratch, command + "-f json");
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  const json j = json::parse(ran.out);
  CHECK(j["status"] == "found");
  CHECK(j["frozen_stable"] == true);
  CHECK(j["fails_deg_s"].get<double>() <= 1.01 * j["holds_deg_s"].get<double>());
  CHECK(j["stretches"][0]["certificate"].get<double>() < 0);
  CHECK(csv_of(run(scratch, command + "-f csv").out).size() == 1 + j["flights"].size());
  const std::string text = run(scratch, command).out;
  says(text, fmt::format("frozen eigenvalues predict the flight up to a tilt rate of {:.4g}°/s,",
                         j["holds_deg_s"].get<double>()));
  says(text, fmt::format("{:.4g}°/s\n", j["fails_deg_s"].get<double>()));
}

TEST_CASE("--samples of a flight without any event") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held);
  REQUIRE(run(scratch, "simulate s.toml --samples f.nc").exit_code == 0);
  CHECK(json::parse(run(scratch, "simulate s.toml -f json").out)["events"].empty());
  CHECK(slurp(scratch.path / "f.nc").substr(1, 3) == "HDF");
  CHECK(scratch.files() == Names{"f.nc", "s.toml"});
}

TEST_CASE("--help names every option") {
  const Scratch scratch("simulate");
  const Ran ran = run(scratch, "simulate --help");
  CHECK(ran.exit_code == 0);
  for (const char* option :
       {"--format", "--output", "--only", "--samples", "--plots", "--tilt-rate-limit", "--tilts",
        "--monte-carlo", "--flight", "--response", "--log", "--threads", "Figures 5-9",
        ".nc or .csv", "[montecarlo]"})
    says(ran.out, option);
}

namespace {

// Output of a run on a terminal until the pattern appears; then it is killed.
std::string on_terminal(const Scratch& scratch, const std::string& command,
                        const std::regex& pattern) {
  int terminal = -1;
  const pid_t pid = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  if (pid == 0) {
    const std::string line = fmt::format("cd '{}' && {}", scratch.path.string(), command);
    ::execl("/bin/sh", "sh", "-c", line.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  std::string said;
  char piece[4096];
  while (!std::regex_search(said, pattern)) {
    const ssize_t n = ::read(terminal, piece, sizeof piece);
    if (n <= 0) break;  // EIO: the other side is closed
    said.append(piece, std::size_t(n));
  }
  ::kill(pid, SIGKILL);
  ::waitpid(pid, nullptr, 0);
  ::close(terminal);
  return said;
}

}  // namespace

TEST_CASE("a terminal has colours, unless NO_COLOR, and is told how far it is; a pipe is not") {
  const Scratch scratch("simulate");
  scratch.write("s.toml", held + flights(1'000'000) + scatter);
  const std::string program = TILTRIM_PROGRAM;
  const std::regex end("energy balance");
  const std::string coloured = on_terminal(scratch, "exec " + program + " simulate s.toml", end);
  says(coloured, "\x1b[32mcompleted");
  const std::string plain =
      on_terminal(scratch, "NO_COLOR=1 exec " + program + " simulate s.toml", end);
  says(plain, "starting from the trim at V = 15 m/s");
  CHECK(plain.find('\x1b') == std::string::npos);
  CHECK(run(scratch, "simulate s.toml").out.find('\x1b') == std::string::npos);
  const std::regex progress(R"(\r\x1b\[K[0-9]+ of 1000000 flights, [0-9]+ good, [0-9]+ s left)");
  const std::string told =
      on_terminal(scratch, "exec " + program + " simulate s.toml --monte-carlo", progress);
  INFO(told);
  CHECK(std::regex_search(told, progress));
}

}  // namespace simulate_cli_test
