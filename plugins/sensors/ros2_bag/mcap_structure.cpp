#include "mcap_structure.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <zlib.h>

#include "mcap_records.hpp"
#include "viwo/api/stamp_order.hpp"
#include "viwo/api/status.hpp"

namespace viwo::bag::mcap {
namespace {

/// A file seen through a small buffer, as most of what is asked for is near to the last.
class Window {
 public:
  explicit Window(const FileBytes& file) : file_(file) {}

  /// At most `n` bytes from `at`, fewer at the end of the file; until the next call.
  std::span<const std::uint8_t> at(std::uint64_t at, std::uint64_t n) {
    n = at < file_.size() ? std::min(n, file_.size() - at) : 0;
    if (at < begin_ || at + n > begin_ + bytes_.size()) {
      constexpr std::uint64_t kLeast = 4096;
      begin_ = at;
      bytes_.resize(static_cast<std::size_t>(
          std::min(std::max(n, kLeast), file_.size() - std::min(at, file_.size()))));
      file_.read(at, bytes_);
    }
    return std::span(bytes_).subspan(static_cast<std::size_t>(at - begin_),
                                     static_cast<std::size_t>(n));
  }

 private:
  const FileBytes& file_;
  std::uint64_t begin_ = 0;
  Bytes bytes_;
};

struct Head {
  std::uint8_t op = 0;
  std::uint64_t content = 0;  ///< where it begins
  std::uint64_t length = 0;
  std::uint64_t end() const { return content + length; }
};

std::int64_t stamp_of(std::uint64_t t_ns) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(t_ns, kMaxStampNs + 1));
}

class Follower {
 public:
  explicit Follower(const FileBytes& file) : file_(file), window_(file) {}

  Structure follow() {
    check_magic();
    std::uint64_t at = kMagic.size();
    try {
      while (const auto record = next(at)) {
        if (record->op == kDataEnd || record->op == kFooter) break;
        take(at, *record);
        at = record->end();
      }
      out_.end = at;
    } catch (const BrokenRecord& broken) {
      throw InputError(file_.name() + "  is damaged: at byte " + std::to_string(at) + ", " +
                       broken.what());
    }
    try {
      if (out_.has_end) read_summary();
    } catch (const BrokenRecord&) {  // all of it stands in the chunks, too
      out_.has_wrong_summary = true;
    }
    return std::move(out_);
  }

 private:
  void check_magic() {
    const auto begin = window_.at(0, kMagic.size());
    if (begin.empty()) throw InputError(file_.name() + "  is empty");
    if (!std::equal(begin.begin(), begin.end(), kMagic.begin())) {
      throw InputError(file_.name() + "  is no MCAP file (version 0)");
    }
    const std::uint64_t least = 2 * kMagic.size();
    const auto end = window_.at(file_.size() - std::min(file_.size(), kMagic.size()), least);
    out_.has_end = file_.size() >= least && std::ranges::equal(end, kMagic);
  }

  /// Nothing where the file was cut.
  std::optional<Head> next(std::uint64_t at) {
    const auto begin = window_.at(at, kRecordHead);
    Head record{0, at + kRecordHead, 0};
    if (begin.size() == kRecordHead) {
      record.op = begin[0];
      record.length = Fields(begin.subspan(1)).u64();
      if (record.op != 0 && record.length <= file_.size() - record.content) return record;
    }
    if (out_.has_end) {
      throw BrokenRecord(record.op == 0 ? "there is no record"
                                        : "a record goes beyond the end of the file");
    }
    if (record.op == kChunk) add_chunk(at, record, true);
    return std::nullopt;
  }

  /// All fields of a record that is kept in memory for a moment.
  std::span<const std::uint8_t> fields(const Head& record) {
    constexpr std::uint64_t kMost = 16 << 20;
    if (record.length > kMost) {
      throw BrokenRecord("the description of a channel has " + std::to_string(record.length) +
                         " bytes");
    }
    return window_.at(record.content, record.length);
  }

  void take(std::uint64_t at, const Head& record) {
    switch (record.op) {
      case kSchema:
        return out_.channels.add_schema(fields(record));
      case kChannel:
        return out_.channels.add_channel(fields(record));
      case kMessage:
        return add_message(at, record);
      case kChunk:
        return add_chunk(at, record, false);
      case kMessageIndex:
        return add_index(record);
      default:  // other indexes, attachments, and what is yet to come
        return;
    }
  }

  void add_message(std::uint64_t at, const Head& record) {
    constexpr std::uint64_t kRow = 1 << 20;  // messages in a row are read in pieces of this size
    Fields in(window_.at(record.content, std::min<std::uint64_t>(record.length, kMessageHead)));
    in.bytes(2 + 4);
    const std::int64_t received_ns = stamp_of(in.u64());
    const std::uint64_t bytes = kRecordHead + record.length;
    if (bytes > kMaxBytes) throw BrokenRecord(too_large("message", bytes));
    Chunk* const last = out_.chunks.empty() ? nullptr : &out_.chunks.back();
    if (last != nullptr && !last->has_record && last->at + last->bytes == at &&
        last->bytes + bytes <= kRow) {
      last->bytes += bytes;
      last->whole_bytes = last->bytes;
      last->begin_ns = std::min(last->begin_ns, received_ns);
      return;
    }
    Chunk row;
    row.place = row.at = at;
    row.bytes = row.whole_bytes = bytes;
    row.begin_ns = received_ns;
    row.has_record = false;
    out_.chunks.push_back(row);
  }

  static std::string too_large(const char* what, std::uint64_t bytes) {
    return std::string("a ") + what + " says to have " + std::to_string(bytes) +
           " bytes, at most " + std::to_string(kMaxBytes) + " are read";
  }

