// The checker of certificates: its equations against the library's, what it accepts, and what it
// refuses. The certificates are made by the plain prover of proof_writer.hpp.
#include "check_proof/check_proof.hpp"

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "check_proof/certificate.hpp"
#include "flight/closed_loop_proof.hpp"
#include "linearize/linearize.hpp"
#include "report/proofs.hpp"
#include "tests/check.hpp"
#include "tests/proof_oracle.hpp"
#include "tests/proof_writer.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;
using namespace tiltrim::checking;
using nlohmann::json;

namespace check_proof_test {

namespace {

const std::string studies = TILTRIM_SOURCE_DIR "/studies/";

double mid(const Ball& b) { return arf_get_d(arb_midref(b.get()), ARF_RND_NEAR); }

const ProofToWrite& corridor_of(const std::string& study, double from, double to) {
  static std::vector<std::unique_ptr<ProofToWrite>> all;
  all.push_back(std::make_unique<ProofToWrite>(
      ProofToWrite{load_study(studies + study), {{"h", {from, to}}}}));
  return *all.back();
}

// Of the scheduled gains, over 6 m of the corridor and 5 % of the mass: several leaves.
const std::string& proof() {
  static const std::string text = [] {
    ProofToWrite asked{load_study(studies + "scheduled.toml"),
                       {{"h", {60, 66}}, {"aircraft.mass", {3.9, 4.1}}}};
    return written_proof(asked);
  }();
  return text;
}

std::string refused(const std::string& text) {
  const ProofCheck check = check_proof_text(text);
  return check.status == CertificateStatus::verified ? "" : check.reason;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}
std::string text_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace

TEST_CASE("the checker's loop has the rates and the Jacobian of linearize()") {
  const ProofToWrite& asked = corridor_of("scheduled.toml", 0, 120);
  const Statement s = statement_of(asked);
  for (const double h : {3.0, 30.0, 52.0, 90.0, 117.0}) {
    const Command command = corridor(h);
    Vehicle vehicle = asked.study.vehicle;
    vehicle.gains = gains_at(asked.study.schedule, command.eta);
    const TrimProblem problem = closed_loop_problem(vehicle, command, Axes::wind);
    const TrimResult trimmed = trim_closed_loop(problem, vehicle, command);
    REQUIRE(trimmed);
    const LinearModel linear = linearize(problem.model, trimmed.point);
    const std::vector<Side> all = sides(s, {{h, std::nextafter(h, 200)}});
    REQUIRE(all.size() == 1);
    std::array<Dual, 6> x;
    for (std::size_t i = 0; i < 6; ++i) {
      x[i] = Dual(Form(trimmed.point.x[Eigen::Index(i)]));
      x[i].slopes[i] = Form(1.0);
    }
    const Loop<Dual> loop = closed_loop(all[0].numbers, *s.polar, x);
    const auto check_row = [&](Eigen::Index row, const Dual& rate, double sign) {
      for (Eigen::Index j = 0; j < 6; ++j) {
        const double own = sign * mid(rate.slopes[std::size_t(j)].value());
        CHECK_NEAR(own, linear.A(row, j), 1e-11 * (1 + std::abs(own)));
      }
      CHECK_NEAR(mid(rate.value.value()), 0.0, 1e-9);  // the trim's tolerance
    };
    check_row(0, loop.rates.V, -1);
    check_row(1, loop.rates.gamma, -1);
    check_row(3, loop.rates.q, 1);
    // det(sI - A) at the eigenvalues' real sum: the coefficient of s⁵ is -tr A.
    const auto c = characteristic(pencil(all[0].numbers, loop));
    CHECK_NEAR(mid(c[5]), -linear.A.trace(), 1e-10);
    CHECK(roots_right(pencil(all[0].numbers, loop), Ball(0)) == 0);
  }
}

TEST_CASE("the checker's spline and schedule are those of the library") {
  const ProofToWrite& asked = corridor_of("scheduled.toml", 0, 120);
  const Statement s = statement_of(asked);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-3.1, 3.1), height(0, 120);
  for (int i = 0; i < 300; ++i) {
    const double a = angle(random), h = height(random);
    const Polar::Slope own = asked.study.vehicle.polar->slope_at(a);
    const Form at(a);
    CHECK_NEAR(mid(s.polar->at(0, at).value()), own.value.CL, 1e-12);
    CHECK_NEAR(mid(s.polar->at(1, at).value()), own.value.CD, 1e-12);
    CHECK_NEAR(mid(s.polar->slope(2, at).value()), own.slope.CM, 1e-11);
    const Command command = corridor(h);
    const Commanded commanded = checking::corridor(Form(h), h < 20 ? 1 : 2);
    CHECK_NEAR(mid(commanded.V.value()), command.V, 1e-13);
    CHECK_NEAR(mid(commanded.angle.value()), command.eta, 1e-14);
  }
}

TEST_CASE("functions of a box enclose their values everywhere in it") {
  const Statement s = statement_of(corridor_of("scheduled.toml", 0, 120));
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 200; ++i) {
    const double m = 0.9 * any(random), r = 0.3 * std::abs(any(random)), t = any(random);
    const Form x = Form::variable(m, r, 0, 1);
    const Form point(Ball(m) + Ball(r) * Ball(t));
    const auto encloses = [&](const Form& over, const Form& at) {
      const Ball value = over.value() + Ball(t) * (over.c[1] + Ball(t) * over.c[2]);
      return arb_contains(widened(value, over.rest + Ball(1e-15)).get(), range(at).get());
    };
    CHECK(encloses(sin(x), sin(point)));
    CHECK(encloses(cos(x), cos(point)));
    CHECK(encloses(sqrt(x + Form(2.0)), sqrt(point + Form(2.0))));
    CHECK(encloses(inverse(x + Form(2.0)), inverse(point + Form(2.0))));
    CHECK(encloses(x * sin(x), point * sin(point)));
    CHECK(encloses(s.polar->at(0, x), s.polar->at(0, point)));
    CHECK(encloses(s.polar->slope(1, x), s.polar->slope(1, point)));
    const Form h = Form(70.0) + Form(40.0) * x, at = Form(70.0) + Form(40.0) * point;
    CHECK(encloses(checking::corridor(h, 2).V, checking::corridor(at, 2).V));
    CHECK(encloses(checking::corridor(h, 2).angle, checking::corridor(at, 2).angle));
  }
}

