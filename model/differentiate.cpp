#include "model/differentiate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <stdexcept>

#include "model/lookup.hpp"
#include "model/many.hpp"
#include "model/spacing.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// Minimizes the sum of truncation error O(h²) and round-off O(ε/h).        [4, sec. 8.1; 5]
const double central_step = std::cbrt(epsilon);
const std::vector<double> near_steps{1, -1, 2, -2};

VectorXd rates_and_outputs(const Model& model, const OperatingPoint& point,
                           Wanted wanted = Wanted::rates_and_outputs) {
  if (wanted == Wanted::rates) {
    VectorXd all = VectorXd::Zero(std::ssize(model.states) + std::ssize(model.outputs));
    const VectorXd rates = model.f(point.x, point.u, point.p);
    check_rates(model, rates);
    all.head(rates.size()) = rates;
    return all;
  }
  const Evaluation e = evaluate(model, point);
  VectorXd all(e.rates.size() + e.outputs.size());
  all << e.rates, e.outputs;
  return all;
}

double step_of(const Model& model, const OperatingPoint& point, Index variable) {
  const double value = value_of(point, variable);
  const double asked = central_step * signal_of(model, variable).nominal;
  const double h = (value + asked) - value;  // the actual step, not the requested one
  return h != 0 ? h : std::nextafter(std::abs(value), INFINITY) - std::abs(value);
}

// [f; h] at these steps along each variable in turn, in one call of a model that evaluates many
// points: the samples of a variable in adjacent columns. Empty for other models, and if a value is
// missing: then one call for each point tells which.
MatrixXd samples_at_once(const Model& model, const OperatingPoint& point,
                         const std::vector<Index>& variables, const std::vector<double>& steps) {
  const Many* const all = many(model);
  if (!all || variables.empty()) return {};
  const Index count = std::ssize(variables) * std::ssize(steps), nx = point.x.size();
  const Index nu = point.u.size();
  MatrixXd z(nx + nu + point.p.size(), count);
  for (Index c = 0; c < count; ++c) z.col(c) << point.x, point.u, point.p;
  Index c = 0;
  for (const Index j : variables)
    for (const double s : steps) z(j, c++) = value_of(point, j) + s * step_of(model, point, j);
  try {
    MatrixXd y = all->values(z.topRows(nx), z.middleRows(nx, nu), z.bottomRows(z.rows() - nx - nu));
    return y.allFinite() ? y : MatrixXd();
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::exception&) {
    return {};
  }
}

// No bound is closer than two steps.
bool has_room(const Model& model, const OperatingPoint& point, const std::vector<Index>& variables,
              const std::vector<Range>& bounds) {
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    const double value = value_of(point, variables[k]), h = step_of(model, point, variables[k]);
    if (!(bounds[k].lower <= value - 2 * h && value + 2 * h <= bounds[k].upper)) return false;
  }
  return true;
}

// [f; h] along one variable: samples at the point and at multiples of the step on both sides.
struct Line {
  const Model& model;
  OperatingPoint at;
  Index variable;
  double value, h;
  Wanted wanted;

  Line(const Model& m, const OperatingPoint& point, Index j,
       Wanted sampled = Wanted::rates_and_outputs)
      : model(m),
        at(point),
        variable(j),
        value(value_of(point, j)),
        h(step_of(m, point, j)),
        wanted(sampled) {}
  // NaN where the model throws: only one side may be outside its domain.
  VectorXd sample(double steps) {
    for (Index i = 0; i < known.cols(); ++i)
      if (near_steps[std::size_t(i)] == steps) return known.col(i);
    set_value(at, variable, value + steps * h);
    VectorXd y = VectorXd::Constant(std::ssize(model.states) + std::ssize(model.outputs), NAN);
    try {
      y = rates_and_outputs(model, at, wanted);
    } catch (const CallerMistake&) {
      throw;
    } catch (...) {
      if (!thrown) thrown = std::current_exception();
    }
    set_value(at, variable, value);
    return y;
  }
  // If a derivative is missing because the model threw, passes on the model's exception.
  void check(const VectorXd& slope) const {
    if (thrown && !slope.allFinite()) std::rethrow_exception(thrown);
  }
  std::exception_ptr thrown;
  MatrixXd known{};  // samples at near_steps, or none
};

