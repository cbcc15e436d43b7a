// The sensor ros1_topics in a running ROS 1 system.
#include <chrono>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "rejections.hpp"
#include "ros_system.hpp"
#include "sensor_under_test.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using testing::Child;
using ::testing::HasSubstr;
using testing::make_ros1_topics;
using testing::said;

constexpr const char* kAllTopics =
    ", imu_topic: /imu0, joint_topic: /joint_states, drive_joints: [drive_1, drive_2], "
    "steer_joints: [steer_1], image_topics: [/cam0/image_raw, /cam1/image_raw/compressed]";
constexpr std::int64_t kStart = 1'700'000'000'000'000'000;
constexpr std::int64_t kPeriod = 5'000'000;

class Ros1Topics : public testing::LiveTest {
 protected:
  static std::string text_of(const std::string& file) {
    std::ifstream in(ros_->file(file));
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::string error_of(const std::string& rest) {
    return testing::error_of([&] { make_ros1_topics(rest); });
  }
};

TEST_F(Ros1Topics, GivesAllThatIsPublishedInOrderAndEndsWhenNothingComes) {
  const auto sensor = make_ros1_topics(std::string(kAllTopics) + ", idle_timeout_s: 4");
  EXPECT_TRUE(sensor->live());
  Child publisher({VIWO_TEST_ROS_NODE, "publish", "400"}, ros_->file("publisher.log"));
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> encoders;
  std::vector<ImageSample> images;
  Measurement measurement;
  auto last = steady_clock::now();
  while (sensor->next(measurement) == Status::kOk) {
    last = steady_clock::now();
    if (const auto* i = measurement.get_if<ImuSample>()) imu.push_back(*i);
    if (const auto* e = measurement.get_if<EncoderSample>()) encoders.push_back(*e);
    if (const auto* p = measurement.get_if<ImageSample>()) images.push_back(*p);
  }
  const double waited_s = std::chrono::duration<double>(steady_clock::now() - last).count();
  EXPECT_GT(waited_s, 3.9);
  EXPECT_LT(waited_s, 10.);
  EXPECT_EQ(publisher.wait(20s), 0) << text_of("publisher.log");
  EXPECT_TRUE(said().has("nothing has come for 4 s (idle_timeout_s): no further measurements"))
      << said().all();

  ASSERT_EQ(imu.size(), 400U);
  for (std::size_t k = 0; k < imu.size(); ++k) {
    EXPECT_EQ(imu[k].t_ns, kStart + static_cast<std::int64_t>(k) * kPeriod);
    EXPECT_EQ(imu[k].gyro_rad_per_s[0], static_cast<double>(k));
    EXPECT_EQ(imu[k].accel_m_per_s2[2], 9.81);
  }
  ASSERT_EQ(encoders.size(), 399U);
  for (std::size_t k = 0; k < encoders.size(); ++k) {
    EXPECT_EQ(encoders[k].begin_ns, imu[k].t_ns);
    EXPECT_EQ(encoders[k].end_ns, imu[k + 1].t_ns);
    EXPECT_EQ(encoders[k].drive_rad_per_s[0], static_cast<double>(k) + 0.5);
    EXPECT_EQ(encoders[k].drive_rad_per_s[1], static_cast<double>(2 * k) + 1.);
    EXPECT_NEAR(encoders[k].steer_rad[0], 0.001 * (static_cast<double>(k) + 0.5), 1e-12);
  }
  ASSERT_EQ(images.size(), 40U);
  for (std::size_t k = 0; k < images.size(); ++k) {
    EXPECT_EQ(images[k].camera, static_cast<int>(k % 2));
    EXPECT_EQ(images[k].t_ns, kStart + static_cast<std::int64_t>(k / 2) * 20 * kPeriod);
    Image image;
    images[k].source->read(image);
    EXPECT_EQ(image.width_px, 8);
    EXPECT_EQ(image.height_px, 4);
    const auto level = static_cast<std::uint8_t>(k / 2 + (k % 2 == 0 ? 100 : 0));
    EXPECT_EQ(image.pixels, std::vector<std::uint8_t>(32, level));
  }
  EXPECT_THAT(testing::rejections_of(*sensor), ::testing::IsEmpty());
}

TEST_F(Ros1Topics, EndsSoonAfterStop) {
  const auto sensor = make_ros1_topics(", imu_topic: /imu0");
  std::thread stopper([&sensor] {
    std::this_thread::sleep_for(300ms);
    sensor->stop();
  });
  const auto begin = steady_clock::now();
  Measurement out;
  EXPECT_EQ(sensor->next(out), Status::kEnd);
  stopper.join();
  const auto took = steady_clock::now() - begin;
  EXPECT_GT(took, 250ms);
  EXPECT_LT(took, 3s);
  EXPECT_EQ(sensor->next(out), Status::kEnd);
}

TEST_F(Ros1Topics, SaysWhichTopicNobodyPublishesAndWhatIsThereInstead) {
  // Who publishes waits for readers of all topics.
  const auto published = make_ros1_topics(std::string(kAllTopics) + ", publish: false");
  Child publisher({VIWO_TEST_ROS_NODE, "publish", "1600"}, ros_->file("publisher.log"));
  const auto sensor = make_ros1_topics(", imu_topic: /imu1, idle_timeout_s: 30");
  const auto deadline = steady_clock::now() + 20s;
  const std::string expected = "nobody publishes topic '/imu1' - did you mean '/imu0'?";
  while (!said().has(expected) && steady_clock::now() < deadline) {
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_TRUE(said().has(expected)) << said().all();
}

TEST_F(Ros1Topics, SaysThatThereIsNoMaster) {
  const std::string uri = "http://127.0.0.1:" + std::to_string(testing::RosSystem::free_port());
  const auto begin = steady_clock::now();
  EXPECT_EQ(
      error_of(", imu_topic: /imu0, connect_timeout_s: 0.5, master_uri: '" + uri + "'"),
      "test.yaml:1:1  sensor (ros1_topics): no ROS master at " + uri + ": is roscore running?");
  EXPECT_LT(steady_clock::now() - begin, 10s);
}

TEST_F(Ros1Topics, SaysThatWhatListensIsNoMaster) {
  const testing::LocalSocket server;
  server.listen_and_say_nothing();
  const std::string uri = "http://127.0.0.1:" + std::to_string(server.port());
  const auto begin = steady_clock::now();
  EXPECT_EQ(
      error_of(", imu_topic: /imu0, connect_timeout_s: 0.5, master_uri: '" + uri + "'"),
      "test.yaml:1:1  sensor (ros1_topics): no ROS master at " + uri + ": is roscore running?");
  EXPECT_LT(steady_clock::now() - begin, 10s);
}

TEST_F(Ros1Topics, RefusesParametersThatContradictEachOther) {
  EXPECT_THAT(error_of(""), HasSubstr("sensor.imu_topic: nothing to listen to: give one of "));
  EXPECT_THAT(error_of(", imu_topic: /a b"),
              HasSubstr("sensor.imu_topic: '/a b' cannot be the name of a topic: "));
  EXPECT_THAT(error_of(", joint_topic: /j"),
              HasSubstr("sensor.joint_topic: a joint_topic needs drive_joints"));
  EXPECT_THAT(error_of(", imu_topic: /i, steer_joints: [s]"),
              HasSubstr("sensor.steer_joints: names of joints need the joint_topic"));
  EXPECT_THAT(error_of(", imu_topic: /i, image_topics: [/c, /i]"),
              HasSubstr("sensor.image_topics: '/i' is wanted twice"));
  EXPECT_THAT(error_of(", pose_topic: /p, odometry_topic: /o"),
              HasSubstr("sensor.odometry_topic: pose_topic and odometry_topic both give poses"));
  EXPECT_THAT(error_of(", imu_topic: /i, p_IinB_m: [1, 2]"),
              HasSubstr("sensor.p_IinB_m: needs 3 numbers, not 2"));
  EXPECT_THAT(error_of(", imu_topic: /i, body_frame: odom"),
              HasSubstr("sensor.body_frame: 'odom' is the world_frame, too"));
  EXPECT_THAT(error_of(", imu_topic: /i, master_uri: here"),
              HasSubstr("master_uri is 'here': expected http://HOST:PORT"));
}

TEST_F(Ros1Topics, PublishesTheEstimate) {
  const auto sensor = make_ros1_topics(
      ", imu_topic: /imu0, world_frame: map, body_frame: base_link, p_IinB_m: "
      "[0.5, 0, 0], warn_latency_s: 10");
  Child recorder({VIWO_TEST_ROS_NODE, "record", ros_->file("heard.txt")},
                 ros_->file("recorder.log"));
  EstimateSample estimate;
  estimate.p_IinG_m = {1., 2., 3.};
  estimate.latency_s = 0.0125;
  estimate.calibration_names = {"r_1"};
  estimate.calibration = {0.0255};
  estimate.calibration_sigma = {0.25};
  const auto deadline = steady_clock::now() + 20s;
  std::string heard;
  const auto complete = [&heard] {
    return heard.find("odometry ") != std::string::npos && heard.find("tf ") != std::string::npos &&
           heard.find("diagnostics ") != std::string::npos;
  };
  for (std::int64_t k = 0; !complete() && steady_clock::now() < deadline; ++k) {
    estimate.t_ns = kStart + k;
    sensor->estimate(estimate);
    std::this_thread::sleep_for(50ms);
    heard = text_of("heard.txt");
  }
  EXPECT_THAT(heard, ::testing::ContainsRegex("odometry 1700000000[0-9]+ map base_link 0.5 2 3"));
  EXPECT_THAT(heard, ::testing::ContainsRegex("tf 1700000000[0-9]+ map base_link 0.5"));
  EXPECT_THAT(heard, HasSubstr(" latency_s=0.0125 "));
  EXPECT_THAT(heard, HasSubstr(" r_1=0.0255 sigma r_1=0.25"));
}

}  // namespace
}  // namespace viwo
