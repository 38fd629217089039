#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <thread>

#include "sweep/difference.hpp"
#include "sweep/map.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"
#include "tests/forged_map.hpp"

using namespace tiltrim;
namespace fs = std::filesystem;

namespace map_file_test {

namespace {

using Text = std::string;

std::size_t files_in(const fs::path& folder) {
  return std::size_t(std::distance(fs::directory_iterator(folder), {}));
}

constexpr double undefined = std::numeric_limits<double>::quiet_NaN();

SweepAxis::Column column(const Text& name, const Text& unit, std::vector<double> values,
                         double to_si = 1.0) {
  SweepAxis::Column column{name, unit, name, values, {}};
  for (double value : values) column.si.push_back(value * to_si);
  return column;
}

// 2 conditions, 3 x 4 points, 3 states. Eigenvalue m of point p is -(1 + p/8 + m/64) + p i, exact
// in binary; there is no equilibrium at point 5 and point 23 was not reached.
SweepMap planted_map() {
  SweepMap map;
  map.study = "# a study\n[[condition]]\nname = \"level\"\n";
  map.program = "tiltrim 0.1.0";
  map.instruction_set = "fma";
  map.polar = "0123456789abcdef";
  map.conditions = {"level", "climb at η = 45°, \"steep\""};
  map.axes = {{"K_Lp", {column("gains.K_Lp", "", {0.1, 0.2, 0.4})}},
              {"eta_deg",
               {column("eta_deg", "degrees", {0, 30, 60, 90}, 0.017453292519943295),
                column("V", "m/s", {15, 12.5, 10, 7.5})}}};
  map.states = {{"V_err", "m/s", 10}, {"q", "rad/s", 1}, {"theta", "rad", 0.1}};
  map.inputs = {{"theta0", "rad", 0.1}, {"delta_e", "rad", 0.25}};
  map.mode_names = {{"short period", "short period", "phugoid"}, {"a", "", "b+c"}};
  map.reasons = {"", "no lift: δₑ at its limit"};
  for (std::size_t p = 0; p < map.points(); ++p) {
    const bool none = p == 5 || p == 23;
    map.status.push_back(p == 5 ? std::int8_t(TrimStatus::infeasible) : p == 23 ? -1 : 0);
    map.verdict.push_back(none ? -1 : std::int8_t(p % 3));
    map.reason.push_back(p == 5);
    map.residual.push_back(none ? undefined : 1e-13 / double(p + 1));
    map.spectral_abscissa.push_back(none ? undefined : -1.0 - double(p) / 8);
    map.damping.push_back(none ? undefined : 1.0 / 3);
    map.second_branch.push_back(p == 7);
    for (int k = 0; k < 3; ++k) {
      map.state.push_back(none ? undefined : 0.1 * double(p) + k);
      map.eigenvalue_re.push_back(none ? undefined : -(1 + double(p) / 8 + k / 64.0));
      map.eigenvalue_im.push_back(none ? undefined : double(p));
      map.confidence.push_back(std::uint8_t(255 - 10 * k));
    }
    for (int k = 0; k < 2; ++k) map.input.push_back(none ? undefined : std::sqrt(double(p) + k));
  }
  map.second = {{7}, {1, 2, 3}, {4, 5}, {-1, -2, 0.25}, {0, 0, 0}, {1}};
  map.crossings = {{0, 1, {0.2, 41.25}, 1e-9, CrossingKind::hopf, 0, 2, 3.5, 2, "phugoid"},
                   {1, 0, {0.15, 60}, 1e-12, CrossingKind::zero, 1, 0, 0.0, -1, ""}};
  map.intervals = {{1, 0, {0.1, 60}, 0.1, 0.15, IntervalVerdict::unstable, 1, 0.5, 0.125},
                   {1, 0, {0.1, 60}, 0.15, 0.4, IntervalVerdict::undecided, 0, -1e-17, 0.15}};
  return map;
}

// Random sizes, contents and names; every list may be empty that may.
SweepMap random_map(unsigned seed) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::size_t n) { return std::size_t(random() % n); };
  const auto number = [&] {
    const std::uint64_t bits = random();  // any bits: NaNs of all kinds, subnormal, infinite
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  };
  const auto doubles = [&](std::size_t n) {
    std::vector<double> values(n);
    std::ranges::generate(values, number);
    return values;
  };
  const auto word = [&] {
    Text text;
    for (std::size_t k = below(6); k > 0; --k) text += "aZ_.9 \"\\é"[below(8)];
    return text + "é";
  };
  const auto words = [&](std::size_t n) {
    std::vector<Text> texts(n);
    std::ranges::generate(texts, word);
    return texts;
  };
  SweepMap map;
  map.study = below(3) == 0 ? "" : word();
  map.program = word();
  map.instruction_set = word();
  map.polar = below(3) == 0 ? "" : word();
  map.conditions = words(1 + below(3));
  for (std::size_t a = below(4); a > 0; --a) {
    SweepAxis axis{word(), {}};
    const std::size_t size = 1 + below(5);
    for (std::size_t c = 1 + below(3); c > 0; --c)
      axis.columns.push_back({word(), word(), word(), doubles(size), doubles(size)});
    map.axes.push_back(axis);
  }
  for (std::size_t k = below(5); k > 0; --k) map.states.push_back({word(), word(), number()});
  for (std::size_t k = below(3); k > 0; --k) map.inputs.push_back({word(), word(), number()});
  const std::size_t n = map.states.size(), points = map.points();
  for (std::size_t k = 0; k < map.conditions.size(); ++k) map.mode_names.push_back(words(n));
  // Any number from `least` on for which a list of `size` has room.
  const auto positions = [&](auto& array, std::size_t count, std::size_t size, int least = 0) {
    array.resize(count);
    for (auto& value : array)
      value = static_cast<std::decay_t<decltype(value)>>(int(below(size + std::size_t(-least))) +
                                                         least);
  };
  positions(map.status, points, std::size_t(TrimStatus::interrupted) + 1, -1);
  positions(map.verdict, points, std::size_t(Verdict::undecided) + 1, -1);
  positions(map.second_branch, points, 2);
  positions(map.confidence, points * n, 256);
  map.reasons = words(1 + below(3));
  positions(map.reason, points, map.reasons.size());
  for (auto* array : {&map.residual, &map.spectral_abscissa, &map.damping})
    *array = doubles(points);
  for (auto* array : {&map.state, &map.eigenvalue_re, &map.eigenvalue_im})
    *array = doubles(points * n);
  map.input = doubles(points * map.inputs.size());
  const std::size_t second = below(4), axes = map.axes.size();
  positions(map.second.points, second, points);
  positions(map.second.verdict, second, std::size_t(Verdict::undecided) + 1, -1);
  for (auto* array : {&map.second.state, &map.second.eigenvalue_re, &map.second.eigenvalue_im})
    *array = doubles(second * n);
  map.second.input = doubles(second * map.inputs.size());
  const auto condition = [&] { return int(below(map.conditions.size())); };
  for (std::size_t k = axes > 0 ? below(4) : 0; k > 0; --k)
    map.crossings.push_back({condition(), int(below(axes)), doubles(axes), number(),
                             CrossingKind(below(5)), int(random()), int(random()), number(),
                             int(below(n + 1)) - 1, word()});
  for (std::size_t k = axes > 0 ? below(4) : 0; k > 0; --k)
    map.intervals.push_back({condition(), int(below(axes)), doubles(axes), number(), number(),
                             IntervalVerdict(below(4)), int(random()), number(), number()});
  return map;
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return false;
  if constexpr (std::is_arithmetic_v<T>)
    return a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
  return false;
}
bool same(double a, double b) { return same(std::vector{a}, std::vector{b}); }
bool same(const std::vector<Text>& a, const std::vector<Text>& b) { return a == b; }
bool same(const Signals& a, const Signals& b) {
  return std::ranges::equal(a, b, [](const Signal& x, const Signal& y) {
    return x.name == y.name && x.unit == y.unit && same(x.nominal, y.nominal);
  });
}
bool same(const std::vector<SweepAxis>& a, const std::vector<SweepAxis>& b) {
  return std::ranges::equal(a, b, [](const SweepAxis& x, const SweepAxis& y) {
    return x.name == y.name && std::ranges::equal(x.columns, y.columns, [](auto& c, auto& d) {
             return c.name == d.name && c.unit == d.unit && c.signal == d.signal &&
                    same(c.values, d.values) && same(c.si, d.si);
           });
  });
}
bool same(const std::vector<AxisCrossing>& a, const std::vector<AxisCrossing>& b) {
  return std::ranges::equal(a, b, [](const AxisCrossing& x, const AxisCrossing& y) {
    return x.condition == y.condition && x.axis == y.axis && same(x.at, y.at) &&
           same(x.error, y.error) && x.kind == y.kind && x.unstable_before == y.unstable_before &&
           x.unstable_after == y.unstable_after && same(x.frequency, y.frequency) &&
           x.mode == y.mode && x.mode_name == y.mode_name;
  });
}
bool same(const std::vector<AxisInterval>& a, const std::vector<AxisInterval>& b) {
  return std::ranges::equal(a, b, [](const AxisInterval& x, const AxisInterval& y) {
    return x.condition == y.condition && x.axis == y.axis && same(x.at, y.at) &&
           same(x.from, y.from) && same(x.to, y.to) && x.verdict == y.verdict &&
           x.unstable == y.unstable && same(x.abscissa, y.abscissa) &&
           same(x.abscissa_at, y.abscissa_at);
  });
}

