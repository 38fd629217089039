/// An append-only log of checksummed records, from which an interrupted sweep resumes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tiltrim {

/// The log cannot be used or written; what() is "path: reason".
struct LogError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The file has a header with the identity of the work and its checksum, then records, each with
/// its length, its tile and a checksum over itself and everything before it, so that a record is
/// valid only at its own position in its own log. Everything after the first damaged or truncated
/// record is dropped. One process at a time: the file is locked while open.
class Log {
 public:
  /// One finished piece of work.
  struct Record {
    std::uint64_t tile = 0;
    std::vector<std::byte> bytes;
  };

  /// Opens or creates the log. Refuses a log of another identity (another study or program), and
  /// quotes the first line in which the identities differ; also refuses a log with a damaged
  /// header, any other file, and a log open in another process. Throws LogError.
  Log(const std::filesystem::path& file, const std::string& identity);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  /// The records found on opening, in file order, one per tile.
  const std::vector<Record>& recovered() const { return recovered_; }
  /// Bytes dropped from a damaged or truncated tail.
  std::uint64_t dropped() const { return dropped_; }

  /// Appends a record completely or, if the disk is full, not at all (the file is cut back to its
  /// previous size) and throws LogError. Not thread-safe.
  void append(std::uint64_t tile, std::span<const std::byte> bytes);
  /// Returns when all appended records are on disk.
  void sync();
  /// Closes and deletes the log when the work is complete.
  void remove();

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0, dropped_ = 0;
  std::uint64_t checksum_ = 0;  ///< of the last valid record, or of the header
  std::vector<Record> recovered_;

  void begin(std::span<const std::byte> header);
  void recover(std::uint64_t header_size);
};

}  // namespace tiltrim
