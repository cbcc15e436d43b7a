#include "live_params.hpp"

#include <set>
#include <string>

#include "frame_tree.hpp"
#include "viwo/api/status.hpp"
#include "viwo/math/rpy.hpp"

namespace viwo::live {

void LiveParams::bind(ParamBinder& b) {
  bag::TopicOptions::bind(b);
  b(VIWO_PARAM(idle_timeout_s),
    {.unit = "s",
     .min = 0.,
     .max = 1e6,
     .help = "the run ends when nothing has come for this long; 0: it goes on"});
  b(VIWO_PARAM(max_waiting_images),
    {.min = 2.,
     .max = 10000.,
     .help = "images that are held until they are taken; then the oldest are dropped"});
  b(VIWO_PARAM(publish),
    {.help = "whether the estimate is published: odometry, path, tf, calibration and diagnostics"});
  b(VIWO_PARAM(odometry_topic_out), {.help = "nav_msgs/Odometry"});
  b(VIWO_PARAM(path_topic_out),
    {.help = "nav_msgs/Path: the way so far, a pose each half second; empty: not published"});
  b(VIWO_PARAM(calibration_topic_out),
    {.help = "sensor_msgs/JointState: name, value (position) and sigma (effort) of each parameter "
             "that is calibrated; empty: not published"});
  b(VIWO_PARAM(publish_tf), {.help = "whether the pose is on /tf, too"});
  b(VIWO_PARAM(world_frame), {.help = "frame of the poses"});
  b(VIWO_PARAM(body_frame), {.help = "frame whose pose is published"});
  b(VIWO_PARAM(imu_frame),
    {.help = "frame of the IMU: where it sits on body_frame is then what /tf_static and the "
             "robot's description say, instead of p_IinB_m and rpy_ItoB_rad"});
  b(VIWO_PARAM(wheel_frame),
    {.help = "frame O of the wheels, as base_link: where the imu_frame is in it is said, as it is "
             "written into the section wheels, and compared with the estimate"});
  b(VIWO_PARAM(camera_frames),
    {.help = "optical frames of the cameras, in the order of image_topics: likewise"});
  b(VIWO_PARAM(description_topic),
    {.help = "the robot's description (URDF): std_msgs/String of ROS 2, parameter of ROS 1; empty: "
             "/tf_static alone is asked"});
  b(VIWO_PARAM(p_IinB_m), {.unit = "m", .help = "origin of the IMU in body_frame"});
  b(VIWO_PARAM(rpy_ItoB_rad),
    {.unit = "rad", .help = "roll, pitch, yaw of the IMU in body_frame, R_ItoB = Rz Ry Rx"});
  b(VIWO_PARAM(sigma_rate_rad_per_s),
    {.unit = "rad/s", .min = 0., .help = "of the angular rate in the published twist"});
  b(VIWO_PARAM(warn_latency_s),
    {.unit = "s",
     .min = 0.,
     .help = "a longer time from image to pose is a warning in the diagnostics"});
}

OutputFrames LiveParams::frames() const {
  OutputFrames frames;
  frames.world = plain_name(world_frame);  // tf2 knows no other names
  frames.body = plain_name(body_frame);
  if (frames.world.empty()) throw ParamError("world_frame", "a frame needs a name");
  if (frames.body.empty()) throw ParamError("body_frame", "a frame needs a name");
  if (frames.world == frames.body) {
    throw ParamError("body_frame", "'" + frames.body + "' is the world_frame, too");
  }
  if (!imu_frame.empty() && !(p_IinB_m.isZero(0.) && rpy_ItoB_rad.isZero(0.))) {
    throw ParamError("imu_frame",
                     "p_IinB_m and rpy_ItoB_rad say where '" + imu_frame + "' sits: give either");
  }
  if (imu_frame.empty() && !wheel_frame.empty()) {
    throw ParamError("wheel_frame", "needs imu_frame: where that is in it is asked for");
  }
  if (imu_frame.empty() && !camera_frames.empty()) {
    throw ParamError("camera_frames", "needs imu_frame: where that is in them is asked for");
  }
  if (camera_frames.size() > image_topics.size()) {
    throw ParamError("camera_frames", "more of them than image_topics");
  }
  frames.R_ItoB = rotation_of_rpy(rpy_ItoB_rad);
  frames.p_IinB = p_IinB_m;
  return frames;
}

const LiveParams& LiveParams::checked(std::string (*why_no_name)(const std::string& topic)) const {
  check("imu_topic", "listen to");
  const auto check_name = [&](const std::string& key, const std::string& topic) {
    if (const std::string why = why_no_name(topic); !why.empty()) {
      throw ParamError(key, "'" + topic + "' cannot be the name of a topic: " + why);
    }
  };
  std::set<std::string> seen;
  const auto check_once = [&](const std::string& key, const std::string& topic) {
    if (topic.empty() || seen.insert(plain_name(topic)).second) return;
    throw ParamError(key, "'" + topic + "' is wanted twice");
  };
  const auto check_topic = [&](const std::string& key, const std::string& topic) {
    if (!topic.empty()) check_name(key, topic);
    check_once(key, topic);
  };
  check_topic("imu_topic", imu_topic);
  for (const std::string& topic : image_topics) check_topic("image_topics", topic);
  check_topic("joint_topic", joint_topic);
  check_topic("pose_topic", pose_topic);
  check_topic("odometry_topic", odometry_topic);
  check_topic("gnss_topic", gnss_topic);
  check_name("odometry_topic_out", odometry_topic_out);
  if (!path_topic_out.empty()) check_name("path_topic_out", path_topic_out);
  if (!calibration_topic_out.empty()) check_name("calibration_topic_out", calibration_topic_out);
  if (publish) {
    if (publish_tf) seen.insert("tf");
    seen.insert("diagnostics");
    check_once("odometry_topic_out", odometry_topic_out);
    check_once("path_topic_out", path_topic_out);
    check_once("calibration_topic_out", calibration_topic_out);
  }
  if (!description_topic.empty()) check_name("description_topic", description_topic);
  return *this;
}

}  // namespace viwo::live
