// Messages of the IMU and of wheels as ROS serialises them, to measurements; their stamps.
#include "test_intake.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ros_messages.hpp"
#include "viwo/api/status.hpp"

namespace viwo::ros1 {
namespace {

using bag::TopicOptions;
using live::Intake;
using ::testing::ElementsAre;

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
      rejections_of(intake),
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
    EXPECT_THAT(rejections_of(intake),
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
  EXPECT_THAT(rejections_of(intake),
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
  EXPECT_THAT(rejections_of(intake),
              ElementsAre("/joint_states: gap longer than 0.2 s | 1 | stamp " +
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
  EXPECT_THAT(rejections_of(intake),
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
      rejections_of(intake),
      ElementsAre(
          "/joint_states: no joint 'drive_1' - did you mean 'drve_1'? | 1 | stamp 1000000000 ns",
          "/joint_states: no velocity of joint 'drive_1' | 1 | stamp 1000000000 ns",
          "/joint_states: velocity of joint 'drive_1' that is not finite | 1 | stamp 1000000000 "
          "ns"));
}

}  // namespace
}  // namespace viwo::ros1
