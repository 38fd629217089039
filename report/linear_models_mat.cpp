#include <fcntl.h>
#include <fmt/core.h>
#include <matio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "report/code_points.hpp"
#include "report/linear_models.hpp"
#include "report/linear_point.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

[[noreturn]] void refuse(const std::string& why) { throw std::runtime_error("MAT-file: " + why); }

using Size = std::array<std::size_t, 2>;

matvar_t* made(matio_classes kind, matio_types type, Size size, const void* data, int flags = 0) {
  matvar_t* const variable =
      Mat_VarCreate(nullptr, kind, type, 2, size.data(), const_cast<void*>(data), flags);
  if (!variable) refuse("no memory for a variable");
  return variable;
}

matvar_t* numbers(const Eigen::MatrixXd& m) {
  return made(MAT_C_DOUBLE, MAT_T_DOUBLE, {std::size_t(m.rows()), std::size_t(m.cols())}, m.data());
}

matvar_t* eigenvalues(const Modes& modes) {
  std::vector<double> re, im;
  for (const Mode& m : modes.modes) {
    re.push_back(m.eigenvalue.real());
    im.push_back(m.eigenvalue.imag());
  }
  if (re.empty()) return numbers(Eigen::MatrixXd(0, 1));
  const mat_complex_split_t parts{re.data(), im.data()};
  return made(MAT_C_DOUBLE, MAT_T_DOUBLE, {re.size(), 1}, &parts, MAT_F_COMPLEX);
}

// ASCII unchanged, which every reader accepts; else UTF-16, except that characters of two code
// units, on which readers disagree, become U+FFFD.
matvar_t* text(const std::string& words) {
  std::vector<std::uint16_t> units;
  for (const char32_t c : code_points(words))
    units.push_back(c < 0x10000 ? std::uint16_t(c) : std::uint16_t{0xFFFD});
  const bool ascii = std::ranges::all_of(units, [](std::uint16_t unit) { return unit < 0x80; });
  const Size size{words.empty() ? 0U : 1U, units.size()};
  return ascii ? made(MAT_C_CHAR, MAT_T_UTF8, size, words.data())
               : made(MAT_C_CHAR, MAT_T_UTF16, size, units.data());
}

matvar_t* list(const Signals& signals) {
  std::vector<matvar_t*> cells;
  for (const Signal& s : signals) cells.push_back(text(s.name));
  return made(MAT_C_CELL, MAT_T_CELL, {cells.size(), 1}, cells.data());
}

// Takes ownership of the parts.
matvar_t* model(const ConditionReport& c, const std::string& name) {
  const LinearModel& l = *c.linear;
  const LinearPoint at = point_of(c);
  const std::pair<const char*, matvar_t*> fields[] = {
      {"name", text(c.answer.condition.name)},
      {"A", numbers(l.A)},
      {"B", numbers(l.B)},
      {"C", numbers(l.C)},
      {"D", numbers(l.D)},
      {"A_error", numbers(l.A_error)},
      {"states", list(l.states)},
      {"inputs", list(l.inputs)},
      {"outputs", list(l.outputs)},
      {"x0", numbers(at.x0)},
      {"u0", numbers(at.u0)},
      {"y0", numbers(at.y0)},
      {"eigenvalues", eigenvalues(*c.modes)},
      {"verdict", text(to_string(c.modes->verdict))}};
  std::vector<const char*> keys;
  for (const auto& [key, value] : fields) keys.push_back(key);
  Size one{1, 1};
  matvar_t* const whole =
      Mat_VarCreateStruct(name.c_str(), 2, one.data(), keys.data(), unsigned(keys.size()));
  if (!whole) refuse("no memory for a variable");
  for (const auto& [key, value] : fields) Mat_VarSetStructFieldByName(whole, key, 0, value);
  return whole;
}

// matio writes to file names only: this name is that of a file in memory.
struct InMemory {
  int fd = ::memfd_create("models.mat", MFD_CLOEXEC);
  InMemory() {
    if (fd < 0) refuse(std::strerror(errno));
  }
  ~InMemory() { ::close(fd); }
  InMemory(const InMemory&) = delete;
  InMemory& operator=(const InMemory&) = delete;

  std::string name() const { return fmt::format("/proc/self/fd/{}", fd); }
  std::string bytes() const {
    std::string all(std::size_t(std::max<off_t>(::lseek(fd, 0, SEEK_END), 0)), '\0');
    for (std::size_t done = 0; done < all.size();) {
      const ssize_t n = ::pread(fd, all.data() + done, all.size() - done, off_t(done));
      if (n <= 0) refuse("the written data cannot be read back");
      done += std::size_t(n);
    }
    return all;
  }
};

}  // namespace

std::string linear_models_mat(const std::vector<ConditionReport>& conditions) {
  const std::vector<const ConditionReport*> all = linear_ones(conditions);
  std::vector<std::string> names;
  for (const ConditionReport* c : all) names.push_back(c->answer.condition.name);
  names = matlab_names(names);
  const InMemory file;
  // A fixed header: matio's contains the time, but the same input must give the same bytes.
  mat_t* const mat = Mat_CreateVer(file.name().c_str(),
                                   "MATLAB 5.0 MAT-file, linear models by tiltrim", MAT_FT_MAT5);
  if (!mat) refuse("cannot be made in memory");
  int failed = 0;
  for (std::size_t i = 0; i < all.size() && failed == 0; ++i) {
    matvar_t* const variable = model(*all[i], names[i]);
    failed = Mat_VarWrite(mat, variable, MAT_COMPRESSION_NONE);
    Mat_VarFree(variable);
  }
  if (Mat_Close(mat) != 0 || failed != 0) refuse("could not be written");
  return file.bytes();
}

}  // namespace tiltrim
