/// Builds a Model with exact derivatives and enclosures from physics templated on its scalar.
/// Internal to model/ and vehicles/.
///
/// A Physics has `sizes` and is called as `physics(x, u, p, rates, outputs)` on pointers to
/// scalars; rates or outputs may be null if not wanted. It accepts parameters of the states' scalar
/// type and of type double.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "model/in_place.hpp"
#include "model/model.hpp"
#include "model/scalar.hpp"

// Not under sanitizers: their checks would make this one large function take minutes to compile.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TILTRIM_FLATTEN
#else
#define TILTRIM_FLATTEN [[gnu::flatten]]
#endif

namespace tiltrim::physics {

/// The numbers of states, inputs, parameters and outputs of a model.
struct Sizes {
  std::size_t states, inputs, parameters, outputs;
};

template <class Physics>
void set_functions(Model& model, const Physics& physics) {
  const auto both = std::make_shared<const InPlace>(
      InPlace{Physics::sizes.states, Physics::sizes.outputs,
              [physics](const double* x, const double* u, const double* p, double* rates,
                        double* outputs) { physics(x, u, p, rates, outputs); }});
  model.f = InPlaceFunction<false>{both};
  model.h = InPlaceFunction<true>{both};
}

// Derivatives with respect to states and inputs only, the common case. Flattened, so that all is
// inlined: dual numbers do not fit in registers, and copying them between functions would cost a
// third of the time.
template <class Physics>
TILTRIM_FLATTEN void along_motion(const Physics& physics, const Dual* x, const Dual* u,
                                  const double* p, Dual* rates, Dual* outputs) {
  physics(x, u, p, rates, outputs);
}

// With respect to any variables: dual numbers of all parameters, which take longer to set up.
template <class Physics>
void along_any(const Physics& physics, const Dual* x, const Dual* u, const OperatingPoint& point,
               const Eigen::Index* wanted, Eigen::Index count, Dual* rates, Dual* outputs) {
  constexpr Sizes n = Physics::sizes;
  constexpr std::size_t moving = n.states + n.inputs;
  std::array<Dual, n.parameters> p;
  std::copy_n(point.p.data(), n.parameters, p.data());
  for (Eigen::Index k = 0; k < count; ++k)
    if (std::size_t(wanted[k]) >= moving) p.at(std::size_t(wanted[k]) - moving).slopes[k] = 1;
  physics(x, u, p.data(), rates, outputs);
}

// Derivatives with respect to up to `dual_width` variables, stacked column by column in `jacobian`.
template <class Physics>
void differentiate_pass(const Physics& physics, const OperatingPoint& point,
                        const Eigen::Index* wanted, Eigen::Index count, double* jacobian) {
  constexpr Sizes n = Physics::sizes;
  constexpr std::size_t moving = n.states + n.inputs;
  std::array<Dual, moving> z;
  Dual* const u = z.data() + n.states;
  std::copy_n(point.x.data(), n.states, z.data());
  std::copy_n(point.u.data(), n.inputs, u);
  bool along_parameters = false;
  for (Eigen::Index k = 0; k < count; ++k)
    if (std::size_t(wanted[k]) < moving)
      z[std::size_t(wanted[k])].slopes[k] = 1;
    else
      along_parameters = true;

  std::array<Dual, n.states + n.outputs> results;
  Dual* const rates = results.data();
  Dual* const outputs = rates + n.states;
  if (along_parameters)
    along_any(physics, z.data(), u, point, wanted, count, rates, outputs);
  else
    along_motion(physics, z.data(), u, point.p.data(), rates, outputs);
  for (Eigen::Index k = 0; k < count; ++k)
    for (const Dual& row : results) *jacobian++ = row.slopes[k];
}

/// Exact derivatives by forward mode, `dual_width` variables per pass.
template <class Physics>
void set_derivatives(Model& model, const Physics& physics) {
  model.derivatives = [physics](const OperatingPoint& point,
                                const std::vector<Eigen::Index>& variables) {
    constexpr Sizes n = Physics::sizes;
    const Eigen::Index columns = std::ssize(variables);
    Eigen::MatrixXd jacobian(n.states + n.outputs, columns);
    for (Eigen::Index j = 0; j < columns; j += dual_width)
      differentiate_pass(physics, point, variables.data() + j,
                         std::min<Eigen::Index>(dual_width, columns - j), &jacobian(0, j));
    return jacobian;
  };
}

/// Ranges over a box of states and inputs. Parameters are fixed at the lower bounds of the box,
/// which must equal the upper bounds.
template <class Physics>
void set_enclosure(Model& model, const Physics& physics) {
  model.enclosure = [physics](const std::vector<Range>& box) {
    constexpr Sizes n = Physics::sizes;
    constexpr std::size_t moving = n.states + n.inputs;
    std::array<Interval, moving> z;
    for (std::size_t j = 0; j < moving; ++j) z[j] = Interval(box[j].lower, box[j].upper);
    std::vector<double> p;
    for (std::size_t j = moving; j < box.size(); ++j) p.push_back(box[j].lower);
    std::array<Interval, n.states + n.outputs> all;
    physics(z.data(), z.data() + n.states, p.data(), all.data(), all.data() + n.states);
    std::vector<Range> ranges;
    for (const Interval& r : all) ranges.push_back({r.lower(), r.upper()});
    return ranges;
  };
}

/// Ranges with first and second derivatives.
template <class Physics>
void set_jets(Model& model, const Physics& physics) {
  model.jets = [physics](const std::vector<Jet>& x, const std::vector<Jet>& u,
                         const std::vector<Jet>& p) {
    std::vector<Jet> all(Physics::sizes.states + Physics::sizes.outputs);
    physics(x.data(), u.data(), p.data(), all.data(), all.data() + Physics::sizes.states);
    return all;
  };
}

}  // namespace tiltrim::physics
