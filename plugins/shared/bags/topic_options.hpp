// Which topics are wanted, and what is on them: of a bag as of a running system.
#pragma once

#include <string>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/api/sample.hpp"
#include "viwo/log/joints.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo::bag {

struct TopicOptions : log::JointParams, log::MaxGapParams {
  std::string imu_topic;
  std::vector<std::string> image_topics;
  std::string joint_topic;
  std::vector<std::string> drive_joints;
  std::vector<std::string> steer_joints;
  enum class Drive { kVelocity, kPosition };
  Drive drive_input = Drive::kVelocity;
  std::string pose_topic;
  std::string odometry_topic;
  std::string gnss_topic;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(imu_topic), {.help = "sensor_msgs/Imu; empty, here and below: not wanted"});
    b(VIWO_PARAM(image_topics),
      {.help = "sensor_msgs/Image or CompressedImage, in the order of the cameras"});
    b(VIWO_PARAM(joint_topic),
      {.help =
           "sensor_msgs/JointState of the wheels; or nav_msgs/Odometry, whose twist is taken as "
           "joints v_x, v_y and omega_z, for the kinematic model body_twist"});
    b(VIWO_PARAM(drive_joints), {.help = "joints that drive, in the order of the wheels"});
    b(VIWO_PARAM(steer_joints), {.help = "joints that steer, in the order of the wheels"});
    b(VIWO_PARAM(drive_input), {{"velocity", Drive::kVelocity}, {"position", Drive::kPosition}},
      {.help = "drive rates from velocities, or from differences of positions"});
    log::JointParams::bind(b);
    b(VIWO_PARAM(pose_topic), {.help = "geometry_msgs/PoseStamped or PoseWithCovarianceStamped"});
    b(VIWO_PARAM(odometry_topic), {.help = "nav_msgs/Odometry, whose poses are taken"});
    b(VIWO_PARAM(gnss_topic), {.help = "sensor_msgs/NavSatFix"});
    log::MaxGapParams::bind(b);
  }

  bool drive_is_angle() const { return drive_input == Drive::kPosition; }
  /// Of the joints that are wanted; ParamError when they do not fit.
  log::JointMap joint_map() const;
  /// ParamError for parameters that contradict each other; where no topic is wanted, for `key`:
  /// "nothing to <verb>".
  void check(const std::string& key, const std::string& verb) const;
  void require_each_once() const;
};

/// The kinds of samples that the topics give.
SampleTypes kinds_of(const TopicOptions& topics);

}  // namespace viwo::bag
