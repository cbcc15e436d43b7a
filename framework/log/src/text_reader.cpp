#include "viwo/log/text_reader.hpp"

#include <algorithm>
#include <cstring>

#include "viwo/api/status.hpp"

namespace viwo::log {
namespace {

constexpr std::size_t kMaxLine = std::size_t{1} << 20;
constexpr std::size_t kBlock = std::size_t{1} << 16;

}  // namespace

TextReader::TextReader(const std::filesystem::path& file) : file_(file), bytes_(file) {
  buffer_.resize(kBlock);
}

std::string TextReader::where() const {
  return file_.filename().string() + ":" + std::to_string(line_);
}

void TextReader::fail(const std::string& text) const { throw InputError(place() + "  " + text); }

bool TextReader::fill() {
  std::move(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  if (buffer_.size() < end_ + kBlock) buffer_.resize(end_ + kBlock);
  const std::size_t n = bytes_.read(buffer_.data() + end_, kBlock);
  end_ += n;
  if (n > 0 || bytes_.fault().empty()) return n > 0;
  ++line_;
  fail(bytes_.fault());
}

bool TextReader::next(std::string_view& line) {
  std::size_t searched = 0;
  for (;;) {
    const char* const from = buffer_.data() + begin_;
    const std::size_t size = end_ - begin_;
    const void* const found =
        size > searched ? std::memchr(from + searched, '\n', size - searched) : nullptr;
    std::size_t length = size;
    if (found != nullptr) {
      length = static_cast<std::size_t>(static_cast<const char*>(found) - from);
    } else {
      searched = size;
      if (size > kMaxLine) {
        ++line_;
        fail("a line of more than 1 MiB: not a text log");
      }
      if (fill()) continue;
      if (size == 0) {
        if (line_ == 0) {
          line_ = 1;
          fail("the file is empty");
        }
        return false;
      }
    }
    ++line_;
    unterminated_ = found == nullptr;
    line = std::string_view(buffer_.data() + begin_, length);
    begin_ += std::min(length + 1, size);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line_ == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
    return true;
  }
}

}  // namespace viwo::log
