/// From physics written once on any scalar to a Model with exact derivatives and enclosures.
/// Internal to model/.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "model/model.hpp"
#include "model/scalar.hpp"

namespace tiltrim::physics {

// Where the variables of a model stand: x, then u, then p.
struct Layout {
  Eigen::Index nx, nu, np, ny;
  explicit Layout(const Model& m)
      : nx(std::ssize(m.states)),
        nu(std::ssize(m.inputs)),
        np(std::ssize(m.parameters)),
        ny(std::ssize(m.outputs)) {}
};

/// `physics(x, u, p, rates, outputs)` on pointers to scalars, either of the last two null if not
/// wanted; must accept parameters on the scalar of the states, and on double beside it.
template <class Physics>
void set_functions(Model& model, const Physics& physics) {
  const Layout at(model);
  model.f = [at, physics](const auto& x, const auto& u, const auto& p) {
    Eigen::VectorXd rates(at.nx);
    physics(x.data(), u.data(), p.data(), rates.data(), static_cast<double*>(nullptr));
    return rates;
  };
  model.h = [at, physics](const auto& x, const auto& u, const auto& p) {
    Eigen::VectorXd outputs(at.ny);
    physics(x.data(), u.data(), p.data(), static_cast<double*>(nullptr), outputs.data());
    return outputs;
  };
}

/// Exact derivatives by forward mode, `dual_width` variables in each pass.
template <class Physics>
void set_derivatives(Model& model, const Physics& physics) {
  const Layout at(model);
  const auto pass = [at, physics](const OperatingPoint& point, const Eigen::Index* wanted,
                                  Eigen::Index count, Eigen::MatrixXd& jacobian, Eigen::Index col) {
    const Eigen::Index moving = at.nx + at.nu;
    std::array<Dual, 64> rates_and_outputs;
    std::vector<Dual> z;
    const auto seed = [&](const Eigen::VectorXd& values) {
      for (double v : values) z.emplace_back(v, Dual::DerType::Zero());
    };
    const bool all = std::any_of(wanted, wanted + count, [&](auto j) { return j >= moving; });
    z.reserve(static_cast<std::size_t>(all ? moving + at.np : moving));
    seed(point.x);
    seed(point.u);
    if (all) seed(point.p);
    for (Eigen::Index k = 0; k < count; ++k) z[std::size_t(wanted[k])].derivatives()[k] = 1;
    Dual* const rates = rates_and_outputs.data();
    Dual* const outputs = rates + at.nx;
    if (all)
      physics(z.data(), z.data() + at.nx, z.data() + moving, rates, outputs);
    else
      physics(z.data(), z.data() + at.nx, point.p.data(), rates, outputs);
    for (Eigen::Index i = 0; i < at.nx + at.ny; ++i)
      jacobian.row(i).segment(col, count) = rates[i].derivatives().head(count).transpose();
  };
  model.derivatives = [at, pass](const OperatingPoint& point,
                                 const std::vector<Eigen::Index>& variables) {
    const Eigen::Index n = std::ssize(variables);
    Eigen::MatrixXd jacobian(at.nx + at.ny, n);
    for (Eigen::Index j = 0; j < n; j += dual_width)
      pass(point, variables.data() + j, std::min<Eigen::Index>(dual_width, n - j), jacobian, j);
    return jacobian;
  };
}

/// Ranges over a box of states and inputs; parameters stay at the box's lower ends, which must be
/// their upper ends too.
template <class Physics>
void set_enclosure(Model& model, const Physics& physics) {
  const Layout at(model);
  model.enclosure = [at, physics](const std::vector<Range>& box) {
    const auto moving = static_cast<std::size_t>(at.nx + at.nu);
    std::vector<Interval> z(moving);
    for (std::size_t j = 0; j < moving; ++j) z[j] = Interval(box[j].lower, box[j].upper);
    std::vector<double> p;
    for (std::size_t j = moving; j < box.size(); ++j) p.push_back(box[j].lower);
    std::vector<Interval> all(static_cast<std::size_t>(at.nx + at.ny));
    physics(z.data(), z.data() + at.nx, p.data(), all.data(), all.data() + at.nx);
    std::vector<Range> ranges;
    for (const Interval& r : all) ranges.push_back({r.lower(), r.upper()});
    return ranges;
  };
}

}  // namespace tiltrim::physics
