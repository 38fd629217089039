// tiltrim modes, and linearize --models, as a user runs them. The model files are read by other
// programs in read_models.py.
#include <algorithm>
#include <bit>
#include <complex>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "tests/check.hpp"
#include "tests/program.hpp"

namespace modes_cli_test {

namespace {

using namespace program;
using nlohmann::json;

const std::string source = TILTRIM_SOURCE_DIR;

json json_of(const Scratch& scratch, const std::string& arguments) {
  return json::parse(run(scratch, arguments + " -f json").out);
}

// Exit code 2, nothing printed, and one line on standard error with this beginning and end.
void check_refused(const Scratch& scratch, const std::string& arguments, const std::string& begin,
                   const std::string& end) {
  const Ran ran = run(scratch, arguments);
  CAPTURE(arguments);
  CAPTURE(ran.err);
  CHECK(ran.exit_code == 2);
  CHECK(ran.out.empty());
  CHECK(ran.err.starts_with("tiltrim: " + begin));
  CHECK(ran.err.ends_with(end + "\n"));
  CHECK(std::ranges::count(ran.err, '\n') == 1);
}

// The eigenvalues are those of [[0, 1], [-2, -3]]: -2 and -1.
void check_two(const Scratch& scratch, const std::string& arguments) {
  CAPTURE(arguments);
  const Ran ran = run(scratch, "modes " + arguments + " -f json");
  CAPTURE(ran.err);
  REQUIRE(ran.exit_code == 0);
  const json found = json::parse(ran.out);
  REQUIRE(found["modes"].size() == 2);
  CHECK_NEAR(found["modes"][0]["re"].get<double>(), -2.0, 1e-14);
  CHECK_NEAR(found["modes"][1]["re"].get<double>(), -1.0, 1e-14);
  CHECK(found["verdict"] == "stable");
}

// A MAT-file of version 5 by hand. "MAT-File Format", The MathWorks: elements of type, size, data.
struct Bytes {
  bool big = false;
  std::string text{};

  template <class Number>
  Bytes& add(Number value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (big) std::reverse(bytes, bytes + sizeof value);
    text.append(bytes, sizeof value);
    return *this;
  }
  Bytes& element(std::uint32_t type, const std::string& data) {
    add(type).add(std::uint32_t(data.size()));
    text += data + std::string((8 - data.size() % 8) % 8, '\0');
    return *this;
  }
};

template <class Number>
std::string packed(bool big, const std::vector<Number>& values) {
  Bytes bytes{big};
  for (const Number value : values) bytes.add(value);
  return bytes.text;
}

struct Variable {
  std::string name = "A";
  std::uint32_t flags = 6;  // class double
  std::vector<std::int32_t> size{2, 2};
  std::uint32_t type = 9;  // of the numbers: double
  std::string numbers{};   // empty: those of [[0, 1], [-2, -3]]
};

std::string mat(const std::vector<Variable>& variables, bool big = false) {
  Bytes file{big, "MATLAB 5.0 MAT-file by a test"};
  file.text.resize(124, ' ');
  file.add(std::uint16_t{0x0100}).add(std::uint16_t{0x4D49});  // read as "IM" or "MI"
  for (const Variable& v : variables) {
    const std::string numbers = v.numbers.empty() ? packed<double>(big, {0, -2, 1, -3}) : v.numbers;
    Bytes inside{big};
    inside.element(6, packed<std::uint32_t>(big, {v.flags, 0}))
        .element(5, packed(big, v.size))
        .element(1, v.name)
        .element(v.type, numbers);
    file.element(14, inside.text);
  }
  return file.text;
}

}  // namespace

TEST_CASE("a published matrix has its published eigenvalues") {
  // [2, section 6.2]: Boeing 747 in cruise. Printed to four digits.
  const Scratch scratch("modes");
  const std::string file = source + "/studies/boeing747.csv";
  const json found = json_of(scratch, "modes " + file);
  CHECK(found["states"] == json{"u", "w", "q", "theta"});
  CHECK(found["verdict"] == "stable");
  REQUIRE(found["modes"].size() == 4);
  const auto check = [&](std::size_t i, const char* name, const char* re, const char* im) {
    const json& mode = found["modes"][i];
    CHECK(mode["name"] == name);
    CHECK_NEAR(mode["re"].get<double>(), std::stod(re), printed_to(re));
    CHECK_NEAR(std::abs(mode["im"].get<double>()), std::stod(im), printed_to(im));
  };
  check(0, "short period", "-0.3719", "0.8875");
  check(1, "short period", "-0.3719", "0.8875");
  check(2, "phugoid", "-0.003289", "0.06723");
  check(3, "phugoid", "-0.003289", "0.06723");
  CHECK(found["spectral_abscissa"] == found["modes"][3]["re"]);

  const Ran text = run(scratch, "modes " + file);
  CHECK(text.exit_code == 0);
  CHECK(text.out.starts_with(file + " (4 states): stable\n"));
  CHECK(text.out.find("-0.3719 ± 0.8875i") != text.out.npos);
  const std::vector<Row> rows = csv_of(run(scratch, "modes " + file + " -f csv").out);
  REQUIRE(rows.size() == 5);
  CHECK(rows[0] == Row{"verdict", "re", "im", "error", "frequency", "damping", "time_to_half",
                       "condition", "backward_error", "mode"});
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(rows[i + 1][0] == "stable");
    CHECK(std::stod(rows[i + 1][1]) == found["modes"][i]["re"].get<double>());
    CHECK(std::stod(rows[i + 1][2]) == found["modes"][i]["im"].get<double>());
    CHECK(rows[i + 1][9] == found["modes"][i]["name"]);
  }
  CHECK(run(scratch, "modes " + file + " -o out.txt").out.empty());
  CHECK(slurp(scratch.path / "out.txt") == text.out);
}

