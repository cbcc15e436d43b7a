// Consistency of the whole filter with fixes, from a start that knows nothing of the Earth.
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gnss_runs.hpp"

namespace viwo {
namespace {

using testing::GnssDrive;
using ::testing::HasSubstr;
using testing::inconsistency;
using testing::poor_odometry;
using testing::poor_receiver;
using testing::run_gnss;
using testing::run_gnss_seeds;

constexpr int kSeeds = 24;

/// Columns of the alignment, the last four: yaw first.
void turn_yaw_round(ResidualFactor& factor) { factor.H.col(factor.H.cols() - 4) *= -1.; }

/// Those behind the two clones; the factors of the start, which has no clones, are left alone.
void turn_lever_arm_round(ResidualFactor& factor) {
  if (factor.columns.size() > 2 * kPoseSize) factor.H.middleCols<3>(2 * kPoseSize) *= -1.;
}

TEST(GnssRuns, AreConsistentWithAReceiverOfAMetreOnAGoodOdometry) {
  GnssDrive drive = poor_receiver();
  const auto runs = run_gnss_seeds(drive, kSeeds);
  EXPECT_EQ(inconsistency(runs), "");
  for (const auto& run : runs) EXPECT_LT(run.sigma_yaw, 0.02);
  drive.spoil = turn_yaw_round;
  EXPECT_THAT(inconsistency(run_gnss_seeds(drive, kSeeds)), HasSubstr("alignment"));
}

TEST(GnssRuns, AreConsistentWithAReceiverOfCentimetresOnAPoorOdometry) {
  GnssDrive drive = poor_odometry();
  const auto runs = run_gnss_seeds(drive, kSeeds);
  EXPECT_EQ(inconsistency(runs), "");
  for (const auto& run : runs) EXPECT_LT(run.sigma_yaw, 0.02);
  drive.spoil = turn_yaw_round;
  EXPECT_THAT(inconsistency(run_gnss_seeds(drive, kSeeds)), HasSubstr("alignment"));
  drive.spoil = turn_lever_arm_round;
  EXPECT_THAT(inconsistency(run_gnss_seeds(drive, kSeeds)), HasSubstr("lever arm"));
}

TEST(GnssRuns, AreConsistentWithFirstEstimatesAndAsAPlainKalmanFilter) {
  for (const Consistency consistency : {Consistency::kFirstEstimates, Consistency::kNone}) {
    for (GnssDrive drive : {poor_receiver(), poor_odometry()}) {
      drive.consistency = consistency;
      EXPECT_EQ(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
    }
  }
}

TEST(GnssRuns, AreConsistentWithErrorsThatLastWhereTheseAreModelled) {
  GnssDrive drive = poor_receiver();
  drive.sigma_m = {0.1, 0.1, 0.1};
  drive.sigma_drift_m = {1., 1., 5.};
  drive.update = ", sigma_drift_m: 1, sigma_height_drift_m: 5, drift_time_constant_s: 30";
  EXPECT_EQ(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
  drive.update = "";
  EXPECT_NE(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
}

TEST(GnssRuns, ShowNoiseThatIsTwiceWhatTheMessagesSay) {
  GnssDrive drive = poor_receiver();
  drive.noise_scale = 2.;
  drive.update = ", gate_probability: 0";
  EXPECT_NE(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
}

TEST(GnssRuns, ShowAClockThatIsWrong) {
  GnssDrive drive = poor_odometry();
  drive.update = ", t_AtoI_s: -0.1";
  EXPECT_NE(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
}

TEST(GnssRuns, FindTheEarthAmongFixesThatAreOff) {
  GnssDrive drive = poor_receiver();
  drive.outlier_probability = 0.1;
  EXPECT_EQ(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
}

TEST(GnssRuns, LeaveAFirstFixThatIsOffOrPoor) {
  constexpr auto kContradicting = "gnss: fix that contradicted the start of that search";
  GnssDrive drive = poor_odometry();
  drive.duration_s = 10.;
  drive.instants_s = {9.};
  const auto plain = run_gnss(drive, 3);
  ASSERT_TRUE(plain.aligned);
  EXPECT_EQ(plain.left_out.count(kContradicting), 0u);
  // The first fix that can be used: the one before is older than the oldest clone.
  drive.edit = [](std::vector<GnssSample>& fixes) { fixes[1].longitude_deg += 1e-3; };
  const auto off = run_gnss(drive, 3);
  EXPECT_TRUE(off.aligned);
  EXPECT_EQ(off.left_out.at(kContradicting), 1);
  drive.edit = [](std::vector<GnssSample>& fixes) {
    for (const std::size_t i : {0u, 4u, 8u}) fixes[1].covariance_ENU_m2[i] = 400.;
  };
  const auto poor = run_gnss(drive, 3);
  EXPECT_TRUE(poor.aligned) << "20 m tell the yaw after 100 m, and 10 m are driven";
  for (const auto& run : {off, poor}) EXPECT_LT(std::abs(run.error_yaw), 4. * run.sigma_yaw);
}

}  // namespace
}  // namespace viwo
