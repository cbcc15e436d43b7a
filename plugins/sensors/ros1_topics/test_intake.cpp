// Messages as ROS serialises them, to measurements.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "intake.hpp"
#include "master.hpp"
#include "ros1_fields.hpp"
#include "ros_messages.hpp"
#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::ros1 {
namespace {

using bag::TopicOptions;
using live::Intake;
using live::LiveQueue;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class Message>
std::shared_ptr<const bag::Bytes> raw(const Message& message) {
  auto out = std::make_shared<bag::Bytes>(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(out->data(), static_cast<std::uint32_t>(out->size()));
  ros::serialization::serialize(stream, message);
  return out;
}

ros::Time time_of(std::int64_t t_ns) {
  return {static_cast<std::uint32_t>(t_ns / 1'000'000'000),
          static_cast<std::uint32_t>(t_ns % 1'000'000'000)};
}

class IntakeTest : public ::testing::Test {
 protected:
  static void log_text(void* host, LogLevel level, const char* text, std::uint64_t size) {
    EXPECT_EQ(level, LogLevel::kWarning);
    static_cast<IntakeTest*>(host)->warnings_.emplace_back(text, size);
  }

  Intake make(const TopicOptions& options) {
    return {options, services_, queue_,
            [](std::span<const std::uint8_t> message) -> std::unique_ptr<bag::FieldReader> {
              return std::make_unique<bag::Ros1Fields>(message);
            }};
  }

  template <class Message>
  static void take(Intake& intake, std::size_t topic, const Message& message) {
    intake.take(topic, ros::message_traits::datatype<Message>(),
                ros::message_traits::md5sum<Message>(), raw(message));
  }

  std::vector<Measurement> taken() {
    std::vector<Measurement> all;
    Measurement out;
    while (queue_.pop(out, std::chrono::milliseconds(0)) == LiveQueue::Taken::kMeasurement) {
      all.push_back(out);
    }
    return all;
  }

  static std::vector<std::string> rejections(const Intake& intake) {
    std::vector<RejectionCount> counts;
    intake.rejections(counts);
    std::vector<std::string> texts;
    for (const RejectionCount& c : counts) {
      texts.push_back(c.reason + " | " + std::to_string(c.count) + " | " + c.first);
    }
    return texts;
  }

  std::vector<std::string> warnings_;
  HostServices services_{this, &IntakeTest::log_text, 1};
  LiveQueue queue_{16};
};

TopicOptions imu_only() {
  TopicOptions options;
  options.imu_topic = "/imu0";
  return options;
}

msg::Imu imu_message(std::int64_t t_ns, double rate = 0.1) {
  msg::Imu message;
  message.header.stamp = time_of(t_ns);
  message.header.frame_id = "imu_link";
  message.orientation_covariance[0] = -1.;
  message.angular_velocity.x = rate;
  message.angular_velocity.y = 0.2;
  message.angular_velocity.z = 0.3;
  message.linear_acceleration.x = 1.;
  message.linear_acceleration.y = 2.;
  message.linear_acceleration.z = 9.8;
  return message;
}

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kTime = 1'700'000'000 * kSecond + 123'456'789;

TEST_F(IntakeTest, TakesImuMessagesToTheNanosecond) {
  Intake intake = make(imu_only());
  EXPECT_FALSE(intake.last_use());
  take(intake, 0, imu_message(kTime));
  EXPECT_TRUE(intake.last_use());
  const auto all = taken();
  ASSERT_EQ(all.size(), 1U);
  const auto& imu = *all[0].get_if<ImuSample>();
  EXPECT_EQ(imu.t_ns, kTime);
  EXPECT_EQ(imu.gyro_rad_per_s, (std::array{0.1, 0.2, 0.3}));
  EXPECT_EQ(imu.accel_m_per_s2, (std::array{1., 2., 9.8}));
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(IntakeTest, CountsWhatCannotBeUsedAndSaysItOnce) {
  Intake intake = make(imu_only());
  take(intake, 0, imu_message(5 * kSecond));
  take(intake, 0, imu_message(5 * kSecond));
  take(intake, 0, imu_message(4 * kSecond));
  take(intake, 0, imu_message(6 * kSecond, std::numeric_limits<double>::infinity()));
  take(intake, 0, imu_message(0));
  take(intake, 0, msg::Odometry());
  intake.take(0, "sensor_msgs/Imu", "00000000000000000000000000000000", raw(imu_message(7)));
  auto cut = std::make_shared<bag::Bytes>(*raw(imu_message(8 * kSecond)));
  cut->resize(100);
  intake.take(0, "sensor_msgs/Imu", "*", cut);
  take(intake, 0, imu_message(5 * kSecond + 100'000'000));
  take(intake, 0, imu_message(6 * kSecond));
  EXPECT_EQ(taken().size(), 3U);
  EXPECT_THAT(
      rejections(intake),
      ElementsAre(
          "/imu0: stamp not after the previous one | 2 | stamp 5000000000 ns",
          "/imu0: value that is not finite | 1 | stamp 6000000000 ns",
          "/imu0: message without a stamp | 1 | stamp 0 ns",
          "/imu0: a nav_msgs/Odometry where a sensor_msgs/Imu must be | 1 | stamp 0 ns",
          "/imu0: another definition of sensor_msgs/Imu (md5 00000000000000000000000000000000) | 1 "
          "| stamp 0 ns",
          "/imu0: message that is broken: it ends too early | 1 | stamp 0 ns",
          "/imu0: gap longer than 0.2 s | 1 | stamp 6000000000 ns"));
  ASSERT_EQ(warnings_.size(), 7U) << "one for each";
  EXPECT_EQ(warnings_[0],
            "topic /imu0: stamp not after the previous one; it is dropped, and others like it are "
            "counted");
}

TopicOptions wheels() {
  TopicOptions options;
  options.joint_topic = "/joint_states";
  options.drive_joints = {"drive_1", "drive_2"};
  options.steer_joints = {"steer_1"};
  return options;
}

msg::JointState joint_message(std::int64_t t_ns, double drive_1, double drive_2, double steer_1) {
  msg::JointState message;
  message.header.stamp = time_of(t_ns);
  message.name = {"arm", "drive_2", "steer_1", "drive_1"};
  message.position = {9., 10. * drive_2, steer_1, 10. * drive_1};
  message.velocity = {9., drive_2, 0., drive_1};
  return message;
}

/// Stamps of what was taken, ms.
std::vector<std::int64_t> stamps_ms(const std::vector<Measurement>& all) {
  std::vector<std::int64_t> t_ms;
  for (const Measurement& m : all) t_ms.push_back(stamp_ns(m) / 1'000'000);
  return t_ms;
}

TEST_F(IntakeTest, IsNotSpoiltByOneStampInTheFuture) {
  for (const std::int64_t ahead_s : {2, 3600}) {
    Intake intake = make(imu_only());
    take(intake, 0, imu_message(5 * kSecond));
    take(intake, 0, imu_message((5 + ahead_s) * kSecond));
    take(intake, 0, imu_message(5 * kSecond + 10'000'000));
    take(intake, 0, imu_message(5 * kSecond + 20'000'000));
    EXPECT_THAT(stamps_ms(taken()), ElementsAre(5000, 5010, 5020)) << ahead_s;
    EXPECT_THAT(rejections(intake),
                ElementsAre("/imu0: stamp far ahead of the previous one | 1 | stamp " +
                            std::to_string((5 + ahead_s) * kSecond) + " ns"));
  }
}

TEST_F(IntakeTest, GoesOnFromAClockThatWasSetBack) {
  TopicOptions options = imu_only();
  options.image_topics = {"/cam0"};
  Intake intake = make(options);
  const auto image = [](std::int64_t t_ns) {
    msg::Image message;
    message.header.stamp = time_of(t_ns);
    message.height = message.width = message.step = 1;
    message.encoding = "mono8";
    message.data = {0};
    return message;
  };
  take(intake, 0, imu_message(3600 * kSecond));
  take(intake, 1, image(3600 * kSecond));
  for (std::int64_t k = 0; k < 12; ++k) {
    take(intake, 0, imu_message(5 * kSecond + k * 10'000'000));
    take(intake, 1, image(5 * kSecond + k * 100'000'000));
  }
  EXPECT_THAT(stamps_ms(taken()),
              ElementsAre(3'600'000, 3'600'000, 5090, 5900, 5100, 6000, 5110, 6100));
  EXPECT_THAT(rejections(intake),
              ElementsAre("/imu0: stamp not after the previous one | 9 | stamp 5000000000 ns",
                          "/cam0: stamp not after the previous one | 9 | stamp 5000000000 ns",
                          "/imu0: clock set back | 1 | stamp 5090000000 ns",
                          "/cam0: clock set back | 1 | stamp 5900000000 ns"));
}

TEST_F(IntakeTest, MakesCausalCellsOfRates) {
  Intake intake = make(wheels());
  take(intake, 0, joint_message(kTime, 1., 2., 3.1));
  EXPECT_TRUE(taken().empty()) << "the first reading only begins a cell";
  take(intake, 0, joint_message(kTime + 10'000'000, 3., 4., -3.1));
  const auto all = taken();
  ASSERT_EQ(all.size(), 1U);
  const auto& cell = *all[0].get_if<EncoderSample>();
  EXPECT_EQ(cell.begin_ns, kTime);
  EXPECT_EQ(cell.end_ns, kTime + 10'000'000) << "no later than what has been read";
  EXPECT_EQ(cell.t_ns, kTime + 5'000'000);
  EXPECT_EQ(cell.n_drive, 2);
  EXPECT_EQ(cell.n_steer, 1);
  EXPECT_EQ(cell.drive_rad_per_s[0], 2.);
  EXPECT_EQ(cell.drive_rad_per_s[1], 3.);
  EXPECT_NEAR(std::abs(cell.steer_rad[0]), M_PI, 1e-12) << "the shorter way round";
}

TEST_F(IntakeTest, TakesTheTwistOfAnOdometryForDrives) {
  TopicOptions options = wheels();
  options.drive_joints = {"v_x", "v_y", "omega_z"};
  options.steer_joints.clear();
  Intake intake = make(options);
  for (const std::int64_t t_ns : {kTime, kTime + 10'000'000}) {
    msg::Odometry odometry;
    odometry.header.stamp = time_of(t_ns);
    odometry.twist.twist.linear.x = 0.75;
    odometry.twist.twist.linear.y = 0.25;
    odometry.twist.twist.angular.z = 0.5;
    take(intake, 0, odometry);
  }
  const auto all = taken();
  ASSERT_EQ(all.size(), 1U);
  const auto& cell = *all[0].get_if<EncoderSample>();
  EXPECT_EQ(cell.n_drive, 3);
  EXPECT_EQ(cell.drive_rad_per_s[0], 0.75);
  EXPECT_EQ(cell.drive_rad_per_s[1], 0.25);
  EXPECT_EQ(cell.drive_rad_per_s[2], 0.5);
}

TEST_F(IntakeTest, MakesCellsOfAnglesWhoseRatesAreExactInTheMean) {
  TopicOptions options = wheels();
  options.drive_input = TopicOptions::Drive::kPosition;
  Intake intake = make(options);
  take(intake, 0, joint_message(kTime, 1., 2., 0.1));
  take(intake, 0, joint_message(kTime + 100'000'000, 3., 2.5, 0.3));
  take(intake, 0, joint_message(kTime + 400'000'000, 3., 2.5, 0.3));  // behind a gap
  take(intake, 0, joint_message(kTime + 500'000'000, 4., 2.5, 0.3));
  const auto all = taken();
  ASSERT_EQ(all.size(), 2U);
  const auto& cell = *all[0].get_if<EncoderSample>();
  EXPECT_NEAR(cell.drive_rad_per_s[0], 20. / 0.1, 1e-9);
  EXPECT_NEAR(cell.drive_rad_per_s[1], 5. / 0.1, 1e-9);
  EXPECT_NEAR(cell.steer_rad[0], 0.2, 1e-15);
  const auto& behind = *all[1].get_if<EncoderSample>();
  EXPECT_EQ(behind.begin_ns, kTime + 400'000'000) << "no cell reaches over the gap";
  EXPECT_NEAR(behind.drive_rad_per_s[0], 10. / 0.1, 1e-9);
  EXPECT_THAT(rejections(intake), ElementsAre("/joint_states: gap longer than 0.2 s | 1 | stamp " +
                                              std::to_string(kTime + 400'000'000) + " ns"));
}

TEST_F(IntakeTest, TakesJointsAsTheyAreMounted) {
  TopicOptions options = wheels();
  options.drive_input = TopicOptions::Drive::kPosition;
  options.drive_scale = {-1., 0.5};
  options.drive_turn = {100., 0.};
  options.drive_channel = {2., 1.};
  options.steer_shift_rad = {2.};
  Intake intake = make(options);
  take(intake, 0, joint_message(kTime, 9.5, 2., 0.1));
  take(intake, 0, joint_message(kTime + 10'000'000, 0.5, 2.5, 0.3));  // 95 to 105
  take(intake, 0, joint_message(kTime + 20'000'000, 5., 2.5, 0.3));   // 105 to 150, or 50?
  take(intake, 0, joint_message(kTime + 30'000'000, 5., 2.5, 0.3));
  take(intake, 0, joint_message(kTime + 40'000'000, 5.5, 2.5, 0.3));
  const auto all = taken();
  ASSERT_EQ(all.size(), 2U);
  const auto& cell = *all[0].get_if<EncoderSample>();
  EXPECT_NEAR(cell.drive_rad_per_s[0], 0.5 * 5. / 0.01, 1e-9);
  EXPECT_NEAR(cell.drive_rad_per_s[1], -10. / 0.01, 1e-9);
  EXPECT_NEAR(cell.steer_rad[0], 2.2, 1e-15);
  const auto& behind = *all[1].get_if<EncoderSample>();
  EXPECT_EQ(behind.begin_ns, kTime + 30'000'000);
  EXPECT_NEAR(behind.drive_rad_per_s[1], -5. / 0.01, 1e-9);
  EXPECT_THAT(rejections(intake),
              ElementsAre("/joint_states: reading that leaves open how many turns a joint has gone "
                          "(drive_turn, steer_turn) | 1 | stamp " +
                          std::to_string(kTime + 20'000'000) + " ns"));
  options.steer_scale = {1., 2.};
  EXPECT_THROW(make(options), ParamError);
}

TEST_F(IntakeTest, NamesTheJointThatIsNotThere) {
  Intake intake = make(wheels());
  msg::JointState message = joint_message(kSecond, 1., 2., 3.);
  message.name[3] = "drve_1";
  take(intake, 0, message);
  message.name[3] = "drive_1";
  message.velocity.clear();
  take(intake, 0, message);
  message.velocity = {0., 0., 0., std::nan("")};
  take(intake, 0, message);
  EXPECT_THAT(
      rejections(intake),
      ElementsAre(
          "/joint_states: no joint 'drive_1' - did you mean 'drve_1'? | 1 | stamp 1000000000 ns",
          "/joint_states: no velocity of joint 'drive_1' | 1 | stamp 1000000000 ns",
          "/joint_states: velocity of joint 'drive_1' that is not finite | 1 | stamp 1000000000 "
          "ns"));
}

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
  EXPECT_THAT(rejections(intake), ElementsAre("/pose: quaternion that is not of unit norm | 1 | "
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
  try {
    all[0].get_if<ImageSample>()->source->read(out);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("image on topic '/cam0' of 1000000000 ns: "));
    EXPECT_THAT(error.what(), HasSubstr("5000"));
  }
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
  EXPECT_THAT(rejections(intake),
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

TEST(MasterAddress, IsReadFromTheUri) {
  const MasterAddress master = master_address("http://robot-7.local:11311/");
  EXPECT_EQ(master.host, "robot-7.local");
  EXPECT_EQ(master.port, 11311);
  for (const char* wrong : {"robot:11311", "http://robot", "http://robot:0", "http://robot:99999",
                            "http://:11311", "https://robot:11311"}) {
    try {
      master_address(wrong);
      ADD_FAILURE() << wrong;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()),
                "master_uri is '" + std::string(wrong) + "': expected http://HOST:PORT");
    }
  }
}

TEST(MasterAddress, ComesFromTheEnvironmentWhereNoneIsGiven) {
  setenv("ROS_MASTER_URI", "http://127.0.0.1:4711", 1);
  EXPECT_EQ(master_address("").port, 4711);
  EXPECT_EQ(master_address("http://127.0.0.1:4712").port, 4712);
  unsetenv("ROS_MASTER_URI");
  EXPECT_EQ(master_address("").uri, "http://localhost:11311");
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
  EXPECT_THAT(rejections(intake), ElementsAre("/fix: message without a fix | 1 | stamp 0 ns",
                                              "/fix: latitude beyond 90 degrees | 1 | stamp " +
                                                  std::to_string(kTime + kSecond) + " ns"));
}

}  // namespace
}  // namespace viwo::ros1
