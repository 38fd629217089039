#include "check_proof/check_proof.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string_view>
#include <system_error>

#include "check_proof/certificate.hpp"
#include "runtime/threads.hpp"

namespace tiltrim {

namespace {

using namespace checking;

std::string words(const Statement& s, const Box& box) {
  std::string text;
  for (std::size_t k = 0; k < box.size(); ++k)
    text += fmt::format("{}{} in [{:.12g}, {:.12g}]", k == 0 ? "" : ", ", s.parameters[k].key,
                        box[k].lower, box[k].upper);
  return text;
}

// The first leaf that does not hold; leaves after one that fails need no verification.
struct FirstFailure {
  std::vector<std::pair<const Theorem*, const Leaf*>> leaves;
  std::vector<std::string> why;
  std::atomic<std::size_t> first{std::numeric_limits<std::size_t>::max()};

  void judge(std::size_t i) {
    if (i > first.load()) return;
    const auto failed = refuted(leaves[i].first->statement, *leaves[i].second);
    if (!failed) return;
    why[i] = *failed;
    std::size_t known = first.load();
    while (i < known && !first.compare_exchange_weak(known, i)) {
    }
  }
};

double share_of(const Theorem& t, Claim claim) {
  Ball sum;
  for (const Leaf& leaf : t.leaves) {
    if (leaf.claim != claim) continue;
    Ball volume(1);
    for (std::size_t k = 0; k < leaf.box.size(); ++k) {
      const Bounds& all = t.statement.parameters[k].domain;
      volume *=
          (Ball(leaf.box[k].upper) - Ball(leaf.box[k].lower)) / (Ball(all.upper) - Ball(all.lower));
    }
    sum += volume;
  }
  return double_above(midpoint(sum));
}

CheckedTheorem told(const Theorem& t) {
  const Statement& s = t.statement;
  CheckedTheorem all{s.condition,
                     {},
                     s.margin,
                     s.damping,
                     t.leaves.size(),
                     share_of(t, Claim::stable),
                     share_of(t, Claim::unstable),
                     share_of(t, Claim::no_trim),
                     share_of(t, Claim::undecided)};
  for (const Parameter& p : s.parameters)
    all.numbers.push_back({p.key, p.domain.lower, p.domain.upper});
  return all;
}

// Where the statement is about another aircraft; empty if nowhere.
std::string not_about(const Statement& s, const std::map<std::string, ProofSubject>& all) {
  const auto found = all.find(s.condition);
  if (found == all.end()) return fmt::format("the study has no condition '{}'", s.condition);
  const ProofSubject& subject = found->second;
  std::set<std::string_view> replaced;
  for (const Parameter& p : s.parameters)
    if (!p.member)
      replaced.insert({"V", "gamma", "eta"});
    else
      replaced.insert(std::ranges::find(names(), p.member, &Named::member)->name);
  for (const Named& one : names()) {
    if (replaced.contains(one.name) || (!s.tilts.empty() && one.name.starts_with("gains.")))
      continue;
    const auto own = subject.numbers.find(std::string(one.name));
    if (own == subject.numbers.end() || !equal((s.numbers.*(one.member)).value(), own->second))
      return fmt::format("'{}' is not that of the study", one.name);
  }
  for (const Parameter& p : s.parameters) {
    if (subject.domain.empty()) break;
    const auto own = subject.domain.find(p.key);
    if (own == subject.domain.end() || own->second != std::array{p.domain.lower, p.domain.upper})
      return fmt::format("the range of '{}' is not that of the study", p.key);
  }
  if (!subject.domain.empty() && subject.domain.size() != s.parameters.size())
    return "the parameters are not those of the study";
  if (s.margin < subject.margin) return "the margin is less than that of the study";
  if (s.damping < subject.damping) return "the damping ratio is less than that of the study";
  if (s.tilts != subject.tilts) return "the tilts of the schedule are not those of the study";
  for (std::size_t i = 0; i < s.tilts.size(); ++i)
    if (!std::ranges::equal(s.gains[i], subject.gains[i]))
      return "the scheduled gains are not those of the study";
  if (s.alpha != subject.alpha || s.coefficients != subject.polar)
    return "the polar is not that of the study";
  const std::map<std::string, std::array<double, 2>> limits{
      {"theta0", {s.theta0.lower, s.theta0.upper}},
      {"a1s", {s.a1s.lower, s.a1s.upper}},
      {"delta_e", {s.delta_e.lower, s.delta_e.upper}},
      {"theta", {s.theta.lower, s.theta.upper}}};
  return limits == subject.limits ? "" : "the limits are not those of the study";
}

}  // namespace

bool can_check_proofs() { return true; }

ProofCheck check_proof_text(const std::string& text, const CheckProofOptions& options) {
  if (!is_certificate(text))
    return {CertificateStatus::unreadable, {}, 1, {}, "not a certificate of tiltrim prove"};
  ProofCheck check;
  std::vector<Theorem> theorems;
  try {
    theorems = read_certificate(text);
  } catch (const Malformed& e) {
    return {CertificateStatus::refused, {}, e.line, {}, e.what()};
  }
  for (const Theorem& t : theorems)
    if (const std::string other =
            options.about.empty() ? "" : not_about(t.statement, options.about);
        !other.empty())
      return {CertificateStatus::refused, {}, t.line, {}, other};
  FirstFailure all;
  for (const Theorem& t : theorems)
    for (const Leaf& leaf : t.leaves) all.leaves.emplace_back(&t, &leaf);
  all.why.resize(all.leaves.size());
  with_threads(options.threads,
               [&] { in_parallel(all.leaves.size(), [&](std::size_t i) { all.judge(i); }); });
  if (const std::size_t i = all.first; i < all.leaves.size()) {
    const auto [theorem, leaf] = all.leaves[i];
    return {CertificateStatus::refused,
            {},
            leaf->line,
            words(theorem->statement, leaf->box),
            all.why[i]};
  }
  check.status = CertificateStatus::verified;
  for (const Theorem& t : theorems) check.theorems.push_back(told(t));
  return check;
}

ProofCheck check_proof(const std::filesystem::path& file, const CheckProofOptions& options) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return {CertificateStatus::unreadable, {}, 0, {}, std::strerror(errno)};
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    return {CertificateStatus::unreadable, {}, 0, {}, "is a directory"};
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in.bad()) return {CertificateStatus::unreadable, {}, 0, {}, "cannot be read"};
  return check_proof_text(text, options);
}

}  // namespace tiltrim
