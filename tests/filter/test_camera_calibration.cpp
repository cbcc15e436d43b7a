// Cameras whose clock is not that of the file: found while driving, and not harmless.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo {
namespace {

constexpr int kPairs = 20;

/// Fifteen seconds of the sweep, stereo, with stamps of the cameras that are off.
RunResult run(const std::string& clock_error_s, std::vector<std::string> more) {
  more.push_back("sensors.simulator0.duration_s=15");
  more.push_back("sensors.simulator0.camera_clock_error_s=" + clock_error_s);
  auto setup = testing::run_setup("runs/viwo_swerve.yaml", more);
  const auto data = collect(setup);
  RunResult result = run(setup, data);
  EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
  return result;
}

const CalibrationTrack& parameter(const RunResult& result, const std::string& name) {
  for (const CalibrationTrack& track : result.calibration) {
    if (track.name == name) return track;
  }
  throw std::invalid_argument("no " + name);
}

void expect_found(const RunResult& result, const std::string& name, double value) {
  const CalibrationTrack& track = parameter(result, name);
  EXPECT_DOUBLE_EQ(track.truth, value) << name;
  EXPECT_GT(track.sigma.front(), 5e-3) << name;
  EXPECT_LT(track.sigma.back(), 1e-3) << name;
  EXPECT_NEAR(track.estimate.back(), value, 4. * track.sigma.back()) << name;
  EXPECT_DOUBLE_EQ(track.final_error, track.estimate.back() - track.truth) << name;
}

TEST(CameraClock, IsFoundForAPairThatIsTriggeredTogether) {
  const RunResult found = run("[0.02]", {"cameras.calibrate=true"});
  expect_found(found, "cam0.t_CtoI", 0.02);
  EXPECT_THROW(parameter(found, "cam1.t_CtoI"), std::invalid_argument);
  EXPECT_LT(found.nees.pose, 20.);
  // Held at what the file says it shows in the trajectory.
  const RunResult held = run("[0.02]", {});
  EXPECT_EQ(parameter(held, "cam0.t_CtoI").sigma.back(), 0.);
  EXPECT_GT(held.nees.pose, 2. * found.nees.pose);
  ASSERT_TRUE(found.accuracy && held.accuracy);
  EXPECT_GT(held.accuracy->ate_m, found.accuracy->ate_m);
}

TEST(CameraClock, IsFoundForEachOfTwoCamerasThatRunFree) {
  const RunResult found =
      run("[0.015, -0.01]", {"cameras.calibrate=true", "cameras.synchronised=false"});
  expect_found(found, "cam0.t_CtoI", 0.015);
  expect_found(found, "cam1.t_CtoI", -0.01);
}

/// Mean square of the errors of a radius, in sigmas, over pairs that are drawn around the file:
/// each against the first by `drawn` of what all are off by, as the filter believes of `believed`.
double nees_of_radius(const std::string& drawn, const std::string& believed) {
  double sum = 0.;
  for (int seed = 1; seed <= kPairs; ++seed) {
    const RunResult result =
        run("[0]",
            {"seed=" + std::to_string(seed), "cameras.calibrate=true",
             "sensors.simulator0.sigma_true_camera_position_m=0.01",
             "sensors.simulator0.sigma_true_camera_orientation_rad=0.005",
             "sensors.simulator0.true_camera_relative=" + drawn, "cameras.relative=" + believed});
    const CalibrationTrack& radius = parameter(result, "r_1");
    sum += std::pow(radius.final_error / radius.sigma.back(), 2);
  }
  return sum / kPairs;
}

TEST(CameraPair, ThatIsKnownToItselfTellsTheRadiiConsistently) {
  const double least = chi2_quantile(0.0005, kPairs) / kPairs;
  const double most = chi2_quantile(0.9995, kPairs) / kPairs;
  const double found = nees_of_radius("0.1", "0.1");
  EXPECT_GT(found, least);
  EXPECT_LT(found, most);
  EXPECT_GT(nees_of_radius("1", "0.1"), most) << "a pair that is not what is believed";
}

}  // namespace
}  // namespace viwo
