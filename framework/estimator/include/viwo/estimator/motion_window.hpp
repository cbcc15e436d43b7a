// How a base moved in the last few seconds: which kinds of motion that hide calibration it was.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace viwo {

/// Motions from which some of a calibration cannot be learned. Several can be true at once.
enum class Degeneracy {
  kStandstill,
  kNoYawRate,
  kConstantSteering,  ///< turning, with the direction of the twist constant
  kSteadyVelocity,    ///< the twist itself constant
  kFlatGround,        ///< turning about one axis only
};
inline constexpr std::size_t kDegeneracies = 5;

/// Sums of the motion of O in bins of a ring. Nothing is allocated after construction.
class MotionWindow {
 public:
  explicit MotionWindow(std::size_t bins) : bins_(bins) {}

  /// Velocity and rate of O, in O: m/s, rad/s; `sigma_w`: white noise of each axis of the rate.
  void add(const Eigen::Vector3d& v_OinO, const Eigen::Vector3d& w_OinO, double sigma_w);
  /// Begins the next bin; the oldest one is forgotten.
  void next_bin();
  /// Whether the motion of all bins together was degenerate in each of the ways.
  std::array<bool, kDegeneracies> classify() const;
  /// Which part of the roll and pitch rates is motion and not noise, 0 to 1 (F-21).
  double tilt_signal() const;

 private:
  /// Sums over the samples; the twist is [v_x, v_y, w_z].
  struct Sums {
    double n = 0.;
    Eigen::Vector3d twist = Eigen::Vector3d::Zero();
    Eigen::Matrix3d twist_twist = Eigen::Matrix3d::Zero();
    Eigen::Vector2d tilt_rate = Eigen::Vector2d::Zero();
    double tilt_rate2 = 0.;   ///< w_x^2 + w_y^2
    double tilt_noise2 = 0.;  ///< of this, what is noise
    /// Scatter of the tilt rates about their mean: a constant one is an error of the bias.
    double tilt_scatter2() const { return tilt_rate2 / n - (tilt_rate / n).squaredNorm(); }
  };
  Sums sum() const;

  std::vector<Sums> bins_;
  std::size_t bin_ = 0;
};

}  // namespace viwo
