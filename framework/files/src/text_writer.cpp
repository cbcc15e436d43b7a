#include "viwo/files/text_writer.hpp"

#include "viwo/math/number_text.hpp"
#include "viwo/math/utf8.hpp"

namespace viwo::files {
namespace {

constexpr std::size_t kFlushBytes = std::size_t{1} << 16;

}  // namespace

void TextWriter::flush() {
  file_.write(pending_);
  pending_.clear();
}

TextWriter& TextWriter::operator<<(std::string_view text) {
  append_valid_utf8(pending_, text);
  if (pending_.size() >= kFlushBytes) flush();
  return *this;
}

TextWriter& TextWriter::operator<<(double value) {
  append_number(pending_, value);
  return *this;
}

TextWriter& TextWriter::operator<<(std::int64_t value) {
  append_number(pending_, value);
  return *this;
}

void TextWriter::close() {
  flush();
  file_.commit();
}

}  // namespace viwo::files