// The names of the fields that differ; empty if the maps are equal bit for bit.
Text what_differs(const SweepMap& a, const SweepMap& b) {
  Text differ;
  const auto compare = [&](const char* name, bool equal) {
    if (!equal) differ += Text(name) + " ";
  };
  compare("study", a.study == b.study);
  compare("program", a.program == b.program);
  compare("instruction_set", a.instruction_set == b.instruction_set);
  compare("polar", a.polar == b.polar);
  compare("conditions", same(a.conditions, b.conditions));
  compare("axes", same(a.axes, b.axes));
  compare("states", same(a.states, b.states));
  compare("inputs", same(a.inputs, b.inputs));
  compare("mode_names", a.mode_names == b.mode_names);
  compare("status", same(a.status, b.status));
  compare("verdict", same(a.verdict, b.verdict));
  compare("reason", same(a.reason, b.reason));
  compare("reasons", same(a.reasons, b.reasons));
  compare("residual", same(a.residual, b.residual));
  compare("spectral_abscissa", same(a.spectral_abscissa, b.spectral_abscissa));
  compare("damping", same(a.damping, b.damping));
  compare("state", same(a.state, b.state));
  compare("input", same(a.input, b.input));
  compare("eigenvalue_re", same(a.eigenvalue_re, b.eigenvalue_re));
  compare("eigenvalue_im", same(a.eigenvalue_im, b.eigenvalue_im));
  compare("confidence", same(a.confidence, b.confidence));
  compare("second_branch", same(a.second_branch, b.second_branch));
  compare("second.points", same(a.second.points, b.second.points));
  compare("second.state", same(a.second.state, b.second.state));
  compare("second.input", same(a.second.input, b.second.input));
  compare("second.eigenvalue_re", same(a.second.eigenvalue_re, b.second.eigenvalue_re));
  compare("second.eigenvalue_im", same(a.second.eigenvalue_im, b.second.eigenvalue_im));
  compare("second.verdict", same(a.second.verdict, b.second.verdict));
  compare("crossings", same(a.crossings, b.crossings));
  compare("intervals", same(a.intervals, b.intervals));
  return differ;
}