// One column of the Jacobian: two estimates of the derivative with truncation errors in the ratio
// 1 : 4; a third, for one-sided differences with ratio 16, for central ones with ratio 1/4, where
// it is needed.
struct Column {
  VectorXd fine, coarse, coarser, finer;
  VectorXd scale;  // largest |sample| of each row
  VectorXd noise;  // round-off of the samples, as observed
  VectorXd moved;  // 1 where a sample differs, 0 where all are equal: a difference without error
  double h = 0.0;  // smallest distance between samples
};

VectorXd differing(const VectorXd& y0, std::initializer_list<const VectorXd*> samples) {
  return VectorXd::NullaryExpr(y0.size(), [&](Index row) {
    return double(
        std::ranges::any_of(samples, [&](const VectorXd* y) { return (*y)[row] != y0[row]; }));
  });
}

//   y' = (-3 y₀ + 4 y(h) - y(2h)) / 2h + O(h²), to the side of the given sign
Column one_sided(Line& line, const VectorXd& y0, double side) {
  const VectorXd y1 = line.sample(side);
  const VectorXd y2 = line.sample(2 * side);
  const VectorXd y4 = line.sample(4 * side);
  const VectorXd y8 = line.sample(8 * side);
  const VectorXd fine = side * (-3 * y0 + 4 * y1 - y2) / (2 * line.h);
  const VectorXd coarse = side * (-3 * y0 + 4 * y2 - y4) / (4 * line.h);
  const VectorXd coarser = side * (-3 * y0 + 4 * y4 - y8) / (8 * line.h);
  const VectorXd scale = y0.cwiseAbs().cwiseMax(y1.cwiseAbs());
  const VectorXd moved = differing(y0, {&y1, &y2, &y4, &y8});
  constexpr double weights = 4;  // (3 + 4 + 1)/2 half spacings
  const VectorXd noise = VectorXd::NullaryExpr(y0.size(), [&](Index row) {
    return weights / 2 * spacing({y0[row], y1[row], y2[row], y4[row], y8[row]});
  });
  return {fine, coarse, coarser, {}, scale, noise, moved, line.h};
}

constexpr double rounding = 8.0;  // round-offs by which two estimates may differ

// For a smooth function the estimates converge by a factor of four per halved step; near a pole, a
// root or a logarithm's singularity they do not, and the error of the finest is unknown.
bool settles(const Column& c, Index row, double round_off) {
  constexpr double least = 2.0;
  const auto converge = [&](double fine, double coarse, double coarser, double noise) {
    const double near = std::abs(fine - coarse), far = std::abs(coarse - coarser);
    return near <= rounding * noise || far >= least * near;
  };
  if (c.coarser.size() > 0) return converge(c.fine[row], c.coarse[row], c.coarser[row], round_off);
  if (c.finer.size() > 0) return converge(c.finer[row], c.fine[row], c.coarse[row], 2 * round_off);
  return true;
}

// The third estimate of a central difference, if the first two differ by more than rounding.
void refine(const Model& model, const OperatingPoint& point, Index variable,
            const VectorXd& round_off, Column& c) {
  const VectorXd spread = (c.fine - c.coarse).cwiseAbs();
  if (c.coarser.size() > 0 || !(spread.array() > rounding * round_off.array()).any()) return;
  Line line(model, point, variable);
  c.finer = (line.sample(0.5) - line.sample(-0.5)) / line.h;
}

// The four neighbours of a point along a line, and tests on their one-sided differences.
struct Neighbours {
  VectorXd y0, ahead, behind, far_ahead, far_behind;

