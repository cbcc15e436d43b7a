// Layout of the error state, what the filter refuses, and when it cannot go on.
#include <limits>
#include <stdexcept>
#include <string>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/filter.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace testing;

std::string refusal(const FilterOptions& options, const CameraPrior& camera,
                    const WheelsPrior& wheels) {
  try {
    Filter filter(options, {camera}, {wheels});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "(accepted)";
}

TEST(Filter, LaysOutInertialStateClonesCamerasAndWheels) {
  const Filter filter = make_filter();
  EXPECT_EQ(filter.size(), kSize);
  EXPECT_EQ(filter.cameras()[0].extrinsics_column, kCameraExtrinsics);
  EXPECT_EQ(filter.cameras()[0].intrinsics_column, kCameraIntrinsics);
  EXPECT_EQ(filter.wheels()[0].extrinsics_column, kWheelsExtrinsics);
  EXPECT_EQ(filter.wheels()[0].time_offset_column, kTimeOffset);
  EXPECT_EQ(filter.wheels()[0].intrinsics_column, kIntrinsics);
  VectorXd sigma = VectorXd::Zero(kSize);
  sigma.segment<6>(kCameraExtrinsics) = camera_prior().sigma_extrinsics;
  sigma.segment<8>(kCameraIntrinsics) = camera_prior().sigma_intrinsics;
  sigma.segment<6>(kWheelsExtrinsics) = wheels_prior().sigma_extrinsics;
  sigma[kTimeOffset] = wheels_prior().sigma_time_offset_s;
  sigma.segment<3>(kIntrinsics) = wheels_prior().sigma_intrinsics;
  const MatrixXd expected = sigma.cwiseAbs2().asDiagonal();
  EXPECT_EQ(filter.covariance(), expected);
  EXPECT_FALSE(filter.initialized());
  EXPECT_EQ(filter.view(-1).wheels, nullptr);
  EXPECT_EQ(filter.view(0).wheels, &filter.wheels()[0]);
  EXPECT_EQ(filter.view(0).P(), filter.covariance());
}

TEST(Filter, GivesNoColumnsToWhatIsHeld) {
  CameraPrior camera = camera_prior();
  camera.sigma_extrinsics.setZero();
  WheelsPrior wheels = wheels_prior();
  wheels.sigma_time_offset_s = 0.;
  wheels.sigma_extrinsics.setZero();
  const Filter filter(kOptions, {camera}, {wheels});
  EXPECT_EQ(filter.size(), kSize - 13);
  EXPECT_EQ(filter.cameras()[0].extrinsics_column, -1);
  EXPECT_EQ(filter.cameras()[0].intrinsics_column, kCameraExtrinsics);
  EXPECT_EQ(filter.wheels()[0].extrinsics_column, -1);
  EXPECT_EQ(filter.wheels()[0].time_offset_column, -1);
  EXPECT_EQ(filter.wheels()[0].intrinsics_column, kCameraExtrinsics + 8);
}

TEST(Filter, RefusesPriorsAndSizesThatMakeNoSense) {
  EXPECT_EQ(refusal(kOptions, camera_prior(), wheels_prior()), "(accepted)");
  const std::string bad_sigma = "a prior sigma is negative or not finite";
  for (const double value : {-1e-9, kNaN, std::numeric_limits<double>::infinity()}) {
    CameraPrior camera = camera_prior();
    camera.sigma_extrinsics[5] = value;
    EXPECT_EQ(refusal(kOptions, camera, wheels_prior()), bad_sigma);
    camera = camera_prior();
    camera.sigma_intrinsics[7] = value;
    EXPECT_EQ(refusal(kOptions, camera, wheels_prior()), bad_sigma);
    WheelsPrior wheels = wheels_prior();
    wheels.sigma_extrinsics[0] = value;
    EXPECT_EQ(refusal(kOptions, camera_prior(), wheels), bad_sigma);
    wheels = wheels_prior();
    wheels.sigma_time_offset_s = value;
    EXPECT_EQ(refusal(kOptions, camera_prior(), wheels), bad_sigma);
    wheels = wheels_prior();
    wheels.sigma_intrinsics[1] = value;
    EXPECT_EQ(refusal(kOptions, camera_prior(), wheels), bad_sigma);
  }
  WheelsPrior wheels = wheels_prior();
  wheels.sigma_intrinsics.conservativeResize(2);
  EXPECT_EQ(refusal(kOptions, camera_prior(), wheels),
            "each intrinsic of a wheel set needs a prior sigma");
  for (const int clones : {-1, 0, 1, 101}) {
    FilterOptions options;
    options.clones = clones;
    EXPECT_EQ(refusal(options, camera_prior(), wheels_prior()),
              "the number of clones must be within 2 .. 100");
  }
}

TEST(Filter, FactorThatIsNotFiniteIsRejectedAndChangesNothing) {
  Random random(9);
  Filter filter = running_filter(random, 2);
  const MatrixXd P = filter.covariance();
  const Vector3d p = filter.imu().p_IinG;
  for (int part = 0; part < 3; ++part) {
    for (const double gate : {0., 0.01}) {
      ResidualFactor factor = random_factor(random);
      factor.gate_probability = gate;
      (part == 0 ? factor.H(1, 2) : part == 1 ? factor.residual[3] : factor.R(2, 2)) = kNaN;
      EXPECT_EQ(filter.apply(factor), FactorResult::kRejected) << part;
    }
  }
  EXPECT_EQ(filter.covariance(), P);
  EXPECT_EQ(filter.imu().p_IinG, p);
}

TEST(Filter, SaysWhyItCannotGoOn) {
  const std::string not_finite = "the estimate or its covariance is not finite any more";
  {
    ImuPrior prior = testing::level_prior(0);
    Filter filter = make_filter();
    filter.initialize(prior);
    EXPECT_EQ(filter.failure(), "");
    prior.state.accel_bias[1] = kNaN;
    filter.initialize(prior);
    EXPECT_EQ(filter.failure(), not_finite);
    prior = testing::level_prior(0);
    prior.P(4, 4) = kNaN;
    filter.initialize(prior);
    EXPECT_EQ(filter.failure(), not_finite);
    prior.P(4, 4) = -1e-3;
    filter.initialize(prior);
    EXPECT_EQ(filter.failure(), "a variance is negative");
  }
  {
    ImuPrior prior = testing::level_prior(0, 1.);
    prior.P(0, 1) = prior.P(1, 0) = 2.;
    Filter filter = make_filter();
    filter.initialize(prior);
    EXPECT_EQ(filter.failure(), "");  // not yet seen
    InformationFactor factor;
    factor.columns.add(0, 3);
    factor.Lambda = Matrix3d::Identity();
    factor.eta = Vector3d::Zero();
    EXPECT_EQ(filter.apply(factor), FactorResult::kFailed);
    EXPECT_EQ(filter.failure(), "the covariance of the clones is not positive definite any more");
  }
}

TEST(Filter, CalibrationOfTheWheelsThatOverflowsEndsTheRun) {
  for (const int column : {kWheelsExtrinsics + 3, kTimeOffset, kIntrinsics}) {
    WheelsPrior wheels = wheels_prior();
    wheels.sigma_extrinsics.tail<3>().setConstant(1e10);
    wheels.sigma_time_offset_s = 1e10;
    wheels.sigma_intrinsics[0] = 1e10;
    Filter filter(kOptions, {camera_prior()}, {wheels});
    filter.initialize(testing::level_prior(0));
    ResidualFactor factor = observation(column, VectorXd::Constant(1, 1e305), 1.);
    factor.H(0, 0) = 1e-5;  // a gain of 1e5
    ASSERT_EQ(filter.apply(factor), FactorResult::kApplied);
    EXPECT_EQ(filter.failure(), "the calibration of the wheels is not finite any more") << column;
  }
}

}  // namespace
}  // namespace viwo
