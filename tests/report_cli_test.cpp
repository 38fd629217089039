// tiltrim report as a user runs it. report_page.py tests the page in a browser.
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "model/degrees.hpp"
#include "sweep/map.hpp"
#include "tests/check.hpp"
#include "tests/program.hpp"

namespace report_cli_test {

namespace {

using namespace std::chrono_literals;
using nlohmann::json;
namespace fs = std::filesystem;
using program::finish;
using program::Ran;
using program::run;
using program::Scratch;
using program::slurp;
using program::start;

bool says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

const std::string level =
    "[[condition]]\nname = \"level\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";
const std::string steep =
    "[[condition]]\nname = \"steep\"\nV = 15.0\ngamma_deg = 80.0\neta_deg = 0.0\n";
const std::string bare = "[report]\nflight = \"skip\"\naudit = \"skip\"\n";

std::string map_over(const std::string& key, int count) {
  return fmt::format(
      "[[report.map]]\n[[report.map.axis]]\nkey = \"{}\"\nfrom = 0.5\nto = 1.0\ncount = {}\n", key,
      count);
}

const std::string small = bare + map_over("gains.K_Lp", 5) + level;

// The data of the page's script.
json data_of(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t at = page.find(begin) + begin.size();
  return json::parse(page.substr(at, page.find("</script>", at) - at));
}

std::string page_of(const Scratch& scratch, const std::string& study,
                    const std::string& options = "") {
  scratch.write("s.toml", study);
  const Ran ran = run(scratch, "report s.toml " + options);
  CHECK(ran.exit_code == 0);
  CHECK(ran.err.empty());
  return slurp(scratch.path / "s.html");
}

void check_refused(const Scratch& scratch, const std::string& command,
                   const std::vector<std::string>& words) {
  const std::set<std::string> before = scratch.files();
  const Ran ran = run(scratch, command);
  CAPTURE(ran.err);
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  for (const std::string& word : words) CHECK_MESSAGE(says(ran.err, word), word);
  CHECK(scratch.files() == before);
}

}  // namespace

TEST_CASE("the page is STUDY.html here, and the terminal is told the verdict") {
  const Scratch scratch("report");
  scratch.write("s.toml", small);
  const Ran ran = run(scratch, "report s.toml");
  CHECK(ran.exit_code == 0);
  CHECK(says(ran.out, "The condition is in verified equilibrium and stable. Along K_Lp: stable"));
  CHECK(says(ran.out, "s.html\n"));
  CHECK(scratch.files() == std::set<std::string>{"s.toml", "s.html"});
  CHECK(run(scratch, "report s.toml -o other.html").exit_code == 0);
  const std::string page = slurp(scratch.path / "s.html"),
                    other = slurp(scratch.path / "other.html");
  CHECK(says(other, "tiltrim report s.toml -o other.html"));
  CHECK(page.size() == other.size() - 4);  // identical except for the name: s, other
}

TEST_CASE("the numbers of a line are those of sweep, to ten digits") {
  const Scratch scratch("report");
  const json track = data_of(page_of(scratch, small))["tracks"].at(0);
  scratch.write("sweep.toml",
                "[[sweep.axis]]\nkey = \"gains.K_Lp\"\nfrom = 0.5\nto = 1.0\ncount = 5\n" + level);
  const json points = json::parse(run(scratch, "sweep sweep.toml -f json").out)["points"];
  std::map<std::string, std::vector<double>> columns;
  for (const json& c : track["columns"])
    for (const json& v : c["values"]) columns[c["key"]].push_back(v);
  REQUIRE(points.size() == 5);
  const std::vector<double>& drawn = columns.at("parameter");  // others between them
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double asked = points[i]["gains.K_Lp"];
    const auto at = std::ranges::find_if(
        drawn, [asked](double p) { return std::abs(p - asked) <= 1e-9 * asked; });
    REQUIRE(at != drawn.end());
    const auto same = [&](const std::string& key, double value) {
      CHECK_NEAR(columns.at(key).at(std::size_t(at - drawn.begin())), value,
                 1e-9 * std::abs(value));
    };
    same("theta0", points[i]["input"]["theta0"]);
    for (std::size_t m = 0; m < 6; ++m) {
      same(fmt::format("re_{}", m), points[i]["modes"][m]["re"]);
      same(fmt::format("im_{}", m), points[i]["modes"][m]["im"]);
    }
  }
}

