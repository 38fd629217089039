#include "runtime/log.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "sweep/record.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"

using namespace tiltrim;
namespace fs = std::filesystem;

namespace log_test {

namespace {

using Text = std::string;

std::span<const std::byte> bytes_of(const Text& text) { return std::as_bytes(std::span(text)); }

Text text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Records of 0 .. 40 bytes, tiles out of order.
std::vector<std::pair<std::uint64_t, Text>> some_records(int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<std::pair<std::uint64_t, Text>> records;
  for (int k = 0; k < count; ++k) {
    Text bytes(random() % 41, '\0');
    for (char& c : bytes) c = char(random());
    records.emplace_back(std::uint64_t(count - k) << 33, bytes);
  }
  return records;
}

const Text identity = "program 1\nV = 15.0\nK_Lp = 0.3\n";

// The file of a log with these records, and where each record ends.
struct Written {
  Text bytes;
  std::vector<std::size_t> ends;
};
Written written(const fs::path& file, const auto& records) {
  Written answer;
  fs::remove(file);
  Log log(file, identity);
  answer.ends.push_back(fs::file_size(file));
  for (const auto& [tile, bytes] : records) {
    log.append(tile, bytes_of(bytes));
    answer.ends.push_back(fs::file_size(file));
  }
  answer.bytes = contents(file);
  return answer;
}

// How many leading records were recovered; -1 if something else was.
int recovered_prefix(const Log& log, const auto& records) {
  for (std::size_t k = 0; k < log.recovered().size(); ++k)
    if (k >= records.size() || log.recovered()[k].tile != records[k].first ||
        text_of(log.recovered()[k].bytes) != records[k].second)
      return -1;
  return int(log.recovered().size());
}

// CRC-64/XZ bit by bit by its definition; the catalogue's check value is asserted below.
std::uint64_t crc_by_bits(const Text& bytes, std::uint64_t before) {
  std::uint64_t crc = ~before;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) * 0xC96C5795D7870F42);
  }
  return ~crc;
}

std::uint64_t number_at(const Text& bytes, std::size_t offset) {
  std::uint64_t number = 0;
  std::memcpy(&number, bytes.data() + offset, sizeof number);
  return number;
}

}  // namespace

TEST_CASE("the file is what the header says, its checksums the published CRC-64/XZ") {
  CHECK(crc_by_bits("123456789", 0) == 0x995DC9BBDF1939FA);
  const Folder folder;
  const auto records = some_records(20, 1);
  const Written log = written(folder.path / "log", records);
  const std::size_t header = log.ends[0];
  REQUIRE(header == 8 + 8 + 8 + identity.size() + 8);
  CHECK(log.bytes.substr(24, identity.size()) == identity);
  std::uint64_t sum = crc_by_bits(log.bytes.substr(0, header - 8), 0);
  CHECK(number_at(log.bytes, header - 8) == sum);
  for (std::size_t k = 0; k < records.size(); ++k) {
    const std::size_t from = log.ends[k], length = log.ends[k + 1] - from;
    CHECK(number_at(log.bytes, from) == records[k].second.size());
    CHECK(number_at(log.bytes, from + 8) == records[k].first);
    sum = crc_by_bits(log.bytes.substr(from, length - 8), sum);
    CHECK(number_at(log.bytes, from + length - 8) == sum);
  }
}

TEST_CASE("what was appended is recovered, each tile once, the first of it") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  {
    Log log(file, identity);
    CHECK(log.recovered().empty());
    log.append(7, bytes_of("seven"));
    log.append(3, bytes_of(""));
    log.append(7, bytes_of("another seven"));
    log.append(~0ull, bytes_of(Text(1 << 20, 'x')));
    log.sync();
  }
  const Log log(file, identity);
  REQUIRE(log.recovered().size() == 3);
  CHECK(log.dropped() == 0);
  CHECK(log.recovered()[0].tile == 7);
  CHECK(text_of(log.recovered()[0].bytes) == "seven");
  CHECK(log.recovered()[1].tile == 3);
  CHECK(log.recovered()[1].bytes.empty());
  CHECK(log.recovered()[2].tile == ~0ull);
  CHECK(text_of(log.recovered()[2].bytes) == Text(1 << 20, 'x'));
}

