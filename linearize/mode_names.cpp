// Names of modes from the states that participate in them.
#include <algorithm>

#include "linearize/mode_name.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

constexpr double most_of_it = 0.7;  // of the participation, for a name from these states alone
constexpr double some = 0.15;       // of the participation, for a state to take part

double share_of(const std::string& state, const Eigen::VectorXd& share,
                const std::vector<std::string>& names) {
  const auto at = std::ranges::find(names, state);
  return at == names.end() ? 0.0 : share[at - names.begin()];
}

bool has_all(const std::vector<std::string>& wanted, const std::vector<std::string>& names) {
  return std::ranges::all_of(wanted, [&](const std::string& state) {
    return std::ranges::find(names, state) != names.end();
  });
}

std::string dominant(const Eigen::VectorXd& share, const std::vector<std::string>& names) {
  Eigen::VectorXd left = (1e9 * share).array().round();  // equal to rounding: in the states' order
  std::string name;
  double sum = 0.0;
  for (std::size_t k = 0; k < names.size(); ++k) {
    Index next = 0;
    left.maxCoeff(&next);
    const double own = share[next];
    if (sum >= most_of_it || own == 0 || (own < some && sum > 0)) break;
    sum += own;
    name += (name.empty() ? "" : " + ") + names[std::size_t(next)];
    left[next] = -1;
  }
  return name;
}

}  // namespace

std::string mode_name(std::complex<double> eigenvalue, const Eigen::VectorXd& participation,
                      const std::vector<std::string>& state_names,
                      const std::shared_ptr<const std::vector<ModeName>>& known) {
  const auto carried_by = [&](const ModeName& mode) {
    if (mode.oscillation && eigenvalue.imag() == 0) return false;
    if (!has_all(mode.among, state_names)) return false;
    double sum = 0.0, least = 1.0;
    for (const std::string& state : mode.states) {
      const double share = share_of(state, participation, state_names);
      sum += share;
      least = std::min(least, share);
    }
    return sum >= most_of_it && (mode.states.size() == 1 || least >= some);
  };
  if (known)
    for (const ModeName& mode : *known)
      if (carried_by(mode)) return mode.name;
  return dominant(participation, state_names);
}

std::shared_ptr<const std::vector<ModeName>> possible_names(
    const std::shared_ptr<const std::vector<ModeName>>& known,
    const std::vector<std::string>& state_names) {
  if (!known) return known;
  auto possible = std::make_shared<std::vector<ModeName>>();
  for (const ModeName& mode : *known)
    if (has_all(mode.states, state_names) && has_all(mode.among, state_names))
      possible->push_back(mode);
  return possible;
}

}  // namespace tiltrim
