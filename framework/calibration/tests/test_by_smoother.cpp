// Wheels, cameras and IMU of a recording together.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "registry.hpp"
#include "simulated_calibration.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/calibration_report/calibration_output.hpp"

namespace viwo {
namespace {

using namespace calibration;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::string kSwerve = VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml";

CalibrationResult calibrated(CalibrationSetup& setup, std::uint64_t seed,
                             std::vector<std::string> assignments = {}) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_by_smoother.yaml";
  std::ofstream(file) << "calibration: by_smoother\nbase: " << kSwerve
                      << "\nreference: smoother\nrecordings:\n  - {motion: icr_sweep}\n"
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

TEST(BySmoother, FindsTheTrueIntrinsicsAndWritesAllOfIt) {
  CalibrationSetup setup;
  const CalibrationResult result = calibrated(setup, 1);
  const Intrinsics truth = testing::truth_of(setup, 1).x_WI;
  const Eigen::ArrayXd off = (result.all.x_WI - truth).array();
  for (Eigen::Index i = 0; i < off.size(); ++i) {
    EXPECT_LE(std::abs(off[i]), 3.5 * result.all.sigma[i] + 1e-12) << i;
  }
  EXPECT_TRUE(result.is_trusted()) << result.doubts.front();
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_by_smoother";
  std::filesystem::create_directories(folder);
  write_calibration(folder, result);
  const CalibrationFile file = read_calibration(folder / "calibration.yaml");
  EXPECT_EQ(file.mount.size(), 6u);
  EXPECT_EQ(file.clock.size(), 1u);
  EXPECT_EQ(file.model, "four_wis_wid");
  EXPECT_DOUBLE_EQ(find(file.intrinsics, "r_2")->estimate, result.all.x_WI[1]);
  EXPECT_THAT(describe(result), HasSubstr("theta_ItoO_z"));
}

TEST(BySmoother, RefusesWhatItDoesNotLookAt) {
  CalibrationSetup setup;
  EXPECT_THAT([&] { calibrated(setup, 1, {"segment_s=1"}); },
              ThrowsMessage<InputError>(HasSubstr("segment_s is not for reference: smoother")));
  EXPECT_THAT([&] { calibrated(setup, 1, {"estimator.type=dead_reckoning"}); },
              ThrowsMessage<InputError>(HasSubstr("needs a section 'updates'")));
}

}  // namespace
}  // namespace viwo
