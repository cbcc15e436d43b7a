// Live sensors that fall silent: said when it happens.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "live_device.hpp"

namespace viwo::experiment {
namespace {

using ::testing::ElementsAre;
using ::testing::MatchesRegex;

/// A live run on what a robot gives, some of it lost; what was said while it ran, and at its end.
struct SilentRobot {
  std::vector<Measurement> measurements;
  std::vector<std::string> said;
  RunResult result;

  SilentRobot() {
    RunSetup setup = testing::standing_then_driving(12.);
    measurements = testing::in_time_order(collect(setup).recorded);
  }
  /// What is lost of the samples of type T from one time on to another, s since the first.
  template <Sample T>
  void lose(double from_s, double to_s) {
    const std::int64_t begin_ns = stamp_ns(measurements.front());
    std::erase_if(measurements, [&](const Measurement& m) {
      const double t_s = seconds_between(begin_ns, stamp_ns(m));
      return m.get_if<T>() != nullptr && t_s > from_s && t_s < to_s;
    });
  }
  /// `stays`: the device does not end, but is silent, until that has been said.
  void run(bool stays = false) {
    RunSetup setup = testing::standing_then_driving(12.);
    setup.routes = testing::routes_of_device(setup);
    RunData data;
    data.live.push_back(
        testing::stream("device", std::make_shared<testing::Device>(measurements, stays)));
    RunHooks hooks;
    hooks.on_warning = [this](double, const std::string& text) {
      if (text.find("of device: ") != std::string::npos) said.push_back(text);
    };
    const auto begin = std::chrono::steady_clock::now();
    hooks.interrupted = [&] {
      return said.size() >= 3 ||
             std::chrono::steady_clock::now() - begin > std::chrono::seconds(60);
    };
    if (!stays) hooks.interrupted = nullptr;
    result = run_filter(setup, data, hooks);
  }
};

TEST(LiveRun, TellsThatTheImuIsSilentAndThatItIsBack) {
  SilentRobot robot;
  robot.lose<ImuSample>(6., 9.);
  robot.run();
  EXPECT_EQ(robot.result.status, RunStatus::kOk) << robot.result.cause;
  EXPECT_THAT(
      robot.said,
      ElementsAre(MatchesRegex("imu of device: no samples since t = [0-9.]+ s: look at its cable, "
                               "driver and bus"),
                  MatchesRegex("imu of device: samples again, after 3 s without any from t = "
                               "[0-9.]+ s on")));
  EXPECT_THAT(robot.result.warnings,
              ElementsAre(MatchesRegex("imu of device: no samples for 3 s from t = .*")));
}

TEST(LiveRun, TellsThatCamerasAndWheelsHaveEnded) {
  SilentRobot robot;
  robot.lose<FeatureSample>(7., 100.);
  robot.lose<EncoderSample>(8., 100.);
  robot.run();
  EXPECT_THAT(robot.said, ElementsAre(MatchesRegex("tracks of device: no samples since .*"),
                                      MatchesRegex("encoders of device: no samples since .*")));
  EXPECT_THAT(robot.result.warnings,
              ::testing::IsSupersetOf(
                  {MatchesRegex("encoders of device: ended 4 s before the end of the run .*"),
                   MatchesRegex("tracks of device: ended 5\\.1 s before the end of the run .*")}));
}

TEST(LiveRun, TellsThatTheWheelsNeverGaveASample) {
  SilentRobot robot;
  robot.lose<EncoderSample>(-1., 100.);
  robot.run();
  EXPECT_THAT(robot.said, ElementsAre("encoders of device: no samples: look at its cable, driver "
                                      "and bus"));
  EXPECT_THAT(robot.result.warnings,
              ::testing::Contains("encoders of device: no samples in all of the run: look at its "
                                  "cable, driver and bus"));
}

TEST(LiveRun, TellsThatAllSensorsAreSilent) {
  SilentRobot robot;
  robot.run(true);
  EXPECT_THAT(robot.said, ElementsAre(MatchesRegex("imu of device: no samples since .*"),
                                      MatchesRegex("tracks of device: no samples since .*"),
                                      MatchesRegex("encoders of device: no samples since .*")));
}

}  // namespace
}  // namespace viwo::experiment
