// `tiltrim prove` as a user runs it: stopped, killed, and taken up again from its log.
#include <doctest/doctest.h>
#include <fmt/core.h>
#include <signal.h>

#include <fstream>

#include "tests/check.hpp"
#include "tests/program.hpp"

using namespace program;

namespace prove_cli_test {

namespace {

const std::string prove =
    "prove " TILTRIM_SOURCE_DIR "/studies/prove_reference.toml --certificate c.proof --log c.log ";

std::string uninterrupted() {
  const Scratch scratch("prove-whole");
  const Ran ran = run(scratch, prove);
  CHECK(ran.exit_code == 1);  // refuted
  CHECK_FALSE(fs::exists(scratch.path / "c.log"));
  return slurp(scratch.path / "c.proof");
}

}  // namespace

TEST_CASE("a proof that ran out of boxes goes on with more: the same bytes") {
  const Scratch scratch("prove-boxes");
  const std::string whole = uninterrupted();
  const Ran first = run(scratch, prove + "--boxes 40 --threads 2");
  CHECK(first.exit_code == 1);
  CHECK(first.err.find("the examined boxes are in c.log") != std::string::npos);
  CHECK(slurp(scratch.path / "c.proof") != whole);
  CHECK(fs::exists(scratch.path / "c.log"));

  const Ran other = run(scratch, prove + "--margin 0.1");
  CHECK(other.exit_code == 2);
  CHECK(other.err.find("prove: margin") != std::string::npos);
  CHECK(run(scratch, prove + "--damping 0.1").exit_code == 2);
  CHECK(run(scratch, prove + "--largest-margin").exit_code == 2);

  const Ran second = run(scratch, prove);
  CHECK(second.err.find("resumed from c.log") != std::string::npos);
  CHECK(slurp(scratch.path / "c.proof") == whole);
  CHECK_FALSE(fs::exists(scratch.path / "c.log"));
}

TEST_CASE("a log without boxes resumes nothing, and the program does not say so") {
  const Scratch scratch("prove-empty-log");
  for (const char* found : {"", "t"}) {  // nothing, or the first byte of its header
    scratch.write("c.log", found);
    const Ran ran = run(scratch, prove + "--boxes 40");
    CHECK(ran.exit_code == 1);
    CHECK(ran.err.find("resumed") == std::string::npos);
  }
}

TEST_CASE("a format that prove does not write is refused before anything is computed") {
  const Scratch scratch("prove-format");
  const Ran ran = run(scratch, prove + "--format csv");
  CHECK(ran.exit_code == 2);
  CHECK(ran.err.find("--format: no 'csv'; expected json|text") != std::string::npos);
  const Ran by_name = run(scratch, prove + "-o proof.csv");
  CHECK(by_name.exit_code == 2);
  CHECK(by_name.err.find("-o proof.csv: prove writes text and json; expected .txt or .json") !=
        std::string::npos);
  CHECK(run(scratch, "prove --help").out.find("csv") == std::string::npos);
  CHECK_FALSE(fs::exists(scratch.path / "c.log"));
  CHECK_FALSE(fs::exists(scratch.path / "c.proof"));
}

TEST_CASE("a box of which nothing is decided is not partly proved") {
  const Scratch scratch("prove-nothing");
  scratch.write("s.toml", R"([model]
state = [{name = "x", rate = "p - x"}]
parameter = [{name = "p", value = -1}]
output = [{name = "lift", value = 'ln(x)'}]
[[condition]]
name = "c"
[prove]
parameter = [{key = "p", from = -2, to = -1}]
)");
  const Ran ran = run(scratch, "prove s.toml --boxes 10");
  CHECK(ran.exit_code == 1);
  CHECK(ran.out.find("  nothing proved: 10 boxes\n") != std::string::npos);
}

TEST_CASE("what is no number, no file or one file for two is refused") {
  const Scratch scratch("prove-refused");
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    CAPTURE(arguments);
    const Ran ran = run(scratch, arguments);
    CHECK(ran.exit_code == 2);
    CHECK(ran.err.find(words) != std::string::npos);
    CHECK_FALSE(fs::exists(scratch.path / "c.proof"));
  };
  refused(prove + "--margin nan", "--margin: nan is not a number from 0 to 1000");
  refused(prove + "-o c.proof", "--certificate and -o name the same file");
  refused("check-proof .", "tiltrim: .: is a directory");
  scratch.write("airframe.toml",
                "[[condition]]\nname = 'loop'\nV = 15\ngamma_deg = 0\neta_deg = 0\n"
                "[[condition]]\nname = 'air'\nformulation = 'airframe'\nV = 15\neta_deg = 0\n"
                "[prove]\nparameter = [{key = 'gains.k_V', percent = 1}]\n");
  refused("prove airframe.toml", "condition 'air': prove needs the closed loop");
}

TEST_CASE(
    "a model of more states than a proof can take is refused with the place of the condition") {
  const Scratch scratch("prove-large");
  std::string study = "[model]\nname = \"chain\"\n";
  for (int i = 0; i < 17; ++i)
    study += fmt::format("[[model.state]]\nname = \"x{0}\"\nrate = \"k - x{0}\"\n", i);
  study += "[[model.parameter]]\nname = \"k\"\nvalue = 1\n[[condition]]\nname = \"rest\"\n";
  study += "[[prove.parameter]]\nkey = \"k\"\nfrom = 1\nto = 2\n";
  std::ofstream(scratch.path / "chain.toml") << study;
  const Ran ran = run(scratch, "prove chain.toml");
  CHECK(ran.exit_code == 2);
  CHECK(ran.err ==
        "tiltrim: chain.toml:57:1: condition 'rest': 17 states and unknown inputs; at most 16\n");
}

TEST_CASE("the log has the evidence of a damping ratio too") {
  const Scratch scratch("prove-damping");
  const std::string damped = prove + "--damping 0.01 --boxes ";
  CHECK(run(scratch, damped + "60").exit_code == 1);
  CHECK(run(scratch, damped + "150").err.find("resumed from c.log") != std::string::npos);
  const std::string resumed = slurp(scratch.path / "c.proof");
  fs::remove(scratch.path / "c.log");
  CHECK(run(scratch, damped + "150").exit_code == 1);
  CHECK(slurp(scratch.path / "c.proof") == resumed);
  CHECK(run(scratch, "check-proof c.proof").exit_code == 0);
}

TEST_CASE("a proof that is killed goes on from its log: the same bytes") {
  const Scratch scratch("prove-killed");
  const std::string whole = uninterrupted();
  std::uintmax_t logged = 0;
  for (int kill = 0; kill < 3; ++kill) {
    const Running run = start(scratch, prove + "--threads 1");
    holds_soon(
        [&] { return has_ended(run) || records_in(scratch.path / "c.log") > logged + 10000; });
    ::kill(run.pid, SIGKILL);
    CHECK(finish(run).signal == SIGKILL);
    CHECK(records_in(scratch.path / "c.log") > logged);
    logged = records_in(scratch.path / "c.log");
  }
  CHECK_FALSE(fs::exists(scratch.path / "c.proof"));
  CHECK(run(scratch, prove).err.find("resumed from c.log") != std::string::npos);
  CHECK(slurp(scratch.path / "c.proof") == whole);
}

}  // namespace prove_cli_test