TEST_CASE("cut off at every length, the whole records before the cut are there and no others") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto records = some_records(12, 2);
  const Written whole = written(file, records);
  for (std::size_t length = 0; length <= whole.bytes.size(); ++length) {
    set_contents(file, whole.bytes.substr(0, length));
    int expected = 0;
    while (std::size_t(expected) < records.size() &&
           whole.ends[std::size_t(expected) + 1] <= length)
      ++expected;
    const std::size_t kept = length < whole.ends[0] ? 0 : whole.ends[std::size_t(expected)];
    {
      Log log(file, identity);
      REQUIRE(recovered_prefix(log, records) == expected);
      REQUIRE(log.dropped() == length - kept);
      for (std::size_t k = std::size_t(expected); k < records.size(); ++k)
        log.append(records[k].first, bytes_of(records[k].second));
    }
    REQUIRE(contents(file) == whole.bytes);  // resumed, it equals the log that was never truncated
  }
}

TEST_CASE("one flipped bit, at every place, is seen") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto records = some_records(6, 3);
  const Written whole = written(file, records);
  int refused = 0;
  for (std::size_t bit = 0; bit < 8 * whole.bytes.size(); ++bit) {
    Text bytes = whole.bytes;
    bytes[bit / 8] = char(bytes[bit / 8] ^ (1 << (bit % 8)));
    set_contents(file, bytes);
    if (bit / 8 < whole.ends[0]) {
      const Text why = refusal<LogError>([&] { Log(file, identity); });
      REQUIRE(contains(why, "delete it, or choose another output"));
      REQUIRE(contents(file) == bytes);  // refused, and left unchanged
      ++refused;
      continue;
    }
    int expected = 0;
    while (whole.ends[std::size_t(expected) + 1] <= bit / 8) ++expected;
    REQUIRE(recovered_prefix(Log(file, identity), records) == expected);
    REQUIRE(fs::file_size(file) == whole.ends[std::size_t(expected)]);
  }
  CHECK(std::size_t(refused) == 8 * whole.ends[0]);
}

TEST_CASE("10000 times a flipped bit, a cut or a stretch of noise in a larger log") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto records = some_records(200, 4);
  const Written whole = written(file, records);
  std::mt19937_64 random(5);
  int wrong = 0;
  for (int trial = 0; trial < trials(10000); ++trial) {
    Text bytes = whole.bytes;
    const std::size_t first = whole.ends[0] + random() % (bytes.size() - whole.ends[0]);
    if (trial % 3 == 0) bytes[first] = char(bytes[first] ^ (1 << random() % 8));
    if (trial % 3 == 1) bytes.resize(first);
    if (trial % 3 == 2)
      for (std::size_t i = first; i < std::min(bytes.size(), first + 20); ++i)
        bytes[i] = char(random());
    const std::size_t damage =
        std::size_t(std::ranges::mismatch(bytes, whole.bytes).in1 - bytes.begin());
    set_contents(file, bytes);
    int expected = 0;
    while (std::size_t(expected) < records.size() &&
           whole.ends[std::size_t(expected) + 1] <= damage)
      ++expected;
    if (recovered_prefix(Log(file, identity), records) != expected) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("records moved, repeated or brought from another log do not count") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto records = some_records(3, 6);
  const Written whole = written(file, records);
  const auto piece = [&](std::size_t k) {
    return whole.bytes.substr(whole.ends[k], whole.ends[k + 1] - whole.ends[k]);
  };
  const Text header = whole.bytes.substr(0, whole.ends[0]);
  set_contents(file, header + piece(1) + piece(0) + piece(2));
  CHECK(recovered_prefix(Log(file, identity), records) == 0);
  set_contents(file, header + piece(0) + piece(2));
  CHECK(recovered_prefix(Log(file, identity), records) == 1);
  set_contents(file, header + piece(0) + Text(1000, '\0'));
  CHECK(recovered_prefix(Log(file, identity), records) == 1);
  CHECK(fs::file_size(file) == whole.ends[1]);

  { Log(folder.path / "other", identity + "eta = 1\n"); }
  const Text other = contents(folder.path / "other");
  set_contents(folder.path / "other", other + piece(0));
  CHECK(Log(folder.path / "other", identity + "eta = 1\n").recovered().empty());
}

TEST_CASE("another identity is refused with what differs and what to do") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const Written whole = written(file, some_records(2, 7));
  const auto why = [&](const Text& other) { return refusal<LogError>([&] { Log(file, other); }); };
  CHECK(why("program 1\nV = 16.0\nK_Lp = 0.3\n") ==
        file.string() +
            ": is the log of another run (line 2: 'V = 15.0' in the log, 'V = 16.0' now); "
            "delete it, or choose another output");
  CHECK(contains(why(identity + "eta = 0"), "line 4: '' in the log, 'eta = 0' now"));
  CHECK(contains(why(""), "line 1: 'program 1' in the log, '' now"));
  CHECK(contents(file) == whole.bytes);
  const Text long_line(200, 'a');
  { Log(folder.path / "long", long_line + "1"); }
  CHECK(contains(refusal<LogError>([&] { Log(folder.path / "long", long_line + "2"); }),
                 fmt::format("line 1: '{0}1' in the log, '{0}2' now", Text(40, 'a'))));
  const Text greek = "\xCE\xB1\xCE\xB2\xCE\xB3";  // cut between letters, never within one
  Text many;
  for (int i = 0; i < 50; ++i) many += greek;
  { Log(folder.path / "greek", "x" + many); }
  CHECK(contains(refusal<LogError>([&] { Log(folder.path / "greek", "y" + many); }),
                 "'x\xCE\xB1\xCE\xB2"));
  CHECK(contains(refusal<LogError>([&] { Log(folder.path / "greek", "y" + many); }),
                 "\xCE\xB1\xCE\xB2' now"));
}

