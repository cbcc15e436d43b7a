// The least-squares problem of a batch calibration: residuals and Jacobians of one recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Values of everything that is estimated: [x_WI (n), extrinsics (3)] shared by all recordings, and
/// what each recording has of its own.
struct CalibrationPoint {
  Intrinsics x_WI;
  PlanarExtrinsics extrinsics = PlanarExtrinsics::Zero();
  double clock_offset_s = 0.;
  double gyro_bias_rad_per_s = 0.;

  bool operator==(const CalibrationPoint&) const = default;
};

/// What a residual is of; those of one kind have one noise (CAL-5), that of what was measured by
/// hand is known.
enum class ResidualKind { kYaw, kPosition, kParity, kDistance, kTurn };
inline constexpr std::size_t kResidualKinds = 5;

/// Residuals of one recording, whitened, with their derivatives by [x_WI, extrinsics, clock
/// offset, gyro bias].
struct RecordingResiduals {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
};

/// Cuts a recording into segments and compares each with the reference. Holds scratch memory: one
/// object per thread.
class RecordingProblem {
 public:
  /// `options.segments` is not kAuto. Throws InputError when wheels and reference have too little
  /// time in common.
  RecordingProblem(const CalibrationRecording& recording, const CalibrationOptions& options);

  int n_segments() const { return static_cast<int>(segments_.size()); }
  int n_unknowns() const { return n_ + 5; }
  /// A kind for each residual.
  const std::vector<ResidualKind>& kinds() const { return kinds_; }
  double duration_s() const { return seconds_between(stamps_ns_.front(), stamps_ns_.back()); }
  /// Residuals that compare one segment with the reference; they come first, segment by segment.
  int rows_per_segment() const {
    if (motions_.empty()) return 0;
    return recording_.motion.kind == ReferenceKind::kPoses ? 3 : 1;
  }
  /// Gradient of the parity cost by the intrinsics, of each piece of about a second or less, where
  /// it was evaluated last.
  const std::vector<Intrinsics>& parity_gradients() const { return parity_gradients_; }

  /// Motion of the reference over each segment, [yaw, x, y].
  const std::vector<Eigen::Vector3d>& motions() const { return motions_; }
  /// Adds the turns of the segments where they were evaluated last, each since the one before, a
  /// gyro's without `gyro_bias_rad_per_s`.
  void add_turns(double gyro_bias_rad_per_s, TurnAgreement& out) const;

  /// Noise that whitens the residuals (CAL-3).
  void set_noise(const CalibrationNoise& noise) { noise_ = noise; }
  /// Whether the motion over a segment is known: wheels and gyro have no hole in it.
  bool is_compared(std::size_t segment) const { return weights_[segment] > 0.; }
  int n_with_holes() const;
  /// Weighs down the segments that fit no normal noise where they were evaluated last (CAL-15).
  void weigh_segments();
  /// Segments that count for less than one.
  int n_weighed_down() const;
  /// Where the weights of the wheels' rows are taken.
  void weigh_rows_at(const Intrinsics& x_WI) {
    preintegrator_.set_intrinsics(x_WI);
    integrated_.reset();
  }

  void evaluate(const CalibrationPoint& point, bool jacobian, RecordingResiduals& out);

 private:
  /// All segments begin at the first one's.
  bool from_start() const { return options_.segments == Segments::kTrajectory; }
  /// Of a segment, in stamps_ns_.
  std::size_t begin_of(std::size_t segment) const { return from_start() ? 0 : segment; }
  void cut(std::int64_t begin_ns, std::int64_t end_ns);
  void move_to_poses(std::int64_t begin_ns, std::int64_t end_ns);
  void compare_with_reference();
  void leave_out_holes();
  std::optional<Eigen::Vector3d> reference_at(std::int64_t t_ns) const;
  /// Motion of O over all segments with the reference shifted by clock_offset_s.
  void integrate(const CalibrationPoint& point);
  /// Of it by the clock offset, where it was integrated.
  void differentiate_by_clock(const CalibrationPoint& point);
  void add_segment(int row, std::size_t k, const CalibrationPoint& point, bool jacobian,
                   RecordingResiduals& out);
  void add_parity(int row, RecordingResiduals& out) const;
  void add_measured_by_hand(int row, const CalibrationPoint& point, RecordingResiduals& out);

  const CalibrationRecording& recording_;
  CalibrationOptions options_;
  int n_;  ///< intrinsics
  Preintegrator preintegrator_;
  std::vector<double> yaw_;               ///< of the poses of the reference, turns counted
  std::vector<std::int64_t> stamps_ns_;   ///< segment ends, clock of the wheels
  std::vector<Eigen::Vector3d> motions_;  ///< of B over each segment; empty without a reference
  /// Of each segment: whitened squares, and their weight; 0 where it is not compared.
  std::vector<double> squares_, weights_;
  std::vector<ResidualKind> kinds_;
  CalibrationNoise noise_;
  std::vector<PreintegratedPose> segments_;
  std::vector<Eigen::Vector3d> by_clock_;  ///< derivative of the motion of each segment, 1/s
  ParityInformation parity_;               ///< of all segments
  std::vector<Intrinsics> parity_gradients_;
  PreintegratedPose piece_;
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
