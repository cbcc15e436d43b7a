// The start from a rest: consistent with its covariance, and refused when nothing stands still.
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/start/standstill_start.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  Vector3d vector3() {
    return Vector3d::NullaryExpr([this] { return normal_(engine_); });
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

constexpr double kRateHz = 200.;
constexpr double kGravity = 9.81;

/// A base at rest for a while: what its IMU reads, and the truth at the end.
struct Rest {
  Matrix3d R_GtoI;
  Vector3d gyro_bias, accel_bias;
  std::vector<ImuSample> imu;
};

struct RestOptions {
  double duration_s = 1.2;
  Vector3d rate = Vector3d::Zero();          ///< of a turning base, rad/s
  Vector3d acceleration = Vector3d::Zero();  ///< of a base that speeds up, m/s^2 in G
  double vibration_gyro = 0., vibration_accel = 0.;
  double bias_scale = 1.;
};

void put(const Vector3d& from, std::array<double, 3>& to) {
  for (std::size_t i = 0; i < 3; ++i) to[i] = from[static_cast<Eigen::Index>(i)];
}

Rest make_rest(const StandstillOptions& prior, Random& random, const RestOptions& options = {}) {
  Rest rest;
  rest.R_GtoI = exp_so3(random.vector3());
  rest.gyro_bias = options.bias_scale * prior.sigma_gyro_bias_rad_per_s * random.vector3();
  // Beyond three sigma a bias is taken for a motion.
  rest.gyro_bias = rest.gyro_bias.cwiseMax(-0.05).cwiseMin(0.05);
  rest.accel_bias = options.bias_scale * prior.sigma_accel_bias_m_per_s2 * random.vector3();
  const double root_rate = std::sqrt(kRateHz);
  const int n = static_cast<int>(options.duration_s * kRateHz) + 1;
  for (int i = 0; i < n; ++i) {
    ImuSample& sample = rest.imu.emplace_back();
    sample.t_ns = 5'000'000'000 + std::int64_t{5'000'000} * i;
    if (i > 0) {
      rest.gyro_bias += prior.noise.gyro_walk_rad_per_s2_sqrt_hz / root_rate * random.vector3();
      rest.accel_bias += prior.noise.accel_walk_m_per_s3_sqrt_hz / root_rate * random.vector3();
    }
    const Vector3d gyro = rest.gyro_bias + options.rate +
                          prior.noise.gyro_rad_per_s_sqrt_hz * root_rate * random.vector3() +
                          options.vibration_gyro * random.vector3();
    const Vector3d force = Vector3d(0., 0., kGravity) + options.acceleration;
    const Vector3d accel = rest.R_GtoI * force + rest.accel_bias +
                           prior.noise.accel_m_per_s2_sqrt_hz * root_rate * random.vector3() +
                           options.vibration_accel * random.vector3();
    put(gyro, sample.gyro_rad_per_s);
    put(accel, sample.accel_m_per_s2);
  }
  return rest;
}

/// Tilt (about two axes across the vertical) and accelerometer bias, then gyro bias: their errors
/// and covariance. The yaw is a matter of definition.
struct StartError {
  VectorXd error{8};
  MatrixXd P;
};
StartError start_error(const Rest& rest, const ImuPrior& prior) {
  const Vector3d z = prior.state.R_GtoI.col(2);
  const Vector3d a = z.unitOrthogonal(), b = z.cross(a);
  // R = Exp(-dtheta) R_hat with an arbitrary yaw of the truth: the smallest turn that takes the
  // vertical onto the true one.
  const Vector3d true_z = rest.R_GtoI.col(2);
  const Vector3d axis = z.cross(true_z);
  const Vector3d turn = axis * (axis.norm() > 0. ? std::asin(axis.norm()) / axis.norm() : 1.);
  const Vector3d dtheta = -turn;
  MatrixXd S = MatrixXd::Zero(8, kImuSize);
  S.block<1, 3>(0, kThetaColumn) = a.transpose();
  S.block<1, 3>(1, kThetaColumn) = b.transpose();
  S.block<3, 3>(2, kAccelBiasColumn).setIdentity();
  S.block<3, 3>(5, kGyroBiasColumn).setIdentity();
  StartError result;
  result.error << a.dot(dtheta), b.dot(dtheta), rest.accel_bias - prior.state.accel_bias,
      rest.gyro_bias - prior.state.gyro_bias;
  result.P = S * prior.P * S.transpose();
  return result;
}

double nees(const VectorXd& error, const MatrixXd& P) { return error.dot(P.llt().solve(error)); }

/// Mean NEES over `runs` of tilt with accelerometer bias (5), and of the gyro bias (3).
struct MeanNees {
  double tilt_and_accel_bias = 0.;
  double gyro_bias = 0.;
};
constexpr int kRuns = 500;

/// `correlation` multiplies the covariance of tilt and accelerometer bias.
MeanNees monte_carlo(double correlation) {
  Random random(21);
  const StandstillOptions options;
  MeanNees mean;
  int n = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Rest rest = make_rest(options, random);
    const auto prior = start_from_standstill(rest.imu, {}, options).prior;
    if (!prior) continue;
    StartError start = start_error(rest, *prior);
    start.P.block<2, 3>(0, 2) *= correlation;
    start.P.block<3, 2>(2, 0) *= correlation;
    mean.tilt_and_accel_bias += nees(start.error.head<5>(), start.P.topLeftCorner<5, 5>());
    mean.gyro_bias += nees(start.error.tail<3>(), start.P.bottomRightCorner<3, 3>());
    ++n;
  }
  EXPECT_GT(n, kRuns * 98 / 100);
  mean.tilt_and_accel_bias /= n;
  mean.gyro_bias /= n;
  return mean;
}

