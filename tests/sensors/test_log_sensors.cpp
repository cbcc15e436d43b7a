// The sensors that play logs back: parameters, data, errors at construction.
#include <gmock/gmock.h>

#include "support.hpp"

namespace viwo {
namespace {

class LogSensors : public SensorsInFolder {};

constexpr const char* kJoints =
    ".header.stamp.secs;.header.stamp.nsecs;time;.name;.position;.velocity\n"
    "1;0;1970/01/01/00:00:03;['s', 'd'];(0.5, 10.0);(0, 7)\n"
    "1;100000000;1970/01/01/00:00:03.2;['s', 'd'];(0.7, 11.0);(0, 8)\n"
    "1;200000000;1970/01/01/00:00:03.3;['s', 'd'];(0.7, 12.5);(0, 9)\n";

TEST_F(LogSensors, AslEncodersYieldRatesAndReportWhatWasDropped) {
  const auto path = write("data.csv", "timestamp_ns,drive_1 [rad/s]\n0,1\n10,2\n10,3\n20,4\n");
  const auto sensor =
      make_sensor("{type: asl_encoders, path: " + path + ", max_rejected_fraction: 0.3}");
  const auto samples = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[2].drive_rad_per_s[0], 4.);
  EXPECT_EQ(samples[1].begin_ns, 5);
  EXPECT_THAT(rejections_of(*sensor),
              ::testing::ElementsAre("stamp not after the previous one | 1 | data.csv:4"));
}

TEST_F(LogSensors, AslEncodersTakeAnglesWithAStride) {
  const auto path =
      write("data.csv", "timestamp_ns,drive_1 [rad]\n0,0\n100000000,1\n200000000,4\n");
  const auto samples = play_only<EncoderSample>(
      "{type: asl_encoders, drive_input: angle, "
      "stride: 2, path: " +
      path + "}");
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].drive_rad_per_s[0], 20.);
  EXPECT_EQ(error_of("{type: asl_encoders, stride: 2, path: " + path + "}"),
            "test.yaml:1:30  sensor.stride: a stride needs drive_input: angle (rates between the "
            "used readings would be lost)");
}

TEST_F(LogSensors, AslEncodersTakeJointsAsTheyAreMounted) {
  const auto path = write("data.csv",
                          "timestamp_ns,drive_1 [deg/s],drive_2 [rpm],steer_1 [counts]\n"
                          "0,90,30,1024\n10,180,60,0\n");
  const std::string of_the_log = "{type: asl_encoders, path: " + path;
  const std::string units = ", drive_scale: [0.0174532925199433, -0.10471975511966]";
  const auto samples = play_only<EncoderSample>(
      of_the_log + units + ", drive_channel: [2, 1], steer_scale: [0.00153398078788564], " +
      "steer_shift_rad: [3]}");
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_NEAR(samples[0].drive_rad_per_s[0], -M_PI, 1e-12);
  EXPECT_NEAR(samples[0].drive_rad_per_s[1], 0.5 * M_PI, 1e-12);
  EXPECT_NEAR(samples[0].steer_rad[0], 0.5 * M_PI + 3., 1e-12);
  EXPECT_EQ(samples[1].steer_rad[0], 3.);
  EXPECT_EQ(error_of(of_the_log + units + "}"),
            "test.yaml:1:1  sensor (asl_encoders): " + path +
                ":1  column 'steer_1 [counts]' has another unit than 'steer_1 [rad]'");
  const std::string error = error_of(of_the_log + ", drive_scale: [1], steer_scale: [1]}");
  EXPECT_NE(
      error.find("  sensor.drive_scale: has 1 number for 2 drive channels of the log: one for "
                 "each, in their order"),
      std::string::npos)
      << error;
}

