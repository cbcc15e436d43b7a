// Numbers as texts that read back to the same bits.
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <string>

namespace viwo {

/// The shortest of those texts.
inline void append_number(std::string& out, double value) {
  std::array<char, 32> digits{};
  const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  out.append(digits.data(), result.ptr);
}
inline void append_number(std::string& out, std::int64_t value) { out += std::to_string(value); }

inline std::string number_text(double value) {
  std::string out;
  append_number(out, value);
  return out;
}

}  // namespace viwo