TEST_CASE("stable, unstable, untrimmable and undecided boxes are told apart") {
  const ProofCheck stable = check_proof_text(proof());
  REQUIRE(stable.status == CertificateStatus::verified);
  REQUIRE(stable.theorems.size() == 1);
  CHECK(stable.theorems[0].stable == 1);
  CHECK(stable.theorems[0].leaves > 1);
  const Study reference = load_study(studies + "map_corridor.toml");
  ProofToWrite slow{reference, {{"h", {60, 60.5}}}};
  const ProofCheck one = check_proof_text(written_proof(slow));
  REQUIRE(one.status == CertificateStatus::verified);
  CHECK(one.theorems[0].stable + one.theorems[0].unstable + one.theorems[0].undecided ==
        doctest::Approx(1));
  // No level flight as an airplane at 2 m/s.
  ProofToWrite crawl{load_study(studies + "paper.toml"),
                     {{"V", {2, 2.1}}, {"gamma", {0, 0.01}}, {"eta", {0, 0.01}}}};
  const ProofCheck none = check_proof_text(written_proof(crawl));
  REQUIRE(none.status == CertificateStatus::verified);
  CHECK(none.theorems[0].no_trim == 1);
  // Two theorems in one file; the result does not depend on threads.
  const ProofCheck two = check_proof_text(proof() + proof(), {.threads = 1});
  REQUIRE(two.theorems.size() == 2);
  CHECK(two.theorems[1].stable == 1);
}

