#include "ros1_structure.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <set>
#include <string_view>
#include <vector>

#include <rosbag/chunked_file.h>
#include <rosbag/stream.h>

#include "file_bytes.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::bag {
namespace {

/// Kinds of records: the field `op`.
constexpr char kMessage = 0x02, kFileHeader = 0x03, kIndex = 0x04, kChunk = 0x05, kChunkInfo = 0x06,
               kConnection = 0x07;
constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kMaxHeader = 1U << 20;
/// Of a compressed chunk, and of all of them: rosbag_storage takes memory as they say.
constexpr std::uint64_t kMostChunk = 128U << 20, kFreeBytes = 64U << 20, kMostRatio = 300;
/// Bytes that bz2 may give, if a chunk is decompressed whenever the next message is in another one;
/// lz4 is that much faster.
constexpr std::uint64_t kFreeWork = 512ULL << 20, kMostRepeated = 16, kLz4IsFaster = 16;
/// How much longer than its file a bag becomes: more of it counts as often as it is there.
constexpr std::uint64_t kUsualRatio = 10;

std::uint32_t u32_at(std::string_view bytes) {
  std::uint32_t value = 0;  // little endian, as all that rosbag_storage runs on
  std::memcpy(&value, bytes.data(), sizeof(value));
  return value;
}

class Structure {
 public:
  explicit Structure(const std::string& file) : file_(file), in_(file), size_(in_.size()) {}

  std::uint64_t check() {
    check_magic();
    std::uint64_t at = kMagic.size();
    while (at < size_) {
      const Record record = read_record(at, size_);
      check_record(record);
      index_is_record_ = index_is_record_ || at == index_place_;
      at = record.end;
    }
    check_work();
    if (!index_is_record_) fail(index_place_, "there is no record where the index should begin");
    require_all_indexed();
    for (const std::uint64_t place : wanted_chunks_) {
      if (!chunks_.contains(place)) fail(place, "there is no chunk where the index has one");
    }
    for (const std::uint64_t place : chunks_) {
      if (!wanted_chunks_.contains(place)) fail(place, "there is a chunk that the index lacks");
    }
    if (n_chunks_ != wanted_chunks_.size() || n_connections_ != described_) {
      fail(0, "the head of the file counts other chunks or connections than there are");
    }
    for (const std::uint32_t connection : indexed_) {
      if (!connections_.contains(connection)) fail(size_, "a connection is missing");
    }
    return whole_bytes_;
  }

 private:
  struct Record {
    std::uint64_t begin = 0;
    std::uint64_t data = 0;
    std::uint64_t end = 0;
    char op = 0;
    std::string header;

    /// The value of a field; empty when there is none.
    std::string_view field(std::string_view name) const {
      std::string_view rest = header;
      while (!rest.empty()) {  // lengths have been checked
        const std::string_view item = rest.substr(4, u32_at(rest));
        rest.remove_prefix(4 + item.size());
        if (item.substr(0, item.find('=')) == name) return item.substr(name.size() + 1);
      }
      return {};
    }
  };

  std::string remedy() const {
    return " - `rosbag reindex " + file_ + "` mends what can be mended";
  }

  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const {
    const std::string in_chunk =
        chunk_.empty() ? "" : "in the chunk at byte " + std::to_string(chunk_place_) + ", ";
    throw InputError(file_ + "  is cut short or damaged: " + in_chunk + "at byte " +
                     std::to_string(at) + ", " + what + remedy());
  }

  /// Of the file, or of the chunk that is looked into.
  std::string read(std::uint64_t at, std::size_t n) const {
    if (!chunk_.empty()) {
      const auto from = chunk_.begin() + static_cast<std::ptrdiff_t>(at);
      return {from, from + static_cast<std::ptrdiff_t>(n)};
    }
    std::string bytes(n, '\0');
    in_.read(at, {reinterpret_cast<std::uint8_t*>(bytes.data()), n});
    return bytes;
  }

  void check_magic() const {
    if (size_ == 0) throw InputError(file_ + "  is empty");
    const std::string begin = read(0, std::min<std::size_t>(kMagic.size(), size_));
    if (begin == kMagic) return;
    if (begin.starts_with("#ROSBAG V")) {
      throw InputError(file_ + "  is a bag of another format than 2.0");
    }
    const bool is_ros2 = begin.starts_with("\x89MCAP") || begin.starts_with("SQLite");
    throw InputError(file_ + "  is no ROS 1 bag" +
                     (is_ros2 ? " - did you mean type: ros2_bag?" : ""));
  }

