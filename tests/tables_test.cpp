// The paper's tables: printed digits, the two constants they imply, slips, and the true equilibria.
#include "tables/tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

using namespace tiltrim;

namespace tables_test {

namespace {

constexpr double pi = std::numbers::pi;
const std::filesystem::path data = TILTRIM_SOURCE_DIR "/data";

const PublishedTables& published() {
  static const PublishedTables p = load_published_tables(data / "paper_tables.json");
  return p;
}

Vehicle vehicle() {
  Vehicle v;
  v.polar = std::make_shared<Polar>(load_polar(data / "naca8h12_re150k.csv"));
  return v;
}

const PaperTables& tables() {
  static const PaperTables t = paper_tables(data, vehicle());
  return t;
}

Agreement agreement(const char* printed, double computed) {
  return compare(read_printed(printed), computed).agreement;
}

// A file with this text, removed at the end.
struct Scratch {
  std::filesystem::path file;
  explicit Scratch(const std::string& text)
      : file(std::filesystem::temp_directory_path() / "tiltrim_tables_test.json") {
    std::ofstream(file) << text;
  }
  ~Scratch() { std::filesystem::remove(file); }
};

std::string what(const std::function<void()>& f) {
  try {
    f();
  } catch (const std::exception& e) {
    return e.what();
  }
  return {};
}

}  // namespace

TEST_CASE("printed numbers: value and one unit of the last digit") {
  CHECK(read_printed("0.01707").value == 0.01707);
  CHECK_NEAR(read_printed("0.01707").unit, 1e-5, 1e-20);
  CHECK(read_printed("-0.5245").value == -0.5245);
  CHECK(read_printed("15").value == 15.0);
  CHECK(read_printed("15").unit == 1.0);
  CHECK(read_printed("0").value == 0.0);
  CHECK(read_printed("-pi/4").value == -pi / 4);
  CHECK(read_printed("-pi/4").unit == pi / 4);
  CHECK(read_printed("pi").value == pi);
  for (const char* bad : {"", "-", ".", "1.2.3", "1e5", "nan", "pi/0", "pi/-2", "pi2", "0.1 ",
                          "--1", "1234567890123456789"})
    CHECK_MESSAGE(what([&] { read_printed(bad); }).find(bad) != std::string::npos, bad);
}

TEST_CASE("agreement with printed digits") {
  CHECK(agreement("0.50", 0.50) == Agreement::exact);
  CHECK(agreement("0.50", 0.503) == Agreement::both);
  CHECK(agreement("0.50", 0.508) == Agreement::truncated);
  CHECK(agreement("0.50", 0.496) == Agreement::rounded);
  CHECK(agreement("0.50", 0.5101) == Agreement::different);
  CHECK(agreement("0.50", 0.4949) == Agreement::different);
  CHECK(agreement("-0.50", -0.508) == Agreement::truncated);
  CHECK(agreement("-0.50", 0.508) == Agreement::opposite_sign);
  CHECK(agreement("0.50", 0.51) == Agreement::different);  // the next printed number
  CHECK(agreement("-pi/2", pi / 2) == Agreement::opposite_sign);
  CHECK(compare(read_printed("0.5"), {}).agreement == Agreement::not_computed);
  CHECK_FALSE(compare(read_printed("0.5"), {}).deviation.has_value());
  CHECK_NEAR(*compare(read_printed("0.50"), 0.508).deviation, 0.8, 1e-12);
  CHECK(compare(read_printed("0.50"), 0.496).matches());
  CHECK_FALSE(compare(read_printed("0.50"), -0.50).matches());
}

TEST_CASE("published tables: what is wrong with the file is said with its name") {
  CHECK(published().theta0[1].text == "-0.66627");
  const auto refusal = [](const std::string& text) {
    const Scratch scratch(text);
    const std::string said = what([&] { load_published_tables(scratch.file); });
    CHECK(said.starts_with(scratch.file.string()));
    return said;
  };
  CHECK(refusal("{").find("not JSON") != std::string::npos);
  CHECK(refusal("[]").find("source: missing") != std::string::npos);
  CHECK(refusal(R"({"source": "s", "columns": ["a"]})").find("columns: expected an array of 3") !=
        std::string::npos);
  CHECK(refusal(R"({"source": "s", "columns": ["a","b","c"], "table1": {"eta": ["0", 1, "0"]}})")
            .find("table1.eta[1]: expected a string") != std::string::npos);
  CHECK(refusal(R"({"source": "s", "columns": ["a","b","c"], "table1": {"eta": ["0", "x", "0"]}})")
            .find("table1.eta[1]: \"x\" is not a printed number") != std::string::npos);
  CHECK(what([] { load_published_tables("no/such.json"); }).find("no/such.json") !=
        std::string::npos);
}

TEST_CASE("Tables 1 and 2: exact, but for the two slips of Table 1") {
  const auto& t = tables();
  for (const Row& row : t.table1.rows)
    for (std::size_t i = 0; i < 3; ++i) {
      const bool slip = (row.name == "gamma" && i == 0) || (row.name == "V" && i == 1);
      CAPTURE(row.name);
      CHECK((row.cells[i].agreement == Agreement::exact) == !slip);
      CHECK(row.cells[i].remark.empty() == !slip);
    }
  CHECK(t.table1.rows[1].cells[0].agreement == Agreement::opposite_sign);
  CHECK(t.table2.rows.size() == 3);
  for (const Row& row : t.table2.rows)
    for (const Cell& cell : row.cells) CHECK(cell.agreement == Agreement::exact);
}

TEST_CASE("Table 3: theta0 and a1s to every printed digit, truncated, one sign slip") {
  const Table& t = tables().table3;
  const Columns<double> theta0{-0.60807, -0.66627, -0.71378}, a1s{-0.002555, -0.0603, -0.00762};
  const auto truncated = [](double value, double unit) {
    return std::trunc(value / unit * (1 + 1e-15)) * unit;
  };
  const Columns<double> a1s_unit{1e-6, 1e-4, 1e-5};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK_NEAR(truncated(*t.rows[0].cells[i].computed, 1e-5), theta0[i], 1e-12);
    CHECK_NEAR(truncated(*t.rows[2].cells[i].computed, a1s_unit[i]), a1s[i], 1e-12);
    CHECK(t.rows[2].cells[i].matches());
  }
  CHECK(t.rows[0].cells[0].agreement == Agreement::opposite_sign);
  CHECK(t.rows[0].cells[0].remark.find("sign slip") != std::string::npos);
  CHECK(t.rows[0].cells[1].matches());
  CHECK(t.rows[0].cells[2].matches());
  CHECK_FALSE(t.rows[1].cells[0].computed.has_value());  // no elevator moment at -90°
}