// The contents of a map after writing and reading.
SweepMap through_a_file(const SweepMap& map) {
  const Folder folder;
  write_netcdf(map, folder.path / "map.nc");
  return read_netcdf(folder.path / "map.nc");
}

}  // namespace

TEST_CASE("points are numbered over condition, first axis, ..., last axis, the last fastest") {
  const SweepMap map = planted_map();
  CHECK(map.points_per_condition() == 12);
  CHECK(map.points() == 24);
  CHECK(map.modes() == 3);
  CHECK(map.position(0) == std::vector<std::size_t>{0, 0, 0});
  CHECK(map.position(3) == std::vector<std::size_t>{0, 0, 3});
  CHECK(map.position(4) == std::vector<std::size_t>{0, 1, 0});
  CHECK(map.position(23) == std::vector<std::size_t>{1, 2, 3});
}

TEST_CASE("words of the enumerators") {
  CHECK(to_string(CrossingKind::zero) == "zero");
  CHECK(to_string(CrossingKind::hopf) == "hopf");
  CHECK(to_string(CrossingKind::jump) == "jump");
  CHECK(to_string(CrossingKind::touch) == "touch");
  CHECK(to_string(CrossingKind::end) == "end");
  CHECK(to_string(IntervalVerdict::stable) == "stable");
  CHECK(to_string(IntervalVerdict::unstable) == "unstable");
  CHECK(to_string(IntervalVerdict::no_trim) == "no_trim");
  CHECK(to_string(IntervalVerdict::undecided) == "undecided");
}

