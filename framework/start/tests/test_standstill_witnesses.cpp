// The start from a rest under vibration: what images and wheels say, and what is left of certainty.
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/math/so3.hpp"
#include "viwo/start/standstill_start.hpp"

namespace viwo::witnesses {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kGravity = 9.81;
constexpr double kRateHz = 200.;
constexpr std::int64_t kBeginNs = 5'000'000'000;
constexpr std::string_view kGyroScatters =
    "the gyro's readings scatter by more than three times their noise";
constexpr std::string_view kAccelScatters =
    "the accelerometer's readings scatter by more than three times their noise";

/// Coloured noise as of idling rotors: it is forgotten within 3 ms.
class Vibration {
 public:
  Vibration(double sigma, std::mt19937_64& engine) : sigma_(sigma), engine_(engine) {}
  Vector3d next() {
    const double keep = std::exp(-1. / (kRateHz * 0.003));
    for (int i = 0; i < 3; ++i) {
      state_[i] = keep * state_[i] + std::sqrt(1. - keep * keep) * sigma_ * normal_(engine_);
    }
    return state_;
  }

 private:
  double sigma_;
  std::mt19937_64& engine_;
  std::normal_distribution<double> normal_;
  Vector3d state_ = Vector3d::Zero();
};

struct Shaken {
  double accel_m_per_s2 = 0., gyro_rad_per_s = 0.;
  Vector3d turned_at_the_end = Vector3d::Zero();  ///< rate of the last 0.5 s, rad/s
};

/// 1.2 s of a base at rest.
struct Rest {
  Rest(unsigned seed, const Shaken& shaken, const StandstillOptions& options = {}) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    const auto normal3 = [&]() -> Vector3d {
      return {normal(engine), normal(engine), normal(engine)};
    };
    R_GtoI = exp_so3(normal3());
    accel_bias = options.sigma_accel_bias_m_per_s2 * normal3();
    gyro_bias = 0.5 * options.sigma_gyro_bias_rad_per_s * normal3();
    Vibration accel(shaken.accel_m_per_s2, engine), gyro(shaken.gyro_rad_per_s, engine);
    const double root = std::sqrt(kRateHz);
    for (int i = 0; i <= 240; ++i) {
      const Vector3d force = R_GtoI.col(2) * kGravity + accel_bias + accel.next() +
                             options.noise.accel_m_per_s2_sqrt_hz * root * normal3();
      Vector3d rate =
          gyro_bias + gyro.next() + options.noise.gyro_rad_per_s_sqrt_hz * root * normal3();
      if (i > 140) rate += shaken.turned_at_the_end;
      imu.push_back({kBeginNs + std::int64_t{5'000'000} * i,
                     {rate.x(), rate.y(), rate.z()},
                     {force.x(), force.y(), force.z()}});
    }
  }
  Matrix3d R_GtoI;
  Vector3d accel_bias, gyro_bias;
  std::vector<ImuSample> imu;
};

/// Images every 50 ms until the end of a rest, of points that err and move.
struct Seen {
  double first_s = 0.;
  double px_per_s = 0.;  ///< the further from the middle the faster: straight on
  double sigma_px = 0.3;
  double sway_px = 0.;  ///< all of them, there and back again in 1 s
  int n_points = 60;
  double late_s = 0.;  ///< of the camera's clock
};
std::vector<FeatureSample> tracks(const Seen& seen) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> place(-1., 1.);
  std::vector<Vector2d> points;
  for (int i = 0; i < seen.n_points; ++i) points.emplace_back(place(engine), place(engine));
  std::vector<FeatureSample> images;
  for (double t = seen.first_s; t < 1.2; t += 0.05) {
    FeatureSample& image = images.emplace_back();
    image.t_ns = kBeginNs + std::llround(1e9 * (t + seen.late_s));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector2d uv = points[i] * (300. + seen.px_per_s * t);
      const double sway = seen.sway_px * std::sin(2. * M_PI * t);
      image.points.push_back({static_cast<std::int64_t>(i),
                              400. + uv.x() + sway + seen.sigma_px * normal(engine),
                              300. + uv.y() + seen.sigma_px * normal(engine)});
    }
  }
  return images;
}

const Shaken kShaken{.accel_m_per_s2 = 0.5, .gyro_rad_per_s = 0.03};

