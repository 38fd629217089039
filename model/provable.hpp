/// @file
/// Models that prove() can take, from functions written once for any scalar.
#pragma once

#include <span>
#include <utility>

#include "model/exact.hpp"
#include "model/jet.hpp"

namespace tiltrim {

/// exact_model() of functions that are also called on Jet: ranges with derivatives.
///
///     m = provable_model(m, [](auto x, auto u, auto p, auto rates) { rates[0] = -p[0] * x[0]; });
template <class F, class H = ExactFunction>
[[nodiscard]] Model provable_model(Model m, const F& f, const H& h = {}) {
  m = exact_model(std::move(m), f, h);
  const std::size_t nx = m.states.size(), ny = m.outputs.size();
  m.jets = [f, h, nx, ny](const std::vector<Jet>& x, const std::vector<Jet>& u,
                          const std::vector<Jet>& p) {
    std::vector<Jet> all(nx + ny);
    const std::span<const Jet> xs(x), us(u), ps(p);
    f(xs, us, ps, std::span<Jet>(all).first(nx));
    if constexpr (!std::is_same_v<H, ExactFunction>) h(xs, us, ps, std::span<Jet>(all).subspan(nx));
    return all;
  };
  return m;
}

}  // namespace tiltrim
