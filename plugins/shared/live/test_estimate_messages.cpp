// The estimate as messages of ROS, against numerical derivatives of what the messages mean.
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "estimate_messages.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::live {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix9d = Eigen::Matrix<double, 9, 9, Eigen::RowMajor>;

/// What the filter estimates.
struct Motion {
  Eigen::Matrix3d R_GtoI;
  Eigen::Vector3d p_IinG, v_IinG, w_IinI;
};

/// As conventions.md has the errors.
Motion perturbed(const Motion& estimate, const Eigen::Matrix<double, 9, 1>& d,
                 const Eigen::Vector3d& dw) {
  return {exp_so3(-d.head<3>()) * estimate.R_GtoI, estimate.p_IinG + d.segment<3>(3),
          estimate.v_IinG + d.tail<3>(), estimate.w_IinI + dw};
}

/// The body: its pose in G, and how a point fixed to it moves, by rigid bodies and nothing else.
struct Body {
  Eigen::Matrix3d R_BtoG;
  Eigen::Vector3d p_BinG, v_inB, w_inB;
};

Body body_of(const Motion& motion, const OutputFrames& frames) {
  Body body;
  const Eigen::Matrix3d R_ItoG = motion.R_GtoI.transpose();
  body.R_BtoG = R_ItoG * frames.R_ItoB.transpose();
  const Eigen::Vector3d p_BinI = -frames.R_ItoB.transpose() * frames.p_IinB;
  body.p_BinG = motion.p_IinG + R_ItoG * p_BinI;
  const Eigen::Vector3d v_BinG = motion.v_IinG + R_ItoG * motion.w_IinI.cross(p_BinI);
  body.v_inB = body.R_BtoG.transpose() * v_BinG;
  body.w_inB = frames.R_ItoB * motion.w_IinI;
  return body;
}

class EstimateMessages : public ::testing::Test {
 protected:
  void SetUp() override {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    const auto vector = [&](double scale) {
      return Eigen::Vector3d(scale * normal(random), scale * normal(random),
                             scale * normal(random));
    };
    motion_ = {exp_so3(vector(1.)), vector(3.), vector(1.), vector(0.7)};
    frames_.R_ItoB = exp_so3(vector(1.));
    frames_.p_IinB = vector(0.3);
    Matrix9d root;
    for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = 0.1 * normal(random);
    P_ = root * root.transpose();

    estimate_.t_ns = 1'700'000'000'123'456'789;
    const Eigen::Quaterniond q_ItoG(Eigen::Matrix3d(motion_.R_GtoI.transpose()));
    estimate_.q_ItoG_xyzw = {q_ItoG.x(), q_ItoG.y(), q_ItoG.z(), q_ItoG.w()};
    Eigen::Vector3d::Map(estimate_.p_IinG_m.data()) = motion_.p_IinG;
    Eigen::Vector3d::Map(estimate_.v_IinG_m_per_s.data()) = motion_.v_IinG;
    Eigen::Vector3d::Map(estimate_.w_IinI_rad_per_s.data()) = motion_.w_IinI;
    Eigen::Map<Matrix9d>(estimate_.covariance.data()) = P_;
  }

  /// Derivatives of [dp, phi; dv, dw] of the body by [dtheta, dp, dv, dw] of the filter.
  Eigen::Matrix<double, 12, 12> numerical_jacobian() const {
    const Body body = body_of(motion_, frames_);
    Eigen::Matrix<double, 12, 12> J;
    constexpr double kStep = 1e-5;
    for (int i = 0; i < 12; ++i) {
      Eigen::Matrix<double, 12, 1> difference;
      difference.setZero();
      for (const double sign : {1., -1.}) {
        Eigen::Matrix<double, 12, 1> d = Eigen::Matrix<double, 12, 1>::Zero();
        d[i] = sign * kStep;
        const Body other = body_of(perturbed(motion_, d.head<9>(), d.tail<3>()), frames_);
        Eigen::Matrix<double, 12, 1> error;
        // ROS: rotations about fixed axes of the parent frame, R = Exp(phi) R_hat.
        error << other.p_BinG - body.p_BinG, log_so3(other.R_BtoG * body.R_BtoG.transpose()),
            other.v_inB - body.v_inB, other.w_inB - body.w_inB;
        difference += sign * error;
      }
      J.col(i) = difference / (2. * kStep);
    }
    return J;
  }

  Motion motion_;
  OutputFrames frames_{"odom", "base_link", {}, {}};
  Matrix9d P_;
  EstimateSample estimate_;
};

TEST_F(EstimateMessages, OdometryHasThePoseAndTheTwistOfTheBody) {
  const Odometry message = odometry_of(estimate_, frames_, 0.01);
  const Body body = body_of(motion_, frames_);
  EXPECT_EQ(message.pose.t_ns, 1'700'000'000'123'456'789);
  EXPECT_EQ(message.world, "odom");
  EXPECT_EQ(message.body, "base_link");
  EXPECT_LT((to_vector(message.pose.p_BinG_m) - body.p_BinG).norm(), 1e-12);
  const Eigen::Quaterniond q_BtoG = to_quaternion(message.pose.q_BtoG_xyzw);
  EXPECT_LT((q_BtoG.toRotationMatrix() - body.R_BtoG).norm(), 1e-12);
  EXPECT_LT((to_vector(message.v_BinB_m_per_s) - body.v_inB).norm(), 1e-12);
  EXPECT_LT((to_vector(message.w_BinB_rad_per_s) - body.w_inB).norm(), 1e-12);
}

