// tiltrim loads and tiltrim validate: published vehicles.
#include <algorithm>

#include "cli/commands.hpp"
#include "report/load_sheets.hpp"
#include "report/validation_sheets.hpp"
#include "study/loads_study.hpp"
#include "study/study.hpp"
#include "study/validation.hpp"

namespace tiltrim::cli {

Outcome run(const LoadsCommand& command, const TextStyle& style, const std::stop_token&) {
  const Study study = read_study(command.common);
  std::vector<LoadsAnswer> answers;
  for_each(study, command.common, [&](const Condition& condition, Progress&) {
    answers.push_back(component_loads(condition));
  });
  const bool all = std::ranges::all_of(answers, [](const auto& a) { return a.message.empty(); });
  return {in_format(
              command.common.format, [&] { return loads_json(answers); },
              [&] { return as_csv(loads_sheet(answers)); },
              [&] { return loads_text(answers, style); }, [&] { return loads_document(answers); }),
          all ? answered : unanswered};
}

Outcome run(const ValidateCommand& command, const TextStyle& style, const std::stop_token&) {
  const Validation validation = validate(command.vehicle);
  return {in_format(
      command.common.format, [&] { return validation_json(validation); },
      [&] { return as_csv(validation_sheet(validation)); },
      [&] { return validation_text(validation, style); },
      [&] { return validation_document(validation); })};
}

}  // namespace tiltrim::cli
