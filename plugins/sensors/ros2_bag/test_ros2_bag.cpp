// The sensor ros2_bag as the host loads it, on bags that SQLite and fastcdr have written.
#include <cmath>
#include <random>
#include <set>

#include <sys/stat.h>

#include "message_of.hpp"
#include "test_fixture.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(Ros2Bag, GivesAllTopicsInTimeOrderToTheBit) {
  write_drive();
  const auto all = play(*make_sensor(section(kAll)));
  const double x = 0.1 * 4 + 1. / 3.;
  const auto imu_samples = only<ImuSample>(all);
  ASSERT_EQ(imu_samples.size(), 20U);
  EXPECT_EQ(imu_samples[4].t_ns, kStart + 20 * kMs);
  EXPECT_EQ(imu_samples[4].gyro_rad_per_s, (std::array{x, -x, 0.2}));
  EXPECT_EQ(imu_samples[4].accel_m_per_s2, (std::array{1., x, 9.81}));
  const auto wheels = only<EncoderSample>(all);
  ASSERT_EQ(wheels.size(), 20U);
  EXPECT_EQ(wheels[4].t_ns, kStart + 20 * kMs);
  EXPECT_EQ(wheels[4].drive_rad_per_s[0], 3. + x);
  EXPECT_EQ(wheels[4].steer_rad[0], x);
  const auto poses = only<PoseSample>(all);
  ASSERT_EQ(poses.size(), 5U);
  EXPECT_EQ(poses[1].p_BinW_m, (std::array{x, 1., 2.}));
  EXPECT_EQ(poses[1].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
  const auto images = only<ImageSample>(all);
  ASSERT_EQ(images.size(), 10U);
  Image pixels;
  images[2].source->read(pixels);
  EXPECT_EQ(images[2].t_ns, kStart + 20 * kMs);
  EXPECT_EQ(pixels.width_px, 3);
  EXPECT_THAT(pixels.pixels, ElementsAre(4, 4, 4, 4, 4, 4));
  images[3].source->read(pixels);
  EXPECT_EQ(images[3].camera, 1);
  EXPECT_THAT(pixels.pixels, ElementsAre(104, 7));
  const auto odometry = play_only<PoseSample>(section("odometry_topic: /odom"));
  ASSERT_EQ(odometry.size(), 5U);
  EXPECT_EQ(odometry[1].p_BinW_m, (std::array{x, 3., 4.}));
  EXPECT_EQ(odometry[1].q_BtoW_xyzw, (std::array{0.6, 0., 0., 0.8}));
}

TEST_F(Ros2Bag, GivesFixes) {
  {
    Writer out(file());
    out.topic(1, "/fix", "sensor_msgs/msg/NavSatFix");
    const std::array<double, 9> covariance{0.81, 0.1, 0.2, 0.1, 0.64, 0.3, 0.2, 0.3, 3.24};
    for (int k = 0; k < 3; ++k) {
      Cdr2 fix;
      // Frames of all lengths: what follows is aligned by them.
      fix.header(kStart + k * kMs, std::string(static_cast<std::size_t>(k), 'g'))
          << static_cast<std::int8_t>(k - 1) << std::uint16_t{3} << 42.5 << -71.25 << 7.5
          << covariance << std::uint8_t{2};
      out.message(1, k, fix.text());
    }
  }
  const auto fixes = play_only<GnssSample>(section("gnss_topic: /fix"));
  ASSERT_EQ(fixes.size(), 2U);  // the first says that it has none
  for (const GnssSample& fix : fixes) {
    EXPECT_EQ(fix.latitude_deg, 42.5);
    EXPECT_EQ(fix.longitude_deg, -71.25);
    EXPECT_EQ(fix.altitude_m, 7.5);
    EXPECT_EQ(fix.covariance_ENU_m2,
              (std::array<double, 9>{0.81, 0., 0., 0., 0.64, 0., 0., 0., 3.24}));
  }
}

TEST_F(Ros2Bag, ReadsBothByteOrders) {
  {
    Writer out(file());
    out.topic(7, "/imu0", "sensor_msgs/msg/Imu");
    out.message(7, 1, imu(kStart, 0.5, Cdr::BIG_ENDIANNESS));
    out.message(7, 2, imu(kStart + kMs, 0.25, Cdr::LITTLE_ENDIANNESS));
  }
  const auto samples = play_only<ImuSample>(section("imu_topic: /imu0"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].t_ns, kStart);
  EXPECT_EQ(samples[0].accel_m_per_s2, (std::array{1., 0.5, 9.81}));
  EXPECT_EQ(samples[1].gyro_rad_per_s, (std::array{0.25, -0.25, 0.2}));
}

