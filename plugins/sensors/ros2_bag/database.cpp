#include "database.hpp"

#include <algorithm>
#include <limits>
#include <system_error>

#include "viwo/api/status.hpp"
#include "viwo/log/files.hpp"

namespace viwo::bag {

namespace fs = std::filesystem;

Database::Database(const fs::path& file) : name_(file.string()) {
  log::require_regular_file(file);
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) throw InputError(name_ + "  cannot be read: " + error.message());
  if (size == 0) throw InputError(name_ + "  is empty");
  sqlite3* database = nullptr;
  const int status = sqlite3_open_v2(name_.c_str(), &database,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, nullptr);
  database_.reset(database);
  if (status != SQLITE_OK) fail();
  read_topics();
}

void Database::fail() const {
  const int code = sqlite3_errcode(database_.get());
  const char* const what = sqlite3_errmsg(database_.get());
  if (code == SQLITE_NOTADB) throw InputError(name_ + "  is no SQLite database");
  throw InputError(name_ + "  cannot be read as a ROS 2 bag: " + what);
}

Database::Statement Database::prepare(const std::string& sql) const {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    fail();
  }
  return Statement(statement);
}

bool Database::step(const Statement& statement) const {
  const int status = sqlite3_step(statement.get());
  if (status == SQLITE_ROW) return true;
  if (status != SQLITE_DONE) fail();
  return false;
}

void Database::read_topics() {
  const Statement topics = prepare("SELECT id, name, type, serialization_format FROM topics");
  const auto text = [&topics](int column) {
    const unsigned char* const value = sqlite3_column_text(topics.get(), column);
    return std::string(value == nullptr ? "" : reinterpret_cast<const char*>(value));
  };
  while (step(topics)) {
    if (text(3) != "cdr") {
      throw InputError(name_ + "  topic '" + text(1) + "' is serialised as '" + text(3) +
                       "', what is read is cdr");
    }
    topic_ids_.push_back(sqlite3_column_int64(topics.get(), 0));
    topics_.push_back({text(1), text(2)});
  }
  const Statement begin = prepare("SELECT MIN(timestamp) FROM messages");
  if (!step(begin)) return;
  is_empty_ = sqlite3_column_type(begin.get(), 0) == SQLITE_NULL;
  begin_ns_ = sqlite3_column_int64(begin.get(), 0);
}

std::vector<Database::Row> Database::rows(const std::vector<Wanted>& wanted,
                                          std::int64_t to_ns) const {
  const Statement messages = prepare(
      "SELECT rowid, topic_id, timestamp FROM messages WHERE timestamp <= ?1 "
      "ORDER BY timestamp, rowid");
  sqlite3_bind_int64(messages.get(), 1, to_ns);
  std::vector<Row> rows;
  while (step(messages)) {
    const std::int64_t id = sqlite3_column_int64(messages.get(), 1);
    const auto known = std::find(topic_ids_.begin(), topic_ids_.end(), id);
    if (known == topic_ids_.end()) continue;
    const Topic& topic = topics_[static_cast<std::size_t>(known - topic_ids_.begin())];
    const auto found = std::find_if(wanted.begin(), wanted.end(),
                                    [&topic](const Wanted& one) { return one.name == topic.name; });
    if (found == wanted.end()) continue;
    rows.push_back({sqlite3_column_int64(messages.get(), 0),
                    static_cast<std::size_t>(found - wanted.begin()),
                    sqlite3_column_int64(messages.get(), 2)});
  }
  return rows;
}

void Database::load(std::int64_t id, std::size_t limit, Bytes& out) const {
  const std::scoped_lock lock(mutex_);
  sqlite3_blob* blob = nullptr;
  // Without this, all of an image would be read for its head.
  if (sqlite3_blob_open(database_.get(), "main", "messages", "data", id, 0, &blob) != SQLITE_OK) {
    fail();
  }
  const std::unique_ptr<sqlite3_blob, void (*)(sqlite3_blob*)> close(
      blob, [](sqlite3_blob* open) { sqlite3_blob_close(open); });
  out.resize(std::min(limit, static_cast<std::size_t>(sqlite3_blob_bytes(blob))));
  if (sqlite3_blob_read(blob, out.data(), static_cast<int>(out.size()), 0) != SQLITE_OK) fail();
}

void Database::read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
                    const std::function<void(const Message&)>& visit,
                    Rejections& /*damage*/) const {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  std::vector<std::int64_t> numbers(wanted.size(), 0);
  Bytes bytes;
  for (const Row& row : rows(wanted, to_ns)) {
    const std::int64_t number = ++numbers[row.topic];
    if (row.received_ns < from_ns) continue;
    const bool large = wanted[row.topic].large;
    load(row.id, large ? kHeadBytes : kAll, bytes);
    Message message;
    message.topic = row.topic;
    message.received_ns = row.received_ns;
    message.number = number;
    message.file = &name_;
    message.bytes = bytes;
    if (large) message.load = [this, id = row.id](Bytes& out) { load(id, kAll, out); };
    visit(message);
  }
}

}  // namespace viwo::bag
