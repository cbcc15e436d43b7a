// The clones and cameras of one epoch as the visual update needs them: poses of all cameras in
// arrays, columns of the factor, and the part of the covariance that belongs to them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/update.hpp"

namespace viwo::visual {

/// Most clones: one bit each in a track's masks.
inline constexpr int kMaxWindowClones = 64;
/// Extrinsics and intrinsics of a camera.
inline constexpr int kCalibrationSize = kPoseSize + 8;

struct WindowClone {
  int slot = 0;
  int column = 0;                 ///< in the factor
  bool at_first_estimate = true;  ///< first estimate and estimate are the same
  Eigen::Matrix3d R_GtoI_fej;
  Eigen::Vector3d p_IinG_fej;
};

/// A camera at the time of a clone.
struct CameraPose {
  Eigen::Matrix3d R_GtoC, R_GtoC_fej;
  Eigen::Vector3d p_CinG, p_CinG_fej;
};

struct WindowCamera {
  const CameraView* view = nullptr;
  int extrinsics = -1;  ///< first column among the calibration columns, -1: held
  int intrinsics = -1;
};

class Window {
 public:
  /// Allocates.
  void start(int max_clones, int n_cameras);

  /// Takes over clones and cameras; `filter` must outlive the use. Clones that have no column, or
  /// whose slot is out of range or taken, are left out.
  void set(const FilterView& filter);

  /// Factor columns: all clones, in the order of the error state, then the calibration.
  const FactorColumns& columns() const { return columns_; }
  int size() const { return columns_.size(); }
  int clone_columns() const { return kPoseSize * n_clones(); }
  int calibration_columns() const { return size() - clone_columns(); }

  /// In the order of their columns.
  const WindowClone& clone(int index) const { return clones_[static_cast<std::size_t>(index)]; }
  int n_clones() const { return static_cast<int>(clones_.size()); }
  /// -1: no clone there.
  int clone_in_slot(int slot) const { return index_of_slot_[static_cast<std::size_t>(slot)]; }
  const WindowCamera& camera(int index) const { return cameras_[static_cast<std::size_t>(index)]; }
  int n_cameras() const { return static_cast<int>(cameras_.size()); }
  const CameraPose& pose(int clone, int camera) const {
    return poses_[static_cast<std::size_t>(clone * n_cameras() + camera)];
  }

  /// Covariance of the factor's columns, all of it, in their order. Copied at the first call after
  /// set(); of the filter's covariance only the lower triangle is read.
  const Eigen::MatrixXd& covariance();

 private:
  void add_columns();
  void set_poses(const FilterView& filter);

  FilterView filter_;
  std::vector<WindowClone> clones_;
  std::vector<int> order_;  ///< of filter_.clones by column
  std::vector<int> index_of_slot_;
  std::vector<WindowCamera> cameras_;
  std::vector<CameraPose> poses_;
  FactorColumns columns_;
  Eigen::MatrixXd covariance_;
  bool has_covariance_ = false;
};

}  // namespace viwo::visual