TEST_CASE("--sweep: a map that is there is taken over, and the page says from where") {
  const Scratch scratch("report");
  // Unevenly spaced: evenly spaced points are drawn with others between them.
  const std::string axis = "key = \"gains.K_Lp\"\nvalues = [0.5, 0.6, 0.75, 0.9, 1.0]\n";
  const std::string small = bare + "[[report.map]]\n[[report.map.axis]]\n" + axis + level;
  const std::string computed = page_of(scratch, small);
  scratch.write("sweep.toml", "[[sweep.axis]]\n" + axis + level);
  REQUIRE(run(scratch, "sweep sweep.toml -o map.nc").exit_code == 0);
  const std::string reused = page_of(scratch, small, "--sweep map.nc");
  CHECK(data_of(reused) == data_of(computed));
  CHECK(says(reused, "Read from map.nc: gains.K_Lp from 0.5 to 1, 5 points."));
  CHECK(!says(computed, "Read from"));
  // A map over other axes is added to the computed ones.
  const std::string both =
      page_of(scratch, bare + map_over("gains.K_Li", 3) + level, "--sweep map.nc");
  CHECK(data_of(both)["tracks"].size() > data_of(computed)["tracks"].size());
}

TEST_CASE("--sweep: another study's map is refused, and what differs is named") {
  const Scratch scratch("report");
  const std::string grid =
      "[[sweep.axis]]\nkey = \"gains.K_Lp\"\nfrom = 0.5\nto = 1.0\ncount = 3\n";
  scratch.write("s.toml", small);
  const auto map_of = [&](const std::string& study) {
    scratch.write("other.toml", study);
    REQUIRE(run(scratch, "sweep other.toml -o map.nc").exit_code == 0);
  };
  map_of("[aircraft]\nmass = 5.0\n[gains]\nK_Li = 0.1\n" + grid + level);
  check_refused(scratch, "report s.toml --sweep map.nc",
                {"map.nc: computed from another study than s.toml", "aircraft.mass", "gains.K_Li"});
  map_of("[limits]\ntheta0 = [0, 0.9]\n" + grid + level);
  check_refused(scratch, "report s.toml --sweep map.nc", {"limits.theta0"});
  map_of("[gains]\nK_Lp = 0.9\n" + grid + level);  // its axis sets it
  CHECK(run(scratch, "report s.toml --sweep map.nc").exit_code == 0);
  map_of(
      "[[sweep.axis]]\nkey = \"V\"\nvalues = [15, 16]\n[[sweep.axis]]\nkey = "
      "\"gains.K_Li\"\nvalues = [0.1, 0.2]\n" +
      grid + level);
  check_refused(scratch, "report s.toml --sweep map.nc",
                {"map.nc: a map over 3 axes cannot be plotted;"});
  scratch.write("no.nc", "not a map");
  check_refused(scratch, "report s.toml --sweep no.nc", {"no.nc"});
  check_refused(scratch, "report s.toml --sweep nowhere.nc", {"nowhere.nc"});
}

TEST_CASE("--sweep: a map of other conditions, gains over tilt or polar is refused") {
  const Scratch scratch("report");
  const std::string axis = "key = \"gains.k_de\"\nfrom = 0.5\nto = 8\ncount = 3\n";
  const std::string grid = "[[sweep.axis]]\n" + axis;
  const std::string bare_airframe =
      "[[condition]]\nname = \"level\"\nformulation = \"airframe\"\nV = 15.0\neta_deg = 0.0\n";
  const auto map_of = [&](const std::string& study) {
    scratch.write("other.toml", study);
    REQUIRE(run(scratch, "sweep other.toml -o map.nc").exit_code == 0);
  };
  const auto refuses = [&](const std::string& study, const std::vector<std::string>& words) {
    scratch.write("s.toml", bare + study);
    check_refused(scratch, "report s.toml --sweep map.nc", words);
  };
  map_of(grid + level);
  refuses(grid + "[[condition]]\nname = \"level\"\nV = 9.0\ngamma_deg = 0.0\neta_deg = 45.0\n",
          {"differ in V of condition 'level', eta_deg of condition 'level';"});  // unstable there
  refuses(grid + "[[condition]]\nname = \"cruise\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n",
          {"condition 'level', which only the map has"});
  refuses(grid + bare_airframe, {"formulation of condition 'level'"});

  const std::string corridor = "[[sweep.axis]]\nkey = \"h\"\nvalues = [0, 10]\n";
  const std::string tilts = "[gains]\nschedule_eta_deg = [0, 90]\nK_Lp = ";
  map_of(tilts + "[0.75, 0.75]\n" + corridor + level);
  refuses(tilts + "[20, 20]\n" + corridor + level, {"differ in gains.K_Lp;"});
  refuses(corridor + level, {"differ in gains.schedule_eta_deg;"});

  const std::string V = "[[sweep.axis]]\nkey = \"V\"\nvalues = [14, 15]\n", at = "a1s_deg = ";
  map_of(V + bare_airframe + at + "0.0\n");
  refuses(V + bare_airframe + at + "1.0\n", {"differ in a1s of condition 'level';"});
}

