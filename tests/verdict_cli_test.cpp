// Maps of verdicts as a user makes them: killed, by parts, by ranks, merged, misused.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace verdict_cli_test {

namespace {

using nlohmann::json;
using program::Ran;
using program::run;
using program::Scratch;
using program::slurp;

#ifndef TILTRIM_MPI_PROGRAM
#define TILTRIM_MPI_PROGRAM ""
#endif

// Two conditions, units enough for parts.
std::string study_of(const std::string& sweep) {
  std::string text;
  for (const char* name : {"a", "b"})
    text +=
        fmt::format("[[condition]]\nname = \"{}\"\nV = 8\ngamma_deg = 30\neta_deg = 30\n", name);
  return text + "[sweep]\n" + sweep +
         "\n[[sweep.axis]]\nkey = \"gains.K_Lp\"\nfrom = 0.02\nto = 10\ncount = 40\n"
         "[[sweep.axis]]\nkey = \"gains.k_de\"\nfrom = 0.05\nto = 20\ncount = 20000\n";
}

const std::string verdicts = "detail = \"verdict\"";

}  // namespace

TEST_CASE(
    "verdicts: parts merge to the bytes of one run; what does not belong is refused by name") {
  const Scratch scratch("verdict-parts");
  scratch.write("s.toml", study_of(verdicts));
  scratch.write("other.toml", study_of(verdicts + "\ncrossings = \"skip\""));
  scratch.write("full.toml", study_of("crossings = \"skip\""));
  scratch.write("few.toml",
                "[[condition]]\nname = \"a\"\nV = 8\ngamma_deg = 30\neta_deg = 30\n"
                "[[sweep.axis]]\nkey = \"gains.k_de\"\nvalues = [1, 2]\n");
  const Ran whole = run(scratch, "sweep s.toml -o whole.nc --threads 1");
  CHECK(whole.exit_code == 0);
  CHECK(contains(whole.out, "80 with all borders located"));
  const std::string bytes = slurp(scratch.path / "whole.nc");
  for (const char* part : {"1", "2"})
    CHECK(run(scratch, fmt::format("sweep s.toml -o {0}.nc --part {0}/2", part)).exit_code == 0);
  const Ran merge = run(scratch, "merge 2.nc 1.nc -o map.nc");
  CHECK(merge.exit_code == 0);
  CHECK(merge.out == whole.out);
  CHECK(slurp(scratch.path / "map.nc") == bytes);
  if (const std::string mpi = TILTRIM_MPI_PROGRAM; !mpi.empty()) {
    const std::string ranks = "mpirun --oversubscribe --allow-run-as-root -n 2 " + mpi;
    CHECK(run(scratch, "sweep s.toml -o ranks.nc", {"", ranks}).exit_code == 0);
    CHECK(slurp(scratch.path / "ranks.nc") == bytes);
  }
  CHECK(run(scratch, "sweep other.toml -o other.nc --part 2/2").exit_code == 0);
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    const Ran ran = run(scratch, arguments);
    CHECK(ran.exit_code == 2);
    INFO(ran.err);
    CHECK(contains(ran.err, words));
  };
  refused("merge 1.nc -o m.nc", "part 2/2 is missing; there are 1 of 2");
  refused("merge 1.nc 1.nc -o m.nc", "1.nc and 1.nc are both part 1 of 2");
  refused("merge 1.nc other.nc -o m.nc",
          "other.nc is not a part of the same map as 1.nc: its study has another text");
  refused("merge 1.nc 2.nc", "expected -o MAP.nc");
  refused("merge 1.nc 2.nc -o m.nc --format csv", "no 'csv'; expected latex|markdown|text");
  CHECK(contains(run(scratch, "merge --help").out, "-o,--output MAP.nc"));
  refused("merge 1.nc s.toml -o m.nc", "s.toml: is not a NetCDF-4 file");
  refused("sweep s.toml --part 1/2", "expected -o PART.nc");
  refused("sweep s.toml -o p.nc --part 3/2", "3/2 is not a part; expected I/N");
  refused("sweep s.toml -o p.nc --part one", "one is not a part; expected I/N");
  refused("sweep full.toml -o p.nc --part 1/2", "detail = \"verdict\"");
  CHECK(run(scratch, "sweep few.toml -o few.nc").exit_code == 0);
  refused("diff few.nc whole.nc",
          "whole.nc is a map of verdicts alone, few.nc is not; expected two of a kind");
  refused("diff 1.nc 2.nc", "1.nc: is a part of a map of verdicts");
  refused("report s.toml --sweep whole.nc", "whole.nc: is a map of verdicts alone");
}