TEST_CASE("what is written is read, bit for bit, and kept for other readers") {
  // tests/read_map.py reads this file with an independent NetCDF library.
  const fs::path file = "map_file_test.nc";
  const SweepMap map = planted_map();
  write_netcdf(map, file);
  CHECK(what_differs(read_netcdf(file), map) == "");
  CHECK((fs::status(file).permissions() & fs::perms::owner_all) ==
        (fs::perms::owner_read | fs::perms::owner_write));
}

TEST_CASE("random maps: written, read and written again they are the same bytes") {
  const fs::path memory = "/dev/shm";  // if available: syncing to a disk dominates the time
  const Folder folder(::access(memory.c_str(), W_OK) == 0 ? memory : fs::temp_directory_path());
  const fs::path first = folder.path / "1.nc", again = folder.path / "2.nc";
  for (unsigned seed = 0; seed < unsigned(trials(150)); ++seed) {
    const SweepMap map = random_map(seed);
    write_netcdf(map, first);
    const SweepMap read = read_netcdf(first);
    REQUIRE(what_differs(read, map) == "");
    write_netcdf(read, again);
    REQUIRE(contents(first) == contents(again));
  }
}

TEST_CASE("the same map gives the same bytes, at another time, too") {
  const Folder folder;
  write_netcdf(planted_map(), folder.path / "1.nc");
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // a clock in it would show
  write_netcdf(planted_map(), folder.path / "2.nc");
  CHECK(contents(folder.path / "1.nc") == contents(folder.path / "2.nc"));
  CHECK_FALSE(contains(contents(folder.path / "1.nc"), folder.path.string()));
}

TEST_CASE("large maps: what repeats takes little, what varies is kept exactly") {
  SweepMap map = planted_map();
  map.conditions.resize(1);
  map.mode_names.resize(1);
  map.crossings.pop_back();
  map.intervals.clear();
  map.axes[0].columns[0] = column("gains.K_Lp", "", std::vector<double>(300, 0.5));
  map.axes[1].columns = {column("eta_deg", "degrees", std::vector<double>(200, 45), 0.017)};
  const std::size_t points = map.points();
  REQUIRE(points == 60000);
  map.status.assign(points, 0);
  map.verdict.assign(points, 1);
  map.reason.assign(points, 0);
  map.second_branch.assign(points, 0);
  map.residual.assign(points, 1e-15);
  map.spectral_abscissa.assign(points, undefined);
  map.damping.assign(points, 0.1);
  map.state.clear();
  map.eigenvalue_im.assign(points * 3, 0.0);
  map.eigenvalue_re.clear();
  map.confidence.assign(points * 3, 255);
  map.input.assign(points * 2, 0.25);
  for (std::size_t k = 0; k < points * 3; ++k) {
    map.state.push_back(double(k % 3) + 0.1);
    map.eigenvalue_re.push_back(std::sin(double(k)));
  }
  const Folder folder;
  write_netcdf(map, folder.path / "map.nc");
  CHECK(what_differs(read_netcdf(folder.path / "map.nc"), map) == "");
  // Of 7.2 MB, 1.44 MB vary.
  CHECK(double(fs::file_size(folder.path / "map.nc")) < 1.05 * 1.44e6 + 100e3);
}