TEST_F(Ros2Bag, PlaysTheFilesOfAFolderOneAfterTheOther) {
  write_drive("bag_10.db3", 10, 20);
  write_drive("bag_9.db3", 0, 10);
  write_metadata("sqlite3", "", "[bag/bag_9.db3, bag_10.db3]");
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "")).size(), 20U);
  // Relative to the first message of the bag, in whichever file.
  const auto samples =
      play_only<ImuSample>(section("imu_topic: /imu0, start_s: 0.04, duration_s: 0.02", ""));
  ASSERT_EQ(samples.size(), 5U);
  EXPECT_EQ(samples[0].t_ns, kStart + 40 * kMs);
  fs::remove(folder_ / "metadata.yaml");  // as a recorder leaves it that was killed
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "")).size(), 20U);
}

/// `ros2 bag record --compression-mode file`, then `unzstd *.zstd`.
TEST_F(Ros2Bag, ReadsWholeFilesThatWereDecompressedBesideTheirCompressedOnes) {
  write_drive();
  write_metadata("sqlite3", "zstd", "[bag_0.db3.zstd]", "FILE");
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "")).size(), 20U);
  std::ofstream(folder_ / "bag_0.db3.zstd") << "compressed";
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "bag_0.db3.zstd")).size(), 20U);
  write_metadata("sqlite3", "zstd", "[bag_1.db3.zstd]", "FILE");
  EXPECT_THAT(error_of(section(kAll, "")), HasSubstr("No such file or directory"));
  std::ofstream(folder_ / "bag_1.db3.zstd") << "compressed";
  EXPECT_THAT(error_of(section(kAll, "")),
              HasSubstr("is compressed as a whole: `unzstd " + file("bag_1.db3.zstd")));
}

TEST_F(Ros2Bag, RefusesWhatItCannotRead) {
  write_drive();
  const std::string remedy =
      ": what is read is mcap (whatever its chunks are compressed by) and sqlite3 without "
      "compression - `ros2 bag convert`";
  write_metadata("rosbag_v2", "", "[bag_0.bag]");
  EXPECT_THAT(error_of(section(kAll, "")), HasSubstr("  is stored as 'rosbag_v2'" + remedy));
  write_metadata("sqlite3", "zstd", "[bag_0.db3.zstd]");
  EXPECT_THAT(error_of(section(kAll, "")), HasSubstr("  is compressed (zstd)" + remedy));
  write_metadata("sqlite3", "", "[bag_1.db3]");
  EXPECT_THAT(error_of(section(kAll, "")),
              HasSubstr(file("bag_1.db3") + "  cannot be read: No such file or directory"));
  std::ofstream(folder_ / "metadata.yaml") << "a: [1\n";
  EXPECT_THAT(error_of(section(kAll, "")),
              HasSubstr(file("metadata.yaml") + ":2:1  not valid YAML: "));
  EXPECT_THAT(error_of(section(kAll, "bag_0.db3.lz4")), HasSubstr("is a file .lz4" + remedy));
  std::ofstream(file("robot.bag")) << "#ROSBAG V2.0\n";
  EXPECT_THAT(error_of(section(kAll, "robot.bag")), HasSubstr("did you mean type: ros1_bag?"));
  fs::create_directories(folder_ / "none");
  EXPECT_THAT(error_of(section(kAll, "none")),
              HasSubstr("is no ROS 2 bag: it has neither metadata.yaml nor *.mcap or *.db3"));
  std::ofstream(file("text.db3")) << std::string(200, 'x');
  EXPECT_THAT(error_of(section(kAll, "text.db3")),
              HasSubstr(file("text.db3") + "  is no SQLite database"));
  {
    Writer out(file("json.db3"));
    out.topic(1, "/imu0", "sensor_msgs/msg/Imu", "json");
  }
  EXPECT_THAT(error_of(section(kAll, "json.db3")),
              HasSubstr("topic '/imu0' is serialised as 'json', what is read is cdr"));
}

TEST_F(Ros2Bag, RefusesAFileThatIsListedTwice) {
  write_drive();
  write_metadata("sqlite3", "", "[bag_0.db3, bag/bag_0.db3]");
  EXPECT_THAT(error_of(section(kAll, "")), HasSubstr("'bag/bag_0.db3' is listed twice"));
}

