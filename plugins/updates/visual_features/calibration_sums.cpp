#include "calibration_sums.hpp"

#include <algorithm>

namespace viwo::visual {

void CalibrationSums::start(int max_clones, int n_cameras) {
  cameras_.resize(static_cast<std::size_t>(n_cameras));
  for (Camera& camera : cameras_) camera.EX.resize(static_cast<std::size_t>(max_clones));
}

void CalibrationSums::begin(const Window& window) {
  for (int j = 0; j < window.n_cameras(); ++j) {
    if (!window.camera(j).calibrates()) continue;
    Camera& sums = cameras_[static_cast<std::size_t>(j)];
    sums.EE.setZero();
    for (int i = 0; i < window.n_clones(); ++i) sums.EX[static_cast<std::size_t>(i)].setZero();
  }
}

void CalibrationSums::add(const Feature& feature, const Window& window,
                          Eigen::Ref<Eigen::MatrixXd> A_xf) {
  for (Camera& camera : cameras_) camera.seen = false;
  for (const LinearSight& row : feature.linear()) {
    if (!window.camera(row.camera).calibrates()) continue;
    Camera& sums = cameras_[static_cast<std::size_t>(row.camera)];
    if (!sums.seen) sums.EF.setZero();
    sums.seen = true;
    const CalibrationRows& E = row.calibration;
    sums.EE.noalias() += E.lazyProduct(E.transpose());
    sums.EX[static_cast<std::size_t>(row.clone)].noalias() += E.lazyProduct(row.H_x);
    sums.EF.noalias() += E.lazyProduct(row.H_f);
  }
  for (int j = 0; j < window.n_cameras(); ++j) {
    const Camera& sums = cameras_[static_cast<std::size_t>(j)];
    if (!sums.seen) continue;
    for (int i = 0; i < kCalibrationSize; ++i) {
      const int column = window.camera(j).column[static_cast<std::size_t>(i)];
      if (column >= 0) A_xf.row(column) += sums.EF.row(i);
    }
  }
}

void CalibrationSums::finish(const Window& window, InformationFactor& factor) const {
  for (int j = 0; j < window.n_cameras(); ++j) {
    const WindowCamera& camera = window.camera(j);
    if (!camera.calibrates()) continue;
    const Camera& sums = cameras_[static_cast<std::size_t>(j)];
    for (int i = 0; i < kCalibrationSize; ++i) {
      const int row = camera.column[static_cast<std::size_t>(i)];
      if (row < 0) continue;
      factor.eta[row] += sums.EE(i, kCalibrationSize);
      for (int k = 0; k <= i; ++k) {
        const int column = camera.column[static_cast<std::size_t>(k)];
        if (column < 0) continue;
        factor.Lambda(std::max(row, column), std::min(row, column)) += sums.EE(i, k);
      }
      for (int k = 0; k < window.n_clones(); ++k) {
        factor.Lambda.block<1, kPoseSize>(row, window.clone(k).column) +=
            sums.EX[static_cast<std::size_t>(k)].row(i);
      }
    }
  }
}

}  // namespace viwo::visual