  // Change of the one-sided difference when the step is doubled.
  double unevenness(double side, Index row) const {
    const VectorXd& near = side > 0 ? ahead : behind;
    const VectorXd& far = side > 0 ? far_ahead : far_behind;
    return std::abs((far[row] - y0[row]) / 2 - (near[row] - y0[row]));
  }

  // For a smooth function the two one-sided differences differ by h f'', and by twice as much at
  // twice the step. At a kink they differ by a constant, at a jump by Δ/h, and near a kink or jump
  // by any factor but two.
  bool kink(Index row) const {
    const double gap = std::abs(ahead[row] - 2 * y0[row] + behind[row]);
    const double far_gap = std::abs(far_ahead[row] - 2 * y0[row] + far_behind[row]) / 2;
    const double size = std::max({std::abs(y0[row]), std::abs(ahead[row]), std::abs(behind[row])});
    const double motion = std::abs(ahead[row] - behind[row]);
    constexpr double noise = 1024 * epsilon;  // round-off of a long sum of cancelling terms
    constexpr double share = 1e-3;            // of the motion: the curvature within a step
    return gap > noise * std::max(size, 1.0) && gap > share * motion &&
           std::abs(far_gap - 2 * gap) > 0.1 * gap;
  }
};

// The fourth difference (h⁴ f⁗ is negligible) is pure noise: √70 ≈ 8 times that of one sample; by
// chance it may be half of that.
Column central(const Line& line, const Neighbours& n) {
  const VectorXd scale = n.ahead.cwiseAbs().cwiseMax(n.behind.cwiseAbs());
  const VectorXd fourth = n.far_ahead - 4 * n.ahead + 6 * n.y0 - 4 * n.behind + n.far_behind;
  VectorXd noise = fourth.cwiseAbs() / 4;
  for (Index row = 0; row < noise.size(); ++row)
    noise[row] = std::max(
        noise[row],
        spacing({n.far_behind[row], n.behind[row], n.y0[row], n.ahead[row], n.far_ahead[row]}) / 2);
  return {(n.ahead - n.behind) / (2 * line.h),
          (n.far_ahead - n.far_behind) / (4 * line.h),
          {},
          {},
          scale,
          noise,
          differing(n.y0, {&n.ahead, &n.behind, &n.far_ahead, &n.far_behind}),
          line.h};
}

std::string kink_remark(const Model& model, const Line& line, const Signal& signal, double side) {
  const char* direction = side > 0 ? "above" : "below";
  OperatingPoint low = line.at;
  OperatingPoint high = line.at;
  set_value(low, line.variable, line.value - 2 * line.h);
  set_value(high, line.variable, line.value + 2 * line.h);
  for (const Model::Switch& s : model.switches)
    if (s.distance(low) * s.distance(high) <= 0)
      return fmt::format("{}: one-sided difference from {}, at a kink: {}", signal.name, direction,
                         s.name);
  return fmt::format("{}: one-sided difference from {}, at a kink of the model", signal.name,
                     direction);
}

Column column(const Model& model, Line& line, const VectorXd& y0, const Range& bounds,
              std::vector<std::string>& remarks) {
  const Signal& signal = signal_of(model, line.variable);
  const auto room = [&](double steps) {  // for this many steps on either side
    const double reached = line.value + steps * line.h;
    return bounds.lower <= reached && reached <= bounds.upper;
  };
  if (!room(2) || !room(-2)) {
    if (!room(4) && !room(-4))
      throw CallerMistake(
          fmt::format("'{}': the bounds are too close for a finite difference", signal.name));
    const double side = room(4) ? 1.0 : -1.0;
    if (!room(8 * side)) line.h /= 2;
    remarks.push_back(fmt::format("{}: one-sided difference from {}, at a limit", signal.name,
                                  side > 0 ? "above" : "below"));
    return one_sided(line, y0, side);
  }
  const Neighbours n{y0, line.sample(1), line.sample(-1), line.sample(2), line.sample(-2)};
  const bool ahead = n.ahead.allFinite() && n.far_ahead.allFinite();
  const bool behind = n.behind.allFinite() && n.far_behind.allFinite();
  if (ahead != behind) {
    remarks.push_back(
        fmt::format("{}: one-sided difference from {}, at the edge of the model's domain",
                    signal.name, ahead ? "above" : "below"));
    return one_sided(line, y0, ahead ? 1.0 : -1.0);
  }
  for (Index row = 0; row < y0.size(); ++row) {
    if (!n.kink(row)) continue;
    const double side = n.unevenness(1, row) <= n.unevenness(-1, row) ? 1.0 : -1.0;
    remarks.push_back(kink_remark(model, line, signal, side));
    return one_sided(line, y0, side);
  }
  return central(line, n);
}