TEST_F(Ros2Bag, LeavesNothingBesideADatabase) {
  const auto in_folder = [this] {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      names.insert(entry.path().filename().string() + " " + testing::text_of(entry.path()));
    }
    return names;
  };
  sqlite3* database = nullptr;
  {
    Writer out(file("live.db3"));
    out.topic(1, "/imu0", "sensor_msgs/msg/Imu");
  }
  ASSERT_EQ(sqlite3_open(file("live.db3").c_str(), &database), SQLITE_OK);
  const auto run = [database](const std::string& sql) {
    ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
  };
  run("PRAGMA journal_mode = WAL");
  sqlite3_stmt* insert = nullptr;
  ASSERT_EQ(sqlite3_prepare_v2(database, "INSERT INTO messages VALUES (?1, 1, ?2, ?3)", -1, &insert,
                               nullptr),
            SQLITE_OK);
  for (int k = 0; k < 20; ++k) {
    const std::string data = imu(kStart + k * kMs, 0.1);
    sqlite3_reset(insert);
    sqlite3_bind_int(insert, 1, k + 1);
    sqlite3_bind_int64(insert, 2, kStart + k * kMs);
    sqlite3_bind_blob(insert, 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    ASSERT_EQ(sqlite3_step(insert), SQLITE_DONE);
  }
  sqlite3_finalize(insert);
  // As a recorder leaves it that is killed now: all is in the log.
  fs::copy_file(file("live.db3"), file("killed.db3"));
  fs::copy_file(file("live.db3-wal"), file("killed.db3-wal"));
  sqlite3_close(database);
  ASSERT_FALSE(fs::exists(file("live.db3-wal")));
  fs::create_directories(folder_ / "links");
  fs::create_symlink(file("killed.db3"), folder_ / "links" / "a.db3");
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "links/a.db3")).size(), 20U);
  fs::remove_all(folder_ / "links");
  const auto before = in_folder();
  for (const char* name : {"killed.db3", "live.db3"}) {
    EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", name)).size(), 20U) << name;
    EXPECT_TRUE(in_folder() == before) << name;
  }
  for (const char* beside : {"-journal", "-wal", "-shm"}) {
    ASSERT_EQ(::mkfifo(file(std::string("live.db3") + beside).c_str(), 0600), 0);
    EXPECT_THAT(error_of(section("imu_topic: /imu0", "live.db3")),
                HasSubstr(file(std::string("live.db3") + beside) + "  is a pipe, not a file"));
    fs::remove(file(std::string("live.db3") + beside));
  }
}

TEST_F(Ros2Bag, CountsRowsOfNoTopicAndOfNoTime) {
  sqlite3* database = nullptr;
  {
    Writer out(file());
    out.topic(1, "/imu0", "sensor_msgs/msg/Imu");
    for (int k = 0; k < 100; ++k) out.message(1, kStart + k * kMs, imu(kStart + k * kMs, 0.1));
  }
  ASSERT_EQ(sqlite3_open(file().c_str(), &database), SQLITE_OK);
  for (const char* sql : {"UPDATE messages SET topic_id = 7 WHERE id IN (3, 4)",
                          "UPDATE messages SET timestamp = 'x' || timestamp WHERE id > 95"}) {
    EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK);
  }
  sqlite3_close(database);
  const auto sensor = make_sensor(section("imu_topic: /imu0, max_rejected_fraction: 0.2"));
  EXPECT_EQ(play(*sensor).size(), 93U);
  EXPECT_THAT(
      rejections_of(*sensor),
      ::testing::UnorderedElementsAre(
          HasSubstr("message of a topic that is described nowhere | 2 | bag_0.db3: row 3"),
          HasSubstr("message whose time of reception is no integer | 5 | bag_0.db3: row ")));
}

TEST_F(Ros2Bag, RefusesADatabaseThatWasCutShort) {
  write_drive("bag_0.db3", 0, 200);
  const auto size = fs::file_size(file());
  fs::resize_file(file(), size / 2);
  EXPECT_THAT(error_of(section(kAll)), HasSubstr(file() + "  cannot be read as a ROS 2 bag: "));
}

TEST_F(Ros2Bag, SurvivesBytesThatAreWrongAnywhere) {
  write_drive();
  const std::string whole = testing::text_of(file());
  std::mt19937_64 random(5);
  int refused = 0;
  for (int k = 0; k < 200; ++k) {
    std::string content = whole;
    for (int i = 0; i < 5; ++i) {
      content[random() % content.size()] = static_cast<char>(random());
    }
    std::ofstream(file(), std::ios::binary) << content;
    try {
      Image pixels;
      for (const ImageSample& sample : only<ImageSample>(play(*make_sensor(section(kAll))))) {
        sample.source->read(pixels);
      }
    } catch (const InputError&) {
      ++refused;  // anything else, or a crash, ends the test
    }
  }
  EXPECT_GT(refused, 10);
  EXPECT_LT(refused, 199);
}

