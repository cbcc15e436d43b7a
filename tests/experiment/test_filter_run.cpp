// Runs of the filter: their progress, and what is written of what their sensors give.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "simulated.hpp"
#include "viwo/experiment/progress.hpp"
#include "viwo/experiment/simulate.hpp"

namespace viwo {
namespace {

using namespace experiment;
using testing::registry;

/// A simulated swerve robot for ten seconds; images only make the epochs.
RunSetup inertia_and_wheels() {
  const config::Node run = config::parse(
      "sensors:\n"
      "  simulator0: {type: simulator, motion: circle, duration_s: 10, features: 10, "
      "cameras: " VIWO_TEST_SOURCE_DIR
      "/configs/cameras/pinhole.yaml, "
      "robot: {type: four_wis_wid, " +
          testing::kSwerve +
          "}}\n"
          "kinematics: {type: four_wis_wid, " +
          testing::kSwerve +
          "}\n"
          "updates: {wheel_odometry: {}}\n",
      "run.yaml");
  return read_run(run, registry(), 1);
}

TEST(FilterRun, TellsItsProgressAsPartOfTheTimeOfTheLog) {
  RunSetup setup = inertia_and_wheels();
  const RunData data = collect(setup);
  std::vector<double> fractions;
  const RunResult result =
      experiment::run(setup, data, [&](double fraction) { fractions.push_back(fraction); });
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  ASSERT_EQ(fractions.size(), static_cast<std::size_t>(result.epochs));
  const double log_s = seconds_between(data.imu.front().t_ns, data.imu.back().t_ns);
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    const double t_s = seconds_between(data.imu.front().t_ns, result.estimate[i].t_ns);
    EXPECT_DOUBLE_EQ(fractions[i], t_s / log_s);
  }
  EXPECT_GT(fractions.back(), 0.95);
  EXPECT_LE(fractions.back(), 1.);
}

TEST(SimulateResult, IsDescribedByWhatThereIs) {
  SimulateResult result;
  result.counts[Measurement(ImuSample()).index()] = 2001;
  EXPECT_EQ(describe(result), "2001 IMU samples");
  result.counts[Measurement(FeatureSample()).index()] = 1;
  EXPECT_EQ(describe(result), "2001 IMU samples and 1 image");
  result.counts[Measurement(EncoderSample()).index()] = 11;
  result.counts[Measurement(PoseSample()).index()] = 12;
  result.counts[Measurement(StateSample()).index()] = 13;
  result.counts[Measurement(CalibrationSample()).index()] = 14;
  EXPECT_EQ(describe(result),
            "2001 IMU samples, 1 image, 11 encoder samples, 12 reference poses, 13 reference "
            "states and 14 true parameters");
}

TEST(TimeProgress, IsSilentForASecondAndThenSaysEveryTenPercent) {
  ::testing::internal::CaptureStderr();
  {
    TimeProgress progress("run");
    progress.at(0.5);
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    progress.at(0.05);  // less than ten percent are not worth a line
    progress.at(0.678);
    progress.at(0.9);  // within a second of the last line
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    progress.at(0.69);
    progress.at(1.);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "run: 67 %\nrun: 100 %\n");
}

}  // namespace
}  // namespace viwo
