// tiltrim check-proof: what a certificate proves, or where it fails.
#include <fmt/core.h>
#include <fmt/std.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "check_proof/check_proof.hpp"
#include "cli/commands.hpp"
#include "study/reference_vehicle.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim::cli {

namespace {

using nlohmann::ordered_json;

std::string proof_json(const std::string& file, const ProofCheck& check,
                       const std::optional<Study>& study) {
  ordered_json all{{"file", file}, {"verified", check.status == CertificateStatus::verified}};
  all["study"] = study ? ordered_json(study->file.string()) : ordered_json(nullptr);
  all["box_compared"] = study && study->prove;
  all["theorems"] = ordered_json::array();
  for (const CheckedTheorem& t : check.theorems) {
    ordered_json numbers = ordered_json::array();
    for (const auto& n : t.numbers)
      numbers.push_back({{"key", n.key}, {"from", n.from}, {"to", n.to}});
    all["theorems"].push_back({{"condition", t.condition},
                               {"parameters", numbers},
                               {"margin", t.margin},
                               {"damping", t.damping},
                               {"leaves", t.leaves},
                               {"proved_stable", t.stable},
                               {"proved_unstable", t.unstable},
                               {"proved_no_trim", t.no_trim},
                               {"undecided", t.undecided}});
  }
  if (check.status != CertificateStatus::verified)
    all["refused"] = {{"line", check.line}, {"box", check.box}, {"reason", check.reason}};
  return all.dump(1) + "\n";
}

std::string box_of(const CheckedTheorem& t) {
  std::string box;
  for (const auto& n : t.numbers)
    box += fmt::format("{}{} from {:.9g} to {:.9g}", box.empty() ? "" : ", ", n.key, n.from, n.to);
  return box;
}

Sheet theorem_sheet(const CheckedTheorem& t) {
  Sheet sheet{t.condition + ": " + box_of(t),
              {{"proved", "proved", ""}, {"share", "share of the box", "%", "{:.6f}"}},
              {},
              {fmt::format("leaves: {}; numbers in SI units and radians", t.leaves)}};
  const std::string line = t.margin == 0 ? "0" : fmt::format("{:.9g} 1/s", -t.margin);
  const auto add = [&](const std::string& what, double share, Tone tone) {
    if (share > 0) sheet.rows.push_back({{what, tone}, 100 * share});
  };
  const bool damped = t.damping > 0;
  add("one trim in the tube, every eigenvalue left of " + line +
          (damped ? fmt::format(", with a damping ratio above {:.6g}", t.damping) : ""),
      t.stable, Tone::good);
  add("one trim in the tube, an eigenvalue right of " + line +
          (damped ? fmt::format(" or with a damping ratio below {:.6g}", t.damping) : ""),
      t.unstable, Tone::bad);
  add("no trim within the limits", t.no_trim, Tone::plain);
  add("nothing", t.undecided, Tone::doubtful);
  return sheet;
}

std::string refusal(const std::string& file, const ProofCheck& check) {
  return fmt::format("{}{}: refused: {}{}{}\n", file,
                     check.line > 0 ? fmt::format(":{}", check.line) : "", check.box,
                     check.box.empty() ? "" : ": ", check.reason);
}

// The nodes of the study's polar, read without the library's spline.
void read_nodes(const Study& study, ProofSubject& subject) {
  std::filesystem::path file = study.file.parent_path() / study.polar_name;
  if (!std::filesystem::exists(file)) file = data_directory() / study.polar_name;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::array<double, 4> row{};
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &row[0], &row[1], &row[2], &row[3]) != 4)
      continue;
    subject.alpha.push_back(row[0] * (std::numbers::pi / 180));
    for (std::size_t k = 0; k < 3; ++k) subject.polar[k].push_back(row[k + 1]);
  }
}

