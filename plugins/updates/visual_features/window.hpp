// The clones and cameras of one epoch as the visual update needs them: poses of all cameras in
// arrays, columns of the factor, and the part of the covariance that belongs to them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/rig.hpp"
#include "viwo/api/update.hpp"

namespace viwo::visual {

/// Most clones: one bit each in a track's masks.
inline constexpr int kMaxWindowClones = 64;
/// Errors of a camera's calibration, in this order: extrinsics, intrinsics, clock.
inline constexpr int kIntrinsicsEntry = kPoseSize;
inline constexpr int kClockEntry = kPoseSize + 8;
inline constexpr int kCalibrationSize = kClockEntry + 1;

/// What a turn of the world about the vertical does to dtheta, dp of a clone: at the first
/// estimate, for all of the filter (VF-25). And to a point.
using WorldTurn = Eigen::Matrix<double, kPoseSize, 1>;
WorldTurn world_turn_of(const CloneState& clone);
inline Eigen::Vector3d world_turn_of_point(const Eigen::Vector3d& p_FinG) {
  return Eigen::Vector3d::UnitZ().cross(p_FinG);
}
/// Takes what rows see of the turn off their columns of the orientation of a clone.
template <class Rows, class Seen>
void make_blind(Rows&& by_pose, const Seen& seen, const WorldTurn& turn) {
  by_pose.template leftCols<3>() -= seen * turn.head<3>().transpose();
}

struct WindowClone {
  std::int64_t t_ns = 0;
  int slot = 0;
  int column = 0;  ///< in the factor
  Eigen::Matrix3d R_GtoI;
  Eigen::Vector3d p_IinG;
  Eigen::Vector3d w_IinI, v_IinG;  ///< then, with what its epoch measured
  Eigen::Vector3d p_IinG_fej;
  WorldTurn world_turn;
};

/// A camera at the time of its image that belongs to a clone, or of one row of it.
struct CameraPose {
  Eigen::Matrix3d R_GtoC;
  Eigen::Vector3d p_CinG;
  Eigen::Vector3d p_IinG;  ///< of the IMU at that time
};

/// A camera as configured, with its calibration as estimated: Jacobians are taken there, too.
struct WindowCamera {
  CameraView view;
  std::array<int, kCalibrationSize> column{};  ///< of each error in the factor; -1: held
  bool has_extrinsics = false, has_intrinsics = false, has_clock = false;  ///< any column
  bool calibrates() const { return has_extrinsics || has_intrinsics || has_clock; }
};

class Window {
 public:
  /// Allocates. `cameras` and `blocks`, of equal size: what was declared.
  void start(int max_clones, std::span<const CameraPrior> cameras,
             std::span<const CameraBlocks> blocks);

  /// Takes over clones and cameras; `filter` must outlive the use. Clones that have no column, or
  /// whose slot is out of range or taken, are left out.
  void set(const FilterView& filter);
  /// Slot of the clone of an image: the nearest one within kSameInstantNs, which remembers the
  /// stamp. Nothing when there is none, or it has an image of that camera with another stamp.
  std::optional<int> take_image(int camera, std::int64_t stamp_ns);
  /// Poses of all cameras, after the last image.
  void set_poses();

  /// Factor columns: all clones, in the order of the error state, then what is estimated of the
  /// calibration.
  const FactorColumns& columns() const { return columns_; }
  int size() const { return columns_.size(); }
  int clone_columns() const { return kPoseSize * n_clones(); }
  int calibration_columns() const { return size() - clone_columns(); }
  /// Column of the error state that a factor column is.
  int state_column(int factor_column) const {
    return state_columns_[static_cast<std::size_t>(factor_column)];
  }

  /// In the order of their columns.
  const WindowClone& clone(int index) const { return clones_[static_cast<std::size_t>(index)]; }
  int n_clones() const { return static_cast<int>(clones_.size()); }
  /// -1: no clone there.
  int clone_in_slot(int slot) const { return index_of_slot_[static_cast<std::size_t>(slot)]; }
  const WindowCamera& camera(int index) const { return cameras_[static_cast<std::size_t>(index)]; }
  int n_cameras() const { return static_cast<int>(cameras_.size()); }
  /// When row `v_px` was exposed. `own` is where that of a rolling shutter is made.
  const CameraPose& pose(int clone, int camera, double v_px, CameraPose& own) const {
    const CameraView& view = this->camera(camera).view;
    if (view.line_delay_s == 0.) return poses_[image_index(clone, camera)];
    own = make_pose(clone, camera, seconds_to_image(clone, camera) + view.after_middle_s(v_px));
    return own;
  }

  const FilterView& filter() const { return filter_; }
  /// How well it is known where a clone is from the newest one: variance of a coordinate there,
  /// m^2.
  double way_variance(int clone);
  /// Whether the way over the window is known to a tenth: else all points that are told by it are
  /// off together.
  bool knows_way();
  /// Covariance of the factor's columns, all of it, in their order. Copied at the first call after
  /// set(); of the filter's covariance only the lower triangle is read.
  const Eigen::MatrixXd& covariance();

 private:
  struct ImageStamp {
    std::int64_t clone_ns = -1;  ///< of the clone that it belongs to
    std::int64_t stamp_ns = 0;
  };

  std::size_t image_index(int clone_or_slot, int camera) const {
    return static_cast<std::size_t>(clone_or_slot * n_cameras() + camera);
  }
  void set_clones();
  void set_cameras();
  void set_columns();
  void set_way_variances();
  /// Time from a clone to the middle row of an image of it.
  double seconds_to_image(int clone, int camera) const;
  CameraPose make_pose(int clone, int camera, double dt_s) const;

  FilterView filter_;
  std::vector<CameraBlocks> blocks_;
  std::vector<WindowClone> clones_;
  std::vector<int> order_;  ///< of filter_.clones by column
  std::vector<int> index_of_slot_;
  std::vector<WindowCamera> cameras_;
  std::vector<ImageStamp> stamps_;  ///< by slot and camera
  std::vector<CameraPose> poses_;
  FactorColumns columns_;
  std::vector<int> state_columns_;
  std::vector<double> way_variance_;  ///< of each clone; empty: not worked out yet
  bool knows_way_ = false;            ///< worked out with them
  Eigen::MatrixXd covariance_;
  bool has_covariance_ = false;
};

}  // namespace viwo::visual
