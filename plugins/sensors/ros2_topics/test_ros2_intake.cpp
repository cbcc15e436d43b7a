// Messages in CDR to measurements and back; hostile ones, which may do no harm.
#include <chrono>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cdr_message.hpp"
#include "intake.hpp"
#include "rejections.hpp"
#include "ros2_fields.hpp"
#include "ros2_messages.hpp"
#include "viwo/api/status.hpp"

namespace viwo::ros2 {
namespace {

using bag::Bytes;
using bag::CdrMessage;
using ::testing::HasSubstr;

constexpr std::int64_t kTime = 1'700'000'000'123'456'789;

std::unique_ptr<bag::FieldReader> fields_of(std::span<const std::uint8_t> message) {
  return std::make_unique<bag::Ros2Fields>(message);
}

Bytes bytes_of(CdrMessage& message) {
  const auto all = message.bytes();
  return {all.begin(), all.end()};
}

Bytes imu(std::int64_t t_ns, double x = 0.1) {
  CdrMessage out;
  out.header(t_ns, "imu") << std::array{0., 0., 0., 1.} << std::array<double, 9>{}
                          << std::array{x, 0.2, 0.3} << std::array<double, 9>{}
                          << std::array{1., 2., 9.8} << std::array<double, 9>{};
  return bytes_of(out);
}

Bytes joints(std::int64_t t_ns) {
  CdrMessage out;
  out.header(t_ns) << std::vector<std::string>{"drive_1", "steer_1"} << std::vector<double>{0., 0.1}
                   << std::vector<double>{2., 0.} << std::vector<double>{};
  return bytes_of(out);
}

Bytes image(std::int64_t t_ns, std::uint32_t width = 3, std::uint32_t height = 2,
            const std::string& encoding = "mono8", std::size_t n = 6) {
  CdrMessage out;
  out.header(t_ns) << height << width << encoding << std::uint8_t{0} << width
                   << Bytes(n, std::uint8_t{7});
  return bytes_of(out);
}

Bytes compressed(std::int64_t t_ns) {
  CdrMessage out;
  out.header(t_ns) << std::string("jpeg") << Bytes(20, std::uint8_t{7});
  return bytes_of(out);
}

Bytes fix(std::int64_t t_ns) {
  CdrMessage out;
  out.header(t_ns) << std::uint8_t{0} << std::uint16_t{1} << 45. << 15. << 100.
                   << std::array<double, 9>{1., 0., 0., 0., 1., 0., 0., 0., 1.} << std::uint8_t{2};
  return bytes_of(out);
}

Bytes odometry(std::int64_t t_ns) {
  live::Odometry odometry;
  odometry.pose.t_ns = t_ns;
  odometry.pose.p_BinG_m = {1., 2., 3.};
  odometry.pose.q_BtoG_xyzw = {0., 0., 0.6, 0.8};
  odometry.v_BinB_m_per_s = {0.5, 0.25, 0.};
  odometry.w_BinB_rad_per_s = {0., 0., 0.125};
  odometry.world = "odom";
  odometry.body = "base_link";
  return odometry_message(odometry);
}

class Ros2Intake : public ::testing::Test {
 protected:
  Ros2Intake() {
    options_.imu_topic = "/imu";
    options_.joint_topic = "/joints";
    options_.drive_joints = {"drive_1"};
    options_.steer_joints = {"steer_1"};
    options_.odometry_topic = "/odom";
    options_.gnss_topic = "/fix";
    options_.image_topics = {"/cam0"};
    intake_ = std::make_unique<live::Intake>(options_, services_, queue_, fields_of);
  }
  /// The type that fits the topic, of which the first is /imu.
  void take(std::size_t topic, Bytes bytes, const char* type = nullptr) {
    static constexpr const char* kTypes[] = {"sensor_msgs/Imu", "sensor_msgs/JointState",
                                             "nav_msgs/Odometry", "sensor_msgs/NavSatFix",
                                             "sensor_msgs/Image"};
    intake_->take(topic, type != nullptr ? type : kTypes[topic], "*",
                  std::make_shared<const Bytes>(std::move(bytes)));
  }
  std::vector<Measurement> taken() {
    std::vector<Measurement> all;
    Measurement out;
    while (queue_.pop(out, std::chrono::milliseconds(0)) ==
           live::MeasurementQueue::Taken::kMeasurement) {
      all.push_back(out);
    }
    return all;
  }
  std::vector<RejectionCount> rejections() const { return testing::all_rejections(*intake_); }

