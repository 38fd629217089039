#include "tests/files.hpp"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>

namespace fs = std::filesystem;

Folder::Folder(const fs::path& in) {
  std::string name = (in / "tiltrim_test.XXXXXX").string();
  if (!::mkdtemp(name.data())) throw std::system_error(errno, std::generic_category(), name);
  path = name;
}

Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

fs::path Folder::write(const std::string& name, const std::string& text) const {
  std::ofstream(path / name, std::ios::binary) << text;
  return path / name;
}

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void set_contents(const fs::path& file, const std::string& bytes) {
  fs::remove(file);  // some file systems flush what is truncated and rewritten
  std::ofstream(file, std::ios::binary) << bytes;
}
