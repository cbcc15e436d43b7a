#include "window.hpp"

#include <algorithm>

namespace viwo::visual {

void Window::start(int max_clones, int n_cameras) {
  const auto clones = static_cast<std::size_t>(max_clones);
  const auto cameras = static_cast<std::size_t>(n_cameras);
  clones_.reserve(clones);
  order_.reserve(clones);
  index_of_slot_.assign(clones, -1);
  cameras_.assign(cameras, {});
  poses_.assign(clones * cameras, {});
  const int columns = kPoseSize * max_clones + kCalibrationSize * n_cameras;
  covariance_.setZero(columns, columns);
}

void Window::set(const FilterView& filter) {
  filter_ = filter;
  has_covariance_ = false;
  const int n_slots = static_cast<int>(index_of_slot_.size());
  std::fill(index_of_slot_.begin(), index_of_slot_.end(), -1);
  order_.clear();
  for (int i = 0; i < static_cast<int>(filter.clones.size()); ++i) {
    const CloneView& clone = filter.clones[static_cast<std::size_t>(i)];
    if (clone.column < 0 || clone.slot < 0 || clone.slot >= n_slots) continue;
    int& index = index_of_slot_[static_cast<std::size_t>(clone.slot)];
    if (index >= 0) continue;
    index = i;
    order_.push_back(i);
  }
  std::sort(order_.begin(), order_.end(), [&](int a, int b) {
    return filter.clones[static_cast<std::size_t>(a)].column <
           filter.clones[static_cast<std::size_t>(b)].column;
  });
  clones_.clear();
  for (const int i : order_) {
    const CloneView& from = filter.clones[static_cast<std::size_t>(i)];
    index_of_slot_[static_cast<std::size_t>(from.slot)] = n_clones();
    WindowClone& clone = clones_.emplace_back();
    clone.slot = from.slot;
    clone.column = kPoseSize * (n_clones() - 1);
    clone.at_first_estimate = from.R_GtoI == from.R_GtoI_fej && from.p_IinG == from.p_IinG_fej;
    clone.R_GtoI_fej = from.R_GtoI_fej;
    clone.p_IinG_fej = from.p_IinG_fej;
  }
  add_columns();
  set_poses(filter);
}

void Window::add_columns() {
  columns_.clear();
  // Clones lie side by side in the error state, in any order: then they are one block.
  const auto column_of = [&](std::size_t i) {
    return filter_.clones[static_cast<std::size_t>(order_[i])].column;
  };
  for (std::size_t begin = 0; begin < order_.size();) {
    std::size_t end = begin + 1;
    while (end < order_.size() && column_of(end) == column_of(end - 1) + kPoseSize) ++end;
    columns_.add(column_of(begin), kPoseSize * static_cast<int>(end - begin));
    begin = end;
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    WindowCamera& camera = cameras_[i];
    camera = {};
    if (i >= filter_.cameras.size()) continue;
    camera.view = &filter_.cameras[i];
    const int first = clone_columns();
    if (camera.view->extrinsics_column >= 0) {
      camera.extrinsics = columns_.add(camera.view->extrinsics_column, kPoseSize) - first;
    }
    if (camera.view->intrinsics_column >= 0) {
      camera.intrinsics = columns_.add(camera.view->intrinsics_column, 8) - first;
    }
  }
}

void Window::set_poses(const FilterView& filter) {
  for (int i = 0; i < n_clones(); ++i) {
    const CloneView& clone =
        filter.clones[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
    for (int j = 0; j < n_cameras(); ++j) {
      const CameraView* camera = cameras_[static_cast<std::size_t>(j)].view;
      if (camera == nullptr) continue;
      CameraPose& pose = poses_[static_cast<std::size_t>(i * n_cameras() + j)];
      const Eigen::Vector3d p_CinI = -camera->R_ItoC.transpose() * camera->p_IinC;
      pose.R_GtoC = camera->R_ItoC * clone.R_GtoI;
      pose.p_CinG = clone.p_IinG + clone.R_GtoI.transpose() * p_CinI;
      pose.R_GtoC_fej = camera->R_ItoC * clone.R_GtoI_fej;
      pose.p_CinG_fej = clone.p_IinG_fej + clone.R_GtoI_fej.transpose() * p_CinI;
    }
  }
}

const Eigen::MatrixXd& Window::covariance() {
  if (has_covariance_) return covariance_;
  has_covariance_ = true;
  const FilterView::Covariance P = filter_.P();
  int row = 0;
  for (const ColumnRange& a : columns_.blocks()) {
    int column = 0;
    for (const ColumnRange& b : columns_.blocks()) {
      if (column > row) break;
      auto block = covariance_.block(row, column, a.count, b.count);
      if (a.first == b.first) {
        block = P.block(a.first, a.first, a.count, a.count).selfadjointView<Eigen::Lower>();
      } else if (a.first > b.first) {
        block = P.block(a.first, b.first, a.count, b.count);
      } else {
        block = P.block(b.first, a.first, b.count, a.count).transpose();
      }
      if (a.first != b.first) {
        covariance_.block(column, row, b.count, a.count) = block.transpose();
      }
      column += b.count;
    }
    row += a.count;
  }
  return covariance_;
}

}  // namespace viwo::visual