TEST_CASE("numbers are read however they are set apart") {
  const Scratch scratch("modes");
  for (const char* const text :
       {"0,1\n-2,-3\n", "0;1\n-2;-3\n", "0\t1\n-2\t-3\n", "0 1\n-2 -3\n", "  0   1\n -2 \t-3",
        "\xEF\xBB\xBF# by hand\r\n\r\n0, 1\r\n  # between\r\n-2e0 , -3.0\r\n", "+0,1.\n-20E-1,-3\n",
        "a,b\n0,1\n-2,-3\n", "\"0\",\"1\"\n\"-2\",\"-3\"\n", "[[0, 1], [-2, -3.0]]",
        "\n {\"A\": [[0, 1], [-2, -3]], \"other\": 1}"}) {
    scratch.write("A.txt", text);
    check_two(scratch, "A.txt");
    check_two(scratch, "- < A.txt");
  }
  scratch.write("A.json", "{\"B\": [[0, 1], [-2, -3]]}");
  check_two(scratch, "A.json --variable B");
  scratch.write("one", "-0.5");
  CHECK(json_of(scratch, "modes one")["modes"][0]["re"] == -0.5);
}

TEST_CASE("states are named by the file, by --states, or by number") {
  const Scratch scratch("modes");
  const std::string numbers = "0,1\n-2,-3\n";
  scratch.write("named.csv", "\"say \"\"a\"\", b\", α\n" + numbers);
  CHECK(json_of(scratch, "modes named.csv")["states"] == json{"say \"a\", b", "α"});
  scratch.write("plain.csv", numbers);
  CHECK(json_of(scratch, "modes plain.csv")["states"] == json{"x1", "x2"});
  CHECK(json_of(scratch, "modes named.csv --states theta,q")["states"] == json{"theta", "q"});
  check_refused(scratch, "modes plain.csv --states a,b,c",
                "--states: 3 names of states; expected 2", "one for each row");
  check_refused(scratch, "modes plain.csv --states a,a", "--states: 'a' names two states", "once");
  scratch.write("named.csv", "a,b\x1b[31m\n" + numbers);
  check_refused(scratch, "modes named.csv", "named.csv: state 'b?[31m' has a control character",
                "printable text");
  scratch.write("named.csv", "a,a\n" + numbers);
  check_refused(scratch, "modes named.csv", "named.csv: 'a' names two states", "once");
}

