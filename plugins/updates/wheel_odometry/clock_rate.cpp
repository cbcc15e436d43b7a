#include "clock_rate.hpp"

#include <array>

#include "viwo/api/measurement.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::wheel_odometry {
namespace {

/// Of the velocity of O after `duration_s` of the accelerometer, by its bias and the tilt.
Eigen::Vector2d variance_by_state(const Point& at, double duration_s, const FilterView& filter) {
  const Eigen::Vector3d gravity(0., 0., -filter.gravity_m_per_s2);
  Eigen::Matrix<double, 3, 6> J;
  J << at.mount.R_ItoO * skew(filter.imu.R_GtoI * gravity), -at.mount.R_ItoO;
  const FilterView::Covariance P = filter.P();
  Eigen::Matrix<double, 6, 6> P_state;
  const std::array<int, 2> columns = {kThetaColumn, kAccelBiasColumn};
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 2; ++k) {
      P_state.block<3, 3>(3 * i, 3 * k) =
          P.block<3, 3>(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(k)]);
    }
  }
  return square(duration_s) * (J * P_state * J.transpose()).diagonal().head<2>();
}

/// Turn of I over some readings of a gyro, the line through them: the noise of its slope has
/// nothing in common with that of its mean.
struct Line {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();  ///< rad/s^2
  double spread_s2 = 0.;  ///< sum of squares of the times of the readings, from their mean
};
Line line_through(std::span<const ImuSample> imu) {
  Line line;
  double mean_s = 0.;
  const double share = 1. / static_cast<double>(imu.size());
  for (const ImuSample& sample : imu) {
    mean_s += share * seconds_between(imu.front().t_ns, sample.t_ns);
    line.mean += share * to_vector(sample.gyro_rad_per_s);
  }
  for (const ImuSample& sample : imu) {
    const double t_s = seconds_between(imu.front().t_ns, sample.t_ns) - mean_s;
    line.slope += t_s * to_vector(sample.gyro_rad_per_s);
    line.spread_s2 += t_s * t_s;
  }
  if (line.spread_s2 > 0.) line.slope /= line.spread_s2;
  return line;
}

/// By the line through the readings of the gyro, and by what the accelerometer measured between the
/// clones. As good as unknown where the readings are not those of the interval, which is of more
/// than one epoch where encoders were late.
Rate rate_of_imu(const Point& at, double duration_s, const FilterView& filter,
                 std::span<const ImuSample> imu) {
  constexpr double kUnknown = 1e6, kNearlyAll = 0.9;
  const double epoch_s = imu.empty() ? 0. : seconds_between(imu.front().t_ns, imu.back().t_ns);
  Rate rate;
  rate.variance.setConstant(kUnknown);
  if (imu.size() < 2 || !(epoch_s > kNearlyAll * duration_s)) return rate;
  const Line line = line_through(imu);
  wheel_motion::MovingPose first = at.first, last = at.last;
  const Eigen::Vector3d mean = line.mean - filter.imu.gyro_bias;
  first.w_IinI = mean - 0.5 * duration_s * line.slope;
  last.w_IinI = mean + 0.5 * duration_s * line.slope;
  rate.g =
      wheel_motion::relative_pose_jacobian(first, last, at.mount).col(wheel_motion::kTimeOffset);
  const double per_s = static_cast<double>(imu.size() - 1) / epoch_s;
  const double turn =
      square(filter.imu_noise.gyro_rad_per_s_sqrt_hz * duration_s) * per_s / line.spread_s2;
  const double velocity = duration_s * square(filter.imu_noise.accel_m_per_s2_sqrt_hz);
  rate.variance << turn, variance_by_state(at, duration_s, filter);
  rate.variance.tail<2>().array() += velocity + at.mount.p_IinO.squaredNorm() * turn;
  return rate;
}

}  // namespace

Rate clock_rate(const WheelRate& wheels, const Point& at, const FilterView& filter,
                std::span<const ImuSample> imu) {
  Rate rate = rate_of_imu(at, wheels.duration_s, filter, imu);
  if (!wheels.g) return rate;
  // A third of the interval has three times the noise in its mean rate, and the ends are half as
  // far apart again as the means.
  const Eigen::Vector3d variance = 13.5 / square(wheels.duration_s) * wheels.variance_of_pose;
  for (int i = 0; i < 3; ++i) {
    const double sum = variance[i] + rate.variance[i];
    const double share = sum > 0. ? variance[i] / sum : 0.5;  // of the IMU
    rate.g[i] = share * rate.g[i] + (1. - share) * (*wheels.g)[i];
    rate.variance[i] *= share;
  }
  return rate;
}

}  // namespace viwo::wheel_odometry
