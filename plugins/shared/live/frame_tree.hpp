// Where frames of a robot are, by what it says of itself: /tf_static and its URDF.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
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

  /// Takes what the other has, too.
  void merge(const FrameTree& other);

  /// Where `a` is in `b`; nothing when no fixed frames join them.
  std::optional<FramePose> find(const std::string& a, const std::string& b) const;
  std::vector<std::string> names() const;

 private:
  struct Fixed {
    std::string parent;
    FramePose pose;
    bool is_of_urdf = false;
  };
  std::string put(const std::string& child, const Fixed& fixed);
  /// The frames from `name` to its root and where `name` is in each; none twice.
  std::vector<std::pair<std::string, FramePose>> up_from(const std::string& name) const;

  std::map<std::string, Fixed> fixed_;
};

/// Without the '/' that it may begin with.
std::string plain_name(std::string_view name);

}  // namespace viwo::live
