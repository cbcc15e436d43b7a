// The sensor ros2_topics with another DDS on loopback.
#include <algorithm>
#include <array>
#include <chrono>
#include <regex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dds_system.hpp"
#include "message_of.hpp"
#include "rejections.hpp"
#include "sensor_under_test.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using testing::Child;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using testing::make_sensor;
using testing::said;

constexpr const char* kAllTopics =
    ", imu_topic: /imu0, joint_topic: /joint_states, drive_joints: [drive_1, drive_2], "
    "steer_joints: [steer_1], image_topics: [/cam0/image_raw, /cam1/image_raw/compressed]";
constexpr std::int64_t kStart = 1'700'000'000'000'000'000;
constexpr std::int64_t kPeriod = 5'000'000;

class Ros2Topics : public testing::DdsTest {
 protected:
  static std::shared_ptr<Sensor> make(const std::string& rest) {
    return make_sensor("ros2_topics", ", " + dds_->parameters() + rest);
  }
  static std::string error_of(const std::string& rest) {
    return testing::error_of([&] { make(rest); });
  }
  /// Whether it holds, within twenty seconds.
  template <class Condition>
  static bool wait_until(const Condition& holds) {
    const auto deadline = steady_clock::now() + 20s;
    while (!holds() && steady_clock::now() < deadline) std::this_thread::sleep_for(20ms);
    return holds();
  }
  static bool wait_until_said(const std::string& text) {
    return wait_until([&text] { return said().has(text); });
  }
  /// What the recorder has heard when all of that is there, or after twenty seconds.
  static std::string publish_until_heard(Sensor& sensor, EstimateSample estimate,
                                         const std::vector<std::string>& all) {
    const auto deadline = steady_clock::now() + 20s;
    std::string heard;
    const auto has = [&heard](const std::string& one) {
      return heard.find(one) != std::string::npos;
    };
    for (std::int64_t k = 0;
         !std::all_of(all.begin(), all.end(), has) && steady_clock::now() < deadline; ++k) {
      estimate.t_ns = kStart + k * 50'000'000;
      sensor.estimate(estimate);
      std::this_thread::sleep_for(50ms);
      heard = dds_->text_of("heard.txt");
    }
    return heard;
  }
  /// All that it gives until nothing comes any more.
  struct Given {
    std::vector<ImuSample> imu;
    std::vector<EncoderSample> encoders;
    std::vector<ImageSample> images;
    std::vector<PoseSample> poses;
    std::vector<GnssSample> fixes;
  };
  static Given all_of(Sensor& sensor) {
    Given given;
    Measurement measurement;
    while (sensor.next(measurement) == Status::kOk) {
      if (const auto* i = measurement.get_if<ImuSample>()) given.imu.push_back(*i);
      if (const auto* e = measurement.get_if<EncoderSample>()) given.encoders.push_back(*e);
      if (const auto* p = measurement.get_if<ImageSample>()) given.images.push_back(*p);
      if (const auto* p = measurement.get_if<PoseSample>()) given.poses.push_back(*p);
      if (const auto* f = measurement.get_if<GnssSample>()) given.fixes.push_back(*f);
    }
    return given;
  }
};