// Size of the terms that cancel in each row: its value, and its change over the nominal sizes.
VectorXd term_sizes(const Model& model, const OperatingPoint& point,
                    const std::vector<Index>& variables, const MatrixXd& J, VectorXd sizes) {
  for (Index k = 0; k < J.cols(); ++k) {
    const Index j = variables[std::size_t(k)];
    const double reach = std::max(std::abs(value_of(point, j)), signal_of(model, j).nominal);
    sizes += J.col(k).cwiseAbs() * reach;
  }
  return sizes;
}

MatrixXd given_derivatives(const Model& model, const OperatingPoint& point,
                           const std::vector<Index>& variables) {
  MatrixXd J = model.derivatives(point, variables);
  check_derivatives(model, J, variables.size());
  return J;
}

}  // namespace

Differences difference(const Model& model, const OperatingPoint& point,
                       const std::vector<Index>& variables, const std::vector<Range>& bounds) {
  const VectorXd y0 = rates_and_outputs(model, point);
  const Index n = std::ssize(variables);
  Differences d{{MatrixXd(y0.size(), n), MatrixXd(y0.size(), n)}, {}};
  std::vector<Column> columns;
  const MatrixXd samples = has_room(model, point, variables, bounds)
                               ? samples_at_once(model, point, variables, near_steps)
                               : MatrixXd();
  const Index each = std::ssize(near_steps);
  for (Index k = 0; k < n; ++k) {
    Line line(model, point, variables[std::size_t(k)]);
    if (samples.size() > 0) line.known = samples.middleCols(each * k, each);
    const Range range = bounds.empty() ? Range{} : bounds.at(std::size_t(k));
    columns.push_back(column(model, line, y0, range, d.remarks));
    d.jacobian.value.col(k) = columns.back().fine;
    line.check(columns.back().fine);
  }
  // A NaN entry must not affect the other entries of its row.
  VectorXd largest = y0.cwiseAbs();
  VectorXd noise = VectorXd::Zero(y0.size());
  MatrixXd known = d.jacobian.value;
  for (Index k = 0; k < n; ++k)
    for (Index row = 0; row < y0.size(); ++row) {
      const Column& c = columns[std::size_t(k)];
      if (!std::isfinite(c.fine[row])) known(row, k) = 0;
      if (!std::isfinite(c.fine[row]) || !std::isfinite(c.noise[row])) continue;
      largest[row] = std::max(largest[row], c.scale[row]);
      noise[row] = std::max(noise[row], c.noise[row]);
    }
  const VectorXd sizes = term_sizes(model, point, variables, known, largest);
  for (Index k = 0; k < n; ++k) {
    Column& c = columns[std::size_t(k)];
    const VectorXd spread = (c.fine - c.coarse).cwiseAbs();
    const double weights =
        c.coarser.size() > 0 ? 4.0 : 1.0;  // weights of a difference's samples: 3, 4 and 1 over 2
    const VectorXd round_off = (weights * epsilon * sizes + 2 * noise) / c.h;
    d.jacobian.error.col(k) = c.moved.cwiseProduct(spread + round_off);
    refine(model, point, variables[std::size_t(k)], round_off, c);
    for (Index row = 0; row < y0.size(); ++row)
      if (!settles(c, row, round_off[row])) d.jacobian.error(row, k) = INFINITY;
  }
  return d;
}

