// Databases that were made to do harm: endless queries, trees that are visited again and again,
// stamps that no clock has. Each was an endless run, or one that took all memory.
#include <cstdint>
#include <limits>

#include "test_fixture.hpp"

namespace viwo {
namespace {

constexpr const char* kTopicsOfOne =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
    "INSERT INTO topics VALUES(1, '/imu0', 'sensor_msgs/msg/Imu', 'cdr');";
constexpr const char* kMessagesOfNone =
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data);";
/// All whole numbers.
constexpr const char* kEndless =
    " AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT ";

class HostileDatabase : public Ros2Bag {
 protected:
  void make(const std::string& sql) const {
    fs::remove(file());
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file().c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
  std::string error(const std::string& rest = "imu_topic: /imu0") const {
    return error_of(section(rest));
  }
  std::string bytes() const { return testing::text_of(file()); }
};

TEST_F(HostileDatabase, ViewsAreRefused) {
  make(std::string(kTopicsOfOne) + "CREATE VIEW messages" + kEndless +
       "x AS id, 1 AS topic_id, x AS timestamp, zeroblob(0) AS data FROM c;");
  EXPECT_THAT(error(), HasSubstr(file() + "  is no ROS 2 bag: 'messages' is no plain table"));
  make(std::string(kMessagesOfNone) + "CREATE VIEW topics" + kEndless +
       "x AS id, '/t' || x AS name, '' AS type, 'cdr' AS serialization_format FROM c;");
  EXPECT_THAT(error(), HasSubstr(file() + "  is no ROS 2 bag: 'topics' is no plain table"));
}

TEST_F(HostileDatabase, VirtualTablesAreRefused) {
  if (sqlite3_compileoption_used("ENABLE_FTS4") == 0) GTEST_SKIP() << "SQLite without FTS4";
  make(std::string(kTopicsOfOne) +
       "CREATE VIRTUAL TABLE messages USING fts4(topic_id, timestamp, data);");
  EXPECT_THAT(error(), HasSubstr("'messages' is no plain table"));
}

TEST_F(HostileDatabase, ColumnsThatAreComputedAreRefused) {
  make(std::string(kTopicsOfOne) +
       "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, "
       "data AS (zeroblob(100000000)));");
  EXPECT_THAT(error(), HasSubstr("the table 'messages' has a column that is computed"));
}

/// Pages that point to each other: 200 kB with more than a million rows.
TEST_F(HostileDatabase, ATreeThatIsVisitedAgainAndAgainIsDamage) {
  make("PRAGMA page_size = 512;" + std::string(kTopicsOfOne) + kMessagesOfNone +
       "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c WHERE x < 15000) "
       "INSERT INTO messages SELECT x, 1, x, x'' FROM c;");
  std::string content = bytes();
  constexpr std::size_t kPage = 512;
  constexpr char kInterior = 5;
  const auto number = [&content](std::size_t at, std::size_t size) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value = value << 8U | static_cast<unsigned char>(content[at + i]);
    }
    return value;
  };
  /// Each child of the page is `child`.
  const auto point = [&](std::size_t page, std::size_t child) {
    const std::size_t at = (page - 1) * kPage;
    const auto set = [&](std::size_t place) {
      for (std::size_t i = 0; i < 4; ++i) {
        content[place + i] = static_cast<char>(child >> (24 - 8 * i));
      }
    };
    set(at + 8);
    for (std::size_t i = 0; i < number(at + 3, 2); ++i) set(at + number(at + 12 + 2 * i, 2));
  };
  std::vector<std::size_t> inner;  // pages, but for the first, which has the schema
  for (std::size_t page = 2; page <= content.size() / kPage; ++page) {
    if (content[(page - 1) * kPage] == kInterior) inner.push_back(page);
  }
  ASSERT_GE(inner.size(), 4U);
  // The root has the smallest number. Under it, two layers instead of one.
  const std::size_t leaf = number((inner[2] - 1) * kPage + 8, 4);
  point(inner[0], inner[1]);
  point(inner[1], inner[2]);
  point(inner[2], leaf);
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error(), HasSubstr("bag_0.db3  is damaged: "));
}

TEST_F(HostileDatabase, StampsOfNoClockAreCountedAndOverflowNothing) {
  {
    Writer out(file());
    out.topic(1, "/imu0", "sensor_msgs/msg/Imu");
    for (int k = 0; k < 400; ++k) out.message(1, kStart + k * kMs, imu(kStart + k * kMs, 0.1));
    using Limits = std::numeric_limits<std::int64_t>;
    for (const std::int64_t t_ns : {Limits::min(), Limits::min() + 1, Limits::max()}) {
      out.message(1, t_ns, imu(kStart, 0.1));
    }
  }
  const auto sensor = make_sensor(section("imu_topic: /imu0, clock: reception"));
  EXPECT_EQ(only<ImuSample>(play(*sensor)).size(), 400U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(::testing::StartsWith("/imu0: stamp of another century | 3 | ")));
  EXPECT_THAT(error("imu_topic: /imu0, start_s: 1e9, duration_s: 1e9"),
              HasSubstr("has no messages in the time that is read"));
}

}  // namespace
}  // namespace viwo
