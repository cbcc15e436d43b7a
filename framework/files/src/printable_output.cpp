#include "viwo/files/printable_output.hpp"

#include <utility>

namespace viwo::files {

PrintableOutput::int_type PrintableOutput::overflow(int_type value) {
  if (traits_type::eq_int_type(value, traits_type::eof())) return traits_type::not_eof(value);
  const char c = traits_type::to_char_type(value);
  const auto byte = static_cast<unsigned char>(c);
  constexpr char kFirst = '\xc2';
  if (std::exchange(may_be_control_, false)) {
    if (byte >= 0x80 && byte < 0xa0) return to_->sputc('?');
    if (traits_type::eq_int_type(to_->sputc(kFirst), traits_type::eof())) return traits_type::eof();
  }
  if (c == kFirst) {
    may_be_control_ = true;
    return value;
  }
  const bool is_control = byte < 0x20 || byte == 0x7f;
  const bool is_harmless = c == '\n' || c == '\t';
  return to_->sputc(is_control && !is_harmless ? '?' : c);
}

}  // namespace viwo::files
