#include "viwo/filter/health.hpp"

#include <cstdio>
#include <string>

namespace viwo {
namespace {

std::string beyond(const char* what, double value, double limit, const char* unit) {
  char text[160];
  std::snprintf(text, sizeof text, "%s is %.3g %s, more than %.3g", what, value, unit, limit);
  return text;
}

}  // namespace

std::string failure_of(const Filter& filter, const HealthLimits& limits) {
  if (filter.covariance_failed()) {
    return "the covariance of the clones is not positive definite any more";
  }
  const ImuState& imu = filter.imu();
  const Eigen::MatrixXd& P = filter.covariance();
  const bool finite = imu.R_GtoI.allFinite() && imu.p_IinG.allFinite() && imu.v_IinG.allFinite() &&
                      imu.gyro_bias.allFinite() && imu.accel_bias.allFinite() &&
                      P.diagonal().allFinite();
  if (!finite) return "the estimate or its covariance is not finite any more";
  if ((P.diagonal().array() < 0.).any()) return "a variance is negative";
  const std::string block = filter.blocks().not_finite();
  if (!block.empty()) return "the block '" + block + "' is not finite any more";
  const double speed = imu.v_IinG.norm(), gyro = imu.gyro_bias.norm(),
               accel = imu.accel_bias.norm();
  if (speed > limits.max_speed_m_per_s) {
    return beyond("the speed", speed, limits.max_speed_m_per_s,
                  "m/s (estimator.max_speed_m_per_s)");
  }
  if (gyro > limits.max_gyro_bias_rad_per_s) {
    return beyond("the gyro bias", gyro, limits.max_gyro_bias_rad_per_s, "rad/s");
  }
  if (accel > limits.max_accel_bias_m_per_s2) {
    return beyond("the accelerometer bias", accel, limits.max_accel_bias_m_per_s2, "m/s^2");
  }
  return "";
}

}  // namespace viwo
