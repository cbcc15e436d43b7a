// Writes MCAP files (https://mcap.dev/spec): chunks with their indexes, and a summary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mcap_chunk.hpp"

namespace viwo::bag::mcap {

/// Little endian.
class Buffer {
 public:
  template <class T>
  Buffer& number(T value) {
    return raw({reinterpret_cast<const std::uint8_t*>(&value), sizeof(value)});
  }
  Buffer& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    return raw({reinterpret_cast<const std::uint8_t*>(value.data()), value.size()});
  }
  Buffer& raw(std::span<const std::uint8_t> bytes);
  /// A record of this kind with these fields.
  Buffer& record(std::uint8_t op, const Buffer& fields) {
    return number(op).number(std::uint64_t{fields.size()}).raw(fields.bytes_);
  }
  const Bytes& bytes() const { return bytes_; }
  std::size_t size() const { return bytes_.size(); }

 private:
  Bytes bytes_;
};

/// Everything that fails is a std::runtime_error "file  cannot be written: why".
class Writer {
 public:
  static constexpr std::size_t kChunkBytes = 768 << 10;

  /// `library`: who writes, as the file's header names it.
  explicit Writer(const std::string& file, Compression compression = Compression::kZstd,
                  std::size_t chunk_bytes = kChunkBytes, const std::string& library = "viwo");
  /// What files of that library begin with.
  static Bytes head(const std::string& library);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Of cdr messages, whose type is described as ROS 2 writes it in its *.msg.
  std::uint16_t add_channel(const std::string& topic, const std::string& type,
                            const std::string& definition);
  void write(std::uint16_t channel, std::int64_t received_ns, std::int64_t sent_ns,
             std::span<const std::uint8_t> data);
  /// Must be called: the last bytes may fail, too.
  void close();

  std::int64_t begin_ns() const { return static_cast<std::int64_t>(begin_ns_); }
  std::int64_t end_ns() const { return static_cast<std::int64_t>(end_ns_); }
  /// Of messages, by channel.
  const std::map<std::uint16_t, std::uint64_t>& counts() const { return counts_; }

 private:
  struct Chunk {
    Buffer records;
    std::map<std::uint16_t, Buffer> index;
    std::uint64_t begin_ns = 0, end_ns = 0;
  };

  [[noreturn]] void fail(const std::string& why) const;
  void put(const Buffer& buffer);
  Bytes compressed(const Bytes& bytes) const;
  void close_chunk();
  void write_summary();
  Buffer statistics() const;

  std::string file_;
  int fd_;
  Compression compression_;
  std::size_t chunk_bytes_;
  std::uint64_t at_ = 0;   ///< bytes written so far
  std::uint32_t crc_ = 0;  ///< of them
  Chunk chunk_;
  Buffer schemas_, channels_;  ///< records
  Buffer chunk_indexes_;
  std::map<std::string, std::uint16_t> schema_of_;  ///< of a type
  std::uint32_t n_chunks_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint64_t begin_ns_ = 0, end_ns_ = 0;
  std::map<std::uint16_t, std::uint64_t> counts_;
};

}  // namespace viwo::bag::mcap
