#include "report/conditions.hpp"
#include "report/json.hpp"
#include "report/quality_sheets.hpp"

namespace tiltrim {

using namespace json;
using Eigen::Index;

namespace {

void add_trim(const Answer& a, ordered_json& c) {
  const TrimResult& t = a.trim;
  c["name"] = a.condition.name;
  c["status"] = to_string(t.status);
  // Without an equilibrium the best point goes under its own key, so it cannot be mistaken for a
  // result.
  if (a.has_equilibrium())
    c.update(point(a.model, a.trim.point, a.trim.outputs));
  else
    c.update({{"state", nullptr},
              {"input", nullptr},
              {"output", nullptr},
              {"closest", point(a.model, a.trim.point, a.trim.outputs)}});
  if (a.condition.user()) c["parameter"] = named(a.model.parameters, t.point.p);
  c["residual"] = t.residual;
  c["limits_active"] = ordered_json::array();
  for (const ActiveLimit& l : t.limits_active)
    c["limits_active"].push_back(l.signal + (l.upper ? " upper" : " lower"));
  c["message"] = t.message;
  c["model"] = a.model.name;
  c["rates"] = named(a.model.states, t.rates);
  c["step"] = t.step;
  c["rcond"] = t.rcond;
  c["effort"] = t.effort;
  c["starts"] = t.starts;
  c["evaluations"] = t.evaluations;
  c["others"] = ordered_json::array();
  for (const OperatingPoint& other : t.others)
    c["others"].push_back(named(a.model.states, other.x));
  if (a.table)
    c["moment"] = {{"CM_required", a.table->CM_required}, {"CM_elevator", a.table->CM_elevator}};
}

ordered_json all_json(const AllEquilibria& all, const Model& model) {
  ordered_json j{{"starts", all.starts}, {"branches", all.branches}};
  j["found"] = ordered_json::array();
  for (const Equilibrium& e : all.equilibria) {
    ordered_json one{{"status", to_string(e.trim.status)}, {"found", e.found}};
    one.update(point(model, e.trim.point, e.trim.outputs));
    one["residual"] = e.trim.residual;
    one["rcond"] = e.trim.rcond;
    one["effort"] = e.trim.effort;
    one["verdict"] = e.modes ? ordered_json(to_string(e.modes->verdict)) : ordered_json();
    one["spectral_abscissa"] = e.modes ? ordered_json(e.modes->spectral_abscissa) : ordered_json();
    j["found"].push_back(one);
  }
  return j;
}

const char* name_of(RemedyKind kind) {
  return kind == RemedyKind::limit ? "limit" : kind == RemedyKind::equation ? "equation" : "lever";
}

ordered_json diagnosis_json(const Explanation& e) {
  ordered_json j{{"words", e.words}, {"model", e.airframe.name}};
  j["holding"] = ordered_json::array();
  j["remedies"] = ordered_json::array();
  if (!e.diagnosis) return j;
  for (const Diagnosis::Holding& h : e.diagnosis->holding)
    j["holding"].push_back({{"limit", h.limit.signal + (h.limit.upper ? " upper" : " lower")},
                            {"value", h.limit.value},
                            {"pull", h.pull}});
  for (const Remedy& r : e.diagnosis->remedies) {
    ordered_json one{{"kind", name_of(r.kind)}, {"signal", r.signal}};
    if (r.kind == RemedyKind::limit) one["side"] = r.upper ? "upper" : "lower";
    one["from"] = r.from;
    one["to"] = r.helps() ? ordered_json(r.to) : ordered_json();
    one["helps"] = r.helps();
    one["status"] = to_string(r.trim.status);
    if (r.kind != RemedyKind::equation) one["searched"] = {r.searched.lower, r.searched.upper};
    if (r.helps()) one.update(point(e.airframe, r.trim.point, r.trim.outputs));
    j["remedies"].push_back(one);
  }
  return j;
}

ordered_json linear_json(const LinearModel& l) {
  ordered_json j{{"status", to_string(l.status)}, {"message", l.message}, {"residual", l.residual}};
  j["remarks"] = l.remarks;
  j["states"] = names(l.states);
  j["inputs"] = names(l.inputs);
  j["outputs"] = names(l.outputs);
  if (!l) return j;
  j["method"] = l.method == Method::exact ? "exact" : "differences";
  j["A"] = rows(l.A);
  j["A_error"] = rows(l.A_error);
  j["B"] = rows(l.B);
  j["B_error"] = rows(l.B_error);
  j["C"] = rows(l.C);
  j["C_error"] = rows(l.C_error);
  j["D"] = rows(l.D);
  j["D_error"] = rows(l.D_error);
  if (l.A_differences) {
    j["A_differences"] = rows(l.A_differences->value);
    j["A_differences_error"] = rows(l.A_differences->error);
  }
  return j;
}

}  // namespace

std::string conditions_json(const std::vector<ConditionReport>& conditions) {
  ordered_json all{{"conditions", ordered_json::array()}};
  for (const ConditionReport& r : conditions) {
    ordered_json c;
    add_trim(r.answer, c);
    if (r.all) c["equilibria"] = all_json(*r.all, r.answer.model);
    if (r.qualities) c["qualities"] = qualities_object(*r.qualities);
    if (r.why) c["diagnosis"] = diagnosis_json(*r.why);
    if (r.linear) c["linear"] = linear_json(*r.linear);
    if (r.modes) {
      c["modes"] = ordered_json::array();
      for (const Mode& m : r.modes->modes) c["modes"].push_back(mode(m, r.linear->states));
      c["spectral_abscissa"] = r.modes->spectral_abscissa;
      c["verdict"] = to_string(r.modes->verdict);
    }
    all["conditions"].push_back(c);
  }
  return all.dump(1) + '\n';
}

}  // namespace tiltrim
