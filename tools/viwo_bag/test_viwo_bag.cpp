// viwo_bag: a log folder, as a bag, read back by ros1_bag or ros2_bag, gives the same samples.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <utility>

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <yaml-cpp/yaml.h>

#include "expect_same.hpp"
#include "support.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ViwoBag : public testing::InFolder {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// The exit code; what it printed is in output_.
  int run(const std::string& arguments) {
    const std::string output = path("output.txt");
    const int status = std::system(
        (VIWO_TEST_BINARY_DIR "/bin/viwo_bag " + arguments + " > " + output + " 2>&1").c_str());
    output_ = testing::text_of(output);
    return WEXITSTATUS(status);
  }

  /// What one sensor of each kind gives, from stamp 0 on, with random values.
  std::vector<Measurement> write_log(const std::string& name) const {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    std::vector<Measurement> all;
    for (std::int64_t k = 0; k < 100; ++k) {
      const std::int64_t t_ns = k * 9'999'991;
      if (k % 5 == 0) {
        PoseSample pose{t_ns, {normal(random), normal(random), normal(random)}, {}};
        pose.q_BtoW_xyzw = {0., 0.6, 0., 0.8};
        all.emplace_back(pose);
      }
      all.emplace_back(ImuSample{t_ns,
                                 {normal(random), normal(random), normal(random)},
                                 {normal(random), normal(random), normal(random)}});
      EncoderSample wheels;
      wheels.t_ns = t_ns + 1;
      wheels.n_drive = wheels.n_steer = 2;
      wheels.drive_rad_per_s = {normal(random), normal(random)};
      wheels.steer_rad = {normal(random), normal(random)};
      all.emplace_back(wheels);
      if (k % 20 != 0) continue;
      GnssSample fix{t_ns + 1, 42.3 + 0.001 * normal(random), -71.1, normal(random), {}};
      for (double& value : fix.covariance_ENU_m2) value = std::abs(normal(random));
      all.emplace_back(fix);
      for (int camera = 0; camera < 2; ++camera) {
        Image image{5, 3, std::vector<std::uint8_t>(15)};
        for (std::uint8_t& pixel : image.pixels) pixel = static_cast<std::uint8_t>(random());
        all.emplace_back(ImageSample{t_ns + 2, camera, std::make_shared<ImageInMemory>(image)});
      }
    }
    log::AslWriter writer(folder_ / name);
    for (const Measurement& measurement : all) EXPECT_TRUE(writer.write(measurement));
    writer.close();
    return all;
  }

  std::string output_;
};

class ViwoBagFormats : public ViwoBag,
                       public ::testing::WithParamInterface<std::pair<const char*, const char*>> {};

TEST_P(ViwoBagFormats, ALogComesBackToTheBit) {
  const auto [sensor, name] = GetParam();
  const auto log = write_log("log");
  ASSERT_EQ(run(path("log") + " " + path(name)), 0) << output_;
  EXPECT_EQ(output_,
            path(name) + ": 235 messages (100 IMU, 100 wheels, 10 images, 20 poses, 5 fixes)\n");
  const auto played = play(*make_sensor(
      std::string("{type: ") + sensor + ", path: " + path(name) +
      ", imu_topic: /imu0, image_topics: [/cam0/image_raw, /cam1/image_raw], joint_topic: "
      "/joint_states, drive_joints: [drive_1, drive_2], steer_joints: [steer_1, steer_2], "
      "pose_topic: /ground_truth, gnss_topic: /fix}"));
  EXPECT_EQ(played.size(), log.size());
  expect_same(log, played);
  // The cells of the wheels are those of the log, too.
  const auto from_log =
      play_only<EncoderSample>("{type: asl_encoders, path: " + path("log/wheels0") + "}");
  const auto from_bag = only<EncoderSample>(played);
  ASSERT_EQ(from_log.size(), from_bag.size());
  for (std::size_t i = 0; i < from_log.size(); ++i) {
    EXPECT_EQ(from_log[i].begin_ns, from_bag[i].begin_ns);
    EXPECT_EQ(from_log[i].end_ns, from_bag[i].end_ns);
  }
}

INSTANTIATE_TEST_SUITE_P(All, ViwoBagFormats,
                         ::testing::Values(std::pair("ros1_bag", "a.bag"),
                                           std::pair("ros2_bag", "a.mcap"),
                                           std::pair("ros2_bag", "a")));