TEST_F(Ros2Bag, NamesTheTopicsThatThereAre) {
  write_drive();
  EXPECT_THAT(error_of(section("imu_topic: /imu")),
              HasSubstr("sensor.imu_topic: no topic '/imu' in " + file() +
                        " - did you mean '/imu0'? - of type sensor_msgs/Imu there are: /imu0"));
  EXPECT_THAT(error_of(section("imu_topic: /pose")),
              HasSubstr("is of type geometry_msgs/msg/PoseStamped, needed is sensor_msgs/Imu - "
                        "there are: /imu0"));
}

TEST_F(Ros2Bag, CountsMessagesThatAreBroken) {
  {
    Writer out(file());
    out.topic(1, "/imu0", "sensor_msgs/msg/Imu");
    out.topic(2, "/joints", "sensor_msgs/msg/JointState");
    const std::string whole = imu(kStart, 0.5);
    out.message(1, 1, whole.substr(0, whole.size() - 80));  // without the accelerations
    out.message(1, 2, whole);
    out.message(1, 3, "\x28\xb5\x2f\xfd compressed, perhaps");
    std::string many = joints(kStart, 0.);
    many.replace(4 + 4 + 4 + 4 + 4, 4, "\xff\xff\xff\x7f");  // the number of names
    out.message(2, 4, many);
    out.message(2, 5, joints(kStart, 0.));
  }
  const auto sensor =
      make_sensor(section("imu_topic: /imu0, joint_topic: /joints, drive_joints: [drive], "
                          "max_rejected_fraction: 0.7"));
  EXPECT_EQ(play(*sensor).size(), 2U);
  EXPECT_THAT(
      rejections_of(*sensor),
      ElementsAre(AllOf(StartsWith("/imu0: broken message: it ends too early | "),
                        EndsWith(" | bag_0.db3: message 1")),
                  StartsWith("/imu0: broken message: it does not begin like CDR | "),
                  StartsWith("/joints: broken message: a list is longer than its message | ")));
  EXPECT_THAT(rejections_of(*make_sensor(
                  section("imu_topic: /imu0, start_s: 1e-9, max_rejected_fraction: 0.7"))),
              ElementsAre(EndsWith(" | bag_0.db3: message 3")))
      << "of the file, wherever reading begins";
}

TEST_F(Ros2Bag, OneTopicIsForOneKindOfSamples) {
  { Writer out(file()); }
  EXPECT_THAT(testing::error_of([&] {
                make_sensor(
                    section("joint_topic: /odom, drive_joints: [v_x, omega_z], "
                            "odometry_topic: /odom"));
              }),
              HasSubstr("odometry_topic: '/odom' is wanted twice: of an Odometry that is to give "
                        "both twist and poses make two sensors"));
}

TEST_F(Ros2Bag, ABrokenImageIsAnErrorWhenItIsRead) {
  {
    Writer out(file());
    out.topic(3, "/cam0", "sensor_msgs/msg/Image");
    out.message(3, 1, image(kStart, 1, 5));
  }
  const auto images = play_only<ImageSample>(section("image_topics: [/cam0]"));
  ASSERT_EQ(images.size(), 1U);
  Image out;
  EXPECT_EQ(testing::error_of([&] { images[0].source->read(out); }),
            file() +
                ": /cam0 message 1: an image of 3 x 2 mono8 in rows of 3 bytes has 5 bytes of "
                "pixels");
}

TEST_F(Ros2Bag, NamesTheJointThatIsNotFinite) {
  {
    Writer out(file());
    out.topic(2, "/joints", "sensor_msgs/msg/JointState");
    out.message(2, 5, joints(kStart, std::nan("")));
  }
  const std::string rest =
      "joint_topic: /joints, drive_joints: [drive], steer_joints: [steer], drive_input: ";
  EXPECT_THAT(error_of(section(rest + "velocity")),
              HasSubstr("/joints: velocity of joint 'drive' that is not finite (1, first at "));
  EXPECT_THAT(error_of(section(rest + "position")),
              HasSubstr("/joints: position of joint 'steer' that is not finite (1, first at "));
}

TEST_F(Ros2Bag, WhatIsNoFileIsRefused) {
  for (const char* name : {"a.mcap", "a.db3"}) {
    ASSERT_EQ(::mkfifo(file(name).c_str(), 0600), 0);
    EXPECT_THAT(error_of(section("imu_topic: /imu0", name)), HasSubstr("is a pipe, not a file"));
  }
}

}  // namespace
}  // namespace viwo
