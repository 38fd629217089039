#include "sweep/line_chain.hpp"

#include <algorithm>

#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;

// Line (i, j, ..., k) has its first point from the line before it along the fastest slower axis
// with an index above zero, and its last point from the next line along the fastest one that is not
// at its end. Of the lines before a row, its start needs only those with faster indices of zero.
LineChain::LineChain(const Prepared& sweep, std::size_t line)
    : sweep_(sweep), lines_{sweep.axes}, line_(line) {
  const std::size_t slower = sweep.axes.size() - 1;
  firsts_.resize(std::max<std::size_t>(slower, 1));
  ends_.resize(slower);
  const GridPlace to = lines_.place(line);
  GridPlace at(sweep.axes.size(), 0.0);
  const auto number = [&] {
    std::size_t n = 0;
    for (std::size_t a = 0; a < slower; ++a) n = n * sweep.axes[a].size() + std::size_t(at[a]);
    return n;
  };
  if (line > 0) (void)first(0);
  for (std::size_t a = 0; a < slower; ++a)
    while (at[a] < to[a]) {
      ++at[a];
      if (number() < line) (void)first(number());
    }
  for (std::size_t a = 0; a < slower; ++a) fill_ends(a, to);
}

GridTrim LineChain::first(std::size_t line) {
  const GridPlace place = lines_.place(line);
  std::size_t from = sweep_.axes.size() - 1;  // the axis along which the line before lies
  while (from > 0 && place[from - 1] == 0) --from;
  std::optional<OperatingPoint> known;
  if (from > 0) known = firsts_[from - 1];
  GridTrim e = first_point(sweep_, place, known);
  for (std::size_t a = from > 0 ? from - 1 : 0; a < firsts_.size(); ++a) firsts_[a] = known;
  return e;
}

// From the end of the row to its beginning; the faster axes are at their ends.
void LineChain::fill_ends(std::size_t axis, GridPlace place) {
  const std::size_t slower = sweep_.axes.size() - 1, size = sweep_.axes[axis].size();
  for (std::size_t a = axis; a < slower; ++a) place[a] = double(sweep_.axes[a].size() - 1);
  const std::size_t n = sweep_.problem.unknowns.size();
  Ends& ends = ends_[axis];
  ends.known.assign(size, 0);
  ends.unknowns.resize(size * n);
  std::optional<OperatingPoint> last;
  if (axis > 0) last = end(axis - 1, place);
  for (std::size_t k = size; k-- > 0;) {
    place[axis] = double(k);
    if (axis == 0 || k + 1 < size) last = last_point(sweep_, place, last);
    ends.known[k] = last.has_value();
    if (!last) continue;
    for (std::size_t i = 0; i < n; ++i)
      ends.unknowns[k * n + i] = value_of(*last, sweep_.problem.unknowns[i]);
  }
}

std::optional<OperatingPoint> LineChain::end(std::size_t axis, GridPlace place) const {
  const Ends& ends = ends_[axis];
  const auto k = std::size_t(place[axis]);
  if (!ends.known[k]) return {};
  place.back() = double(sweep_.axes.back().size() - 1);
  OperatingPoint at = numbers_at(sweep_, place);
  const std::size_t n = sweep_.problem.unknowns.size();
  for (std::size_t i = 0; i < n; ++i)
    set_value(at, sweep_.problem.unknowns[i], ends.unknowns[k * n + i]);
  return at;
}

// φ at all points is that of the line before if it has the same values, bit for bit, at points
// spread over the line. It is computed for the second line of those: one on its own computes it
// itself.
std::shared_ptr<const std::vector<double>> LineChain::phi_of(const LineStart& start) {
  constexpr std::size_t spread = 16;  // pieces of the line
  const Model::Affine* structure = sweep_.affine.back();
  if (!structure || !start.first.valid()) return {};
  const std::size_t axis = sweep_.axes.size() - 1, last = sweep_.axes[axis].size() - 1;
  std::vector<std::optional<double>> some;
  OperatingPoint at = start.first.at;
  for (std::size_t i = 0; i <= spread; ++i) {
    const std::size_t point = last * i / spread;
    move_to(sweep_, axis, double(point), at);
    some.push_back(structure->phi(at.p));
  }
  if (some != some_phi_) {
    some_phi_ = some;
    phi_ = {};
    return {};
  }
  if (!phi_) {
    std::vector<double> phi = phi_along(sweep_, start.first.at);
    if (!phi.empty()) phi_ = std::make_shared<const std::vector<double>>(std::move(phi));
  }
  return phi_;
}

LineStart LineChain::next() {
  const std::size_t slower = sweep_.axes.size() - 1;
  LineStart start;
  start.place = lines_.place(line_);
  start.first = first(line_);
  start.last = slower > 0 ? end(slower - 1, start.place) : last_point(sweep_, start.place, {});
  start.phi = phi_of(start);
  ++line_;
  if (line_ >= lines_.count()) return start;
  const GridPlace place = lines_.place(line_);  // rows that begin with the next line
  std::size_t changed = slower;
  while (changed > 0 && place[changed - 1] == 0) --changed;
  for (std::size_t a = changed; a < slower; ++a) fill_ends(a, place);
  return start;
}

}  // namespace tiltrim
