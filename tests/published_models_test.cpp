#include <algorithm>
#include <complex>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "linearize/modes.hpp"
#include "tests/check.hpp"
#include "trim/trim.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;

namespace published_models_test {

static double number(const nlohmann::json& printed) {
  return std::stod(printed.get<std::string>());
}

// of(text) of every entry of the printed matrix.
template <class Of>
static MatrixXd entries(const nlohmann::json& rows, const Of& of) {
  MatrixXd A(rows.size(), rows.size());
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < A.cols(); ++j) A(i, j) = of(rows[std::size_t(i)][std::size_t(j)]);
  return A;
}

// x' = A x without exact derivatives: it is linearized by differences.
static Model published(const nlohmann::json& entry) {
  const MatrixXd A = entries(entry.at("A"), number);
  Model m;
  for (const auto& name : entry.at("states")) m.states.push_back({name, "", 0.1});
  m.f = [A](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd { return A * x; };
  return m;
}

TEST_CASE("published linear models have their published eigenvalues, to every digit printed") {
  std::ifstream file(TILTRIM_SOURCE_DIR "/data/references/linear_models.json");
  const auto models = nlohmann::json::parse(file).at("models");
  CHECK(models.size() == 5);
  for (const auto& entry : models) {
    CAPTURE(entry.at("aircraft").get<std::string>());
    const Model m = published(entry);
    const auto states = names(m.states);
    const VectorXd off = VectorXd::Constant(std::ssize(states), 0.05);
    const TrimResult rest = trim(m, {.free = states, .steady = states}, {off, {}, {}});
    REQUIRE(rest);
    CHECK(rest.point.x.cwiseAbs().maxCoeff() < 1e-6);
    const Modes found = modes(linearize(m, rest.point));
    std::size_t counted = 0;
    bool stable = true;
    for (const auto& printed : entry.at("eigenvalues")) {
      const std::string re = printed[0], im = printed[1];
      const std::complex<double> expected(number(printed[0]), number(printed[1]));
      const Mode& nearest = *std::ranges::min_element(
          found.modes, {}, [&](const Mode& mode) { return std::abs(mode.eigenvalue - expected); });
      CHECK_NEAR(nearest.eigenvalue.real(), expected.real(), printed_to(re));
      if (im == "0")
        CHECK(nearest.eigenvalue.imag() == 0);
      else
        CHECK_NEAR(nearest.eigenvalue.imag(), expected.imag(), printed_to(im));
      counted += im == "0" ? 1 : 2;
      stable = stable && expected.real() < 0;
    }
    CHECK(counted == found.modes.size());
    CHECK(found.verdict == (stable ? Verdict::stable : Verdict::unstable));
  }
}

}  // namespace published_models_test
