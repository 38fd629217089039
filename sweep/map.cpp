#include "sweep/map.hpp"

namespace tiltrim {

std::string to_string(CrossingKind kind) {
  switch (kind) {
    case CrossingKind::zero:
      return "zero";
    case CrossingKind::hopf:
      return "hopf";
    case CrossingKind::jump:
      return "jump";
    case CrossingKind::touch:
      return "touch";
    case CrossingKind::end:
      return "end";
  }
  return "unknown";
}

std::string to_string(IntervalVerdict verdict) {
  switch (verdict) {
    case IntervalVerdict::stable:
      return "stable";
    case IntervalVerdict::unstable:
      return "unstable";
    case IntervalVerdict::no_trim:
      return "no_trim";
    case IntervalVerdict::undecided:
      return "undecided";
  }
  return "unknown";
}

std::size_t SweepMap::points_per_condition() const {
  std::size_t points = 1;
  for (const SweepAxis& axis : axes) points *= axis.size();
  return points;
}

std::vector<std::size_t> SweepMap::position(std::size_t point) const {
  std::vector<std::size_t> position(axes.size() + 1);
  for (std::size_t k = axes.size(); k > 0; --k) {
    position[k] = point % axes[k - 1].size();
    point /= axes[k - 1].size();
  }
  position[0] = point;
  return position;
}

}  // namespace tiltrim
