#include "model/feedback.hpp"

#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "dense/products.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::VectorXd;

namespace {

constexpr std::array<const char*, 2> roles = {"plant", "controller"};
using Sides = std::array<OperatingPoint, 2>;

// An input of one side that the other side feeds.
struct Feed {
  std::size_t side;  // the side with the input
  Index input;
  bool from_output;  // otherwise from a state
  Index source;
  std::string name;
  double nominal;
};

// The vectors of the loop are those of the two sides concatenated, without the fed inputs.
struct Loop {
  std::array<Model, 2> models;
  std::vector<Feed> feeds;
  std::array<std::vector<Index>, 2> open;  // inputs of each side that remain inputs

  Index states(std::size_t side) const { return std::ssize(models[side].states); }
  Index outputs(std::size_t side) const { return std::ssize(models[side].outputs); }
  Index parameters(std::size_t side) const { return std::ssize(models[side].parameters); }
};

std::string unit_of(const Signal& s) { return s.unit.empty() ? "" : fmt::format(" [{}]", s.unit); }

std::optional<Feed> feed_of(const std::array<Model, 2>& models, std::size_t side, Index input) {
  const Signal& fed = models[side].inputs[std::size_t(input)];
  const Model& other = models[1 - side];
  const Index output = find(other.outputs, fed.name);
  const Index state = find(other.states, fed.name);
  if (output < 0 && state < 0) return {};
  const Signal& source =
      output >= 0 ? other.outputs[std::size_t(output)] : other.states[std::size_t(state)];
  if (!fed.unit.empty() && !source.unit.empty() && fed.unit != source.unit)
    throw std::invalid_argument(fmt::format(
        "the {}'s input '{}'{} is fed by the {}'s {}, which is{}", roles[side], fed.name,
        unit_of(fed), roles[1 - side], output >= 0 ? "output" : "state", unit_of(source)));
  return Feed{side, input, output >= 0, output >= 0 ? output : state, fed.name, fed.nominal};
}

// A static controller needs no f.
void check_side(Model& m, const char* role) {
  if (!m.f && m.states.empty())
    m.f = [](const VectorXd&, const VectorXd&, const VectorXd&) { return VectorXd(); };
  try {
    check(m);
  } catch (const std::invalid_argument& wrong) {
    throw std::invalid_argument(fmt::format("the {}: {}", role, wrong.what()));
  }
}

Loop connect(const Model& plant, const Model& controller) {
  Loop loop{{plant, controller}, {}, {}};
  for (std::size_t side : {0, 1}) check_side(loop.models[side], roles[side]);
  for (std::size_t side : {0, 1})
    for (Index j = 0; j < std::ssize(loop.models[side].inputs); ++j) {
      if (auto feed = feed_of(loop.models, side, j))
        loop.feeds.push_back(*feed);
      else
        loop.open[side].push_back(j);
    }
  if (loop.feeds.empty())
    throw std::invalid_argument(fmt::format(
        "the loop is not closed: no input of the plant ({}) is an output or state of the "
        "controller ({}), and no input of the controller ({}) is one of the plant ({})",
        fmt::join(names(plant.inputs), ", "), fmt::join(names(controller.outputs), ", "),
        fmt::join(names(controller.inputs), ", "), fmt::join(names(plant.outputs), ", ")));
  return loop;
}

// A variable or output name of one side must not denote anything on the other. Outputs are
// included because a variable takes precedence over an output of the same name.
void check_names(const Loop& loop) {
  std::map<std::string, std::string> places;  // of the plant
  for (std::size_t side : {0, 1}) {
    const Model& m = loop.models[side];
    std::map<std::string, std::string> own;
    const auto add = [&](const Signal& s, const char* kind) {
      own.emplace(s.name, fmt::format("the {}'s {}", roles[side], kind));
    };
    for (const Signal& s : m.states) add(s, "state");
    for (const Index j : loop.open[side]) add(m.inputs[std::size_t(j)], "input");
    for (const Signal& s : m.parameters) add(s, "parameter");
    for (const Signal& s : m.outputs) add(s, "output");
    for (const auto& [name, place] : own)
      if (const auto twice = places.find(name); twice != places.end())
        throw std::invalid_argument(fmt::format(
            "the name '{}' would stand for two signals: {} and {}", name, twice->second, place));
    places.merge(own);
  }
}

// Bitwise equality, except that all NaNs are equal.
bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

double& fed(Sides& at, const Feed& feed) { return at[feed.side].u[feed.input]; }

// Passes the outputs of one side to the inputs they feed; returns whether any input changed.
bool pass_on(const Loop& loop, std::size_t from, const VectorXd& outputs, Sides& at) {
  bool changed = false;
  for (const Feed& feed : loop.feeds) {
    if (feed.side == from || !feed.from_output) continue;
    const double value = outputs[feed.source];
    changed = changed || !same(fed(at, feed), value);
    fed(at, feed) = value;
  }
  return changed;
}

VectorXd rates_of(const Model& m, const OperatingPoint& at) {
  VectorXd rates = m.f(at.x, at.u, at.p);
  check_rates(m, rates);
  return rates;
}

VectorXd outputs_of(const Model& m, const OperatingPoint& at) {
  VectorXd outputs = m.h ? m.h(at.x, at.u, at.p) : VectorXd();
  check_outputs(m, outputs);
  return outputs;
}

// The points of the two sides for a point of the loop. Inputs fed by outputs are not known yet;
// they start at values that no equilibrium has, so that an algebraic loop is not missed there.
Sides split(const Loop& loop, const VectorXd& x, const VectorXd& u, const VectorXd& p) {
  Sides at;
  Index nx = 0, nu = 0, np = 0;
  for (std::size_t side : {0, 1}) {
    at[side].x = x.segment(nx, loop.states(side));
    at[side].p = p.segment(np, loop.parameters(side));
    at[side].u.resize(std::ssize(loop.models[side].inputs));
    for (const Index j : loop.open[side]) at[side].u[j] = u[nu++];
    nx += loop.states(side);
    np += loop.parameters(side);
  }
  for (const Feed& feed : loop.feeds)
    fed(at, feed) =
        feed.from_output ? 0.7310585786 * feed.nominal : at[1 - feed.side].x[feed.source];
  return at;
}

// depends(i, j): the source of input i depends on input j, fed to the side of that source.
MatrixXd dependence(const Loop& loop, Sides at) {
  const Index n = std::ssize(loop.feeds);
  MatrixXd depends = MatrixXd::Zero(n, n);
  const std::array<VectorXd, 2> before = {outputs_of(loop.models[0], at[0]),
                                          outputs_of(loop.models[1], at[1])};
  for (Index j = 0; j < n; ++j) {
    const Feed& moved = loop.feeds[std::size_t(j)];
    const double value = fed(at, moved);
    fed(at, moved) = value + 0.1 * moved.nominal;
    const VectorXd after = outputs_of(loop.models[moved.side], at[moved.side]);
    fed(at, moved) = value;
    for (Index i = 0; i < n; ++i) {
      const Feed& feed = loop.feeds[std::size_t(i)];
      if (feed.side == moved.side || !feed.from_output) continue;
      depends(i, j) = !same(after[feed.source], before[moved.side][feed.source]);
    }
  }
  return depends;
}

// Signals that depend on themselves, directly or through others.
std::vector<std::string> on_a_cycle(const Loop& loop, const MatrixXd& depends) {
  MatrixXd reach = depends;
  for (Index k = 1; k < depends.rows(); ++k)  // reach + reach * depends, as zeros and ones
    reach = (reach + reach * depends).cwiseMin(1.0);
  std::vector<std::string> found;
  for (Index i = 0; i < depends.rows(); ++i)
    if (reach(i, i) > 0) found.push_back(loop.feeds[std::size_t(i)].name);
  return found;
}

[[noreturn]] void refuse_cycle(const Loop& loop, std::vector<std::string> signals) {
  if (signals.empty())
    for (const Feed& feed : loop.feeds) signals.push_back(feed.name);
  throw std::invalid_argument(
      fmt::format("algebraic loop: each of these depends on itself without a state in between: {}",
                  fmt::join(signals, ", ")));
}

// The points of both sides with every fed input in place, and all outputs there. A chain of k fed
// inputs is resolved after k + 1 passes; an input that then still changes depends on itself.
struct Closed {
  Sides at;
  std::array<VectorXd, 2> outputs;
};

Closed close(const Loop& loop, const VectorXd& x, const VectorXd& u, const VectorXd& p) {
  Closed c{split(loop, x, u, p), {}};
  c.outputs[0] = outputs_of(loop.models[0], c.at[0]);
  pass_on(loop, 0, c.outputs[0], c.at);
  c.outputs[1] = outputs_of(loop.models[1], c.at[1]);
  for (std::size_t pass = 0; pass <= loop.feeds.size(); ++pass)
    for (std::size_t side : {0, 1}) {
      if (!pass_on(loop, 1 - side, c.outputs[1 - side], c.at)) {
        if (pass > 0 || side == 1) return c;
        continue;
      }
      c.outputs[side] = outputs_of(loop.models[side], c.at[side]);
    }
  refuse_cycle(loop, on_a_cycle(loop, dependence(loop, c.at)));
}

// The requested variables of one side and their positions in the request to the loop, followed by
// the fed inputs.
struct Asked {
  std::vector<Index> variables;
  std::vector<Index> columns;
  std::vector<Index> feeds;
};

std::array<Asked, 2> sort(const Loop& loop, const std::vector<Index>& variables) {
  std::vector<std::pair<std::size_t, Index>> own;  // for each variable of the loop
  const auto all = [&](const auto& numbers) {
    for (std::size_t side : {0, 1})
      for (const Index k : numbers(side)) own.emplace_back(side, k);
  };
  const auto range = [](Index from, Index count) {
    std::vector<Index> numbers(static_cast<std::size_t>(count));
    std::iota(numbers.begin(), numbers.end(), from);
    return numbers;
  };
  const auto inputs = [&](std::size_t side) { return std::ssize(loop.models[side].inputs); };
  all([&](std::size_t side) { return range(0, loop.states(side)); });
  all([&](std::size_t side) {
    std::vector<Index> numbers = loop.open[side];
    for (Index& k : numbers) k += loop.states(side);
    return numbers;
  });
  all([&](std::size_t side) {
    return range(loop.states(side) + inputs(side), loop.parameters(side));
  });
  std::array<Asked, 2> asked;
  for (std::size_t k = 0; k < variables.size(); ++k) {
    const auto [side, number] = own.at(std::size_t(variables[k]));
    asked[side].variables.push_back(number);
    asked[side].columns.push_back(Index(k));
  }
  for (std::size_t k = 0; k < loop.feeds.size(); ++k) {
    const Feed& feed = loop.feeds[k];
    asked[feed.side].variables.push_back(loop.states(feed.side) + feed.input);
    asked[feed.side].feeds.push_back(Index(k));
  }
  return asked;
}

// Derivatives of all rows (the sides' rates, then the sides' outputs) with respect to the
// requested variables and the fed inputs w, for each side separately.
struct Partial {
  MatrixXd by_variables, by_feeds;
};

Partial partial(const Loop& loop, const Sides& at, const std::array<Asked, 2>& asked, Index n) {
  const Index nx = loop.states(0) + loop.states(1);
  const Index rows = nx + loop.outputs(0) + loop.outputs(1);
  Partial d{MatrixXd::Zero(rows, n), MatrixXd::Zero(rows, std::ssize(loop.feeds))};
  for (std::size_t side : {0, 1}) {
    const Asked& a = asked[side];
    const MatrixXd J = loop.models[side].derivatives(at[side], a.variables);
    check_derivatives(loop.models[side], J, a.variables.size());
    const Index rates = loop.states(side), outputs = loop.outputs(side);
    const Index first_rate = side == 0 ? 0 : loop.states(0);
    const Index first_output = nx + (side == 0 ? 0 : loop.outputs(0));
    const auto place = [&](Index column, Ref<VectorXd> into) {
      into.segment(first_rate, rates) = J.col(column).head(rates);
      into.segment(first_output, outputs) = J.col(column).tail(outputs);
    };
    Index column = 0;
    for (const Index k : a.columns) place(column++, d.by_variables.col(k));
    for (const Index k : a.feeds) place(column++, d.by_feeds.col(k));
  }
  return d;
}

// w = S [x; y]:   dw/dv = S_x ∂x/∂v + S_y (∂h/∂v + ∂h/∂w dw/dv)
// Without an algebraic loop S_y ∂h/∂w is nilpotent, and one pass per fed input is exact.
MatrixXd derivatives(const Loop& loop, const OperatingPoint& point,
                     const std::vector<Index>& variables) {
  const Sides at = close(loop, point.x, point.u, point.p).at;
  const Index n = std::ssize(variables), feeds = std::ssize(loop.feeds);
  const Partial d = partial(loop, at, sort(loop, variables), n);
  MatrixXd direct = MatrixXd::Zero(feeds, n);
  MatrixXd through = MatrixXd::Zero(feeds, feeds);
  for (Index i = 0; i < feeds; ++i) {
    const Feed& feed = loop.feeds[std::size_t(i)];
    const Index first = feed.side == 1 ? 0 : 1;  // of the other side
    if (feed.from_output) {
      const Index row = loop.states(0) + loop.states(1) + first * loop.outputs(0) + feed.source;
      direct.row(i) = d.by_variables.row(row);
      through.row(i) = d.by_feeds.row(row);
    } else {
      const Index state = first * loop.states(0) + feed.source;
      for (Index k = 0; k < n; ++k) direct(i, k) = variables[std::size_t(k)] == state;
    }
  }
  const MatrixXd depends = (through.array() != 0).cast<double>();
  if (const auto cycle = on_a_cycle(loop, depends); !cycle.empty()) refuse_cycle(loop, cycle);
  MatrixXd w = direct;
  for (Index pass = 0; pass < feeds; ++pass) w = direct + through * w;
  return d.by_variables + d.by_feeds * w;
}

// Finds a loop that is algebraic everywhere by evaluating x, u, p at a few magnitudes; points where
// the functions throw or are not finite are ignored.
void probe(const Loop& loop, const Model& closed) {
  for (const double size : {0.0, 0.41, -0.87}) {
    const VectorXd x = size * nominals(closed.states);
    const VectorXd u = size * nominals(closed.inputs);
    const VectorXd p = (1.0 + 0.1 * size) * nominals(closed.parameters);
    std::vector<std::string> cycle;
    try {
      cycle = on_a_cycle(loop, dependence(loop, split(loop, x, u, p)));
    } catch (...) {
      continue;
    }
    if (!cycle.empty()) refuse_cycle(loop, cycle);
  }
}

Signals joined(Signals first, const Signals& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

VectorXd joined(const VectorXd& first, const VectorXd& second) {
  VectorXd all(first.size() + second.size());
  all.head(first.size()) = first;
  all.tail(second.size()) = second;
  return all;
}

}  // namespace

Model feedback(const Model& plant, const Model& controller) {
  const auto loop = std::make_shared<const Loop>(connect(plant, controller));
  check_names(*loop);
  Model m;
  m.name =
      controller.name.empty() ? plant.name : fmt::format("{} with {}", plant.name, controller.name);
  m.states = joined(plant.states, controller.states);
  for (std::size_t side : {0, 1})
    for (const Index j : loop->open[side])
      m.inputs.push_back(loop->models[side].inputs[std::size_t(j)]);
  m.outputs = joined(plant.outputs, controller.outputs);
  m.parameters = joined(plant.parameters, controller.parameters);
  m.f = [loop](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    const Sides at = close(*loop, x, u, p).at;
    return joined(rates_of(loop->models[0], at[0]), rates_of(loop->models[1], at[1]));
  };
  if (!m.outputs.empty())
    m.h = [loop](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
      const Closed c = close(*loop, x, u, p);
      return joined(c.outputs[0], c.outputs[1]);
    };
  if (plant.derivatives && controller.derivatives)
    m.derivatives = [loop](const OperatingPoint& point, const std::vector<Index>& variables) {
      return derivatives(*loop, point, variables);
    };
  m.mode_names = plant.mode_names ? plant.mode_names : controller.mode_names;
  for (std::size_t side : {0, 1})
    for (const Model::Switch& s : loop->models[side].switches)
      m.switches.push_back(
          {s.name, [loop, side, distance = s.distance](const OperatingPoint& point) {
             return distance(close(*loop, point.x, point.u, point.p).at[side]);
           }});
  probe(*loop, m);
  return m;
}

}  // namespace tiltrim
