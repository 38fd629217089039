// Branch and bound over the box of parameters.
#include "prove/prove.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
#include "prove/examined.hpp"
#include "prove/parts.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;
using namespace proving;

std::string to_string(ProofVerdict verdict) {
  switch (verdict) {
    case ProofVerdict::stable:
      return "proved_stable";
    case ProofVerdict::unstable:
      return "proved_unstable";
    case ProofVerdict::no_trim:
      return "proved_no_trim";
    default:
      return "undecided";
  }
}

std::string to_string(ProofStatus status) {
  switch (status) {
    case ProofStatus::proved:
      return "proved";
    case ProofStatus::partly:
      return "partly";
    default:
      return "refuted";
  }
}

ProofStatus Theorem::status() const {
  if (unstable > 0) return ProofStatus::refuted;
  return undecided > 0 ? ProofStatus::partly : ProofStatus::proved;
}

namespace {

// A box to examine, with its parent's tube for a start.
struct Open {
  std::size_t node = 0;
  VectorXd z;  // empty: none
};

VectorXd first_start(const Setup& s, const Cell& cell) {
  if (s.problem.start)
    if (const auto z =
            s.problem.start(Eigen::Map<const VectorXd>(cell.m.data(), Index(cell.m.size()))))
      return *z;
  VectorXd z(s.nz());
  for (std::size_t j = 0; j < s.nz(); ++j) z[Index(j)] = value_of(s.problem.guess, s.unknowns[j]);
  return z;
}

// The outcomes of open comparisons that this box allows, found by evaluating every combination.
std::vector<Branches> all_sides(const Setup& s, const Cell& cell, const VectorXd& z) {
  std::vector<Branches> all;
  Branches sides;
  const Jets unknowns(z.begin(), z.end());
  constexpr std::size_t most = 16;
  while (all.size() < most) {
    sides.next = 0;
    sides.blocked = false;
    {
      const BranchScope scope(sides);
      (void)evaluate(s, known(s, cell), unknowns, Along::nothing);
    }
    sides.blocked = false;
    all.push_back(sides);
    all.back().replay = true;
    while (!sides.taken.empty() && (!sides.open.back() || sides.taken.back())) {
      sides.taken.pop_back();
      sides.open.pop_back();
    }
    if (sides.taken.empty()) return all;
    sides.taken.back() = 1;
  }
  return {};
}

// One side of the switches on one box.
ProofVerdict one_side(const Setup& s, const Cell& cell, const Branches& sides,
                      const Required& required, Answer& answer) {
  Tube tube;
  int limits = 0;
  bool near = false;  // an equilibrium at the middle, within the limits as far as seen
  for (const bool again : {false, true}) {  // the parent's equilibrium may be another one
    if (again) answer.z = first_start(s, cell);
    tube = find_tube(s, cell, answer.z, sides);
    limits = tube.failed ? 0 : within_limits(s, tube, answer.failure);
    if (tube.failed) answer.failure = *tube.failed;
    near = tube.trimmed && middle_within_limits(s, tube);
    if (near || answer.trimmed) break;
    answer.trimmed = true;
  }
  if (near) {
    answer.z = tube.record.z;
    answer.S = tube.record.S;
  }
  answer.found = near;
  if (limits == -1 || !near) {
    Record absent;
    if (!prove_absent(s, cell, sides, absent)) {
      if (limits == -1) answer.failure.cause = "limit";
      return ProofVerdict::undecided;
    }
    answer.sides.push_back(std::move(absent));
    return ProofVerdict::no_trim;
  }
  if (limits != 1 || !count_roots(s, tube, required, answer.failure)) {
    answer.failure.cut = worst(s, cell, tube.record, sides, answer.failure);
    return ProofVerdict::undecided;
  }
  answer.sides.push_back(std::move(tube.record));
  const Record& found = answer.sides.back();
  return found.roots + found.outside == 0 ? ProofVerdict::stable : ProofVerdict::unstable;
}

int widest(const Setup& s, const std::vector<Range>& box) {
  const auto share = [&](std::size_t j) {
    const Uncertain& p = s.problem.parameters[j];
    return (box[j].upper - box[j].lower) / (p.upper - p.lower);
  };
  std::size_t k = 0;
  for (std::size_t j = 1; j < s.k(); ++j)
    if (share(j) > share(k)) k = j;
  return int(k);
}

// A parameter that takes the box across a switch on its own and is wide; -1: none.
int across(const Setup& s, const Cell& cell, const VectorXd& z) {
  constexpr double wide = 1.0 / 32;  // of its range: narrower boxes are proved on both sides
  for (std::size_t k = 0; k < s.k(); ++k) {
    const Uncertain& p = s.problem.parameters[k];
    if (cell.box[k].upper - cell.box[k].lower <= wide * (p.upper - p.lower)) continue;
    Cell alone = cell;
    for (std::size_t j = 0; j < s.k(); ++j)
      if (j != k) alone.r[j] = 0;
    if (all_sides(s, alone, z).size() != 1) return int(k);
  }
  return -1;
}

Answer examine(const Setup& s, const std::vector<Range>& box, const VectorXd& start,
               const Required& required) {
  const RoundToNearest environment;
  const Cell cell(box);
  Answer answer;
  answer.trimmed = start.size() == 0;
  answer.z = answer.trimmed ? first_start(s, cell) : start;
  const std::vector<Branches> all = all_sides(s, cell, answer.z);
  ProofVerdict verdict = ProofVerdict::undecided;
  if (all.size() != 1) {
    answer.failure = {"switch", across(s, cell, answer.z), {}, {}};
    if (all.empty() || answer.failure.cut >= 0) {
      if (answer.failure.cut < 0) answer.failure.cut = widest(s, box);
      return answer;
    }
  }
  for (const Branches& sides : all) {
    const ProofVerdict side = one_side(s, cell, sides, required, answer);
    const bool other = &sides != &all.front() && side != verdict;
    verdict = other ? ProofVerdict::undecided : side;
    if (verdict != ProofVerdict::undecided) continue;
    if (all.size() > 1) answer.failure.cause = "switch";
    answer.sides.clear();
    break;
  }
  if (answer.failure.cut < 0) answer.failure.cut = widest(s, box);
  answer.verdict = verdict;
  return answer;
}

// Which parameter to cut, and where; negative if too small.
int cut_of(const Setup& s, const std::vector<Range>& box, std::size_t wanted, double smallest,
           double& at) {
  const auto share = [&](std::size_t k) {
    return (box[k].upper - box[k].lower) /
           (s.problem.parameters[k].upper - s.problem.parameters[k].lower);
  };
  std::size_t k = wanted;
  if (share(k) <= smallest)
    for (std::size_t j = 0; j < s.k(); ++j)
      if (share(j) > share(k)) k = j;
  at = 0.5 * (box[k].lower + box[k].upper);
  if (share(k) <= smallest || !(at > box[k].lower && at < box[k].upper)) return -1;
  return int(k);
}

// The boxes of one level, and those of the next.
class Search {
 public:
  Search(const ProveProblem& problem, const ProveOptions& options)
      : s_(problem), options_(options), examined_(options) {
    theorem_.name = problem.name;
    theorem_.parameters = problem.parameters;
    theorem_.unknowns = problem.unknowns;
    theorem_.margin = options.margin;
    theorem_.damping = options.damping;
    ProofNode root;
    for (const Uncertain& p : problem.parameters) root.box.push_back({p.lower, p.upper});
    root.volume = 1;
    root.cause = "stopped";
    theorem_.tree.push_back(root);
    theorem_.undecided = 1;
    level_.push_back({});
  }

