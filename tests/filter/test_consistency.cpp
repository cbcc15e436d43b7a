// Is the covariance of the whole filter honest: simulated robot, real updates, many seeds.
//
// The errors of one run are correlated over its whole length (a wrong yaw stays wrong), so its mean
// NEES is not that of many independent numbers, and its spread is not known beforehand. What is
// independent is one instant over the seeds: the sum of NEES there is chi-square with 6 degrees of
// freedom per seed, exactly. Several instants are tested, each with its share of the error
// probability (Bonferroni), which holds whatever their correlation.
#include <gtest/gtest.h>

#include "filter_runs.hpp"

namespace viwo {
namespace {

using testing::MayBeModest;

constexpr int kSeeds = 8;
const std::vector<double> kInstants{5., 10., 15., 19.5};
const std::vector<std::string> kTwentySeconds{"sensors.simulator0.duration_s=20"};

std::string inconsistency(const std::vector<RunResult>& runs,
                          MayBeModest modest = MayBeModest::kNo) {
  return testing::inconsistency_of_pose(runs, kInstants, modest);
}

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), kTwentySeconds.begin(), kTwentySeconds.end());
  return more;
}

TEST(FilterConsistency, PoseIsConsistentWhileAllOfTheCalibrationIsFound) {
  EXPECT_EQ(inconsistency(testing::variant_runs("paper_accuracy", "bad_init_calib_on", kSeeds,
                                                kTwentySeconds)),
            "");
}

TEST(FilterConsistency, PoseIsNotTooSureWithTheTrueCalibrationHeld) {
  EXPECT_EQ(inconsistency(testing::variant_runs("paper_accuracy", "true_init_calib_off", kSeeds,
                                                kTwentySeconds),
                          MayBeModest::kYes),
            "");
}

/// The floors of an interval are ten times the noise of these wheels: where nothing else is unknown
/// of them, the mean NEES is 4.3 with them, and 6.0 with a tenth of them (60 and 40 seeds).
TEST(FilterConsistency, PoseIsConsistentWithTheTrueCalibrationHeld) {
  EXPECT_EQ(inconsistency(testing::variant_runs(
                "paper_accuracy", "true_init_calib_off", kSeeds,
                with({"updates.wheel_odometry.sigma_floor_yaw_rad=3e-6",
                      "updates.wheel_odometry.sigma_floor_position_m=3e-6"}))),
            "");
}

TEST(FilterConsistency, CheckSeesPixelsThatAreTwiceAsNoisyAsTheFilterThinks) {
  EXPECT_NE(
      inconsistency(testing::variant_runs("paper_accuracy", "bad_init_calib_on", kSeeds,
                                          with({"updates.visual_features.sigma_px=0.5",
                                                "updates.visual_features.find_noise=false"}))),
      "");
}

TEST(FilterConsistency, CheckSeesAWrongSignOfTheExtrinsics) {
  EXPECT_NE(inconsistency(testing::variant_runs("paper_accuracy", "true_init_calib_off", kSeeds,
                                                with({"wheels.p_IinO_m=[-0.05, -0.02, 0.15]"}))),
            "");
}

TEST(FilterConsistency, SameSeedGivesTheSameBits) {
  const std::vector<std::string> three_seconds{"sensors.simulator0.duration_s=3"};
  const auto first = testing::variant_runs("paper_accuracy", "bad_init_calib_on", 2, three_seconds);
  const auto second =
      testing::variant_runs("paper_accuracy", "bad_init_calib_on", 2, three_seconds);
  for (std::size_t i = 0; i < first.size(); ++i) {
    ASSERT_GT(first[i].epochs, 20);
    ASSERT_EQ(first[i].estimate.size(), second[i].estimate.size());
    EXPECT_EQ(first[i].estimate.back().p_BinW, second[i].estimate.back().p_BinW);
    EXPECT_EQ(first[i].nees.series, second[i].nees.series);
    for (std::size_t k = 0; k < first[i].calibration.size(); ++k) {
      EXPECT_EQ(first[i].calibration[k].estimate, second[i].calibration[k].estimate);
    }
  }
  EXPECT_NE(first[0].estimate.back().p_BinW, first[1].estimate.back().p_BinW);
}

}  // namespace
}  // namespace viwo