TEST_F(LogSensors, AslEncodersCountWhatLeavesTurnsOpenOnce) {
  std::string text = "timestamp_ns,drive_1\n";
  for (int k = 0; k < 20; ++k) {
    text += std::to_string(10'000'000 * k) + "," + std::to_string(k == 9 ? 200 : 10 * k) + "\n";
  }
  const std::string section =
      "{type: asl_encoders, drive_input: angle, drive_scale: [1], drive_turn: [360], path: " +
      write("data.csv", text);
  const auto sensor = make_sensor(section + "}");
  // Neither side of the reading that was dropped, nor the one behind it: that one begins anew.
  const auto cells = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(cells.size(), 17U);
  for (const EncoderSample& cell : cells) EXPECT_NEAR(cell.drive_rad_per_s[0], 1000., 1e-9);
  EXPECT_THAT(rejections_of(*sensor),
              ::testing::ElementsAre("reading that leaves open how many turns a joint has gone "
                                     "(drive_turn, steer_turn) | 1 | data.csv:11"));
  const std::string error = error_of(section + ", max_rejected_fraction: 0.04}");
  EXPECT_NE(error.find("  1 of 20 data rejected"), std::string::npos) << error;
}

TEST_F(LogSensors, ABrokenLogFailsAtConstruction) {
  const auto path = write("data.csv", "timestamp_ns,drive_1\n0,1\n10,two\n");
  const std::string error = error_of("{type: asl_encoders, path: " + path + "}");
  EXPECT_NE(error.find(path + "  1 of 2 data rejected"), std::string::npos) << error;
  EXPECT_NE(error.find("data.csv:3  column 'drive_1': 'two' is not a number"), std::string::npos)
      << error;
}

TEST_F(LogSensors, AslPoseYieldsPositionAndQuaternion) {
  const auto path = write("data.csv",
                          "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],"
                          "q_RS_y [],q_RS_z []\n5,1,2,3,0.8,0,0,0.6\n");
  const auto samples = play_only<PoseSample>("{type: asl_pose, path: " + path + "}");
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].p_BinW_m, (std::array{1., 2., 3.}));
  EXPECT_EQ(samples[0].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
}

TEST_F(LogSensors, RosTextEncodersDifferencePositionsByDefault) {
  const auto path = write("odom.csv", kJoints);
  const auto samples = play_only<EncoderSample>(
      "{type: ros_text_encoders, drive: [d], steer: [s], path: " + path + "}");
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_NEAR(samples[0].drive_rad_per_s[0], 10., 1e-12);
  EXPECT_NEAR(samples[1].drive_rad_per_s[0], 15., 1e-12);
  EXPECT_NEAR(samples[0].steer_rad[0], 0.6, 1e-15);
  EXPECT_EQ(samples[0].t_ns, 1'050'000'000);
}

TEST_F(LogSensors, RosTextEncodersTakeVelocitiesAndTheReceptionClock) {
  const auto path = write("odom.csv", kJoints);
  const auto samples = play_only<EncoderSample>(
      "{type: ros_text_encoders, drive: d, drive_input: velocity, clock: reception, path: " + path +
      "}");
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[1].drive_rad_per_s[0], 8.);
  EXPECT_EQ(samples[1].n_steer, 0);
  EXPECT_EQ(samples[1].t_ns, (7LL * 3600 + 3) * 1'000'000'000 + 200'000'000);  // 7 h behind UTC
}

TEST_F(LogSensors, AnUnknownJointIsReportedWhereItIsWritten) {
  const auto path = write("odom.csv", kJoints);
  EXPECT_EQ(error_of("{type: ros_text_encoders, drive: [x], path: " + path + "}"),
            "test.yaml:1:34  sensor.drive: no joint 'x' in " + path + " - there are: s, d");
}

TEST_F(LogSensors, RosTextPoseYieldsPoses) {
  const auto path = write("abs.csv",
                          ".header.stamp.secs;.header.stamp.nsecs;.pose.position.x;"
                          ".pose.position.y;.pose.position.z;.pose.orientation.x;"
                          ".pose.orientation.y;.pose.orientation.z;.pose.orientation.w\n"
                          "1;5;1;2;3;0;0;0.6;0.8\n");
  const auto samples = play_only<PoseSample>("{type: ros_text_pose, path: " + path + "}");
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].t_ns, 1'000'000'005);
  EXPECT_EQ(samples[0].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
}

}  // namespace
}  // namespace viwo