TEST_CASE("long texts and none, one point, no axis") {
  SweepMap map = planted_map();
  map.study.assign(300'000, 'x');
  map.study += '\n';
  CHECK(through_a_file(map).study == map.study);
  map.study = "";
  CHECK(through_a_file(map).study.empty());

  SweepMap point;
  point.conditions = {"only"};
  point.mode_names = {{}};
  point.status = {5};
  point.verdict = {-1};
  point.reason = {0};
  point.reasons = {""};
  point.residual = point.spectral_abscissa = point.damping = std::vector{undefined};
  point.second_branch = {0};
  CHECK(what_differs(through_a_file(point), point) == "");
}

TEST_CASE("names of axes that the file has for something else are numbered") {
  SweepMap map = planted_map();
  map.axes[0].name = map.axes[0].columns[0].name = "mode";
  map.axes[1].columns = {
      column("eta_deg", "degrees", {0, 1, 2, 3}, 0.1), column("gains.V", "m/s", {0, 1, 2, 3}),
      column("aircraft.V", "m/s", {0, 1, 2, 4}), column("eta_deg_si", "", {0, 1, 2, 4}),
      column("status", "", {0, 1, 2, 4})};
  CHECK(what_differs(through_a_file(map), map) == "");
  const Folder folder;
  write_netcdf(map, folder.path / "map.nc");
  const Text bytes = contents(folder.path / "map.nc");
  for (const char* name : {"mode_2", "V_2", "status_2", "eta_deg_si_2"})
    CHECK(contains(bytes, Text(name) + '\0'));
}

TEST_CASE("a map that does not fit itself is refused by name") {
  const auto why = [](const auto& spoil) {
    SweepMap map = planted_map();
    spoil(map);
    const Folder folder;
    const Text text =
        refusal<std::invalid_argument>([&] { write_netcdf(map, folder.path / "map.nc"); });
    CHECK(files_in(folder.path) == 0);
    return text;
  };
  CHECK(why([](SweepMap& map) { map.status.pop_back(); }) ==
        "write_netcdf: 23 numbers in status for a map of 24");
  CHECK(contains(why([](SweepMap& map) { map.confidence.clear(); }), "0 numbers in confidence"));
  CHECK(
      contains(why([](SweepMap& map) { map.mode_names[1].pop_back(); }), "5 numbers in mode_name"));
  CHECK(contains(why([](SweepMap& map) { map.crossings[0].at.pop_back(); }), "in crossing_at"));
  CHECK(contains(why([](SweepMap& map) { map.second.input.push_back(1); }), "in second_input"));
  CHECK(contains(why([](SweepMap& map) { map.axes[1].columns[1].values.pop_back(); }), "in V"));
  CHECK(contains(why([](SweepMap& map) { map.axes[0].columns[0].si.pop_back(); }), "in K_Lp_si"));
}

TEST_CASE("cut off anywhere, it is refused") {
  const Folder folder;
  const fs::path file = folder.path / "map.nc";
  write_netcdf(planted_map(), file);
  const Text whole = contents(file);
  std::size_t step = 97;  // every length near both ends
  for (std::size_t length = 0; length < whole.size();
       length += length < 100 || length + 200 > whole.size() ? 1 : step) {
    set_contents(file, whole.substr(0, length));
    const Text why = refusal<std::runtime_error>([&] { (void)read_netcdf(file); });
    REQUIRE(why.starts_with(file.string() + ": "));
    REQUIRE((contains(why, "is not a NetCDF-4 file") || contains(why, "truncated")));
  }
  set_contents(file, whole + "x");
  CHECK(contains(refusal<std::runtime_error>([&] { (void)read_netcdf(file); }),
                 "changed by another program"));
  set_contents(file, whole);
  CHECK_NOTHROW((void)read_netcdf(file));
}

TEST_CASE("10000 times a flipped bit: every one is seen") {
  const Folder folder;
  const fs::path file = folder.path / "map.nc";
  write_netcdf(planted_map(), file);
  Text bytes = contents(file);
  std::mt19937_64 random(1);
  int missed = 0;
  // In place: only the read contents matter.
  const int fd = ::open(file.c_str(), O_WRONLY);
  for (int trial = 0; trial < trials(10000); ++trial) {
    const std::size_t at = random() % bytes.size();
    const char flipped = char(bytes[at] ^ (1 << random() % 8));
    REQUIRE(::pwrite(fd, &flipped, 1, off_t(at)) == 1);
    if (refusal<std::runtime_error>([&] { (void)read_netcdf(file); }).empty()) ++missed;
    REQUIRE(::pwrite(fd, &bytes[at], 1, off_t(at)) == 1);
  }
  ::close(fd);
  CHECK(missed == 0);
  CHECK_NOTHROW((void)read_netcdf(file));
}

TEST_CASE("what is no map is refused with the path and the reason") {
  const Folder folder;
  const fs::path file = folder.path / "map.nc";
  const auto why = [](const fs::path& path) {
    return refusal<std::runtime_error>([&] { (void)read_netcdf(path); });
  };
  CHECK(why(file) == file.string() + ": No such file or directory");
  CHECK(why(folder.path) == folder.path.string() + ": Is a directory");
  CHECK(why("/dev/null") == "/dev/null: Invalid argument");
  set_contents(file, "");
  CHECK(why(file) == file.string() + ": is not a NetCDF-4 file");
  set_contents(file, "[aircraft]\n");
  CHECK(why(file) == file.string() + ": is not a NetCDF-4 file");
  set_contents(file, "\x89HDF\r\n\x1a\n and nothing more");
  CHECK(contains(why(file), "is not the map that tiltrim wrote: it was truncated,"));
}

TEST_CASE("whole, but not what is expected: what is missing is named") {
  const Folder folder;
  const fs::path file = folder.path / "map.nc";
  write_netcdf(planted_map(), file);
  const Text whole = contents(file);
  const auto why = [&](const Text& old_name, const Text& name) {
    Text bytes = whole;
    for (auto at = bytes.find(old_name); at != Text::npos; at = bytes.find(old_name, at + 1))
      bytes.replace(at, old_name.size(), name);
    set_contents(file, sealed_map(bytes.substr(0, bytes.size() - 16)));
    return refusal<std::runtime_error>([&] { (void)read_netcdf(file); });
  };
  CHECK(why("nothing by this name", "") == "");
  CHECK(why("crossing_frequency", "crossing_frequencz") ==
        file.string() + ": crossing_frequency: NetCDF: Variable not found");
  CHECK(why("format_version", "format_versiom") ==
        file.string() + ": format_version: NetCDF: Attribute not found");
  set_contents(file, sealed_map("\x89HDF\r\n\x1a\n and nothing more"));
  CHECK(contains(refusal<std::runtime_error>([&] { (void)read_netcdf(file); }),
                 ": contents: NetCDF: "));
}

// HDF5 crashes on some of these and does not terminate on others.
TEST_CASE("forged, every checksum holding: read, or refused by name") {
  const fs::path memory = "/dev/shm";
  const Folder folder(::access(memory.c_str(), W_OK) == 0 ? memory : fs::temp_directory_path());
  const fs::path file = folder.path / "map.nc";
  const SweepMap map = planted_map();
  write_netcdf(map, file);
  const Text whole = contents(file);
  const auto pieces = hdf5_pieces(whole);
  REQUIRE(pieces.size() > 100);
  CHECK(forged(whole, pieces, {}) == whole);
  std::mt19937_64 random(20);
  const auto draw = [&] { return std::uint16_t(random()); };
  std::map<Text, int> endings;
  for (int trial = 0; trial < trials(250); ++trial) {
    std::vector<Hdf5Change> changes(1 + random() % 3);
    for (Hdf5Change& f : changes)
      f = {draw(), draw(), std::uint8_t(draw()), std::uint8_t(draw()), draw()};
    set_contents(file, forged(whole, pieces, changes));
    Text why;
    try {
      const SweepMap read = read_netcdf(file);
      REQUIRE(read.status.size() == read.points());
      (void)difference(read, read);
    } catch (const std::exception& e) {
      why = e.what();
      REQUIRE(why.starts_with(file.string() + ": "));
    }
    const Text end = why.empty() ? "read" : why.substr(file.string().size() + 2);
    ++endings[end.substr(0, end.find('('))];
  }
  CHECK(endings["read"] > 0);
  CHECK(endings["is damaged: the NetCDF library crashes "] > 0);
}

TEST_CASE("where it cannot be written the system's words say why, and nothing is left behind") {
  const Folder folder;
  set_contents(folder.path / "file", "");
  const auto why = [](const fs::path& path) {
    return refusal<std::runtime_error>([&] { write_netcdf(planted_map(), path); });
  };
  CHECK(why(folder.path) == folder.path.string() + ": Is a directory");
  CHECK(contains(why(folder.path / "none" / "map.nc"), "map.nc: No such file or directory"));
  CHECK(contains(why(folder.path / "file" / "map.nc"), "map.nc: Not a directory"));
  CHECK(files_in(folder.path) == 1);
  if (::geteuid() == 0) return;  // may write everywhere
  ::chmod(folder.path.c_str(), 0500);
  CHECK(contains(why(folder.path / "map.nc"), "map.nc: Permission denied"));
  ::chmod(folder.path.c_str(), 0700);
}

TEST_CASE("a disk that fills up leaves the old file and nothing else") {
  const Folder folder;
  const fs::path file = folder.path / "map.nc";
  write_netcdf(planted_map(), file);
  const Text old = contents(file);
  SweepMap other = planted_map();
  other.study += "# another\n";
  // A file-size limit stands in for a full disk: writes are truncated and then fail in the same
  // way, without special rights.
  const auto old_action = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &old_limit) == 0);
  for (const std::size_t room : {std::size_t(0), std::size_t(1), old.size() / 2, old.size() - 1}) {
    rlimit limit = old_limit;
    limit.rlim_cur = room;
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
    const Text why = refusal<std::runtime_error>([&] { write_netcdf(other, file); });
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &old_limit) == 0);
    CHECK(why == file.string() + ": File too large");
    CHECK(contents(file) == old);
    CHECK(files_in(folder.path) == 1);
  }
  std::signal(SIGXFSZ, old_action);
  CHECK_NOTHROW(write_netcdf(other, file));
  CHECK(read_netcdf(file).study == other.study);
}

