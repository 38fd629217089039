// Everything that `tiltrim tables` prints.
#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "tables/slips.hpp"

namespace tiltrim {

namespace {

std::string in_words(const std::optional<Range>& r, int digits) {
  if (!r) return "no value";
  return fmt::format("[{:.{}f}, {:.{}f}]", r->lower, digits, r->upper, digits);
}

std::string identification_in_words(const Identification& id) {
  if (id.status != IdentifyStatus::reproduced)
    return fmt::format("Table 3's six numbers, read as {}: {}: {}", to_string(id.reading),
                       to_string(id.status), id.message);
  return fmt::format(
      "two constants reproduce Table 3's six numbers theta0 and a1s, read as {}, to every printed "
      "digit: Ep in {} and k in {}; at Ep = {:.6f} and V + vi = {:.4f} m/s every number is within "
      "{:.3f} of a last digit of the middle of its interval",
      to_string(id.reading), in_words(id.thrust_excess_range, 6), in_words(id.k_range, 7),
      id.thrust_excess, id.effective_speed, id.worst);
}

long confirmed(const std::vector<Slip>& slips) {
  return std::ranges::count_if(slips, [](const Slip& s) { return s.confirmed(); });
}

std::vector<std::string> outcome(const PaperTables& t) {
  std::vector<std::string> findings{identification_in_words(t.identified),
                                    identification_in_words(t.as_rounded)};
  if (t.at_excess_1_4.k_range)
    findings.push_back(fmt::format("with Ep = 1.4 exactly, truncated digits allow k in {}",
                                   in_words(t.at_excess_1_4.k_range, 7)));
  const bool round_excess = t.as_rounded_at_excess_1_4.status == IdentifyStatus::reproduced;
  findings.push_back(round_excess ? "with Ep = 1.4 exactly, rounded digits are possible too"
                                  : "with Ep = 1.4 exactly, the digits cannot have been rounded");
  findings.push_back(t.elevator.finding);
  findings.push_back(
      fmt::format("{} slips, {} of them confirmed by numbers", t.slips.size(), confirmed(t.slips)));
  findings.push_back(t.wake_as_printed.finding);
  return findings;
}

}  // namespace

std::vector<Slip> find_slips(const PublishedTables& published, const Identification& identified,
                             const Polar& section, const Vehicle& vehicle,
                             const CorrectedTable& free_pitch) {
  const slips::Source source{published, identified, section, vehicle, free_pitch};
  std::vector<Slip> all;
  for (const auto& part : {slips::in_airframe(source), slips::in_control_law(source),
                           slips::in_tables(source), slips::in_flight(source)})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

PaperTables paper_tables(const std::filesystem::path& data, const Vehicle& vehicle) {
  const Aircraft paper;
  const Polar anchored = load_polar(data / "table2_anchored.csv");
  const Polar section = load_polar(data / "naca8h12_re150k.csv");
  PaperTables t;
  t.published = load_published_tables(data / "paper_tables.json");
  const SixNumbers six = six_numbers(t.published);
  t.identified = identify(six, paper);
  t.at_excess_1_4 = identify(six, paper, {.thrust_excess = {1.4, 1.4}});
  t.as_rounded = identify(six, paper, {.reading = Reading::rounded});
  t.as_rounded_at_excess_1_4 =
      identify(six, paper, {.reading = Reading::rounded, .thrust_excess = {1.4, 1.4}});
  t.elevator = audit_elevator(t.published, t.identified, vehicle);
  t.table1 = recompute_table1(t.published);
  t.table2 = recompute_table2(t.published, anchored);
  t.table3 = recompute_table3(t.published, t.identified, t.elevator);
  for (std::size_t i = 0; i < 3; ++i) t.section[i] = section.at(t.published.alpha[i].value);
  t.level_body = trim_level_body(vehicle);
  t.free_pitch = trim_free_pitch(vehicle);
  t.wake_as_printed = climb_with_printed_wake(vehicle);
  t.slips = find_slips(t.published, t.identified, section, vehicle, t.free_pitch);
  t.findings = outcome(t);
  return t;
}

}  // namespace tiltrim