TEST_CASE("bounds of the entries decide whether a verdict can be given: exit codes") {
  const Scratch scratch("modes");
  scratch.write("A.csv", "-0.1,1\n-1,-0.1\n");
  scratch.write("small.csv", "0.01,0\n0,0.01\n");
  scratch.write("large.csv", "0.2,0\n0,0.2\n");
  scratch.write("unstable.csv", "0.1,1\n-1,0.1\n");
  CHECK(run(scratch, "modes A.csv").exit_code == 0);
  CHECK(run(scratch, "modes unstable.csv").exit_code == 0);
  const json exact = json_of(scratch, "modes A.csv"),
             small = json_of(scratch, "modes A.csv --error small.csv");
  CHECK(small["verdict"] == "stable");
  // Of this normal matrix an eigenvalue moves by no more than the error's size, and may by as much.
  CHECK(exact["modes"][0]["error"].get<double>() < 1e-14);
  CHECK(small["modes"][0]["error"].get<double>() >= 0.01);
  CHECK(small["modes"][0]["error"].get<double>() <= 0.0201);
  const Ran undecided = run(scratch, "modes A.csv --error large.csv");
  CHECK(undecided.exit_code == 1);
  CHECK(undecided.out.find("; the axis") != undecided.out.npos);
  CHECK(json_of(scratch, "modes A.csv --error - < large.csv")["verdict"] == "undecided");
  scratch.write("both.json", R"({"A": [[-1]], "A_error": [[2]]})");
  CHECK(json_of(scratch, "modes both.json --error both.json")["verdict"] == "undecided");

  scratch.write("negative.csv", "0.1,0\n0,-0.1\n");
  scratch.write("three.csv", "1,0,0\n0,1,0\n0,0,1\n");
  check_refused(scratch, "modes A.csv --error negative.csv",
                "negative.csv:2:3: '-0.1' is below zero", "bounds that are not negative");
  check_refused(scratch, "modes A.csv --error three.csv", "three.csv: 3 x 3 bounds; expected 2 x 2",
                "as the matrix");
  check_refused(scratch, "modes - --error - < A.csv", "--error: standard input", "a file");
  scratch.write("a.csv", "a,b\n1,0\n0,1\n");
  scratch.write("b.csv", "b,a\n1,0\n0,1\n");
  check_refused(scratch, "modes a.csv --error b.csv", "b.csv: its states have other names",
                "the names of the matrix");
}

TEST_CASE("what is not a matrix is refused with its place") {
  const Scratch scratch("modes");
  const auto check = [&](const std::string& text, const std::string& begin,
                         const std::string& end) {
    CAPTURE(text);
    scratch.write("A.csv", text);
    check_refused(scratch, "modes A.csv", "A.csv" + begin, end);
  };
  check("", ": an empty matrix", "numbers");
  check("# nothing\n\n", ":2:1: an empty matrix", "numbers");
  check("a,b\n", ":1:1: an empty matrix", "numbers");
  check("1,2\n", ":1:1: 1 row of 2 numbers", "as many rows as columns");
  check("1,2\n3,4\n5,6\n", ":3:1: row 3 of 2 numbers", "as many rows as columns");
  check("1,2\n3\n", ":2:2: 1 number; expected 2 numbers", "in the first line");
  check("1,2\n3,4,5\n", ":2:5: 3 numbers; expected 2 numbers", "in the first line");
  check("1,2\n3,x\n", ":2:3: 'x' is not a number", "a number, as -1.5e-3");
  check("1,x\n3,4\n", ":1:3: 'x' is not a number", "a number, as -1.5e-3");
  check("1,2\n3,\n", ":2:3: nothing", "a number, as -1.5e-3");
  check("1,2\n3,nan\n", ":2:3: 'nan' is not finite or exceeds the range of a double",
        "a finite number");
  check("1,2\n-inf,4\n", ":2:1: '-inf' is not finite or exceeds the range of a double",
        "a finite number");
  check("1,2\n3,1e999\n", ":2:3: '1e999' is not finite or exceeds the range of a double",
        "a finite number");
  check("1,5;2\n3;4\n", ":1:1: '1,5' is not a number", "a number, as -1.5e-3");
  check("1,2i\n3,4\n", ":1:3: '2i' is not a number", "a number, as -1.5e-3");
  check("1,\"2\n3,4\n", ":1:3: a quote that is not closed", "\"");
  check("1,\"2\"3\n", ":1:6: text after a closing quote", "the next field");
  check(std::string("1,\0\x1b[31m\n", 10), ":1:3: '??[31m' is not a number", "as -1.5e-3");
  check("α,β\n1,é\n", ":2:3: 'é' is not a number", "a number, as -1.5e-3");
  check("1,2\n3," + std::string(100000, '4') + "x", ":2:3: '444444444444444444444444...'",
        "a number, as -1.5e-3");
  std::string wide = "1";
  for (int i = 0; i < 1000; ++i) wide += ",1";
  check(wide, ":1:1: 1001 fields", "at most 1000 x 1000 numbers");
  CHECK(run(scratch, "modes A.csv -o kept").exit_code == 2);
  CHECK(!fs::exists(scratch.path / "kept"));
}

