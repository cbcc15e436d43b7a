// Pixels of all encodings, against values by hand; messages that take more than they are.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "joint_reading.hpp"
#include "message_of.hpp"
#include "messages.hpp"

namespace viwo::bag {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;

Image grey(const ImageHead& head, const Bytes& pixels) {
  Image out;
  to_grey(head, pixels, out);
  return out;
}

ImageHead head(const std::string& encoding, std::uint32_t width_px, std::uint32_t height_px,
               std::uint32_t row_bytes, bool big_endian = false) {
  return {0, height_px, width_px, encoding, big_endian, row_bytes};
}

std::string error_of(const ImageHead& bad, const Bytes& pixels) {
  return testing::error_of<BrokenMessage>([&] { grey(bad, pixels); });
}

/// A list of `count` texts, all the same, and no numbers.
class Names final : public FieldReader {
 public:
  Names(std::uint32_t count, std::size_t size) : count_(count), name_(size, 'a') {}
  std::int64_t stamp() override { return 1; }
  std::uint8_t u8() override { return 0; }
  std::uint16_t u16() override { return 0; }
  std::uint32_t u32() override { return std::exchange(count_, 0); }
  double f64() override { return 0.; }
  std::string_view text() override { return name_; }
  std::span<const std::uint8_t> bytes() override { return {}; }
  std::size_t left() const override { return 1'000'000'000; }

 private:
  std::uint32_t count_;
  std::string name_;
};

TEST(ReadJoints, RefusesMoreAndLongerNamesThanARobotHas) {
  const auto error = [](std::uint32_t count, std::size_t size) {
    Names names(count, size);
    return testing::error_of<BrokenMessage>([&] { read_joints(names); });
  };
  EXPECT_EQ(error(200'000'000, 0), "it has more than 10000 joints");
  EXPECT_EQ(error(1, 1001), "a joint has a name of over 1000 bytes");
  Names names(10'000, 1000);
  EXPECT_EQ(read_joints(names).names.size(), 10'000U);
}

/// One drive and one steering, as one message or as two.
class JointReadingsTest : public ::testing::Test {
 protected:
  static TopicOptions options() {
    TopicOptions out;
    out.drive_joints = {"drive"};
    out.steer_joints = {"steer"};
    return out;
  }
  /// "1.5 0.2 at 3", "rest", or what is missing.
  std::string take(std::int64_t t_ns, const std::vector<std::string>& names, double velocity,
                   double position) {
    Joints joints;
    joints.t_ns = t_ns;
    joints.names = names;
    joints.velocities.assign(names.size(), velocity);
    joints.positions.assign(names.size(), position);
    log::EncoderReading reading;
    if (const auto missing = readings_.add(joints, reading)) {
      return missing->what == MissingJoint::What::kRest    ? "rest"
             : missing->what == MissingJoint::What::kAgain ? "again"
                                                           : "no " + missing->joint;
    }
    return std::to_string(static_cast<int>(reading.drive[0])) + " " +
           std::to_string(static_cast<int>(reading.steer_rad[0])) + " at " +
           std::to_string(reading.t_ns);
  }

  JointReadings readings_{options()};
};

TEST_F(JointReadingsTest, AreOfOneMessageOrOfSeveral) {
  EXPECT_EQ(take(1, {"steer", "arm", "drive"}, 7., 8.), "7 8 at 1");
  EXPECT_EQ(take(2, {"drive"}, 1., 0.), "rest");
  EXPECT_EQ(take(3, {"drive"}, 2., 0.), "again") << "faster than the steering";
  EXPECT_EQ(take(4, {"steer"}, 0., 3.), "2 3 at 4");
  EXPECT_EQ(take(5, {"steer"}, 0., 4.), "rest");
  EXPECT_EQ(take(6, {"drive"}, 5., 0.), "5 4 at 6");
}

TEST_F(JointReadingsTest, SayWhatDoesNotCome) {
  EXPECT_EQ(take(1, {"drive"}, 1., 0.), "no steer") << "nobody has seen it";
  EXPECT_EQ(take(2, {"arm"}, 1., 0.), "no drive");
  EXPECT_EQ(take(3, {"steer"}, 0., 1.), "1 1 at 3");
  EXPECT_EQ(take(4, {"drive"}, 1., 0.), "rest");
  for (int k = 1; k <= 40; ++k) EXPECT_EQ(take(4 + k, {"drive"}, 1., 0.), "again");
  EXPECT_EQ(take(50, {"drive"}, 1., 0.), "no steer") << "it came once, and comes no more";
  // A drive from before a pause is of no use to a steering after it.
  constexpr std::int64_t kLater = 10'000'000'000;
  EXPECT_EQ(take(kLater, {"steer"}, 0., 1.), "rest");
  EXPECT_EQ(take(kLater + 1, {"drive"}, 5., 0.), "5 1 at 10000000001");
  readings_.restart();
  EXPECT_EQ(take(51, {"drive"}, 1., 0.), "no steer");
}

TEST(ToGrey, LeavesOutThePaddingOfRows) {
  const Image out = grey(head("mono8", 2, 2, 3), {1, 2, 99, 3, 4});  // the last row may end early
  EXPECT_EQ(out.width_px, 2);
  EXPECT_EQ(out.height_px, 2);
  EXPECT_THAT(out.pixels, ElementsAre(1, 2, 3, 4));
}

TEST(ToGrey, TakesTheUpperByteInTheByteOrderOfTheMessage) {
  EXPECT_THAT(grey(head("mono16", 2, 1, 4, false), {1, 2, 3, 4}).pixels, ElementsAre(2, 4));
  EXPECT_THAT(grey(head("16UC1", 2, 1, 4, true), {1, 2, 3, 4}).pixels, ElementsAre(1, 3));
}

TEST(ToGrey, WeighsColoursInTheOrderOfTheEncoding) {
  // 0.299 R + 0.587 G + 0.114 B of (200, 100, 50) and of (50, 100, 200)
  EXPECT_THAT(grey(head("rgb8", 1, 1, 3), {200, 100, 50}).pixels, ElementsAre(124));
  EXPECT_THAT(grey(head("bgr8", 1, 1, 3), {200, 100, 50}).pixels, ElementsAre(96));
  EXPECT_THAT(grey(head("8UC3", 1, 1, 3), {200, 100, 50}).pixels, ElementsAre(96));
  EXPECT_THAT(grey(head("rgba8", 1, 1, 4), {200, 100, 50, 9}).pixels, ElementsAre(124));
  EXPECT_THAT(grey(head("bgra8", 1, 1, 4), {200, 100, 50, 9}).pixels, ElementsAre(96));
}

TEST(ToGrey, KnowsWhereTheColoursOfABayerPatternAre) {
  // Everywhere R = 200, G = 100, B = 50; what is at (row, column) of the pattern's square.
  const auto field = [](const Bytes& square) {
    Bytes pixels;
    for (std::size_t v = 0; v < 6; ++v) {
      for (std::size_t u = 0; u < 6; ++u) pixels.push_back(square[2 * (v % 2) + u % 2]);
    }
    return pixels;
  };
  EXPECT_THAT(grey(head("bayer_rggb8", 6, 6, 6), field({200, 100, 100, 50})).pixels, Each(124));
  EXPECT_THAT(grey(head("bayer_bggr8", 6, 6, 6), field({50, 100, 100, 200})).pixels, Each(124));
  EXPECT_THAT(grey(head("bayer_gbrg8", 6, 6, 6), field({100, 50, 200, 100})).pixels, Each(124));
  EXPECT_THAT(grey(head("bayer_grbg8", 6, 6, 6), field({100, 200, 50, 100})).pixels, Each(124));
}

TEST(ToGrey, TakesTheBrightnessOfYuv) {
  EXPECT_THAT(grey(head("yuv422", 2, 1, 4), {9, 1, 8, 2}).pixels, ElementsAre(1, 2));
  EXPECT_THAT(grey(head("yuv422_yuy2", 2, 1, 4), {1, 9, 2, 8}).pixels, ElementsAre(1, 2));
}

TEST(ToGrey, RefusesSizesThatContradictEachOther) {
  EXPECT_EQ(error_of(head("mono8", 2, 2, 2), {1, 2, 3}),
            "an image of 2 x 2 mono8 in rows of 2 bytes has 3 bytes of pixels");
  EXPECT_EQ(error_of(head("rgb8", 2, 1, 5), Bytes(10)),
            "an image of 2 x 1 rgb8 in rows of 5 bytes has 10 bytes of pixels");
  EXPECT_EQ(error_of(head("mono8", 0, 1, 0), {}), "an image of 0 x 1 mono8");
  EXPECT_EQ(error_of(head("mono8", 1, 0xffffffff, 1), {1}), "an image of 1 x 4294967295 mono8");
  EXPECT_EQ(error_of(head("mono8", 8192, 4097, 8192), {1}), "an image of 8192 x 4097 mono8");
  EXPECT_EQ(error_of(head("32FC1", 1, 1, 4), Bytes(4)), "encoding '32FC1' is not read");
}

TEST(Kinds, AreThoseOfBothRos) {
  EXPECT_EQ(kind_of("sensor_msgs/Imu"), Kind::kImu);
  EXPECT_EQ(kind_of("sensor_msgs/msg/Imu"), Kind::kImu);
  EXPECT_EQ(kind_of("nav_msgs/msg/Odometry"), Kind::kOdometry);
  EXPECT_EQ(kind_of("sensor_msgs/msg/PointCloud2"), std::nullopt);
  EXPECT_EQ(type_name(Kind::kPoseWithCovariance), "geometry_msgs/PoseWithCovarianceStamped");
}

}  // namespace
}  // namespace viwo::bag
