// Where in an MCAP file its messages are, found by following its records from the first to the
// last: so it is the same for files with and without a summary, chunked or not, whole or cut.
#pragma once

#include <cstdint>
#include <vector>

#include "file_bytes.hpp"
#include "mcap_channels.hpp"
#include "mcap_chunk.hpp"

namespace viwo::bag::mcap {

struct Structure {
  std::vector<Chunk> chunks;  ///< in the order of the file
  /// Those of the summary and those that are described outside of chunks.
  Channels channels;
  bool has_all_channels = false;   ///< the summary says so: the chunks need not be searched
  bool has_wrong_summary = false;  ///< by its check sum; it is not used then
  std::uint64_t n_missing = 0;     ///< chunks that the summary counts and that are not there
  std::uint64_t n_behind = 0;      ///< chunks and messages behind the end of the data, not read
  bool has_end = true;             ///< false: the file was cut off, or its recording not ended
  std::uint64_t end = 0;           ///< of the last whole record
  std::uint64_t whole_bytes = 0;   ///< of all chunks, decompressed
};

/// Reads no messages. InputError "file  what" for a file that is no MCAP, and for one that has its
/// end and is damaged before. What does not fit in a file without its end is where it was cut.
Structure read_structure(const FileBytes& file);

}  // namespace viwo::bag::mcap
