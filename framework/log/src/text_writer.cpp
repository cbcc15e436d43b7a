#include "viwo/log/text_writer.hpp"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "viwo/log/text.hpp"

namespace viwo::log {
namespace {

constexpr std::size_t kFlushBytes = std::size_t{1} << 16;

}  // namespace

TextWriter::TextWriter(const std::filesystem::path& file, Appears appears) : file_(file) {
  if (appears == Appears::kWhole) {
    whole_.emplace(file);
    return;
  }
  errno = 0;
  stream_.open(file, std::ios::binary | std::ios::trunc);
  check();
}

void TextWriter::check() const {
  if (stream_.good()) return;
  const int error = errno;
  throw std::runtime_error("cannot write " + file_.string() +
                           (error != 0 ? std::string(": ") + std::strerror(error) : ""));
}

void TextWriter::flush() {
  if (whole_) {
    whole_->write(pending_);
    pending_.clear();
    return;
  }
  errno = 0;
  stream_.write(pending_.data(), static_cast<std::streamsize>(pending_.size()));
  pending_.clear();
  stream_.flush();
  check();
}

TextWriter& TextWriter::operator<<(std::string_view text) {
  pending_ += text;
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
  if (whole_) {
    whole_->commit();
    whole_.reset();
    return;
  }
  errno = 0;
  stream_.close();
  check();
}

}  // namespace viwo::log