TEST_CASE("difference: a map and itself") {
  const MapDifference same_map = difference(planted_map(), planted_map());
  CHECK(same_map.compared == 24);
  CHECK(same_map.changed.empty());
  CHECK(same_map.largest_abscissa_change == 0.0);
  CHECK(same_map.crossings.appeared.empty());
  CHECK(same_map.crossings.vanished.empty());
  CHECK(same_map.crossings.moved.empty());
}

TEST_CASE("difference: changes of points are found where they were planted") {
  const SweepMap before = planted_map();
  SweepMap after = before;
  after.verdict[4] = std::int8_t(Verdict::undecided);  // unstable before
  after.status[5] = 0;                                 // infeasible before
  after.verdict[5] = 0;
  after.spectral_abscissa[5] = -100.0;
  after.spectral_abscissa[10] += 0.25;
  after.spectral_abscissa[20] -= 0.5;
  after.status[21] = std::int8_t(TrimStatus::not_found);
  after.verdict[21] = -1;
  after.spectral_abscissa[21] = undefined;
  const MapDifference found = difference(before, after);
  REQUIRE(found.changed.size() == 3);
  CHECK(found.changed[0].point == 4);
  CHECK(found.changed[0].verdict_before == int(Verdict::unstable));
  CHECK(found.changed[0].verdict_after == int(Verdict::undecided));
  CHECK(found.changed[1].point == 5);
  CHECK(found.changed[1].status_before == TrimStatus::infeasible);
  CHECK(found.changed[1].status_after == TrimStatus::converged);
  CHECK(found.changed[1].verdict_before == -1);
  CHECK(std::isnan(found.changed[1].abscissa_before));
  CHECK(found.changed[1].abscissa_after == -100.0);
  CHECK(found.changed[2].point == 21);
  CHECK(found.changed[2].status_after == TrimStatus::not_found);
  CHECK(found.largest_abscissa_change == 0.5);  // the 100 of a new equilibrium is none
  CHECK(found.largest_at == 20);
}

