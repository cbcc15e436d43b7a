#include "mcap_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>

#include "mcap_records.hpp"
#include "viwo/api/status.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::bag {

namespace fs = std::filesystem;
using mcap::Chunk;

McapFile::McapFile(const fs::path& file)
    : file_(file.string()), structure_(mcap::read_structure(file_)) {
  if (!structure_.has_all_channels) find_channels();
  channels_ = structure_.channels.all();
  for (const auto& [id, channel] : channels_) {
    add_topic(file_.name(), {channel.topic, channel.type}, topics_);
  }
}

void McapFile::fail(std::size_t chunk, const std::string& what) const {
  throw InputError(file_.name() + "  is damaged: in the chunk at byte " +
                   std::to_string(structure_.chunks[chunk].place) + ", " + what);
}

void McapFile::find_channels() {
  for (std::size_t i = 0; i < structure_.chunks.size(); ++i) {
    if (!structure_.chunks[i].has_record) continue;
    const mcap::Content content = mcap::read_chunk(file_, structure_.chunks[i]);
    if (!content.fault.empty()) {
      if (damage_.empty()) {
        damage_ = file_.name() + ": the chunk at byte " +
                  std::to_string(structure_.chunks[i].place) + " " + content.fault;
      }
      continue;
    }
    try {
      mcap::for_each_record(content.records, structure_.chunks[i].is_cut,
                            [this](std::uint8_t op, std::span<const std::uint8_t> fields, auto) {
                              if (op == mcap::kSchema) structure_.channels.add_schema(fields);
                              if (op == mcap::kChannel) structure_.channels.add_channel(fields);
                            });
    } catch (const mcap::BrokenRecord& broken) {
      fail(i, broken.what());
    }
  }
}

std::int64_t McapFile::begin_ns() const {
  std::optional<std::int64_t> begin_ns;
  for (const Chunk& chunk : structure_.chunks) {
    if (chunk.begin_ns == 0 && chunk.has_record) continue;  // a chunk without messages
    begin_ns = std::min(begin_ns.value_or(chunk.begin_ns), chunk.begin_ns);
  }
  return begin_ns.value_or(0);
}

McapFile::Records McapFile::load(std::size_t chunk) const {
  constexpr std::size_t kKeptBytes = 32 << 20, kKept = 64;
  const std::scoped_lock lock(mutex_);
  const auto known = std::find_if(kept_.begin(), kept_.end(),
                                  [chunk](const auto& item) { return item.first == chunk; });
  if (known != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, known);
    return kept_.front().second;
  }
  const auto size = [](std::size_t sum, const auto& item) {
    return sum + item.second->records.capacity();
  };
  while (kept_.size() >= kKept ||
         std::accumulate(kept_.begin(), kept_.end(), std::size_t{0}, size) > kKeptBytes) {
    kept_.pop_back();
  }
  kept_.emplace_front(chunk, std::make_shared<const mcap::Content>(
                                 mcap::read_chunk(file_, structure_.chunks[chunk])));
  return kept_.front().second;
}

void McapFile::load(std::size_t chunk, std::size_t offset, std::size_t size, Bytes& out) const {
  const Records content = load(chunk);
  if (!content->fault.empty() || offset + size > content->records.size()) {
    fail(chunk, "what has been there is there no more");
  }
  const auto bytes = std::span(content->records).subspan(offset, size);
  out.assign(bytes.begin(), bytes.end());
}

/// One pass through the file. Chunks may overlap in time: messages wait, with what is read of them,
/// until no later chunk can have earlier ones.
class McapFile::Reading {
 public:
  Reading(const McapFile& file, const std::vector<Wanted>& wanted, std::int64_t from_ns,
          std::int64_t to_ns, const std::function<void(const Message&)>& visit, Rejections& damage)
      : file_(file),
        wanted_(wanted),
        from_ns_(from_ns),
        to_ns_(to_ns),
        visit_(visit),
        damage_(damage),
        numbers_(wanted.size(), 0) {
    for (const auto& [id, channel] : file.channels_) {
      const auto found =
          std::find_if(wanted.begin(), wanted.end(),
                       [&topic = channel.topic](const Wanted& one) { return one.name == topic; });
      topics_[id] = static_cast<std::size_t>(found - wanted.begin());
      if (found == wanted.end() || channel.encoding == "cdr") continue;
      throw InputError(file.name() + "  topic '" + channel.topic + "' is serialised as '" +
                       channel.encoding + "', what is read is cdr");
    }
  }

