// Names of modes from the states that take part in them.
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "linearize/modes.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

enum class Shape { oscillation, any };

// A classical mode: the states that carry it, each of which must take part, and the motion.
struct Classical {
  const char* name;
  std::array<const char*, 2> states;  // the second may be null
  Shape shape;
};

constexpr double most_of_it = 0.7;  // of the share, to be called by its states alone
constexpr double some = 0.15;       // of the share, for a state to take part

// Longitudinal motion, in wind axes, body axes and as errors of the closed loop.   [2, ch. 6; 3]
constexpr auto classical = std::to_array<Classical>({
    {"short period", {"theta", "q"}, Shape::oscillation},
    {"short period", {"alpha", "q"}, Shape::oscillation},
    {"short period", {"w", "q"}, Shape::oscillation},
    {"phugoid", {"V", "gamma"}, Shape::oscillation},
    {"phugoid", {"V", "theta"}, Shape::oscillation},
    {"phugoid", {"u", "theta"}, Shape::oscillation},
    {"speed and path", {"V_err", "gamma_err"}, Shape::oscillation},
    {"both integrals", {"energy_integral", "distribution_integral"}, Shape::oscillation},
    {"speed", {"V", nullptr}, Shape::any},
    {"speed", {"V_err", nullptr}, Shape::any},
    {"speed", {"u", nullptr}, Shape::any},
    {"heave", {"w", nullptr}, Shape::any},
    {"flight path", {"gamma", nullptr}, Shape::any},
    {"flight path", {"gamma_err", nullptr}, Shape::any},
    {"pitch", {"theta", nullptr}, Shape::any},
    {"pitch rate", {"q", nullptr}, Shape::any},
    {"energy integral", {"energy_integral", nullptr}, Shape::any},
    {"distribution integral", {"distribution_integral", nullptr}, Shape::any},
});

double share_of(const char* state, const Eigen::VectorXd& share,
                const std::vector<std::string>& names) {
  if (!state) return 0.0;
  const auto at = std::ranges::find(names, state);
  return at == names.end() ? 0.0 : share[at - names.begin()];
}

std::string dominant(const Eigen::VectorXd& share, const std::vector<std::string>& names) {
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t k) { return share[Index(k)]; });
  std::vector<std::string> leading;
  double sum = 0.0;
  for (const std::size_t k : order) {
    const double own = share[Index(k)];
    if (sum >= most_of_it || own == 0 || (own < some && sum > 0)) break;
    sum += own;
    leading.push_back(names[k]);
  }
  return fmt::format("{}", fmt::join(leading, " + "));
}

}  // namespace

std::string mode_name(std::complex<double> eigenvalue, const Eigen::VectorXd& participation,
                      const std::vector<std::string>& state_names) {
  for (const Classical& c : classical) {
    if (c.shape == Shape::oscillation && eigenvalue.imag() == 0) continue;
    const double first = share_of(c.states[0], participation, state_names);
    const double second = share_of(c.states[1], participation, state_names);
    const bool both = !c.states[1] || (first >= some && second >= some);
    if (both && first + second >= most_of_it) return c.name;
  }
  return dominant(participation, state_names);
}

}  // namespace tiltrim