  Record read_record(std::uint64_t at, std::uint64_t end) const {
    constexpr std::size_t kMost = 128;  // of a header: one read for nearly all records
    const std::string begin = read(at, std::min<std::uint64_t>(kMost, end - at));
    if (begin.size() < 8) fail(at, "a record goes beyond the end");
    const std::uint32_t size = u32_at(begin);
    if (size > kMaxHeader || size > end - at - 8) fail(at, "a record goes beyond the end");
    Record record;
    record.begin = at;
    const std::string rest =
        size + 8 <= begin.size() ? begin.substr(4, size + 4) : read(at + 4, size + 4);
    record.header = rest.substr(0, size);
    record.data = at + 8 + size;
    const std::uint32_t data_size = u32_at(std::string_view(rest).substr(size));
    if (data_size > end - record.data) fail(at, "a record goes beyond the end");
    record.end = record.data + data_size;
    check_fields(record.header, at);
    const std::string_view op = record.field("op");
    if (op.size() != 1) fail(at, "a record has no kind");
    record.op = op[0];
    return record;
  }

  /// roscpp believes the lengths of fields, whatever there is behind them, and of two fields of one
  /// name the last, where field() finds the first.
  void check_fields(std::string_view rest, std::uint64_t record_begin) const {
    std::set<std::string_view> names;
    while (!rest.empty()) {
      const bool is_whole = rest.size() >= 4 && u32_at(rest) <= rest.size() - 4;
      const std::string_view item = is_whole ? rest.substr(4, u32_at(rest)) : std::string_view();
      if (item.find('=') == std::string_view::npos ||
          !names.insert(item.substr(0, item.find('='))).second) {
        fail(record_begin, "the header of a record is wrong");
      }
      rest.remove_prefix(4 + item.size());
    }
  }

  std::uint32_t number(const Record& record, std::string_view name) const {
    const std::string_view value = record.field(name);
    if (value.size() != 4) fail(record.begin, "a record lacks a number");
    return u32_at(value);
  }

  std::uint64_t place(const Record& record, std::string_view name) const {
    const std::string_view value = record.field(name);
    std::uint64_t out = 0;
    if (value.size() != sizeof(out)) fail(record.begin, "a record lacks a place");
    std::memcpy(&out, value.data(), sizeof(out));
    return out;
  }

  void check_record(const Record& record) {
    switch (record.op) {
      case kFileHeader:
        return check_file_header(record);
      case kChunk:
        return check_chunk(record);
      case kIndex:
        return check_index(record);
      case kChunkInfo:
        wanted_chunks_.insert(place(record, "chunk_pos"));
        return check_list(record, 8);
      case kConnection:
        return check_connection(record);
      default:
        fail(record.begin, "a record is of an unknown kind");
    }
  }

  /// Its data are the header that the publisher gave.
  void check_connection(const Record& record) {
    connections_.insert(number(record, "conn"));
    ++described_;
    if (record.end - record.data > kMaxHeader) fail(record.begin, "the header of a topic is wrong");
    check_fields(read(record.data, record.end - record.data), record.begin);
  }

  void check_file_header(const Record& record) {
    const std::string_view encryptor = record.field("encryptor");
    if (!encryptor.empty() && encryptor != "rosbag/NoEncryptor") {
      throw InputError(file_ + "  is encrypted, which is not read");
    }
    const std::uint64_t index = place(record, "index_pos");
    if (index == 0) {
      throw InputError(file_ + "  has no index: its recording was not ended" + remedy());
    }
    if (index > size_) fail(size_, "the file ends before its index");
    n_chunks_ = number(record, "chunk_count");
    n_connections_ = number(record, "conn_count");
    index_place_ = index;
    index_is_record_ = index == size_;  // of a bag without topics
  }

  /// A list of items as long as `count` says.
  void check_list(const Record& record, std::uint64_t item_bytes) const {
    if (record.end - record.data != item_bytes * number(record, "count")) {
      fail(record.begin, "a list has another length than it says");
    }
  }

  /// Of the last chunk: rosbag finds no message by itself.
  void require_all_indexed() const {
    const auto found = std::find(is_indexed_.begin(), is_indexed_.end(), false);
    if (found == is_indexed_.end()) return;
    fail(chunk_place_, "a chunk has a message that no index has");
  }

  void check_chunk(const Record& chunk) {
    require_all_indexed();
    chunks_.insert(chunk.begin);
    chunk_place_ = chunk.begin;
    messages_.clear();
    chunk_size_ = number(chunk, "size");
    whole_bytes_ += chunk_size_;
    const std::string_view compression = chunk.field("compression");
    is_compressed_ = compression != "none";
    if (is_compressed_) {
      add_compressed(chunk, compression == "lz4");
      decompress(chunk, compression);
      check_messages(0, chunk_size_);
      chunk_.clear();
    } else {
      if (chunk.end - chunk.data != chunk_size_) fail(chunk.begin, "a chunk has another size");
      check_messages(chunk.data, chunk.end);
    }
    is_indexed_.assign(messages_.size(), false);
  }

  /// The records of a chunk.
  void check_messages(std::uint64_t begin, std::uint64_t end) {
    for (std::uint64_t at = begin; at < end;) {
      const Record record = read_record(at, end);
      if (record.op == kMessage) {
        messages_.push_back(static_cast<std::uint32_t>(at - begin));
      } else if (record.op != kConnection) {
        fail(at, "a record is of an unknown kind");
      }
      at = record.end;
    }
  }

