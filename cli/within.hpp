/// Ranges of numbers on the command line. Internal to cli/.
#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <string>
#include <type_traits>

namespace tiltrim::cli {

/// Accepts numbers from `from` to `to`, whole ones if these are integers.
template <class Number>
CLI::Validator within(Number from, Number to) {
  const CLI::Range range(from, to);
  const std::string expected =
      fmt::format("a {}number from {} to {}", std::is_integral_v<Number> ? "whole " : "", from, to);
  return {[range, expected](std::string& word) {
            return range(word).empty() ? "" : fmt::format("{} is not {}", word, expected);
          },
          range.get_description()};
}

}  // namespace tiltrim::cli
