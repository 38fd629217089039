/// Files that are removed at the end of the test.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

/// A new folder, removed with its contents.
struct Folder {
  std::filesystem::path path;
  explicit Folder(const std::filesystem::path& in = std::filesystem::temp_directory_path());
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& text) const;
};

std::string contents(const std::filesystem::path& file);
void set_contents(const std::filesystem::path& file, const std::string& bytes);