  void decompress(const Record& chunk, std::string_view compression) {
    if (compression != "lz4" && compression != "bz2") {
      fail(chunk.begin, "a chunk is compressed by " + log::quoted(compression));
    }
    std::string from = read(chunk.data, chunk.end - chunk.data);
    rosbag::ChunkedFile no_file;  // of which only writing has any use
    rosbag::StreamFactory streams(&no_file);
    const auto stream = streams.getStream(compression == "lz4" ? rosbag::compression::LZ4
                                                               : rosbag::compression::BZ2);
    chunk_.resize(chunk_size_);
    try {
      stream->decompress(chunk_.data(), chunk_size_, reinterpret_cast<std::uint8_t*>(from.data()),
                         static_cast<unsigned>(from.size()));
    } catch (const std::exception& broken) {
      throw InputError(file_ + "  is damaged: the chunk at byte " + std::to_string(chunk.begin) +
                       " cannot be decompressed: " + broken.what());
    }
  }

  void add_compressed(const Record& chunk, bool is_lz4) {
    if (chunk_size_ > kMostChunk) {
      fail(chunk.begin, "a chunk says to become " + std::to_string(chunk_size_) +
                            " bytes, at most " + std::to_string(kMostChunk) + " are read");
    }
    if (whole_bytes_ > kFreeBytes + kMostRatio * size_) {
      fail(chunk.begin, "the chunks say to become more than " + std::to_string(kMostRatio) +
                            " times as long as the file");
    }
    work_of_.push_back(is_lz4 ? chunk_size_ / kLz4IsFaster : chunk_size_);
  }

  /// Messages are read in the order of their times.
  void check_work() {
    std::stable_sort(entries_.begin(), entries_.end(),
                     [](const Entry& a, const Entry& b) { return a.time < b.time; });
    std::uint64_t work = 0;
    for (std::size_t i = 1; i < entries_.size(); ++i) {
      if (entries_[i].chunk != entries_[i - 1].chunk) work += work_of_[entries_[i].chunk];
    }
    const std::uint64_t usual = std::min(whole_bytes_, kUsualRatio * size_);
    if (work <= kFreeWork + kMostRepeated * usual) return;
    throw InputError(file_ + "  has messages whose chunks alternate, so that " +
                     std::to_string(work >> 20U) +
                     " MiB would be decompressed - `rosbag "
                     "decompress " +
                     file_ + "` makes it quick to read");
  }

  /// Of the messages of the chunk before it.
  void check_index(const Record& record) {
    constexpr std::size_t kEntry = 12;  // time and offset
    indexed_.insert(number(record, "conn"));
    check_list(record, kEntry);
    const std::string data = read(record.data, record.end - record.data);
    for (std::size_t i = 0; i < data.size(); i += kEntry) {
      const std::uint32_t offset = u32_at(std::string_view(data).substr(i + 8));
      const auto message = std::lower_bound(messages_.begin(), messages_.end(), offset);
      if (message == messages_.end() || *message != offset) {
        fail(record.begin, "there is no message where the index has one");
      }
      is_indexed_[static_cast<std::size_t>(message - messages_.begin())] = true;
      if (!is_compressed_) continue;
      const auto seconds = u32_at(std::string_view(data).substr(i));
      const auto nanoseconds = u32_at(std::string_view(data).substr(i + 4));
      entries_.push_back(
          {std::uint64_t{seconds} * 1'000'000'000 + nanoseconds,  // as ros::Time has it
           static_cast<std::uint32_t>(work_of_.size() - 1)});
    }
  }

  std::string file_;
  FileBytes in_;
  std::uint64_t size_;
  std::uint64_t index_place_ = 0;
  bool index_is_record_ = false;
  std::set<std::uint64_t> chunks_, wanted_chunks_;
  std::set<std::uint32_t> connections_, indexed_;
  std::size_t n_chunks_ = 0, n_connections_ = 0;  ///< as the head of the file has them
  std::size_t described_ = 0;                     ///< connections, behind the chunks
  std::uint64_t whole_bytes_ = 0;                 ///< of all chunks, decompressed
  struct Entry {
    std::uint64_t time;
    std::uint32_t chunk;
  };
  std::vector<Entry> entries_;          ///< messages in compressed chunks
  std::vector<std::uint64_t> work_of_;  ///< compressed chunks
  // Of the last chunk:
  std::vector<std::uint8_t> chunk_;      ///< while a compressed one is looked into
  std::vector<std::uint32_t> messages_;  ///< where they are in it
  std::vector<bool> is_indexed_;         ///< of each
  std::uint64_t chunk_place_ = 0;
  std::uint32_t chunk_size_ = 0;
  bool is_compressed_ = false;
};

}  // namespace

std::uint64_t check_structure(const std::string& file) { return Structure(file).check(); }

}  // namespace viwo::bag
