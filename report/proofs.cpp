#include "report/proofs.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <iterator>
#include <map>
#include <set>

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
  if (!r.ray_w.empty()) {
    ordered_json& ray = side["ray"];
    for (const double w : r.ray_w) ray["w"].push_back(hex(w));
    for (const auto& v : r.ray_v) ray["v"].push_back({hex(v.real()), hex(v.imag())});
    ray["roots"] = r.outside;
  }
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
  if (t.damping > 0) head["damping"] = hex(t.damping);
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
  if (study.user_model) return text;
  for (const Theorem& t : theorems) {
    text += header(study, t).dump() + "\n";
    write_tree(t, 0, text);
  }
  return text;
}

namespace {

// "h from 0 to 45 m"
std::string interval(const Study& study, std::size_t k, double from, double to) {
  const Key& key = study.prove->parameters[k].key;
  return fmt::format("{} from {:.9g} to {:.9g}{}{}", key.name, in_study_unit(study, k, from),
                     in_study_unit(study, k, to), key.unit.empty() ? "" : " ", key.unit);
}

std::string box_in_words(const Study& study, const std::vector<Range>& box) {
  std::string words;
  for (std::size_t k = 0; k < box.size(); ++k)
    words += (k == 0 ? "" : ", ") + interval(study, k, box[k].lower, box[k].upper);
  return words;
}

std::string verdict_and_cause(const ProofNode& region) {
  return to_string(region.verdict) + (region.cause.empty() ? "" : " (" + region.cause + ")");
}

constexpr std::size_t most_lines = 40;  // of regions

// One line a region, for one parameter.
std::string each_region(const Study& study, const std::vector<ProofNode>& regions) {
  std::string text;
  for (std::size_t i = 0; i < std::min(most_lines, regions.size()); ++i)
    text += fmt::format("  {}: {}\n", verdict_and_cause(regions[i]),
                        box_in_words(study, regions[i].box));
  if (regions.size() > most_lines)
    text += fmt::format("  and {} more regions: --format json\n", regions.size() - most_lines);
  return text;
}

// What is found somewhere in a stretch of the first parameter.
struct Stretch {
  double from, to;
  std::set<std::string> verdicts;
};

std::vector<Stretch> along_the_first(const std::vector<ProofNode>& regions) {
  std::map<double, std::set<std::string>> from;  // the verdicts from there to the next
  for (const ProofNode& r : regions) from[r.box[0].lower], from[r.box[0].upper];
  for (const ProofNode& r : regions)
    for (auto at = from.find(r.box[0].lower); at->first < r.box[0].upper; ++at)
      at->second.insert(verdict_and_cause(r));
  std::vector<Stretch> stretches;
  for (auto at = from.begin(); std::next(at) != from.end(); ++at) {
    const double end = std::next(at)->first;
    if (!stretches.empty() && stretches.back().verdicts == at->second)
      stretches.back().to = end;
    else
      stretches.push_back({at->first, end, at->second});
  }
  return stretches;
}

// The smallest box about all regions that are not stable, for each verdict and cause.
std::string where_not_stable(const Study& study, const std::vector<ProofNode>& regions) {
  std::map<std::string, ProofNode> about;
  std::map<std::string, std::size_t> count;
  for (const ProofNode& r : regions) {
    if (r.verdict == ProofVerdict::stable) continue;
    const std::string verdict = verdict_and_cause(r);
    ++count[verdict];
    const auto [found, first] = about.try_emplace(verdict, r);
    if (first) continue;
    found->second.volume += r.volume;
    for (std::size_t k = 0; k < r.box.size(); ++k) {
      Range& range = found->second.box[k];
      range = {std::min(range.lower, r.box[k].lower), std::max(range.upper, r.box[k].upper)};
    }
  }
  std::string text;
  for (const auto& [verdict, all] : about)
    text +=
        fmt::format("  {}: {}, {:.3g} of the volume, within {}\n", verdict,
                    number_of(count[verdict], "region"), all.volume, box_in_words(study, all.box));
  return text;
}

std::string status_in_words(const Theorem& t) {
  if (t.status() == ProofStatus::refuted) return "refuted (unstable in some of the range)";
  if (t.status() == ProofStatus::proved) return "proved";
  return t.stable + t.no_trim > 0 ? "partly proved" : "nothing proved";
}

// For several parameters: stretches of the first one, and where the others matter.
std::string regions_in_words(const Study& study, const std::vector<ProofNode>& regions) {
  std::string text;
  const std::vector<Stretch> stretches = along_the_first(regions);
  for (std::size_t i = 0; i < std::min(most_lines, stretches.size()); ++i)
    text += fmt::format("  {}: {}\n", interval(study, 0, stretches[i].from, stretches[i].to),
                        fmt::join(stretches[i].verdicts, ", "));
  if (stretches.size() > most_lines)
    text += fmt::format("  and {} more stretches\n", stretches.size() - most_lines);
  return text + where_not_stable(study, regions) +
         fmt::format("  {} in all: --format json\n", number_of(regions.size(), "region"));
}

}  // namespace

std::string theorems_text(const Study& study, const std::vector<Theorem>& theorems) {
  std::string text;
  for (const Theorem& t : theorems) {
    text += fmt::format("{}{}\n", text.empty() ? "" : "\n", t.name);
    for (std::size_t k = 0; k < t.parameters.size(); ++k)
      text +=
          fmt::format("  {}\n", interval(study, k, t.parameters[k].lower, t.parameters[k].upper));
    text += fmt::format("  {}: {} box{}{}\n", status_in_words(t), t.boxes, t.boxes == 1 ? "" : "es",
                        t.interrupted ? ", interrupted" : "");
    constexpr std::size_t width = TextStyle{}.width;
    text += wrapped(
        fmt::format(
            "stable: every eigenvalue has a real part below {:.6g} 1/s{}",
            t.margin == 0 ? 0.0 : -t.margin,
            t.damping > 0 ? fmt::format(" and a damping ratio above {:.6g}", t.damping) : ""),
        2, width);
    text += wrapped(fmt::format("shares of the volume: {} stable, {} unstable, {} without trim, {} "
                                "undecided",
                                share_in_words(t.stable), share_in_words(t.unstable),
                                share_in_words(t.no_trim), share_in_words(t.undecided)),
                    2, width);
    text += t.parameters.size() == 1 || t.regions.size() <= 1 ? each_region(study, t.regions)
                                                              : regions_in_words(study, t.regions);
  }
  if (study.user_model) text += fmt::format("\n{}\n", no_certificate);
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
    one["damping"] = t.damping;
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
