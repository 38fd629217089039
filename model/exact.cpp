#include "model/exact.hpp"

#include <fmt/core.h>

#include <stdexcept>

#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Counts {
  Index states, inputs, parameters, outputs;
};

// Spans of a wrong length would be read out of bounds.
void check_sizes(const Counts& n, const VectorXd& x, const VectorXd& u, const VectorXd& p) {
  const auto size = [](const char* what, Index expected, Index got) {
    if (got != expected)
      throw CallerMistake(fmt::format("{}: expected {} values, got {}", what, expected, got));
  };
  size("state x", n.states, x.size());
  size("input u", n.inputs, u.size());
  size("parameters p", n.parameters, p.size());
}

decltype(Model::f) on_vectors(const Counts& n, Index count, const ExactFunction& function) {
  return [n, count, function](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    check_sizes(n, x, u, p);
    VectorXd values(count);
    if (function.values) function.values(x, u, p, values);
    return values;
  };
}

}  // namespace

Model exact_model(Model m, const ExactFunction& f, const ExactFunction& h) {
  if (!m.states.empty() && !f.values) throw std::invalid_argument("the model has no function f");
  if (!m.outputs.empty() && !h.values)
    throw std::invalid_argument("the model names outputs but has no function h");
  const Counts n{std::ssize(m.states), std::ssize(m.inputs), std::ssize(m.parameters),
                 std::ssize(m.outputs)};
  m.f = on_vectors(n, n.states, f);
  m.h = m.outputs.empty() ? decltype(Model::f)() : on_vectors(n, n.outputs, h);
  m.derivatives = [n, f, h](const OperatingPoint& at, const std::vector<Index>& variables) {
    check_sizes(n, at.x, at.u, at.p);
    MatrixXd all(n.states + n.outputs, std::ssize(variables));
    if (n.states > 0) f.slopes(at, variables, all.topRows(n.states));
    if (n.outputs > 0) h.slopes(at, variables, all.bottomRows(n.outputs));
    return all;
  };
  check(m);
  return m;
}

}  // namespace tiltrim
