#include "viwo/start/standstill_start.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "start_frame.hpp"
#include "still_tracks.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Means of a window, whose readings come in equal steps or nearly so, and what is known of them.
struct Means {
  Vector3d mean = Vector3d::Zero();
  double scatter = 0.;                        ///< variance of a reading, mean of the axes
  Vector3d variance = Vector3d::Zero();       ///< of the mean, by the means of kBatches batches
  Vector3d halves_differ = Vector3d::Zero();  ///< in their own sigmas
};

/// (F-33). A vibration is no white noise, but means over a tenth of the window are independent
/// unless it is slower than that; then they differ all the more.
constexpr int kBatches = 10;

template <class Get>
Means means_of(std::span<const ImuSample> samples, double density, const Get& get) {
  Means m;
  const auto n = static_cast<Eigen::Index>(samples.size());
  const auto reading = [&](Eigen::Index i) {
    return to_vector(get(samples[static_cast<std::size_t>(i)]));
  };
  for (Eigen::Index i = 0; i < n; ++i) m.mean += reading(i) / static_cast<double>(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    m.scatter += (reading(i) - m.mean).squaredNorm() / (3. * static_cast<double>(n - 1));
  }
  Eigen::Matrix<double, 3, kBatches> batches;
  for (Eigen::Index b = 0; b < kBatches; ++b) {
    const Eigen::Index first = b * n / kBatches, last = (b + 1) * n / kBatches;
    Vector3d sum = Vector3d::Zero();
    for (Eigen::Index i = first; i < last; ++i) sum += reading(i);
    batches.col(b) = sum / static_cast<double>(last - first);
  }
  const auto squares = [](const auto& part) -> Vector3d {
    return (part.colwise() - part.rowwise().mean()).rowwise().squaredNorm();
  };
  // Student's t of 9 degrees of freedom has the variance 9/7.
  m.variance = squares(batches) / (7. * kBatches);
  const auto first = batches.leftCols<kBatches / 2>(), second = batches.rightCols<kBatches / 2>();
  const Vector3d difference = second.rowwise().mean() - first.rowwise().mean();
  // Readings may be coarse: their scatter is not taken for less than the noise.
  const double span_s = seconds_between(samples.front().t_ns, samples.back().t_ns);
  const Vector3d of_difference = ((squares(first) + squares(second)) * (4. / (kBatches * 8.)))
                                     .cwiseMax(4. * squared(density) / span_s);
  m.halves_differ = difference.cwiseAbs().cwiseQuotient(of_difference.cwiseSqrt());
  return m;
}

/// What a vibration has moved the base by at an instant: mean square of an axis of the integral of
/// the readings, less its own mean.
template <class Get>
double mean_square_of_integral(std::span<const ImuSample> samples, const Vector3d& mean,
                               const Get& get) {
  Vector3d integral = Vector3d::Zero(), sum = Vector3d::Zero();
  double squares = 0.;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double dt = seconds_between(samples[i - 1].t_ns, samples[i].t_ns);
    integral += dt * (0.5 * (to_vector(get(samples[i - 1])) + to_vector(get(samples[i]))) - mean);
    sum += integral;
    squares += integral.squaredNorm();
  }
  const auto n = static_cast<double>(samples.size());
  return (squares / n - (sum / n).squaredNorm()) / 3.;
}

enum class Wheels : std::uint8_t { kSilent, kStand, kTurn };

/// Whether wheels turn faster than encoder noise and resolution explain, in the window that ends at
/// `end_ns`; those of which the last samples are older say nothing.
Wheels wheels_of(std::span<const std::span<const EncoderSample>> encoders,
                 std::span<const double> t_OtoI_s, std::int64_t end_ns, double window_s) {
  constexpr double kWheelStillRadPerS = 0.05, kMaxLate_s = 0.25;
  Wheels wheels = Wheels::kSilent;
  for (std::size_t set = 0; set < encoders.size(); ++set) {
    const auto& samples = encoders[set];
    const std::int64_t clock_ns = set < t_OtoI_s.size() ? to_ns(t_OtoI_s[set]) : 0;
    if (samples.empty()) continue;
    const std::int64_t last_ns = std::max(samples.back().t_ns, samples.back().end_ns) + clock_ns;
    if (seconds_between(last_ns, end_ns) > kMaxLate_s) continue;
    for (auto s = samples.rbegin(); s != samples.rend(); ++s) {
      if (seconds_between(s->t_ns, samples.back().t_ns) > window_s) break;
      for (int i = 0; i < s->n_drive; ++i) {
        if (std::abs(s->drive_rad_per_s[static_cast<std::size_t>(i)]) > kWheelStillRadPerS)
          return Wheels::kTurn;
      }
      const bool is_whole = seconds_between(s->t_ns, samples.back().t_ns) > 0.5 * window_s;
      if (is_whole && s->n_drive > 0) wheels = Wheels::kStand;
    }
  }
  return wheels;
}

