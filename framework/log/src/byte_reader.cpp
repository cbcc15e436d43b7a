#include "viwo/log/byte_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include <zlib.h>

#include "viwo/api/status.hpp"
#include "viwo/log/files.hpp"

namespace viwo::log {
namespace {

/// Recordings of a robot become up to 12 times as long, one of a robot that rests in a simulation
/// without noise 36 times; gzip could do a thousand.
constexpr std::uint64_t kMostRatio = 100, kFreeBytes = 16 << 20, kCheckEach = 1 << 20;

gzFile as_gz(void* handle) { return static_cast<gzFile>(handle); }

}  // namespace

void ByteReader::Closer::operator()(void* handle) const { gzclose_r(as_gz(handle)); }

ByteReader::ByteReader(const std::filesystem::path& file) : file_(file.string()) {
  require_regular_file(file);
  errno = 0;
  handle_.reset(gzopen(file.c_str(), "rb"));
  if (handle_ == nullptr) {
    const int error = errno;
    throw InputError(file_ +
                     "  cannot be read: " + (error != 0 ? std::strerror(error) : "out of memory"));
  }
}

bool ByteReader::is_too_long(std::uint64_t more) {
  given_ += more;
  if (given_ < check_at_) return false;
  check_at_ = given_ + kCheckEach;
  gzFile gz = as_gz(handle_.get());
  if (given_ <= kFreeBytes || gzdirect(gz) != 0) return false;
  return given_ > kFreeBytes + kMostRatio * static_cast<std::uint64_t>(gzoffset(gz));
}

std::size_t ByteReader::read(char* into, std::size_t size) {
  constexpr std::size_t kMost = std::size_t{1} << 30;
  const int n = gzread(as_gz(handle_.get()), into, static_cast<unsigned>(std::min(size, kMost)));
  if (n > 0 && !is_too_long(static_cast<std::uint64_t>(n))) return static_cast<std::size_t>(n);
  if (n > 0) {
    fault_ = "the gzip data become more than " + std::to_string(kMostRatio) +
             " times as long, as those of no recording do";
    return 0;
  }
  // zlib reports a stream that stops in the middle as "nothing more to read" with this error.
  int error = Z_OK;
  const char* text = gzerror(as_gz(handle_.get()), &error);
  truncated_ = error == Z_BUF_ERROR;
  if (error == Z_OK) return 0;
  if (truncated_) {
    fault_ = "the gzip data end early: the file is truncated";
  } else if (error == Z_ERRNO) {
    fault_ = std::string("cannot be read: ") + std::strerror(errno);
  } else {
    // zlib puts the name of the file before its text; it is said already.
    std::string_view reason = text;
    if (reason.starts_with(file_ + ": ")) reason.remove_prefix(file_.size() + 2);
    fault_ = "the gzip data are corrupt: " + std::string(reason);
  }
  return 0;
}

}  // namespace viwo::log