  bag::TopicOptions options_;
  HostServices services_;
  live::LiveQueue queue_{64};
  std::unique_ptr<live::Intake> intake_;
};

TEST_F(Ros2Intake, TakesAllKindsOfMessages) {
  take(0, imu(kTime));
  take(1, joints(kTime));
  take(1, joints(kTime + 10'000'000));
  take(2, odometry(kTime));
  take(3, fix(kTime));
  take(4, image(kTime));
  take(4, compressed(kTime + 1), "sensor_msgs/CompressedImage");
  const auto all = taken();
  ASSERT_EQ(all.size(), 6U);
  EXPECT_EQ(all[0].get_if<ImuSample>()->gyro_rad_per_s, (std::array{0.1, 0.2, 0.3}));
  EXPECT_EQ(all[0].get_if<ImuSample>()->t_ns, kTime);
  EXPECT_EQ(all[1].get_if<EncoderSample>()->drive_rad_per_s[0], 2.);
  EXPECT_EQ(all[2].get_if<PoseSample>()->p_BinW_m, (std::array{1., 2., 3.}));
  EXPECT_EQ(all[2].get_if<PoseSample>()->q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
  EXPECT_EQ(all[3].get_if<GnssSample>()->latitude_deg, 45.);
  Image pixels;
  all[4].get_if<ImageSample>()->source->read(pixels);
  EXPECT_EQ(pixels.pixels, Bytes(6, std::uint8_t{7}));
  EXPECT_THROW(all[5].get_if<ImageSample>()->source->read(pixels), InputError) << "no JPEG";
  EXPECT_TRUE(rejections().empty());
}

TEST_F(Ros2Intake, ReadsTheTwistOfWhatIsPublished) {
  const Bytes message = odometry(kTime);
  const bag::Joints twist = bag::read_twist(*fields_of(message));
  EXPECT_EQ(twist.t_ns, kTime);
  EXPECT_EQ(twist.velocities, (std::vector<double>{0.5, 0.25, 0.125}));
}

/// What is done to a good message, and what is said of it.
struct Hostile {
  const char* what;
  Bytes bytes;
  const char* said;
};

/// The four bytes at a place of the message (its encapsulation included), changed.
Bytes with_u32(Bytes bytes, std::size_t at, std::uint32_t value) {
  std::memcpy(bytes.data() + at, &value, sizeof(value));
  return bytes;
}
Bytes with_u8(Bytes bytes, std::size_t at, std::uint8_t value) {
  bytes.at(at) = value;
  return bytes;
}
Bytes cut(Bytes bytes, std::size_t size) {
  bytes.resize(size);
  return bytes;
}

TEST_F(Ros2Intake, CountsHostileMessagesAndGoesOn) {
  constexpr std::uint32_t kHuge = std::numeric_limits<std::uint32_t>::max();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr const char* kNoCdr = "it does not begin like CDR";
  constexpr const char* kShort = "it ends too early";
  constexpr const char* kList = "a list is longer than its message";
  // Behind the encapsulation: seconds at 4, nanoseconds at 8, the length of the frame at 12.
  const std::vector<Hostile> of_imu{
      {"nothing", {}, kNoCdr},
      {"half an encapsulation", {0, 1}, kNoCdr},
      {"an encapsulation alone", {0, 1, 0, 0}, kShort},
      {"CDR of version 2", with_u8(imu(kTime), 1, 7), kNoCdr},
      {"a list of parameters", with_u8(imu(kTime), 1, 3), kNoCdr},
      {"an encapsulation of nobody", with_u8(imu(kTime), 0, 200), kNoCdr},
      {"the other byte order", with_u8(imu(kTime), 1, 0), kList},
      {"a frame longer than all", with_u32(imu(kTime), 12, kHuge), kList},
      {"cut in the frame", cut(imu(kTime), 17), kList},
      {"cut in the numbers", cut(imu(kTime), 200), kShort},
      {"cut before the last that is read", cut(imu(kTime), 12), kShort},
      {"not a number", imu(kTime, kNan), "value that is not finite"},
      {"a stamp of zero", imu(0), "message without a stamp"},
  };
  for (const Hostile& one : of_imu) {
    take(0, one.bytes);
    EXPECT_TRUE(taken().empty()) << one.what;
    ASSERT_FALSE(rejections().empty()) << one.what;
    bool is_said = false;
    for (const RejectionCount& r : rejections()) {
      is_said = is_said || r.reason.find(one.said) != std::string::npos;
    }
    EXPECT_TRUE(is_said) << one.what;
  }
  take(1, with_u32(joints(kTime), 20, kHuge));  // the number of names
  take(1, with_u32(joints(kTime), 24, kHuge));  // the length of the first
  EXPECT_THAT(rejections().back().reason, HasSubstr(kList));
  take(3, cut(fix(kTime), 40));
  take(4, image(kTime, 3, 2, "32FC1"));
  EXPECT_THAT(rejections().back().reason, HasSubstr("image of encoding '32FC1'"));
  take(0, imu(kTime), "nav_msgs/Odometry");
  EXPECT_THAT(rejections().back().reason,
              HasSubstr("a nav_msgs/Odometry where a sensor_msgs/Imu must be"));
  EXPECT_TRUE(taken().empty());
  // Sizes that contradict each other show when pixels are wanted.
  take(4, image(kTime, 1U << 20U, 1U << 20U));
  take(4, image(kTime + 1, 3, 3));
  Image pixels;
  for (const Measurement& one : taken()) {
    EXPECT_THROW(one.get_if<ImageSample>()->source->read(pixels), InputError);
  }
  take(0, imu(kTime));
  EXPECT_EQ(taken().size(), 1U) << "what is good is still taken";
}

TEST_F(Ros2Intake, SurvivesMessagesOfRandomBytes) {
  std::mt19937_64 random(18);
  const std::vector<std::pair<std::size_t, Bytes>> good{{0, imu(kTime)},
                                                        {1, joints(kTime)},
                                                        {2, odometry(kTime)},
                                                        {3, fix(kTime)},
                                                        {4, image(kTime)}};
  for (int k = 0; k < 20'000; ++k) {
    auto [topic, bytes] = good[random() % good.size()];
    for (std::uint64_t n = random() % 8; n > 0; --n) {
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    }
    if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    take(topic, std::move(bytes));
    Image pixels;
    for (const Measurement& one : taken()) {
      const auto* image = one.get_if<ImageSample>();
      if (image == nullptr) continue;
      try {
        image->source->read(pixels);
      } catch (const InputError&) {
      }
    }
  }
  std::int64_t n = 0;
  for (const RejectionCount& r : rejections()) n += r.count;
  EXPECT_GT(n, 1000);
}

TEST(CdrMessage, HasZerosBetweenItsNumbersHoweverLongItIs) {
  std::vector<double> numbers(5000);
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(i);
  // Memory as others leave it.
  for (const std::size_t n : {64U, 1024U, 4096U, 65536U}) Bytes(n, 0xaa).shrink_to_fit();
  CdrMessage out;
  out << std::uint8_t{1} << numbers << std::uint8_t{2} << std::uint32_t{3};
  const auto bytes = out.bytes();
  ASSERT_EQ(bytes.size(), 4 + 8 + 5000 * 8 + 8U);
  EXPECT_EQ(bytes[4], 1);
  for (const std::size_t i : {5U, 6U, 7U}) EXPECT_EQ(bytes[i], 0) << i;
  const std::size_t end = bytes.size() - 8;
  EXPECT_EQ(bytes[end], 2);
  for (const std::size_t i : {1U, 2U, 3U}) EXPECT_EQ(bytes[end + i], 0) << i;
  EXPECT_EQ(bytes[end + 4], 3);
  bag::Ros2Fields in(bytes);
  EXPECT_EQ(in.u8(), 1);
  ASSERT_EQ(in.count(8), numbers.size());
  for (const double number : numbers) ASSERT_EQ(in.f64(), number);
  EXPECT_EQ(in.u8(), 2);
  EXPECT_EQ(in.u32(), 3U);
}

TEST(CdrMessage, AlignsWhatMakesItGrow) {
  for (std::size_t n = 1000; n < 1040; ++n) {
    CdrMessage out;
    for (std::size_t i = 0; i < n; ++i) out << std::uint8_t{7};
    out << std::uint16_t{0x0102} << std::uint8_t{3} << 4.;
    bag::Ros2Fields in(out.bytes());
    for (std::size_t i = 0; i < n; ++i) in.u8();
    ASSERT_EQ(in.u16(), 0x0102) << n;
    ASSERT_EQ(in.u8(), 3) << n;
    ASSERT_EQ(in.f64(), 4.) << n;
  }
}

TEST(Ros2Messages, HaveEachNumberAtItsPlace) {
  live::Odometry odometry;
  odometry.pose = {kTime, {1., 2., 3.}, {0.1, 0.2, 0.3, 0.9}};
  odometry.world = "map";
  odometry.body = "base";
  const Bytes tf = tf_message(odometry);
  bag::Ros2Fields in(tf);
  EXPECT_EQ(in.u32(), 1U);
  EXPECT_EQ(in.header(), kTime);
  EXPECT_EQ(in.text(), "base");
  for (const double expected : {1., 2., 3., 0.1, 0.2, 0.3, 0.9}) EXPECT_EQ(in.f64(), expected);
  EXPECT_EQ(in.left(), 0U);

  live::Path path;
  path.add(odometry.pose, 0);
  const Bytes message = path_message(path, "map");
  bag::Ros2Fields poses(message);
  EXPECT_EQ(poses.header(), kTime);
  EXPECT_EQ(poses.u32(), 1U);
  EXPECT_EQ(poses.header(), kTime);
  for (const double expected : {1., 2., 3., 0.1, 0.2, 0.3, 0.9}) EXPECT_EQ(poses.f64(), expected);
  EXPECT_EQ(poses.left(), 0U);

  const Bytes status =
      diagnostics_message({kTime, true, false, "latency 0.3 s", {{"r_1", "0.0255"}, {"a", "b"}}});
  bag::Ros2Fields values(status);
  EXPECT_EQ(values.header(), kTime);
  EXPECT_EQ(values.u32(), 1U);
  EXPECT_EQ(values.u8(), 1U);
  for (const char* expected : {"viwo: odometry", "latency 0.3 s", "viwo"}) {
    EXPECT_EQ(values.text(), expected);
  }
  EXPECT_EQ(values.u32(), 2U);
  for (const char* expected : {"r_1", "0.0255", "a", "b"}) EXPECT_EQ(values.text(), expected);
  EXPECT_EQ(values.left(), 0U);
}

}  // namespace
}  // namespace viwo::ros2
