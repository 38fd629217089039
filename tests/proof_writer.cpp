#include "tests/proof_writer.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "check_proof/certificate.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using namespace tiltrim::checking;
using nlohmann::ordered_json;

namespace {

constexpr std::array<std::size_t, 3> state_of{2, 4, 5};
constexpr int halvings = 4;  // fewer than the checker's own: smaller leaves, which it verifies soon

std::string hex(double x) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%a", x);
  return text.data();
}
ordered_json hex(const auto& numbers) {
  ordered_json all = ordered_json::array();
  for (const double x : numbers) all.push_back(hex(x));
  return all;
}
double mid(const Ball& b) { return arf_get_d(arb_midref(b.get()), ARF_RND_NEAR); }

ordered_json header(const ProofToWrite& asked) {
  const Study& study = asked.study;
  const Condition& condition = study.conditions.front();
  const Vehicle vehicle = vehicle_at(study, condition);
  ordered_json h{{"tiltrim_proof", 1},
                 {"condition", condition.name},
                 {"system", "tiltrotor closed loop, wind axes"}};
  for (const auto& [key, domain] : asked.parameters)
    h["parameters"].push_back(
        {{"key", key}, {"signal", key}, {"from", hex(domain.lower)}, {"to", hex(domain.upper)}});
  h["margin"] = hex(asked.margin);
  const Eigen::VectorXd p = closed_loop_parameters(vehicle, *condition.command());
  for (std::size_t i = 0; i < names().size(); ++i)
    h["numbers"][names()[i].name] = hex(p[Eigen::Index(i)]);
  if (!study.schedule.eta.empty()) {
    h["schedule"]["eta"] = hex(study.schedule.eta);
    for (Gains gains : study.schedule.gains) {
      std::vector<double> set;
      for (std::size_t k = 0; k < gain_count; ++k) set.push_back(gain_value(gains, k));
      h["schedule"]["gains"].push_back(hex(set));
    }
  }
  std::ifstream in(std::string(TILTRIM_SOURCE_DIR) + "/data/" + study.polar_name);
  for (std::string line; std::getline(in, line);) {
    std::array<double, 4> row{};
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &row[0], &row[1], &row[2], &row[3]) != 4)
      continue;
    h["polar"]["alpha"].push_back(hex(row[0] * (std::numbers::pi / 180)));
    for (std::size_t k = 0; k < 3; ++k)
      h["polar"][std::array{"CL", "CD", "CM"}[k]].push_back(hex(row[k + 1]));
  }
  const auto both = [](const Range& r) { return hex(std::array{r.lower, r.upper}); };
  const Limits& limits = vehicle.limits;
  h["limits"] = {{"theta0", both(limits.theta0)},
                 {"a1s", both(limits.a1s)},
                 {"delta_e", both(limits.delta_e)},
                 {"theta", both(limits.theta)}};
  h["states"] = {"V_err", "gamma_err", "theta", "q", "energy_integral", "distribution_integral"};
  h["unknowns"] = {"theta", "energy_integral", "distribution_integral"};
  h["equations"] = {"V_err", "gamma_err", "q"};
  h["equations_are"] = "consistent";
  h["boxes"] = 1;
  return h;
}

class Writer {
 public:
  explicit Writer(const ProofToWrite& asked) : asked_(asked), s_(statement_of(asked)) {}

  void grow(const Box& box, int depth, std::string& lines, int& leaves) {
    Leaf leaf;
    if (prove(box, leaf)) {
      ++leaves;
      lines += told(leaf).dump() + "\n";
      return;
    }
    if (depth == 0) {
      ++leaves;
      lines += "{\"leaf\":\"undecided\",\"cause\":\"width\"}\n";
      return;
    }
    std::size_t k = 0;
    const auto share = [&](std::size_t i) {
      const checking::Bounds& all = s_.parameters[i].domain;
      return (box[i].upper - box[i].lower) / (all.upper - all.lower);
    };
    for (std::size_t i = 1; i < box.size(); ++i)
      if (share(i) > share(k)) k = i;
    const double at = (box[k].lower + box[k].upper) / 2;
    lines += ordered_json{{"split", k}, {"at", hex(at)}}.dump() + "\n";
    Box low = box, high = box;
    low[k].upper = high[k].lower = at;
    grow(low, depth - 1, lines, leaves);
    grow(high, depth - 1, lines, leaves);
  }