  Theorem run() {
    while (!level_.empty() && !options_.stop.stop_requested()) {
      if (theorem_.undecided <= options_.undecided) break;
      if (options_.refuted_is_enough && theorem_.unstable > 0) break;
      const std::size_t left = options_.max_boxes - std::min(options_.max_boxes, theorem_.boxes);
      if (left == 0) break;
      level_.resize(std::min(left, level_.size()));
      step();
      if (options_.observe) options_.observe(1 - theorem_.undecided, theorem_.boxes);
    }
    theorem_.interrupted = options_.stop.stop_requested();
    return std::move(theorem_);
  }

 private:
  void step() {
    std::vector<std::optional<Answer>> answers(level_.size());
    for (std::size_t from = 0; from < level_.size() && !options_.stop.stop_requested();) {
      const std::size_t count = std::min(level_.size() - from, examined_.at_once());
      in_parallel(count, [&](std::size_t i) { answers[from + i] = answer_of(from + i); });
      examined_.append(theorem_.boxes + from, std::span(answers).subspan(from, count));
      from += count;
    }
    std::vector<Open> next;
    for (std::size_t i = 0; i < level_.size(); ++i)
      if (answers[i]) settle(level_[i].node, *answers[i], next);
    level_ = std::move(next);
  }

  // Of a box of this level; none after a stop.
  std::optional<Answer> answer_of(std::size_t i) {
    if (auto known = examined_.take(theorem_.boxes + i)) return known;
    if (options_.stop.stop_requested()) return {};
    return examine(s_, theorem_.tree[level_[i].node].box, level_[i].z,
                   {options_.margin, options_.damping});
  }