TEST_CASE("identification: Ep = 1.4000 and the range of k from the six numbers alone") {
  const Identification& id = tables().identified;
  CHECK(id.status == IdentifyStatus::reproduced);
  CHECK_NEAR(id.thrust_excess, 1.4000, printed_to("1.4000"));
  CHECK_NEAR(id.effective_speed, 2.0146, printed_to("2.0146"));
  CHECK(id.worst <= 0.5);
  CHECK(id.thrust_excess_range->lower < 1.4);
  CHECK(id.thrust_excess_range->upper > 1.4);
  CHECK(id.evaluations < IdentifyOptions{}.max_evaluations);
  const Identification& fixed = tables().at_excess_1_4;
  CHECK(fixed.thrust_excess == 1.4);
  CHECK_NEAR(fixed.k_range->lower, 0.0424923, printed_to("0.0424923"));
  CHECK_NEAR(fixed.k_range->upper, 0.0424944, printed_to("0.0424944"));
  CHECK(tables().as_rounded.status == IdentifyStatus::reproduced);
  CHECK_NEAR(tables().as_rounded.thrust_excess, 1.40002, printed_to("1.40002"));
  CHECK(tables().as_rounded_at_excess_1_4.status == IdentifyStatus::not_reproduced);
  for (const ColumnConstants& c : id.columns) {
    CHECK((c.thrust_excess.lower < id.thrust_excess && id.thrust_excess < c.thrust_excess.upper));
    CHECK((c.k.lower < id.k && id.k < c.k.upper));
  }
}

TEST_CASE("forces of (15): the rows vanish, and trim_table() agrees") {
  const auto& t = tables();
  Vehicle v = vehicle();
  v.aircraft.thrust_excess = t.identified.thrust_excess;
  for (std::size_t i = 0; i < 3; ++i) {
    const double CL = published().CL[i].value, CD = published().CD[i].value, k = t.identified.k;
    const double alpha = published().alpha[i].value, eta = published().eta[i].value;
    const ForceBalance b = solve_forces(t.identified.thrust_excess, k, CL, CD, -pi / 2, alpha, eta);
    const double thrust = t.identified.thrust_excess * b.theta0, phi = alpha + eta - b.a1s;
    CHECK_NEAR(thrust * std::cos(phi) - k * CD + 1.0, 0.0, 1e-15);
    CHECK_NEAR(thrust * std::sin(phi) + k * CL, 0.0, 1e-15);
    const TableTrim trimmed = trim_table(v, {.gamma = -pi / 2,
                                             .alpha = alpha,
                                             .eta = eta,
                                             .CL = CL,
                                             .CD = CD,
                                             .CM = published().CM[i].value,
                                             .k = k});
    CHECK(trimmed.trim.status == TrimStatus::converged);
    CHECK_NEAR(trimmed.theta0, b.theta0, 1e-10);  // the trim's own tolerance
    CHECK_NEAR(trimmed.a1s, b.a1s, 1e-10);
    CHECK_NEAR(trimmed.CM_elevator, t.elevator.columns[i].CM_increment,
               1e-7);  // over k cbar = 0.015
  }
}

