#include "viwo/log/byte_reader.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>

#include <unistd.h>
#include <zlib.h>

#include "viwo/api/status.hpp"
#include "viwo/config/regular_file.hpp"

namespace viwo::log {
namespace {

/// Recordings of a robot become up to 12 times as long, one of a robot that rests in a simulation
/// without noise 36 times; gzip could do a thousand.
constexpr std::uint64_t kMostRatio = 100, kFreeBytes = 16 << 20;

constexpr std::array<unsigned char, 2> kMagic{0x1f, 0x8b};

/// A whole member with its head and its checksum.
constexpr int kGzipOnly = 16 + MAX_WBITS;

}  // namespace

/// The file, and what of it was read but not given yet.
struct ByteReader::Source {
  int fd = -1;
  bool is_gzip = false;
  bool in_member = false;
  int error = 0;  ///< errno of a read that failed
  std::uint64_t taken = 0, given = 0;
  z_stream stream{};
  std::array<unsigned char, 1 << 16> bytes{};

  std::size_t read(void* into, std::size_t size) {
    ssize_t n = 0;
    do {
      n = ::read(fd, into, size);
    } while (n < 0 && errno == EINTR);
    if (n < 0) error = errno;
    return n > 0 ? static_cast<std::size_t>(n) : 0;
  }

  /// Whether there are at least `least` bytes (one or two) to take; reads more if not.
  bool has(std::size_t least) {
    while (stream.avail_in < least) {
      std::memmove(bytes.data(), stream.next_in, stream.avail_in);
      stream.next_in = bytes.data();
      const std::size_t n =
          read(bytes.data() + stream.avail_in, bytes.size() - std::size_t{stream.avail_in});
      if (n == 0) return false;
      stream.avail_in += static_cast<unsigned>(n);
      taken += n;
    }
    return true;
  }

  bool begins_with_magic() {
    return has(kMagic.size()) && std::equal(kMagic.begin(), kMagic.end(), stream.next_in);
  }
};

void ByteReader::Closer::operator()(Source* source) const {
  inflateEnd(&source->stream);  // also of one that never began
  if (source->fd >= 0) ::close(source->fd);
  delete source;
}

ByteReader::ByteReader(const std::filesystem::path& file) : source_(new Source) {
  Source& source = *source_;
  source.fd = config::open_regular_file(file);
  source.stream.next_in = source.bytes.data();
  if (source.fd >= 0) source.is_gzip = source.begins_with_magic();
  const int error = source.fd < 0 ? errno : source.error;
  if (error != 0) throw InputError(file.string() + "  cannot be read: " + std::strerror(error));
  source.in_member = source.is_gzip;
  if (source.is_gzip && inflateInit2(&source.stream, kGzipOnly) != Z_OK) throw std::bad_alloc();
}

std::size_t ByteReader::read(char* into, std::size_t size) {
  if (!fault_.empty()) return 0;
  const std::size_t n = source_->is_gzip ? inflate(into, size) : read_plain(into, size);
  if (source_->error != 0) {
    fault_ = std::string("cannot be read: ") + std::strerror(source_->error);
    return 0;
  }
  return n;
}

std::size_t ByteReader::read_plain(char* into, std::size_t size) {
  z_stream& stream = source_->stream;
  if (stream.avail_in == 0) return source_->read(into, size);
  const std::size_t n = std::min<std::size_t>(size, stream.avail_in);
  std::memcpy(into, stream.next_in, n);
  stream.next_in += n;
  stream.avail_in -= static_cast<unsigned>(n);
  return n;
}

/// Whether there is another one; behind the last there may be zeros, as tapes pad with them.
bool ByteReader::begin_member() {
  Source& source = *source_;
  if (source.begins_with_magic()) return inflateReset(&source.stream) == Z_OK;
  while (source.has(1)) {
    const unsigned char* const end = source.stream.next_in + source.stream.avail_in;
    if (std::any_of(static_cast<const unsigned char*>(source.stream.next_in), end,
                    [](unsigned char byte) { return byte != 0; })) {
      fault_ = "something is behind the gzip data that is none: the file is damaged";
      return false;
    }
    source.stream.avail_in = 0;
  }
  return false;
}

std::size_t ByteReader::inflate(char* into, std::size_t size) {
  Source& source = *source_;
  z_stream& stream = source.stream;
  const auto most =
      static_cast<unsigned>(std::min<std::size_t>(size, std::numeric_limits<unsigned>::max() / 2));
  stream.next_out = reinterpret_cast<Bytef*>(into);
  stream.avail_out = most;
  while (source.in_member && stream.avail_out == most && most > 0) {
    if (!source.has(1)) {
      truncated_ = source.error == 0;
      if (truncated_) fault_ = "the gzip data end early: the file is truncated";
      return 0;
    }
    const int result = ::inflate(&stream, Z_NO_FLUSH);
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    if (result == Z_STREAM_END) {
      source.in_member = begin_member();
    } else if (result != Z_OK && result != Z_BUF_ERROR) {
      fault_ = std::string("the gzip data are corrupt: ") +
               (stream.msg != nullptr ? stream.msg : "no gzip data");
      return 0;
    }
  }
  const std::size_t n = most - stream.avail_out;
  source.given += n;
  if (source.given > kFreeBytes + kMostRatio * source.taken) {
    fault_ = "the gzip data become more than " + std::to_string(kMostRatio) +
             " times as long, as those of no recording do";
    return 0;
  }
  return n;
}

}  // namespace viwo::log
