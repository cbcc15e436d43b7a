// Small ROS 2 bags, whose messages fastcdr writes: by SQLite with the tables of rosbag2.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "cdr_message.hpp"
#include "peak_memory.hpp"
#include "support.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {

namespace fs = std::filesystem;
using eprosima::fastcdr::Cdr;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::peak_mb;

inline constexpr std::int64_t kStart = 1'700'000'000'123'456'789;
inline constexpr std::int64_t kMs = 1'000'000;

/// A message in the making, as the tables of SQLite take it.
class Cdr2 : public bag::CdrMessage {
 public:
  using CdrMessage::CdrMessage;
  std::string text() {
    const auto all = bytes();
    return {all.begin(), all.end()};
  }
};

inline std::string imu(std::int64_t t_ns, double x,
                       Cdr::Endianness order = Cdr::LITTLE_ENDIANNESS) {
  Cdr2 out(order);
  out.header(t_ns, "imu_link") << std::array{0., 0., 0., 1.} << std::array<double, 9>{}
                               << std::array{x, -x, 0.2} << std::array<double, 9>{}
                               << std::array{1., x, 9.81} << std::array<double, 9>{};
  return out.text();
}

inline std::string joints(std::int64_t t_ns, double x) {
  Cdr2 out;
  out.header(t_ns, "") << std::vector<std::string>{"steer", "drive"} << std::vector<double>{x, 0.}
                       << std::vector<double>{0., 3. + x} << std::vector<double>{};
  return out.text();
}

inline std::string image(std::int64_t t_ns, std::uint8_t value, std::size_t size = 6) {
  Cdr2 out;
  out.header(t_ns, "camera") << std::uint32_t{2} << std::uint32_t{3} << std::string("mono8")
                             << std::uint8_t{0} << std::uint32_t{3}
                             << std::vector<std::uint8_t>(size, value);
  return out.text();
}

/// Writes a .db3 with the tables of rosbag2.
class Writer {
 public:
  explicit Writer(const std::string& file) {
    sqlite3* database = nullptr;
    EXPECT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    database_.reset(database);
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
        "timestamp INTEGER NOT NULL, data BLOB NOT NULL)");
    run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    run("BEGIN");
  }
  ~Writer() { run("COMMIT"); }

  void topic(int id, const std::string& name, const std::string& type,
             const std::string& format = "cdr") {
    run("INSERT INTO topics VALUES (" + std::to_string(id) + ", '" + name + "', '" + type + "', '" +
        format + "', '')");
  }
  void message(int topic, std::int64_t received_ns, const std::string& data) {
    sqlite3_stmt* insert = nullptr;
    ASSERT_EQ(
        sqlite3_prepare_v2(database_.get(),
                           "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)",
                           -1, &insert, nullptr),
        SQLITE_OK);
    sqlite3_bind_int(insert, 1, topic);
    sqlite3_bind_int64(insert, 2, received_ns);
    sqlite3_bind_blob(insert, 3, data.data(), static_cast<int>(data.size()), SQLITE_STATIC);
    EXPECT_EQ(sqlite3_step(insert), SQLITE_DONE);
    sqlite3_finalize(insert);
  }

 private:
  void run(const std::string& sql) {
    ASSERT_EQ(sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database_.get());
  }
  struct Close {
    void operator()(sqlite3* database) const { sqlite3_close(database); }
  };
  std::unique_ptr<sqlite3, Close> database_;
};

class Ros2Bag : public testing::InFolder {
 protected:
  std::string file(const std::string& name = "bag_0.db3") const {
    return (folder_ / name).string();
  }
  std::string section(const std::string& rest, const std::string& name = "bag_0.db3") const {
    return "{type: ros2_bag, path: " + file(name) + ", " + rest + "}";
  }

  /// Samples begin..end-1 at 5 ms, images and poses at each fourth.
  void write_drive(const std::string& name = "bag_0.db3", int begin = 0, int end = 20) const {
    Writer out(file(name));
    out.topic(1, "/imu0", "sensor_msgs/msg/Imu");
    out.topic(2, "/joints", "sensor_msgs/msg/JointState");
    out.topic(3, "/cam0", "sensor_msgs/msg/Image");
    out.topic(4, "/png", "sensor_msgs/msg/CompressedImage");
    out.topic(5, "/pose", "geometry_msgs/msg/PoseStamped");
    out.topic(6, "/odom", "nav_msgs/msg/Odometry");
    for (int k = begin; k < end; ++k) {
      const std::int64_t t = kStart + 5 * k * kMs;
      const double x = 0.1 * k + 1. / 3.;
      out.message(1, t + kMs, imu(t, x));
      out.message(2, t + kMs, joints(t, x));
      if (k % 4 != 0) continue;
      out.message(3, t + kMs, image(t, static_cast<std::uint8_t>(k)));
      out.message(4, t + kMs, png(t, static_cast<std::uint8_t>(k + 100)));
      Cdr2 pose, odometry;
      pose.header(t) << std::array{x, 1., 2.} << std::array{0., 0., 0.6, 0.8};
      odometry.header(t) << std::string("base_link") << std::array{x, 3., 4.}
                         << std::array{0.6, 0., 0., 0.8} << std::array<double, 36>{}
                         << std::array<double, 6>{} << std::array<double, 36>{};
      out.message(5, t + kMs, pose.text());
      out.message(6, t + kMs, odometry.text());
    }
  }

  static std::string png(std::int64_t t_ns, std::uint8_t value) {
    Cdr2 out;
    // A frame so long that its head alone would not do as a message.
    out.header(t_ns, std::string(100, 'x')) << std::string("png") << encode_png({2, 1, {value, 7}});
    return out.text();
  }

  void write_metadata(const std::string& storage, const std::string& compression,
                      const std::string& files, const std::string& mode = "") const {
    std::ofstream(folder_ / "metadata.yaml")
        << "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: " << storage
        << "\n  compression_format: \"" << compression << "\"\n  compression_mode: \"" << mode
        << "\"\n"
        << "  relative_file_paths: " << files << "\n";
  }

  static constexpr const char* kAll =
      "imu_topic: /imu0, joint_topic: /joints, drive_joints: [drive], steer_joints: [steer], "
      "image_topics: [/cam0, /png], pose_topic: /pose";
};

}  // namespace viwo