constexpr auto kGyroOf = [](const ImuSample& s) { return s.gyro_rad_per_s; };
constexpr auto kAccelOf = [](const ImuSample& s) { return s.accel_m_per_s2; };

/// What of the readings is no rest, or nothing; vibration is one only where `strict`.
std::string_view not_at_rest(const Means& gyro, const Means& accel, double dt, bool strict,
                             const StandstillOptions& options) {
  constexpr double kVibration = 9.;  // three times the noise of the data sheet
  if (strict && gyro.scatter > kVibration * squared(options.noise.gyro_rad_per_s_sqrt_hz) / dt) {
    return "the gyro's readings scatter by more than three times their noise";
  }
  if (strict && accel.scatter > kVibration * squared(options.noise.accel_m_per_s2_sqrt_hz) / dt) {
    return "the accelerometer's readings scatter by more than three times their noise";
  }
  // Vibration makes means uncertain; who says that it is one is not in doubt about the rest.
  const auto sigma = [strict](double of_bias, const Means& means) {
    return strict ? of_bias : std::sqrt(squared(of_bias) + means.variance.maxCoeff());
  };
  if (gyro.mean.cwiseAbs().maxCoeff() > 3. * sigma(options.sigma_gyro_bias_rad_per_s, gyro)) {
    return "the mean rate of the gyro is beyond three sigma of its bias";
  }
  const double gravity_off = std::abs(accel.mean.norm() - options.gravity_m_per_s2);
  if (gravity_off > 4. * sigma(options.sigma_accel_bias_m_per_s2, accel)) {
    return "the mean specific force is not gravity within four sigma of its bias";
  }
  // A start of a motion; Student's t of 8 degrees of freedom is beyond with a probability of 0.001.
  constexpr double kHalves = 5.;
  if (gyro.halves_differ.maxCoeff() > kHalves || accel.halves_differ.maxCoeff() > kHalves) {
    return "the readings of the two halves of the window differ";
  }
  return {};
}

