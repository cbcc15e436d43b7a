#include "viwo/camera/camera_chain.hpp"

#include <cmath>

namespace viwo {
namespace {

/// What another camera has of the error of the first.
Eigen::Matrix3d of_first(double relative, const Eigen::Matrix3d& R_ItoC0,
                         const Eigen::Matrix3d& R_ItoC) {
  const Eigen::Matrix3d R_C0toC = R_ItoC * R_ItoC0.transpose();
  return std::sqrt(1. - relative * relative) * R_C0toC;
}

}  // namespace

Eigen::Vector3d ChainedErrors::next(const Eigen::Matrix3d& R_ItoC, const Eigen::Vector3d& own) {
  if (!first_) {
    first_ = {R_ItoC, own};
    return own;
  }
  return of_first(relative_, first_->R_ItoC, R_ItoC) * first_->error + relative_ * own;
}

Eigen::MatrixXd chain_correlations(double relative, std::span<const CameraView> cameras) {
  const auto n = static_cast<Eigen::Index>(cameras.size());
  Eigen::MatrixXd correlations = Eigen::MatrixXd::Identity(6 * n, 6 * n);
  const auto share = [&](Eigen::Index k) -> Eigen::Matrix3d {
    if (k == 0) return Eigen::Matrix3d::Identity();
    return of_first(relative, cameras[0].R_ItoC, cameras[static_cast<std::size_t>(k)].R_ItoC);
  };
  for (Eigen::Index row = 0; row < n; ++row) {
    for (Eigen::Index col = 0; col < row; ++col) {
      const Eigen::Matrix3d block = share(row) * share(col).transpose();
      for (const Eigen::Index part : {0, 3}) {
        correlations.block<3, 3>(6 * row + part, 6 * col + part) = block;
        correlations.block<3, 3>(6 * col + part, 6 * row + part) = block.transpose();
      }
    }
  }
  return correlations;
}

}  // namespace viwo
