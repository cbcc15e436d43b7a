// Wheels against the filter of their own run without them: cameras and IMU.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "registry.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/sim/encoder_simulator.hpp"

namespace viwo {
namespace {

using namespace calibration;

const std::string kSwerve = VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml";

CalibrationResult calibrated(CalibrationSetup& setup, std::uint64_t seed,
                             std::vector<std::string> assignments = {}) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_by_filter.yaml";
  std::ofstream(file) << "calibration: by_filter\nbase: " << kSwerve
                      << "\nreference: filter\nrecordings:\n  - {motion: icr_sweep}\n"
                         "  - {motion: figure_eight}\n";
  for (const char* fixed :
       {"estimator.calibration_error_scale=0", "sensors.simulator0.true_intrinsics_scale=1",
        "sensors.simulator0.ground=flat"}) {
    assignments.emplace_back(fixed);
  }
  assignments.push_back("seed=" + std::to_string(seed));
  setup = read_calibration_setup(file, assignments, testing::registry());
  return calibrate(setup);
}

/// Errors of the estimate in its sigmas.
Eigen::ArrayXd normalised_errors(std::uint64_t seed, const std::vector<std::string>& assignments) {
  CalibrationSetup setup;
  const CalibrationResult result = calibrated(setup, seed, assignments);
  const Intrinsics truth =
      sim::perturbed_intrinsics(setup.recordings[0].setup.model->description(), 1., 1000 * seed);
  return (result.all.x_WI - truth).array() / result.all.sigma.array();
}

TEST(FilterReference, FindsTheTrueIntrinsicsWithHonestSigmas) {
  double squares = 0.;
  constexpr std::uint64_t kSeeds = 4;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Eigen::ArrayXd error = normalised_errors(seed, {});
    EXPECT_LT(error.abs().maxCoeff(), 3.) << seed;
    squares += error.square().mean() / kSeeds;
  }
  // 1.28 over 12 seeds; those of a seed go together.
  EXPECT_GT(squares, 0.3);
  EXPECT_LT(squares, 3.);
  // Where O is in I is taken from the section of the wheels: 2 cm off is seen.
  EXPECT_GT(normalised_errors(1, {"wheels.p_IinO_m=[0.07, 0.02, 0.15]"}).abs().maxCoeff(), 10.);
}

TEST(FilterReference, NeedsAFilterThatSeesWithoutWheels) {
  CalibrationSetup setup;
  EXPECT_THAT([&] { calibrated(setup, 1, {"updates.visual_features.enabled=false"}); },
              ::testing::ThrowsMessage<InputError>(
                  "recording 'icr_sweep': reference: filter, but without its wheels the filter of "
                  "the base knows of the motion by its IMU alone: it needs an update of cameras, "
                  "say, or reference: gyro"));
}

}  // namespace
}  // namespace viwo
