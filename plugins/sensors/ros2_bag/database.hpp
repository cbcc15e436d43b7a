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

class Database final : public BagFile {
 public:
  explicit Database(const std::filesystem::path& file);

  const std::string& name() const override { return name_; }
  const std::vector<Topic>& topics() const override { return topics_; }
  bool is_empty() const override { return is_empty_; }
  std::int64_t begin_ns() const override { return begin_ns_; }
  /// Damage is an error.
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
  Statement prepare(const std::string& sql) const;
  bool step(const Statement& statement) const;
  void read_topics();
  std::vector<Row> rows(const std::vector<Wanted>& wanted, std::int64_t to_ns) const;
  /// At most `limit` bytes of a message.
  void load(std::int64_t id, std::size_t limit, Bytes& out) const;

  std::string name_;
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  mutable std::mutex mutex_;  ///< of the database
  std::vector<Topic> topics_;
  std::vector<std::int64_t> topic_ids_;  ///< in the file, of topics_
  bool is_empty_ = true;
  std::int64_t begin_ns_ = 0;
};

}  // namespace viwo::bag
