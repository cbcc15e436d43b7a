#include "viwo/filter/health.hpp"

namespace viwo {

std::string failure_of(const Filter& filter) {
  if (filter.covariance_failed()) {
    return "the covariance of the clones is not positive definite any more";
  }
  const ImuView& imu = filter.imu();
  const Eigen::MatrixXd& P = filter.covariance();
  const bool finite = imu.R_GtoI.allFinite() && imu.p_IinG.allFinite() && imu.v_IinG.allFinite() &&
                      imu.gyro_bias.allFinite() && imu.accel_bias.allFinite() &&
                      P.diagonal().allFinite();
  if (!finite) return "the estimate or its covariance is not finite any more";
  if ((P.diagonal().array() < 0.).any()) return "a variance is negative";
  const std::string block = filter.blocks().not_finite();
  return block.empty() ? "" : "the block '" + block + "' is not finite any more";
}

}  // namespace viwo
