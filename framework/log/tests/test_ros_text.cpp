// Printed ROS messages.
#include <gmock/gmock.h>

#include "log_files.hpp"
#include "viwo/log/ros_text.hpp"

namespace viwo::log {
namespace {

using ::testing::HasSubstr;

using ::testing::ElementsAre;

class RosTextTest : public InFolder {
 protected:
  static constexpr const char* kHeader =
      "time;.header.stamp.secs;.header.stamp.nsecs;.name;.position;.velocity\n";

  std::filesystem::path joints(const std::string& rows) const {
    return write("odom.csv", kHeader + rows);
  }

  std::string message(const std::string& rows) const {
    const auto file = joints(rows);
    const std::string what = error_of([&] { read_ros_encoders(file, options_); });
    return what.substr(std::min(what.size(), file.string().size()));
  }

  RosEncoderOptions options_ = [] {
    RosEncoderOptions options;
    options.drive = {"R_Wheel", "L_Wheel"};
    options.steer = {"R_Position"};
    return options;
  }();
};

constexpr const char* kTwoRows =
    "2024/05/03/13:18:14.900000;1714767494;963170505;['L_Wheel', 'R_Position', 'R_Wheel'];"
    "(10.0, 0.5, 20.0);(1.0, 0.0, 2.0)\n"
    "2024/05/03/13:18:15;1714767494;979170505;['R_Wheel', 'L_Wheel', 'R_Position'];"
    "(20.16, 10.08, 0.7);(4.0, 3.0, 0.0)\n";

TEST_F(RosTextTest, OrdersJointsAsAskedEvenWhenTheMessagesDoNot) {
  const auto samples = read_ros_encoders(joints(kTwoRows), options_).samples;
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].t_ns, 1714767494963170505);
  EXPECT_EQ(samples[0].end_ns, 1714767494971170505);
  EXPECT_EQ(samples[0].n_drive, 2);
  EXPECT_EQ(samples[0].n_steer, 1);
  EXPECT_THAT(std::span(samples[0].drive_rad_per_s).first(2), ElementsAre(2., 1.));
  EXPECT_THAT(std::span(samples[1].drive_rad_per_s).first(2), ElementsAre(4., 3.));
  EXPECT_EQ(samples[0].steer_rad[0], 0.5);
  EXPECT_EQ(samples[1].steer_rad[0], 0.7);
}

TEST_F(RosTextTest, DifferencesPositionsAndReadsTheReceptionTime) {
  options_.recording.drive_is_angle = true;
  options_.clock = {true, -7.};
  const auto samples = read_ros_encoders(joints(kTwoRows), options_).samples;
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].begin_ns, 1714767494900000000);  // 20:18:14.9 UTC
  EXPECT_EQ(samples[0].end_ns, 1714767495000000000);
  EXPECT_NEAR(samples[0].drive_rad_per_s[0], 1.6, 1e-12);
  EXPECT_NEAR(samples[0].drive_rad_per_s[1], 0.8, 1e-12);
  EXPECT_NEAR(samples[0].steer_rad[0], 0.6, 1e-15);
}

TEST_F(RosTextTest, CountsRowsWithoutTheJoints) {
  options_.recording.limits.max_rejected_fraction = 0.5;
  const auto read =
      read_ros_encoders(joints(std::string("t;1;0;['Arm'];(1.0,);(0.0,)\n") + kTwoRows), options_);
  EXPECT_EQ(read.samples.size(), 2U);
  ASSERT_EQ(read.rejections.size(), 1U);
  EXPECT_EQ(read.rejections[0].reason, "row without one of the joints");
  EXPECT_EQ(read.rejections[0].first, "odom.csv:2");
}

TEST_F(RosTextTest, NamesTheParameterOfAJointThatDoesNotExist) {
  const auto file = joints(kTwoRows);
  options_.steer = {"R_Positoin"};
  try {
    read_ros_encoders(file, options_);
    FAIL() << "accepted an unknown joint";
  } catch (const ParamError& error) {
    EXPECT_EQ(error.key(), "steer");
    EXPECT_EQ(std::string(error.what()),
              "no joint 'R_Positoin' in " + file.string() + " - did you mean 'R_Position'?");
  }
  options_.drive = {};
  EXPECT_EQ(error_of([&] { read_ros_encoders(file, options_); }), "0 joints, must be 1 to 8");
  options_.drive = {"L_Wheel", "L_Wheel"};
  EXPECT_EQ(error_of([&] { read_ros_encoders(file, options_); }),
            "joint 'L_Wheel' is listed twice");
}

