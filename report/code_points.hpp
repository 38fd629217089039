/// The characters of UTF-8 text. Internal to report/.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace tiltrim {

/// Number of characters: bytes that do not continue a character.
inline std::size_t characters(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// Decodes UTF-8; each byte that is not part of a valid character becomes U+FFFD.
inline std::u32string code_points(std::string_view text) {
  constexpr char32_t replacement = 0xFFFD;
  std::u32string points;
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i]);
    const std::size_t more = first < 0x80 ? 0 : first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
    constexpr unsigned char bits[] = {0x7F, 0x1F, 0x0F, 0x07};
    constexpr char32_t least[] = {0, 0x80, 0x800, 0x10000};  // overlong forms are invalid
    char32_t point = first & bits[more];
    bool valid = (first < 0x80 || first >= 0xC2) && first < 0xF5 && i + more < text.size();
    for (std::size_t k = 1; valid && k <= more; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      valid = (next & 0xC0) == 0x80;
      point = point << 6 | (next & 0x3F);
    }
    valid = valid && point >= least[more] && point <= 0x10FFFF &&
            !(point >= 0xD800 && point < 0xE000);  // surrogates are invalid
    points += valid ? point : replacement;
    i += valid ? more + 1 : 1;
  }
  return points;
}

}  // namespace tiltrim
