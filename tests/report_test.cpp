// Sheets: what is aligned, quoted and rounded.
#include "report/sheet.hpp"
#include "tests/check.hpp"

using namespace tiltrim;

static const Sheet sheet{
    "title",
    {{"name", "name", ""}, {"angle_deg", "θ", "°", "{:.2f}"}, {"n", "n", "", "{:.0e}"}},
    {{SheetCell("a, \"b\""), SheetCell(0.1), SheetCell()},
     {SheetCell("γ"), SheetCell(-12.345), SheetCell(1e-13)}},
    {}};

TEST_CASE("text is aligned by characters, numbers to the right, words to the left") {
  CHECK(as_text(sheet) ==
        "title\n"
        "  name         θ      n\n"
        "               °\n"
        "  a, \"b\"    0.10      -\n"
        "  γ       -12.35  1e-13\n");
}

TEST_CASE("CSV quotes what needs it and keeps every digit") {
  CHECK(as_csv(sheet) ==
        "name,angle_deg,n\n"
        "\"a, \"\"b\"\"\",0.10000000000000001,\n"
        "γ,-12.345000000000001,1e-13\n");
  CHECK(std::stod("0.10000000000000001") == 0.1);
}

TEST_CASE("colour only where asked for; lines wrap by characters") {
  CHECK(toned("stable", Tone::good, {}) == "stable");
  CHECK(toned("stable", Tone::good, {.colour = true}) == "\033[32mstable\033[0m");
  CHECK(wrapped("one two three", 2, 9) == "  one two\n  three\n");
  CHECK(wrapped("", 2, 9) == "  \n");
  CHECK(wrapped("unbreakable", 2, 5) == "  unbreakable\n");
}

TEST_CASE("a minus sign never stands before a zero") {
  Sheet zero = sheet;
  zero.rows = {{SheetCell("z"), SheetCell(-0.0), SheetCell(0.0)}};
  CHECK(as_text(zero).find("-0") == std::string::npos);
  zero.rows = {{SheetCell("z"), SheetCell(-1e-20), SheetCell(0.0)}};  // of its digits none is shown
  CHECK(as_text(zero).find("-0") == std::string::npos);
}
