// Branches of trims against closed forms, published folds and re-trims; their ends and their laws.
#include "follow/follow.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "model/study.hpp"
#include "tests/check.hpp"
#include "trim/conditions.hpp"

using namespace tiltrim;
using Eigen::MatrixXd;
using Eigen::VectorXd;

static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
static constexpr double located = 1e-10;  // of an event: Newton's settled step, with margin

static VectorXd vec(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), std::ssize(values));
}

// ---- models: states x, parameters p, no inputs ----

using Flow = std::function<VectorXd(const VectorXd& x, const VectorXd& p)>;

static Model flow(const std::vector<std::string>& states, const std::vector<std::string>& p,
                  Flow rates) {
  Model m;
  for (const std::string& name : states) m.states.push_back({name, "", 1.0});
  for (const std::string& name : p) m.parameters.push_back({name, "", 1.0});
  m.f = [rates = std::move(rates)](const VectorXd& x, const VectorXd&, const VectorXd& values) {
    return rates(x, values);
  };
  return m;
}

static Model scalar(const std::function<double(double x, double p)>& rate) {
  return flow({"x"}, {"p"},
              [rate](const VectorXd& x, const VectorXd& p) { return vec({rate(x[0], p[0])}); });
}

static OperatingPoint at(VectorXd x, VectorXd p) { return {std::move(x), VectorXd(), std::move(p)}; }
static OperatingPoint at(double x, double p) { return at(vec({x}), vec({p})); }

// All states free, all rates still.
static TrimSpec equilibrium(const Model& m) {
  return {.free = names(m.states), .still = names(m.states)};
}

/// A branch to be followed.
struct Route {
  Model model;
  TrimSpec spec;
  OperatingPoint start;
  std::string parameter;
  double to;
};

// ---- following, with what holds on every branch ----

static double left_over(const Model& model, const TrimSpec& spec, const OperatingPoint& point) {
  const VectorXd rates = evaluate(model, point).rates;
  double most = 0;
  for (const std::string& name : spec.still) {
    const auto i = index_of(model.states, name, "state");
    most = std::max(most, std::abs(rates[i]) / model.states[std::size_t(i)].nominal);
  }
  return most;
}

// By how much a free variable's bound is exceeded; negative inside.
static double beyond_bounds(const Model& model, const TrimSpec& spec, const OperatingPoint& point) {
  double most = -std::numeric_limits<double>::infinity();
  for (const std::string& name : spec.free)
    if (const auto bound = spec.bounds.find(name); bound != spec.bounds.end()) {
      const double value = value_of(point, variable(model, name));
      most = std::max({most, bound->second.lower - value, value - bound->second.upper});
    }
  return most;
}

static Branch walk(const Route& r, const FollowOptions& options = {}) {
  const Branch branch = follow(r.model, r.spec, r.start, r.parameter, r.to, options);
  REQUIRE(!branch.events.empty());
  CHECK(branch.events.back().kind == EventKind::end);
  CHECK(std::ranges::count(branch.events, EventKind::end, &BranchEvent::kind) == 1);
  CHECK(branch.events.back().which == branch.message);
  CHECK(std::ssize(branch.points) <= options.max_points);
  CHECK(branch.evaluations > 0);
  const auto j = variable(r.model, r.parameter);
  double residual = 0, excess = -1;
  bool parameter_is_its_value = true;
  const auto judge = [&](const BranchPoint& b) {
    residual = std::max({residual, b.residual, left_over(r.model, r.spec, b.point)});
    excess = std::max(excess, beyond_bounds(r.model, r.spec, b.point));
    parameter_is_its_value = parameter_is_its_value && b.parameter == value_of(b.point, j);
  };
  for (const BranchPoint& b : branch.points) judge(b);
  for (const BranchEvent& e : branch.events) judge(e.at);
  CHECK(residual <= options.tolerance);
  CHECK(excess <= 1e-12);
  CHECK(parameter_is_its_value);
  return branch;
}

// "fold, limit u1 upper, end: reached"
static std::string story(const Branch& branch) {
  std::string words;
  for (const BranchEvent& e : branch.events) {
    words += to_string(e.kind);
    if (e.kind == EventKind::limit || e.kind == EventKind::limit_left) words += " " + e.which;
    words += e.kind == EventKind::end ? ": " + to_string(branch.end) : ", ";
  }
  return words;
}

static std::vector<BranchEvent> of(const Branch& branch, EventKind kind) {
  std::vector<BranchEvent> found;
  std::ranges::copy_if(branch.events, std::back_inserter(found),
                       [kind](const BranchEvent& e) { return e.kind == kind; });
  return found;
}
