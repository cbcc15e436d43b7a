// Records of an MCAP file that are read at once: a chunk, or messages in a row outside of chunks.
#pragma once

#include <cstdint>
#include <string>

#include "bag.hpp"
#include "file_bytes.hpp"

namespace viwo::bag::mcap {

/// More is not held in memory: neither of a chunk nor of a message. An image of 2^25 pixels in
/// colours fits.
inline constexpr std::uint64_t kMaxBytes = 128ULL << 20;
/// Nor are chunks longer than this, all together and as many times as long as the file, when they
/// are decompressed. Images of one grey level become 255 times as short by lz4.
inline constexpr std::uint64_t kFreeBytes = 64ULL << 20, kMostRatio = 300;

enum class Compression : std::uint8_t { kNone, kLz4, kZstd };

struct Chunk {
  std::uint64_t place = 0;  ///< of its record, for messages
  std::uint64_t at = 0;     ///< of its records, perhaps compressed
  std::uint64_t bytes = 0;
  std::uint64_t whole_bytes = 0;  ///< when they are not
  std::uint32_t crc = 0;          ///< of them; 0: none
  Compression compression = Compression::kNone;
  std::int64_t begin_ns = 0;     ///< no message was received before
  std::int64_t end_ns = 0;       ///< nor after, as the chunk says
  std::uint64_t n_messages = 0;  ///< in the indexes behind it; 0: it has none
  bool has_record = true;        ///< false: messages outside of chunks
  bool is_cut = false;           ///< the file ends within it
};

struct Content {
  Bytes records;
  std::string fault;  ///< why they are not what was written; empty when they are
};

/// Of a chunk that is cut all that there is. InputError when the file cannot be read.
Content read_chunk(const FileBytes& file, const Chunk& chunk);

}  // namespace viwo::bag::mcap