TEST_CASE("what is no JSON matrix is refused") {
  const Scratch scratch("modes");
  const auto check = [&](const std::string& text, const std::string& begin,
                         const std::string& end) {
    CAPTURE(text.substr(0, 100));
    scratch.write("A.json", text);
    check_refused(scratch, "modes A.json", "A.json" + begin, end);
  };
  check("", ":1:1: is not JSON here", "a list of lists of numbers");
  check("[[1, 2],\n [3, 4]", ":2:8: is not JSON here", "a list of lists of numbers");
  check("[[1, 2], [3, NaN]]", ":1:14: is not JSON here", "a list of lists of numbers");
  check("[]", ": an empty matrix", "numbers");
  check("[[]]", ": an empty matrix", "numbers");
  check("[1, 2]", ": row 1: not a list; expected 2 numbers", "");
  check("3", ": is not a matrix", "a list of lists of numbers");
  check("[[1, 2]]", ": 1 row of 2 numbers", "as many rows as columns");
  check("[[1, 2], [3]]", ": row 2: 1 number; expected 2 numbers", "");
  check("[[1, 2], [3, null]]", ": row 2, column 2: 'null' is not a number", "a number");
  check("[[1, 2], [3, [4]]]", ": row 2, column 2: 'a list' is not a number", "a number");
  check("[[1, 2], [3, 1e999]]", ": has a number that exceeds the range of a double",
        "finite numbers");
  check("{\"B\": [[1]]}", ": has no 'A'; expected one of 'B'", "(--variable)");
  check("{}", ": has no 'A'", "an object with a matrix");
  check(std::string(1'000'000, '['), ": is nested too deeply", "a list of lists of numbers");
  std::string empty_lists = "[";
  for (int i = 0; i < 2'000'100; ++i) empty_lists += "[],";
  check(empty_lists, ": has too many values", "a list of lists of numbers");
}

TEST_CASE("MAT-files: every class of number, both orders of bytes") {
  const Scratch scratch("modes");
  for (const bool big : {false, true}) {
    CAPTURE(big);
    const auto check = [&](const std::vector<Variable>& variables, const std::string& more = "") {
      scratch.write("A.mat", mat(variables, big));
      check_two(scratch, "A.mat" + more);
    };
    check({{}});
    check({{"other"}, {"A"}});
    check({{"A"}, {"B", 6, {1, 1}, 9, packed<double>(big, {7})}});
    check({{"B"}}, " --variable B");
    check({{"A", 7, {2, 2}, 7, packed<float>(big, {0, -2, 1, -3})}});
    check({{"A", 6, {2, 2}, 1, packed<std::int8_t>(big, {0, -2, 1, -3})}});  // doubles, saved short
    check({{"A", 10, {2, 2}, 3, packed<std::int16_t>(big, {0, -2, 1, -3})}});
    check({{"A", 12, {2, 2}, 5, packed<std::int32_t>(big, {0, -2, 1, -3})}});
    check({{"A", 14, {2, 2}, 12, packed<std::int64_t>(big, {0, -2, 1, -3})}});
  }
}

