#include "sweep/halves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sweep/side_by_side.hpp"

namespace tiltrim {

using Eigen::Index;

static std::vector<SweepAxis> with_middles(const Prepared& sweep, std::size_t axis) {
  std::vector<SweepAxis> axes = sweep.axes;
  for (SweepAxis::Column& column : axes[axis].columns) column.values.clear(), column.si.clear();
  for (std::size_t i = 0; i + 1 < 2 * sweep.axes[axis].size(); ++i) {
    const std::vector<double> si = values_at(sweep.axes[axis], 0.5 * double(i));
    for (std::size_t c = 0; c < si.size(); ++c) {
      axes[axis].columns[c].values.push_back(coordinate(sweep.axes[axis], 0.5 * double(i)));
      axes[axis].columns[c].si.push_back(si[c]);
    }
  }
  return axes;
}

Halved::Halved(const Prepared& whole, std::size_t axis)
    : axes(with_middles(whole, axis)), sweep(whole.request, axes, whole.trimming) {}

dense::SmallMatrix Halves::A(std::size_t i) const {
  dense::SmallMatrix A(line.A.n, line.A.n);
  for (Index c = 0; c < A.cols(); ++c)
    for (Index r = 0; r < A.rows(); ++r) A(r, c) = line.A(r, c, Index(i));
  return A;
}

PerMode<Complex> Halves::eigenvalues(std::size_t i) const {
  PerMode<Complex> lambda;
  for (std::size_t at = i; at < batch.re.size(); at += line.count)
    lambda.push_back({batch.re[at], batch.im[at]});
  std::ranges::sort(lambda, {}, [](Complex z) { return std::pair(z.real(), z.imag()); });
  return lambda;
}

int Halves::unstable(std::size_t i) const {
  return int(std::ranges::count_if(eigenvalues(i), [](Complex z) { return z.real() > 0; }));
}

Sample Halves::sample(std::size_t i) const {
  const PerMode<Complex> lambda = eigenvalues(i);
  return {0.5 * double(i), line.at(i), A(i),
          Eigen::Map<const Eigen::VectorXcd>(lambda.data(), std::ssize(lambda))};
}

dense::SmallMatrix Halves::bend(std::size_t i) const { return A(i - 1) - 2 * A(i) + A(i + 1); }

std::vector<double> Halves::bends() const {
  std::vector<double> all(line.count, std::numeric_limits<double>::quiet_NaN());
  if (line.count < 3) return all;
  std::fill(all.begin() + 1, all.end() - 1, 0.0);
  for (Index c = 0; c < line.A.n; ++c)
    for (Index r = 0; r < line.A.n; ++r)
      for (Index i = 1; i + 1 < Index(line.count); ++i) {
        const double own = line.A(r, c, i - 1) - 2 * line.A(r, c, i) + line.A(r, c, i + 1);
        all[std::size_t(i)] += own * own;
      }
  for (std::size_t i = 1; i + 1 < line.count; ++i)
    all[i] = found(i - 1) && found(i) && found(i + 1) ? std::sqrt(all[i])
                                                      : std::numeric_limits<double>::quiet_NaN();
  return all;
}

double Halves::apart(std::size_t i, std::size_t k) const {
  const std::size_t n = line.n_unknowns();
  double most = 0.0;
  for (std::size_t j = 0; j < n; ++j)
    most = std::max(most, std::abs(line.unknowns[i * n + j] - line.unknowns[k * n + j]) /
                              line.sweep.problem.nominal[Index(j)]);
  return most;
}

namespace {

// By Newton from the map's equilibrium.
GridTrim alone(const GridLine& line, std::size_t i) {
  const std::size_t k = i / 2;
  if (!line.valid(k)) return {};
  return settle(line.sweep, line.at(0.5 * double(i)), operating_point(line, k))
      .value_or(GridTrim{});
}

// True if the walk has come to the map's equilibrium at point k.
bool as_in_map(const GridLine& line, const LineTracker& walked, std::size_t k) {
  const std::size_t n = std::size_t(line.sweep.states());
  const auto there = std::span(line.map.state).subspan(line.point(k) * n, n);
  const auto here = std::span(walked.points.state).subspan(2 * k * n, n);
  for (std::size_t i = 0; i < n; ++i)
    if (!(std::abs(here[i] - there[i]) <= other_branch * line.sweep.model().states[i].nominal))
      return false;
  return line.valid(k);
}

}  // namespace

std::vector<Halves> walk_halves(const Halved& halved, const std::vector<const GridLine*>& lines,
                                std::vector<Room>& rooms) {
  static thread_local std::vector<LinePoints> points(Model::model_lanes);
  std::vector<Halves> all;
  for (std::size_t l = 0; l < lines.size(); ++l)
    all.push_back(
        {begin_line(halved.sweep, lines[l]->place, lines[l]->axis, points[l], rooms.at(l), false),
         rooms[l].eigenvalues});
  std::vector<LineTracker*> walked;
  for (Halves& h : all) walked.push_back(&h.line);
  const auto kept_alone = [&](std::size_t l, std::size_t i) {
    const GridTrim e = alone(*lines[l], i);
    keep_trim(*walked[l], i, e);
    return e;
  };
  if (has_lanes(halved.sweep))
    walk_side_by_side(walked, kept_alone);
  else
    for (std::size_t l = 0; l < lines.size(); ++l)
      for (std::size_t i = 0; i < walked[l]->count; ++i) (void)kept_alone(l, i);
  for (std::size_t l = 0; l < lines.size(); ++l) {
    Room& room = rooms[l];
    tiltrim::eigenvalues(room.A, room.eigenvalues);
    for (std::size_t i = 0; i < room.valid.size(); ++i) {
      // A middle is on the branch of the point before it.
      const bool same = i % 2 == 0 ? as_in_map(*lines[l], *walked[l], i / 2) : room.valid[i - 1];
      room.valid[i] =
          room.valid[i] && same && room.eigenvalues.status[i] < LaneStatus::not_converged;
    }
  }
  return all;
}

}  // namespace tiltrim
