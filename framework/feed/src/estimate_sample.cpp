#include "viwo/feed/estimate_sample.hpp"

#include <Eigen/Geometry>

#include "viwo/setup/filter_setup.hpp"

namespace viwo {

EstimateSample estimate_sample(const Filter& filter, int piece,
                               const std::vector<std::string>& warnings) {
  const ImuState& imu = filter.imu();
  EstimateSample sample;
  sample.t_ns = filter.t_ns();
  const Eigen::Quaterniond q_ItoG(imu.R_GtoI.transpose());
  sample.q_ItoG_xyzw = {q_ItoG.x(), q_ItoG.y(), q_ItoG.z(), q_ItoG.w()};
  Eigen::Vector3d::Map(sample.p_IinG_m.data()) = imu.p_IinG;
  Eigen::Vector3d::Map(sample.v_IinG_m_per_s.data()) = imu.v_IinG;
  if (!filter.clones().empty()) {
    Eigen::Vector3d::Map(sample.w_IinI_rad_per_s.data()) = filter.clones().back().w_IinI;
  }
  Eigen::Map<Eigen::Matrix<double, 9, 9, Eigen::RowMajor>>(sample.covariance.data()) =
      filter.imu_covariance().topLeftCorner<9, 9>();
  sample.calibration_names = calibration_names(filter);
  for (const BlockEstimate& estimate : calibration_of(filter)) {
    sample.calibration.push_back(estimate.value);
    sample.calibration_sigma.push_back(estimate.sigma);
  }
  sample.piece = piece;
  sample.warnings = warnings;
  return sample;
}

}  // namespace viwo
