/// Reading a certificate. Internal to check_proof/.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "check_proof/leaf.hpp"

namespace tiltrim::checking {

struct Theorem {
  std::size_t line = 0;  ///< of the header
  Statement statement;
  std::vector<Leaf> leaves;
};

/// What is wrong with a certificate, at a line.
struct Malformed : std::runtime_error {
  std::size_t line;
  Malformed(std::size_t at, const std::string& why) : std::runtime_error(why), line(at) {}
};

/// Throws Malformed. Every key must be known, every number a finite hexadecimal float, every tree
/// complete.
std::vector<Theorem> read_certificate(const std::string& text);

/// Whether the text begins as a certificate does.
bool is_certificate(const std::string& text);

}  // namespace tiltrim::checking
