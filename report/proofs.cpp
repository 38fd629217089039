#include "report/proofs.hpp"

#include <fmt/core.h>

#include "flight/closed_loop_proof.hpp"
#include "report/json.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

// A value of parameter k in the study's unit.
double in_study_unit(const Study& study, std::size_t k, double si) {
  return study.prove->parameters[k].key.in_study(si);
}

std::string share_in_words(double share) {
  return share == 1 ? "all" : share == 0 ? "none" : fmt::format("{:.6g}", share);
}

std::string hex(double value) { return fmt::format("{:a}", value); }

ordered_json hexes(const Eigen::VectorXd& values) {
  ordered_json list = ordered_json::array();
  for (const double value : values) list.push_back(hex(value));
  return list;
}

ordered_json hex_rows(const Eigen::MatrixXd& matrix) {
  ordered_json list = ordered_json::array();
  for (const auto& row : matrix.rowwise()) list.push_back(hexes(row.transpose()));
  return list;
}

ordered_json evidence(const ProofNode::Record& r) {
  ordered_json side = ordered_json::object();
  if (!r.absent.empty()) {
    side["exclude"] = ordered_json::array();
    for (const ProofNode::Record::Exclusion& node : r.absent)
      side["exclude"].push_back(node.split < 0
                                    ? ordered_json{{"y", hexes(node.weights)}}
                                    : ordered_json{{"split", node.split}, {"at", hex(node.at)}});
    return side;
  }
  side["z"] = hexes(r.z);
  side["S"] = hex_rows(r.S);
  side["C"] = hex_rows(r.C);
  side["Z"] = hexes(r.Z);
  side["T"] = hex_rows(r.T);
  side["w"] = ordered_json::array();
  for (const double w : r.w) side["w"].push_back(hex(w));
  side["v"] = ordered_json::array();
  for (const auto& v : r.v) side["v"].push_back({hex(v.real()), hex(v.imag())});
  side["roots"] = r.roots;
  return side;
}

std::string leaf_name(ProofVerdict verdict) {
  const std::string name = to_string(verdict);
  return name.starts_with("proved_") ? name.substr(7) : name;
}

void write_tree(const Theorem& t, std::size_t at, std::string& text) {
  const ProofNode& node = t.tree[at];
  if (node.split >= 0) {
    text += ordered_json{{"split", node.split}, {"at", hex(node.at)}}.dump() + "\n";
    write_tree(t, node.lower, text);
    write_tree(t, node.upper, text);
    return;
  }
  ordered_json leaf{{"leaf", leaf_name(node.verdict)}};
  if (node.verdict == ProofVerdict::undecided) {
    leaf["cause"] = node.cause;
  } else {
    leaf["sides"] = ordered_json::array();
    for (const ProofNode::Record& side : node.sides) leaf["sides"].push_back(evidence(side));
  }
  text += leaf.dump() + "\n";
}

ordered_json limits_of(const Limits& limits) {
  const auto pair = [](const Range& r) { return ordered_json{hex(r.lower), hex(r.upper)}; };
  return {{"theta0", pair(limits.theta0)},
          {"a1s", pair(limits.a1s)},
          {"delta_e", pair(limits.delta_e)},
          {"theta", pair(limits.theta)}};
}

ordered_json header(const Study& study, const Theorem& t) {
  ordered_json head{{"tiltrim_proof", 1},
                    {"condition", t.name},
                    {"system", "tiltrotor closed loop, wind axes"},
                    {"parameters", ordered_json::array()},
                    {"margin", hex(t.margin)}};
  for (std::size_t k = 0; k < t.parameters.size(); ++k)
    head["parameters"].push_back({{"key", study.prove->parameters[k].key.name},
                                  {"signal", t.parameters[k].name},
                                  {"from", hex(t.parameters[k].lower)},
                                  {"to", hex(t.parameters[k].upper)}});
  Command command;
  for (const Condition& condition : study.conditions)
    if (condition.name == t.name && condition.command()) command = *condition.command();
  const Model model = closed_loop(study.vehicle, Axes::wind);
  const Eigen::VectorXd p = closed_loop_parameters(study.vehicle, command);
  for (std::size_t j = 0; j < model.parameters.size(); ++j)
    head["numbers"][model.parameters[j].name] = hex(p[Eigen::Index(j)]);
  if (!study.schedule.eta.empty()) {
    ordered_json rows = ordered_json::array(), tilts = ordered_json::array();
    for (std::size_t i = 0; i < study.schedule.eta.size(); ++i) {
      tilts.push_back(hex(study.schedule.eta[i]));
      ordered_json row = ordered_json::array();
      Gains gains = study.schedule.gains[i];
      for (std::size_t j = 0; j < gain_signals().size(); ++j)
        row.push_back(hex(gain_value(gains, j)));
      rows.push_back(row);
    }
    head["schedule"] = {{"eta", tilts}, {"gains", rows}};
  }
  ordered_json alpha = ordered_json::array(), CL = alpha, CD = alpha, CM = alpha;
  for (const double a : study.vehicle.polar->knots()) alpha.push_back(hex(a));
  for (const Coefficients& row : study.vehicle.polar->rows()) {
    CL.push_back(hex(row.CL));
    CD.push_back(hex(row.CD));
    CM.push_back(hex(row.CM));
  }
  head["polar"] = {{"alpha", alpha}, {"CL", CL}, {"CD", CD}, {"CM", CM}};
  head["limits"] = limits_of(study.vehicle.limits);
  head["states"] = names(model.states);
  head["unknowns"] = t.unknowns;
  head["equations"] = {"V_err", "gamma_err", "q"};
  head["equations_are"] = "consistent";
  head["boxes"] = t.boxes;
  return head;
}

}  // namespace

