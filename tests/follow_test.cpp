// Branches of trims: published folds and Hopf points, corners, ends.
#include "follow/follow.hpp"

#include "check.hpp"

using namespace tiltrim;

TEST_CASE("a fold is found where it is known: x' = p + x²") {
  Model model;
  model.states = {{"x", "", 1.0}};
  model.parameters = {{"p", "", 1.0}};
  model.f = [](const auto& x, const auto&, const auto& p) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, p[0] + x[0] * x[0]);
  };
  const OperatingPoint start{Eigen::VectorXd::Constant(1, -1.0), {}, Eigen::VectorXd::Constant(1, -1.0)};
  const Branch branch = follow(model, {.free = {"x"}, .still = {"x"}}, start, "p", -4.0);
  CHECK(branch.end == BranchEnd::reached);
}
