// main() of every folder's tests. It fails if no test ran: a filter that matches no test case, or
// only test cases without assertions. It exits with code 77, with a message, only if the
// environment's TILTRIM_SIMD names an instruction set that this processor lacks.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "linearize/batch.hpp"
#include "tests/check.hpp"

namespace {

constexpr int skipped = 77;

/// Checks of a whole run that doctest does not make.
struct Ran : doctest::IReporter {
  static inline unsigned cases = 0;
  static inline int assertions = 0;

  explicit Ran(const doctest::ContextOptions&) {}
  void test_run_end(const doctest::TestRunStats& run) override {
    cases = run.numTestCasesPassingFilters;
    assertions = run.numAsserts;
  }

  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_case_start(const doctest::TestCaseData&) override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_end(const doctest::CurrentTestCaseStats&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}
};
REGISTER_LISTENER("ran", 1, Ran);

/// The requested instruction set, if it exists and the processor lacks it.
const char* missing_instruction_set() {
  const char* asked = std::getenv("TILTRIM_SIMD");
  constexpr std::array<std::string_view, 4> known = {"scalar", "baseline", "avx2", "avx512"};
  if (!asked || std::ranges::find(known, asked) == known.end()) return nullptr;
  try {
    (void)tiltrim::instruction_set();
  } catch (const std::invalid_argument&) {
    return asked;
  }
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  if (const char* set = missing_instruction_set()) {
    std::printf("skipped: this processor has no %s\n", set);
    return skipped;
  }
  doctest::Context context(argc, argv);
  if (sanitized && std::getenv("TILTRIM_BRIEF"))
    context.addFilter("test-suite-exclude", "thorough");
  const int failed = context.run();
  if (failed || context.shouldExit()) return failed;
  if (Ran::cases == 0 || Ran::assertions == 0) {
    std::fputs("no test case ran, or none asserted anything\n", stderr);
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
