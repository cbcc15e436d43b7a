#include "database.hpp"

#include <algorithm>
#include <cctype>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "viwo/api/stamp_order.hpp"
#include "viwo/api/status.hpp"
#include "viwo/files/files.hpp"

namespace viwo::bag {

namespace fs = std::filesystem;

namespace {

/// A message, and all else that is one value.
constexpr int kMostBytes = 256 << 20;
/// A row of a bag has more than this, its place in a page and its page in the tree included.
constexpr std::uint64_t kLeastRow = 8;
/// Steps of SQLite's machine between two looks. A row is read, compared and sorted in less than 40,
/// and has more than 8 bytes.
constexpr int kBlock = 100'000;
constexpr std::uint64_t kStepsPerByte = 5, kFreeBlocks = 10;

std::string text_in(sqlite3_stmt* statement, int column) {
  const unsigned char* const value = sqlite3_column_text(statement, column);
  return value == nullptr ? "" : reinterpret_cast<const char*>(value);
}

/// All that a file could bring along is off, and the sizes are those of a bag.
void defend(sqlite3* database) {
  for (const int option : {SQLITE_DBCONFIG_ENABLE_TRIGGER, SQLITE_DBCONFIG_ENABLE_VIEW,
                           SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
    sqlite3_db_config(database, option, 0, nullptr);
  }
  sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  const std::pair<int, int> limits[] = {{SQLITE_LIMIT_LENGTH, kMostBytes},
                                        {SQLITE_LIMIT_SQL_LENGTH, 100'000},
                                        {SQLITE_LIMIT_COLUMN, 100},
                                        {SQLITE_LIMIT_EXPR_DEPTH, 20},
                                        {SQLITE_LIMIT_COMPOUND_SELECT, 2},
                                        {SQLITE_LIMIT_VDBE_OP, 25'000},
                                        {SQLITE_LIMIT_FUNCTION_ARG, 8},
                                        {SQLITE_LIMIT_ATTACHED, 0},
                                        {SQLITE_LIMIT_LIKE_PATTERN_LENGTH, 50},
                                        {SQLITE_LIMIT_TRIGGER_DEPTH, 1},
                                        {SQLITE_LIMIT_WORKER_THREADS, 0}};
  for (const auto& [limit, most] : limits) sqlite3_limit(database, limit, most);
}

}  // namespace

Database::Database(const fs::path& link) : name_(link.string()) {
  files::require_regular_file(link);
  std::error_code error;
  // SQLite looks for what is beside the file that a link leads to.
  const fs::path file = fs::weakly_canonical(link, error);
  const auto size = fs::file_size(file, error);
  if (error) throw InputError(name_ + "  cannot be read: " + error.message());
  if (size == 0) throw InputError(name_ + "  is empty");
  for (const char* const beside : {"-journal", "-wal", "-shm"}) {
    files::require_regular_file(file.string() + beside);
  }
  // Of a recorder that was killed most may still be in the log beside it.
  const auto size_of = [&file](const char* beside) {
    std::error_code none;
    const auto bytes = fs::file_size(file.string() + beside, none);
    return none ? 0 : bytes;
  };
  const auto log_size = size_of("-wal");
  size_ = size + log_size;
  open(file, log_size > 0              ? Beside::kLog
             : size_of("-journal") > 0 ? Beside::kJournal
                                       : Beside::kNothing);
  for (const char* const table : {"topics", "messages"}) require_real_table(table);
  read_topics();
}

void Database::open(const fs::path& file, Beside beside) {
  std::string uri = "file:";
  for (const char c : fs::absolute(file).string()) {
    constexpr const char* kDigits = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain =
        std::isalnum(byte) != 0 || std::string_view("/._-").find(c) != std::string_view::npos;
    uri +=
        is_plain ? std::string(1, c) : std::string{'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
  }
  // Without this SQLite makes files beside one that was written with a log.
  if (beside == Beside::kNothing) uri += "?immutable=1";
  sqlite3* database = nullptr;
  const int status = sqlite3_open_v2(uri.c_str(), &database,
                                     SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_URI,
                                     beside == Beside::kLog ? "unix-none" : nullptr);
  database_.reset(database);
  if (status != SQLITE_OK) fail();
  defend(database);
  if (beside == Beside::kLog) {
    // The index of the log stays in memory, the log as it is.
    sqlite3_db_config(database, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
    step(prepare("PRAGMA locking_mode = EXCLUSIVE"));
  }
  sqlite3_progress_handler(database, kBlock, end_of_steps, this);
  // The file has its word for the first time.
  step(prepare("PRAGMA cell_size_check = ON"));
}

int Database::end_of_steps(void* self) {
  auto& left = static_cast<Database*>(self)->blocks_left_;
  return left == 0 || --left == 0 ? 1 : 0;
}

void Database::require_real_table(const std::string& table) const {
  const Statement found =
      prepare("SELECT type, rootpage FROM sqlite_master WHERE name = '" + table + "'");
  if (!step(found)) {
    throw InputError(name_ + "  cannot be read as a ROS 2 bag: no such table: " + table);
  }
  // A view and a virtual table have no pages.
  if (text_in(found.get(), 0) != "table" || sqlite3_column_int64(found.get(), 1) <= 0) {
    throw InputError(name_ + "  is no ROS 2 bag: '" + table + "' is no plain table");
  }
  const Statement columns = prepare("PRAGMA table_xinfo('" + table + "')");
  while (step(columns)) {
    constexpr int kHidden = 6;
    if (sqlite3_column_int(columns.get(), kHidden) == 0) continue;
    throw InputError(name_ + "  is no ROS 2 bag: the table '" + table +
                     "' has a column that is computed");
  }
}

void Database::fail() const {
  const int code = sqlite3_errcode(database_.get());
  const char* const what = sqlite3_errmsg(database_.get());
  if (code == SQLITE_INTERRUPT) damaged("a query takes longer than one of its size can");
  if (code == SQLITE_NOTADB) throw InputError(name_ + "  is no SQLite database");
  throw InputError(name_ + "  cannot be read as a ROS 2 bag: " + what);
}

void Database::damaged(const std::string& what) const {
  throw InputError(name_ + "  is damaged: " + what);
}

void Database::allow_steps() const { blocks_left_ = kFreeBlocks + kStepsPerByte * size_ / kBlock; }

Database::Statement Database::prepare(const std::string& sql) const {
  allow_steps();
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
  const auto text = [&topics](int column) { return text_in(topics.get(), column); };
  while (step(topics)) {
    for (const int column : {1, 2, 3}) check_topic(name_, text(column), topics_.size());
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
  begin_ns_ =
      std::clamp(std::int64_t{sqlite3_column_int64(begin.get(), 0)}, -kMaxStampNs, kMaxStampNs);
}

std::vector<Database::Row> Database::rows(const std::vector<Wanted>& wanted, std::int64_t to_ns,
                                          Rejections& damage) const {
  const Statement messages = prepare(
      "SELECT rowid, topic_id, timestamp FROM messages "
      "WHERE timestamp <= ?1 OR typeof(timestamp) <> 'integer' ORDER BY timestamp, rowid");
  sqlite3_bind_int64(messages.get(), 1, to_ns);
  std::vector<Row> rows;
  const auto reject = [&](const char* reason) {
    damage.add(reason, [&] {
      return fs::path(name_).filename().string() + ": row " +
             std::to_string(sqlite3_column_int64(messages.get(), 0));
    });
  };
  while (step(messages)) {
    const std::int64_t id = sqlite3_column_int64(messages.get(), 1);
    const auto known = std::find(topic_ids_.begin(), topic_ids_.end(), id);
    if (known == topic_ids_.end()) {
      reject("message of a topic that is described nowhere");
      continue;
    }
    const Topic& topic = topics_[static_cast<std::size_t>(known - topic_ids_.begin())];
    const auto found = std::find_if(wanted.begin(), wanted.end(),
                                    [&topic](const Wanted& one) { return one.name == topic.name; });
    if (found == wanted.end()) continue;
    if (sqlite3_column_type(messages.get(), 2) != SQLITE_INTEGER) {
      reject("message whose time of reception is no integer");
      continue;
    }
    if (rows.size() > size_ / kLeastRow) damaged("it has more messages than its bytes can hold");
    rows.push_back({sqlite3_column_int64(messages.get(), 0),
                    static_cast<std::size_t>(found - wanted.begin()),
                    sqlite3_column_int64(messages.get(), 2)});
  }
  return rows;
}

void Database::load(std::int64_t id, std::size_t limit, Bytes& out) const {
  const std::scoped_lock lock(mutex_);
  allow_steps();
  sqlite3_blob* blob = nullptr;
  // Without this, all of an image would be read for its head.
  if (sqlite3_blob_open(database_.get(), "main", "messages", "data", id, 0, &blob) != SQLITE_OK) {
    fail();
  }
  const std::unique_ptr<sqlite3_blob, void (*)(sqlite3_blob*)> close(
      blob, [](sqlite3_blob* open) { sqlite3_blob_close(open); });
  const auto bytes = static_cast<std::uint64_t>(sqlite3_blob_bytes(blob));
  if (bytes > size_) damaged("it has a message that is larger than the file");
  out.resize(std::min(limit, static_cast<std::size_t>(bytes)));
  if (sqlite3_blob_read(blob, out.data(), static_cast<int>(out.size()), 0) != SQLITE_OK) fail();
}

void Database::read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
                    const std::function<void(const Message&)>& visit, Rejections& damage) const {
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();
  std::vector<std::int64_t> numbers(wanted.size(), 0);
  Bytes bytes;
  std::uint64_t read = 0;
  for (const Row& row : rows(wanted, to_ns, damage)) {
    const std::int64_t number = ++numbers[row.topic];
    if (row.received_ns < from_ns) continue;
    const bool large = wanted[row.topic].large;
    load(row.id, large ? kHeadBytes : kAll, bytes);
    read += bytes.size();
    if (read > size_) damaged("its messages have more bytes than the file");
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
