// Theorems about a study's [model], where the truth is known in closed form.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "linearize/linearize.hpp"
#include "model/lookup.hpp"
#include "prove/prove.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"

using namespace tiltrim;

namespace prove_study_test {

namespace {

Study study_of(const std::string& text) { return parse_study(text, "prove.toml"); }

// Theorem about the first condition.
Theorem proved(const std::string& text, std::size_t boxes = 3000) {
  const Study study = study_of(text);
  ProveOptions options;
  options.max_boxes = boxes;
  options.undecided = study.prove->undecided;
  options.margin = study.prove->margin;
  return prove(prove_problem(study, study.conditions.at(0)), options);
}

// States with their rates.
std::string states(const std::vector<std::pair<std::string, std::string>>& rates) {
  std::string text = "[model]\n";
  for (const auto& [name, rate] : rates)
    text += fmt::format("[[model.state]]\nname = \"{}\"\nrate = \"{}\"\n", name, rate);
  return text;
}
std::string input(const std::string& name) {
  return fmt::format("[[model.input]]\nname = \"{}\"\n", name);
}
std::string parameter(const std::string& name, double value) {
  return fmt::format("[[model.parameter]]\nname = \"{}\"\nvalue = {}\n", name, value);
}
std::string condition(const std::string& values) {
  return fmt::format("[[condition]]\nname = \"there\"\n{}\n", values);
}
std::string box(const std::string& key, double from, double to) {
  return fmt::format("[[prove.parameter]]\nkey = \"{}\"\nfrom = {}\nto = {}\n", key, from, to);
}

// x' = -x, y' = (p - 0.37) y and a term that the test names.
std::string crossing(const std::string& rate = "0") {
  return states({{"x", "-x"}, {"y", "(p - 0.37)*y + " + rate}}) + parameter("p", 0) +
         condition("") + box("p", 0, 1);
}

}  // namespace

TEST_CASE("an oscillator is stable where its damping is above twice the margin" * thorough) {
  // x'' + c x' + k x = 0, k > c²/4: both eigenvalues have the real part -c/2.
  const std::string oscillator = states({{"x", "v"}, {"v", "-c*v - k*x"}}) + parameter("c", 1) +
                                 parameter("k", 4) + condition("");
  for (const double margin : {0.0, 0.25}) {
    const Theorem t =
        proved(oscillator + fmt::format("[prove]\nundecided = 0.01\nmargin = {}\n", margin) +
               box("c", -1, 2) + box("k", 2, 6));
    CHECK(t.undecided <= 0.01);
    CHECK_NEAR(t.stable, (2 - 2 * margin) / 3, 0.01);  // share of c in (2 margin, 2]
    for (const ProofNode& r : t.regions) {
      if (r.verdict == ProofVerdict::stable) CHECK(r.box[0].lower > 2 * margin);
      if (r.verdict == ProofVerdict::unstable) CHECK(r.box[0].upper < 2 * margin);
      CHECK(r.verdict != ProofVerdict::no_trim);
    }
  }
}

TEST_CASE("a planted crossing is enclosed") {
  const Theorem t = proved(crossing());
  CHECK(t.status() == ProofStatus::refuted);
  CHECK(t.undecided < 1e-8);
  REQUIRE(t.regions.size() == 3);
  CHECK(t.regions[0].verdict == ProofVerdict::stable);
  CHECK(t.regions[0].box[0].upper < 0.37);
  CHECK(t.regions[1].cause == "fold");  // a real eigenvalue crosses where the Jacobian is singular
  CHECK(t.regions[2].verdict == ProofVerdict::unstable);
  CHECK(t.regions[2].box[0].lower > 0.37);
}

TEST_CASE("below a fold there is no trim, above it the branch of the condition is stable" *
          thorough) {
  // x' = p - x² with x within [0, 3]: x = sqrt(p), eigenvalue -2x.
  const Theorem t = proved(states({{"x", "p - x^2"}}) + parameter("p", 1) +
                           condition("x = [0.0, 3.0]") + box("p", -1, 4));
  CHECK(t.undecided < 1e-4);
  for (const ProofNode& r : t.regions) {
    CHECK(r.verdict != ProofVerdict::unstable);
    if (r.verdict == ProofVerdict::stable) CHECK(r.box[0].lower > 0);
    if (r.verdict == ProofVerdict::no_trim) CHECK(r.box[0].upper < 0);
  }
  CHECK_NEAR(t.stable, 0.8, 1e-4);
  CHECK_NEAR(t.no_trim, 0.2, 1e-4);
}

TEST_CASE("beyond the limit of an input there is no trim; a fixed state may vary" * thorough) {
  // 0 = u - p x with x held: u = p x within [-1, 0.8], eigenvalue -p.
  const std::string held = states({{"x", "u - p*x"}}) + input("u") + parameter("p", 0.4) +
                           condition("x = 1.0\nu = [-1.0, 0.8]");
  const Theorem by_p = proved(held + box("p", 0.2, 2));
  CHECK_NEAR(by_p.stable, (0.8 - 0.2) / 1.8, 1e-6);
  CHECK_NEAR(by_p.no_trim, 1.2 / 1.8, 1e-6);
  const Theorem by_x = proved(held + box("x", 1, 3));  // to u = 0.4 x = 0.8
  CHECK_NEAR(by_x.stable, 0.5, 1e-6);
  CHECK_NEAR(by_x.no_trim, 0.5, 1e-6);
  for (const ProofNode& r : by_x.regions)
    if (r.verdict == ProofVerdict::no_trim) CHECK(r.box[0].lower > 2);
}

TEST_CASE("a rate that a condition prescribes is met, not zero") {
  // x' = u - x = 2 at x = 1 needs u = 3, beyond its limit from x = 2 on.
  const Theorem t =
      proved(states({{"x", "u - x"}}) + input("u") +
             condition("x = 1.0\nu = [0.0, 4.0]\nrates = {x = 2.0}") + box("x", 0, 4));
  CHECK_NEAR(t.stable, 0.5, 1e-6);
  CHECK_NEAR(t.no_trim, 0.5, 1e-6);
}

TEST_CASE("the sides of a comparison of parameters are both proved") {
  // Stable on both sides of p = 0.3; beyond it a jump of the decay rate.
  const std::string jump = states({{"x", "(p < 0.3 ? -1 : -2)*x + max(p, 0.6)"}}) +
                           parameter("p", 0.5) + condition("") + box("p", 0, 1);
  CHECK(proved(jump).status() == ProofStatus::proved);
  // Unstable beyond it: undecided is only what contains 0.3.
  const Theorem t = proved(states({{"x", "(p < 0.3 ? -1 : 2)*x + abs(p - 0.6)"}}) +
                           parameter("p", 0.5) + condition("") + box("p", 0, 1));
  CHECK_NEAR(t.stable, 0.3, 1e-8);
  CHECK_NEAR(t.unstable, 0.7, 1e-8);
  REQUIRE(t.regions.size() == 3);
  CHECK(t.regions[1].cause == "switch");
}

TEST_CASE("what no range can decide is undecided and names the formula's function") {
  const auto cause = [](const std::string& rate) {
    const Theorem t = proved(crossing(rate), 40);
    CHECK(t.stable + t.unstable + t.no_trim == 0);
    return t.regions.empty() ? "" : t.regions[0].cause;
  };
  CHECK(cause("abs(y)") == "switch: abs in the rate of 'y'");
  CHECK(cause("y*abs(y)") == "switch: abs in the rate of 'y'");
  CHECK(cause("min(0, y)") == "switch: min in the rate of 'y'");
  CHECK(cause("(y > 0 ? y : 2*y)") == "switch: > in the rate of 'y'");
  CHECK(cause("y*(x == 0 ? 1 : sin(x)/x)") == "switch: == in the rate of 'y'");
  CHECK(cause("y*sqrt(x)") == "undefined: sqrt in the rate of 'y'");
  CHECK(cause("y*ln(p - 2)") == "undefined: ln in the rate of 'y'");
}

TEST_CASE("where an output may be undefined nothing is proved") {
  const Theorem t =
      proved(states({{"x", "p - x"}}) + "[[model.output]]\nname = \"lift\"\nvalue = \"sqrt(x)\"\n" +
                 parameter("p", 1) + condition("") + box("p", -1, 1),
             200);
  CHECK_NEAR(t.stable, 0.5, 1e-2);
  CHECK(t.stable < 0.5);
  CHECK(t.regions.front().cause == "undefined: sqrt in the output 'lift'");
}

TEST_CASE("a look-up table: smooth across its entries, with kinks at those of a linear one") {
  // The square root of p, by the cubics that are its parabola: -2 sqrt(p) and 0.3 - p.
  const auto root = [](const std::string& interpolation) {
    return states({{"x", "p - T(x)"}, {"y", "(p - 0.3)*y"}}) + parameter("p", 2) +
           "[[model.table]]\nname = \"T\"\nat = [0, 1, 2, 4]\nvalues = [0, 1, 4, 16]\n" +
           fmt::format("interpolation = \"{}\"\n", interpolation);
  };
  const std::string within = condition("guess = {x = 1}");
  const Theorem smooth = proved(root("cubic") + within + box("p", 0.1, 15));
  CHECK_NEAR(smooth.stable, 0.2 / 14.9, 1e-7);
  CHECK_NEAR(smooth.unstable, 14.7 / 14.9, 1e-7);
  const Theorem linear = proved(root("linear") + within + box("p", 0.1, 15));
  CHECK_NEAR(linear.stable, 0.2 / 14.9, 1e-7);
  CHECK_NEAR(linear.unstable, 14.7 / 14.9, 1e-6);
  CHECK(std::ranges::count(linear.regions, "switch: T in the rate of 'x'", &ProofNode::cause) == 2);
  // Of a known quantity both sides of a kink are proved; beyond the entries nothing is.
  const std::string known =
      states({{"x", "-(1 + T(p))*x"}}) + root("linear").substr(root("linear").find("[[model.par"));
  CHECK(proved(known + condition("") + box("p", 0, 4)).status() == ProofStatus::proved);
  const Theorem beyond = proved(known + condition("") + box("p", 2, 6), 200);
  CHECK_NEAR(beyond.stable, 0.5, 1e-2);
  CHECK(beyond.regions.back().cause == "undefined: T in the rate of 'x'");
}

TEST_CASE("a kink away from the trim does not matter") {
  const Theorem t = proved(crossing("y*(abs(x + 1) - 1) + max(x - 1, 0)"));
  CHECK(t.undecided < 1e-8);
  CHECK_NEAR(t.stable, 0.37, 1e-8);
}

TEST_CASE("proved regions of the levitation study agree with its closed form and with linearize") {
  // The ball is held if k_p > i/x = sqrt(m g/k), at x = (k_p aim - bias)/(k_p - i/x).
  const Study study = load_study(TILTRIM_SOURCE_DIR "/studies/prove_levitation.toml");
  ProveOptions options;
  options.max_boxes = study.prove->boxes;
  options.undecided = (sanitized ? 3 : 1) * study.prove->undecided;
  const Theorem t = prove(prove_problem(study, study.conditions.at(0)), options);
  CHECK(t.stable > 0.6);
  CHECK(t.unstable + t.no_trim > 0.05);
  std::mt19937_64 draw(11);
  std::uniform_real_distribution<double> any(0, 1);
  int judged = 0;
  for (const ProofNode& r : t.regions) {
    if (r.verdict == ProofVerdict::undecided) continue;
    for (int i = 0; i < 3; ++i, ++judged) {
      const double k_p = r.box[0].lower + any(draw) * (r.box[0].upper - r.box[0].lower);
      const double mass = r.box[1].lower + any(draw) * (r.box[1].upper - r.box[1].lower);
      const double ratio = std::sqrt(mass * 9.81 / 9.81e-5), gap = (k_p * 0.01 - 1) / (k_p - ratio);
      CAPTURE(k_p);
      CAPTURE(mass);
      const bool exists = gap >= 0.005 && gap <= 0.02;
      REQUIRE(exists == (r.verdict != ProofVerdict::no_trim));
      if (!exists) continue;
      REQUIRE((k_p > ratio) == (r.verdict == ProofVerdict::stable));
      TrimProblem problem = user_problem(*study.conditions[0].user());
      set_value(problem.guess, variable(problem.model, "k_p"), k_p);
      set_value(problem.guess, variable(problem.model, "mass"), mass);
      problem.guess.x = Eigen::Vector2d(gap, 0);
      const Eigen::MatrixXd A = linearize(problem.model, problem.guess).A;
      REQUIRE((A.eigenvalues().real().maxCoeff() < 0) == (r.verdict == ProofVerdict::stable));
    }
  }
  CHECK(judged > 100);
}

TEST_CASE("[prove] of a [model] refuses what is no number of the study") {
  const std::string level =
      states({{"x", "u - p*x"}}) + input("u") + parameter("p", 1) + condition("u = 1.0");
  const auto says = [&](const std::string& text) {
    return refusal<StudyError>([&] { (void)study_of(level + text); });
  };
  CHECK(says(box("p", 0, 1)).empty());
  CHECK(says(box("u", 0, 1)).empty());
  const std::string unknown = says(box("q", 0, 1));
  CHECK(unknown == "prove.toml:14:7: prove.parameter.key: 'q' is not known; expected one of u, p");
  CHECK(contains(says(box("x", 0, 1)), "'x' is not known; expected one of u, p"));
  CHECK(contains(says(box("h", 0, 1)), "'h' is not known; expected one of u, p"));
  CHECK(contains(says(box("p", 1, 0)), "rising"));
  CHECK(contains(says(box("p", 0, 1) + box("p", 2, 3)), "twice"));
  CHECK(contains(says("[[prove.parameter]]\nkey = \"u\"\npercent = 10\n"),
                 "parameters of the model"));
  CHECK(says("[[prove.parameter]]\nkey = \"p\"\npercent = 10\n").empty());
  CHECK(contains(says("[prove]\nmargin = 1\n"), "prove.parameter"));
  CHECK(contains(says("[[prove.parameter]]\nfrom = 1\nto = 2\n"), "is missing"));
}

TEST_CASE("a condition that a proof cannot be about is refused with the reason") {
  const std::string model = states({{"x", "u - p*x"}}) + input("u") + parameter("p", 1);
  const auto says = [&](const std::string& values, const std::string& key = "p") {
    const Study study =
        study_of(model + "[[model.output]]\nname = \"y\"\nvalue = \"x\"\n" + condition(values) +
                 "[[condition]]\nname = \"other\"\nu = 1.0\n" + box(key, 1, 2));
    return refusal<StudyError>([&] { (void)prove_problem(study, study.conditions[0]); });
  };
  CHECK(says("u = 1.0").empty());
  CHECK(contains(says("u = [0.0, 1.0]"), "condition 'there': a proof needs as many unknowns"));
  CHECK(contains(says("u = [0.0, 1.0]\nx = 1.0", "u"), "'u' is unknown here"));
  CHECK(contains(says("u = 1.0\nx = 1.0\np = \"free\"", "u"), "the parameter 'p' is unknown"));
  CHECK(contains(says("u = 1.0\nrates = {x = \"implied\"}\nx = 1.0"), "implied"));
  CHECK(contains(says("u = \"free\"\ny = 1.0"), "'y' is held at a value"));
}

}  // namespace prove_study_test
