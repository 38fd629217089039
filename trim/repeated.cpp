#include "trim/repeated.hpp"

#include <utility>

#include "model/time_limit.hpp"
#include "runtime/rounding.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

struct RepeatedTrim::Parts {
  Model model;
  TrimSpec spec;
  Problem problem;

  Parts(Model m, TrimSpec s)
      : model(std::move(m)), spec(std::move(s)), problem(unguessed_problem(model, spec)) {}
};

RepeatedTrim::RepeatedTrim(Model model, TrimSpec spec)
    : parts_(std::make_unique<Parts>(std::move(model), std::move(spec))) {}
RepeatedTrim::~RepeatedTrim() = default;
RepeatedTrim::RepeatedTrim(RepeatedTrim&& other) noexcept = default;
RepeatedTrim& RepeatedTrim::operator=(RepeatedTrim&& other) noexcept = default;

TrimResult RepeatedTrim::operator()(const OperatingPoint& guess, const TrimOptions& options) {
  // A time limit needs a model of its own.
  if (options.time_limit != unlimited) return trim(parts_->model, parts_->spec, guess, options);
  const RoundToNearest environment;
  set_guess(parts_->problem, guess);
  return solution_of(parts_->problem, options);
}

}  // namespace tiltrim