TEST_CASE("verdicts: two maps, and what changed between them") {
  const Scratch scratch("verdict-diff");
  scratch.write("before.toml", study_of(verdicts));
  scratch.write("after.toml", "[gains]\nK_Li = 3\n" + study_of(verdicts));
  for (const auto& [map, borders] : {std::pair("before", 80), std::pair("after", 74)})
    CHECK(contains(run(scratch, fmt::format("sweep {0}.toml -o {0}.nc", map)).out,
                   fmt::format("located, {} borders\n", borders)));
  const Ran same = run(scratch, "diff before.nc before.nc");
  CHECK(same.exit_code == 0);
  CHECK(same.out ==
        "0 of 1600000 points changed stability\ncrossings: 0 moved, 0 appeared, 0 vanished\n");

  const Ran text = run(scratch, "diff before.nc after.nc");
  CHECK(text.exit_code == 1);
  CHECK(contains(text.out, "of 1600000 points changed stability\n  stable, now unstable: "));
  CHECK(contains(text.out, "crossings: 74 moved, 0 appeared, 6 vanished\n"));
  CHECK(contains(text.out, "more: --format csv lists all"));
  const json all = json::parse(run(scratch, "diff before.nc after.nc --format json").out);
  std::uint64_t changed = 0;
  for (const json& stretch : all["changed"]) changed += stretch["points"].get<std::uint64_t>();
  CHECK(text.out.starts_with(fmt::format("{} of 1600000 points", changed)));
  CHECK(all["moved"].size() == 74);
  const std::string csv = run(scratch, "diff before.nc after.nc --format csv").out;
  CHECK(
      csv.starts_with("condition,gains.K_Lp,gains.k_de_from,gains.k_de_to,points,verdict_before,"
                      "verdict_after\n"));
  CHECK(std::size_t(std::ranges::count(csv, '\n')) == 1 + all["changed"].size());
}

TEST_CASE("verdicts: killed and resumed, the same bytes") {
  const Scratch scratch("verdict-killed");
  scratch.write("s.toml", study_of(verdicts));
  CHECK(run(scratch, "sweep s.toml -o whole.nc").exit_code == 0);
  const std::string command = "sweep s.toml -o map.nc --threads 1 --checkpoint 0";
  program::Running first = program::start(scratch, command);
  CHECK(program::holds_soon([&] { return program::records_in(scratch.path / "map.nc.log") > 0; }));
  ::kill(first.pid, SIGKILL);
  (void)program::finish(first);
  const Ran last = run(scratch, command);
  CHECK(last.exit_code == 0);
  CHECK(slurp(scratch.path / "map.nc") == slurp(scratch.path / "whole.nc"));
  CHECK_FALSE(std::filesystem::exists(scratch.path / "map.nc.log"));
}

TEST_CASE("verdicts: limits of the grid, formats") {
  const Scratch scratch("verdict-formats");
  scratch.write("s.toml", study_of(verdicts));
  const json all = json::parse(run(scratch, "sweep s.toml --format json").out);
  CHECK(all["verdicts"][0]["stable"].get<int>() + all["verdicts"][0]["unstable"].get<int>() ==
        800000);
  CHECK(all["crossings"].size() == 80);
  const std::string csv = run(scratch, "sweep s.toml --format csv").out;
  CHECK(csv.starts_with("condition,gains.K_Lp,gains.k_de_from,gains.k_de_to,points,verdict\n"));
  CHECK(std::ranges::count(csv, '\n') == 1 + 160);  // two stretches on each of 80 lines
  std::string large = study_of(verdicts);
  large.replace(large.find("count = 40"), 10, "count = 60000");
  scratch.write("large.toml", large);
  CHECK(contains(run(scratch, "sweep large.toml").err, "expected at most 1000000000"));
  large = study_of("");
  large.replace(large.find("count = 40"), 10, "count = 4000");
  scratch.write("large.toml", large);
  CHECK(contains(run(scratch, "sweep large.toml").err, "or detail = \"verdict\" in [sweep]"));
}

}  // namespace verdict_cli_test