/// Errors at the start (F-10): accel.mean = R_GtoI g e3 + ba + noise. The accelerometer bias is
/// taken as zero, so that tilt and bias err together: dtheta = [z]x (ba + noise) / g. The noise is
/// also the walk of the biases: their means over the window are not their values at its end.
ImuMatrix covariance_at_rest(std::span<const ImuSample> window, const Means& gyro,
                             const Means& accel, const Vector3d& z,
                             const StandstillOptions& options) {
  const double span_s = seconds_between(window.front().t_ns, window.back().t_ns);
  const double dt = span_s / static_cast<double>(window.size() - 1);
  const ImuNoise& noise = options.noise;
  // Beyond chance (eight sigma with 200 readings) the means are as uncertain as they show (F-33).
  constexpr double kChance = 1.5;
  const auto variance_of_mean = [&](const Means& means, double density, double walk) {
    Vector3d variance = Vector3d::Constant(squared(density) / span_s);
    if (means.scatter > kChance * squared(density) / dt)
      variance = variance.cwiseMax(means.variance);
    return Vector3d(variance.array() + squared(walk) * span_s / 3.);
  };
  const Vector3d gyro_variance =
      variance_of_mean(gyro, noise.gyro_rad_per_s_sqrt_hz, noise.gyro_walk_rad_per_s2_sqrt_hz);
  const Vector3d accel_variance =
      variance_of_mean(accel, noise.accel_m_per_s2_sqrt_hz, noise.accel_walk_m_per_s3_sqrt_hz);
  const double bias_variance = squared(options.sigma_accel_bias_m_per_s2);
  const Matrix3d tilt = skew(z) / options.gravity_m_per_s2;
  const Vector3d specific_force_variance = accel_variance.array() + bias_variance;

  ImuMatrix P = ImuMatrix::Zero();
  P.block<3, 3>(kThetaColumn, kThetaColumn) =
      tilt * specific_force_variance.asDiagonal() * tilt.transpose() +
      squared(options.sigma_yaw_rad) * z * z.transpose();
  P.block<3, 3>(kThetaColumn, kAccelBiasColumn) = bias_variance * tilt;
  P.block<3, 3>(kAccelBiasColumn, kThetaColumn) = bias_variance * tilt.transpose();
  P.diagonal().segment<3>(kAccelBiasColumn).setConstant(bias_variance);
  P.diagonal().segment<3>(kPositionColumn).setConstant(squared(options.sigma_position_m));
  // At rest within what a second of noise could hide.
  P.diagonal().segment<3>(kVelocityColumn).setConstant(squared(0.01));
  P.diagonal().segment<3>(kGyroBiasColumn) = gyro_variance;
  if (gyro.scatter > kChance * squared(noise.gyro_rad_per_s_sqrt_hz) / dt) {
    P.diagonal().segment<3>(kThetaColumn).array() +=
        mean_square_of_integral(window, gyro.mean, kGyroOf);
  }
  if (accel.scatter > kChance * squared(noise.accel_m_per_s2_sqrt_hz) / dt) {
    P.diagonal().segment<3>(kVelocityColumn).array() +=
        mean_square_of_integral(window, accel.mean, kAccelOf);
  }
  return P;
}

}  // namespace

StartAttempt start_from_standstill(std::span<const ImuSample> imu,
                                   std::span<const std::span<const EncoderSample>> encoders,
                                   const StandstillOptions& options,
                                   std::span<const FeatureSample> tracks) {
  constexpr std::string_view kTooShort = "fewer IMU samples than start_window_s asks for";
  // One attempt comes up to 55 ms after the other: the next one would be behind the window.
  const double whole_s = options.window_s - std::min(0.055, 0.055 * options.window_s);
  if (imu.size() < 2 * kBatches) return no_start(kTooShort);
  std::size_t first = imu.size() - 1;
  while (first > 0 && seconds_between(imu[first].t_ns, imu.back().t_ns) < options.window_s) --first;
  const double span_s = seconds_between(imu[first].t_ns, imu.back().t_ns);
  if (span_s < whole_s) return no_start(kTooShort);
  const auto window = imu.subspan(first);
  if (window.size() < 2 * kBatches) return no_start(kTooShort);

  const Wheels wheels = wheels_of(encoders, options.t_OtoI_s, window.back().t_ns, span_s);
  if (wheels == Wheels::kTurn) return no_start("a wheel turns faster than 0.05 rad/s");
  const Stillness images =
      stillness_of(tracks, options.t_CtoI_s, window.front().t_ns, window.back().t_ns);
  if (images == Stillness::kMoved) return no_start("the images move");
  if (images == Stillness::kTooEarly) return no_start("the images do not reach back far enough");
  const bool strict = wheels != Wheels::kStand && images != Stillness::kStill;
  const double dt = span_s / static_cast<double>(window.size() - 1);
  const Means gyro = means_of(window, options.noise.gyro_rad_per_s_sqrt_hz, kGyroOf);
  const Means accel = means_of(window, options.noise.accel_m_per_s2_sqrt_hz, kAccelOf);
  const std::string_view obstacle = not_at_rest(gyro, accel, dt, strict, options);
  if (!obstacle.empty()) return no_start(obstacle);

  ImuPrior prior;
  prior.t_ns = window.back().t_ns;
  const Vector3d z = accel.mean.normalized();  // R_GtoI z = direction of the specific force
  prior.state.R_GtoI = R_GtoI_from_up(z);
  prior.state.gyro_bias = gyro.mean;
  prior.P = covariance_at_rest(window, gyro, accel, z, options);
  return {prior, {}};
}

}  // namespace viwo
