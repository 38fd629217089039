#include "report/paper_facts.hpp"

#include <fmt/ranges.h>

#include <algorithm>

namespace tiltrim {

namespace {

// The features that the flight does not reach are one row: all differ for the same reason.
std::vector<PaperFact> shown_facts(const std::vector<PaperFact>& facts) {
  std::vector<PaperFact> shown, late;
  for (const PaperFact& f : facts) (f.reached ? shown : late).push_back(f);
  if (late.size() < 2) return facts;
  PaperFact all = late.front();
  all.paper = number_of(late.size(), "feature") + " at later times";
  for (const PaperFact& f : late)
    if (!all.figure.ends_with(f.figure)) all.figure += ", " + f.figure;
  shown.push_back(all);
  return shown;
}

std::string facts_title(const std::vector<PaperFact>& facts) {
  return fmt::format("Compared with the paper's figures, {} of {} agree",
                     std::ranges::count_if(facts, &PaperFact::agrees), facts.size());
}

SheetCell agreement(const PaperFact& f) {
  return f.agrees ? SheetCell("agrees", Tone::good) : SheetCell("differs", Tone::doubtful);
}

}  // namespace

Sheet facts_sheet(const std::vector<PaperFact>& facts) {
  Sheet sheet{facts_title(facts),
              {{"figure", "figure", ""},
               {"agrees", "verdict", ""},
               {"paper", "paper", ""},
               {"flight", "flight", ""},
               {"why", "why", ""}},
              {},
              {}};
  for (const PaperFact& f : shown_facts(facts))
    sheet.rows.push_back({f.figure, agreement(f), f.paper, f.flight, f.why});
  return sheet;
}

std::string facts_text(const std::vector<PaperFact>& facts, const TextStyle& style) {
  if (facts.empty()) return "";
  constexpr std::size_t indent = 19;  // width of "  fig. 5  differs  "
  std::string text = "\n" + facts_title(facts) + ":\n";
  for (const PaperFact& f : shown_facts(facts)) {
    const std::string verdict =
        f.agrees ? toned("agrees ", Tone::good, style) : toned("differs", Tone::doubtful, style);
    const std::string words = wrapped(f.paper + ": " + f.flight, indent, style.width);
    text += fmt::format("  fig. {}  {}  {}", f.figure, verdict, words.substr(indent));
    if (!f.why.empty()) text += wrapped(f.why, indent + 2, style.width);
  }
  return text;
}

}  // namespace tiltrim
