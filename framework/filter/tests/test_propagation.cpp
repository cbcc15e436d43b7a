// Propagation against fine integration, central differences and the null space it must keep.
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/filter/propagation.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Vector3d rate(double t) { return {0.4 * std::sin(2. * t), 0.3 * std::cos(3. * t), 0.7 + 0.2 * t}; }
Vector3d force(double t) {
  return {1.5 * std::sin(4. * t), -0.8 * std::cos(2. * t), 9.6 + 0.5 * std::sin(3. * t)};
}

std::vector<ImuSample> samples(double duration_s, double dt) {
  std::vector<ImuSample> all;
  for (int i = 0; i * dt <= duration_s + 1e-9; ++i) {
    ImuSample sample;
    sample.t_ns = std::llround(i * dt * 1e9);
    for (std::size_t k = 0; k < 3; ++k) {
      sample.gyro_rad_per_s[k] = rate(i * dt)[static_cast<Eigen::Index>(k)];
      sample.accel_m_per_s2[k] = force(i * dt)[static_cast<Eigen::Index>(k)];
    }
    all.push_back(sample);
  }
  return all;
}

ImuState start() {
  ImuState imu;
  imu.R_GtoI = exp_so3({0.1, -0.2, 0.9});
  imu.p_IinG = {1., -2., 0.5};
  imu.v_IinG = {0.3, 0.2, -0.1};
  imu.gyro_bias = {0.01, -0.02, 0.03};
  imu.accel_bias = {-0.05, 0.02, 0.04};
  imu.R_GtoI_fej = imu.R_GtoI;
  imu.p_IinG_fej = imu.p_IinG;
  imu.v_IinG_fej = imu.v_IinG;
  return imu;
}

/// The error state of `to` relative to `from`.
VectorXd minus(const ImuState& to, const ImuState& from) {
  VectorXd d(kImuSize);
  d << -log_so3(to.R_GtoI * from.R_GtoI.transpose()), to.p_IinG - from.p_IinG,
      to.v_IinG - from.v_IinG, to.gyro_bias - from.gyro_bias, to.accel_bias - from.accel_bias;
  return d;
}

ImuState plus(ImuState imu, const VectorXd& d) {
  imu.R_GtoI = exp_so3(-d.segment<3>(0)) * imu.R_GtoI;
  imu.p_IinG += d.segment<3>(3);
  imu.v_IinG += d.segment<3>(6);
  imu.gyro_bias += d.segment<3>(9);
  imu.accel_bias += d.segment<3>(12);
  return imu;
}

TEST(Propagation, FollowsAFineIntegrationOfTheMotion) {
  // Midpoint rule with a step of 2 microseconds on the continuous signals.
  ImuState fine = start();
  const int steps = 50000;
  const double h = 0.1 / steps;
  Matrix3d R = fine.R_GtoI.transpose();
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) * h;
    const Matrix3d middle = R * exp_so3(0.5 * h * (rate(t) - fine.gyro_bias));
    const Vector3d a = middle * (force(t) - fine.accel_bias) + Vector3d(0., 0., -9.81);
    fine.p_IinG += h * fine.v_IinG + 0.5 * h * h * a;
    fine.v_IinG += h * a;
    R = R * exp_so3(h * (rate(t) - fine.gyro_bias));
  }
  fine.R_GtoI = R.transpose();
  ImuState imu = start();
  propagate(samples(0.1, 0.005), {}, 9.81, imu);
  const VectorXd error = minus(imu, fine);
  // What is left is that the readings are taken as linear between samples.
  EXPECT_LT(error.segment<3>(0).norm(), 2e-6);
  EXPECT_LT(error.segment<3>(3).norm(), 2e-6);
  EXPECT_LT(error.segment<3>(6).norm(), 3e-5);
}

TEST(Propagation, TransitionAgreesWithCentralDifferences) {
  const auto all = samples(0.1, 0.005);
  ImuState imu = start();
  const ImuTransition transition = propagate(all, {}, 9.81, imu);
  const auto moved = [&](const VectorXd& d) -> VectorXd {
    ImuState other = plus(start(), d);
    propagate(all, {}, 9.81, other);
    return minus(other, imu);
  };
  const auto numeric = testing::central_difference(moved, VectorXd::Zero(kImuSize), 1e-5);
  // The effect of biases is taken as constant in direction over one IMU step.
  EXPECT_EQ(testing::jacobian_mismatch(transition.Phi, numeric, {}, 2e-5), "");
}

