#include "viwo/files/printable_output.hpp"

#include <iostream>
#include <stdexcept>

#include <poll.h>
#include <unistd.h>

#include "viwo/math/utf8.hpp"

namespace viwo::files {
namespace {

constexpr std::string_view kNone = "\xef\xbf\xbd";

/// Whether a character may begin with all of it, and have more bytes.
bool is_begin(const std::string& text) {
  return utf8_size(text + "\x80\x80\x80") > text.size() ||
         utf8_size(text + "\xbf\xbf\xbf") > text.size();
}

bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  const bool is_harmless = first == '\n' || first == '\t';
  return (first < 0x20 && !is_harmless) || first == 0x7f ||
         (character.size() == 2 && character < "\xc2\xa0");
}

}  // namespace

PrintableOutput::~PrintableOutput() {
  for (std::size_t i = 0; i < held_.size(); ++i) put(kNone);
  stream_.rdbuf(to_);
}

bool PrintableOutput::put(std::string_view character) {
  const auto size = static_cast<std::streamsize>(character.size());
  return to_->sputn(character.data(), size) == size;
}

bool PrintableOutput::take(char byte) {
  held_ += byte;
  bool is_put = true;
  while (!held_.empty() && !is_begin(held_)) {
    const std::size_t size = utf8_size(held_);
    const std::string_view character = std::string_view(held_).substr(0, size);
    is_put = put(size == 0 ? kNone : is_control(character) ? "?" : character) && is_put;
    held_.erase(0, size == 0 ? 1 : size);
  }
  return is_put;
}

PrintableOutput::int_type PrintableOutput::overflow(int_type value) {
  if (traits_type::eq_int_type(value, traits_type::eof())) return traits_type::not_eof(value);
  const std::lock_guard lock(mutex_);
  return take(traits_type::to_char_type(value)) ? value : traits_type::eof();
}

std::streamsize PrintableOutput::xsputn(const char* text, std::streamsize size) {
  const std::lock_guard lock(mutex_);
  for (std::streamsize i = 0; i < size; ++i) {
    if (!take(text[i])) return i;
  }
  return size;
}

int PrintableOutput::sync() {
  const std::lock_guard lock(mutex_);
  return to_->pubsync();
}

void flush_output(const std::string& program) {
  if (std::cout.flush()) return;
  pollfd out{STDOUT_FILENO, POLLOUT, 0};
  const bool reader_is_gone = ::poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
  if (!reader_is_gone) {
    throw std::runtime_error(program + ": the standard output cannot be written");
  }
}

}  // namespace viwo::files