TEST_CASE("MAT-files that hold no such matrix are refused") {
  const Scratch scratch("modes");
  const auto check = [&](const std::string& bytes, const std::string& begin,
                         const std::string& end) {
    scratch.write("A.mat", bytes);
    check_refused(scratch, "modes A.mat", "A.mat: " + begin, end);
  };
  const char* const full = "a full matrix of real numbers";
  check("", "is not a MAT-file of version 5", "save -v7");
  check("1,2\n3,4\n", "is not a MAT-file of version 5", "save -v7");
  check("\x89HDF\r\n\x1a\n", "is an HDF5 file", "save -v7");
  std::string newer = mat({{}});
  newer[125] = 2;
  check(newer, "is a MAT-file of version 7.3", "save -v7");
  newer[125] = 3;
  check(newer, "is not a MAT-file of version 5", "save -v7");
  check(mat({}), "has no variable 'A'", "a matrix");
  check(mat({{"B"}, {"evil\x1b[31m"}}), "has no variable 'A'; expected one of 'B', 'evil?[31m'",
        "(--variable)");
  check(mat({{"A", 1}}), "variable 'A': is a cell array", full);
  check(mat({{"A", 2}}), "variable 'A': is a struct", full);
  check(mat({{"A", 4}}), "variable 'A': is text", full);
  check(mat({{"A", 5}}), "variable 'A': is sparse", "as full(A)");
  check(mat({{"A", 17}}), "variable 'A': has no numbers", full);
  check(mat({{"A", 6 | 0x0800}}), "variable 'A': is complex", full);
  check(mat({{"A", 6, {2, 2, 1}}}), "variable 'A': has 3 dimensions", "two");
  check(mat({{"A", 6, {1, 4}}}), "variable 'A': 1 row of 4 numbers", "as many rows as columns");
  check(mat({{"A", 6, {0, 0}}}), "variable 'A': an empty matrix", "numbers");
  check(mat({{"A", 6, {1001, 1001}}}), "variable 'A': 1001 x 1001 numbers", "1000 x 1000");
  check(mat({{"A", 6, {3, 3}}}), "variable 'A': its numbers are truncated", "9 of them");
  check(mat({{"A", 6, {2, 2}, 14}}), "variable 'A': its numbers are truncated", "4 of them");
  const double nan = std::nan("");
  check(mat({{"A", 6, {2, 2}, 9, packed<double>(false, {0, -2, nan, -3})}}),
        "variable 'A', row 1, column 2: nan is not finite", "a finite number");
  check(mat({{"A", 6, {-1, 2}}}), "has no variable 'A'", "a matrix");
}

TEST_CASE("MAT-files truncated or damaged anywhere never crash, and cut off they are refused") {
  const Scratch scratch("modes");
  const std::string whole = mat({{"other"}, {"A"}});
  for (std::size_t size = 0; size + 1 < whole.size(); size += sanitized ? 97 : 7) {
    CAPTURE(size);
    scratch.write("A.mat", whole.substr(0, size));
    const Ran ran = run(scratch, "modes A.mat");
    CHECK(ran.exit_code == 2);
    CHECK(ran.err.starts_with("tiltrim: A.mat"));
  }
  for (std::size_t at = 128; at < whole.size(); at += sanitized ? 29 : 3) {
    CAPTURE(at);
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ (at % 2 == 0 ? 0xFF : 0x01));
    scratch.write("A.mat", damaged);
    CHECK(run(scratch, "modes A.mat").exit_code >= 0);  // else a signal ended it
  }
}

