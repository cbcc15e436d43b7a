// The clock of wheels that are noisy: does the filter know how well it knows it. Its column is of
// what the wheels measured, too, and what that has in common with the residual would be a bias.
#include <cmath>

#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "viwo/eval/consistency.hpp"

namespace viwo {
namespace {

constexpr int kSeeds = 12;

struct Base {
  const char* experiment;
  const char* variant;
};

void PrintTo(const Base& base, std::ostream* out) { *out << base.experiment; }

/// Error over sigma of t_OtoI at the end of drives with drives of 0.02 rad/s per sample.
std::vector<double> errors_of(const Base& base, const std::vector<std::string>& more = {}) {
  std::vector<std::string> assignments{"sensors.simulator0.duration_s=40",
                                       "sensors.simulator0.robot.sigma_drive_rad_per_s=0.02",
                                       "kinematics.sigma_drive_rad_per_s=0.02"};
  assignments.insert(assignments.end(), more.begin(), more.end());
  std::vector<double> errors;
  for (const RunResult& run :
       testing::variant_runs(base.experiment, base.variant, kSeeds, std::move(assignments))) {
    for (const auto& track : run.calibration) {
      if (track.name == "t_OtoI") errors.push_back(track.final_error / track.sigma.back());
    }
  }
  return errors;
}

double mean_square(const std::vector<double>& errors) {
  double sum = 0.;
  for (const double error : errors) sum += error * error;
  return sum / static_cast<double>(errors.size());
}

class ClockOf : public ::testing::TestWithParam<Base> {};

// Smooth drives: what the clock is learned from is as small as the noise of an interval.
INSTANTIATE_TEST_SUITE_P(, ClockOf,
                         ::testing::Values(Base{"calibrate_ackermann", "rear_and_centre"},
                                           Base{"calibrate_skid_steer", "held_frame"}),
                         [](const auto& test) { return std::string(test.param.experiment); });

// With a column of two intervals one of which is the residual's it was 3.7, and 15.
TEST_P(ClockOf, NoisyDrivesIsConsistent) {
  const std::vector<double> errors = errors_of(GetParam());
  ASSERT_EQ(errors.size(), static_cast<std::size_t>(kSeeds));
  const auto bounds = eval::mean_nees_bounds(1, kSeeds, 0.999);
  EXPECT_GT(mean_square(errors), bounds.low);
  EXPECT_LT(mean_square(errors), bounds.high);
}

TEST_P(ClockOf, DrivesThatAreNoisierThanBelievedIsNot) {
  const std::vector<double> errors =
      errors_of(GetParam(), {"kinematics.sigma_drive_rad_per_s=0.002",
                             "updates.wheel_odometry.gate_probability=0",
                             "updates.wheel_odometry.find_noise=false"});
  EXPECT_GT(mean_square(errors), eval::mean_nees_bounds(1, kSeeds, 0.999).high);
}

}  // namespace
}  // namespace viwo