/// Whether the mean of `kRuns` chi-square numbers is within two-sided 99.9 % bounds.
bool consistent(double mean, int dof) {
  const double sum = mean * kRuns, total = dof * static_cast<double>(kRuns);
  return sum > chi2_quantile(0.0005, total) && sum < chi2_quantile(0.9995, total);
}

TEST(StandstillStart, IsConsistentWithItsCovariance) {
  const MeanNees mean = monte_carlo(1.);
  EXPECT_TRUE(consistent(mean.tilt_and_accel_bias, 5)) << mean.tilt_and_accel_bias;
  EXPECT_TRUE(consistent(mean.gyro_bias, 3)) << mean.gyro_bias;
}

// Without the correlation the mean would still be 5: then the filter is too unsure of the
// combination that the readings tell, not too sure of anything.
TEST(StandstillStart, ConsistencyCheckSeesAWrongSignOfTheCorrelation) {
  EXPECT_FALSE(consistent(monte_carlo(-1.).tilt_and_accel_bias, 5));
}

TEST(StandstillStart, KnowsTheCombinationOfTiltAndBiasAsWellAsTheReadingsTellIt) {
  // g [z]x dtheta + (I - z z^T) ba: what is left of the specific force across the vertical.
  Random random(25);
  const StandstillOptions options;
  double sum = 0.;
  int n = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Rest rest = make_rest(options, random);
    const auto prior = start_from_standstill(rest.imu, {}, options).prior;
    if (!prior) continue;
    const StartError start = start_error(rest, *prior);
    const Vector3d z = prior->state.R_GtoI.col(2);
    const Vector3d a = z.unitOrthogonal(), b = z.cross(a);
    MatrixXd S = MatrixXd::Zero(2, 8);  // z x a = b, z x b = -a
    S.row(0) << 0., -kGravity, a.transpose(), 0., 0., 0.;
    S.row(1) << kGravity, 0., b.transpose(), 0., 0., 0.;
    sum += nees(S * start.error, S * start.P * S.transpose());
    ++n;
  }
  // The tilt is not small (5 mrad), so the linear combination is off by about 1e-4 m/s^2.
  EXPECT_TRUE(consistent(sum / n, 2)) << sum / n;
}

