#include "local_frame.hpp"

namespace viwo::gnss {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Eigen::Matrix3d covariance_of(const GnssSample& fix, const FixNoise& noise) {
  const double scale = noise.scale * noise.scale;
  if (!fix.has_covariance()) {
    return scale * noise.sigma_m * noise.sigma_m * Eigen::Matrix3d::Identity();
  }
  const Eigen::Map<const RowMajor3> given(fix.covariance_ENU_m2.data());
  return 0.5 * scale * (given + given.transpose());
}

LocalFix LocalFrame::at(const GnssSample& fix, const FixNoise& noise) {
  LocalFix local;
  Eigen::Vector3d& p = local.p_AinE;
  // (GN-1)
  frame_.Forward(fix.latitude_deg, fix.longitude_deg, fix.altitude_m, p.x(), p.y(), p.z(),
                 ENU_to_E_);
  const Eigen::Map<const RowMajor3> M(ENU_to_E_.data());
  local.R = M * covariance_of(fix, noise) * M.transpose();
  return local;
}

}  // namespace viwo::gnss