  void add_chunk(std::uint64_t at, const Head& record, bool is_cut) {
    constexpr std::uint64_t kMostOfHead = 128;
    const auto head = window_.at(record.content, std::min(record.length, kMostOfHead));
    Chunk chunk;
    try {
      Fields in(head);
      chunk.begin_ns = stamp_of(in.u64());
      chunk.end_ns = stamp_of(in.u64());
      chunk.whole_bytes = in.u64();
      chunk.crc = in.u32();
      chunk.compression = compression(in.text());
      chunk.bytes = in.u64();
      chunk.at = record.content + (head.size() - in.rest().size());
    } catch (const BrokenRecord&) {
      if (is_cut) return;
      throw;
    }
    chunk.place = at;
    chunk.is_cut = is_cut;
    if (chunk.whole_bytes > kMaxBytes) throw BrokenRecord(too_large("chunk", chunk.whole_bytes));
    out_.whole_bytes += chunk.whole_bytes;
    if (out_.whole_bytes > kFreeBytes + kMostRatio * file_.size()) {
      throw BrokenRecord("the chunks say to become more than " + std::to_string(kMostRatio) +
                         " times as long as the file");
    }
    if (is_cut) {
      chunk.bytes = std::min(chunk.bytes, file_.size() - chunk.at);
    } else if (chunk.bytes > record.end() - chunk.at) {
      throw BrokenRecord("a chunk has more bytes than its record");
    }
    out_.chunks.push_back(chunk);
  }

  /// For how much a chunk has that cannot be read.
  void add_index(const Head& record) {
    constexpr std::uint64_t kUsed = 2 + 4, kEntry = 8 + 8;
    if (out_.chunks.empty() || record.length < kUsed) return;
    Fields in(window_.at(record.content, kUsed));
    in.u16();  // the channel
    out_.chunks.back().n_messages += in.u32() / kEntry;
  }

  static Compression compression(std::string_view name) {
    if (name.empty()) return Compression::kNone;
    if (name == "lz4") return Compression::kLz4;
    if (name == "zstd") return Compression::kZstd;
    throw BrokenRecord("a chunk is compressed by '" + std::string(name.substr(0, 40)) +
                       "', what is read is lz4 and zstd");
  }

  /// For the channels, which stand in the chunks, too: they are believed where the statistics have
  /// as many.
  void read_summary() {
    constexpr std::uint64_t kFooterBytes = 20;
    const std::uint64_t tail = kRecordHead + kFooterBytes + kMagic.size();
    if (file_.size() < kMagic.size() + tail) return;
    const std::uint64_t footer = file_.size() - tail;
    const auto bytes = window_.at(footer, kRecordHead + kFooterBytes);
    if (bytes[0] != kFooter) throw BrokenRecord("the file does not end with a footer");
    Fields in(bytes.subspan(kRecordHead));
    const std::uint64_t begin = in.u64();
    in.u64();  // of the offsets within the summary
    const std::uint32_t crc = in.u32();
    count_behind(footer);                                  // moves the window
    if (begin < kMagic.size() || begin >= footer) return;  // there is none
    out_.has_wrong_summary =
        crc != 0 && crc != crc_of(begin, footer + kRecordHead + kFooterBytes - sizeof(crc));
    if (out_.has_wrong_summary) return;
    std::optional<std::uint32_t> n_channels;
    for (std::uint64_t at = begin; at < footer;) {
      const auto record = next(at);
      if (record->op == kSchema || record->op == kChannel) take(at, *record);
      if (record->op == kStatistics) {
        constexpr std::uint64_t kBefore = 8 + 2;   // the numbers of messages and of schemas
        constexpr std::uint64_t kBetween = 4 + 4;  // of attachments and metadata
        const std::uint64_t used = kBefore + kBetween + 2 * sizeof(std::uint32_t);
        Fields statistics(window_.at(record->content, std::min(record->length, used)));
        statistics.bytes(kBefore);
        n_channels = statistics.u32();
        statistics.bytes(kBetween);
        count_missing(statistics.u32());
      }
      at = record->end();
    }
    out_.has_all_channels = n_channels == out_.channels.size();
  }

  /// From the end of the data to the footer at the end of the file.
  void count_behind(std::uint64_t footer) {
    for (std::uint64_t at = out_.end; at < footer;) {
      const auto record = next(at);
      if (!record) return;
      const bool is_data = record->op == kChunk || record->op == kMessage;
      out_.n_behind += is_data ? 1 : 0;
      at = record->end();
    }
  }

  /// A record of a kind that is not known is passed over: one that was damaged, too.
  void count_missing(std::uint64_t n_chunks) {
    const auto found = static_cast<std::uint64_t>(
        std::ranges::count_if(out_.chunks, [](const Chunk& chunk) { return chunk.has_record; }));
    out_.n_missing = n_chunks - std::min(n_chunks, found);
  }

  std::uint32_t crc_of(std::uint64_t from, std::uint64_t to) {
    constexpr std::uint64_t kBlock = 64 << 10;
    uLong crc = 0;
    for (std::uint64_t at = from; at < to; at += kBlock) {
      const auto block = window_.at(at, std::min(kBlock, to - at));
      crc = crc32_z(crc, block.data(), block.size());
    }
    return static_cast<std::uint32_t>(crc);
  }

  const FileBytes& file_;
  Window window_;
  Structure out_;
};

}  // namespace

Structure read_structure(const FileBytes& file) { return Follower(file).follow(); }

}  // namespace viwo::bag::mcap
