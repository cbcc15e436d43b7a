// Consistency of the whole filter with fixes, from a start that knows nothing of the Earth.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "gnss_runs.hpp"

namespace viwo {
namespace {

using testing::GnssDrive;
using testing::inconsistency;
using testing::poor_odometry;
using testing::poor_receiver;
using testing::run_gnss_seeds;

constexpr int kSeeds = 20;

TEST(GnssRuns, FindTheEarthAndAreConsistent) {
  const auto runs = run_gnss_seeds(poor_receiver(), kSeeds);
  EXPECT_EQ(inconsistency(runs), "");
  for (const auto& run : runs) EXPECT_LT(run.sigma_yaw, 0.06);
}

TEST(GnssRuns, AreConsistentWithAReceiverOfCentimetresOnAPoorOdometry) {
  EXPECT_EQ(inconsistency(run_gnss_seeds(poor_odometry(), kSeeds)), "");
}

TEST(GnssRuns, AreConsistentWithErrorsThatLastWhereTheyAreModelled) {
  GnssDrive drive = poor_receiver();
  drive.sigma_m = {0.1, 0.1, 0.1};
  drive.sigma_drift_m = {1., 1., 5.};
  drive.update = ", sigma_drift_m: 1, sigma_height_drift_m: 5, drift_time_constant_s: 30";
  EXPECT_EQ(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
  drive.update = "";
  EXPECT_NE(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
}

TEST(GnssRuns, FindTheEarthAmongFixesThatAreOff) {
  GnssDrive drive = poor_receiver();
  drive.outlier_probability = 0.1;
  const auto runs = run_gnss_seeds(drive, kSeeds);
  double applied = 0., rejected = 0.;
  for (const auto& run : runs) {
    EXPECT_TRUE(run.aligned) << run.failure;
    applied += static_cast<double>(run.counts.applied);
    rejected += static_cast<double>(run.counts.rejected);
  }
  EXPECT_NEAR(rejected / (applied + rejected), 0.1, 0.02);
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

TEST(GnssRuns, ShowAJacobianOfTheYawWithTheWrongSign) {
  GnssDrive drive = poor_odometry();
  drive.spoil = [](ResidualFactor& factor) {
    if (factor.columns.size() >= 19) factor.H.col(15) *= -1.;
  };
  EXPECT_NE(inconsistency(run_gnss_seeds(drive, kSeeds)), "");
}

}  // namespace
}  // namespace viwo
