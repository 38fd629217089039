#include "sweep/starts.hpp"

#include <algorithm>

#include "linearize/modes.hpp"
#include "model/lookup.hpp"
#include "sweep/spectrum.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

struct Named {
  Reference reference;
  std::vector<std::string> names;
};

// The modes in the order and with the names of modes(), at the first equilibrium of a condition.
Named named_modes(const Prepared& sweep, const GridTrim& e) {
  Named named;
  named.reference.A = e.A(sweep);
  for (const Mode& m :
       modes(named.reference.A, {}, names(sweep.model().states), sweep.model().mode_names).modes) {
    named.reference.modes.push_back(m.eigenvalue);
    named.names.push_back(m.name);
  }
  return named;
}

// The modes at the first point of a line, extrapolated linearly from the two lines before it.
Eigenvalues foreseen(const Lines& lines, const std::vector<LineStart>& starts, std::size_t line,
                     std::size_t before) {
  const Eigenvalues& modes = starts[before].reference->modes;
  const GridPlace here = lines.place(line), there = lines.place(before);
  std::size_t axis = 0;
  while (here[axis] == there[axis]) ++axis;
  const std::size_t k = std::size_t(here[axis]), stride = line - before;
  if (k < 2) return modes;
  const LineStart& earlier = starts[before - stride];
  if (!earlier.first.valid() || !starts[before].first.valid() || !earlier.reference) return modes;
  const std::vector<double>& v = lines.axes[axis].columns.front().values;
  const double ratio = (v[k] - v[k - 1]) / (v[k - 1] - v[k - 2]);
  Eigenvalues predicted = modes;
  for (std::size_t i = 0; i < modes.size(); ++i)
    if (side(earlier.reference->modes[i]) == side(modes[i]))
      predicted[i] += ratio * (modes[i] - earlier.reference->modes[i]);
  return predicted;
}

}  // namespace

GridTrim first_point(const Prepared& sweep, const GridPlace& place,
                     std::optional<OperatingPoint>& known) {
  std::optional<GridTrim> e;
  if (known) e = settle(sweep, place, *known);
  if (!e) e = from_nothing(sweep, place);
  if (e->valid()) known = e->at;
  return *e;
}

std::optional<OperatingPoint> last_point(const Prepared& sweep, GridPlace place,
                                         const std::optional<OperatingPoint>& after) {
  place.back() = double(sweep.axes.back().size() - 1);
  if (!after) {
    const GridTrim own = from_nothing(sweep, place);
    return own.valid() ? std::optional(own.at) : std::nullopt;
  }
  if (const auto e = settle(sweep, place, *after)) return e->at;
  OperatingPoint at = numbers_at(sweep, place);  // parameters of this line, unknowns of the other
  for (const Index j : sweep.problem.unknowns) set_value(at, j, value_of(*after, j));
  return at;
}

void start_first_points(const Prepared& sweep, const Lines& lines, std::vector<LineStart>& starts,
                        std::vector<std::string>& mode_names) {
  const std::size_t n = std::size_t(sweep.states());
  std::vector<std::optional<OperatingPoint>> last(starts.size());
  for (std::size_t l = 0; l < starts.size(); ++l) {
    LineStart& s = starts[l];
    s.confidence.assign(n, 0);
    const auto before = lines.next_to(l, true);
    if (before) {
      last[l] = last[*before];
      s.reference = starts[*before].reference;
    }
    s.first = first_point(sweep, s.place, last[l]);
    if (!s.first.valid()) continue;
    const Eigen::MatrixXd A = s.first.A(sweep);
    const Eigenvalues lambda = eigenvalues_of(A);
    if (lambda.size() != n) continue;
    if (mode_names.empty()) {
      Named named = named_modes(sweep, s.first);
      if (named.reference.modes.size() != n) continue;
      mode_names = named.names;
      s.reference = named.reference;
      s.confidence.assign(n, 255);
    } else if (s.reference) {
      const Ordered ordered = in_order(
          *s.reference, before ? foreseen(lines, starts, l, *before) : s.reference->modes, A,
          lambda,
          before ? trims_between(sweep, lines.place(*before), s.place, s.first.at) : nullptr);
      s.reference = Reference{A, ordered.modes};
      s.confidence = ordered.confidence;
    }
  }
}

void start_last_points(const Prepared& sweep, const Lines& lines, std::vector<LineStart>& starts) {
  for (std::size_t l = starts.size(); l-- > 0;) {
    const auto after = lines.next_to(l, false);
    starts[l].last = last_point(sweep, starts[l].place, after ? starts[*after].last : std::nullopt);
  }
}

void name_late(const Prepared& sweep, std::size_t condition, SweepMap& map) {
  std::vector<std::string>& all = map.mode_names[condition];
  const std::size_t n = map.modes(), count = map.points_per_condition();
  if (std::ranges::any_of(all, [](const std::string& name) { return !name.empty(); })) return;
  for (std::size_t p = condition * count; p < (condition + 1) * count; ++p) {
    if (map.verdict[p] < 0) continue;
    GridPlace place;
    const std::vector<std::size_t> position = map.position(p);
    for (std::size_t a = 1; a < position.size(); ++a) place.push_back(double(position[a]));
    const GridTrim e = from_nothing(sweep, place);
    if (!e.valid() || !e.A(sweep).allFinite()) return;
    const Named named = named_modes(sweep, e);
    for (std::size_t i = 0; i < n && i < named.names.size(); ++i) {
      const std::complex<double> own(map.eigenvalue_re[p * n + i], map.eigenvalue_im[p * n + i]);
      const auto nearest = std::ranges::min_element(
          named.reference.modes, {}, [&](const auto& z) { return std::abs(z - own); });
      all[i] = named.names[std::size_t(nearest - named.reference.modes.begin())];
    }
    return;
  }
}

}  // namespace tiltrim
