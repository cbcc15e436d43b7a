#include "mcap_writer.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <lz4frame.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include "mcap_records.hpp"

namespace viwo::bag::mcap {
namespace {

const char* name_of(Compression compression) {
  switch (compression) {
    case Compression::kLz4:
      return "lz4";
    case Compression::kZstd:
      return "zstd";
    case Compression::kNone:
      break;
  }
  return "";
}

std::uint32_t crc_of(const Bytes& bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

/// What lists and maps begin with.
Buffer& list(Buffer& out, const Buffer& items) {
  return out.number(static_cast<std::uint32_t>(items.size())).raw(items.bytes());
}

}  // namespace

Buffer& Buffer::raw(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return *this;
  const std::size_t before = bytes_.size();
  bytes_.resize(before + bytes.size());
  std::memcpy(bytes_.data() + before, bytes.data(), bytes.size());
  return *this;
}

Bytes Writer::head(const std::string& library) {
  return Buffer().raw(kMagic).record(kHeader, Buffer().text("ros2").text(library)).bytes();
}

Writer::Writer(const std::string& file, Compression compression, std::size_t chunk_bytes,
               const std::string& library)
    : file_(file),
      // A pipe that nobody reads is an error, not something to wait for.
      fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK, 0666)),
      compression_(compression),
      chunk_bytes_(chunk_bytes) {
  if (fd_ < 0 || ::fcntl(fd_, F_SETFL, 0) != 0) {
    const std::string why = std::strerror(errno);
    if (fd_ >= 0) ::close(fd_);
    fail(why);
  }
  try {
    put(Buffer().raw(head(library)));
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

Writer::~Writer() {
  if (fd_ >= 0) ::close(fd_);  // who wants a whole file has called close()
}

void Writer::fail(const std::string& why) const {
  throw std::runtime_error(file_ + "  cannot be written: " + why);
}

void Writer::put(const Buffer& buffer) {
  std::span<const std::uint8_t> rest = buffer.bytes();
  while (!rest.empty()) {
    const ssize_t n = ::write(fd_, rest.data(), rest.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(std::strerror(errno));
    rest = rest.subspan(static_cast<std::size_t>(n));
  }
  at_ += buffer.size();
  crc_ = crc_of(buffer.bytes(), crc_);
}

std::uint16_t Writer::add_channel(const std::string& topic, const std::string& type,
                                  const std::string& definition) {
  const auto next_schema = static_cast<std::uint16_t>(schema_of_.size() + 1);
  const auto [schema, is_new] = schema_of_.emplace(type, next_schema);
  Buffer described;
  if (is_new) {
    Buffer fields;
    fields.number(schema->second).text(type).text("ros2msg").text(definition);
    described.record(kSchema, fields);
    schemas_.raw(described.bytes());
  }
  const auto id = static_cast<std::uint16_t>(counts_.size());
  counts_[id] = 0;
  Buffer qos;
  qos.text("offered_qos_profiles").text("");
  Buffer fields;
  list(fields.number(id).number(schema->second).text(topic).text("cdr"), qos);
  channels_.record(kChannel, fields);
  chunk_.records.raw(described.record(kChannel, fields).bytes());
  return id;
}

void Writer::write(std::uint16_t channel, std::int64_t received_ns, std::int64_t sent_ns,
                   std::span<const std::uint8_t> data) {
  const auto t_ns = static_cast<std::uint64_t>(received_ns);
  const bool is_first = sequence_ == 0, is_first_of_chunk = chunk_.index.empty();
  chunk_.begin_ns = is_first_of_chunk ? t_ns : std::min(chunk_.begin_ns, t_ns);
  chunk_.end_ns = std::max(chunk_.end_ns, t_ns);
  begin_ns_ = is_first ? t_ns : std::min(begin_ns_, t_ns);
  end_ns_ = std::max(end_ns_, t_ns);
  chunk_.index[channel].number(t_ns).number(std::uint64_t{chunk_.records.size()});
  Buffer fields;
  fields.number(channel).number(sequence_++).number(t_ns);
  chunk_.records.record(kMessage, fields.number(static_cast<std::uint64_t>(sent_ns)).raw(data));
  ++counts_[channel];
  if (chunk_.records.size() >= chunk_bytes_) close_chunk();
}

Bytes Writer::compressed(const Bytes& bytes) const {
  if (compression_ == Compression::kNone) return bytes;
  Bytes out;
  if (compression_ == Compression::kLz4) {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    const std::size_t n =
        LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
    if (LZ4F_isError(n)) fail(LZ4F_getErrorName(n));
    out.resize(n);
  } else {
    constexpr int kDefaultLevel = 0;
    out.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t n =
        ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kDefaultLevel);
    if (ZSTD_isError(n) != 0) fail(ZSTD_getErrorName(n));
    out.resize(n);
  }
  return out;
}

void Writer::close_chunk() {
  const Bytes& records = chunk_.records.bytes();
  const Bytes bytes = compressed(records);
  Buffer fields;
  fields.number(chunk_.begin_ns).number(chunk_.end_ns).number(std::uint64_t{records.size()});
  fields.number(crc_of(records)).text(name_of(compression_)).number(std::uint64_t{bytes.size()});
  const std::uint64_t begin = at_;
  put(Buffer().record(kChunk, fields.raw(bytes)));
  const std::uint64_t end = at_;
  Buffer places;
  for (const auto& [channel, entries] : chunk_.index) {
    places.number(channel).number(at_);
    Buffer index;
    put(Buffer().record(kMessageIndex, list(index.number(channel), entries)));
  }
  Buffer in_summary;
  in_summary.number(chunk_.begin_ns).number(chunk_.end_ns).number(begin).number(end - begin);
  list(in_summary, places).number(at_ - end).text(name_of(compression_));
  in_summary.number(std::uint64_t{bytes.size()}).number(std::uint64_t{records.size()});
  chunk_indexes_.record(kChunkIndex, in_summary);
  ++n_chunks_;
  chunk_ = {};
}

Buffer Writer::statistics() const {
  Buffer counts;
  for (const auto& [channel, n] : counts_) counts.number(channel).number(n);
  Buffer fields;
  fields.number(std::uint64_t{sequence_}).number(static_cast<std::uint16_t>(schema_of_.size()));
  fields.number(static_cast<std::uint32_t>(counts_.size()));
  fields.number(std::uint32_t{0}).number(std::uint32_t{0});  // attachments and metadata
  list(fields.number(n_chunks_).number(begin_ns_).number(end_ns_), counts);
  Buffer out;
  out.record(kStatistics, fields);
  return out;
}

void Writer::write_summary() {
  const std::pair<std::uint8_t, Buffer> groups[] = {{kSchema, schemas_},
                                                    {kChannel, channels_},
                                                    {kStatistics, statistics()},
                                                    {kChunkIndex, chunk_indexes_}};
  const std::uint64_t begin = at_;
  Buffer summary, offsets;
  for (const auto& [op, records] : groups) {
    if (records.size() == 0) continue;
    Buffer fields;
    fields.number(op).number(begin + summary.size()).number(std::uint64_t{records.size()});
    offsets.record(kSummaryOffset, fields);
    summary.raw(records.bytes());
  }
  const std::uint64_t begin_of_offsets = begin + summary.size();
  summary.raw(offsets.bytes());
  constexpr std::uint64_t kFooterBytes = 20;
  summary.number(std::uint8_t{kFooter}).number(kFooterBytes).number(begin).number(begin_of_offsets);
  put(summary.number(crc_of(summary.bytes())).raw(kMagic));
}

void Writer::close() {
  if (fd_ < 0) return;
  if (chunk_.records.size() > 0) close_chunk();
  Buffer crc;
  put(Buffer().record(kDataEnd, crc.number(crc_)));
  write_summary();
  // What is no file (a pipe, a device) has nothing to bring to the disk.
  if (::fsync(fd_) != 0 && errno != EINVAL && errno != EROFS) fail(std::strerror(errno));
  if (::close(std::exchange(fd_, -1)) != 0) fail(std::strerror(errno));
}

}  // namespace viwo::bag::mcap