Estimate exact(const Model& model, const OperatingPoint& point,
               const std::vector<Index>& variables) {
  if (!model.derivatives) throw std::invalid_argument("the model has no exact derivatives");
  Estimate e{given_derivatives(model, point, variables), {}};
  // A derivative that is not finite must not affect the others of its row.
  const MatrixXd known = e.value.array().isFinite().select(e.value, 0.0);
  const VectorXd sizes = term_sizes(model, point, variables, known, VectorXd::Zero(e.value.rows()));
  constexpr double operations = 16;  // approximate number of roundings in a derivative
  e.error.resizeLike(e.value);
  for (Index k = 0; k < e.value.cols(); ++k) {
    const Index j = variables[std::size_t(k)];
    const double reach = std::max(std::abs(value_of(point, j)), signal_of(model, j).nominal);
    const auto moved = (e.value.col(k).array() != 0).cast<double>();
    e.error.col(k) =
        operations * epsilon * (e.value.col(k).cwiseAbs().array() + moved * sizes.array() / reach);
  }
  return e;
}

std::vector<Disagreement> disagreements(const Model& model, const std::vector<Index>& variables,
                                        const Estimate& exact, const Estimate& differences) {
  constexpr double doubt = 10.0;
  std::vector<Disagreement> found;
  for (Index i = 0; i < exact.value.rows(); ++i)
    for (Index j = 0; j < exact.value.cols(); ++j) {
      const double own = exact.value(i, j), difference = differences.value(i, j);
      const double apart = std::abs(own - difference);
      const double allowed = doubt * (exact.error(i, j) + differences.error(i, j));
      if (!std::isfinite(own) || !std::isfinite(difference) || apart <= allowed) continue;
      found.push_back(
          {i, j, apart,
           fmt::format("d{}/d{}: exact {:.6g} and difference {:.6g} disagree", row_name(model, i),
                       signal_of(model, variables[std::size_t(j)]).name, own, difference)});
    }
  return found;
}

MatrixXd jacobian(const Model& model, const OperatingPoint& point,
                  const std::vector<Index>& variables, bool* exact, Wanted wanted) {
  if (exact) *exact = bool(model.derivatives);
  MatrixXd J = model.derivatives ? given_derivatives(model, point, variables)
                                 : MatrixXd(std::ssize(model.states) + std::ssize(model.outputs),
                                            std::ssize(variables));
  if (model.derivatives && std::isfinite((0.0 * J).sum())) return J;  // as is each of them
  static const std::vector<double> beside{1, -1};
  const MatrixXd samples =
      model.derivatives ? MatrixXd() : samples_at_once(model, point, variables, beside);
  for (Index k = 0; k < J.cols(); ++k) {
    if (model.derivatives && J.col(k).allFinite()) continue;
    if (exact) *exact = false;
    const VectorXd own = J.col(k);
    if (samples.size() > 0) {
      const double h = step_of(model, point, variables[std::size_t(k)]);
      J.col(k) = (samples.col(2 * k) - samples.col(2 * k + 1)) / (2 * h);
      continue;
    }
    Line line(model, point, variables[std::size_t(k)], wanted);
    const VectorXd ahead = line.sample(1), behind = line.sample(-1);
    J.col(k) = (ahead - behind) / (2 * line.h);
    if (ahead.allFinite() != behind.allFinite()) {  // at the edge of the model's domain
      const VectorXd here = line.sample(0);
      J.col(k) = ahead.allFinite() ? (ahead - here) / line.h : (here - behind) / line.h;
    }
    if (model.derivatives) J.col(k) = own.array().isFinite().select(own, J.col(k));
    line.check(J.col(k));
  }
  return J;
}

}  // namespace tiltrim
