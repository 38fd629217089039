#include "runtime/log.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <unordered_set>

#include "runtime/checksum.hpp"
#include "runtime/whole_file.hpp"

namespace tiltrim {

namespace {

using Bytes = std::vector<std::byte>;

constexpr std::string_view magic = "tiltlog\n";
constexpr std::uint64_t log_format = 1;
constexpr std::uint64_t word = sizeof(std::uint64_t);
constexpr std::uint64_t before_identity = 3 * word;  // magic, format, length of the identity
constexpr std::uint64_t before_payload = 2 * word;   // length, tile

[[noreturn]] void refuse_log(const std::filesystem::path& file, const std::string& why) {
  throw LogError(fmt::format("{}: {}", file.string(), why));
}

[[noreturn]] void refuse_log(const std::filesystem::path& file, int error) {
  refuse_log(file, std::strerror(error));
}

void put(Bytes& to, std::span<const std::byte> bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

void put(Bytes& to, std::uint64_t number) { put(to, std::as_bytes(std::span(&number, 1))); }

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

std::uint64_t number_at(std::span<const std::byte> bytes, std::uint64_t offset) {
  std::uint64_t number = 0;
  std::memcpy(&number, bytes.data() + offset, word);
  return number;
}

Bytes header_of(const std::string& identity) {
  Bytes header;
  put(header, bytes_of(magic));
  put(header, log_format);
  put(header, identity.size());
  put(header, bytes_of(identity));
  put(header, checksum(header));
  return header;
}

// Opens and locks the file. If another process deletes it between the two, tries again.
int open_locked(const std::filesystem::path& file) {
  constexpr int patience = 100;
  for (int i = 0; i < patience; ++i) {
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0 && errno == EINTR) continue;
    if (fd < 0) refuse_log(file, errno);
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      ::close(fd);
      if (error == EINTR) continue;
      if (error != EWOULDBLOCK) refuse_log(file, error);
      refuse_log(file, "another process is using it; wait for it, or choose another output");
    }
    struct stat opened {
    }, named{};
    if (::fstat(fd, &opened) == 0 && ::stat(file.c_str(), &named) == 0 &&
        opened.st_ino == named.st_ino && opened.st_dev == named.st_dev)
      return fd;
    ::close(fd);
  }
  refuse_log(file, "is repeatedly deleted by another process");
}

// Fills `bytes` from `offset`; false if the file ends before.
bool read_at(const std::filesystem::path& file, int fd, std::span<std::byte> bytes,
             std::uint64_t offset) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::pread(fd, bytes.data() + done, bytes.size() - done, off_t(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) refuse_log(file, errno);
    if (n == 0) return false;
    done += std::size_t(n);
  }
  return true;
}

// 0, or the errno of the write that failed.
int write_at(int fd, std::span<const std::byte> bytes, std::uint64_t offset) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::pwrite(fd, bytes.data() + done, bytes.size() - done, off_t(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : EIO;
    done += std::size_t(n);
  }
  return 0;
}

std::uint64_t size_of(const std::filesystem::path& file, int fd) {
  struct stat opened {};
  if (::fstat(fd, &opened) != 0) refuse_log(file, errno);
  if (!S_ISREG(opened.st_mode)) refuse_log(file, "is not a regular file");
  return std::uint64_t(opened.st_size);
}

// At most `longest` bytes of the line, starting at `from`, cut between UTF-8 characters.
std::string quoted(std::string_view text, std::size_t from) {
  constexpr std::size_t longest = 60;
  const auto inside = [&](std::size_t i) {
    return i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80;
  };
  std::size_t end = std::min({text.find('\n', from), text.size(), from + longest});
  while (inside(end)) --end;
  while (from < end && inside(from)) ++from;
  std::string piece(text.substr(from, end - from));
  for (char& c : piece)
    if (static_cast<unsigned char>(c) < 0x20) c = '?';
  return fmt::format("'{}'", piece);
}

// "line 3: 'V = 15' there, 'V = 16' here", for the first line that differs.
std::string what_differs(std::string_view there, std::string_view here) {
  constexpr std::size_t context = 40;  // bytes of a long line before the difference
  const auto start = std::size_t(std::ranges::mismatch(there, here).in1 - there.begin());
  const std::size_t before = there.substr(0, start).rfind('\n');
  const std::size_t line = before == std::string_view::npos ? 0 : before + 1;
  const std::size_t from = start - line > context ? start - context : line;
  return fmt::format("line {}: {} in the log, {} now",
                     1 + std::ranges::count(there.substr(0, line), '\n'), quoted(there, from),
                     quoted(here, from));
}

constexpr std::string_view remedy = "delete it, or choose another output";