TEST_CASE("what prove() writes is verified, and its verdicts are those of the checker") {
  const auto checked = [](const std::string& name, double from, double to) {
    const Study study = load_study(studies + name);
    ProveOptions options;
    options.smallest = 1e-5;  // few boxes at a crossing: each costs a search for the equilibrium
    const tiltrim::Theorem proved =
        prove(closed_loop_proof(study.vehicle, study.schedule, "corridor",
                                *study.conditions[0].command(), {{"h", from, to}}),
              options);
    const ProofCheck check = check_proof_text(certificate_of(study, {proved}));
    CHECK_MESSAGE(check.reason == "", check.box);
    REQUIRE(check.theorems.size() == 1);
    CHECK(check.theorems[0].stable == doctest::Approx(proved.stable));
    CHECK(check.theorems[0].unstable == doctest::Approx(proved.unstable));
    return check.theorems[0];
  };
  CHECK(checked("prove_corridor.toml", 60, 66).stable == 1);
  CHECK(checked("prove_corridor.toml", 10.3, 10.35).stable == 1);  // V constant, η bends
  CHECK(checked("prove_reference.toml", 48, 48.2).unstable == 1);
  // Across a crossing: stable below, unstable above, and a sliver of which nothing is stated.
  const CheckedTheorem both = checked("prove_reference.toml", 51.6, 51.7);
  CHECK(both.stable > 0.01);
  CHECK(both.unstable > 0.9);
  CHECK(both.undecided > 0);
  CHECK(both.undecided < 1e-4);
}

TEST_CASE("a damping ratio is verified on its own ray, and refused where it is altered") {
  const Study study = load_study(studies + "prove_corridor.toml");
  const auto proved = [&](double from, double to, double damping) {
    ProveOptions options;
    options.damping = damping;
    options.smallest = 1e-5;
    return prove(
        closed_loop_proof(study.vehicle, study.schedule, "corridor", {15, 0, 0}, {{"h", from, to}}),
        options);
  };
  // Across the height at which a mode's damping ratio passes through 0.3, left of the axis all
  // along.
  const tiltrim::Theorem both = proved(76.5, 77.2, 0.3);
  const std::string text = certificate_of(study, {both});
  const ProofCheck check = check_proof_text(text);
  CHECK_MESSAGE(check.reason == "", check.box);
  REQUIRE(check.theorems.size() == 1);
  CHECK(check.theorems[0].damping == 0.3);
  CHECK(check.theorems[0].stable > 0.2);
  CHECK(check.theorems[0].unstable > 0.2);
  CHECK(check.theorems[0].undecided < 1e-3);
  const OracleFindings found = oracle(read_certificate(text).front(), study, 200, 7);
  CHECK_MESSAGE(found.contradictions == 0, found.first);

  const std::vector<std::string> lines = lines_of(certificate_of(study, {proved(70, 72, 0.1)}));
  REQUIRE(refused(text_of(lines)) == "");
  const auto altered = [&](std::size_t line, const auto& change) {
    std::vector<std::string> all = lines;
    auto object = nlohmann::ordered_json::parse(all[line]);
    change(object);
    all[line] = object.dump();
    return refused(text_of(all));
  };
  std::size_t leaf = 1;
  while (!json::parse(lines[leaf]).contains("leaf")) ++leaf;
  CHECK(altered(0, [](auto& header) { header["damping"] = "0x1.6666666666666p-1"; }) != "");  // 0.7
  CHECK(altered(0, [](auto& header) { header["damping"] = "0x0p+0"; }) != "");
  CHECK(altered(0, [](auto& header) { header.erase("damping"); }).find("a 'ray' belongs") !=
        std::string::npos);
  CHECK(altered(leaf, [](auto& one) { one["sides"][0].erase("ray"); }).find("a 'ray' belongs") !=
        std::string::npos);
  CHECK(altered(leaf, [](auto& one) { one["sides"][0]["ray"]["roots"] = 2; }) != "");
  CHECK(altered(leaf, [](auto& one) {
          one["leaf"] = "unstable";
          one["sides"][0]["ray"]["roots"] = 2;
        }).find("no root has less damping") != std::string::npos);
  CHECK(altered(leaf, [](auto& one) {
          one["sides"][0]["ray"]["v"][0] = {"-0x1p+0", "0x0p+0"};
        }) != "");
  CHECK(altered(leaf, [](auto& one) { one["sides"][0]["ray"]["w"][0] = "0x1p-1"; }) != "");
}