TEST(StandstillStart, IsExactForReadingsWithoutNoiseAndBias) {
  Random random(22);
  StandstillOptions options;
  const Rest rest = make_rest(options, random, {.bias_scale = 0.});
  std::vector<ImuSample> imu = rest.imu;
  for (ImuSample& sample : imu) {
    sample.gyro_rad_per_s = {0.001, -0.002, 0.003};
    put(rest.R_GtoI.col(2) * kGravity, sample.accel_m_per_s2);
  }
  const auto prior = start_from_standstill(imu, {}, options).prior;
  ASSERT_TRUE(prior);
  EXPECT_EQ(prior->t_ns, imu.back().t_ns);
  EXPECT_LT((prior->state.R_GtoI.col(2) - rest.R_GtoI.col(2)).norm(), 1e-12);
  EXPECT_LT((prior->state.R_GtoI * prior->state.R_GtoI.transpose() - Matrix3d::Identity()).norm(),
            1e-12);
  EXPECT_NEAR(prior->state.R_GtoI.determinant(), 1., 1e-12);
  EXPECT_LT((prior->state.gyro_bias - Vector3d(0.001, -0.002, 0.003)).norm(), 1e-12);
  EXPECT_EQ(prior->state.accel_bias, Vector3d::Zero());
  EXPECT_EQ(prior->state.p_IinG, Vector3d::Zero());
  EXPECT_EQ(prior->state.v_IinG, Vector3d::Zero());
  EXPECT_GT(prior->P.llt().matrixL().toDenseMatrix().diagonal().minCoeff(), 0.);
  // The yaw has its own sigma, and nothing else turns about the vertical.
  const Vector3d z = prior->state.R_GtoI.col(2);
  EXPECT_NEAR(std::sqrt(z.dot(prior->P.topLeftCorner<3, 3>() * z)), options.sigma_yaw_rad, 1e-12);
}

TEST(StandstillStart, HasYawZeroWhicheverWayTheImuIsMounted) {
  for (const Vector3d& turn : {Vector3d(0., 0., 0.), Vector3d(0.1, -0.2, 0.), Vector3d(3., 0., 0.),
                               Vector3d(0., M_PI / 2., 0.), Vector3d(0., -M_PI / 2., 0.)}) {
    const Matrix3d R_GtoI = exp_so3(turn);
    std::vector<ImuSample> imu(250);
    for (std::size_t i = 0; i < imu.size(); ++i) {
      imu[i].t_ns = static_cast<std::int64_t>(i) * 5'000'000;
      put(R_GtoI.col(2) * kGravity, imu[i].accel_m_per_s2);
    }
    const auto prior = start_from_standstill(imu, {}, {}).prior;
    ASSERT_TRUE(prior) << turn.transpose();
    EXPECT_TRUE(prior->state.R_GtoI.allFinite());
    EXPECT_LT((prior->state.R_GtoI.col(2) - R_GtoI.col(2)).norm(), 1e-12);
    EXPECT_NEAR(prior->state.R_GtoI.determinant(), 1., 1e-12);
  }
}

/// What is in the way of a start; empty when there is one.
std::string_view obstacle(const RestOptions& rest_options,
                          const std::vector<std::vector<EncoderSample>>& encoders = {}) {
  Random random(23);
  const Rest rest = make_rest({}, random, rest_options);
  const std::vector<std::span<const EncoderSample>> sets(encoders.begin(), encoders.end());
  const StartAttempt attempt = start_from_standstill(rest.imu, sets, {});
  EXPECT_NE(attempt.prior.has_value(), !attempt.obstacle.empty());
  return attempt.obstacle;
}

bool starts(const RestOptions& rest_options,
            const std::vector<std::vector<EncoderSample>>& encoders = {}) {
  return obstacle(rest_options, encoders).empty();
}

TEST(StandstillStart, RefusesABaseThatMoves) {
  EXPECT_TRUE(starts({.bias_scale = 0.}));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_FALSE(starts({.rate = 0.065 * Vector3d::Unit(axis), .bias_scale = 0.}));
    EXPECT_FALSE(starts({.rate = -0.065 * Vector3d::Unit(axis), .bias_scale = 0.}));
    EXPECT_TRUE(starts({.rate = 0.055 * Vector3d::Unit(axis), .bias_scale = 0.}));
  }
  // What changes the magnitude of the specific force by more than 0.2 m/s^2.
  for (const Vector3d& acceleration : {Vector3d(0., 0., 0.3), Vector3d(0., 0., -0.3),
                                       Vector3d(3., 0., 0.), Vector3d(0., -3., 0.)}) {
    EXPECT_FALSE(starts({.acceleration = acceleration, .bias_scale = 0.}));
  }
  EXPECT_TRUE(starts({.acceleration = {0., 0., 0.1}, .bias_scale = 0.}));
}