TEST_CASE("difference: crossings that moved, vanished and appeared") {
  SweepMap before = planted_map(), after = before;
  const AxisCrossing hopf = before.crossings[0];
  const auto at = [&](double eta, double gain = 0.2) {
    AxisCrossing crossing = hopf;
    crossing.at = {gain, eta};
    return crossing;
  };
  before.crossings = {at(10), at(20), at(80), at(40, 0.1), at(30, 0.4)};
  after.crossings = {at(21), at(10), at(40.5, 0.1), at(30, 0.4), at(55, 0.4)};
  after.crossings[3].kind = CrossingKind::touch;
  const MapDifference found = difference(before, after);
  REQUIRE(found.crossings.moved.size() == 3);
  CHECK(found.crossings.moved[0].before.at[1] == 20);
  CHECK(found.crossings.moved[0].after.at[1] == 21);
  CHECK(found.crossings.moved[1].before.at[1] == 40);
  CHECK(found.crossings.moved[1].after.at[1] == 40.5);
  CHECK(found.crossings.moved[2].before.at[1] ==
        30);  // the one of its kind that is left on the line
  CHECK(found.crossings.moved[2].after.at[1] == 55);
  REQUIRE(found.crossings.vanished.size() == 1);
  CHECK(found.crossings.vanished[0].at[1] == 80);
  REQUIRE(found.crossings.appeared.size() == 1);
  CHECK(found.crossings.appeared[0].kind == CrossingKind::touch);

  after = before;
  after.crossings[2].unstable_after = 1;  // at its place, but it is not what it was
  REQUIRE(difference(before, after).crossings.moved.size() == 1);
  CHECK(difference(before, after).crossings.moved[0].after.unstable_after == 1);
}

TEST_CASE("difference: maps of other grids are refused with what is another") {
  const auto why = [](const auto& change) {
    SweepMap after = planted_map();
    change(after);
    return refusal<std::invalid_argument>([&] { (void)difference(planted_map(), after); });
  };
  CHECK(why([](SweepMap& map) { map.conditions[1] = "dive"; }) ==
        "the maps cannot be compared: conditions [level, climb at η = 45°, \"steep\"] before, "
        "[level, dive] after");
  CHECK(contains(why([](SweepMap& map) { map.states[0].name = "V"; }),
                 "states [V_err, q, theta] before, [V, q, theta] after"));
  CHECK(contains(why([](SweepMap& map) { map.axes[1].columns.pop_back(); }),
                 "axes [gains.K_Lp, eta_deg, with V] before, [gains.K_Lp, eta_deg] after"));
  CHECK(contains(why([](SweepMap& map) { map.axes[0].columns[0].values[1] = 0.25; }),
                 "value 2 of gains.K_Lp 0.2 before, 0.25 after"));
  CHECK(contains(why([](SweepMap& map) { map.axes[0].columns[0].values.pop_back(); }),
                 "points of gains.K_Lp 3 before, 2 after"));
}

}  // namespace map_file_test
