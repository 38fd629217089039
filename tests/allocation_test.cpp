// Out of memory: the k-th allocation of a run fails, for every k or for many spread over the run.
// Eigen allocates by malloc, everything else by operator new; both are replaced in this program.
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <new>
#include <string>

#include "linearize/linearize.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"

using namespace tiltrim;

namespace {

std::atomic<long> counted{0}, failing{0};  // allocations so far; the one that fails

bool fails() { return ++counted == failing; }

}  // namespace

extern "C" void* __real_malloc(std::size_t size);   // NOLINT: the linker's names
extern "C" void* __wrap_malloc(std::size_t size) {  // NOLINT
  return fails() ? nullptr : __real_malloc(size);
}

void* operator new(std::size_t size) {
  if (fails()) throw std::bad_alloc();
  if (void* const memory = __real_malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

// The outcomes of `act` with one failing allocation each: "" for a result.
std::map<std::string, int> endings(const std::function<void()>& act) {
  const auto run = [&](long k) -> std::string {
    std::string why;
    counted = 0;
    failing = k;
    try {
      act();
    } catch (const std::exception& e) {
      failing = 0;
      why = e.what();
      REQUIRE(!why.empty());
    }
    failing = 0;
    return why;
  };
  REQUIRE(run(0).empty());  // first run: allocations at first use are made
  REQUIRE(run(0).empty());
  const long all = counted;
  const long every = 40, most = trials(160);  // one by one at first
  std::map<std::string, int> found;
  for (long k = 1; k <= all; k += k < every ? 1 : std::max(1L, (all - every) / most))
    ++found[run(k)];
  return found;
}

Study study_of(const std::string& name) {
  return load_study(std::string(TILTRIM_SOURCE_DIR) + "/studies/" + name);
}

}  // namespace

TEST_CASE("an allocation that fails: reading a study") {
  for (const char* name : {"paper.toml", "levitation.toml", "tune_transition.toml"}) {
    const Study whole = study_of(name);
    const auto found = endings([&] {
      const Study study = study_of(name);  // the library copes without: the result is complete
      REQUIRE(study.text == whole.text);
      REQUIRE(study.conditions.size() == whole.conditions.size());
      REQUIRE(study.tune.has_value() == whole.tune.has_value());
    });
    CHECK(found.at("std::bad_alloc") > 0);
  }
}

TEST_CASE("an allocation that fails: trim and linearize") {
  const Study study = study_of("paper.toml");
  const TrimProblem problem = problem_of(study.vehicle, study.conditions.at(0));
  const TrimResult whole = trim(problem.model, problem.spec, problem.guess);
  REQUIRE(whole);
  const auto trims = endings([&] {
    const TrimResult result = trim(problem.model, problem.spec, problem.guess);
    if (result)
      REQUIRE((result.point.x - whole.point.x).norm() < 1e-6);
    else
      REQUIRE(!result.message.empty());
  });
  CHECK(trims.at("std::bad_alloc") > 0);
  const LinearModel linear = linearize(problem.model, whole.point);
  (void)endings([&] {
    const LinearModel again = linearize(problem.model, whole.point);
    if (again)
      REQUIRE((again.A - linear.A).norm() < 1e-6);
    else
      REQUIRE(!again.message.empty());
  });
}

TEST_CASE("an allocation that fails: a sweep by two threads, its log and its map") {
  const Folder folder;
  const std::filesystem::path file = folder.path / "map.nc";
  Study study = study_of("map_two_gains.toml");
  study.sweep->axes = {study.sweep->axes.at(0)};
  for (SweepAxis::Column& column : study.sweep->axes[0].columns) {
    column.values.resize(3);
    column.si.resize(3);
  }
  const auto requests = sweep_requests(study, study.conditions, study.sweep->axes);
  SweepOptions options{.threads = 2};
  options.log = folder.path / "map.nc.log";
  const SweepMap whole = sweep(requests, study.sweep->axes, options);
  const auto found = endings([&] {
    std::filesystem::remove(file);
    std::filesystem::remove(options.log);
    try {
      write_netcdf(sweep(requests, study.sweep->axes, options), file);
    } catch (...) {
      failing = 0;
      REQUIRE(!std::filesystem::exists(file));
      throw;
    }
    failing = 0;
    const SweepMap map = read_netcdf(file);
    REQUIRE(map.verdict == whole.verdict);
    REQUIRE(map.crossings.size() == whole.crossings.size());
  });
  CHECK(found.at("std::bad_alloc") > 0);
}
