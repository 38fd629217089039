#include "trim/no_answer.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "model/differentiate.hpp"
#include "model/time_limit.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::VectorXd;

namespace {

const char* residuals_in_words(const Problem& p) {
  const bool one = p.equations.size() == 1;
  const auto is_rate = [&](Eigen::Index row) { return row < std::ssize(p.model.states); };
  return std::ranges::all_of(p.equations, is_rate) ? (one ? "residual rate" : "residual rates")
                                                   : (one ? "residual" : "residuals");
}

// What the model gave at the guess, where nothing was finite, as text.
std::string no_numbers(const Problem& p) {
  if (!p.thrown.empty()) return "the model threw: " + p.thrown;
  const VectorXd rates = rates_of(p, values(p, unknowns_of(p, p.base)));
  return "at the guess " + not_finite_in_words(p, rates, outputs(p, p.base));
}

// The closest point of a search without result, as text.
std::string closest_in_words(const TrimSearch& s, const TrimResult& r) {
  const Problem& p = s.p;
  if (r.rates.size() == 0)  // not finite
    return "the model is not finite at any point tried; " + no_numbers(p);
  std::string words = fmt::format("the closest point has {} {}, {}", residuals_in_words(p),
                                  left_over(p, p.equations, r), limits_in_words(p, r));
  if (!p.thrown.empty()) words += "; at some points the model threw: " + p.thrown;
  return words;
}

// Only what was evaluated in the time allowed.
TrimResult out_of_time(const TrimSearch& s) {
  const Problem& p = s.p;
  const auto& [z, at, residual] = p.nearest;
  TrimResult r;
  r.status = TrimStatus::time_limit;
  r.point = z.size() == p.n() ? point_of(p, z) : p.base;
  r.rates = rates_of(p, at);
  r.outputs = outputs(p, r.point);
  r.residual = residual;
  r.effort = at.effort;
  r.message =
      out_of_time_in_words(s.options.time_limit) + ": " + counted(int(p.evaluations), "evaluation");
  if (std::isfinite(residual))
    r.message += fmt::format("; the closest point has a residual of {:.3g} 1/s", residual);
  return r;
}

// Wrong derivatives lead a search astray: one of those that disagree with differences, as text.
std::string doubtful_derivatives(const Problem& p, const OperatingPoint& at) {
  if (!p.model.derivatives) return "";
  try {
    const Differences d = difference(p.model, at, p.unknowns);
    const auto wrong =
        disagreements(p.model, p.unknowns, exact(p.model, at, p.unknowns), d.jacobian);
    if (wrong.empty() || !d.remarks.empty()) return "";  // at a kink both may be right
    return fmt::format("; the model's derivatives may be wrong: {}{}", wrong.front().text,
                       wrong.size() > 1 ? fmt::format(", and {} more", wrong.size() - 1) : "");
  } catch (...) {  // the model's exception, whatever it is: there is no comparison
    return "";
  }
}

}  // namespace

TrimResult no_answer(TrimSearch& s) {
  const Problem& p = s.p;
  if (s.not_repeatable) return *s.not_repeatable;
  TrimResult r = closest_to(s);
  if (s.not_repeatable) return *s.not_repeatable;
  if (!s.answers.empty()) return best_answer(s);
  if (p.over()) return out_of_time(s);
  if (s.options.stop.stop_requested()) {
    r.status = TrimStatus::interrupted;
    r.message = "stopped by the caller after " + counted(s.starts, "start");
  } else if (!s.proof.proved && !std::isfinite(s.closest_residual)) {
    r.status = p.thrown.empty() ? TrimStatus::not_finite : TrimStatus::model_threw;
    r.message = p.thrown.empty() ? fmt::format("the model is not finite at any of {}; {}",
                                               counted(s.starts, "start"), no_numbers(p))
                                 : no_numbers(p);
  } else if (s.output_not_finite) {
    r = *s.output_not_finite;
  } else {
    const Proof proof = s.proof.proved ? s.proof : prove_no_solution(p, s.options);
    if (p.over()) return out_of_time(s);
    r.status = proof.proved ? TrimStatus::infeasible : TrimStatus::not_found;
    std::string none = proof.proved ? "no point within the limits is an equilibrium"
                                    : "no equilibrium found from " + counted(s.starts, "start");
    if (proof.boxes > 0 && proof.proved)
      none += fmt::format(" (proved over {} box{})", proof.boxes, proof.boxes == 1 ? "" : "es");
    r.message = fmt::format(
        "{}{}; {}", none,
        s.none_within && r.rates.size() > 0 ? ", and no point within all limits was found" : "",
        closest_in_words(s, r));
    if (!proof.proved) r.message += doubtful_derivatives(p, r.point);
  }
  return r;
}

}  // namespace tiltrim