TEST_CASE("a tube of the actuators is no tube of the integrals, and needs integrals that follow") {
  const Study study = load_study(studies + "prove_corridor.toml");
  const ProveProblem problem =
      closed_loop_proof(study.vehicle, study.schedule, "corridor", {15, 0, 0}, {{"h", 70, 74}});
  REQUIRE(problem.unknowns == std::vector<std::string>{"theta", "theta0", "deflection"});
  const std::vector<std::string> lines = lines_of(certificate_of(study, {prove(problem)}));
  REQUIRE(refused(text_of(lines)) == "");
  const auto altered = [&](const auto& change) {
    std::vector<std::string> all = lines;
    auto header = nlohmann::ordered_json::parse(all[0]);
    change(header);
    all[0] = header.dump();
    return refused(text_of(all));
  };
  CHECK(altered([](nlohmann::ordered_json& header) {
          header["unknowns"] = {"theta", "energy_integral", "distribution_integral"};
        }) != "");
  constexpr std::array<std::size_t, 2> integral_gains{2, 4};  // K_Ei, K_Li
  for (const std::size_t gain : integral_gains) {
    const std::string why = altered([&](nlohmann::ordered_json& header) {
      for (nlohmann::ordered_json& set : header["schedule"]["gains"]) set[gain] = "0x0p+0";
    });
    CAPTURE(why);
    CHECK(why.find("the integrals do not follow") != std::string::npos);
  }
}

TEST_CASE("both sides of the handover are needed") {
  ProofToWrite asked = corridor_of("scheduled.toml", 46.4, 46.6);  // η = 60° at 46.436 m
  asked.depth = 14;
  const std::string text = written_proof(asked);
  REQUIRE(refused(text) == "");
  std::vector<std::string> lines = lines_of(text);
  int cut = 0;
  for (std::string& line : lines) {
    json leaf = json::parse(line);
    if (!leaf.contains("sides") || leaf["sides"].size() < 2) continue;
    ++cut;
    const std::string before = line;
    leaf["sides"].erase(1);
    line = leaf.dump();
    CHECK(refused(text_of(lines)) != "");
    line = before;
  }
  CHECK(cut > 0);
}

TEST_CASE("a certificate must be about the study") {
  const Statement s = statement_of(corridor_of("scheduled.toml", 0, 120));
  const ProofSubject subject = subject_of(s);
  const auto reason = [&](const ProofSubject& about) {
    return check_proof_text(proof(), {.about = {{"corridor", about}}}).reason;
  };
  CHECK(reason(subject) == "");
  ProofSubject other = subject;
  other.domain = {{"h", {60, 66}}, {"aircraft.mass", {3.9, 4.1}}};
  CHECK(reason(other) == "");
  other.domain["h"][1] = 67;
  CHECK(reason(other) == "the range of 'h' is not that of the study");
  other.domain = {{"h", {60, 66}}, {"aircraft.mass", {3.9, 4.1}}, {"aircraft.CM_de", {-1, 0}}};
  CHECK(reason(other) == "the parameters are not those of the study");
  other = subject;
  other.margin = 0.1;
  CHECK(reason(other) == "the margin is less than that of the study");
  other = subject;
  other.damping = 0.1;
  CHECK(reason(other) == "the damping ratio is less than that of the study");
  other = subject;
  other.numbers["aircraft.CM_q"] = std::nextafter(other.numbers["aircraft.CM_q"], 0);
  CHECK(reason(other) == "'aircraft.CM_q' is not that of the study");
  other = subject;
  other.gains[1][2] *= 2;
  CHECK(reason(other) == "the scheduled gains are not those of the study");
  other = subject;
  other.tilts[1] += 0.1;
  CHECK(reason(other) == "the tilts of the schedule are not those of the study");
  other = subject;
  other.polar[2][100] += 1e-9;
  CHECK(reason(other) == "the polar is not that of the study");
  other = subject;
  other.limits["a1s"][1] = 0.36;
  CHECK(reason(other) == "the limits are not those of the study");
  CHECK(check_proof_text(proof(), {.about = {{"level", subject}}}).reason ==
        "the study has no condition 'corridor'");
}

TEST_CASE("random points of what is proved do not contradict it") {
  const Study study = load_study(studies + "scheduled.toml");
  const checking::Theorem theorem = read_certificate(proof()).front();
  const OracleFindings found = oracle(theorem, study, std::size_t(trials(2000)), 5);
  CHECK(found.stable == std::size_t(trials(2000)));
  CHECK_MESSAGE(found.contradictions == 0, found.first);
  // A wrong verdict does not escape it.
  checking::Theorem wrong = theorem;
  for (Leaf& leaf : wrong.leaves) leaf.claim = Claim::unstable;
  CHECK(oracle(wrong, study, 20, 5).contradictions == 20);
}

}  // namespace check_proof_test
