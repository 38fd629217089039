#include "follow/envelope_rows.hpp"

#include <algorithm>
#include <cmath>

namespace tiltrim {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

constexpr double same_break = 1e-9;  // scaled: closer breaks of a row are the same

struct Break {
  double x;  // scaled
  std::string name;
};

// Where a piece of border crosses a row between two of its points, to round-off; less accurate
// next to a switch, where Newton does not converge.
Break crossing(const Grid& g, const Followed& f, const VectorXd& a, const VectorXd& b, double row) {
  const Index n = a.size();
  const double rise = b[n - 1] - a[n - 1];
  const double share = rise != 0 ? std::clamp((row - a[n - 1]) / rise, 0.0, 1.0) : 0.0;
  const VectorXd y = a + share * (b - a);
  const auto at =
      in_plane(border(g.plane, f.stop, y), y, VectorXd::Unit(n, n - 1), row, (b - a).norm() + 1e-3);
  return {at.value_or(y)[n - 2], f.piece.name};
}

std::vector<Break> breaks(const Grid& g, const std::vector<Followed>& border, double row) {
  constexpr double on_row =
      2e-5;  // a piece that ends at the plane's edge may stop this far before it
  std::vector<Break> all{{g.plane.lower[0], "edge"}, {g.plane.upper[0], "edge"}};
  for (const Followed& f : border) {
    const auto above = [&](const VectorXd& y) { return y[y.size() - 1] - row; };
    for (std::size_t k = 0; k + 1 < f.way.size(); ++k)
      if ((above(f.way[k]) < 0) != (above(f.way[k + 1]) < 0))
        all.push_back(crossing(g, f, f.way[k], f.way[k + 1], row));
    for (const VectorXd* end : {&f.way.front(), &f.way.back()})
      if (std::abs(above(*end)) <= on_row) all.push_back(crossing(g, f, *end, *end, row));
  }
  std::ranges::stable_sort(all, {}, &Break::x);
  return all;
}

// A trim within the limits at the point, if one is found, starting from nearby trims and from the
// border. Near a fold its two trims are close to each other and are started away from the fold.
std::optional<VectorXd> somewhere(const Grid& g, const std::vector<Followed>& border,
                                  const Vector2d& p) {
  constexpr int cap = 20;
  const Vector2d cell =
      (g.plane.upper - g.plane.lower).cwiseQuotient(Vector2d(g.x.count - 1, g.y.count - 1));
  std::vector<VectorXd> starts = around(g, p);
  for (const Followed& f : border)
    for (const VectorXd& y : f.way) {
      if ((y.tail<2>() - p).cwiseAbs().cwiseQuotient(cell).maxCoeff() > 1.0) continue;
      starts.push_back(y.head(g.n()));
      if (f.stop.limit) continue;
      const VectorXd c = FoldTest(g.plane, y).c;
      for (const double off : {-0.3, -0.05, 0.05, 0.3}) starts.push_back(y.head(g.n()) + off * c);
    }
  g.put(p);
  for (VectorXd& z : starts) {
    if (settle(g, z, cap) != Settled::trim) continue;
    VectorXd y(g.n() + 2);
    y << z, p;
    return y;
  }
  return {};
}

// Where trims end on a row between x with a trim and x without: at a stop not found as a piece, or
// where the values are not finite; in that case bisection finds the last trim.
Break last_between(const Grid& g, const std::vector<Followed>& border, VectorXd with,
                   double without, double row) {
  constexpr int halvings = 40;
  constexpr double beyond = 1e-6;
  const Index at_x = g.n();
  const double way_out = without > with[at_x] ? 1.0 : -1.0;
  const Way way = go(g.plane, with, Vector2d(without, row));
  if (way.met) {
    const double x = way.met->y[at_x];
    if (!somewhere(g, border, Vector2d(x + way_out * beyond, row)))
      return {x, way.met->stop.name()};
  }
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (with[at_x] + without);
    if (auto y = somewhere(g, border, Vector2d(middle, row)))
      with = *y;
    else
      without = middle;
  }
  return {with[at_x], "lost"};
}

// x at which a row is tested between two of its breaks: grid values, or the middle.
std::vector<double> samples(const Grid& g, double a, double b) {
  std::vector<double> xs{0.5 * (a + b)};
  for (int i = 0; i < g.x.count; ++i)
    if (const double x = g.place(i, 0)[0]; x > a + same_break && x < b - same_break)
      xs.push_back(x);
  std::ranges::sort(xs);
  return xs;
}

}  // namespace

EnvelopeRow row_at(const Grid& g, const std::vector<Followed>& border, double y) {
  const double nominal = g.moving.nominal[g.n()];
  EnvelopeRow row{y * g.moving.nominal[g.n() + 1], {}};
  bool open = false;  // the last interval may continue
  const auto add_piece = [&](const Break& from, const Break& to) {
    if (!open) row.intervals.push_back({{from.x * nominal, from.name}, {}});
    row.intervals.back().to = {to.x * nominal, to.name};
    open = true;
  };
  const std::vector<Break> all = breaks(g, border, y);
  for (std::size_t k = 0; k + 1 < all.size(); ++k) {
    if (!(all[k + 1].x - all[k].x > same_break)) continue;
    const std::vector<double> xs = samples(g, all[k].x, all[k + 1].x);
    Break from = all[k];
    auto last = somewhere(g, border, Vector2d(xs.front(), y));
    open = open && last;
    for (std::size_t i = 1; i < xs.size(); ++i) {
      const auto next = somewhere(g, border, Vector2d(xs[i], y));
      if (last && !next) {
        add_piece(from, last_between(g, border, *last, xs[i], y));
        open = false;
      }
      if (!last && next) from = last_between(g, border, *next, xs[i - 1], y);
      last = next;
    }
    if (last) add_piece(from, all[k + 1]);
  }
  return row;
}

}  // namespace tiltrim
