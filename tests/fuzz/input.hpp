/// What the fuzzer made up, as a file for readers that take a path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

/// Writes a file of the folder to work in, which is in memory when run.sh starts a target.
inline std::filesystem::path as_file(const std::string& name, std::span<const std::byte> bytes) {
  std::FILE* const file = std::fopen(name.c_str(), "wb");
  if (!file || std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size() ||
      std::fclose(file) != 0)
    std::abort();
  return name;
}

inline std::span<const std::byte> bytes_of(const std::uint8_t* data, std::size_t size) {
  return std::as_bytes(std::span(data, size));
}
