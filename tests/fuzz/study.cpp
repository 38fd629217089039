// Studies: TOML, its problems, and nothing thrown but what their headers name.
#include "study/study.hpp"

#include <stdexcept>

#include "study/problems.hpp"
#include "tests/fuzz/input.hpp"

using namespace tiltrim;

namespace {

// What a verb would be asked; none of it is solved.
void make_problems(const Study& study) {
  for (const Condition& condition : study.conditions)
    if (!condition.table()) (void)problem_of(vehicle_at(study, condition), condition);
  if (study.sweep) (void)sweep_requests(study, study.conditions, study.sweep->axes);
  if (study.tune) (void)tune_problem(study);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Study study;
  try {
    study = parse_study({reinterpret_cast<const char*>(data), size}, "fuzzed.toml");
  } catch (const StudyError&) {
    return 0;
  }
  try {
    make_problems(study);
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
