#include "viwo/camera/camera_chain.hpp"

#include <cmath>

namespace viwo {
namespace {

/// What a camera has of the error of the first.
Eigen::Matrix3d of_first(double relative, std::span<const CameraView> cameras, std::size_t index) {
  if (index == 0) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d R_C0toC = cameras[index].R_ItoC * cameras[0].R_ItoC.transpose();
  return std::sqrt(1. - relative * relative) * R_C0toC;
}

}  // namespace

Eigen::Vector3d chained_error(double relative, std::span<const CameraView> cameras,
                              std::size_t index, const Eigen::Vector3d& first,
                              const Eigen::Vector3d& own) {
  if (index == 0) return first;
  return of_first(relative, cameras, index) * first + relative * own;
}

Eigen::MatrixXd chain_correlations(double relative, std::span<const CameraView> cameras) {
  const auto n = static_cast<Eigen::Index>(cameras.size());
  Eigen::MatrixXd correlations = Eigen::MatrixXd::Identity(6 * n, 6 * n);
  for (Eigen::Index row = 0; row < n; ++row) {
    for (Eigen::Index col = 0; col < row; ++col) {
      const Eigen::Matrix3d block =
          of_first(relative, cameras, static_cast<std::size_t>(row)) *
          of_first(relative, cameras, static_cast<std::size_t>(col)).transpose();
      for (const Eigen::Index part : {0, 3}) {
        correlations.block<3, 3>(6 * row + part, 6 * col + part) = block;
        correlations.block<3, 3>(6 * col + part, 6 * row + part) = block.transpose();
      }
    }
  }
  return correlations;
}

}  // namespace viwo