TEST_F(RosTextTest, SaysLineAndColumnOfWhatIsWrong) {
  const std::string names = ";['L_Wheel', 'R_Position', 'R_Wheel'];";
  EXPECT_THAT(message("t;1;0" + names + "(1.0, 2.0);(1.0, 2.0, 3.0)\n"),
              HasSubstr(":2  column '.position': 2 values for 3 joints"));
  EXPECT_THAT(message("t;1;0" + names + "(1.0, 2.0, 3.0);(1.0, 2.0, x)\n"),
              HasSubstr(":2  column '.velocity': 'x' is not a number"));
  EXPECT_THAT(message("t;1;0" + names + "(1.0, 2.0, 3.0);1.0\n"),
              HasSubstr(":2  column '.velocity': '1.0' is not a list"));
  EXPECT_THAT(message("t;1;1000000000" + names + "(1.0, 2.0, 3.0);(1.0, 2.0, 3.0)\n"),
              HasSubstr(":2  column '.header.stamp.nsecs': '1000000000' is not in [0, 1e9) ns"));
  EXPECT_THAT(message("t;5000000000;0" + names + "(1.0, 2.0, 3.0);(1.0, 2.0, 3.0)\n"),
              HasSubstr(":2  column '.header.stamp.secs': '5000000000' is no stamp in seconds"));
  options_.clock.reception = true;
  EXPECT_THAT(message("yesterday;1;0" + names + "(1.0, 2.0, 3.0);(1.0, 2.0, 3.0)\n"),
              HasSubstr(":2  column 'time': 'yesterday' is no time yyyy/MM/dd/HH:mm:ss.ffffff"));
}

TEST_F(RosTextTest, ReadsPoses) {
  const auto file = write("abs.csv",
                          ".header.stamp.secs;.header.stamp.nsecs;.pose.position.x;"
                          ".pose.position.y;.pose.position.z;.pose.orientation.x;"
                          ".pose.orientation.y;.pose.orientation.z;.pose.orientation.w\n"
                          "1;5;-1.47E-05;2;3;0;0;0.6;0.8\n");
  const auto samples = read_ros_poses(file, {}, {}).samples;
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_EQ(samples[0].t_ns, 1'000'000'005);
  EXPECT_EQ(samples[0].p_BinW_m, (std::array{-1.47e-5, 2., 3.}));
  EXPECT_EQ(samples[0].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
}

TEST(Lists, ComeInRoundOrSquareBracketsWithOrWithoutQuotes) {
  EXPECT_THAT(parse_list("['a b', \"c\"]").value(), ElementsAre("a b", "c"));
  EXPECT_THAT(parse_list(" (1.0,) ").value(), ElementsAre("1.0"));
  EXPECT_THAT(parse_list("(1, 2,3)").value(), ElementsAre("1", "2", "3"));
  EXPECT_TRUE(parse_list("()").value().empty());
  for (const char* text : {"", "1, 2", "(1, 2]", "[1", "("}) EXPECT_FALSE(parse_list(text)) << text;
}

TEST(ReceptionTime, IsReadInItsOffsetFromUtc) {
  EXPECT_EQ(parse_reception_ns("1970/01/01/00:00:00", 0.), 0);
  EXPECT_EQ(parse_reception_ns("2024/02/29/23:59:59.000000001", 0.), 1709251199000000001);
  EXPECT_EQ(parse_reception_ns("2024/03/01/05:29:59", 5.5), 1709251199000000000);
  for (const char* text :
       {"", "2024/02/30/00:00:00", "2024/13/01/00:00:00", "2024/01/01/24:00:00",
        "2024-01-01/00:00:00", "2024/01/01/00:00:00,5", "2024/01/01/00:00:00.0000000001",
        "2024/01/01/00:00:0x", "2024/01/01/00:00:00.12x", "3024/01/01/00:00:00"}) {
    EXPECT_EQ(parse_reception_ns(text, 0.), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace viwo::log
