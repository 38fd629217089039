// A problem with its names resolved, and the boxes of its parameters.
#include <fmt/core.h>

#include <algorithm>

#include "model/among.hpp"
#include "model/lookup.hpp"
#include "prove/parts.hpp"

namespace tiltrim::proving {

using Eigen::Index;

Setup::Setup(const ProveProblem& p) : problem(p), states(p.model.states.size()) {
  if (!p.model.jets)
    throw CallerMistake(fmt::format("{}: the model has no ranges with derivatives", p.model.name));
  if (p.unknowns.size() != p.equations.size() || p.unknowns.empty())
    throw CallerMistake(
        fmt::format("{} unknowns for {} equations", p.unknowns.size(), p.equations.size()));
  if (p.parameters.empty()) throw CallerMistake("a proof needs at least one parameter");
  const Index inputs = std::ssize(p.model.inputs);
  moving = states;
  for (const std::string& name : p.unknowns) {
    unknowns.push_back(variable(p.model, name));
    if (unknowns.back() >= Index(states) + inputs)
      throw CallerMistake(fmt::format("the unknown '{}' is a parameter", name));
    if (unknowns.back() >= Index(states)) ++moving;
  }
  for (const std::string& name : p.equations)
    equations.push_back(index_of(p.model.states, name, "state"));
  for (const auto& [name, range] : p.limits) {
    const auto own = std::ranges::find(p.unknowns, name);
    if (own != p.unknowns.end())
      limits.push_back({own - p.unknowns.begin(), -1, range});
    else
      limits.push_back({-1, Index(states) + index_of(p.model.outputs, name, "output"), range});
  }
  for (const Uncertain& parameter : p.parameters) {
    if (!(parameter.lower < parameter.upper))
      throw CallerMistake(fmt::format("{}: expected from < to", parameter.name));
    if (p.numbers) continue;
    placed.push_back(variable(p.model, parameter.name));
    if (std::ranges::find(unknowns, placed.back()) != unknowns.end())
      throw CallerMistake(fmt::format("'{}' is an unknown and cannot vary", parameter.name));
  }
  if (k() > most_parameters)
    throw CallerMistake(fmt::format("{} parameters; at most {}", k(), most_parameters));
  if (moving > most_moving)
    throw CallerMistake(
        fmt::format("{} states and unknown inputs; at most {}", moving, most_moving));
}

std::size_t Setup::direction(std::size_t unknown) const {
  const std::size_t own = std::size_t(unknowns[unknown]);
  if (own < states) return own;
  std::size_t at = states;
  for (std::size_t j = 0; j < unknown; ++j) at += std::size_t(unknowns[j]) >= states;
  return at;
}

Cell::Cell(std::vector<Range> b) : box(std::move(b)) {
  for (const Range& range : box) {
    m.push_back(0.5 * (range.lower + range.upper));
    r.push_back(Interval::up(
        std::max(Interval::up(range.upper - m.back()), Interval::up(m.back() - range.lower))));
  }
}

Jets Cell::numbers() const {
  Jets c;
  for (std::size_t k = 0; k < m.size(); ++k) c.push_back(Jet::number(m[k], r[k], k, m.size()));
  return c;
}

Known known(const Setup& s, const Cell& cell) {
  const OperatingPoint& guess = s.problem.guess;
  const Jets c = cell.numbers();
  Known at;
  at.u.assign(guess.u.begin(), guess.u.end());
  at.p.assign(guess.p.begin(), guess.p.end());
  for (const double value : guess.x) at.x.push_back(Jet::number(value, 0, 0, s.k()));
  if (s.problem.numbers) at.p = s.problem.numbers(c);
  for (std::size_t k = 0; k < s.placed.size(); ++k) {
    const std::size_t own = std::size_t(s.placed[k]), nu = at.u.size();
    (own < s.states        ? at.x[own]
     : own < s.states + nu ? at.u[own - s.states]
                           : at.p[own - s.states - nu]) = c[k];
  }
  if (current_branches) at.next = current_branches->next;
  return at;
}

}  // namespace tiltrim::proving