std::map<std::string, ProofSubject> subjects(const Study& study) {
  const std::filesystem::path& file = study.file;
  if (study.vehicle.equations == Equations::printed)
    throw StudyError(file.string() +
                     ": certificates are about equations = \"consistent\", not \"printed\"");
  std::map<std::string, ProofSubject> all;
  for (const Condition& condition : study.conditions) {
    if (!condition.command()) continue;
    const Vehicle vehicle = vehicle_at(study, condition);
    ProofSubject& subject = all[condition.name];
    const Eigen::VectorXd p = closed_loop_parameters(vehicle, *condition.command());
    const Model loop = closed_loop(vehicle, Axes::wind);
    for (std::size_t i = 0; i < loop.parameters.size(); ++i)
      subject.numbers[loop.parameters[i].name] = p[Eigen::Index(i)];
    subject.tilts = study.schedule.eta;
    for (Gains gains : study.schedule.gains) {
      auto& set = subject.gains.emplace_back();
      for (std::size_t k = 0; k < gain_signals().size(); ++k) set.push_back(gain_value(gains, k));
    }
    read_nodes(study, subject);
    const Limits& limits = vehicle.limits;
    const auto both = [](const Range& r) { return std::array{r.lower, r.upper}; };
    subject.limits = {{"theta0", both(limits.theta0)},
                      {"a1s", both(limits.a1s)},
                      {"delta_e", both(limits.delta_e)},
                      {"theta", both(limits.theta)}};
    if (!study.prove) continue;
    subject.margin = study.prove->margin;
    subject.damping = study.prove->damping;
    for (const ProveTable::Parameter& one : study.prove->parameters)
      subject.domain[one.key.name] = {one.from, one.to};
  }
  if (all.empty()) throw StudyError(file.string() + ": no condition with a closed loop");
  return all;
}

// What of the study a verified certificate has been compared with, and what of it is missing there.
std::string compared(const Study& study, const ProofCheck& check) {
  std::string text =
      fmt::format("compared with {}: numbers, gains, limits, polar", study.file.string());
  text += study.prove ? ", box, margin, damping"
                      : "; it has no [prove], so box, margin and damping are the file's";
  const auto is_height = [](const ProveTable::Parameter& one) { return one.key.name == "h"; };
  const bool over_h = study.prove && std::ranges::any_of(study.prove->parameters, is_height);
  std::string missing;
  for (const Condition& condition : study.conditions) {
    if (!condition.command()) continue;
    if (std::ranges::find(check.theorems, condition.name, &CheckedTheorem::condition) ==
        check.theorems.end())
      missing += " " + condition.name;
    if (over_h) break;  // which sets the commands of all: the first stands for them
  }
  return text + (missing.empty() ? "" : "; not in the certificate:" + missing);
}

}  // namespace

Outcome run(const CheckProofCommand& command, const TextStyle& style, const std::stop_token&) {
  const std::string file = command.common.study.string();
  CheckProofOptions options{command.threads};
  std::optional<Study> study;
  if (!command.about.empty()) {
    study = read_study(command.about);
    options.about = subjects(*study);
  }
  const ProofCheck check = check_proof(command.common.study, options);
  if (check.status == CertificateStatus::unreadable)
    throw std::runtime_error(fmt::format("{}: {}", file, check.reason));
  const bool verified = check.status == CertificateStatus::verified;
  std::vector<Sheet> sheets;
  for (const CheckedTheorem& t : check.theorems) sheets.push_back(theorem_sheet(t));
  const auto text = [&] {
    if (!verified) return refusal(file, check);
    std::string all = file + ": " + toned("verified", Tone::good, style) + "\n";
    if (study) all += wrapped(compared(*study, check), 0, style.width);
    for (const Sheet& sheet : sheets) all += "\n" + as_text(sheet, style);
    return all;
  };
  const auto csv = [&] {
    Sheet all{{},
              {{"condition", "", ""},
               {"stable", "", ""},
               {"unstable", "", ""},
               {"no_trim", "", ""},
               {"undecided", "", ""}},
              {},
              {}};
    for (const CheckedTheorem& t : check.theorems)
      all.rows.push_back({t.condition, t.stable, t.unstable, t.no_trim, t.undecided});
    return as_csv(all);
  };
  const auto document = [&] {
    return verified ? sheets : std::vector{paragraph_sheet(refusal(file, check))};
  };
  return {in_format(
              command.common.format, [&] { return proof_json(file, check, study); }, csv, text,
              document),
          verified ? answered : unanswered};
}

}  // namespace tiltrim::cli