std::string certificate_of(const Study& study, const std::vector<Theorem>& theorems) {
  std::string text;
  for (const Theorem& t : theorems) {
    text += header(study, t).dump() + "\n";
    write_tree(t, 0, text);
  }
  return text;
}

std::string theorems_text(const Study& study, const std::vector<Theorem>& theorems) {
  constexpr std::size_t most = 40;  // regions
  std::string text;
  for (const Theorem& t : theorems) {
    text += fmt::format("{}{}\n", text.empty() ? "" : "\n", t.name);
    const auto interval = [&](std::size_t k, double from, double to) {
      const Key& key = study.prove->parameters[k].key;
      return fmt::format("{} from {:.9g} to {:.9g}{}{}", key.name, in_study_unit(study, k, from),
                         in_study_unit(study, k, to), key.unit.empty() ? "" : " ", key.unit);
    };
    for (std::size_t k = 0; k < t.parameters.size(); ++k)
      text += fmt::format("  {}\n", interval(k, t.parameters[k].lower, t.parameters[k].upper));
    text += fmt::format("  {}: {} boxes{}\n", to_string(t.status()), t.boxes,
                        t.interrupted ? ", interrupted" : "");
    text += fmt::format(
        "  shares of the volume; stable: every eigenvalue left of {:.6g} 1/s\n"
        "    {} stable, {} unstable, {} without trim, {} undecided\n",
        t.margin == 0 ? 0.0 : -t.margin, share_in_words(t.stable), share_in_words(t.unstable),
        share_in_words(t.no_trim), share_in_words(t.undecided));
    for (std::size_t i = 0; i < std::min(most, t.regions.size()); ++i) {
      const ProofNode& r = t.regions[i];
      std::string where;
      for (std::size_t k = 0; k < r.box.size(); ++k)
        where += (k == 0 ? "" : ", ") + interval(k, r.box[k].lower, r.box[k].upper);
      text += fmt::format("  {}{}: {}\n", to_string(r.verdict),
                          r.cause.empty() ? "" : " (" + r.cause + ")", where);
    }
    if (t.regions.size() > most)
      text += fmt::format("  and {} more regions: --format json\n", t.regions.size() - most);
  }
  return text;
}

std::string theorems_json(const Study& study, const std::vector<Theorem>& theorems,
                          const std::string& certificate) {
  ordered_json all = ordered_json::array();
  for (const Theorem& t : theorems) {
    ordered_json one{{"condition", t.name}, {"parameters", ordered_json::array()}};
    for (std::size_t k = 0; k < t.parameters.size(); ++k)
      one["parameters"].push_back({{"key", study.prove->parameters[k].key.name},
                                   {"from", in_study_unit(study, k, t.parameters[k].lower)},
                                   {"to", in_study_unit(study, k, t.parameters[k].upper)}});
    one["margin"] = t.margin;
    one["status"] = to_string(t.status());
    one["boxes"] = t.boxes;
    one["proved_stable"] = t.stable;
    one["proved_unstable"] = t.unstable;
    one["proved_no_trim"] = t.no_trim;
    one["undecided"] = t.undecided;
    one["interrupted"] = t.interrupted;
    one["regions"] = ordered_json::array();
    for (const ProofNode& r : t.regions) {
      ordered_json region{{"verdict", to_string(r.verdict)}};
      for (std::size_t k = 0; k < r.box.size(); ++k) {
        const std::string& key = study.prove->parameters[k].key.name;
        region["from"][key] = in_study_unit(study, k, r.box[k].lower);
        region["to"][key] = in_study_unit(study, k, r.box[k].upper);
      }
      region["volume"] = r.volume;
      region["cause"] = r.cause.empty() ? ordered_json(nullptr) : ordered_json(r.cause);
      one["regions"].push_back(region);
    }
    all.push_back(one);
  }
  const ordered_json file = certificate.empty() ? ordered_json(nullptr) : ordered_json(certificate);
  return ordered_json{{"theorems", all}, {"certificate", file}}.dump(2) + "\n";
}

}  // namespace tiltrim