TEST_CASE("what is no log, or a damaged one, is refused and left as it is") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto why = [&](const Text& bytes) {
    set_contents(file, bytes);
    const Text text = refusal<LogError>([&] { Log(file, identity); });
    CHECK(contents(file) == bytes);
    return text;
  };
  CHECK(contains(why("a letter to a friend\n"), "is not a log of tiltrim;"));
  CHECK(contains(why(Text(100, '\0')), "is not a log of tiltrim;"));
  Text header = written(file, some_records(0, 0)).bytes;
  header[8] = 2;
  CHECK(contains(why(header), "is a log of another format, 2 instead of 1"));
  header[8] = 1;
  for (std::size_t i = 16; i < 24; ++i) header[i] = char(0xFF);  // an identity of 2⁶⁴ - 1 bytes
  CHECK(contains(why(header), "its header is damaged"));
}

TEST_CASE("a record that claims 2⁶⁴ bytes is dropped without asking for them") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto records = some_records(2, 8);
  const Written whole = written(file, records);
  for (const std::uint64_t length : {~0ull, ~0ull - 24, 1ull << 63, 1ull << 40}) {
    Text bytes = whole.bytes;
    std::memcpy(bytes.data() + whole.ends[1], &length, sizeof length);
    set_contents(file, bytes);
    CHECK(recovered_prefix(Log(file, identity), records) == 1);
  }
}

TEST_CASE("a second writer is refused while the first is at work, and welcome after") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  {
    Log first(file, identity);
    first.append(1, bytes_of("one"));
    CHECK(refusal<LogError>([&] { Log(file, identity); }) ==
          file.string() + ": another process is using it; wait for it, or choose another output");
    const pid_t child = ::fork();
    if (child == 0)
      ::_exit(contains(refusal<LogError>([&] { Log(file, identity); }), "another process") ? 0 : 1);
    int status = -1;
    REQUIRE(::waitpid(child, &status, 0) == child);
    CHECK(WEXITSTATUS(status) == 0);
  }
  CHECK(Log(file, identity).recovered().size() == 1);
}

TEST_CASE("remove() leaves nothing, and nothing can be appended after it") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  Log log(file, identity);
  log.append(1, bytes_of("one"));
  log.remove();
  CHECK_FALSE(fs::exists(file));
  CHECK(refusal<LogError>([&] { log.append(2, bytes_of("two")); }) ==
        file.string() + ": Bad file descriptor");
  Log again(file, identity);
  CHECK(again.recovered().empty());
}

TEST_CASE("a disk that fills up: the record is not there, the log is, and goes on when it may") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  // A file-size limit stands in for a full disk: writes are truncated and then fail in the same
  // way, without special rights.
  const auto old_action = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &old_limit) == 0);
  Log log(file, identity);
  log.append(1, bytes_of(Text(1000, 'a')));
  const auto size = fs::file_size(file);
  rlimit limit = old_limit;
  limit.rlim_cur = size + 500;
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  CHECK(refusal<LogError>([&] { log.append(2, bytes_of(Text(1000, 'b'))); }) ==
        file.string() + ": File too large");
  CHECK(fs::file_size(file) == size);
  CHECK_NOTHROW(log.append(3, bytes_of("small")));
  const auto why = refusal<LogError>([&] { Log(folder.path / "new", Text(5000, 'i')); });
  CHECK(contains(why, "new: File too large"));
  CHECK_FALSE(fs::exists(folder.path / "new"));
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &old_limit) == 0);
  std::signal(SIGXFSZ, old_action);
  log.append(2, bytes_of(Text(1000, 'b')));
  log.remove();
}

TEST_CASE("a full device gives the system's words") {
  // /dev/full refuses every write and cannot be recovered from.
  if (!fs::exists("/dev/full")) return;
  CHECK(refusal<LogError>([] { Log("/dev/full", identity); }) ==
        "/dev/full: is not a regular file");
}