TEST_F(EstimateMessages, CovariancesAreThoseOfNumericalDerivatives) {
  constexpr double kSigmaRate = 0.2;
  const Odometry message = odometry_of(estimate_, frames_, kSigmaRate);
  const Eigen::Matrix<double, 12, 12> J = numerical_jacobian();
  Eigen::Matrix<double, 12, 12> P = Eigen::Matrix<double, 12, 12>::Zero();
  P.topLeftCorner<9, 9>() = P_;
  P.bottomRightCorner<3, 3>() = kSigmaRate * kSigmaRate * Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, 12, 12> expected = J * P * J.transpose();
  const Matrix6d pose = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(
      message.pose_covariance.data());
  const Matrix6d twist = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(
      message.twist_covariance.data());
  EXPECT_LT((pose - expected.topLeftCorner<6, 6>()).norm(), 1e-8 * expected.norm()) << pose;
  EXPECT_LT((twist - expected.bottomRightCorner<6, 6>()).norm(), 1e-8 * expected.norm()) << twist;
  EXPECT_EQ(pose, Matrix6d(pose.transpose()));
  EXPECT_EQ(twist, Matrix6d(twist.transpose()));
}

TEST_F(EstimateMessages, OfTheImuItselfTheCovarianceIsTurnedIntoTheWorld) {
  // An error about one axis of I shows about that axis as it stands in G.
  const OutputFrames imu;
  estimate_.covariance = {};
  estimate_.covariance[0] = 0.04;  // dtheta_x
  const Odometry message = odometry_of(estimate_, imu, 0.);
  const Eigen::Vector3d x_IinG = motion_.R_GtoI.transpose().col(0);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(message.pose_covariance[static_cast<std::size_t>(6 * (3 + i) + 3 + j)],
                  0.04 * x_IinG[i] * x_IinG[j], 1e-15);
      EXPECT_EQ(message.pose_covariance[static_cast<std::size_t>(6 * i + j)], 0.);
    }
  }
}

std::string value_of(const Diagnostics& message, const std::string& wanted) {
  for (const auto& [key, value] : message.values) {
    if (key == wanted) return value;
  }
  return "nothing of " + wanted;
}

TEST_F(EstimateMessages, DiagnosticsTellLatencyAndCalibration) {
  estimate_.latency_s = 0.025;
  estimate_.calibration_names = {"r_1", "t_OtoI"};
  estimate_.calibration = {0.0255, 0.005};
  estimate_.calibration_sigma = {1e-4, 2e-4};
  estimate_.covariance = {};
  for (const std::size_t i : {30U, 40U, 50U}) estimate_.covariance[i] = 0.03;  // position
  const Diagnostics message = diagnostics_of(estimate_, {});
  EXPECT_EQ(message.t_ns, estimate_.t_ns);
  EXPECT_FALSE(message.warns);
  EXPECT_EQ(message.message, "ok");
  EXPECT_EQ(value_of(message, "latency_s"), "0.025");
  EXPECT_EQ(value_of(message, "r_1"), "0.0255");
  EXPECT_EQ(value_of(message, "sigma r_1"), "1e-04");
  EXPECT_EQ(value_of(message, "sigma t_OtoI"), "2e-04");
  EXPECT_EQ(value_of(message, "sigma position [m]"), "0.3");
  EXPECT_EQ(value_of(message, "sigma velocity [m/s]"), "0");
  estimate_.latency_s = std::numeric_limits<double>::quiet_NaN();  // without cameras
  EXPECT_EQ(value_of(diagnostics_of(estimate_, {}), "latency_s"), "nothing of latency_s");
}

TEST_F(EstimateMessages, DiagnosticsWarnOfWhatIsOff) {
  estimate_.latency_s = 0.3;
  Health health;
  health.silent_topics = {"/imu0", "/cam0/image_raw"};
  health.rejected = 3;
  Diagnostics message = diagnostics_of(estimate_, health);
  EXPECT_TRUE(message.warns);
  EXPECT_EQ(message.message,
            "latency 0.3 s; nothing on topic '/imu0'; nothing on topic '/cam0/image_raw'");
  EXPECT_EQ(value_of(message, "rejections"), "3");
  estimate_.latency_s = 0.2;
  estimate_.covariance[7] = std::numeric_limits<double>::quiet_NaN();
  message = diagnostics_of(estimate_, {});
  EXPECT_TRUE(message.warns);
  EXPECT_EQ(message.message, "the estimate is not finite");
  estimate_.covariance[7] = 0.;
  estimate_.piece = 2;
  estimate_.warnings = {"imu0: no samples since t = 5.000 s", "drive 2 left out"};
  message = diagnostics_of(estimate_, {});
  EXPECT_TRUE(message.warns);
  EXPECT_EQ(message.message, "imu0: no samples since t = 5.000 s; drive 2 left out");
  EXPECT_EQ(value_of(message, "started anew"), "2");
}

TEST(Path, HasAPoseEachHalfSecondAndTheLastOfThem) {
  Path path;
  constexpr std::int64_t kStep = 100'000'000;
  for (std::int64_t k = 0; k < 11'000; ++k) {
    EXPECT_EQ(path.add({k * kStep, {}, {}}, 0), k % 5 == 0) << k;
  }
  ASSERT_EQ(path.poses().size(), Path::kMost);
  EXPECT_EQ(path.poses().back().t_ns, 10'995 * kStep);
  EXPECT_EQ(path.poses().front().t_ns, (10'995 - 5 * 1999) * kStep);
  EXPECT_TRUE(path.add({0, {}, {}}, 1)) << "another piece";
  EXPECT_EQ(path.poses().size(), 1U);
}

}  // namespace
}  // namespace viwo::live
