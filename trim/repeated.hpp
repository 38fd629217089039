/// @file
/// A trim problem that is solved from many guesses.
#pragma once

#include <memory>

#include "trim/trim.hpp"

namespace tiltrim {

/// trim() of one model and spec from many guesses, as in a loop over airspeeds: names are checked
/// and found once, and memory is used again. Every result is that of trim(), bit for bit. One
/// thread at a time may use an object.
class RepeatedTrim {
 public:
  /// Throws as trim() does.
  RepeatedTrim(Model model, TrimSpec spec);
  ~RepeatedTrim();
  RepeatedTrim(RepeatedTrim&& other) noexcept;             ///< leaves the other one unusable
  RepeatedTrim& operator=(RepeatedTrim&& other) noexcept;  ///< leaves the other one unusable

  /// trim() from this guess.
  [[nodiscard]] TrimResult operator()(const OperatingPoint& guess, const TrimOptions& options = {});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tiltrim