std::string_view obstacle(const Shaken& shaken, const std::vector<FeatureSample>& images,
                          const std::vector<EncoderSample>& wheels = {},
                          const StandstillOptions& options = {}) {
  const Rest rest(11, shaken, options);
  const std::array<std::span<const EncoderSample>, 1> encoders{wheels};
  return start_from_standstill(rest.imu, encoders, options, images).obstacle;
}

TEST(StandstillWitnesses, VibrationIsNoMotionWhereImagesStandStill) {
  EXPECT_EQ(obstacle(kShaken, {}), kGyroScatters);
  EXPECT_EQ(obstacle({.accel_m_per_s2 = 0.5}, {}), kAccelScatters);
  EXPECT_EQ(obstacle(kShaken, tracks({})), "");
  EXPECT_EQ(obstacle(kShaken, tracks({.sigma_px = 1.})), "");
  EXPECT_EQ(obstacle(kShaken, tracks({.first_s = 0.6})), "") << "half of the window";
  EXPECT_EQ(obstacle(kShaken, tracks({.n_points = 9})), kGyroScatters) << "too few to tell";
}

TEST(StandstillWitnesses, VibrationIsNoMotionWhereWheelsStand) {
  std::vector<EncoderSample> wheels(110);
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    wheels[i].t_ns = kBeginNs + static_cast<std::int64_t>(i) * 10'000'000;
    wheels[i].n_drive = 2;
  }
  EXPECT_EQ(obstacle(kShaken, {}, wheels), "");
  EXPECT_EQ(obstacle(kShaken, tracks({.px_per_s = 20.}), wheels), "the images move") << "carried";
  // Those that have fallen silent since do not know.
  std::vector<EncoderSample> silent = wheels;
  for (EncoderSample& sample : silent) sample.t_ns -= 2'000'000'000;
  EXPECT_EQ(obstacle(kShaken, {}, silent), kGyroScatters);
  StandstillOptions late_clock;
  late_clock.t_OtoI_s = {2.};
  EXPECT_EQ(obstacle(kShaken, {}, silent, late_clock), "");
  const std::vector<EncoderSample> late(wheels.begin() + 80, wheels.end());
  EXPECT_EQ(obstacle(kShaken, {}, late), kGyroScatters) << "0.3 s of wheels";
  wheels[60].drive_rad_per_s[1] = 0.2;
  EXPECT_EQ(obstacle(kShaken, tracks({}), wheels), "a wheel turns faster than 0.05 rad/s");
}

TEST(StandstillWitnesses, ARobotThatFliesStraightOnAtAConstantSpeedIsNotAtRest) {
  EXPECT_EQ(obstacle({}, {}), "") << "as its IMU alone would have it";
  EXPECT_EQ(obstacle({}, tracks({.px_per_s = 5.})), "the images move");
  EXPECT_EQ(obstacle({}, tracks({.px_per_s = 200.})), "the images move");
  EXPECT_EQ(obstacle({}, tracks({.sway_px = 2.})), "the images move") << "back at the end";
}

TEST(StandstillWitnesses, ImagesThatHaveJustBegunAreWaitedFor) {
  EXPECT_EQ(obstacle({}, tracks({.first_s = 0.9})), "the images do not reach back far enough");
}

TEST(StandstillWitnesses, ImagesAreTakenByTheClockOfTheImu) {
  const Seen late{.first_s = 0.3, .late_s = 2.};
  EXPECT_EQ(obstacle(kShaken, tracks(late)), kGyroScatters) << "as if they were yet to come";
  StandstillOptions options;
  options.t_CtoI_s = {-2.};
  EXPECT_EQ(obstacle(kShaken, tracks(late), {}, options), "");
}

TEST(StandstillWitnesses, HalvesOfTheWindowMustAgree) {
  // Half of the rate of a motion that has begun would be taken for a bias.
  EXPECT_EQ(obstacle({.turned_at_the_end = {0., 0.01, 0.}}, {}),
            "the readings of the two halves of the window differ");
  EXPECT_EQ(obstacle({.turned_at_the_end = {0., 2e-4, 0.}}, {}), "");
}

/// Mean over rests of the squares of numbers that should have the variance 1 (per axis).
struct MeanSquares {
  double of_covariance = 0.;  ///< with the covariance of the start
  double of_white = 0.;       ///< with that of white noise as the data sheet has it
  int n = 0;
};

