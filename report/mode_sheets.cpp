#include "report/mode_sheets.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/json.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

std::string shares(const Eigen::VectorXd& participation, const Signals& states) {
  constexpr double shown = 0.1;  // smaller participations appear in the JSON only
  std::vector<std::pair<double, std::string>> parts;
  for (Index k = 0; k < participation.size(); ++k)
    if (participation[k] >= shown)
      parts.emplace_back(participation[k], states[std::size_t(k)].name);
  // Shares that are equal but for rounding keep the order of the states.
  std::ranges::stable_sort(parts, std::greater{},
                           [](const auto& part) { return std::round(1e9 * part.first); });
  std::vector<std::string> words;
  for (const auto& [share, name] : parts)
    words.push_back(fmt::format("{} {:.0f}%", name, 100 * share));
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

std::string eigenvalue_text(const Mode& m) {
  const double re = m.eigenvalue.real(), im = m.eigenvalue.imag();
  const auto text = [](double number) { return number_text(number, "{:.4f}"); };
  return im == 0 ? text(re) : text(re) + " ± " + text(std::abs(im)) + "i";
}

Tone tone_of(Verdict verdict) {
  return verdict == Verdict::stable     ? Tone::good
         : verdict == Verdict::unstable ? Tone::bad
                                        : Tone::doubtful;
}

std::string verdict_in_words(const Modes& m) {
  if (!m.converged) return "the eigenvalue iteration did not converge";
  if (m.modes.empty()) return "no states";
  const Mode& last = m.modes.back();
  const std::string least = fmt::format("the rightmost eigenvalue {} {} 1/s ({}); ",
                                        last.eigenvalue.imag() == 0 ? "is" : "has real part",
                                        number_text(last.eigenvalue.real(), "{:.4f}"), last.name);
  switch (m.verdict) {
    case Verdict::stable:
      return least + "it is left of the axis by more than its error bound";
    case Verdict::unstable:
      return least + "it is right of the axis by more than its error bound";
    case Verdict::undecided:
      return least + fmt::format("the axis lies within its error bound of {:.1e}", last.error);
  }
  return least;
}

SheetCell damping_cell(const Mode& mode) {
  return mode.frequency() > mode.error ? SheetCell(mode.damping()) : SheetCell();
}

Sheet modes_sheet(const Modes& modes, const Signals& states) {
  Sheet sheet;
  sheet.columns = {{"eigenvalue", "eigenvalue", "1/s"},
                   {"error", "± bound", "1/s", "{:.0e}"},
                   {"frequency", "frequency", "rad/s", "{:.4f}"},
                   {"damping", "damping", "", "{:.3f}"},
                   {"time_to_half", "t half", "s", "{:.3g}"},
                   {"condition", "cond.", "", "{:.1f}"},
                   {"mode", "mode", ""},
                   {"participation", "participation", ""}};
  bool growing = false, on_axis = false, undetermined = false;
  for (const Mode& m : modes.modes) {
    if (m.eigenvalue.imag() < 0) continue;  // the conjugate represents both
    growing = growing || m.eigenvalue.real() > m.error;
    on_axis = on_axis || std::isnan(m.time_to_half());
    undetermined = undetermined || !m.determined;
    sheet.rows.push_back({SheetCell(eigenvalue_text(m)), m.error, m.frequency(), damping_cell(m),
                          number_cell(m.time_to_half()), m.condition,
                          m.name + (m.determined ? "" : " (!)"), shares(m.participation, states)});
  }
  if (growing) sheet.notes.push_back("For a growing mode, t half is the time to double.");
  if (on_axis)
    sheet.notes.push_back(
        "Where t half or damping is missing, the eigenvalue's bound reaches the axis or 0.");
  if (undetermined)
    sheet.notes.push_back(
        "(!) condition above 1e8: the value of this eigenvalue is not determined.");
  return sheet;
}

Sheet all_modes_sheet(const Modes& modes) {
  Sheet sheet;
  for (const char* const key : {"verdict", "re", "im", "error", "frequency", "damping",
                                "time_to_half", "condition", "backward_error", "mode"})
    sheet.columns.push_back({key, "", ""});
  for (const Mode& m : modes.modes)
    sheet.rows.push_back({to_string(modes.verdict), m.eigenvalue.real(), m.eigenvalue.imag(),
                          m.error, m.frequency(), number_cell(m.damping()),
                          number_cell(m.time_to_half()), m.condition, m.backward_error, m.name});
  return sheet;
}

Sheet judged_modes_sheet(const std::string& name, const Modes& modes, const Signals& states) {
  Sheet sheet = modes_sheet(modes, states);
  sheet.title = name + ": " + to_string(modes.verdict);
  sheet.notes.insert(sheet.notes.begin(), verdict_in_words(modes) + ".");
  return sheet;
}

std::string modes_text(const std::string& name, const Modes& modes, const Signals& states,
                       const TextStyle& style) {
  std::string text =
      fmt::format("{} ({} state{}): {}\n", name, states.size(), states.size() == 1 ? "" : "s",
                  toned(to_string(modes.verdict), tone_of(modes.verdict), style));
  text += wrapped(verdict_in_words(modes) + ".", 2, style.width);
  return modes.modes.empty() ? text : text + as_text(modes_sheet(modes, states), style);
}

std::string modes_json(const Modes& modes, const Signals& states) {
  using namespace json;
  ordered_json j{{"states", names(states)}, {"modes", ordered_json::array()}};
  for (const Mode& m : modes.modes) j["modes"].push_back(mode(m, states));
  j["spectral_abscissa"] = modes.spectral_abscissa;
  j["verdict"] = to_string(modes.verdict);
  return j.dump(1) + '\n';
}

}  // namespace tiltrim