TEST_F(Ros2Topics, GivesAllThatIsPublishedInOrderAndEndsWhenNothingComes) {
  const auto sensor = make(std::string(kAllTopics) + ", idle_timeout_s: 4");
  EXPECT_TRUE(sensor->live());
  Child publisher(dds_->node("publish", "400"), dds_->file("publisher.log"));
  const Given given = all_of(*sensor);
  EXPECT_EQ(publisher.wait(20s), 0) << dds_->text_of("publisher.log");
  EXPECT_TRUE(said().has("nothing has come for 4 s (idle_timeout_s): no further measurements"))
      << said().all();
  ASSERT_EQ(given.imu.size(), 400U) << said().all() << dds_->text_of("publisher.log");
  for (std::size_t k = 0; k < given.imu.size(); ++k) {
    EXPECT_EQ(given.imu[k].t_ns, kStart + static_cast<std::int64_t>(k) * kPeriod);
    EXPECT_EQ(given.imu[k].gyro_rad_per_s[0], static_cast<double>(k));
    EXPECT_EQ(given.imu[k].accel_m_per_s2[2], 9.81);
  }
  ASSERT_EQ(given.encoders.size(), 399U);
  for (std::size_t k = 0; k < given.encoders.size(); ++k) {
    EXPECT_EQ(given.encoders[k].begin_ns, given.imu[k].t_ns);
    EXPECT_EQ(given.encoders[k].drive_rad_per_s[1], static_cast<double>(2 * k) + 1.);
    EXPECT_NEAR(given.encoders[k].steer_rad[0], 0.001 * (static_cast<double>(k) + 0.5), 1e-12);
  }
  ASSERT_EQ(given.images.size(), 40U);
  for (std::size_t k = 0; k < given.images.size(); ++k) {
    EXPECT_EQ(given.images[k].camera, static_cast<int>(k % 2));
    EXPECT_EQ(given.images[k].t_ns, kStart + static_cast<std::int64_t>(k / 2) * 20 * kPeriod);
    Image image;
    given.images[k].source->read(image);
    EXPECT_EQ(image.width_px, 8);
    const auto level = static_cast<std::uint8_t>(k / 2 + (k % 2 == 0 ? 100 : 0));
    EXPECT_EQ(image.pixels, std::vector<std::uint8_t>(32, level));
  }
  EXPECT_THAT(testing::rejections_of(*sensor), ::testing::IsEmpty());
}