TEST_CASE("--sweep: the polar is compared by its numbers, and a map without them is refused") {
  const Scratch scratch("report");
  scratch.write("s.toml", "[[sweep.axis]]\nkey = \"V\"\nvalues = [14, 15]\n" + bare + level);
  REQUIRE(run(scratch, "sweep s.toml -o map.nc").exit_code == 0);
  CHECK(run(scratch, "report s.toml --sweep map.nc").exit_code == 0);
  std::string polar = slurp(fs::path(TILTRIM_SOURCE_DIR) / "data/naca8h12_re150k.csv");
  scratch.write("naca8h12_re150k.csv", polar);
  CHECK(run(scratch, "report s.toml --sweep map.nc").exit_code == 0);
  const std::size_t row = polar.find("\n0", polar.find("alpha_deg")) + 1, CL = polar.find(',', row);
  polar.replace(CL + 1, polar.find(',', CL + 1) - CL - 1, "0.1234");
  scratch.write("naca8h12_re150k.csv", polar);
  check_refused(
      scratch, "report s.toml --sweep map.nc",
      {"map.nc: computed from another study", "differ in the numbers of aircraft.polar;"});
  tiltrim::SweepMap map = tiltrim::read_netcdf(scratch.path / "map.nc");
  map.polar.clear();  // as written by earlier versions
  write_netcdf(map, scratch.path / "map.nc");
  check_refused(scratch, "report s.toml --sweep map.nc", {"the map has no checksum of it"});
}

// x'' = -2 x - (c - x²/2) x' + u: held at x it is stable for c > x²/2.
const std::string oscillators = R"(
[model]
name = "oscillator"
state = [{name = "x", rate = "v"}, {name = "v", rate = "-2*x - (c - 0.5*x^2)*v + u"}]
input = [{name = "u"}]
parameter = [{name = "c", value = 0.9}]
[[condition]]
name = "A"
u = [-9.0, 9.0]
x = 1.2
[[condition]]
name = "B"
u = [-9.0, 9.0]
x = 0.1
)";

std::string over_c(const std::string& axis, double from, int count) {
  return fmt::format("[[{}]]\nkey = \"c\"\nfrom = {}\nto = 1.5\ncount = {}\n", axis, from, count);
}

// The output on one line.
std::string unwrapped(const std::string& text) {
  return std::regex_replace(text, std::regex("\n *"), " ");
}

TEST_CASE("--sweep: a map over another range is drawn in addition to the one asked for") {
  const Scratch scratch("report");
  scratch.write("s.toml", oscillators + over_c("sweep.axis", 0.8, 25) + "[[report.map]]\n" +
                              over_c("report.map.axis", -1, 26));
  REQUIRE(run(scratch, "sweep s.toml -o map.nc").exit_code == 0);
  const Ran ran = run(scratch, "report s.toml --sweep map.nc");
  CHECK(ran.exit_code == 0);
  const std::string out = unwrapped(ran.out);
  CHECK(says(out, "Along c (A, map.nc): stable throughout [0.8, 1.5]"));
  CHECK(says(out, "Along c (A): unstable in 1 interval of [-1, 1.5], 1.72 in total"));  // to 0.72
  CHECK(says(slurp(scratch.path / "s.html"), "Read from map.nc: c from 0.8 to 1.5, 25 points."));
}

