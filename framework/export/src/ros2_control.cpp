// Parameters of the controllers of ros2_controllers. Joints are called as in the URDF.
#include <cmath>

#include "formats.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::exports {
namespace {

using config::Node;

Node joints(const std::vector<std::string>& names) {
  Node list = Node::list_of();
  for (const std::string& name : names) list.items().push_back(Node::scalar_of(name));
  return list;
}

Node differential(const Robot& robot, Lost& lost) {
  const Wheel &left = robot.wheels[0], &right = robot.wheels[1];
  const double mean = robot.mean_radius_m();
  Node params = Node::empty_map();
  params.set("left_wheel_names", joints({drive_joint(left)}));
  params.set("right_wheel_names", joints({drive_joint(right)}));
  params.set("wheel_separation", real_number(robot.track_m));
  params.set("wheel_separation_multiplier", real_number(1.));
  params.set("wheel_radius", real_number(mean));
  params.set("left_wheel_radius_multiplier", real_number(left.radius_m / mean));
  params.set("right_wheel_radius_multiplier", real_number(right.radius_m / mean));
  if (robot.base == Base::kSkidSteer) {
    lost.add("x_icr: the controller takes the base to turn about a point between its wheels");
    lost.add("the middle of y_icr_left and y_icr_right: base_link is there");
  }
  return params;
}

Node ackermann(const Robot& robot, Lost& lost) {
  const std::vector<Wheel> rear(robot.wheels.begin(), robot.wheels.begin() + 2);
  Node params = Node::empty_map();
  // The controller wants the right one first.
  params.set("traction_joints_names", joints({drive_joint(rear[1]), drive_joint(rear[0])}));
  params.set("steering_joints_names",
             joints({steer_joint(robot.wheels[3]), steer_joint(robot.wheels[2])}));
  params.set("wheelbase", real_number(robot.wheel_base_m));
  params.set("traction_track_width", real_number(robot.track_m));
  params.set("steering_track_width", real_number(robot.track_m));
  params.set("traction_wheels_radius", real_number(0.5 * (rear[0].radius_m + rear[1].radius_m)));
  lost.radii_but_the_mean(rear);
  lost.add("radii of the front wheels");
  if (robot.wheels[2].zero_rad != 0. || robot.wheels[3].zero_rad != 0.) {
    lost.add("zeros of the steering, delta_o_left and delta_o_right (the URDF has them)");
  }
  return params;
}

Node mecanum(const Robot& robot, Lost& lost) {
  constexpr const char* kCorners[] = {"front_left", "front_right", "rear_left", "rear_right"};
  const std::vector<Wheel> wheels = corners(robot);
  Node params = Node::empty_map();
  double sum = 0., most_deg = 0.;
  for (std::size_t i = 0; i < 4; ++i) {
    params.set(std::string(kCorners[i]) + "_wheel_command_joint_name",
               Node::scalar_of(drive_joint(wheels[i])));
    sum += std::abs(wheels[i].k_m);
    const double off = std::abs(std::atan(std::abs(wheels[i].tan_gamma)) - 0.25 * M_PI);
    most_deg = std::max(most_deg, off * 180. / M_PI);
  }
  Node kinematics = Node::empty_map();
  kinematics.set("wheels_radius", real_number(robot.mean_radius_m()));
  kinematics.set("sum_of_robot_center_projection_on_X_Y_axis", real_number(sum / 4.));
  params.set("kinematics", kinematics);
  lost.radii_but_the_mean(wheels);
  lost.add("one lever arm for all wheels, the mean of |k_1| .. |k_4|");
  lost.add("angles of the rollers: the controller takes 45 deg, they are up to " +
           significant(most_deg, 3) + " deg off");
  return params;
}

}  // namespace

Exported to_ros2_control(const Robot& robot) {
  Lost lost(robot);
  lost.all_but_geometry();
  if (const std::string names = robot.reversed_wheels(); !names.empty()) {
    lost.add("drive_signs: the drives of " + names +
             " turn backwards against the readings of the recording, which the hardware's side "
             "has to undo (the URDF has them)");
  }
  std::string controller = "diff_drive_controller", remark;
  Node params;
  if (robot.base == Base::kAckermann) {
    controller = "ackermann_steering_controller";
    params = ackermann(robot, lost);
    remark =
        "# Humble and Iron say rear_wheel_track and front_wheel_track for the two track widths, "
        "rear_wheels_radius\n# for traction_wheels_radius, rear_wheels_names and "
        "front_wheels_names for the joints.\n";
  } else if (robot.base == Base::kMecanum) {
    controller = "mecanum_drive_controller";
    params = mecanum(robot, lost);
  } else {
    params = differential(robot, lost);
  }
  Node parameters = Node::empty_map(), root = Node::empty_map();
  parameters.set("ros__parameters", params);
  root.set(controller, parameters);
  return {head(robot, lost.texts(), "# ") + remark + config::to_yaml(root), lost.texts()};
}

}  // namespace viwo::exports