 private:
  bool prove(const Box& box, Leaf& leaf) {
    leaf.box = box;
    const std::vector<Side> all = sides(s_, box);
    for (const Side& side : all)
      if (const auto record = evidence(side, box.size())) leaf.records.push_back(*record);
    if (leaf.records.size() == all.size()) {
      leaf.claim = leaf.records.front().roots == 0 ? Claim::stable : Claim::unstable;
      return !refuted(s_, leaf, halvings);
    }
    if (!leaf.records.empty()) return false;
    leaf.claim = Claim::no_trim;
    for (const Side& side : all) {
      Exclusion tree;
      if (!exclude(side, box.size(), {s_.theta, s_.theta0, side.cyclic ? s_.a1s : s_.delta_e}, 18,
                   tree))
        return false;
      leaf.exclusions.push_back(tree);
    }
    return !refuted(s_, leaf, halvings);
  }

  bool exclude(const Side& side, std::size_t n, const Region& region, int depth, Exclusion& tree) {
    for (const std::array<double, 3> weights :
         {std::array{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}})
      if (unbalanced(s_, side, n, region, weights)) {
        tree.push_back({-1, 0, weights});
        return true;
      }
    if (depth == 0) return false;
    std::size_t k = 0;
    for (std::size_t i = 1; i < 3; ++i)
      if (region[i].upper - region[i].lower > region[k].upper - region[k].lower) k = i;
    const double at = (region[k].lower + region[k].upper) / 2;
    tree.push_back({k == 2 && !side.cyclic ? 3 : int(k), at, {}});
    Region low = region, high = region;
    low[k].upper = high[k].lower = at;
    return exclude(side, n, low, depth - 1, tree) && exclude(side, n, high, depth - 1, tree);
  }

