// Names, addresses and the environment.
#include <cstdlib>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dds_names.hpp"
#include "dds_settings.hpp"
#include "message_of.hpp"
#include "messages.hpp"

namespace viwo::ros2 {
namespace {

TEST(DdsNames, AreThoseThatRos2Makes) {
  EXPECT_EQ(dds_topic("/imu0"), "rt/imu0");
  EXPECT_EQ(dds_topic("viwo/odometry"), "rt/viwo/odometry");
  EXPECT_EQ(ros_topic("rt/cam0/image_raw"), "/cam0/image_raw");
  EXPECT_EQ(ros_topic("rq/service"), std::nullopt);
  EXPECT_EQ(dds_type("sensor_msgs/Imu"), "sensor_msgs::msg::dds_::Imu_");
  EXPECT_EQ(ros_type("sensor_msgs::msg::dds_::Imu_"), "sensor_msgs/Imu");
  EXPECT_EQ(ros_type("Imu"), "Imu");
  EXPECT_EQ(ros_type("sensor_msgs::msg::dds_::Imu"), "sensor_msgs::msg::dds_::Imu");
}

TEST(DdsNames, SayTheHashOfEachTypeThatIsHeard) {
  for (int kind = 0; kind <= static_cast<int>(bag::Kind::kNavSatFix); ++kind) {
    const auto type = bag::type_name(static_cast<bag::Kind>(kind));
    EXPECT_THAT(said_of_type(type), ::testing::MatchesRegex("typehash=RIHS01_[0-9a-f]+;")) << type;
    EXPECT_EQ(said_of_type(type).size(), 81U) << type;
  }
  EXPECT_EQ(said_of_type("sensor_msgs/Range"), "");
}

TEST(DdsNames, SayWhatIsNoTopic) {
  for (const char* good : {"/imu", "imu", "/robot_1/cam0/image_raw", "_hidden"}) {
    EXPECT_EQ(why_no_name(good), "") << good;
  }
  for (const char* bad : {"", "/", "/1st", "a b", "/a//b", "/a/", "/a-b", "~/x"}) {
    EXPECT_NE(why_no_name(bad), "") << bad;
  }
}

class Settings : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* name :
         {"ROS_DOMAIN_ID", "ROS_LOCALHOST_ONLY", "ROS_AUTOMATIC_DISCOVERY_RANGE"}) {
      unsetenv(name);
    }
  }
  static std::string error_of(const DdsParams& params) {
    return testing::error_of<std::exception>([&] { params.settings(); });
  }
};

TEST_F(Settings, TakeTheDomainOfTheEnvironmentWhereNoneIsGiven) {
  EXPECT_EQ(DdsParams().settings().domain, 0U);
  setenv("ROS_DOMAIN_ID", "42", 1);
  EXPECT_EQ(DdsParams().settings().domain, 42U);
  DdsParams given;
  given.domain_id = 7;
  EXPECT_EQ(given.settings().domain, 7U);
  for (const char* wrong : {"-1", "233", "four", "4.5"}) {
    setenv("ROS_DOMAIN_ID", wrong, 1);
    EXPECT_EQ(error_of({}), "the environment's ROS_DOMAIN_ID is '" + std::string(wrong) +
                                "': expected a number from 0 to 232");
  }
}

TEST_F(Settings, StayOnThisMachineWhereTheEnvironmentSaysSo) {
  EXPECT_TRUE(DdsParams().settings().interfaces.empty());
  setenv("ROS_LOCALHOST_ONLY", "0", 1);
  EXPECT_TRUE(DdsParams().settings().interfaces.empty());
  EXPECT_TRUE(DdsParams().settings().peers.empty());
  const std::vector<std::string> loopback{"127.0.0.1"};
  setenv("ROS_LOCALHOST_ONLY", "1", 1);
  EXPECT_EQ(DdsParams().settings().interfaces, loopback);
  EXPECT_EQ(DdsParams().settings().peers, loopback) << "by addresses, without multicast";
  unsetenv("ROS_LOCALHOST_ONLY");
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", 1);
  EXPECT_EQ(DdsParams().settings().interfaces, loopback);
  EXPECT_EQ(DdsParams().settings().peers, loopback);
}

TEST_F(Settings, OfTheParametersWinOverTheEnvironment) {
  DdsParams given;
  given.interfaces = {"127.0.0.1", "127.0.0.1"};  // what no environment gives
  for (const char* range : {"LOCALHOST", "OFF"}) {
    setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", range, 1);
    EXPECT_EQ(given.settings().interfaces, given.interfaces) << range;
  }
}

TEST_F(Settings, RefuseAnEnvironmentInWhichNobodyIsFound) {
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", 1);
  EXPECT_THAT(error_of({}), ::testing::StartsWith(
                                "the environment's ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: nobody"));
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost", 1);
  EXPECT_THAT(error_of({}), ::testing::HasSubstr("expected LOCALHOST, SUBNET"));
  for (const char* range : {"SUBNET", "SYSTEM_DEFAULT", ""}) {
    setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", range, 1);
    EXPECT_EQ(error_of({}), "") << range;
  }
}

TEST_F(Settings, RefuseWhatIsNoAddress) {
  DdsParams params;
  params.peers = {"robot"};
  EXPECT_EQ(error_of(params), "'robot' is no address such as 192.168.1.7");
  params.peers.clear();
  params.interfaces = {"127.0.0.1"};
  EXPECT_EQ(params.settings().interfaces, params.interfaces);
  params.interfaces.emplace_back("192.0.2.1");  // of documentation: nobody has it
  EXPECT_THAT(error_of(params), ::testing::StartsWith("192.0.2.1 is no address of this machine - "
                                                      "there are: "));
}

}  // namespace
}  // namespace viwo::ros2
