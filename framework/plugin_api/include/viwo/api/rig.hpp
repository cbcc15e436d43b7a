// What the configuration says of cameras and wheel sets, and how updates declare their calibration:
// the one place where it is laid out.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/block.hpp"
#include "viwo/api/export.hpp"
#include "viwo/api/kinematic_model.hpp"

namespace viwo {

class Declarations;
struct FilterView;

inline constexpr int kPoseSize = 6;  ///< dtheta, dp

enum class CameraDistortion : std::uint8_t { kRadtan, kEquidistant };

/// Camera model and where the camera sits: p_C = R_ItoC p_I + p_IinC.
struct CameraView {
  CameraDistortion distortion = CameraDistortion::kRadtan;
  int width_px = 0;
  int height_px = 0;
  /// fx, fy, cx, cy [px], then the four distortion coefficients in the order of Kalibr.
  Eigen::Matrix<double, 8, 1> intrinsics = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix3d R_ItoC = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinC = Eigen::Vector3d::Zero();
  double t_CtoI_s = 0.;  ///< t_imu = t_camera + t_CtoI, of the first row
  /// From one row to the next one below; 0: a global shutter. Row v: t_imu = t_camera + t_CtoI +
  /// v * line_delay.
  double line_delay_s = 0.;

  /// From the first row to the one in the middle, and from there to row `v_px`.
  double middle_s() const { return 0.5 * line_delay_s * (height_px - 1); }
  double after_middle_s(double v_px) const { return v_px * line_delay_s - middle_s(); }
  /// What is to be added to a stamp for the time of the middle row, where the image stands for.
  double image_offset_s() const { return t_CtoI_s + middle_s(); }
};

/// A camera of the configuration with the prior of its calibration; zeros hold entries.
struct CameraPrior {
  CameraView camera;
  Eigen::Matrix<double, 6, 1> sigma_extrinsics = Eigen::Matrix<double, 6, 1>::Zero();  ///< rad, m
  Eigen::Matrix<double, 8, 1> sigma_intrinsics = Eigen::Matrix<double, 8, 1>::Zero();  ///< px, 1
  double sigma_clock_s = 0.;
  /// Triggered together with camera 0: their clocks differ by what the configuration says.
  bool shares_clock = true;
};

/// Where the calibration of a camera stands.
struct CameraBlocks {
  BlockId extrinsics;            ///< R_ItoC, p_IinC
  BlockId intrinsics;            ///< fx, fy, cx, cy, distortion
  BlockId clock;                 ///< t_CtoI of this camera or, if it shares its clock, of camera 0
  double clock_constant_s = 0.;  ///< what this camera's t_CtoI is more than the block's
  /// The same of the middle row: the StreamSpec::Clock of its images, whose clones are there.
  double middle_constant_s = 0.;

  /// `camera` with what is estimated.
  VIWO_API void read(const FilterView& filter, CameraView& camera) const;
};

/// Declares `cam<index>.extrinsics`, `cam<index>.intrinsics` and `cam<index>.clock`, for a camera
/// that shares it `cam0.clock`.
VIWO_API CameraBlocks declare_camera(Declarations& host, int index);

/// Extrinsics, intrinsics and clock of camera `index` as blocks of its own, in this order.
VIWO_API std::array<BlockSpec, 3> camera_blocks(std::size_t index, const CameraPrior& prior);

/// A wheel set: its kinematic model, and how its odometry frame O sits on the IMU.
struct WheelsView {
  const KinematicModel* model = nullptr;
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();
  double t_OtoI_s = 0.;        ///< t_imu = t_odom + t_OtoI
  Intrinsics x_WI;             ///< as they are now, what wanders included
  int extrinsics_column = -1;  ///< of dtheta of R_ItoO (same convention as R_GtoI); dp follows
  int time_offset_column = -1;
  /// Of x_WI[0]; the others follow. Entries held by the gauge have columns, with zero variance.
  int intrinsics_column = -1;
  /// Of what wanders: as many columns, with the same derivatives.
  int wander_column = -1;
  double wander_time_s = 0.;  ///< after which it is another

  /// Covariance of x_WI, of FilterView::P().
  VIWO_API IntrinsicMatrix
  covariance(const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& P) const;
};

/// A wheel set of the configuration with the prior of its calibration; all-zero sigmas hold a
/// block, single zeros hold an entry.
struct WheelsPrior {
  std::string name;    ///< in front of its parameters; "" for nothing
  std::string sensor;  ///< that gives its encoder samples; "" for the only one
  WheelsView wheels;
  Eigen::Matrix<double, 6, 1> sigma_extrinsics = Eigen::Matrix<double, 6, 1>::Zero();  ///< rad, m
  double sigma_time_offset_s = 0.;
  Intrinsics sigma_intrinsics;
  double intrinsics_walk = 0.;  ///< random walk of the intrinsics, in prior sigmas per sqrt(s)
  /// Gauss-Markov processes beside the constant intrinsics: play, slip, tyres. Empty: none.
  Intrinsics sigma_wander;
  double wander_time_s = 0.;
};

/// What an update can ask the configuration for.
class VIWO_API Rig {
 public:
  Rig() = default;
  Rig(std::vector<CameraPrior> cameras, std::optional<WheelsPrior> wheels)
      : cameras_(std::move(cameras)), wheels_(std::move(wheels)) {}

  std::span<const CameraPrior> cameras() const { return cameras_; }
  /// The wheel set that an instance is for: an update that asks has one instance for each wheel
  /// set. InputError when there is none.
  const WheelsPrior& wheels();
  bool was_asked_for_wheels() const { return was_asked_for_wheels_; }

 private:
  std::vector<CameraPrior> cameras_;
  std::optional<WheelsPrior> wheels_;
  bool was_asked_for_wheels_ = false;
};

/// Where the calibration of a wheel set stands.
struct WheelsBlocks {
  const KinematicModel* model = nullptr;
  BlockId extrinsics, clock, intrinsics;
  BlockId wander;  ///< index -1: none
  double wander_time_s = 0.;

  VIWO_API WheelsView view(const FilterView& filter) const;
};

/// Declares `extrinsics`, `clock`, `intrinsics` and, where they wander, `wander` of the wheel set
/// that an instance is for (Rig::wheels()), behind `wheels.` or `wheels.<name>.`
VIWO_API WheelsBlocks declare_wheels(Declarations& host);

/// The three blocks that declare_wheels() always declares, in this order.
VIWO_API std::array<BlockSpec, 3> wheels_blocks(const WheelsPrior& prior);

}  // namespace viwo
