// Messages of images, poses and fixes as ROS serialises them, to measurements; silent topics.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "ros_messages.hpp"
#include "test_intake.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::ros1 {
namespace {

using bag::TopicOptions;
using live::Intake;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(IntakeTest, TakesPosesOfEitherMessage) {
  TopicOptions options;
  options.pose_topic = "/pose";
  Intake intake = make(options);
  msg::PoseStamped pose;
  pose.header.stamp = time_of(kTime);
  pose.pose.position.x = 1.;
  pose.pose.position.z = 3.;
  pose.pose.orientation.z = 0.6;
  pose.pose.orientation.w = 0.8;
  take(intake, 0, pose);
  msg::PoseWithCovarianceStamped other;
  other.header.stamp = time_of(kTime + 1);
  other.pose.pose = pose.pose;
  take(intake, 0, other);
  pose.header.stamp = time_of(kTime + 2);
  pose.pose.orientation.w = 0.9;
  take(intake, 0, pose);
  const auto all = taken();
  ASSERT_EQ(all.size(), 2U);
  for (const Measurement& measurement : all) {
    const auto& sample = *measurement.get_if<PoseSample>();
    EXPECT_EQ(sample.p_BinW_m, (std::array{1., 0., 3.}));
    EXPECT_EQ(sample.q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
  }
  EXPECT_EQ(stamp_ns(all[1]), kTime + 1);
  EXPECT_THAT(rejections_of(intake), ElementsAre("/pose: quaternion that is not of unit norm | 1 | "
                                                 "stamp " +
                                                 std::to_string(kTime + 2) + " ns"));
}

TEST_F(IntakeTest, TakesImagesRawAndCompressedPixelForPixel) {
  TopicOptions options;
  options.image_topics = {"/cam0", "/cam1"};
  Intake intake = make(options);
  Image pixels{3, 2, {1, 2, 3, 4, 5, 6}};
  msg::Image left;
  left.header.stamp = time_of(kTime);
  left.width = 3;
  left.height = 2;
  left.step = 4;
  left.encoding = "mono8";
  left.data = {1, 2, 3, 99, 4, 5, 6, 99};
  msg::CompressedImage right;
  right.header.stamp = time_of(kTime);
  right.format = "mono8; png compressed";
  const auto png = encode_png(pixels);
  right.data.assign(png.begin(), png.end());
  take(intake, 1, right);
  EXPECT_TRUE(taken().empty()) << "the left one is waited for";
  take(intake, 0, left);
  const auto all = taken();
  ASSERT_EQ(all.size(), 2U);
  for (int camera = 0; camera < 2; ++camera) {
    const auto& image = *all[static_cast<std::size_t>(camera)].get_if<ImageSample>();
    EXPECT_EQ(image.camera, camera);
    EXPECT_EQ(image.t_ns, kTime);
    Image read;
    image.source->read(read);
    EXPECT_EQ(read.width_px, 3);
    EXPECT_EQ(read.height_px, 2);
    EXPECT_EQ(read.pixels, pixels.pixels);
  }
}

TEST_F(IntakeTest, ImagesThatWaitTakeSoManyBytesAndNoMore) {
  TopicOptions options;
  options.image_topics = {"/cam0"};
  Intake intake = make(options);
  msg::CompressedImage image;
  image.format = "png";
  const auto send = [&](std::int64_t k, std::size_t megabytes) {
    image.header.stamp = time_of(k * kSecond / 10);
    image.data.resize(megabytes << 20);
    take(intake, 0, image);
  };
  for (std::int64_t k = 1; k <= 5; ++k) send(k, 120);  // the fifth has no room
  auto all = taken();
  EXPECT_EQ(all.size(), 4U);
  EXPECT_THAT(
      rejections_of(intake),
      ElementsAre("/cam0: image beyond the 512 MiB that images may take while they wait | 1 | "
                  "stamp 500000000 ns"));
  all.clear();
  send(6, 120);
  EXPECT_EQ(taken().size(), 1U) << "what is not held any more does not count";
  send(7, 129);
  EXPECT_EQ(rejections_of(intake).size(), 2U);
  EXPECT_THAT(rejections_of(intake).back(), HasSubstr("/cam0: message of more than 128 MiB | 1"));
}

TEST_F(IntakeTest, InStepImagesThatFillTheMemoryWaitAndNoneIsLost) {
  TopicOptions options;
  options.image_topics = {"/cam0"};
  options.imu_topic = "/imu";
  Intake intake = make(options, live::Pace::kInStep);
  const auto camera = static_cast<std::size_t>(intake.topics()[0].camera < 0 ? 1 : 0);
  msg::CompressedImage image;
  image.format = "png";
  image.data.resize(120 << 20);
  for (std::int64_t k = 1; k <= 5; ++k) {
    EXPECT_FALSE(intake.is_full(camera)) << k;
    image.header.stamp = time_of(k * kSecond / 10);
    take(intake, camera, image);
  }
  EXPECT_TRUE(intake.is_full(camera));
  EXPECT_FALSE(intake.is_full(1 - camera)) << "the IMU";
  EXPECT_EQ(taken().size(), 5U);
  EXPECT_THAT(rejections_of(intake), ::testing::IsEmpty());
  EXPECT_FALSE(intake.is_full(camera));
}

TEST_F(IntakeTest, SaysWhichImagesAreNotRead) {
  TopicOptions options;
  options.image_topics = {"/cam0"};
  Intake intake = make(options);
  msg::Image image;
  image.header.stamp = time_of(kSecond);
  image.encoding = "32FC1";
  take(intake, 0, image);
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_THAT(warnings_[0],
              HasSubstr("topic /cam0: image of encoding '32FC1': what is read is mono8, "));
  // What is wrong with the pixels shows when they are read.
  image.encoding = "mono8";
  image.width = 100;
  image.height = 100;
  image.step = 100;
  image.data.resize(5000);
  take(intake, 0, image);
  const auto all = taken();
  ASSERT_EQ(all.size(), 1U);
  Image out;
  const std::string error =
      testing::error_of([&] { all[0].get_if<ImageSample>()->source->read(out); });
  EXPECT_THAT(error, HasSubstr("image on topic '/cam0' of 1000000000 ns: "));
  EXPECT_THAT(error, HasSubstr("5000"));
}

TEST_F(IntakeTest, RefusesCompressedImagesOfDepthAndSaysItOnce) {
  TopicOptions options;
  options.image_topics = {"/cam0"};
  Intake intake = make(options);
  msg::CompressedImage depth;
  depth.format = "16UC1; compressedDepth png";
  for (int k = 1; k <= 2; ++k) {
    depth.header.stamp = time_of(k * kSecond);
    take(intake, 0, depth);
  }
  EXPECT_TRUE(taken().empty());
  EXPECT_THAT(rejections_of(intake),
              ElementsAre("/cam0: image of depth (format '16UC1; compressedDepth png'): grey or "
                          "colour ones are needed | 2 | stamp 1000000000 ns"));
  EXPECT_EQ(warnings_.size(), 1U);
}

TEST_F(IntakeTest, KnowsWhichTopicsAreSilent) {
  TopicOptions options = imu_only();
  options.image_topics = {"/cam0"};
  Intake intake = make(options);
  EXPECT_TRUE(intake.silent_topics(std::chrono::seconds(10)).empty());
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  take(intake, 0, imu_message(kSecond));
  EXPECT_THAT(intake.silent_topics(std::chrono::milliseconds(50)), ElementsAre("/cam0"));
}

TEST_F(IntakeTest, TakesFixesAndCountsMessagesThatHaveNone) {
  TopicOptions options;
  options.gnss_topic = "/fix";
  Intake intake = make(options);
  msg::NavSatFix message;
  message.header.stamp = time_of(kTime);
  message.status.status = sensor_msgs::NavSatStatus::STATUS_NO_FIX;
  message.latitude = 42.5;
  message.longitude = -71.25;
  message.altitude = 7.5;
  message.position_covariance[0] = message.position_covariance[4] = 0.81;
  message.position_covariance[8] = 3.24;
  message.position_covariance_type = msg::NavSatFix::COVARIANCE_TYPE_APPROXIMATED;
  take(intake, 0, message);
  message.status.status = sensor_msgs::NavSatStatus::STATUS_SBAS_FIX;
  take(intake, 0, message);
  message.header.stamp = time_of(kTime + kSecond);  // no gap, though longer than max_gap_s
  message.latitude = 142.5;
  take(intake, 0, message);
  message.latitude = 42.5;
  take(intake, 0, message);
  const auto all = taken();
  ASSERT_EQ(all.size(), 2U);
  const auto* const fix = all[0].get_if<GnssSample>();
  ASSERT_NE(fix, nullptr);
  EXPECT_EQ(fix->t_ns, kTime);
  EXPECT_EQ(fix->latitude_deg, 42.5);
  EXPECT_EQ(fix->covariance_ENU_m2[8], 3.24);
  EXPECT_THAT(rejections_of(intake), ElementsAre("/fix: message without a fix | 1 | stamp 0 ns",
                                                 "/fix: latitude beyond 90 degrees | 1 | stamp " +
                                                     std::to_string(kTime + kSecond) + " ns"));
}

}  // namespace
}  // namespace viwo::ros1
