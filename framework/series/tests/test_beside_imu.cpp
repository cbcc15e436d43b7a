// What an IMU says of poses that go with it.
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/math/so3.hpp"
#include "viwo/series/beside_imu.hpp"

namespace viwo::series {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A hand that waves for a minute: exact IMU at 200 Hz, and poses at 20 Hz of a body on it.
struct Waving {
  Vector3d bias_gyro{0.02, -0.01, 0.03}, bias_accel{0.05, 0.1, -0.08};
  Matrix3d R_BtoI = exp_so3(Vector3d(0.02, -0.1, 0.05));
  Vector3d p_BinI{0.1, -0.05, 0.2};
  double t_BtoI_s = 0.004;
  Vector3d tilt = Vector3d::Zero();  ///< of the poses' world
  double sigma_rad = 0., sigma_m = 0.;
  std::vector<ImuSample> imu;
  Trajectory poses;

  static Matrix3d R_ItoG(double t) {
    return exp_so3(Vector3d(0.7 * std::sin(1.1 * t), 0.5 * std::sin(1.7 * t), 0.4 * t)) *
           exp_so3(Vector3d(0.3 * std::sin(2.3 * t), 0., 0.5 * std::sin(0.9 * t)));
  }
  static Vector3d p_IinG(double t) {
    return {std::sin(1.3 * t), 0.6 * std::cos(0.8 * t), 0.3 * std::sin(1.9 * t)};
  }

  void make() {
    constexpr double kStep = 1e-4;
    std::mt19937 random(3);
    std::normal_distribution<double> draw(0., 1.);
    const auto noise = [&] { return Vector3d(draw(random), draw(random), draw(random)); };
    for (std::int64_t i = 0; i <= 12'000; ++i) {
      const double t = 0.005 * static_cast<double>(i);
      const Vector3d rate =
          log_so3(R_ItoG(t - kStep).transpose() * R_ItoG(t + kStep)) / (2. * kStep);
      const Vector3d accel =
          (p_IinG(t + kStep) - 2. * p_IinG(t) + p_IinG(t - kStep)) / (kStep * kStep);
      const Vector3d w = rate + bias_gyro;
      const Vector3d f = R_ItoG(t).transpose() * (accel + Vector3d(0., 0., 9.81)) + bias_accel;
      imu.push_back({i * 5'000'000, {w.x(), w.y(), w.z()}, {f.x(), f.y(), f.z()}});
    }
    const Matrix3d R_GtoW = exp_so3(tilt);
    for (std::int64_t i = 2; i <= 1198; ++i) {
      const double t = 0.05 * static_cast<double>(i);
      const Matrix3d R = R_GtoW * R_ItoG(t);
      StampedPose pose;
      pose.t_ns = i * 50'000'000 - static_cast<std::int64_t>(std::lround(1e9 * t_BtoI_s));
      pose.p_BinW = R_GtoW * p_IinG(t) + R * p_BinI + sigma_m * noise();
      pose.q_BtoW = Eigen::Quaterniond(R * R_BtoI * exp_so3(sigma_rad * noise()));
      poses.push_back(pose);
    }
  }
};

TEST(BesideGyro, FindsBiasMountingAndClockOfGoodPosesAndNoNoise) {
  Waving hand;
  hand.make();
  const auto found = compare_with_gyro(hand.poses, hand.imu, Matrix3d::Identity());
  ASSERT_TRUE(found);
  EXPECT_LT(found->sigma_rad, 2e-4);
  EXPECT_LT((found->gyro_bias - hand.bias_gyro).norm(), 1e-4);
  EXPECT_LT(log_so3(found->R_BtoI.transpose() * hand.R_BtoI).norm(), 1e-3);
  EXPECT_NEAR(found->t_BtoI_s, hand.t_BtoI_s, 1e-4);
}

TEST(BesideGyro, TellsTheNoiseOfOrientations) {
  Waving hand;
  hand.sigma_rad = 0.004;
  hand.make();
  for (std::size_t i = 0; i < hand.poses.size(); i += 40) {  // one in forty is nonsense
    hand.poses[i].q_BtoW =
        Eigen::Quaterniond(exp_so3(Vector3d(0.1 * static_cast<double>(i), 1., 0.)));
  }
  const auto found = compare_with_gyro(hand.poses, hand.imu, Matrix3d::Identity());
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->sigma_rad, 0.004, 3e-4);
}

TEST(BesideGyro, SaysNothingOfTooFewPosesOrWithoutReadings) {
  Waving hand;
  hand.make();
  EXPECT_FALSE(compare_with_gyro({}, hand.imu, Matrix3d::Identity()));
  EXPECT_FALSE(compare_with_gyro(hand.poses, {}, Matrix3d::Identity()));
  hand.poses.resize(25);  // 1.2 s
  EXPECT_FALSE(compare_with_gyro(hand.poses, hand.imu, Matrix3d::Identity()));
}

TEST(FindVertical, FindsTheTiltOfTheWorldBesideTheBias) {
  for (const double tilt : {0., 0.0127}) {
    Waving hand;
    hand.tilt = tilt * Vector3d(0.6, -0.8, 0.);
    hand.sigma_rad = 0.002;
    hand.sigma_m = 0.002;
    hand.make();
    const auto gyro = compare_with_gyro(hand.poses, hand.imu, Matrix3d::Identity());
    ASSERT_TRUE(gyro);
    const auto found = find_vertical(hand.poses, hand.imu, *gyro, 0.1);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->tilt_rad, tilt, 3. * found->sigma_rad);
    EXPECT_LT(found->sigma_rad, 1e-3);
    EXPECT_GT(found->windows, 40U);
    EXPECT_NEAR(found->gravity_m_per_s2, 9.81, 0.1);
  }
}

TEST(FindVertical, KnowsThatABaseThatDoesNotTurnCannotTellTiltFromBias) {
  Waving hand;
  std::mt19937 random(5);
  std::normal_distribution<double> draw(0., 1e-3);
  for (std::int64_t i = 0; i <= 12'000; ++i) {
    hand.imu.push_back({i * 5'000'000, {0., 0., 0.}, {0.08, 0., 9.81}});
  }
  for (std::int64_t i = 0; i <= 1200; ++i) {
    hand.poses.push_back({i * 50'000'000, {draw(random), draw(random), 0.}, {}});
    hand.poses.back().q_BtoW.setIdentity();
  }
  const auto found = find_vertical(hand.poses, hand.imu, {}, 0.1);
  ASSERT_TRUE(found);
  EXPECT_GT(found->sigma_rad, 0.9 * 0.1 / 9.81);
}

}  // namespace
}  // namespace viwo::series