TEST_CASE("--sweep: a map of some of the conditions leaves the others to be computed") {
  const Scratch scratch("report");
  scratch.write("s.toml", oscillators + over_c("sweep.axis", 0.3, 25));
  REQUIRE(run(scratch, "sweep s.toml --only B -o B.nc").exit_code == 0);
  REQUIRE(run(scratch, "sweep s.toml --only A -o A.nc").exit_code == 0);
  const std::string unstable = "Along c (A): unstable in 1 interval of [0.3, 1.5], 0.42 in total";
  const Ran ran = run(scratch, "report s.toml --sweep B.nc");
  CHECK(says(unwrapped(ran.out), "Along c (B, B.nc): stable throughout [0.3, 1.5]"));
  CHECK(says(unwrapped(ran.out), unstable));

  for (const char* maps : {"--sweep A.nc --sweep B.nc", "--sweep A.nc B.nc"}) {
    const Ran both = run(scratch, std::string("report s.toml ") + maps);
    CHECK(both.exit_code == 0);
    CHECK(says(unwrapped(both.out), "Along c (A, A.nc): unstable in 1 interval"));
    CHECK(says(unwrapped(both.out), "Along c (B, B.nc): stable throughout"));
    CHECK_FALSE(says(unwrapped(both.out), "Along c (A): "));
  }
}

TEST_CASE("lines are named when the study has several conditions") {
  const Scratch scratch("report");
  const std::string line = over_c("report.map.axis", 0.3, 25);
  scratch.write("s.toml", oscillators + "[[report.map]]\ncondition = \"A\"\n" + line +
                              "[[report.map]]\ncondition = \"B\"\n" + line);
  const Ran ran = run(scratch, "report s.toml");
  CHECK(says(unwrapped(ran.out), "Along c (A): unstable in 1 interval"));
  CHECK(says(unwrapped(ran.out), "Along c (B): stable throughout"));
  CHECK(says(slurp(scratch.path / "s.html"), "Along c: B</h2>"));
}

TEST_CASE("each formulation of a study is swept on its own") {
  const Scratch scratch("report");
  const std::string loop_and_airframe =
      bare + level +
      "[[condition]]\nname = \"bare\"\nformulation = \"airframe\"\nV = 15.0\neta_deg = 0.0\n"
      "a1s_deg = 0.0\n";
  const auto along = [](const std::string& key, const std::string& range) {
    return "[[report.map]]\n[[report.map.axis]]\nkey = \"" + key + "\"\n" + range + "\n";
  };
  scratch.write("s.toml", loop_and_airframe + along("V", "from = 10\nto = 20\ncount = 21"));
  const Ran ran = run(scratch, "report s.toml");
  CHECK(ran.exit_code == 0);
  CHECK(says(unwrapped(ran.out), "Along V (level): "));
  CHECK(says(unwrapped(ran.out), "Along V (bare): unstable in 2 intervals"));

  scratch.write("s.toml", loop_and_airframe + along("gains.K_Lp", "values = [0.5, 1.0]"));
  const Ran gain = run(scratch, "report s.toml");
  CHECK(gain.exit_code == 1);
  CHECK(says(unwrapped(gain.out), "Along K_Lp (level): stable throughout"));
  CHECK(says(unwrapped(gain.out), "The map over K_Lp of bare: s.toml:"));
  CHECK(says(slurp(scratch.path / "s.html"), "has no variable gains.K_Lp.</dd>"));

  // Without a map asked for, the default ones: of closed loops.
  scratch.write("s.toml", loop_and_airframe);
  CHECK(run(scratch, "report s.toml --only bare").exit_code == 0);
}

TEST_CASE("what has no answer is said first, the rest is drawn, exit 1") {
  const Scratch scratch("report");
  scratch.write("s.toml", bare + map_over("gains.K_Lp", 3) + steep + level);
  const Ran ran = run(scratch, "report s.toml");
  CHECK(ran.exit_code == 1);
  CHECK(says(ran.out,
             "No verified equilibrium for 1 of 2 conditions (steep: infeasible); 1 in verified"));
  const std::string page = slurp(scratch.path / "s.html");
  const std::size_t unanswered = page.find("<section id=\"unanswered\""),
                    conditions = page.find("<section id=\"conditions\"");
  CHECK(unanswered < conditions);
  CHECK(conditions != std::string::npos);
  CHECK(says(page, "<dt>Trim of steep</dt><dd>infeasible: "));
  CHECK(says(page, "data-figure=\"participation_2_level\""));
  CHECK(says(page, "<dt>All 3 points over K_Lp (steep)</dt><dd>proved: no equilibrium within"));
  CHECK(says(page, "data-figure=\"locus_2_level\""));
  CHECK_FALSE(says(page, "data-figure=\"locus_1_steep\""));  // no point to draw
}

