#include "contents.hpp"

#include <algorithm>
#include <optional>
#include <system_error>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::wpilog {
namespace {

constexpr std::size_t kMostEntries = 65536;
constexpr std::size_t kLongestName = 1024;
/// Of all that is named: an hour of four modules at 250 Hz has 200 MB. A record of one byte is kept
/// in six times as many, and gzip makes it smaller.
constexpr std::size_t kMostKept = std::size_t{512} << 20, kFreeKept = std::size_t{64} << 20;
constexpr std::size_t kMostRatio = 32;

std::size_t most_kept(const std::filesystem::path& file) {
  std::error_code unknown;
  const auto size = std::filesystem::file_size(file, unknown);
  if (unknown || size > kMostKept / kMostRatio) return kMostKept;
  return std::min(kMostKept, kFreeKept + kMostRatio * static_cast<std::size_t>(size));
}
constexpr std::string_view kSchema = ".schema/struct:";

enum Control : char { kStart = 0, kFinish = 1, kSetMetadata = 2 };

/// A text behind its length; nothing where it is cut.
std::optional<std::string_view> take_text(std::string_view& rest) {
  if (rest.size() < 4) return std::nullopt;
  const std::uint64_t size = little_endian(rest.data(), 4);
  if (rest.size() - 4 < size) return std::nullopt;
  const std::string_view text = rest.substr(4, size);
  rest.remove_prefix(4 + size);
  return text;
}

bool is_wanted(const std::string& name, const std::vector<std::string>& wanted) {
  return std::any_of(wanted.begin(), wanted.end(), [&](const std::string& want) {
    return want.starts_with(name) && (want.size() == name.size() || want[name.size()] == '/');
  });
}

}  // namespace

Contents::Contents(const std::filesystem::path& file, const std::vector<std::string>& wanted)
    : file_(file), most_kept_(most_kept(file)) {
  for (Record record; file_.next(record);) {
    if (record.entry == 0) {
      take_control(record);
    } else {
      take(record, wanted);
    }
  }
  if (file_.fault() == nullptr) return;
  rejections_.add(file_.fault(), [this] { return where(file_.offset()); });
}

std::string Contents::damage() const {
  const auto& counts = rejections_.counts();
  if (counts.empty()) return {};
  return "; the log is damaged: " + counts.back().reason + " (first at " + counts.back().first +
         ")";
}

void Contents::keep(std::size_t bytes, const Record& record) {
  kept_ += bytes;
  if (kept_ <= most_kept_) return;
  throw InputError(file() + "  has more than " + std::to_string(most_kept_ >> 20) +
                   " MiB of records of the entries that are named, up to byte " +
                   std::to_string(record.offset) + ": too much for a log of a robot");
}

void Contents::reject(const char* reason, const Record& record) {
  rejections_.add(reason, [&] { return where(record.offset); });
}

void Contents::take(const Record& record, const std::vector<std::string>& wanted) {
  const auto id = by_id_.find(record.entry);
  if (id == by_id_.end()) return reject("record of an entry that was not started", record);
  Entry& entry = entries_[id->second];
  ++entry.records;
  const bool is_schema =
      entry.type == "structschema" && entry.name.find(kSchema) != entry.name.npos;
  if (!is_schema && !is_wanted(entry.name, wanted)) return;
  keep(record.payload.size() + sizeof(Datum), record);
  if (is_schema) {
    const std::string of = entry.name.substr(entry.name.find(kSchema) + kSchema.size());
    if (record.size > kMaxPayload) return schemas_.add_too_long(of);
    return schemas_.add(of, record.payload);
  }
  if (record.size > kMaxPayload) return reject("record of more than 1 MiB", record);
  entry.data.push_back({record.t_us, record.offset, entry.bytes.size(), record.size});
  entry.bytes += record.payload;
}

void Contents::take_control(const Record& record) {
  const std::string_view payload = record.payload;
  bool can_be_read = payload.size() >= 5;
  if (can_be_read) {
    const auto id = static_cast<std::uint32_t>(little_endian(&payload[1], 4));
    switch (payload[0]) {
      case kStart:
        can_be_read = start(record);
        break;
      case kFinish:
        can_be_read = finish(id, record);
        break;
      case kSetMetadata:
        break;  // of no use here
      default:
        can_be_read = false;
    }
  }
  if (!can_be_read) reject("control record that cannot be read", record);
}

/// What was written last holds no longer.
bool Contents::finish(std::uint32_t id, const Record& record) {
  const auto known = by_id_.find(id);
  if (known == by_id_.end()) return false;
  Entry& entry = entries_[known->second];
  by_id_.erase(known);
  if (entry.data.empty()) return true;
  keep(sizeof(Datum), record);
  entry.data.push_back({std::max(record.t_us, entry.data.back().t_us), record.offset, 0, 0, true});
  return true;
}

bool Contents::start(const Record& record) {
  std::string_view payload = record.payload;
  const auto id = static_cast<std::uint32_t>(little_endian(&payload[1], 4));
  payload.remove_prefix(5);
  const auto name = take_text(payload);
  const auto type = name ? take_text(payload) : std::nullopt;
  if (!type || name->size() > kLongestName || type->size() > kLongestName || id == 0) return false;
  std::string key = std::string(*name) + '\0' + std::string(*type);
  const auto [known, is_new] = by_name_and_type_.try_emplace(std::move(key), entries_.size());
  if (is_new) {
    if (entries_.size() == kMostEntries) {
      throw InputError(file() + "  has more than " + std::to_string(kMostEntries) + " entries");
    }
    keep(sizeof(Entry) + name->size() + type->size(), record);
    entries_.push_back({std::string(*name), std::string(*type), 0, {}, {}});
  }
  const auto before = by_id_.find(id);
  if (before != by_id_.end() && before->second != known->second) {
    const std::string old = entries_[before->second].name;
    rejections_.add("entry started by the number of another one, which was not finished", [&] {
      return where(record.offset) + ", " + log::quoted(*name) + " in place of " + log::quoted(old);
    });
    finish(id, record);
  }
  by_id_[id] = known->second;
  return true;
}

const Entry* Contents::find(std::string_view name) const {
  const Entry* found = nullptr;
  for (const Entry& entry : entries_) {
    if (entry.name != name) continue;
    if (found != nullptr && found->records > 0 && entry.records > 0) {
      throw InputError(file() + "  the entry '" + std::string(name) + "' is of two types, " +
                       log::quoted(found->type) + " and " + log::quoted(entry.type));
    }
    if (found == nullptr || entry.records > 0) found = &entry;
  }
  return found;
}

}  // namespace viwo::wpilog
