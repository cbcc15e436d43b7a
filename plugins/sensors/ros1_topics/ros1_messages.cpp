#include "ros1_messages.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace viwo::ros1 {
namespace {

ros::Time time_of(std::int64_t t_ns) {
  ros::Time time;
  return time.fromNSec(static_cast<std::uint64_t>(t_ns));
}

template <class Message>
void set_xyz(Message& to, const std::array<double, 3>& from) {
  to.x = from[0];
  to.y = from[1];
  to.z = from[2];
}

template <class Message>
void set_quaternion(Message& to, const std::array<double, 4>& from_xyzw) {
  to.x = from_xyzw[0];
  to.y = from_xyzw[1];
  to.z = from_xyzw[2];
  to.w = from_xyzw[3];
}

}  // namespace

msg::Odometry odometry_message(const live::Odometry& odometry) {
  msg::Odometry message;
  message.header.stamp = time_of(odometry.pose.t_ns);
  message.header.frame_id = odometry.world;
  message.child_frame_id = odometry.body;
  set_xyz(message.pose.pose.position, odometry.pose.p_BinG_m);
  set_quaternion(message.pose.pose.orientation, odometry.pose.q_BtoG_xyzw);
  set_xyz(message.twist.twist.linear, odometry.v_BinB_m_per_s);
  set_xyz(message.twist.twist.angular, odometry.w_BinB_rad_per_s);
  std::ranges::copy(odometry.pose_covariance, message.pose.covariance.begin());
  std::ranges::copy(odometry.twist_covariance, message.twist.covariance.begin());
  return message;
}

msg::TFMessage tf_message(const live::Odometry& odometry) {
  msg::TransformStamped transform;
  transform.header.stamp = time_of(odometry.pose.t_ns);
  transform.header.frame_id = odometry.world;
  transform.child_frame_id = odometry.body;
  set_xyz(transform.transform.translation, odometry.pose.p_BinG_m);
  set_quaternion(transform.transform.rotation, odometry.pose.q_BtoG_xyzw);
  msg::TFMessage message;
  message.transforms.push_back(transform);
  return message;
}

msg::Path path_message(const live::Path& path, const std::string& world) {
  msg::Path message;
  message.header.frame_id = world;
  for (const live::Pose& pose : path.poses()) {
    msg::PoseStamped& stamped = message.poses.emplace_back();
    stamped.header.stamp = time_of(pose.t_ns);
    stamped.header.frame_id = world;
    set_xyz(stamped.pose.position, pose.p_BinG_m);
    set_quaternion(stamped.pose.orientation, pose.q_BtoG_xyzw);
    message.header.stamp = stamped.header.stamp;
  }
  return message;
}

msg::DiagnosticArray diagnostics_message(const live::Diagnostics& diagnostics) {
  msg::DiagnosticStatus status;
  status.name = live::Diagnostics::kName;
  status.hardware_id = live::Diagnostics::kHardware;
  status.level = diagnostics.fails   ? msg::DiagnosticStatus::ERROR
                 : diagnostics.warns ? msg::DiagnosticStatus::WARN
                                     : msg::DiagnosticStatus::OK;
  status.message = diagnostics.message;
  for (const auto& [key, value] : diagnostics.values) {
    msg::KeyValue& pair = status.values.emplace_back();
    pair.key = key;
    pair.value = value;
  }
  msg::DiagnosticArray message;
  message.header.stamp = time_of(diagnostics.t_ns);
  message.status.push_back(status);
  return message;
}

msg::JointState calibration_message(const EstimateSample& estimate) {
  msg::JointState message;
  message.header.stamp = time_of(estimate.t_ns);
  message.name.assign(estimate.calibration_names.begin(), estimate.calibration_names.end());
  message.position.assign(estimate.calibration.begin(), estimate.calibration.end());
  message.effort.assign(estimate.calibration_sigma.begin(), estimate.calibration_sigma.end());
  return message;
}

}  // namespace viwo::ros1
