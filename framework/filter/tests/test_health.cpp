// When a filter cannot go on, and what it says then.
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/health.hpp"

namespace viwo {
namespace {

using testing::kNaN;
using testing::kOptions;
using testing::level_prior;
using testing::make_filter;
using testing::observation;

constexpr const char* kNotFinite = "the estimate or its covariance is not finite any more";

/// What is said of a filter that begins there.
std::string failure_at(const ImuPrior& prior) {
  Filter filter = make_filter();
  filter.initialize(prior);
  return failure_of(filter);
}

TEST(Health, IsGoodAtTheStart) { EXPECT_EQ(failure_at(level_prior(0)), ""); }

TEST(Health, SeesAStateThatIsNotFinite) {
  for (int part = 0; part < 5; ++part) {
    ImuPrior prior = level_prior(0);
    ImuState& imu = prior.state;
    (part == 0   ? imu.R_GtoI(1, 2)
     : part == 1 ? imu.p_IinG[0]
     : part == 2 ? imu.v_IinG[1]
     : part == 3 ? imu.gyro_bias[2]
                 : imu.accel_bias[1]) = kNaN;
    EXPECT_EQ(failure_at(prior), kNotFinite) << part;
  }
}

TEST(Health, SeesVariancesThatAreNone) {
  ImuPrior prior = level_prior(0);
  prior.P(4, 4) = kNaN;
  EXPECT_EQ(failure_at(prior), kNotFinite);
  prior.P(4, 4) = -1e-3;
  EXPECT_EQ(failure_at(prior), "a variance is negative");
}

TEST(Health, RemembersThatACovarianceWasNotPositiveDefinite) {
  ImuPrior prior = level_prior(0, 1.);
  prior.P(0, 1) = prior.P(1, 0) = 2.;
  Filter filter = make_filter();
  filter.initialize(prior);
  EXPECT_EQ(failure_of(filter), "") << "not yet seen";
  InformationFactor factor;
  factor.columns.add(0, 3);
  factor.Lambda = Eigen::Matrix3d::Identity();
  factor.eta = Eigen::Vector3d::Zero();
  EXPECT_EQ(filter.apply(factor), FactorResult::kFailed);
  EXPECT_EQ(failure_of(filter), "the covariance of the clones is not positive definite any more");
}

TEST(Health, NamesTheBlockThatOverflows) {
  const struct {
    std::size_t block, entry;
    int column;
  } cases[] = {{0, 3, testing::kArmMount + 3},
               {2, 3, testing::kBaseMount + 3},
               {3, 0, testing::kBaseClock},
               {4, 0, testing::kBaseNumbers}};
  for (const auto& one : cases) {
    std::vector<BlockSpec> blocks = testing::fixture_blocks();
    blocks[one.block].entries[one.entry].sigma = 1e10;
    Filter filter(kOptions, blocks);
    filter.initialize(level_prior(0));
    ResidualFactor factor = observation(one.column, Eigen::VectorXd::Constant(1, 1e305), 1.);
    factor.H(0, 0) = 1e-5;  // a gain of 1e5
    ASSERT_EQ(filter.apply(factor), FactorResult::kApplied);
    EXPECT_EQ(failure_of(filter),
              "the block '" + blocks[one.block].name + "' is not finite any more");
  }
}

TEST(Health, SeesWhatNoRobotDoes) {
  ImuPrior fast = level_prior(0);
  fast.state.v_IinG = {60., 80., 1.};
  EXPECT_EQ(failure_at(fast), "the speed is 100 m/s (estimator.max_speed_m_per_s), more than 100");
  ImuPrior gyro = level_prior(0);
  gyro.state.gyro_bias = {0., -1.5, 0.};
  EXPECT_EQ(failure_at(gyro), "the gyro bias is 1.5 rad/s, more than 1");
  ImuPrior accel = level_prior(0);
  accel.state.accel_bias = {0., 0., 12.};
  EXPECT_EQ(failure_at(accel), "the accelerometer bias is 12 m/s^2, more than 10");
}

}  // namespace
}  // namespace viwo
