// The cameras as a camera chain of Kalibr; everything as a table.
#include <Eigen/Geometry>

#include "formats.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::exports {
namespace {

using config::Node;

template <class Numbers>
Node list(const Numbers& values) {
  Node out = Node::list_of();
  for (const double value : values) {
    out.items().push_back(real_number(value));
  }
  return out;
}

Eigen::Isometry3d T_cam_imu_of(const CameraView& camera) {
  Eigen::Isometry3d T_cam_imu = Eigen::Isometry3d::Identity();
  T_cam_imu.linear() = camera.R_ItoC;
  T_cam_imu.translation() = camera.p_IinC;
  return T_cam_imu;
}

Node matrix(const Eigen::Isometry3d& T) {
  Node rows = Node::list_of();
  for (int i = 0; i < 4; ++i) rows.items().push_back(list(T.matrix().row(i)));
  return rows;
}

/// `before`: the camera before it in the chain; null for the first.
Node camera_node(const CameraView& camera, std::size_t index, const CameraView* before) {
  const Eigen::Isometry3d T_cam_imu = T_cam_imu_of(camera);
  const bool is_radtan = camera.distortion == CameraDistortion::kRadtan;
  Node node = Node::empty_map();
  node.set("T_cam_imu", matrix(T_cam_imu));
  if (before != nullptr) node.set("T_cn_cnm1", matrix(T_cam_imu * T_cam_imu_of(*before).inverse()));
  node.set("cam_overlaps", Node::list_of());
  node.set("camera_model", Node::scalar_of("pinhole"));
  node.set("distortion_coeffs", list(camera.intrinsics.tail<4>()));
  node.set("distortion_model", Node::scalar_of(is_radtan ? "radtan" : "equidistant"));
  node.set("intrinsics", list(camera.intrinsics.head<4>()));
  if (camera.line_delay_s > 0.) {
    node.set("line_delay_nanoseconds", real_number(1e9 * camera.line_delay_s));
  }
  Node resolution = Node::list_of();
  for (const int pixels : {camera.width_px, camera.height_px}) {
    resolution.items().push_back(Node::scalar_of(std::to_string(pixels)));
  }
  node.set("resolution", resolution);
  node.set("rostopic", Node::scalar_of("/cam" + std::to_string(index) + "/image_raw"));
  node.set("timeshift_cam_imu", real_number(camera.t_CtoI_s));
  return node;
}

/// A text that may have separators.
std::string field(const std::string& text) {
  return text.find_first_of(",\"") == std::string::npos ? text : '"' + text + '"';
}

}  // namespace

Exported to_kalibr(const Robot& robot) {
  Lost lost(robot);
  lost.sigmas();
  const CalibrationFile& file = *robot.file;
  if (!file.intrinsics.empty()) lost.add("the wheels, their mount and clock");
  lost.add(
      "names of topics and overlaps of the cameras, which nothing tells: those here are made "
      "up");
  Node root = Node::empty_map();
  for (std::size_t i = 0; i < robot.cameras.size(); ++i) {
    root.set("cam" + std::to_string(i),
             camera_node(robot.cameras[i], i, i == 0 ? nullptr : &robot.cameras[i - 1]));
  }
  return {head(robot, lost.texts(), "# ") + config::to_yaml(root), lost.texts()};
}

Exported to_csv(const Robot& robot) {
  Lost lost(robot);
  lost.add("correlations");
  if (!robot.cameras.empty())
    lost.add("distortion models, resolutions and shutters of the cameras");
  std::string text = head(robot, lost.texts(), "# ") + "name,value,sigma,unit\n";
  const CalibrationFile& file = *robot.file;
  for (const auto* entries :
       {&file.intrinsics, &file.mount, &file.clock, &file.reference, &file.cameras}) {
    for (const CalibrationEntry& entry : *entries) {
      text += field(entry.name) + "," + number_text(entry.estimate) + "," +
              number_text(entry.sigma) + "," + field(entry.unit) + "\n";
    }
  }
  for (std::size_t i = 0; i < file.drive_signs.size(); ++i) {
    text +=
        "drive_sign_" + std::to_string(i + 1) + "," + std::to_string(file.drive_signs[i]) + ",0,\n";
  }
  return {text, lost.texts()};
}

}  // namespace viwo::exports
