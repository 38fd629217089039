#include <nlohmann/json.hpp>

#include "report/paper.hpp"

namespace tiltrim {

using nlohmann::ordered_json;

namespace {

ordered_json optional(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json range(const std::optional<Range>& r) {
  return r ? ordered_json{r->lower, r->upper} : ordered_json(nullptr);
}

ordered_json table_json(const Table& table) {
  ordered_json t{{"title", table.title}, {"notes", table.notes}};
  for (const Row& row : table.rows) {
    ordered_json r{{"unit", row.unit}};
    for (const char* key :
         {"published", "published_text", "computed", "deviation", "agreement", "remark"})
      r[key] = ordered_json::array();
    for (const Cell& c : row.cells) {
      r["published"].push_back(c.published.value);
      r["published_text"].push_back(c.published.text);
      r["computed"].push_back(optional(c.computed));
      r["deviation"].push_back(optional(c.deviation));
      r["agreement"].push_back(to_string(c.agreement));
      r["remark"].push_back(c.remark);
    }
    t[row.name] = r;
  }
  return t;
}

ordered_json identification_json(const Identification& id) {
  return {{"thrust_excess", id.thrust_excess},
          {"effective_speed", id.effective_speed},
          {"k", id.k},
          {"thrust_excess_range", range(id.thrust_excess_range)},
          {"k_range", range(id.k_range)},
          {"worst_miss", id.worst},
          {"misses", id.misses},
          {"reading", to_string(id.reading)},
          {"status", to_string(id.status)},
          {"message", id.message},
          {"evaluations", id.evaluations}};
}

ordered_json elevator_json(const ElevatorAudit& audit, const Columns<std::string>& columns) {
  ordered_json list = ordered_json::array();
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const ElevatorColumn& e = audit.columns[k];
    list.push_back({{"column", columns[k]},
                    {"CM_thrust", e.CM_thrust},
                    {"CM_required", e.CM_required},
                    {"CM_published", e.CM_published},
                    {"CM_increment", e.CM_increment},
                    {"slope", e.slope},
                    {"K_Lp", e.K_Lp},
                    {"delta_e", optional(e.delta_e)}});
  }
  return {{"columns", list}, {"finding", audit.finding}};
}

ordered_json corrected_json(const CorrectedColumn& c) {
  return {{"name", c.name},
          {"V", c.condition.V},
          {"gamma", c.condition.gamma},
          {"eta", c.condition.eta},
          {"status", to_string(c.trim.status)},
          {"message", c.trim.message},
          {"residual", c.trim.residual},
          {"theta", optional(c.theta)},
          {"theta0", optional(c.theta0)},
          {"a1s", optional(c.a1s)},
          {"delta_e", optional(c.delta_e)},
          {"stopped_by", c.stopped_by},
          {"verdict", c.verdict ? ordered_json(to_string(*c.verdict)) : ordered_json(nullptr)},
          {"spectral_abscissa", optional(c.spectral_abscissa)},
          {"finding", c.finding}};
}

ordered_json corrected_json(const CorrectedTable& table) {
  ordered_json t{{"title", table.title}, {"columns", ordered_json::array()}};
  for (const CorrectedColumn& c : table.columns) t["columns"].push_back(corrected_json(c));
  return t;
}

ordered_json slip_json(const Slip& s) {
  ordered_json evidence = ordered_json::array();
  for (const Evidence& e : s.evidence)
    evidence.push_back(
        {{"what", e.what}, {"value", e.value}, {"unit", e.unit}, {"confirms", e.confirms}});
  return {{"where", s.where}, {"printed", s.printed}, {"consistent", s.consistent},
          {"why", s.why},     {"evidence", evidence}, {"confirmed", s.confirmed()}};
}

}  // namespace

std::string paper_json(const PaperTables& t) {
  ordered_json all{{"source", t.published.source}, {"columns", t.published.columns}};
  all["identified"] = identification_json(t.identified);
  all["identified_at_thrust_excess_1.4"] = identification_json(t.at_excess_1_4);
  all["identified_as_rounded"] = identification_json(t.as_rounded);
  all["identified_as_rounded_at_thrust_excess_1.4"] =
      identification_json(t.as_rounded_at_excess_1_4);
  all["table1"] = table_json(t.table1);
  all["table2"] = table_json(t.table2);
  all["table3"] = table_json(t.table3);
  all["elevator"] = elevator_json(t.elevator, t.published.columns);
  all["corrected_theta_zero"] = corrected_json(t.level_body);
  all["corrected_theta_free"] = corrected_json(t.free_pitch);
  all["climb_with_wake_as_printed"] = corrected_json(t.wake_as_printed);
  all["slips"] = ordered_json::array();
  for (const Slip& s : t.slips) all["slips"].push_back(slip_json(s));
  all["findings"] = t.findings;
  return all.dump(1) + '\n';
}

}  // namespace tiltrim