  // A trim at the middle, its slopes by the implicit function theorem, a tube half as wide again
  // as what the equations leave.
  std::optional<checking::Record> evidence(const Side& side, std::size_t n) {
    Eigen::VectorXd p(Eigen::Index(names().size()));
    for (std::size_t i = 0; i < names().size(); ++i)
      p[Eigen::Index(i)] = mid((side.numbers.*(names()[i].member)).value());
    auto [vehicle, command] = vehicle_from(asked_.study.vehicle, p);
    constexpr double apart = 1e-9;  // rad: the middle may lie on the other side of the handover
    vehicle.aircraft.cyclic_off = command.eta + (side.cyclic ? -apart : apart);
    const TrimResult trimmed =
        trim_closed_loop(closed_loop_problem(vehicle, command, Axes::wind), vehicle, command);
    if (!trimmed) return {};
    checking::Record r;
    std::array<Dual, 6> x;
    for (std::size_t i = 0; i < 3; ++i) {
      r.z[i] = trimmed.point.x[Eigen::Index(state_of[i])];
      x[state_of[i]] = Dual(Form(r.z[i]));
    }
    for (std::size_t i = 0; i < 6; ++i) x[i].slopes[i] = Form(1.0);
    const Loop<Dual> loop = closed_loop(side.numbers, *s_.polar, x);
    const std::array<Dual, 3> G{Dual(0.0) - loop.rates.V, Dual(0.0) - loop.rates.gamma,
                                loop.rates.q};
    Eigen::Matrix3d J;
    Eigen::MatrixXd P(3, Eigen::Index(n));
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < 3; ++j)
        J(i, j) = mid(G[std::size_t(i)].slopes[state_of[std::size_t(j)]].value());
      for (Eigen::Index j = 0; j < P.cols(); ++j)
        P(i, j) = mid(G[std::size_t(i)].value.slope(std::size_t(j)));
    }
    const Eigen::Matrix3d C = J.inverse();
    const Eigen::MatrixXd S = -C * P;
    std::array<Form, 6> at;
    for (std::size_t i = 0; i < 3; ++i) {
      at[state_of[i]] = Form(r.z[i]);
      at[state_of[i]].reserve(n);
      for (std::size_t k = 0; k < n; ++k) {
        r.S[i].push_back(S(Eigen::Index(i), Eigen::Index(k)));
        at[state_of[i]].slope(k) = Ball(r.S[i][k]);
      }
      for (std::size_t j = 0; j < 3; ++j) r.C[i][j] = C(Eigen::Index(i), Eigen::Index(j));
    }
    const Loop<Form> left = closed_loop(side.numbers, *s_.polar, at);
    for (std::size_t i = 0; i < 3; ++i) {
      const Form step = Form(-r.C[i][0]) * left.rates.V - Form(r.C[i][1]) * left.rates.gamma +
                        Form(r.C[i][2]) * left.rates.q;
      r.Z[i] = 1.5 * double_above(magnitude(range(step))) + 1e-14 * (1 + std::abs(r.z[i]));
    }
    const double last = 60;  // rad/s; beyond, the checker goes on by itself
    for (double w = 0; w < last; w = r.line.back().to)
      r.line.push_back({w, w == 0 ? 0.25 : 1.4 * w, 1, 0});
    const auto roots = roots_right(pencil(side.numbers, loop), Ball(s_.margin));
    if (!roots) return {};
    r.roots = *roots;
    return r;
  }

  static ordered_json told(const Leaf& leaf) {
    ordered_json line{{"leaf", leaf.claim == Claim::stable     ? "stable"
                               : leaf.claim == Claim::unstable ? "unstable"
                                                               : "no_trim"}};
    for (const checking::Record& r : leaf.records) {
      ordered_json one{{"z", hex(r.z)}};
      for (const auto& row : r.S) one["S"].push_back(hex(row));
      for (const auto& row : r.C) one["C"].push_back(hex(row));
      one["Z"] = hex(r.Z);
      one["w"].push_back(hex(0.0));
      for (const Half& half : r.line) {
        one["w"].push_back(hex(half.to));
        one["v"].push_back(hex(std::array{half.re, half.im}));
      }
      one["roots"] = r.roots;
      line["sides"].push_back(one);
    }
    for (const Exclusion& tree : leaf.exclusions) {
      ordered_json nodes = ordered_json::array();
      for (const Node& node : tree)
        nodes.push_back(node.split < 0 ? ordered_json{{"y", hex(node.weights)}}
                                       : ordered_json{{"split", node.split}, {"at", hex(node.at)}});
      line["sides"].push_back({{"exclude", nodes}});
    }
    return line;
  }

  const ProofToWrite& asked_;
  Statement s_;
};

}  // namespace

Statement statement_of(const ProofToWrite& asked) {
  const std::string empty =
      header(asked).dump() + "\n{\"leaf\":\"undecided\",\"cause\":\"width\"}\n";
  return read_certificate(empty).front().statement;
}

std::string written_proof(const ProofToWrite& asked) {
  Writer writer(asked);
  Box box;
  for (const auto& [key, domain] : asked.parameters) box.push_back(domain);
  std::string lines;
  int leaves = 0;
  writer.grow(box, asked.depth, lines, leaves);
  ordered_json head = header(asked);
  head["boxes"] = leaves;
  return head.dump() + "\n" + lines;
}

ProofSubject subject_of(const Statement& s) {
  ProofSubject subject;
  for (const Named& one : names())
    subject.numbers[std::string(one.name)] = mid((s.numbers.*(one.member)).value());
  subject.tilts = s.tilts;
  for (const auto& set : s.gains) subject.gains.emplace_back(set.begin(), set.end());
  subject.alpha = s.alpha;
  subject.polar = s.coefficients;
  const auto both = [](const checking::Bounds& b) { return std::array{b.lower, b.upper}; };
  subject.limits = {{"theta0", both(s.theta0)},
                    {"a1s", both(s.a1s)},
                    {"delta_e", both(s.delta_e)},
                    {"theta", both(s.theta)}};
  return subject;
}
