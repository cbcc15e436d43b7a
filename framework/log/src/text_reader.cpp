#include "viwo/log/text_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <zlib.h>

#include "viwo/api/status.hpp"

namespace viwo::log {
namespace {

constexpr std::size_t kMaxLine = std::size_t{1} << 20;
constexpr unsigned kBlock = 1U << 16;

gzFile as_gz(void* handle) { return static_cast<gzFile>(handle); }

}  // namespace

void TextReader::Closer::operator()(void* handle) const { gzclose_r(as_gz(handle)); }

TextReader::TextReader(const std::filesystem::path& file) : file_(file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw InputError(file.string() + "  is a folder, not a file");
  }
  errno = 0;
  handle_.reset(gzopen(file.c_str(), "rb"));
  if (handle_ == nullptr) {
    const int error = errno;
    throw InputError(file.string() +
                     "  cannot be read: " + (error != 0 ? std::strerror(error) : "out of memory"));
  }
  buffer_.resize(kBlock);
}

TextReader::~TextReader() = default;

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
  const int n = gzread(as_gz(handle_.get()), buffer_.data() + end_, kBlock);
  if (n > 0) {
    end_ += static_cast<std::size_t>(n);
    return true;
  }
  // zlib reports a stream that stops in the middle as "nothing more to read" with this error.
  int error = Z_OK;
  const char* text = gzerror(as_gz(handle_.get()), &error);
  if (error == Z_OK) return false;
  ++line_;
  if (error == Z_BUF_ERROR) fail("the gzip data end early: the file is truncated");
  if (error == Z_ERRNO) fail(std::string("cannot be read: ") + std::strerror(errno));
  // zlib puts the name of the file before its text; it is said already.
  std::string_view reason = text;
  const std::string prefix = file_.string() + ": ";
  if (reason.starts_with(prefix)) reason.remove_prefix(prefix.size());
  fail("the gzip data are corrupt: " + std::string(reason));
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
