/// Comparisons that print both values to 17 digits and the difference.
#pragma once

#include <doctest/doctest.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "dense/products.hpp"  // or each test would compile its own

/// |actual - expected| <= tolerance, absolute; NaN fails.
#define CHECK_NEAR(actual, expected, tolerance)                                               \
  do {                                                                                        \
    const double near_a_ = (actual), near_e_ = (expected), near_t_ = (tolerance);             \
    CHECK_MESSAGE(std::abs(near_a_ - near_e_) <= near_t_,                                     \
                  fmt::format(#actual " = {:.17g}, expected {:.17g}, off by {:.3g} > {:.3g}", \
                              near_a_, near_e_, std::abs(near_a_ - near_e_), near_t_));       \
  } while (false)

/// Half a unit of the last printed digit: printed_to("0.1485") is 5e-5, printed_to("1.49E-01") is
/// 5e-4.
inline double printed_to(std::string_view printed) {
  const std::size_t e = std::min(printed.find_first_of("eE"), printed.size());
  const std::size_t point = std::min(printed.find('.'), e);
  const double decimals = point == e ? 0.0 : static_cast<double>(e - point - 1);
  const double power = e == printed.size() ? 0.0 : std::stod(std::string(printed.substr(e + 1)));
  return 0.5 * std::pow(10.0, power - decimals);
}

/// The message of the Error that `act` throws; empty if it throws none.
template <class Error = std::invalid_argument, std::invocable Act>
std::string refusal(const Act& act) {
  try {
    act();
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

inline bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TILTRIM_SANITIZED
#endif
#endif
#if defined(TILTRIM_SANITIZED) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// Marks a case that takes long and runs next to nothing of the library that no other case runs:
/// left out under sanitizers where the environment has TILTRIM_BRIEF, and nowhere else.
inline constexpr struct {
  void fill(doctest::detail::TestCase& of) const { of.m_test_suite = "thorough"; }
} thorough;

/// Number of random trials: a tenth under sanitizers, which look for faults, not for rates. The
/// environment's TILTRIM_TRIALS scales it, down to one: 0.02 in an emulator. Compile-time constants
/// are not scaled.
constexpr int trials(int n) {
  const int most = sanitized ? n / 10 : n;
  if (std::is_constant_evaluated()) return most;
  const char* share = std::getenv("TILTRIM_TRIALS");
  return share ? std::max(1, int(most * std::atof(share))) : most;
}