  void settle(std::size_t at, Answer& answer, std::vector<Open>& next) {
    ++theorem_.boxes;
    ProofNode node = theorem_.tree[at];
    node.verdict = answer.verdict;
    if (answer.verdict != ProofVerdict::undecided) {
      theorem_.undecided -= node.volume;
      (node.verdict == ProofVerdict::stable     ? theorem_.stable
       : node.verdict == ProofVerdict::unstable ? theorem_.unstable
                                                : theorem_.no_trim) += node.volume;
      node.cause.clear();
      node.sides = std::move(answer.sides);
      theorem_.tree[at] = std::move(node);
      return;
    }
    node.cause = answer.failure.cause;
    const int k = cut_of(s_, node.box, std::size_t(answer.failure.cut), options_.smallest, node.at);
    theorem_.tree[at] = node;
    if (k < 0) return;
    theorem_.tree[at].split = k;
    for (const bool upper : {false, true}) {
      ProofNode child;
      child.box = node.box;
      (upper ? child.box[std::size_t(k)].lower : child.box[std::size_t(k)].upper) = node.at;
      child.volume = 0.5 * node.volume;
      child.cause = node.cause;
      (upper ? theorem_.tree[at].upper : theorem_.tree[at].lower) = theorem_.tree.size();
      VectorXd z;
      if (answer.found) z = answer.z + (upper ? 0.5 : -0.5) * answer.S.col(k);
      next.push_back({theorem_.tree.size(), z});
      theorem_.tree.push_back(std::move(child));
    }
  }

  Setup s_;
  const ProveOptions& options_;
  Examined examined_;
  Theorem theorem_;
  std::vector<Open> level_;
};

// Whether all leaves below have one verdict and cause; adds regions where they do not.
bool merge(const Theorem& t, std::size_t at, std::vector<ProofNode>& regions) {
  const ProofNode& node = t.tree[at];
  const std::size_t first = regions.size();
  if (node.split < 0) {
    ProofNode region;
    region.verdict = node.verdict;
    if (node.verdict == ProofVerdict::undecided) region.cause = node.cause;
    region.box = node.box;
    region.volume = node.volume;
    regions.push_back(std::move(region));
    return true;
  }
  const bool low = merge(t, node.lower, regions);
  const bool one = merge(t, node.upper, regions) && low;
  if (!one || regions[first].verdict != regions[first + 1].verdict ||
      regions[first].cause != regions[first + 1].cause)
    return false;
  regions.resize(first + 1);
  regions[first].box = node.box;
  regions[first].volume = node.volume;
  return true;
}

// Along one parameter neighbours of one verdict are one interval.
void join(std::vector<ProofNode>& regions) {
  std::ranges::sort(regions, {}, [](const ProofNode& r) { return r.box[0].lower; });
  std::vector<ProofNode> joined;
  for (const ProofNode& r : regions) {
    if (!joined.empty() && joined.back().verdict == r.verdict && joined.back().cause == r.cause) {
      joined.back().box[0].upper = r.box[0].upper;
      joined.back().volume += r.volume;
    } else {
      joined.push_back(r);
    }
  }
  regions = std::move(joined);
}

}  // namespace

Theorem prove(const ProveProblem& problem, const ProveOptions& options) {
  const RoundToNearest environment;
  if (!(options.damping >= 0 && options.damping < 1))
    throw CallerMistake(
        fmt::format("damping = {}; expected a ratio from 0 to below 1", options.damping));
  Theorem theorem = Search(problem, options).run();
  // Anew: the running difference may lose the smallest leaves.
  theorem.undecided = 0;
  for (const ProofNode& node : theorem.tree)
    if (node.split < 0 && node.verdict == ProofVerdict::undecided) theorem.undecided += node.volume;
  merge(theorem, 0, theorem.regions);
  if (problem.parameters.size() == 1) join(theorem.regions);
  return theorem;
}

Theorem prove_largest_margin(const ProveProblem& problem, const ProveOptions& options) {
  ProveOptions at = options;
  at.log = nullptr;
  Theorem best = prove(problem, at);
  if (best.status() != ProofStatus::proved) return best;
  // A box that is unstable, or needs as many boxes again as the first proof took, ends a trial.
  constexpr double least = 1e-4, largest = 1e3, accuracy = 0.01;  // 1/s
  constexpr std::size_t effort = 20;
  at.max_boxes = std::min(options.max_boxes, effort * best.boxes + 1000);
  at.refuted_is_enough = true;
  double above = std::max(2 * options.margin, least);
  const auto proved = [&](double margin) {
    at.margin = margin;
    Theorem theorem = prove(problem, at);
    const bool holds = theorem.status() == ProofStatus::proved;
    if (holds) best = std::move(theorem);
    return holds;
  };
  while (above < largest && proved(above)) above *= 4;
  while (above - best.margin > accuracy * above && above > least && !at.stop.stop_requested()) {
    const double middle = best.margin > 0 ? std::sqrt(best.margin * above) : 0.1 * above;
    if (!proved(middle)) above = middle;
  }
  return best;
}

}  // namespace tiltrim
