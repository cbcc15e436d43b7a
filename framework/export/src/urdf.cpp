// Links and joints of wheels, IMU and cameras.
#include <cmath>

#include "formats.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/rpy.hpp"

namespace viwo::exports {
namespace {

std::string triple(const Eigen::Vector3d& v) {
  return number_text(v[0]) + " " + number_text(v[1]) + " " + number_text(v[2]);
}

std::string joint(const std::string& name, const char* type, const std::string& parent,
                  const std::string& child, const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy,
                  const char* axis) {
  std::string text = "  <joint name=\"" + name + "\" type=\"" + type + "\">\n    <parent link=\"" +
                     parent + "\"/>\n    <child link=\"" + child + "\"/>\n    <origin xyz=\"" +
                     triple(xyz) + "\" rpy=\"" + triple(rpy) + "\"/>\n";
  if (axis[0] != '\0') text += std::string("    <axis xyz=\"") + axis + "\"/>\n";
  return text + "  </joint>\n";
}

std::string empty_link(const std::string& name) { return "  <link name=\"" + name + "\"/>\n"; }

std::string wheel_link(const std::string& name, double radius_m) {
  // A cylinder stands along z.
  const std::string shape = "      <origin xyz=\"0 0 0\" rpy=\"" + number_text(M_PI_2) +
                            " 0 0\"/>\n      <geometry><cylinder radius=\"" +
                            number_text(radius_m) + "\" length=\"" + number_text(0.5 * radius_m) +
                            "\"/></geometry>\n";
  return "  <link name=\"" + name + "\">\n    <visual>\n" + shape +
         "    </visual>\n    <collision>\n" + shape + "    </collision>\n  </link>\n";
}

std::string wheel_text(const Wheel& wheel) {
  const Eigen::Vector3d hub(wheel.x_m, wheel.y_m, wheel.radius_m);
  const std::string rim = "wheel_" + wheel.name + "_link";
  const std::string fork = "steer_" + wheel.name + "_link";
  std::string text;
  if (wheel.steers) {
    // At the reading zero_rad the wheel points straight ahead.
    text += empty_link(fork) + joint(steer_joint(wheel), "continuous", "base_link", fork, hub,
                                     {0., 0., 0. - wheel.zero_rad}, "0 0 1");
  }
  return text + wheel_link(rim, wheel.radius_m) +
         joint(drive_joint(wheel), "continuous", wheel.steers ? fork : "base_link", rim,
               wheel.steers ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : hub,
               Eigen::Vector3d::Zero(), wheel.reversed ? "0 -1 0" : "0 1 0");
}

std::string camera_text(std::size_t index, const CameraView& camera) {
  const std::string frame = "cam" + std::to_string(index) + "_optical_frame";
  const Eigen::Matrix3d R_CtoI = camera.R_ItoC.transpose();
  return empty_link(frame) + joint("cam" + std::to_string(index) + "_joint", "fixed", "imu_link",
                                   frame, -(R_CtoI * camera.p_IinC), rpy_of_rotation(R_CtoI), "");
}

/// What must not stand in a comment of XML.
std::string without_dashes(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--")) {
    text.replace(at, 2, "- -");
  }
  return text;
}

std::vector<std::string> lost_in_urdf(const Robot& robot) {
  Lost lost(robot);
  lost.sigmas();
  lost.clocks();
  lost.beside();
  if (!robot.cameras.empty()) lost.add("intrinsics and distortion of the cameras (format kalibr)");
  if (!robot.mount) lost.add("the mount of the IMU, which this calibration does not have");
  if (!robot.mount && !robot.cameras.empty()) lost.add("the places of the cameras, likewise");
  lost.add("the width of the wheels, which nothing tells: half of the radius is written");
  if (robot.base == Base::kSkidSteer) {
    lost.add(
        "the places of the wheels: those here are the centres of rotation of the sides, with "
        "effective radii, and move the base as it moves");
  }
  return lost.texts();
}

}  // namespace

Exported to_urdf(const Robot& robot) {
  const std::vector<std::string> lost = lost_in_urdf(robot);
  std::string text = "<?xml version=\"1.0\"?>\n<!--\n" + without_dashes(head(robot, lost, "")) +
                     "base_link is O: x forward, y left, z up, on the ground. Joints have the "
                     "position that\ntheir encoders read: zeros of the steering are in their "
                     "origins, drives that turn backwards in\ntheir axes.\n-->\n<robot name=\"" +
                     robot.file->model + "\">\n" + empty_link("base_link");
  for (const Wheel& wheel : robot.wheels) text += wheel_text(wheel);
  if (robot.mount) {
    text += empty_link("imu_link") + joint("imu_joint", "fixed", "base_link", "imu_link",
                                           robot.mount->p_IinO,
                                           rpy_of_rotation(robot.mount->R_ItoO), "");
    for (std::size_t i = 0; i < robot.cameras.size(); ++i) {
      text += camera_text(i, robot.cameras[i]);
    }
  }
  return {text + "</robot>\n", lost};
}

}  // namespace viwo::exports
