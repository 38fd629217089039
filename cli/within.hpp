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
  const std::string expected =
      fmt::format("a {}number from {} to {}", std::is_integral_v<Number> ? "whole " : "", from, to);
  return {[=](std::string& word) {
            Number number{};  // no comparison with NaN holds
            using CLI::detail::lexical_cast;
            const bool accepted = lexical_cast(word, number) && number >= from && number <= to;
            return accepted ? "" : fmt::format("{} is not {}", word, expected);
          },
          CLI::Range(from, to).get_description()};
}

}  // namespace tiltrim::cli
