// One .db3 of a ROS 2 bag.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "bag_file.hpp"

namespace viwo::bag {

/// Opened so that nothing in the file decides what is run, how long, or for how much memory: real
/// tables only, no trigger, no function of a schema; a query may take a number of steps in
/// proportion to the file, and there are no more rows or bytes than its bytes can hold.
class Database final : public BagFile {
 public:
  explicit Database(const std::filesystem::path& file);

  const std::string& name() const override { return name_; }
  const std::vector<Topic>& topics() const override { return topics_; }
  bool is_empty() const override { return is_empty_; }
  std::int64_t begin_ns() const override { return begin_ns_; }
  /// Rows of no topic and of no time are counted; other damage is an error.
  void read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
            const std::function<void(const Message&)>& visit, Rejections& damage) const override;

 private:
  struct CloseDatabase {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

  /// A message before its bytes are read.
  struct Row {
    std::int64_t id = 0;
    std::size_t topic = 0;
    std::int64_t received_ns = 0;
  };

  [[noreturn]] void fail() const;
  [[noreturn]] void damaged(const std::string& what) const;
  /// What a recorder that was killed has left beside the file: a log (WAL), or a journal of what it
  /// had begun, which only one who writes could take back.
  enum class Beside : std::uint8_t { kNothing, kLog, kJournal };
  void open(const std::filesystem::path& file, Beside beside);
  /// InputError for a view, a virtual table, and one with columns that are computed.
  void require_real_table(const std::string& table) const;
  static int end_of_steps(void* self);
  void allow_steps() const;
  Statement prepare(const std::string& sql) const;
  bool step(const Statement& statement) const;
  void read_topics();
  std::vector<Row> rows(const std::vector<Wanted>& wanted, std::int64_t to_ns,
                        Rejections& damage) const;
  /// At most `limit` bytes of a message.
  void load(std::int64_t id, std::size_t limit, Bytes& out) const;

  std::string name_;
  std::uint64_t size_ = 0;                 ///< of the file and of the log beside it [bytes]
  mutable std::uint64_t blocks_left_ = 0;  ///< of steps that the query may take
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  mutable std::mutex mutex_;  ///< of the database
  std::vector<Topic> topics_;
  std::vector<std::int64_t> topic_ids_;  ///< in the file, of topics_
  bool is_empty_ = true;
  std::int64_t begin_ns_ = 0;
};

}  // namespace viwo::bag
