// The least-squares problem of a batch calibration: residuals and Jacobians of one recording.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Values of everything that is estimated: [x_WI (n), extrinsics (3)] shared by all recordings, and
/// the clock offset of one.
struct CalibrationPoint {
  Intrinsics x_WI;
  PlanarExtrinsics extrinsics = PlanarExtrinsics::Zero();
  double clock_offset_s = 0.;

  bool operator==(const CalibrationPoint&) const = default;
};

/// Residuals of one recording, whitened, with their derivatives by [x_WI, extrinsics, clock
/// offset].
struct RecordingResiduals {
  Eigen::VectorXd pose, parity;
  Eigen::MatrixXd J_pose, J_parity;
};

/// Cuts a recording into segments and compares each with the reference. Holds scratch memory: one
/// object per thread.
class RecordingProblem {
 public:
  /// Throws InputError when wheels and reference have too little time in common.
  RecordingProblem(const CalibrationRecording& recording, const CalibrationOptions& options);

  int n_segments() const { return static_cast<int>(reference_.size()); }
  int n_pose() const { return 3 * n_segments(); }
  int n_parity() const { return options_.parity ? n_ : 0; }

  /// Noise that whitens the residuals (CAL-3).
  void set_noise(const CalibrationNoise& noise) { noise_ = noise; }

  void evaluate(const CalibrationPoint& point, bool jacobian, RecordingResiduals& out);

 private:
  /// Motion of O over all segments with the reference shifted by clock_offset_s.
  void integrate(const CalibrationPoint& point, std::vector<PreintegratedPose>& segments);

  const CalibrationRecording& recording_;
  CalibrationOptions options_;
  int n_;  ///< intrinsics
  Preintegrator preintegrator_;
  std::vector<std::int64_t> stamps_ns_;     ///< segment ends, clock of the reference
  std::vector<Eigen::Vector3d> reference_;  ///< motion of B over each segment
  CalibrationNoise noise_;
  std::vector<PreintegratedPose> segments_, later_, earlier_;
  std::optional<CalibrationPoint> integrated_;  ///< where segments_ are
};

/// h = E (+) g (+) E^-1: motion of B for motion g of O, with E = [yaw, x, y] of O in B (CAL-2), and
/// its derivatives.
struct MotionOfBody {
  Eigen::Vector3d h;
  Eigen::Matrix3d by_g;
  Eigen::Matrix3d by_extrinsics;  ///< columns x, y, yaw
};
MotionOfBody motion_of_body(const Eigen::Vector3d& g, const PlanarExtrinsics& extrinsics);

}  // namespace viwo::calibration
