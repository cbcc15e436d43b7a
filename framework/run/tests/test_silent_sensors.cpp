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

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::MatchesRegex;

/// A live run on what a robot gives, some of it lost; what was said while it ran, and at its end.
struct SilentRobot {
  std::vector<Measurement> measurements;
  std::vector<std::string> said;
  RunResult result;
  std::shared_ptr<testing::Device> device;  ///< of the last run

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
    device = std::make_shared<testing::Device>(measurements, stays);
    data.live.push_back(testing::stream("device", device));
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
  EXPECT_THAT(robot.device->estimates[20].warnings, ::testing::IsEmpty());
  EXPECT_THAT(robot.device->estimates.back().warnings,
              ::testing::IsSupersetOf({MatchesRegex("tracks of device: no samples since .*"),
                                       MatchesRegex("encoders of device: no samples since .*")}))
      << "while it lasts";
}

TEST(LiveRun, TellsThatTheWheelsNeverGaveASample) {
  SilentRobot robot;
  robot.lose<EncoderSample>(-1., 100.);
  robot.run();
  EXPECT_THAT(robot.said, ElementsAre("encoders of device: no samples: look at its cable, driver "
                                      "and bus, or at why all of it is rejected"));
  EXPECT_THAT(robot.result.doubts,
              ElementsAre("encoders of device: no samples in all of the run: look at its "
                          "cable, driver and bus, or at why all of it is rejected"));
}

TEST(LiveRun, TellsTheDeviceWhichWheelIsLeftOutAndUntilWhen) {
  SilentRobot robot;
  const std::int64_t begin_ns = stamp_ns(robot.measurements.front());
  for (Measurement& m : robot.measurements) {
    const auto* encoders = m.get_if<EncoderSample>();
    const double t_s = seconds_between(begin_ns, stamp_ns(m));
    if (encoders == nullptr || t_s < 3. || t_s > 6.) continue;
    EncoderSample slips = *encoders;
    slips.drive_rad_per_s[1] *= 1.5;
    m = slips;
  }
  robot.run();
  const auto warnings_at = [&](double t_s) {
    const auto& all = robot.device->estimates;
    return std::find_if(all.begin(), all.end(),
                        [&](const EstimateSample& estimate) {
                          return seconds_between(begin_ns, estimate.t_ns) > t_s;
                        })
        ->warnings;
  };
  const auto left_out = ::testing::Contains(MatchesRegex(
      "wheel_odometry: drive 2 left out of a sample: the other wheels contradict it .* - [0-9]+ of "
      "[0-9]+ in the last second"));
  EXPECT_THAT(warnings_at(2.5), ::testing::Not(left_out));
  EXPECT_THAT(warnings_at(5.5), left_out);
  EXPECT_THAT(robot.device->estimates.back().warnings, left_out) << "ten seconds are not over";
  EXPECT_EQ(robot.result.status, RunStatus::kOk) << robot.result.cause;
}

TEST(LiveRun, TellsThatAllSensorsAreSilent) {
  SilentRobot robot;
  robot.run(true);
  EXPECT_THAT(robot.said, ElementsAre(MatchesRegex("imu of device: no samples since .*"),
                                      MatchesRegex("tracks of device: no samples since .*"),
                                      MatchesRegex("encoders of device: no samples since .*")));
}

}  // namespace
}  // namespace viwo
