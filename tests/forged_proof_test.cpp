// Damaged and altered certificates: none is accepted. Each TILTRIM_SEED makes others
// (make forge).
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "check_proof/certificate.hpp"
#include "check_proof/check_proof.hpp"
#include "flight/closed_loop_proof.hpp"
#include "report/proofs.hpp"
#include "tests/check.hpp"
#include "tests/forger.hpp"
#include "tests/proof_writer.hpp"

using namespace tiltrim;
using nlohmann::ordered_json;

namespace forged_proof_test {

namespace {

ProofToWrite asked() {
  return {load_study(TILTRIM_SOURCE_DIR "/studies/scheduled.toml"),
          {{"h", {60, 66}}, {"aircraft.mass", {3.9, 4.1}}}};
}

// What prove() writes, over a box of the study.
std::string proved(const std::string& name, const std::vector<Uncertain>& box, double undecided,
                   double damping = 0) {
  Study study = load_study(std::string(TILTRIM_SOURCE_DIR "/studies/") + name);
  study.prove->parameters.clear();
  for (const Uncertain& p : box)
    study.prove->parameters.push_back({Key{p.name, p.name, {}, {}}, p.lower, p.upper});
  ProveOptions options;
  options.undecided = undecided;
  options.damping = damping;
  return certificate_of(
      study, {prove(closed_loop_proof(study.vehicle, study.schedule, "corridor", {15, 0, 0}, box),
                    options)});
}

std::string of_actuators() {
  return proved("prove_corridor.toml", {{"h", 60, 84}, {"aircraft.mass", 3.88, 4.12}}, 0);
}
std::string of_damping() {
  return proved("prove_corridor.toml", {{"h", 66, 80}, {"aircraft.mass", 3.99, 4.01}}, 0, 0.2);
}
std::string of_scatter() {
  return proved("prove_scatter.toml",
                {{"h", 72, 80},
                 {"aircraft.mass", 3.6, 4.4},
                 {"aircraft.inertia_yy", 5.47, 6.68},
                 {"aircraft.CM_de", -0.7, -0.58}},
                0.3);
}
std::string of_handover() {
  return proved("prove_corridor.toml", {{"h", 44, 48}, {"aircraft.mass", 3.96, 4.04}}, 0);
}
std::string with_and_without_trim() { return proved("prove_reference.toml", {{"V", 4, 12}}, 0.02); }

}  // namespace

TEST_CASE("no altered certificate is accepted") {
  std::vector<Forger> genuine;
  for (const std::string& text : {written_proof(asked()), of_actuators(), of_handover(),
                                  with_and_without_trim(), of_damping(), of_scatter()}) {
    const ProofCheck check = check_proof_text(text);
    REQUIRE_MESSAGE(check.status == CertificateStatus::verified, check.reason);
    genuine.emplace_back(text);
  }
  constexpr std::array<std::size_t, 16> turns{0, 1, 2, 3, 4, 0, 1, 2,
                                              3, 4, 0, 1, 2, 3, 4, 5};  // 5: slow
  constexpr std::array names{"integrals", "actuators", "handover", "no trim", "damping", "scatter"};
  std::array<std::size_t, names.size()> made{};
  int count = trials(144);
  std::map<std::string, int> accepted;
  for (int i = 0; i < count; ++i) {
    const std::size_t kind = turns[std::size_t(i) % turns.size()];
    const std::vector<Forgery> all = forgeries_for(genuine[kind]);
    const auto& [name, forge] = all[made[kind]++ % all.size()];
    const ProofCheck check = check_proof_text(forge(genuine[kind]));
    if (check.status == CertificateStatus::verified)
      ++accepted[fmt::format("{}, {}", names[kind], name)];
  }
  for (const auto& [name, n] : accepted) FAIL_CHECK(fmt::format("{}: {} accepted", name, n));
  std::string text;
  for (std::size_t kind = 0; kind < names.size(); ++kind)
    text += fmt::format("{}{} of {}", kind == 0 ? "" : ", ", made[kind], names[kind]);
  MESSAGE("altered certificates: ", text);
}

// A flipped bit in the low digits of a hint leaves a valid proof of the same theorem: what is
// accepted must be that theorem, over the same box, with the same verdicts.
TEST_CASE("a certificate with a flipped bit is refused, or proves the same") {
  const std::string genuine = written_proof(asked());
  Forger forger(genuine);
  const ProofCheck truth = check_proof_text(genuine);
  REQUIRE(truth.status == CertificateStatus::verified);
  int count = trials(50);
  int harmless = 0;
  for (int i = 0; i < count; ++i) {
    std::string text = genuine;
    char& byte = text[forger.below(text.size())];
    byte = char(byte ^ char(1 << forger.below(7)));
    const ProofCheck check = check_proof_text(text);
    if (check.status != CertificateStatus::verified) continue;
    ++harmless;
    REQUIRE(check.theorems.size() == 1);
    const CheckedTheorem &own = check.theorems[0], &real = truth.theorems[0];
    CHECK(own.leaves == real.leaves);
    CHECK(own.stable == real.stable);
  }
  MESSAGE(count, " flipped bits, ", harmless, " without effect on what is proved");
}

namespace {

// Every number of a header: its text is in quotes.
std::vector<ordered_json*> numbers_of(ordered_json& value) {
  std::vector<ordered_json*> all;
  if (value.is_string() && value.get<std::string>().find("0x") != std::string::npos)
    all.push_back(&value);
  if (value.is_structured())
    for (ordered_json& part : value)
      for (ordered_json* one : numbers_of(part)) all.push_back(one);
  return all;
}

}  // namespace

// With --study a statement that differs in the last bit of any number is refused, although its
// evidence may still prove it.
TEST_CASE("a certificate about other numbers is never taken for one about the study") {
  const ProofToWrite of = asked();
  const std::string genuine = written_proof(of);
  Forger forger(genuine);
  ProofSubject subject = subject_of(checking::read_certificate(genuine).front().statement);
  for (const auto& [key, range] : of.parameters) subject.domain[key] = {range.lower, range.upper};
  const CheckProofOptions options{.threads = 1, .about = {{"corridor", subject}}};
  REQUIRE(check_proof_text(genuine, options).status == CertificateStatus::verified);
  int count = trials(300);
  int accepted = 0, replaced = 0;
  for (int i = 0; i < count; ++i) {
    std::string which;
    const std::string text = forger.header([&](ordered_json& header) {
      const std::vector<ordered_json*> all = numbers_of(header);
      ordered_json& one = *all[forger.below(all.size())];
      const double x = Forger::number(one), up = forger.below(2) == 0 ? 1e300 : -1e300;
      const double to = forger.below(2) == 0 ? std::nextafter(x, up) : x * (1 + forger.share()) + 1;
      one = Forger::hex(to);
      // Numbers that a parameter or the schedule replaces say nothing.
      for (const auto& [name, value] : header["numbers"].items())
        if (&value == &one) which = name;
    });
    const bool unused = which == "V" || which == "gamma" || which == "eta" ||
                        which == "aircraft.mass" || which.starts_with("gains.");
    replaced += unused;
    if (unused) continue;
    const ProofCheck check = check_proof_text(text, options);
    const bool more = check.status == CertificateStatus::verified &&
                      check.theorems.front().margin > 0;  // proves more than is asked
    accepted += check.status == CertificateStatus::verified && !more;
    CHECK_MESSAGE((check.status != CertificateStatus::verified || more), check.reason);
  }
  CHECK(accepted == 0);
  CHECK(replaced < count / 5);
}

// Evidence changed a little: it proves the same, or is refused.
TEST_CASE("evidence altered a little is refused, or proves the same" * thorough) {
  const std::string genuine = written_proof(asked());
  Forger forger(genuine);
  const ProofCheck truth = check_proof_text(genuine);
  int count = trials(30);
  count = std::max(count, 30);  // of so many, some are refused
  int same = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t line = 1 + forger.below(forger.original.size() - 1);
    const double by = std::pow(10.0, -16 * forger.share()) * (forger.below(2) == 0 ? 1 : -1);
    const std::string text = forger.edited(line, [&](ordered_json& object) {
      const std::vector<ordered_json*> all = numbers_of(object);
      if (all.empty()) return;
      ordered_json& one = *all[forger.below(all.size())];
      one = Forger::hex(Forger::number(one) * (1 + by) + by * 1e-3);
    });
    const ProofCheck check = check_proof_text(text);
    if (check.status != CertificateStatus::verified) continue;
    ++same;
    REQUIRE(check.theorems.size() == 1);
    const CheckedTheorem &own = check.theorems[0], &real = truth.theorems[0];
    CHECK(own.leaves == real.leaves);
    CHECK(own.stable == real.stable);
    for (std::size_t k = 0; k < own.numbers.size(); ++k) {
      CHECK(own.numbers[k].from == real.numbers[k].from);
      CHECK(own.numbers[k].to == real.numbers[k].to);
    }
  }
  CHECK(same < count);
}

}  // namespace forged_proof_test