/// What `ros2 bag info` prints.
TEST_F(ViwoBag, TheFolderOfARos2BagSaysWhatIsInIt) {
  write_log("log");
  ASSERT_EQ(run(path("log") + " " + path("robot")), 0) << output_;
  const YAML::Node info =
      YAML::LoadFile(path("robot/metadata.yaml"))["rosbag2_bagfile_information"];
  EXPECT_EQ(info["storage_identifier"].as<std::string>(), "mcap");
  EXPECT_EQ(info["message_count"].as<int>(), 235);
  EXPECT_EQ(info["starting_time"]["nanoseconds_since_epoch"].as<std::int64_t>(), 0);
  EXPECT_EQ(info["duration"]["nanoseconds"].as<std::int64_t>(), 99 * 9'999'991 + 1);
  EXPECT_EQ(info["relative_file_paths"][0].as<std::string>(), "robot_0.mcap");
  std::map<std::string, std::string> types;
  int n = 0;
  for (const YAML::Node& topic : info["topics_with_message_count"]) {
    types[topic["topic_metadata"]["name"].as<std::string>()] =
        topic["topic_metadata"]["type"].as<std::string>();
    EXPECT_EQ(topic["topic_metadata"]["serialization_format"].as<std::string>(), "cdr");
    n += topic["message_count"].as<int>();
  }
  EXPECT_EQ(n, 235);
  EXPECT_EQ(types.size(), 6U);
  EXPECT_EQ(types["/fix"], "sensor_msgs/msg/NavSatFix");
  EXPECT_TRUE(fs::exists(folder_ / "robot/robot_0.mcap"));
}

TEST_F(ViwoBag, WhatTheLogDoesNotHaveIsNotRead) {
  write_log("log");
  ASSERT_EQ(run(path("log") + " " + path("a.bag")), 0) << output_;
  const std::string error =
      error_of("{type: ros1_bag, path: " + path("a.bag") +
               ", joint_topic: /joint_states, drive_joints: [drive_1, drive_2], drive_input: "
               "position}");
  EXPECT_THAT(error, HasSubstr("100 of 100 messages rejected"));
  EXPECT_THAT(error, HasSubstr("/joint_states: position of joint 'drive_1' that is not finite "
                               "(100, first at"));
}

TEST_F(ViwoBag, SaysHowItIsUsed) {
  EXPECT_EQ(run("--help"), 0);
  EXPECT_THAT(output_, HasSubstr("viwo_bag LOG_FOLDER OUT.bag|OUT.mcap|OUT"));
  EXPECT_EQ(run(""), 2);
  EXPECT_EQ(run("--fast a b"), 2);
}

TEST_F(ViwoBag, RefusesWrongInputAndWritesNothing) {
  const std::string out = path("out.bag");
  EXPECT_EQ(run(path("none") + " " + out), 2);
  EXPECT_EQ(output_, path("none") + "  is no folder\n");
  fs::create_directories(folder_ / "empty");
  EXPECT_EQ(run(path("empty") + " " + out), 2);
  EXPECT_THAT(output_, HasSubstr(path("empty") + "  is no log folder: it has none of imu0, "));
  write_log("log");
  for (const char* name : {"text.bag", "text.mcap"}) {
    std::ofstream(path(name)) << "important\n";
    EXPECT_EQ(run(path("log") + " " + path(name)), 2);
    EXPECT_EQ(output_, path(name) + std::string("  exists and is no bag\n"));
  }
  EXPECT_EQ(run(path("log") + " " + path("a.db3")), 2);
  EXPECT_THAT(output_, HasSubstr(path("a.db3") + "  ends with '.db3': .bag makes a ROS 1 bag, "));
  EXPECT_EQ(run(path("log") + " " + path("empty")), 2);
  EXPECT_EQ(output_, path("empty") + "  exists and is no bag that viwo_bag has written\n");
  write_log("of_others");
  EXPECT_EQ(run(path("log") + " " + path("of_others")), 2);
  EXPECT_EQ(output_, path("of_others") + "  exists and is no bag that viwo_bag has written\n");
  // of a recorder, whose header has its name
  fs::create_directories(folder_ / "recorded");
  std::ofstream(path("recorded/metadata.yaml")) << "rosbag2_bagfile_information:\n";
  std::ofstream(path("recorded/recorded_0.mcap")) << "\x89MCAP0\r\n ros2 libmcap 0.8.0";
  EXPECT_EQ(run(path("log") + " " + path("recorded")), 2);
  EXPECT_EQ(run(path("log") + " " + path("recorded/recorded_0.mcap")), 2);
  EXPECT_EQ(output_, path("recorded/recorded_0.mcap") +
                         "  exists and is no bag that viwo_bag has written\n");
  EXPECT_TRUE(fs::exists(folder_ / "recorded/recorded_0.mcap"));
  fs::remove(folder_ / "log/cam1/data/2.png");
  EXPECT_EQ(run(path("log") + " " + out), 2);
  EXPECT_EQ(output_, path("log/cam1/data/2.png") + ": the image is missing or cannot be read\n");
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(run(path("log") + " " + path("out")), 2);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  EXPECT_FALSE(fs::exists(folder_ / "out.part"));
}

