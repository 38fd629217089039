#include "follow/envelope.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <stdexcept>

#include "follow/envelope_rows.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"

namespace tiltrim {

namespace {

TrimSpec over_plane(const Model& model, const TrimSpec& spec, const EnvelopeAxis& x,
                    const EnvelopeAxis& y) {
  for (const EnvelopeAxis* axis : {&x, &y}) {
    if (!(axis->range.lower < axis->range.upper && std::isfinite(axis->range.lower) &&
          std::isfinite(axis->range.upper)))
      throw std::invalid_argument(fmt::format("the range of '{}' is empty: [{}, {}]", axis->signal,
                                              axis->range.lower, axis->range.upper));
    if (axis->count < 2)
      throw std::invalid_argument(
          fmt::format("'{}' needs at least two grid points, not {}", axis->signal, axis->count));
  }
  if (x.signal == y.signal)
    throw std::invalid_argument(fmt::format("both axes are '{}'", x.signal));
  return with_parameter(model, with_parameter(model, spec, x.signal), y.signal);
}

}  // namespace

// Sheets to where they end, and the border from there, until nothing new is found.
static void explore(Grid& g, std::vector<Followed>& border, std::deque<Seed>& seeds) {
  const auto stopped = [&] { return g.options.stop.stop_requested(); };
  std::deque<Front> front;
  seed(g, front);
  while (!front.empty() && !stopped()) {  // ends: most_sheets trims at a point
    const std::vector<Edge> edges = spread(g, front);
    std::vector<Way> ways(edges.size());
    for_all(g, edges.size(), [&](const Grid& own, std::size_t k) {
      if (!stopped()) ways[k] = go(own.plane, edges[k].from, g.place(edges[k].i, edges[k].j));
    });
    for (std::size_t k = 0; k < edges.size() && !stopped(); ++k) {
      const Edge& edge = edges[k];
      const Way& way = ways[k];
      if (way.arrived) add(g, edge.i, edge.j, way.arrived->head(g.n()), true, front);
      if (way.back) add(g, edge.at_i, edge.at_j, way.back->head(g.n()), true, front);
      if (!way.met) continue;
      seeds.push_back({way.met->stop, way.met->y});
      follow_border(g, seeds, border);
    }
  }
}

static Envelope explored(Grid& g) {
  std::vector<Followed> border;
  std::deque<Seed> seeds;
  explore(g, border, seeds);
  Envelope e;
  e.x = g.x;
  e.y = g.y;
  e.count.resize(g.x.count, g.y.count);
  for (int i = 0; i < g.x.count; ++i)
    for (int j = 0; j < g.y.count; ++j) e.count(i, j) = int(g.sheets.trims[g.node(i, j)].size());
  const auto stopped = [&] { return g.options.stop.stop_requested(); };
  for (Followed& f : border) {
    if (stopped()) break;
    f.piece.points.resize(f.way.size());
    for_all(g, f.way.size(),
            [&](const Grid& own, std::size_t k) { f.piece.points[k] = reported(own, f.way[k]); });
    e.pieces.push_back(f.piece);
  }
  e.rows.resize(stopped() ? 0 : g.options.rows.size());
  for_all(g, e.rows.size(), [&](const Grid& own, std::size_t k) {
    e.rows[k] = row_at(own, border, g.options.rows[k] / g.moving.nominal[g.n() + 1]);
  });
  e.evaluations = g.fixed.evaluations + g.moving.evaluations;
  if (e.count.maxCoeff() == 0) e.status = EnvelopeStatus::empty;
  const auto ends_early = [](const BorderPiece& p) { return p.from == cut_off || p.to == cut_off; };
  if (!seeds.empty() || g.sheets.more || std::ranges::any_of(e.pieces, ends_early))
    e.status = EnvelopeStatus::incomplete;
  if (stopped()) e.status = EnvelopeStatus::interrupted;
  return e;
}

Envelope envelope(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                  const EnvelopeAxis& x, const EnvelopeAxis& y, const EnvelopeOptions& options) {
  const RoundToNearest environment;
  const TrimSpec over = over_plane(model, spec, x, y);
  TrimSpec fixed = over;
  fixed.free.resize(fixed.free.size() - 2);
  Sheets sheets;
  Grid g(model, fixed, over, guess, x, y, options, sheets);
  for (const EnvelopeAxis* axis : {&x, &y})
    check_within_limits(fixed, axis->signal, std::array{axis->range.lower, axis->range.upper});
  for (const auto& [j, range] : g.fixed.fixed_bounds)
    if (const std::string& name = signal_of(model, j).name; name != x.signal && name != y.signal)
      check_within_limits(fixed, name, std::array{value_of(g.fixed.base, j)});
  if (!g.fixed.square())
    throw std::invalid_argument(
        fmt::format("an envelope needs as many unknowns as equations, not {} and {}", g.fixed.n(),
                    g.fixed.m()));
  if (options.threads == 1) return explored(g);
  Envelope e;
  with_threads(options.threads, [&] { e = explored(g); });
  return e;
}

std::string to_string(EnvelopeStatus status) {
  switch (status) {
    case EnvelopeStatus::complete:
      return "complete";
    case EnvelopeStatus::empty:
      return "empty";
    case EnvelopeStatus::interrupted:
      return "interrupted";
    case EnvelopeStatus::incomplete:
      break;
  }
  return "incomplete";
}

}  // namespace tiltrim
