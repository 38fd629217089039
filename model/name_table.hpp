/// Names of a model, checked and found without comparing each with all. Internal to tiltrim.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// Positions by name in a vector of signals, or in several numbered through. They must outlive the
/// table.
class NameTable {
 public:
  explicit NameTable(std::initializer_list<const Signals*> parts) {
    std::size_t names = 0;
    for (auto* part = parts_; const Signals* signals : parts)
      names += signals->size(), *part++ = *signals;
    slots_.resize(std::bit_ceil(2 * names + 2), empty);
  }

  /// The name of the next signal, in order. False if the name is there already.
  bool insert(std::string_view name) {
    std::int32_t& slot = slots_[place_of(name)];
    if (slot != empty) return false;
    slot = inserted_++;
    return true;
  }
  /// -1 if the name is not there.
  Eigen::Index find(std::string_view name) const { return slots_[place_of(name)]; }

 private:
  static constexpr std::int32_t empty = -1;
  template <class Word>
  static std::uint64_t word_at(const char* bytes) {
    Word word;
    std::memcpy(&word, bytes, sizeof word);
    return word;
  }
  // Of length, first and last bytes; names that share them meet, and are compared.
  static std::uint64_t hash_of(std::string_view name) {
    constexpr std::uint64_t odd = 0x9e3779b97f4a7c15;
    const std::size_t n = name.size();
    const char* const at = name.data();
    std::uint64_t first = 0, last = 0;
    if (n >= 8)
      first = word_at<std::uint64_t>(at), last = word_at<std::uint64_t>(at + n - 8);
    else if (n >= 4)
      first = word_at<std::uint32_t>(at), last = word_at<std::uint32_t>(at + n - 4);
    else if (n > 0)
      first = word_at<std::uint8_t>(at), last = word_at<std::uint8_t>(at + n - 1);
    return ((first ^ (last * odd)) + n) * odd;
  }
  // Of the name, or of the empty slot where it belongs.
  std::size_t place_of(std::string_view name) const {
    const std::uint64_t mask = slots_.size() - 1;
    // Only the highest bits of a product depend on all bits of its factors.
    std::uint64_t at = hash_of(name) >> std::countl_zero(mask);
    while (slots_[at] != empty && name_of(std::size_t(slots_[at])) != name) at = (at + 1) & mask;
    return at;
  }
  const std::string& name_of(std::size_t number) const {
    const auto* part = parts_;
    for (; number >= part->size(); ++part) number -= part->size();
    return (*part)[number].name;
  }
  std::span<const Signal> parts_[3];  // states, inputs and parameters, or outputs
  std::vector<std::int32_t> slots_;   // at most half of them in use
  std::int32_t inserted_ = 0;
};

/// The numbers of a model's variables and outputs by name.
struct ModelNames {
  NameTable variables, outputs;
};
/// Throws as check(model) does.
ModelNames checked_names(const Model& model);

}  // namespace tiltrim
