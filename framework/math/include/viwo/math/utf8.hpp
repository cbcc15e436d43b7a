// Texts from anywhere (names of files, printed messages) as UTF-8, which those who read results
// need.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace viwo {

/// Bytes of the character that `text` begins with; 0: it begins with none. (Unicode 15, table 3-7:
/// no detours, no halves of pairs, nothing beyond U+10FFFF.)
inline std::size_t utf8_size(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  const auto follows = [&](std::size_t i, unsigned low = 0x80, unsigned high = 0xbf) {
    return byte(i) >= low && byte(i) <= high;
  };
  const unsigned first = byte(0);
  if (text.empty() || first < 0x80) return text.empty() ? 0 : 1;
  if (first < 0xc2 || first > 0xf4) return 0;
  if (first < 0xe0) return follows(1) ? 2 : 0;
  if (first < 0xf0) {
    return follows(1, first == 0xe0 ? 0xa0 : 0x80, first == 0xed ? 0x9f : 0xbf) && follows(2) ? 3
                                                                                              : 0;
  }
  return follows(1, first == 0xf0 ? 0x90 : 0x80, first == 0xf4 ? 0x8f : 0xbf) && follows(2) &&
                 follows(3)
             ? 4
             : 0;
}

/// Appends the text, with U+FFFD for each byte that is not part of a character.
inline void append_valid_utf8(std::string& result, std::string_view text) {
  while (!text.empty()) {
    const auto ascii = std::find_if(text.begin(), text.end(),
                                    [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
    std::size_t size = static_cast<std::size_t>(ascii - text.begin());
    if (size == 0) size = utf8_size(text);
    result += size > 0 ? text.substr(0, size) : std::string_view("\xef\xbf\xbd");
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
}

inline std::string valid_utf8(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  append_valid_utf8(result, text);
  return result;
}

}  // namespace viwo