TEST(StandstillStart, RefusesVibrationBeyondThreeTimesTheNoise) {
  const ImuNoise noise;
  const double gyro = noise.gyro_rad_per_s_sqrt_hz * std::sqrt(kRateHz);
  const double accel = noise.accel_m_per_s2_sqrt_hz * std::sqrt(kRateHz);
  // Together with the noise itself: sqrt(1 + 2.5^2) = 2.7 and sqrt(1 + 3.2^2) = 3.35 of it.
  EXPECT_TRUE(starts({.vibration_gyro = 2.5 * gyro, .bias_scale = 0.}));
  EXPECT_FALSE(starts({.vibration_gyro = 3.2 * gyro, .bias_scale = 0.}));
  EXPECT_TRUE(starts({.vibration_accel = 2.5 * accel, .bias_scale = 0.}));
  EXPECT_FALSE(starts({.vibration_accel = 3.2 * accel, .bias_scale = 0.}));
}

TEST(StandstillStart, RefusesWheelsThatTurnWithinTheWindow) {
  std::vector<EncoderSample> samples(150);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].t_ns = 4'710'000'000 + static_cast<std::int64_t>(i) * 10'000'000;
    samples[i].n_drive = 4;
  }
  EXPECT_TRUE(starts({.bias_scale = 0.}, {samples}));
  const auto with_rate = [&](std::size_t index, double rate, std::size_t channel = 3) {
    auto turning = samples;
    turning[index].drive_rad_per_s[channel] = rate;
    return starts({.bias_scale = 0.}, {samples, turning});
  };
  EXPECT_FALSE(with_rate(100, 0.06));
  EXPECT_FALSE(with_rate(149, -0.06));
  EXPECT_TRUE(with_rate(100, 0.04));
  EXPECT_TRUE(with_rate(10, 5.)) << "long before the window";
  EXPECT_TRUE(with_rate(100, 5., 4)) << "a channel that the base does not have";
}

TEST(StandstillStart, SaysWhatIsInItsWay) {
  EXPECT_EQ(obstacle({.duration_s = 0.9, .bias_scale = 0.}),
            "fewer IMU samples than start_window_s asks for");
  EXPECT_EQ(obstacle({.rate = {0., 0., 0.065}, .bias_scale = 0.}),
            "the mean rate of the gyro is beyond three sigma of its bias");
  EXPECT_EQ(obstacle({.acceleration = {0., 0., 0.3}, .bias_scale = 0.}),
            "the mean specific force is not gravity within four sigma of its bias");
  EXPECT_EQ(obstacle({.vibration_gyro = 1., .bias_scale = 0.}),
            "the gyro's readings scatter by more than three times their noise");
  EXPECT_EQ(obstacle({.vibration_accel = 1., .bias_scale = 0.}),
            "the accelerometer's readings scatter by more than three times their noise");
  std::vector<EncoderSample> turning(1);
  turning[0].t_ns = 6'200'000'000;
  turning[0].n_drive = 4;
  turning[0].drive_rad_per_s[2] = 1.;
  EXPECT_EQ(obstacle({.bias_scale = 0.}, {turning}), "a wheel turns faster than 0.05 rad/s");
}

TEST(StandstillStart, WaitsForAWholeWindow) {
  EXPECT_FALSE(starts({.duration_s = 0.9, .bias_scale = 0.}));
  EXPECT_TRUE(starts({.duration_s = 1.01, .bias_scale = 0.}));
  EXPECT_FALSE(start_from_standstill({}, {}, {}).prior.has_value());
}

TEST(StandstillStart, LooksAtTheLastWindowOnly) {
  Random random(24);
  Rest rest = make_rest({}, random, {.duration_s = 2., .bias_scale = 0.});
  for (std::size_t i = 0; i < 150; ++i) rest.imu[i].gyro_rad_per_s[0] = 3.;
  EXPECT_TRUE(start_from_standstill(rest.imu, {}, {}).prior.has_value());
}

}  // namespace
}  // namespace viwo