  void read() {
    const auto& chunks = file_.structure_.chunks;
    std::vector<std::size_t> order(chunks.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&chunks](std::size_t a, std::size_t b) {
      return chunks[a].begin_ns < chunks[b].begin_ns;
    });
    for (const std::size_t i : order) {
      visit_before(chunks[i].begin_ns);
      if (chunks[i].begin_ns > to_ns_) break;
      read_chunk(i);
    }
    visit_before(kNever);
    report();
  }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  /// Bytes for a message that waits, beside its own; what may wait, all together and as many times
  /// as the file is long.
  static constexpr std::uint64_t kPlace = 150, kFree = 64 << 20, kMostRatio = 32;

  /// Messages that are read: so many, and one for so many bytes of the file. Empty ones become
  /// hundreds of times as short as they are, and what is wrong with each is found by itself.
  static constexpr std::uint64_t kFreeMessages = 100'000, kFileBytesOfOne = 4;

  /// When received; of one time as in the file: the chunk, and where in it.
  using Key = std::tuple<std::int64_t, std::size_t, std::size_t>;
  struct Lost {
    std::size_t chunk;
    std::uint64_t n_messages;
    bool is_counted;  ///< otherwise there may be more
    std::string fault;
  };
  struct Waiting {
    std::size_t topic;
    std::size_t size;  ///< of the message
    Bytes bytes;       ///< of a large one its head
  };

  void read_chunk(std::size_t i) {
    const Records content = file_.load(i);
    const Chunk& chunk = file_.structure_.chunks[i];
    const bool is_good = content->fault.empty();
    std::uint64_t n = 0;
    try {
      mcap::for_each_record(
          content->records, chunk.is_cut || !is_good,
          [&](std::uint8_t op, std::span<const std::uint8_t> fields, std::size_t at) {
            if (op == mcap::kChunk) {
              damage_.add("chunk within a chunk: it is not read",
                          [&] { return place(chunk.place); });
            }
            if (op != mcap::kMessage) return;
            ++n;
            if (is_good) take(i, fields, at + mcap::kRecordHead);
          });
    } catch (const mcap::BrokenRecord& broken) {
      file_.fail(i, broken.what());
    }
    if (is_good && span_ns(chunk) > 0.) {
      read_messages_ += static_cast<double>(n);
      read_ns_ += span_ns(chunk);
    }
    if (!is_good) {
      const bool is_counted = chunk.n_messages > 0 || content->records.size() == chunk.whole_bytes;
      lost_.push_back({i, std::max(n, chunk.n_messages), is_counted, content->fault});
    }
  }

  void take(std::size_t chunk, std::span<const std::uint8_t> fields, std::size_t at) {
    mcap::Fields in(fields);
    const auto topic = topics_.find(in.u16());
    in.u32();  // a number, which need not be one
    const std::uint64_t received_ns = in.u64();
    in.u64();  // when it was sent
    const auto data = in.rest();
    if (topic == topics_.end()) {
      damage_.add("message of a channel that is described nowhere",
                  [&] { return place(file_.structure_.chunks[chunk].place); });
      return;
    }
    if (topic->second == wanted_.size()) return;
    const auto t_ns = static_cast<std::int64_t>(received_ns);
    if (received_ns >= kNever || t_ns < file_.structure_.chunks[chunk].begin_ns) {
      throw mcap::BrokenRecord("a message was received at " + std::to_string(received_ns) +
                               " ns: before the chunk begins, or never");
    }
    if (t_ns > to_ns_) return;
    if (++taken_ > kFreeMessages + file_.file_.size() / kFileBytesOfOne) {
      throw mcap::BrokenRecord("there are too many messages in it for a file of this size");
    }
    const std::size_t used =
        wanted_[topic->second].large ? std::min(data.size(), kHeadBytes) : data.size();
    waiting_bytes_ += used + kPlace;
    if (waiting_bytes_ > kFree + kMostRatio * file_.file_.size()) {
      throw mcap::BrokenRecord(
          "there are too many messages in it, or too many that are not in the order of time");
    }
    waiting_[{t_ns, chunk, at + mcap::kMessageHead}] = {
        topic->second, data.size(), Bytes(data.begin(), data.begin() + static_cast<long>(used))};
  }

  void visit_before(std::int64_t t_ns) {
    while (!waiting_.empty() && std::get<0>(waiting_.begin()->first) < t_ns) {
      const auto& [key, one] = *waiting_.begin();
      const auto [received_ns, chunk, offset] = key;
      Message message;
      message.topic = one.topic;
      message.number = ++numbers_[one.topic];
      message.received_ns = received_ns;
      message.file = &file_.name();
      message.bytes = one.bytes;
      if (wanted_[one.topic].large) {
        count_work(chunk);
        message.load = [&file = file_, chunk = chunk, offset = offset,
                        size = one.size](Bytes& out) { file.load(chunk, offset, size, out); };
      }
      if (received_ns >= from_ns_) visit_(message);
      waiting_bytes_ -= one.bytes.size() + kPlace;
      waiting_.erase(waiting_.begin());
    }
  }

  /// Large messages are loaded again, one after the other: what alternates between chunks is
  /// decompressed again and again.
  void count_work(std::size_t chunk) {
    constexpr std::uint64_t kFreeWork = 4ULL << 30, kMostRepeated = 16;
    if (chunk == last_large_) return;
    last_large_ = chunk;
    work_ += file_.structure_.chunks[chunk].whole_bytes;
    if (work_ <= kFreeWork + kMostRepeated * file_.structure_.whole_bytes) return;
    throw InputError(file_.name() +
                     "  has images whose chunks alternate, so that they would be "
                     "decompressed " +
                     std::to_string(kMostRepeated) + " times and more");
  }

  static double span_ns(const Chunk& chunk) {
    return std::max(0., static_cast<double>(chunk.end_ns) - static_cast<double>(chunk.begin_ns));
  }

  /// Where no index tells how many messages a chunk had, they were as dense as the others.
  void report(const Lost& lost) {
    const Chunk& chunk = file_.structure_.chunks[lost.chunk];
    auto n = static_cast<double>(lost.n_messages);
    std::string more;
    if (!lost.is_counted && read_ns_ > 0.) {
      const double by_time = read_messages_ * span_ns(chunk) / read_ns_;
      const auto most = static_cast<double>(chunk.whole_bytes / mcap::kMessageHead);
      n = std::max(n, std::min(by_time, most));
      more = ", which has " + number_text(1e-9 * span_ns(chunk)) +
             " s: their number is that of others in this time";
    }
    damage_.add(
        "message of a chunk that " + lost.fault, [&] { return place(chunk.place) + more; },
        std::max<std::int64_t>(std::llround(n), 1));
  }

  void report() {
    for (const Lost& lost : lost_) report(lost);
    const mcap::Structure& structure = file_.structure_;
    if (structure.has_wrong_summary) {
      damage_.add("summary that is damaged: the messages were found without it",
                  [&] { return place(structure.end); });
    }
    if (structure.n_behind > 0) {
      damage_.add(
          "chunk or message behind the end of the data: it is not read",
          [&] { return place(structure.end); }, static_cast<std::int64_t>(structure.n_behind));
    }
    if (structure.n_missing > 0) {
      damage_.add(
          "chunk that the summary counts and that is not there: what it held is lost",
          [&] { return place(structure.end); }, static_cast<std::int64_t>(structure.n_missing));
    }
    if (structure.has_end) return;
    const std::uint64_t left = file_.file_.size() - structure.end;
    damage_.add(
        "file without its end: it is read up to where it was cut off, or its recorder "
        "stopped",
        [&] { return place(structure.end) + ", " + std::to_string(left) + " bytes left"; });
  }

  /// "bag_0.mcap: byte 1234"
  std::string place(std::uint64_t at) const {
    return fs::path(file_.name()).filename().string() + ": byte " + std::to_string(at);
  }

  const McapFile& file_;
  const std::vector<Wanted>& wanted_;
  std::int64_t from_ns_, to_ns_;
  const std::function<void(const Message&)>& visit_;
  Rejections& damage_;
  std::map<std::uint16_t, std::size_t> topics_;  ///< of channels; wanted_.size(): not wanted
  std::vector<std::int64_t> numbers_;
  std::map<Key, Waiting> waiting_;
  std::uint64_t waiting_bytes_ = 0;
  std::uint64_t taken_ = 0;  ///< messages
  std::vector<Lost> lost_;
  std::size_t last_large_ = std::numeric_limits<std::size_t>::max();  ///< its chunk
  std::uint64_t work_ = 0;                    ///< bytes that loading large messages decompresses
  double read_messages_ = 0., read_ns_ = 0.;  ///< of the chunks that are as they were written
};

void McapFile::read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
                    const std::function<void(const Message&)>& visit, Rejections& damage) const {
  Reading(*this, wanted, from_ns, to_ns, visit, damage).read();
}

}  // namespace viwo::bag
