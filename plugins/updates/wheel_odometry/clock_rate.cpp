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

/// How the turn of I changes, rad/s^2: the line through the readings of the gyro, whose slope has
/// no noise of their mean.
struct Slope {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  double spread_s2 = 0.;  ///< sum of squares of the times of the readings, from their mean
};
Slope slope_of(std::span<const ImuSample> imu) {
  Slope slope;
  double mean_s = 0.;
  for (const ImuSample& sample : imu) {
    mean_s += seconds_between(imu.front().t_ns, sample.t_ns) / static_cast<double>(imu.size());
  }
  for (const ImuSample& sample : imu) {
    const double t_s = seconds_between(imu.front().t_ns, sample.t_ns) - mean_s;
    slope.rate += t_s * to_vector(sample.gyro_rad_per_s);
    slope.spread_s2 += t_s * t_s;
  }
  if (slope.spread_s2 > 0.) slope.rate /= slope.spread_s2;
  return slope;
}

/// By the slope of the gyro, and by what the accelerometer measured between the clones.
Rate rate_of_imu(const Point& at, double duration_s, const FilterView& filter,
                 std::span<const ImuSample> imu) {
  wheel_motion::MovingPose first = at.first, last = at.last;
  const Slope slope = slope_of(imu);
  Rate rate;
  if (slope.spread_s2 > 0.) {
    const Eigen::Vector3d mean = 0.5 * (first.w_IinI + last.w_IinI);
    first.w_IinI = mean - 0.5 * duration_s * slope.rate;
    last.w_IinI = mean + 0.5 * duration_s * slope.rate;
    const double per_s =
        static_cast<double>(imu.size() - 1) / seconds_between(imu.front().t_ns, imu.back().t_ns);
    const double turn =
        square(filter.imu_noise.gyro_rad_per_s_sqrt_hz * duration_s) * per_s / slope.spread_s2;
    const double velocity = duration_s * square(filter.imu_noise.accel_m_per_s2_sqrt_hz);
    rate.variance << turn, variance_by_state(at, duration_s, filter);
    rate.variance.tail<2>().array() += velocity + at.mount.p_IinO.squaredNorm() * turn;
  }
  rate.g =
      wheel_motion::relative_pose_jacobian(first, last, at.mount).col(wheel_motion::kTimeOffset);
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
