// What a WPILOG file has: its entries, its schemas, and the payloads of the entries that are asked
// for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "log_file.hpp"
#include "schema.hpp"
#include "viwo/api/rejections.hpp"

namespace viwo::wpilog {

/// A record that is kept, or the end of an entry.
struct Datum {
  std::int64_t t_us = 0;
  std::int64_t offset = 0;  ///< in the file
  std::size_t begin = 0;    ///< in Entry::bytes
  std::uint32_t size = 0;
  bool is_end = false;  ///< no value: the entry was finished here
};

struct Entry {
  std::string name;
  std::string type;  ///< "double[]", "struct:Pose2d", ...
  std::int64_t records = 0;
  std::vector<Datum> data;  ///< of an entry that is asked for, in the order of the file
  std::string bytes;

  std::string_view payload(const Datum& datum) const {
    return std::string_view(bytes).substr(datum.begin, datum.size);
  }
};

class Contents {
 public:
  /// Reads the file to its end, or to where it can be read. Kept is what `wanted` names: entries,
  /// or "ENTRY/PATH" within one. InputError for what is no WPILOG, for corrupt gzip data, and for
  /// more than fits into memory.
  Contents(const std::filesystem::path& file, const std::vector<std::string>& wanted);

  std::string file() const { return file_.file().string(); }
  /// "name: byte 17"
  std::string where(std::int64_t offset) const { return file_.where(offset); }
  std::span<const Entry> entries() const { return entries_; }
  const Schemas& schemas() const { return schemas_; }
  const Rejections& rejections() const { return rejections_; }
  /// "; the log is damaged: what, where", or nothing: for what is missing in it.
  std::string damage() const;

  /// The entry of that name, if there is one with records, otherwise one without; nullptr: none.
  /// InputError when records under that name are of two types.
  const Entry* find(std::string_view name) const;

 private:
  void take(const Record& record, const std::vector<std::string>& wanted);
  void take_control(const Record& record);
  bool start(const Record& record);
  bool finish(std::uint32_t id, const Record& record);
  void keep(std::size_t bytes, const Record& record);
  void reject(const char* reason, const Record& record);

  LogFile file_;
  std::vector<Entry> entries_;
  std::unordered_map<std::string, std::size_t> by_name_and_type_;
  std::unordered_map<std::uint32_t, std::size_t> by_id_;
  Schemas schemas_;
  std::size_t most_kept_;
  std::size_t kept_ = 0;  ///< [bytes]
  Rejections rejections_;
};

}  // namespace viwo::wpilog
