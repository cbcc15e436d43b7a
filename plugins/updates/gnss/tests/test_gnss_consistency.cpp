// Nightly: as test_gnss_runs.cpp, with more seeds. 99 % bounds are then within 14 % of the mean.
#include <gtest/gtest.h>

#include "gnss_runs.hpp"

namespace viwo {
namespace {

using testing::inconsistency;
using testing::run_gnss_seeds;

constexpr int kSeeds = 300;

TEST(ManyGnssRuns, AreConsistentWithAReceiverOfAMetreOnAGoodOdometry) {
  EXPECT_EQ(inconsistency(run_gnss_seeds(testing::poor_receiver(), kSeeds)), "");
}

TEST(ManyGnssRuns, AreConsistentWithAReceiverOfCentimetresOnAPoorOdometry) {
  EXPECT_EQ(inconsistency(run_gnss_seeds(testing::poor_odometry(), kSeeds)), "");
}

}  // namespace
}  // namespace viwo
