#include <array>
#include <stdexcept>

#include "linearize/linearize.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "simulate/comparison.hpp"
#include "simulate/simulate.hpp"

namespace tiltrim {

using Eigen::VectorXd;

std::string to_string(ResponseStatus status) {
  constexpr std::array names{"responded", "no_trim", "cut_short"};
  return names[std::size_t(status)];
}

VectorXd offset_of(const Signals& states, const std::map<std::string, double>& offset) {
  VectorXd by = VectorXd::Zero(std::ssize(states));
  for (const auto& [name, value] : offset) by[index_of(states, name, "state")] = value;
  if (by.isZero(0)) throw std::invalid_argument("an empty offset; expected a state and its change");
  return by;
}

Response response(const Model& model, const OperatingPoint& trim,
                  const std::map<std::string, double>& offset, const ResponseOptions& options) {
  const RoundToNearest environment;
  Response response;
  response.states = model.states;
  response.offset = offset_of(model.states, offset);
  const LinearModel linear = linearize(model, trim);
  response.message = linear.message;
  if (!linear) return response;
  const auto moved = [&](const VectorXd& by) {
    IntegrateOptions integrate;
    integrate.tolerance = options.tolerance;
    integrate.sample = options.sample;
    integrate.global_error = false;  // the difference from the linear response matters here
    OperatingPoint from = trim;
    from.x += by;
    const Simulation s = simulate(model, from, options.duration, {}, integrate);
    return comparing::Nonlinear{s.t, s.x.colwise() - trim.x, bool(s), s.message};
  };
  comparing::compare(moved, linear.A, options, response);
  return response;
}

}  // namespace tiltrim
