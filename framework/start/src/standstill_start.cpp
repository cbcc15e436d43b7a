#include "viwo/start/standstill_start.hpp"

#include <cmath>
#include <string_view>

#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Moments {
  Vector3d mean = Vector3d::Zero();
  double variance = 0.;  ///< of one axis, their mean
};

template <class Get>
Moments moments(std::span<const ImuSample> samples, const Get& get) {
  Moments m;
  const double n = static_cast<double>(samples.size());
  for (const ImuSample& sample : samples) m.mean += to_vector(get(sample)) / n;
  for (const ImuSample& sample : samples) {
    m.variance += (to_vector(get(sample)) - m.mean).squaredNorm() / (3. * (n - 1.));
  }
  return m;
}

/// Wheels that turn faster than encoder noise and resolution explain.
bool wheels_turn(std::span<const std::span<const EncoderSample>> encoders, double window_s) {
  constexpr double kWheelStillRadPerS = 0.05;
  for (const auto& samples : encoders) {
    for (auto s = samples.rbegin(); s != samples.rend(); ++s) {
      if (seconds_between(s->t_ns, samples.back().t_ns) > window_s) break;
      for (int i = 0; i < s->n_drive; ++i) {
        if (std::abs(s->drive_rad_per_s[static_cast<std::size_t>(i)]) > kWheelStillRadPerS)
          return true;
      }
    }
  }
  return false;
}

}  // namespace

StartAttempt start_from_standstill(std::span<const ImuSample> imu,
                                   std::span<const std::span<const EncoderSample>> encoders,
                                   const StandstillOptions& options) {
  constexpr std::string_view kTooShort = "fewer IMU samples than start_window_s asks for";
  if (imu.size() < 20) return no_start(kTooShort);
  std::size_t first = imu.size() - 1;
  while (first > 0 && seconds_between(imu[first].t_ns, imu.back().t_ns) < options.window_s) --first;
  const double span_s = seconds_between(imu[first].t_ns, imu.back().t_ns);
  if (span_s < options.window_s) return no_start(kTooShort);
  const auto window = imu.subspan(first);
  const double dt = span_s / static_cast<double>(window.size() - 1);
  const Moments gyro = moments(window, [](const ImuSample& s) { return s.gyro_rad_per_s; });
  const Moments accel = moments(window, [](const ImuSample& s) { return s.accel_m_per_s2; });
  const auto squared = [](double x) { return x * x; };
  constexpr double kVibration = 9.;  // three times the noise of the data sheet
  const double gyro_variance = squared(options.noise.gyro_rad_per_s_sqrt_hz) / dt;
  const double accel_variance = squared(options.noise.accel_m_per_s2_sqrt_hz) / dt;
  const double gravity_off = std::abs(accel.mean.norm() - options.gravity_m_per_s2);
  if (wheels_turn(encoders, span_s)) return no_start("a wheel turns faster than 0.05 rad/s");
  if (gyro.variance > kVibration * gyro_variance) {
    return no_start("the gyro's readings scatter by more than three times their noise");
  }
  if (accel.variance > kVibration * accel_variance) {
    return no_start("the accelerometer's readings scatter by more than three times their noise");
  }
  if (gyro.mean.cwiseAbs().maxCoeff() > 3. * options.sigma_gyro_bias_rad_per_s) {
    return no_start("the mean rate of the gyro is beyond three sigma of its bias");
  }
  if (gravity_off > 4. * options.sigma_accel_bias_m_per_s2) {
    return no_start("the mean specific force is not gravity within four sigma of its bias");
  }

  ImuPrior prior;
  prior.t_ns = window.back().t_ns;
  // R_GtoI z = direction of the specific force; yaw zero: the x axis of G lies in I's x-z plane.
  const Vector3d z = accel.mean.normalized();
  const Vector3d reference = std::abs(z.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d x = (reference - z * z.dot(reference)).normalized();
  prior.state.R_GtoI << x, z.cross(x), z;
  prior.state.gyro_bias = gyro.mean;

  // Errors at the start (F-10): accel.mean = R_GtoI g e3 + ba + noise. The accelerometer bias is
  // taken as zero, so that tilt and bias err together: dtheta = [z]x (ba + noise) / g. The noise
  // is also the walk of the biases: their means over the window are not their values at its end.
  const double bias_variance = squared(options.sigma_accel_bias_m_per_s2);
  const auto noise_of_mean = [&](double density, double walk) {
    return squared(density) / span_s + squared(walk) * span_s / 3.;
  };
  const double noise_variance = noise_of_mean(options.noise.accel_m_per_s2_sqrt_hz,
                                              options.noise.accel_walk_m_per_s3_sqrt_hz);
  const Matrix3d tilt = skew(z) / options.gravity_m_per_s2;
  ImuMatrix& P = prior.P;
  P.block<3, 3>(kThetaColumn, kThetaColumn) =
      (bias_variance + noise_variance) * tilt * tilt.transpose() +
      squared(options.sigma_yaw_rad) * z * z.transpose();
  P.block<3, 3>(kThetaColumn, kAccelBiasColumn) = bias_variance * tilt;
  P.block<3, 3>(kAccelBiasColumn, kThetaColumn) = bias_variance * tilt.transpose();
  P.diagonal().segment<3>(kAccelBiasColumn).setConstant(bias_variance);
  P.diagonal().segment<3>(kPositionColumn).setConstant(squared(options.sigma_position_m));
  // At rest within what a second of noise could hide.
  P.diagonal().segment<3>(kVelocityColumn).setConstant(squared(0.01));
  P.diagonal()
      .segment<3>(kGyroBiasColumn)
      .setConstant(noise_of_mean(options.noise.gyro_rad_per_s_sqrt_hz,
                                 options.noise.gyro_walk_rad_per_s2_sqrt_hz));
  return {prior, {}};
}

}  // namespace viwo