// Throws unless the file begins with the expected header; returns 0 if the header is incomplete.
std::uint64_t check_header(const std::filesystem::path& file, int fd, std::uint64_t size,
                           std::span<const std::byte> ours, const std::string& identity) {
  Bytes start(std::min<std::uint64_t>(size, ours.size()));
  if (!read_at(file, fd, start, 0)) refuse_log(file, EIO);
  if (std::ranges::equal(start, ours.first(start.size())))
    return start.size() == ours.size() ? ours.size() : 0;
  if (size < before_identity + word ||
      !std::ranges::equal(std::span(start).first(magic.size()), bytes_of(magic)))
    refuse_log(file, fmt::format("is not a log of tiltrim; {}", remedy));
  if (number_at(start, word) != log_format)
    refuse_log(file, fmt::format("is a log of another format, {} instead of {}; {}",
                                 number_at(start, word), log_format, remedy));
  const std::uint64_t length = number_at(start, 2 * word);
  const std::string damaged = fmt::format("its header is damaged; {}", remedy);
  if (length > size - before_identity - word) refuse_log(file, damaged);
  Bytes header(before_identity + length + word);
  if (!read_at(file, fd, header, 0)) refuse_log(file, EIO);
  const auto checked = std::span(header).first(before_identity + length);
  if (number_at(header, checked.size()) != checksum(checked)) refuse_log(file, damaged);
  const std::string there(reinterpret_cast<const char*>(header.data()) + before_identity, length);
  refuse_log(file, fmt::format("is the log of another run ({}); {}", what_differs(there, identity),
                               remedy));
}

}  // namespace

Log::Log(const std::filesystem::path& file, const std::string& identity) : file_(file) {
  const Bytes header = header_of(identity);
  descriptor_ = open_locked(file);
  try {
    const std::uint64_t size = size_of(file, descriptor_);
    if (check_header(file, descriptor_, size, header, identity) == 0) {
      dropped_ = size;
      begin(header);
    } else {
      size_ = size;
      checksum_ = number_at(header, header.size() - word);
      recover(header.size());
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

Log::~Log() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void Log::begin(std::span<const std::byte> header) {
  if (::ftruncate(descriptor_, 0) != 0) refuse_log(file_, errno);
  const int error = write_at(descriptor_, header, 0);
  if (error != 0) {
    ::unlink(file_.c_str());
    refuse_log(file_, error);
  }
  filing::sync_folder(file_);
  size_ = header.size();
  checksum_ = number_at(header, header.size() - word);
}

// Reads records while they are intact, and truncates the file after the last one.
void Log::recover(std::uint64_t header_size) {
  const std::uint64_t size = size_;
  std::unordered_set<std::uint64_t> seen;
  std::uint64_t good = header_size;
  while (size - good >= before_payload + word) {
    Bytes record(before_payload);
    if (!read_at(file_, descriptor_, record, good)) break;
    const std::uint64_t length = number_at(record, 0);
    if (length > size - good - before_payload - word) break;
    record.resize(before_payload + length + word);
    if (!read_at(file_, descriptor_, record, good)) break;
    const auto checked = std::span(record).first(before_payload + length);
    const std::uint64_t expected = checksum(checked, checksum_);
    if (number_at(record, checked.size()) != expected) break;
    good += record.size();
    checksum_ = expected;
    const std::uint64_t tile = number_at(record, word);
    if (!seen.insert(tile).second) continue;
    recovered_.push_back({tile, {checked.begin() + before_payload, checked.end()}});
  }
  dropped_ = size - good;
  size_ = good;
  if (dropped_ > 0 && ::ftruncate(descriptor_, off_t(good)) != 0) refuse_log(file_, errno);
}

void Log::append(std::uint64_t tile, std::span<const std::byte> bytes) {
  Bytes record;
  record.reserve(before_payload + bytes.size() + word);
  put(record, bytes.size());
  put(record, tile);
  put(record, bytes);
  const std::uint64_t sum = checksum(record, checksum_);
  put(record, sum);
  const int error = write_at(descriptor_, record, size_);
  if (error != 0) {
    // If this fails too, the next append overwrites the partial record, or recovery drops it.
    if (::ftruncate(descriptor_, off_t(size_)) != 0) errno = error;
    refuse_log(file_, error);
  }
  size_ += record.size();
  checksum_ = sum;
}

void Log::sync() {
  int error = 0;
  do error = ::fdatasync(descriptor_) == 0 ? 0 : errno;
  while (error == EINTR);
  if (error != 0) refuse_log(file_, error);
}

void Log::remove() {
  if (::unlink(file_.c_str()) != 0 && errno != ENOENT) refuse_log(file_, errno);
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

}  // namespace tiltrim
