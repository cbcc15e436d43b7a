// Zeros of the steering anywhere, drives that turn backwards, gears that are off: found from wheels
// and gyro alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "joint_search.hpp"
#include "unknown_swerve.hpp"

namespace viwo {
namespace {

using namespace calibration;
using testing::calibrate_unknown;
using testing::gyro_setup;
using testing::unknown_swerve;

TEST(JointSearch, FindsZerosAnywhereADriveThatTurnsBackwardsAndAGear) {
  EXPECT_LT(calibrate_unknown(4).most_sigmas, 4.);
}

TEST(JointSearch, FindsADriveThatTurnsBackwards) {
  for (const int reversed : {-1, 0, 1}) {
    CalibrationSetup setup = gyro_setup(
        "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3",
        "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3", 1);
    std::vector<int> signs{1, 1};
    if (reversed >= 0) signs[static_cast<std::size_t>(reversed)] = -1;
    reverse_drives(setup, signs);
    const auto fit_nominal = calibrate(setup);
    EXPECT_EQ(fit_nominal.is_trusted(), reversed < 0)
        << ::testing::PrintToString(fit_nominal.doubts);
    setup.options.find_drive_signs = true;
    const auto result = calibrate(setup);
    EXPECT_EQ(result.search.drive_signs, signs);
    EXPECT_TRUE(result.is_trusted()) << ::testing::PrintToString(result.doubts);
    const auto& truth = setup.recordings[0].data.calibration;
    for (const char* name : {"r_left", "r_right"}) {
      const int k = setup.recordings[0].setup.model->find(name);
      ASSERT_GE(k, 0) << name;
      EXPECT_NEAR(result.all.x_WI[k], truth.at(name), 4. * result.all.sigma[k]) << name;
    }
  }
}

TEST(JointSearch, SaysWhatAllDrivesReversedMayBeAsWell) {
  const std::string base =
      "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3";
  CalibrationSetup setup = gyro_setup(base, base, 1);
  setup.options.find_drive_signs = true;
  const auto exchanged = ::testing::Contains(::testing::HasSubstr("right are exchanged"));
  EXPECT_THAT(calibrate(setup).warnings, ::testing::Not(exchanged));
  reverse_drives(setup, {-1, -1});
  const auto result = calibrate(setup);
  EXPECT_THAT(result.search.drive_signs, ::testing::ElementsAre(-1, -1));
  EXPECT_THAT(result.warnings, exchanged);
}

TEST(JointSearch, SaysWithWhichSignsTheOtherSolutionIs) {
  const std::string base =
      "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3";
  CalibrationSetup setup = gyro_setup(base, base, 1);
  testing::change_wheels(setup, [](EncoderSample& sample) { sample.drive_rad_per_s[1] = 0.; });
  setup.options.find_drive_signs = true;
  EXPECT_THAT(calibrate(setup).doubts,
              ::testing::Contains(::testing::HasSubstr(
                  "another solution of the joints fits as well: drive signs [")));
}

TEST(JointSearch, SaysThatADriveWithoutTurnsTellsNoZeros) {
  CalibrationSetup setup = unknown_swerve(1, "straight");
  setup.options.find_steering_zeros = true;
  const auto result = calibrate(setup);
  EXPECT_THAT(result.doubts, ::testing::Contains(::testing::HasSubstr("another solution")));
}

TEST(SteeringZeros, AreTheIntrinsicsThatDoWhatTheReadingDoes) {
  const auto setup = unknown_swerve(1);
  const WheelModel& model = *setup.recordings[0].setup.model;
  const auto zeros = steering_zeros(model);
  ASSERT_EQ(zeros.size(), 4u);
  for (int j = 0; j < 4; ++j) {
    EXPECT_EQ(zeros[static_cast<std::size_t>(j)], model.find("delta_o" + std::to_string(j + 1)));
  }
}

}  // namespace
}  // namespace viwo
