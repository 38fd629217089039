// What a theorem proves along its first parameter: shares of the box of the others.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <vector>

#include "report/figure_parts.hpp"

namespace tiltrim::figures {

namespace {

struct Kind {
  ProofVerdict verdict;
  const char* title;
  int colour;
};
constexpr std::array<Kind, 4> kinds{
    {{ProofVerdict::stable, "proved stable", colour::stable},
     {ProofVerdict::unstable, "proved unstable", colour::unstable + 1},
     {ProofVerdict::no_trim, "proved to have no trim", colour::none},
     {ProofVerdict::undecided, "undecided", colour::undecided}}};

constexpr std::size_t most_columns = 400;

// Ends of the regions along the first parameter, thinned where there are too many.
std::vector<double> ends_of(const Theorem& t) {
  std::vector<double> ends{t.parameters.front().lower, t.parameters.front().upper};
  for (const ProofNode& r : t.regions) {
    ends.push_back(r.box.front().lower);
    ends.push_back(r.box.front().upper);
  }
  std::ranges::sort(ends);
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  if (ends.size() <= most_columns + 1) return ends;
  std::vector<double> even;
  for (std::size_t i = 0; i <= most_columns; ++i)
    even.push_back(ends.front() + (ends.back() - ends.front()) * double(i) / double(most_columns));
  return even;
}

// Volume of each kind between two values of the first parameter.
std::array<double, 4> shares(const Theorem& t, double from, double to) {
  std::array<double, 4> all{};
  double sum = 0;
  for (const ProofNode& r : t.regions) {
    const Range& along = r.box.front();
    const double common = std::min(to, along.upper) - std::max(from, along.lower);
    if (!(common > 0)) continue;
    const double share = r.volume * common / (along.upper - along.lower);
    for (std::size_t k = 0; k < kinds.size(); ++k)
      if (kinds[k].verdict == r.verdict) all[k] += share;
    sum += share;
  }
  for (double& share : all) share /= sum;
  return all;
}

}  // namespace

void add_proof(const Theorem& t, const ProveTable& table, const std::string& id,
               ReportFigures& all) {
  const Key& key = table.parameters.front().key;
  Panel panel;
  panel.height = t.parameters.size() == 1 ? 5 : 14;
  panel.x = {with_unit(key.name, key.unit),
             {key.in_study(t.parameters.front().lower), key.in_study(t.parameters.front().upper)},
             false,
             {},
             {}};
  panel.y = {t.parameters.size() == 1 ? "" : "share of the others' box", {0, 1}, false, {}, {}};
  if (t.parameters.size() == 1) panel.y.ticks = {{0, " "}};
  for (const Kind& kind : kinds) panel.boxes.push_back({kind.title, kind.colour, false, {}});
  const std::vector<double> ends = ends_of(t);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const std::array<double, 4> column = shares(t, ends[i], ends[i + 1]);
    double below = 0;
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      if (!(column[k] > 0)) continue;
      const double above = std::min(1.0, below + column[k]);
      panel.boxes[k].corners.push_back(
          {key.in_study(ends[i]), key.in_study(ends[i + 1]), below, above});
      below = above;
    }
  }
  std::erase_if(panel.boxes, [](const Boxes& b) { return b.corners.empty(); });
  Figure figure;
  figure.name = "proof_" + id;
  figure.caption = fmt::format("{}: {} over {} boxes; undecided is a share of {:.3g}", t.name,
                               to_string(t.status()), t.boxes, t.undecided);
  figure.alternative = fmt::format(
      "Shares of the box over {}: stable {:.6g}, unstable {:.6g}, without trim {:.6g}, "
      "undecided {:.6g}",
      key.name, t.stable, t.unstable, t.no_trim, t.undecided);
  figure.panels.push_back(std::move(panel));
  all.figures.push_back(std::move(figure));
}

}  // namespace tiltrim::figures