TEST_CASE("files that cannot be read are refused") {
  const Scratch scratch("modes");
  check_refused(scratch, "modes none.csv", "none.csv: No such file", "directory");
  fs::create_directory(scratch.path / "folder.csv");
  check_refused(scratch, "modes folder.csv", "folder.csv: Is a directory", "");
  check_refused(scratch, "modes /dev/zero", "/dev/zero: is too large", "at most 64 MB");
  check_refused(scratch, "modes", "A.csv is missing; expected 'tiltrim modes A.csv'",
                "'tiltrim modes --help'");
  scratch.write("A.csv", "-1\n");
  check_refused(scratch, "modes A.csv -o A.csv", "A.csv: -o and", "expected two files");
  check_refused(scratch, "modes A.csv --error E.csv -o E.csv", "E.csv: -o and --error",
                "expected two files");
  check_refused(scratch, "modes A.csv --variable B", "--variable: A.csv has one matrix",
                "a MAT-file or a JSON object");
  CHECK(slurp(scratch.path / "A.csv") == "-1\n");
  scratch.write("zero.csv", "0\n");  // which has no damping ratio
  CHECK(run(scratch, "modes zero.csv").out.find("  0.0000        0e+00     0.0000  - ") !=
        std::string::npos);
  CHECK(run(scratch, "modes --help").out.find("--variable") != std::string::npos);
}

TEST_CASE("the modes of a linear model's A are the condition's") {
  const Scratch scratch("modes");
  const json all = json_of(scratch, "linearize " + source + "/studies/paper.toml");
  for (const json& condition : all["conditions"]) {
    scratch.write("linear.json", condition["linear"].dump());
    const json again = json_of(scratch, "modes linear.json --error linear.json");
    CHECK(again["states"] == condition["linear"]["states"]);
    CHECK(again["modes"] == condition["modes"]);
    CHECK(again["verdict"] == condition["verdict"]);
  }
}

namespace {

std::string condition(const std::string& name, double V, double gamma_deg = 0) {
  return fmt::format("[[condition]]\nname = \"{}\"\nV = {}\ngamma_deg = {}\neta_deg = 0.0\n", name,
                     V, gamma_deg);
}

}  // namespace

TEST_CASE("--models leaves out what has no linear model, and says so") {
  const Scratch scratch("modes");
  scratch.write("study.toml", condition("level", 15) + condition("too steep", 60, 80));
  const Ran ran = run(scratch,
                      "linearize study.toml --models all.json --models all.mat "
                      "--models all.csv --models all.py");
  CHECK(ran.exit_code == 1);
  CHECK(ran.out.ends_with("too steep is left out of the models: no equilibrium: infeasible.\n"));
  CHECK(scratch.files() ==
        std::set<std::string>{"all.csv", "all.json", "all.mat", "all.py", "study.toml"});
  const json models = json::parse(slurp(scratch.path / "all.json"));
  REQUIRE(models["models"].size() == 1);
  CHECK(models["models"][0]["name"] == "level");
  REQUIRE(models["left_out"].size() == 1);
  CHECK(models["left_out"][0] ==
        json{{"name", "too steep"}, {"why", "no equilibrium: infeasible"}});
  // Machine-readable output is unchanged.
  const std::string level = "linearize study.toml --only level -f json";
  CHECK(run(scratch, level + " --models all.json").out == run(scratch, level).out);
  // The same input gives the same bytes; --only chooses.
  const std::string once = slurp(scratch.path / "all.mat");
  CHECK(run(scratch, "linearize study.toml --only level --models all.mat").exit_code == 0);
  CHECK(slurp(scratch.path / "all.mat") == once);
}

TEST_CASE("--models that cannot be are refused before any work") {
  const Scratch scratch("modes");
  scratch.write("study.toml", condition("level", 15));
  const std::string begin = "linearize study.toml --models ";
  check_refused(scratch, begin + "all.xls", "--models: 'all.xls' has an unknown ending;",
                "expected .mat, .json, .csv or .py");
  check_refused(scratch, begin + "all", "--models: 'all' has an unknown ending;",
                "expected .mat, .json, .csv or .py");
  check_refused(scratch, begin + "a.csv --models ./a.csv", "./a.csv: --models and another",
                "expected two files");
  check_refused(scratch, begin + "a.csv -o a.csv", "a.csv: --models and -o", "expected two files");
  check_refused(scratch, begin + "none/a.mat", "none: No such file or directory",
                "before a.mat is written to it");
  fs::create_symlink("study.toml", scratch.path / "study.csv");
  check_refused(scratch, begin + "study.csv", "study.csv: --models and the study",
                "expected two files");
  CHECK(scratch.files() == std::set<std::string>{"study.toml", "study.csv"});
}

}  // namespace modes_cli_test