/// Whether a mean square of `n` numbers is that of a start that is honest: each is an error over a
/// sigma from the 10 batches, Student's t of 9 degrees of freedom divided by its own sigma, whose
/// square has the variance 162 * 8 / (49 * 5) * (7 / 9)^2 = 3.2. Two-sided, 99.9 %.
bool is_honest(double mean_square, int n) {
  return std::abs(mean_square - 1.) < 3.29 * std::sqrt(3.2 / n);
}

TEST(StandstillWitnesses, KnowsTheSpecificForceAsWellAsVibrationLetsIt) {
  const StandstillOptions options;
  MeanSquares squares;
  for (unsigned seed = 0; seed < 400; ++seed) {
    const Rest rest(seed, {.accel_m_per_s2 = 0.5}, options);
    const auto prior = start_from_standstill(rest.imu, {}, options, tracks({})).prior;
    if (!prior) continue;
    // g [z]x dtheta + (I - z z^T) ba: what is left of the specific force across the vertical.
    const Vector3d z = prior->state.R_GtoI.col(2);
    const Vector3d axis = z.cross(rest.R_GtoI.col(2));
    const Vector3d dtheta = -axis * (std::asin(axis.norm()) / axis.norm());
    for (const Vector3d& across : {z.unitOrthogonal(), Vector3d(z.cross(z.unitOrthogonal()))}) {
      Eigen::Matrix<double, 1, kImuSize> S = Eigen::Matrix<double, 1, kImuSize>::Zero();
      S.segment<3>(kThetaColumn) = kGravity * across.transpose() * skew(z);
      S.segment<3>(kAccelBiasColumn) = across.transpose();
      const double error = kGravity * across.dot(z.cross(dtheta)) + across.dot(rest.accel_bias);
      const double density = options.noise.accel_m_per_s2_sqrt_hz;
      squares.of_covariance += error * error / (S * prior->P * S.transpose()).value();
      squares.of_white += error * error / (density * density);
      ++squares.n;
    }
  }
  ASSERT_GT(squares.n, 2 * 390);
  EXPECT_TRUE(is_honest(squares.of_covariance / squares.n, squares.n))
      << squares.of_covariance / squares.n;
  EXPECT_FALSE(is_honest(squares.of_white / squares.n, squares.n));
}

TEST(StandstillWitnesses, KnowsTheGyrosBiasAsWellAsVibrationLetsIt) {
  const StandstillOptions options;
  MeanSquares squares;
  for (unsigned seed = 0; seed < 400; ++seed) {
    const Rest rest(seed, {.gyro_rad_per_s = 0.03}, options);
    const auto prior = start_from_standstill(rest.imu, {}, options, tracks({})).prior;
    if (!prior) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const double error = rest.gyro_bias[axis] - prior->state.gyro_bias[axis];
      const double density = options.noise.gyro_rad_per_s_sqrt_hz;
      squares.of_covariance +=
          error * error / prior->P(kGyroBiasColumn + axis, kGyroBiasColumn + axis);
      squares.of_white += error * error / (density * density);
      ++squares.n;
    }
  }
  ASSERT_GT(squares.n, 3 * 370);
  EXPECT_TRUE(is_honest(squares.of_covariance / squares.n, squares.n))
      << squares.of_covariance / squares.n;
  EXPECT_FALSE(is_honest(squares.of_white / squares.n, squares.n));
}

TEST(StandstillWitnesses, IsNotSureOfAVelocityThatVibrationHas) {
  // A sway of 3 Hz and 1 m/s^2 is one of 53 mm/s.
  Rest rest(5, {});
  for (std::size_t i = 0; i < rest.imu.size(); ++i) {
    const double t = static_cast<double>(i) / kRateHz;
    rest.imu[i].accel_m_per_s2[0] += std::sin(2. * M_PI * 3. * t);
  }
  const auto attempt = start_from_standstill(rest.imu, {}, {}, tracks({.sigma_px = 0.2}));
  ASSERT_TRUE(attempt.prior) << attempt.obstacle;
  const double sway = 1. / (2. * M_PI * 3.) / std::sqrt(2.) / std::sqrt(3.);  // of each axis
  EXPECT_NEAR(std::sqrt(attempt.prior->P(kVelocityColumn, kVelocityColumn)), std::hypot(sway, 0.01),
              0.002);
}

}  // namespace
}  // namespace viwo::witnesses