TEST_F(ViwoBag, TakesNoImageFromOutsideOfItsFolder) {
  write_log("log");
  for (const std::string name : {"../../../secret.png", "/etc/passwd"}) {
    std::ofstream(path("log/cam0/data.csv")) << "#timestamp [ns],filename\n1," << name << "\n";
    EXPECT_EQ(run(path("log") + " " + path("out.bag")), 2);
    EXPECT_THAT(output_, HasSubstr("'" + name + "' leads out of the folder of the images"));
  }
}

TEST_F(ViwoBag, KeepsTheBagThatIsThereUntilThereIsAnother) {
  const auto content = [this] { return testing::text_of(path("a.bag")); };
  write_log("log");
  ASSERT_EQ(run(path("log") + " " + path("a.bag")), 0) << output_;
  const std::string whole = content();
  fs::remove(folder_ / "log/cam1/data/2.png");
  EXPECT_EQ(run(path("log") + " " + path("a.bag")), 2);
  EXPECT_EQ(content(), whole);
  EXPECT_FALSE(fs::exists(folder_ / "a.bag.part"));
  fs::remove_all(folder_ / "log/cam1");
  fs::create_symlink("a.bag", folder_ / "link.bag");
  ASSERT_EQ(run(path("log") + " " + path("link.bag")), 0) << output_;
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.bag"));
  EXPECT_LT(content().size(), whole.size());
}

TEST_F(ViwoBag, ReplacesItsOwnFolder) {
  const auto info = [this] {
    return YAML::LoadFile(path("robot/metadata.yaml"))["rosbag2_bagfile_information"];
  };
  write_log("log");
  ASSERT_EQ(run(path("log") + " " + path("robot")), 0) << output_;
  fs::remove_all(folder_ / "log/cam1");
  ASSERT_EQ(run(path("log") + " " + path("robot")), 0) << output_;
  EXPECT_LT(info()["message_count"].as<int>(), 235);
  fs::create_directories(folder_ / "robot.before");
  EXPECT_EQ(run(path("log") + " " + path("robot")), 2);
  EXPECT_EQ(output_, path("robot.before") + "  exists\n");
  fs::remove(folder_ / "robot.before");
  fs::remove(folder_ / "log/cam0/data/2.png");
  EXPECT_EQ(run(path("log") + " " + path("robot")), 2);
  EXPECT_TRUE(fs::exists(folder_ / "robot/robot_0.mcap"));
  EXPECT_FALSE(fs::exists(folder_ / "robot.part"));
  EXPECT_FALSE(fs::exists(folder_ / "robot.before"));
}

TEST_F(ViwoBag, AFullDiskIsAnError) {
  write_log("log");
  EXPECT_EQ(run(path("log") + " /dev/full"), 1);
  EXPECT_THAT(output_, HasSubstr("/dev/full  cannot be written: "));
  EXPECT_EQ(run(path("log") + " " + path("no/such/folder/a.bag")), 1);
  EXPECT_THAT(output_, HasSubstr("a.bag.part  cannot be written: "));
  fs::create_symlink("/dev/full", folder_ / "full.mcap");
  EXPECT_EQ(run(path("log") + " " + path("full.mcap")), 1);
  EXPECT_THAT(output_, HasSubstr("full.mcap  cannot be written: No space left on device"));
  EXPECT_EQ(run(path("log") + " " + path("no/such/folder/a")), 1);
}

TEST_F(ViwoBag, ALimitOfTheSizeOfFilesIsAnError) {
  write_log("log");
  for (const char* const name : {"a.bag", "a.mcap"}) {
    const std::string command = "ulimit -f 8; " VIWO_TEST_BINARY_DIR "/bin/viwo_bag " +
                                path("log") + " " + path(name) + " 2> " + path("output.txt");
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1) << name;
    EXPECT_THAT(testing::text_of(path("output.txt")),
                HasSubstr(std::string(name) + ".part  cannot be written: "));
    EXPECT_FALSE(fs::exists(path(name)));
    EXPECT_FALSE(fs::exists(path(name) + ".part"));
  }
}

}  // namespace
}  // namespace viwo
