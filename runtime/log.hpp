/// An append-only log of checksummed records, from which a killed sweep goes on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tiltrim {

/// The log cannot be used or written: what() is "path: why".
struct LogError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One finished piece of work.
struct Record {
  std::uint64_t tile = 0;
  std::vector<std::byte> bytes;
};

/// The file: a header with the identity of the work and its checksum, then records, each with its
/// length, its tile and a checksum of all of it and of what came before, so that a record counts at
/// its own place in its own log alone. What follows the first damaged or cut-off record is dropped.
/// One process at a time: the file is locked while it is open.
class Log {
 public:
  /// Opens or begins the log. A log of another identity (another study, another program) is
  /// refused, never mixed; the message quotes the first line in which the identities differ. So is
  /// a log whose header is damaged, any other file, and a log that is open elsewhere. Throws
  /// LogError.
  Log(const std::filesystem::path& file, const std::string& identity);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  /// The records found when it was opened, in the file's order, each tile once.
  const std::vector<Record>& recovered() const { return recovered_; }
  /// Bytes of a damaged or cut-off tail that were dropped.
  std::uint64_t dropped() const { return dropped_; }

  /// Appends a record whole or, where the disk is full, not at all (the file is cut back to what it
  /// was); throws LogError. Not for several threads at once.
  void append(std::uint64_t tile, std::span<const std::byte> bytes);
  /// All that was appended is on the disk when this returns.
  void sync();
  /// Closes and deletes the log: its work is done.
  void remove();

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0, dropped_ = 0;
  std::uint64_t checksum_ = 0;  ///< of the last good record, or of the header
  std::vector<Record> recovered_;

  void begin(std::span<const std::byte> header);
  void recover(std::uint64_t header_size);
};

}  // namespace tiltrim
