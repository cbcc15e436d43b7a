// A start that may be anywhere: relative measurements do as with one that is known, absolute ones
// find where it is.
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "filter_fixture.hpp"

namespace viwo {
namespace {

using testing::Random;

constexpr double kAbsolute_m = 1.;  ///< sigma of a fix

/// A filter that has gone a while, with clones on the way.
Filter on_its_way(double sigma_start_m) {
  FilterOptions options;
  options.clones = 4;
  Filter filter(options);
  ImuPrior prior;
  prior.state.v_IinG = {0.5, 0.1, 0.};
  prior.P.diagonal().setConstant(1e-6);
  prior.P.diagonal().segment<3>(kPositionColumn).setConstant(sigma_start_m * sigma_start_m);
  filter.initialize(prior);
  for (int step = 0; step < 3; ++step) {
    std::vector<ImuSample> samples;
    for (int k = 0; k <= 20; ++k) {
      ImuSample sample;
      sample.t_ns = (20 * step + k) * std::int64_t{5'000'000};
      sample.gyro_rad_per_s = {0.1, 0., 0.5};
      sample.accel_m_per_s2 = {0.3, 0.1, 9.8};
      samples.push_back(sample);
    }
    filter.propagate(samples);
    filter.clone(samples.back());
  }
  return filter;
}

/// How far the second clone is from the first, or, absolute, where it is.
ResidualFactor position_factor(const Filter& filter, bool absolute, const Eigen::Vector3d& r,
                               double sigma_m) {
  ResidualFactor factor;
  const int from = factor.columns.add(filter.clones()[0].column, 6);
  const int to = factor.columns.add(filter.clones()[1].column, 6);
  factor.set_rows(3);
  factor.H.block<3, 3>(0, to + 3).setIdentity();
  if (!absolute) factor.H.block<3, 3>(0, from + 3) = -Eigen::Matrix3d::Identity();
  factor.residual = r;
  factor.R = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  return factor;
}

TEST(SharedPosition, ChangesNothingOfWhatRelativeMeasurementsDo) {
  Filter near = on_its_way(10.), far = on_its_way(10e3);
  for (Filter* filter : {&near, &far}) {
    for (int k = 0; k < 100; ++k) {
      const Eigen::Vector3d r(1e-4 * std::sin(k), 1e-4 * std::cos(k), 0.);
      ASSERT_EQ(filter->apply(position_factor(*filter, false, r, 1e-4)), FactorResult::kApplied);
    }
  }
  EXPECT_EQ(near.covariance(), far.covariance());
  EXPECT_EQ(near.imu().p_IinG, far.imu().p_IinG);
  EXPECT_NEAR(near.imu_covariance()(kPositionColumn, kPositionColumn), 100., 1e-3);
  EXPECT_NEAR(far.imu_covariance()(kPositionColumn, kPositionColumn), 1e8, 1e-3);
}

/// Of a point that has been eliminated rows are left that would be zero.
TEST(SharedPosition, IsNotSeenInTheRoundingOfRelativeMeasurements) {
  Filter near = on_its_way(10.), far = on_its_way(10e3);
  for (Filter* filter : {&near, &far}) {
    InformationFactor factor;
    factor.columns.add(filter->clones()[0].column, 6);
    factor.columns.add(filter->clones()[1].column, 6);
    factor.Lambda = Eigen::MatrixXd::Zero(filter->size(), filter->size());
    factor.eta = Eigen::VectorXd::Zero(filter->size());
    const Eigen::Matrix3d information = 1e4 * Eigen::Matrix3d::Identity();
    factor.Lambda.block<3, 3>(3, 3) = factor.Lambda.block<3, 3>(9, 9) = information;
    factor.Lambda.block<3, 3>(9, 3) = -information;
    factor.Lambda(3, 0) = factor.Lambda(10, 6) = 1.16e-10;
    factor.eta[3] = 1.;
    factor.eta[9] = -1.;
    ASSERT_EQ(filter->apply(factor), FactorResult::kApplied);
  }
  EXPECT_EQ(near.covariance(), far.covariance());
}

TEST(SharedPosition, IsFoundByAFix) {
  Filter filter = on_its_way(10e3);
  const Eigen::Vector3d off(4000., -7000., 300.);
  const Eigen::Vector3d before = filter.imu().p_IinG;
  ASSERT_EQ(filter.apply(position_factor(filter, true, off, kAbsolute_m)), FactorResult::kApplied);
  EXPECT_LT((filter.imu().p_IinG - before - off).norm(), 1e-3);
  for (int i = 0; i < 3; ++i) {
    const double variance = filter.imu_covariance()(kPositionColumn + i, kPositionColumn + i);
    EXPECT_NEAR(variance, kAbsolute_m * kAbsolute_m, 1e-3);
  }
}

TEST(SharedPosition, IsFoundByNormalEquationsOfAFix) {
  Filter filter = on_its_way(10e3);
  InformationFactor factor;
  factor.columns.add(filter.clones()[1].column, 6);
  factor.Lambda = Eigen::MatrixXd::Zero(filter.size(), filter.size());
  factor.eta = Eigen::VectorXd::Zero(filter.size());
  factor.Lambda.block<3, 3>(3, 3).setIdentity();
  factor.eta[3] = 4000.;
  const double before = filter.imu().p_IinG.x();
  ASSERT_EQ(filter.apply(factor), FactorResult::kApplied);
  EXPECT_NEAR(filter.imu().p_IinG.x() - before, 4000., 1e-2);
}

TEST(SharedPosition, IsLeftWhereItIsWhereItIsSmall) {
  const Filter filter = on_its_way(5.);
  EXPECT_EQ(filter.imu_covariance(),
            (filter.covariance().topLeftCorner<kImuSize, kImuSize>().eval()));
}

}  // namespace
}  // namespace viwo
