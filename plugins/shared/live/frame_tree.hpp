// Where frames of a robot are, by what it says of itself: /tf_static and its URDF.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "messages.hpp"

namespace viwo::live {

/// Where a frame A is in a frame B.
struct FramePose {
  Eigen::Matrix3d R_AtoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_AinB = Eigen::Vector3d::Zero();
};

/// Frames by the frame that each is fixed to. Names may begin with '/', as those of old had to.
class FrameTree {
 public:
  static constexpr std::size_t kMost = 1000;  ///< frames; no robot has so many

  /// Newer ones replace what was known of the child. Why it is of no use; "" when it was taken.
  std::string add(const bag::Transform& transform);
  /// The fixed joints of a robot's description (URDF). Likewise.
  std::string add_urdf(const std::string& xml);

  /// Where `a` is in `b`; nothing when nothing says so.
  std::optional<FramePose> find(const std::string& a, const std::string& b) const;
  std::vector<std::string> names() const;

 private:
  struct Fixed {
    std::string parent;
    FramePose pose;
  };
  bool is_full_for(const std::string& child) const;
  /// The frames from `name` to its root and where `name` is in each; none twice.
  std::vector<std::pair<std::string, FramePose>> up_from(const std::string& name) const;

  std::map<std::string, Fixed> fixed_;
};

/// R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Matrix3d rotation_of_rpy(const Eigen::Vector3d& rpy_rad);

}  // namespace viwo::live