TEST_CASE("--figures and --tables: every one, in every form") {
  const Scratch scratch("report");
  const std::string page = page_of(scratch, small, "--figures made/fig --tables tab");
  const json data = data_of(page);
  for (const json& figure : data["figures"])
    for (const char* ending : {".svg", ".pdf", ".png"})
      CHECK(program::size_of(scratch.path / "made/fig" / (std::string(figure["name"]) + ending)) >
            500);
  for (const char* name :
       {"conditions", "trims_1", "modes_1_level", "margins", "intervals_1_level"})
    for (const char* ending : {".txt", ".csv", ".md", ".tex"})
      CHECK(program::size_of(scratch.path / "tab" / (std::string(name) + ending)) > 0);
}

// λ² + 2λ + k: two real eigenvalues that meet at -1 where k = 1, between two points.
const std::string spring = R"(
[model]
name = "spring"
state = [{name = "x", unit = "m", rate = "v"}, {name = "v", unit = "m/s", rate = "u - k*x - 2*v"}]
input = [{name = "u", unit = "m/s²"}]
parameter = [{name = "k", unit = "1/s²", value = 2.0}]
[[condition]]
name = "held"
x = 1.0
u = [-5.0, 5.0]
[[sweep.axis]]
key = "k"
from = 0.3
to = 3.3
count = 7
)";

TEST_CASE("eigenvalues that meet: drawn without a chord, with ticks of the parameter") {
  const Scratch scratch("report");
  const std::string page = page_of(scratch, spring, "--figures fig");
  CHECK(says(page, "; largest Re λ -0.163 1/s at k = 0.3 1/s²."));  // -1 + √0.7
  CHECK(says(page, "Constant: x = 1 m, v = 0 m/s."));
  CHECK(says(page, ">u [m/s²]<"));
  CHECK_FALSE(says(page, ">v [m/s]<"));
  CHECK(says(page, "k from 0.3 to 3.3 1/s²; dashed: limits"));
  CHECK(says(page, ">upper limit<"));
  const std::string script = slurp(scratch.path / "fig/figures.gp");
  const std::size_t locus = script.find("set output 'locus_1_held.svg'");
  CHECK(says(script.substr(locus), "set label '2 1/s²' at screen"));
  const std::size_t meets = script.find("\n-1 0\n", locus), end = script.find("EOD", meets);
  REQUIRE(end != std::string::npos);
  std::istringstream curve(script.substr(script.rfind("EOD\n", meets) + 4, end));
  double re = 0, im = 0, last_re = -1, last_im = 0;
  for (int points = 0; curve >> re >> im; last_re = re, last_im = im, ++points)
    if (points > 0) CHECK(((re == -1 && last_re == -1) || (im == 0 && last_im == 0)));
  CHECK_NEAR(last_im, std::sqrt(3.3 - 1), 1e-6);  // seven digits
}

