// Small files that would become large, each through the whole program: refused by name, in little
// memory and time. What is refused and why is tested beside each reader.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMiB = 1 << 20;

/// As the format has it: little endian.
template <class T>
std::string bytes_of_number(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

std::string behind_its_length(const std::string& text) {
  return bytes_of_number(static_cast<std::uint32_t>(text.size())) + text;
}

std::string times(std::size_t n, const std::string& text) {
  std::string all;
  for (std::size_t i = 0; i < n; ++i) all += text;
  return all;
}

class AmplifyingTest : public CommandLineTest {
 protected:
  /// Refused, or failed, with this among what is said.
  void expect_bounded(const std::vector<std::string>& words, const std::string& said) const {
    const Outcome outcome = viwo(words);
    EXPECT_TRUE(outcome.code == 1 || outcome.code == 2) << outcome.code << outcome.out;
    EXPECT_NE(outcome.err.find(said), std::string::npos) << outcome.err;
    expect_small(outcome);
  }

  static void expect_small(const Outcome& outcome) {
    EXPECT_LT(outcome.peak_mb, 512) << outcome.err;
    EXPECT_LT(outcome.cpu_s, 20.) << outcome.err;
  }

  /// A run of the wheels alone by one sensor.
  void expect_sensor_bounded(const std::string& sensor, const std::string& said) const {
    write("run.yaml", "name: a\nsensors: {wheels0: {" + sensor +
                          "}}\nkinematics: {type: differential, radius_left_m: 0.1, "
                          "radius_right_m: 0.1, baseline_m: 0.5}\n");
    expect_bounded({"run", "run.yaml", "--out", "out"}, said);
    expect_bounded({"inspect", "run.yaml", "--out", "inspected"}, said);
  }

  static bool has_sensor(const std::string& name) {
    return fs::exists(fs::path(VIWO_TEST_PLUGIN_DIR) / ("libviwo_sensor_" + name + ".so"));
  }

  /// The bytes of a gzip file.
  std::string zipped(const std::string& text) const {
    const gzFile file = gzopen(at("part.gz").c_str(), "wb9");
    EXPECT_EQ(gzwrite(file, text.data(), static_cast<unsigned>(text.size())),
              static_cast<int>(text.size()));
    EXPECT_EQ(gzclose(file), Z_OK);
    return read("part.gz");
  }

  /// A file in MCAP with one chunk, of wheels.
  std::string mcap(std::uint64_t says_to_be, const std::string& compressed) const {
    const auto record = [](char op, const std::string& fields) {
      return op + bytes_of_number(std::uint64_t{fields.size()}) + fields;
    };
    const std::string magic = "\x89MCAP0\r\n";
    const std::string schema = bytes_of_number(std::uint16_t{1}) +
                               behind_its_length("sensor_msgs/msg/JointState") +
                               behind_its_length("ros2msg") + behind_its_length("");
    const std::string channel = bytes_of_number(std::uint16_t{1}) +
                                bytes_of_number(std::uint16_t{1}) +
                                behind_its_length("/joint_states") + behind_its_length("cdr") +
                                bytes_of_number(std::uint32_t{0});
    const std::string chunk = bytes_of_number(std::uint64_t{1}) +
                              bytes_of_number(std::uint64_t{2}) + bytes_of_number(says_to_be) +
                              bytes_of_number(std::uint32_t{0}) + behind_its_length("zstd") +
                              bytes_of_number(std::uint64_t{compressed.size()}) + compressed;
    return magic + record(1, behind_its_length("ros2") + behind_its_length("")) +
           record(3, schema) + record(4, channel) + record(6, chunk) +
           record(2, std::string(20, '\0')) + magic;
  }
};

TEST_F(AmplifyingTest, AMegabyteOfGzipBecomesNoGigabyte) {
  // As many rows as there is room for, and a single line.
  for (const std::string row : {"1,1,1\n", "1"}) {
    const std::string member = zipped("timestamp_ns,drive_1 [rad/s],drive_2 [rad/s]\n" +
                                      times(16 * kMiB / row.size(), row));
    ASSERT_LT(member.size(), kMiB / 16);
    write("wheels0/data.csv.gz", times(kMiB / member.size() + 1, member));
    expect_sensor_bounded("type: asl_encoders, path: wheels0", "wheels0/data.csv.gz");
  }
}

TEST_F(AmplifyingTest, AliasesOfAliasesAreCounted) {
  std::string values = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string one = "*a" + std::to_string(i - 1);
    values += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + times(9, one + ", ") +
              one + "]\n";
  }
  const std::string texts =
      "t: &t " + std::string(kMiB - 10'000, 'x') + "\nu: [" + times(1000, "*t, ") + "*t]\n";
  const std::string run = VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml";
  for (const auto& [text, said] : {std::pair{values, "values, with those that aliases stand for"},
                                   {texts, "MiB of text, with that which aliases stand for"},
                                   {"a: " + std::string(100'000, '['), "nested deeper than 100"}}) {
    write("a.yaml", text);
    expect_bounded({"run", "a.yaml", "--out", "out"}, said);
    for (const std::string set :
         {"cameras.kalibr=FILE", "imu={kalibr: FILE}", "calibration=FILE"}) {
      expect_bounded(
          {"run", run, "--out", "out", "--set", replaced(set, "FILE", at("a.yaml").string())},
          said);
    }
  }
}

/// A frame of Zstandard can repeat one byte 131072 times by four bytes.
TEST_F(AmplifyingTest, AChunkIsNoLargerThanItSays) {
  if (!has_sensor("ros2_bag")) GTEST_SKIP() << "sensor ros2_bag is left out";
  const std::string block("\x02\x00\x10\x01", 4);
  const std::string frame =
      std::string("\x28\xb5\x2f\xfd\x00\x38", 6) + times(kMiB / block.size(), block);
  const std::string sensor =
      "type: ros2_bag, path: a.mcap, joint_topic: /joint_states, drive_joints: [l, r]";
  write("a.mcap", mcap(32ULL << 30, frame));
  expect_sensor_bounded(sensor,
                        "a chunk says to have 34359738368 bytes, at most 134217728 are read");
  for (const std::uint64_t says_to_be : {100'000ULL, 120ULL << 20}) {
    write("a.mcap", mcap(says_to_be, frame));
    expect_sensor_bounded(sensor, "a.mcap");
  }
}

TEST_F(AmplifyingTest, AnIndexHasAsManyMessagesAsItSays) {
  if (!has_sensor("ros1_bag")) GTEST_SKIP() << "sensor ros1_bag is left out";
  const auto record = [](const std::vector<std::string>& fields, const std::string& data) {
    std::string header;
    for (const std::string& field : fields) header += behind_its_length(field);
    return behind_its_length(header) + behind_its_length(data);
  };
  const std::string one = bytes_of_number(std::uint32_t{1});
  write(
      "a.bag",
      "#ROSBAG V2.0\n" +
          record({"op=\x03", "index_pos=" + bytes_of_number(std::uint64_t{13}), "conn_count=" + one,
                  "chunk_count=" + one},
                 "") +
          record({"op=\x05", "compression=none", "size=" + bytes_of_number(std::uint32_t{0})}, "") +
          record({"op=\x04", "ver=" + one, "conn=" + one,
                  "count=" + bytes_of_number(std::uint32_t{0xffffffff})},
                 std::string(12, '\0')));
  expect_sensor_bounded(
      "type: ros1_bag, path: a.bag, joint_topic: /joint_states, drive_joints: [l, r]",
      "a list has another length than it says");
}

/// Of two streams rates are compared in cells of 10 ms.
TEST_F(AmplifyingTest, AGapOfADayIsNotFilledWithCells) {
  std::string imu =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  std::string wheels = "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s]\n";
  for (std::int64_t k = 0; k < 2000; ++k) {
    const std::string t = std::to_string(10'000'000 * k + (k < 1000 ? 0 : 86'000'000'000'000));
    const std::string turns = k / 100 % 2 == 0 ? "1" : "-1";
    imu += t + ",0,0," + turns + ",0,0,9.81\n";
    wheels += t + ",0," + turns + "\n";
  }
  write("imu0/data.csv", imu);
  write("wheels0/data.csv", wheels);
  write("run.yaml",
        "name: a\nsensors: {imu0: {type: asl_imu, path: imu0}, wheels0: {type: asl_encoders, path: "
        "wheels0}}\nkinematics: {type: differential, radius_left_m: 0.25, radius_right_m: 0.25, "
        "baseline_m: 0.25}\n");
  const Outcome outcome = viwo({"inspect", "run.yaml", "--out", "inspected"});
  EXPECT_NE(outcome.out.find("8.6e+07 ms"), std::string::npos) << outcome.out << outcome.err;
  expect_small(outcome);
}

/// What is made of a log is bounded by its rows, however long they are apart.
class LongTimesTest : public AmplifyingTest {
 protected:
  /// Rows of wheels and IMU, `gap_s` apart after five seconds of rest.
  void write_log(int rows, double gap_s) const {
    std::string imu =
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
        "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
    std::string wheels = "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s]\n";
    const std::int64_t gap_ns = std::llround(1e9 * gap_s), rest_ns = 5'000'000'000;
    const auto add = [&](std::int64_t t_ns, const char* turn) {
      imu += std::to_string(t_ns) + ",0,0," + turn + ",0,0,9.81\n";
      wheels += std::to_string(t_ns) + "," + turn + "," + turn + "\n";
    };
    for (std::int64_t t_ns = 0; t_ns < rest_ns; t_ns += 10'000'000) add(t_ns, "0");
    for (int k = 0; k < rows; ++k) add(rest_ns + k * gap_ns, k % 2 == 0 ? "0.1" : "0.2");
    write("imu0/data.csv", imu);
    write("wheels0/data.csv", wheels);
  }

  const std::string sensors_ =
      "sensors: {imu0: {type: asl_imu, path: imu0}, wheels0: {type: asl_encoders, path: "
      "wheels0}}\nkinematics: {type: differential, radius_left_m: 0.1, radius_right_m: 0.1, "
      "baseline_m: 0.5}\n";
  const std::string imu_ =
      "imu: {sigma_gyro_rad_per_s_sqrt_hz: 1e-3, sigma_accel_m_per_s2_sqrt_hz: 1e-2, "
      "sigma_gyro_walk_rad_per_s2_sqrt_hz: 1e-5, sigma_accel_walk_m_per_s3_sqrt_hz: 1e-3}\n";
};

TEST_F(LongTimesTest, OfWheelsAreRefused) {
  write("run.yaml", "name: a\n" + sensors_);
  write("calibrate.yaml", "calibration: a\nbase: run.yaml\nrecordings: [{name: a}]\n");
  for (const auto& [rows, gap_s] : {std::pair{50, 1e5}, {2000, 1000.}, {20000, 9.}}) {
    write_log(rows, gap_s);
    expect_bounded({"run", "run.yaml", "--out", "out"}, "");
    expect_bounded({"calibrate", "calibrate.yaml", "--out", "out"}, "the encoder samples ");
  }
}

TEST_F(LongTimesTest, BetweenReadingsOfTheImuEndTheRun) {
  write("run.yaml", "name: a\n" + sensors_ + imu_ +
                        "estimator: {start: standstill}\nupdates: {wheel_odometry: {}}\n");
  write_log(10000, 9.);
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.out.find("diverged: the IMU was silent for "), std::string::npos)
      << outcome.out;
  expect_small(outcome);
}

TEST_F(LongTimesTest, OfPosesAreNotSimulated) {
  if (!has_sensor("recorded_motion_simulator")) {
    GTEST_SKIP() << "sensor recorded_motion_simulator is left out";
  }
  std::string poses =
      "time;.header.stamp.secs;.header.stamp.nsecs;.pose.position.x;.pose.position.y;"
      ".pose.position.z;.pose.orientation.x;.pose.orientation.y;.pose.orientation.z;"
      ".pose.orientation.w\n";
  for (int k = 0; k < 3000; ++k) {
    poses += "2024/05/01/10:00:00;" + std::to_string(1000 + 9 * k) + ";0;" +
             std::to_string(0.1 * k) + ";0;0;0;0;0;1\n";
  }
  write("poses.csv", poses);
  write("run.yaml",
        "name: a\nsensors: {rig0: {type: recorded_motion_simulator, path: poses.csv, features: 0, "
        "max_gap_s: 100, max_rejected_fraction: 1}}\n" +
            imu_ + "estimator: {start: reference}\nupdates: {visual_features: {}}\n");
  expect_bounded({"run", "run.yaml", "--out", "out"}, "at most 7200 s are simulated");
}

TEST_F(AmplifyingTest, AnImageIsNoLargerThanACameraHas) {
  if (!has_sensor("klt_tracker")) GTEST_SKIP() << "sensor klt_tracker is left out";
  std::string png = testing::text_of(VIWO_TEST_SOURCE_DIR "/tests/app/data/tiny.png");
  png.replace(16, 8, std::string("\0\0\xea\x60\0\0\xea\x60", 8));  // width and height
  write("mask.png", png);
  expect_bounded({"run", VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_images.yaml", "--out", "out",
                  "--set", "sensors.tracks0.mask0=" + at("mask.png").string()},
                 "mask.png: an image of 60000 x 60000 pixels, at most 32 Mi are read");
}

}  // namespace
}  // namespace viwo