TEST_CASE("paths that cannot be written are refused with the system's words") {
  const Folder folder;
  set_contents(folder.path / "file", "");
  const auto why = [](const fs::path& path) {
    return refusal<LogError>([&] { Log(path, identity); });
  };
  CHECK(why(folder.path) == folder.path.string() + ": Is a directory");
  CHECK(contains(why(folder.path / "none" / "log"), ": No such file or directory"));
  CHECK(contains(why(folder.path / "file" / "log"), ": Not a directory"));
  if (::geteuid() == 0) return;  // may write everywhere
  ::chmod(folder.path.c_str(), 0500);
  CHECK(contains(why(folder.path / "log"), ": Permission denied"));
  ::chmod(folder.path.c_str(), 0700);
}

TEST_CASE("killed at random moments, a writer loses no record that it was told is written") {
  const Folder folder;
  const fs::path file = folder.path / "log";
  const auto records = some_records(400, 9);
  std::mt19937_64 random(10);
  std::size_t done = 0;
  for (int kill = 0; kill < 40 && done < records.size(); ++kill) {
    int pipe[2];
    REQUIRE(::pipe(pipe) == 0);
    const pid_t child = ::fork();
    if (child == 0) {
      Log log(file, identity);
      for (std::size_t k = log.recovered().size(); k < records.size(); ++k) {
        log.append(records[k].first, bytes_of(records[k].second));
        const std::uint32_t told = std::uint32_t(k + 1);
        if (::write(pipe[1], &told, sizeof told) != sizeof told) ::_exit(1);
      }
      ::_exit(0);
    }
    ::close(pipe[1]);
    std::uint32_t told = std::uint32_t(done);
    for (std::uint64_t k = 0, some = random() % 30; k < some; ++k)
      if (::read(pipe[0], &told, sizeof told) != sizeof told) break;
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ::close(pipe[0]);
    const Log log(file, identity);
    done = log.recovered().size();
    REQUIRE(recovered_prefix(log, records) == int(done));
    REQUIRE(done >= told);
  }
  CHECK(done > 0);
}

// Checksums of forged records are valid: lines go straight into the map's arrays.
TEST_CASE("lines that do not fit the sweep are refused") {
  const LineSizes sizes{.conditions = 1, .axes = 2, .points = 2, .states = 1, .inputs = 1};
  LinePoints points;
  points.status = points.second_branch = {0, 1};
  points.verdict = {-1, 0};
  points.reason = {0, 0};
  points.residual = points.spectral_abscissa = points.damping = {1, 2};
  points.state = points.input = points.eigenvalue_re = points.eigenvalue_im = {1, 2};
  points.confidence = {0, 255};
  points.second = {1};
  points.second_state = points.second_input = points.second_re = points.second_im = {1};
  points.second_verdict = {0};
  CHECK_NOTHROW((void)points_from(as_bytes(points), sizes));
  const auto refused = [&](const auto& change) {
    LinePoints other = points;
    change(other);
    return contains(refusal<std::runtime_error>([&] { (void)points_from(as_bytes(other), sizes); }),
                    "does not match the sweep");
  };
  CHECK(refused([](LinePoints& p) { p.state.resize(1000); }));
  CHECK(refused([](LinePoints& p) { p.second_im.clear(); }));
  CHECK(refused([](LinePoints& p) { p.confidence.pop_back(); }));
  CHECK(refused([](LinePoints& p) { p.reason[1] = -1; }));
  CHECK(refused([](LinePoints& p) { p.reason[1] = 1; }));
  CHECK(refused([](LinePoints& p) { p.second[0] = 2; }));
  CHECK(refused([](LinePoints& p) { p.status[0] = 100; }));

  LineVerdicts verdicts;
  verdicts.crossings = {{0, 1, {0.2, 3}, 1e-9, CrossingKind::hopf, 0, 2, 3.5, -1, ""}};
  verdicts.intervals = {{0, 0, {0.1, 6}, 0.1, 0.15, IntervalVerdict::unstable, 1, 0.5, 0.125}};
  CHECK_NOTHROW((void)verdicts_from(as_bytes(verdicts), sizes));
  const auto refused_verdicts = [&](const LineVerdicts& other) {
    return contains(
        refusal<std::runtime_error>([&] { (void)verdicts_from(as_bytes(other), sizes); }),
        "does not match the sweep");
  };
  LineVerdicts other = verdicts;
  other.crossings[0].axis = 2;
  CHECK(refused_verdicts(other));
  other = verdicts;
  other.crossings[0].mode = 1;
  CHECK(refused_verdicts(other));
  other = verdicts;
  other.intervals[0].at = {0.1};
  CHECK(refused_verdicts(other));
}

}  // namespace log_test