TEST_CASE("margins, the study's own gains and the end of the flight are marked") {
  const Scratch scratch("report");
  const std::string map =
      "[[report.map]]\n[[report.map.axis]]\nkey = \"gains.K_Lp\"\nvalues = [0.5, 1.0]\n"
      "[[report.map.axis]]\nkey = \"gains.K_Li\"\nvalues = [0.05, 0.1]\n";
  const std::string page =
      page_of(scratch, "[report]\naudit = \"skip\"\n" + map + level, "--figures fig");
  const std::string script = slurp(scratch.path / "fig/figures.gp");
  const json gains = json::parse(run(scratch, "margins s.toml -f json").out)["conditions"][0];
  for (const json& loop : gains["loops"]) {
    if (!loop["in_use"]) continue;
    const double phase = loop["margins"]["phase"].get<double>() * tiltrim::degrees;
    CHECK(says(script, fmt::format("set label '{:.3g}°' at", phase)));
    CHECK(says(script, fmt::format("\n{:.7g} ", loop["margins"]["phase_at"].get<double>())));
  }
  CHECK(says(page, ">this study<"));
  const std::size_t map_at = script.find("set output 'stability_"),
                    shaded = script.find("plot $", map_at);
  REQUIRE(shaded != std::string::npos);
  const auto from = script.begin() + std::ptrdiff_t(map_at);
  CHECK(std::count(from, script.begin() + std::ptrdiff_t(shaded), '\n') > 100);  // of four points
  CHECK(says(script, "\n0.75 0.085\n"));  // K_Lp and K_Li of the reference
  CHECK(says(page, "features at later times"));
  CHECK(says(page, "The flight ends at 3.43 s: "));
}

TEST_CASE("bad calls: exit 2, nothing written") {
  const Scratch scratch("report");
  scratch.write("s.toml", small);
  check_refused(scratch, "report", {"STUDY.toml is missing"});
  check_refused(scratch, "report nowhere.toml", {"nowhere.toml"});
  check_refused(scratch, "report s.toml -o s.toml", {"s.toml"});
  check_refused(scratch, "report s.toml -o nowhere/page.html", {"nowhere"});
  check_refused(scratch, "report s.toml --only lvel", {"no condition 'lvel' (nearest: 'level')"});
  check_refused(scratch, "report s.toml --figures s.toml/fig", {"s.toml: Not a directory"});
  check_refused(scratch, "report s.toml --tables s.toml", {"s.toml: Not a directory"});
  check_refused(scratch, "report s.toml --format json", {"--format"});
}

TEST_CASE("without gnuplot: said with the package's name, no page") {
  const Scratch scratch("report");
  scratch.write("s.toml", small);
  const Ran ran = run(scratch, "report s.toml", {.before = "PATH=/nowhere;"});
  CHECK(ran.exit_code == 2);
  CHECK(says(ran.err, "gnuplot is not installed (Debian: gnuplot-nox)"));
  CHECK(scratch.files() == std::set<std::string>{"s.toml"});
}

TEST_CASE("Ctrl-C: a page of what there is, which says so first; exit 130") {
  const Scratch scratch("report");
  std::string many = bare + map_over("gains.K_Lp", 3);
  for (int i = 0; i < 400; ++i)
    many +=
        fmt::format("[[condition]]\nname = \"{}\"\nV = 15.0\ngamma_deg = 80.0\neta_deg = 0.0\n", i);
  scratch.write("s.toml", many);
  const program::Running report = start(scratch, "report s.toml");
  let_compute(report, 500ms);
  ::kill(report.pid, SIGINT);
  const Ran ran = finish(report, 120s);
  CHECK(ran.exit_code == 128 + SIGINT);
  const std::string first = "Interrupted, so incomplete: not examined are condition ";
  CHECK(says(ran.out, first));
  CHECK(says(ran.out, " examined"));  // of those, and no others
  CHECK_FALSE(says(ran.out, "400 conditions"));
  CHECK(says(slurp(scratch.path / "s.html"),
             "<p id=\"verdict\" class=\"verdict doubtful\">" + first));
}

TEST_CASE("Ctrl-C in a map: the conditions are examined, the map and what follows are not") {
  const Scratch scratch("report");
  const std::string lines =  // seconds, on one thread
      "[[report.map.axis]]\nkey = \"V\"\nfrom = 10\nto = 20\ncount = 1000\n";
  const std::string map = map_over("gains.K_Lp", 800) + lines;
  scratch.write("s.toml", "[report]\naudit = \"skip\"\n" + map + level);
  const program::Running report = start(scratch, "report s.toml --threads 1");
  let_compute(report, 1s);
  ::kill(report.pid, SIGINT);
  const Ran ran = finish(report, 120s);
  CHECK(ran.exit_code == 128 + SIGINT);
  CAPTURE(ran.out);
  CHECK(says(ran.out, "Interrupted, so incomplete: not examined are "));
  CHECK(says(std::regex_replace(ran.out, std::regex("\n"), " "),
             "the map over K_Lp and V, the flight."));
}

}  // namespace report_cli_test
