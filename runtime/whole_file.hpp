/// Files read and written as a whole: the file on disk is always either the old or the new one.
#pragma once

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tiltrim::filing {

[[noreturn]] inline void refuse(const std::filesystem::path& file, const std::string& why) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), why));
}

[[noreturn]] inline void refuse(const std::filesystem::path& file, int error) {
  refuse(file, std::strerror(error));
}

/// 0, or the errno of the write that failed.
inline int write_all(int fd, std::span<const std::byte> bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : EIO;
    done += std::size_t(n);
  }
  return 0;
}

/// The file a name refers to, through symbolic links; it need not exist yet. If the links form a
/// circle, returns a link.
inline std::filesystem::path target_of(std::filesystem::path file) {
  constexpr int most = 40;  // the limit of Linux
  std::error_code error;
  for (int i = 0; i < most && std::filesystem::is_symlink(file, error); ++i) {
    const std::filesystem::path to = std::filesystem::read_symlink(file, error);
    if (error) break;
    file = file.parent_path() / to;  // only `to` if it is absolute
  }
  return file;
}

/// 0, or the errno that explains why no file can be written under that name: it is too long, a
/// folder, or a circular link.
inline int name_error(const std::filesystem::path& file) {
  struct stat there {};
  if (::stat(file.c_str(), &there) == 0) return S_ISDIR(there.st_mode) ? EISDIR : 0;
  return errno == ENOENT ? 0 : errno;
}

/// Makes the names in the folder of `file` last, if the folder can be read.
inline void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

/// Writes the pieces in order to the open file `beside`, syncs, closes and renames it to `target`;
/// removes it on any error. Throws std::runtime_error "name: reason".
inline void finish(int fd, const std::string& beside, const std::filesystem::path& target,
                   const std::filesystem::path& name,
                   std::initializer_list<std::span<const std::byte>> pieces) {
  int error = 0;
  for (const auto piece : pieces)
    if (error == 0) error = write_all(fd, piece);
  if (error == 0 && ::fsync(fd) != 0 && errno != EINVAL && errno != EROFS) error = errno;
  if (::close(fd) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(beside.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(beside.c_str());
    refuse(name, error);
  }
  sync_folder(target);
}

/// Writes the pieces in order to a file next to `file`, syncs and renames it; a symbolic link is
/// followed to its target. On any error the old file is unchanged. Throws std::runtime_error "path:
/// reason".
inline void write_whole(const std::filesystem::path& file,
                        std::initializer_list<std::span<const std::byte>> pieces) {
  if (const int error = name_error(file); error != 0) refuse(file, error);
  const std::filesystem::path target = target_of(file);
  // A fixed name, so that the next run overwrites what a killed program left.
  const std::string beside = target.string() + ".part";
  const int fd =
      ::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (fd < 0) refuse(file, errno);
  finish(fd, beside, target, file, pieces);
}

/// All bytes of a regular file. Throws std::runtime_error "path: reason".
inline std::vector<std::byte> read_whole(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) refuse(file, errno);
  struct stat opened {};
  int error = ::fstat(fd, &opened) == 0 ? 0 : errno;
  if (error == 0 && S_ISDIR(opened.st_mode)) error = EISDIR;
  if (error == 0 && !S_ISREG(opened.st_mode)) error = EINVAL;
  std::vector<std::byte> bytes(error == 0 ? std::size_t(opened.st_size) : 0);
  for (std::size_t done = 0; error == 0 && done < bytes.size();) {
    const ssize_t n = ::read(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) error = errno;
    if (n == 0) bytes.resize(done);
    if (n > 0) done += std::size_t(n);
  }
  ::close(fd);
  if (error != 0) refuse(file, error);
  return bytes;
}

}  // namespace tiltrim::filing
