// Front end, filter and calibration together on rendered fisheye stereo images of the paper's
// robot.
#include <cmath>

#include <gtest/gtest.h>

#include "filter_runs.hpp"

namespace viwo {
namespace {

RunResult run(const std::string& configuration, const std::vector<std::string>& assignments) {
  auto setup = testing::run_setup(configuration, assignments);
  const auto data = collect(setup);
  auto result = run(setup, data);
  EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
  return result;
}

/// Of the free wheel intrinsics: how many, and their mean squared error in units of the prior.
struct Intrinsics {
  int n = 0;
  double error = 0.;
};

Intrinsics intrinsics_of(const RunResult& result) {
  Intrinsics out;
  for (const auto& track : result.calibration) {
    const bool is_intrinsic = track.name.starts_with("r_") || track.name.starts_with("x_") ||
                              track.name.starts_with("y_") || track.name.starts_with("delta_");
    const double prior = track.sigma.front(), sigma = track.sigma.back();
    if (!is_intrinsic || sigma == 0.) continue;
    EXPECT_LT(std::abs(track.final_error), 3. * sigma) << track.name;
    out.error += std::pow(track.final_error / prior, 2);
    ++out.n;
  }
  out.error = std::sqrt(out.error / out.n);
  return out;
}

TEST(RenderedImages, CalibrateAsWellAsIdealTracks) {
  const auto images = run("runs/viwo_images.yaml", {});
  ASSERT_TRUE(images.accuracy);
  const double path_m = images.accuracy->path_length_m;
  EXPECT_GT(path_m, 25.);
  EXPECT_LT(images.accuracy->ate_m, 0.005 * path_m);
  EXPECT_LT(images.accuracy->end_m, 0.005 * path_m);
  EXPECT_LT(images.nees.pose, 12.);
  EXPECT_GT(images.nees.pose, 1.);
  const Intrinsics rendered = intrinsics_of(images);
  const Intrinsics ideal = intrinsics_of(run("runs/viwo_swerve.yaml", {}));
  EXPECT_EQ(rendered.n, 13);
  EXPECT_LT(rendered.error, 2. * ideal.error);
}

TEST(RenderedImages, LeaveAGapOfFiveSecondsToWheelsAndImu) {
  const auto dark = run("runs/viwo_images.yaml",
                        {"sensors.images0.dark_start_s=[20]", "sensors.images0.dark_duration_s=5"});
  ASSERT_TRUE(dark.accuracy);
  EXPECT_LT(dark.accuracy->ate_m, 0.005 * dark.accuracy->path_length_m);
  EXPECT_LT(dark.nees.pose, 12.);
  EXPECT_EQ(intrinsics_of(dark).n, 13);
}

}  // namespace
}  // namespace viwo