TEST_CASE("elevator row: no linear elevator stands behind it") {
  const auto& c = tables().elevator.columns;
  for (const ElevatorColumn& e : c) CHECK(e.CM_required + e.CM_thrust == 0.0);
  CHECK_NEAR(c[0].CM_increment, -0.0467, printed_to("0.0467"));
  CHECK_NEAR(c[1].CM_increment, 0.9210, printed_to("0.9210"));
  CHECK_NEAR(c[2].CM_increment, 0.0244, printed_to("0.0244"));
  CHECK(c[1].slope < 0.0);
  CHECK(c[0].slope > 0.0);
  // Level flight: eta = 0, so CM_thrust = -(xR + zH) sin a1s Ep theta0/(k cbar), and Ep theta0 sin
  // a1s = k CL
  CHECK_NEAR(c[2].CM_thrust, -0.09 * published().CL[2].value / 0.36, 1e-12);
}

TEST_CASE("slips: each is confirmed by its numbers") {
  const auto& slips = tables().slips;
  CHECK(slips.size() >= 30);
  for (const Slip& s : slips) {
    CAPTURE(s.where);
    CHECK(s.confirmed());
    CHECK_FALSE((s.printed.empty() || s.consistent.empty() || s.why.empty()));
    for (const Evidence& e : s.evidence) CHECK(std::isfinite(e.value));
  }
  CHECK_FALSE(Slip{}.confirmed());
  const auto number = [&](std::string_view evidence) {
    for (const Slip& s : slips)
      for (const Evidence& e : s.evidence)
        if (e.what == evidence) return e.value;
    return std::nan("");
  };
  CHECK_NEAR(number("Ep |theta0| at gamma = 0 with lift up, V and vi free"), 0.0952,
             printed_to("0.0952"));
  CHECK_NEAR(number("largest radius with a real vi, level"), 5.7 * 6 * 0.05 / (pi * 32 * 0.71378),
             1e-15);
  CHECK(number("smallest |eigenvalue| of (14) as printed, the largest of three points") < 1e-12);
}

TEST_CASE("slips: the conserved sum of (14) as printed, at random points") {
  Vehicle printed = vehicle();
  printed.equations = Equations::printed;
  const Model loop = closed_loop(printed);
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd x(6);
    for (double& v : x) v = 2.0 * uniform(random) - 1.0;
    const Command command = corridor(120.0 * uniform(random));
    const Eigen::VectorXd rate =
        evaluate(loop, {x, Eigen::VectorXd(0), closed_loop_parameters(printed, command)}).rates;
    const double scale = 1.0 + rate.cwiseAbs().maxCoeff();
    CHECK_NEAR(rate[4] + rate[5], 2 * rate[0] / 9.81, 1e-14 * scale);
  }
}

TEST_CASE("corrected table: theta = 0 has no equilibrium, and says what stops it") {
  const auto& c = tables().level_body.columns;
  for (const CorrectedColumn& column : c) {
    CAPTURE(column.finding);
    CHECK(column.trim.status == TrimStatus::infeasible);
    CHECK_FALSE(column.stopped_by.empty());
    CHECK_FALSE(column.a1s.has_value());
    CHECK_FALSE(column.verdict.has_value());
  }
  const auto stops = [](const CorrectedColumn& column, std::string_view word) {
    return std::ranges::any_of(column.stopped_by,
                               [&](const auto& s) { return s.find(word) != std::string::npos; });
  };
  CHECK(stops(c[0], "pitch equation"));
  CHECK(stops(c[1], "path equation"));
  CHECK(stops(c[2], "limits of a1s"));
}

TEST_CASE("corrected table: theta free is held and stable, at the reference equilibria") {
  // data/reference_cases.json
  const Columns<double> theta{0.28664746759891757, 0.7629973267152013, 0.029481630070231437};
  const Columns<double> theta0{0.8013582754386792, 0.7053740943909972, 0.02459682949583505};
  const auto& c = tables().free_pitch.columns;
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(c[i].trim.status == TrimStatus::converged);
    CHECK_NEAR(*c[i].theta, theta[i], 1e-9);
    CHECK_NEAR(*c[i].theta0, theta0[i], 1e-9);
    CHECK(c[i].verdict == Verdict::stable);
  }
}

TEST_CASE("the climb with (3) as printed: no equilibrium, and no number that looks like one") {
  const CorrectedColumn& c = tables().wake_as_printed;
  CHECK(c.trim.status == TrimStatus::infeasible);
  CHECK(c.finding.find("no equilibrium") != std::string::npos);
  CHECK_FALSE((c.theta || c.theta0 || c.a1s || c.delta_e || c.verdict));
}

TEST_CASE("the same input gives the same bits") {
  const Identification a = identify(six_numbers(published()), Aircraft{});
  const Identification& b = tables().identified;
  const auto same = [](double x, double y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  CHECK(same(a.thrust_excess, b.thrust_excess));
  CHECK(same(a.k, b.k));
  CHECK(same(a.k_range->lower, b.k_range->lower));
  CHECK(same(a.thrust_excess_range->upper, b.thrust_excess_range->upper));
  CHECK(a.evaluations == b.evaluations);
  const PaperTables again = paper_tables(data, vehicle());
  CHECK(again.findings == tables().findings);
  for (std::size_t i = 0; i < again.slips.size(); ++i)
    for (std::size_t j = 0; j < again.slips[i].evidence.size(); ++j)
      CHECK(same(again.slips[i].evidence[j].value, tables().slips[i].evidence[j].value));
}

}  // namespace tables_test
