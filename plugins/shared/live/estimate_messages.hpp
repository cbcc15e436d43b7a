// The estimate as messages of ROS, before either ROS has made them its own.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/rejections.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::live {

/// Frames of the messages, and where the IMU sits on the body whose pose is published.
struct OutputFrames {
  std::string world = "odom";
  std::string body = "imu";
  Eigen::Matrix3d R_ItoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinB = Eigen::Vector3d::Zero();
};

/// Pose of B in G.
struct Pose {
  std::int64_t t_ns = 0;
  std::array<double, 3> p_BinG_m{};
  std::array<double, 4> q_BtoG_xyzw{0., 0., 0., 1.};
};

/// What nav_msgs/Odometry has.
struct Odometry {
  Pose pose;
  std::string world, body;
  std::array<double, 3> v_BinB_m_per_s{};
  std::array<double, 3> w_BinB_rad_per_s{};
  std::array<double, 36> pose_covariance{};   ///< row after row, as ROS has it
  std::array<double, 36> twist_covariance{};  ///< likewise
};

/// Pose of B in G, twist of B in B, and their covariances as ROS has them: position before
/// rotation, rotations about the axes of G. `sigma_rate_rad_per_s`: of each axis of the angular
/// rate.
Odometry odometry_of(const EstimateSample& estimate, const OutputFrames& frames,
                     double sigma_rate_rad_per_s);

/// What the estimate does not tell of how things are going.
struct Health {
  std::vector<std::string> silent_topics;
  std::string trouble;  ///< of the sensor itself; empty: none
  /// What was counted so far: messages that could not be used, gaps. Negative: nobody counts.
  std::int64_t rejected = 0;
  double warn_latency_s = 0.25;  ///< more than this is worth a warning
};

/// What a diagnostic_msgs/DiagnosticStatus has.
struct Diagnostics {
  static constexpr const char* kName = "viwo: odometry";
  static constexpr const char* kHardware = "viwo";
  std::int64_t t_ns = 0;
  bool warns = false;
  /// There is no estimate where there was one, or none that can be used; or the run has failed.
  bool fails = false;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values;
};

/// Latency, calibration with its sigmas, and a warning when something is off.
Diagnostics diagnostics_of(const EstimateSample& estimate, const Health& health);

/// While there is no estimate, for `lost_s` where there was one: a warning before the first one and
/// an error afterwards, that say so, and what may be the cause. `rejected`: what was dropped so
/// far.
Diagnostics diagnostics_without_estimate(std::int64_t t_ns, std::optional<std::int64_t> lost_s,
                                         const Health& health,
                                         const std::vector<RejectionCount>& rejected);

/// The way so far, as far as it is shown: a pose each half second, the last kMost of them, of the
/// present piece of the run.
class Path {
 public:
  static constexpr std::size_t kMost = 2000;
  static constexpr double kPeriodS = 0.5;

  /// Whether the pose was taken: then the path is to be published again.
  bool add(const Pose& pose, int piece);
  const std::vector<Pose>& poses() const { return poses_; }

 private:
  std::vector<Pose> poses_;
  int piece_ = 0;
};

}  // namespace viwo::live