TEST_F(Ros2Topics, HearsWhereTheRobotIsInEachMessageThatSaysSo) {
  const std::string rest = ", publish: false, idle_timeout_s: 4";
  const auto pose = make(", pose_topic: /pose" + rest);
  const auto amcl = make(", pose_topic: /amcl_pose" + rest);
  const auto odometry = make(", odometry_topic: /odom" + rest);
  const auto fixes = make(", gnss_topic: /fix" + rest);
  Child publisher(dds_->node("poses", "40"), dds_->file("publisher.log"));
  EXPECT_EQ(publisher.wait(30s), 0) << dds_->text_of("publisher.log");
  double first_x = 0.;
  for (const auto& sensor : {pose, amcl, odometry}) {
    const auto poses = all_of(*sensor).poses;
    ASSERT_EQ(poses.size(), 40U) << first_x << said().all() << dds_->text_of("publisher.log");
    for (std::size_t k = 0; k < poses.size(); ++k) {
      EXPECT_EQ(poses[k].t_ns, kStart + static_cast<std::int64_t>(k) * kPeriod);
      EXPECT_EQ(poses[k].p_BinW_m, (std::array{first_x + static_cast<double>(k), 2., 3.}));
      EXPECT_EQ(poses[k].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
    }
    first_x += 100.;
  }
  const auto fixed = all_of(*fixes).fixes;
  ASSERT_EQ(fixed.size(), 40U) << said().all();
  for (std::size_t k = 0; k < fixed.size(); ++k) {
    EXPECT_EQ(fixed[k].t_ns, kStart + static_cast<std::int64_t>(k) * kPeriod);
    EXPECT_EQ(fixed[k].latitude_deg, 45.);
    EXPECT_EQ(fixed[k].longitude_deg, 15. + 1e-6 * static_cast<double>(k));
    EXPECT_EQ(fixed[k].altitude_m, 100.);
    EXPECT_EQ(fixed[k].covariance_ENU_m2, (std::array{0.25, 0., 0., 0., 0.25, 0., 0., 0., 0.25}));
  }
}

TEST_F(Ros2Topics, IsWhereTheEnvironmentOfRos2SaysAndHearsThisMachineByAddressesAlone) {
  setenv("ROS_DOMAIN_ID", dds_->domain().c_str(), 1);
  const std::string all = std::string(kAllTopics) + ", publish: false, idle_timeout_s: 4";
  for (const auto& [name, value] :
       {std::pair{"ROS_LOCALHOST_ONLY", "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}) {
    setenv(name, value, 1);
    const auto sensor = make_sensor("ros2_topics", all);
    Child publisher(dds_->node("publish", "40"), dds_->file("publisher.log"));
    EXPECT_EQ(publisher.wait(30s), 0) << name << dds_->text_of("publisher.log");
    EXPECT_EQ(all_of(*sensor).imu.size(), 40U) << name << said().all();
    unsetenv(name);
  }
  unsetenv("ROS_DOMAIN_ID");
}

TEST_F(Ros2Topics, GoesOnWithAPublisherThatLeavesAndReturns) {
  const auto sensor = make(std::string(kAllTopics) + ", idle_timeout_s: 30");
  for (int part = 0; part < 2; ++part) {
    Child publisher(dds_->node("publish", "100"), dds_->file("publisher.log"));
    EXPECT_EQ(publisher.wait(30s), 0) << dds_->text_of("publisher.log");
    // Who does not say that he goes is missed when his lease has run out.
    if (part == 0) wait_until_said("topic '/imu0' has no publisher any more");
  }
  sensor->stop();
  const Given given = all_of(*sensor);
  // The second has the stamps of the first, long before the last: a clock that was set back.
  EXPECT_GE(given.imu.size(), 100U);
  EXPECT_TRUE(said().has("topic '/imu0' has no publisher any more")) << said().all();
  EXPECT_TRUE(said().has("topic '/imu0' has a publisher again")) << said().all();
}

TEST_F(Ros2Topics, CountsWhatCannotBeUsed) {
  const auto sensor = make(std::string(kAllTopics) + ", idle_timeout_s: 6");
  Child publisher(dds_->node("wrong", "40"), dds_->file("publisher.log"));
  EXPECT_EQ(publisher.wait(30s), 0) << dds_->text_of("publisher.log");
  sensor->stop();
  const Given given = all_of(*sensor);
  EXPECT_TRUE(given.imu.empty());
  const auto rejections = testing::rejections_of(*sensor);
  EXPECT_THAT(rejections,
              Contains(HasSubstr("/imu0: a publisher of geometry_msgs/PoseStamped where a "
                                 "sensor_msgs/Imu must be | 1 | ")));
  EXPECT_THAT(rejections, Contains(HasSubstr("/joint_states: no joint 'drive_1'")));
  EXPECT_THAT(rejections, Contains(HasSubstr(" | 40 | ")));
}

TEST_F(Ros2Topics, SaysWhoIsTwoAndWhoIsBestEffort) {
  const auto sensor = make(", imu_topic: /imu0");
  const auto strict = make(std::string(kAllTopics) + ", publish: false, reliable: true");
  // Who publishes waits for readers of all topics.
  const auto all = make(std::string(kAllTopics) + ", publish: false");
  Child one(dds_->node("publish", "600"), dds_->file("one.log"));
  Child two(dds_->node("publish", "600"), dds_->file("two.log"));
  EXPECT_TRUE(
      wait_until_said("topic '/imu0' has 2 publishers: their messages are taken as those of one"))
      << said().all();
  EXPECT_TRUE(
      wait_until_said("topic '/imu0' has a publisher that is best effort: it is not heard "
                      "while `reliable` or `lockstep` asks for more"))
      << said().all();
}

TEST_F(Ros2Topics, SaysWhichTopicNobodyPublishesAndWhatIsThereInstead) {
  const auto published = make(std::string(kAllTopics) + ", publish: false");
  Child publisher(dds_->node("publish", "1600"), dds_->file("publisher.log"));
  const auto sensor = make(", imu_topic: /imu1");
  EXPECT_TRUE(wait_until_said("nobody publishes topic '/imu1' - did you mean '/imu0'?"))
      << said().all();
}

TEST_F(Ros2Topics, EndsSoonAfterStop) {
  const auto sensor = make(", imu_topic: /imu0");
  std::thread stopper([&sensor] {
    std::this_thread::sleep_for(300ms);
    sensor->stop();
  });
  Measurement out;
  EXPECT_EQ(sensor->next(out), Status::kEnd);
  stopper.join();
  EXPECT_EQ(sensor->next(out), Status::kEnd);
}

TEST_F(Ros2Topics, RefusesParametersThatContradictEachOther) {
  EXPECT_THAT(error_of(""), HasSubstr("sensor.imu_topic: nothing to listen to: give one of "));
  EXPECT_THAT(error_of(", imu_topic: /a b"),
              HasSubstr("sensor.imu_topic: '/a b' cannot be the name of a topic: "));
  EXPECT_THAT(error_of(", imu_topic: /i, image_topics: [/c, /i]"),
              HasSubstr("sensor.image_topics: '/i' is wanted twice"));
  EXPECT_THAT(error_of(", imu_topic: /i, joint_topic: i, drive_joints: [a]"),
              HasSubstr("sensor.joint_topic: 'i' is wanted twice"));
  EXPECT_THAT(error_of(", imu_topic: /i, odometry_topic: /viwo/odometry"),
              HasSubstr("sensor.odometry_topic_out: 'viwo/odometry' is wanted twice"));
  EXPECT_THAT(error_of(", imu_topic: /i, path_topic_out: /tf"),
              HasSubstr("sensor.path_topic_out: '/tf' is wanted twice"));
  EXPECT_THAT(error_of(", imu_topic: /i, calibration_topic_out: /viwo/path"),
              HasSubstr("sensor.calibration_topic_out: '/viwo/path' is wanted twice"));
  EXPECT_THAT(error_of(", imu_topic: /i, body_frame: /odom"),
              HasSubstr("sensor.body_frame: 'odom' is the world_frame, too"));
  const auto first = make(", imu_topic: /i");
  EXPECT_THAT(error_of(", imu_topic: /i"),
              HasSubstr("sensor.publish: another sensor of this run publishes the estimate"));
  EXPECT_EQ(error_of(", imu_topic: /i, publish: false"), "");
}

TEST_F(Ros2Topics, PublishesTheEstimate) {
  const auto sensor = make(
      ", imu_topic: /imu0, world_frame: /map, body_frame: /base_link, p_IinB_m: [0.5, 0, 0], "
      "warn_latency_s: 10, sigma_rate_rad_per_s: 0.5");
  Child recorder(dds_->node("record", dds_->file("heard.txt")), dds_->file("recorder.log"));
  EstimateSample estimate;
  estimate.p_IinG_m = {1., 2., 3.};
  estimate.covariance[40] = 0.25;  // of the position along y
  estimate.latency_s = 0.0125;
  estimate.calibration_names = {"r_1"};
  estimate.calibration = {0.0255};
  estimate.calibration_sigma = {0.25};
  // The warning last, which has a clock of its own: nothing comes on /imu0.
  const std::string heard = publish_until_heard(
      *sensor, estimate, {"odometry ", "tf ", "path ", "calibration ", " level 1 "});
  EXPECT_THAT(heard, ContainsRegex("odometry 170000000[0-9]+ map base_link 0.5 2 3 0.25 0.25"))
      << dds_->text_of("recorder.log");
  EXPECT_THAT(heard, ContainsRegex("tf 170000000[0-9]+ map base_link 0.5"));
  EXPECT_THAT(heard, ContainsRegex("path map [0-9]+ 0.5"));
  EXPECT_THAT(heard, ContainsRegex("diagnostics 170000000[0-9]+ level 1 latency_s=0.0125 "));
  EXPECT_THAT(heard, HasSubstr(" r_1=0.0255 sigma r_1=0.25"));
  EXPECT_THAT(heard, ContainsRegex("calibration 170000000[0-9]+ r_1=0.02549999[0-9]+ sigma 0.25"));
  EXPECT_THAT(heard, ::testing::Not(HasSubstr(" level 2 ")));
  EXPECT_TRUE(wait_until([] {
    return dds_->text_of("heard.txt").find(" level 2 ") != std::string::npos;
  })) << "an error where there was an estimate, and is none any more";
}

TEST_F(Ros2Topics, SaysTheHashesOfItsTypes) {
  // The reader of a topic is made when its publisher is met, who waits for readers of all topics.
  const auto sensor =
      make(std::string(kAllTopics) + ", imu_frame: imu_link, body_frame: base_link");
  Child publisher(dds_->node("publish", "200"), dds_->file("publisher.log"));
  Child listing(dds_->node("endpoints", dds_->file("endpoints.txt")), dds_->file("listing.log"));
  struct Endpoint {
    std::string what, type, hash;  ///< hash: its begin
  };
  for (const Endpoint& one : std::vector<Endpoint>{
           {"writer rt/viwo/odometry", "nav_msgs::msg::dds_::Odometry_", "3cc97dc7fb75"},
           {"writer rt/viwo/path", "nav_msgs::msg::dds_::Path_", "1957a5bb3cee"},
           {"writer rt/viwo/calibration", "sensor_msgs::msg::dds_::JointState_", "a13ee3a330e3"},
           {"writer rt/tf", "tf2_msgs::msg::dds_::TFMessage_", "e369d0f05a23"},
           {"writer rt/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_",
            "5a8a36efb05f"},
           {"reader rt/tf_static", "tf2_msgs::msg::dds_::TFMessage_", "e369d0f05a23"},
           {"reader rt/robot_description", "std_msgs::msg::dds_::String_", "df668c740482"},
           {"reader rt/imu0", "sensor_msgs::msg::dds_::Imu_", "7d9a00ff1310"}}) {
    const std::regex line(one.what + " " + one.type + " typehash=RIHS01_" + one.hash +
                          "[0-9a-f]+;\n");
    EXPECT_TRUE(wait_until([&line] {
      return std::regex_search(dds_->text_of("endpoints.txt"), line);
    })) << one.what
        << dds_->text_of("endpoints.txt") << dds_->text_of("listing.log")
        << dds_->text_of("publisher.log");
  }
}

TEST_F(Ros2Topics, TellsTheRobotThatThereIsNoEstimate) {
  Child recorder(dds_->node("record", dds_->file("heard.txt")), dds_->file("recorder.log"));
  const auto sensor = make(", imu_topic: /imu0");
  EXPECT_TRUE(wait_until([] {
    return dds_->text_of("heard.txt").find(" level 1 rejections=0") != std::string::npos;
  })) << dds_->text_of("heard.txt");
}

TEST_F(Ros2Topics, NamesWhatIsMissingBeforeItEndsForWantOfIt) {
  const auto sensor = make(", imu_topic: /imu0, idle_timeout_s: 0.5");
  Measurement out;
  EXPECT_EQ(sensor->next(out), Status::kEnd);
  EXPECT_TRUE(said().has("nobody publishes topic '/imu0' (nor any other)")) << said().all();
}

TEST_F(Ros2Topics, AsksTheRobotWhereItsImuSits) {
  const auto sensor = make(
      ", imu_topic: /imu0, imu_frame: imu_link, body_frame: base_link, wheel_frame: base_link");
  Child recorder(dds_->node("record", dds_->file("heard.txt")), dds_->file("recorder.log"));
  EstimateSample estimate;
  estimate.p_IinG_m = {1., 2., 3.};
  // Nothing is said yet of where the body is, but that.
  const std::string before = publish_until_heard(*sensor, estimate, {"diagnostics ", " level 1 "});
  EXPECT_THAT(before, ::testing::Not(HasSubstr("odometry ")));
  EXPECT_TRUE(
      wait_until_said("nothing says where frame 'imu_link' is in 'base_link': no pose is "
                      "published (no frame is known from /tf_static or the robot's description)"));
  Child robot(dds_->node("mount", "0.25"), dds_->file("robot.log"));
  ASSERT_TRUE(wait_until_said(
      "frame 'imu_link' is in 'base_link' at p_IinB_m: [0.5, 0, 0.25], rpy_ItoB_rad: [0, 0, 0]"))
      << dds_->text_of("robot.log");
  EXPECT_TRUE(wait_until_said(
      "frame 'imu_link' is in 'base_link', wheels: {p_IinO_m: [0.5, 0, 0.25], rpy_ItoO_rad: [0, 0, "
      "0]}"));
  EXPECT_THAT(publish_until_heard(*sensor, estimate, {"odometry "}),
              ContainsRegex("odometry 170000000[0-9]+ odom base_link 0.5 2 2.75"));
  EXPECT_THAT(error_of(", imu_topic: /i, imu_frame: imu_link, p_IinB_m: [1, 0, 0]"),
              HasSubstr("sensor.imu_frame: p_IinB_m and rpy_ItoB_rad say where 'imu_link' sits"));
}

TEST_F(Ros2Topics, HearsFramesThatWereSaidBeforeItCame) {
  Child robot(dds_->node("mount", "0.5"), dds_->file("robot.log"));
  std::this_thread::sleep_for(500ms);  // it is said once, and long ago
  const auto sensor = make(", imu_topic: /imu0, imu_frame: imu_link, body_frame: base_link");
  EXPECT_TRUE(wait_until_said(
      "frame 'imu_link' is in 'base_link' at p_IinB_m: [0.5, 0, 0.5], rpy_ItoB_rad: [0, 0, 0]"));
}

}  // namespace
}  // namespace viwo
