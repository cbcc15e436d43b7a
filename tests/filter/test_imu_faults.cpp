// Faults of an IMU, put into a simulated run: the estimate stays good, or the run says that it is
// not. None may be wrong without a word.
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "viwo/results/run_record.hpp"

namespace viwo {
namespace {

using Readings = std::vector<ImuSample>;

constexpr double kFaultS = 7.;
constexpr std::int64_t kSecond = 1'000'000'000;

/// What a fault makes of the readings; `after_s` is the time since the fault begins.
using Fault = std::function<void(ImuSample& reading, double after_s)>;

Readings broken(const Readings& good, const Fault& fault,
                const std::function<bool(double after_s)>& is_lost) {
  Readings readings;
  for (ImuSample reading : good) {
    const double after_s = seconds_between(good.front().t_ns, reading.t_ns) - kFaultS;
    if (is_lost && is_lost(after_s)) continue;
    if (fault) fault(reading, after_s);
    if (readings.empty() || reading.t_ns > readings.back().t_ns) readings.push_back(reading);
  }
  return readings;
}

class ImuFaults : public ::testing::Test {
 protected:
  static RunResult run(const Fault& fault, const std::function<bool(double)>& is_lost = {}) {
    auto setup = testing::run_setup("runs/viwo_swerve.yaml", {"sensors.simulator0.duration_s=15"});
    auto data = collect(setup);
    const auto imu = data.imu();
    data.recorded.set("simulator0", broken({imu.begin(), imu.end()}, fault, is_lost));
    return viwo::run(setup, data);
  }
  static double ate_m(const RunResult& result) {
    return result.accuracy ? result.accuracy->ate_m : 1e9;
  }
  static bool is_flagged(const RunResult& result) {
    return !is_trusted(result) || !result.warnings.empty();
  }
  /// Not worse than twice the clean run, and a centimetre for what the other sensors can do.
  static void expect_accurate(const RunResult& result) {
    static const double clean_m = ate_m(run({}));
    EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
    EXPECT_LT(ate_m(result), 2. * clean_m + 0.01);
  }
};

TEST_F(ImuFaults, GapsAreBridgedByTheOtherSensors) {
  for (const double gap_s : {0.5, 2., 5.}) {
    expect_accurate(run({}, [gap_s](double after_s) { return after_s > 0. && after_s < gap_s; }));
  }
}

TEST_F(ImuFaults, SingleReadingsBeyondTheRangeAreLeftOut) {
  for (const double spike : {1000., 1e20}) {
    expect_accurate(run([spike](ImuSample& reading, double after_s) {
      if (after_s >= 0. && after_s < 0.005) reading.accel_m_per_s2[0] = spike;
    }));
  }
}

TEST_F(ImuFaults, SingleSpikesWithinTheRangeAreLeftOut) {
  expect_accurate(run([](ImuSample& reading, double after_s) {
    if (after_s >= 0. && after_s < 0.005) reading.accel_m_per_s2[0] = 150.;
    if (after_s >= 1. && after_s < 1.005) reading.gyro_rad_per_s[2] = -30.;
  }));
}

TEST_F(ImuFaults, ThatLastAreNotSilent) {
  const std::vector<std::pair<const char*, Fault>> faults{
      {"clock ahead",
       [](ImuSample& reading, double after_s) {
         if (after_s > 0.) reading.t_ns += kSecond;
       }},
      {"clock back",
       [](ImuSample& reading, double after_s) {
         if (after_s > 0.) reading.t_ns -= kSecond;
       }},
      {"axes exchanged",
       [](ImuSample& reading, double) {
         std::swap(reading.gyro_rad_per_s[0], reading.gyro_rad_per_s[1]);
         std::swap(reading.accel_m_per_s2[0], reading.accel_m_per_s2[1]);
       }},
      {"gyro in degrees",
       [](ImuSample& reading, double) {
         for (double& rate : reading.gyro_rad_per_s) rate *= 180. / M_PI;
       }},
      {"accelerometer in g", [](ImuSample& reading, double) {
         for (double& accel : reading.accel_m_per_s2) accel /= 9.81;
       }}};
  for (const auto& [name, fault] : faults) {
    const RunResult result = run(fault);
    EXPECT_TRUE(is_flagged(result)) << name << ", " << ate_m(result) << " m";
  }
}

TEST_F(ImuFaults, AnAccelerometerInGEndsTheRunWithTheReason) {
  const RunResult result = run([](ImuSample& reading, double) {
    for (double& accel : reading.accel_m_per_s2) accel /= 9.81;
  });
  EXPECT_EQ(result.status, RunStatus::kDiverged);
  EXPECT_NE(result.cause, "");
}

TEST_F(ImuFaults, ARunThatEndsInNoNumbersKeepsThoseBefore) {
  auto setup = testing::run_setup(
      "runs/viwo_swerve.yaml",
      {"sensors.simulator0.duration_s=5", "estimator.sigma_start_gyro_bias_rad_per_s=1e200"});
  const RunResult result = viwo::run(setup, collect(setup));
  EXPECT_EQ(result.status, RunStatus::kDiverged);
  for (const StampedPose& pose : result.estimate) {
    ASSERT_TRUE(pose.p_BinW.allFinite() && pose.q_BtoW.coeffs().allFinite()) << pose.t_ns;
  }
  EXPECT_EQ(from_record(to_record(result)).cause, result.cause);
}

}  // namespace
}  // namespace viwo