TEST(Propagation, FirstEstimatesKeepYawAndPositionUnobservable) {
  const auto all = samples(0.1, 0.005);
  ImuState imu = start();
  // The estimate was corrected after it was first used.
  VectorXd correction = VectorXd::LinSpaced(kImuSize, -0.02, 0.03);
  imu = plus(imu, correction);
  const auto null_space = [](const ImuState& at) {
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(kImuSize, 4);
    const Vector3d up = Vector3d::UnitZ();
    N.block<3, 1>(0, 0) = at.R_GtoI_fej * up;
    N.block<3, 1>(3, 0) = -skew(at.p_IinG_fej) * up;
    N.block<3, 1>(6, 0) = -skew(at.v_IinG_fej) * up;
    N.block<3, 3>(3, 1).setIdentity();
    return N;
  };
  const Eigen::MatrixXd before = null_space(imu);
  ImuState corrected = imu;
  const ImuTransition transition = propagate(all, {}, 9.81, imu);
  EXPECT_LT((transition.Phi * before - null_space(imu)).norm(), 1e-12);
  // Without first estimates the same product misses by the correction.
  corrected.R_GtoI_fej = corrected.R_GtoI;
  corrected.p_IinG_fej = corrected.p_IinG;
  corrected.v_IinG_fej = corrected.v_IinG;
  const ImuTransition usual = propagate(all, {}, 9.81, corrected);
  EXPECT_GT((usual.Phi * before - null_space(corrected)).norm(), 1e-3);
}

TEST(Propagation, NoiseAgreesWithALinearIntegrationOnFinerSteps) {
  const ImuNoise noise{2e-3, 3e-2, 1e-3, 2e-2};
  ImuState imu = start();
  const ImuTransition transition = propagate(samples(0.1, 0.005), noise, 9.81, imu);
  // dP/dt = F P + P F^T + G Qc G^T by Euler steps of the readings sampled a hundred times finer.
  const auto fine = samples(0.1, 0.00005);
  ImuState at = start();
  ImuMatrix P = ImuMatrix::Zero();
  for (std::size_t i = 0; i + 1 < fine.size(); ++i) {
    const double h = seconds_between(fine[i].t_ns, fine[i + 1].t_ns);
    const Vector3d w =
        Vector3d(fine[i].gyro_rad_per_s[0], fine[i].gyro_rad_per_s[1], fine[i].gyro_rad_per_s[2]) -
        at.gyro_bias;
    const Vector3d a =
        Vector3d(fine[i].accel_m_per_s2[0], fine[i].accel_m_per_s2[1], fine[i].accel_m_per_s2[2]) -
        at.accel_bias;
    ImuMatrix F = ImuMatrix::Zero();
    F.block<3, 3>(0, 0) = -skew(w);
    F.block<3, 3>(0, 9) = -Matrix3d::Identity();
    F.block<3, 3>(3, 6).setIdentity();
    F.block<3, 3>(6, 0) = -at.R_GtoI.transpose() * skew(a);
    F.block<3, 3>(6, 12) = -at.R_GtoI.transpose();
    P += h * (F * P + P * F.transpose());
    P.diagonal().segment<3>(0).array() += 4e-6 * h;
    P.diagonal().segment<3>(6).array() += 9e-4 * h;
    P.diagonal().segment<3>(9).array() += 1e-6 * h;
    P.diagonal().segment<3>(12).array() += 4e-4 * h;
    propagate(std::span(fine).subspan(i, 2), noise, 9.81, at);
  }
  const VectorXd sigma = P.diagonal().cwiseSqrt();
  for (int i = 0; i < kImuSize; ++i) {
    for (int j = 0; j < kImuSize; ++j) {
      EXPECT_NEAR(transition.Q(i, j), P(i, j), 5e-3 * sigma[i] * sigma[j]) << i << ", " << j;
    }
  }
}

TEST(Propagation, InterpolatesReadingsLinearly) {
  const auto all = samples(0.01, 0.005);
  const ImuSample middle = interpolate(all[0], all[1], 1'250'000);
  EXPECT_EQ(middle.t_ns, 1'250'000);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_DOUBLE_EQ(middle.gyro_rad_per_s[k],
                     0.75 * all[0].gyro_rad_per_s[k] + 0.25 * all[1].gyro_rad_per_s[k]);
  }
}

TEST(Propagation, KnowsLittleOfAGapHoweverItIsCut) {
  const double T = 2.;
  for (const double step_s : {2., 0.1}) {
    const auto all = samples(T, step_s);
    std::vector<double> gaps_s(all.size(), T);
    ImuState imu = start(), same = start();
    const ImuTransition without = propagate(all, {}, 9.81, same);
    const ImuTransition with = propagate(all, {}, 9.81, imu, gaps_s);
    EXPECT_EQ(imu.p_IinG, same.p_IinG);
    // White noise of this size over T is an angle of 0.5 rad/s T and a velocity of 2 m/s^2 T.
    const ImuMatrix more = with.Q - without.Q;
    EXPECT_NEAR(more(kThetaColumn, kThetaColumn), 0.25 * T * T, 1e-9);
    // What the turn makes of gravity and motion comes on top.
    EXPECT_GT(more(kVelocityColumn, kVelocityColumn), 4. * T * T * (1. - 1e-9));
    EXPECT_GT(more(kPositionColumn, kPositionColumn), 4. * T * T * T * T / 3. * (1. - 1e-9));
    EXPECT_NEAR(more.diagonal().tail<6>().norm(), 0., 1e-12);
  }
}

}  // namespace
}  // namespace viwo
